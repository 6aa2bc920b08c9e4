"""Methods on cells in three dimensions: segment-to-segment springs at Gauss points, and mortar.

Springs: a point has the pressure −ε̂ g where g < 0, along the slave's normal, and pushes both faces by their shape
functions there. So force and moment balance point by point, and a uniform pressure is integrated exactly over what is
covered.

Mortar: the gap of slave node i is G_i / W_i with G_i = ∫ N_i g and W_i = ∫ N_i over what the master covers. Its
pressure −ε̂ G_i / W_i, where that is above 0, acts with the same shape function. So a uniform pressure is exact, and
force and moment balance at each point of the integrals.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.formulation import ContactPoints, Pairing, check_penalty
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits
from contactverif_surfaces.cell_points import (
    SURFACE_TRAITS,
    CellPoints,
    FacePairs,
    SlaveView,
    add_blocks,
    add_rows,
    axes_of,
    differentiate,
    first_faces,
    flatten_pushes,
    gauss_points,
    report_points,
    unknowns_of,
)

PointRule = Callable[[SlaveView, IntArray], CellPoints]  # It takes the view and the codes of cells.
N_POINTS = 6  # Gauss points a triangle: a gap × two shape functions has degree 3.


@dataclass(frozen=True, slots=True, eq=False)
class CellSprings:
    """The formulation: pressure −ε̂ g at each point of a cell where g < 0."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.
    rule: PointRule

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells, and which of their points are in contact (n_cells, n_points)."""
        pairs = FacePairs.find(interface, z)
        points = _points(self.rule, pairs.n_slave_corners, pairs.corners_at(z), pairs.codes)
        return Pairing({**pairs.as_arrays(), "active": points.gap < 0})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        pairs = FacePairs.from_pairing(interface, pairing)
        local = self._forces(pairs)(pairs.corners_at(z), pairs.codes, pairing["active"])
        return add_rows(local, unknowns_of(pairs.nodes), z.shape[-1])

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.csr_array:
        """Compute the derivative of the residual, sparse."""
        pairs, unknowns = FacePairs.from_pairing(interface, pairing), interface.n_unknowns
        blocks = differentiate(self._forces(pairs), pairs.corners_at(z), pairs.codes, pairing["active"])
        places = unknowns_of(pairs.nodes)
        return add_blocks(blocks, places, places, (unknowns, unknowns))

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the points of all cells."""
        pairs = FacePairs.from_pairing(interface, pairing)
        corners = pairs.corners_at(z)
        points = _points(self.rule, pairs.n_slave_corners, corners, pairs.codes)
        pressure = np.where(pairing["active"], -self.penalty * points.gap, 0.0)
        return report_points(pairs, points, corners, pressure, pairing["active"])

    def _forces(self, pairs: FacePairs) -> Callable[..., Array]:
        return partial(_spring_forces, self.rule, self.penalty, pairs.n_slave_corners)


def _points(rule: PointRule, n_slave: int, corners: Array, codes: IntArray) -> CellPoints:
    """Return the points of cells with corners (..., n_cells, n_corners, 3), the first `n_slave` of the slave."""
    return rule(SlaveView.of_corners(corners[..., :n_slave, :], corners[..., n_slave:, :]), codes)


def _spring_forces(
    rule: PointRule, penalty: float, n_slave: int, corners: Array, codes: IntArray, active: BoolArray
) -> Array:
    """Return the residuals (..., n_cells, n_corners · 3) of cells with corners (..., n_cells, n_corners, 3)."""
    points = _points(rule, n_slave, corners, codes)
    force = np.where(active, -penalty * points.gap, 0.0) * points.weight
    return flatten_pushes(*points.push(force))


def sts_3d(*, penalty: float) -> CellSprings:
    """Segment to segment in three dimensions: pressures at Gauss points of the overlaps of slave and master faces.

    A cell of triangles has three points a triangle of its fan, which are exact for a linear gap × a shape function; of
    quadrilaterals it has six.

    Parameters
    ----------
    penalty : float
        Distributed stiffness ε̂ > 0, force per area per length of penetration.

    References
    ----------
    Zavarise & Wriggers, Math. Comput. Modelling 28 (1998) 497–515; on faces: here.
    """
    source = "Zavarise & Wriggers, Math. Comput. Modelling 28 (1998) 497–515; on faces: here"
    traits = SURFACE_TRAITS.revise(faces=(3, 4), integrates_linear_gap=True, source=source)
    return CellSprings(traits, check_penalty(penalty), _by_corners)


def _by_corners(view: SlaveView, codes: IntArray) -> CellPoints:
    """Return three Gauss points for each triangle of a cell of triangles, and six for others."""
    triangles = view.slave.shape[-2] == view.master.shape[-2] == 3
    return gauss_points(view, codes, 3 if triangles else 6)


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceMortar:
    """The formulation: nodal pressures −ε̂ G_i / W_i, where they are above 0."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells, which slave nodes they cover, and which of these nodes are in contact."""
        pairs = FacePairs.find(interface, z)
        gaps, weights = _node_sums(pairs, z, interface.n_slave_nodes)
        return Pairing({**pairs.as_arrays(), "active": (gaps < 0) & (weights > 0)})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        pairs = FacePairs.from_pairing(interface, pairing)
        pressure = self._pressures(*_node_sums(pairs, z, interface.n_slave_nodes), pairing)
        local = _forces(pairs.n_slave_corners, pairs.corners_at(z), pairs.codes, pressure[..., pairs.slave_nodes])
        return add_rows(local, unknowns_of(pairs.nodes), z.shape[-1])

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.csr_array:
        """Compute the derivative of the residual: of the cells at fixed pressures, and of the pressures."""
        pairs, active = FacePairs.from_pairing(interface, pairing), pairing["active"]
        n, n_nodes, n_slave = interface.n_unknowns, interface.n_slave_nodes, pairs.n_slave_corners
        corners, places, slave_nodes = pairs.corners_at(z), unknowns_of(pairs.nodes), pairs.slave_nodes
        gaps, weights = _node_sums(pairs, z, n_nodes)
        pressure = self._pressures(gaps, weights, pairing)
        fixed = differentiate(partial(_forces, n_slave), corners, pairs.codes, pressure[slave_nodes])
        by_pressure = add_blocks(_unit_forces(n_slave, corners, pairs.codes), places, slave_nodes, (n, n_nodes))
        sums = differentiate(partial(_local_sums, n_slave), corners, pairs.codes)
        by_gap, by_weight = (add_blocks(sums[:, k], slave_nodes, places, (n_nodes, n)) for k in range(2))
        whole = np.where(active, weights, 1.0)
        scale, mean = np.where(active, -self.penalty / whole, 0.0), np.where(active, gaps / whole, 0.0)
        # The derivatives of the pressures: −ε̂ (∂G − G/W ∂W) / W.
        of_pressure = sparse.diags_array(scale) @ (by_gap - sparse.diags_array(mean) @ by_weight)
        of_cells = add_blocks(fixed, places, places, (n, n))
        return sparse.csr_array(of_cells + by_pressure @ sparse.csr_array(of_pressure))

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the slave nodes that the master covers: weighted nodes without a foot, on the first of their faces."""
        pairs, faces = FacePairs.from_pairing(interface, pairing), interface.slave.faces
        gaps, weights = _node_sums(pairs, z, interface.n_slave_nodes)
        nodes = np.flatnonzero(weights > 0)
        carrier, shape = first_faces(faces, nodes)
        slave = z.reshape(-1, 3)[faces[carrier]]
        return ContactPoints.on_faces(
            slave_segment=carrier,
            slave_shape=shape,
            master_segment=np.full(len(nodes), -1),
            master_shape=np.full((len(nodes), interface.master.faces.shape[1]), np.nan),
            position=z.reshape(-1, 3)[nodes],
            normal=-axes_of(slave)[2],
            gap=gaps[nodes] / weights[nodes],
            pressure=self._pressures(gaps, weights, pairing)[nodes],
            weight=weights[nodes],
            active=pairing["active"][nodes],
            weighted=True,
        )

    def _pressures(self, gaps: Array, weights: Array, pairing: Pairing) -> Array:
        """Return the pressures (..., n_slave_nodes) of weighted gaps."""
        active = pairing["active"]
        pressures: Array = np.where(active, -self.penalty * gaps / np.where(active, weights, 1.0), 0.0)
        return pressures


def _six_points(view: SlaveView, codes: IntArray) -> CellPoints:
    return gauss_points(view, codes, N_POINTS)


def _local_sums(n_slave: int, corners: Array, codes: IntArray) -> Array:
    """Return ∫ N_i g and ∫ N_i of each cell, (..., n_cells, 2, n_slave_corners)."""
    points = _points(_six_points, n_slave, corners, codes)
    weights = np.stack([points.weight * points.gap, points.weight], axis=-2)  # (..., n_cells, 2, n_points)
    sums: Array = weights @ points.slave_shape
    return sums


def _node_sums(pairs: FacePairs, z: Array, n_nodes: int) -> tuple[Array, Array]:
    """Return G_i and W_i (..., n_nodes) of the slave nodes."""
    sums = _local_sums(pairs.n_slave_corners, pairs.corners_at(z), pairs.codes)
    gaps, weights = (add_rows(sums[..., k, :], pairs.slave_nodes, n_nodes) for k in range(2))
    return gaps, weights


def _forces(n_slave: int, corners: Array, codes: IntArray, pressure: Array) -> Array:
    """Return the residuals (..., n_cells, n_corners · 3) of pressures (..., n_cells, n_slave_corners) there."""
    points = _points(_six_points, n_slave, corners, codes)
    force = (points.slave_shape @ pressure[..., None])[..., 0] * points.weight
    return flatten_pushes(*points.push(force))


def _unit_forces(n_slave: int, corners: FloatArray, codes: IntArray) -> FloatArray:
    """Return the residuals (n_cells, n_corners · 3, n_slave_corners) of a unit pressure at each slave corner."""
    units = np.eye(n_slave)[:, None, :]  # (n_slave_corners, 1, n_slave_corners)
    forces: FloatArray = np.moveaxis(_forces(n_slave, corners, codes, units), 0, -1)
    return forces


def mortar_3d(*, penalty: float) -> SurfaceMortar:
    """Mortar in three dimensions: nodal pressures from weighted gaps, over exactly cut cells.

    Parameters
    ----------
    penalty : float
        Distributed stiffness ε̂ > 0, force per area per length of penetration.

    References
    ----------
    Puso & Laursen, Comput. Methods Appl. Mech. Engrg. 193 (2004) 601–629, with the normal of the slave face: here.
    """
    source = "Puso & Laursen, Comput. Methods Appl. Mech. Engrg. 193 (2004) 601–629; the slave's normal: here"
    return SurfaceMortar(SURFACE_TRAITS.revise(faces=(3, 4), source=source), check_penalty(penalty))
