"""Tables that campaigns fill a line at a time and continue after a stop, and what campaigns share beside them."""

import csv
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))

from origin import entries, judge_of, keep_commit, read_commits

ROOT = Path(__file__).parents[2]
FOLDER, TESTS = ROOT / "reports" / "trust", ROOT / "tests"
SURVIVES = "survives: "  # Before the name of a mutant that no property is meant to catch.
UNKNOWN = "-"  # The cell of a property that was not asked.
JUDGE = "judge"  # The column with the digest of the properties that judged a line.
# {table: the head that names the one property that judged a line, behind a slash if there is one; "" where all did}
JUDGED_BY = {
    "campaign.csv": "seed/property",
    "strangers.csv": "",
    "options.csv": "",
    "faces.csv": "formulation/property",
    "kills.csv": "",
    "face_kills.csv": "",
    "smallest_errors.csv": "property",
    "curved_damage.csv": "property",
    "smallest_cases.csv": "caught by",
    "unseen.csv": "",
    "bugs.csv": "",
}


def read(name: str) -> list[dict[str, str]]:
    """Return the lines of a table in `reports/trust`, without their judges, none where it is missing."""
    return [{head: cell for head, cell in row.items() if head != JUDGE} for row in _read(name)]


def _read(name: str) -> list[dict[str, str]]:
    file = FOLDER / name
    if not file.exists():
        return []
    with file.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def judge_today(name: str, row: dict[str, str]) -> str:
    """Return the digest of the properties that judge a line of a table today."""
    head = JUDGED_BY[name]
    return judge_of(*([row[head].rpartition("/")[2]] if head else entries()))


def is_old(name: str, row: dict[str, str]) -> bool:
    """Return whether a line of a table is of an older judge."""
    return name in JUDGED_BY and row.get(JUDGE) != judge_today(name, row)


def count_old() -> dict[str, tuple[int, int]]:
    """Return {table: how many of its lines are of an older judge, and of how many}."""
    tables = {name: [is_old(name, row) for row in _read(name)] for name in JUDGED_BY}
    return {name: (sum(old), len(old)) for name, old in tables.items()}


def fill(
    name: str, heads: Iterable[str], keys: Iterable[str], cells: Callable[[str], list[str]], processes: int = 1
) -> None:
    """Write a table with a line for each key, in their order: the key, then its cells; the first head is the key's.

    Lines that are there stay as they are, if the table has the same heads and their judge is that of today. Delete the
    file to begin anew. `processes` share the keys, so `cells` is a function of a module.
    """
    keys = list(keys)
    heads = [*heads, JUDGE] if name in JUDGED_BY else list(heads)
    rows = {row[heads[0]]: row for row in _read(name) if list(row) == heads}
    lines = {key: [*row.values()] for key, row in rows.items() if key in keys}
    _write(name, heads, lines, keys)
    missing = [key for key in keys if key not in lines or is_old(name, rows[key])]
    if missing:
        keep_commit(FOLDER / name)
    # A process that dies ends this one, too; a `multiprocessing.Pool` would wait for its line for ever.
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for number, (key, line) in enumerate(zip(missing, pool.map(cells, missing), strict=True), 1):
            lines[key] = [key, *line]
            if name in JUDGED_BY:
                lines[key].append(judge_today(name, dict(zip(heads, lines[key], strict=False))))
            _write(name, heads, lines, keys)
            print(f"{number} of {len(missing)}: {key}", flush=True)


def fill_all(*tables: tuple[str, Iterable[str], Callable[[str], list[str]], Iterable[str]]) -> None:
    """Fill tables (name, heads, cells, keys) with the processes that the command line asks for, or one."""
    for name, heads, cells, keys in tables:
        fill(name, heads, keys, cells, processes=int(sys.argv[1]) if len(sys.argv) > 1 else 1)


def commits_of(tables: Iterable[str]) -> str:
    """Return with which commit each of some tables was filled, in Markdown."""
    commits = read_commits()
    return ", ".join(f"`{name}` at commit {commits[f'trust/{name}']}" for name in sorted(tables))


def _write(name: str, heads: list[str], lines: dict[str, list[str]], keys: list[str]) -> None:
    with (FOLDER / name).open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(heads)
        table.writerows(lines[key] for key in keys if key in lines)


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]], align: str = "--:") -> str:
    """Return a table in Markdown, its first column to the left and all others aligned by some marks."""
    lines = [f"| {' | '.join(heads)} |", f"|---|{f'{align}|' * (len(heads) - 1)}"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"


def install(folder: Path, targets: dict[str, str]) -> str:
    """Make {name: module:factory} entry points of a project in a folder; return the folder for the path of Python."""
    about = folder / "campaign-1.0.dist-info"
    about.mkdir(parents=True, exist_ok=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: campaign\nVersion: 1.0\n")
    lines = [f"{name} = {target}" for name, target in targets.items()]
    (about / "entry_points.txt").write_text("\n".join(["[contactverif.formulations]", *lines, ""]))
    return str(folder)
