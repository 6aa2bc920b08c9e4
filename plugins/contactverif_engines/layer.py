"""A scene as a layer of solids, one unit of length thick, for codes that know contact in three dimensions alone.

All displacements across the layer are held, so that it is in plane strain. Rigid bodies get a row of elements behind
their surface, of which every node is imposed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contactverif.contract.engine import BoolArray, FloatArray, IntArray, SceneArrays


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """The nodes and elements of a layer; its first nodes are those of the scene, and those above them follow."""

    scene: SceneArrays
    nodes: FloatArray  # (n, 3): the front, then the back.
    wedges: IntArray  # (n, 6): front and back triangle.
    bricks: IntArray  # (n, 8): front and back quadrilateral.
    body_of_wedge: IntArray
    body_of_brick: IntArray
    slave: IntArray  # (n_segments, 4): the faces of the slave, seen from outside of its body counter-clockwise.
    master: IntArray
    frames: FloatArray  # (n, 2, 2): from the axes of each node's body to the global ones.
    fixed: BoolArray  # (n, 2), in the axes of the body.
    imposed: FloatArray  # (n, 2)
    load: FloatArray  # (n, 2)

    @property
    def n_front(self) -> int:
        """The number of nodes of the front."""
        return len(self.nodes) // 2


def make_layer(scene: SceneArrays, thickness: float = 1.0) -> Layer:
    """Return the layer of a scene, so thick; its loads are those of the thickness."""
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
    flat, corners, body = np.vstack(nodes), np.vstack(cells), np.concatenate(bodies)
    triangles = corners[:, 3] < 0
    both = np.vstack([np.column_stack([flat, np.full(count, z)]) for z in (0.0, thickness)])
    load = np.zeros((count, 2))
    load[: len(scene.nodes)] = scene.load * thickness / 2
    return Layer(
        scene,
        both,
        np.hstack([corners[triangles, :3], corners[triangles, :3] + count]),
        np.hstack([corners[~triangles], corners[~triangles] + count]),
        body[triangles],
        body[~triangles],
        _faces(scene.slave, count),
        _faces(scene.master, count),
        np.tile(np.vstack(frames), (2, 1, 1)),
        np.tile(np.vstack(fixed), (2, 1)),
        np.tile(np.vstack(imposed), (2, 1)),
        np.tile(load, (2, 1)),
    )


def deepen(layer: Layer, share: float = 2.0**-30) -> FloatArray:
    """Return displacements (n_front, 2) that move each slave body out of itself, by a share of the largest body's size.

    Codes that count no contact without depth begin so: a body that only touches would be free to move.
    """
    scene, moves = layer.scene, np.zeros((layer.n_front, 2))
    body_of_edge = scene.body_of_node[scene.slave[:, 0]]
    for body in np.unique(body_of_edge):
        along = np.diff(scene.nodes[scene.slave[body_of_edge == body]], axis=1)[:, 0]
        outwards = np.array([along[:, 1].sum(), -along[:, 0].sum()]) / np.linalg.norm(along, axis=1).sum()
        moves[np.flatnonzero(scene.body_of_node == body)] = share * scene.unit * outwards
    return moves


def _faces(edges: IntArray, count: int) -> IntArray:
    """Return the faces (n, 4) over edges whose body is on the left, counter-clockwise seen from outside."""
    first, second = edges.T
    return np.column_stack([first, second, second + count, first + count])
