"""Ask whether the solved patch test holds in unusual set-ups: rigid, unequal, inclined, slid, or under a punch.

**Question.** Does a uniform pressure stay exact on a rigid master, with materials whose stiffness differs by 1e-6 to
1e6, inclined by 1° to 179°, slid to 200 positions, and under a punch that is narrower than its base?

**Why it matters.** Codes that pass the textbook patch test often fail when the interface is inclined, when one body is
rigid, or when nodes nearly coincide. These are the everyday cases of an engineer.

**How it is judged.** As in `patch.flat.solve`, at ε̂ = 10 E/h alone, with the same tolerances.

**Undecided.** Never, as in `patch.flat.solve`.
"""

from __future__ import annotations

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.strategies.solids import variant_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.solved_patch import MULTIPLIERS, QUANTITIES, forces_to_draw, measure_once


def measure_variant(case: Case, subject: Subject) -> Measurement:
    """Solve a scene in an unusual set-up at its own penalty, or with multipliers, and return the errors.

    Parameters
    ----------
    case : Case
        A uniform scene.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The errors of `measure_once`, all dimensionless.
    """
    return measure_once(case, subject)


PATCH_VARIANTS = Property(
    id="patch.variants",
    family="patch",
    summary="A uniform pressure stays exact with a rigid master, unequal materials, an inclined interface or a punch.",
    quantities=(*QUANTITIES, MULTIPLIERS),
    cases=variant_cases,
    measure=measure_variant,
    promise=lambda traits: traits.passes_flat_patch,
    applicable=refuse_barrier,
    bodies=True,
    exact=forces_to_draw,
)
