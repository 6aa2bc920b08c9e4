"""A scene: elastic bodies around an interface, as little of them as can matter, and how a `Case` keeps it.

Bodies are condensed onto their contact boundaries, so that what remains are the free components q of the nodes there.
A body that no other can reach is no part of the interface and none of q: nothing of it is visited while contact is
solved.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from scipy import linalg, sparse

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface, Surface
from contactverif.mechanics.bulk import CACHE_SIZE, DENSE_LIMIT, CondensedBody, condense, free_on_contact, loose_modes

_BODIES = "bodies_"  # before the names of the parameters of a case that hold its bodies


@dataclass(frozen=True, eq=False)
class Scene:
    """Bodies, and which of them are slave and master.

    Attributes
    ----------
    bodies : tuple[Body, ...]
        All of them, those out of reach too.
    slave, master : tuple[int, ...]
        Indices of bodies; every body is one or the other.
    penalty : float
        Ε̂ that the scene is solved with unless somebody says otherwise.
    facts : Mapping[str, FloatArray]
        What is known exactly, arrays by name; they become parameters of a case.
    name : str
        Of the scene on the command line, empty if it is a random one.

    Raises
    ------
    MisuseError
        If a body is neither or both, or can move as a rigid one though nothing resists.
    """

    bodies: tuple[Body, ...]
    slave: tuple[int, ...] = (0,)
    master: tuple[int, ...] = (1,)
    penalty: float = 1.0
    facts: Mapping[str, FloatArray] = field(default_factory=dict)
    name: str = ""

    def __post_init__(self) -> None:
        if sorted((*self.slave, *self.master)) != list(range(len(self.bodies))):
            found = f"slave {self.slave} and master {self.master} of {len(self.bodies)} bodies"
            raise MisuseError("bodies", found, "each body either slave or master, and at least one of both")
        if not self.slave or not self.master:
            raise MisuseError("bodies", "no slave" if not self.slave else "no master", "at least one of both")
        for body in self.bodies:
            if loose := loose_modes(body):
                held = "fixed components that prevent it (contact without friction does not)"
                supports = "no supports" if not body.fixed.any() else "supports"
                raise MisuseError(f"supports of {body.name}", f"{supports}: it can {' and '.join(loose)}", held)

    @cached_property
    def bodies_in_reach(self) -> tuple[int, ...]:
        """The bodies that another side's body can reach, slaves first.

        Two bodies reach each other if the boxes around their contact boundaries, each widened by its own diagonal, meet
        where the bodies start or where they lie.
        """
        boxes = [_reach(body) for body in self.bodies]

        def meet(one: int, other: int) -> bool:
            (low, high), (other_low, other_high) = boxes[one], boxes[other]
            return bool((low <= other_high).all() and (other_low <= high).all())

        slaves = tuple(one for one in self.slave if any(meet(one, other) for other in self.master))
        masters = tuple(one for one in self.master if any(meet(one, other) for other in self.slave))
        if not slaves:
            raise MisuseError("bodies", "no slave within reach of a master", "bodies that can touch")
        return slaves + masters

    @cached_property
    def condensed_bodies(self) -> tuple[CondensedBody, ...]:
        """The bodies within reach, condensed, in the order of `bodies_in_reach`."""
        return tuple(condense(self.bodies[index]) for index in self.bodies_in_reach)

    @cached_property
    def interface(self) -> Interface:
        """The contact boundaries of the bodies within reach."""
        segments: dict[bool, list[IntArray]] = {True: [], False: []}
        first = 0
        for index in self.bodies_in_reach:
            body = self.bodies[index]
            segments[index in self.slave].append(np.searchsorted(body.contact_nodes, body.contact) + first)
            first += len(body.contact_nodes)
        nodes = np.vstack(
            [self.bodies[index].nodes[self.bodies[index].contact_nodes] for index in self.bodies_in_reach]
        )
        return Interface(nodes, Surface(np.vstack(segments[True])), Surface(np.vstack(segments[False])))

    @cached_property
    def unknowns(self) -> tuple[IntArray, ...]:
        """What q is made of: the free components on the contact boundary of each body within reach."""
        return tuple(free_on_contact(self.bodies[index]) for index in self.bodies_in_reach)

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Where each body within reach has its unknowns in q."""
        ends = np.cumsum([0, *map(len, self.unknowns)]).tolist()
        return tuple(slice(start, end) for start, end in itertools.pairwise(ends))

    @property
    def n_free(self) -> int:
        """Number of unknowns q."""
        return self.slices[-1].stop if self.slices else 0

    @cached_property
    def stiffness(self) -> FloatArray | sparse.csr_array:
        """(n_free, n_free) of all bodies within reach: dense where that is small, else sparse."""
        blocks = [body.stiffness for body in self.condensed_bodies]
        if self.n_free <= DENSE_LIMIT:
            matrix: FloatArray = linalg.block_diag(*blocks)
            return matrix
        return sparse.csr_array(sparse.block_diag(blocks))

    @cached_property
    def load(self) -> FloatArray:
        """(n_free,) forces of loads and imposed displacements."""
        return np.concatenate([body.load for body in self.condensed_bodies])

    @cached_property
    def transformation(self) -> FloatArray | sparse.csr_array:
        """(n_unknowns of the interface, n_free): what unit values of q do to the positions."""
        rows, columns, values = [], [], []
        first = 0
        for index, unknowns, part in zip(self.bodies_in_reach, self.unknowns, self.slices, strict=True):
            body = self.bodies[index]
            nodes, components = np.divmod(unknowns, 2)
            row = 2 * (first + np.searchsorted(body.contact_nodes, nodes))
            for direction in (0, 1):
                rows.append(row + direction)
                columns.append(np.arange(part.start, part.stop))
                values.append(body.frame[direction, components])
            first += len(body.contact_nodes)
        shape = (self.interface.n_unknowns, self.n_free)
        places = np.concatenate(rows), np.concatenate(columns)
        if self.n_free <= DENSE_LIMIT:
            matrix = np.zeros(shape)
            matrix[places] = np.concatenate(values)
            return matrix
        return sparse.csr_array((np.concatenate(values), places), shape=shape)

    @cached_property
    def imposed_displacements(self) -> FloatArray:
        """(n_unknowns,) what the imposed displacements do to the positions."""
        bodies = [self.bodies[index] for index in self.bodies_in_reach]
        parts = [(body.imposed @ body.frame.T)[body.contact_nodes] for body in bodies]
        return np.vstack(parts).reshape(-1)

    @cached_property
    def start(self) -> FloatArray:
        """(n_free,) the first guess of q."""
        pairs = zip(self.bodies_in_reach, self.unknowns, strict=True)
        return np.concatenate([self.bodies[index].start[unknowns % 2] for index, unknowns in pairs])

    def positions(self, q: FloatArray, factor: float = 1.0) -> FloatArray:
        """Current positions (n_unknowns,), flat, with imposed displacements × factor."""
        positions: FloatArray = (
            self.interface.nodes.reshape(-1) + factor * self.imposed_displacements + self.transformation @ q
        )
        return positions

    def bulk_forces(self, q: FloatArray, factor: float = 1.0) -> FloatArray:
        """S q − g (n_free,): the forces that contact must bring, by the bodies alone."""
        forces: FloatArray = self.stiffness @ q - factor * self.load
        return forces

    def nodal_forces(self, q: FloatArray, factor: float = 1.0) -> FloatArray:
        """The same on the nodes of the interface (n_nodes, 2), in global axes; without what supports there take."""
        forces: FloatArray = (self.transformation @ self.bulk_forces(q, factor)).reshape(-1, 2)
        return forces

    def displacements(self, q: FloatArray, factor: float = 1.0) -> list[FloatArray]:
        """Of the nodes of every body (n_nodes, 2), in global axes; a body out of reach is solved on its own."""
        return [body.displacements(own, factor) for body, own in self._every(q, factor)]

    def stresses(self, q: FloatArray, factor: float = 1.0) -> list[FloatArray]:
        """At the Gauss points of every body (n_cells, n_points, 3): along, across and shear, in the body's axes."""
        return [body.stresses(own, factor) for body, own in self._every(q, factor)]

    def case(self, *, seed: int = 0) -> Case:
        """The scene as a case, at the first guess of its solution."""
        arrays = {_BODIES + name: values for name, values in _packed(self).items()}
        z = self.positions(self.start)
        return Case(self.interface, z, self.penalty, {**self.facts, **arrays}, seed, self.name)

    def _every(self, q: FloatArray, factor: float) -> list[tuple[CondensedBody, FloatArray]]:
        own = dict(zip(self.bodies_in_reach, (q[part] for part in self.slices), strict=True))
        pairs = []
        for index, body in enumerate(self.bodies):
            condensed = condense(body)
            if index not in own:
                own[index] = _alone(condensed, factor)
            pairs.append((condensed, own[index]))
        return pairs


def has_bodies(case: Case) -> bool:
    """Whether the case holds a scene."""
    return f"{_BODIES}nodes" in case.parameters


@lru_cache(maxsize=CACHE_SIZE)
def scene_of(case: Case) -> Scene:
    """The scene that `Scene.case` made a case of.

    Raises
    ------
    MisuseError
        If the case holds none.
    """
    if not has_bodies(case):
        raise MisuseError("case", "an interface without bodies", "a case made of a scene")
    packed = {
        name.removeprefix(_BODIES): values for name, values in case.parameters.items() if name.startswith(_BODIES)
    }
    facts = {name: values for name, values in case.parameters.items() if not name.startswith(_BODIES)}
    bodies, slave, master = _unpacked(packed)
    return Scene(bodies, slave, master, case.penalty, facts, case.name)


def _reach(body: Body) -> tuple[FloatArray, FloatArray]:
    nodes, frame = body.nodes[body.contact_nodes], body.frame
    moves = body.start if not body.rigid else body.imposed[body.contact_nodes].mean(axis=0)
    places = np.vstack([nodes, nodes + frame @ moves])
    low, high = places.min(axis=0), places.max(axis=0)
    diagonal = np.linalg.norm(high - low)
    return low - diagonal, high + diagonal


def _alone(condensed: CondensedBody, factor: float) -> FloatArray:
    """The unknowns of a body that touches nothing."""
    if not len(condensed.unknowns):
        return np.zeros(0)
    stiffnesses, modes = linalg.eigh(condensed.stiffness)
    if stiffnesses[0] <= len(modes) * UNIT_ROUNDOFF * stiffnesses[-1]:
        found = "not enough to hold a body that can touch nothing"
        raise MisuseError(f"supports of {condensed.body.name}", found, "supports against every motion")
    alone: FloatArray = modes @ (modes.T @ (factor * condensed.load) / stiffnesses)
    return alone


def _packed(scene: Scene) -> dict[str, FloatArray]:
    """All bodies in a few arrays of floats, whose integers are exact; a triangle has −1 for its fourth node."""
    bodies = scene.bodies
    first = np.cumsum([0, *(len(body.nodes) for body in bodies)]).tolist()
    cells = [np.pad(body.cells, ((0, 0), (0, 4 - body.cells.shape[1])), constant_values=-1) for body in bodies]
    cells = [np.where(numbers < 0, -1, numbers + start) for numbers, start in zip(cells, first, strict=False)]
    return {
        "nodes": np.vstack([body.nodes for body in bodies]),
        "cells": np.vstack(cells).astype(np.float64),
        "contact": np.vstack([body.contact + start for body, start in zip(bodies, first, strict=False)]).astype(float),
        "fixed": np.vstack([body.fixed for body in bodies]).astype(np.float64),
        "imposed": np.vstack([body.imposed for body in bodies]),
        "load": np.vstack([body.load for body in bodies]),
        "count": np.array([len(body.nodes) for body in bodies], dtype=np.float64),
        "is_slave": np.array([index in scene.slave for index in range(len(bodies))], dtype=np.float64),
        "young": np.array([body.young for body in bodies]),
        "poisson": np.array([body.poisson for body in bodies]),
        "axis": np.array([body.axis for body in bodies]),
        "start": np.array([body.start for body in bodies]),
    }


def _unpacked(packed: Mapping[str, FloatArray]) -> tuple[tuple[Body, ...], tuple[int, ...], tuple[int, ...]]:
    count = packed["count"].astype(np.int64)
    ends = np.cumsum(count).tolist()
    cells, contact = (packed[name].astype(np.int64) for name in ("cells", "contact"))
    bodies = []
    for index, (start, end) in enumerate(zip([0, *ends], ends, strict=False)):
        own = cells[(cells[:, 0] >= start) & (cells[:, 0] < end)] if len(cells) else cells.reshape(0, 4)
        own = own[:, :3] if len(own) and (own[:, 3] < 0).all() else own
        bodies.append(
            Body(
                nodes=packed["nodes"][start:end],
                cells=own - start,
                contact=contact[(contact[:, 0] >= start) & (contact[:, 0] < end)] - start,
                young=float(packed["young"][index]),
                poisson=float(packed["poisson"][index]),
                fixed=packed["fixed"][start:end] != 0,
                imposed=packed["imposed"][start:end],
                load=packed["load"][start:end],
                axis=packed["axis"][index],
                start=packed["start"][index],
                name=_body_name(packed["is_slave"], index),
            )
        )
    slave = np.flatnonzero(packed["is_slave"] != 0)
    master = np.flatnonzero(packed["is_slave"] == 0)
    return tuple(bodies), tuple(slave.tolist()), tuple(master.tolist())


def _body_name(is_slave: FloatArray, index: int) -> str:
    same = np.flatnonzero(is_slave == is_slave[index])
    side = "slave" if is_slave[index] else "master"
    return side if len(same) == 1 else f"{side} {int(np.searchsorted(same, index)) + 1}"
