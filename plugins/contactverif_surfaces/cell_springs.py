"""Springs at points of the cells: segment-to-segment contact in three dimensions.

A point has the pressure −ε̂ g where g < 0, along the slave's normal, and pushes both faces by their shape functions
there. So force and moment balance point by point. A uniform pressure is integrated exactly over what is covered.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import Interface
from contactverif.contract.option_checks import check_penalty
from contactverif.contract.pairing import Pairing
from contactverif.contract.traits import Traits
from contactverif_surfaces.cell_points import CellPoints, SlaveView, flatten_pushes, gauss_points
from contactverif_surfaces.face_pairs import FacePairs
from contactverif_surfaces.local_derivatives import add_blocks, add_rows, differentiate, unknowns_of
from contactverif_surfaces.surface_traits import SURFACE_TRAITS

PointRule = Callable[[SlaveView, IntArray], CellPoints]  # It takes the view and the codes of cells.


@dataclass(frozen=True, slots=True, eq=False)
class CellSprings:
    """The formulation: pressure −ε̂ g at each point of a cell where g < 0."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.
    rule: PointRule

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells, and which of their points are in contact (n_cells, n_points)."""
        pairs = FacePairs.find(interface, z)
        points = _points(pairs.corners_at(z), pairs.codes, pairs.n_slave_corners, self.rule)
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
        points = _points(corners, pairs.codes, pairs.n_slave_corners, self.rule)
        pressure = np.where(pairing["active"], -self.penalty * points.gap, 0.0)
        return report_points(pairs, points, corners, pressure, pairing["active"])

    def _forces(self, pairs: FacePairs) -> Callable[..., Array]:
        return partial(_spring_forces, self.rule, self.penalty, pairs.n_slave_corners)


def _points(corners: Array, codes: IntArray, n_slave: int, rule: PointRule) -> CellPoints:
    """Return the points of cells with corners (..., n_cells, n_corners, 3), slave first."""
    return rule(SlaveView.of_corners(corners[..., :n_slave, :], corners[..., n_slave:, :]), codes)


def _spring_forces(
    rule: PointRule, penalty: float, n_slave: int, corners: Array, codes: IntArray, active: BoolArray
) -> Array:
    """Return the residuals (..., n_cells, n_corners · 3) of cells with corners (..., n_cells, n_corners, 3)."""
    points = _points(corners, codes, n_slave, rule)
    force = np.where(active, -penalty * points.gap, 0.0) * points.weight
    return flatten_pushes(*points.push(force))


def report_points(
    pairs: FacePairs, points: CellPoints, corners: FloatArray, pressure: FloatArray, active: BoolArray
) -> ContactPoints:
    """Return points of cells as contact points, with pressures and activity (n_cells, n_points)."""
    n_points = points.gap.shape[1]
    place = np.einsum("cqk,cki->cqi", points.slave_shape, corners[:, : pairs.n_slave_corners])
    return ContactPoints.on_faces(
        slave_segment=np.repeat(pairs.slave_face, n_points),
        slave_shape=points.slave_shape.reshape(-1, points.slave_shape.shape[-1]),
        master_segment=np.repeat(pairs.master_face, n_points),
        master_shape=points.master_shape.reshape(-1, points.master_shape.shape[-1]),
        position=place.reshape(-1, 3),
        normal=np.repeat(-points.normal, n_points, axis=0),
        gap=points.gap.reshape(-1),
        pressure=pressure.reshape(-1),
        weight=points.weight.reshape(-1),
        active=active.reshape(-1),
    )


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
