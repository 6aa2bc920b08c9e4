"""What no choice of axes or units may change: objectivity and scaling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, dense
from contactverif.contract.case import Case
from contactverif.contract.formulation import Traits
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import Subject
from contactverif.strategies import smooth_cases
from contactverif_properties import roundoff
from contactverif_properties.anywhere import any_cases, no_barrier, posed
from contactverif_properties.kinks import excuse

SCALED_REASON = "powers of two scale the four operations and roots exactly; a power or an angle is rounded anew"
TURNED_FORCES = Quantity("turned forces", "1", roundoff.TURNED, roundoff.TURNED_REASON)
TURNED_TANGENT = Quantity("turned tangent", "1", roundoff.TURNED, roundoff.TURNED_REASON)
SCALED_FORCES = Quantity("scaled forces", "1", roundoff.TURNED, SCALED_REASON)
SCALED_TANGENT = Quantity("scaled tangent", "1", roundoff.TURNED, SCALED_REASON)
LARGEST_EXPONENT = 60


def turned(case: Case, subject: Subject) -> Measurement:
    """R(Qx + c) against Q R(x), over Σ|R| of the slave; K(Qx + c) against Q K Qᵀ, over max|K|; Q, c random.

    Of multipliers, which nothing turns, the constraint rows are judged too: everything at once.
    """
    formulation, case = posed(case, subject)
    interface, n = case.interface, case.interface.n_unknowns
    random = np.random.default_rng(case.seed)
    angle = random.uniform(-np.pi, np.pi)
    q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = case.positions @ q.T + random.uniform(-1, 1, 2) * case.diameter
    there = replace(case, z=np.concatenate([moved.reshape(-1), case.z[n:]]))
    pairing, pairing_there = (formulation.pair(interface, state.z) for state in (case, there))
    turn = linalg.block_diag(np.kron(np.eye(interface.n_nodes), q), np.eye(case.n_multipliers))
    forces = formulation.residual(interface, pairing, case.z)
    forces_there = formulation.residual(interface, pairing_there, there.z)

    largest = max(case.largest_coordinate, there.largest_coordinate)
    tolerance = _turned_tolerance(case, forces, largest)
    errors = {"forces": float(np.abs(forces_there - turn @ forces).max())}
    size = roundoff.slave_forces(case, forces) + float(np.abs(forces[n:]).sum())
    values = {TURNED_FORCES.name: roundoff.share(errors["forces"], size)}
    if "tangent" in formulation.provides:
        tangent = dense(formulation.tangent(interface, pairing, case.z))
        tangent_there = dense(formulation.tangent(interface, pairing_there, there.z))
        errors["tangent"] = float(np.abs(tangent_there - turn @ tangent @ turn.T).max())
        values[TURNED_TANGENT.name] = roundoff.share(errors["tangent"], float(np.abs(tangent).max()))
    failing = {
        what: error for (what, error), value in zip(errors.items(), values.values(), strict=True) if value > tolerance
    }
    rounding = 64 * UNIT_ROUNDOFF * largest  # a turn and a shift round each coordinate a few times
    undecided = ""
    if failing:  # slivers may cost more digits in one place than in the other
        undecided = excuse(case, formulation, pairing, rounding, failing)
        undecided = undecided or excuse(there, formulation, pairing_there, rounding, failing)
    return Measurement(values, dict.fromkeys(values, tolerance), undecided, idle=not forces[:n].any())


def scaled(case: Case, subject: Subject) -> Measurement:
    """All lengths × 2^k: R × 2^k and K the same, for a penalty that scales with its unit; bitwise where nothing but the
    four operations and square roots is used, and to roundoff where a power or an angle is.

    A multiplier stays the same if it is a pressure, and scales if it is a nodal force. Of a formulation that has some
    the forces are judged, and their tangent by the positions.
    """
    interface, random = case.interface, np.random.default_rng(case.seed)
    factor, n = 2.0 ** int(random.integers(-LARGEST_EXPONENT, LARGEST_EXPONENT + 1)), interface.n_unknowns
    distributed = subject.traits.penalty == "distributed"
    formulation, case = posed(case, subject)
    z = np.concatenate([case.z[:n] * factor, case.z[n:] * (1.0 if distributed else factor)])
    there = replace(case, interface=interface.at(interface.nodes * factor), z=z)
    penalty = 1.0 if case.n_multipliers else subject.penalty(case)
    rescaled = subject.with_penalty(penalty / (factor if distributed else 1.0))
    pairing, pairing_there = formulation.pair(interface, case.z), rescaled.pair(there.interface, there.z)
    forces = formulation.residual(interface, pairing, case.z)[:n]
    forces_there = rescaled.residual(there.interface, pairing_there, there.z)[:n]
    errors = {"forces": float(np.abs(forces_there / factor - forces).max())}
    values = {SCALED_FORCES.name: roundoff.share(errors["forces"], float(np.abs(forces).max()))}
    if "tangent" in formulation.provides:
        tangent = dense(formulation.tangent(interface, pairing, case.z))[:n, :n]
        tangent_there = dense(rescaled.tangent(there.interface, pairing_there, there.z))[:n, :n]
        errors["tangent"] = float(np.abs(tangent_there - tangent).max())
        values[SCALED_TANGENT.name] = roundoff.share(errors["tangent"], float(np.abs(tangent).max()))
    tolerance = _turned_tolerance(case, forces, case.largest_coordinate)
    failing = {
        what: error for (what, error), value in zip(errors.items(), values.values(), strict=True) if value > tolerance
    }
    rounding = 64 * UNIT_ROUNDOFF * case.largest_coordinate
    undecided = excuse(case, formulation, pairing, rounding, failing) if failing else ""
    return Measurement(values, dict.fromkeys(values, tolerance), undecided, idle=not forces.any())


def _turned_tolerance(case: Case, forces: Array, largest: float) -> float:
    """u(8X/min(g, ℓ) + 4N). Where nothing is in contact any tolerance does: the value is 0 or infinite."""
    penetration = roundoff.mean_penetration(case, forces)
    reach = min(penetration, case.shortest_segment) if penetration > 0 else case.shortest_segment
    return UNIT_ROUNDOFF * (8 * largest / reach + 4 * case.n_segments)


def _penalty_is_stated(traits: Traits) -> str:
    if traits.penalty is None:
        return "the trait `penalty` (nodal or distributed) is not stated, so its unit is unknown"
    return no_barrier(traits)


OBJECTIVITY = Property(
    id="objectivity",
    family="invariants",
    summary="turning and shifting the state turns the forces and the tangent with it",
    quantities=(TURNED_FORCES, TURNED_TANGENT),
    cases=smooth_cases,
    measure=turned,
    promise=lambda traits: True,
    applicable=no_barrier,
)
SCALING = Property(
    id="scaling",
    family="invariants",
    summary="another unit of length changes nothing: no absolute tolerance is hidden",
    quantities=(SCALED_FORCES, SCALED_TANGENT),
    cases=any_cases,
    measure=scaled,
    promise=lambda traits: True,
    applicable=_penalty_is_stated,
)
