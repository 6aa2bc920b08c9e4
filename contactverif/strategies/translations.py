"""States that can be moved far away without rounding, and with too many bits for anything but their differences.

Coordinates are multiples of 2^-32 below 2^5. A translation by up to 2^20 is therefore exact: the moved coordinates fill
the 53 bits of a double. A point inside a segment has more bits, so code that forms its coordinates far away rounds it.
On a coarser lattice that would be exact as well, and nothing would show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import accumulate
from math import ceil, ldexp, log2

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.contract.interface import Interface
from contactverif.strategies import given_interface
from contactverif.strategies.parts import OFFSETS, Motion, ends_of, penalties, repeat_cyclically, seeds, shifts

FINENESS = 32  # Coordinates are multiples of 2^-32.
FURTHEST = 20  # Translations reach 2^20.
KINDS = ("plain", "turned", "slave tilted", "kinked", "overhang")
_KINDS = st.sampled_from(KINDS)
_DEPTHS = st.integers(7, 20)  # Exponents of the penetration 2^-e.
_LENGTHS = st.lists(st.integers(1, 4), min_size=1, max_size=4)
_QUARTERS = st.lists(st.integers(1, 8), min_size=1, max_size=4)
_RISES = st.lists(st.sampled_from([1, -1, 2, -2, 0]), min_size=1, max_size=4)  # Eighths
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
    degrees = 0 if kind == "plain" else draw(_angles(at_least=int(kind == "turned")))
    penalty, seed, shift = draw(penalties()), draw(seeds()), draw(exact_shifts())
    offsets = draw(OFFSETS)
    covers, several = kind != "overhang", len(slave_lengths) > 1
    line = _master_line(master_lengths, sum(slave_lengths), rises, offsets, covers=covers, several=several)
    slave = _slave_below(line, slave_lengths, offsets)
    moves = repeat_cyclically(quarters, len(slave)) / 4 * depth + tilt * _way_to_the_end(slave, tilt)
    current = slave - moves[:, None] * [0.0, 1.0]
    reference, positions = (_turn_onto_lattice(points, degrees) for points in (slave, current))
    master = _turn_onto_lattice(line[::-1], degrees)
    interface = Interface.from_chains(reference, master)
    return Case(interface, np.vstack([positions, master]).reshape(-1), penalty, {"shift": shift}, seed, kind=kind)


@cache
def _angles(*, at_least: int) -> SearchStrategy[int]:
    return st.integers(1, 359) if at_least else st.one_of(st.just(0), st.integers(1, 359))


@cache
def exact_shifts() -> SearchStrategy[FloatArray]:
    """Return translations (2,) by ±2^k or 0 along each axis, k = 0 … 20; the simplest is far along one axis."""
    exponent = st.one_of(st.just(FURTHEST), st.sampled_from(range(FURTHEST, -1, -1)))
    far = st.builds(ldexp, st.sampled_from([1.0, -1.0]), exponent)
    return st.tuples(far, st.one_of(st.just(0.0), far)).map(np.array)


def _master_line(
    lengths: Sequence[int], width: int, rises: Sequence[int], offsets: Sequence[int], *, covers: bool, several: bool
) -> FloatArray:
    """Return the master's points (n, 2) from left to right, beyond the slave at both ends or short of it.

    It is short of the slave's last node, and of the first one too unless the slave may have no other.
    """
    begin, end = (-1.0, width + 1.0) if covers else (0.5 if several else -1.0, width - 0.375)
    x = [begin, *(place for place in accumulate(lengths, initial=0) if begin < place < end), end]
    shift = repeat_cyclically(offsets, len(x)) / 13 / 16
    heights = ends_of(repeat_cyclically(rises, len(x) - 1)) / 8
    return np.column_stack([x + shift, heights])


def _slave_below(line: FloatArray, lengths: Sequence[int], offsets: Sequence[int]) -> FloatArray:
    """Return the slave's points (n, 2) on the master's line, or on the continuation of its end."""
    x = ends_of(lengths)
    x = x + shifts(offsets, len(x))[:, 0]
    return np.column_stack([x, np.interp(x, *line.T)])


def _way_to_the_end(slave: FloatArray, tilt: float) -> FloatArray:
    """Return the signed way of each node from the end that a tilt leaves in its place, so that tilt × way ≥ 0."""
    x = slave[:, 0]
    way: FloatArray = x - (x[0] if tilt >= 0 else x[-1])
    return way


def _turn_onto_lattice(points: FloatArray, degrees: int) -> FloatArray:
    """Return the points turned about the origin, each coordinate rounded to a multiple of 2^-32."""
    return _onto_lattice(Motion(degrees)(points), -FINENESS)


def _onto_lattice(points: FloatArray, exponent: int) -> FloatArray:
    """Return the points, each coordinate rounded to a multiple of 2^exponent."""
    return np.round(points * 2.0**-exponent) * 2.0**exponent


def _centre(case: Case, shift: FloatArray) -> Case:
    """Return a state with its centre moved to the origin, on a lattice fine for its size."""
    nodes, positions = case.interface.nodes, case.positions
    centre = positions.mean(axis=0)
    size = ceil(log2(max(np.abs(nodes - centre).max(), np.abs(positions - centre).max())))
    reference, positions = (_onto_lattice(points - centre, size - FINENESS) for points in (nodes, positions))
    moved = replace(case, interface=case.interface.at(reference), z=positions.reshape(-1))
    return replace(moved, parameters={"shift": np.ldexp(shift, size)})
