"""Find which property catches which mutant, and at which of its cases. All mutants get the same cases."""

from functools import cache

from mutate import Mutant
from subjects import load_property
from without_points import CAUGHT_BY, count_points, take_points_away

from contactverif import Case, Property, Subject, Verdict, judge_case, load_properties
from contactverif.sampling.draw import Sampling, draw_cases

EXAMPLES = 100  # Cases of the property that is meant to catch the mutant; of a finite list all.
OTHERS = 20  # Cases of each other property, which `tox -e trust` asks.
SEED = 0
KEY = "kills"  # under which a row of the matrix travels in the report of a test


@cache
def properties() -> tuple[Property, ...]:
    """Return all installed properties, sorted by id."""
    loaded = load_properties()
    assert all(isinstance(question, Property) for question in loaded), loaded
    return tuple(question for question in loaded if isinstance(question, Property))


@cache
def cases(property_id: str, examples: int = EXAMPLES) -> tuple[Case, ...]:
    """Return the planned cases of a property, as a run draws them."""
    question = load_property(property_id)
    key = Sampling(examples=examples, seed=SEED).key(question)
    return draw_cases(question.cases(None), seed=key, examples=examples).cases


def caught_at(question: Property, subject: Subject, examples: int | None) -> int:
    """Return the number of the first case that accuses the formulation of what it promised, from 1; 0 if none does.

    Only the first `examples` cases are asked, or all of them (None).
    """
    if question.refusal_of(subject) or question.needs - subject.provides:
        return 0
    promised = question.promise(subject.traits) is True
    for number, case in enumerate(cases(question.id)[:examples], 1):
        # A copy: one mutant changes the mesh that it is given, and the next is to be given the same as all.
        outcome = judge_case(question, Case.from_arrays(case.to_arrays()), subject)
        if outcome.verdict is Verdict.CRASHED or outcome.breach or (promised and outcome.verdict is Verdict.FAIL):
            return number
    return 0


def first_kill(mutant: Mutant) -> tuple[int, bool]:
    """Return `caught_at` of the property that is meant to catch a mutant, and whether it looked at contact points."""
    calls: list[None] = []
    number = caught_at(load_property(mutant.caught_by), Subject(mutant.name, count_points(mutant.make, calls)), None)
    return number, bool(calls)


def first_kill_without_points(mutant: Mutant) -> int:
    """Return `caught_at` of a mutant without contact points, of its property or of the one that `CAUGHT_BY` names."""
    question = load_property(CAUGHT_BY.get(mutant.name, mutant.caught_by))
    return caught_at(question, Subject(mutant.name, take_points_away(mutant.make)), None)


def as_lines(matrix: dict[str, tuple[str, dict[str, int]]]) -> list[str]:
    """Write the kill matrix as text, from {mutant: (the property that is meant to catch it, its cells)}.

    A number is the first case that caught the mutant, in brackets where the property is the one that is meant to; a
    bracket without a number is a survivor.
    """
    ids = list(next(iter(matrix.values()))[1])
    titles = _short_titles(ids)
    widths = [max(len(title), 5) for title in titles]
    margin = max(map(len, matrix))

    def line(name: str, cells: list[str]) -> str:
        return f"{name:{margin}}  " + "  ".join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True))

    lines = [line("", titles)]
    for name, (intended, row) in matrix.items():
        lines.append(line(name, [_mark(row[question], bracket=question == intended) for question in ids]))
    lines.append(line("caught", [str(sum(row[question] > 0 for _, row in matrix.values())) for question in ids]))
    return lines


def _short_titles(ids: list[str]) -> list[str]:
    """Return the first word of each property id, or its last word where several ids share the first."""
    families = [question.partition(".")[0] for question in ids]
    return [
        family if families.count(family) == 1 else question.rpartition(".")[2]
        for question, family in zip(ids, families, strict=True)
    ]


def _mark(number: int, bracket: bool) -> str:
    """Return the text of a cell: the number of the first case, or nothing."""
    return f"[{number or ''}]" if bracket else str(number or "·")
