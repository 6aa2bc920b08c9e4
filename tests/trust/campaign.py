"""Ask every property with random cases of every formulation that is right, and count whoever is accused.

`tox -e trust` writes `reports/trust/campaign.csv`, a line for each seed and property. An accusation is a failure of
what the formulation promises, a crash, or a breach of the contract. A finite list of cases is the same for every seed,
and the tests run it.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache

from every_formulation import FORMULATIONS
from expected_verdicts import FAILS
from strangers import STRANGERS
from tables import fill

from contactverif import Case, Subject, judge_case, load_formulation, load_properties
from contactverif.contract.property import Property, Verdict, checked_numbers
from contactverif.sampling.draw import draw_cases

FILE = "campaign.csv"
EXAMPLES = {1: 60, 2: 30}  # {seed: random cases of each property and formulation}
SOLVED = 5 / 12  # The share of these cases where bodies are solved.
NUMBERS = ("cases", "accusations", "undecided", "idle", "nearest")
HEADS = ("seed/property", *NUMBERS, "formulation", "formulations", "accused")


@cache
def right_formulations() -> tuple[Subject, ...]:
    """Return the built-in formulations with their options, and right ones by strangers."""
    built_in = [load_formulation(name) for name in sorted({*FAILS, *FORMULATIONS})]
    strangers = [Subject(f"stranger: {name}", make) for name, make in STRANGERS.items()]
    return (*(subject for subject in built_in if isinstance(subject, Subject)), *strangers)


@cache
def questions() -> dict[str, Property]:
    """Return {id: property} of all properties with random cases."""
    loaded = (question for question in load_properties() if isinstance(question, Property))
    return {question.id: question for question in loaded if not isinstance(question.cases(None), tuple)}


@dataclass
class Count:
    """The outcomes of some cases, and the number nearest to its tolerance in one that passes, where it must."""

    cases: int = 0
    undecided: int = 0
    idle: int = 0
    nearest: float = 0.0
    closest: str = ""
    accused: list[str] = field(default_factory=list)

    def ask(self, question: Property, cases: Sequence[Case], subject: Subject) -> None:
        """Judge the cases, if the property makes sense for the formulation."""
        if question.refusal_of(subject) or question.needs - subject.provides:
            return
        promised = question.promise(subject.traits) is True
        for number, case in enumerate(cases, 1):
            outcome = judge_case(question, case, subject)
            self.cases += 1
            self.undecided += outcome.verdict is Verdict.UNDECIDED
            self.idle += outcome.measurement is not None and outcome.measurement.idle
            if outcome.verdict is Verdict.CRASHED or outcome.breach or (promised and outcome.verdict is Verdict.FAIL):
                self.accused.append(f"{subject.name}, {question.id}, case {number}: {outcome.reason}")
            if promised and outcome.verdict is Verdict.PASS:
                ratios = [number.ratio for number in checked_numbers(question.info, outcome.measurement)]
                if max(ratios, default=0.0) > self.nearest:
                    self.nearest, self.closest = max(ratios), f"{subject.name}, {question.id}"

    @property
    def numbers(self) -> list[str]:
        """The cells of a table, by `NUMBERS`."""
        counts = (self.cases, len(self.accused), self.undecided, self.idle)
        return [*map(str, counts), f"{self.nearest:.3g}"]


def random_cases(question: Property, seed: str, examples: int) -> tuple[Case, ...]:
    """Return random cases of a property; of those that solve bodies, a share."""
    return draw_cases(
        question.cases(None), seed=seed, examples=round(examples * (SOLVED if question.bodies else 1))
    ).cases


def count(key: str) -> list[str]:
    """Return the cells of a line, whose key is the seed of a run's cases, such as "1/mirror"."""
    seed, _, name = key.partition("/")
    question = questions()[name]
    cases, total, n_formulations = random_cases(question, key, EXAMPLES[int(seed)]), Count(), 0
    for subject in right_formulations():
        before = total.cases
        total.ask(question, cases, subject)
        n_formulations += total.cases > before
    return [*total.numbers, total.closest.rpartition(", ")[0], str(n_formulations), "; ".join(total.accused)]


if __name__ == "__main__":
    keys = [f"{seed}/{name}" for seed in EXAMPLES for name in questions()]
    fill(FILE, HEADS, keys, count, processes=int(sys.argv[1]) if len(sys.argv) > 1 else 1)
