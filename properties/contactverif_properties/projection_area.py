"""Ask whether the areas of competence add up to the slave's length, or to what of it is covered.

**Question.** Each contact point stands for a length of the slave, its weight. Do the weights add up, and are the ends
of the areas where the weights say?

**Why it matters.** The weight is the stiffness of a point. A length that is counted twice, or not at all, is a contact
that is too stiff or too soft in one place. A sum over the whole interface hides it where two errors cancel.

**How it is judged.** All points are reported, active or not. A weight is a number ≥ 0. Where ends are reported of a
point inside its segment, in either order, the weight is the length between them, in the configuration of the trait
`area` (without the trait, in either); the point lies between them, and areas of one segment do not overlap: 16u of the
interface's diameter. The sum of the weights is held against an exact length, 64u of the diameter for each segment.
Cells cover what the slave sees along its normal, segment by segment. Closest points add up to the slave's length;
unless the trait `covers_overhang` is False, they need to only where the whole slave faces one master chain in all its
normals. Points that look along the slave's normal need to where all of the slave sees the master. Elsewhere the sum is
at most the slave's length; without a rule in the trait `gap`, that is asked only where the slave faces one master chain
as above, since cells of averaged normals overlap where a master folds back.

**Undecided.** Never. The coverage of slave segments that see several bodies behind one another, or one that is deeper
than two lengths, is not measured. A nodal penalty has no areas and is not asked.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.oracle.exact_coverage import Coverage, lies_in_shadow
from contactverif.oracle.exact_points import Lattice
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.exact_places import (
    CELLS,
    CLOSEST,
    PROJECTED_KINDS,
    Reported,
    largest,
    name_places,
    projected_cases,
)
from contactverif_properties.shared.passes import Pass

ENDS_REASON = "An end that a master node cuts is a quotient of differences; X is added unless points keep their digits."
WEIGHT = Quantity("weight against the area's ends", "1", "16u", ENDS_REASON)
ENDS = Quantity("area outside its segment, its point or its neighbour", "1", "16u", ENDS_REASON)
SUM = Quantity(
    "error of the sum of weights", "1", "64u", "As above; nodes that are covered by less than that are left out."
)


def measure_areas(case: Case, subject: Subject) -> Measurement:
    """Hold weights against the ends of areas, and their sums against exact lengths.

    Parameters
    ----------
    case : Case
        Any state.
    subject : Subject
        A formulation with a distributed penalty or with multipliers that are pressures.

    Returns
    -------
    Measurement
        The largest difference of a weight from the length of its area, the largest length by which an area leaves its
        segment, its point or overlaps another, both over the lengths that it is formed from; the error of a sum over
        the same. All are dimensionless. Broken: a weight is negative or NaN, or idle points are left out.
    """
    reported = Reported.from_case(case, subject)
    values = dict.fromkeys((WEIGHT, ENDS, SUM), 0.0)
    one_pass = not reported.points.on_master.any()
    for each in reported.passes:
        lengths = _lengths(each, subject.traits)
        trials = [_Areas(each, subject.traits, length, reported.distant, one_pass).errors() for length in lengths]
        best = min(trials, key=lambda trial: max(trial.values()))
        values = {name: max(value, best[name]) for name, value in values.items()}
    tolerances = {WEIGHT: 16 * UNIT_ROUNDOFF, ENDS: 16 * UNIT_ROUNDOFF, SUM: 64 * UNIT_ROUNDOFF}
    fits = values[SUM] <= tolerances[SUM]
    return Measurement(
        check_all(values, tolerances), broken=_breach(reported, fits=fits), idle=not reported.points.active.any()
    )


def _breach(reported: Reported, *, fits: bool) -> str:
    """Return how the points break the contract, or an empty string; `fits` says that weights have the right sums.

    Idle points are left out if no point is idle, and lengths are missing.
    """
    points = reported.points
    if not (points.weight >= 0).all():
        return "a weight is negative or NaN"
    length = sum(float(_lengths(each, reported.traits)[0].sum()) for each in reported.passes)
    if not fits and points.active.all() and float(points.weight.sum()) < length:
        return "every reported point is active, and a length is missing: report all contact points, active or not"
    return ""


def _lengths(each: Pass, traits: Traits) -> list[FloatArray]:
    """Return the lengths (n_segments,) of the slave in the configurations in which areas may be measured."""
    current, reference = (each.interface.slave.lengths(nodes) for nodes in (each.positions, each.interface.nodes))
    return {"current": [current], "reference": [reference], None: [current, reference]}[traits.area]


@dataclass(frozen=True, slots=True, eq=False)
class _Areas:
    """The points of a pass, the lengths of the slave segments, and the length at which a point may be rounded.

    The trait `covers_overhang` speaks of the sum of all passes, so it says something here if there is one.
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
        size = self._size_of_segments()
        low, high, on = whole.area_from, whole.area_to, whole.slave_segment
        stretch = self.length[on] / self._current()[on]
        weights = np.where(whole.weight > 0, np.abs(whole.weight - (high - low) / 2 * self.length[on]), 0.0)
        outside = np.maximum.reduce([low - whole.c, whole.c - high, -1 - low, high - 1, _overlaps(whole)], initial=0.0)
        return {
            WEIGHT: largest(weights / (size[on] * stretch)),
            ENDS: largest(outside / 2 * self._current()[on] / size[on]),
            SUM: largest(np.array(list(self._sum_errors(size)))),
        }

    def _current(self) -> FloatArray:
        return self.each.interface.slave.lengths(self.each.positions)

    def _size_of_segments(self) -> FloatArray:
        """Return for each slave segment the length of which rounding is a share: the diameter and `distant`."""
        diameter = float(np.hypot(*np.ptp(self.each.positions, axis=0)))
        return np.full(len(self.length), diameter + self.distant)

    def _sum_errors(self, size: FloatArray) -> Iterator[float]:
        """Yield the errors of sums of weights, over the lengths that they are formed from."""
        points, slave = self.each.points, self.each.interface.slave
        rule = self.traits.gap
        scale = len(slave) * float((size * self.length / self._current()).max())
        total, whole = float(points.weight.sum()), float(self.length.sum())
        lattice = Lattice.from_state(self.each.interface, self.each.z)
        if rule in CELLS:
            yield from self._cell_errors(Coverage.along_slave_normals(lattice), scale)
        elif rule is not None or lies_in_shadow(lattice, self.each.interface):
            missing = abs(total - whole) if self._covers_all(lattice) else 0.0
            yield max(total - whole, missing) / scale

    def _covers_all(self, lattice: Lattice) -> bool:
        """Return whether the weights of the points must add up to the slave's length."""
        rule, covers = self.traits.gap, self.traits.covers_overhang
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


def refuse(traits: Traits) -> str:
    """Return why there are no areas to judge, or an empty string."""
    if traits.penalty != "distributed":
        return "there are no distributed springs"
    return refuse_barrier(traits)


PROJECTION_AREA = Property(
    id="projection.area",
    family="projection",
    summary="Areas of competence and weights add up to the slave's length, or to what of it is covered.",
    quantities=(WEIGHT, ENDS, SUM),
    cases=projected_cases,
    kinds=PROJECTED_KINDS,
    measure=measure_areas,
    promise=lambda traits: True,
    needs=frozenset({"contact_points"}),
    applicable=refuse,
)
