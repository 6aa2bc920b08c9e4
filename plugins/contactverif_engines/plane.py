"""A scene in which every body has cells, for codes that know no rigid surface.

A rigid body gets a row of quadrilaterals behind its surface, of which every node is imposed. All else is that of the
scene, whose nodes come first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contactverif.contract.engine import BoolArray, FloatArray, IntArray, SceneArrays


@dataclass(frozen=True, slots=True, eq=False)
class PlaneScene:
    """The nodes, cells, supports and loads of all bodies."""

    scene: SceneArrays
    nodes: FloatArray  # (n, 2)
    # Triangles (n, 3), then quadrilaterals (n, 4), counter-clockwise, each kind with the body of each cell.
    cells: tuple[tuple[IntArray, IntArray], ...]
    frames: FloatArray  # (n, 2, 2): from the axes of each node's body to the global ones.
    fixed: BoolArray  # (n, 2), in the axes of the body.
    imposed: FloatArray  # (n, 2)
    load: FloatArray  # (n, 2)
    start: FloatArray  # (n, 2), a first guess of the displacements, in global axes.

    @property
    def materials(self) -> list[tuple[float, float]]:
        """The modulus of Young and the ratio of Poisson of each body; those of a rigid one do not matter."""
        scene = self.scene
        moduli = zip(scene.young.tolist(), scene.poisson.tolist(), scene.rigid.tolist(), strict=True)
        return [(1.0, 0.0) if rigid else (young, poisson) for young, poisson, rigid in moduli]


def make_plane(scene: SceneArrays) -> PlaneScene:
    """Return the scene with cells for its rigid bodies."""
    nodes, cells, bodies = [scene.nodes], [scene.cells], [scene.body_of_cell]
    frames, fixed, imposed = [scene.frames()], [scene.fixed], [scene.imposed]
    count = len(scene.nodes)
    for index in np.flatnonzero(scene.rigid):
        edges = np.vstack([side[scene.body_of_node[side[:, 0]] == index] for side in (scene.slave, scene.master)])
        used, ends = np.unique(edges, return_inverse=True)
        ends = ends.reshape(-1, 2)
        inwards = np.zeros((len(used), 2))
        along = scene.nodes[edges[:, 1]] - scene.nodes[edges[:, 0]]
        np.add.at(inwards, ends, np.column_stack([-along[:, 1], along[:, 0]])[:, None])
        inwards *= scene.unit / 4 / np.linalg.norm(inwards, axis=1)[:, None]
        nodes.append(scene.nodes[used] + inwards)
        cells.append(np.column_stack([edges, count + ends[:, ::-1]]))
        bodies.append(np.full(len(edges), index))
        frames.append(scene.frames()[used])
        fixed.append(np.ones((len(used), 2), bool))
        imposed.append(scene.imposed[used])
        count += len(used)
    corners, body = np.vstack(cells), np.concatenate(bodies)
    is_triangle, behind = corners[:, 3] < 0, ((0, count - len(scene.nodes)), (0, 0))
    return PlaneScene(
        scene,
        np.vstack(nodes),
        ((corners[is_triangle, :3], body[is_triangle]), (corners[~is_triangle], body[~is_triangle])),
        np.vstack(frames),
        np.vstack(fixed),
        np.vstack(imposed),
        np.pad(scene.load, behind),
        np.pad(scene.start, behind),
    )


def deepen(plane: PlaneScene, share: float = 2.0**-30) -> FloatArray:
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
