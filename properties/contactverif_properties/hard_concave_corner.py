"""Ask whether a corner that sits in a re-entrant corner is pushed by both faces.

**Question.** The corner of the slave penetrates both faces of a 90° corner of the master. Its node is equally far from
both, or nearer to one by a rounding. Are both faces felt, and is the node counted once?

**Why it matters.** The foot of that node lies on neither face. A code that asks for a foot inside a segment loses the
node, and the body falls into the corner. Another one counts it twice.

**How it is judged.** All gaps are d. Normals are along the axes, so the sum of both components of the total force is ε̂
d times the area that is felt: that of the parts that face a face along its normal at least, and the slave's length at
most. A formulation that states no rule for gaps may push along the diagonal, and may lose what is at the node alone. No
force pulls. The tolerance is u(8X/min(|g|, ℓ) + 4N). Totals are asked where `penalty` and `area` are stated, directions
of everybody.

**Undecided.** Never: which face takes the node is left open by the bounds.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.hard_corner_states import concave_corner_states
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.bounded_forces import BOUNDED_QUANTITIES, measure_bounded, promise_bounds
from contactverif_properties.shared.finite_lists import unless_given

HARD_CONCAVE_CORNER = Property(
    id="hard.concave-corner",
    family="hard",
    summary="A corner in a re-entrant corner of 90° is pushed by both faces, whichever is nearer by a rounding.",
    quantities=BOUNDED_QUANTITIES,
    cases=unless_given(concave_corner_states),
    measure=measure_bounded,
    promise=promise_bounds,
    applicable=refuse_barrier,
)
