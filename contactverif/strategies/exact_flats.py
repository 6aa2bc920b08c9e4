"""Flat states whose exact forces are known, with too many bits for anything but differences of positions.

Their penetration is uniform, or linear along a straight slave.

A state is laid out on multiples of 2^-40, or of 2^-32 if it is moved by up to 2^20, and turned and stretched by a
Pythagorean triple. All this is exact. The turned coordinates have some 40 bits, so that products of them are rounded.
On a flat that is parallel to an axis nearly all products would be exact, and would hide a kernel that rounds.
"""

from __future__ import annotations

from itertools import accumulate

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.problems.flat_states import Turn, flat_master, flat_state
from contactverif.strategies.parts import OFFSETS, on_own_meshes, penalties, repeat_cyclically, seeds
from contactverif.strategies.translations import FINENESS, exact_shifts

_TURNS: tuple[Turn, ...] = ((4, 3, 5), (12, -5, 13), (-3, 4, 5), (-5, -12, 13))
_FINENESS_AT_REST = 40
_COARSE = 12  # The bits of the places of a slave that is not parallel to the master.
_ANY_TURN = st.sampled_from(_TURNS)
_QUARTERS = st.integers(1, 7)
_EXPONENTS, _COARSE_EXPONENTS = st.integers(6, 28), st.integers(6, 12)  # Of the penetration 2^-e.
_RISES = st.sampled_from([1, -1, 2, -2, 3, -3])
_SHIFTS = st.one_of(st.just(np.zeros(2)), exact_shifts())
_LENGTHS = st.lists(st.integers(1, 4), min_size=1, max_size=4)


@on_own_meshes
def exact_flat_cases(draw: DrawFn) -> Case:
    """Return states of uniform penetration, near the origin, whose exact forces are rationals.

    Cases have the parameters of `contactverif.problems.flat_states.flat_state`, and "shift" (2,), a length each: a
    translation that rounds no coordinate. The penetration is 2^-28 to 2^-6 of a segment; every slave point projects
    inside the master.
    """
    turn, slave_lengths, master_lengths = _turn_and_lengths(draw)
    depth = draw(_QUARTERS) / 4 * 2.0 ** -draw(_EXPONENTS)
    penalty, seed, shift, offsets = _others(draw)
    fineness = FINENESS if shift.any() else _FINENESS_AT_REST
    slave, master = _slave_and_master(slave_lengths, master_lengths, offsets, fineness, fineness)
    case = flat_state("", slave.tolist(), flat_master(master.tolist()), depth, turn=turn)
    return Case(case.interface, case.z, penalty, {**case.parameters, "shift": shift}, seed)


@on_own_meshes
def linear_flat_cases(draw: DrawFn) -> Case:
    """Return states like those of `exact_flat_cases` whose slave is straight and has a slope, the parameter "slope"."""
    turn, slave_lengths, master_lengths = _turn_and_lengths(draw)
    depth, rise = 2.0 ** -draw(_COARSE_EXPONENTS), draw(_RISES)
    penalty, seed, shift, offsets = _others(draw)
    # Heights are places times a power of two, so that they need some bits more than places.
    slave, master = _slave_and_master(slave_lengths, master_lengths, offsets, _COARSE, FINENESS)
    case = flat_state("", slave.tolist(), flat_master(master.tolist()), depth, turn=turn)
    # The longest slave is 16 long, so that the penetration is 5/8 of that of the middle node or more.
    slope = depth * rise / 128
    (p, q, _), middle = turn, slave[len(slave) // 2]
    positions = case.positions.copy()
    positions[: len(slave)] += np.outer(slope * (slave - middle), [-q, p])
    parameters = {"direction": case.parameters["direction"], "slope": np.array(slope), "shift": shift}
    return Case(case.interface, positions.reshape(-1), penalty, parameters, seed)


def _turn_and_lengths(draw: DrawFn) -> tuple[Turn, list[int], list[int]]:
    return draw(_ANY_TURN), draw(_LENGTHS), draw(_LENGTHS)


def _others(draw: DrawFn) -> tuple[float, int, FloatArray, list[int]]:
    """Draw penalty, seed, translation and offsets."""
    penalty, seed = draw(penalties()), draw(seeds())
    return penalty, seed, draw(_SHIFTS), draw(OFFSETS)


def _slave_and_master(
    slave_lengths: list[int], master_lengths: list[int], offsets: list[int], slave_bits: int, master_bits: int
) -> tuple[FloatArray, FloatArray]:
    """Return the places of both surfaces' nodes along the line; the master goes beyond the slave by 1."""
    end = float(sum(slave_lengths))
    slave = _places([float(place) for place in accumulate(slave_lengths, initial=0)], offsets, 7, slave_bits)
    inside = [float(place) for place in accumulate(master_lengths, initial=0) if place < end + 1]
    return slave, _places([-1.0, *inside, end + 1], offsets, 13, master_bits)


def _places(places: list[float], offsets: list[int], over: int, fineness: int) -> FloatArray:
    """Return the places, each moved by up to 1/16 and rounded to a multiple of 2^-fineness."""
    moved = places + repeat_cyclically(offsets, len(places)) / over / 16
    return np.round(moved * 2.0**fineness) * 2.0**-fineness
