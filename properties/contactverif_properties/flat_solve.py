"""Ask whether two elastic blocks under a uniform pressure find the exact stress, at a moderate and at a high penalty.

**Question.** Two random elastic blocks on rollers are pressed together. Are the stress, the forces on both sides, the
gap and the reported pressure the exact ones?

**Why it matters.** This is the patch test as an engineer runs it. The two penalties say different things. At a
moderate penalty a wrong distribution of forces bends the bodies. As the penalty grows, a method that only
interpolates the gap well locks into the right pressure and seems to pass. The slope of the stress error over the
penalty, a detail of every measurement, tells them apart: near 0 the method fails at any penalty, near −1 it passes
because it locks.

**How it is judged.** The blocks cannot strain sideways, so the exact pressure is p = Δ / (H1/M1 + H2/M2 + 1/ε̂).
Stress is compared at the Gauss points over p, nodal forces over p L, heights and reported gaps over p/ε̂, and
reported pressures over p. The tolerance of a stress is 1e-11 + 1e-13 κ + 5e-15/r + 64 u (X ε̂ + M U/ℓ)/p: the
condition of the matrix, the ratio of segments, and the rounding of positions and displacements. The other tolerances
follow from it (`docs/concepts/tolerances.md`). Newton's method differentiates the residual by itself here, so a wrong
tangent does no harm. A formulation with multipliers has no penalty and is asked once; its multipliers are compared
with p.

**Undecided.** Never: where Newton's method ends elsewhere, it starts again at the exact solution, where a formulation
that passes is in balance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.strategies.solids import block_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.solved_patch import (
    MULTIPLIERS,
    QUANTITIES,
    STRESS,
    forces_to_draw,
    measure_at_penalty,
    measure_once,
)

HIGH = 1e3  # The high penalty over the moderate penalty of a case.
SLOPE = "slope over penalties (−1 if it locks)"


def high_name(name: str) -> str:
    """Return the name of a quantity at the high penalty."""
    return f"{name}, high penalty"


def measure_two_penalties(case: Case, subject: Subject) -> Measurement:
    """Solve two blocks at the penalty of the case and at a HIGH one, and return the errors of both.

    Parameters
    ----------
    case : Case
        A uniform scene.
    subject : Subject
        The formulation. One with multipliers has no penalty, and is solved once.

    Returns
    -------
    Measurement
        The quantities of `measure_at_penalty`, and the same again at the high penalty. Details: how each solution
        ended, and the slope of the logarithm of the stress error over that of the penalty.
    """
    if subject.traits.enforcement == "multiplier":
        return measure_once(case, subject)
    moderate = measure_at_penalty(case, subject, case.penalty)
    high = measure_at_penalty(case, subject, HIGH * case.penalty)
    errors = moderate.values[STRESS.name], high.values[STRESS.name]
    slope = float(np.log(errors[1] / errors[0]) / np.log(HIGH)) if min(errors) > 0 else 0.0
    return Measurement(
        {**moderate.values, **_rename_high(high.values)},
        {**moderate.tolerances, **_rename_high(high.tolerances)},
        undecided=moderate.undecided or high.undecided,
        details={**moderate.details, **_rename_high(high.details), SLOPE: slope},
    )


def _rename_high(numbers: Mapping[str, float]) -> dict[str, float]:
    return {high_name(name): number for name, number in numbers.items()}


FLAT_SOLVE = Property(
    id="patch.flat.solve",
    family="patch",
    summary="Two elastic blocks under a uniform pressure find the exact stress, forces and gap at two penalties.",
    quantities=(
        *QUANTITIES,
        *(replace(quantity, name=high_name(quantity.name)) for quantity in QUANTITIES),
        MULTIPLIERS,
    ),
    cases=block_cases,
    measure=measure_two_penalties,
    promise=lambda traits: traits.passes_flat_patch,
    applicable=refuse_barrier,
    bodies=True,
    exact=forces_to_draw,
)
