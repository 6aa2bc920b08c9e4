"""Ask whether the search finds the right master segment where other surfaces are near.

**Question.** The slave lies on a flat part of the master. Something else is near: a node that is nearer than those of
the right segment, the other side of a thin plate or of a sharp wedge, a second body behind the first, or the place
where a closed chain begins. Are the forces those of the flat part alone?

**Why it matters.** These are the named failures of projection in the manuals of contact codes. A search that starts
from the nearest node ends on the wrong side of a plate, and pulls where it should push.

**How it is judged.** The flat part is the nearest surface, and the first that the slave's normal meets, for every point
of the slave. So all rules agree, and the exact forces are those of a uniform pressure on it; all other nodes are free.
What is asked, and the tolerance u(8Z/|g| + 4N), are as in `hard.offset`.

**Undecided.** Never.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.hard_flat_states import search_states
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.flat_forces import (
    FLAT_QUANTITIES,
    exact_forces,
    measure_flat,
    promise_flat_forces,
)

HARD_SEARCH = Property(
    id="hard.search",
    family="hard",
    summary="Other surfaces nearby, sharp wedges and the seam of a closed chain do not mislead the search.",
    quantities=FLAT_QUANTITIES,
    cases=unless_given(search_states),
    measure=measure_flat,
    promise=promise_flat_forces,
    applicable=refuse_barrier,
    exact=exact_forces,
)
