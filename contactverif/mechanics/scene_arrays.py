"""Bodies as plain arrays, for codes that know nothing of the harness, and their answers back on these bodies.

Rule for the next editor: whatever a code is spared, such as inclined axes, is undone here, so that its answer is
measured on the scene itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.body import Body
from contactverif.contract.engine import EngineAnswer, SceneArrays
from contactverif.contract.errors import MisuseError
from contactverif.mechanics.packed_bodies import pack_bodies

_SAME = 64 * UNIT_ROUNDOFF  # Coordinates that differ by less, over the largest one, were equal before they were turned.


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Bodies as they are posed to a code: their arrays, and how an answer goes back to them."""

    arrays: SceneArrays
    turn: FloatArray  # (2, 2): from the axes of the arrays to those of the bodies.
    lowered: FloatArray  # (n_nodes, 2): by how much nodes were moved beforehand, in the axes of the arrays.
    scale: float  # The factor of all loads and imposed displacements.

    def restore(self, answer: EngineAnswer) -> EngineAnswer:
        """Return an answer for the bodies as they were: in global axes, and under their own loads."""
        forces, pressures = answer.contact_forces, answer.pressures
        return replace(
            answer,
            displacements=(self.lowered + answer.displacements) / self.scale @ self.turn.T,
            contact_forces=None if forces is None else forces / self.scale @ self.turn.T,
            pressures=None if pressures is None else pressures / self.scale,
        )


def pose_bodies(
    bodies: tuple[Body, ...], slave: Sequence[int], penalty: float, *, upright: bool, lowered: bool, scale: float
) -> Pose:
    """Return bodies as a code is given them; `Scene.pose` says how."""
    turn = _common_frame(bodies) if upright else np.eye(2)
    packed = pack_bodies(bodies, slave)
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
        penalty=penalty,
        unit=max(float(np.ptp(body.nodes, axis=0).max()) for body in bodies),
    )
    return Pose(arrays, turn, moved, scale)


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
