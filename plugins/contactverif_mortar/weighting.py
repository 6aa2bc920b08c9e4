"""What mortar methods share: points, shapes and weighted gaps of a state, B and all Δ, whatever the pressures are.

Source: Puso & Laursen (2004); Popp, Gitterle, Gee & Wall (2010).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, FloatArray, IntArray
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
from contactverif_mortar import transmission
from contactverif_mortar.cells import Cells, Quadrature
from contactverif_mortar.geometry import D_C
from contactverif_mortar.shapes import Rows, Shapes, integrals

# A node whose covered part is below this share of its own length is not covered. What it would carry is below roundoff
# of what its neighbour does, and the row of its multiplier would be no row at all.
UNCOVERED = 64 * UNIT_ROUNDOFF


def own_lengths(interface: Interface, x: FloatArray) -> FloatArray:
    """Half of the segments at each slave node (n_slave_nodes,), at the positions x (n_nodes, 2)."""
    halves = np.repeat(interface.slave.lengths(x) / 2, 2)
    return np.bincount(interface.slave.segments.ravel(), halves, interface.n_slave_nodes).astype(np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Weighted:
    """Points of the cells in question at some states, and what the slave nodes' shapes make of them.

    Attributes
    ----------
    points : Array, shape (n_states, n_points, 6)
        Of `Quadrature.points`.
    ends, segment : IntArray, shape (n_points, 2)
        And (n_points,) slave nodes and slave segment of each.
    nodes : IntArray, shape (n_cells, n_local)
        Of `Cells.local_nodes`.
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
        """Forces (n_states, n_nodes, 2) of pressures (n_states, n_slave_nodes) of the slave nodes."""
        return transmission.forces(self.points, self.shapes.at(pressure, self.ends), self.nodes, n_nodes)


@dataclass(frozen=True, slots=True, eq=False)
class Weighting:
    """How gaps are weighted and pressures interpolated.

    Attributes
    ----------
    averaged : bool
        Normals are averaged at the slave nodes, else those of the segments.
    dual : bool
        Shapes are biorthogonal, else standard.
    quadrature : Quadrature
        The points on a cell, and where their lengths are measured.
    """

    averaged: bool
    dual: bool
    quadrature: Quadrature

    def at(self, interface: Interface, cells: Cells, x: Array) -> Weighted:
        """All of it on these cells at the positions x (n_states, n_nodes, 2)."""
        points = self.quadrature.points(interface, cells, x)
        segment = np.repeat(cells.slave, len(self.quadrature))
        ends = interface.slave.segments[segment]
        shapes = Shapes.dual(points, segment, len(interface.slave)) if self.dual else Shapes.standard(points)
        sums = integrals(shapes, points, ends, interface.n_slave_nodes)
        return Weighted(cells, points, shapes, ends, segment, cells.local_nodes(interface), *sums)

    def carrying(self, interface: Interface, pairing: Pairing, x: Array) -> Weighted:
        """The same on the cells whose slave segment has an active node; of the others nothing is felt."""
        return self.at(interface, Cells.of(pairing).near(pairing["active"], interface), x)

    def gaps(self, interface: Interface, cells: Cells, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """∫N_j (n_slave_nodes,), zero where nothing is covered, and G_j, NaN there, at x (n_nodes, 2)."""
        found = self.at(interface, cells, x[None])
        covered = found.areas[0] > UNCOVERED * own_lengths(interface, x if self.quadrature.current else interface.nodes)
        gaps = np.full(len(covered), np.nan)
        gaps[covered] = found.with_gap[0, covered] / found.areas[0, covered]
        return np.where(covered, found.areas[0], 0.0), gaps

    def pairing(self, interface: Interface, x: FloatArray, penalty: float, multipliers: FloatArray | float) -> Pairing:
        """The cells, and the slave nodes that are covered and have λ_j − ε̂ G_j ≥ 0."""
        cells = Cells.find(interface, x, self.averaged)
        _, gaps = self.gaps(interface, cells, x)
        return Pairing({**cells.as_arrays(), "active": multipliers - penalty * gaps >= 0})  # not where NaN

    def rows(self, interface: Interface, weighted: Weighted, x: FloatArray) -> Rows:
        """All Δ of the points of one state, x (n_nodes, 2)."""
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


def of_given_pressures(rows: Rows, pressure: FloatArray) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Σ p_j ΔB_j at given nodal pressures, and B (n_unknowns, n_slave_nodes), the forces of unit pressures."""
    points, shapes, size = rows.points, rows.shapes, rows.n_unknowns
    difference = pressure[rows.ends[:, 1]] - pressure[rows.ends[:, 0]]
    d_pressure = (difference * shapes.slope[0])[:, None, None] * rows.gains[:, D_C]
    at_points = shapes.at(pressure[None], rows.ends)[0]
    own = transmission.tangent(points, rows.gains, at_points, d_pressure, rows.nodes, size).tocsr()
    ends = rows.by_cell(rows.ends)
    influence = transmission.influence(points, shapes.values[0], ends, rows.nodes, (size, len(pressure))).tocsr()
    if rows.dual:
        by = np.column_stack([difference * shapes.by_mean[0], difference * shapes.by_variance[0]])
        segment = rows.by_cell(rows.segment)
        places = np.column_stack([segment, segment + rows.n_segments])
        through = transmission.influence(points, by, places, rows.nodes, (size, 2 * rows.n_segments))
        own = own + through.tocsr() @ rows.of_segments()
    return own, influence
