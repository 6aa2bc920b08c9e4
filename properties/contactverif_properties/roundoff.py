"""The tolerances that several properties share: what roundoff alone may do to a force, each formula with its reason.

Symbols: u = 2⁻⁵³; X is the largest coordinate; Z is X, or the diameter D of a formulation that promises
`translation_stable` (`rounding_distance`); g is the penetration; ℓ is the shortest segment, or for a barrier its gap
(`Case.resolution`); L is the slave's length; N is the number of segments of both sides; d/h is the longest edge of a
face over its least height. Where the penetration varies, g is the uniform one that would give the same forces,
Σ|R| / (ε̂ L). `docs/concepts/tolerances.md` has the whole list.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from itertools import combinations
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, FloatArray, dense
from contactverif.contract.case import ACTIVATION, FORCE_LENGTH, Case
from contactverif.contract.interface import PLANE
from contactverif.contract.property import Measurement, Quantity
from contactverif.contract.traits import Traits
from contactverif_properties.states import FrozenState, random_directions

# Tables have 14 digits and more, and the weights that NGSolve 6.2.2608 computes for up to 20 Gauss points add up to
# 1 − 84u at worst, and to 1 − 79u for 6. 1e-14 is 90u, and places of integration that are wrong as much add their part.
WEIGHT_ROUNDINGS = 128
WEIGHT_REASON = "Weights of integration are known to 1e-14."
GAP_TOLERANCE = "u(8X/|g| + 4N + 128)"
_ALL_REASON = f"and N forces are summed. {WEIGHT_REASON} In 3-D a rounded normal adds D d/h to the distance."
GAP_REASON = f"A gap is a difference of coordinates, each rounded to uX, {_ALL_REASON}"
STATED_GAP_TOLERANCE = "u(8Z/|g| + 4N + 128)"
STATED_GAP_REASON = (
    f"A gap is a difference of positions, each rounded to uZ, {_ALL_REASON} "
    "Z is the largest coordinate X, and the diameter D where the trait `translation_stable` is True."
)
SEGMENT_TOLERANCE = "u(8X/min(g, ℓ) + 4N)"
SEGMENT_REASON = (
    "A gap is a difference of coordinates, each rounded to uX, and N forces are summed. "
    "Rounding the ends of a segment turns the segment and its force by uX/ℓ. "
    "8 is the number of coordinates of two segments; two triangles have 18, two quadrilaterals 24. "
    "In 3-D a rounded normal adds D d/h to X."
)
COORDINATE_ROUNDING = 64 * UNIT_ROUNDOFF  # A motion rounds each coordinate a few times; this times X bounds the move.


def sum_slave_forces(case: Case, forces: Array) -> float:
    """Return Σ|R| over the entries of the slave nodes of a residual, (n_unknowns, …) or (n_nodes, dim)."""
    return float(np.abs(forces.reshape(-1)[: case.interface.dim * case.interface.n_slave_nodes]).sum())


def sum_larger_forces(case: Case, forces: Array) -> float:
    """Return Σ|R| over the entries of the slave or of the master, the larger: half passes may push one side alone."""
    slave = sum_slave_forces(case, forces)
    return max(slave, float(np.abs(forces.reshape(-1)[: case.interface.n_unknowns]).sum()) - slave)


def mean_penetration(case: Case, forces: Array) -> float:
    """Return the uniform penetration, a length, that would need the same Σ|R| over the slave: Σ|R| / (ε̂ L).

    In space the area takes the place of the length L.

    Where half passes push the master alone, Σ|R| is that of the master. A barrier has no such penetration; its forces
    change over the gap, or over what is left of it to the activation distance. Those of a law of its own change over a
    length that the case says.
    """
    if ACTIVATION in case.parameters:
        return case.resolution
    if FORCE_LENGTH in case.parameters:
        return case.parameter(FORCE_LENGTH)
    whole = sum_slave_forces(case, forces) or sum_larger_forces(case, forces)
    return whole / (case.penalty * case.slave_measure)


def rounding_distance(case: Case, traits: Traits) -> float:
    """Return the distance Z, a length, at which a formulation may round the position of a point.

    A kernel that subtracts the centroid first is `translation_stable`, and rounds points at the diameter.
    """
    return case.diameter if traits.promises.translation_stable else case.largest_coordinate


def gap_tolerance(case: Case, penetration: float, distance: float | None = None) -> float:
    """Return GAP_TOLERANCE as a number, or STATED_GAP_TOLERANCE for a distance Z at which positions are rounded.

    Where the penetration g, a length, is 0 there is no gap to round, and a force of any size is wrong. The forces of a
    law of its own may change over less than g.
    """
    if FORCE_LENGTH in case.parameters:
        penetration = min(penetration, case.parameter(FORCE_LENGTH))
    largest = (case.largest_coordinate if distance is None else distance) + normal_rounding(case)
    gap_rounding = 8 * largest / penetration if penetration > 0 else 0.0
    return UNIT_ROUNDOFF * (gap_rounding + 4 * case.n_segments + WEIGHT_ROUNDINGS)


def segment_tolerance(case: Case, forces: Array, largest: float) -> float:
    """Return SEGMENT_TOLERANCE as a number, from the largest coordinate X of all states that take part.

    The residual (n_unknowns,) tells the mean penetration. Where nothing is in contact the value is 0 or infinite, and
    any tolerance serves.
    """
    penetration = mean_penetration(case, forces)
    reach = min(penetration, case.resolution) if penetration > 0 else case.resolution
    largest += normal_rounding(case)
    return UNIT_ROUNDOFF * (pair_coordinates(case) * largest / reach + 4 * case.n_segments)


def normal_rounding(case: Case) -> float:
    """Return D d/h, the length by which a rounded normal makes a gap wrong, in units of u; 0 in the plane.

    A normal is a cross product of edges, none longer than d. Each edge is rounded to ud, each of the products to ud²,
    so that the sum of two is off by 5ud². It is dh long, twice the area; so the normal turns by 5u d/h, and the gap of
    a point whose foot is up to D away from the corner that the gap is measured from changes by 5u D d/h. That is less
    than 8 times, which is what counts. A normal that is read off rounded corners needs no more: a foot inside a face
    moves with them as a mean of them.
    """
    return case.diameter * slenderness(case) if case.interface.dim != PLANE else 0.0


def pair_coordinates(case: Case) -> int:
    """Return the number of coordinates of a slave and a master face, each of which is rounded: 8 of two segments."""
    interface = case.interface
    return int(interface.dim * (interface.slave.faces.shape[1] + interface.master.faces.shape[1]))


def slenderness(case: Case) -> float:
    """Return the longest edge of a face over its least height, the largest of both sides; 1 in the plane.

    Rounding its corners moves a place along a face by so many times uX, as it does where two edges cross at a small
    angle. So shape functions change by uX/ℓ times that.
    """
    interface, largest = case.interface, 1.0
    for side in (interface.slave, interface.master) if interface.dim != PLANE else ():
        corners = case.positions[side.faces]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        largest = max(largest, float((edges / side.heights(case.positions)).max()))
    return largest


def ratio(part: float, whole: float) -> float:
    """Return part / whole; 0/0 counts as 0, and anything else over 0 as infinite."""
    if whole > 0:
        return part / whole
    return 0.0 if part == 0 else np.inf


def gap_quantity(name: str) -> Quantity:
    """Return a dimensionless quantity that only the rounding of gaps may keep from zero."""
    return Quantity(name, GAP_TOLERANCE, GAP_REASON)


def stated_gap_quantity(name: str) -> Quantity:
    """Return a quantity as `gap_quantity` does; how gaps are rounded follows from the traits (`rounding_distance`)."""
    return Quantity(name, STATED_GAP_TOLERANCE, STATED_GAP_REASON)


# The names of the details. `contactverif_reports` draws them.
ERROR = "relative error"
CONDITION = "condition number"
FORCE_ERROR = "force error"
# The tolerance of ω. Against 60 digits the kernels here reach 1.8; right ones in other ways of writing reach 4.
MOST_ROUNDINGS = 16.0
TANGENT_STEP = 2.0**-20  # The motion of the nodes over the shortest segment that shows how a tangent changes.
N_TANGENT_DIRECTIONS = 2  # The random directions of that motion.
FORCES_REASON = (
    "Rounding the positions relative to one another changes forces by 1 at most. Right kernels reach 4 in all ways of "
    "writing that were tried."
)


def forces_quantity(name: str) -> Quantity:
    """Return a quantity for an ω of the residual."""
    return Quantity(name, "16 (times what rounding the positions relative to their centroid does)", FORCES_REASON)


@dataclass(frozen=True, slots=True, eq=False)
class Conditioning:
    """The size of the answers at a state, and what a relative rounding of the whole input may change in them."""

    # (n_nodes + n_multipliers,) For each node, and behind them for each constraint row: Σ_b ‖K_ab‖ d_b + Σ_j ‖K_aj‖
    # |λ_j| + floor, in the unit of the row. A relative rounding u of the input changes the row by u times this at
    # most.
    reach: FloatArray
    # (n_nodes + n_multipliers,) The largest force max_c |R_c| for a node; the largest constraint row for a constraint
    # row.
    floor: FloatArray
    dim: int = PLANE  # The number of entries of a residual that a node has.

    def worst_row(self, error: Array) -> WorstRow:
        """Return the row of an error of the residual (n_unknowns + n_multipliers,) that is the most roundings."""
        n_nodes = (len(error) - len(self.reach)) // (self.dim - 1)  # The error has dim entries a node, the reach one.
        sizes = _row_sizes(error, n_nodes, self.dim)
        counts = np.array([ratio(size, UNIT_ROUNDOFF * reach) for size, reach in zip(sizes, self.reach, strict=True)])
        row = int(np.argmax(counts))
        floor = float(self.floor[row])
        return WorstRow(float(counts[row]), ratio(sizes[row], floor), ratio(float(self.reach[row]), floor))

    def count_roundings(self, error: Array) -> float:
        """Return ω of an error of the residual (n_unknowns + n_multipliers,), a number without a unit."""
        return self.worst_row(error).roundings


class WorstRow(NamedTuple):
    """The row of a residual with the largest ω; error = roundings × u × condition."""

    roundings: float  # The error in roundings, ω.
    error: float  # The error of the row over the largest force, or over the largest constraint row.
    # The relative change of the row by a relative change of the whole input, κ. It is at least 1.
    condition: float


def measure_conditioning(state: FrozenState, forces: Array) -> Conditioning:
    """Measure what roundings of the input may change in each row of the residual (n_unknowns + n_multipliers,).

    The state is one near the origin, with its multipliers if any. The formulation is called once, on the frozen
    pairing, with a batch of two states for each unknown.
    """
    return conditioning_of(state.case, difference_quotient(state), forces)


def conditioning_of(case: Case, derivative: FloatArray, forces: Array) -> Conditioning:
    """Return what `measure_conditioning` does, from the `difference_quotient` (n, n) and the residual (n,)."""
    n_nodes, dim = case.interface.n_nodes, case.interface.dim
    inputs = np.concatenate([_distances(case), np.abs(case.multipliers)])
    sizes = _row_sizes(forces, n_nodes, dim)
    floor = np.repeat([sizes[:n_nodes].max(), sizes[n_nodes:].max(initial=0.0)], [n_nodes, case.n_multipliers])
    # The Frobenius norms of the blocks of the derivative, first of their rows, then of their columns.
    n = dim * n_nodes
    rows = np.vstack([reduce(np.hypot, [derivative[axis:n:dim] for axis in range(dim)]), derivative[n:]])
    norms = np.hstack([reduce(np.hypot, [rows[:, axis:n:dim] for axis in range(dim)]), np.abs(rows[:, n:])])
    return Conditioning(norms @ inputs + floor, floor, dim)


def difference_quotient(state: FrozenState) -> FloatArray:
    """Return the central difference quotient (n, n) of the residual at a state on a frozen pairing, rows by columns.

    The step of a position is ℓ (u X/ℓ)^(1/3), at which truncation and roundoff are equal, about (u X/ℓ)^(2/3) relative.
    That of a multiplier is the largest multiplier, since the residual is affine in them.
    """
    case = state.case
    shortest = case.shortest_segment
    largest = float(np.abs(case.positions).max())
    step = shortest * (UNIT_ROUNDOFF * max(largest / shortest, 1.0)) ** (1 / 3)
    steps = np.full(len(case.z), step)
    steps[case.interface.n_unknowns :] = np.abs(case.multipliers).max(initial=0.0) or 1.0
    moves = np.diag(steps)
    answers = state.residual_at(case.z + np.stack([moves, -moves]))
    columns: FloatArray = (answers[0] - answers[1]) / (2 * steps[:, None])
    return columns.T


def count_tangent_roundings(case: Case, tangent: FloatArray, other: FloatArray, slope: float = 0.0) -> float:
    """Return how much two tangents differ, in units of u D times what a motion by a unit of length changes in them.

    That is the slope of `measure_tangent_slope`, at the state near the origin. At least max|K|/ℓ counts, since a
    segment turns.
    """
    slope = max(slope, float(np.abs(tangent).max()) / case.shortest_segment)
    return ratio(float(np.abs(other - tangent).max()), UNIT_ROUNDOFF * slope * case.diameter)


def measure_tangent_slope(state: FrozenState, tangent: FloatArray) -> float:
    """Return the largest change of an entry of the tangent over a small motion of the nodes, over its length.

    The tangent of a law that is not linear is small at a small gap, and its change is not: that of a pressure ε̂ g² is
    2 ε̂ g, which a rounding of the gap changes by 2 ε̂ u D.
    """
    case, (method, interface, pairing, z) = state.case, state.call("tangent")
    step = TANGENT_STEP * case.shortest_segment
    moves = step * random_directions(case.seed, N_TANGENT_DIRECTIONS, z.size)
    moved = state.formulation.answers([(method, interface, pairing, z + move) for move in moves])
    return max(float(np.abs(dense(there) - tangent).max()) for there in moved) / step


def _distances(case: Case) -> FloatArray:
    """Return for each node its distance from the centroid of all nodes, or its longest segment if that is longer.

    A dual mortar method couples a node to the opposite one alone where meshes match; the shares of all others cancel.
    If both are at the centroid, there is still the rounding of what cancels, which is of the length of segments.
    """
    positions, interface = case.positions, case.interface
    distances: FloatArray = np.linalg.norm(positions - positions.mean(axis=0), axis=1)
    for surface in (interface.slave, interface.master):
        corners = positions[surface.faces]
        for start, end in combinations(range(corners.shape[1]), 2):
            along = corners[:, end] - corners[:, start]
            lengths = np.sqrt((along * along).sum(axis=-1))
            for corner in (start, end):
                np.maximum.at(distances, surface.faces[:, corner], lengths)
    return distances


def _row_sizes(rows: Array, n_nodes: int, dim: int) -> FloatArray:
    """Return |R_a| of each node and |row| of each constraint row, (n_nodes + n_multipliers,)."""
    forces = np.hypot.reduce(np.asarray(rows[: dim * n_nodes], dtype=np.float64).reshape(n_nodes, dim), axis=1)
    return np.concatenate([forces, np.abs(rows[dim * n_nodes :]).astype(np.float64)])


def make_sweep_measurement(
    quantity: Quantity, conditioning: Conditioning, error: Array, *, idle: bool, action: str
) -> Measurement:
    """Return ω of an error of the residual (n_unknowns + n_multipliers,), at most 16, after an action on a case.

    Details are the error and the condition number of the row with that ω, and the largest error of a force over the
    largest force.
    """
    worst, dim = conditioning.worst_row(error), conditioning.dim
    n = dim * ((len(error) - len(conditioning.reach)) // (dim - 1))
    largest = float(np.linalg.norm(np.asarray(error[:n], dtype=np.float64).reshape(-1, dim), axis=1).max())
    force_error = ratio(largest, float(conditioning.floor[0]))
    details = {ERROR: worst.error, CONDITION: worst.condition, FORCE_ERROR: force_error}
    return Measurement([quantity.check(worst.roundings, MOST_ROUNDINGS)], details=details, idle=idle).after(action)
