"""Projection: the place of each contact point, the master segment opposite, and whether it is active."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE
from contactverif.contract.measurement import Measurement, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.oracle.exact_choices import DEEP, closest_excess, seen_excess
from contactverif.oracle.exact_points import ExactPoints, Lattice, positions
from contactverif_properties.shared.exact_places import (
    CELLS,
    CLOSEST,
    FOOT_REASON,
    LOCAL_REASON,
    Places,
    Reported,
    define_projection,
    largest,
    name_places,
)
from contactverif_properties.shared.face_places import ON_FACES, count_decisions, face_errors, place_errors
from contactverif_properties.shared.passes import Pass


def refuse_without_rule(traits: Traits) -> str:
    """Return why places cannot be judged, or an empty string where the trait `gap` states a rule."""
    return "" if traits.rules.gap is not None else "the trait `gap` states no rule of projection"


# Two ends of an overlap are scalar products of two terms, each rounded by 2u of the lengths.
OVERLAP_ROUNDOFF = 8 * UNIT_ROUNDOFF
# A search may call segments tied whose distances differ by so little, and no gap shows which of them it took.
TIED = 1e-12
FARTHER = Quantity(
    "distance beyond the nearest segment", "1e-12", "A search may call segments tied that differ by less."
)


@define_projection(
    id="projection.segment", rank=320, quantities=(FARTHER,), cases_in_space=ON_FACES, applicable=refuse_without_rule
)
def projection_segment(case: Case, subject: Subject) -> Measurement:
    """Each contact point is measured against the master segment that the stated rule names.

    **Question.** A formulation states by which rule a point gets its master segment: the closest one, or the nearest
    that its slave segment sees along its normal. Does each point that it reports have a segment by that rule?

    **Why it matters.** A wrong segment is a wrong gap, a wrong normal and a force on wrong nodes. It happens where
    search is hard: past free ends, at sharp vertices, where the nearest node is not on the nearest segment. Meshes for
    tests rarely have such places, and assemblies do.

    **How it is judged.** The point is formed in rationals from the stored nodes and c. The number is how much farther
    the reported segment is than the nearest, a length that is exact, over the lengths of which a gap is a difference.
    It must be at most 1e-12. So a tie needs no rule: of segments at the same distance any is right. Along the slave's
    normal, a segment must face the slave and be met by the line. Of one that is seen edge-on, rounding may leave an
    overlap: a point whose weight is at most 8u of those lengths may name it. For `cells` it may be the nearest at the
    point or in the middle of its overlap, and segments beyond two lengths of both are no rivals.

    In space a master face must look at the slave. Along the slave's normal the foot lies in it, or past the border of
    the master. By the closest point no face with a foot inside is nearer. Lengths are those of `projection.place`.

    **Undecided.** Never. The number of exact ties is a detail. A point that names no segment is not judged here.
    """
    if case.interface.dim != PLANE:
        value, broken, idle = face_errors(case, subject)
        return Measurement([FARTHER.check(value, TIED)], broken=broken, idle=idle)
    reported = Reported.from_case(case, subject)
    rule, value, ties, broken = subject.traits.rules.gap, 0.0, 0, ""
    for each in reported.passes:
        places = Places.from_pass(each, rule, reported.distant)
        segments = places.reported.master_segment
        if rule == CLOSEST:
            excess, tied = closest_excess(places.lattice, places.exact, segments)
            ties += int((tied > 1).sum())
        else:
            carrier = places.reported.slave_segment
            excess = seen_excess(places.lattice, places.exact, carrier, segments, cells=rule in CELLS)
        facing = places.view.cosine > 0
        value = max(value, largest(excess[facing] / places.scale[facing]))
        rounded = places.reported.weight <= OVERLAP_ROUNDOFF * (places.view.lengths + reported.distant)
        if not (facing | rounded).all():
            broken = "a master segment does not face the slave segment of its point"
    return Measurement(
        [FARTHER.check(value, TIED)],
        broken=broken,
        details={"tied points": ties},
        idle=not reported.points.active.any(),
    )


GAP = Quantity("error of the gap", "4u", LOCAL_REASON)
XI = Quantity("error of ξ", "4u", FOOT_REASON)
NORMAL = Quantity(
    "error of the normal",
    "8u (1 + D/ℓ)",
    "A difference, a root and a division are rounded, and ends at uD turn a segment.",
)
POSITION = Quantity("error of the position", "4u", "Two products and their sum are rounded, relative to X.")
_ROUNDINGS = {GAP: 4, XI: 4, NORMAL: 8, POSITION: 4}


@define_projection(
    id="projection.place",
    rank=70,
    quantities=(GAP, XI, NORMAL, POSITION),
    cases_in_space=ON_FACES,
    applicable=refuse_without_rule,
)
def projection_place(case: Case, subject: Subject) -> Measurement:
    """Position, ξ, normal and gap of each contact point are those of its place.

    **Question.** A contact point lies at c on a slave segment and is measured against a master segment. Are its
    position, its foot ξ, its normal and its gap those of that place, by the rule that the formulation states?

    **Why it matters.** Forces follow from these numbers. A gap that is formed from coordinates, n·x − n·x₁, loses a
    digit for each power of ten of the distance from the origin. A foot that is clipped to the segment hides that a
    point lies past its end. No patch test on a small mesh near the origin sees either.

    **How it is judged.** The point is formed in rationals from the stored nodes and c, never from the reported
    position. Gap and ξ may differ by 4u(L + |P − A| + D) from the exact ones: L are the lengths of both segments, P is
    the point, A the first node of the master segment, and D the diameter of the interface. So a gap that small may have
    either sign. ξ is multiplied by its segment's length; |gap| D/ℓ is added for it, since a segment of length ℓ whose
    ends are rounded turns, and a foot moves by the angle times the gap. Past an end of the segment by ξ', D (1 + ξ')
    takes the place of D. The normal is compared as a vector, 8u (1 + D/ℓ). The position is rounded where it is, 4uX.
    Along the slave's normal the first tolerance is over the cosine of the angle between the segments. X takes the place
    of D where the traits do not promise `translation_stable`: points that are formed first are rounded there.

    In space the shape functions of a foot take the place of ξ, times the longest edge of their face. The lengths are
    2 (L + |P − A| + D + |gap| D/h) Π ℓ/h over the cosine, with the longest edge ℓ and the height h of both faces:
    coordinates in a slave face round a place by ℓ/h, and shape functions of the master change over its height.

    **Undecided.** Never. NaN fails at an active point and is "nothing to say" at an idle one. The gap of a weighted
    node is a mean, and is not judged here.
    """
    tolerances = {name: count * UNIT_ROUNDOFF for name, count in _ROUNDINGS.items()}
    if case.interface.dim != PLANE:
        on_faces, idle = place_errors(case, subject)
        return Measurement(check_all(dict(zip(_ROUNDINGS, on_faces, strict=True)), tolerances), idle=idle)
    reported = Reported.from_case(case, subject)
    values, far = dict.fromkeys(_ROUNDINGS, 0.0), reported.state.largest_coordinate
    for each in reported.passes:
        places = Places.from_pass(each, subject.traits.rules.gap, reported.distant)
        for name, errors in (*_errors(places, reported.distant), (POSITION, _position_errors(each, far))):
            values[name] = float(np.maximum(values[name], largest(errors)))
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
    return np.where(np.isnan(errors) & ~active, 0.0, np.abs(errors))


LARGE_UNIT = 2.0**-32
WRONG = Quantity("wrong decisions", "0", "A decision is right or wrong; what roundoff or a rule decides is left out.")


def refuse_other_decisions(traits: Traits) -> str:
    """Return why the decision is not known from the gap, or an empty string."""
    if traits.rules.enforcement == "multiplier":
        return "the enforcement is by a multiplier, which decides in its own way"
    if traits.rules.gap == "cells and nodes":
        return "the slave nodes decide, and the points do not"
    return refuse_without_rule(traits)


@define_projection(
    id="projection.activity", rank=50, quantities=(WRONG,), cases_in_space=ON_FACES, applicable=refuse_other_decisions
)
def projection_activity(case: Case, subject: Subject) -> Measurement:
    """A contact point is active exactly where its gap is closed and its foot is on the master.

    **Question.** Is a contact point active exactly where its gap is not open and its foot lies on the surface?

    **Why it matters.** One wrong decision is a force that is missing or one too many. An absolute epsilon in the
    decision works for parts in millimetres and fails for the same part in metres. A decision taken from a neighbour is
    right on every flat patch.

    **How it is judged.** The exact gap of the point to its reported segment decides. The number of wrong decisions must
    be 0. A weighted node is judged by the weighted gap that it reports.

    **Undecided.** A point is left out where formulations may decide either way: a gap of roundoff, 4u(L + |P − A| + D);
    a foot past a free end by up to one segment, since each formulation has its own tolerance τ; an idle point whose
    slave segment does not face the master, or that has no weight; a penetration of more than two lengths of both
    segments. Details say how many points were decided and how many were left out. Multipliers have their own decision,
    λ − c g ≥ 0, and pressures that are interpolated between nodes have the nodes' decision, which is not reported; both
    are not asked.
    """
    both = [Reported.from_case(state, subject) for state in (case, _in_large_unit(case))]
    wrong, decided = zip(*map(_count if case.interface.dim == PLANE else count_decisions, both), strict=True)
    samples = [each.points for each in both]
    homeless = any(
        (points.active & ~(name_places(points) & ((points.master_segment >= 0) | points.weighted))).any()
        for points in samples
    )
    n_points = sum(len(points.c) for points in samples)
    return Measurement(
        [WRONG.check(float(sum(wrong)), 0.0)],
        broken="an active point names no place or no master segment" if homeless else "",
        details={"decided points": sum(decided), "points left out": n_points - sum(decided)},
        idle=not decided[0],
    )


def _in_large_unit(case: Case) -> Case:
    """Return the state with all lengths divided by 2^32, which rounds nothing; the penalty stays."""
    interface = case.interface.at(case.interface.nodes * LARGE_UNIT)
    return replace(case, interface=interface, z=case.z * LARGE_UNIT)


def _count(reported: Reported) -> tuple[int, int]:
    """Return how many decisions are wrong in one state, and how many points are decided."""
    rule, wrong, decided = reported.traits.rules.gap, 0, 0
    for each in reported.passes:
        weighted = each.points.select(each.points.weighted)
        local = Places.from_pass(each, rule, reported.distant)
        certain, closed = _decide(local, rule)
        wrong += int((certain & (local.reported.active != closed)).sum())
        decided += int(certain.sum())
        sure = np.abs(weighted.gap) > 4 * UNIT_ROUNDOFF * (reported.state.diameter + reported.distant)
        wrong += int((sure & (weighted.active != (weighted.gap < 0))).sum())
        decided += int(sure.sum())
    return wrong, decided


def _decide(places: Places, rule: str | None) -> tuple[BoolArray, BoolArray]:
    """Return at which points (n_points,) every right formulation decides alike, and whether it decides for contact."""
    points, view = places.reported, places.view
    rounding, foot_rounding = 4 * UNIT_ROUNDOFF * places.gap_scale, 4 * UNIT_ROUNDOFF * places.foot_scale
    gap, xi, length = view.gap.floats(), view.xi.floats(), view.master_length
    past = np.stack([-xi, xi - 1], axis=1) * length[:, None]  # Past the first end, and past the second.
    certain = (np.abs(gap) > rounding) & (np.abs(gap) <= DEEP * (length + view.slave_length)) & ~points.weighted
    if rule != CLOSEST:
        return certain & (past < -foot_rounding[:, None]).all(axis=1), gap < 0
    free = places.interface.master.neighbours[points.master_segment] < 0
    beyond = free & (past >= length[:, None])
    near_end = free & ~beyond & (past > -foot_rounding[:, None])
    usable = points.active | (places.facing & (points.weight != 0))
    return certain & usable & ~near_end.any(axis=1), (gap < 0) & ~beyond.any(axis=1)
