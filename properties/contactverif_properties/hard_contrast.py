"""Ask whether the choice of the slave matters where stiffness and mesh differ much.

**Question.** A block with 8 segments lies on one with 2. Either is the slave, and either is softer by 1e6, or they are
equally stiff. Is the stress of a uniform pressure exact at 10 E/h and at 1e5 E/h?

**Why it matters.** Manuals tell users to take the softer or the finer body as the slave, and warn of locking otherwise.
A formulation that passes the patch test must pass it for every choice.

**How it is judged.** As in `patch.flat.solve`, with its tolerances. The promise is `passes_flat_patch`. Whether
pressures that vary lock is another question, which this one does not answer.

**Undecided.** Never.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.hard_scenes import contrast_scenes
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.hard_patch import PATCH_QUANTITIES, measure_patch, patch_forces, promise_patch

HARD_CONTRAST = Property(
    id="hard.contrast",
    family="hard",
    summary="A uniform pressure stays uniform for any contrast of stiffness and mesh, whichever body is the slave.",
    quantities=PATCH_QUANTITIES,
    cases=unless_given(contrast_scenes),
    measure=measure_patch,
    promise=promise_patch,
    applicable=refuse_barrier,
    bodies=True,
    exact=patch_forces,
)
