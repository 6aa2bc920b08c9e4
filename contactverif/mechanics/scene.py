"""A scene: elastic bodies around an interface, condensed or whole, packed into a case, or posed to another code.

Symbols: q are the unknowns of a scene, the free components of the nodes on the contact boundaries; S is the stiffness
and g the load of the bodies, condensed onto q; z are the positions of the interface's nodes.

A body that no other can reach is no part of the interface and has none of the unknowns, so nothing of it is visited
while contact is solved. A case that holds a scene gives the same scene back to the last bit.
"""

import itertools
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, Self

import numpy as np
from scipy import linalg, sparse

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray, dense
from contactverif.contract.body import Body
from contactverif.contract.case import BODIES, Case
from contactverif.contract.engine import EngineAnswer, SceneArrays
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import PLANE, Interface, Surface, ways_to_master
from contactverif.mechanics import bulk

_SAME = 64 * UNIT_ROUNDOFF  # Coordinates that differ by less, over the largest one, were equal before they were turned.


def pack_bodies(bodies: Sequence[Body], slave: Sequence[int]) -> dict[str, FloatArray]:
    """Return all bodies in a few arrays of floats, whose integers are exact; −1 stands for nodes that a cell lacks."""
    counts = [len(body.nodes) for body in bodies]
    first = np.cumsum([0, *counts[:-1]]).tolist()

    def number(name: str, width: int) -> list[IntArray]:
        rows = [getattr(body, name) + start for body, start in zip(bodies, first, strict=True)]
        return [np.pad(part, ((0, 0), (0, width - part.shape[1])), constant_values=-1) for part in rows]

    parts: dict[str, list[Any]] = {
        "nodes": [body.nodes for body in bodies],
        "cells": number("cells", 4 if bodies[0].dim == PLANE else 8),
        "contact": number("contact", 2 if bodies[0].dim == PLANE else 4),
        **{name: [getattr(body, name) for body in bodies] for name in ("fixed", "imposed", "load")},
    }
    return {
        **{name: np.vstack(arrays).astype(np.float64) for name, arrays in parts.items()},
        "count": np.array(counts, dtype=np.float64),
        "is_slave": np.array([index in slave for index in range(len(bodies))], dtype=np.float64),
        **{name: np.array([getattr(body, name) for body in bodies]) for name in ("young", "poisson", "axis", "start")},
    }


def unpack_bodies(packed: Mapping[str, FloatArray]) -> tuple[tuple[Body, ...], tuple[int, ...], tuple[int, ...]]:
    """Return bodies, slave indices and master indices from the arrays that `pack_bodies` made."""
    count = packed["count"].astype(np.int64)
    ends = np.cumsum(count).tolist()
    cells, contact = (packed[name].astype(np.int64) for name in ("cells", "contact"))
    bodies = []

    def rows_of(numbers: IntArray, start: int, end: int) -> IntArray:
        rows = numbers[(numbers[:, 0] >= start) & (numbers[:, 0] < end)]
        return rows[:, (rows >= 0).any(axis=0)] - start if len(rows) else rows

    for index, (start, end) in enumerate(zip([0, *ends], ends, strict=False)):
        bodies.append(
            Body(
                nodes=packed["nodes"][start:end],
                cells=rows_of(cells, start, end),
                contact=rows_of(contact, start, end),
                young=float(packed["young"][index]),
                poisson=float(packed["poisson"][index]),
                fixed=packed["fixed"][start:end] != 0,
                imposed=packed["imposed"][start:end],
                load=packed["load"][start:end],
                axis=packed["axis"][index],
                start=packed["start"][index],
                name=body_name(packed["is_slave"], index),
            )
        )
    slave, master = (np.flatnonzero((packed["is_slave"] != 0) == side).tolist() for side in (True, False))
    return tuple(bodies), tuple(slave), tuple(master)


def body_name(is_slave: FloatArray, index: int) -> str:
    """Return "slave" or "master", with a number where there are several."""
    same = np.flatnonzero(is_slave == is_slave[index])
    side = "slave" if is_slave[index] else "master"
    return side if len(same) == 1 else f"{side} {int(np.searchsorted(same, index)) + 1}"


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Bodies as they are posed to a code: their arrays, and how an answer goes back to them."""

    arrays: SceneArrays
    turn: FloatArray  # (dim, dim): from the axes of the arrays to those of the bodies.
    lowered: FloatArray  # (n_nodes, dim): by how much nodes were moved beforehand, in the axes of the arrays.
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


def _turn_back(nodes: FloatArray, turn: FloatArray) -> FloatArray:
    """Return places (n, dim) in the axes of a rotation; coordinates that rounding alone tells apart become equal."""
    upright = nodes @ turn
    if (np.abs(turn) == np.eye(len(turn))).all():
        return upright
    rounding = _SAME * float(np.abs(upright).max())
    for column in upright.T:
        order = np.argsort(column)
        groups = np.cumsum(np.diff(column[order], prepend=column[order[0]]) > rounding)
        firsts = np.flatnonzero(np.diff(groups, prepend=-1))
        column[order] = column[order][firsts][groups]
    return upright


@dataclass(frozen=True, eq=False)
class Scene:
    """Elastic or rigid bodies in contact: a boundary value problem that `solve` solves with any formulation.

    Its methods take the unknowns q (n_free,), a length each, and the share `factor` of loads and imposed displacements.

    Attributes
    ----------
    bodies : tuple[Body, ...]
        All bodies, including those that nothing can reach.
    slave, master : tuple[int, ...]
        The indices of the slave bodies and of the master bodies. Every body is one or the other.
    penalty : float
        The distributed stiffness ε̂ of `case`, force per length per length of penetration.
    facts : Mapping[str, FloatArray]
        Whatever is known exactly about the solution, arrays by name. They become parameters of the case.
    name : str
        The name of the scene on the command line; empty for a random scene.

    Raises
    ------
    MisuseError
        If a body is neither slave nor master, or both, or if a body can move as a rigid one and nothing resists.

    See Also
    --------
    load_scene : A scene by its name on the command line.
    two_blocks : Two blocks, one on the other.
    block, rigid_surface, body_from_mesh : Bodies.

    Examples
    --------
    >>> from contactverif import Rectangle, Scene, block, rigid_surface
    >>> punch = block(Rectangle([0, 1, 2], [0, 1]), contact="bottom", approach=0.1, name="punch")
    >>> floor = rigid_surface([[3, 0], [-1, 0]], name="floor")
    >>> scene = Scene((punch, floor), penalty=100.0)
    >>> scene.interface.n_nodes, scene.n_free
    (5, 4)
    """

    bodies: tuple[Body, ...]
    slave: tuple[int, ...] = (0,)
    master: tuple[int, ...] = (1,)
    penalty: float = 1.0
    facts: Mapping[str, FloatArray] = field(default_factory=dict)
    name: str = ""

    def __post_init__(self) -> None:
        if sorted((*self.slave, *self.master)) != list(range(len(self.bodies))):
            roles = f"slave {self.slave} and master {self.master} of {len(self.bodies)} bodies"
            raise MisuseError("bodies", roles, "each body either slave or master, and at least one of both")
        if not self.slave or not self.master:
            raise MisuseError("bodies", "no slave" if not self.slave else "no master", "at least one of both")
        if len({body.dim for body in self.bodies}) > 1:
            raise MisuseError("bodies", "bodies in the plane and bodies in space", "either")
        for body in self.bodies:
            if loose := bulk.loose_modes(body):
                needed = "fixed components that prevent it (contact without friction does not)"
                actual = f"{'too few' if body.fixed.any() else 'none'}: it can {' and '.join(loose)}"
                raise MisuseError(f"supports of {body.name}", actual, needed)

    @property
    def dim(self) -> int:
        """The number of coordinates of a node."""
        return self.bodies[0].dim

    @cached_property
    def bodies_in_reach(self) -> tuple[int, ...]:
        """The indices of the bodies that a body of the other side can reach, slaves first; an error if there are none.

        Two bodies can reach each other if the boxes around their contact boundaries meet. Each box is widened by its
        own diagonal, and holds both the reference and the first guess.
        """
        boxes = []
        for body in self.bodies:
            nodes = body.nodes[body.contact_nodes]
            moves = body.start if not body.rigid else body.imposed[body.contact_nodes].mean(axis=0)
            places = np.vstack([nodes, nodes + body.frame @ moves])
            low, high = places.min(axis=0), places.max(axis=0)
            diagonal = np.linalg.norm(high - low)
            boxes.append((low - diagonal, high + diagonal))
        lows, highs = np.array(boxes).swapaxes(0, 1)
        meet = (lows[:, None] <= highs).all(axis=2)
        meet &= meet.T
        slaves = tuple(body for body in self.slave if meet[body, list(self.master)].any())
        masters = tuple(body for body in self.master if meet[body, list(self.slave)].any())
        if not slaves:
            raise MisuseError("bodies", "no slave within reach of a master", "bodies that can touch")
        return slaves + masters

    @property
    def _reached(self) -> tuple[Body, ...]:
        return tuple(self.bodies[index] for index in self.bodies_in_reach)

    @property
    def nodes_in_reach(self) -> IntArray:
        """The numbers (n_nodes,) of the interface's nodes among the nodes of all bodies, one body after the other."""
        first = np.cumsum([0, *(len(body.nodes) for body in self.bodies)])
        return np.concatenate([first[index] + self.bodies[index].contact_nodes for index in self.bodies_in_reach])

    @cached_property
    def condensed_bodies(self) -> tuple[bulk.CondensedBody, ...]:
        """The bodies within reach, condensed, in the order of `bodies_in_reach`."""
        return tuple(map(bulk.condense, self._reached))

    @cached_property
    def interface(self) -> Interface:
        """The contact boundaries of the bodies within reach."""
        segments: dict[bool, list[IntArray]] = {True: [], False: []}
        first = 0
        for index, body in zip(self.bodies_in_reach, self._reached, strict=True):
            segments[index in self.slave].append(np.searchsorted(body.contact_nodes, body.contact) + first)
            first += len(body.contact_nodes)
        nodes = np.vstack([body.nodes[body.contact_nodes] for body in self._reached])
        return Interface(nodes, Surface(np.vstack(segments[True])), Surface(np.vstack(segments[False])))

    @cached_property
    def unknowns(self) -> tuple[IntArray, ...]:
        """The unknowns of each body within reach: dim × node + component of what is free on its contact boundary."""
        return tuple(map(bulk.free_on_contact, self._reached))

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """The slice of q that holds the unknowns of each body within reach."""
        ends = np.cumsum([0, *map(len, self.unknowns)]).tolist()
        return tuple(slice(start, end) for start, end in itertools.pairwise(ends))

    @property
    def n_free(self) -> int:
        """The number of unknowns q."""
        return self.slices[-1].stop if self.slices else 0

    @cached_property
    def stiffness(self) -> FloatArray | sparse.csr_array:
        """The stiffness S (n_free, n_free) of all bodies within reach: dense if it is small or has few blocks."""
        blocks = [body.stiffness for body in self.condensed_bodies]
        n_entries = sum(block.size for block in blocks)  # Blocks are full.
        if self.n_free <= bulk.DENSE_LIMIT or n_entries >= bulk.DENSE_SHARE * self.n_free**2:
            matrix = np.zeros((self.n_free, self.n_free))
            for part, block in zip(self.slices, blocks, strict=True):
                matrix[part, part] = block
            return matrix
        return sparse.csr_array(sparse.block_diag(blocks))

    @cached_property
    def load(self) -> FloatArray:
        """The load g (n_free,), a force: that of nodal forces and of imposed displacements."""
        return np.concatenate([body.load for body in self.condensed_bodies])

    @cached_property
    def transformation(self) -> FloatArray | sparse.csr_array:
        """The matrix (n_unknowns of the interface, n_free) from unknowns q to changes of the positions z.

        Its transpose takes nodal forces to forces on q. It is dense up to `DENSE_LIMIT` unknowns, else sparse.
        """
        rows, columns, values = [], [], []
        first = 0
        for body, unknowns, part in zip(self._reached, self.unknowns, self.slices, strict=True):
            nodes, components = np.divmod(unknowns, self.dim)
            on_contact = np.flatnonzero(np.isin(nodes, body.contact_nodes))
            row = self.dim * (first + np.searchsorted(body.contact_nodes, nodes[on_contact]))
            for direction in range(self.dim):
                rows.append(row + direction)
                columns.append(part.start + on_contact)
                values.append(body.frame[direction, components[on_contact]])
            first += len(body.contact_nodes)
        shape = (self.interface.n_unknowns, self.n_free)
        places = np.concatenate(rows), np.concatenate(columns)
        if self.n_free <= bulk.DENSE_LIMIT:
            matrix = np.zeros(shape)
            matrix[places] = np.concatenate(values)
            return matrix
        return sparse.csr_array((np.concatenate(values), places), shape=shape)

    @cached_property
    def imposed_displacements(self) -> FloatArray:
        """The change (n_unknowns,) of the positions z by the imposed displacements, a length each."""
        parts = [(body.imposed @ body.frame.T)[body.contact_nodes] for body in self._reached]
        return np.vstack(parts).reshape(-1)

    @cached_property
    def start(self) -> FloatArray:
        """The first guess (n_free,) of q."""
        parts = zip(self._reached, self.unknowns, strict=True)
        return np.concatenate([body.start[unknowns % self.dim] for body, unknowns in parts])

    def positions(self, q: FloatArray, factor: float = 1.0) -> FloatArray:
        """Return the current positions z (n_unknowns,) of the interface's nodes, a length each."""
        nodes: FloatArray = self.interface.nodes.reshape(-1)
        return nodes + factor * self.imposed_displacements + self.transformation @ q

    def bulk_forces(self, q: FloatArray, factor: float = 1.0) -> FloatArray:
        """Return S q − g (n_free,): the forces on the unknowns that contact must supply."""
        return self.stiffness @ q - factor * self.load

    def nodal_forces(self, q: FloatArray, factor: float = 1.0) -> FloatArray:
        """Return the forces (n_nodes, dim) that contact must supply at the interface's nodes, in global axes.

        Reactions of supports on the contact boundary are not among them.
        """
        return (self.transformation @ self.bulk_forces(q, factor)).reshape(-1, self.dim)

    def displacements(self, q: FloatArray, factor: float = 1.0) -> list[FloatArray]:
        """Return the displacements (n_nodes, dim) of the nodes of each body, a length each, in global axes.

        A body out of reach is solved on its own.
        """
        return [body.displacements(part, factor) for body, part in self._all_unknowns(q, factor)]

    def stresses(self, q: FloatArray, factor: float = 1.0) -> list[FloatArray]:
        """Return the stresses (n_cells, n_points, 3 or 6) of each body at its Gauss points, force per length squared.

        They are the normal stresses along its axes, positive in tension, and the shear stresses, see `CondensedBody`. A
        rigid body has no cells.
        """
        return [body.stresses(part, factor) for body, part in self._all_unknowns(q, factor)]

    def case(self, *, seed: int = 0) -> Case:
        """Return the scene as a case, at the first guess of its solution; `scene_of` gives the scene back."""
        arrays = {BODIES + name: values for name, values in pack_bodies(self.bodies, self.slave).items()}
        z = self.positions(self.start)
        case = Case(self.interface, z, self.penalty, {**self.facts, **arrays}, seed, self.name)
        if all(body.name == body_name(arrays[BODIES + "is_slave"], index) for index, body in enumerate(self.bodies)):
            _remember(case, self)
        return case

    def pose(self, *, upright: bool = False, lowered: bool = False, scale: float = 1.0) -> Pose:
        """Return the scene as a code is given it.

        Parameters
        ----------
        upright : bool
            Turn the scene so that the axes of its bodies are the global ones. Coordinates that were equal before the
            scene was inclined are equal again.
        lowered : bool
            Move each body that nothing holds along one of its axes by its first guess there, so that it touches.
        scale : float
            The factor of all loads and imposed displacements. Only a scene without a first gap may be scaled.

        Raises
        ------
        MisuseError
            If it is to be upright, and its bodies have different axes.
        """
        bodies = self.bodies
        if upright and any((body.frame != bodies[0].frame).any() for body in bodies):
            raise MisuseError("upright", "bodies with different axes", "bodies that have the same axes")
        turn = bodies[0].frame if upright else np.eye(self.dim)
        packed = pack_bodies(bodies, self.slave)
        body_of_node = np.repeat(np.arange(len(bodies)), packed["count"].astype(np.int64))
        cells, contact = (packed[name].astype(np.int64) for name in ("cells", "contact"))
        is_slave = packed["is_slave"][body_of_node[contact[:, 0]]] != 0
        nodes = _turn_back(packed["nodes"], turn) if upright else packed["nodes"]

        def at_nodes(starts: list[FloatArray]) -> FloatArray:
            pairs = zip(bodies, starts, strict=True)
            return np.vstack([np.broadcast_to(s @ body.frame.T, body.nodes.shape) for body, s in pairs]) @ turn

        moves = at_nodes([body.start for body in bodies])
        loose = at_nodes([np.where(body.fixed.any(axis=0), 0.0, body.start) for body in bodies])
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
            axes=np.array([np.eye(self.dim)[: self.dim - 1]] * len(bodies)) if upright else packed["axis"],
            young=packed["young"],
            poisson=packed["poisson"],
            penalty=self.penalty,
            unit=max(float(np.ptp(body.nodes, axis=0).max()) for body in bodies),
        )
        return Pose(arrays, turn, moved, scale)

    def arrays(self, *, upright: bool = False, lowered: bool = False) -> SceneArrays:
        """Return the scene as plain arrays, which any contact code can read, see `pose`."""
        return self.pose(upright=upright, lowered=lowered).arrays

    def gap_at_rest(self) -> float:
        """Return the least way between a node of one side and the other side, where bodies move and nothing presses.

        It is a length, infinite where no node sees the other side. A body that its supports do not hold stays in place.
        """
        parts = zip(map(partial(_move_freely, factor=1.0), self.condensed_bodies), self.unknowns, strict=True)
        free = [np.zeros(len(unknowns)) if part is None else part for part, unknowns in parts]
        positions = self.positions(np.concatenate([np.zeros(0), *free]))
        there = replace(self.interface, nodes=positions.reshape(-1, self.dim))
        return float(min(ways_to_master(each)[0].min() for each in (there, there.swap_roles())))

    def _all_unknowns(self, q: FloatArray, factor: float) -> list[tuple[bulk.CondensedBody, FloatArray]]:
        """Return every body with its unknowns; those of a body out of reach are solved for here."""
        unknowns = dict(zip(self.bodies_in_reach, (q[part] for part in self.slices), strict=True))
        condensed = tuple(map(bulk.condense, self.bodies))
        for number, body in enumerate(condensed):
            if number not in unknowns and len(body.unknowns):
                if (free := _move_freely(body, factor)) is None:
                    actual = "not enough to hold a body that can touch nothing"
                    raise MisuseError(f"supports of {body.body.name}", actual, "supports against every motion")
                unknowns[number] = free
        return [(body, unknowns.get(number, np.zeros(0))) for number, body in enumerate(condensed)]


def _move_freely(body: bulk.CondensedBody, factor: float) -> FloatArray | None:
    """Return the unknowns of a body that touches nothing, for a share of its loads; None if its supports are loose."""
    if not len(body.unknowns):
        return np.zeros(0)
    stiffnesses, modes = linalg.eigh(body.stiffness)
    if stiffnesses[0] <= len(modes) * UNIT_ROUNDOFF * stiffnesses[-1]:
        return None
    return np.asarray(modes @ (modes.T @ (factor * body.load) / stiffnesses))


def has_bodies(case: Case) -> bool:
    """Return whether the case holds a scene."""
    return bool(case.packed_bodies)


# The scenes of the last cases, so that a scene that has just been made is not made again from its case. They are kept
# by identity: cases have no other equality.
_ORIGINS: OrderedDict[Case, Scene] = OrderedDict()


def _remember(case: Case, scene: Scene) -> None:
    _ORIGINS[case] = scene
    if len(_ORIGINS) > bulk.SCENES_SIZE:
        _ORIGINS.popitem(last=False)


def forget_bodies() -> None:
    """Let go of all scenes and condensed bodies, before the time that they take is measured."""
    _ORIGINS.clear()
    bulk.forget_condensed()


def scene_of(case: Case) -> Scene:
    """Return the scene of a case that `Scene.case` made; bodies that two cases share are two bodies then.

    The last cases have their scenes still, with whatever is condensed of them. Any other case, such as a stored one,
    gives the same scene to the last bit.
    """
    if (scene := _ORIGINS.get(case)) is not None:
        return scene
    packed = case.packed_bodies
    if not packed:
        raise MisuseError("case", "an interface without bodies", "a case made of a scene")
    facts = {name: values for name, values in case.parameters.items() if not name.startswith(BODIES)}
    bodies, slave, master = unpack_bodies(packed)
    scene = Scene(bodies, slave, master, case.penalty, facts, case.name)
    _remember(case, scene)
    return scene


@dataclass(frozen=True, eq=False)
class WholeScene(Scene):
    """A scene whose unknowns are all free components of its bodies. `solve` takes it like any other scene."""

    @classmethod
    def of_scene(cls, scene: Scene) -> Self:
        """Return the same scene, uncondensed."""
        return cls(scene.bodies, scene.slave, scene.master, scene.penalty, scene.facts, scene.name)

    @cached_property
    def unknowns(self) -> tuple[IntArray, ...]:
        """The unknowns of each body within reach: dim × node + component of all that is free."""
        return tuple(np.flatnonzero(~body.fixed.reshape(-1)) for body in self._reached)

    @cached_property
    def stiffness(self) -> FloatArray | sparse.csr_array:
        """The stiffness (n_free, n_free) of all bodies within reach: dense if it is small, else sparse."""
        blocks = [rows[:, free] for rows, free in zip(self._rows, self.unknowns, strict=True)]
        matrix = sparse.csr_array(sparse.block_diag(blocks))
        return dense(matrix) if self.n_free <= bulk.DENSE_LIMIT else matrix

    @cached_property
    def load(self) -> FloatArray:
        """The load (n_free,), a force: that of nodal forces and of imposed displacements."""
        parts = zip(self._reached, self._rows, self.unknowns, strict=True)
        return np.concatenate(
            [body.load.reshape(-1)[free] - rows @ body.imposed.reshape(-1) for body, rows, free in parts]
        )

    @cached_property
    def _rows(self) -> tuple[Any, ...]:
        """The rows (n_unknowns, dim × n_nodes) of the stiffness of each body within reach."""
        rows = []
        for body, free in zip(self._reached, self.unknowns, strict=True):
            nothing = (body.nodes.size,) * 2
            rows.append(sparse.csr_array(nothing if body.rigid else bulk.assemble_stiffness(body)[0])[free])
        return tuple(rows)
