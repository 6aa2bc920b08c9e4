"""Ask whether a slave that ends at, past or beyond the master's free end feels a sound force.

**Question.** The first node of the slave is at the free end of a flat master, a rounding beside it, or up to half a
segment past it; or the slave is wholly outside. Is the total force between that of the segments that surely face the
master and that of all, and 0 outside?

**Why it matters.** A body that slides off an edge passes all these states. A master that is continued past its end
holds it in the air.

**How it is judged.** How far past an end a point still counts is a choice, such as the option τ. The jump of the force
as a point crosses that distance is the force of the point, so it is no more than that of its segment. Hence where
`penalty` and `area` are stated, the total is at least ε̂ |g| times the length of the other segments, and at most that
of the whole slave. The detail `share of the upper bound` shows the jump: compare the cases 0.0099 and 0.0101 past the
end for τ = 0.01. A slave wholly outside, by the length of a segment or more, must feel exactly nothing, whatever the
formulation. The tolerance is u(8X/min(|g|, ℓ) + 4N).

**Undecided.** Never: what a formulation may choose is inside the bounds.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.hard_corner_states import free_end_states
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.bounded_forces import BOUNDED_QUANTITIES, measure_bounded, promise_bounds
from contactverif_properties.shared.finite_lists import unless_given

HARD_FREE_END = Property(
    id="hard.free-end",
    family="hard",
    summary="At a free end the force is between that of the inner segments and that of all; beyond it is 0.",
    quantities=BOUNDED_QUANTITIES,
    cases=unless_given(free_end_states),
    measure=measure_bounded,
    promise=promise_bounds,
    applicable=refuse_barrier,
)
