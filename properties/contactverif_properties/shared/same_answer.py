"""Two states that a right formulation answers alike: the same one in other numbers, mirrored, or with a bystander.

Each state is one case. `Carry` says which node of the second state is which node of the first, and how vectors go over.
Multipliers are uniform, so that their order does not matter; only the rows of positions are compared.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE
from contactverif.contract.measurement import CheckedNumber, Measurement, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.oracle import default_points, nearest_segments
from contactverif_properties.shared import roundoff
from contactverif_properties.shared.any_state import ask_forces_and_tangents
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.kinks import explain_by_kink
from contactverif_properties.shared.worst_force import worst_force

TOLERANCE = "u(8Z/min(g, ℓ) + 4N)"
SHARE = 0.1875  # A uniform multiplier over the shortest segment, with c = 1: as large as a penetration would be.
BITS = "entries with other bits"
TIE = "a tie: a point in the normal cone of a vertex is as near to one segment as to another"


@dataclass(frozen=True, slots=True)
class Carry:
    """The way in which the first of two states becomes the second."""

    nodes: IntArray  # (n_nodes,) The number, in the second state, of each node of the first.
    # (dim, dim) What becomes of vectors: a force f becomes matrix · f.
    matrix: FloatArray = field(default_factory=lambda: np.eye(2))


def same_answer_quantities(situation: str) -> tuple[Quantity, Quantity]:
    """Return the quantities of `compare`, the changes of forces and tangent; `situation` ends their names."""
    return (
        Quantity(f"change of the forces {situation}", TOLERANCE, roundoff.SEGMENT_REASON),
        Quantity(f"change of the tangent {situation}", TOLERANCE, roundoff.SEGMENT_REASON),
    )


def _ask(case: Case, subject: Subject, penalty: float, multiplier: float) -> tuple[FrozenState, FloatArray, FloatArray]:
    """Return a state with uniform multipliers if there are any, its forces (n_nodes, dim) and tangent.

    The tangent has the rows and columns of positions, and none where the plugin has no tangent.
    """
    formulation, n = subject.with_penalty(penalty), case.interface.n_unknowns
    if formulation.n_multipliers(case.interface):
        formulation = subject.with_penalty(1.0)
    state = FrozenState.with_multiplier(formulation, case, multiplier)
    (forces,), tangents = ask_forces_and_tangents(state)
    return state, forces[:n].reshape(case.interface.nodes.shape), tangents[0][:n, :n] if tangents else np.empty((0, 0))


class Change(NamedTuple):
    """The change of the forces, or of the tangent, between two states."""

    part: str  # "forces" or "tangent".
    quantity: Quantity
    change: FloatArray
    size: float  # The size that the largest change counts over, in the unit of the change.
    # (n_nodes,) The number, in the second state, of each node of the change; None where both have the same numbers.
    nodes: IntArray | None = None
    dim: int = PLANE  # The number of unknowns of a node.

    def worst_columns(self, number: int) -> IntArray:
        """Return the columns of the node, or the multiplier, with the largest change, in the first state or second."""
        n_columns = self.change.shape[-1]
        node = int(np.abs(self.change).argmax()) % n_columns // self.dim
        if self.nodes is None or number == 0:
            columns: IntArray = np.minimum(self.dim * node + np.arange(self.dim), n_columns - 1)
            return columns
        return self.dim * int(self.nodes[node]) + np.arange(self.dim)


def judge_changes(
    changes: Sequence[Change], tolerance: float, states: Iterable[FrozenState], largest: float | None = None
) -> tuple[tuple[CheckedNumber, ...], str]:
    """Return the largest changes over their sizes, and why a kink excuses those above the tolerance.

    Coordinates are rounded at the largest one of each state, or at a length. Without states, nothing is excused.
    """
    errors = [float(np.abs(each.change).max()) for each in changes]
    values = {each.quantity: roundoff.ratio(error, each.size) for each, error in zip(changes, errors, strict=True)}
    failures = [each for each in changes if values[each.quantity] > tolerance]
    excuses = (_find_excuse(failures, number, state, largest) for number, state in enumerate(states))
    return check_all(values, tolerance), next(filter(None, excuses), "") if failures else ""


def _find_excuse(failures: Sequence[Change], number: int, state: FrozenState, largest: float | None) -> str:
    """Return why a kink in the first state, or the second, excuses changes that are too large, or an empty string."""
    errors = {each.part: float(np.abs(each.change).max()) for each in failures}
    columns = next((each.worst_columns(number) for each in failures if each.part == "tangent"), None)
    return explain_by_kink(
        state, roundoff.COORDINATE_ROUNDING * (largest or state.case.largest_coordinate), errors, columns
    )


def compare(
    quantities: tuple[Quantity, Quantity],
    subject: Subject,
    case: Case,
    other: Case,
    carry: Carry,
    *,
    explain: bool = True,
) -> Measurement:
    """Compare the answers in two states: the largest change of a force over Σ|R| of a side, of an entry over max|K|.

    The sizes are the larger of both states. The detail `BITS` counts entries that are not equal to the last bit.
    """
    penalty, multiplier = subject.penalty(case), SHARE * case.resolution
    (first, forces, tangent), (second, forces_there, tangent_there) = (
        _ask(state, subject, penalty, multiplier) for state in (case, other)
    )
    size = max(roundoff.sum_larger_forces(case, forces), roundoff.sum_larger_forces(other, forces_there))
    changes = [Change("forces", quantities[0], forces_there[carry.nodes] - forces @ carry.matrix.T, size)]
    if tangent.size:
        dim = case.interface.dim
        places = (dim * carry.nodes[:, None] + np.arange(dim)).reshape(-1)
        turn = np.kron(np.eye(len(carry.nodes)), carry.matrix)
        change = tangent_there[np.ix_(places, places)] - turn @ tangent @ turn.T
        size = float(max(np.abs(tangent).max(), np.abs(tangent_there).max()))
        changes.append(Change("tangent", quantities[1], change, size, carry.nodes, dim))
    distance = max(roundoff.rounding_distance(state, subject.traits) for state in (case, other))
    tolerance = roundoff.segment_tolerance(case, forces, distance)
    numbers, undecided = judge_changes(changes, tolerance, [first, second] if explain else [])
    if explain and not undecided and any(number.value > number.tolerance for number in numbers):
        # A point that is active in one state may be tied to a segment for which it is open, and be open in the other.
        undecided = _find_tie(first) or _find_tie(second)
    finding = None
    if numbers[0].ratio > 1:
        back = forces_there[carry.nodes] @ carry.matrix
        finding = worst_force(case.interface, back, forces, ("force in the second state", "in the first"))
    details = {BITS: float(sum(np.count_nonzero(each.change) for each in changes))}
    idle = not (forces.any() or forces_there.any())
    return Measurement(numbers, undecided, details=details, idle=idle, finding=finding)


def _find_tie(state: FrozenState) -> str:
    """Return why either of two segments is right for a point, or an empty string if none is tied.

    A point in the normal cone of a re-entrant vertex is equally near to both segments there, wherever it is. By the
    rule "the nearest segment" alone, a formulation may take the one with the lower number.
    """
    if state.case.interface.dim != PLANE:
        return ""
    if state.has_points:
        passes = [(each.interface, each.z, each.points.position[each.points.active]) for each in state.passes]
    else:
        interface, positions = state.case.interface, state.case.positions
        segment, c, _, _ = default_points(interface)
        first, second = np.swapaxes(positions[interface.slave.segments[segment]], 0, 1)
        share = (1 + c[:, None]) / 2
        passes = [(interface, state.case.z, (1 - share) * first + share * second)]
    for interface, z, places in passes:
        nodes = z[: interface.n_unknowns].reshape(-1, 2)
        for place in places[np.isfinite(places).all(axis=1)]:
            near = nearest_segments(nodes, interface.master.segments, (float(place[0]), float(place[1]))).segments
            open_point = all(segment.signed_squared_gap > 0 for segment in near)
            if len(near) > 1 and (not open_point or state.case.n_multipliers):  # Multipliers may push across a gap.
                return TIE
    return ""
