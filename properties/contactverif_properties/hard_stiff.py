"""Ask whether very stiff springs between very unequal bodies spoil the stress.

**Question.** The penalty is 1e4 or 1e10 E/h, E that of the softer body, and E of the master is 1e-6, 1 or 1e6 times
that of the slave. Is the stress of a uniform pressure still as exact as the condition of the matrix allows?

**Why it matters.** Users raise the penalty until the penetration is small, and press rubber on steel. A tangent that
subtracts large numbers, or a pressure that is computed from a gap near roundoff, then gives noise in place of stress.

**How it is judged.** As in `patch.flat.solve`. Its tolerances contain the condition κ of the matrix and the rounding X
ε̂/p of gaps, so they are wide at 1e10: up to 1 part in 10 for pressures. What is asked there is that nothing is worse
than conditioning, that Newton's method comes near a solution, and that all numbers are finite. The promise is
`passes_flat_patch`.

**Undecided.** Never.
"""

from __future__ import annotations

from contactverif.contract.property import Property
from contactverif.problems.hard_scenes import stiff_scenes
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.hard_patch import PATCH_QUANTITIES, measure_patch, patch_forces, promise_patch

HARD_STIFF = Property(
    id="hard.stiff",
    family="hard",
    summary="Springs of ε̂h/E = 1e10 on bodies whose stiffness differs by 1e6 leave a uniform pressure uniform.",
    quantities=PATCH_QUANTITIES,
    cases=unless_given(stiff_scenes),
    measure=measure_patch,
    promise=promise_patch,
    applicable=refuse_barrier,
    bodies=True,
    exact=patch_forces,
)
