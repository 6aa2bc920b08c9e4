"""Find which property catches which mutant, and at which of its cases. All mutants get the same cases.

Contact points are optional, so a mutant must not be caught by them alone: where the property that is meant to catch a
mutant looks at points, the mutant is asked again without any. What else then catches it stands in `CAUGHT_BY`.
"""

from functools import cache
from pathlib import Path
from typing import Any

from planned_cases import draw_cases
from subjects import Changed, load_property

from contactverif import Case, Property, Subject, Verdict, judge_case, load_properties
from contactverif.sampling.draw import Sampling
from zoo.making import PLANE, SPACE, SURVIVORS, Make, Mutant
from zoo.mutants import faces

__all__ = ["MUTANTS", "MUTANTS_IN_SPACE", "SURVIVORS", "faces"]
MUTANTS, MUTANTS_IN_SPACE = tuple(PLANE), tuple(SPACE)
EXAMPLES = 100  # Cases of the property that is meant to catch the mutant; of a finite list all.
OTHERS = 20  # Cases of each other property, which `tox -e trust` asks.
KILL_TABLE = Path(__file__).parents[2] / "reports" / "trust" / "kills.csv"
KEY = "kills"  # under which a row of the matrix travels in the report of a test

REPORTS_ALONE = "only what it reports is wrong"
CAUGHT_BY = {
    "whole slave segments in contact": "nodal-push",
    "whole slave segment active with one of its points": "nodal-push",
    "activity of the neighbour": "unilateral",
    "penetrations below 1e-9 left open": "hard.offset",
    "gaps below 1e-9 closed": "units",
    "segments of the nearest node only": "hard.search",
    "wrong with four chains": "patch.flat.transmission",
    "wrong at tilts of 23° to 29°": "patch.flat.transmission",
    "wrong beyond 45°": "patch.tilted.resultant",
    "wrong at a re-entrant vertex": "locality.bend",
    "wrong on a closed master": "hard.search",
    "wrong deeper than half a segment": "hard.deep",
    "wrong past the end of the master": "hard.free-end",
}
# Mutants with wrong forces that survive without points, with the reason.
RIGHT_WITHOUT = {
    "contact points of the last residual": REPORTS_ALONE,
    "contact points of the last pairing": REPORTS_ALONE,
    "residual on the pairing of the last contact points": "nobody asks for points, so nothing remembers their pairing",
}


@cache
def properties(in_space: bool = False) -> dict[str, Property]:
    """Return {id: property} of all installed properties, or of those with cases in space."""
    loaded = [prop for prop in load_properties() if isinstance(prop, Property)]
    return {prop.id: prop for prop in loaded if not in_space or prop.cases_in_space is not None}


@cache
def cases(prop: Property, examples: int = EXAMPLES) -> tuple[Case, ...]:
    """Return the planned cases of a property, as a run draws them."""
    source = prop.cases(None)
    key = Sampling(examples=examples, seed=0).key(prop)
    return source if isinstance(source, tuple) else draw_cases(source, seed=key, examples=examples).cases


def first_accusation(prop: Property, subject: Subject, planned: tuple[Case, ...]) -> tuple[int, str]:
    """Return the number of the first case that accuses a formulation of what it promises, from 1, and why; else 0."""
    promised = prop.promise(subject.traits) is True
    for number, case in enumerate(planned, 1):
        # A copy: one mutant changes the mesh that it is given, and the next is to be given the same as all.
        outcome = judge_case(prop, Case.from_arrays(case.to_arrays()), subject)
        if outcome.verdict is Verdict.CRASHED or outcome.breach or (promised and outcome.verdict is Verdict.FAIL):
            return number, outcome.reason
    return 0, ""


def caught_at(prop: Property, subject: Subject, examples: int | None) -> int:
    """Return the number of the first accusation; only the first `examples` cases are asked, or all of them (None)."""
    if prop.refusal_of(subject) or prop.needs - subject.provides:
        return 0
    return first_accusation(prop, subject, cases(prop)[:examples])[0]


def first_accused(prop: Property, subject: Subject, examples: int) -> tuple[int, str]:
    """Return the first accusation in space, of what a formulation promises alone."""
    if prop.refusal_of(subject) or prop.promise(subject.traits) is not True:
        return 0, ""
    prop = prop.for_traits(subject.traits)
    return first_accusation(prop, subject, cases(prop, examples)[:examples])


def reports_alone(mutant: Mutant) -> bool:
    """Return whether the contact points are the one part of a right formulation that is changed."""
    formulation = mutant.make(penalty=1.0)
    changes = set(vars(formulation)) - {"inner"} if isinstance(formulation, Changed) else set()
    return changes == {"contact_points"}


def first_kill(mutant: Mutant) -> tuple[int, bool]:
    """Return `caught_at` of the property that is meant to catch a mutant, and whether it looked at contact points."""
    calls: list[None] = []

    def counting(*, penalty: float) -> Any:
        inner = mutant.make(penalty=penalty)
        if not callable(getattr(inner, "contact_points", None)):
            return inner

        def contact_points(*state: Any) -> Any:
            calls.append(None)
            return inner.contact_points(*state)

        return Changed(inner, contact_points=contact_points)

    return caught_at(load_property(mutant.caught_by), Subject(mutant.name, counting), None), bool(calls)


def first_kill_without_points(mutant: Mutant) -> int:
    """Return `caught_at` of a mutant without contact points, of its property or of the one that `CAUGHT_BY` names."""
    prop = load_property(CAUGHT_BY.get(mutant.name, mutant.caught_by))
    return caught_at(prop, Subject(mutant.name, without_points(mutant.make)), None)


def without_points(make: Make) -> Make:
    """Return the factory of a formulation without contact points."""
    return lambda *, penalty: Changed(make(penalty=penalty), contact_points=None)


def as_lines(matrix: dict[str, tuple[str, dict[str, int | None]]]) -> list[str]:
    """Write the kill matrix as text, from {mutant: (the property that is meant to catch it, its cells)}.

    A number is the first case that caught the mutant, in brackets where the property is the one that is meant to. A
    bracket without a number is a survivor, and "?" a pair that was never asked. A title is the first word of an id, or
    the last where several share it.
    """
    ids = list(next(iter(matrix.values()))[1])
    families = [name.partition(".")[0] for name in ids]
    titles = [
        family if families.count(family) == 1 else name.rpartition(".")[2]
        for name, family in zip(ids, families, strict=True)
    ]
    rows = [["", *titles]]
    for name, (intended, row) in matrix.items():
        cells = {each: "?" if number is None else str(number or "·") for each, number in row.items()}
        rows.append([name, *(f"[{row[each] or ''}]" if each == intended else cells[each] for each in ids)])
    rows.append(["caught", *(str(sum((row[each] or 0) > 0 for _, row in matrix.values())) for each in ids)])
    margin = max(map(len, matrix))
    return [
        f"{name:{margin}}  "
        + "  ".join(f"{cell:>{max(len(title), 5)}}" for cell, title in zip(cells, titles, strict=True))
        for name, *cells in rows
    ]
