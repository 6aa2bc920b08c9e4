"""Ask for exact forces, gaps and pressures on flat meshes whose inner master nodes all lie on slave nodes.

**Question.** Two flat surfaces penetrate each other by the same depth everywhere. The master covers the slave, and each
inner master node lies on a slave node, as in cases A1 and A2. Are the nodal forces on both sides, the reported gaps and
the reported pressures exact?

**Why it matters.** Many formulations state that they fail the general patch test, and a general test cannot tell
whether they fail as their theory says or by a mistake. On this class NTS-AR, VTS-G and VTS-ME are exact too, because
the master's shape functions are linear along each slave segment. So a wrong area of competence shows, a wrong weight, a
wrong sign of what is reported.

**How it is judged.** The measured numbers are the largest |F − F_exact| / (ε̂ |g| L) over the nodes of both surfaces,
the largest error of a reported gap over |g|, and that of a reported pressure over ε̂ |g|. The exact forces are computed
in rationals. The tolerance is u(8X/|g| + 4N), as in `patch.flat.transmission`, and multipliers are judged as there. The
promise is `passes_normal_patch`; a formulation that passes any flat patch test is asked too.

**Undecided.** A failing case is undecided where a slave node faces a free end of the master exactly, and roundoff
decides whether the node is over the master.

**Source.** Zavarise & De Lorenzis (2009), Figs. 8 and 11, Section 4.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.strategies import normal_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.patch_class import CLASS_QUANTITIES, USUAL_UNDECIDED, measure_class, promise_normal
from contactverif_properties.shared.uniform_pressure import forces_of_penetration

FLAT_NORMAL = Property(
    id="patch.flat.normal",
    family="patch",
    summary="Forces, gaps and pressures are exact on flat meshes with each inner master node on a slave node.",
    quantities=CLASS_QUANTITIES,
    cases=normal_cases,
    measure=measure_class,
    promise=promise_normal,
    applicable=refuse_barrier,
    exact=forces_of_penetration,
    usual_undecided=USUAL_UNDECIDED,
)
