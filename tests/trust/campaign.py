"""Ask every property of every formulation that is right, many times over, and count whoever is accused.

`tox -e trust` writes `reports/trust/campaign.csv`, one line for each property. An accusation
is a failure of what the formulation promises, a crash, or a breach of the contract.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from every_formulation import FORMULATIONS
from expected_verdicts import FAILS
from strangers import STRANGERS

from contactverif.contract.property import Property, Verdict, checked_numbers
from contactverif.contract.result import Row
from contactverif.contract.subject import Subject
from contactverif.run.registry import load_formulation, load_properties
from contactverif.run.runner import run

FILE = Path(__file__).parents[2] / "reports" / "trust" / "campaign.csv"
EXAMPLES, EXAMPLES_SOLVED = 60, 25  # Random cases of each property and formulation, for each seed.
SEEDS = (1, 2)
HEADS = ("property", "cases", "accusations", "undecided", "idle", "nearest", "formulation", "formulations", "seeds")


@dataclass
class Count:
    """The counts of one property over all formulations.

    Attributes
    ----------
    cases, accusations, undecided, idle : int
        Numbers of cases.
    nearest : float
        The largest number over its tolerance of a case that passes.
    formulation : str
        The formulation that came nearest.
    accused : list[str]
        The formulations that were accused.
    """

    cases: int = 0
    accusations: int = 0
    undecided: int = 0
    idle: int = 0
    nearest: float = 0.0
    formulation: str = ""
    accused: list[str] = field(default_factory=list)

    def add(self, row: Row) -> None:
        """Count a row of a run. Whoever promises nothing, or states that it fails, is not accused of a failure."""
        for outcome in row.outcomes:
            failed = row.promise is True and outcome.verdict is Verdict.FAIL
            if failed or outcome.verdict is Verdict.CRASHED or outcome.breach:
                self.accusations += 1
                self.accused.append(row.formulation)
            self.cases += 1
            self.undecided += outcome.verdict is Verdict.UNDECIDED
            self.idle += outcome.measurement is not None and outcome.measurement.idle
            if outcome.verdict is Verdict.PASS and row.promise is True:
                ratios = [number.ratio for number in checked_numbers(row.info, outcome.measurement)]
                if max(ratios, default=0.0) > self.nearest:
                    self.nearest, self.formulation = max(ratios), row.formulation


def right_formulations() -> list[Subject]:
    """Return the built-in formulations with their options, and right ones by strangers."""
    names = sorted({*FAILS, *FORMULATIONS})
    built_in = [load_formulation(name) for name in names]
    strangers = [Subject(f"stranger: {name}", make) for name, make in STRANGERS.items()]
    return [subject for subject in built_in if isinstance(subject, Subject)] + strangers


def questions() -> Iterator[Property]:
    """Yield all properties with random cases. A finite list is the same for every seed, and the tests run it."""
    for question in load_properties():
        if isinstance(question, Property) and not isinstance(question.cases(None), tuple):
            yield question


def count_all(seeds: Iterable[int]) -> dict[str, Count]:
    """Return {property id: counts} over all formulations and seeds."""
    subjects, counts = right_formulations(), {}
    for question in questions():
        count = counts[question.id] = Count()
        for seed in seeds:
            examples = EXAMPLES_SOLVED if question.bodies else EXAMPLES
            for row in run(subjects, [question], examples=examples, seed=seed).rows:
                count.add(row)
        print(f"{question.id}: {count}", flush=True)
    return counts


def write(counts: dict[str, Count], seeds: Iterable[int]) -> None:
    """Write the counts as a table of comma-separated values."""
    with FILE.open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(HEADS)
        n_formulations = len(right_formulations())
        for name, count in counts.items():
            numbers = [count.cases, count.accusations, count.undecided, count.idle, f"{count.nearest:.3g}"]
            table.writerow([name, *numbers, count.formulation, n_formulations, " ".join(map(str, seeds))])


if __name__ == "__main__":
    seeds = tuple(map(int, sys.argv[1:])) or SEEDS
    write(count_all(seeds), seeds)
