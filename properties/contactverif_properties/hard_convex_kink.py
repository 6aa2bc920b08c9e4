"""Ask whether a slave node that crosses the bisector of a convex vertex feels a sound force on either side.

**Question.** The master is a roof with a kink of 0.1, 0.5 or 1.5 rad, and the slave is a parallel roof below it. Its
vertex is on the bisector, or 1e-3 to 1e-12 to either side. Is the total force what the gap says, and does it point
between the two normals?

**Why it matters.** Where two segments are nearly equally near, one code takes neither, one takes both, and one averages
to a direction outside the two. The sliding body then jumps or sticks at each vertex.

**How it is judged.** The direction of a node's force may jump by the kink's angle as it crosses, since the nearest
segment does. What every right formulation fulfils: each push is along a normal between those of the two segments, and
each side has one gap, d cos a ∓ δ sin a (a half of the kink, d the depth straight down, δ the distance from the
bisector). So where `penalty` and `area` are stated, the vertical force is ε̂ L cos a times a number between these two
gaps, on both sides of the bisector: as δ goes to 0 it is continuous. A formulation that states no rule for gaps may
look straight up at the vertex, and is allowed the gap d there. The tolerance is u(8X/min(|g|, ℓ) + 4N).

**Undecided.** Never: on the bisector itself the bounds allow for either segment.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.hard_corner_states import convex_kink_states
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.bounded_forces import BOUNDED_QUANTITIES, measure_bounded, promise_bounds
from contactverif_properties.shared.finite_lists import unless_given

HARD_CONVEX_KINK = Property(
    id="hard.convex-kink",
    family="hard",
    summary="A slave node that passes a convex master vertex within 1e-12 feels no wild force.",
    quantities=BOUNDED_QUANTITIES,
    cases=unless_given(convex_kink_states),
    measure=measure_bounded,
    promise=promise_bounds,
    applicable=refuse_barrier,
)
