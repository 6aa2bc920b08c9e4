"""States of two grids in space that are tilted and warped, so that the contact is partly open.

The slave is turned about the middle of the square, where it lies below the master by its depth. So about half of it is
in contact, whatever its slope. Nodes of both sides move up and down besides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.contract.faces import TRIANGLE
from contactverif.contract.interface import Interface
from contactverif.strategies.parts import OFFSETS, depth_units, penalties, repeat_cyclically, seeds
from contactverif.strategies.surfaces.given_surfaces import given_surface_states
from contactverif.strategies.surfaces.space_motions import SpaceMotion, space_motions
from contactverif.strategies.surfaces.surface_pairs import SurfacePair, surface_pairs
from contactverif.strategies.translations import FINENESS, FURTHEST

_QUARTERS = st.integers(1, 8)  # The depth of the middle in quarters of a unit of the least height.
_SLOPES = st.sampled_from([0.0, 0.125, -0.125, 0.375, -0.375, 1.0, -1.0])
_FINENESS = FINENESS + 1  # One bit more: far away all 53 are full, so that the middle of an edge is rounded.
_PLACES = st.integers(-(2**FURTHEST) + 2**6, 2**FURTHEST - 2**6)
_WARPS = st.lists(st.integers(-4, 4), min_size=1, max_size=9)  # Moves across in sixteenths of the least height.


@random_source("contactverif.strategies.surfaces.tilted_surfaces.surface_cases")
def surface_cases(
    interface: Interface | None = None, faces: tuple[int, ...] = (TRIANGLE,)
) -> SearchStrategy[Case] | None:
    """Return tilted and warped states, of which half have surfaces on the same domain, with all its ties.

    On an interface of the user they are states of this.
    """
    if interface is not None:
        return given_surface_states(interface, smooth=False)
    return _tilted_states(surface_pairs(faces=faces), smooth=False)


@random_source("contactverif.strategies.surfaces.tilted_surfaces.smooth_surface_cases")
def smooth_surface_cases(
    interface: Interface | None = None, faces: tuple[int, ...] = (TRIANGLE,)
) -> SearchStrategy[Case] | None:
    """Return tilted and warped states off the lattice, over a larger master: for derivatives.

    On an interface of the user they are states of this.
    """
    if interface is not None:
        return given_surface_states(interface, smooth=True)
    return _tilted_states(surface_pairs(same_domain=False, stretched=False, faces=faces), smooth=True)


@random_source("contactverif.strategies.surfaces.tilted_surfaces.translated_surface_cases")
def translated_surface_cases(
    interface: Interface | None = None, faces: tuple[int, ...] = (TRIANGLE,)
) -> SearchStrategy[Case] | None:
    """Return turned states near the origin that a translation by the parameter "shift" (3,) moves exactly.

    State and reference are rounded to multiples of 2^-33, and the translation goes up to 2^20.
    """
    pairs = surface_pairs(same_domain=False, stretched=False, most=3, faces=faces)
    return _translated_states(pairs) if interface is None else None


@st.composite
def _translated_states(draw: DrawFn, pair: SearchStrategy[SurfacePair]) -> Case:
    case = draw(_tilted_states(pair, smooth=True, motions=space_motions(furthest=0, exponents=0)))
    shift = np.array([draw(_PLACES), draw(_PLACES), draw(_PLACES)], dtype=np.float64)
    nodes, z = (
        np.ldexp(np.round(np.ldexp(values, _FINENESS)), -_FINENESS) for values in (case.interface.nodes, case.z)
    )
    return replace(case, interface=case.interface.at(nodes), z=z, parameters={"shift": shift})


@st.composite
def _tilted_states(
    draw: DrawFn,
    pairs: SearchStrategy[SurfacePair],
    smooth: bool,
    motions: SearchStrategy[SpaceMotion] | None = None,
) -> Case:
    pair = draw(pairs)
    quarters, unit = draw(_QUARTERS), draw(depth_units())
    slopes, warps = (draw(_SLOPES), draw(_SLOPES)), (draw(_WARPS), draw(_WARPS))
    motion, penalty, seed = draw(space_motions() if motions is None else motions), draw(penalties()), draw(seeds())
    offsets = draw(OFFSETS) if smooth else [0]  # Drawn last, so that the offset shrinks last.
    interface, _, domain = pair.lay_out()
    least = float(min(side.heights(interface.nodes).min() for side in (interface.slave, interface.master)))
    n_slave, current = interface.n_slave_nodes, interface.nodes.copy()
    current[:n_slave] += _offsets(offsets, n_slave) * least
    current[:n_slave, 2] += (current[:n_slave, :2] - domain.mean(axis=0)) @ slopes - quarters / 4 * unit * least
    for part, warp in zip((slice(n_slave), slice(n_slave, None)), warps, strict=True):
        current[part, 2] += _warp(warp, len(current[part])) * unit * least
    scaled = interface.at(interface.nodes * motion.scale)
    return Case(scaled, motion(current).reshape(-1), penalty, {}, seed)


def _offsets(offsets: Sequence[int], count: int) -> FloatArray:
    """Return shifts (count, 3) of slave nodes by 0 to 1/16, on lattices that are coprime to the powers of two."""
    return repeat_cyclically(offsets, 3 * count).reshape(-1, 3) / [7.0, 11.0, 13.0] / 16


def _warp(warps: Sequence[int], count: int) -> FloatArray:
    """Return moves across (count,), a quarter at most, dealt out in turn."""
    return repeat_cyclically(warps, count) / 16
