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

**Undecided.** Never: Newton's method starts at the exact solution, where a formulation that passes is in balance.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.strategies.solids import block_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.solved_patch import forces_to_draw
from contactverif_properties.shared.two_penalties import TWO_PENALTIES, measure_two_penalties

FLAT_SOLVE = Property(
    id="patch.flat.solve",
    family="patch",
    summary="Two elastic blocks under a uniform pressure find the exact stress, forces and gap at two penalties.",
    quantities=TWO_PENALTIES,
    cases=block_cases,
    measure=measure_two_penalties,
    promise=lambda traits: traits.passes_flat_patch,
    applicable=refuse_barrier,
    bodies=True,
    exact=forces_to_draw,
)
