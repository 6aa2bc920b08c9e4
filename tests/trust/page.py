"""Write `reports/trust/README.md` and its figure from the tables that the studies of this folder keep beside it."""

from collections import defaultdict

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from face_page import FILES, faces
from option_names import is_pair
from options import SEED, SLOW
from stranger_cases import EXAMPLES, SEEDS, UNSTATED
from strangers import STRANGERS as ALL_STRANGERS
from tables import COMMITS, FOLDER, SURVIVES, UNKNOWN, read

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
    *FILES,
)
COUNTS = ("cases", "accusations", "undecided", "idle")

INTRODUCTION = """# Trust

A verifier must catch what is wrong, and never accuse what is right. `tox -e trust` measures both and wrote this page
from the tables beside it: {commits}.

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

{mutants} formulations are wrong on purpose, and each is caught. A row of the figure is one of them, a column a
property: dark where the property is the one that is meant to catch it, light where it does so too.
{survivors}

![Wrong formulations against properties](kills.svg)

*Meant* counts the wrong formulations that a property is meant to catch, *catches* those that it catches, and *alone*
those that no other property catches. *Least shared* names, where that is none, a wrong formulation that few
others catch, and who they are. Properties that are not meant to catch one get 20 random cases, or one where bodies are
solved or a list is finite. Slow ones are asked only where at most one other property catches it.

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


def table(heads: list[str], rows: list[list[str]]) -> str:
    """Return a table in Markdown, its first column to the left."""
    lines = [f"| {' | '.join(heads)} |", f"|---|{'--:|' * (len(heads) - 1)}"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"


def campaign_counts() -> dict[str, dict[str, int]]:
    """Return {property: {count: number}} over all seeds."""
    counts: dict[str, dict[str, int]] = defaultdict(lambda: dict.fromkeys(COUNTS, 0))
    for row in read("campaign.csv"):
        for name in COUNTS:
            counts[row["seed/property"].partition("/")[2]][name] += int(row[name])
    return dict(counts)


def nearest_margins() -> dict[str, tuple[float, str]]:
    """Return {property: (largest number over its tolerance in a case that passes, its formulation)}."""
    margins: dict[str, tuple[float, str]] = {}
    for row in read("campaign.csv"):
        name = row["seed/property"].partition("/")[2]
        margins[name] = max(margins.get(name, (0.0, "")), (float(row["nearest"]), row["formulation"]))
    return margins


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


def least_shared(name: str) -> tuple[str, list[str]]:
    """Return the mutant of a property that fewest others catch, and those others."""
    ids, rows, _ = kill_rows()
    candidates = [row for row in rows if is_kill(row[name])]
    row = min(candidates, key=lambda row: len(catchers(row, ids)))
    return row["mutant"], [other for other in catchers(row, ids) if other != name]


def campaign() -> str:
    """Return the part about formulations that are right."""
    rows, counts, margins = read("campaign.csv"), campaign_counts(), nearest_margins()
    text = CAMPAIGN.format(
        cases=sum(count["cases"] for count in counts.values()),
        formulations=max(int(row["formulations"]) for row in rows),
        seeds=" and ".join(dict.fromkeys(row["seed/property"].partition("/")[0] for row in rows)),
        accusations=sum(count["accusations"] for count in counts.values()) or "no",
    )
    lines = [
        [
            f"`{name}`",
            str(count["cases"]),
            str(count["accusations"]),
            *(f"{count[share] / count['cases']:.1%}" for share in ("undecided", "idle")),
            f"{margins[name][0]:.2g}",
            f"`{margins[name][1]}`" if margins[name][1] else "",
        ]
        for name, count in counts.items()
    ]
    return text + table(["property", "cases", "accused", "undecided", "idle", "nearest", "by"], lines)


def option_rows() -> list[Row]:
    """Return the rows of all formulations with their options."""
    return read("options.csv")


def base_name(formulation: str) -> str:
    """Return a formulation's name without its options; what a wrapper wraps is left out, too."""
    outer, slash, _ = formulation.partition("/")
    return outer.partition(":")[0] + slash


def stranger_rows() -> list[Row]:
    """Return the rows of all seeds and formulations of strangers."""
    return read("strangers.csv")


def strangers() -> str:
    """Return the part about right formulations of strangers."""
    groups = defaultdict[str, list[Row]](list)
    for row in stranger_rows():
        groups[row["seed/formulation"].partition("/")[2]].append(row)
    lines, sums = [], [0, 0]
    for name, members in groups.items():
        counts = [sum(int(row[count]) for row in members) for count in COUNTS]
        sums = [sums[0] + counts[0], sums[1] + counts[1]]
        nearest = max(members, key=lambda row: float(row["nearest"]))
        lines.append([name, *map(str, counts), nearest["nearest"], f"`{nearest['property']}`"])
    missing = len(SEEDS) * len(ALL_STRANGERS) - len(stranger_rows())
    text = STRANGERS.format(
        formulations=len(ALL_STRANGERS),
        seeds=", ".join(map(str, SEEDS)),
        examples=EXAMPLES,
        part=UNSTATED,
        cases=sums[0],
        accusations=sums[1],
        rest=f" {missing} of the campaign's lines have not run yet." if missing else "",
    )
    return text + table(["formulation", "cases", "accused", "undecided", "idle", "nearest", "in"], lines)


def options() -> str:
    """Return the part about options."""
    rows, groups = option_rows(), defaultdict[str, list[Row]](list)
    for row in rows:
        groups[base_name(row["formulation"])].append(row)
    n_accused = sum(int(row["accusations"]) for row in rows)
    accused = "; ".join(f"`{row['formulation']}`, {row['accused']}" for row in rows if row["accused"])
    text = OPTIONS.format(
        formulations=len(rows),
        pairs=sum(is_pair(row["formulation"]) for row in rows),
        cases=sum(int(row["cases"]) for row in rows),
        seed=SEED,
        accusations=f"There are {n_accused} accusations: {accused}." if accused else "Nobody was accused.",
        slow=", ".join(f"`{name}`" for name in SLOW),
    )
    lines = []
    for name, members in groups.items():
        heads = [text.partition(":")[0] for row in members for text in row["not judged"].split("; ")]
        open_rows = [head for head in heads if head and " " not in head]  # Else it is a part of a reason.
        properties = dict.fromkeys(open_rows)
        undecided = sum(int(row["undecided"]) for row in members)
        counts = (
            len(members),
            sum(int(row["cases"]) for row in members),
            sum(int(row["accusations"]) for row in members),
        )
        cells = [*map(str, (*counts, undecided, len(open_rows))), ", ".join(f"`{each}`" for each in properties)]
        lines.append([f"`{name}{'…' if name.endswith('/') else ''}`", *cells])
    return text + table(["formulation", "variants", "cases", "accused", "undecided", "not judged", "in"], lines)


def kills() -> str:
    """Return the part about formulations that are wrong."""
    ids, rows, survivors = kill_rows()
    alone, lines = caught_alone(), []
    for name in ids:
        n_intended = sum(row["caught by"] == name for row in rows)
        catches = sum(is_kill(row[name]) for row in rows)
        shared = ""
        if not alone[name]:
            mutant, others = least_shared(name)
            rest = f" and {len(others) - 3} more" if len(others) > 3 else ""
            shared = f"{mutant}: {', '.join(f'`{other}`' for other in others[:3])}{rest}"
        lines.append([f"`{name}`", str(n_intended), str(catches), str(len(alone[name])), shared])
    missing = "; ".join(
        f"*{row['mutant'].removeprefix(SURVIVES)}* (missing: `{row['caught by']}`)" for row in survivors
    )
    text = KILLS.format(mutants=len(rows), survivors=f"No property catches {len(survivors)} more: {missing}.")
    return text + table(["property", "meant", "catches", "alone", "least shared"], lines)


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
        [f"`{row['property']}`", *(f"1e-{row[kind]}" if row[kind] else "" for kind in kinds)]
        for row in rows
        if any(row[kind] for kind in kinds)
    ]
    return SMALLEST + '<div class="wide" markdown>\n\n' + table(["property", *kinds], lines) + "\n</div>\n"


def damage() -> str:
    """Return the part about the sizes of damages off the flat, before and today."""
    before = {row["property"]: row for row in read("curved_damage_before.csv")}
    today = read("curved_damage.csv")
    kinds = [name for name in today[0] if name not in ("property", "carrier")]
    lines = [
        [
            f"`{name}`",
            f"`{row['carrier']}`",
            *(f"{before[name][kind] or 'none'} → {row[kind] or 'none'}" for kind in kinds),
        ]
        for row in today
        if (name := row["property"]) in before
    ]
    return DAMAGE + table(["property", "carried by", *kinds], lines)


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
    lines = [[name, f"`{row['caught by']}`", row["seed 0"], today[name]["seed 0"]] for name, row in before.items()]
    return text + table(["wrong formulation", "caught by", "before", "today"], lines)


def page() -> str:
    """Return the whole page."""
    commits = ", ".join(
        f"`{row['table']}` at commit {row['commit']}" for row in read(COMMITS) if row["table"] in _TABLES
    )
    parts = [campaign(), strangers(), options(), kills(), faces(), unseen(), small_cases(), smallest(), damage()]
    return INTRODUCTION.format(commits=commits) + "\n".join(filter(None, parts))


def draw() -> None:
    """Draw the kill matrix."""
    ids, rows, _ = kill_rows()
    rows.sort(key=lambda row: ids.index(row["caught by"]))
    shades = np.array([[(row["caught by"] == name) + 0.45 * is_kill(row[name]) for name in ids] for row in rows])
    mpl.rcParams.update({"svg.hashsalt": "contactverif", "svg.fonttype": "none"})
    figure, axes = plt.subplots(figsize=(0.16 * len(ids) + 1, 0.045 * len(rows) + 2.4), layout="constrained")
    axes.imshow(np.minimum(shades, 1), cmap="Blues", vmin=0, vmax=1.15, aspect="auto", interpolation="nearest")
    axes.set_xticks(range(len(ids)), ids, rotation=90, fontsize=6)
    axes.set_yticks([])
    axes.set_ylabel(f"{len(rows)} wrong formulations")
    for side in axes.spines.values():
        side.set_visible(False)
    figure.savefig(FOLDER / FIGURE, metadata={"Date": None})


if __name__ == "__main__":
    (FOLDER / PAGE).write_text(page(), encoding="utf-8")
    draw()
