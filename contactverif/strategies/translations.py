"""States that are moved: far away without rounding, or along a bent master.

Coordinates that move far away are multiples of 2^-32 below 2^5, so a translation by up to 2^20 is exact: the moved
coordinates fill the 53 bits of a double. A point inside a segment has more bits, so code that forms its coordinates far
away rounds it. On a coarser lattice nothing would show.

A sliding slave follows the graph of a broken line with slopes up to 1/2 from below. Penetrations are small against its
segments, so each line along a normal meets the master once, and the nearest segment is always near.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import accumulate, pairwise, product
from math import ceil, ldexp, log2

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, random_source
from contactverif.contract.interface import Interface
from contactverif.strategies import given_interface, samples

FINENESS = 32  # Coordinates are multiples of 2^-32.
FURTHEST = 20  # Translations reach 2^20.
KINDS = ("plain", "turned", "slave tilted", "kinked", "overhang")
_KINDS = st.sampled_from(KINDS)
_DEPTHS = st.integers(7, 20)  # Exponents of the penetration 2^-e.
_LENGTHS = st.lists(st.integers(1, 4), min_size=1, max_size=4)
_QUARTERS = st.lists(st.integers(1, 8), min_size=1, max_size=4)
_RISES = st.lists(st.sampled_from([1, -1, 2, -2, 0]), min_size=1, max_size=4)  # Eighths
_ANY_ANGLE = st.integers(1, 359)
_LEVEL_OR_ANY = st.one_of(st.just(0), _ANY_ANGLE)
_TILTS = st.sampled_from([0.25, -0.25, 0.0625, -0.0625])  # Slopes of a slave that deepens towards one end


@random_source("contactverif.strategies.translations.translated_cases")
def translated_cases(interface: Interface | None = None) -> SearchStrategy[Case]:
    """Return states near the origin that a translation by the parameter "shift" (2,), a length each, moves exactly.

    State and reference move. The penetration is 2^-20 to 2^-7, and the translation up to 2^20, in units of segments of
    length 1 to 4. `Case.kind` is one of `KINDS`; it is empty for a given interface.
    """
    if interface is None:
        return _translated_cases()
    return st.builds(_centre, given_interface.states(interface, smooth=True), exact_shifts())


@st.composite
def _translated_cases(draw: DrawFn) -> Case:
    kind = draw(_KINDS)
    slave_lengths, master_lengths = draw(_LENGTHS), draw(_LENGTHS)
    quarters, depth = draw(_QUARTERS), 2.0 ** -draw(_DEPTHS)
    rises = draw(_RISES) if kind == "kinked" else [0]
    tilt = draw(_TILTS) if kind == "slave tilted" else 0.0
    angles = _ANY_ANGLE if kind == "turned" else _LEVEL_OR_ANY
    degrees = 0 if kind == "plain" else draw(angles)
    penalty, seed, shift = draw(samples.PENALTIES), draw(samples.SEEDS), draw(exact_shifts())
    offsets = draw(samples.OFFSETS)
    covers, several = kind != "overhang", len(slave_lengths) > 1
    line = _master_line(master_lengths, sum(slave_lengths), rises, offsets, covers=covers, several=several)
    x = samples.ends_of(slave_lengths)
    x = x + samples.shifts(offsets, len(x))[:, 0]
    slave = np.column_stack([x, np.interp(x, *line.T)])  # On the line, or on the continuation of its end.
    # A tilt leaves one end in its place, so that tilt × way ≥ 0.
    moves = samples.repeat_cyclically(quarters, len(slave)) / 4 * depth + tilt * (x - (x[0] if tilt >= 0 else x[-1]))
    current = slave - moves[:, None] * [0.0, 1.0]
    reference, positions, master = (
        samples.on_lattice(samples.Motion(degrees)(points), FINENESS) for points in (slave, current, line[::-1])
    )
    interface = Interface.from_chains(reference, master)
    return Case(interface, np.vstack([positions, master]).reshape(-1), penalty, {"shift": shift}, seed, kind=kind)


@cache
def exact_shifts() -> SearchStrategy[FloatArray]:
    """Return translations (2,) by ±2^k or 0 along each axis, k = 0 … 20; the simplest is far along one axis."""
    exponent = st.one_of(st.just(FURTHEST), st.sampled_from(range(FURTHEST, -1, -1)))
    far = st.builds(ldexp, st.sampled_from([1.0, -1.0]), exponent)
    return st.tuples(far, st.one_of(st.just(0.0), far)).map(np.array)


def _master_line(
    lengths: Sequence[int], width: int, rises: Sequence[int], offsets: Sequence[int], *, covers: bool, several: bool
) -> FloatArray:
    """Return the master's points (n, 2) from left to right, beyond the slave at both ends, or short of it."""
    begin, end = (-1.0, width + 1.0) if covers else (0.5 if several else -1.0, width - 0.375)
    x = [begin, *(place for place in accumulate(lengths, initial=0) if begin < place < end), end]
    shift = samples.repeat_cyclically(offsets, len(x)) / 13 / 16
    heights = samples.ends_of(samples.repeat_cyclically(rises, len(x) - 1)) / 8
    return np.column_stack([x + shift, heights])


def _centre(case: Case, shift: FloatArray) -> Case:
    """Return a state with its centre moved to the origin, on a lattice fine for its size."""
    nodes, positions = case.interface.nodes, case.positions
    centre = positions.mean(axis=0)
    size = ceil(log2(max(np.abs(nodes - centre).max(), np.abs(positions - centre).max())))
    reference, positions = (samples.on_lattice(points - centre, FINENESS - size) for points in (nodes, positions))
    moved = replace(case, interface=case.interface.at(reference), z=positions.reshape(-1))
    return replace(moved, parameters={"shift": np.ldexp(shift, size)})


_SLAVE = st.lists(st.sampled_from([1.0, 1.5, 2.0]), min_size=1, max_size=3)
_MASTER = st.lists(st.sampled_from([1.0, 2.0, 1.5]), min_size=1, max_size=3)
_SLOPES = st.lists(st.integers(1, 8), min_size=2, max_size=5)  # Sixteenths; their signs alternate along the master.
_SLIDING_DEPTHS = st.lists(st.integers(1, 8), min_size=1, max_size=3)  # Thirty-seconds of the unit length.
_PLACES = st.integers(0, 12)
_PARALLEL = 2.0**-10  # The largest difference of parallel slopes: what opens in so short a time looks like a jump.
_MARGIN = 3.0  # The length of master on both sides of what the slave passes.


@random_source("contactverif.strategies.sliding.sliding_cases")
@samples.on_own_meshes
def sliding_cases(draw: DrawFn) -> Case:
    """Return slaves that slide along a bent master by the length of a segment; None for a given mesh.

    The parameter "path" (n_unknowns,) holds the way of each node, a length each: states are z + t path, 0 ≤ t ≤ 1. The
    parameter "opens" is 1 if a length of the slave leaves the master in one moment of the way, or enters it, else 0.
    """
    steps = draw(_SLAVE)
    way = max(steps)
    x = samples.ends_of(steps)
    line = _bent_line(draw(_MASTER), draw(_SLOPES), -_MARGIN - draw(_PLACES) / 13, x[-1] + way + _MARGIN)
    depth = samples.repeat_cyclically(draw(_SLIDING_DEPTHS), len(x)) / 32
    # The slave follows the master as it lies in the middle of the way.
    slave = np.column_stack([x, samples.on_lattice(np.interp(x + way / 2, *line.T)) - depth])
    motion, penalty, seed, shuffle = samples.draw_others(draw)
    chains = [samples.Chain(slave)], [samples.Chain(line[::-1])], [samples.Chain(slave)]
    interface, order = samples.assemble_chains(*chains, motion.scale, shuffle)
    nodes = np.vstack([slave, line[::-1]])
    moved = nodes + np.where(np.arange(len(nodes)) < len(slave), way, 0.0)[:, None] * [1.0, 0.0]
    z, end = motion(nodes[order]).reshape(-1), motion(moved[order]).reshape(-1)
    opens = np.array(float(_opens_at_once(slave, line, way)))
    return Case(interface, z, penalty, {"path": end - z, "opens": opens}, seed)


def _opens_at_once(slave: FloatArray, line: FloatArray, way: float) -> bool:
    """Return whether a length of the slave (n, 2), parallel to the line (m, 2) in touch, leaves it in one moment."""
    for (a, b), (p, q) in product(pairwise(slave), pairwise(line)):
        slope, other = ((end[1] - start[1]) / (end[0] - start[0]) for start, end in ((a, b), (p, q)))
        if abs(slope - other) > _PARALLEL:
            continue
        share = (a[1] - p[1] + other * (p[0] - a[0])) / (slope * way)
        overlap = min(q[0], b[0] + share * way) - max(p[0], a[0] + share * way)
        if -_PARALLEL <= share <= 1 + _PARALLEL and overlap > 0:
            return True
    return False


def _bent_line(lengths: list[float], slopes: list[int], start: float, end: float) -> FloatArray:
    """Return a broken line (n, 2) from left to right; it goes up and down in turn, so that it stays near one height."""
    points = [(start, 0.0)]
    while points[-1][0] < end:
        number = len(points)
        length = lengths[number % len(lengths)]
        slope = slopes[number % len(slopes)] / 16 * (1 if number % 2 else -1)
        points.append((points[-1][0] + length, points[-1][1] + length * slope))
    return samples.on_lattice(np.array(points))
