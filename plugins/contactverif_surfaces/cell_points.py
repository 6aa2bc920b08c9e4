"""The points of a cell: where they lie on both faces, what they weigh, and their gaps along the slave's normal.

Every number is a smooth function of the positions of the cell's nodes, real or complex, on the integers of
`face_search`. Points and gaps are made of differences from the slave's first corner, so a far translation rounds no
more than the positions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contactverif.contract.arrays import Array, IntArray
from contactverif_surfaces.plane_shapes import TRIANGLE, cross_plane, evaluate_shapes

# Rules of Gauss points on a triangle, in its three corner coordinates, with weights that add up to 1. Three points are
# exact for degree 2, which a gap × a shape function has; six for degree 4.
_A, _B = 0.445948490915965, 0.091576213509771
_THREE = np.array([[4.0, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
_SIX = np.array([[1 - 2 * c if i == j else c for j in range(3)] for c in (_A, _B) for i in range(3)])
_SIX_WEIGHTS = np.repeat([0.223381589678011, 0.109951743655322], 3)
GAUSS = {3: (_THREE, np.full(3, 1 / 3)), 6: (_SIX, _SIX_WEIGHTS / _SIX_WEIGHTS.sum())}


@dataclass(frozen=True, slots=True, eq=False)
class CellPoints:
    """Points of cells, with any leading axes."""

    slave_shape: Array  # (..., n_cells, n_points, n_slave_corners)
    master_shape: Array  # (..., n_cells, n_points, n_master_corners)
    weight: Array  # (..., n_cells, n_points) The area of a point, in the plane of the slave face.
    gap: Array  # (..., n_cells, n_points) The gap along the slave's normal, negative in penetration.
    normal: Array  # (..., n_cells, 3) The unit normal out of the slave.

    def push(self, force: Array) -> tuple[Array, Array]:
        """Return the residuals (..., n_cells, n_corners, 3) on slave and master corners of forces at the points.

        A positive force (..., n_cells, n_points) presses the faces apart.
        """
        normal = self.normal[..., None, :]
        slave, master = (force[..., None, :] @ shape for shape in (self.slave_shape, self.master_shape))
        return np.swapaxes(slave, -2, -1) * normal, -np.swapaxes(master, -2, -1) * normal


@dataclass(frozen=True, slots=True, eq=False)
class SlaveView:
    """Cells as their slave faces see them: plane coordinates from the slave's first corner."""

    slave: Array  # (..., n_cells, n_slave_corners, 2)
    master: Array  # (..., n_cells, n_master_corners, 2) The corners in the order of the face.
    slave_height: Array  # (..., n_cells, n_slave_corners) Heights along the normal, 0 on a triangle.
    master_height: Array  # (..., n_cells, n_master_corners)
    normal: Array  # (..., n_cells, 3)

    @classmethod
    def of_corners(cls, slave: Array, master: Array) -> SlaveView:
        """Return the view of slave corners and master corners (..., n_cells, n_corners, 3)."""
        arms = [side - slave[..., :1, :] for side in (slave, master)]
        along, across, normal = axes_of(slave)
        plane = [np.stack([_dot(arm, along), _dot(arm, across)], axis=-1) for arm in arms]
        return cls(plane[0], plane[1], _dot(arms[0], normal), _dot(arms[1], normal), normal)

    def points_at(self, places: Array, weight: Array) -> CellPoints:
        """Return the points at places (..., n_cells, n_points, 2) of the plane, with their areas."""
        slave, master = evaluate_shapes(self.slave, places), evaluate_shapes(self.master, places)
        gap = (master @ self.master_height[..., None] - slave @ self.slave_height[..., None])[..., 0]
        return CellPoints(slave, master, weight, gap, self.normal)

    def cell_corners(self, codes: IntArray) -> Array:
        """Return the corners (..., n_cells, most_corners, 2) with these codes (n_cells, most_corners, 2)."""
        n_slave, n_master = self.slave.shape[-2], self.master.shape[-2]
        i, j = codes[..., 0], codes[..., 1]
        reverse = self.master[..., ::-1, :]
        start, end = _take(self.slave, i % n_slave), _take(self.slave, (i + 1) % n_slave)
        before, behind = _take(reverse, j % n_master), _take(reverse, (j + 1) % n_master)
        here, there = cross_plane(end - start, before - start), cross_plane(end - start, behind - start)
        crossing = (i >= 0) & (j >= 0)
        share = here / np.where(crossing, here - there, 1.0)
        corner = np.where((j < 0)[..., None], start, before)
        return np.where(crossing[..., None], before + share[..., None] * (behind - before), corner)


def flatten_pushes(*sides: Array) -> Array:
    """Return residuals (..., n, n_corners, 3) on the corners of one or two faces as rows (..., n, n_corners · 3)."""
    pushes = np.concatenate(sides, axis=-2)
    return pushes.reshape(*pushes.shape[:-2], 3 * pushes.shape[-2])


def axes_of(slave: Array) -> tuple[Array, Array, Array]:
    """Return the axes (..., n_cells, 3) of slave faces (..., n_cells, n_corners, 3): along, across, unit normal."""
    first, last = slave[..., 0, :], slave[..., -1, :]
    if slave.shape[-2] == TRIANGLE:
        normal = np.cross(slave[..., 1, :] - first, last - first)
    else:
        normal = np.cross(slave[..., 2, :] - first, last - slave[..., 1, :])
    normal = unit_vectors(normal)
    edge = slave[..., 1, :] - first
    along = unit_vectors(edge - (edge * normal).sum(axis=-1)[..., None] * normal)
    return along, np.cross(normal, along), normal


def unit_vectors(vectors: Array) -> Array:
    """Return vectors (..., 3) over their lengths; a length is a root of squares, so that it takes complex numbers."""
    units: Array = vectors / np.sqrt((vectors * vectors).sum(axis=-1))[..., None]
    return units


def gauss_points(view: SlaveView, codes: IntArray, n_points: int) -> CellPoints:
    """Return the Gauss points of each cell, `n_points` on each triangle between its middle and two corners.

    Triangles around a corner would do as well where all of a cell is in contact. Where a part is open, their points
    would depend on which corner is the first, and so on the numbers of the nodes.
    """
    places, weights = GAUSS[n_points]
    corners = view.cell_corners(codes)
    following = np.roll(corners, -1, axis=-2)
    middle = np.broadcast_to(_middle(corners, following), corners.shape)
    triangles = np.stack([middle, corners, following], axis=-2)
    points = places @ triangles
    count = points.shape[-3] * n_points
    area = _areas(triangles)[..., None] * weights
    return view.points_at(points.reshape(*points.shape[:-3], count, 2), area.reshape(*area.shape[:-2], count))


def _middle(corners: Array, following: Array) -> Array:
    """Return a point in the middle of each cell (..., n_cells, 1, 2), the mean of its edges by their squared lengths.

    It lies inside however thin the cell is, and corners that are listed twice do not count. The centroid of a cell
    without area would be a quotient of two roundoffs.
    """
    weights = ((following - corners) ** 2).sum(axis=-1)[..., None]
    total = weights.sum(axis=-2, keepdims=True)
    middle: Array = (weights * (corners + following)).sum(axis=-2, keepdims=True) / np.where(total == 0, 1.0, 2 * total)
    return np.where(total == 0, corners[..., :1, :], middle)


def _areas(triangles: Array) -> Array:
    """Return the areas (...,) of triangles (..., 3, 2), positive if their corners run counter-clockwise."""
    first = triangles[..., 0, :]
    return cross_plane(triangles[..., 1, :] - first, triangles[..., 2, :] - first) / 2


def _dot(arms: Array, axis: Array) -> Array:
    """Return the products (..., n_cells, n_corners) of arms (..., n_cells, n_corners, 3) and axes (..., n_cells, 3)."""
    product: Array = (arms @ axis[..., None])[..., 0]
    return product


def _take(corners: Array, numbers: IntArray) -> Array:
    """Return corners (..., n_cells, k, 2) by their numbers (n_cells, k)."""
    cells = np.arange(len(numbers))[:, None]
    selection: Array = corners[..., cells, numbers, :]
    return selection
