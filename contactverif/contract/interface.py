"""The two facing meshes of a contact problem: how segments hang together, and where their nodes are.

Whatever can be wrong with a mesh is found here, in the constructors, once; nobody checks it again. `Surface` knows how
segments hang together and nothing of positions; `Interface` adds the reference positions.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from contactverif.contract.arrays import FloatArray, IntArray, as_array, freeze
from contactverif.contract.errors import MisuseError


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """One side of the interface: chains of straight segments, each with the body on its left.

    On the way from the first to the second node of a segment the body is on the left and the other surface on the
    right. A surface consists of any number of chains, open or closed. A node belongs to at most two segments.

    Attributes
    ----------
    segments : IntArray, shape (n_segments, 2)
        The numbers of the first and the second node of each segment, in any order of the segments. This is the only
        argument of the constructor; the other attributes follow from it.
    neighbours : IntArray, shape (n_segments, 2)
        The numbers of the previous and the next segment of the chain; −1 at a free end.
    chain_order : IntArray, shape (n_segments,)
        The numbers of the segments in the order of a walk along the chains: open chains from their free ends, then
        closed chains.
    chain_starts : IntArray, shape (n_chains,)
        The places in `chain_order` at which the chains begin.
    nodes : IntArray, shape (n_nodes,)
        The numbers of the nodes of this surface, ascending.

    Raises
    ------
    MisuseError
        If the segments form no chains: two of them begin at one node, two end at one node, or one begins and ends at
        the same node.

    Examples
    --------
    >>> from contactverif import Surface
    >>> surface = Surface([[0, 1], [1, 2]])
    >>> surface.neighbours.tolist()
    [[-1, 1], [0, -1]]
    """

    segments: IntArray
    neighbours: IntArray = field(init=False)
    chain_order: IntArray = field(init=False)
    chain_starts: IntArray = field(init=False)
    nodes: IntArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        raw = as_array("segments", self.segments)
        if raw.ndim != 2 or raw.shape[1] != 2 or len(raw) == 0:
            raise MisuseError("segments", f"an array of shape {raw.shape}", "shape (n_segments, 2), n_segments ≥ 1")
        if not np.issubdtype(raw.dtype, np.integer):
            raise MisuseError("segments", f"dtype {raw.dtype}", "integer node numbers")
        segments = freeze(raw, np.int64)
        link = _link_small if segments.size <= _SMALL else _link
        object.__setattr__(self, "segments", segments)
        names = ("neighbours", "chain_order", "chain_starts", "nodes")
        for name, array in zip(names, link(segments.tobytes()), strict=True):
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.segments)

    def lengths(self, nodes: FloatArray) -> FloatArray:
        """Return the lengths of the segments.

        Parameters
        ----------
        nodes : FloatArray, shape (n_nodes, dim)
            The positions of all nodes of the interface, reference or current.

        Returns
        -------
        FloatArray, shape (n_segments,)
            The lengths, in the unit of the positions.
        """
        ends = nodes[self.segments]  # (n_segments, 2, dim)
        along = ends[:, 1] - ends[:, 0]
        lengths: FloatArray = np.sqrt((along * along).sum(axis=-1))
        return lengths


@dataclass(frozen=True, slots=True, eq=False)
class Interface:
    """The two surfaces that may touch, slave and master, in their reference configuration.

    The meshes need not match. Both surfaces have their body on the left, so they run in opposite directions where they
    face each other: with the slave body on top, the slave runs in +x and the master in −x.

    Attributes
    ----------
    nodes : FloatArray, shape (n_nodes, 2)
        The reference positions of all nodes, a length each: slave nodes first, then master nodes.
    slave, master : Surface
        The two surfaces. Slave nodes have the numbers 0 … n_slave_nodes − 1, master nodes all numbers behind them; each
        node belongs to exactly one surface.

    Raises
    ------
    MisuseError
        If a coordinate is NaN or infinite, a segment has no length, two nodes of one surface lie in one place, a node
        belongs to both surfaces or to none, or the slave nodes are not the first.

    See Also
    --------
    Interface.from_chains : Make an interface from the points of one open chain a side.

    Examples
    --------
    Two slave segments over one master segment, both 4 long; the slave body is on top:

    >>> from contactverif import Interface
    >>> interface = Interface.from_chains(slave=[[0, 0], [2, 0], [4, 0]], master=[[4, 0], [0, 0]])
    >>> interface.slave.segments.tolist(), interface.master.segments.tolist()
    ([[0, 1], [1, 2]], [[3, 4]])
    >>> interface.n_nodes, interface.n_slave_nodes, interface.n_unknowns
    (5, 3, 10)
    """

    nodes: FloatArray
    slave: Surface
    master: Surface

    def __post_init__(self) -> None:
        for name, surface in (("slave", self.slave), ("master", self.master)):
            if not isinstance(surface, Surface):
                raise MisuseError(name, f"a {type(surface).__name__}", "a Surface")
        nodes = _check_nodes(self.nodes)
        object.__setattr__(self, "nodes", nodes)
        used_slave, used_master = self.slave.nodes, self.master.nodes
        n_slave = len(used_slave)
        if used_slave[-1] != n_slave - 1:  # The numbers of a surface are different, ascending and ≥ 0.
            raise MisuseError(
                "slave",
                f"nodes {_abbreviate(used_slave)}",
                f"the first node numbers, 0 … {n_slave - 1}, each used",
            )
        if used_master[0] != n_slave or not n_slave + len(used_master) == len(nodes) == used_master[-1] + 1:
            raise MisuseError(
                "master",
                f"nodes {_abbreviate(used_master)}",
                f"all node numbers behind the slave's, {n_slave} … {len(nodes) - 1}, each used",
            )
        _check_positions("slave", self.slave, nodes)
        _check_positions("master", self.master, nodes)

    @classmethod
    def from_chains(cls, slave: ArrayLike, master: ArrayLike) -> Interface:
        """Return the interface with one open chain a side.

        Parameters
        ----------
        slave, master : ArrayLike, shape (n_points, 2)
            The points of each chain in walking order, with the body on the left; at least two.

        Returns
        -------
        Interface
            Its nodes are numbered in walking order, slave first.

        Raises
        ------
        MisuseError
            If the points form no such chain.
        """
        points = [as_array(name, side) for name, side in (("slave", slave), ("master", master))]
        for name, side in zip(("slave", "master"), points, strict=True):
            if side.ndim != 2 or side.shape[1] != 2 or len(side) < 2:
                raise MisuseError(name, f"an array of shape {side.shape}", "shape (n ≥ 2, 2), the points of a chain")
        n_slave, n_master = map(len, points)
        numbers = np.arange(n_slave + n_master)
        segments = np.column_stack([numbers[:-1], numbers[1:]])
        return cls(np.vstack(points), Surface(segments[: n_slave - 1]), Surface(segments[n_slave:]))

    @classmethod
    def of_parts(cls, nodes: FloatArray, slave: Surface, master: Surface) -> Interface:
        """Return the interface of read-only parts of which somebody else has checked that they belong together."""
        interface = object.__new__(cls)
        for name, part in (("nodes", nodes), ("slave", slave), ("master", master)):
            object.__setattr__(interface, name, part)
        return interface

    @property
    def dim(self) -> int:
        """The number of coordinates of a node: 2."""
        return int(self.nodes.shape[1])

    @property
    def n_nodes(self) -> int:
        """The number of nodes of both sides."""
        return int(self.nodes.shape[0])

    @property
    def n_slave_nodes(self) -> int:
        """The number of slave nodes, which are the first nodes."""
        return len(self.slave.nodes)

    @property
    def n_unknowns(self) -> int:
        """The number of position unknowns: n_nodes × dim."""
        return self.nodes.size

    def swap_roles(self) -> Interface:
        """Return the interface with the roles of slave and master exchanged; nodes are renumbered, slave first."""
        n_slave = self.n_slave_nodes
        n_master = self.n_nodes - n_slave
        return Interface(
            np.vstack([self.nodes[n_slave:], self.nodes[:n_slave]]),
            Surface(self.master.segments - n_slave),
            Surface(self.slave.segments + n_master),
        )

    def at(self, nodes: ArrayLike) -> Interface:
        """Return the interface with the same segments on other reference positions, shape (n_nodes, dim)."""
        return Interface(as_array("nodes", nodes), self.slave, self.master)


def _link(data: bytes) -> list[IntArray]:
    """Check the segments (n_segments, 2) whose bytes are given; return neighbours, chain order and starts, nodes."""
    segments = np.frombuffer(data, np.int64).reshape(-1, 2)
    _check_chains(segments)
    nodes, ends = np.unique(segments, return_inverse=True)
    first, second = ends.reshape(segments.shape).T  # Node numbers without gaps.
    starting, ending = (np.full(len(nodes), -1) for _ in range(2))
    starting[first] = ending[second] = np.arange(len(segments))
    neighbours = np.column_stack([ending[first], starting[second]])  # −1 at a free end.
    order = _chain_order(neighbours)
    starts = np.flatnonzero(np.append(True, neighbours[order[:-1], 1] != order[1:]))
    return [freeze(array, np.int64) for array in (neighbours, order, starts, nodes)]


_SMALL = 128  # Number of node numbers of a surface that is remembered: random meshes share few ways to hang together.
_link_small = lru_cache(maxsize=1024)(_link)


def _check_chains(segments: IntArray) -> None:
    """Check that node numbers and connections are those of chains."""
    if segments.min() < 0:
        raise MisuseError("segments", f"node number {segments.min()}", "node numbers ≥ 0")
    loops = np.flatnonzero(segments[:, 0] == segments[:, 1])
    if len(loops):
        segment = loops[0]
        node = segments[segment, 0]
        raise MisuseError("segments", f"segment {segment} that begins and ends at node {node}", "two nodes")
    for end, verb in ((0, "begin"), (1, "end")):
        numbers = np.sort(segments[:, end])
        if (numbers[1:] == numbers[:-1]).any():
            numbers, counts = np.unique(numbers, return_counts=True)
            node = numbers[np.argmax(counts)]
            meeting = ", ".join(map(str, np.flatnonzero(segments[:, end] == node)[:4]))
            raise MisuseError(
                "segments",
                f"segments {meeting} that all {verb} at node {node}",
                "chains: a node begins at most one segment and ends at most one (body on the left throughout)",
            )


def _chain_order(neighbours: IntArray) -> IntArray:
    """Return open chains first, each from its free end; then closed chains, each from its lowest segment."""
    numbers = np.arange(len(neighbours))
    if ((neighbours[:, 1] == numbers + 1) | (neighbours[:, 1] < 0)).all():
        return numbers  # Open chains, numbered as they run.
    following = neighbours[:, 1].tolist()
    visited = [False] * len(following)
    order = []
    for start in [*np.flatnonzero(neighbours[:, 0] < 0).tolist(), *range(len(following))]:
        segment = start
        while segment >= 0 and not visited[segment]:
            visited[segment] = True
            order.append(segment)
            segment = following[segment]
    return np.array(order, dtype=np.int64)


def _check_nodes(values: ArrayLike) -> FloatArray:
    """Return reference positions (n_nodes, 2), checked and read-only."""
    raw = as_array("nodes", values)
    if raw.ndim != 2 or raw.shape[1] != 2:
        raise MisuseError("nodes", f"an array of shape {raw.shape}", "shape (n_nodes, 2)")
    if raw.dtype.kind not in "fiu":
        raise MisuseError("nodes", f"dtype {raw.dtype}", "real numbers")
    nodes = freeze(raw, np.float64)
    if not np.isfinite(nodes).all():
        bad = np.flatnonzero(~np.isfinite(nodes).all(axis=1))[0]
        raise MisuseError("nodes", f"node {bad} at {tuple(nodes[bad].tolist())}", "finite coordinates")
    return nodes


def _check_positions(name: str, surface: Surface, nodes: FloatArray) -> None:
    """Check that the segments of a surface have a length and its nodes a place of their own."""
    used = surface.nodes
    if len(set(map(tuple, nodes[used].tolist()))) == len(used):
        return
    ends = nodes[surface.segments]
    zero = np.flatnonzero((ends[:, 0] == ends[:, 1]).all(axis=1))
    if len(zero):
        raise MisuseError(name, f"segment {zero[0]} of zero length", "two different end positions")
    _, first, counts = np.unique(nodes[used], axis=0, return_index=True, return_counts=True)
    place = nodes[used[first[np.argmax(counts)]]]
    twins = used[(nodes[used] == place).all(axis=1)]
    raise MisuseError(
        name,
        f"coincident nodes {_abbreviate(twins)} at {tuple(place.tolist())}",
        "one node a place on each surface (merge them, or move one)",
    )


def _abbreviate(numbers: IntArray) -> str:
    listed = ", ".join(map(str, numbers[:5].tolist()))
    return listed + (", …" if len(numbers) > 5 else "")
