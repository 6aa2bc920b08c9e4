"""Compute what all mortar methods share: points, shapes and weighted gaps of a state, forces, and all Δ.

A method decides which pressures the slave nodes have. This file does not know: it weights gaps over the slave nodes'
shapes, spreads nodal pressures over the cells, and hands out the Δ of both.

Source: Puso & Laursen (2004); Popp, Gitterle, Gee & Wall (2010).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, BoolArray, FloatArray, IntArray
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
from contactverif.geometry.block_rows import Couplings
from contactverif_mortar import cell_forces
from contactverif_mortar.cell_geometry import D_C
from contactverif_mortar.integration_cells import Cells, Quadrature
from contactverif_mortar.node_factors import (
    Factors,
    check_product,
    fixed_pressures,
    group_nodes,
    multiply,
    rows_of_nodes,
)
from contactverif_mortar.pressure_shapes import Rows, Shapes, integrals

# The smallest covered share of a node's own length that counts. Below it the node would carry less than the roundoff of
# its neighbour's force, and the row of its multiplier would vanish.
UNCOVERED = 64 * UNIT_ROUNDOFF


def own_lengths(interface: Interface, x: FloatArray) -> FloatArray:
    """Return half of the length of the segments at each slave node (n_slave_nodes,), at x (n_nodes, 2)."""
    halves = np.repeat(interface.slave.lengths(x) / 2, 2)
    ends, n_nodes = interface.slave.segments.ravel(), interface.n_slave_nodes
    lengths: FloatArray = cell_forces.sum_by_place(halves[None], ends, n_nodes)[0]
    return lengths


class NodeState(NamedTuple):
    """The slave nodes of a method at one state.

    Attributes
    ----------
    pressure : FloatArray, shape (n_slave_nodes,)
        The pressures p_j, zero where a node is not active.
    weights : FloatArray, shape (n_slave_nodes,)
        Δp_j for each unit of row j of `Factors.right`.
    gaps, divisor : FloatArray, shape (n_slave_nodes,)
        G_j and ∫φ_j, if that row is ΔG_j. Zero and one, if it is Δ∫φ_j g.
    """

    pressure: FloatArray
    weights: FloatArray
    gaps: FloatArray
    divisor: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Weighted:
    """The points of some cells at some states, the slave nodes' shapes there, and weighted gaps.

    Attributes
    ----------
    cells : Cells
        The cells.
    points : Array, shape (n_states, n_points, 6)
        The points of `Quadrature.points`.
    shapes : Shapes
        The shapes at the points.
    ends : IntArray, shape (n_points, 2)
        The slave nodes of each point.
    segment : IntArray, shape (n_points,)
        The slave segment of each point.
    nodes : IntArray, shape (n_cells, n_local)
        The nodes of `Cells.local_nodes`.
    areas, with_gap : Array, shape (n_states, n_slave_nodes)
        ∫φ_j and ∫φ_j g.
    """

    cells: Cells
    points: Array
    shapes: Shapes
    ends: IntArray
    segment: IntArray
    nodes: IntArray
    areas: Array
    with_gap: Array

    def forces(self, pressure: Array, n_nodes: int) -> Array:
        """Compute forces (n_states, n_nodes, 2) from pressures (n_states, n_slave_nodes) of the slave nodes."""
        return cell_forces.forces(self.points, self.shapes.at(pressure, self.ends), self.nodes, n_nodes)


@dataclass(frozen=True, slots=True, eq=False)
class Weighting:
    """A way to weight gaps and to interpolate pressures.

    Attributes
    ----------
    averaged : bool
        Normals are averaged at the slave nodes; else they are those of the segments.
    dual : bool
        Shapes are biorthogonal; else they are standard.
    quadrature : Quadrature
        The points on a cell, and the configuration in which lengths are measured.
    """

    averaged: bool
    dual: bool
    quadrature: Quadrature

    def at(self, interface: Interface, cells: Cells, x: Array) -> Weighted:
        """Compute points, shapes and weighted gaps on some cells at the positions x (n_states, n_nodes, 2)."""
        points = self.quadrature.points(interface, cells, x)
        segment = np.repeat(cells.slave, len(self.quadrature))
        ends = interface.slave.segments[segment]
        shapes = Shapes.dual(points, segment, len(interface.slave)) if self.dual else Shapes.standard(points)
        sums = integrals(shapes, points, ends, interface.n_slave_nodes)
        return Weighted(cells, points, shapes, ends, segment, cells.local_nodes(interface), *sums)

    def carrying(self, interface: Interface, pairing: Pairing, x: Array) -> Weighted:
        """Do so on the cells whose slave segment has an active node; the others carry no pressure."""
        return self.at(interface, Cells.from_pairing(pairing).near(pairing["active"], interface), x)

    def gaps(self, interface: Interface, cells: Cells, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ∫N_j and G_j (n_slave_nodes,) at x (n_nodes, 2); where nothing is covered they are zero and NaN."""
        weighted = self.at(interface, cells, x[None])
        lengths = own_lengths(interface, x if self.quadrature.current else interface.nodes)
        covered = weighted.areas[0] > UNCOVERED * lengths
        gaps = np.full(len(covered), np.nan)
        gaps[covered] = weighted.with_gap[0, covered] / weighted.areas[0, covered]
        return np.where(covered, weighted.areas[0], 0.0), gaps

    def pairing(self, interface: Interface, x: FloatArray, penalty: float, multipliers: FloatArray | float) -> Pairing:
        """Find the cells, and the active slave nodes: those that are covered and have λ_j − ε̂ G_j ≥ 0."""
        cells = Cells.find(interface, x, self.averaged)
        _, gaps = self.gaps(interface, cells, x)
        return Pairing({**cells.as_arrays(), "active": multipliers - penalty * gaps >= 0})  # false where the gap is NaN

    @property
    def plain(self) -> bool:
        """True for standard shapes on slaves that look along their own normal: `node_factors` serves them."""
        return not (self.averaged or self.dual)

    def tangent(
        self, interface: Interface, active: BoolArray, weighted: Weighted, x: FloatArray, state: NodeState
    ) -> sparse.csr_array:
        """Compute the assembled tangent (n_unknowns, n_unknowns) at a state of the slave nodes."""
        if not self.plain:
            return self.factors(interface, active, weighted, x, state).assemble()
        groups = group_nodes(interface, weighted.cells, active)
        check_product(groups)
        factors = self._plain_factors(interface, groups, weighted, x, state, groups)
        return multiply(factors, groups)

    def factors(
        self, interface: Interface, active: BoolArray, weighted: Weighted, x: FloatArray, state: NodeState
    ) -> Factors:
        """Compute the tangent in factors at a state of the slave nodes."""
        if self.plain:
            groups = group_nodes(interface, weighted.cells, active)
            return self._plain_factors(interface, groups, weighted, x, state, None)
        rows = self.rows(interface, weighted, x)
        rest, left = at_fixed_lengths(rows, state.pressure)
        right, weights = rows.weighted_gaps(state.gaps, state.divisor), state.weights
        if self.dual:
            left = sparse.hstack([left, by_lengths(rows, state.pressure)])
            right = sparse.vstack([right, rows.segment_moments()])
            weights = np.append(weights, np.ones(right.shape[0] - len(weights)))
        return Factors(rest, left.T.tocsr(), weights, right.tocsr())

    def saddle(
        self, interface: Interface, active: BoolArray, weighted: Weighted, x: FloatArray, multipliers: FloatArray
    ) -> tuple[sparse.csr_array, sparse.csr_array, sparse.csr_array]:
        """Compute Σ λ_j ΔB_j, B (n_unknowns, n_slave_nodes) and Δ∫φ_j g (n_slave_nodes, n_unknowns)."""
        zeros, ones = np.zeros(len(active)), np.ones(len(active))
        if self.plain:
            state = NodeState(multipliers, ones, zeros, ones)
            rest, left, _, right = self.factors(interface, active, weighted, x, state)
            return rest, left.T.tocsr(), right
        rows = self.rows(interface, weighted, x)
        return *at_fixed_pressures(rows, multipliers), rows.weighted_gaps(zeros, ones)

    def _plain_factors(
        self,
        interface: Interface,
        groups: Couplings,
        weighted: Weighted,
        x: FloatArray,
        state: NodeState,
        pattern: Couplings | None,
    ) -> Factors:
        """Compute the factors for standard shapes, with `pattern` for the rest if it is to have more entries."""
        arguments = (interface, weighted.cells, self.quadrature, x, weighted.points[0])
        rest = fixed_pressures(*arguments, state.pressure, pattern)
        left, right = rows_of_nodes(*arguments, groups, state.gaps, state.divisor)
        return Factors(rest, left, state.weights, right)

    def rows(self, interface: Interface, weighted: Weighted, x: FloatArray) -> Rows:
        """Compute all Δ of the points of one state, x (n_nodes, 2)."""
        return Rows(
            self.quadrature.gains(interface, weighted.cells, x),
            weighted.points[0],
            weighted.shapes,
            weighted.segment,
            weighted.ends,
            weighted.nodes,
            len(interface.slave),
            interface.n_nodes * 2,
            self.dual,
        )


def at_fixed_pressures(rows: Rows, pressure: FloatArray) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Compute the derivative of the forces at fixed nodal pressures, and the forces of unit pressures.

    Parameters
    ----------
    rows : Rows
        The Δ of the points of one state.
    pressure : FloatArray, shape (n_slave_nodes,)
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


def at_fixed_lengths(rows: Rows, pressure: FloatArray) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Compute the same, but for what the mean and the variance of c on a slave segment add to ΔB of dual shapes."""
    points, shapes, size = rows.points, rows.shapes, rows.n_unknowns
    difference = pressure[rows.ends[:, 1]] - pressure[rows.ends[:, 0]]
    d_pressure = (difference * shapes.slope[0])[:, None, None] * rows.gains[:, D_C]
    at_points = shapes.at(pressure[None], rows.ends)[0]
    derivative = cell_forces.tangent(points, rows.gains, at_points, d_pressure, rows.nodes, size).tocsr()
    ends = rows.by_cell(rows.ends)
    influence = cell_forces.influence(points, shapes.values[0], ends, rows.nodes, (size, len(pressure))).tocsr()
    return derivative, influence


def by_lengths(rows: Rows, pressure: FloatArray) -> sparse.csr_array:
    """Compute the forces of a unit of c̄ and, behind them, of v of all slave segments, (n_unknowns, 2 n_segments)."""
    shapes = rows.shapes
    difference = pressure[rows.ends[:, 1]] - pressure[rows.ends[:, 0]]
    by = np.column_stack([difference * shapes.by_mean[0], difference * shapes.by_variance[0]])
    segment = rows.by_cell(rows.segment)
    places = np.column_stack([segment, segment + rows.n_segments])
    shape = (rows.n_unknowns, 2 * rows.n_segments)
    return cell_forces.influence(rows.points, by, places, rows.nodes, shape).tocsr()
