"""The control: springs between the bodies in the Gauss points of a common mesh of both surfaces, and nothing clever.

It is an engine whose answers are right to the accuracy of its mesh. A failure of another code is believed only if this
engine passes on the same scene. scikit-fem assembles the stiffness of the bodies.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

from contactverif.contract.engine import EngineAnswer, EngineTraits, FloatArray, SceneArrays
from contactverif_engines.faces import contact_in_space, node_areas

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_ITERATIONS = 60
_CONVERGED = 1e-12  # The last step over the largest displacement.
_ROUNDED = 1e-9  # A step below this share that does not shrink any more is roundoff of a badly conditioned matrix.
_POSITION_ROUNDINGS = 2.0**-48  # A gap is a difference of coordinates, each rounded by 2⁻⁵³ of the largest.


@dataclass(frozen=True)
class Control:
    """Distributed springs on the common mesh of both surfaces, seen along the normals of the slave's segments."""

    dim: int = 2  # 3 takes scenes in space.

    @property
    def traits(self) -> EngineTraits:
        """The statements of the control."""
        return EngineTraits(
            "penalty",
            accuracy=1e-10,
            inclined_supports=True,
            passes_flat_patch=True,
            converges=True,
            source="springs in three Gauss points of each part that a slave and a master segment share",
            dimensions=(self.dim,),
        )

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Solve a scene by steps with the stiffness of the springs that are closed, normals and places held."""
        stiffness, frames = assemble(scene), sparse.block_diag(list(scene.frames()), format="csr")
        free, shape = np.flatnonzero(~scene.fixed.reshape(-1)), scene.nodes.shape
        find_contact = _contact if shape[1] == 2 else contact_in_space
        u = np.where(scene.fixed, scene.imposed, np.einsum("nij,ni->nj", scene.frames(), scene.start)).reshape(-1)
        step, rounding = np.inf, _POSITION_ROUNDINGS * float(np.abs(scene.nodes).max())
        for iteration in range(1, _ITERATIONS + 1):
            positions = scene.nodes + (frames @ u).reshape(shape)
            forces, springs = find_contact(scene, positions)
            residual = stiffness @ u + frames.T @ forces - scene.load.reshape(-1)
            matrix = sparse.csc_array(stiffness + frames.T @ springs @ frames)[free][:, free]
            try:
                change = linalg.splu(sparse.csc_matrix(matrix)).solve(-residual[free])
            except RuntimeError as error:
                return EngineAnswer((frames @ u).reshape(shape), False, iteration, str(error))
            if not np.isfinite(change).all():
                return EngineAnswer((frames @ u).reshape(shape), False, iteration, "a singular matrix")
            u[free] += change
            before, step = step, float(np.abs(change).max(initial=0.0))
            largest = float(np.abs(u).max())
            small = max(_ROUNDED * largest, rounding)  # Without a load there are no displacements to count over.
            if step <= _CONVERGED * largest or (step <= small and step >= before / 2):
                break
        converged = step <= small
        displacements = (frames @ u).reshape(shape)
        forces = -find_contact(scene, scene.nodes + displacements)[0].reshape(shape)
        nodes = np.unique(scene.slave[scene.slave >= 0])
        if shape[1] == 3:
            pressures = np.linalg.norm(forces[nodes], axis=1) / node_areas(scene)
        else:  # The pressure is the force on each node of the slave over the length of its segments.
            ends = scene.nodes[scene.slave]
            halves = np.repeat(np.hypot(*(ends[:, 1] - ends[:, 0]).T) / 2, 2)
            pressures = np.asarray(np.hypot(*forces[nodes].T) / np.bincount(scene.slave.reshape(-1), halves)[nodes])
        return EngineAnswer(displacements, converged, iteration, "" if converged else "no end", forces, pressures)


def _contact(scene: SceneArrays, positions: FloatArray) -> tuple[FloatArray, sparse.csr_array]:
    """Return the internal forces (2 n_nodes,) of all springs and their stiffness, normals and places held."""
    rows, columns, values, size = [], [], [], 2 * len(positions)
    forces = np.zeros(size)
    ends = positions[scene.master]
    for first, second in scene.slave:
        a, b = positions[first], positions[second]
        length = float(np.hypot(*(b - a)))
        tangent = (b - a) / length
        normal = np.array([-tangent[1], tangent[0]])  # Into the slave's body, which lies on the left.
        places, heights = (ends - a) @ tangent / length, (ends - a) @ normal
        low, high = np.clip(places.min(axis=1), 0, 1), np.clip(places.max(axis=1), 0, 1)
        for index in np.flatnonzero((high > low) & (places[:, 0] > places[:, 1])):  # The master runs against the slave.
            s = (low[index] + high[index]) / 2 + (high[index] - low[index]) / 2 * _POINTS
            xi = (s - places[index, 0]) / (places[index, 1] - places[index, 0])
            gap = -(heights[index, 0] + xi * (heights[index, 1] - heights[index, 0]))
            weight = scene.penalty * length * (high[index] - low[index]) / 2 * _WEIGHTS
            shapes = np.stack([1 - s, s, xi - 1, -xi])  # (4, n_points): the slave's place less the master's
            nodes = np.array([first, second, *scene.master[index]])
            closed = (gap < 0) & (gap > -2 * length - np.abs(np.diff(heights[index])))
            if not closed.any():
                continue
            unknowns = (2 * nodes[:, None] + [0, 1]).reshape(-1)
            forces[unknowns] += np.einsum("ap,p,i->ai", shapes, weight * gap * closed, normal).reshape(-1)
            block = np.einsum("ap,p,bp,i,j->aibj", shapes, weight * closed, shapes, normal, normal).reshape(8, 8)
            rows.append(np.repeat(unknowns, 8))
            columns.append(np.tile(unknowns, 8))
            values.append(block.reshape(-1))
    if not rows:
        return forces, sparse.csr_array((size, size))
    places = np.concatenate(rows), np.concatenate(columns)
    return forces, sparse.csr_array((np.concatenate(values), places), shape=(size, size))


def assemble(scene: SceneArrays) -> sparse.csr_array:
    """Return the stiffness (dim n_nodes, dim n_nodes), row dim × node + component, in the axes of each node's body."""
    size = scene.nodes.size
    total = sparse.csr_array((size, size))
    corners = (scene.cells >= 0).sum(axis=1)
    for index in np.unique(scene.body_of_cell):
        for n_corners in np.unique(corners).tolist():
            cells = scene.cells[(corners == n_corners) & (scene.body_of_cell == index), :n_corners]
            if len(cells):
                total = total + _one_body(scene, cells, scene.young[index], scene.poisson[index])
    frames = sparse.block_diag(list(scene.frames()), format="csr")
    return sparse.csr_array(frames.T @ total @ frames)


def _one_body(scene: SceneArrays, cells: Any, young: float, poisson: float) -> sparse.csr_array:
    import skfem
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    dim, n_corners = scene.nodes.shape[1], cells.shape[1]
    kind, element, order = {
        (2, 3): ("MeshTri", "ElementTriP1", range(3)),
        (2, 4): ("MeshQuad", "ElementQuad1", range(4)),
        (3, 4): ("MeshTet", "ElementTetP1", range(4)),
        (3, 8): ("MeshHex", "ElementHex1", (6, 2, 5, 7, 1, 3, 4, 0)),  # scikit-fem numbers corners by coordinates.
    }[dim, n_corners]
    used, corners = np.unique(cells[:, order], return_inverse=True)
    arrays = map(np.ascontiguousarray, (scene.nodes[used].T, corners.reshape(cells.shape).T))
    basis = skfem.Basis(
        getattr(skfem, kind)(*arrays), skfem.ElementVector(getattr(skfem, element)()), intorder=4 if dim == 2 else 2
    )
    local = sparse.coo_array(skfem.asm(linear_elasticity(*lame_parameters(young, poisson)), basis))
    numbers = np.empty(dim * len(used), np.int64)
    numbers[basis.nodal_dofs.T.reshape(-1)] = (dim * used[:, None] + np.arange(dim)).reshape(-1)
    size = scene.nodes.size
    return sparse.csr_array((local.data, (numbers[local.row], numbers[local.col])), shape=(size, size))
