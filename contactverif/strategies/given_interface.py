"""Random states of an interface that the user gives, in 2-D or 3-D: their mesh, our displacements."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import (
    ONE_SIDED,
    PLANE,
    STEEPEST_FACING,
    TRIANGLE,
    Interface,
    Surface,
    turns_of,
    ways_to_master,
)
from contactverif.oracle.flat_answers import chain_ends
from contactverif.strategies.samples import OFFSETS, PENALTIES, SEEDS, depth_units, depths, repeat_cyclically, shifts

# A slave segment or face that is bent onto the master keeps this share of its size, seen along itself or its normal.
LEAST_SHARE = 0.25
_QUARTERS = st.integers(1, 8)
_ON = st.integers(0, 7)  # 0 is no offset
_MODES = st.lists(st.integers(-8, 8), min_size=1, max_size=6)  # amplitudes of waves, in eighths


def flat_cases(interface: Interface) -> SearchStrategy[Case] | None:
    """Return states whose slave is moved along the normal into a uniform penetration.

    The penetration is 2^-10 to 2^-1 of the shortest segment. The result is None unless both surfaces are straight and
    parallel up to 64 u X, face each other, and each slave chain lies over one master chain.
    """
    nodes, n_slave = interface.nodes, interface.n_slave_nodes
    direction = slave_direction(interface)
    if direction is None:
        return None
    normal = np.array([-direction[1], direction[0]])  # out of the master
    roundoff = 64 * UNIT_ROUNDOFF * float(np.abs(nodes).max())
    heights, along = nodes @ normal, nodes @ direction
    if max(np.ptp(heights[:n_slave]), np.ptp(heights[n_slave:])) > roundoff:
        return None
    for surface, way in ((interface.slave, 1), (interface.master, -1)):
        if not (way * np.diff(along[surface.segments], axis=1) > roundoff).all():
            return None
    slave, master = (
        [sorted(along[list(ends)]) for ends in chain_ends(side)] for side in (interface.slave, interface.master)
    )
    for low, high in slave:
        if not any(low >= first - roundoff and high <= last + roundoff for first, last in master):
            return None
    return _flat_states(interface, along, direction, normal, float(heights[:n_slave].mean() - heights[n_slave:].mean()))


def slave_direction(interface: Interface) -> FloatArray | None:
    """Return the unit vector (2,) from the slave's first to its last nodes; None if its chains are closed."""
    ends = interface.nodes[interface.slave.segments]
    chord = (ends[:, 1] - ends[:, 0]).sum(axis=0)
    direction: FloatArray = chord / (np.hypot(*chord) or 1.0)
    return direction if chord.any() else None


@st.composite
def _flat_states(
    draw: DrawFn, interface: Interface, along: FloatArray, direction: FloatArray, normal: FloatArray, opening: float
) -> Case:
    quarters, unit = draw(_QUARTERS), draw(depth_units(finest=6))
    penalty, seed = draw(PENALTIES), draw(SEEDS)
    penetration = quarters / 16 * unit * least_height(interface, interface.nodes)
    positions = interface.nodes.copy()
    positions[: interface.n_slave_nodes] -= (opening + penetration) * normal
    parameters = {"penetration": np.array(penetration), "along": along, "direction": direction}
    return Case(interface, positions.reshape(-1), penalty, parameters, seed)


def states(interface: Interface, smooth: bool) -> SearchStrategy[Case]:
    """Return random states of the interface.

    The slave is bent onto the master, so that most of its nodes touch whatever the gap of the mesh is. Then all nodes
    move in waves, the slave is pushed as a whole until its deepest node penetrates, and a coprime offset is added.
    """
    return _states(interface, _bend_slave(interface, *ways_to_master(interface)), smooth)


@st.composite
def _states(draw: DrawFn, interface: Interface, closed: FloatArray, smooth: bool) -> Case:
    quarters, unit = draw(depths()), draw(depth_units())
    slave_waves, master_waves = draw(_MODES), draw(_MODES)
    penalty, seed = draw(PENALTIES), draw(SEEDS)
    offsets = draw(OFFSETS) if smooth or draw(_ON) > 0 else [0]
    n_slave, shortest = interface.n_slave_nodes, least_height(interface, interface.nodes)
    depth = quarters[0] / 4 * unit * shortest
    positions = closed.copy()
    for waves, part in ((slave_waves, slice(0, n_slave)), (master_waves, slice(n_slave, None))):
        positions[part] += depth / 4 * _waves(interface.nodes[part], waves)
    positions[:n_slave] += shifts(offsets, n_slave) / 2 * min(depth, shortest)
    # The slave is pushed until its deepest node penetrates. A node past the ends of the segment nearest to it counts
    # only where none stands over one.
    gaps, normals, over = _look(interface, positions, positions[:n_slave])
    deepest = np.argmin(gaps + np.where(over, 0.0, interface.master.lengths(positions).sum()))
    positions[:n_slave] += -(gaps[deepest] + depth) * normals[deepest]
    return Case(interface, positions.reshape(-1), penalty, {}, seed)


def least_height(interface: Interface, nodes: FloatArray) -> float:
    """Return the length of the shortest segment, or the least height of a face, of both surfaces."""
    return float(min(side.heights(nodes).min() for side in (interface.slave, interface.master)))


def _waves(nodes: FloatArray, amplitudes: list[int]) -> FloatArray:
    """Return displacements (n, 2): Σ a_k/8 cos(k π s + k) along the longer side of the box, alternating components."""
    box = np.ptp(nodes, axis=0)
    axis = int(np.argmax(box))
    place = (nodes[:, axis] - nodes[:, axis].min()) / box[axis]
    displacement = np.zeros_like(nodes)
    for k, amplitude in enumerate(amplitudes):
        displacement[:, (k + 1 + axis) % 2] += amplitude / 8 * np.cos(k * np.pi * place + k)
    return displacement


def _bend_slave(interface: Interface, ways: FloatArray, directions: FloatArray) -> FloatArray:
    """Return positions (n_nodes, dim) in which each slave node that has a way (n_slave,) to the master lies on it.

    Any other slave node moves as the nearest node that has one. Where this would shrink a segment or face to less than
    `LEAST_SHARE` of its size, or turn it too far, the slave stays as it is.
    """
    nodes, n_slave, in_plane = interface.nodes, interface.n_slave_nodes, interface.dim == PLANE
    facing, closed = np.flatnonzero(np.isfinite(ways)), nodes.copy()
    if len(facing):
        arms = (nodes[facing] - node for node in nodes[:n_slave])
        distances = (np.hypot(*arm.T) if in_plane else np.sqrt((arm**2).sum(axis=1)) for arm in arms)
        nearest = [facing[distance.argmin()] for distance in distances]
        closed[:n_slave] += ways[nearest, None] * directions[nearest]
    before, after = (
        (corners[:, 1] - corners[:, 0] if in_plane else turns_of(corners).sum(axis=1))
        for corners in (nodes[interface.slave.faces], closed[interface.slave.faces])
    )  # The vector of each segment, or the normal of each face.
    kept = np.einsum("ij,ij->i", before, after) >= LEAST_SHARE * np.einsum("ij,ij->i", before, before)
    return closed if kept.all() else nodes.copy()


def touches(interface: Interface, positions: FloatArray) -> bool:
    """Return whether half of a slave segment, its end and its middle, is below the master segments nearest to it."""
    ends = positions[interface.slave.segments]
    points = np.concatenate([ends[:, 0], ends.mean(axis=1), ends[:, 1]])
    gaps, _, over = _look(interface, positions, points)
    first, middle, last = (over & (gaps < 0)).reshape(3, -1)
    return bool((middle & (first | last)).any())


def _look(interface: Interface, positions: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return gaps (n,) and normals (n, 2) of points (n, 2) at the nearest master segments, and which are over these."""
    ends = positions[interface.master.segments]  # (n_segments, 2 ends, dim)
    first, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    length = np.hypot(*along.T)
    homes, feet = [], []
    for point in points:  # One by one: a mesh of the user may have thousands of segments on either side.
        foot = np.einsum("ij,ij->i", point - first, along) / length**2
        distance = np.hypot(*(point - first - np.clip(foot, 0, 1)[:, None] * along).T)
        homes.append(int(np.argmin(distance)))
        feet.append(foot[homes[-1]])
    home, foot = np.array(homes), np.array(feet)
    normals = np.column_stack([along[home, 1], -along[home, 0]]) / length[home, None]
    return np.einsum("ij,ij->i", points - first[home], normals), normals, (foot >= 0) & (foot <= 1)


_FACE_QUARTERS = st.integers(1, 4)  # The depth in quarters of a unit of the least height of a face.
_WARPS = st.lists(st.integers(-4, 4), min_size=1, max_size=9)


def given_surface_states(interface: Interface, *, smooth: bool) -> SearchStrategy[Case]:
    """Return random states of the interface.

    The slave is bent onto the master, so that most of its nodes touch whatever the gap of the mesh is. Then each node
    moves into the master by its own depth, or stays outside; `smooth` adds an offset off the lattice.
    """
    directions = node_directions(interface.slave, interface.nodes)[: interface.n_slave_nodes]
    return _face_states(interface, close_surfaces(interface, directions), directions, smooth)


@st.composite
def _face_states(draw: DrawFn, interface: Interface, closed: FloatArray, directions: FloatArray, smooth: bool) -> Case:
    quarters, unit = draw(_FACE_QUARTERS), draw(depth_units())
    slave_warps, master_warps = draw(_WARPS), draw(_WARPS)
    penalty, seed = draw(PENALTIES), draw(SEEDS)
    offsets = draw(OFFSETS) if smooth else [0]  # Drawn last, so that the offset shrinks last.
    n_slave, positions = interface.n_slave_nodes, closed.copy()
    depth = quarters / 4 * unit * least_height(interface, closed)
    warps = repeat_cyclically(slave_warps, n_slave)
    shares = 1 + (warps - warps.max()) / 4  # −1 to 1, and 1 at the deepest node.
    positions[:n_slave] += depth * shares[:, None] * directions
    moves = depth / 16 * repeat_cyclically(master_warps, len(positions) - n_slave)
    positions[n_slave:] += moves[:, None] * node_directions(interface.master, interface.nodes)[n_slave:]
    positions[:n_slave] += depth * repeat_cyclically(offsets, 3 * n_slave).reshape(-1, 3) / [7.0, 11.0, 13.0] / 16
    return Case(interface, positions.reshape(-1), penalty, {}, seed)


def node_directions(surface: Surface, nodes: FloatArray) -> FloatArray:
    """Return unit vectors (n_nodes, 3) out of the body: the mean normal, or those of the nodes around a closed body."""
    turns = turns_of(nodes[surface.faces]).sum(axis=1)
    mean = turns.sum(axis=0) / np.linalg.norm(turns, axis=1).sum()
    if np.linalg.norm(mean) > ONE_SIDED:
        return np.broadcast_to(mean / np.linalg.norm(mean), nodes.shape)
    normals = np.zeros_like(nodes)
    np.add.at(normals, surface.faces, turns[:, None])
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(np.divide(normals, sizes, out=np.zeros_like(normals), where=sizes > 0))


def close_surfaces(interface: Interface, directions: FloatArray) -> FloatArray:
    """Return positions (n_nodes, 3) in which each slave node that sees the master along its direction lies on it.

    Any other slave node moves as the nearest node that does, unless that would shrink a slave face too much.
    """
    pairs = zip(interface.nodes[: interface.n_slave_nodes], directions, strict=True)
    return _bend_slave(interface, np.array([_way_along(interface, *pair) for pair in pairs]), directions)


def _way_along(interface: Interface, point: FloatArray, direction: FloatArray) -> float:
    """Return the shortest way, forwards or backwards, from a point (3,) to a master face that faces it, or infinity."""
    faces = interface.master.faces  # Quadrilaterals are cut along their first diagonal.
    if faces.shape[1] != TRIANGLE:
        faces = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    corners = interface.nodes[faces]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    turns = np.cross(first, second)
    falls = turns @ direction
    falls = np.where(falls < -STEEPEST_FACING * np.linalg.norm(turns, axis=1), falls, np.nan)
    arms = point - corners[:, 0]
    across = np.cross(arms, direction)
    s, t = -np.einsum("fi,fi->f", second, across) / falls, np.einsum("fi,fi->f", first, across) / falls
    ways = -np.einsum("fi,fi->f", turns, arms) / falls
    ways = ways[(s >= 0) & (t >= 0) & (s + t <= 1)]
    return float(ways[np.abs(ways).argmin()]) if len(ways) else np.inf
