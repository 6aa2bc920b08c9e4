"""Turn pressures of slave nodes into pressures at the points of cells, and those into nodal forces, for many states.

With F = w p, w the weight (a length) of a point, p its pressure and n out of the slave:

    R_A = (1−c)/2 F n    R_B = (1+c)/2 F n    R_1 = −(1−ξ) F n    R_2 = −ξ F n

Forces and moments balance point by point, whatever the pressures are, because x_m − x_s is along n.

Pressures of slave nodes are interpolated along the slave, and gaps weighted, with the same shapes. Standard shapes:
N_A = (1−c)/2, N_B = (1+c)/2. Dual shapes: ψ_A, ψ_B with ∫ψ_j N_k = δ_jk ∫N_j over the covered part of each slave
segment. With c̄ the mean of c over that part and v its variance these are

    ψ_A, ψ_B = N_A(c̄) − κ (c − c̄), N_B(c̄) + κ (c − c̄)        κ = (1 − c̄²) / 2v

(∫ψ_B = ∫N_B gives the constant, ∫ψ_B c = ∫N_B the slope.) No matrix is inverted, so a sliver is as good as a whole
segment; in the middle of a segment κ grows there like 1/length, as biorthogonality wants. The weighted gap of a node is
G_j = ∫φ_j g / ∫φ_j over all that is covered, φ = N or ψ, and ∫φ_j = ∫N_j in both cases.

Source: Puso & Laursen (2004); dual shapes: Wohlmuth (2000), on the covered part: Popp, Gitterle, Gee & Wall (2010).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from contactverif.compiler import compile_maker
from contactverif.contract.arrays import Array, IntArray
from contactverif.geometry.block_rows import NumberArray
from contactverif_mortar.integration_cells import GAP, NORMAL_X, NORMAL_Y, WEIGHT, XI, C


@compile_maker
def forces(points: Array, pressure: Array, nodes: NumberArray, n_nodes: int) -> Array:
    """Compute forces (n_states, n_nodes, 2) from pressures (n_states, n_points), positive where the surfaces press.

    The `points` (n_states, n_points, 6) of a cell follow each other; of its `nodes` (n_cells, n_local) A, B, 1, 2 come
    first.
    """
    totals = np.zeros((points.shape[0], n_nodes, 2), dtype=points.dtype)
    n_q = points.shape[1] // max(len(nodes), 1)
    for state in range(points.shape[0]):
        for number in range(points.shape[1]):
            if pressure[state, number] == 0:
                continue
            point, local = points[state, number], nodes[number // n_q]
            f = point[WEIGHT] * pressure[state, number]
            c, xi = point[C], point[XI]
            for k, shape in enumerate(((1 - c) / 2, (1 + c) / 2, xi - 1, -xi)):
                totals[state, local[k], 0] += shape * f * point[NORMAL_X]
                totals[state, local[k], 1] += shape * f * point[NORMAL_Y]
    return totals


@compile_maker
def sum_by_place(values: Array, places: IntArray, n_places: int) -> Array:
    """Return sums (n_states, n_places) of the values (n_states, n) that belong to the same of the places (n,)."""
    sums = np.zeros((values.shape[0], n_places), dtype=values.dtype)
    for state in range(values.shape[0]):
        for number in range(len(places)):
            sums[state, places[number]] += values[state, number]
    return sums


@dataclass(frozen=True, slots=True, eq=False)
class Shapes:
    """The values of shapes at points of some states, and how they change."""

    # (n_states, n_points, 2) Values of the shapes of A and B, the nodes of the slave segment that carries the point.
    values: Array
    slope: Array  # (n_states, n_points) Δ of the second shape for each unit of c; Δ of the first is the opposite.
    # (n_states, n_points) Δ of the second shape for each unit of c̄ and of v of the segment; zero for standard shapes.
    by_mean: Array
    by_variance: Array
    centred: Array  # (n_states, n_points) c − c̄, and ∫1 of the segment; zero for standard shapes.
    extent: Array
    variance: Array  # (n_states, n_points) The variance v of the segment; zero for standard shapes.

    @classmethod
    def standard(cls, points: Array) -> Shapes:
        """Return the standard shapes at points (n_states, n_points, 6)."""
        c, nothing = points[..., C], np.zeros_like(points[..., C])
        return cls(np.stack([(1 - c) / 2, (1 + c) / 2], axis=-1), nothing + 0.5, *[nothing] * 5)

    @classmethod
    def dual(cls, points: Array, segment: IntArray, n_segments: int) -> Shapes:
        """Return the dual shapes on what the points cover; `segment` (n_points,) is the slave segment of each."""
        c, w = points[..., C], points[..., WEIGHT]
        first = _first_of_each(segment)
        rough = c[..., first]  # a place in the covered part: so c − c̄ is as exact as c, however short the part
        extent = sum_by_place(w, segment, n_segments)[..., segment]
        mean = sum_by_place(w * (c - rough), segment, n_segments)[..., segment] / extent
        centred = (c - rough) - mean
        mean = rough + mean
        variance = sum_by_place(w * centred * centred, segment, n_segments)[..., segment] / extent
        kappa = (1 - mean) * (1 + mean) / (2 * variance)
        second = (1 + mean) / 2 + kappa * centred
        first_value = (1 - mean) / 2 - kappa * centred
        values, by_mean = np.stack([first_value, second], axis=-1), 0.5 - kappa - mean / variance * centred
        return cls(values, kappa, by_mean, -kappa / variance * centred, centred, extent, variance)

    def fields_of_first_state(self) -> tuple[Array, ...]:
        """Return all fields at the first state, in their order."""
        return tuple([getattr(self, entry.name)[0] for entry in fields(self)])

    def at(self, node_values: Array, ends: IntArray) -> Array:
        """Interpolate values (n_states, n_nodes) of the nodes to the points, each between its nodes `ends`."""
        interpolated: Array = (self.values * node_values[..., ends]).sum(axis=-1)
        return interpolated


def _first_of_each(segment: IntArray) -> IntArray:
    """Return for each point the first point of its slave segment; the points of a segment follow each other."""
    begins = np.r_[True, segment[1:] != segment[:-1]] if len(segment) else np.zeros(0, bool)
    return np.maximum.accumulate(np.where(begins, np.arange(len(segment)), 0))


def integrals(shapes: Shapes, points: Array, ends: IntArray, n_nodes: int) -> tuple[Array, Array]:
    """Return ∫φ_j and ∫φ_j g (n_states, n_nodes) of the slave nodes."""
    weighted = shapes.values * points[..., WEIGHT, None]
    with_gap = weighted * points[..., GAP, None]
    areas = sum_by_place(weighted.reshape(len(points), -1), ends.ravel(), n_nodes)
    return areas, sum_by_place(with_gap.reshape(len(points), -1), ends.ravel(), n_nodes)
