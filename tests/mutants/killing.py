"""Which property catches which mutant, and at which of its cases. The cases of a property are drawn once for all."""

from __future__ import annotations

from functools import cache

from mutate import Mutant

from contactverif.contract.case import Case
from contactverif.contract.property import Property, Verdict
from contactverif.contract.subject import Subject
from contactverif.run.driver import draw_cases
from contactverif.run.registry import load_properties
from contactverif.run.runner import judge_case

EXAMPLES = 100  # Cases of the property that is meant to catch the mutant.
OTHERS = 10  # Cases of each other property, which fill the matrix and decide nothing.
OTHERS_FOR_A_SURVIVOR = 25  # Cases of each other property where no property may catch the mutant.
SEED = 0
KEY = "kills"  # under which a row of the matrix travels in the report of a test


@cache
def properties() -> tuple[Property, ...]:
    """All that are installed, sorted by id."""
    found = load_properties()
    assert all(isinstance(one, Property) for one in found), found
    return tuple(one for one in found if isinstance(one, Property))


@cache
def cases(property_id: str, seed: int = SEED, examples: int = EXAMPLES) -> tuple[Case, ...]:
    """The planned cases of a property, as a run with that seed draws them."""
    (question,) = (one for one in properties() if one.id == property_id)
    return draw_cases(question.cases(None), seed=f"{seed}/{property_id}", examples=examples).cases


def caught_at(question: Property, subject: Subject, examples: int) -> int:
    """The number of the first case that accuses the formulation of what it promised, from 1; 0 if none does."""
    if question.applicable(subject.traits) or question.needs - subject.provides:
        return 0
    promised = question.promise(subject.traits) is True
    for number, case in enumerate(cases(question.id)[:examples], 1):
        # A copy: one mutant changes the mesh that it is given, and the next is to be given the same as all.
        outcome = judge_case(question, Case.from_arrays(case.to_arrays()), subject)
        if outcome.verdict is Verdict.CRASHED or outcome.breach or (promised and outcome.verdict is Verdict.FAIL):
            return number
    return 0


def kills(mutant: Mutant, others: int = OTHERS) -> dict[str, int]:
    """Return {property id: `caught_at`} of a mutant."""
    subject = Subject(mutant.name, mutant.make)
    return {
        question.id: caught_at(question, subject, EXAMPLES if question.id == mutant.caught_by else others)
        for question in properties()
    }


def as_lines(matrix: dict[str, tuple[str, dict[str, int]]]) -> list[str]:
    """The kill matrix as text, from {mutant: (the property that is meant to catch it, its `kills`)}.

    A number is the first case that caught the mutant, in brackets where the property is the one that is meant to; a
    bracket without a number is a survivor.
    """
    ids = list(next(iter(matrix.values()))[1])
    firsts = [one.partition(".")[0] for one in ids]
    titles = [
        first if firsts.count(first) == 1 else one.rpartition(".")[2] for one, first in zip(ids, firsts, strict=True)
    ]
    widths = [max(len(title), 5) for title in titles]
    wide = max(map(len, matrix))
    lines = [f"{'':{wide}}  " + "  ".join(f"{title:>{width}}" for title, width in zip(titles, widths, strict=True))]
    for name, (meant, row) in matrix.items():
        marks = [f"[{row[one] or ''}]" if one == meant else str(row[one] or "·") for one in ids]
        lines.append(f"{name:{wide}}  " + "  ".join(f"{m:>{width}}" for m, width in zip(marks, widths, strict=True)))
    totals = [str(sum(row[one] > 0 for _, row in matrix.values())) for one in ids]
    lines.append(f"{'caught':{wide}}  " + "  ".join(f"{t:>{width}}" for t, width in zip(totals, widths, strict=True)))
    return lines
