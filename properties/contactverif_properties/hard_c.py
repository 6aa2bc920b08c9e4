"""Ask whether the reference paper's case C, and its variant off the kink, give exact forces and stresses.

**Question.** Two slave segments of 2 and two of 4 lie on four master segments of 3. One area of competence covers two
master segments, and its virtual slave node is exactly on a master node (C), or beside it (C′). Are the forces of a
uniform penetration exact, and is the stress of two blocks under a uniform pressure?

**Why it matters.** It is the smallest mesh on which VTS-ME and its relatives fail the patch test, and the one by which
the paper shows that VTS-PPT passes. In C roundoff decides between two segments in every iteration of Newton's method.

**How it is judged.** The states have the paper's forces, in rationals, and are judged as in `hard.offset`. The scenes
have a master three times as stiff, and ε̂ = E and 1e4 E; they are judged as in `patch.flat.solve`, with its tolerances.
The promise is `passes_flat_patch`.

**Undecided.** Never: on a flat interface both partners of the kink give the same gap.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.hard_scenes import case_c
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.hard_patch import PATCH_QUANTITIES, measure_patch, patch_forces, promise_patch

HARD_C = Property(
    id="hard.c",
    family="hard",
    summary="Cases C and C′ of the reference paper give the exact forces as states, and the exact stress solved.",
    quantities=PATCH_QUANTITIES,
    cases=unless_given(case_c),
    measure=measure_patch,
    promise=promise_patch,
    applicable=refuse_barrier,
    bodies=True,
    exact=patch_forces,
)
