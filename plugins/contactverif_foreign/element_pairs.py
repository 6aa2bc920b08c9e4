"""The nodes that form an element: a slave node with its segment, two segments with an overlap, or two chains.

What is chosen here is all that the harness decides. Whether an element is in contact it decides itself.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from contactverif.compiler import compile_maker
from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.interface import Interface, Surface
from contactverif.geometry.projection import (
    PointOnSegment,
    Tree,
    arm,
    dot,
    foot_on_surface,
    frame,
    nearest_segment,
    node,
    search_tree,
)

_LEAST_OVERLAP = 1e-12  # Part of a slave segment; a shorter overlap is roundoff of two segments that meet at a point.


@dataclass(frozen=True, slots=True, eq=False)
class Elements:
    """Elements of one kind: their nodes, slave nodes first."""

    labels: IntArray  # (n,), the number of the slave node, the slave segment or the slave chain
    nodes: IntArray  # (n, n_nodes)
    lengths: FloatArray  # (n,), reference length of the slave part
    sides: tuple[int, int, int, int]  # The number of slave nodes and of master nodes; 1 if the slave, master is closed.


def pair_nodes(interface: Interface, x: FloatArray, tau: float) -> list[Elements]:
    """Return an element of three nodes for each slave node whose foot is on the master, at x (n_nodes, 2).

    A slave node gets its nearest closed master segment. Its foot may lie past a free end by τ × the segment's length.
    """
    master, areas = interface.master, np.zeros(interface.n_slave_nodes)
    nearest, is_over = _find_segments(x, len(areas), master.segments, master.neighbours, search_tree(master, x), tau)
    lengths = np.repeat(interface.slave.lengths(interface.nodes) / 2, 2)
    np.add.at(areas, interface.slave.segments.ravel(), lengths)
    number = np.flatnonzero(is_over)
    nodes = np.column_stack([number, master.segments[nearest[number]]])
    return [Elements(number, nodes, areas[number], (1, 2, 0, 0))]


@compile_maker
def _find_segments(
    x: FloatArray, n_nodes: int, master: IntArray, neighbours: IntArray, tree: Tree, tau: float
) -> tuple[IntArray, BoolArray]:
    order, boxes = tree
    nearest, is_over = np.empty(n_nodes, dtype=np.int64), np.zeros(n_nodes, dtype=np.bool_)
    for i in range(n_nodes):
        v = PointOnSegment(node(x, i), node(x, i), -1.0)
        m = nearest_segment(v, x, master, order, boxes)
        nearest[i] = m
        if m >= 0:
            x_1 = node(x, master[m, 0])
            length, t, _ = frame(x_1, node(x, master[m, 1]))
            s = dot(arm(x_1, v), t)
            is_over[i] = foot_on_surface(s, length, neighbours[m, 0] < 0, neighbours[m, 1] < 0, tau)
    return nearest, is_over


def pair_segments(interface: Interface, x: FloatArray, tau: float) -> list[Elements]:
    """Return an element of four nodes for each slave and master segment that face each other, at x (n_nodes, 2).

    They overlap, seen along the normal of the slave segment, and no other master segment is nearer in the middle of the
    overlap.
    """
    rows = []
    for number, (a, b) in enumerate(interface.slave.segments):
        rows += [(number, m) for m in _facing_segments(x[a], x[b], x[interface.master.segments])]
    pairs = np.array(rows, dtype=np.int64).reshape(-1, 2)
    nodes = np.hstack([interface.slave.segments[pairs[:, 0]], interface.master.segments[pairs[:, 1]]])
    lengths = interface.slave.lengths(interface.nodes)[pairs[:, 0]]
    return [Elements(pairs[:, 0], nodes, lengths, (2, 2, 0, 0))]


def _facing_segments(a: Array, b: Array, ends: Array) -> Array:
    """Return the numbers of the master segments with ends (n, 2, 2) that a slave segment a b overlaps with."""
    along = b - a
    square = along @ along
    places = (ends - a) @ along / square  # (n, 2), 0 at a and 1 at b; a master that faces the slave runs back.
    heights = (along[0] * (ends - a)[..., 1] - along[1] * (ends - a)[..., 0]) / square
    low, high = np.maximum(places[:, 1], 0.0), np.minimum(places[:, 0], 1.0)
    facing = np.flatnonzero(high - low > _LEAST_OVERLAP)
    middle = (low + high)[facing] / 2
    share = (middle[:, None] - places[facing, 0]) / (places[facing, 1] - places[facing, 0])  # (middles, segments)
    covers = (share >= 0) & (share <= 1)
    height = np.abs((1 - share) * heights[facing, 0] + share * heights[facing, 1])
    visible: Array = facing[np.diagonal(height) <= np.where(covers, height, np.inf).min(axis=1, initial=np.inf)]
    return visible


def pair_chains(interface: Interface, x: FloatArray, tau: float) -> list[Elements]:
    """Return an element for each slave chain and each master chain that is nearest to one of its nodes.

    An element has all nodes of both chains, each in the order of a walk along its chain.
    """
    master, slave = interface.master, interface.slave
    arrays = master.segments, master.neighbours, search_tree(master, x)
    nearest, _ = _find_segments(x, interface.n_slave_nodes, *arrays, tau)
    lengths, masters = slave.lengths(interface.nodes), walk_chains(master)
    chain_of = np.empty(len(master), dtype=np.int64)
    for number, (segments, _, _) in enumerate(masters):
        chain_of[segments] = number
    elements = []
    for number, (segments, nodes, is_closed) in enumerate(walk_chains(slave)):
        for chain in np.unique(chain_of[nearest[nodes]]):
            _, others, other_is_closed = masters[chain]
            sides = len(nodes), len(others), int(is_closed), int(other_is_closed)
            together, length = np.concatenate([nodes, others])[None], lengths[segments].sum(keepdims=True)
            elements.append(Elements(np.array([number]), together, length, sides))
    return elements


def walk_chains(surface: Surface) -> list[tuple[IntArray, IntArray, bool]]:
    """Return the segments and the nodes of each chain in the order of a walk, and whether the chain is closed."""
    chains = []
    for segments in np.split(surface.chain_order, surface.chain_starts[1:]):
        is_closed = bool(surface.neighbours[segments[0], 0] >= 0)
        last: Any = [] if is_closed else [surface.segments[segments[-1], 1]]
        chains.append((segments, np.append(surface.segments[segments, 0], last).astype(np.int64), is_closed))
    return chains


RULES = {3: pair_nodes, 4: pair_segments, "n": pair_chains}  # The keys are the values of the option `nodes`.
