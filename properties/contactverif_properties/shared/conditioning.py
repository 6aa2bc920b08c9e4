"""Condition numbers of a residual, and errors counted in roundings of the input.

A double holds a position relative to the centre of the interface to u |x − x̄| (u = 2⁻⁵³). Such a rounding of all
nodes b changes the force on node a by up to u Σ_b ‖K_ab‖ |x_b − x̄|, where K is the derivative of the residual. A node
that is the centre itself is still seen from the other end of its segment, so d_b = max(|x_b − x̄|, longest segment at b)
stands for that distance. An error is divided by this, and the quotient is called ω:

    ω = max_a |ΔR_a| / (u (Σ_b ‖K_ab‖ d_b + Σ_j ‖K_aj‖ |λ_j| + max_c |R_c|))

Here a is a node or a constraint row, and ΔR_a a vector or a number. ‖·‖ is the Frobenius norm of a block, and λ_j a
multiplier. The last term allows for the rounding of the forces themselves; for a constraint row it is the largest
constraint row. A stable kernel has ω of order 1 at any offset, gap and ratio of lengths. In a kernel that rounds at its
distance from the origin, ω grows like that distance over the diameter of the interface.

Rules for the next editor:

- K is a difference quotient of the residual, on a frozen pairing if there is one, and never the plugin's tangent. It
  is a condition number: a few correct digits are enough.
- Ask for K at the state near the origin. Far from it, a difference quotient has no correct digits.
- No absolute length, gap or offset stands in a formula here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from itertools import combinations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE
from contactverif.contract.measurement import Measurement, Quantity
from contactverif_properties.shared.any_state import random_directions
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.roundoff import ratio

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
TANGENT_REASON = (
    "Rounding the positions relative to one another by uD turns a segment by uD/ℓ, and changes the stiffness of a law "
    "that is not linear by uD max|dK/dx|."
)


def forces_quantity(name: str) -> Quantity:
    """Return a quantity for an ω of the residual."""
    return Quantity(name, "16 (times what rounding the positions relative to their centroid does)", FORCES_REASON)


def tangent_quantity(name: str) -> Quantity:
    """Return a quantity for an error of the tangent in units of u D max(max|K|/ℓ, max|dK/dx|)."""
    return Quantity(name, "16 (times u D max(max|K|/ℓ, max|dK/dx|))", TANGENT_REASON)


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


@dataclass(frozen=True, slots=True)
class WorstRow:
    """The row of a residual with the largest ω.

    The three numbers belong together: error = roundings × u × condition.
    """

    roundings: float  # The error in roundings, ω.
    error: float  # The error of the row over the largest force, or over the largest constraint row.
    # The condition number κ of the row: the relative change of the row by a relative change of the whole input. It is
    # at least 1.
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
    return Conditioning(_block_norms(derivative, n_nodes, dim) @ inputs + floor, floor, dim)


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


def _block_norms(matrix: FloatArray, n_nodes: int, dim: int) -> FloatArray:
    """Return the Frobenius norms of the blocks of a matrix, (n_nodes + n_multipliers,) in rows and in columns."""
    n = dim * n_nodes
    rows = np.vstack([reduce(np.hypot, [matrix[axis:n:dim] for axis in range(dim)]), matrix[n:]])
    return np.hstack([reduce(np.hypot, [rows[:, axis:n:dim] for axis in range(dim)]), np.abs(rows[:, n:])])


def make_sweep_measurement(quantity: Quantity, conditioning: Conditioning, error: Array, *, idle: bool) -> Measurement:
    """Return ω of an error of the residual (n_unknowns + n_multipliers,), which is at most 16.

    Details are the error and the condition number of the row with that ω, and the largest error of a force over the
    largest force.
    """
    worst = conditioning.worst_row(error)
    dim = conditioning.dim
    n = dim * ((len(error) - len(conditioning.reach)) // (dim - 1))
    largest = float(np.linalg.norm(np.asarray(error[:n], dtype=np.float64).reshape(-1, dim), axis=1).max())
    details = {
        ERROR: worst.error,
        CONDITION: worst.condition,
        FORCE_ERROR: ratio(largest, float(conditioning.floor[0])),
    }
    return Measurement([quantity.check(worst.roundings, MOST_ROUNDINGS)], details=details, idle=idle)
