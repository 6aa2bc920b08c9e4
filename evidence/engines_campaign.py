"""Ask every engine and every library all questions that it can answer, and write the tables of `reports/findings`.

`tox -e engines` writes `reports/findings/engines.csv`, a line for each engine and question, and the page `engines.md`;
`tox -e libraries` writes `libraries.csv` and `libraries.md`. Engines that come as Python packages get environments of
their own; `GETFEM_PYTHON` names the interpreter of GetFEM. A library is a package of the environment that runs this.
Lines of today's judges stay; a page says how many are of older ones. A report that is complete is read and not made
again, and one that was stopped goes on, so that the same command goes on with the whole.
"""

import csv
import json
import os
import shutil
import subprocess
import sys
import venv
from dataclasses import dataclass
from importlib.util import find_spec
from math import nan
from pathlib import Path
from typing import Any

from origin import judge_of, keep_commit

from contactverif.plugins.registry import property_ids

FOLDER = Path(__file__).parents[1] / "reports" / "findings"
COUNTS, NUMBERS = ("judged", "failed", "planned"), ("number", "value", "tolerance")
HEADS = ("engine", "question", "verdict", *COUNTS, *NUMBERS, "seconds a case", "reason", "judge")
PARTS = ("StructuralMechanics", "ContactStructuralMechanics", "LinearSolvers")
HANGS = "engine.locking"  # It is asked in a run of its own: where no answer came twice, a run asks no more.
Line = tuple[str, ...]
KRATOS = ("KratosMultiphysics", *(f"Kratos{part}Application" for part in PARTS))


@dataclass(frozen=True)
class Choice:
    """An engine with options, and the packages that its interpreter needs; none if it lives in this one.

    Where no index has the packages, a variable of the environment names the interpreter.
    """

    name: str
    options: str = ""
    packages: tuple[str, ...] = ()
    variable: str = ""
    library: str = ""  # The package of a formulation; empty for an engine.

    @property
    def label(self) -> str:
        """The name and the options."""
        return f"{self.name}:{self.options}" if self.options else self.name

    def write_name(self, environments: Path) -> str:
        """Return the name as on the command line, after its environment is made."""
        options = [self.options] if self.options else []
        if self.packages:
            options.append(f"python={_interpreter(environments / self.name, self.packages)}")
        if self.variable:
            options.append(f"python={os.environ[self.variable]}")
        return f"{self.name}:{','.join(options)}" if options else self.name


CHOICES = (
    Choice("control"),
    Choice("control", "dim=3"),
    Choice("calculix"),
    Choice("calculix", "dim=3"),
    Choice("calculix", "kind=nodes"),
    Choice("calculix", "kind=mortar"),
    Choice("calculix", "kind=linmortar"),
    Choice("getfem", variable="GETFEM_PYTHON"),
    Choice("getfem", "kind=multiplier", variable="GETFEM_PYTHON"),
    Choice("kratos", "", KRATOS),
    Choice("kratos", "search_factor=10000", KRATOS),
    Choice("kratos", "search=radius,search_factor=10000,normals=updated,augmentation=1e-6", KRATOS),
    Choice("kratos", "kind=penalty", KRATOS),
    Choice("kratos", "dim=3", KRATOS),
    Choice("kratos", "dim=3,search=radius,search_factor=10000,normals=updated,augmentation=1e-6", KRATOS),
    Choice("ngsolve", "", ("ngsolve",)),
    Choice("ngsolve", "order=15", ("ngsolve",)),
    Choice("opensees", "", ("openseespy",)),
    Choice("fedoo", "", ("fedoo",)),
    Choice("sfepy", "", ("sfepy",)),
)


LIBRARIES = (
    Choice("ipctk", "kind=ipc", library="ipctk"),
    Choice("ipctk", "kind=improved", library="ipctk"),
    Choice("ipctk", "kind=ogc", library="ipctk"),
    Choice("opensees", "kind=nts", library="openseespy"),
    Choice("opensees", "kind=interface", library="openseespy"),
    Choice("fedoo", "kind=search_nearest", library="fedoo"),
    Choice("fedoo", "kind=bucket", library="fedoo"),
    Choice("ngsolve", "kind=energy", library="ngsolve"),
)


def _interpreter(folder: Path, packages: tuple[str, ...]) -> Path:
    """Return the interpreter of an environment with numpy and some packages, which is made if it is not there."""
    python = folder / "bin" / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "-q", "numpy", *packages], check=True)
    return python


def ask(choice: Choice, questions: list[str], folder: Path, examples: int) -> list[Line]:
    """Return the lines of an engine for some questions, from a report that is made or gone on with."""
    label = choice.label.replace(":", "-").replace("=", "-").replace(",", "-")
    report = folder / f"{label}-{judge_of(*questions)}.json"  # Other judges, another report.
    if not report.exists():
        journal = report.with_name(report.name + ".journal")
        name = choice.write_name(folder / "environments")
        # A box forbids the socket that OpenSees opens when it is imported.
        new = [
            *([name, "--isolation", "process"] if choice.library else ["--engine", name]),
            "--seed",
            "1",
            "--examples",
            str(examples),
            *(word for question in questions for word in ("-p", question)),
        ]
        arguments = ["--resume", str(report)] if journal.exists() else [*new, "--out", str(report), "--no-memory"]
        command = [sys.executable, "-m", "contactverif", "verify", *arguments, "--keep-going", "-q", "--jobs", "2"]
        subprocess.run(command, check=False, cwd=folder)
    document = json.loads(report.read_text(encoding="utf-8"))
    return [line for row in document["rows"] if (line := _line(choice, row)) is not None]


def _line(choice: Choice, row: dict[str, Any]) -> Line | None:
    """Return the line of a row; None where displacements do not answer the question."""
    if row["result"] == "not applicable":
        return None
    closest = row["closest"] or {"name": "", "value": None, "tolerance": None}
    # A report has no value for a number that is infinite or none.
    numbers = ["" if closest[key] is None else f"{closest[key]:.2e}" for key in ("value", "tolerance")]
    seconds = f"{row['seconds'] / max(row['planned'], 1):.2g}"
    counts = (str(row[key]) for key in ("judged", "failed", "planned"))
    cells = choice.label, row["property"], row["result"], *counts, closest["name"], *numbers, seconds, row["reason"]
    return *cells, judge_of(row["property"])


LIBRARIES_PAGE = """# Libraries of contact, question by question

Each library was asked every property that makes sense for it, as a formulation: up to {examples} random states of seed
1, and all lists. A cell is read as on the page of [contact codes](engines.md): the verdict, the number that is nearest
to its tolerance or furthest beyond it, over the tolerance, how many cases could be judged of how many, and the seconds
of a case. What fails without a promise is no mistake: a barrier at nodes does not pass the patch test.

`tox -e libraries` wrote this page, and `libraries.csv` beside it, which has the reasons. {older}

{tables}
"""

PAGE = """# Contact codes, question by question

Each code was asked every question that its displacements answer
([what is asked](../../docs/how-to/whole-codes.md#what-is-asked)): the scenes of seed 1, up to {examples} random ones of
a question, and all that have an exact solution. A cell says how it ended, with the number that is nearest to its
tolerance or furthest beyond it, over the tolerance (below 1 passes), how many scenes could be judged of how many, and
the seconds of a scene. A scene is not judged where the code says that it finds no solution, or takes no such supports.

- **pass** and **fail**: the verdict over all scenes; **BROKEN PROMISE** where the engine states that it passes, or any
  code should. What is not among [the findings](README.md) was not examined yet: it may be a mistake of the adapter.
- **not judged**, or **undecided** where nothing is promised: more than a tenth of the scenes was not judged.
- **crashed**: it ended, or gave no answer within a minute.

`tox -e engines` wrote this page, and `engines.csv` beside it, which has the reasons. {older}

{tables}
"""


def write_page(lines: list[Line], examples: int, name: str = "engines", page: str = PAGE) -> None:
    """Write the page: a table for each engine or library."""
    tables = []
    for engine in dict.fromkeys(line[0] for line in lines):
        rows = ["| question | verdict | over tolerance | judged | seconds |", "|---|---|---|---|---|"]
        for row in (dict(zip(HEADS, line, strict=True)) for line in lines if line[0] == engine):
            value, tolerance = (float(row[name] or nan) for name in ("value", "tolerance"))
            least = row["number"].startswith("rate")
            ratio = tolerance / value if least else value / tolerance if tolerance else nan
            over = f"{row['number']} {ratio:.2g}" if ratio == ratio else ""
            rows.append(
                f"| `{row['question']}` | {row['verdict']} | {over} | {row['judged']} of {row['planned']} | "
                f"{row['seconds a case']} |"
            )
        tables.append("\n".join([f"## {engine}", "", *rows, ""]))
    old = [line[-1] != judge_of(line[1]) for line in lines]
    older = (
        f"{sum(old)} of its {len(old)} lines are of an older judge, whose digest they keep (`judge`) if there is one."
    )
    text = page.format(examples=examples, tables="\n".join(tables), older=older)
    (FOLDER / f"{name}.md").write_text(text, encoding="utf-8")


def main(folder: Path, examples: int, name: str = "engines") -> None:
    """Ask all engines whose program is there, or all libraries that are installed."""
    for place in (folder, FOLDER):
        place.mkdir(parents=True, exist_ok=True)
    choices, page = (LIBRARIES, LIBRARIES_PAGE) if name == "libraries" else (CHOICES, PAGE)
    file = FOLDER / f"{name}.csv"
    with file.open(encoding="utf-8", newline="") as stream:
        rows = [tuple(row.get(head, "") for head in HEADS) for row in csv.DictReader(stream)]
    lines = {row[:2]: row for row in rows}  # {(engine, question): line}
    for choice in choices:
        if choice.library and find_spec(choice.library) is None:
            print(f"{choice.label}: {choice.library} is not installed")
            continue
        if choice.name == "calculix" and shutil.which("ccx") is None:
            print("calculix: the program ccx is not installed")
            continue
        if choice.variable and choice.variable not in os.environ:
            print(f"{choice.name}: {choice.variable} is not set")
            continue
        ids = property_ids(engines=not choice.library)
        old = [id_ for id_ in ids if lines.get((choice.label, id_), ("",))[-1] != judge_of(id_)]
        for part in ([id_ for id_ in old if id_ != HANGS], [id_ for id_ in old if id_ == HANGS]):
            lines |= {line[:2]: line for line in ask(choice, part, folder, examples)} if part else {}
        rows = [line for each in choices for line in lines.values() if line[0] == each.label]
        with file.open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream, lineterminator="\n").writerows([HEADS, *rows])
        keep_commit(file)
        write_page(rows, examples, name, page)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1000, *sys.argv[3:4])
