"""Ask whether contact is where the gap is closed and the foot is on the master.

**Question.** Is a contact point active exactly where its gap is not open and its foot lies on the surface?

**Why it matters.** One wrong decision is a force that is missing or one too many. An absolute epsilon in the decision
works for parts in millimetres and fails for the same part in metres. A decision taken from a neighbour is right on
every flat patch.

**How it is judged.** The exact gap of the point to its reported segment decides. The number of wrong decisions must be
0. A weighted node is judged by the weighted gap that it reports.

**Undecided.** A point is left out where formulations may decide either way: a gap of roundoff, 4u(L + |P − A| + D); a
foot past a free end by up to one segment, since each formulation has its own tolerance τ; an idle point whose slave
segment does not face the master, or that has no weight; a penetration of more than two lengths of both segments.
Details say how many points were decided and how many were left out. Multipliers have their own decision, λ − c g ≥ 0,
and pressures that are interpolated between nodes have the nodes' decision, which is not reported; both are not asked.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.oracle.exact_choices import DEEP
from contactverif_properties.shared.exact_places import (
    CLOSEST,
    PROJECTED_KINDS,
    Places,
    Reported,
    name_places,
    projected_cases,
    refuse_without_rule,
)

LARGE_UNIT = 2.0**-32
WRONG = Quantity(
    "wrong decisions", "1", "0", "A decision is right or wrong; what roundoff or a rule decides is left out."
)


def measure_activity(case: Case, subject: Subject) -> Measurement:
    """Count the points whose decision is wrong.

    Parameters
    ----------
    case : Case
        Any state.
    subject : Subject
        A penalty formulation that states its rule in the trait `gap`.

    Returns
    -------
    Measurement
        The number of wrong decisions, in the state and in the scaled one. Broken: an active point names no place, or no
        master segment. Details: how many points were decided, and how many were left out.
    """
    here, small = (_count(Reported.from_case(state, subject)) for state in (case, _in_large_unit(case)))
    excluded = here.points + small.points - here.decided - small.decided
    return Measurement(
        [WRONG.check(float(here.wrong + small.wrong), 0.0)],
        broken=here.broken or small.broken,
        details={"decided points": here.decided + small.decided, "points left out": excluded},
        idle=not here.decided,
    )


def _in_large_unit(case: Case) -> Case:
    """Return the state with all lengths divided by 2^32, which rounds nothing; the penalty stays."""
    interface = case.interface.at(case.interface.nodes * LARGE_UNIT)
    return replace(case, interface=interface, z=case.z * LARGE_UNIT)


@dataclass(frozen=True, slots=True)
class _Count:
    """The numbers of points, of decided points and of wrong decisions in a state, and what is broken there."""

    points: int
    decided: int
    wrong: int
    broken: str


def _count(reported: Reported) -> _Count:
    """Count the decisions in one state."""
    rule, wrong, decided = reported.traits.gap, 0, 0
    for each in reported.passes:
        weighted = each.points.select(each.points.weighted)
        local = Places.from_pass(each, rule, reported.distant)
        certain, closed = _decide(local, rule)
        wrong += int((certain & (local.reported.active != closed)).sum())
        decided += int(certain.sum())
        sure = np.abs(weighted.gap) > 4 * UNIT_ROUNDOFF * (reported.state.diameter + reported.distant)
        wrong += int((sure & (weighted.active != (weighted.gap < 0))).sum())
        decided += int(sure.sum())
    broken = "an active point names no place or no master segment" if _without_place(reported.points).any() else ""
    return _Count(len(reported.points.c), decided, wrong, broken)


def _without_place(points: ContactPoints) -> BoolArray:
    """Return which points are active but cannot be: without a place, or without a master segment for a gap there."""
    homeless: BoolArray = points.active & ~(name_places(points) & ((points.master_segment >= 0) | points.weighted))
    return homeless


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


def refuse(traits: Traits) -> str:
    """Return why the decision is not known from the gap, or an empty string."""
    if traits.enforcement != "penalty":
        return f"the enforcement is by a {traits.enforcement}, which decides in its own way"
    if traits.gap == "cells and nodes":
        return "the slave nodes decide, and the points do not"
    return refuse_without_rule(traits)


PROJECTION_ACTIVITY = Property(
    id="projection.activity",
    family="projection",
    summary="A contact point is active exactly where its gap is closed and its foot is on the master.",
    quantities=(WRONG,),
    cases=projected_cases,
    kinds=PROJECTED_KINDS,
    measure=measure_activity,
    promise=lambda traits: True,
    needs=frozenset({"contact_points"}),
    applicable=refuse,
)
