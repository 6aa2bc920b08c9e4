"""Interfaces of any shape: flat, tilted, bent, circular, overhanging on either side, partly open, or exactly at a tie.

The master of an open panel is the graph of a broken line, with walls; the slave's nodes lie below that line by their
penetration. Contact is there by construction, and nothing is filtered: half of a slave segment, from a node to the
middle, lies over the master, and where the draws leave it open, the slave sinks as a whole until that half is closed.
A formulation looks for contact at nodes, at points inside segments or on whole segments; half a segment has all.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import cycle, pairwise
from math import floor, log2

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, random_source
from contactverif.contract.interface import Interface
from contactverif.strategies import given_interface, samples

STEEPEST = 1e-3  # An edge seen at a smaller slope than this from a point counts as seen at this slope.
SMALLEST = 0.25  # The smallest factor for a slave, and the inverse of the largest.


def _sink_below(slave: FloatArray, line: FloatArray, depth: float) -> FloatArray:
    """Lower a slave (n, 2) until half of a segment is below the line (m, 2) by `depth`. Both run from left to right."""
    heights = []
    for left, right in _covered_halves(slave[:, 0], line[0, 0], line[-1, 0]):
        places = np.array([left, right, *line[(line[:, 0] > left) & (line[:, 0] < right), 0]])
        heights.append(float((np.interp(places, *slave.T) - np.interp(places, *line.T)).max()))
    lift = min(heights, default=-depth) + depth
    if lift <= 0:
        return slave
    return slave - [0.0, float(samples.on_lattice(np.array(lift + 2.0**-20)))]


def _radial_factor(slave: FloatArray, polygon: FloatArray, depth: float, *, outside: bool, closed: bool) -> float:
    """Return the factor for the distances of the slave (n, 2) from the origin by which half of a segment penetrates.

    The master's polygon (m, 2) is convex and runs counter-clockwise; its body is outside of it, or inside. The factor
    is 1 if half of a segment penetrates by `depth` already, or none can; else above 1 outside, and below 1 inside.
    """
    last = None if closed else -1
    begin, along = polygon[:last], (np.roll(polygon, -1, axis=0) - polygon)[:last]
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
    heights = np.einsum("ij,ij->i", normals, begin)  # The distances of the edges from the centre.
    first, second = slave[:last], np.roll(slave, -1, axis=0)[:last]
    shares = np.array([[1.0, 0.75, 0.5], [0.5, 0.25, 0.0]])[..., None, None]  # Node, point between and middle.
    points = shares * first + (1 - shares) * second  # (half, place, segment, 2)
    radius = float(np.hypot(*polygon.T).max())
    toward = np.maximum(points @ normals.T, radius * STEEPEST)  # (half, place, segment, edge)
    if outside:  # A point is in the body if it is beyond one edge.
        factor = float(((heights + depth) / toward).min(axis=3).max(axis=1).min())
        return factor if 1 < factor < 1 / SMALLEST else 1.0
    factor = float(((heights - depth) / toward).min(axis=3).min(axis=1).max())
    return factor if SMALLEST < factor < 1 else 1.0  # A polygon beside the centre may have no place for a segment.


def _covered_halves(x: FloatArray, begin: float, end: float) -> list[tuple[float, float]]:
    pairs = [(left, right, (left + right) / 2) for left, right in pairwise(x.tolist())]
    halves = [half for left, right, middle in pairs for half in ((left, middle), (middle, right))]
    return [half for half in halves if begin <= half[0] and half[1] <= end]


RADIUS = 4.0


@dataclass(frozen=True, slots=True)
class Ring:
    """Two concentric polygons, or parts of them."""

    slave: Sequence[int]  # Weights by which the segments share the angle.
    master: Sequence[int]
    degrees: int  # The angle; 360 is closed.
    inner_slave: bool  # The slave is the disc, else the hole around it.
    # As of `Broken`, along the radius; then the slave is scaled until half a segment is closed.
    quarters: Sequence[int]
    unit: float

    def __call__(self, offsets: Sequence[int]) -> samples.Panel:
        """Return the panel, its slave nodes moved off the lattice by these numerators, 0 for none."""
        warp = 1 + offsets[0] / 13 / 8  # no two segments at right angles, so that nothing is seen exactly edge-on
        master = self._points(self.master, not self.inner_slave, warp)
        reference = self._points(self.slave, self.inner_slave, 1.0)
        length = min(samples.shortest(master), samples.shortest(reference))
        depth = samples.on_lattice(samples.repeat_cyclically(self.quarters, len(reference)) / 4 * self.unit * length)
        depth = np.clip(depth, -RADIUS / 2, RADIUS / 2)  # neither a hole nor a disc shrinks to a point
        outward = reference / RADIUS if self.inner_slave else -reference / RADIUS
        shift = samples.shifts(offsets, len(reference)) * length
        slave = samples.on_lattice(reference + outward * depth[:, None]) + shift
        least, closed = min(self.unit * length / 4, RADIUS / 16), self.degrees == 360
        edges = master[::-1] if self.inner_slave else master
        factor = _radial_factor(slave, edges, least, outside=self.inner_slave, closed=closed)
        return samples.Panel(slave * factor, master, reference, closed=closed)

    def _points(self, weights: Sequence[int], inner: bool, warp: float) -> FloatArray:
        """Return points (n, 2), the body on the left: counter-clockwise around a disc, clockwise around a hole."""
        shares = samples.ends_of(weights) / sum(weights)
        angles = np.deg2rad(self.degrees * (shares[:-1] if self.degrees == 360 else shares) ** warp)
        points = samples.on_lattice(RADIUS * np.column_stack([np.cos(angles), np.sin(angles)]))
        return points if inner else points[::-1]


_DEPTH = st.one_of(samples.depths(), samples.depths(lowest=-6))


def _rings() -> SearchStrategy[Ring]:
    """Return arcs of 60° to 180°, and closed rings.

    Each call makes another strategy, since `st.one_of` counts one that it has twice, or an equal one, only once.
    """
    weights = st.lists(st.integers(1, 3), min_size=3, max_size=10)
    degrees = st.sampled_from([60, 150, 360, 180, 360, 360])
    return st.builds(Ring, weights, weights, degrees, st.booleans(), _DEPTH, samples.depth_units())


_RINGS = _rings()


@st.composite
def closed_cases(draw: DrawFn) -> Case:
    """Return a closed ring in a hole, off the lattice; its seam is where the numbering, on the walk or not, begins."""
    ring = replace(draw(_RINGS), degrees=360)
    motion, penalty, seed, shuffle = samples.draw_others(draw)
    interface, z, _ = samples.assemble_panels([ring(draw(samples.OFFSETS))], motion, shuffle)
    return Case(interface, z, penalty, {}, seed)


_ON = st.integers(0, 7)  # Zero means no offset.
_WALL = 5  # The kind of a step that is a wall: one step in six.
_BENDS = st.sampled_from([0.0, 0.125, 0.25, 0.5, 1.0, 0.03125])  # steepness of the master's steps
_TILTS = st.sampled_from([0.0, 0.125, -0.125, 0.375, -0.375, 1.0, -1.0])  # slope of a slave segment, at most 45°


def general_cases(interface: Interface | None = None) -> SearchStrategy[Case]:
    """Return states of any kind; one in eight exactly on the lattice, the others off it by some sevenths."""
    return _general_cases(smooth=False) if interface is None else given_interface.states(interface, smooth=False)


@random_source("contactverif.strategies.general.smooth_cases")
def smooth_cases(interface: Interface | None = None) -> SearchStrategy[Case]:
    """Return cases as `general_cases` does, always off the lattice: for derivatives, which mean nothing at a kink."""
    return _general_cases(smooth=True) if interface is None else given_interface.states(interface, smooth=True)


@st.composite
def _general_cases(draw: DrawFn, smooth: bool) -> Case:
    makers: list[Broken | Ring] = draw(_panels(smooth))
    motion, penalty, seed, shuffle = samples.draw_others(draw)
    # Drawn last, so that the offset shrinks last.
    offset_on = smooth or draw(_ON) > 0
    offsets = draw(samples.OFFSETS) if offset_on else [0]
    if not offset_on or any(isinstance(maker, Broken) and maker.upright for maker in makers):
        # A quarter turn keeps a tie a tie, and a wall upright.
        motion = replace(motion, degrees=motion.degrees // 90 * 90)
    interface, z, _ = samples.assemble_panels([maker(offsets) for maker in makers], motion, shuffle)
    return Case(interface, z, penalty, {}, seed)


@dataclass(frozen=True, slots=True)
class Broken:
    """A slave chain below a broken line."""

    # The master from left to right: length along, rise in units of `bend`, kind (a wall if 5).
    steps: Sequence[tuple[float, int, int]]
    bend: float  # The steepness of a rise of 1; walls are steep anyway.
    slave: Sequence[float]  # Lengths along of the slave segments.
    # X of the first slave node; the first master node is at 0. The slave moves on, and the master grows, until half
    # of a slave segment is over it.
    start: int
    tilt: float  # Slope of the slave against the master, turned about its middle, flatter for long chains.
    quarters: Sequence[int]  # Penetrations: quarters/4 × unit × the shortest segment, dealt to the slave nodes in turn.
    unit: float
    upright: bool = False  # Walls do not lean, and the slave stays where it starts.

    def __call__(self, offsets: Sequence[int]) -> samples.Panel:
        """Return the panel, its nodes moved off the lattice by these numerators, 0 for none."""
        line = self._master(offsets)
        length = min(samples.shortest(line), min(self.slave))
        start = float(self.start)
        if not self.upright:
            needed = max(self.slave[0], self.slave[-1]) / 2 + 2 * (length / 8)
            if line[-1, 0] < needed:
                line = np.vstack([line, [needed + length / 8, line[-1, 1]]])
            # Half of the first or last segment fits into the width.
            width, total = line[-1, 0] - length / 8, float(sum(self.slave))
            if not _covered_halves(start + samples.ends_of(self.slave), 0.0, width):
                to_right = min(max(start, self.slave[-1] / 2 - total), width - total)
                start = min(start, width - self.slave[0] / 2) if start >= 0 else to_right
        x = start + samples.ends_of(self.slave)
        reference = np.column_stack([x, samples.on_lattice(np.interp(x, *line.T))])
        flatter = 2.0 ** floor(min(0.0, log2(2 * length / (x[-1] - x[0]))))
        rise = self.tilt * flatter * (x - (x[0] + x[-1]) / 2)
        shift = samples.shifts(offsets, len(x))
        depth = (samples.repeat_cyclically(self.quarters, len(x)) / 4 + shift[:, 1]) * self.unit * length
        x = x + shift[:, 0] * length
        # The line is met again at the moved nodes, or a steep line would make the penetration another one.
        slave = np.column_stack([x, samples.on_lattice(np.interp(x, *line.T)) + rise - depth])
        return samples.Panel(_sink_below(slave, line, self.unit * length / 4), line[::-1], reference)

    def _master(self, offsets: Sequence[int]) -> FloatArray:
        """Return points (n, 2) from left to right; no wall stands on a wall, and with an offset nothing is edge-on."""
        points, wall = [(0.0, 0.0)], False
        for index, ((along, up, kind), offset) in enumerate(zip(self.steps, cycle(offsets), strict=False)):
            wall = kind == _WALL and not wall
            uneven = offset / 13 / 32
            if wall:
                dx, dy = 0.0 if self.upright else uneven, (up or 1) / 2
            else:
                dx, dy = along, (up + index % 3 * uneven) * self.bend
            points.append((points[-1][0] + dx, points[-1][1] + dy))
        return np.array(points)


@cache
def _broken_lines() -> SearchStrategy[Broken]:
    """Return flat panels with neighbours' lengths of any ratio, bent panels with lengths of 1 to 4."""
    flat = samples.lengths().map(lambda along: [(length, 0, 0) for length in along])
    step = st.tuples(st.integers(1, 4).map(float), st.integers(-4, 4), st.integers(0, _WALL))
    bent = st.lists(step, min_size=1, max_size=6)
    plain = samples.lengths(graded=False).map(lambda along: [(length + 1) // 2 for length in along])
    others = st.integers(-2, 2), _TILTS, _DEPTH, samples.depth_units()
    return st.one_of(
        st.builds(Broken, flat, st.just(0.0), samples.lengths(), *others),
        st.builds(Broken, bent, _BENDS, plain, *others),
    )


def _ledge(floor: Sequence[float], slave: Sequence[float], rise: int, quarters: Sequence[int], unit: float) -> Broken:
    """Return a floor whose free end is an upright wall. The slave begins on it with a long segment beyond the wall.

    The area of competence of that segment's first quarter point goes past the wall: a walk ends edge-on.
    """
    steps, end = [*((length, 0, 0) for length in floor), (0.0, rise, _WALL)], int(sum(floor))
    return Broken(steps, 0.0, [6.0, *slave], end - min(end, 2), 0.0, quarters, unit, upright=True)


@cache
def _panels(smooth: bool) -> SearchStrategy[list[Broken | Ring]]:
    """Return one or two panels; ledges, which are kinks, only if not smooth."""
    shapes: list[SearchStrategy[Broken | Ring]] = [*[_broken_lines()] * 3, _rings(), _rings()]
    if not smooth:
        plain = samples.lengths(graded=False)  # Drawn from like the others, so that these do not shrink to a ledge.
        others = st.sampled_from([-1, -1, 1]), samples.depths(), samples.depth_units()
        shapes.append(st.builds(_ledge, plain, plain, *others))
    return samples.one_or_two(st.one_of(*shapes))


_RISES = st.sampled_from([0.0, 0.25, -0.25, 1.0, -1.0])  # The rise of a vertex above its neighbours, per length.
_QUARTERS = st.lists(st.integers(0, 8), min_size=1, max_size=4)  # Penetrations; 0 is a gap of exactly zero.
_SEGMENT = st.tuples(st.integers(0, 3).map(lambda k: 2.0**k), st.integers(0, 3))  # Length; quarter under a master node.


@st.composite
def tie_cases(draw: DrawFn) -> Case:
    """Return random meshes that stand exactly on a kink, where none of the choices of a formulation is wrong.

    Slave nodes over master nodes, quarter points over master nodes, points on the bisector of a vertex, ends at ends,
    gaps of exactly zero. Motions are quarter turns and whole numbers, so that a tie stays one bit for bit.
    """
    panel = draw(_PANELS)
    motion, penalty, seed = draw(samples.motions(exact=True)), draw(samples.PENALTIES), draw(samples.SEEDS)
    interface, z, _ = samples.assemble_panels([panel], motion)
    return Case(interface, z, penalty, {}, seed)


def _facing(
    segments: Sequence[tuple[float, int]], rises: Sequence[float], quarters: Sequence[int], unit: float
) -> samples.Panel:
    """Return a panel with master nodes under all slave nodes, and under some quarter points or middles (0: none)."""
    slave_x, master_x = [0.0], [0.0]
    for length, quarter in segments:
        if quarter:
            master_x.append(slave_x[-1] + length * quarter / 4)
        slave_x.append(slave_x[-1] + length)
        master_x.append(slave_x[-1])
    x, line = np.array(slave_x), np.column_stack([master_x, samples.repeat_cyclically(rises, len(master_x)) / 4])
    heights = np.interp(x, *line.T)
    slave = np.column_stack([x, heights - samples.repeat_cyclically(quarters, len(x)) / 4 * (unit / 4)])
    # A gap of zero may stay if a node and a quarter point beside it are below the line.
    beside = np.concatenate([0.75 * x[:-1] + 0.25 * x[1:], 0.25 * x[:-1] + 0.75 * x[1:]])
    here, there = (np.interp(places, *slave.T) < np.interp(places, *line.T) for places in (x, beside))
    if not here[np.r_[: len(x) - 1, 1 : len(x)]][there].any():
        slave = _sink_below(slave, line, unit / 4 / 4)
    return samples.Panel(slave, line[::-1], np.column_stack([x, heights]))


def _on_bisector(
    segments: Sequence[tuple[float, int]], rises: Sequence[float], quarters: Sequence[int], unit: float
) -> samples.Panel:
    """Return a symmetric roof or valley, with a node or quarter point of a level slave on its upright bisector."""
    x = samples.ends_of(length for length, _ in segments)
    x -= segments[0][0] * segments[0][1] / 4
    reach = 4 * x[-1]
    line = np.array([[-reach, -reach * rises[0]], [0.0, 0.0], [reach, -reach * rises[0]]])
    slave = _sink_below(np.column_stack([x, np.full(len(x), -quarters[0] / 4 * unit)]), line, unit / 4)
    return samples.Panel(slave, line[::-1], np.column_stack([x, np.zeros(len(x))]))


_ARGUMENTS = (
    st.lists(_SEGMENT, min_size=1, max_size=5),
    st.lists(_RISES, min_size=1, max_size=4),
    _QUARTERS,
    samples.depth_units(),
)
_PANELS = st.one_of(st.builds(_facing, *_ARGUMENTS), st.builds(_on_bisector, *_ARGUMENTS))
