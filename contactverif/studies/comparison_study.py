"""A comparison of candidates with a reference: one run over the same cases, then the cost of an evaluation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isnan
from typing import Any

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface
from contactverif.contract.property import Property
from contactverif.contract.result import NotLoaded, Row, Run
from contactverif.contract.subject import Subject
from contactverif.run.run import run
from contactverif.sampling.draw import Sampling, with_case
from contactverif.studies.evaluation_cost import measure_costs
from contactverif_reports.compare.comparison import Comparison, Cost, Differing


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """A comparison with all that it rests on."""

    run: Run  # The run of reference and candidates, as `verify` makes it.
    comparison: Comparison  # Its numbers side by side.
    # The case of each property on which they differ most, the largest difference first.
    differing: tuple[Differing, ...]
    costs: tuple[Cost, ...]  # The times of an evaluation.
    apart: tuple[str, ...] = ()  # The candidates with other cases: of another dimension, or on other faces.


def run_comparison(
    reference: Subject,
    candidates: Sequence[Subject | NotLoaded],
    properties: Sequence[Property | NotLoaded],
    *,
    place: Interface | Case | None = None,
    **options: Any,
) -> Study:
    """Check every property of the reference and of the candidates, on the same cases; options are those of `run`."""
    if not candidates:
        raise MisuseError("NAME", "nothing", f"a formulation to compare with {reference.name}")
    if any(_name(candidate) == reference.name for candidate in candidates):
        raise MisuseError("--against", f"{reference.name}, which is compared too", "another formulation than those")
    result = run([reference, *candidates], properties, place=place, **options)
    comparison = Comparison.from_run(result, reference.name)
    loaded = [candidate for candidate in candidates if isinstance(candidate, Subject)]
    apart = _on_other_faces(reference, loaded)
    variants = [item.for_traits(reference.traits) for item in properties if isinstance(item, Property)]
    differing = _with_cases(find_differing(result, comparison), variants, result, place)
    return Study(result, comparison, differing, measure_costs([reference, *loaded]), apart)


def _on_other_faces(reference: Subject, candidates: Sequence[Subject]) -> tuple[str, ...]:
    """Return the names of candidates that are asked in another dimension than the reference, or on other faces."""
    faces, *others = (
        () if subject.traits.abilities.in_plane else subject.traits.abilities.faces
        for subject in (reference, *candidates)
    )
    return tuple(subject.name for subject, there in zip(candidates, others, strict=True) if there != faces)


def _with_cases(
    every: Sequence[Differing],
    properties: Sequence[Property],
    result: Run,
    place: Interface | Case | None,
) -> tuple[Differing, ...]:
    """Return the differing outcomes with their cases; a run of many examples does not keep them all."""
    facts = result.provenance
    sampling = Sampling.at(place, int(facts["examples"]), int(facts["seed"]))
    question_of = {question.id: question for question in properties}
    complete = []
    for differing in every:
        question, number = question_of[differing.info.id], differing.number
        outcome = with_case(sampling, question, number, differing.outcome)
        reference_outcome = replace(differing.reference_outcome, case_or_summary=outcome.case)
        complete.append(replace(differing, outcome=outcome, reference_outcome=reference_outcome))
    return tuple(complete)


def find_differing(result: Run, comparison: Comparison) -> tuple[Differing, ...]:
    """Return for each property the case on which a candidate differs most from the reference.

    The largest difference comes first. Cases on which one passes and the other does not stand before those where both
    fail.
    """
    rows = result.row_of
    largest = []
    for property_id in comparison.properties:
        every = list(_candidates(rows, comparison, property_id))
        if every:
            largest.append(max(every, key=_rank))
    return tuple(sorted(largest, key=_rank, reverse=True))


def _candidates(rows: Mapping[tuple[str, str], Row], comparison: Comparison, property_id: str) -> Iterator[Differing]:
    """Yield for each candidate the case on which it differs most."""
    reference = comparison.reference
    for name in comparison.formulations[1:]:
        paired = comparison.paired.get((name, property_id))
        if paired is None:
            continue
        row, reference_row = rows[name, property_id], rows[reference, property_id]
        cells = comparison.cells[name, property_id], comparison.cells[reference, property_id]
        number = paired.furthest(cells[0].kinds[:, :2].sum(axis=1))
        if number is None:
            continue
        yield Differing(
            info=row.info,
            formulation=name,
            number=number,
            apart=bool(paired.apart[number]),
            decades=float(paired.decades[number]),
            margin=float(cells[0].standing[number]),
            reference_margin=float(cells[1].standing[number]),
            outcome=row.outcomes[number],
            reference_outcome=reference_row.outcomes[number],
        )


def _rank(differing: Differing) -> tuple[Any, ...]:
    far = inf if isnan(differing.decades) else float(np.abs(differing.decades))
    return differing.apart, far


def _name(candidate: Subject | NotLoaded) -> str:
    return candidate.name if isinstance(candidate, Subject) else candidate.formulation
