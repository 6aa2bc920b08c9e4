"""What no choice of axes or units may change: objectivity and scaling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.arrays import UNIT_ROUNDOFF
from contactverif.case import Case
from contactverif.formulation import Traits
from contactverif.property import Measurement, Property, Quantity
from contactverif.strategies import smooth_cases
from contactverif.subject import Subject
from contactverif_properties import roundoff
from contactverif_properties.anywhere import any_cases
from contactverif_properties.kinks import dense, jump, kink_within

TURNED_FORCES = Quantity("turned forces", "1", roundoff.TURNED, roundoff.TURNED_REASON)
TURNED_TANGENT = Quantity("turned tangent", "1", roundoff.TURNED, roundoff.TURNED_REASON)
SCALED_FORCES = Quantity("scaled forces", "1", "0", "powers of two scale every rounded operation exactly")
SCALED_TANGENT = Quantity("scaled tangent", "1", "0", "powers of two scale every rounded operation exactly")
LARGEST_EXPONENT = 60


def turned(case: Case, subject: Subject) -> Measurement:
    """R(Qx + c) against Q R(x), over Σ|R| of the slave; K(Qx + c) against Q K Qᵀ, over max|K|; Q, c random."""
    formulation, interface = subject.on(case), case.interface
    random = np.random.default_rng(case.seed)
    angle = random.uniform(-np.pi, np.pi)
    q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = case.positions @ q.T + random.uniform(-1, 1, 2) * case.diameter
    there = replace(case, z=moved.reshape(-1))
    pairing, pairing_there = (formulation.pair(interface, state.z) for state in (case, there))
    forces = formulation.residual(interface, pairing, case.z).reshape(-1, 2)
    forces_there = formulation.residual(interface, pairing_there, there.z).reshape(-1, 2)

    largest = max(case.largest_coordinate, there.largest_coordinate)
    penetration = roundoff.mean_penetration(case, forces)
    # Where nothing is in contact, nothing may come of turning: any tolerance does, the value is 0 or infinite.
    reach = min(penetration, case.shortest_segment) if penetration > 0 else case.shortest_segment
    tolerance = UNIT_ROUNDOFF * (8 * largest / reach + 4 * case.n_segments)
    errors = [float(np.abs(forces_there - forces @ q.T).max()), 0.0]
    values = {TURNED_FORCES.name: roundoff.share(errors[0], roundoff.slave_forces(case, forces))}
    if "tangent" in formulation.provides:
        blocks = np.kron(np.eye(interface.n_nodes), q)
        tangent = dense(formulation.tangent(interface, pairing, case.z))
        tangent_there = dense(formulation.tangent(interface, pairing_there, there.z))
        errors[1] = float(np.abs(tangent_there - blocks @ tangent @ blocks.T).max())
        values[TURNED_TANGENT.name] = roundoff.share(errors[1], float(np.abs(tangent).max()))
    undecided = ""
    failing = [number for number, value in enumerate(values.values()) if value > tolerance]
    if failing:
        directions = random.uniform(-1, 1, (4, case.z.size))
        directions /= np.abs(directions).max(axis=1, keepdims=True)
        rounding = 64 * UNIT_ROUNDOFF * largest  # a turn and a shift round each coordinate a few times
        undecided = kink_within(case, formulation, pairing, rounding, directions[0])
        jumps = jump(case, formulation, rounding, directions)
        if not undecided and all(4 * jumps[number] >= errors[number] for number in failing):
            undecided = "a kink: moving the nodes by roundoff changes the answer as much"
    return Measurement(values, dict.fromkeys(values, tolerance), undecided)


def scaled(case: Case, subject: Subject) -> Measurement:
    """All lengths × 2^k: R × 2^k and K the same, bitwise, for a penalty that scales with its unit."""
    interface, random = case.interface, np.random.default_rng(case.seed)
    factor = 2.0 ** int(random.integers(-LARGEST_EXPONENT, LARGEST_EXPONENT + 1))
    there = replace(case, interface=interface.at(interface.nodes * factor), z=case.z * factor)
    formulation = subject.on(case)
    rescaled = subject.with_penalty(
        subject.penalty(case) / (factor if subject.traits.penalty == "distributed" else 1.0)
    )
    pairing, pairing_there = formulation.pair(interface, case.z), rescaled.pair(there.interface, there.z)
    forces = formulation.residual(interface, pairing, case.z)
    forces_there = rescaled.residual(there.interface, pairing_there, there.z)
    largest = float(np.abs(forces).max())
    values = {SCALED_FORCES.name: roundoff.share(float(np.abs(forces_there / factor - forces).max()), largest)}
    if "tangent" in formulation.provides:
        tangent = dense(formulation.tangent(interface, pairing, case.z))
        tangent_there = dense(rescaled.tangent(there.interface, pairing_there, there.z))
        difference = float(np.abs(tangent_there - tangent).max())
        values[SCALED_TANGENT.name] = roundoff.share(difference, float(np.abs(tangent).max()))
    return Measurement(values, dict.fromkeys(values, 0.0))


def _penalty_is_stated(traits: Traits) -> str:
    if traits.enforcement == "penalty" and traits.penalty is None:
        return "the trait `penalty` (nodal or distributed) is not stated, so its unit is unknown"
    return ""


OBJECTIVITY = Property(
    id="objectivity",
    family="invariants",
    summary="turning and shifting the state turns the forces and the tangent with it",
    quantities=(TURNED_FORCES, TURNED_TANGENT),
    cases=smooth_cases,
    measure=turned,
    promise=lambda traits: True,
)
SCALING = Property(
    id="scaling",
    family="invariants",
    summary="another unit of length changes no digit: no absolute tolerance is hidden",
    quantities=(SCALED_FORCES, SCALED_TANGENT),
    cases=any_cases,
    measure=scaled,
    promise=lambda traits: True,
    applicable=_penalty_is_stated,
)
