"""Compute what all mortar methods share: points, shapes and weighted gaps of a state, forces, and all Δ.

A method decides which pressures the slave nodes have. This file does not know: it weights gaps over the slave nodes'
shapes, spreads nodal pressures over the cells, and hands out the Δ of both.

Source: Puso & Laursen (2004); Popp, Gitterle, Gee & Wall (2010).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, BoolArray, FloatArray, IntArray
from contactverif.contract.interface import Interface
from contactverif.contract.pairing import Pairing
from contactverif.geometry.block_rows import Couplings, NumberArray, zero_matrix
from contactverif_mortar import cell_forces
from contactverif_mortar.cell_forces import Shapes, integrals
from contactverif_mortar.integration_cells import Cells, Quadrature, Sides
from contactverif_mortar.node_factors import Factors, NodeRows
from contactverif_mortar.node_groups import RowGroups, check_product, group_nodes
from contactverif_mortar.node_rows import NodeState, node_rows, weigh
from contactverif_mortar.shape_rows import ShapedPoints, add_shaped_rows

# The smallest covered share of a node's own length that counts. Below it the node would carry less than the roundoff of
# its neighbour's force, and the row of its multiplier would vanish.
UNCOVERED = 64 * UNIT_ROUNDOFF


def own_lengths(interface: Interface | Sides, x: FloatArray) -> FloatArray:
    """Return half of the length of the segments at each slave node (n_slave_nodes,), at x (n_nodes, 2)."""
    halves = np.repeat(interface.slave.lengths(x) / 2, 2)
    ends, n_nodes = interface.slave.segments.ravel(), interface.n_slave_nodes
    lengths: FloatArray = cell_forces.sum_by_place(halves[None], ends, n_nodes)[0]
    return lengths


def divide_covered(areas: FloatArray, with_gap: FloatArray, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return ∫N_j and G_j (n_slave_nodes,) of nodes with own `lengths`; zero and NaN where nothing is covered."""
    covered = areas > UNCOVERED * lengths
    gaps = np.full(len(covered), np.nan)
    gaps[covered] = with_gap[covered] / areas[covered]
    return np.where(covered, areas, 0.0), gaps


class StateWeights(NamedTuple):
    """The integrals of the shapes of the slave nodes at one state, and the shapes: their numbers, or at points."""

    areas: FloatArray  # (n_slave_nodes,) ∫φ_j and ∫φ_j g.
    with_gap: FloatArray
    shapes: FloatArray | ShapedPoints


class Carried(NamedTuple):
    """The cells that carry pressures at one state, and what a method makes of them."""

    cells: Cells
    active: BoolArray  # (n_slave_nodes,)
    weights: StateWeights
    x: FloatArray  # (n_nodes, 2)
    state: NodeState


@dataclass(frozen=True, slots=True, eq=False)
class Weighted:
    """The points of some cells at some states, the slave nodes' shapes there, and weighted gaps."""

    cells: Cells
    points: Array  # (n_states, n_points, 6) The points of `Quadrature.points`.
    shapes: Shapes
    ends: IntArray  # (n_points, 2) The slave nodes of each point.
    segment: IntArray  # (n_points,) The slave segment of each point.
    nodes: NumberArray  # (n_cells, n_local)
    areas: Array  # (n_states, n_slave_nodes) ∫φ_j and ∫φ_j g.
    with_gap: Array

    def forces(self, pressure: Array, n_nodes: int) -> Array:
        """Compute forces (n_states, n_nodes, 2) from pressures (n_states, n_slave_nodes) of the slave nodes."""
        return cell_forces.forces(self.points, self.shapes.at(pressure, self.ends), self.nodes, n_nodes)


@dataclass(frozen=True, slots=True, eq=False)
class Weighting:
    """A way to weight gaps and to interpolate pressures."""

    averaged: bool  # Normals are averaged at the slave nodes; else they are those of the segments.
    dual: bool  # Shapes are biorthogonal; else they are standard.
    quadrature: Quadrature  # The points on a cell, and the configuration in which lengths are measured.

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

    def weigh(self, interface: Interface, cells: Cells, x: FloatArray) -> StateWeights:
        """Compute the integrals of the shapes on some cells at one state, x (n_nodes, 2)."""
        if not self.averaged:
            return StateWeights(*weigh(interface, cells, self.quadrature, x, self.dual))
        weighted = self.at(interface, cells, x[None])

        def make_gains(begin: int, end: int) -> FloatArray:
            return self.quadrature.gains(interface, cells.select(slice(begin, end)), x)

        points, slave = weighted.points[0], interface.slave.segments
        shaped = ShapedPoints(points, weighted.shapes, weighted.segment, slave, make_gains)
        return StateWeights(weighted.areas[0], weighted.with_gap[0], shaped)

    def gaps(self, interface: Interface, cells: Cells, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ∫N_j and G_j (n_slave_nodes,) at x (n_nodes, 2); where nothing is covered they are zero and NaN."""
        weights = self.weigh(interface, cells, x)
        lengths = own_lengths(interface, x if self.quadrature.current else interface.nodes)
        return divide_covered(weights.areas, weights.with_gap, lengths)

    def pairing(self, interface: Interface, x: FloatArray, penalty: float, multipliers: FloatArray | float) -> Pairing:
        """Find the cells, and the active slave nodes: those that are covered and have λ_j − ε̂ G_j ≥ 0."""
        cells = Cells.find(interface, x, self.averaged)
        _, gaps = self.gaps(interface, cells, x)
        return Pairing({**cells.as_arrays(), "active": multipliers - penalty * gaps >= 0})  # false where the gap is NaN

    def tangent(self, interface: Interface, carried: Carried) -> NodeRows:
        """Compute forces and the assembled tangent, which is the `rest` of the result."""
        n_nodes = len(carried.active)

        def choose_pattern(groups: RowGroups) -> Couplings:
            check_product(groups.starts[: n_nodes + 1])
            return groups.pattern(0, n_nodes)

        rows = self._rows(interface, carried, choose_pattern)
        rows.multiply(carried.state.weights, 0, len(rows.groups.starts) - 1)
        return rows

    def factors(self, interface: Interface, carried: Carried) -> Factors:
        """Compute the tangent in factors at a state of the slave nodes."""
        return self._rows(interface, carried, RowGroups.pattern_of_cells).factors(carried.state.weights)

    def saddle(
        self, interface: Interface, cells: Cells, active: BoolArray, x: FloatArray, multipliers: FloatArray
    ) -> Factors:
        """Compute Σ λ_j ΔB_j, B and Δ∫φ_j g: the `rest`, and `left` and `right` of the slave nodes alone."""
        zeros, ones, n_nodes = np.zeros(len(active)), np.ones(len(active)), len(active)
        state, weights = NodeState(multipliers, ones, zeros, ones), self.weigh(interface, cells, x)

        def choose_pattern(groups: RowGroups) -> Couplings:
            if self.dual:
                return groups.pattern(n_nodes, len(groups.starts) - 1)
            return groups.pattern_of_cells()

        rows = self._rows(interface, Carried(cells, active, weights, x, state), choose_pattern)
        rows.multiply(ones, n_nodes, len(rows.groups.starts) - 1)
        rest, left, _, right = rows.factors(ones)
        return Factors(rest, left[:n_nodes], ones, right[:n_nodes])

    def _rows(
        self, interface: Interface, carried: Carried, choose_pattern: Callable[[RowGroups], Couplings]
    ) -> NodeRows:
        """Compute forces and factors, with a pattern for the rest that depends on the groups of the rows."""
        cells, active, weights, x, state = carried
        groups = group_nodes(
            interface.n_nodes, interface.slave.segments, cells.slave, cells.local_nodes(interface), active, self.dual
        )
        pattern, shapes = choose_pattern(groups), weights.shapes
        if not isinstance(shapes, ShapedPoints):
            return node_rows(interface, cells, self.quadrature, x, shapes, state, groups, pattern)
        forces, rest = np.zeros(interface.n_unknowns), zero_matrix(interface.n_nodes, 0, pattern)
        return add_shaped_rows(shapes, groups, state, 4, forces, rest)
