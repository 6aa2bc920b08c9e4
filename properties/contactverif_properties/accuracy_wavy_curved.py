"""Ask whether that still holds where the interface stays curved, so that facets of both meshes cross.

**Question.** The bodies of `accuracy.wavy` fit along a wave of 1e-6 of their size. Do nodal forces, pressures and
displacements converge there too, at a moderate and at a high penalty?

**Why it matters.** On a curved interface the facets of two meshes do not lie on one another. At 100 E/h the distance
between them is up to ten times the penetration. A method that presses every point of every facet then carries the load
on the few places where facets cross: it locks. Its pressures are wrong by half of their own size and more, on any mesh.

**How it is judged.** As `accuracy.wavy`, with the same exact field: a slope of 1e-6 changes it by as much. Chords leave
a part of the error that falls with h alone, so less is asked of the rate of forces and of the size of pressures; right
ones have at least 1.13 and at most 1.4kh/√24. Displacements and pressures are asked for the rates of `accuracy.wavy`:
right ones have at least 1.89 and 1.28. At 100 E/h the pressures of formulations that lock are off by 0.17 and more,
where 0.08 to 0.11 is allowed, or displacements converge with 1.3. The promise is that a formulation
converges (`converges`) and does not lock (`locks`). At 1000 E/h forces of those that lock fall with at most 0.82, but
Newton's method finds no solution for some there. `docs/concepts/accuracy.md` has a picture.

**Undecided.** Where Newton's method finds no solution on one of the meshes.
"""

from __future__ import annotations

from functools import partial

from contactverif.contract.property import Property
from contactverif.contract.traits import Traits
from contactverif.problems.wavy import CURVED_STUDIES
from contactverif_properties.shared.applicability import refuse_dependent_multipliers
from contactverif_properties.shared.convergence import exact_forces, measure_convergence
from contactverif_properties.shared.finite_lists import unless_given


def promise_without_locking(traits: Traits) -> bool | None:
    """Return whether the traits promise convergence without locking; None if they leave one of them open."""
    if traits.converges is False or traits.locks is True:
        return False
    return True if traits.converges and traits.locks is False else None


ACCURACY_WAVY_CURVED = Property(
    id="accuracy.wavy-curved",
    family="accuracy",
    summary="Wavy bodies converge to the exact solution on a curved interface too, at a high penalty as well.",
    quantities=CURVED_STUDIES.quantities,
    cases=unless_given(CURVED_STUDIES.cases),
    measure=partial(measure_convergence, CURVED_STUDIES),
    promise=promise_without_locking,
    applicable=refuse_dependent_multipliers,
    series=dict.fromkeys(CURVED_STUDIES.series, "1"),
    bodies=True,
    exact=partial(exact_forces, CURVED_STUDIES),
)
