"""Ask whether that still holds where the interface stays curved, so that facets of both meshes cross.

**Question.** The bodies of `accuracy.wavy` fit along a wave of 1e-6 of their size. Do nodal forces, pressures and
displacements converge there too, at a moderate and at a high penalty?

**Why it matters.** On a curved interface the facets of two meshes do not lie on one another. At 100 E/h the distance
between them is up to ten times the penetration. A method that presses every point of every facet then carries the load
on the few places where facets cross: it locks. Its pressures are wrong by half of their own size and more, on any mesh.

**How it is judged.** As `accuracy.wavy`, with the same exact field: a slope of 1e-6 changes it by as much. Chords leave
a part of the error that falls with h alone, so forces are asked for the rate 1.0, and pressures may be off by
4kh/√24; right ones have at least 1.13 and at most 1.4kh/√24. Displacements and pressures are asked for the rates of
`accuracy.wavy`: right ones have at least 1.89 and 1.28. At 100 E/h the pressures of formulations that lock are off by
0.17 and more, where 0.08 to 0.11 is allowed, or displacements converge with 1.3. The promise is that a formulation
converges (`converges`) and does not lock (`locks`). At 1000 E/h forces of those that lock fall with at most 0.82, but
Newton's method finds no solution for some there. `docs/concepts/accuracy.md` has a picture.

**Undecided.** Where Newton's method finds no solution on one of the meshes.
"""

from __future__ import annotations

from functools import partial

from contactverif.contract.property import Property, Quantity
from contactverif.contract.traits import Traits
from contactverif_properties.shared.applicability import refuse_dependent_multipliers
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.wave_study import (
    FORCE_RATE,
    LAST_PRESSURE,
    MOTION_RATE,
    PRESSURE_RATE,
    SERIES,
    exact_study_forces,
    measure_study,
    study_cases,
)

AMPLITUDE = 1e-6  # A length. Facets of the two meshes are up to this × k²h²/8 apart: 1 to 10 times p/ε̂ at 100 E/h.
STIFFNESSES = (10.0, 100.0)  # The penalties ε̂h/E.
BOUNDS = {FORCE_RATE: 1.0, MOTION_RATE: 1.8, PRESSURE_RATE: 0.9, LAST_PRESSURE: 4.0}


def promise_without_locking(traits: Traits) -> bool | None:
    """Return whether the traits promise convergence without locking; None if they leave one of them open."""
    if traits.converges is False or traits.locks is True:
        return False
    return True if traits.converges and traits.locks is False else None


ACCURACY_WAVY_CURVED = Property(
    id="accuracy.wavy-curved",
    family="accuracy",
    summary="Wavy bodies converge to the exact solution on a curved interface too, at a high penalty as well.",
    quantities=(
        Quantity(FORCE_RATE, "1", "1.0", "Right ones: at least 1.13.", sense="at least"),
        Quantity(MOTION_RATE, "1", "1.8", "The rate of linear elements is 2; right ones: at least 1.89.", "at least"),
        Quantity(PRESSURE_RATE, "1", "0.9", "Constant pressures on segments have the rate 1.", sense="at least"),
        Quantity(
            LAST_PRESSURE,
            "1",
            "4kh/√24",
            "Twice that of `accuracy.wavy`: facets that cross add as much as constant pressures do.",
        ),
    ),
    cases=unless_given(partial(study_cases, AMPLITUDE, STIFFNESSES)),
    measure=partial(measure_study, bounds=BOUNDS),
    promise=promise_without_locking,
    applicable=refuse_dependent_multipliers,
    series=SERIES,
    bodies=True,
    exact=exact_study_forces,
)
