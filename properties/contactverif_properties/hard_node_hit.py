"""Ask whether a point that hits a master node, or misses it by one rounding, is counted once.

**Question.** A slave node, a quarter point or the middle of a slave segment lies over a master node exactly, or one
rounding to its left or right. So ξ is 0, 1, −u or 1 + u. Are the forces as if nothing were special there?

**Why it matters.** A point that belongs to both segments is counted twice by one code, and lost by another. Meshes of
two bodies share lines more often than not, so this is the normal case.

**How it is judged.** As in `hard.offset`: the interface is flat, so both segments give the same gap, and the exact
forces are those of a uniform pressure. The tolerance is u(8Z/|g| + 4N).

**Undecided.** Never: whichever segment a formulation takes, the answer is the same.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.hard_flat_states import node_hit_states
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.flat_forces import (
    FLAT_QUANTITIES,
    exact_forces,
    measure_flat,
    promise_flat_forces,
)

HARD_NODE_HIT = Property(
    id="hard.node-hit",
    family="hard",
    summary="A point over a master node, or beside it by one rounding, is counted once.",
    quantities=FLAT_QUANTITIES,
    cases=unless_given(node_hit_states),
    measure=measure_flat,
    promise=promise_flat_forces,
    applicable=refuse_barrier,
    exact=exact_forces,
)
