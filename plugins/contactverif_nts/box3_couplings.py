"""The couplings of Box 3: which nodes feel which, by the pairing alone, before any number is known.

A coupling is the work that is done at once: all virtual slave nodes of a slave segment with all their master segments.
Where this has too many nodes for a small dense matrix, a coupling is one virtual slave node, and if that still has too
many, one virtual slave node with one master segment. So the tangent of a slave segment over n master segments has O(n)
entries. No two multipliers feel each other, so with multipliers a coupling is never more than one virtual slave node.

Rule for the next editor: `box3_tangent` adds the matrix of a coupling as a whole. What it writes must be listed here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_kernel, constant
from contactverif.contract.arrays import BoolArray, IntArray
from contactverif.geometry.block_rows import MOST_NODES, NO_NODE, NumberArray, insert_node
from contactverif_nts.box3 import Area
from contactverif_nts.eq6 import Fields
from contactverif_nts.walk import NOT_CUT

WHOLE = constant(-1)  # All master segments, where the number of one may stand.
_BEGIN = constant(0)
_FEW = 2  # The nodes of a point over so many master segments always fit: A, B, four that cut, and three.


class Box3Couplings(NamedTuple):
    """The couplings of Box 3, in this order."""

    nodes: NumberArray  # (n_entries,), as in `Couplings`: ascending within a coupling, its multiplier last
    starts: IntArray  # (n_couplings + 1,)
    first_point: IntArray  # (n_couplings,), the virtual slave nodes of each coupling
    end_point: IntArray
    segment: IntArray  # (n_couplings,), the master segment, or WHOLE


def list_couplings(surfaces: Fields, areas: Fields, n: int, group: int, first_multiplier: int) -> Fields:
    """List the couplings of all virtual slave nodes, n on each slave segment, as the fields of `Box3Couplings`.

    A coupling has at most `group` of them. The number of the first multiplier is NO_NODE for a penalty.
    """
    _, first, last, _, _, _, _, _, active = areas
    n_most, n_entries = _bound_couplings(surfaces[3], first, last, active, first_multiplier != NO_NODE)
    nodes, starts = np.empty(n_entries, dtype=np.int32), np.empty(n_most + 1, dtype=np.int64)
    of_couplings = (*np.empty((3, n_most), dtype=np.int64),)
    count, place = _write_couplings(nodes, starts, of_couplings, surfaces, areas, n, group, first_multiplier)
    return nodes[:place], starts[: count + 1], *[each[:count] for each in of_couplings]


@compile_kernel
def _write_couplings(
    nodes: NumberArray,
    starts: IntArray,
    of_couplings: Fields,
    surfaces: Fields,
    areas: Fields,
    n: int,
    group: int,
    first_multiplier: int,
) -> tuple[int, int]:
    """Write the fields of `Box3Couplings`; return the number of couplings, and of the entries of `nodes`."""
    _, slave, master, neighbours = surfaces
    partner, first, last, cutting, cut_p, cut_q, clip_p, clip_q, active = areas
    first_point, end_point, segment = of_couplings
    has_multipliers = first_multiplier != NO_NODE
    coupling, place, starts[0] = 0, _BEGIN, 0
    for begin in range(0, len(active), group):
        i, end, j = begin, begin + group, WHOLE
        while i < begin + group:
            start = place
            for point in range(i, end):
                if active[point] and place - start <= MOST_NODES:
                    cuts = cutting[point], cut_p[point], cut_q[point], clip_p[point], clip_q[point]
                    area = Area(partner[point], first[point], last[point], *cuts)
                    place = _insert_segment(nodes, start, place, slave, point // n)
                    place = _insert_point(nodes, start, place, master, neighbours, area, j)
            if place - start > MOST_NODES:
                place = start
                end, j = (i + 1, WHOLE) if end - i > 1 else (end, first[i])
                continue
            if has_multipliers:
                nodes[place], place = first_multiplier + i, place + 1
            if place > start:
                first_point[coupling], end_point[coupling], segment[coupling] = i, end, j
                starts[coupling + 1], coupling = place, coupling + 1
            i, end, j = _next_points(i, end, j, last, neighbours)
    return coupling, place


@compile_inline
def _next_points(i: int, end: int, j: int, last: IntArray, neighbours: IntArray) -> tuple[int, int, int]:
    """Return what comes after some points with the master segment j: the segment after it, or the next point."""
    if j != WHOLE and j != last[i]:
        return i, end, neighbours[j, 1]
    return end, end + 1, WHOLE


@compile_inline
def _insert_point(
    nodes: NumberArray, start: int, place: int, master: IntArray, neighbours: IntArray, area: Area, j: int
) -> int:
    """Insert the nodes of one virtual slave node with one or the WHOLE of its master segments; return the list's end.

    The list is not complete if it has more than MOST_NODES.
    """
    place = _insert_core(nodes, start, place, master, area.frame, area.cut_p, area.cut_q)
    place = _insert_segment(nodes, start, place, master, area.master)
    if area.clip_p != NOT_CUT:  # A free end that truncates an area, on which a balanced pressure depends
        place = insert_node(nodes, start, place, master[area.first, 0])
    if area.clip_q != NOT_CUT:
        place = insert_node(nodes, start, place, master[area.last, 1])
    k, k_last = (area.first, area.last) if j == WHOLE else (j, j)
    place = _insert_segment(nodes, start, place, master, k)
    while k != k_last and place - start <= MOST_NODES:
        k = neighbours[k, 1]
        place = _insert_segment(nodes, start, place, master, k)
    return place


@compile_inline
def _insert_segment(nodes: NumberArray, start: int, place: int, segments: IntArray, segment: int) -> int:
    """Insert both nodes of a segment; return the end of the list."""
    place = insert_node(nodes, start, place, segments[segment, 0])
    return insert_node(nodes, start, place, segments[segment, 1])


@compile_inline
def _insert_core(
    nodes: NumberArray, start: int, place: int, master: IntArray, cutting: int, cut_p: int, cut_q: int
) -> int:
    """Insert the nodes that cut an area of competence and those of the frame they do it in; return the end."""
    if cutting == NOT_CUT:
        return place
    place = _insert_segment(nodes, start, place, master, cutting)
    if cut_p != NOT_CUT:
        place = insert_node(nodes, start, place, cut_p)
    if cut_q != NOT_CUT:
        place = insert_node(nodes, start, place, cut_q)
    return place


@compile_kernel
def _bound_couplings(
    neighbours: IntArray, first: IntArray, last: IntArray, active: BoolArray, has_multipliers: bool
) -> tuple[int, int]:
    """Return bounds of the number of couplings and of the number of their entries."""
    n_couplings, n_entries, most = 0, MOST_NODES + 2, MOST_NODES + 2
    for i in range(len(active)):
        if not active[i]:
            n_couplings, n_entries = n_couplings + has_multipliers, n_entries + has_multipliers
            continue
        n_segments, j = 1, first[i]
        while j != last[i]:
            n_segments, j = n_segments + 1, neighbours[j, 1]
        n_parts = n_segments if n_segments > _FEW else 1
        n_couplings, n_entries = n_couplings + n_parts, n_entries + n_parts * most
    return n_couplings, n_entries
