"""Interpolate pressures of slave nodes along the slave, weight gaps with the same shapes.

Standard shapes: N_A = (1−c)/2, N_B = (1+c)/2. Dual shapes: ψ_A, ψ_B with ∫ψ_j N_k = δ_jk ∫N_j over the covered part of
each slave segment. With c̄ the mean of c over that part and v its variance these are

    ψ_A, ψ_B = N_A(c̄) − κ (c − c̄), N_B(c̄) + κ (c − c̄)        κ = (1 − c̄²) / 2v

(∫ψ_B = ∫N_B gives the constant, ∫ψ_B c = ∫N_B the slope.) No matrix is inverted, so a sliver is as good as a whole
segment. On a sliver in the middle of a segment κ grows like 1/length, as biorthogonality wants.

The weighted gap of a node is G_j = ∫φ_j g / ∫φ_j over all that is covered, φ = N or ψ. ∫φ_j = ∫N_j in both cases.

Source: Puso & Laursen (2004); dual shapes: Wohlmuth (2000), on the covered part: Popp, Gitterle, Gee & Wall (2010).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contactverif.contract.arrays import Array, IntArray
from contactverif_mortar.cell_forces import sum_by_place
from contactverif_mortar.integration_cells import GAP, WEIGHT, C


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
        return cls(
            np.stack([first_value, second], axis=-1),
            kappa,
            0.5 - kappa - mean / variance * centred,
            -kappa / variance * centred,
            centred,
            extent,
            variance,
        )

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
