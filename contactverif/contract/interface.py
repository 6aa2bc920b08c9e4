"""The two facing meshes of a contact problem: how segments or faces hang together, and where their nodes are.

Whatever can be wrong with a mesh is found here, in the constructors, once; nobody checks it again. `Surface` knows how
faces hang together and nothing of positions; `Interface` adds the reference positions. A segment of a plane interface
is a face of two corners.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactverif.contract.arrays import Array, FloatArray, IntArray, as_array, freeze
from contactverif.contract.errors import MisuseError

SEGMENT, TRIANGLE, QUADRILATERAL = 2, 3, 4  # Numbers of corners.
PLANE, SPACE = 2, 3  # Numbers of coordinates.


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """One side of the interface: chains of straight segments in the plane, or triangles or quadrilaterals in space.

    On the way from the first to the second node of a segment the body is on the left and the other surface on the
    right. A surface of segments consists of any number of chains, open or closed, and a node belongs to at most two
    segments. The corners of a triangle or quadrilateral run counter-clockwise, seen from outside the body. All faces of
    a surface are of one kind.

    Attributes
    ----------
    faces : IntArray, shape (n_faces, n_corners)
        The numbers of the corners of each face, in any order of the faces: 2 corners are a segment, 3 a triangle, 4 a
        quadrilateral. This is the only argument of the constructor; the other attributes follow from it.
    neighbours : IntArray, shape (n_faces, n_corners)
        The number of the face across each edge, of which edge i runs from corner i to the next one, −1 at the border.
        Of segments, those of the previous and the next segment of the chain, −1 at a free end.
    chain_order : IntArray, shape (n_segments,)
        The numbers of the segments in the order of a walk along the chains: open chains from their free ends, then
        closed chains. Empty in space.
    chain_starts : IntArray, shape (n_chains,)
        The places in `chain_order` at which the chains begin.
    nodes : IntArray, shape (n_nodes,)
        The numbers of the nodes of this surface, ascending.

    Raises
    ------
    MisuseError
        If the segments form no chains: two of them begin at one node, two end at one node, or one begins and ends at
        the same node. In space, if an edge belongs to three faces, or two neighbours turn against each other.

    Examples
    --------
    >>> from contactverif import Surface
    >>> surface = Surface([[0, 1], [1, 2]])
    >>> surface.neighbours.tolist()
    [[-1, 1], [0, -1]]

    Two triangles in space, which have the edge between the nodes 1 and 2 in common:

    >>> Surface([[0, 1, 2], [2, 1, 3]]).neighbours.tolist()
    [[-1, 1, -1], [0, -1, -1]]
    """

    faces: IntArray
    neighbours: IntArray = field(init=False)
    chain_order: IntArray = field(init=False)
    chain_starts: IntArray = field(init=False)
    nodes: IntArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        raw = as_array("segments", self.faces)
        if raw.ndim != 2 or raw.shape[1] not in (SEGMENT, TRIANGLE, QUADRILATERAL) or len(raw) == 0:
            needed = "shape (n_segments, 2), n_segments ≥ 1, or in space (n_faces, 3 or 4)"
            raise MisuseError("segments", f"an array of shape {raw.shape}", needed)
        if not np.issubdtype(raw.dtype, np.integer):
            raise MisuseError("segments", f"dtype {raw.dtype}", "integer node numbers")
        faces = freeze(raw, np.int64)
        link = _link_small if faces.size <= _SMALL else _link
        object.__setattr__(self, "faces", faces)
        names = ("neighbours", "chain_order", "chain_starts", "nodes")
        for name, array in zip(names, link(faces.tobytes(), faces.shape[1]), strict=True):
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.faces)

    @property
    def segments(self) -> IntArray:
        """The faces (n_segments, 2) of a surface in the plane; one in space raises a MisuseError."""
        if self.faces.shape[1] != SEGMENT:
            raise MisuseError("segments", f"faces of {self.faces.shape[1]} corners", "`faces` of a surface in space")
        return self.faces

    def lengths(self, nodes: FloatArray) -> FloatArray:
        """Return the lengths (n_segments,) at reference or current positions (n_nodes, dim)."""
        ends = nodes[self.segments]  # (n_segments, 2, dim)
        along = ends[:, 1] - ends[:, 0]
        lengths: FloatArray = np.sqrt((along * along).sum(axis=-1))
        return lengths

    def measures(self, nodes: FloatArray) -> FloatArray:
        """Return the lengths of segments, or the areas of faces (n_faces,); a quadrilateral is bilinear."""
        if self.faces.shape[1] == SEGMENT:
            return self.lengths(nodes)
        corners = nodes[self.faces]
        if self.faces.shape[1] == TRIANGLE:
            triangles: FloatArray = np.linalg.norm(turns_of(corners)[:, 0], axis=1) / 2
            return triangles
        # Where the face is flat, its Jacobian is linear in either coordinate, and the rule is exact. Else it is smooth.
        points, weights = np.polynomial.legendre.leggauss(4)
        corners = corners - corners[:, :1]  # Far from the origin, shares of positions would round the area away.
        areas = np.zeros(len(corners))
        for s, weight_s in zip(points, weights, strict=True):
            for t, weight_t in zip(points, weights, strict=True):
                along_s = np.array([t - 1, 1 - t, 1 + t, -1 - t]) / 4
                along_t = np.array([s - 1, -1 - s, 1 + s, 1 - s]) / 4
                tangents = [np.einsum("a,fai->fi", shares, corners) for shares in (along_s, along_t)]
                areas += weight_s * weight_t * np.linalg.norm(np.cross(*tangents), axis=1)
        return areas

    def heights(self, nodes: FloatArray) -> FloatArray:
        """Return the lengths of segments, or for each face the least distance of a corner from an edge (n_faces,)."""
        return self.lengths(nodes) if self.faces.shape[1] == SEGMENT else measure_heights(nodes[self.faces])


@dataclass(frozen=True, slots=True, eq=False)
class Interface:
    """The two surfaces that may touch, slave and master, in their reference configuration.

    The meshes need not match. Both surfaces have their body on the left, so they run in opposite directions where they
    face each other: with the slave body on top, the slave runs in +x and the master in −x.

    Attributes
    ----------
    nodes : FloatArray, shape (n_nodes, 2 or 3)
        The reference positions of all nodes, a length each: slave nodes first, then master nodes. Surfaces of segments
        lie in the plane, others in space.
    slave, master : Surface
        The two surfaces. Slave nodes have the numbers 0 … n_slave_nodes − 1, master nodes all numbers behind them; each
        node belongs to exactly one surface.

    Raises
    ------
    MisuseError
        If a coordinate is NaN or infinite, a segment has no length, two nodes of one surface lie in one place, a node
        belongs to both surfaces or to none, or the slave nodes are not the first. In space, if a face has no area, or a
        quadrilateral is not convex.

    See Also
    --------
    Interface.from_chains : Make an interface from the points of one open chain a side.
    Interface.from_faces : Make an interface from points and faces in space.

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
        sides = {"slave": self.slave, "master": self.master}
        for name, surface in sides.items():
            if not isinstance(surface, Surface):
                raise MisuseError(name, f"a {type(surface).__name__}", "a Surface")
        raw = as_array("nodes", self.nodes)
        if raw.ndim != 2 or raw.shape[1] not in (PLANE, SPACE):
            needed = "shape (n_nodes, 2), or (n_nodes, 3) in space"
            raise MisuseError("nodes", f"an array of shape {raw.shape}", needed)
        if raw.dtype.kind not in "fiu":
            raise MisuseError("nodes", f"dtype {raw.dtype}", "real numbers")
        nodes = freeze(raw, np.float64)
        if not np.isfinite(nodes).all():
            bad = np.flatnonzero(~np.isfinite(nodes).all(axis=1))[0]
            raise MisuseError("nodes", f"node {bad} at {tuple(nodes[bad].tolist())}", "finite coordinates")
        for name, surface in sides.items():
            if (surface.faces.shape[1] == SEGMENT) != (nodes.shape[1] == PLANE):
                corners = f"faces of {surface.faces.shape[1]} corners and nodes with {nodes.shape[1]} coordinates"
                raise MisuseError(name, corners, "segments in the plane, triangles or quadrilaterals in space")
        object.__setattr__(self, "nodes", nodes)
        of_slave, of_master = self.slave.nodes, self.master.nodes
        n_slave = len(of_slave)
        if of_slave[-1] != n_slave - 1:  # The numbers of a surface are different, ascending and ≥ 0.
            needed = f"the first node numbers, 0 … {n_slave - 1}, each used"
            raise MisuseError("slave", f"nodes {_abbreviate(of_slave)}", needed)
        if of_master[0] != n_slave or not n_slave + len(of_master) == len(nodes) == of_master[-1] + 1:
            needed = f"all node numbers behind the slave's, {n_slave} … {len(nodes) - 1}, each used"
            raise MisuseError("master", f"nodes {_abbreviate(of_master)}", needed)
        for name, surface in sides.items():
            _check_positions(name, surface, nodes)

    @classmethod
    def from_chains(cls, slave: ArrayLike, master: ArrayLike) -> Interface:
        """Return the interface with one open chain a side; its nodes are numbered in walking order, slave first.

        Parameters
        ----------
        slave, master : ArrayLike, shape (n_points, 2)
            The points of each chain in walking order, with the body on the left; at least two.
        """
        points = _as_points({"slave": slave, "master": master}, PLANE, 2, "shape (n ≥ 2, 2), the points of a chain")
        n_slave, numbers = len(points[0]), np.arange(sum(map(len, points)))
        segments = np.column_stack([numbers[:-1], numbers[1:]])
        return cls(np.vstack(points), Surface(segments[: n_slave - 1]), Surface(segments[n_slave:]))

    @classmethod
    def from_faces(
        cls, slave: ArrayLike, slave_faces: ArrayLike, master: ArrayLike, master_faces: ArrayLike
    ) -> Interface:
        """Return the interface of two surfaces in space, each with node numbers of its own.

        Parameters
        ----------
        slave : ArrayLike, shape (n_points, 3)
            The points of the slave.
        slave_faces : ArrayLike, shape (n_faces, 3 or 4)
            The corners of each face, numbered from 0, counter-clockwise seen from outside the body.
        master : ArrayLike, shape (n_points, 3)
            The points of the master.
        master_faces : ArrayLike, shape (n_faces, 3 or 4)
            Its faces, likewise, with node numbers of their own.

        Examples
        --------
        A triangle over a larger one:

        >>> from contactverif import Interface
        >>> upper, lower = [[0, 0, 0], [0, 1, 0], [1, 0, 0]], [[-1, -1, 0], [3, -1, 0], [-1, 3, 0]]
        >>> interface = Interface.from_faces(upper, [[0, 1, 2]], lower, [[0, 1, 2]])
        >>> interface.dim, interface.master.faces.tolist(), interface.slave.measures(interface.nodes).tolist()
        (3, [[3, 4, 5]], [0.5])
        """
        points = _as_points({"slave": slave, "master": master}, SPACE, 0, "shape (n_points, 3)")
        corners = as_array("master_faces", master_faces)
        return cls(np.vstack(points), Surface(as_array("slave_faces", slave_faces)), Surface(corners + len(points[0])))

    @classmethod
    def of_parts(cls, nodes: FloatArray, slave: Surface, master: Surface) -> Interface:
        """Return the interface of read-only parts of which somebody else has checked that they belong together."""
        interface = object.__new__(cls)
        for name, part in (("nodes", nodes), ("slave", slave), ("master", master)):
            object.__setattr__(interface, name, part)
        return interface

    @property
    def dim(self) -> int:
        """The number of coordinates of a node: 2 in the plane, 3 in space."""
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
        slave, master = Surface(self.master.faces - n_slave), Surface(self.slave.faces + self.n_nodes - n_slave)
        return Interface(np.vstack([self.nodes[n_slave:], self.nodes[:n_slave]]), slave, master)

    def at(self, nodes: ArrayLike) -> Interface:
        """Return the interface with the same faces on other reference positions, shape (n_nodes, dim)."""
        return Interface(as_array("nodes", nodes), self.slave, self.master)


def _link(data: bytes, n_corners: int) -> list[IntArray]:
    """Check the faces (n_faces, n_corners) whose bytes are given; return neighbours, chain order and starts, nodes."""
    faces = np.frombuffer(data, np.int64).reshape(-1, n_corners)
    if n_corners == SEGMENT:
        _check_chains(faces)
        nodes, ends = np.unique(faces, return_inverse=True)
        first, second = ends.reshape(faces.shape).T  # Node numbers without gaps.
        starting, ending = (np.full(len(nodes), -1) for _ in range(2))
        starting[first] = ending[second] = np.arange(len(faces))
        neighbours = np.column_stack([ending[first], starting[second]])  # −1 at a free end.
        order = _chain_order(neighbours)
        starts = np.flatnonzero(np.append(True, neighbours[order[:-1], 1] != order[1:]))
        arrays = [neighbours, order, starts, nodes]
    else:
        none = np.zeros(0, np.int64)
        arrays = [_link_faces(faces), none, none, np.unique(faces)]
    return [freeze(array, np.int64) for array in arrays]


_SMALL = 128  # Number of node numbers of a surface that is remembered: random meshes share few ways to hang together.
_link_small = lru_cache(maxsize=1024)(_link)


def _link_faces(faces: IntArray) -> IntArray:
    """Check faces (n_faces, n_corners) in space, and return the face across each edge, −1 at the border."""
    n_corners = faces.shape[1]
    if faces.min() < 0:
        raise MisuseError("faces", f"node number {faces.min()}", "node numbers ≥ 0")
    twice = np.flatnonzero((np.diff(np.sort(faces, axis=1), axis=1) == 0).any(axis=1))
    if len(twice):
        corners = faces[twice[0]].tolist()
        raise MisuseError("faces", f"face {twice[0]} with the corners {corners}", "different corners")
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)  # (n_faces · n_corners, 2)
    keys, number, counts = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    number = number.reshape(-1)
    crowded = np.flatnonzero(counts > 2)
    if len(crowded):
        owners = np.flatnonzero(number == crowded[0]) // n_corners
        those = f"faces {', '.join(map(str, owners[:4]))} on the edge {keys[crowded[0]].tolist()}"
        raise MisuseError("faces", those, "a surface: at most two faces on an edge")
    order = np.argsort(number, kind="stable")
    matched = np.flatnonzero(number[order[1:]] == number[order[:-1]])
    first, second = order[matched], order[matched + 1]  # Both edges between the same two nodes.
    alike = np.flatnonzero((edges[first] == edges[second]).all(axis=1))
    if len(alike):
        numbers = " and ".join(str(int(owners[alike[0]]) // n_corners) for owners in (first, second))
        pair = f"faces {numbers}, which both run along the edge {edges[first[alike[0]]].tolist()}"
        raise MisuseError("faces", pair, "corners counter-clockwise seen from outside the body, throughout")
    neighbours = np.full(faces.size, -1)
    neighbours[first], neighbours[second] = second // n_corners, first // n_corners
    return neighbours.reshape(faces.shape)


def _check_chains(segments: IntArray) -> None:
    if segments.min() < 0:
        raise MisuseError("segments", f"node number {segments.min()}", "node numbers ≥ 0")
    loops = np.flatnonzero(segments[:, 0] == segments[:, 1])
    if len(loops):
        loop = f"segment {loops[0]} that begins and ends at node {segments[loops[0], 0]}"
        raise MisuseError("segments", loop, "two nodes")
    for end, verb in ((0, "begin"), (1, "end")):
        numbers, counts = np.unique(segments[:, end], return_counts=True)
        if counts.max() > 1:
            node = numbers[np.argmax(counts)]
            meeting = ", ".join(map(str, np.flatnonzero(segments[:, end] == node)[:4]))
            needed = "chains: a node begins at most one segment and ends at most one (body on the left throughout)"
            raise MisuseError("segments", f"segments {meeting} that all {verb} at node {node}", needed)


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


def _check_positions(name: str, surface: Surface, nodes: FloatArray) -> None:
    """Check that the segments of a surface have a length, or its faces an area, and its nodes a place of their own."""
    used, corners = surface.nodes, nodes[surface.faces]
    if surface.faces.shape[1] != SEGMENT:
        turns = turns_of(corners)
        normals = turns.sum(axis=1)
        flat = np.flatnonzero(~normals.any(axis=1))
        if len(flat):
            raise MisuseError(name, f"face {flat[0]} of no area", "corners that do not lie on one line")
        dented = np.flatnonzero((np.einsum("fci,fi->fc", turns, normals) <= 0).any(axis=1))
        if len(dented):
            dent = f"face {dented[0]}, a quadrilateral that is not convex"
            raise MisuseError(name, dent, "four corners that point outwards")
    if len(set(map(tuple, nodes[used].tolist()))) == len(used):
        return
    zero = np.flatnonzero((corners[:, 0] == corners[:, 1]).all(axis=1))
    if len(zero):
        raise MisuseError(name, f"segment {zero[0]} of zero length", "two different end positions")
    _, first, counts = np.unique(nodes[used], axis=0, return_index=True, return_counts=True)
    place = nodes[used[first[np.argmax(counts)]]]
    twins = f"coincident nodes {_abbreviate(used[(nodes[used] == place).all(axis=1)])} at {tuple(place.tolist())}"
    raise MisuseError(name, twins, "one node a place on each surface (merge them, or move one)")


def _abbreviate(numbers: IntArray) -> str:
    return ", ".join(map(str, numbers[:5].tolist())) + (", …" if len(numbers) > 5 else "")


def _as_points(sides: Mapping[str, ArrayLike], dim: int, least: int, needed: str) -> list[NDArray[Any]]:
    arrays = {name: as_array(name, values) for name, values in sides.items()}
    for name, points in arrays.items():
        if points.ndim != 2 or points.shape[1] != dim or len(points) < least:
            raise MisuseError(name, f"an array of shape {points.shape}", needed)
    return [*arrays.values()]


def measure_heights(corners: FloatArray) -> FloatArray:
    """Return the least distance (n_faces,) of a corner from an edge of its face that does not end there."""
    n_corners = corners.shape[1]
    heights = np.full(len(corners), np.inf)
    for edge in range(n_corners):
        start, run = corners[:, edge], corners[:, (edge + 1) % n_corners] - corners[:, edge]
        for corner in range(n_corners):
            if corner not in (edge, (edge + 1) % n_corners):
                across = np.cross(run, corners[:, corner] - start)
                heights = np.minimum(heights, np.linalg.norm(across, axis=1) / np.linalg.norm(run, axis=1))
    return heights


def turns_of(corners: FloatArray) -> FloatArray:
    """Return the cross products (n_faces, n_corners, 3) of the edge after each corner and the one before, reversed."""
    following, before = np.roll(corners, -1, axis=1), np.roll(corners, 1, axis=1)
    turns: FloatArray = np.cross(following - corners, before - corners)
    return turns


def unit_normals(faces: FloatArray) -> FloatArray:
    """Return the unit normals (n, dim) of faces (n, n_corners, dim) out of their body; zero for a face without area."""
    if faces.shape[2] == PLANE:
        normals = (faces[:, 1] - faces[:, 0])[:, ::-1] * [1.0, -1.0]
    else:  # The cross product of the diagonals is twice the vector area; a triangle has an edge for one of them.
        normals = np.cross(faces[:, 2] - faces[:, 0], faces[:, -1] - faces[:, 1])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    units: FloatArray = normals / np.where(lengths > 0, lengths, 1.0)
    return units


def split_states(interface: Interface, z: Array) -> tuple[Array, Array]:
    """Return contiguous copies of the positions (n_states, n_nodes, dim) and the multipliers (n_states, n_multipliers).

    The states z (..., n_unknowns + n_multipliers) are real or complex; their leading axes become one.
    """
    states = z.reshape(-1, z.shape[-1])
    n_unknowns = interface.n_unknowns
    positions = np.array(states[:, :n_unknowns]).reshape(len(states), *interface.nodes.shape)
    return positions, np.array(states[:, n_unknowns:])


def split_state(interface: Interface, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return copies of the positions (n_nodes, dim) and the multipliers of one state (n_unknowns + n_multipliers,)."""
    n_unknowns = interface.n_unknowns
    return np.array(z[:n_unknowns]).reshape(interface.nodes.shape), np.array(z[n_unknowns:])


def join_rows(forces: Array, constraints: Array, z: Array) -> Array:
    """Join forces (n_states, n_nodes, dim) and constraint rows (n_states, n_multipliers) to a residual of z's shape."""
    if not constraints.size:
        return forces.reshape(z.shape)
    return np.concatenate([forces.reshape(len(forces), -1), constraints], axis=1).reshape(z.shape)


STEEPEST_FACING = 0.5  # The cosine of 60°: two surfaces whose normals differ more from opposite ones do not face.
# The normals of a half disk have a mean of 0.64, of half a sphere 0.5; those of a ring or a sphere have none.
ONE_SIDED = 0.5


def ways_to_master(interface: Interface) -> tuple[FloatArray, FloatArray]:
    """Return how far each slave node (n_slave_nodes,) is from the master, and the unit vector (n, dim) along which.

    Nodes look along the mean normal of the slave; around a ring each looks along its own. The way is a length, negative
    where the node is inside the master, and infinite where the node does not see the master.
    """
    surface, nodes, n_slave = interface.slave, interface.nodes, interface.n_slave_nodes
    mean, directions = mean_normal(surface, nodes), np.zeros((n_slave, interface.dim))
    if np.linalg.norm(mean) > ONE_SIDED:
        directions[:] = mean / np.linalg.norm(mean)
    else:
        normals = surface.measures(nodes)[:, None] * unit_normals(nodes[surface.faces])
        for corner in surface.faces.T:
            np.add.at(directions, corner, normals)
        lengths = np.linalg.norm(directions, axis=1)[:, None]
        directions /= np.where(lengths > 0, lengths, 1.0)
    pairs = zip(nodes[:n_slave], directions, strict=True)
    return np.array([_way_along(interface, point, direction) for point, direction in pairs]), directions


def mean_normal(surface: Surface, nodes: FloatArray) -> FloatArray:
    """Return the mean normal (dim,) out of the body, weighted by size: shorter than 1 where the surface is bent."""
    sizes = surface.measures(nodes)
    normal: FloatArray = sizes @ unit_normals(nodes[surface.faces]) / sizes.sum()
    return normal


def _way_along(interface: Interface, point: FloatArray, direction: FloatArray) -> float:
    """Return the shortest way, forwards or backwards, from a point (dim,) to a master segment or face that faces it."""
    if interface.dim != PLANE:
        return _way_to_faces(interface.nodes[interface.master.faces], point, direction)
    first, second = np.moveaxis(interface.nodes[interface.master.segments], 1, 0)
    along, apart = second - first, first - point
    facing = direction[0] * along[:, 1] - direction[1] * along[:, 0]  # −|along| where the normals oppose each other.
    facing = np.where(facing < -STEEPEST_FACING * np.hypot(*along.T), facing, np.nan)
    place = (direction[1] * apart[:, 0] - direction[0] * apart[:, 1]) / facing
    ways = (along[:, 1] * apart[:, 0] - along[:, 0] * apart[:, 1]) / facing
    ways = ways[(place >= 0) & (place <= 1)]
    return float(ways[np.argmin(np.abs(ways))]) if len(ways) else np.inf


def _way_to_faces(faces: FloatArray, point: FloatArray, direction: FloatArray) -> float:
    """Return the shortest way from a point to faces (n_faces, n_corners, 3), quadrilaterals as two triangles each."""
    parts = [faces[:, [0, corner, corner + 1]] for corner in range(1, faces.shape[1] - 1)]
    first, second, third = (corner - point for corner in np.moveaxis(np.concatenate(parts), 1, 0))
    normals = np.cross(second - first, third - first)
    facing, sizes = normals @ direction, np.linalg.norm(normals, axis=1)
    facing = np.where(facing < -STEEPEST_FACING * sizes, facing, np.nan)
    pairs = (first, second), (second, third), (third, first)
    shares = np.array([np.cross(*pair) @ direction for pair in pairs]) / facing
    ways = ((first * normals).sum(axis=1) / facing)[(shares >= -_EDGE).all(axis=0)]
    return float(ways[np.argmin(np.abs(ways))]) if len(ways) else np.inf


_EDGE = 1e-9  # A node on an edge is seen, whatever rounding says.
_AT_ONCE = 256  # Points that are compared with all master faces at once, so that memory stays small.
_TIED = 1 + 1e-9  # Faces are equally near if distances differ by less: far more than rounding, far less than a mesh.


def find_depth(interface: Interface, positions: FloatArray) -> float:
    """Return how far a corner or middle of a slave face lies behind the master at most, in positions (n_nodes, dim).

    It counts over the master's shortest segment or edge in the reference. It is the longer of two ways to the plane of
    the nearest face: along its normal, and along that of the slave's face if both are turned to each other. So it is no
    less than any rule for gaps finds on a straight or plane slave. A point past the border counts too.
    """
    faces, reference = positions[interface.master.faces], interface.nodes[interface.master.faces]
    slave = positions[interface.slave.faces]
    points = np.concatenate([slave, slave.mean(axis=1, keepdims=True)], axis=1)
    normals = np.repeat(unit_normals(slave), points.shape[1], axis=0)
    points = points.reshape(-1, interface.dim)
    parts = (slice(first, first + _AT_ONCE) for first in range(0, len(points), _AT_ONCE))
    depth = max(_largest_depth(points[part], normals[part], faces) for part in parts)
    return depth / float(np.linalg.norm(np.roll(reference, -1, axis=1) - reference, axis=2).min())


def _largest_depth(points: FloatArray, slave_normals: FloatArray, faces: FloatArray) -> float:
    normals, in_space = unit_normals(faces), faces.shape[2] != PLANE
    heights = np.einsum("pmi,mi->pm", points[:, None] - faces[:, 0], normals)
    distances, inside = np.full(heights.shape, np.inf), np.full(heights.shape, in_space)
    for corner, run in enumerate(np.swapaxes(np.roll(faces, -1, axis=1) - faces, 0, 1)):
        way = points[:, None] - faces[:, corner]
        share = np.clip(np.einsum("pmi,mi->pm", way, run) / (run**2).sum(axis=1), 0.0, 1.0)
        distances = np.minimum(distances, np.linalg.norm(way - share[..., None] * run, axis=2))
        if in_space:
            inside &= np.einsum("pmi,mi->pm", way, np.cross(normals, run)) >= 0
    distances = np.where(inside, np.abs(heights), distances)
    # Of faces that are equally near, the one counts past whose edge the point lies least.
    near = distances <= _TIED * distances.min(axis=1, keepdims=True)
    face, point = np.where(near, np.abs(heights), -1.0).argmax(axis=1), np.arange(len(points))
    facing = -np.einsum("pi,pi->p", slave_normals, normals[face])
    return float(np.max(-heights[point, face] / np.where(facing > 0, facing, 1.0), initial=0.0))
