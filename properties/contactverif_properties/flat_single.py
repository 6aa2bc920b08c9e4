"""Ask for exact forces, gaps and pressures on flat meshes with master nodes on slave nodes and on midpoints.

**Question.** Two flat surfaces penetrate each other by the same depth everywhere. The master covers the slave, and each
inner master node lies on a slave node or in the middle of a slave segment, as in case B. Are the nodal forces on both
sides, the reported gaps and the reported pressures exact?

**Why it matters.** The area of each quarter point of a slave segment then lies over one master segment. VTS-ME with an
even number of points passes here and fails elsewhere. VTS-G, whose points are elsewhere on the segment, fails here. So
this is the test that tells them apart, and that a VTS-ME with misplaced points cannot pass.

**How it is judged.** As in `patch.flat.normal`, with the same tolerances. The promise is `passes_single_patch`; a
formulation that passes any flat patch test is asked too.

**Undecided.** As in `patch.flat.normal`.

**Source.** Zavarise & De Lorenzis (2009), Fig. 16, Section 5.1.2.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.strategies import single_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.patch_class import CLASS_QUANTITIES, USUAL_UNDECIDED, measure_class, promise_single
from contactverif_properties.shared.uniform_pressure import forces_of_penetration

FLAT_SINGLE = Property(
    id="patch.flat.single",
    family="patch",
    summary="They are exact too where inner master nodes lie in the middle of slave segments.",
    quantities=CLASS_QUANTITIES,
    cases=single_cases,
    measure=measure_class,
    promise=promise_single,
    applicable=refuse_barrier,
    exact=forces_of_penetration,
    usual_undecided=USUAL_UNDECIDED,
)
