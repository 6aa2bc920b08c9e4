"""Ask formulations with a mistake each as a user would, and write the page with all that the screen said.

`python tests/bugs/bugs_campaign.py` writes `reports/trust/bugs.md` and `bugs.csv`: a line for each formulation with the
seconds to the first row, to the first wrong one and in all, the lines of the screen, and whether place and kind of the
mistake are named. With names, it asks these alone and prints what it found.
"""

import csv
import os
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from fresh_bugs import FRESH
from springs_with_bugs import BUGS, Springs

FOLDER = Path(__file__).parents[2] / "reports" / "trust"
HEADS = ("formulation", "named", "first row", "first wrong row", "in all", "lines", "status", "diagnosis")
WRONG = re.compile(r"^\S+ \S+: (fail|crashed|BROKEN|breaks)")
RIGHT = "right"
EVERY = BUGS | FRESH
_PAGE = """# Twenty mistakes, as the screen tells them

Each formulation below was written with NumPy as a user would write it, has one mistake, and was judged by
`contactverif verify NAME --seed 1` with all else as it is by default. Twelve mistakes were known to the authors of the
rules of [diagnosis](../../docs/concepts/diagnosis.md). Eight were written by somebody who had not seen the rules.

Five times eight such mistakes were asked so far, and 38 were caught. A decision about contact by the mean gap of two
segments is shown as `nodal-push` failing without a promise. Averages of the gap that are interpolated like nodal gaps
break no promise: that formulation passes the patch test, and converges like others. When they were asked for the first
time, place and kind were named of 1, 1, 2, 3 and 1 of the eight, and three were called by a wrong name. Rules for the
others were added each time, so what is said below is no measure of what is said of a mistake that nobody thought of.
`tests/bugs/bugs_campaign.py` wrote this page. Seconds are those of a machine with two cores on which a loop of ten
million turns in Python takes {loop:.2g} s, and upper bounds: other work ran beside some of them.

A reader who saw the screens alone, without the names of the mistakes, said where to look and what is wrong. Of the
twenty, eighteen answers are right; one more, that nothing is broken, is right of the averages of the gap; steps that
pile up were taken for two components that are exchanged.

{summary}

{table}
{parts}"""


@dataclass(frozen=True)
class Answer:
    """The words that a command printed, and the seconds when."""

    name: str
    summary: str  # What is wrong with the formulation, in a line.
    words: str  # A pattern for the words that name place and kind.
    screen: str
    status: int
    first: float  # Seconds to the first row, to the first wrong one (NaN without one), and in all.
    first_wrong: float
    seconds: float

    @property
    def diagnosis(self) -> str:
        """The sentence of the diagnosis; empty without one."""
        sentence = re.search(r"^  diagnosis: (.*(?:\n  \S.*)*)", self.screen, flags=re.MULTILINE)
        return " ".join(sentence[1].split()) if sentence else ""

    @property
    def named(self) -> bool:
        """True if the diagnosis, or else the screen, names place and kind of the mistake."""
        return bool(re.search(self.words, self.diagnosis or " ".join(self.screen.split())))

    @property
    def line(self) -> tuple[str, ...]:
        """The line of the table."""
        seconds = (f"{value:.1f}" for value in (self.first, self.first_wrong, self.seconds))
        named = "–" if self.name == RIGHT else "yes" if self.named else "no"
        return self.name, named, *seconds, str(len(self.screen.splitlines())), str(self.status), self.diagnosis


def install(folder: Path) -> dict[str, str]:
    """Make all formulations entry points of a project; return the environment in which a command sees them."""
    about = folder / "bugs-1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: bugs\nVersion: 1.0\n")
    makers = {RIGHT: Springs} | {name: make for name, (make, _) in EVERY.items()}
    lines = [f"{name} = {make.__module__}:{make.__name__}" for name, make in makers.items()]
    (about / "entry_points.txt").write_text("\n".join(["[contactverif.formulations]", *lines, ""]))
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), str(Path(__file__).parent)]), "COLUMNS": "80"}


def ask(name: str, environment: dict[str, str], folder: Path) -> Answer:
    """Judge a formulation as a user does, and note when its rows appear."""
    make, words = EVERY.get(name, (Springs, "^$"))
    command = [sys.executable, "-m", "contactverif", "verify", name, "--seed", "1"]
    begin, times = time.monotonic(), []
    with (folder / "screen").open("w+", encoding="utf-8") as screen:
        process = subprocess.Popen(
            command, stdout=screen, stderr=subprocess.PIPE, text=True, env=environment, cwd=folder
        )
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith(name):
                times.append((time.monotonic() - begin, bool(WRONG.match(line))))
        status, seconds = process.wait(), time.monotonic() - begin
        screen.seek(0)
        text = screen.read()
    wrong = next((second for second, is_wrong in times if is_wrong), float("nan"))
    first = times[0][0] if times else float("nan")
    return Answer(name, (make.__doc__ or "").splitlines()[0], words, text, status, first, wrong, seconds)


def _loop() -> float:
    begin = time.perf_counter()
    for _ in range(10**7):
        pass
    return time.perf_counter() - begin


def _page(answers: list[Answer]) -> str:
    """Return the page: how many mistakes are named, the table, and each screen."""
    counts = []
    for text, names in (("the twelve", BUGS), ("the eight", FRESH)):
        named = sum(answer.named for answer in answers if answer.name in names)
        silent = sum(not answer.diagnosis for answer in answers if answer.name in names)
        counts.append(f"Of {text}, {named} are named, place and kind; {silent} have no diagnosis.")
    heads = ["formulation", "named", "first row", "first wrong", "in all", "lines"]
    rows = [heads, ["---"] * len(heads), *([*answer.line[:6]] for answer in answers)]
    table = "".join(f"| {' | '.join(row)} |\n" for row in rows)
    parts = [f"## {answer.name}\n\n{answer.summary}\n\n```text\n{answer.screen.strip()}\n```\n" for answer in answers]
    return _PAGE.format(loop=_loop(), summary="\n".join(counts), table=table, parts="\n".join(parts))


def main(names: list[str]) -> None:
    """Ask all formulations, or those of some names."""
    answers = []
    with tempfile.TemporaryDirectory() as place:
        environment = install(Path(place) / "site")
        for name in names or [RIGHT, *EVERY]:
            answers.append(ask(name, environment, Path(place)))
            print(*answers[-1].line, sep="; ", flush=True)
            if names:
                print(answers[-1].screen)
    if not names:
        with (FOLDER / "bugs.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([HEADS, *(answer.line for answer in answers)])
        (FOLDER / "bugs.md").write_text(_page(answers), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
