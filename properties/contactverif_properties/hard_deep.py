"""Ask whether a deep penetration gives the forces of that penetration.

**Question.** A flat slave penetrates a flat master by half a segment, and by two segments. Are the forces those of the
pressure ε̂ |g|?

**Why it matters.** A first guess of Newton's method, or a large load step, often penetrates that deep. A search that
looks at near segments only, or takes what is deep for the far side of the body, lets the bodies pass through.

**How it is judged.** As in `hard.offset`: flat states that are exact in binary, no force along the surface, the total
and the nodal forces as the traits promise them, with the tolerance u(8Z/|g| + 4N).

**Undecided.** Never.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.hard_flat_states import deep_states
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.flat_forces import (
    FLAT_QUANTITIES,
    exact_forces,
    measure_flat,
    promise_flat_forces,
)

HARD_DEEP = Property(
    id="hard.deep",
    family="hard",
    summary="A penetration of half a segment or two segments gives the forces of that penetration.",
    quantities=FLAT_QUANTITIES,
    cases=unless_given(deep_states),
    measure=measure_flat,
    promise=promise_flat_forces,
    applicable=refuse_barrier,
    exact=exact_forces,
)
