"""Forces at vertices and free ends, judged by what every right formulation fulfils there.

At a kink two right formulations may give different forces. What they have in common:

- The total force on the slave is a sum of pushes along normals that lie between those of the master segments there.
- No gap is longer than the interface, so no force is larger than the springs on that gap.
- Where `penalty` and `area` are stated, weights are positive and add up to the slave's length. So the total lies
  between the least and the largest gap times that length. A formulation that states its rule for gaps (`gap`) gets the
  bounds of a push along normals of segments; any other gets those of any direction in between.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif_properties.shared.flat_forces import knows_total, uniform_forces
from contactverif_properties.shared.roundoff import ratio

_TOLERANCE = "u(8X/min(|g|, ℓ) + 4N)"
_REASON = (
    "A gap is a difference of coordinates, each rounded to uX, and N forces are summed. Rounding the ends of a segment "
    "turns its force by uX/ℓ."
)
DIRECTION = Quantity("part outside the normals", "1", _TOLERANCE, _REASON)
TOTAL = Quantity("excess of the total", "1", _TOLERANCE, _REASON)
SIZE = Quantity(
    "force over ε̂ D L",
    "1",
    "4",
    "No gap is longer than D; springs act in two passes at most, on n + 1 nodes for n segments.",
)
BOUNDED_QUANTITIES = (DIRECTION, TOTAL, SIZE)


def measure_bounded(case: Case, subject: Subject) -> Measurement:
    """Compare the total force on the slave with the bounds of the case.

    Parameters
    ----------
    case : Case
        A state of `contactverif.problems.hard_corner_states`.
    subject : Subject
        The formulation; all of its multipliers, if it has any, press as the typical gap would.

    Returns
    -------
    Measurement
        All dimensionless. The part of the total force that lies outside the normals, over Σ|F|; by how much the total
        along the axis leaves its bounds, over the upper one; Σ|F| over ε̂ D L.
    """
    bounds = case.parameters["segment_bounds" if subject.traits.gap else "bounds"] * case.penalty
    slave = uniform_forces(case, subject)[: case.interface.n_slave_nodes]
    total, size = slave.sum(axis=0), float(np.abs(slave).sum())
    largest = case.penalty * case.diameter * case.slave_length
    values, tolerances, broken = {SIZE: size / largest}, {SIZE: 4.0}, ""
    if bounds[1] == 0:
        broken = f"a force of {size:.2g} on a slave that faces no master" if size > 0 else ""
    else:
        values[DIRECTION] = ratio(_outside(total, case.parameters["edges"]), size)
        if knows_total(subject.traits):
            along = float(total @ case.parameters["axis"])
            values[TOTAL] = max(0.0, bounds[0] - along, along - bounds[1]) / float(bounds[1])
    reach = min(case.parameter("penetration"), case.shortest_segment)
    tolerance = UNIT_ROUNDOFF * (8 * case.largest_coordinate / reach + 4 * case.n_segments)
    tolerances |= {quantity: tolerance for quantity in values if quantity != SIZE}
    details = {"share of the upper bound": ratio(float(total @ case.parameters["axis"]), float(bounds[1]))}
    # Where the lower bound is 0, no force is as good an answer as any.
    return Measurement(check_all(values, tolerances), broken=broken, details=details, idle=size == 0 and bounds[0] > 0)


def promise_bounds(traits: Traits) -> bool:
    """Return True: the bounds hold for every law that pushes."""
    return True


def _outside(force: FloatArray, edges: FloatArray) -> float:
    """Return the part of a force that lies outside the directions between two edges, a force ≥ 0."""
    right, left = edges
    middle = right + left
    sideways = max(-_cross(right, force), -_cross(force, left))
    return max(0.0, sideways, -float(force @ middle) / float(np.linalg.norm(middle)))


def _cross(a: FloatArray, b: FloatArray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])
