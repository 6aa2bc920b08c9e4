"""The tangent of mortar methods as triplets and sparse products: slow, and close to the formulas.

Tests hold the kernels that write compressed rows (`cell_tangent`, `node_rows`, `shape_rows`) against this.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from contactverif_mortar.cell_forces import Shapes
from contactverif_mortar.cell_geometry import D_C, D_GAP, D_WEIGHT, D_XI, OMEGA
from contactverif_mortar.integration_cells import GAP, NORMAL_X, NORMAL_Y, WEIGHT, XI, C


def _blocks(points: Any, gains: Any, pressure: Any, d_pressure: Any, n_q: int) -> Any:
    """Compute Δ of the forces of each cell, (n_cells, 4 nodes, 2, n_local, 2)."""
    n_local = gains.shape[2]
    blocks = np.zeros((len(points) // n_q, 4, 2, n_local, 2))
    for number in range(len(points)):
        block, point, gain = blocks[number // n_q], points[number], gains[number]
        c, xi, w, p = point[C], point[XI], point[WEIGHT], pressure[number]
        n = (point[NORMAL_X], point[NORMAL_Y])
        tau = (-n[1], n[0])
        f = w * p
        shape = ((1 - c) / 2, (1 + c) / 2, xi - 1, -xi)
        for column in range(n_local):
            for j in range(2):
                d_f = gain[D_WEIGHT, column, j] * p + w * d_pressure[number, column, j]
                omega = f * gain[OMEGA, column, j]
                d_c, d_xi = f * gain[D_C, column, j] / 2, f * gain[D_XI, column, j]
                d_shape = (-d_c, d_c, d_xi, -d_xi)
                for k in range(4):
                    along_n = shape[k] * d_f + d_shape[k]
                    along_tau = -shape[k] * omega  # Δn = −τ ω
                    for i in range(2):
                        block[k, i, column, j] += along_n * n[i] + along_tau * tau[i]
    return blocks


def tangent(points: Any, gains: Any, pressure: Any, d_pressure: Any, nodes: Any, size: int) -> Any:
    """Compute the derivative of `forces` at one state.

    Parameters
    ----------
    points : array, shape (n_points, 6)
        The points of `Quadrature.points` at that state.
    gains : array, shape (n_points, 5, n_local, 2)
        Their Δ, from `Quadrature.gains`.
    pressure : array, shape (n_points,)
        Pressures.
    d_pressure : array, shape (n_points, n_local, 2)
        The part of Δ of a pressure that depends on the local nodes of its own cell.
    nodes : array, shape (n_cells, n_local)
        Node numbers of each cell.
    size : int
        Number of rows and columns of the result.

    Returns
    -------
    sparse.coo_array, shape (size, size)
        The derivative.
    """
    n_q = len(points) // max(len(nodes), 1)
    if not n_q:
        return sparse.coo_array((size, size))
    blocks = _blocks(points, gains, pressure, d_pressure, n_q)
    unknown = 2 * nodes[:, :, None] + np.arange(2)  # (n_cells, n_local, 2)
    rows = np.broadcast_to(unknown[:, :4, :, None, None], blocks.shape)
    columns = np.broadcast_to(unknown[:, None, None], blocks.shape)
    return sparse.coo_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))


def influence(points: Any, shares: Any, places: Any, nodes: Any, shape: tuple[int, int]) -> Any:
    """Compute the forces that a unit of each source puts on the nodes.

    A source is a number that pressures depend on linearly, such as the pressure at a slave node.

    Parameters
    ----------
    points : array, shape (n_points, 6)
        The points of `Quadrature.points` at one state.
    shares : array, shape (n_points, n_sources_of_cell)
        The pressure at a point for a unit of each source of its cell.
    places : array, shape (n_cells, n_sources_of_cell)
        The columns of the sources of each cell.
    nodes : array, shape (n_cells, n_local)
        Node numbers of each cell.
    shape : tuple[int, int]
        Shape (n_unknowns, n_sources) of the result.

    Returns
    -------
    sparse.coo_array, shape (n_unknowns, n_sources)
        Internal forces.
    """
    c, xi = points[:, C], points[:, XI]
    transmit = np.stack([(1 - c) / 2, (1 + c) / 2, xi - 1, -xi], axis=1) * points[:, WEIGHT, None]  # (n_points, 4)
    normal = points[:, NORMAL_X : NORMAL_Y + 1]
    by_cell = (len(nodes), len(points) // max(len(nodes), 1))
    values = np.einsum(
        "cqk,cqi,cqm->ckim",
        transmit.reshape(*by_cell, 4),
        normal.reshape(*by_cell, 2),
        shares.reshape(*by_cell, shares.shape[1]),
    )
    unknown = 2 * nodes[:, :4, None, None] + np.arange(2)[:, None]
    rows = np.broadcast_to(unknown, values.shape)
    columns = np.broadcast_to(places[:, None, None, :], values.shape)
    return sparse.coo_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=shape)


def gather_rows(rows: Any, places: Any, nodes: Any, shape: tuple[int, int]) -> Any:
    """Add up Δ of numbers of points that belong to the same place, such as a node.

    Parameters
    ----------
    rows : array, shape (n_points, n_places_of_cell, n_local, 2)
        Δ of the numbers.
    places : array, shape (n_cells, n_places_of_cell)
        The rows of the result to which the numbers of each cell belong.
    nodes : array, shape (n_cells, n_local)
        Node numbers of each cell.
    shape : tuple[int, int]
        Shape (n_places, n_unknowns) of the result.

    Returns
    -------
    sparse.coo_array, shape (n_places, n_unknowns)
        The sums.
    """
    values = rows.reshape(len(nodes), len(rows) // max(len(nodes), 1), *rows.shape[1:]).sum(axis=1)
    unknown = 2 * nodes[:, None, :, None] + np.arange(2)
    columns = np.broadcast_to(unknown, values.shape)
    lines = np.broadcast_to(places[:, :, None, None], values.shape)
    return sparse.coo_array((values.ravel(), (lines.ravel(), columns.ravel())), shape=shape)


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """The Δ of the points of one state, and the sparse rows over all unknowns that follow from them.

    Attributes
    ----------
    gains : array, shape (n_points, 5, n_local, 2)
        The Δ of `Quadrature.gains`.
    points : array, shape (n_points, 6)
        The points of `Quadrature.points`.
    shapes : Shapes
        The shapes at that one state, n_states = 1.
    segment : array, shape (n_points,)
        The slave segment of each point.
    ends : array, shape (n_points, 2)
        The slave nodes of each point.
    nodes : array, shape (n_cells, n_local)
        The nodes of `Cells.local_nodes`.
    n_segments, n_unknowns : int
        Numbers of slave segments and of positions.
    dual : bool
        The shapes are dual.
    """

    gains: Any
    points: Any
    shapes: Shapes
    segment: Any
    ends: Any
    nodes: Any
    n_segments: int
    n_unknowns: int
    dual: bool

    def segment_moments(self) -> Any:
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

    def weighted_gaps(self, reference: Any, divisor: Any) -> Any:
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

    def by_cell(self, by_point: Any) -> Any:
        """Return what all points of a cell have in common once for each cell, from (n_points, …)."""
        return by_point[:: max(len(by_point) // max(len(self.nodes), 1), 1)]


def _times(factor: Any, rows: Any) -> Any:
    """Multiply the Δ of each point (and node of it) by a factor."""
    product: Any = factor[..., None, None] * rows
    return product


def at_fixed_pressures(rows: Rows, pressure: Any) -> tuple[Any, Any]:
    """Compute the derivative of the forces at fixed nodal pressures, and the forces of unit pressures.

    Parameters
    ----------
    rows : Rows
        The Δ of the points of one state.
    pressure : array, shape (n_slave_nodes,)
        Pressures p_j of the slave nodes.

    Returns
    -------
    derivative : sparse.csr_array, shape (n_unknowns, n_unknowns)
        Σ p_j ΔB_j.
    influence : sparse.csr_array, shape (n_unknowns, n_slave_nodes)
        B, whose columns are the forces of a unit pressure at one node.
    """
    derivative, influence = at_fixed_lengths(rows, pressure)
    if rows.dual:
        derivative = derivative + by_lengths(rows, pressure) @ rows.segment_moments()
    return derivative, influence


def at_fixed_lengths(rows: Rows, pressure: Any) -> tuple[Any, Any]:
    """Compute the same, but for what the mean and the variance of c on a slave segment add to ΔB of dual shapes."""
    points, shapes, size = rows.points, rows.shapes, rows.n_unknowns
    difference = pressure[rows.ends[:, 1]] - pressure[rows.ends[:, 0]]
    d_pressure = (difference * shapes.slope[0])[:, None, None] * rows.gains[:, D_C]
    at_points = shapes.at(pressure[None], rows.ends)[0]
    derivative = tangent(points, rows.gains, at_points, d_pressure, rows.nodes, size).tocsr()
    ends = rows.by_cell(rows.ends)
    return derivative, influence(points, shapes.values[0], ends, rows.nodes, (size, len(pressure))).tocsr()


def by_lengths(rows: Rows, pressure: Any) -> Any:
    """Compute the forces of a unit of c̄ and, behind them, of v of all slave segments, (n_unknowns, 2 n_segments)."""
    shapes = rows.shapes
    difference = pressure[rows.ends[:, 1]] - pressure[rows.ends[:, 0]]
    by = np.column_stack([difference * shapes.by_mean[0], difference * shapes.by_variance[0]])
    segment = rows.by_cell(rows.segment)
    places = np.column_stack([segment, segment + rows.n_segments])
    shape = (rows.n_unknowns, 2 * rows.n_segments)
    return influence(rows.points, by, places, rows.nodes, shape).tocsr()


def mortar_tangent(plugin: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Compute the tangent of a mortar method by penalty: Σ p_j ΔB_j + B Δp."""
    weighting, active, x = plugin.weighting, pairing["active"], z.reshape(-1, 2)
    weighted = weighting.carrying(interface, pairing, x[None])
    areas = np.where(active, weighted.areas[0], 1.0)
    gaps = np.where(active, weighted.with_gap[0] / areas, 0.0)
    weights = np.where(active, -plugin.penalty, 0.0)
    rows = Rows(
        weighting.quadrature.gains(interface, weighted.cells, x),
        weighted.points[0],
        weighted.shapes,
        weighted.segment,
        weighted.ends,
        weighted.nodes,
        len(interface.slave),
        interface.n_unknowns,
        weighting.dual,
    )
    derivative, influence = at_fixed_pressures(rows, weights * gaps)
    return (derivative + (influence * weights) @ rows.weighted_gaps(gaps, areas)).toarray()


def half_pass_tangent(plugin: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Compute the tangent of two half passes: that of each pass, on the rows of the surface that it pushes."""
    total, active, x = np.zeros((z.size, z.size)), pairing["active"], z.reshape(-1, 2)
    for half_pass in plugin._carrying(interface, pairing, x[None]):
        sides, ranges = half_pass.sides, half_pass.ranges
        own = active & (half_pass.areas[0] != 0)
        areas = np.where(own, half_pass.areas[0], 1.0)
        gaps, weights = half_pass.with_gap[0] / areas, np.where(own, -plugin.penalty, 0.0)
        rows = Rows(
            ranges.gains(sides, x, plugin.rule),
            half_pass.points[0],
            half_pass.shapes,
            ranges.slave,
            half_pass.ends,
            ranges.local_nodes(sides),
            len(sides.slave),
            z.size,
            False,
        )
        derivative, influence = at_fixed_pressures(rows, weights * gaps)
        whole = (derivative + (influence * weights) @ rows.weighted_gaps(gaps, areas)).toarray()
        pushed = (2 * sides.slave.nodes[:, None] + np.arange(2)).ravel()
        total[pushed] += whole[pushed]
    return total
