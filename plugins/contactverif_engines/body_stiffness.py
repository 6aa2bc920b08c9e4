"""The stiffness of all bodies of a scene in plane strain, assembled with scikit-fem, for engines that lack one."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from contactverif.contract.engine import SceneArrays


def assemble(scene: SceneArrays) -> sparse.csr_array:
    """Return the stiffness (2 n_nodes, 2 n_nodes), row 2 × node + component, in the axes of each node's body."""
    size = 2 * len(scene.nodes)
    total = sparse.csr_array((size, size))
    triangles = scene.cells[:, 3] < 0
    for index in np.unique(scene.body_of_cell):
        for kind in (triangles, ~triangles):
            cells = scene.cells[kind & (scene.body_of_cell == index)]
            if len(cells):
                cells = cells[:, :3] if (cells[:, 3] < 0).all() else cells
                total = total + _one_body(scene, cells, scene.young[index], scene.poisson[index])
    frames = sparse.block_diag(list(scene.frames()), format="csr")
    return sparse.csr_array(frames.T @ total @ frames)


def _one_body(scene: SceneArrays, cells: Any, young: float, poisson: float) -> sparse.csr_array:
    """Return the stiffness of some cells of one material, in global axes."""
    from skfem import Basis, ElementQuad1, ElementTriP1, ElementVector, MeshQuad, MeshTri, asm
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    used, corners = np.unique(cells, return_inverse=True)
    kind, element = (MeshTri, ElementTriP1()) if cells.shape[1] == 3 else (MeshQuad, ElementQuad1())
    mesh = kind(*map(np.ascontiguousarray, (scene.nodes[used].T, corners.reshape(cells.shape).T)))
    basis = Basis(mesh, ElementVector(element), intorder=4)
    local = sparse.coo_array(asm(linear_elasticity(*lame_parameters(young, poisson)), basis))
    order = np.empty(2 * len(used), np.int64)
    order[basis.nodal_dofs.T.reshape(-1)] = (2 * used[:, None] + [0, 1]).reshape(-1)
    size = 2 * len(scene.nodes)
    return sparse.csr_array((local.data, (order[local.row], order[local.col])), shape=(size, size))
