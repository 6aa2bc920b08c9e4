"""Ask every property with random cases of every formulation that is right, and count whoever is accused.

`tox -e trust` writes `reports/trust/campaign.csv`, a line for each seed and property. An accusation is a failure of
what the formulation promises, a crash, or a breach of the contract. A finite list of cases is the same for every seed,
and the tests run it.
"""

import sys
from functools import cache

from every_formulation import FORMULATIONS
from expected_verdicts import FAILS
from strangers import STRANGERS
from tables import fill

from contactverif import Subject, judge_case, load_formulation, load_properties
from contactverif.contract.property import Property, Verdict, checked_numbers
from contactverif.run.draw import draw_cases

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


def count(key: str) -> list[str]:
    """Return the cells of a line, whose key is the seed of a run's cases, such as "1/mirror".

    The nearest number is the largest over its tolerance in a case that passes, where it must.
    """
    seed, _, name = key.partition("/")
    question = questions()[name]
    examples = round(EXAMPLES[int(seed)] * (SOLVED if question.bodies else 1))
    cases = draw_cases(question.cases(None), seed=key, examples=examples).cases
    n_cases = n_undecided = n_idle = n_formulations = 0
    nearest, formulation = 0.0, ""
    accused: list[str] = []
    for subject in right_formulations():
        if question.refusal(subject.traits) or question.needs - subject.provides:
            continue
        n_formulations += 1
        promised = question.promise(subject.traits) is True
        for number, case in enumerate(cases, 1):
            outcome = judge_case(question, case, subject)
            n_cases += 1
            n_undecided += outcome.verdict is Verdict.UNDECIDED
            n_idle += outcome.measurement is not None and outcome.measurement.idle
            if outcome.verdict is Verdict.CRASHED or outcome.breach or (promised and outcome.verdict is Verdict.FAIL):
                accused.append(f"{subject.name}, case {number}: {outcome.reason}")
            if promised and outcome.verdict is Verdict.PASS:
                ratios = [number.ratio for number in checked_numbers(question.info, outcome.measurement)]
                if max(ratios, default=0.0) > nearest:
                    nearest, formulation = max(ratios), subject.name
    numbers = [str(number) for number in (n_cases, len(accused), n_undecided, n_idle)]
    return [*numbers, f"{nearest:.3g}", formulation, str(n_formulations), "; ".join(accused)]


if __name__ == "__main__":
    keys = [f"{seed}/{name}" for seed in EXAMPLES for name in questions()]
    fill(FILE, HEADS, keys, count, processes=int(sys.argv[1]) if len(sys.argv) > 1 else 1)
