"""Ask whether forces stay right far from the origin, where gaps are small differences of large coordinates.

**Question.** A flat interface with lengths near 1 lies 1e6, 1e8 or 2^10 away from the origin, and penetrates by 1e-6,
1e-9, or one step of the doubles. Are the forces those of the gap that the stored numbers say?

**Why it matters.** Users work in millimetres, with coordinates of a site or of a whole machine. A kernel that rounds a
point where it is, and then subtracts a node, loses the gap. At 1e6 and a gap of 1e-6 that costs a part in 1e4 of the
force, and nobody sees it.

**How it is judged.** The states are flat to the last bit: upright, or turned by a Pythagorean triple, with coordinates
of few enough bits. So the stored gap is uniform, and the forces are exact in rationals. Near 1e8 the stored gap is not
the one that was asked for, and the stored one counts. What is asked depends on the traits: no force along the surface
(everybody), the total (who states `penalty` and `area`), each nodal force (unless `passes_flat_patch` is False). The
tolerance is u(8Z/|g| + 4N). Z is the diameter D of the interface for whoever says `translation_stable`, and the largest
coordinate X for everybody else.

**Undecided.** The case whose gap is one step of the doubles is undecided without that promise: there the tolerance is
more than the force.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.hard_flat_states import offset_states
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.flat_forces import (
    FLAT_QUANTITIES,
    exact_forces,
    measure_flat,
    promise_flat_forces,
)

HARD_OFFSET = Property(
    id="hard.offset",
    family="hard",
    summary="Far from the origin, with gaps of 1e-6 to 1e-9, forces are those of the stored positions.",
    quantities=FLAT_QUANTITIES,
    cases=unless_given(offset_states),
    measure=measure_flat,
    promise=promise_flat_forces,
    applicable=refuse_barrier,
    exact=exact_forces,
)
