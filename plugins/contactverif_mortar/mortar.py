"""Mortar contact: gaps weighted over the slave nodes' shapes, pressures or multipliers at slave nodes.

| method | pressure | shapes |
|---|---|---|
| `mortar` | p_j = −ε̂ G_j where G_j ≤ 0 | N |
| `mortar-dual` | the same | ψ, biorthogonal to N on what is covered |
| `mortar-lm`, `mortar-dual-lm` | a multiplier λ_j, ∫φ_j g = 0 where active | N, ψ |
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray
from contactverif.contract.formulation import ContactPoints, Pairing, Traits
from contactverif.contract.interface import Interface
from contactverif.contract.state_vector import join_rows, split_state, split_states
from contactverif_mortar.cells import Cells, Quadrature
from contactverif_mortar.options import AREAS, NORMALS, check_penalty, chosen
from contactverif_mortar.reported import at_nodes
from contactverif_mortar.weighting import Weighting, of_given_pressures, own_lengths

_SOURCES = {
    False: "Puso & Laursen, Comput. Methods Appl. Mech. Engrg 193 (2004) 601–629",
    True: "Popp, Gitterle, Gee & Wall, Int. J. Numer. Meth. Engng 83 (2010) 1428–1465",
}


@dataclass(frozen=True, slots=True, eq=False)
class Mortar:
    """Pressures −ε̂ G_j at slave nodes that are covered and have G_j ≤ 0."""

    traits: Traits
    penalty: float
    weighting: Weighting

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """The cells, and which slave nodes are in contact."""
        return self.weighting.pairing(interface, np.array(z).reshape(-1, 2), self.penalty, 0.0)

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Forces (..., n_unknowns)."""
        x = np.array(z).reshape(-1, interface.n_nodes, 2)
        weighted, active = self.weighting.carrying(interface, pairing, x), pairing["active"]
        pressure = np.zeros_like(weighted.areas)
        pressure[:, active] = -self.penalty * weighted.with_gap[:, active] / weighted.areas[:, active]
        return weighted.forces(pressure, interface.n_nodes).reshape(z.shape)

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.coo_array:
        """The exact derivative of the residual, sparse: Σ p_j ΔB_j + B Δp."""
        x, active = np.array(z).reshape(-1, 2), pairing["active"]
        weighted = self.weighting.carrying(interface, pairing, x[None])
        areas = np.where(active, weighted.areas[0], 1.0)
        gaps = np.where(active, weighted.with_gap[0] / areas, 0.0)
        stiffness = np.where(active, self.penalty, 0.0)
        rows = self.weighting.rows(interface, weighted, x)
        own, influence = of_given_pressures(rows, -stiffness * gaps)
        return (own - influence @ sparse.diags_array(stiffness) @ rows.of_gaps(gaps, areas)).tocoo()

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """The slave nodes: weighted gap and nodal pressure, ∫N_j as weight."""
        x, cells, active = np.array(z).reshape(-1, 2), Cells.of(pairing), pairing["active"]
        areas, gaps = self.weighting.gaps(interface, cells, x)
        pressure = np.where(active, -self.penalty * gaps, 0.0)
        return at_nodes(interface, cells, x, areas, gaps, pressure, active)


@dataclass(frozen=True, slots=True, eq=False)
class MortarMultipliers:
    """A multiplier λ_j ≥ 0 at each slave node, a pressure. Unknowns are positions and behind them multipliers.

    Attributes
    ----------
    penalty : float
        C of the decision that a node is active: it is covered and λ_j − c G_j ≥ 0.
    """

    traits: Traits
    penalty: float
    weighting: Weighting

    def n_multipliers(self, interface: Interface) -> int:
        """One at each slave node."""
        return interface.n_slave_nodes

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """The cells, and which slave nodes are in contact."""
        x, multipliers = split_states(interface, z)
        return self.weighting.pairing(interface, x[0], self.penalty, multipliers[0])

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Forces and behind them constraint rows (..., n_unknowns + n_slave_nodes).

        Rows: −∫φ_j g where active, else λ_j × the node's own length in the reference.
        """
        x, multipliers = split_states(interface, z)
        weighted, active = self.weighting.carrying(interface, pairing, x), pairing["active"]
        forces = weighted.forces(np.where(active, multipliers, 0.0), interface.n_nodes)
        rows = np.where(active, -weighted.with_gap, multipliers * own_lengths(interface, interface.nodes))
        return join_rows(forces, rows, z)

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.coo_array:
        """The exact derivative of all rows, sparse: [[Σ λ_j ΔB_j, B], [−Δ∫φ_j g, 0]], and lengths where not active."""
        x, multipliers = split_state(interface, z)
        active = pairing["active"]
        rows = self.weighting.rows(interface, self.weighting.carrying(interface, pairing, x[None]), x)
        own, influence = of_given_pressures(rows, np.where(active, multipliers, 0.0))
        d_gaps = rows.of_gaps(np.zeros(len(active)), np.ones(len(active)))
        some = sparse.diags_array(active.astype(np.float64))
        idle = sparse.diags_array(np.where(active, 0.0, own_lengths(interface, interface.nodes)))
        return sparse.block_array([[own, influence @ some], [-(some @ d_gaps), idle]]).tocoo()

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """The slave nodes: weighted gap and multiplier, ∫N_j as weight."""
        x, multipliers = split_state(interface, z)
        cells, active = Cells.of(pairing), pairing["active"]
        areas, gaps = self.weighting.gaps(interface, cells, x)
        return at_nodes(interface, cells, x, areas, gaps, np.where(active, multipliers, 0.0), active)


def mortar(*, penalty: float, area: str = "current", normals: str = "segment") -> Mortar:
    """Mortar with standard shapes: nodal pressures ε̂⟨−G_j⟩, interpolated linearly.

    Parameters
    ----------
    penalty : float
        Distributed stiffness ε̂ > 0, force per length per length of penetration.
    area : str
        "current" or "reference", where lengths are measured.
    normals : str
        "segment" (default), or "averaged" at slave nodes and interpolated in between, which is smoother and
        fails the patch test on a kinked surface.
    """
    return Mortar(_traits(area, normals, False), check_penalty(penalty), _weighting(area, normals, False))


def mortar_dual(*, penalty: float, area: str = "current", normals: str = "segment") -> Mortar:
    """Mortar with dual shapes: weighted gaps come from linear fits, and a nodal pressure moves no other slave node.

    Parameters are those of `mortar`.
    """
    return Mortar(_traits(area, normals, True), check_penalty(penalty), _weighting(area, normals, True))


def mortar_lm(*, penalty: float, area: str = "current", normals: str = "segment") -> MortarMultipliers:
    """Mortar with a Lagrange multiplier at each slave node, standard shapes.

    Parameters
    ----------
    penalty : float
        c > 0 of the decision λ_j − c G_j ≥ 0, force per length per length; the solution does not depend on it.
    area, normals : str
        As for `mortar`.
    """
    traits = _by_multipliers(_traits(area, normals, False))
    return MortarMultipliers(traits, check_penalty(penalty), _weighting(area, normals, False))


def mortar_dual_lm(*, penalty: float, area: str = "current", normals: str = "segment") -> MortarMultipliers:
    """Mortar with a Lagrange multiplier at each slave node, dual shapes.

    Parameters are those of `mortar_lm`.
    """
    traits = _by_multipliers(_traits(area, normals, True))
    return MortarMultipliers(traits, check_penalty(penalty), _weighting(area, normals, True))


def _weighting(area: str, normals: str, dual: bool) -> Weighting:
    averaged = chosen("normals", normals, NORMALS)
    # Linear shapes times linear gaps are exact with two points; unit normals that turn are not polynomials.
    return Weighting(averaged, dual, Quadrature.gauss(3 if averaged else 2, chosen("area", area, AREAS)))


def _by_multipliers(traits: Traits) -> Traits:
    """At given multipliers forces jump where a node is let go."""
    return replace(traits, enforcement="multiplier", independent_multipliers=True, continuity=None)


def _traits(area: str, normals: str, dual: bool) -> Traits:
    return Traits(
        passes_flat_patch=True,
        covers_overhang=True,
        tangent="exact",
        symmetric=False,  # forces are along the slave's normal, the gradient of the gap is not
        conserves_force=True,
        conserves_moment=True,
        # averaged directions of a coarse ring turn away from a segment that is still seen, and its cell is gone at once
        continuity=None if chosen("normals", normals, NORMALS) else "C0",
        area="current" if chosen("area", area, AREAS) else "reference",
        penalty="distributed",
        batched=True,
        takes_complex=True,
        source=_SOURCES[dual],
    )
