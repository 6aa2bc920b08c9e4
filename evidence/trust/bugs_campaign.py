"""Ask formulations with a mistake each as a user would, and write the page with all that the screen said.

`python evidence/trust/bugs_campaign.py` writes `reports/trust/bugs.md` and `bugs.csv`: a line for each formulation with
the seconds to the first row, to the first wrong one and in all, the lines of the screen, and whether place and kind of
the mistake are named. With names, it asks these alone and prints what it found.
"""

import csv
import os
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from math import nan
from pathlib import Path

from tables import FOLDER, JUDGE, TESTS, entries, install, judge_of, keep_commit, markdown
from zoo.springs import FRESH, KNOWN, Springs

HEADS = ("formulation", "named", "first row", "first wrong row", "in all", "lines", "status", "diagnosis", JUDGE)
WRONG = re.compile(r"^\S+ \S+: (fail|crashed|BROKEN|breaks)")
RIGHT = "right"
ASKED = KNOWN | FRESH
_PAGE = """# Twenty mistakes, as the screen tells them

Each formulation below was written with NumPy as a user would write it, has one mistake, and was judged by
`contactverif verify NAME --seed 1` with all else as it is by default. Twelve mistakes were known to the authors of the
rules of [diagnosis](../../docs/concepts/diagnosis.md). Eight were written by somebody who had not seen the rules.

Five times eight such mistakes were asked so far, and 38 were caught. A decision about contact by the mean gap of two
segments is shown as `nodal-push` failing without a promise. Averages of the gap that are interpolated like nodal gaps
break no promise: that formulation passes the patch test, and converges like others. When they were asked for the first
time, place and kind were named of 1, 1, 2, 3 and 1 of the eight, and three were called by a wrong name. Rules for the
others were added each time, so what is said below is no measure of what is said of a mistake that nobody thought of.
`evidence/trust/bugs_campaign.py` wrote this page. Seconds are those of a machine with two cores on which a loop of ten
million turns in Python takes {loop:.2g} s, and upper bounds: other work ran beside some of them.

A reader who saw the screens alone, without the names of the mistakes, said where to look and what is wrong. Of the
twenty, eighteen answers are right; one more, that nothing is broken, is right of the averages of the gap; steps that
pile up were taken for two components that are exchanged.

{summary}

{table}
{parts}"""


@dataclass(frozen=True)
class Answer:
    """The words that a command printed, and the seconds to its first row, to the first wrong one, and in all."""

    name: str
    screen: str
    status: int
    times: tuple[float, float, float]  # NaN where there is no such row.

    @property
    def diagnosis(self) -> str:
        """The sentence of the diagnosis; empty without one."""
        sentence = re.search(r"^  diagnosis: (.*(?:\n  \S.*)*)", self.screen, flags=re.MULTILINE)
        return " ".join(sentence[1].split()) if sentence else ""

    @property
    def named(self) -> bool:
        """True if the diagnosis, or else the screen, names place and kind of the mistake."""
        return self.name != RIGHT and bool(
            re.search(ASKED[self.name][1], self.diagnosis or " ".join(self.screen.split()))
        )

    @property
    def line(self) -> tuple[str, ...]:
        """The line of the table."""
        named = "–" if self.name == RIGHT else "yes" if self.named else "no"
        seconds = (f"{value:.1f}" for value in self.times)
        counts = str(len(self.screen.splitlines())), str(self.status)
        return self.name, named, *seconds, *counts, self.diagnosis, judge_of(*entries())


def ask(name: str, folder: Path) -> Answer:
    """Judge a formulation as a user does, and note when its rows appear."""
    (folder / "mistakes.py").write_text(
        "from zoo.springs import EVERY, Springs\n\nright = Springs\n"
        "globals().update({name.replace('-', '_'): make for name, (make, _) in EVERY.items()})\n"
    )
    site = install(folder, {each: f"mistakes:{each.replace('-', '_')}" for each in (RIGHT, *ASKED)})
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([site, str(TESTS)]), "COLUMNS": "80"}
    command = [sys.executable, "-m", "contactverif", "verify", name, "--seed", "1"]
    begin, times = time.monotonic(), []
    with (folder / "screen").open("w+", encoding="utf-8") as screen:
        process = subprocess.Popen(
            command, stdout=screen, stderr=subprocess.PIPE, text=True, env=environment, cwd=folder
        )
        for line in process.stderr or ():
            if line.startswith(name):
                times.append((time.monotonic() - begin, bool(WRONG.match(line))))
        status, seconds = process.wait(), time.monotonic() - begin
        screen.seek(0)
        text = screen.read()
    first = next((second for second, _ in times), nan)
    return Answer(name, text, status, (first, next((second for second, wrong in times if wrong), nan), seconds))


def _page(answers: list[Answer]) -> str:
    """Return the page: how many mistakes are named, the table, and each screen."""
    counts = []
    for text, names in (("the twelve", KNOWN), ("the eight", FRESH)):
        group = [answer for answer in answers if answer.name in names]
        n_named, n_silent = sum(each.named for each in group), sum(not each.diagnosis for each in group)
        counts.append(f"Of {text}, {n_named} are named, place and kind; {n_silent} have no diagnosis.")
    heads = ["formulation", "named", "first row", "first wrong", "in all", "lines"]
    table = markdown(heads, [answer.line[:6] for answer in answers], "---")
    parts = [
        f"## {answer.name}\n\n{(ASKED.get(answer.name, (Springs,))[0].__doc__ or '').splitlines()[0]}\n\n"
        f"```text\n{answer.screen.strip()}\n```\n"
        for answer in answers
    ]
    begin = time.perf_counter()
    for _ in range(10**7):
        pass
    loop = time.perf_counter() - begin
    return _PAGE.format(loop=loop, summary="\n".join(counts), table=table, parts="\n".join(parts))


def main(names: list[str]) -> None:
    """Ask all formulations, or those of some names."""
    answers = []
    with tempfile.TemporaryDirectory() as folder:
        for name in names or [RIGHT, *ASKED]:
            answers.append(ask(name, Path(folder)))
            print(*answers[-1].line, sep="; ", flush=True)
            if names:
                print(answers[-1].screen)
    if not names:
        with (FOLDER / "bugs.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([HEADS, *(answer.line for answer in answers)])
        keep_commit(FOLDER / "bugs.csv")
        (FOLDER / "bugs.md").write_text(_page(answers), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
