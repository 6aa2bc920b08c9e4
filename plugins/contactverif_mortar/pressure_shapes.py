"""Interpolate pressures of slave nodes along the slave, weight gaps with the same shapes, and compute Δ of both.

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
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif_mortar.cell_forces import gather_rows, sum_by_place
from contactverif_mortar.cell_geometry import D_C, D_GAP, D_WEIGHT
from contactverif_mortar.integration_cells import GAP, WEIGHT, C


@dataclass(frozen=True, slots=True, eq=False)
class Shapes:
    """The values of shapes at points of some states, and how they change.

    Attributes
    ----------
    values : Array, shape (n_states, n_points, 2)
        Values of the shapes of A and B, the nodes of the slave segment that carries the point.
    slope : Array, shape (n_states, n_points)
        Δ of the second shape for each unit of c; Δ of the first is the opposite.
    by_mean, by_variance : Array, shape (n_states, n_points)
        Δ of the second shape for each unit of c̄ and of v of the segment; zero for standard shapes.
    centred, extent : Array, shape (n_states, n_points)
        c − c̄, and ∫1 of the segment; zero for standard shapes.
    variance : Array, shape (n_states, n_points)
        The variance v of the segment; zero for standard shapes.
    """

    values: Array
    slope: Array
    by_mean: Array
    by_variance: Array
    centred: Array
    extent: Array
    variance: Array

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


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """The Δ of the points of one state, and the sparse rows over all unknowns that follow from them.

    Attributes
    ----------
    gains : FloatArray, shape (n_points, 5, n_local, 2)
        The Δ of `Quadrature.gains`.
    points : FloatArray, shape (n_points, 6)
        The points of `Quadrature.points`.
    shapes : Shapes
        The shapes at that one state, n_states = 1.
    segment : IntArray, shape (n_points,)
        The slave segment of each point.
    ends : IntArray, shape (n_points, 2)
        The slave nodes of each point.
    nodes : IntArray, shape (n_cells, n_local)
        The nodes of `Cells.local_nodes`.
    n_segments, n_unknowns : int
        Numbers of slave segments and of positions.
    dual : bool
        The shapes are dual.
    """

    gains: FloatArray
    points: FloatArray
    shapes: Shapes
    segment: IntArray
    ends: IntArray
    nodes: IntArray
    n_segments: int
    n_unknowns: int
    dual: bool

    def segment_moments(self) -> sparse.csr_array:
        """Return Δc̄ and, behind them, Δv of all slave segments, (2 n_segments, n_unknowns).

        ∫1 Δc̄ = Σ (c − c̄) Δw + w Δc        ∫1 Δv = Σ ((c − c̄)² − v) Δw + 2 w (c − c̄) Δc
        """
        s, d_c, d_w = self.shapes, self.gains[:, D_C], self.gains[:, D_WEIGHT]
        centred, extent, variance = s.centred[0], s.extent[0], s.variance[0]
        w = self.points[:, WEIGHT]
        d_mean = _times(centred / extent, d_w) + _times(w / extent, d_c)
        d_variance = _times((centred * centred - variance) / extent, d_w) + _times(2 * w * centred / extent, d_c)
        cell_segment = self.by_cell(self.segment)
        places = np.column_stack([cell_segment, cell_segment + self.n_segments])
        rows = np.stack([d_mean, d_variance], axis=1)
        return gather_rows(rows, places, self.nodes, (2 * self.n_segments, self.n_unknowns)).tocsr()

    def weighted_gaps(self, reference: FloatArray, divisor: FloatArray) -> sparse.csr_array:
        """Return Σ [w φ Δg + (g − G) Δ(w φ)] / divisor, (n_nodes, n_unknowns).

        With the weighted gaps as `reference` G and ∫φ_j as `divisor` this is ΔG_j. With zero and one it is Δ∫φ_j g. The
        difference g − G does not cancel on a sliver.
        """
        s, points, n_nodes = self.shapes, self.points, len(divisor)
        w, values = points[:, WEIGHT], s.values[0]
        share = 1 / divisor[self.ends]
        above = (points[:, GAP, None] - reference[self.ends]) * share  # (n_points, 2)
        rows = _times(w[:, None] * values * share, self.gains[:, D_GAP, None])
        rows += _times(above * values, self.gains[:, D_WEIGHT, None])
        signed = above * w[:, None] * [-1.0, 1.0]
        rows += _times(signed * s.slope[0][:, None], self.gains[:, D_C, None])
        places = self.by_cell(self.ends)
        total = gather_rows(rows, places, self.nodes, (n_nodes, self.n_unknowns)).tocsr()
        if self.dual:
            by = np.stack([signed * s.by_mean[0][:, None], signed * s.by_variance[0][:, None]])  # (2, n_points, 2)
            lines = np.broadcast_to(self.ends, by.shape)
            columns = np.broadcast_to(self.segment[:, None], by.shape[1:]) + [[[0]], [[self.n_segments]]]
            chain = sparse.coo_array(
                (by.ravel(), (lines.ravel(), columns.ravel())), shape=(n_nodes, 2 * self.n_segments)
            )
            total = total + chain.tocsr() @ self.segment_moments()
        return total

    def by_cell(self, by_point: IntArray) -> IntArray:
        """Return what all points of a cell have in common once for each cell, from (n_points, …)."""
        return by_point[:: max(len(by_point) // max(len(self.nodes), 1), 1)]


def _times(factor: FloatArray, rows: FloatArray) -> FloatArray:
    """Multiply the Δ of each point (and node of it) by a factor."""
    product: FloatArray = factor[..., None, None] * rows
    return product
