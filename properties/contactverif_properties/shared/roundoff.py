"""The tolerances that several properties share: what roundoff alone may do to a force, each formula with its reason.

Symbols: u = 2⁻⁵³; X is the largest coordinate; Z is X, or the diameter D of a formulation that promises
`translation_stable` (`rounding_distance`); g is the penetration; ℓ is the shortest segment, or for
a barrier its gap (`Case.resolution`); L is the slave's
length; N is the number of segments of both sides. Where the penetration varies, g is the uniform one that would give
the same forces, Σ|R| / (ε̂ L). `docs/concepts/tolerances.md` has the whole list.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array
from contactverif.contract.case import ACTIVATION, Case
from contactverif.contract.interface import PLANE
from contactverif.contract.measurement import Quantity
from contactverif.contract.traits import Traits

# Tables have 14 digits and more, and the weights that NGSolve 6.2.2608 computes for 3, 4 and 5 Gauss points add up to
# 1 − 26u, 1 − 54u and 1 − 71u. 1e-14 is 90u, and places of integration that are wrong by as much add their part.
WEIGHT_ROUNDINGS = 128
WEIGHT_REASON = "Weights of integration are known to 1e-14."
GAP_TOLERANCE = "u(8X/|g| + 4N + 128)"
GAP_REASON = f"A gap is a difference of coordinates, each rounded to uX, and N forces are summed. {WEIGHT_REASON}"
STATED_GAP_TOLERANCE = "u(8Z/|g| + 4N + 128)"
STATED_GAP_REASON = (
    f"A gap is a difference of positions, each rounded to uZ, and N forces are summed. {WEIGHT_REASON} "
    "Z is the largest coordinate X, and the diameter D where the trait `translation_stable` is True."
)
SEGMENT_TOLERANCE = "u(8X/min(g, ℓ) + 4N)"
SEGMENT_REASON = (
    "A gap is a difference of coordinates, each rounded to uX, and N forces are summed. "
    "Rounding the ends of a segment turns the segment and its force by uX/ℓ. "
    "8 is the number of coordinates of two segments; two triangles have 18, two quadrilaterals 24."
)
COORDINATE_ROUNDING = 64 * UNIT_ROUNDOFF  # A motion rounds each coordinate a few times; this times X bounds the move.


def sum_slave_forces(case: Case, forces: Array) -> float:
    """Return Σ|R| over the entries of the slave nodes of a residual, (n_unknowns, …) or (n_nodes, dim)."""
    return float(np.abs(forces.reshape(-1)[: case.interface.dim * case.interface.n_slave_nodes]).sum())


def sum_larger_forces(case: Case, forces: Array) -> float:
    """Return Σ|R| over the entries of the slave or of the master, the larger: half passes may push one side alone."""
    slave = sum_slave_forces(case, forces)
    return max(slave, float(np.abs(forces.reshape(-1)[: case.interface.n_unknowns]).sum()) - slave)


def mean_penetration(case: Case, forces: Array) -> float:
    """Return the uniform penetration, a length, that would need the same Σ|R| over the slave: Σ|R| / (ε̂ L).

    In space the area takes the place of the length L.

    Where half passes push the master alone, Σ|R| is that of the master. A barrier has no such penetration; its forces
    change over the gap, or over what is left of it to the activation distance.
    """
    if ACTIVATION in case.parameters:
        return case.resolution
    whole = sum_slave_forces(case, forces) or sum_larger_forces(case, forces)
    return whole / (case.penalty * case.slave_measure)


def rounding_distance(case: Case, traits: Traits) -> float:
    """Return the distance Z, a length, at which a formulation may round the position of a point.

    A kernel that subtracts the centroid first is `translation_stable`, and rounds points at the diameter.
    """
    return case.diameter if traits.promises.translation_stable else case.largest_coordinate


def gap_tolerance(case: Case, penetration: float, distance: float | None = None) -> float:
    """Return GAP_TOLERANCE as a number, or STATED_GAP_TOLERANCE for a distance Z at which positions are rounded.

    Where the penetration g, a length, is 0 there is no gap to round, and a force of any size is wrong.
    """
    largest = case.largest_coordinate if distance is None else distance
    gap_rounding = 8 * largest / penetration if penetration > 0 else 0.0
    return UNIT_ROUNDOFF * (gap_rounding + 4 * case.n_segments + WEIGHT_ROUNDINGS)


def segment_tolerance(case: Case, forces: Array, largest: float) -> float:
    """Return SEGMENT_TOLERANCE as a number, from the largest coordinate X of all states that take part.

    The residual (n_unknowns,) tells the mean penetration. Where nothing is in contact the value is 0 or infinite, and
    any tolerance serves.
    """
    penetration = mean_penetration(case, forces)
    reach = min(penetration, case.resolution) if penetration > 0 else case.resolution
    return UNIT_ROUNDOFF * (pair_coordinates(case) * largest / reach + 4 * case.n_segments)


def pair_coordinates(case: Case) -> int:
    """Return the number of coordinates of a slave and a master face, each of which is rounded: 8 of two segments."""
    interface = case.interface
    return int(interface.dim * (interface.slave.faces.shape[1] + interface.master.faces.shape[1]))


def slenderness(case: Case) -> float:
    """Return the longest edge of a face over its least height, the largest of both sides; 1 in the plane.

    Rounding its corners moves a place along a face by so many times uX, as it does where two edges cross at a small
    angle. So shape functions change by uX/ℓ times that.
    """
    interface, largest = case.interface, 1.0
    for side in (interface.slave, interface.master) if interface.dim != PLANE else ():
        corners = case.positions[side.faces]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        largest = max(largest, float((edges / side.heights(case.positions)).max()))
    return largest


def ratio(part: float, whole: float) -> float:
    """Return part / whole; 0/0 counts as 0, and anything else over 0 as infinite."""
    if whole > 0:
        return part / whole
    return 0.0 if part == 0 else np.inf


def gap_quantity(name: str) -> Quantity:
    """Return a dimensionless quantity that only the rounding of gaps may keep from zero."""
    return Quantity(name, GAP_TOLERANCE, GAP_REASON)


def stated_gap_quantity(name: str) -> Quantity:
    """Return a quantity as `gap_quantity` does; how gaps are rounded follows from the traits (`rounding_distance`)."""
    return Quantity(name, STATED_GAP_TOLERANCE, STATED_GAP_REASON)
