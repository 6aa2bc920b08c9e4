"""Mortar contact: gaps weighted over the slave nodes' shapes, pressures or multipliers at slave nodes.

| method | pressure | shapes |
|---|---|---|
| `mortar` | p_j = −ε̂ G_j where G_j ≤ 0 | N |
| `mortar-dual` | the same | ψ, biorthogonal to N on what is covered |
| `mortar-lm`, `mortar-dual-lm` | a multiplier λ_j, ∫φ_j g = 0 where active | N, ψ |

With `gap_shapes="standard"` dual shapes carry pressures alone, and gaps are weighted with N (Popp, Seitz et al. 2013).

Source: Puso & Laursen (2004); dual shapes: Popp, Gitterle, Gee & Wall (2010).
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from contactverif.compiler import match_precision
from contactverif.contract.arrays import Array, BoolArray, FloatArray
from contactverif.contract.formulation import ContactPoints, Pairing, check_penalty, choose
from contactverif.contract.interface import Interface, join_rows, split_state, split_states
from contactverif.contract.traits import Traits
from contactverif.geometry.block_rows import Couplings, TangentOfBoth, zero_matrix
from contactverif_mortar.cell_frame import ForcesAndTangent, NodeState, node_rows, weigh
from contactverif_mortar.integration_cells import AREAS, CELL_TRAITS, Cells, Quadrature, near, report_nodes
from contactverif_mortar.node_factors import Factors, NodeRows, RowGroups, check_product, group_nodes
from contactverif_mortar.shape_rows import Weighted, add_shaped_rows, divide_covered, own_lengths, weigh_points

# ∫φ_j and ∫φ_j g (n_slave_nodes,) at one state, and the shapes: their numbers, or at points.
StateWeights = tuple[FloatArray, FloatArray, FloatArray | Weighted]
GAP_SHAPES = {"dual": True, "standard": False}  # The words of the option `gap_shapes`.
NORMALS = {"segment": False, "averaged": True}  # The words of the option `normals`.

_SOURCES = {
    False: "Puso & Laursen, Comput. Methods Appl. Mech. Engrg 193 (2004) 601–629",
    True: "Popp, Gitterle, Gee & Wall, Int. J. Numer. Meth. Engng 83 (2010) 1428–1465",
}


@dataclass(frozen=True, slots=True, eq=False)
class Weighting:
    """A way to weight gaps and to interpolate pressures, and what all methods do with it.

    A method decides which pressures the slave nodes have. It does not know how gaps are weighted over the slave nodes'
    shapes, how nodal pressures spread over the cells, and what the variations of both are.
    """

    averaged: bool  # Normals are averaged at the slave nodes; else they are those of the segments.
    dual: bool  # Shapes are biorthogonal; else they are standard.
    alike: bool  # Gaps are weighted with the shapes of the pressures; else with standard ones.
    quadrature: Quadrature  # The points on a cell, and the configuration in which lengths are measured.

    def carrying(self, interface: Interface, pairing: Pairing, x: Array) -> Weighted:
        """Compute points, shapes, gaps at x (n_states, n_nodes, 2) on cells of segments with an active node."""
        cells = near(Cells.from_pairing(pairing), pairing["active"], interface)
        return weigh_points(interface, cells, self.quadrature, x, self.dual, self.alike)

    def weigh(self, interface: Interface, cells: Cells, x: FloatArray) -> StateWeights:
        """Compute the integrals of the shapes on some cells at one state, x (n_nodes, 2)."""
        if not self.averaged:
            return weigh(interface, cells, self.quadrature, x, self.dual, self.alike)
        weighted = weigh_points(interface, cells, self.quadrature, x[None], self.dual, self.alike)
        return weighted.areas[0], weighted.with_gap[0], weighted

    def gaps(self, interface: Interface, cells: Cells, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ∫N_j and G_j (n_slave_nodes,) at x (n_nodes, 2); where nothing is covered they are zero and NaN."""
        areas, with_gap, _ = self.weigh(interface, cells, x)
        return divide_covered(
            areas, with_gap, own_lengths(interface, x if self.quadrature.current else interface.nodes)
        )

    def pairing(self, interface: Interface, x: FloatArray, penalty: float, multipliers: FloatArray | float) -> Pairing:
        """Find the cells, and the active slave nodes: those that are covered and have λ_j − ε̂ G_j ≥ 0."""
        cells = Cells.find(interface, x, self.averaged)
        _, gaps = self.gaps(interface, cells, x)
        return Pairing({**cells._asdict(), "active": multipliers - penalty * gaps >= 0})  # false where the gap is NaN

    def groups(self, interface: Interface, cells: Cells, active: BoolArray) -> RowGroups:
        """Return the nodes of the rows of factors on some cells."""
        local = cells.local_nodes(interface)
        return group_nodes(interface.n_nodes, interface.slave.segments, cells.slave, local, active, self.dual)

    def rows(
        self,
        interface: Interface,
        cells: Cells,
        x: FloatArray,
        shapes: FloatArray | Weighted,
        state: NodeState,
        groups: RowGroups,
        pattern: Couplings,
    ) -> NodeRows:
        """Compute forces and factors on the cells that carry pressures, with the shapes of `weigh` there.

        The rest gets a pattern.
        """
        if not isinstance(shapes, Weighted):
            return node_rows(interface, cells, self.quadrature, x, shapes, state, groups, pattern)
        total, rest = np.zeros(interface.n_unknowns), zero_matrix(interface.n_nodes, 0, pattern)
        return add_shaped_rows(shapes, self.quadrature, x, groups, state, 4, total, rest)


@dataclass(frozen=True, slots=True, eq=False)
class Mortar(TangentOfBoth):
    """A mortar formulation by penalty: pressures −ε̂ G_j at slave nodes that are covered and have G_j ≤ 0."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.
    weighting: Weighting  # The shapes, the normals and the quadrature.

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells, and which slave nodes are in contact."""
        return self.weighting.pairing(interface, np.array(z).reshape(-1, 2), self.penalty, 0.0)

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        x = np.array(z).reshape(-1, interface.n_nodes, 2)
        weighted, active = self.weighting.carrying(interface, pairing, x), pairing["active"]
        pressure = np.zeros_like(weighted.areas)
        pressure[:, active] = -self.penalty * weighted.with_gap[:, active] / weighted.areas[:, active]
        return weighted.forces(pressure).reshape(z.shape)

    def residual_and_tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ForcesAndTangent:
        """Compute forces (n_unknowns,) and their derivative, Σ p_j ΔB_j + B Δp, from the same points."""
        rows = self._rows(interface, pairing, z, assembled=True)
        rows.multiply(0, len(rows.groups.starts) - 1)
        return rows.forces, rows.rest

    def factors(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> Factors:
        """Compute the derivative of the residual in factors, whose size grows with the number of cells alone.

        The assembled tangent is dense on all nodes that face the segments at a slave node. A solver that multiplies by
        the tangent, or that knows the pressures as unknowns of their own, does not need it.
        """
        return self._rows(interface, pairing, z, assembled=False).factors()

    def _rows(self, interface: Interface, pairing: Pairing, z: FloatArray, *, assembled: bool) -> NodeRows:
        x, active = np.array(z).reshape(-1, 2), pairing["active"]
        cells = near(Cells.from_pairing(pairing), active, interface)
        areas, with_gap, shapes = self.weighting.weigh(interface, cells, x)
        areas = np.where(active, areas, 1.0)
        gaps = np.where(active, with_gap / areas, 0.0)
        weights = np.where(active, -self.penalty, 0.0)
        state = NodeState(weights * gaps, weights, gaps, areas)
        groups = self.weighting.groups(interface, cells, active)
        if assembled:
            check_product(groups.starts[: len(active) + 1])
        pattern = groups.pattern(0, len(active)) if assembled else groups.pattern_of_cells()
        return self.weighting.rows(interface, cells, x, shapes, state, groups, pattern)

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the slave nodes with weighted gap and nodal pressure, ∫N_j as weight."""
        x, cells, active = np.array(z).reshape(-1, 2), Cells.from_pairing(pairing), pairing["active"]
        areas, gaps = self.weighting.gaps(interface, cells, x)
        pressure = np.where(active, -self.penalty * gaps, 0.0)
        return report_nodes(interface, cells, x, areas, gaps, pressure, active)


@dataclass(frozen=True, slots=True, eq=False)
class MortarMultipliers:
    """A mortar formulation with a multiplier λ_j ≥ 0, a pressure, at each slave node."""

    traits: Traits
    penalty: float  # Scale c of the decision that a node is active: it is covered and λ_j − c G_j ≥ 0.
    weighting: Weighting  # The shapes, the normals and the quadrature.

    def n_multipliers(self, interface: Interface) -> int:
        """Return the number of multipliers: one at each slave node."""
        return interface.n_slave_nodes

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells, and which slave nodes are in contact."""
        x, multipliers = split_state(interface, z)
        return self.weighting.pairing(interface, x, self.penalty, multipliers)

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute forces and, behind them, constraint rows (..., n_unknowns + n_slave_nodes).

        A row is −∫φ_j g where the node is active, else λ_j × the node's own length in the reference configuration.
        """
        x, multipliers = split_states(interface, z)
        weighted, active = self.weighting.carrying(interface, pairing, x), pairing["active"]
        forces = weighted.forces(np.where(active, multipliers, 0.0))
        (reference,) = match_precision(z, interface.nodes)
        rows = np.where(active, -weighted.with_gap, multipliers * own_lengths(interface, reference))
        return join_rows(forces, rows, z)

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.csr_array:
        """Compute the derivative of all rows, sparse: [[Σ λ_j ΔB_j, B], [−Δ∫φ_j g, 0]]; lengths if not active."""
        x, multipliers = split_state(interface, z)
        active = pairing["active"]
        cells = near(Cells.from_pairing(pairing), active, interface)
        n_nodes, zeros, ones = len(active), np.zeros(len(active)), np.ones(len(active))
        state = NodeState(np.where(active, multipliers, 0.0), ones, zeros, ones)

        shapes, groups = self.weighting.weigh(interface, cells, x)[2], self.weighting.groups(interface, cells, active)
        n_rows = len(groups.starts) - 1
        pattern = groups.pattern(n_nodes, n_rows) if self.weighting.dual else groups.pattern_of_cells()
        rows = self.weighting.rows(interface, cells, x, shapes, state, groups, pattern)
        rows.multiply(n_nodes, n_rows)
        derivative, left, _, right = rows.factors()
        influence, d_gaps = left[:n_nodes], right[:n_nodes]
        idle = sparse.diags_array(np.where(active, 0.0, own_lengths(interface, interface.nodes)), format="csr")
        upper = sparse.hstack([derivative, influence.T.tocsr()], format="csr")
        return sparse.vstack([upper, sparse.hstack([-d_gaps, idle], format="csr")], format="csr")

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the slave nodes with weighted gap and multiplier, ∫N_j as weight."""
        x, multipliers = split_state(interface, z)
        cells, active = Cells.from_pairing(pairing), pairing["active"]
        areas, gaps = self.weighting.gaps(interface, cells, x)
        return report_nodes(interface, cells, x, areas, gaps, np.where(active, multipliers, 0.0), active)


def mortar(*, penalty: float, area: str = "current", normals: str = "segment") -> Mortar:
    """Mortar with standard shapes: nodal pressures ε̂⟨−G_j⟩ of weighted gaps G_j, interpolated linearly.

    Cells are integrated exactly and forces balance point by point. So force and moment are conserved, the flat patch
    test is passed, and an overhang is covered. The tangent is exact and unsymmetric: forces are along the slave's
    normal, the gradient of the gap is not. With `normals="averaged"` normals are averaged at slave nodes and
    interpolated in between, which is smoother, and fails the patch test on a kinked surface.

    Source: Puso & Laursen, Comput. Methods Appl. Mech. Engrg 193 (2004) 601–629.
    """
    return Mortar(*_make(penalty, area, normals, dual=False))


def mortar_dual(*, penalty: float, area: str = "current", normals: str = "segment", gap_shapes: str = "dual") -> Mortar:
    """Mortar with dual shapes: a nodal pressure moves no other slave node.

    Its promises are those of `mortar`. The weighted gap of a node is the value of a linear fit to the gaps around it.
    That fit is extrapolated to a node that is not covered. There a gap that grows inwards may be below zero though it
    is open all along, and then it pushes. With `gap_shapes="standard"` gaps are weighted as in `mortar`, and it does
    not. A linear gap is integrated exactly, too.

    Source: Popp, Gitterle, Gee & Wall, Int. J. Numer. Meth. Engng 83 (2010) 1428–1465; standard shapes of gaps: Popp,
    Seitz, Gee & Wall, Comput. Methods Appl. Mech. Engrg 264 (2013) 67–80.
    """
    return Mortar(*_make(penalty, area, normals, dual=True, gap_shapes=gap_shapes))


def mortar_lm(*, penalty: float, area: str = "current", normals: str = "segment") -> MortarMultipliers:
    """Mortar with a Lagrange multiplier, a pressure, at each slave node, and standard shapes.

    Its promises are those of `mortar`, except that no continuity is promised: at given multipliers forces jump where a
    node is released. The constraints are independent, so the multipliers are unique.

    Source: Puso & Laursen, Comput. Methods Appl. Mech. Engrg 193 (2004) 601–629.
    """
    return MortarMultipliers(*_make(penalty, area, normals, dual=False, multipliers=True))


def mortar_dual_lm(*, penalty: float, area: str = "current", normals: str = "segment") -> MortarMultipliers:
    """Mortar with a Lagrange multiplier, a pressure, at each slave node, and dual shapes.

    Its promises are those of `mortar_lm`, but for gaps that open past the end of the master (`mortar_dual`).

    Source: Popp, Gitterle, Gee & Wall, Int. J. Numer. Meth. Engng 83 (2010) 1428–1465.
    """
    return MortarMultipliers(*_make(penalty, area, normals, dual=True, multipliers=True))


def _make(
    penalty: float, area: str, normals: str, *, dual: bool, multipliers: bool = False, gap_shapes: str = "dual"
) -> tuple[Traits, float, Weighting]:
    averaged, current = choose("normals", normals, NORMALS), choose("area", area, AREAS)
    extrapolates = choose("gap_shapes", gap_shapes, GAP_SHAPES) and dual
    kinked = {"patch.kinked": "edge of 53°, lower slave"} if averaged else {}
    pulls = {"nodal-push": "b"} if dual else {}
    extrapolated = {"unilateral": "open-end"} if extrapolates else {}
    traits = CELL_TRAITS.revise(
        kinked=not averaged,  # An averaged normal belongs to neither facet of a kink.
        # On a coarse ring, averaged directions turn away from a segment that is still seen, and its cell vanishes.
        continuity=None if averaged or multipliers else "C0",
        integrates_linear_gap=None if averaged or multipliers else dual and not extrapolates,
        opens_at_ends=not extrapolates,
        nodes_push=not dual,  # Dual shapes are negative in places.
        area=area,
        gap=None if averaged else "cells",
        gap_shapes="dual" if extrapolates else "standard",
        pressure_shapes="dual" if dual else "standard",
        force_along=None if averaged else "slave normal",
        witnesses={**kinked, **pulls, **extrapolated, "patch.tilted": "tilted", **CELL_TRAITS.evidence.witnesses},
        source=_SOURCES[dual],
    )
    if multipliers:
        traits = traits.revise(enforcement="multiplier", independent_multipliers=True, inf_sup=True)
    # Two points are exact for linear shapes × linear gaps. Unit normals that turn are not polynomials and get a third.
    rule = Quadrature.gauss(3 if averaged else 2, current)
    return traits, check_penalty(penalty), Weighting(averaged, dual, extrapolates or not dual, rule)
