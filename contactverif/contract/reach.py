"""The depth of a slave behind the master, for formulations that say how far behind a surface they look."""

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import PLANE, Interface

_AT_ONCE = 256  # Points that are compared with all master faces at once, so that memory stays small.
_TIED = 1 + 1e-9  # Faces are equally near if distances differ by less: far more than rounding, far less than a mesh.


def find_depth(interface: Interface, positions: FloatArray) -> float:
    """Return how far a corner or middle of a slave face lies behind the master at most, in positions (n_nodes, dim).

    It counts over the master's shortest segment or edge in the reference. It is the longer of two ways to the plane of
    the nearest face: along its normal, and along that of the slave's face if both are turned to each other. So it is no
    less than any rule for gaps finds on a straight or plane slave. A point past the border counts too.
    """
    faces, reference = positions[interface.master.faces], interface.nodes[interface.master.faces]
    slave = positions[interface.slave.faces]
    points = np.concatenate([slave, slave.mean(axis=1, keepdims=True)], axis=1)
    normals = np.repeat(_normals(slave), points.shape[1], axis=0)
    points = points.reshape(-1, interface.dim)
    parts = (slice(first, first + _AT_ONCE) for first in range(0, len(points), _AT_ONCE))
    depth = max(_largest_depth(points[part], normals[part], faces) for part in parts)
    return depth / float(np.linalg.norm(np.roll(reference, -1, axis=1) - reference, axis=2).min())


def _normals(faces: FloatArray) -> FloatArray:
    """Return the unit normals (n, dim) of faces (n, n_corners, dim) out of their body."""
    if faces.shape[2] == PLANE:
        normals = (faces[:, 1] - faces[:, 0])[:, ::-1] * [1.0, -1.0]
    else:  # The cross product of the diagonals is twice the vector area; a triangle has an edge for one of them.
        normals = np.cross(faces[:, 2] - faces[:, 0], faces[:, -1] - faces[:, 1])
    units: FloatArray = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return units


def _largest_depth(points: FloatArray, slave_normals: FloatArray, faces: FloatArray) -> float:
    normals, in_space = _normals(faces), faces.shape[2] != PLANE
    heights = np.einsum("pmi,mi->pm", points[:, None] - faces[:, 0], normals)
    distances, inside = np.full(heights.shape, np.inf), np.full(heights.shape, in_space)
    for corner, run in enumerate(np.swapaxes(np.roll(faces, -1, axis=1) - faces, 0, 1)):
        way = points[:, None] - faces[:, corner]
        share = np.clip(np.einsum("pmi,mi->pm", way, run) / (run**2).sum(axis=1), 0.0, 1.0)
        distances = np.minimum(distances, np.linalg.norm(way - share[..., None] * run, axis=2))
        if in_space:
            inside &= np.einsum("pmi,mi->pm", way, np.cross(normals, run)) >= 0
    distances = np.where(inside, np.abs(heights), distances)
    # Of faces that are equally near, the one counts past whose edge the point lies least.
    near = distances <= _TIED * distances.min(axis=1, keepdims=True)
    face, point = np.where(near, np.abs(heights), -1.0).argmax(axis=1), np.arange(len(points))
    facing = -np.einsum("pi,pi->p", slave_normals, normals[face])
    return float(np.max(-heights[point, face] / np.where(facing > 0, facing, 1.0), initial=0.0))
