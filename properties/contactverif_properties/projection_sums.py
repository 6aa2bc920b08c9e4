"""The sums over contact points: areas of competence to the slave's length, pressures to the forces on it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.faces import turns_of
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import PLANE
from contactverif.contract.measurement import Measurement, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.oracle.exact_coverage import Coverage, lies_in_shadow
from contactverif.oracle.exact_points import Lattice
from contactverif_properties.shared.exact_places import (
    CELLS,
    CLOSEST,
    Reported,
    define_projection,
    largest,
    name_places,
)
from contactverif_properties.shared.face_places import ON_FACES, FacePlaces, area_error
from contactverif_properties.shared.passes import Pass
from contactverif_properties.shared.roundoff import WEIGHT_REASON, WEIGHT_ROUNDINGS, sum_slave_forces

ENDS_REASON = "An end that a master node cuts is a quotient of differences; X is added unless points keep their digits."
WEIGHT = Quantity("weight against the area's ends", "16u", ENDS_REASON)
ENDS = Quantity("area outside its segment, its point or its neighbour", "16u", ENDS_REASON)
SUM = Quantity("error of the sum of weights", "192u", f"{WEIGHT_REASON} Nodes that are covered by less are left out.")


@define_projection(
    id="projection.area",
    rank=210,
    quantities=(WEIGHT, ENDS, SUM),
    cases_in_space=ON_FACES,
    applicable=lambda traits: "" if traits.rules.penalty == "distributed" else "there are no distributed springs",
)
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
    reported = Reported.from_case(case, subject)
    in_space = case.interface.dim != PLANE
    values = dict.fromkeys((SUM,) if in_space else (WEIGHT, ENDS, SUM), 0.0)
    one_pass = not reported.points.on_master.any()
    for each in reported.passes:
        lengths = _lengths(each, subject.traits)
        if in_space:
            rule, distant = subject.traits.rules.gap, reported.distant
            values[SUM] = max(values[SUM], min(area_error(each, rule, length, distant) for length in lengths))
            continue
        trials = [_Areas(each, subject.traits, length, reported.distant, one_pass).errors() for length in lengths]
        best = min(trials, key=lambda trial: max(trial.values()))
        values = {name: max(value, best[name]) for name, value in values.items()}
    tolerances = {name: {SUM: 64 + WEIGHT_ROUNDINGS}.get(name, 16) * UNIT_ROUNDOFF for name in values}
    fits = values[SUM] <= tolerances[SUM]
    return Measurement(
        check_all(values, tolerances), broken=_area_breach(reported, fits=fits), idle=not reported.points.active.any()
    )


def _area_breach(reported: Reported, *, fits: bool) -> str:
    """Return how the points break the contract, or an empty string; `fits` says that weights have the right sums.

    Idle points are left out if no point is idle, and lengths are missing.
    """
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


@dataclass(frozen=True, slots=True, eq=False)
class _Areas:
    """The points of a pass, the lengths of the slave segments, and the length at which a point may be rounded.

    The trait `patch.overhang` speaks of the sum of all passes, so it says something here if there is one.
    """

    each: Pass
    traits: Traits
    length: FloatArray
    distant: float
    one_pass: bool

    def errors(self) -> dict[Quantity, float]:
        """Return the errors of weights, ends and sums by name."""
        points = self.each.points
        ends = np.stack([points.area_from, points.area_to])
        within = np.abs(points.c) < 1  # A node may stand for parts of two segments, and its ends for one of them.
        given = np.isfinite(ends).all(axis=0) & name_places(points) & within
        whole = replace(points, area_from=ends.min(axis=0), area_to=ends.max(axis=0)).select(given)
        current = self.each.interface.slave.lengths(self.each.positions)
        size = float(np.hypot(*np.ptp(self.each.positions, axis=0))) + self.distant  # Rounding is a share of it.
        scale = len(current) * float((size * self.length / current).max())
        low, high, on = whole.area_from, whole.area_to, whole.slave_segment
        stretch = self.length[on] / current[on]
        weights = np.where(whole.weight > 0, np.abs(whole.weight - (high - low) / 2 * self.length[on]), 0.0)
        outside = np.maximum.reduce([low - whole.c, whole.c - high, -1 - low, high - 1, _overlaps(whole)], initial=0.0)
        return {
            WEIGHT: largest(weights / (size * stretch)),
            ENDS: largest(outside / 2 * current[on] / size),
            SUM: largest(np.array(list(self._sum_errors(scale)))),
        }

    def _sum_errors(self, scale: float) -> Iterator[float]:
        """Yield the errors of sums of weights over the lengths that they are formed from, the scale."""
        points, rule = self.each.points, self.traits.rules.gap
        total, whole = float(points.weight.sum()), float(self.length.sum())
        lattice = Lattice.from_state(self.each.interface, self.each.z)
        if rule in CELLS:
            yield from self._cell_errors(Coverage.along_slave_normals(lattice), scale)
        elif rule is not None or lies_in_shadow(lattice, self.each.interface):
            missing = abs(total - whole) if self._covers_all(lattice) else 0.0
            yield max(total - whole, missing) / scale

    def _covers_all(self, lattice: Lattice) -> bool:
        """Return whether the weights of the points must add up to the slave's length."""
        rule, covers = self.traits.rules.gap, self.traits.promises.patch.overhang
        if rule == CLOSEST:
            return (covers is False and self.one_pass) or lies_in_shadow(lattice, self.each.interface)
        if rule is None:
            return False
        coverage = Coverage.along_slave_normals(lattice)
        return bool(coverage.clear.all() and (coverage.share.floats() == 1).all())

    def _cell_errors(self, coverage: Coverage, scale: float) -> Iterator[float]:
        """Yield the errors of sums over the cells, segment by segment where points lie on one segment."""
        points = self.each.points
        expected = coverage.share.floats() * self.length
        if points.weighted.any():
            if coverage.clear.all():
                yield abs(float(points.weight.sum()) - float(expected.sum())) / scale
            return
        named = points.select(name_places(points))
        sums = np.bincount(named.slave_segment, named.weight, len(self.length))
        yield largest(np.abs(sums - expected)[coverage.clear]) / scale


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


@define_projection(id="projection.forces", rank=40, quantities=(UNIT, FORCES, FOOT, LAW), cases_in_space=ON_FACES)
def projection_forces(case: Case, subject: Subject) -> Measurement:
    """The pressures at the contact points are the forces on the slave, and their gaps are what the places show.

    **Question.** Are the pressures at the contact points, over their weights and along their normals, the forces that
    the formulation puts on the slave?

    **Why it matters.** Engineers look at contact pressures and gaps, and not at nodal forces. A report that is not what
    was computed misleads them, and no other question sees it: the forces are right.

    **How it is judged.** These identities hold for right formulations whether they pass the patch test or not:

    - A point with a pressure has a normal of length 1 (8u). A pressure is a number ≥ 0. An idle point carries nothing.
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
    reported = Reported.from_case(case, subject)
    points, state = reported.points, reported.state
    distance = reported.distant
    values = {UNIT: _normal_error(points)}
    tolerances = {UNIT: 8 * UNIT_ROUNDOFF}
    if (difference := _force_difference(reported)) is not None:
        values[FORCES], tolerance = _compare_forces(reported, difference)
        tolerances[FORCES] = tolerance + _bend(reported) + 8 * UNIT_ROUNDOFF * _thinness(reported)
    if subject.traits.rules.gap is not None:
        values[FOOT] = max((_foot_error(each, reported) for each in reported.passes), default=0.0)
        tolerances[FOOT] = 16 * UNIT_ROUNDOFF
    if _has_linear_law(subject.traits):
        penalty = 1.0 if state.n_multipliers else subject.penalty(state)
        active = points.select(points.active)
        errors = np.abs(active.pressure + penalty * active.gap) / (penalty * (np.abs(active.gap) + distance))
        values[LAW] = largest(errors)
        tolerances[LAW] = 8 * UNIT_ROUNDOFF
    return Measurement(
        check_all(values, tolerances), broken=_breach(points, subject.traits), idle=not points.active.any()
    )


def _compare_forces(reported: Reported, difference: FloatArray) -> tuple[float, float]:
    """Return a difference of forces over Σ|R|, and its tolerance.

    A gap of roundoff may give a pressure in one place and none in the other. So Σ|R| counts for no less than a
    penetration of u D gives.
    """
    state = reported.state
    stiffness = state.penalty * state.slave_measure  # Force per length of penetration.
    size = max(sum_slave_forces(state, reported.forces), UNIT_ROUNDOFF * reported.distant * stiffness)
    reach = min(size / stiffness, state.shortest_segment)
    tolerance = UNIT_ROUNDOFF * (8 * reported.distant / reach + 4 * state.n_segments)
    return float(np.abs(difference).max()) / size, tolerance


def _breach(points: ContactPoints, traits: Traits) -> str:
    """Return how the points break the contract, or an empty string."""
    inside = (points.slave_shape < 1).all(axis=1) if points.slave_shape.shape[1] else np.abs(points.c) < 1
    if (points.weighted & inside).any():
        return "a weighted node lies inside a segment"
    if traits.rules.penalty == "nodal" and (points.weight[points.active] != 1).any():
        return "a nodal force has a weight other than 1"
    if not (points.pressure[points.active] >= 0).all():
        return "a pressure at an active point is negative or NaN"
    if np.nan_to_num(points.pressure[~points.active]).any():
        return "an idle point carries a pressure"
    return ""


def _normal_error(points: ContactPoints) -> float:
    """Return the largest difference of a normal's length from 1, where a point has a pressure or a normal."""
    counted = (points.pressure > 0) | np.isfinite(points.normal).all(axis=1)
    return largest(np.abs(_norms(points.normal[counted]) - 1))


def _norms(vectors: FloatArray) -> FloatArray:
    """Return the lengths (n,) of vectors (n, dim)."""
    return np.hypot(vectors[:, 0], vectors[:, 1]) if vectors.shape[1] == PLANE else np.linalg.norm(vectors, axis=1)


def _force_difference(reported: Reported) -> FloatArray | None:
    """Return Σ pressure × weight × normal + ΣR of the slave (dim,), or None where the two need not be equal.

    A second pass pushes the master. What it does to the slave is the reaction, if forces balance.
    """
    points = reported.points
    size = sum_slave_forces(reported.state, reported.forces)
    balanced = np.abs(reported.forces.sum(axis=0)).max() <= UNIT_ROUNDOFF * 64 * reported.state.n_segments * size
    if points.on_master.any() and not balanced:  # `balance.force` asks for that.
        return None
    if _bend(reported) > STRAIGHT:
        return None
    carrying = points.pressure > 0
    pushes = (points.pressure * points.weight)[carrying, None] * points.normal[carrying]
    slave, master = (pushes[points.on_master[carrying] == side].sum(axis=0) for side in (False, True))
    forces = reported.forces[: reported.state.interface.n_slave_nodes].sum(axis=0)
    both = slave - master + forces
    # In half passes each surface is pushed by its own points alone, and hands nothing on.
    alone = max(slave + forces, master - forces, key=lambda difference: float(np.abs(difference).max()))
    nearest: FloatArray = min(both, alone, key=lambda difference: float(np.abs(difference).max()))
    return nearest


def _bend(reported: Reported) -> float:
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


def _thinness(reported: Reported) -> float:
    """Return the largest slave segment over the weight of an active weighted node on it; 0 if there are none.

    Dual shapes on a covered share of a segment are differences of places, which are rounded by u over that share.
    """
    thinness = 0.0
    for each in reported.passes if reported.state.interface.dim == PLANE else ():
        points = each.points.select(each.points.weighted & each.points.active & name_places(each.points))
        length = each.interface.slave.lengths(each.positions)[points.slave_segment]
        with np.errstate(divide="ignore"):
            thinness = max(thinness, largest(length / points.weight))
    return thinness


def _foot_error(each: Pass, reported: Reported) -> float:
    """Return the largest |position − foot − gap × normal| over the lengths that these vectors are formed from.

    A foot along the slave's normal is a quotient by the cosine of the angle between the surfaces, and so is its gap. So
    the lengths are over that cosine. A kernel that rounds nodes at D turns the segment whose normal it takes by uD/ℓ,
    which moves the end of gap × normal by |gap| uD/ℓ, and ξ past an end by |ξ| uD/ℓ.
    """
    if each.interface.dim != PLANE:
        places = FacePlaces.from_pass(each, reported.traits.rules.gap, reported.distant)
        points, nodes = places.reported, each.positions[each.interface.master.faces]
        foot = np.einsum("qk,qki->qi", points.master_shape, nodes[points.master_segment])
        errors = points.position - foot - points.gap[:, None] * points.normal
        return largest(_norms(errors) / (np.abs(each.positions).max() + places.scale))
    named = name_places(each.points) & (each.points.master_segment >= 0) & ~each.points.weighted
    points = each.points.select(named & np.isfinite(each.points.gap))
    first, second = np.swapaxes(each.positions[each.interface.master.segments[points.master_segment]], 0, 1)
    arm, along = points.position - first, second - first
    errors = arm - points.xi[:, None] * along - points.gap[:, None] * points.normal
    far = np.abs(each.positions).max()
    length = np.hypot(along[:, 0], along[:, 1])
    carrier = each.interface.slave.lengths(each.positions)[points.slave_segment]
    if reported.traits.rules.gap == CLOSEST:
        carrier = length
    size = far + np.hypot(arm[:, 0], arm[:, 1]) + (1 + np.abs(points.xi)) * length
    size += reported.distant * (np.abs(points.gap) / carrier + np.abs(points.xi))
    cosine = np.abs(along[:, 0] * points.normal[:, 1] - along[:, 1] * points.normal[:, 0]) / length
    return largest(np.hypot(errors[:, 0], errors[:, 1]) * cosine / size)


def _has_linear_law(traits: Traits) -> bool:
    """Return whether a pressure is −ε̂ × the gap that is reported beside it."""
    if traits.rules.enforcement != "penalty" or traits.rules.gap in (None, "cells and nodes"):
        return False
    return traits.rules.penalty == "distributed" and traits.rules.area is not None
