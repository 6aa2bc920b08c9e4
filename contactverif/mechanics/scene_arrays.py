"""A scene as plain arrays, for codes that know nothing of the harness, and the solution that their answer is.

Rule for the next editor: whatever a code is spared, such as inclined axes, is undone here, so that its answer is
measured on the scene itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.body import Body
from contactverif.contract.engine import EngineAnswer, SceneArrays
from contactverif.contract.engine_subject import EngineSubject
from contactverif.contract.errors import MisuseError
from contactverif.contract.foreign_text import one_line
from contactverif.mechanics.accuracy import Solution
from contactverif.mechanics.packed_bodies import pack_bodies
from contactverif.mechanics.scene import Scene

_SAME = 64 * UNIT_ROUNDOFF  # Coordinates that differ by less, over the largest one, were equal before they were turned.


@dataclass(frozen=True, slots=True, eq=False)
class ScenePose:
    """A scene as it is posed to a code: its arrays, and how an answer goes back to the scene."""

    scene: Scene
    arrays: SceneArrays
    turn: FloatArray  # (2, 2): from the axes of the arrays to those of the scene.
    lowered: FloatArray  # (n_nodes, 2): by how much nodes were moved beforehand, in the axes of the arrays.
    scale: float  # The factor of all loads and imposed displacements.

    def solution(self, answer: EngineAnswer) -> Solution:
        """Return the solution of the scene that an answer is.

        Its forces are those that the condensed bodies need for the displacements of the interface's nodes, so that the
        cells of the code do not matter.
        """
        moves = (self.lowered + answer.displacements) / self.scale @ self.turn.T
        no_solution = "" if answer.converged else f"did not converge: {one_line(answer.message) or 'no words about it'}"
        return Solution.from_displacements(self.scene, moves[self.interface_nodes], no_solution)

    @property
    def interface_nodes(self) -> IntArray:
        """The numbers of the interface's nodes, in its order, among the nodes of the arrays."""
        first = np.cumsum([0, *(len(body.nodes) for body in self.scene.bodies)])
        return np.concatenate(
            [first[index] + self.scene.bodies[index].contact_nodes for index in self.scene.bodies_in_reach]
        )


def pose_arrays(scene: Scene, *, upright: bool = False, lowered: bool = False, scale: float = 1.0) -> ScenePose:
    """Return a scene as a code is given it.

    Parameters
    ----------
    scene : Scene
        The scene.
    upright : bool
        Turn the scene so that the axes of its bodies are the global ones. Coordinates that were equal before the scene
        was inclined are equal again.
    lowered : bool
        Move each body that nothing holds along one of its axes by its first guess there, so that it touches.
    scale : float
        The factor of all loads and imposed displacements. Only a scene without a first gap may be scaled.

    Raises
    ------
    MisuseError
        If it is to be upright, and its bodies have different axes.
    """
    bodies = scene.bodies
    turn = _common_frame(bodies) if upright else np.eye(2)
    packed = pack_bodies(bodies, scene.slave)
    count = packed["count"].astype(np.int64)
    body_of_node = np.repeat(np.arange(len(bodies)), count)
    cells = packed["cells"].astype(np.int64)
    contact = packed["contact"].astype(np.int64)
    is_slave = packed["is_slave"][body_of_node[contact[:, 0]]] != 0
    nodes = _turn_back(packed["nodes"], turn) if upright else packed["nodes"]
    moves = np.vstack([np.broadcast_to(body.start @ body.frame.T, body.nodes.shape) for body in bodies]) @ turn
    loose = np.vstack([np.broadcast_to(_loose_start(body) @ body.frame.T, body.nodes.shape) for body in bodies]) @ turn
    moved = scale * loose if lowered else np.zeros_like(nodes)
    arrays = SceneArrays(
        nodes=nodes + moved,
        cells=cells,
        body_of_cell=body_of_node[cells[:, 0]] if len(cells) else np.zeros(0, np.int64),
        body_of_node=body_of_node,
        slave=contact[is_slave],
        master=contact[~is_slave],
        fixed=packed["fixed"] != 0,
        imposed=packed["imposed"] * scale,
        load=packed["load"] * scale,
        start=scale * moves - moved,
        axes=np.tile([1.0, 0.0], (len(bodies), 1)) if upright else packed["axis"],
        young=packed["young"],
        poisson=packed["poisson"],
        penalty=scene.penalty,
        unit=max(float(np.ptp(body.nodes, axis=0).max()) for body in bodies),
    )
    return ScenePose(scene, arrays, turn, moved, scale)


def _common_frame(bodies: tuple[Body, ...]) -> FloatArray:
    """Return the rotation of all bodies' axes, which have to be the same."""
    frame = bodies[0].frame
    if any((body.frame != frame).any() for body in bodies):
        raise MisuseError("upright", "bodies with different axes", "bodies that have the same axes")
    return frame


def _turn_back(nodes: FloatArray, turn: FloatArray) -> FloatArray:
    """Return places (n, 2) in the axes of a rotation; coordinates that rounding alone tells apart become equal."""
    upright = nodes @ turn
    if (np.abs(turn) == np.eye(2)).all():
        return upright
    rounding = _SAME * float(np.abs(upright).max())
    for column in upright.T:
        order = np.argsort(column)
        groups = np.cumsum(np.diff(column[order], prepend=column[order[0]]) > rounding)
        firsts = np.flatnonzero(np.diff(groups, prepend=-1))
        column[order] = column[order][firsts][groups]
    return upright


def _loose_start(body: Body) -> FloatArray:
    """Return the first guess (2,) of a body along those of its axes along which nothing holds it, 0 along others."""
    return np.where(body.fixed.any(axis=0), 0.0, body.start)


def solve_by_engine(
    scene: Scene, subject: EngineSubject, *, lowered: bool = True, linear: bool = False
) -> tuple[Solution, EngineAnswer | None]:
    """Return the solution of a scene by an engine, with its answer; None if the scene cannot be posed to it.

    The scene is turned where the engine takes no inclined axes. Bodies that nothing holds are `lowered`, as in
    `pose_arrays`. Where its solution is linear in the loads, they are multiplied by the engine's `load_scale`.
    """
    traits = subject.engine_traits
    try:
        pose = pose_arrays(
            scene,
            upright=not traits.inclined_supports,
            lowered=lowered,
            scale=traits.load_scale if linear else 1.0,
        )
    except MisuseError as error:
        return Solution.from_displacements(scene, np.zeros_like(scene.interface.nodes), str(error)), None
    answer = subject.solve(pose.arrays)
    return pose.solution(answer), answer
