"""Ask whether a tilted slave gets the force of its gap.

**Question.** A straight slave is tilted against a flat master by 3° to 35°, and penetrates it with all its length. Is
the force on the slave ε̂ ∫ |g| ds, along the normal that the traits name?

**Why it matters.** Flat patch tests never tilt a surface. A pressure that falls with the tilt, for example with its
cosine squared, passes all of them, and is wrong on every curved part.

**How it is judged.** The gap is linear along the slave, so its integral is exact for every rule: points with weights
that balance, cells, nodal areas. The trait `gap` names the normal along which gaps are measured, `force_along` that
along which contact pushes, `area` the configuration of ds. The first number is the part of the total force off that
normal, over the total. The second is the error of the total force over its exact size, where `penalty` and `area` are
stated. Multipliers that are pressures are uniform here, and nodal springs are asked for the direction alone. The
tolerance is u(8Z/|g| + 4N), where Z is the diameter of a formulation that promises `translation_stable`, and the
largest coordinate of any other.

**Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X changes
the answer by a quarter of the error or more.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, check_all
from contactverif.contract.subject import Subject
from contactverif.strategies.straight import tilted_cases
from contactverif_properties.shared.kinks import explain_by_kink
from contactverif_properties.shared.linear_gaps import (
    directions,
    exact_slave_forces,
    knows_linear_total,
    node_gaps,
    refuse_unknown_direction,
    slave_forces,
)
from contactverif_properties.shared.roundoff import (
    COORDINATE_ROUNDING,
    gap_tolerance,
    ratio,
    rounding_distance,
    stated_gap_quantity,
)

OFF_NORMAL = stated_gap_quantity("part of the force off the normal")
TOTAL = stated_gap_quantity("error of the total force")


def measure_tilted_resultant(case: Case, subject: Subject) -> Measurement:
    """Compare the total force on a tilted slave with the integral of its gap.

    Parameters
    ----------
    case : Case
        A straight slave that penetrates a flat master with all its length.
    subject : Subject
        A formulation that states `force_along`.

    Returns
    -------
    Measurement
        The part of the total force off its normal over the total, and the error of the total over its exact size;
        both dimensionless. Broken: nothing pushes the slave along its normal.
    """
    traits, total = subject.traits, slave_forces(case, subject).sum(axis=0)
    normal = directions(case)[0 if traits.force_along == "master normal" else 1]
    push, across = float(total @ normal), abs(float(total[0] * normal[1] - total[1] * normal[0]))
    broken = "" if push > 0 else "nothing pushes the slave out of the master"
    size = float(np.linalg.norm(total))
    values = {OFF_NORMAL: ratio(across, size)}
    errors = {OFF_NORMAL: across}
    if knows_linear_total(traits):
        exact = float(np.linalg.norm(exact_slave_forces(case, traits).sum(axis=0)))
        errors[TOTAL] = abs(push - exact)
        values[TOTAL] = errors[TOTAL] / exact
    depth = abs(float(node_gaps(case).mean()))
    tolerance = gap_tolerance(case, depth, rounding_distance(case, traits))
    error = max((error for name, error in errors.items() if values[name] > tolerance), default=0.0)
    undecided = ""
    if error and not subject.for_case(case).n_multipliers(case.interface):
        formulation = subject.for_case(case)
        reach = COORDINATE_ROUNDING * case.largest_coordinate
        pairing = formulation.pair(case.interface, case.z)
        undecided = explain_by_kink(case, formulation, pairing, reach, {"forces": error})
    return Measurement(check_all(values, tolerance), undecided, broken)


TILTED_RESULTANT = Property(
    id="patch.tilted.resultant",
    family="patch",
    summary="A straight slave, tilted against a flat master, gets the force ε̂ ∫ |g| ds along the stated normal.",
    quantities=(OFF_NORMAL, TOTAL),
    cases=tilted_cases,
    measure=measure_tilted_resultant,
    promise=lambda traits: True if traits.force_along else None,
    applicable=refuse_unknown_direction,
)
