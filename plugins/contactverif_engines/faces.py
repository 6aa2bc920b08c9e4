"""The springs of the control in space: on the common mesh of both surfaces, seen along the normals of slave faces."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from contactverif.contract.engine import FloatArray, SceneArrays

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(3)
# Points and weights on a triangle whose first corner is where all lines of a square meet; the area is 1/2.
_ALONG, _ACROSS = (each.reshape(-1) for each in np.meshgrid((_POINTS + 1) / 2, (_POINTS + 1) / 2, indexing="ij"))
_FAN = np.stack([1 - _ALONG, _ALONG * (1 - _ACROSS), _ALONG * _ACROSS], axis=1)  # (9, 3)
_FAN_WEIGHTS = np.outer(_WEIGHTS, _WEIGHTS).reshape(-1) / 4 * _ALONG
_STEPS = 8  # Newton's method finds a place in a quadrilateral that is nearly a rectangle in fewer.


def contact_in_space(scene: SceneArrays, positions: FloatArray) -> tuple[FloatArray, sparse.csr_array]:
    """Return the internal forces (3 n_nodes,) of all springs and their stiffness, normals and places held."""
    rows, columns, values, size = [], [], [], positions.size
    forces = np.zeros(size)
    masters = [face[face >= 0] for face in scene.master]
    centres = np.array([positions[face].mean(axis=0) for face in masters])
    radii = np.array([_radius(positions[face]) for face in masters])
    directions = np.array([_normal(positions[face]) for face in masters])
    for slave in (face[face >= 0] for face in scene.slave):
        corners, normal = positions[slave], -_normal(positions[slave])  # Into the slave's body.
        origin, reach = corners.mean(axis=0), _radius(corners)
        axes = np.linalg.svd(normal[None])[2][1:]  # Two axes (2, 3) of the face's plane.
        axes[1] = np.cross(normal, axes[0])
        flat = ((corners - origin) @ axes.T)[::-1]  # Counter-clockwise, seen along the normal from inside.
        near = np.linalg.norm((centres - origin) @ axes.T, axis=1) <= reach + radii
        near &= (np.abs((centres - origin) @ normal) <= 3 * (reach + radii)) & (directions @ normal > 0)
        for index in np.flatnonzero(near):
            master = masters[index]
            heads = (positions[master] - origin) @ axes.T
            points, weights = _common_points(flat, heads)
            if not len(points):
                continue
            on_slave, on_master = _shapes(flat, points)[:, ::-1], _shapes(heads, points)
            shapes, nodes = np.hstack([on_slave, -on_master]), np.concatenate([slave, master])
            gap = shapes @ ((positions[nodes] - origin) @ normal)
            weights = scene.penalty * weights * ((gap < 0) & (gap > -2 * reach))
            unknowns = (3 * nodes[:, None] + [0, 1, 2]).reshape(-1)
            forces[unknowns] += np.outer(weights * gap @ shapes, normal).reshape(-1)
            block = np.einsum("pa,p,pb,i,j->aibj", shapes, weights, shapes, normal, normal, optimize=True)
            rows.append(np.repeat(unknowns, len(unknowns)))
            columns.append(np.tile(unknowns, len(unknowns)))
            values.append(block.reshape(-1))
    if not rows:
        return forces, sparse.csr_array((size, size))
    places = np.concatenate(rows), np.concatenate(columns)
    return forces, sparse.csr_array((np.concatenate(values), places), shape=(size, size))


def node_areas(scene: SceneArrays) -> FloatArray:
    """Return ∫N dA (n_slave_nodes,) in the reference, of the slave's nodes in the order of their numbers."""
    areas = np.zeros(len(scene.nodes))
    for face in (row[row >= 0] for row in scene.slave):
        corners, normal = scene.nodes[face], _normal(scene.nodes[face])
        axes = np.linalg.svd(normal[None])[2][1:]
        axes[1] = np.cross(normal, axes[0])
        flat = (corners - corners.mean(axis=0)) @ axes.T
        points, weights = _common_points(flat, flat)
        areas[face] += weights @ _shapes(flat, points)
    return areas[np.unique(scene.slave[scene.slave >= 0])]


def _normal(corners: FloatArray) -> FloatArray:
    """Return the unit normal (3,) of a face by its diagonals."""
    normal = np.cross(corners[2] - corners[0], corners[-1] - corners[1])
    return np.asarray(normal / np.linalg.norm(normal))


def _radius(corners: FloatArray) -> float:
    return float(np.linalg.norm(corners - corners.mean(axis=0), axis=1).max())


def _common_points(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return points (n, 2) and weights (n,) on the part that two convex polygons (n_corners, 2) share."""
    polygon = first
    for start, end in zip(second, np.roll(second, -1, axis=0), strict=True):
        along = end - start
        sides = along[0] * (polygon[:, 1] - start[1]) - along[1] * (polygon[:, 0] - start[0])
        after, next_sides = np.roll(polygon, -1, axis=0), np.roll(sides, -1)
        crosses = sides * next_sides < 0
        shares = np.where(crosses, sides, 0.0) / np.where(crosses, sides - next_sides, 1.0)
        cuts = polygon + shares[:, None] * (after - polygon)
        both = np.stack([polygon, cuts], axis=1).reshape(-1, 2)
        polygon = both[np.stack([sides >= 0, crosses], axis=1).reshape(-1)]
        if len(polygon) < 3:
            return np.zeros((0, 2)), np.zeros(0)
    middle = polygon.mean(axis=0)
    ends = np.stack([polygon, np.roll(polygon, -1, axis=0)], axis=1) - middle  # (n_corners, 2, 2)
    doubled = ends[:, 0, 0] * ends[:, 1, 1] - ends[:, 0, 1] * ends[:, 1, 0]
    points = middle + (_FAN[:, 1:] @ ends).reshape(-1, 2)
    return points, np.outer(doubled, _FAN_WEIGHTS).reshape(-1)


def _shapes(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Return the shape functions (n, n_corners) of a flat triangle or quadrilateral at points (n, 2)."""
    second, last = corners[1] - corners[0], corners[-1] - corners[0]
    if len(corners) == 3:
        shares = np.linalg.solve(np.stack([second, last], axis=1), (points - corners[0]).T)
        return np.stack([1 - shares.sum(axis=0), *shares], axis=1)
    twist = corners[2] - corners[0] - second - last
    st = np.full(points.shape, 0.5)
    for _ in range(_STEPS):
        s, t = st[:, :1], st[:, 1:]
        left = corners[0] + s * second + t * last + s * t * twist - points
        slopes = np.stack([second + t * twist, last + s * twist], axis=2)
        st = st - np.linalg.solve(slopes, left[..., None])[..., 0]
    s, t = st.T
    return np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=1)
