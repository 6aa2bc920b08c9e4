"""One virtual slave node a cell, compiled: pressure −ε̂ g at the centroid of each cell of triangles, on all of its area.

The shape functions of triangles are linear over a cell, so the centroid integrates them exactly: a uniform pressure is
transmitted, and force and moment balance cell by cell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.faces import TRIANGLE
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import Interface
from contactverif.contract.option_checks import check_penalty
from contactverif.contract.pairing import Pairing
from contactverif.contract.traits import Traits
from contactverif_surfaces.cell_points import CellPoints
from contactverif_surfaces.cell_springs import report_points
from contactverif_surfaces.centre_geometry import ROOM, add_forces, write_points
from contactverif_surfaces.centre_tangent import forces_and_tangent
from contactverif_surfaces.face_pairs import FacePairs
from contactverif_surfaces.surface_traits import SURFACE_TRAITS


@dataclass(frozen=True, slots=True, eq=False)
class CentreSprings:
    """The formulation: pressure −ε̂ g at the centroid of each cell where g < 0."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells, and which of them are in contact (n_cells,)."""
        pairs = FacePairs.find(interface, z)
        return Pairing({**pairs.as_arrays(), "active": _points(pairs, z).gap[:, 0] < 0})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        pairs, x = FacePairs.from_pairing(interface, pairing), np.array(z).reshape(-1, interface.n_nodes, 3)
        forces, room, shapes = np.zeros_like(x), np.empty(ROOM, x.dtype), np.empty(6, x.dtype)
        add_forces(forces, room, shapes, x, _nodes(pairs), pairs.codes, pairing["active"], self.penalty)
        return forces.reshape(z.shape)

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.csr_array:
        """Compute the derivative of the residual, sparse."""
        return self.residual_and_tangent(interface, pairing, z)[1]

    def residual_and_tangent(
        self, interface: Interface, pairing: Pairing, z: FloatArray, /
    ) -> tuple[FloatArray, sparse.csr_array]:
        """Compute forces (n_unknowns,) and their derivative from the same points."""
        pairs, x = FacePairs.from_pairing(interface, pairing), np.array(z).reshape(-1, 3)
        forces, tangent = forces_and_tangent(x, _nodes(pairs), pairs.codes, pairing["active"], self.penalty)
        return forces.reshape(-1), tangent

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the points of all cells."""
        pairs, active = FacePairs.from_pairing(interface, pairing), pairing["active"][:, None]
        points = _points(pairs, z)
        pressure = np.where(active, -self.penalty * points.gap, 0.0)
        return report_points(pairs, points, pairs.corners_at(z), pressure, active)


def _nodes(pairs: FacePairs) -> tuple[IntArray, IntArray]:
    """Return the nodes of both faces of each cell (n_cells, 3); the kernels would read past other faces."""
    for nodes in (pairs.slave_nodes, pairs.master_nodes):
        if nodes.shape[1] != TRIANGLE:
            raise MisuseError("interface", f"faces with {nodes.shape[1]} corners", "triangles")
    return pairs.slave_nodes, pairs.master_nodes


def _points(pairs: FacePairs, z: FloatArray) -> CellPoints:
    """Return the points of all cells, one each."""
    n_cells = len(pairs.codes)
    points, shapes = np.empty((n_cells, 5)), np.empty((n_cells, 6))
    write_points(points, shapes, np.empty(ROOM), np.array(z).reshape(-1, 3), _nodes(pairs), pairs.codes)
    slave, master = shapes[:, None, :3], shapes[:, None, :2:-1]
    return CellPoints(slave, master, points[:, 1:2], points[:, :1], points[:, 2:])


def vts_cell_3d(*, penalty: float) -> CentreSprings:
    """Take one virtual slave node at the centroid of each cell, with the area of the cell. On triangles it is exact.

    Parameters
    ----------
    penalty : float
        Distributed stiffness ε̂ > 0, force per area per length of penetration.
    """
    return CentreSprings(SURFACE_TRAITS.revise(source="here"), check_penalty(penalty))
