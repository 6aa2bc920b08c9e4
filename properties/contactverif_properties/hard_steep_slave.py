"""Ask whether a slave segment that stands on the master, or faces away from it, gives a sound force.

**Question.** A slave segment is at 89.9°, 90° or 180° to the master that it penetrates: it stands on it, with either
side in front, or lies in it with its back to it. Is the force finite, bounded, and no pull?

**Why it matters.** A projected length is 0 there, and a gap along the slave's normal is infinite. Thin bodies, edges
and corners meet their masters like that.

**How it is judged.** A formulation may see such a segment or not. What every right formulation fulfils: all numbers are
finite; the force points between the master's normal and the direction into the slave's body (at 180°: along the
master's normal); it is at most ε̂ D L, since no gap is longer than the interface's diameter D. Where `penalty` and
`area` are not stated, springs may act in two passes, and 4 ε̂ D L is allowed.

**Undecided.** Never.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.hard_corner_states import steep_slave_states
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.bounded_forces import BOUNDED_QUANTITIES, measure_bounded, promise_bounds
from contactverif_properties.shared.finite_lists import unless_given

HARD_STEEP_SLAVE = Property(
    id="hard.steep-slave",
    family="hard",
    summary="A slave segment at 89.9°, 90° or 180° to the master gives no wild force and no pull.",
    quantities=BOUNDED_QUANTITIES,
    cases=unless_given(steep_slave_states),
    measure=measure_bounded,
    promise=promise_bounds,
    applicable=refuse_barrier,
)
