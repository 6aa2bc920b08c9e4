"""Ask whether another unit of length changes nothing.

**Question.** All lengths are multiplied by 2^k, for a random k from −60 to 60. Are the forces 2^k times the old ones,
and is the tangent the same, for a penalty that changes with its unit?

**Why it matters.** A code with an absolute tolerance hidden in it, such as 1e-6 for "touching", works in millimetres
and fails in metres or micrometres.

**How it is judged.** Differences of the forces count over max|R|, those of the tangent over max|K|. The tolerance is
u(8Z/min(g, ℓ) + 4N), where Z is the diameter of a formulation that promises `translation_stable`, and the largest
coordinate of any other. Powers of two scale the four operations and square roots exactly, so a formulation that uses
nothing else gives 0; a power or an angle is rounded anew. A multiplier stays the same if it is a pressure, and scales
if it is a nodal force. Of a formulation with multipliers only the position rows are compared.

**Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X changes
the answer by a quarter of the error or more.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif_properties.shared.any_state import any_cases, prepare_state
from contactverif_properties.shared.applicability import refuse_unstated_penalty
from contactverif_properties.shared.forces_and_tangents import ask_forces_and_tangents
from contactverif_properties.shared.kinks import explain_by_kink
from contactverif_properties.shared.roundoff import (
    COORDINATE_ROUNDING,
    ratio,
    rounding_distance,
    segment_tolerance,
    select_failures,
)

REASON = "Powers of two scale the four operations and square roots exactly. A power or an angle is rounded anew."
TOLERANCE = "u(8Z/min(g, ℓ) + 4N)"
FORCES = Quantity("error of the forces in another unit", "1", TOLERANCE, REASON)
TANGENT = Quantity("error of the tangent in another unit", "1", TOLERANCE, REASON)
LARGEST_EXPONENT = 60


def measure_scaling(case: Case, subject: Subject) -> Measurement:
    """Compare forces and tangent in another unit of length with those of the state.

    Parameters
    ----------
    case : Case
        A random state.
    subject : Subject
        A formulation whose trait `penalty` says which unit the penalty has.

    Returns
    -------
    Measurement
        The largest difference of a force over max|R|, and of an entry of the tangent over max|K|; both dimensionless.
    """
    interface, random = case.interface, np.random.default_rng(case.seed)
    factor, n = 2.0 ** int(random.integers(-LARGEST_EXPONENT, LARGEST_EXPONENT + 1)), interface.n_unknowns
    distributed = subject.traits.penalty == "distributed"
    formulation, case = prepare_state(case, subject)
    z = np.concatenate([case.z[:n] * factor, case.z[n:] * (1.0 if distributed else factor)])
    there = replace(case, interface=interface.at(interface.nodes * factor), z=z)
    penalty = 1.0 if case.n_multipliers else subject.penalty(case)
    rescaled = subject.with_penalty(penalty / (factor if distributed else 1.0))
    pairing, pairing_there = formulation.pair(interface, case.z), rescaled.pair(there.interface, there.z)
    (forces,), tangents = ask_forces_and_tangents(formulation, (interface, pairing, case.z))
    (forces_there,), tangents_there = ask_forces_and_tangents(rescaled, (there.interface, pairing_there, there.z))
    forces, forces_there = forces[:n], forces_there[:n]
    errors = {"forces": float(np.abs(forces_there / factor - forces).max())}
    values = {FORCES: ratio(errors["forces"], float(np.abs(forces).max()))}
    if tangents:
        tangent, tangent_there = tangents[0][:n, :n], tangents_there[0][:n, :n]
        errors["tangent"] = float(np.abs(tangent_there - tangent).max())
        values[TANGENT] = ratio(errors["tangent"], float(np.abs(tangent).max()))
    tolerance = segment_tolerance(case, forces, rounding_distance(case, subject.traits))
    failures = select_failures(errors, values, tolerance)
    rounding = COORDINATE_ROUNDING * case.largest_coordinate
    undecided = explain_by_kink(case, formulation, pairing, rounding, failures) if failures else ""
    return Measurement(check_all(values, tolerance), undecided, idle=not forces.any())


SCALING = Property(
    id="scaling",
    family="invariants",
    summary="Another unit of length changes nothing, so no absolute tolerance is hidden.",
    quantities=(FORCES, TANGENT),
    cases=any_cases,
    measure=measure_scaling,
    promise=lambda traits: True,
    applicable=refuse_unstated_penalty,
)
