"""Ask whether ξ, gap, normal and position of each contact point are right.

**Question.** A contact point lies at c on a slave segment and is measured against a master segment. Are its position,
its foot ξ, its normal and its gap those of that place, by the rule that the formulation states?

**Why it matters.** Forces follow from these numbers. A gap that is formed from coordinates, n·x − n·x₁, loses a digit
for each power of ten of the distance from the origin. A foot that is clipped to the segment hides that a point lies
past its end. No patch test on a small mesh near the origin sees either.

**How it is judged.** The point is formed in rationals from the stored nodes and c, never from the reported position.
Gap and ξ may differ by 4u(L + |P − A| + D) from the exact ones: L are the lengths of both segments, P is the point, A
the first node of the master segment, and D the diameter of the interface. So a gap that small may have either sign. ξ
is multiplied by its segment's length; |gap| D/ℓ is added for it, since a segment of length ℓ whose ends are rounded
turns, and a foot moves by the angle times the gap. Past an end of the segment by ξ', D (1 + ξ') takes the place of D.
The normal is compared as a vector, 8u (1 + D/ℓ). The position is rounded where it is, 4uX. Along the slave's normal the
first tolerance is over the cosine of the angle between the segments. X takes the place of D where the traits do not
promise `translation_stable`: points that are formed first are rounded there.

**Undecided.** Never. NaN fails at an active point and is "nothing to say" at an idle one. The gap of a weighted node is
a mean, and is not judged here.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.oracle.exact_points import ExactPoints, Lattice, positions
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.exact_places import (
    FOOT_REASON,
    LOCAL_REASON,
    PROJECTED_KINDS,
    Places,
    Reported,
    largest,
    name_places,
    projected_cases,
    refuse_without_rule,
)
from contactverif_properties.shared.passes import Pass

GAP = Quantity("error of the gap", "1", "4u", LOCAL_REASON)
XI = Quantity("error of ξ", "1", "4u", FOOT_REASON)
NORMAL = Quantity(
    "error of the normal",
    "1",
    "8u (1 + D/ℓ)",
    "A difference, a root and a division are rounded, and ends at uD turn a segment.",
)
POSITION = Quantity("error of the position", "1", "4u", "Two products and their sum are rounded, relative to X.")
_ROUNDINGS = {GAP: 4, XI: 4, NORMAL: 8, POSITION: 4}


def measure_places(case: Case, subject: Subject) -> Measurement:
    """Compare what the formulation reports at its points with what is exact there.

    Parameters
    ----------
    case : Case
        Any state.
    subject : Subject
        A formulation that states its rule in the trait `gap`.

    Returns
    -------
    Measurement
        The largest errors: of a gap and of ξ × length over L + |P − A|, of a normal, of a coordinate over X; all
        dimensionless.
    """
    reported = Reported.from_case(case, subject)
    values, far = dict.fromkeys(_ROUNDINGS, 0.0), reported.state.largest_coordinate
    for each in reported.passes:
        places = Places.from_pass(each, subject.traits.gap, reported.distant)
        for name, errors in (*_errors(places, reported.distant), (POSITION, _position_errors(each, far))):
            values[name] = float(np.maximum(values[name], largest(errors)))
    tolerances = {name: count * UNIT_ROUNDOFF for name, count in _ROUNDINGS.items()}
    return Measurement(check_all(values, tolerances), idle=not reported.points.active.any())


def _errors(places: Places, distant: float) -> Iterator[tuple[Quantity, FloatArray]]:
    """Yield the name of each quantity with its errors, NaN only where an active point has NaN."""
    points, view = places.reported, places.view
    facing = np.isfinite(places.scale)
    counted = facing & ~points.weighted
    yield GAP, _size(view.gap.errors(points.gap) / places.gap_scale, points.active)[counted]
    length = view.master_length / places.foot_scale
    yield XI, _size(view.xi.errors(points.xi) * length, points.active)[facing]
    carrier = np.minimum(view.master_length, view.slave_length)  # Rounding the ends of a segment turns it.
    turns = view.normal.errors(points.normal)
    yield NORMAL, _size(np.hypot(turns[:, 0], turns[:, 1]) / (1 + distant / carrier), points.active)[facing]


def _position_errors(each: Pass, far: float) -> FloatArray:
    """Return the errors of positions over X, of all points that name a place, whether they see a master or not."""
    points = each.points.select(name_places(each.points))
    lattice = Lattice.from_state(each.interface, each.z)
    exact = ExactPoints.at(lattice, points.slave_segment, points.c)
    shifts = positions(lattice, exact).errors(points.position) / far
    return _size(np.abs(shifts).max(axis=1, initial=0.0), points.active)


def _size(errors: FloatArray, active: BoolArray) -> FloatArray:
    """Return |errors|; 0 in place of NaN where a point is idle."""
    sizes: FloatArray = np.where(np.isnan(errors) & ~active, 0.0, np.abs(errors))
    return sizes


PROJECTION_PLACE = Property(
    id="projection.place",
    family="projection",
    summary="Position, ξ, normal and gap of each contact point are those of its place.",
    quantities=(GAP, XI, NORMAL, POSITION),
    cases=projected_cases,
    kinds=PROJECTED_KINDS,
    measure=measure_places,
    promise=lambda traits: True,
    needs=frozenset({"contact_points"}),
    applicable=lambda traits: refuse_without_rule(traits) or refuse_barrier(traits),
)
