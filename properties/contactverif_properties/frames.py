"""Properties about the frame in which a state is described: its unit of length, and its rotation."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.interface import PLANE
from contactverif.contract.measurement import Measurement, Quantity
from contactverif.contract.property import WITH_BARRIER, Property
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.strategies import smooth_cases
from contactverif.strategies.surfaces import smooth_surface_cases, surface_cases
from contactverif_properties.shared import roundoff
from contactverif_properties.shared.any_state import any_cases, ask_forces_and_tangents, freeze_state
from contactverif_properties.shared.applicability import refuse_unstated_penalty
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.same_answer import Change, judge_changes

POWERS_OF_TWO = "Powers of two scale the four operations and square roots exactly. A power or an angle is rounded anew."
SCALED_TOLERANCE = "u(8Z/min(g, ℓ) + 4N)"
SCALED_FORCES = Quantity("error of the forces in another unit", SCALED_TOLERANCE, POWERS_OF_TWO)
SCALED_TANGENT = Quantity("error of the tangent in another unit", SCALED_TOLERANCE, POWERS_OF_TWO)
LARGEST_EXPONENT = 60
TURNED_FORCES = Quantity("error of the forces after a rotation", roundoff.SEGMENT_TOLERANCE, roundoff.SEGMENT_REASON)
TURNED_TANGENT = Quantity("error of the tangent after a rotation", roundoff.SEGMENT_TOLERANCE, roundoff.SEGMENT_REASON)


def refuse_unknown_unit(traits: Traits) -> str:
    """Return why the number of the penalty in another unit of length is unknown, or an empty string."""
    if traits.rules.enforcement != "barrier":
        return refuse_unstated_penalty(traits)
    if traits.rules.activation_unit == "length":
        return "the activation distance of the barrier is a length, which another unit would change"
    return "" if traits.rules.penalty_power is not None else "the barrier does not state the trait `penalty_power`"


def penalty_power(traits: Traits, dim: int = PLANE) -> float:
    """Return the power of a length in the penalty, so that forces grow with lengths and the tangent stays."""
    if traits.rules.enforcement == "barrier":
        return traits.rules.penalty_power or 0.0
    return float(1 - dim) if traits.rules.penalty == "distributed" else 0.0


_define = partial(Property.define, family="invariants", promise=lambda traits: True, asks=WITH_BARRIER)


@_define(
    id="units",
    rank=180,
    role="comparison",
    turn=3,
    quantities=(SCALED_FORCES, SCALED_TANGENT),
    cases=Cases.random(any_cases),
    cases_in_space=Cases.random(surface_cases),
    applicable=refuse_unknown_unit,
)
def units(case: Case, subject: Subject) -> Measurement:
    """Another unit of length changes nothing, so no absolute tolerance is hidden.

    **Question.** All lengths are multiplied by 2^k, for a random k from −60 to 60. Are the forces 2^k times the old
    ones, and is the tangent the same, for a penalty that changes with its unit?

    **Why it matters.** A code with an absolute tolerance hidden in it, such as 1e-6 for "touching", works in
    millimetres and fails in metres or micrometres.

    **How it is judged.** Differences of the forces count over max|R|, those of the tangent over max|K|. The tolerance
    is u(8Z/min(g, ℓ) + 4N), where Z is the diameter of a formulation that promises `translation_stable`, and the
    largest coordinate of any other. Powers of two scale the four operations and square roots exactly, so a formulation
    that uses nothing else gives 0; a power or an angle is rounded anew. A multiplier stays the same if it is a
    pressure, and scales if it is a nodal force. Of a formulation with multipliers only the position rows are compared.

    **Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X
    changes the answer by a quarter of the error or more.
    """
    interface, random, dim = case.interface, np.random.default_rng(case.seed), case.interface.dim
    factor, n = 2.0 ** int(random.integers(-LARGEST_EXPONENT, LARGEST_EXPONENT + 1)), interface.n_unknowns
    distributed = subject.traits.rules.penalty == "distributed"
    state = freeze_state(case, subject)
    case, z = state.case, state.case.z
    z_there = np.concatenate([z[:n] * factor, z[n:] * (1.0 if distributed else factor)])
    case_there = replace(case, interface=interface.at(interface.nodes * factor), z=z_there)
    penalty = 1.0 if case.n_multipliers else subject.penalty(case)
    there = FrozenState.at(
        subject.with_penalty(penalty * factor ** penalty_power(subject.traits, interface.dim)), case_there
    )
    (forces,), tangents = ask_forces_and_tangents(state)
    (forces_there,), tangents_there = ask_forces_and_tangents(there)
    forces, forces_there = forces[:n], forces_there[:n]
    changes = [Change("forces", SCALED_FORCES, forces_there / factor - forces, float(np.abs(forces).max()))]
    if tangents:
        tangent, tangent_there = tangents[0][:n, :n], tangents_there[0][:n, :n]
        changes.append(
            Change("tangent", SCALED_TANGENT, tangent_there - tangent, float(np.abs(tangent).max()), dim=dim)
        )
    tolerance = roundoff.segment_tolerance(case, forces, roundoff.rounding_distance(case, subject.traits))
    return Measurement(*judge_changes(changes, tolerance, [state]), idle=not forces.any())


def turn_state(case: Case) -> tuple[Case, FloatArray]:
    """Return a case with the nodes at Qx + c, and the rotation Q (dim, dim), both random by the seed of the case."""
    random = np.random.default_rng(case.seed)
    rotation = _draw_rotation(random, case.interface.dim)
    positions = case.positions @ rotation.T + random.uniform(-1, 1, case.interface.dim) * case.diameter
    return replace(case, z=np.concatenate([positions.reshape(-1), case.multipliers])), rotation


def _draw_rotation(random: np.random.Generator, dim: int) -> FloatArray:
    """Return a rotation (dim, dim): by a random angle in the plane, and of a random quaternion in space."""
    if dim == PLANE:
        angle = random.uniform(-np.pi, np.pi)
        return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    quaternion = random.normal(size=4)
    a, *axis = quaternion / np.linalg.norm(quaternion)
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: FloatArray = np.eye(3) + 2 * a * cross + 2 * cross @ cross
    return rotation


@_define(
    id="objectivity",
    rank=100,
    role="comparison",
    quantities=(TURNED_FORCES, TURNED_TANGENT),
    cases=Cases.random(smooth_cases),
    cases_in_space=Cases.random(smooth_surface_cases),
    applicable=lambda traits: (
        "normals are those of the reference configuration" if traits.abilities.motions == "small" else ""
    ),
    usual_undecided=0.003,
)
def objectivity(case: Case, subject: Subject) -> Measurement:
    """Turning and shifting the state turns the forces and the tangent with it.

    **Question.** A random state is turned by a random angle and shifted. Are the forces and the tangent the old ones,
    turned?

    **Why it matters.** A formulation that prefers an axis gives another answer for the same part in another position in
    the assembly. In large rotations it creates energy.

    **How it is judged.** The forces R(Qx + c) are compared with Q R(x) over Σ|R| of a side, and the tangent K(Qx + c)
    with Q K Qᵀ over max|K|. Nothing turns multipliers; their constraint rows are compared too. The tolerance is
    u(8X/min(g, ℓ) + 4N): a gap is a difference of coordinates, and rounding the ends of a segment turns the segment and
    its force by uX/ℓ. X stands here for every formulation, because the harness itself rounds the turned positions to
    uX. Where springs act twice, in two passes, half of the penetration g needs the same forces.

    **Undecided.** A failing case is undecided where either state lies at a kink, or where moving the nodes by 64 u X
    changes the answer by a quarter of the error or more.
    """
    state = freeze_state(case, subject)
    case, n = state.case, case.interface.n_unknowns
    case_there, rotation = turn_state(case)
    there = FrozenState.at(state.formulation, case_there)
    turn = linalg.block_diag(np.kron(np.eye(case.interface.n_nodes), rotation), np.eye(case.n_multipliers))
    (forces, forces_there), tangents = ask_forces_and_tangents(state, there)

    largest = max(case.largest_coordinate, case_there.largest_coordinate)
    # Where springs act twice, in two passes, half of the penetration needs the same forces.
    n_passes = len(list(state.passes)) if subject.traits.rules.area is None and state.has_points else 1
    one_pass = forces / n_passes
    tolerance = roundoff.segment_tolerance(case, one_pass, largest)
    size = roundoff.sum_larger_forces(case, forces) + float(np.abs(forces[n:]).sum())
    changes = [Change("forces", TURNED_FORCES, forces_there - turn @ forces, size)]
    if tangents:
        tangent, tangent_there = tangents
        change = tangent_there - turn @ tangent @ turn.T
        size = float(np.abs(tangent).max())
        changes.append(Change("tangent", TURNED_TANGENT, change, size, dim=case.interface.dim))
    # Slivers may cost more digits in one place than in the other, so that both are looked at.
    numbers, undecided = judge_changes(changes, tolerance, [state, there], largest)
    return Measurement(numbers, undecided, idle=not forces[:n].any())
