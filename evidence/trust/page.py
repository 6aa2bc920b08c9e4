"""Write `reports/trust/README.md` and its figure from the tables that the campaigns keep beside it."""

from collections import defaultdict
from collections.abc import Callable, Iterable

import matplotlib as mpl
import matplotlib.pyplot as plt
from right import EXAMPLES_STRANGERS, SEED, SEEDS, SLOW, UNSTATED, is_pair
from tables import FOLDER, SURVIVES, UNKNOWN, commits_of, count_old, markdown, read
from zoo.right import STRANGERS as ALL_STRANGERS

PAGE, FIGURE = "README.md", "kills.svg"
_TABLES = (
    "campaign.csv",
    "strangers.csv",
    "options.csv",
    "kills.csv",
    "unseen.csv",
    "smallest_cases.csv",
    "smallest_errors.csv",
    "curved_damage.csv",
    "faces.csv",
    "face_kills.csv",
)
CAMPAIGN_FILE = "campaign.csv"
AT_LIMIT = "hard.touch"  # All springs of a slave that touches have together exactly the stiffness that is allowed.
COUNTS = ("cases", "accusations", "undecided", "idle")

INTRODUCTION = """# Trust

A verifier must catch what is wrong, and never accuse what is right. `tox -e trust` measures both and wrote this page
from the tables beside it: {commits}.

Each line of these tables keeps a digest of the properties that judged it (`judge`). {older} `tox -e trust` asks such
lines anew, and no others. `evidence/trust/bugs_campaign.py` writes `bugs.csv`; the formulations of `unseen.csv` were
not kept, so that its lines stay.

"""
CAMPAIGN = """## Nobody who is right is accused

{cases:,} random cases over {formulations} formulations that are right, with seeds {seeds}: {accusations} accusations.
An accusation is a failure of what a formulation promises, a crash, or a breach of the contract. *Nearest* is the
largest number over its tolerance in a case that passes, and the formulation that came so near.
In *idle* cases nothing is in contact. The campaign has random cases alone: no scene with a name, such as those of the
paper, and no finite list, such as those of `hard.*` and `accuracy.*`. These are the same for every seed, and the tests
ask them.

"""
STRANGERS = """## Right formulations of strangers

{formulations} formulations are written from papers and textbooks, and share no code with the plugins. Each was asked
every property that makes sense for it: {examples} random cases of each with seeds {seeds}, or 5/12 as many where bodies
are solved, and all named cases. Where it states nothing of a property that solves bodies, which can then accuse it of a
crash or a breach of the contract alone, one in {part} of these. {cases:,} cases, {accusations} accusations.{rest}
*Nearest* is as above.

"""
OPTIONS = """## Every option of every formulation

{formulations} names of built-in formulations, each option with each of its words or numbers and {pairs} pairs of them,
were asked every property: {cases:,} cases, random ones with seed {seed} and all named ones. Options and words are read
from the factories themselves. {accusations} An accusation is a promise that is broken, a statement to fail that is not
true, a crash, or a breach of the contract. Pairs of options are not asked about long lists of scenes ({slow}). The
table has the formulations by name, and how many of their variants were asked. *Not judged* counts the rows in which too
few cases touch or are decided, and names the properties.

"""
KILLS = """## Who catches whom

{mutants} formulations are wrong on purpose, and each is caught. A bar of the figure is how many of them a property
catches; the dark part is caught by it alone.
{survivors}

![How many wrong formulations each property catches](kills.svg)

*Meant* counts the wrong formulations that a property is meant to catch, *catches* those that it catches, and *alone*
those that no other property catches. *Least shared* names, where that is none, a wrong formulation that few
others catch, and who they are. Properties that are not meant to catch one get 20 random cases, or one where bodies are
solved or a list is finite. Slow ones are asked only where at most one other property catches it.

"""
FACES = """## In space

Six formulations on faces were asked every property that has cases in space: {cases:,} cases, {accusations} of them
accusations, {undecided} undecided. *Nearest* is as above, but for `hard.touch`, whose number is its limit for whoever
is right. {mutants} formulations on faces are wrong on purpose. Each is caught by the property that is meant to: {first}
by its first case, and all by its case {last} at the latest. {alone} are caught by that property alone.

"""
UNSEEN = """## Wrong formulations that nobody here had seen

Somebody who had not read the properties wrote {count} wrong formulations, as people get them wrong: rows of
multipliers, a store with too small a key, the first call of a process, a gap of exactly zero, slaves that are steep,
0.3 % in rare places. `contactverif verify NAME --seed 1` names {found} of them wrong, and {without} where they report
no contact points. On one core beside other work the first broken promise came after {median} seconds (median), and in
nine of ten after {late}. `unseen.csv` says which property found each. Two need a state that is a tie to the last bit,
and half a stiffness is an element of the generalised derivative there. Not found:

"""
SMALLEST = """## How small an error is caught

An error of a kind and a relative size was planted in a formulation that is right. The table has the smallest size, a
power of ten down to 1e-15, that each property caught. Where a cell is empty, the property does not look at that.

"""

DAMAGE = """## How small a damage is caught off the flat

The same with the sizes 1, 2 and 5 of each decade, for properties whose interface is bent or whose pressure varies. A
cell says what was caught before these questions came closer, and today. The forces of a right formulation are scaled,
turned, scaled on the master alone, handed on along the slave as if its points lay farther by a share of a segment, or
lost where the slave ends; the rings of `patch.curved` are whole today, and have no ends. All cases of a property were
asked, and no contact points were reported. A rate of `accuracy.hertz` caught springs that were 5e-3 too stiff, and none
that were too soft; it accused a right formulation.

"""

SMALL = """## How small the counterexamples are

A run shrinks what a wrong formulation fails on. Of {mutants} that were asked, {single} fail on one segment a side. The
table has the others that were also asked before cases were drawn without hypothesis' engine: slave and master segments,
and the bits of the coordinate that needs most. {smaller} became smaller, {same} stayed, and {larger} became larger. One
seed was asked; another one gives other cases.

"""

Row = dict[str, str]


def number(rows: Iterable[Row], name: str) -> int:
    """Return the sum of a column."""
    return sum(int(row[name]) for row in rows)


def group(rows: Iterable[Row], key: Callable[[Row], str]) -> dict[str, list[Row]]:
    """Return {key: rows}, in the order in which keys appear."""
    groups = defaultdict[str, list[Row]](list)
    for row in rows:
        groups[key(row)].append(row)
    return groups


def second_part(column: str) -> Callable[[Row], str]:
    """Return the function of a row that is what stands behind the slash in a column."""
    return lambda row: row[column].partition("/")[2]


def nearest(rows: Iterable[Row]) -> Row:
    """Return the row with the largest number over its tolerance."""
    return max(rows, key=lambda row: float(row["nearest"]))


def code(word: str) -> str:
    return f"`{word}`" if word else ""


def campaign_counts() -> dict[str, dict[str, int]]:
    """Return {property: {count: number}} over all seeds."""
    groups = group(read(CAMPAIGN_FILE), second_part("seed/property"))
    return {name: {count: number(rows, count) for count in COUNTS} for name, rows in groups.items()}


def is_kill(cell: str) -> bool:
    """Return whether a cell of the kill matrix says that the property catches the mutant."""
    return cell not in ("", UNKNOWN)


def kill_rows() -> tuple[list[str], list[Row], list[Row]]:
    """Return the ids of the properties, the rows of the mutants that are caught, and those of the survivors."""
    rows = read("kills.csv")
    ids = [name for name in rows[0] if name not in ("mutant", "caught by")]
    survivors = [row for row in rows if row["mutant"].startswith(SURVIVES)]
    return ids, [row for row in rows if row not in survivors], survivors


def catchers(row: Row, ids: list[str]) -> list[str]:
    """Return the properties that catch the mutant of a row."""
    return [name for name in ids if is_kill(row[name])]


def caught_alone() -> dict[str, list[str]]:
    """Return {property: the mutants that no other property catches}."""
    ids, rows, _ = kill_rows()
    return {name: [row["mutant"] for row in rows if catchers(row, ids) == [name]] for name in ids}


def campaign() -> str:
    """Return the part about formulations that are right."""
    rows, counts = read(CAMPAIGN_FILE), campaign_counts()
    text = CAMPAIGN.format(
        cases=number(rows, "cases"),
        formulations=max(int(row["formulations"]) for row in rows),
        seeds=" and ".join(dict.fromkeys(row["seed/property"].partition("/")[0] for row in rows)),
        accusations=number(rows, "accusations") or "no",
    )
    lines = []
    for name, members in group(rows, second_part("seed/property")).items():
        count = counts[name]
        margin, by = max([(0.0, ""), *((float(row["nearest"]), row["formulation"]) for row in members)])
        shares = [f"{count[share] / count['cases']:.1%}" for share in ("undecided", "idle")]
        lines.append([code(name), str(count["cases"]), str(count["accusations"]), *shares, f"{margin:.2g}", code(by)])
    return text + markdown(["property", "cases", "accused", "undecided", "idle", "nearest", "by"], lines)


def strangers() -> str:
    """Return the part about right formulations of strangers."""
    rows = read("strangers.csv")
    lines = []
    for name, members in group(rows, second_part("seed/formulation")).items():
        closest = nearest(members)
        counts = [str(number(members, count)) for count in COUNTS]
        lines.append([name, *counts, closest["nearest"], code(closest["property"])])
    missing = len(SEEDS) * len(ALL_STRANGERS) - len(rows)
    text = STRANGERS.format(
        formulations=len(ALL_STRANGERS),
        seeds=", ".join(map(str, SEEDS)),
        examples=EXAMPLES_STRANGERS,
        part=UNSTATED,
        cases=number(rows, "cases"),
        accusations=number(rows, "accusations"),
        rest=f" {missing} of the campaign's lines have not run yet." if missing else "",
    )
    return text + markdown(["formulation", "cases", "accused", "undecided", "idle", "nearest", "in"], lines)


def base_name(row: Row) -> str:
    """Return a formulation's name without its options; what a wrapper wraps is left out, too."""
    outer, slash, _ = row["formulation"].partition("/")
    return outer.partition(":")[0] + slash


def options() -> str:
    """Return the part about options."""
    rows = read("options.csv")
    accused = "; ".join(f"`{row['formulation']}`, {row['accused']}" for row in rows if row["accused"])
    text = OPTIONS.format(
        formulations=len(rows),
        pairs=sum(is_pair(row["formulation"]) for row in rows),
        cases=number(rows, "cases"),
        seed=SEED,
        accusations=f"There are {number(rows, 'accusations')} accusations: {accused}."
        if accused
        else "Nobody was accused.",
        slow=", ".join(map(code, SLOW)),
    )
    lines = []
    for name, members in group(rows, base_name).items():
        heads = [text.partition(":")[0] for row in members for text in row["not judged"].split("; ")]
        open_rows = [head for head in heads if head and " " not in head]  # Else it is a part of a reason.
        counts = [number(members, count) for count in ("cases", "accusations", "undecided")]
        cells = [*map(str, (len(members), *counts, len(open_rows))), ", ".join(map(code, dict.fromkeys(open_rows)))]
        lines.append([f"`{name}{'…' if name.endswith('/') else ''}`", *cells])
    return text + markdown(["formulation", "variants", "cases", "accused", "undecided", "not judged", "in"], lines)


def kills() -> str:
    """Return the part about formulations that are wrong."""
    ids, rows, survivors = kill_rows()
    alone, lines = caught_alone(), []
    for name in ids:
        caught = [row for row in rows if is_kill(row[name])]
        shared = ""
        if not alone[name]:
            row = min(caught, key=lambda row: len(catchers(row, ids)))
            others = [other for other in catchers(row, ids) if other != name]
            rest = f" and {len(others) - 3} more" if len(others) > 3 else ""
            shared = f"{row['mutant']}: {', '.join(map(code, others[:3]))}{rest}"
        counts = (sum(row["caught by"] == name for row in rows), len(caught), len(alone[name]))
        lines.append([code(name), *map(str, counts), shared])
    missing = "; ".join(
        f"*{row['mutant'].removeprefix(SURVIVES)}* (missing: `{row['caught by']}`)" for row in survivors
    )
    text = KILLS.format(mutants=len(rows), survivors=f"No property catches {len(survivors)} more: {missing}.")
    return text + markdown(["property", "meant", "catches", "alone", "least shared"], lines)


def on_faces() -> str:
    """Return the part about formulations on faces, nothing before the campaign has run."""
    rows, mutants = read("faces.csv"), read("face_kills.csv")
    if not (rows and mutants):
        return ""
    lines = []
    for name, members in group(rows, lambda row: row["formulation/property"].partition("/")[0]).items():
        closest = nearest(row for row in members if not row["formulation/property"].endswith(f"/{AT_LIMIT}"))
        counts = [f"{number(members, count):,}" for count in COUNTS]
        lines.append([code(name), *counts, closest["nearest"], code(second_part("formulation/property")(closest))])
    cases = sorted(int(row["first case"]) for row in mutants)
    text = FACES.format(
        **{count: number(rows, count) for count in COUNTS[:3]},
        mutants=len(mutants),
        first=cases.count(1),
        last=cases[-1],
        alone=sum(not row["also"] for row in mutants),
    )
    return text + markdown(["formulation", "cases", "accused", "undecided", "idle", "nearest", "in"], lines)


def unseen() -> str:
    """Return the part about wrong formulations that were written by somebody who had not seen the properties."""
    rows = read("unseen.csv")
    seconds = sorted(int(row[head]) for row in rows for head in ("seconds", "seconds without") if row[head])
    text = UNSEEN.format(
        count=len(rows),
        found=sum(bool(row["found by"]) for row in rows),
        without=sum(bool(row["without contact points"]) for row in rows),
        median=seconds[len(seconds) // 2],
        late=seconds[9 * len(seconds) // 10],
    )
    missed = [row["fault"] for row in rows if not (row["found by"] and row["without contact points"])]
    return text + "".join(f"- {fault}\n" for fault in missed)


def smallest() -> str:
    """Return the part about the sizes of errors."""
    rows = read("smallest_errors.csv")
    kinds = [name for name in rows[0] if name not in ("property", "carrier")]
    lines = [
        [code(row["property"]), *(f"1e-{row[kind]}" if row[kind] else "" for kind in kinds)]
        for row in rows
        if any(row[kind] for kind in kinds)
    ]
    return SMALLEST + '<div class="wide" markdown>\n\n' + markdown(["property", *kinds], lines) + "\n</div>\n"


def damage() -> str:
    """Return the part about the sizes of damages off the flat, before and today."""
    before = {row["property"]: row for row in read("curved_damage_before.csv")}
    today = read("curved_damage.csv")
    kinds = [name for name in today[0] if name not in ("property", "carrier")]
    lines = [
        [
            code(row["property"]),
            code(row["carrier"]),
            *(f"{old[kind] or 'none'} → {row[kind] or 'none'}" for kind in kinds),
        ]
        for row in today
        if (old := before.get(row["property"]))
    ]
    return DAMAGE + markdown(["property", "carried by", *kinds], lines)


def size_of(row: Row) -> tuple[int, int]:
    """Return the segments of both sides and the bits of a row of `smallest_cases.csv`."""
    slave, master, bits = map(int, row["seed 0"].split())
    return slave + master, bits


def small_cases() -> str:
    """Return the part about the sizes of counterexamples."""
    today = {row["mutant"]: row for row in read("smallest_cases.csv")}
    before = {row["mutant"]: row for row in read("smallest_cases_before.csv") if row["mutant"] in today}
    changes = [(size_of(today[name]), size_of(row)) for name, row in before.items()]
    text = SMALL.format(
        mutants=len(today),
        single=sum(size_of(row)[0] == 2 for row in today.values()),
        smaller=sum(new < old for new, old in changes),
        same=sum(new == old for new, old in changes),
        larger=sum(new > old for new, old in changes),
    )
    lines = [[name, code(row["caught by"]), row["seed 0"], today[name]["seed 0"]] for name, row in before.items()]
    return text + markdown(["wrong formulation", "caught by", "before", "today"], lines)


def older() -> str:
    """Return the sentence about lines of an older judge."""
    counts = {name: count for name, count in count_old().items() if count[0]}
    listed = ", ".join(
        f"{'all' if old == every else old} of the {every} in `{name}`" for name, (old, every) in counts.items()
    )
    return (
        f"The properties were changed since they judged {listed}." if counts else "All are of the properties of today."
    )


def page() -> str:
    """Return the whole page."""
    parts = [campaign(), strangers(), options(), kills(), on_faces(), unseen(), small_cases(), smallest(), damage()]
    return INTRODUCTION.format(commits=commits_of(_TABLES), older=older()) + "\n".join(filter(None, parts))


def draw() -> None:
    """Draw how many wrong formulations each property catches, and how many of them it alone."""
    ids, rows, _ = kill_rows()
    alone, caught = caught_alone(), {name: sum(is_kill(row[name]) for row in rows) for name in ids}
    order = sorted(ids, key=lambda name: (caught[name], len(alone[name])))
    mpl.rcParams.update({"svg.hashsalt": "contactverif", "svg.fonttype": "none", "font.size": 9})
    figure, axes = plt.subplots(figsize=(3.7, 0.18 * len(ids) + 1), layout="constrained")  # As wide as a phone.
    axes.barh(order, [caught[name] for name in order], color="#9ecae1", label="others catch it too")
    axes.barh(order, [len(alone[name]) for name in order], color="#08519c", label="caught by it alone")
    axes.set(xlabel=f"of {len(rows)} wrong formulations", ylim=(-0.6, len(ids) - 0.4))
    axes.tick_params(axis="y", length=0)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(loc="lower right", frameon=False)
    figure.savefig(FOLDER / FIGURE, metadata={"Date": None})


if __name__ == "__main__":
    (FOLDER / PAGE).write_text(page(), encoding="utf-8")
    draw()
