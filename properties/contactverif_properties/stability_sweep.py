"""Ask whether the error of the forces stays in proportion to the condition number, on named states that get harder.

**Question.** A flat interface lies turned and far from the origin, with gaps down to 1e-12, segments down to 1e-9 and
offsets up to 1e9. Is the error of each nodal force at most sixteen times what rounding the positions relative to one
another would change?

**Why it matters.** A small gap is a difference of nearly equal coordinates. Then digits are lost in any formulation,
and the condition number says how many. A kernel that rounds a point at its distance from the origin loses more. No
test near the origin shows that, and in a model in global coordinates it looks like bad contact.

**How it is judged.** The same state, flat and at the origin, is the reference: there every product is nearly exact. It
is turned by a rational rotation and shifted, and neither rounds anything. Both residuals are evaluated on the pairing
of the flat state. The error is counted in roundings, ω (see the shared measure of conditioning). The tolerance is 16.
The states are a finite list, and `contactverif stability` draws them. Besides ω, the error and the condition number of
the worst force are kept.

**Undecided.** Never, since no decision is made anew. A formulation without `pair` decides anew inside its residual. One
that prefers an axis fails in every state: look at `objectivity` first.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.contract.interface import Interface
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.problems.stability_states import stability_states
from contactverif_properties.shared.any_state import prepare_state
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.conditioning import forces_quantity, measure_conditioning
from contactverif_properties.shared.exact_motions import ExactMotion
from contactverif_properties.shared.sweep_measurement import make_sweep_measurement

ROUNDINGS = forces_quantity("error of a force in roundings")


@random_source("contactverif_properties.stability_sweep.sweep_cases")
def sweep_cases(interface: Interface | None = None) -> tuple[Case, ...] | None:
    """Return the named states; None on a given interface, which has none of them."""
    return stability_states() if interface is None else None


def move_state(case: Case) -> Case:
    """Return the state after its exact motion, multipliers included.

    Parameters
    ----------
    case : Case
        A state with the parameters "turn" and "shift", as it lies flat at the origin.
    """
    motion = ExactMotion.from_case(case)
    positions = motion.move(case.positions)
    z = np.concatenate([positions.reshape(-1), case.multipliers])
    return replace(case, interface=case.interface.at(motion.move(case.interface.nodes)), z=z)


def measure_sweep(case: Case, subject: Subject) -> Measurement:
    """Compare the residual of a moved state with the moved residual of the state at the origin.

    Parameters
    ----------
    case : Case
        A state from `stability_states`.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The number of roundings ω, dimensionless. Details: the relative error and the condition number of the worst row,
        and the largest error of a force over the largest force.
    """
    formulation, case = prepare_state(case, subject)
    n = case.interface.n_unknowns
    pairing = formulation.pair(case.interface, case.z)
    forces = formulation.residual(case.interface, pairing, case.z)
    there = move_state(case)
    forces_there = formulation.residual(there.interface, pairing, there.z)
    expected: FloatArray = np.array(forces)
    expected[:n] = ExactMotion.from_case(case).turn(forces[:n].reshape(-1, 2)).reshape(-1)
    conditioning = measure_conditioning(case, formulation, pairing, forces)
    return make_sweep_measurement(ROUNDINGS, conditioning, forces_there - expected, idle=not forces.any())


STABILITY_SWEEP = Property(
    id="stability.sweep",
    family="stability",
    summary="Small gaps, short segments and a place far away cost no more digits than the condition number says.",
    quantities=(ROUNDINGS,),
    cases=sweep_cases,
    measure=measure_sweep,
    promise=lambda traits: traits.translation_stable,
    applicable=refuse_barrier,
)
