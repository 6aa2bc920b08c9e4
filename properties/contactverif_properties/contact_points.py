"""The contact points that a formulation reports, beside what is exact at their places, and the sums over them.

A point is formed in rationals from the stored nodes of its slave segment or face, and the reported place on it. Its
reported position is rounded at its distance from the origin, and serves for nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from math import sqrt
from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray
from contactverif.contract.case import Case, Cases, random_source
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import PLANE, TRIANGLE, Interface, turns_of
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.oracle import exact_points
from contactverif.oracle.exact_points import DEEP, Coverage, closest_excess, lies_in_shadow, seen_excess
from contactverif.strategies import general_cases, tie_cases
from contactverif.strategies.beside import layered_cases
from contactverif.strategies.projection_situations import KINDS, projection_states, projections_by_kind
from contactverif.strategies.surfaces import flat_surface_cases, surface_cases
from contactverif_properties import roundoff
from contactverif_properties.applicability import refuse_unstated
from contactverif_properties.states import Pass, any_cases, freeze_state, split_passes

LARGER_MESHES = ("larger random mesh", "larger mesh, exact ties")
PROJECTED_KINDS = (*KINDS, *LARGER_MESHES)
CLOSEST = "closest point"
CELLS = ("cells", "cells and nodes")

LOCAL_REASON = (
    "A gap is a difference of the lengths L of both segments and |P − A|, each rounded a few times; along the slave's "
    "normal over the cosine. A kernel that centres its coordinates rounds them at D; X takes the place of D where the "
    "traits do not promise `translation_stable`."
)
FOOT_REASON = LOCAL_REASON + " Rounding the ends of a segment turns it by uD/ℓ, which moves a foot by |gap| uD/ℓ."


class _Reported(NamedTuple):
    state: Case  # With multipliers, if the formulation has any.
    forces: FloatArray  # The position rows of the residual, of shape (n_nodes, dim).
    points: ContactPoints
    traits: Traits

    @classmethod
    def from_case(cls, case: Case, subject: Subject) -> _Reported:
        """Ask a formulation about a case without multipliers."""
        frozen = freeze_state(case, subject)
        forces, points = frozen.formulation.answers([frozen.call("residual"), frozen.call("contact_points")])
        forces = forces[: case.interface.n_unknowns].reshape(case.positions.shape)
        return cls(frozen.case, forces, points, subject.traits)

    @property
    def passes(self) -> Iterator[Pass]:
        return split_passes(self.state, self.points)

    @property
    def in_plane(self) -> bool:
        return self.state.interface.dim == PLANE

    @property
    def rule(self) -> str | None:
        """The trait `gap`."""
        return self.traits.rules.gap

    @property
    def distant(self) -> float:
        """The length Z at which a point may be rounded."""
        return roundoff.rounding_distance(self.state, self.traits)

    @property
    def idle(self) -> bool:
        return not self.points.active.any()


class _Places(NamedTuple):
    """The points of a pass that name a place on a slave segment and a master segment.

    A scale is the length of which rounding is a share: L + |P − A|, plus D or X, at which a point may be rounded, over
    the cosine; infinite where the rule sees nothing of the segment.
    """

    lattice: exact_points.Lattice
    reported: ContactPoints
    exact: exact_points.ExactPoints
    view: exact_points.View  # Of the reported master segment, by the rule of the formulation.
    scale: FloatArray  # (n_points,), as are the others.
    gap_scale: FloatArray  # Past an end of the master segment by ξ', its ends are extrapolated: D ξ' is added.
    # Rounding its ends at D turns the segment of length ℓ whose normal is taken by uD/ℓ, which moves the foot by
    # |gap| uD/ℓ. So |gap| D/ℓ is added too.
    foot_scale: FloatArray

    @classmethod
    def from_pass(cls, each: Pass, reported: _Reported) -> _Places:
        points = each.points.select(_name_places(each.points) & (each.points.master_segment >= 0))
        lattice = exact_points.Lattice.from_state(each.interface, each.z)
        exact = exact_points.ExactPoints.at(lattice, points.slave_segment, points.c)
        closest, distant = reported.rule == CLOSEST, reported.distant
        look = exact_points.closest_view if closest else exact_points.slave_normal_view
        view = look(lattice, exact, points.master_segment)
        with np.errstate(divide="ignore"):
            over, xi = np.where(view.cosine > 0, 1 / np.abs(view.cosine), np.inf), view.xi.floats()
        size = view.lengths + distant
        gap_size = size + distant * np.maximum(0, np.maximum(-xi, xi - 1))
        carrier = view.master_length if closest else view.slave_length
        foot_size = gap_size + distant * np.abs(view.gap.floats()) / carrier
        return cls(lattice, points, exact, view, size * over, gap_size * over, foot_size * over)


def _name_places(points: ContactPoints) -> BoolArray:
    placed = np.isfinite(points.slave_shape).all(axis=1) if points.slave_shape.shape[1] else np.isfinite(points.c)
    return np.asarray((points.slave_segment >= 0) & placed)


@random_source("contactverif_properties.shared.exact_places.projected_cases")
def projected_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | SearchStrategy[Case]:
    """Return {kind: strategy} of `PROJECTED_KINDS`, or one strategy for states of a given interface."""
    if interface is not None:
        return st.one_of(projection_states(interface), any_cases(interface))
    return projections_by_kind() | dict(zip(LARGER_MESHES, (general_cases(), tie_cases()), strict=True))


def _largest(values: FloatArray) -> float:
    """Return the largest of some values ≥ 0; NaN if one is NaN, 0 if there are none."""
    return float(np.max(values, initial=0.0))


FLAT, TILTED, LAYERED = "flat faces", "tilted and warped faces", "a second layer of the master"


@random_source("contactverif_properties.shared.face_places.projected_faces")
def _projected_faces(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | None:
    cases = {FLAT: flat_surface_cases(interface), TILTED: surface_cases(interface), LAYERED: layered_cases(interface)}
    if interface is not None and interface.slave.faces.shape[1] + interface.master.faces.shape[1] > 2 * TRIANGLE:
        return None  # A foot on a quadrilateral is a root, and no exact number.
    return {kind: strategy for kind, strategy in cases.items() if strategy is not None}


_define = partial(
    Property.define,
    cases=Cases.random(projected_cases),
    cases_in_space=Cases.random(_projected_faces),
    kinds=PROJECTED_KINDS,
    needs=frozenset({"contact_points"}),
)


class _FacePlaces(NamedTuple):
    """The points of a pass that name a place on a slave face and a master face, and what is exact there."""

    interface: Interface  # In the roles of the pass.
    lattice: exact_points.Lattice
    reported: ContactPoints
    exact: exact_points.ExactFacePoints
    view: exact_points.FaceView  # Of the reported master face, by the rule of the formulation.
    # (n_points,) The length of which rounding is a share: 2 (L + |P − A| + D + |gap| D/h) Π ℓ/h over the cosine. L are
    # the longest edges of both faces, |P − A| is the way from the point to a corner. Rounding the corners of a face at
    # D turns it by D over its height h. Coordinates in a slave face of length ℓ and height h round a place by ℓ/h along
    # it, and the shape functions of the master face change over its own height. So the product is over both faces.
    scale: FloatArray
    slave_edges: FloatArray  # (n_points,) The longest edge of the slave face.
    carrier_height: FloatArray  # (n_points,) The height of the face whose normal is taken.
    # (n_points,) The weight over the square of the lengths, 1 at most. A corner of a cell is a quotient by the width of
    # the cell. So the error of a place counts by the area that it moves.
    share: FloatArray

    @classmethod
    def from_pass(cls, each: Pass, reported: _Reported) -> _FacePlaces:
        named = _name_places(each.points) & (each.points.master_segment >= 0)
        points, slave = each.points.select(named & ~each.points.weighted), each.interface.slave
        lattice = exact_points.Lattice.from_state(each.interface, each.z)
        exact = exact_points.ExactFacePoints.at(lattice, points.slave_segment, points.slave_shape)
        closest = reported.rule == CLOSEST
        view = exact_points.FaceView.of_faces(lattice, exact, points.master_segment, closest=closest)
        slave_height = slave.heights(each.positions)[points.slave_segment]
        carrier = view.heights if closest else slave_height
        edges = _longest_edges(view.corners)
        slave_edges = _longest_edges(each.positions[slave.faces[points.slave_segment]])
        size = edges + slave_edges + np.linalg.norm(view.corners, axis=2).max(axis=1, initial=0.0)
        size += reported.distant * (1 + np.abs(view.gap.floats()) / carrier)
        with np.errstate(divide="ignore"):
            slender = edges / view.heights * slave_edges / slave_height
            scale = 2 * size * slender / np.maximum(view.cosine, 0.0)
        share = np.minimum(np.abs(points.weight) / size**2, 1.0)
        return cls(each.interface, lattice, points, exact, view, scale, slave_edges, carrier, share)

    @property
    def depth_inside(self) -> FloatArray:
        """The depth of each foot (n_points,) inside its face, a length; negative outside."""
        return np.asarray(self.view.shape.floats().min(axis=1, initial=np.inf) * self.view.heights)

    @property
    def beside_border(self) -> BoolArray:
        """True for feet (n_points,) that may lie past the border of the master, by roundoff or more."""
        free = self.interface.master.neighbours[self.reported.master_segment] < 0
        past = self.view.shape.floats() * self.view.heights[:, None] <= 4 * UNIT_ROUNDOFF * self.scale[:, None]
        return np.asarray((np.roll(free, -1, axis=1) & past).any(axis=1))  # Edge b + 1 is opposite corner b.

    def excess(self, positions: FloatArray, rule: str) -> FloatArray:
        """Return how much farther each point's face (n_points,) is than another one with a foot inside, a length.

        Distances that differ by rounding are tied, so floats tell. A rule of `CELLS` may choose anywhere in the slave
        face, where distances are others by the slopes of both.
        """
        excess, gaps = np.zeros(len(self.share)), np.abs(self.view.gap.floats())
        master, slave = (positions[side.faces] for side in (self.interface.master, self.interface.slave))
        outward, edges, slope = turns_of(master)[:, 0], _longest_edges(master), np.zeros(len(master))
        for number in np.unique(self.reported.slave_segment):
            here = np.flatnonzero(self.reported.slave_segment == number)
            look = -outward if rule == CLOSEST else np.broadcast_to(turns_of(slave[[number]])[0, 0], outward.shape)
            front_faces = np.flatnonzero((outward * look).sum(axis=1) < 0)
            look, front = look[front_faces], outward[front_faces]
            product = (front * look).sum(axis=1)
            arms = master[front_faces] - (self.reported.slave_shape[here] @ slave[number])[:, None, None]
            inside = np.ones(arms.shape[:2], bool)
            for k in range(TRIANGLE):
                inside &= (np.cross(arms[:, :, k - 2], arms[:, :, k - 1]) * look).sum(axis=-1) / product > INSIDE
            distance = np.abs((arms[:, :, 0] * front).sum(axis=-1) / product) * _norms(look)
            if rule != CLOSEST:
                inside &= distance <= DEEP * (edges[front_faces] + self.slave_edges[here[0]])
            if rule in CELLS:
                slope[front_faces] = np.sqrt(np.maximum((_norms(front) * _norms(look) / product) ** 2 - 1, 0.0))
                slopes = slope[front_faces] + slope[self.reported.master_segment[here], None]
                distance += self.slave_edges[here[0]] * slopes
            excess[here] = gaps[here] - np.where(inside, distance, np.inf).min(axis=1, initial=np.inf)
        rounding = TIED * gaps + 64 * UNIT_ROUNDOFF * (np.abs(positions).max() + self.scale)
        return np.where(excess > rounding, excess, 0.0)


def _longest_edges(corners: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0.0))


def _refuse_without_rule(traits: Traits) -> str:
    return refuse_unstated(traits, "gap")


def _refuse_unknown_areas(traits: Traits) -> str:
    nodal = traits.rules.penalty == "nodal"
    return "there are no distributed springs" if nodal else refuse_unstated(traits, "penalty")


# Two ends of an overlap are scalar products of two terms, each rounded by 2u of the lengths.
OVERLAP_ROUNDOFF = 8 * UNIT_ROUNDOFF
# A search may call segments tied whose distances differ by so little, and no gap shows which of them it took.
TIED = 1e-12
INSIDE = 2.0**-20  # The least shape function of a foot in a face that another one may have to give way to.
FARTHER = Quantity(
    "distance beyond the nearest segment", "1e-12", "A search may call segments tied that differ by less."
)


@_define(id="projection.segment", rank=320, quantities=(FARTHER,), applicable=_refuse_without_rule)
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
    the master. No face with a foot inside is nearer, by whichever rule, within two longest edges of both along the
    slave's normal. For `cells` that is asked where slopes make no other face nearer elsewhere in the slave face. In a
    third of the cases the master has a second layer. Lengths are those of `projection.place`.

    **Undecided.** Never. The number of exact ties is a detail. A point that names no segment is not judged here.
    """
    reported = _Reported.from_case(case, subject)
    value, ties, broken = 0.0, 0, ""
    for each in reported.passes:
        excess, tied, breach = (_find_farther if reported.in_plane else _find_farther_face)(each, reported)
        value, ties, broken = max(value, _largest(excess)), ties + tied, breach or broken
    details = {"tied points": ties} if reported.in_plane else {}
    return Measurement([FARTHER.check(value, TIED)], broken=broken, details=details, idle=reported.idle)


def _find_farther(each: Pass, reported: _Reported) -> tuple[FloatArray, int, str]:
    """Return how much farther segments are than the right ones over the scale, the number of ties, and a breach."""
    places, ties = _Places.from_pass(each, reported), 0
    segments, facing = places.reported.master_segment, places.view.cosine > 0
    if reported.rule == CLOSEST:
        excess, tied = closest_excess(places.lattice, places.exact, segments)
        ties = int((tied > 1).sum())
    else:
        carrier = places.reported.slave_segment
        excess = seen_excess(places.lattice, places.exact, carrier, segments, cells=reported.rule in CELLS)
    rounded = places.reported.weight <= OVERLAP_ROUNDOFF * (places.view.lengths + reported.distant)
    breach = "" if (facing | rounded).all() else "a master segment does not face the slave segment of its point"
    return excess[facing] / places.scale[facing], ties, breach


def _find_farther_face(each: Pass, reported: _Reported) -> tuple[FloatArray, int, str]:
    places = _FacePlaces.from_pass(each, reported)
    counted = places.view.cosine > 0
    excess = places.excess(each.positions, str(reported.rule))
    if reported.rule != CLOSEST:
        outside = np.where(places.beside_border, 0.0, np.maximum(-places.depth_inside, 0.0)) * places.share
        excess = np.maximum(outside, excess)
    wrong = (places.reported.active & ~counted & (places.share > 4 * UNIT_ROUNDOFF)).any()
    breach = "a master face does not face the slave face of its point" if wrong else ""
    return (excess / places.scale)[counted], 0, breach


GAP = Quantity("error of the gap", "4u", LOCAL_REASON)
XI = Quantity("error of ξ", "4u", FOOT_REASON)
NORMAL = Quantity(
    "error of the normal",
    "8u (1 + D/ℓ)",
    "A difference, a root and a division are rounded, and ends at uD turn a segment.",
)
POSITION = Quantity("error of the position", "4u", "Two products and their sum are rounded, relative to X.")
_ROUNDINGS = {GAP: 4, XI: 4, NORMAL: 8, POSITION: 4}


@_define(id="projection.place", rank=85, quantities=(GAP, XI, NORMAL, POSITION), applicable=_refuse_without_rule)
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
    reported = _Reported.from_case(case, subject)
    find_errors = _find_errors if reported.in_plane else _find_errors_on_faces
    values = np.zeros(len(_ROUNDINGS))
    for each in reported.passes:
        values = np.maximum(values, list(map(_largest, find_errors(each, reported))))
    tolerances = {name: count * UNIT_ROUNDOFF for name, count in _ROUNDINGS.items()}
    return Measurement(check_all(dict(zip(_ROUNDINGS, values.tolist(), strict=True)), tolerances), idle=reported.idle)


def _find_errors(each: Pass, reported: _Reported) -> Iterator[FloatArray]:
    """Yield the errors of gap, ξ, normal and position, each over its scale; NaN only where an active point has NaN."""
    places = _Places.from_pass(each, reported)
    points, view, facing = places.reported, places.view, np.isfinite(places.scale)
    yield _size(view.gap.errors(points.gap) / places.gap_scale, points.active)[facing & ~points.weighted]
    length = view.master_length / places.foot_scale
    yield _size(view.xi.errors(points.xi) * length, points.active)[facing]
    carrier = np.minimum(view.master_length, view.slave_length)  # Rounding the ends of a segment turns it.
    turns = view.normal.errors(points.normal)
    yield _size(np.hypot(turns[:, 0], turns[:, 1]) / (1 + reported.distant / carrier), points.active)[facing]
    # A position counts for all points that name a place, whether they see a master or not.
    points = each.points.select(_name_places(each.points))
    exact = exact_points.ExactPoints.at(places.lattice, points.slave_segment, points.c)
    shifts = exact_points.positions(places.lattice, exact).errors(points.position) / reported.state.largest_coordinate
    yield _size(np.abs(shifts).max(axis=1, initial=0.0), points.active)


def _find_errors_on_faces(each: Pass, reported: _Reported) -> Iterator[FloatArray]:
    """Yield the same of points on faces, with the shape functions of the foot in place of ξ."""
    places = _FacePlaces.from_pass(each, reported)
    points, view, scale, facing = places.reported, places.view, places.scale, np.isfinite(places.scale)
    yield _size(np.abs(view.gap.errors(points.gap)) / scale, points.active)[facing]
    foot = np.abs(view.shape.errors(points.master_shape)).max(axis=1, initial=0.0) * _longest_edges(view.corners)
    yield _size(foot / scale, points.active)[facing]
    turned = 1 + reported.distant / places.carrier_height
    yield _size(np.linalg.norm(view.normal.errors(points.normal), axis=1) / turned, points.active)[facing]
    points = each.points.select(_name_places(each.points))
    exact = exact_points.ExactFacePoints.at(places.lattice, points.slave_segment, points.slave_shape)
    shifts = exact_points.positions(places.lattice, exact).errors(points.position)
    yield _size(np.abs(shifts).max(axis=1, initial=0.0), points.active) / reported.state.largest_coordinate


def _size(errors: FloatArray, active: BoolArray) -> FloatArray:
    return np.where(np.isnan(errors) & ~active, 0.0, np.abs(errors))


LARGE_UNIT = 2.0**-32
WRONG = Quantity("wrong decisions", "0", "A decision is right or wrong; what roundoff or a rule decides is left out.")


def _refuse_other_decisions(traits: Traits) -> str:
    if traits.rules.enforcement == "multiplier":
        return "the enforcement is by a multiplier, which decides in its own way"
    if traits.rules.gap == "cells and nodes":
        return "the slave nodes decide, and the points do not"
    if traits.rules.own_law and traits.rules.law_distance:
        return "the law begins at a gap, and not in touch"
    return _refuse_without_rule(traits)


@_define(id="projection.activity", rank=50, quantities=(WRONG,), applicable=_refuse_other_decisions)
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
    segments, or of two longest edges of both faces. Details say how many points were decided and how many were left
    out. Multipliers have their own decision, λ − c g ≥ 0, and pressures that are interpolated between nodes have the
    nodes' decision, which is not reported; both are not asked.
    """
    # All lengths are divided by 2^32, which rounds nothing; the penalty stays.
    large = replace(case, interface=case.interface.at(case.interface.nodes * LARGE_UNIT), z=case.z * LARGE_UNIT)
    both = [_Reported.from_case(state, subject) for state in (case, large)]
    wrong, decided = zip(*map(_count_decisions, both), strict=True)
    samples = [each.points for each in both]
    at_home = (_name_places(points) & ((points.master_segment >= 0) | points.weighted) for points in samples)
    homeless = any((points.active & ~named).any() for points, named in zip(samples, at_home, strict=True))
    n_points = sum(len(points.c) for points in samples)
    return Measurement(
        [WRONG.check(float(sum(wrong)), 0.0)],
        broken="an active point names no place or no master segment" if homeless else "",
        details={"decided points": sum(decided), "points left out": n_points - sum(decided)},
        idle=not decided[0],
    ).after("" if wrong[0] else "with all lengths times 2^-32", WRONG)


def _count_decisions(reported: _Reported) -> tuple[int, int]:
    wrong = decided = 0
    for each in reported.passes:
        weighted = each.points.select(each.points.weighted)
        sure = np.abs(weighted.gap) > 4 * UNIT_ROUNDOFF * (reported.state.diameter + reported.distant)
        decide = _decide if reported.in_plane else _decide_on_faces
        for active, certain, closed in (decide(each, reported), (weighted.active, sure, weighted.gap < 0)):
            wrong += int((certain & (active != closed)).sum())
            decided += int(certain.sum())
    return wrong, decided


def _decide(each: Pass, reported: _Reported) -> tuple[BoolArray, BoolArray, BoolArray]:
    """Return which points (n_points,) are active, where every right formulation decides alike, and for contact."""
    places = _Places.from_pass(each, reported)
    points, view = places.reported, places.view
    rounding, foot_rounding = 4 * UNIT_ROUNDOFF * places.gap_scale, 4 * UNIT_ROUNDOFF * places.foot_scale
    gap, xi, length = view.gap.floats(), view.xi.floats(), view.master_length
    past = np.stack([-xi, xi - 1], axis=1) * length[:, None]  # Past the first end, and past the second.
    certain = (np.abs(gap) > rounding) & (np.abs(gap) <= DEEP * (length + view.slave_length)) & ~points.weighted
    if reported.rule != CLOSEST:
        return points.active, certain & (past < -foot_rounding[:, None]).all(axis=1), gap < 0
    free = each.interface.master.neighbours[points.master_segment] < 0
    beyond = free & (past >= length[:, None])
    near_end = free & ~beyond & (past > -foot_rounding[:, None])
    facing = exact_points.run_against(places.lattice, places.exact, points.master_segment)
    usable = points.active | (facing & (points.weight != 0))
    return points.active, certain & usable & ~near_end.any(axis=1), (gap < 0) & ~beyond.any(axis=1)


def _decide_on_faces(each: Pass, reported: _Reported) -> tuple[BoolArray, BoolArray, BoolArray]:
    places = _FacePlaces.from_pass(each, reported)
    points, gap, rounding = places.reported, places.view.gap.floats(), 4 * UNIT_ROUNDOFF * places.scale
    shallow = np.abs(gap) <= DEEP * (_longest_edges(places.view.corners) + places.slave_edges)
    certain = (places.view.cosine > 0) & (points.weight != 0) & (np.abs(gap) > rounding) & shallow
    return points.active, certain & (places.depth_inside > rounding), gap < 0


ENDS_REASON = "An end that a master node cuts is a quotient of differences; X is added unless points keep their digits."
WEIGHT = Quantity("weight against the area's ends", "16u", ENDS_REASON)
ENDS = Quantity("area outside its segment, its point or its neighbour", "16u", ENDS_REASON)
SUM = Quantity(
    "error of the sum of weights", "192u", f"{roundoff.WEIGHT_REASON} Nodes that are covered by less are left out."
)


@_define(id="projection.area", rank=210, quantities=(WEIGHT, ENDS, SUM), applicable=_refuse_unknown_areas)
def projection_area(case: Case, subject: Subject) -> Measurement:
    """Areas of competence and weights add up to the slave's length, or to what of it is covered.

    **Question.** Each contact point stands for a length of the slave, its weight. Do the weights add up, and are the
    ends of the areas where the weights say?

    **Why it matters.** The weight is the stiffness of a point. A length that is counted twice, or not at all, is a
    contact that is too stiff or too soft in one place. A sum over the whole interface hides it where two errors cancel.

    **How it is judged.** All points are reported, active or not. A weight is ≥ 0, or negative by rounding. Where ends
    are reported of a point inside its segment, in either order, the weight is the length between them, in the
    configuration of the trait `area` (without the trait, in either); the point lies between them, and areas of one
    segment do not overlap: 16u of the interface's diameter. The sum of the weights is held against an exact length,
    192u of the diameter for each segment. Cells cover what the slave sees along its normal, segment by segment. Closest
    points add up to the slave's length; unless the trait `patch.overhang` is False, they need to only where the whole
    slave faces one master chain in all its normals. Points that look along the slave's normal need to where all of the
    slave sees the master. Elsewhere the sum is at most the slave's length; without a rule in the trait `gap`, that is
    asked only where the slave faces one master chain as above, since cells of averaged normals overlap where a master
    folds back.

    In space a weight is an area, and areas have no ends. The sums are over the diameter
    and the longest edge, or the area's root. Closest points add up to the slave's area where they are all its nodes.

    **Undecided.** Never. The coverage of slave segments that see several bodies behind one another, or one that is
    deeper than two lengths, is not measured. A nodal penalty has no areas and is not asked.
    """
    reported = _Reported.from_case(case, subject)
    values = dict.fromkeys((WEIGHT, ENDS, SUM) if reported.in_plane else (SUM,), 0.0)
    for each in reported.passes:
        find_errors = _find_area_errors if reported.in_plane else _find_sum_error_of_faces
        trials = [find_errors(each, reported, length) for length in _lengths(each, subject.traits)]
        best = min(trials, key=lambda trial: max(trial.values()))
        values = {name: max(value, best[name]) for name, value in values.items()}
    tolerances = {name: {SUM: 64 + roundoff.WEIGHT_ROUNDINGS}.get(name, 16) * UNIT_ROUNDOFF for name in values}
    broken = _area_breach(reported, fits=values[SUM] <= tolerances[SUM])
    return Measurement(check_all(values, tolerances), broken=broken, idle=reported.idle)


def _area_breach(reported: _Reported, *, fits: bool) -> str:
    """Return how the points break the contract, or an empty string; `fits` says that weights have the right sums."""
    points = reported.points
    # What a cell of no more than rounding covers may have either sign.
    rounding = 16 * UNIT_ROUNDOFF * reported.distant ** (reported.state.interface.dim - 1)
    if not (points.weight >= -rounding).all():
        return "a weight is negative or NaN"
    length = sum(float(_lengths(each, reported.traits)[0].sum()) for each in reported.passes)
    if not fits and points.active.all() and float(points.weight.sum()) < length:
        return "every reported point is active, and a part of the slave is missing: report idle points, find all cells"
    return ""


def _lengths(each: Pass, traits: Traits) -> list[FloatArray]:
    """Return the lengths or areas (n_faces,) of the slave in the configurations in which they may be measured."""
    current, reference = (each.interface.slave.measures(nodes) for nodes in (each.positions, each.interface.nodes))
    return {"current": [current], "reference": [reference], None: [current, reference]}[traits.rules.area]


def _find_area_errors(each: Pass, reported: _Reported, length: FloatArray) -> dict[Quantity, float]:
    """Return the errors of weights, ends and sums, for slave segments of a length (n_segments,)."""
    points, distant = each.points, reported.distant
    ends = np.stack([points.area_from, points.area_to])
    within = np.abs(points.c) < 1  # A node may stand for parts of two segments, and its ends for one of them.
    given = np.isfinite(ends).all(axis=0) & _name_places(points) & within
    whole = replace(points, area_from=ends.min(axis=0), area_to=ends.max(axis=0)).select(given)
    current = each.interface.slave.lengths(each.positions)
    size = float(np.hypot(*np.ptp(each.positions, axis=0))) + distant  # Rounding is a share of it.
    scale = len(current) * float((size * length / current).max())
    low, high, on = whole.area_from, whole.area_to, whole.slave_segment
    weights = np.where(whole.weight > 0, np.abs(whole.weight - (high - low) / 2 * length[on]), 0.0)
    outside = np.maximum.reduce([low - whole.c, whole.c - high, -1 - low, high - 1, _overlaps(whole)], initial=0.0)
    return {
        WEIGHT: _largest(weights / (size * (length[on] / current[on]))),
        ENDS: _largest(outside / 2 * current[on] / size),
        SUM: _largest(np.array([_sum_error(each, reported, length) / scale])),
    }


def _sum_error(each: Pass, reported: _Reported, length: FloatArray) -> float:
    """Return the error of the sum of weights, a length; of cells segment by segment, where points lie on one."""
    points, rule, interface = each.points, reported.rule, each.interface
    lattice = exact_points.Lattice.from_state(interface, each.z)
    excess, covered = float(points.weight.sum()) - float(length.sum()), False
    if rule == CLOSEST:
        # The trait speaks of the sum of all passes, so it says something here if there is one.
        covers = reported.traits.promises.patch.overhang is False and not reported.points.on_master.any()
        covered = covers or lies_in_shadow(lattice, interface)
    elif rule is not None:
        coverage = Coverage.along_slave_normals(lattice)
        share, clear = coverage.share.floats(), coverage.clear
        if rule not in CELLS:
            covered = bool(clear.all() and (share == 1).all())
        elif points.weighted.any():
            difference = float(points.weight.sum()) - float((share * length).sum())
            return abs(difference) if clear.all() else 0.0
        else:
            named = points.select(_name_places(points))
            sums = np.bincount(named.slave_segment, named.weight, len(length))
            return _largest(np.abs(sums - share * length)[clear])
    elif not lies_in_shadow(lattice, interface):
        return 0.0
    return abs(excess) if covered else max(excess, 0.0)


def _find_sum_error_of_faces(each: Pass, reported: _Reported, areas: FloatArray) -> dict[Quantity, float]:
    """Return the error of the sums of weights over the scale of areas (n_faces,), face by face where points lie on one.

    An area is a product of lengths of which each is rounded at D, so its scale is L D; on needles the longest edge is
    more than √A.
    """
    points, rule, whole = each.points.select(_name_places(each.points)), reported.rule, float(areas.sum())
    faces = each.interface.slave.faces
    length = max(sqrt(whole), float(_longest_edges(each.positions[faces]).max()))
    scale = len(areas) * length * (length + reported.distant)
    excess = float(points.weight.sum()) - whole
    if rule is None:
        return {SUM: excess / scale}
    if rule == CLOSEST:  # Are the points the slave nodes, all of them?
        corners = faces[points.slave_segment, points.slave_shape.argmax(axis=1)]
        at_nodes = bool((points.slave_shape == 1).any(axis=1).all())
        covered = at_nodes and len(np.unique(corners)) == each.interface.n_slave_nodes
        return {SUM: (abs(excess) if covered else max(excess, 0.0)) / scale}
    lattice = exact_points.Lattice.from_state(each.interface, each.z)
    shares = np.array(exact_points.covered_shares(lattice), dtype=np.float64)
    if (shares > 1).any():  # Master faces lie behind one another.
        return {SUM: 0.0}
    if rule not in CELLS:
        return {SUM: (abs(excess) if (shares == 1).all() else max(excess, 0.0)) / scale}
    errors = np.bincount(points.slave_segment, points.weight, len(areas)) - shares * areas
    return {SUM: (abs(float(errors.sum())) if points.weighted.any() else float(np.abs(errors).max())) / scale}


def _overlaps(points: ContactPoints) -> FloatArray:
    """Return how far each area reaches over the next one on its segment, in c; 0 where there is none with a weight."""
    order = np.lexsort([points.c, points.slave_segment])
    overlaps = np.zeros(len(order))
    if len(order) > 1:
        now, following = order[:-1], order[1:]
        same: BoolArray = points.slave_segment[now] == points.slave_segment[following]
        carrying = (points.weight[now] > 0) & (points.weight[following] > 0)
        overlaps[now] = np.where(same & carrying, points.area_to[now] - points.area_from[following], 0.0)
    return overlaps


STRAIGHT = 2.0**-26  # Normals of a straight slave, whose nodes are rounded far away, differ by less than this.
UNIT = Quantity("length of the normal less 1", "8u", "A difference, a root and a division are rounded.")
FORCES = Quantity(
    "pressures against the slave's forces",
    "u(8D/min(g, ℓ) + 4N) + Δn",
    "Both are sums of N rounded gaps and normals; a straight slave is rounded too.",
)
FOOT = Quantity(
    "position − foot against gap × normal",
    "16u",
    "Each vector is a sum of rounded products, and a segment whose ends are rounded turns by uD/ℓ.",
)
LAW = Quantity("pressure against −ε̂ × gap", "8u", "The gap may be formed anew for the pressure.")


@_define(id="projection.forces", rank=40, quantities=(UNIT, FORCES, FOOT, LAW))
def projection_forces(case: Case, subject: Subject) -> Measurement:
    """The pressures at the contact points are the forces on the slave, and their gaps are what the places show.

    **Question.** Are the pressures at the contact points, over their weights and along their normals, the forces that
    the formulation puts on the slave?

    **Why it matters.** Engineers look at contact pressures and gaps, and not at nodal forces. A report that is not what
    was computed misleads them, and no other question sees it: the forces are right.

    **How it is judged.** These identities hold for right formulations whether they pass the patch test or not:

    - A point with a pressure has a normal of length 1 (8u). A pressure is a number ≥ 0, or negative by the rounding of
      its gap. An idle point carries nothing.
    - A nodal force has the weight 1. A weighted node lies at a node, not inside a segment.
    - −Σ pressure × weight × normal is the residual of the slave. So it is for weighted nodes on a straight slave, up to
      the difference Δn of its normals by rounding, and to 8u over the covered share w/ℓ of a segment. Points of a
      second pass push the master, and the slave by reaction; or each surface has its own points alone (half passes).
    - Position − foot = gap × normal as vectors, where the trait `gap` states a rule and the point is no weighted node.
      Foot and gap along the slave's normal are quotients by the cosine between the surfaces, and rounding the ends of a
      segment turns its normal by uD/ℓ, both of which is allowed for.
    - Pressure = −ε̂ × gap at active points, for a penalty whose traits state the configuration of areas (and with it
      that it is linear), except where pressures are interpolated between nodes.

    Sums are compared over Σ|R|, with u(8D/min(g, ℓ) + 4N). Vectors are compared over X, |gap| D/ℓ and the lengths that
    they are formed from, with 16u, and pressures over ε̂ times the gap and D, with 8u. X takes the place of the
    diameter D where the traits do not promise `translation_stable`. In space vectors are compared over X and the
    lengths of `projection.place`.

    **Undecided.** Never. What does not hold for a formulation by its traits is not measured.
    """
    reported = _Reported.from_case(case, subject)
    points, state, rules = reported.points, reported.state, subject.traits.rules
    reporting = (points.pressure > 0) | np.isfinite(points.normal).all(axis=1)
    values = {UNIT: _largest(np.abs(_norms(points.normal[reporting]) - 1))}
    tolerances = {UNIT: 8 * UNIT_ROUNDOFF, FOOT: 16 * UNIT_ROUNDOFF, LAW: 8 * UNIT_ROUNDOFF}
    if (compared := _compare_forces(reported)) is not None:
        values[FORCES], tolerances[FORCES] = compared
    if rules.gap is not None:
        values[FOOT] = max((_foot_error(each, reported) for each in reported.passes), default=0.0)
    springs = rules.enforcement == "penalty" and rules.penalty == "distributed" and rules.area is not None
    if springs and not rules.own_law and rules.gap not in (None, "cells and nodes"):
        penalty = 1.0 if state.n_multipliers else subject.penalty(state)
        active = points.select(points.active)
        sizes = penalty * (np.abs(active.gap) + reported.distant)
        values[LAW] = _largest(np.abs(active.pressure + penalty * active.gap) / sizes)
    # Whether a point is active may be decided by a gap that is rounded otherwise.
    rounding = 8 * UNIT_ROUNDOFF * subject.penalty(state) * reported.distant if rules.enforcement == "penalty" else 0.0
    broken = _breach(points, subject.traits, rounding)
    return Measurement(check_all(values, tolerances), broken=broken, idle=reported.idle)


def _compare_forces(reported: _Reported) -> tuple[float, float] | None:
    """Return Σ pressure × weight × normal + ΣR of the slave over Σ|R|, and its tolerance; None if it need not be 0.

    A second pass pushes the master. What it does to the slave is the reaction, if forces balance. A gap of roundoff may
    give a pressure in one place and none in the other. So Σ|R| counts for no less than a penetration of u D gives.
    """
    points, state, distant = reported.points, reported.state, reported.distant
    size, bend = roundoff.sum_slave_forces(state, reported.forces), _bend(reported)
    balanced = np.abs(reported.forces.sum(axis=0)).max() <= UNIT_ROUNDOFF * 64 * state.n_segments * size
    if bend > STRAIGHT or (points.on_master.any() and not balanced):  # `balance.force` asks for that.
        return None
    carrying = points.pressure > 0
    pushes = (points.pressure * points.weight)[carrying, None] * points.normal[carrying]
    slave, master = (pushes[points.on_master[carrying] == side].sum(axis=0) for side in (False, True))
    forces = reported.forces[: state.interface.n_slave_nodes].sum(axis=0)
    both = slave - master + forces
    # In half passes each surface is pushed by its own points alone, and hands nothing on.
    alone = max(slave + forces, master - forces, key=lambda difference: float(np.abs(difference).max()))
    difference = min(float(np.abs(both).max()), float(np.abs(alone).max()))
    stiffness = state.penalty * state.slave_measure  # Force per length of penetration.
    size = max(size, UNIT_ROUNDOFF * distant * stiffness)
    reach = min(size / stiffness, state.shortest_segment)
    tolerance = UNIT_ROUNDOFF * (8 * (distant + roundoff.normal_rounding(state)) / reach + 4 * state.n_segments)
    return difference / size, tolerance + bend + 8 * UNIT_ROUNDOFF * _thinness(reported)


def _breach(points: ContactPoints, traits: Traits, rounding: float) -> str:
    inside = (points.slave_shape < 1).all(axis=1) if points.slave_shape.shape[1] else np.abs(points.c) < 1
    if (points.weighted & inside).any():
        return "a weighted node lies inside a segment"
    if traits.rules.penalty == "nodal" and (points.weight[points.active] != 1).any():
        return "a nodal force has a weight other than 1"
    if not (points.pressure[points.active] >= -rounding).all():
        return "a pressure at an active point is negative or NaN"
    if np.nan_to_num(points.pressure[~points.active]).any():
        return "an idle point carries a pressure"
    return ""


def _norms(vectors: FloatArray) -> FloatArray:
    return np.hypot(vectors[:, 0], vectors[:, 1]) if vectors.shape[1] == PLANE else np.linalg.norm(vectors, axis=1)


def _bend(reported: _Reported) -> float:
    """Return by how much the normals of the slave differ where weighted nodes lie on it; 0 if there are none.

    A pressure between two nodes acts along the normal of its segment, and is reported along that of a node.
    """
    bend = 0.0
    for each in reported.passes:
        if each.points.weighted.any():
            ends = each.positions[each.interface.slave.faces]
            if each.interface.dim == PLANE:
                ways = (ends[:, 1] - ends[:, 0]) / each.interface.slave.lengths(each.positions)[:, None]
            else:
                ways = turns_of(ends).sum(axis=1)
                ways /= _norms(ways)[:, None]
            bend = max(bend, float(np.ptp(ways, axis=0).max()))
    return bend


def _thinness(reported: _Reported) -> float:
    """Return the largest slave segment over the weight of an active weighted node on it; 0 if there are none.

    Dual shapes on a covered share of a segment are differences of places, which are rounded by u over that share.
    """
    thinness = 0.0
    for each in reported.passes if reported.in_plane else ():
        points = each.points.select(each.points.weighted & each.points.active & _name_places(each.points))
        length = each.interface.slave.lengths(each.positions)[points.slave_segment]
        with np.errstate(divide="ignore"):
            thinness = max(thinness, _largest(length / points.weight))
    return thinness


def _foot_error(each: Pass, reported: _Reported) -> float:
    """Return the largest |position − foot − gap × normal| over the lengths that these vectors are formed from.

    A foot along the slave's normal is a quotient by the cosine of the angle between the surfaces, and so is its gap. So
    the lengths are over that cosine. A kernel that rounds nodes at D turns the segment whose normal it takes by uD/ℓ,
    which moves the end of gap × normal by |gap| uD/ℓ, and ξ past an end by |ξ| uD/ℓ.
    """
    if each.interface.dim != PLANE:
        places = _FacePlaces.from_pass(each, reported)
        points, nodes = places.reported, each.positions[each.interface.master.faces]
        foot = np.einsum("qk,qki->qi", points.master_shape, nodes[points.master_segment])
        errors = points.position - foot - points.gap[:, None] * points.normal
        return _largest(_norms(errors) / (np.abs(each.positions).max() + places.scale))
    named = _name_places(each.points) & (each.points.master_segment >= 0) & ~each.points.weighted
    points = each.points.select(named & np.isfinite(each.points.gap))
    first, second = np.swapaxes(each.positions[each.interface.master.segments[points.master_segment]], 0, 1)
    arm, along = points.position - first, second - first
    errors = arm - points.xi[:, None] * along - points.gap[:, None] * points.normal
    far = np.abs(each.positions).max()
    length = np.hypot(along[:, 0], along[:, 1])
    carrier = each.interface.slave.lengths(each.positions)[points.slave_segment]
    if reported.rule == CLOSEST:
        carrier = length
    size = far + np.hypot(arm[:, 0], arm[:, 1]) + (1 + np.abs(points.xi)) * length
    size += reported.distant * (np.abs(points.gap) / carrier + np.abs(points.xi))
    cosine = np.abs(along[:, 0] * points.normal[:, 1] - along[:, 1] * points.normal[:, 0]) / length
    return _largest(np.hypot(errors[:, 0], errors[:, 1]) * cosine / size)
