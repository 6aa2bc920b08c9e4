"""Find the cells: the pairs of a slave and a master segment that face each other, and what cuts each cell.

A slave segment and a master segment make a cell where

1. they face each other: the master's normal runs against the directions in which both ends of the slave look;
2. they overlap: some point of the slave sees the master segment along its direction (`cell_geometry`), either way;
3. no other master segment that faces the slave is nearer, seen from the middle of the overlap. So of bodies one behind
   the other only the first is touched, and never one at the far side of a ring, which does not face the slave;
4. the gap there is at most 2 (h_s + h_m) either way, h the longest segment of the chain. A deeper penetration is no
   contact, and neither is a floor far below an overhang (our choice; a penetration of two segments is well within it).

Candidates come from the tree of `search_tree`, at a cost of O(log n) for each slave segment and each candidate: the
segments that may lie in a `Strip` over the slave segment. It holds all that the segment sees within a distance `reach`,
on either side. A box is opened if it may meet the strip. What lies behind a surface that hides it is not looked at, so
dense turns of a spiral cost no more.

Rules for the next editor:

1. `find_cells` makes decisions. It returns integers and booleans, never a real number.
2. A doubt of some roundings keeps a box. No segment in the strip may be lost.
"""

from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_maker, compile_part
from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, BoolArray, FloatArray, IntArray
from contactverif.contract.interface import Surface
from contactverif.geometry.block_rows import Fields
from contactverif.geometry.projection import LEAF, Tree, Vector, dot, frame, minus, node
from contactverif_mortar.cell_geometry import SlaveView, facing_point, seen_from, slave_view, turn

# The longest overlap, in c ∈ [−1, 1], that counts as none: roundoff could not tell its points apart.
ROUNDOFF = 4 * UNIT_ROUNDOFF
# The columns of the table of candidates: ends of the overlap, |gap| in its middle, and the largest |gap| on it.
LOW, HIGH, GAP, DEPTH, N_COLUMNS = range(5)
AHEAD = 8  # A region reaches so many strips ahead.


def longest_of_chain(surface: Surface, x: FloatArray) -> FloatArray:
    """Return for each segment the length of the longest one of its chain, at the positions x (n_nodes, 2)."""
    return _longest_of_chain(x, surface.segments, surface.neighbours, surface.chain_order)


@compile_maker
def _longest_of_chain(x: FloatArray, segments: IntArray, neighbours: IntArray, order: IntArray) -> FloatArray:
    """Return the lengths (n_segments,); a chain begins where the walk `order` does not go on to a neighbour."""
    lengths, begin, longest = np.empty(len(order)), 0, 0.0
    for place in range(len(order)):
        s = order[place]
        length, _, _ = frame(node(x, segments[s, 0]), node(x, segments[s, 1]))
        longest = max(longest, length)
        if place + 1 == len(order) or neighbours[s, 1] != order[place + 1]:
            for member in range(begin, place + 1):
                lengths[order[member]] = longest
            begin, longest = place + 1, 0.0
    return lengths


@compile_maker
def averaging(x: FloatArray, slave: IntArray, neighbours: IntArray) -> tuple[IntArray, IntArray]:
    """Return with which segment the normals at the two ends of each slave segment are averaged, −1 for none.

    There is none at a free end, and where two segments meet at 90° or sharper: that is a corner, not a facet of a
    smooth surface (our choice).
    """
    partners = np.full((2, len(slave)), -1, dtype=np.int64)
    for segment in range(len(slave)):
        _, t, _ = frame(node(x, slave[segment, 0]), node(x, slave[segment, 1]))
        for end in range(2):
            other = neighbours[segment, end]
            if other >= 0:
                _, t_other, _ = frame(node(x, slave[other, 0]), node(x, slave[other, 1]))
                if dot(t, t_other) > 0:
                    partners[end, segment] = other
    return partners[0], partners[1]


@compile_maker
def find_cells(
    x: FloatArray, slaves: Fields, masters: Fields, tree: Tree
) -> tuple[IntArray, IntArray, BoolArray, BoolArray]:
    """Return the slave and the master segment of each cell, and whether master nodes cut its lower and its upper end.

    `slaves` are segments, those before and behind with which normals are averaged, and the answer of
    `longest_of_chain`; `masters` are segments and that answer. The second node of the master segment cuts the lower
    end, the first node the upper end. Cells are in the order of the slave segments, and on one slave segment in the
    order in which one meets them along it.

    A search begins with the depth of the cells on the last slave segment. It is done as soon as it saw what hides all
    that lies deeper; otherwise it looks farther, up to the reach of rule 4. The cells are the same.
    """
    (slave, before, behind, slave_longest), (master, master_longest) = slaves, masters
    room = len(slave) + len(master)
    cell_slave, cell_master = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64)
    cut_low, cut_high = np.empty(room, dtype=np.bool_), np.empty(room, dtype=np.bool_)
    members, table = np.empty(len(master), dtype=np.int64), np.empty((len(master), N_COLUMNS))
    waiting = np.empty(64, dtype=np.int64)
    n_cells, longest, depth = 0, np.max(master_longest), 0.0
    region = Region((0.0, 0.0), (1.0, 1.0), (-1.0, -1.0), 1)
    for s in range(len(slave)):
        view = slave_view(x, slave, s, before[s], behind[s])
        farthest = 2 * (slave_longest[s] + longest)
        length, _, _ = frame(view.x_a, view.x_b)
        reach = min(farthest, max(length / 16, 4 * depth))
        while True:
            strip = _make_strip(view, reach)
            if not _holds(region, strip):
                region = _make_region(strip, tree[1])
            count = _collect_segments(strip, region.box, tree, waiting, members)
            count = _find_candidates(x, masters, view, count, slave_longest[s], members, table)
            if reach >= farthest or _hides(table, count, reach / 2):
                break
            reach = min(farthest, 4 * reach)
        if n_cells + count > room:
            room = 2 * (n_cells + count)
            cell_slave, cell_master = _lengthen(cell_slave, room), _lengthen(cell_master, room)
            cut_low, cut_high = _lengthen(cut_low, room), _lengthen(cut_high, room)
        reached, depth = -1.0, 0.0  # the highest upper end so far, and the largest |gap| of a cell
        for i in range(count):
            if _is_nearest(x, master, view, members[:count], table, i, reached):
                cell_slave[n_cells], cell_master[n_cells] = s, members[i]
                cut_low[n_cells], cut_high[n_cells] = table[i, LOW] > -1, table[i, HIGH] < 1
                n_cells += 1
                depth = max(depth, table[i, DEPTH])
            reached = max(reached, table[i, HIGH])
    segment, partner = cell_slave[:n_cells].copy(), cell_master[:n_cells].copy()
    return segment, partner, cut_low[:n_cells].copy(), cut_high[:n_cells].copy()


@compile_maker
def _lengthen(values: Array, room: int) -> Array:
    longer = np.empty(room, dtype=values.dtype)
    longer[: len(values)] = values
    return longer


@compile_inline
def _find_candidates(
    x: FloatArray,
    masters: Fields,
    view: SlaveView,
    n_members: int,
    longest: float,
    members: IntArray,
    table: FloatArray,
) -> int:
    """Keep the members that overlap the slave segment and are near, by lower ends, then numbers; return how many."""
    (master, master_longest), count = masters, 0
    for place in range(n_members):
        m = members[place]
        x_1, x_2 = node(x, master[m, 0]), node(x, master[m, 1])
        low, high = overlap(view, x_1, x_2)
        if high - low <= ROUNDOFF:
            continue
        _, gap, _ = facing_point(view, x_1, x_2, (low + high) / 2)
        if abs(gap) > 2 * (longest + master_longest[m]):
            continue
        i = count
        while i > 0 and (table[i - 1, LOW] > low or (table[i - 1, LOW] == low and members[i - 1] > m)):
            members[i] = members[i - 1]
            for column in range(N_COLUMNS):
                table[i, column] = table[i - 1, column]
            i -= 1
        members[i], table[i, LOW], table[i, HIGH], table[i, GAP] = m, low, high, abs(gap)
        table[i, DEPTH] = _largest_gap(view, x_1, x_2, low, high)
        count += 1
    return count


@compile_inline
def _hides(table: FloatArray, count: int, depth: float) -> bool:
    reached = -1.0
    for i in range(count):
        if table[i, DEPTH] <= depth:
            if table[i, LOW] > reached:
                return False
            reached = max(reached, table[i, HIGH])
    return reached >= 1


@compile_part
def _largest_gap(view: SlaveView, x_1: Vector, x_2: Vector, low: float, high: float) -> float:
    """Return the largest |gap| between two points of a slave segment.

    Between them |gap| is at most the larger one of both ends. Directions that turn bend the gap, by no more than both
    segments are long.
    """
    _, at_low, _ = facing_point(view, x_1, x_2, low)
    _, at_high, _ = facing_point(view, x_1, x_2, high)
    bend = 0.0
    if not view.straight:
        bend = frame(view.x_a, view.x_b)[0] + frame(x_1, x_2)[0]
    return max(abs(at_low), abs(at_high)) + bend


@compile_inline
def _is_nearest(
    x: FloatArray, master: IntArray, view: SlaveView, members: IntArray, table: FloatArray, i: int, reached: float
) -> bool:
    """Return whether no other candidate is nearer in the middle of the overlap of candidate i.

    The candidates are sorted by their lower ends, and `reached` is the highest upper end of those before. Of two
    equally near segments the one with the lower number counts as nearer. The middle may be at the end of the other: two
    segments that meet there hide what is behind them as one.
    """
    middle = (table[i, LOW] + table[i, HIGH]) / 2
    # Overlapping are at most the candidates before this one, if any of them reaches its middle, and behind it those
    # that do not begin behind its middle.
    other = 0 if reached >= middle else i + 1
    while other < len(members) and table[other, LOW] <= middle:
        if other != i and middle <= table[other, HIGH]:
            x_1, x_2 = node(x, master[members[other], 0]), node(x, master[members[other], 1])
            _, gap, _ = facing_point(view, x_1, x_2, middle)
            if abs(gap) < table[i, GAP] or (abs(gap) == table[i, GAP] and members[other] < members[i]):
                return False
        other += 1
    return True


@compile_part
def overlap(view: SlaveView, x_1: Vector, x_2: Vector) -> tuple[float, float]:
    """Return the lower and upper end on the slave of what it sees of the master segment 1 2; (1, −1) if nothing.

    As c grows, the line along the slave's direction passes node 2 first, because the master runs against the slave. So
    node 1 is ahead of where the slave begins to look, and node 2 is passed where it ends. This does not hold where
    averaged directions have crossed before they reach the master, deeper than the slave's own radius of curvature; the
    slave then sees nothing (our choice).
    """
    x_a, x_b, n_a, n_b, _ = view
    along = minus(x_2, x_1)
    tau_a, tau_b = turn(n_a), turn(n_b)
    if dot(along, tau_a) >= 0 or dot(along, tau_b) >= 0:
        return 1.0, -1.0
    if dot(minus(x_1, x_a), tau_a) <= 0 or dot(minus(x_2, x_b), tau_b) >= 0:
        return 1.0, -1.0
    low, high = -1.0, 1.0
    if dot(minus(x_2, x_a), tau_a) > 0:
        low = max(seen_from(x_2, view), -1.0)
    if dot(minus(x_1, x_b), tau_b) < 0:
        high = min(seen_from(x_1, view), 1.0)
    return low, high


class Strip(NamedTuple):
    """The strip over a slave segment a b, with directions n_a and n_b at its ends."""

    a: Vector
    b: Vector
    n_a: Vector
    n_b: Vector
    reach: float
    low: Vector  # The box around the strip, measured from a.
    high: Vector
    straight: bool  # n_a and n_b are the normal of the segment.


@compile_part
def _make_strip(view: SlaveView, reach: float) -> Strip:
    """Return the strip over all that a slave segment sees within a reach."""
    a, b, n_a, n_b, straight = view
    d = minus(b, a)
    wide = (reach, reach)
    if straight:
        wide = (reach * abs(n_a[0]), reach * abs(n_a[1]))
    doubt = 16 * UNIT_ROUNDOFF * (reach + abs(d[0]) + abs(d[1]))
    low = (min(d[0], 0.0) - wide[0] - doubt, min(d[1], 0.0) - wide[1] - doubt)
    high = (max(d[0], 0.0) + wide[0] + doubt, max(d[1], 0.0) + wide[1] + doubt)
    return Strip(a, b, n_a, n_b, reach, low, high, straight)


class Region(NamedTuple):
    """A rectangle, and the smallest box of the tree that holds all segments which meet it.

    The strips of slave segments that follow each other lie in one region, so that a search for them begins there and
    not with the box of all segments.
    """

    origin: Vector  # A node nearby.
    low: Vector  # Corners of the rectangle, measured from the origin.
    high: Vector
    box: int


@compile_inline
def _holds(region: Region, strip: Strip) -> bool:
    """Return whether a strip lies in a region, by more than roundoff."""
    d = minus(strip.a, region.origin)
    doubt = 16 * UNIT_ROUNDOFF * (abs(d[0]) + abs(d[1]) + strip.reach)
    for axis in range(2):
        low, high = d[axis] + strip.low[axis] - doubt, d[axis] + strip.high[axis] + doubt
        if low < region.low[axis] or high > region.high[axis]:
            return False
    return True


@compile_part
def _make_region(strip: Strip, boxes: FloatArray) -> Region:
    """Return the region that is `AHEAD` times as large as the box around a strip, on each side of it.

    One goes down the tree as long as one half of the box alone meets the rectangle.
    """
    around = AHEAD * max(strip.high[0] - strip.low[0], strip.high[1] - strip.low[1])
    low = (strip.low[0] - around, strip.low[1] - around)
    high = (strip.high[0] + around, strip.high[1] + around)
    box, n_leaves = 1, len(boxes) // 2
    while box < n_leaves:
        near = _in_rectangle(strip.a, low, high, boxes[2 * box])
        far = _in_rectangle(strip.a, low, high, boxes[2 * box + 1])
        if near == far:
            break
        box = 2 * box if near else 2 * box + 1
    return Region(strip.a, low, high, box)


@compile_inline
def _in_rectangle(origin: Vector, low: Vector, high: Vector, box: FloatArray) -> bool:
    """Return whether a box meets a rectangle; `_holds` leaves room for the roundoff of both."""
    for axis in range(2):
        if box[axis] - origin[axis] > high[axis] or box[2 + axis] - origin[axis] < low[axis]:
            return False
    return True


@compile_inline
def _collect_segments(strip: Strip, begin: int, tree: Tree, waiting: IntArray, members: IntArray) -> int:
    """Write the segments below the box `begin` that may meet the strip, and some more, and return how many there are.

    `waiting` (64,) is room for the boxes still to open, and `members` has room for all segments. They come in the
    reverse order of their chains, which is that of the slave.
    """
    order, boxes = tree
    n_leaves = len(boxes) // 2
    count, n_waiting = 0, 1
    waiting[0] = begin
    while n_waiting > 0:
        n_waiting -= 1
        box = waiting[n_waiting]
        if not _meets(strip, boxes[box, 0], boxes[box, 1], boxes[box, 2], boxes[box, 3]):
            continue
        if box < n_leaves:
            waiting[n_waiting], waiting[n_waiting + 1] = 2 * box, 2 * box + 1
            n_waiting += 2
            continue
        start = (box - n_leaves) * LEAF
        for place in range(min(start + LEAF, len(order)) - 1, start - 1, -1):
            if order[place] >= 0:  # no padding
                members[count] = order[place]
                count += 1
    return count


@compile_part
def _meets(strip: Strip, low_x: float, low_y: float, high_x: float, high_y: float) -> bool:
    """Return whether a box may meet the strip. An empty box, from infinity to minus infinity, meets nothing."""
    a, b, n_a, n_b, reach, low, high, straight = strip
    a_low, a_high = minus((low_x, low_y), a), minus((high_x, high_y), a)
    if a_low[0] > high[0] or a_low[1] > high[1] or a_high[0] < low[0] or a_high[1] < low[1]:
        return False
    b_low, b_high = minus((low_x, low_y), b), minus((high_x, high_y), b)
    size = max(abs(a_low[0]), abs(a_low[1]), abs(a_high[0]), abs(a_high[1]))
    size = max(reach, size, abs(b_low[0]), abs(b_low[1]), abs(b_high[0]), abs(b_high[1]))
    doubt = 16 * UNIT_ROUNDOFF * size
    # n × d, d from a or b to a corner: the largest is negative behind a, the smallest positive before b.
    if max(n_a[0] * a_low[1], n_a[0] * a_high[1]) + max(-n_a[1] * a_low[0], -n_a[1] * a_high[0]) < -doubt:
        return False
    if min(n_b[0] * b_low[1], n_b[0] * b_high[1]) + min(-n_b[1] * b_low[0], -n_b[1] * b_high[0]) > doubt:
        return False
    if not straight:
        return True
    lowest = min(n_a[0] * a_low[0], n_a[0] * a_high[0]) + min(n_a[1] * a_low[1], n_a[1] * a_high[1])
    highest = max(n_a[0] * a_low[0], n_a[0] * a_high[0]) + max(n_a[1] * a_low[1], n_a[1] * a_high[1])
    return lowest <= reach + doubt and highest >= -reach - doubt
