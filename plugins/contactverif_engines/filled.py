"""A scene in which every body has cells, for codes that know no rigid surface.

A rigid body gets a row of quadrilaterals behind its surface, in space of wedges or hexahedra, of which every node is
imposed. All else is that of the scene, whose nodes come first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contactverif.contract.engine import BoolArray, FloatArray, IntArray, SceneArrays


@dataclass(frozen=True, slots=True, eq=False)
class FilledScene:
    """The nodes, cells, supports and loads of all bodies."""

    scene: SceneArrays
    nodes: FloatArray  # (n, dim)
    # Triangles (n, 3), then quadrilaterals (n, 4), counter-clockwise, each kind with the body of each cell. In space
    # tetrahedra (n, 4), wedges (n, 6) and hexahedra (n, 8), ordered as those of a scene.
    cells: tuple[tuple[IntArray, IntArray], ...]
    frames: FloatArray  # (n, dim, dim): from the axes of each node's body to the global ones.
    fixed: BoolArray  # (n, dim), in the axes of the body.
    imposed: FloatArray  # (n, dim)
    load: FloatArray  # (n, dim)
    start: FloatArray  # (n, dim), a first guess of the displacements, in global axes.

    @property
    def materials(self) -> list[tuple[float, float]]:
        """The modulus of Young and the ratio of Poisson of each body; those of a rigid one do not matter."""
        scene = self.scene
        moduli = zip(scene.young.tolist(), scene.poisson.tolist(), scene.rigid.tolist(), strict=True)
        return [(1.0, 0.0) if rigid else (young, poisson) for young, poisson, rigid in moduli]


def fill_rigid_bodies(scene: SceneArrays) -> FilledScene:
    """Return the scene with cells for its rigid bodies."""
    nodes, cells, bodies = [scene.nodes], [scene.cells], [scene.body_of_cell]
    frames, fixed, imposed = [scene.frames()], [scene.fixed], [scene.imposed]
    count, (plane, dim) = len(scene.nodes), (scene.nodes.shape[1] == 2, scene.nodes.shape[1])
    for index in np.flatnonzero(scene.rigid):
        edges = np.vstack([side[scene.body_of_node[side[:, 0]] == index] for side in (scene.slave, scene.master)])
        edges = edges[:, (edges >= 0).all(axis=0)]  # The faces of a body have one shape.
        used, ends = np.unique(edges, return_inverse=True)
        ends = ends.reshape(edges.shape)
        inwards, corners = np.zeros((len(used), dim)), scene.nodes[edges]
        if plane:
            along = corners[:, 1] - corners[:, 0]
            away = np.column_stack([-along[:, 1], along[:, 0]])
        else:
            away = np.cross(corners[:, -1] - corners[:, 1], corners[:, 2] - corners[:, 0])
        np.add.at(inwards, ends, away[:, None])
        inwards *= scene.unit / 4 / np.linalg.norm(inwards, axis=1)[:, None]
        nodes.append(scene.nodes[used] + inwards)
        solids = np.hstack([edges if plane else edges[:, ::-1], count + ends[:, ::-1]])
        missing = scene.cells.shape[1] - solids.shape[1]
        cells.append(np.pad(solids, ((0, 0), (0, missing)), constant_values=-1))
        bodies.append(np.full(len(edges), index))
        frames.append(scene.frames()[used])
        fixed.append(np.ones((len(used), dim), bool))
        imposed.append(scene.imposed[used])
        count += len(used)
    numbers, body = np.vstack(cells), np.concatenate(bodies)
    n_corners, behind = (numbers >= 0).sum(axis=1), ((0, count - len(scene.nodes)), (0, 0))
    return FilledScene(
        scene,
        np.vstack(nodes),
        tuple((numbers[n_corners == n, :n], body[n_corners == n]) for n in ((3, 4) if plane else (4, 6, 8))),
        np.vstack(frames),
        np.vstack(fixed),
        np.vstack(imposed),
        np.pad(scene.load, behind),
        np.pad(scene.start, behind),
    )


def deepen(plane: FilledScene, share: float = 2.0**-30) -> FloatArray:
    """Return displacements (n, 2) that move each slave body out of itself, by a share of the largest body's size.

    Codes that count no contact without depth begin so: a body that only touches would be free to move.
    """
    scene, moves = plane.scene, np.zeros_like(plane.nodes)
    body_of_edge = scene.body_of_node[scene.slave[:, 0]]
    for body in np.unique(body_of_edge):
        along = np.diff(scene.nodes[scene.slave[body_of_edge == body]], axis=1)[:, 0]
        outwards = np.array([along[:, 1].sum(), -along[:, 0].sum()]) / np.linalg.norm(along, axis=1).sum()
        moves[np.flatnonzero(scene.body_of_node == body)] = share * scene.unit * outwards
    return moves
