"""Candidates against a reference: one run over the same cases, its numbers side by side, the cost of an evaluation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import inf, isnan
from typing import Any

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface
from contactverif.contract.property import Property
from contactverif.contract.result import NotLoaded, Row, Run
from contactverif.contract.subject import Subject
from contactverif.run.profiles import Profile
from contactverif.run.runner import Progress, run
from contactverif.studies.evaluation_cost import measured
from contactverif_reports.compare.comparison import Comparison, Cost, Differing


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """All that a comparison found.

    Attributes
    ----------
    run : Run
        As `verify` would have found it, reference and candidates.
    comparison : Comparison
        Its numbers side by side.
    differing : tuple[Differing, ...]
        A case a property, the largest difference first.
    costs : tuple[Cost, ...]
        Of an evaluation.
    """

    run: Run
    comparison: Comparison
    differing: tuple[Differing, ...]
    costs: tuple[Cost, ...]


def compared(
    reference: Subject,
    candidates: Sequence[Subject | NotLoaded],
    properties: Sequence[Property | NotLoaded],
    *,
    profile: Profile | str = "dev",
    examples: int | None = None,
    seed: int | None = None,
    interface: Interface | None = None,
    scene: Case | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Study:
    """Ask every property of the reference and of the candidates, on the same cases.

    Parameters
    ----------
    profile, examples, seed, interface, scene, progress
        As of `contactverif.run.runner.run`.

    Raises
    ------
    MisuseError
        If the reference is a candidate too, or there is no candidate; and as `run`.
    """
    if not candidates:
        raise MisuseError("NAME", "nothing", f"a formulation to compare with {reference.name}")
    if any(_name(candidate) == reference.name for candidate in candidates):
        raise MisuseError("--against", f"{reference.name}, which is compared too", "another formulation than those")
    found = run(
        [reference, *candidates],
        properties,
        profile=profile,
        examples=examples,
        seed=seed,
        interface=interface,
        scene=scene,
        progress=progress,
    )
    comparison = Comparison.of(found, reference.name)
    loaded = [candidate for candidate in candidates if isinstance(candidate, Subject)]
    return Study(found, comparison, differing(found, comparison), measured([reference, *loaded]))


def differing(found: Run, comparison: Comparison) -> tuple[Differing, ...]:
    """For each property the case on which some candidate differs most from the reference, the largest difference first.

    Cases on which one passes and the other does not stand before those where both fail.
    """
    rows = {(row.formulation, row.question.id): row for row in found.rows}
    chosen = []
    for property_id in comparison.properties:
        every = list(_candidates(rows, comparison, property_id))
        if every:
            chosen.append(max(every, key=_rank))
    return tuple(sorted(chosen, key=_rank, reverse=True))


def _candidates(rows: dict[tuple[str, str], Row], comparison: Comparison, property_id: str) -> Iterator[Differing]:
    reference = comparison.reference
    for name in comparison.formulations[1:]:
        paired = comparison.paired.get((name, property_id))
        if paired is None:
            continue
        row, against = rows[name, property_id], rows[reference, property_id]
        cells = comparison.cells[name, property_id], comparison.cells[reference, property_id]
        number = paired.furthest(cells[0].kinds[:, :2].sum(axis=1))
        if number is None:
            continue
        yield Differing(
            question=row.question,
            formulation=name,
            number=number,
            apart=bool(paired.apart[number]),
            decades=float(paired.decades[number]),
            margin=float(cells[0].standing[number]),
            reference_margin=float(cells[1].standing[number]),
            outcome=row.outcomes[number],
            reference_outcome=against.outcomes[number],
        )


def _rank(one: Differing) -> tuple[Any, ...]:
    far = inf if isnan(one.decades) else float(np.abs(one.decades))
    return one.apart, far


def _name(candidate: Subject | NotLoaded) -> str:
    return candidate.name if isinstance(candidate, Subject) else candidate.formulation
