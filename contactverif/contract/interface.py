"""The two facing meshes. What is wrong with a mesh is said here, once; behind this door every mesh is right.

A `Surface` knows how segments hang together and nothing of positions; an `Interface` adds the reference positions.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactverif.contract.arrays import FloatArray, IntArray, freeze
from contactverif.contract.errors import MisuseError


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Chains of straight segments with their body on the left.

    Attributes
    ----------
    segments : IntArray, shape (n_segments, 2)
        Node numbers, first and second node of each segment.
    neighbours : IntArray, shape (n_segments, 2)
        The previous and the next segment of the chain, −1 at a free end.
    chain_order : IntArray, shape (n_segments,)
        The segments as one meets them walking along the chains.

    Raises
    ------
    MisuseError
        If the segments are no chains: a node that begins or ends two of them, or a segment that begins where it
        ends.
    """

    segments: IntArray
    neighbours: IntArray = field(init=False)
    chain_order: IntArray = field(init=False)

    def __post_init__(self) -> None:
        raw = _array("segments", self.segments)
        if raw.ndim != 2 or raw.shape[1] != 2 or len(raw) == 0:
            raise MisuseError("segments", f"an array of shape {raw.shape}", "shape (n_segments, 2), n_segments ≥ 1")
        if not np.issubdtype(raw.dtype, np.integer):
            raise MisuseError("segments", f"dtype {raw.dtype}", "integer node numbers")
        segments = freeze(raw, np.int64)
        if segments.min() < 0:
            raise MisuseError("segments", f"node number {segments.min()}", "node numbers ≥ 0")
        looped = np.flatnonzero(segments[:, 0] == segments[:, 1])
        if len(looped):
            raise MisuseError(
                "segments",
                f"segment {looped[0]} that begins and ends at node {segments[looped[0], 0]}",
                "two nodes",
            )
        for end, word in ((0, "begin"), (1, "end")):
            numbers, counts = np.unique(segments[:, end], return_counts=True)
            if counts.max() > 1:
                node = numbers[np.argmax(counts)]
                where = ", ".join(map(str, np.flatnonzero(segments[:, end] == node)[:4]))
                raise MisuseError(
                    "segments",
                    f"segments {where} that all {word} at node {node}",
                    "chains: a node begins at most one segment and ends at most one (body on the left throughout)",
                )
        object.__setattr__(self, "segments", segments)
        object.__setattr__(self, "neighbours", freeze(_neighbours(segments), np.int64))
        object.__setattr__(self, "chain_order", freeze(_chain_order(self.neighbours), np.int64))

    def __len__(self) -> int:
        return len(self.segments)

    @property
    def nodes(self) -> IntArray:
        """The node numbers of this surface, ascending."""
        return np.unique(self.segments)

    def lengths(self, nodes: FloatArray) -> FloatArray:
        """Lengths (n_segments,) of the segments at the node positions (n_nodes, dim)."""
        ends = nodes[self.segments]  # (n_segments, 2, dim)
        lengths: FloatArray = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1)
        return lengths


@dataclass(frozen=True, slots=True, eq=False)
class Interface:
    """A slave and a master surface in their reference configuration.

    Attributes
    ----------
    nodes : FloatArray, shape (n_nodes, dim)
        Reference positions, a length each; slave nodes first, then master nodes.
    slave, master : Surface
        The two surfaces, bodies on the left: where they face each other they run in opposite directions.

    Raises
    ------
    MisuseError
        On NaN or infinity, zero-length segments, two nodes of one surface in one place, a node of both surfaces
        or of none, or nodes out of order.
    """

    nodes: FloatArray
    slave: Surface
    master: Surface

    def __post_init__(self) -> None:
        for name, surface in (("slave", self.slave), ("master", self.master)):
            if not isinstance(surface, Surface):
                raise MisuseError(name, f"a {type(surface).__name__}", "a Surface")
        raw = _array("nodes", self.nodes)
        if raw.ndim != 2 or raw.shape[1] != 2:
            raise MisuseError("nodes", f"an array of shape {raw.shape}", "shape (n_nodes, 2)")
        if raw.dtype.kind not in "fiu":
            raise MisuseError("nodes", f"dtype {raw.dtype}", "real numbers")
        nodes = freeze(raw, np.float64)
        bad = np.flatnonzero(~np.isfinite(nodes).all(axis=1))
        if len(bad):
            raise MisuseError("nodes", f"node {bad[0]} at {tuple(nodes[bad[0]].tolist())}", "finite coordinates")
        object.__setattr__(self, "nodes", nodes)
        used_slave, used_master = self.slave.nodes, self.master.nodes
        n_slave = len(used_slave)
        if not np.array_equal(used_slave, np.arange(n_slave)):
            raise MisuseError(
                "slave",
                f"nodes {_brief(used_slave)}",
                f"the first node numbers, 0 … {n_slave - 1}, each used",
            )
        if not np.array_equal(used_master, np.arange(n_slave, len(nodes))):
            raise MisuseError(
                "master",
                f"nodes {_brief(used_master)}",
                f"all node numbers behind the slave's, {n_slave} … {len(nodes) - 1}, each used",
            )
        for name, surface, used in (("slave", self.slave, used_slave), ("master", self.master, used_master)):
            _check_positions(name, surface, used, nodes)

    @classmethod
    def from_chains(cls, slave: ArrayLike, master: ArrayLike) -> Interface:
        """One open chain a side, through the points (n, 2) in walking order, the body on the left."""
        points = [_array(name, side) for name, side in (("slave", slave), ("master", master))]
        for name, side in zip(("slave", "master"), points, strict=True):
            if side.ndim != 2 or side.shape[1] != 2 or len(side) < 2:
                raise MisuseError(name, f"an array of shape {side.shape}", "shape (n ≥ 2, 2), the points of a chain")
        n_slave, n_master = map(len, points)
        numbers = np.arange(n_slave + n_master)
        segments = np.column_stack([numbers[:-1], numbers[1:]])
        return cls(np.vstack(points), Surface(segments[: n_slave - 1]), Surface(segments[n_slave:]))

    @property
    def dim(self) -> int:
        """Number of coordinates of a node."""
        return int(self.nodes.shape[1])

    @property
    def n_nodes(self) -> int:
        """Number of nodes, both sides."""
        return int(self.nodes.shape[0])

    @property
    def n_slave_nodes(self) -> int:
        """Number of slave nodes; they are the first."""
        return int(self.slave.segments.max()) + 1

    @property
    def n_unknowns(self) -> int:
        """Number of position unknowns: n_nodes × dim."""
        return self.nodes.size

    def swapped(self) -> Interface:
        """The same two surfaces with their roles exchanged (slave nodes are renumbered to come first)."""
        n_slave = self.n_slave_nodes
        n_master = self.n_nodes - n_slave
        return Interface(
            np.vstack([self.nodes[n_slave:], self.nodes[:n_slave]]),
            Surface(self.master.segments - n_slave),
            Surface(self.slave.segments + n_master),
        )

    def at(self, nodes: ArrayLike) -> Interface:
        """The same segments on other reference positions (n_nodes, dim)."""
        return Interface(_array("nodes", nodes), self.slave, self.master)


def _array(argument: str, values: ArrayLike) -> NDArray[Any]:
    try:
        return np.asarray(values)
    except ValueError as error:
        raise MisuseError(argument, "rows of different lengths", "an array") from error


def _neighbours(segments: IntArray) -> IntArray:
    starting = {int(first): index for index, first in enumerate(segments[:, 0])}
    ending = {int(second): index for index, second in enumerate(segments[:, 1])}
    return np.array([[ending.get(int(first), -1), starting.get(int(second), -1)] for first, second in segments])


def _chain_order(neighbours: IntArray) -> IntArray:
    """Open chains first, each from its free end; then closed chains, each from its lowest segment."""
    following = neighbours[:, 1].tolist()
    seen = [False] * len(following)
    order = []
    for start in [*np.flatnonzero(neighbours[:, 0] < 0).tolist(), *range(len(following))]:
        segment = start
        while segment >= 0 and not seen[segment]:
            seen[segment] = True
            order.append(segment)
            segment = following[segment]
    return np.array(order, dtype=np.int64)


def _check_positions(name: str, surface: Surface, used: IntArray, nodes: FloatArray) -> None:
    ends = nodes[surface.segments]
    zero = np.flatnonzero((ends[:, 0] == ends[:, 1]).all(axis=1))
    if len(zero):
        raise MisuseError(name, f"segment {zero[0]} of zero length", "two different end positions")
    _, first, counts = np.unique(nodes[used], axis=0, return_index=True, return_counts=True)
    if counts.max() > 1:
        place = nodes[used[first[np.argmax(counts)]]]
        twins = used[(nodes[used] == place).all(axis=1)]
        raise MisuseError(
            name,
            f"coincident nodes {_brief(twins)} at {tuple(place.tolist())}",
            "one node a place on each surface (merge them, or move one)",
        )


def _brief(numbers: IntArray) -> str:
    shown = ", ".join(map(str, numbers[:5].tolist()))
    return shown + (", …" if len(numbers) > 5 else "")
