"""Random states of an interface in space that somebody gives: their mesh, our displacements."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.faces import turns_of
from contactverif.contract.interface import Interface, Surface
from contactverif.contract.ways import ONE_SIDED, STEEPEST_FACING
from contactverif.strategies.parts import OFFSETS, depth_units, penalties, repeat_cyclically, seeds

LEAST_SHARE = 0.25  # A slave face that is bent onto the master keeps this share of its area, seen along its normal.
_QUARTERS = st.integers(1, 4)  # The depth in quarters of a unit of the least height of a face.
_WARPS = st.lists(st.integers(-4, 4), min_size=1, max_size=9)


def given_surface_states(interface: Interface, *, smooth: bool) -> SearchStrategy[Case]:
    """Return random states of the interface.

    The slave is bent onto the master, so that most of its nodes touch whatever the gap of the mesh is. Then each node
    moves into the master by its own depth, or stays outside; `smooth` adds an offset off the lattice.
    """
    directions = node_directions(interface.slave, interface.nodes)[: interface.n_slave_nodes]
    return _states(interface, close_surfaces(interface, directions), directions, smooth)


@st.composite
def _states(draw: DrawFn, interface: Interface, closed: FloatArray, directions: FloatArray, smooth: bool) -> Case:
    quarters, unit = draw(_QUARTERS), draw(depth_units())
    slave_warps, master_warps = draw(_WARPS), draw(_WARPS)
    penalty, seed = draw(penalties()), draw(seeds())
    offsets = draw(OFFSETS) if smooth else [0]  # Drawn last, so that the offset shrinks last.
    n_slave, positions = interface.n_slave_nodes, closed.copy()
    least = float(min(side.heights(closed).min() for side in (interface.slave, interface.master)))
    depth = quarters / 4 * unit * least
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
    units: FloatArray = np.divide(normals, sizes, out=np.zeros_like(normals), where=sizes > 0)
    return units


def close_surfaces(interface: Interface, directions: FloatArray) -> FloatArray:
    """Return positions (n_nodes, 3) in which each slave node that sees the master along its direction lies on it.

    Any other slave node moves as the nearest node that does. Where this would shrink a slave face to less than
    `LEAST_SHARE` of its area, seen along its normal, the slave stays as it is.
    """
    nodes, n_slave = interface.nodes, interface.n_slave_nodes
    ways = np.array([_way_along(interface, *pair) for pair in zip(nodes[:n_slave], directions, strict=True)])
    facing = np.flatnonzero(np.isfinite(ways))
    closed = nodes.copy()
    if len(facing):
        nearest = [facing[np.linalg.norm(nodes[facing] - node, axis=1).argmin()] for node in nodes[:n_slave]]
        closed[:n_slave] += ways[nearest, None] * directions[nearest]
    before, after = (turns_of(places[interface.slave.faces]).sum(axis=1) for places in (nodes, closed))
    kept = np.einsum("fi,fi->f", before, after) >= LEAST_SHARE * np.einsum("fi,fi->f", before, before)
    return closed if kept.all() else nodes.copy()


def _way_along(interface: Interface, point: FloatArray, direction: FloatArray) -> float:
    """Return the shortest way, forwards or backwards, from a point (3,) to a master face that faces it, or infinity."""
    corners = interface.nodes[_triangles(interface.master.faces)]
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


def _triangles(faces: IntArray) -> IntArray:
    """Return triangles (n, 3) in place of quadrilaterals, cut along their first diagonal."""
    return faces if faces.shape[1] == 3 else np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
