"""Flat states that are opened by hand, wholly or but for one end, and the cases of properties about pushing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.contract.interface import Interface
from contactverif.strategies import flat_cases, general_cases

CLOSED = 1 / 8  # The share of the slave's length, at one end, that is closed while the rest is open.
SHALLOW = 2.0**-6  # The deepest penetration there over the slave's length, so that the slave hardly tilts.
FAR = 2.0  # A distance in longest segments: the shapes of a mortar method reach over one, on either side.
FLAT, ANY_SHAPE = "flat", "any shape"


@random_source("contactverif_properties.shared.openings.pushing_cases")
def pushing_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]]:
    """Return flat cases with a uniform penetration, and states of any shape, each half of all cases.

    Parameters
    ----------
    interface : Interface | None
        Random meshes if None; else states of this one, which has flat cases only if it is flat.
    """
    flat = flat_cases(interface)
    return ({} if flat is None else {FLAT: flat}) | {ANY_SHAPE: general_cases(interface)}


def lift_slave(case: Case, height: float) -> Case:
    """Return the case with its slave moved away from the master, across the interface, by a height (a length)."""
    along = case.parameters["direction"]
    positions = case.positions.copy()
    positions[: case.interface.n_slave_nodes] += height * np.array([-along[1], along[0]])
    return replace(case, z=positions.reshape(-1))


def open_all_but_one_end(case: Case, closed: float = CLOSED) -> Case:
    """Return the case with its slave lifted so that the gap grows along it, and only its first part is closed.

    The gap grows linearly, and nodes move only across the interface, so that every slave stays straight.

    Parameters
    ----------
    case : Case
        A flat case with a uniform penetration.
    closed : float
        The share of the slave's length that is closed.
    """
    interface, positions = case.interface, case.positions.copy()
    depth, places = case.parameter("penetration"), _slave_places(case)
    shallow = min(depth, SHALLOW * case.slave_length)
    x, y = case.parameters["direction"]
    positions[: interface.n_slave_nodes] += (depth + shallow * (places / closed - 1))[:, None] * np.array([-y, x])
    return replace(case, z=positions.reshape(-1))


def nodes_far_from_contact(case: Case) -> BoolArray:
    """Return which slave nodes (n_slave_nodes,) are then FAR or more segments from the closed end."""
    interface, along = case.interface, case.parameters["along"]
    slave = along[: interface.n_slave_nodes]
    longest = max(float(np.abs(np.diff(along[side.segments])).max()) for side in (interface.slave, interface.master))
    distant: BoolArray = (_slave_places(case) - CLOSED) * np.ptp(slave) > FAR * longest
    return distant


def _slave_places(case: Case) -> FloatArray:
    """Return where the slave's nodes lie along the interface (n_slave_nodes,), from 0 to 1."""
    slave = case.parameters["along"][: case.interface.n_slave_nodes]
    places: FloatArray = (slave - slave.min()) / np.ptp(slave)
    return places
