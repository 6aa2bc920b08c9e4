"""Straight slaves on a flat part of the master: tilted, so that the gap is linear, and with a bend beside that part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis.strategies import SearchStrategy

from contactverif.contract.case import Case
from contactverif.contract.cases import Cases, random_source
from contactverif.contract.interface import Interface
from contactverif.contract.measurement import Measurement, check_all
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.strategies.straight import bent_end_cases, steep_cases, tilted_cases
from contactverif.strategies.surfaces import tilted_plane_cases
from contactverif_properties.shared import linear_gaps, roundoff
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.kinks import explain_by_kink
from contactverif_properties.shared.same_answer import Carry, compare, same_answer_quantities
from contactverif_properties.shared.worst_force import distance_from_line, worst_force

OFF_NORMAL = roundoff.stated_gap_quantity("part of the force off the normal")
TOTAL = roundoff.stated_gap_quantity("error of the total force")
NODAL = roundoff.stated_gap_quantity("error of a nodal force")
AFTER_A_BEND = same_answer_quantities("after a bend elsewhere")
TILTED, STEEP = "tilted by 3° to 35°", "tilted by 35° to 89°"


@random_source("contactverif_properties.straight_slaves.resultant_cases")
def resultant_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | None:
    """Return {kind: strategy} of tilted and of steep slaves; None for a given mesh."""
    tilted, steep = tilted_cases(interface), steep_cases(interface)
    return {TILTED: tilted, STEEP: steep} if tilted is not None and steep is not None else None


def refuse_unknown_direction(traits: Traits) -> str:
    """Return why the direction of the forces is unknown from the traits, or an empty string if they state it."""
    stated = traits.rules.force_along is not None
    return "" if stated else "the trait `force_along` is not stated, so the direction of the force is unknown"


def _tolerance(case: Case, traits: Traits) -> float:
    """Return `STATED_GAP_TOLERANCE` as a number, for the mean penetration."""
    return roundoff.gap_tolerance(
        case, abs(float(linear_gaps.node_gaps(case).mean())), roundoff.rounding_distance(case, traits)
    )


@Property.define(
    id="patch.tilted.resultant",
    rank=250,
    family="patch",
    quantities=(OFF_NORMAL, TOTAL),
    cases=Cases.by_kind(resultant_cases),
    cases_in_space=Cases.random(tilted_plane_cases),
    kinds=(TILTED, STEEP),
    promise=lambda traits: True if traits.rules.force_along else None,
    applicable=refuse_unknown_direction,
)
def patch_tilted_resultant(case: Case, subject: Subject) -> Measurement:
    """A straight slave, tilted against a flat master, gets the force ε̂ ∫ |g| ds along the stated normal.

    **Question.** A straight slave is tilted against a flat master by 3° to 89°, and penetrates it with all its length.
    In space it is a plane, tilted by up to 19°. Is the force on the slave ε̂ ∫ |g| ds, along the normal that the traits
    name?

    **Why it matters.** Flat patch tests never tilt a surface. A pressure that falls with the tilt, for example with its
    cosine squared, passes all of them, and is wrong on every curved part.

    **How it is judged.** The gap is linear along the slave, so its integral is exact for every rule: points with
    weights that balance, cells, nodal areas. The trait `gap` names the normal along which gaps are measured,
    `force_along` that along which contact pushes, `area` the configuration of ds. The first number is the part of the
    total force off that normal, over the total. The second is the error of the total force over its exact size, where
    `penalty` and `area` are stated. Multipliers that are pressures are uniform here, and nodal springs are asked for
    the direction alone. The tolerance is u(8Z/|g| + 4N + 128), where Z is the diameter of a formulation that promises
    `translation_stable`, and the largest coordinate of any other.

    In half of the cases the tilt is 35° to 89°, and no coordinate is rounded. Gaps along the slave's normal are up to
    57 times those along the master's there, and yet no longer than two master segments, so that every search finds
    them. A formulation that states no rule `gap` may overlook a slave so steep, and give no force at all.

    **Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X
    changes the answer by a quarter of the error or more.
    """
    traits, total = subject.traits, linear_gaps.slave_forces(case, subject).sum(axis=0)
    if not total.any() and _may_overlook(case, traits):
        return Measurement()
    normal = linear_gaps.directions(case)[0 if traits.rules.force_along == "master normal" else 1]
    push, across = float(total @ normal), distance_from_line(total, normal)
    broken = "" if push > 0 else "nothing pushes the slave out of the master"
    values = {OFF_NORMAL: roundoff.ratio(across, float(np.linalg.norm(total)))}
    errors = {OFF_NORMAL: across}
    if linear_gaps.knows_linear_total(traits):
        exact = float(np.linalg.norm(linear_gaps.exact_slave_forces(case, traits).sum(axis=0)))
        errors[TOTAL] = abs(push - exact)
        values[TOTAL] = errors[TOTAL] / exact
    tolerance = _tolerance(case, traits)
    error = max((error for name, error in errors.items() if values[name] > tolerance), default=0.0)
    formulation, undecided = subject.for_case(case), ""
    if error and not formulation.n_multipliers(case.interface):
        reach = roundoff.COORDINATE_ROUNDING * case.largest_coordinate
        undecided = explain_by_kink(FrozenState.at(formulation, case), reach, {"forces": error})
    return Measurement(check_all(values, tolerance), undecided, broken)


def _may_overlook(case: Case, traits: Traits) -> bool:
    """Return whether no stated rule says that the slave sees what it is so steep to."""
    return case.kind == STEEP and traits.rules.gap is None


def refuse_unknown_integral(traits: Traits) -> str:
    """Return why no exact nodal force follows from the traits, or an empty string if one does."""
    if traits.rules.enforcement == "multiplier":
        return "multipliers have pressures of their own, not those of a gap"
    if not linear_gaps.knows_linear_total(traits):
        return "the traits `penalty`, `area`, `gap` and `force_along` do not state all of the integral"
    return ""


@Property.define(
    id="patch.tilted.nodal",
    rank=370,
    family="patch",
    quantities=(NODAL,),
    cases=Cases.random(tilted_cases),
    cases_in_space=Cases.random(tilted_plane_cases),
    promise=lambda traits: traits.promises.integrates_linear_gap,
    applicable=refuse_unknown_integral,
)
def patch_tilted_nodal(case: Case, subject: Subject) -> Measurement:
    """Each node of a straight, tilted slave gets the exact integral of its linear gap.

    **Question.** A straight slave is tilted against a flat master and penetrates it with all its length, so that the
    gap is linear. Is the force on each node of the slave ε̂ ∫ N_i |g| ds?

    **Why it matters.** A method that integrates a linear pressure exactly takes bending and Hertz-like pressures on
    coarse meshes better than one that knows constant pressures alone. Many good methods do not: those with points in
    the middle of parts, and mortar methods, whose pressures come from weighted means.

    **How it is judged.** The largest error of a nodal force on the slave counts over the total. Gap, direction and
    lengths follow from the traits as in `patch.tilted.resultant`. The tolerance is u(8Z/|g| + 4N + 128), likewise.

    **Undecided.** Never: the slave is in contact with all its length, and far from the ends of the master.
    """
    exact, forces = linear_gaps.exact_slave_forces(case, subject.traits), linear_gaps.slave_forces(case, subject)
    error = float(np.linalg.norm(forces - exact, axis=1).max()) / float(np.linalg.norm(exact.sum(axis=0)))
    number = NODAL.check(error, _tolerance(case, subject.traits))
    finding = worst_force(case.interface, forces, exact) if number.ratio > 1 else None
    return Measurement([number], idle=not forces.any(), finding=finding)


@Property.define(
    id="locality.bend",
    rank=260,
    family="invariants",
    quantities=AFTER_A_BEND,
    cases=Cases.random(bent_end_cases),
    promise=lambda traits: traits.promises.local,
)
def locality_bend(case: Case, subject: Subject) -> Measurement:
    """A bend of the master's unloaded neighbours changes neither forces nor tangent.

    **Question.** A slave lies on a flat part of the master. The unloaded segments on both sides of that part turn about
    its ends by −0.3 to 0.9 rad. Are forces and tangent those of before?

    **Why it matters.** Contact acts between what touches. A formulation that makes its springs softer where the surface
    bends, by averaged normals or by an estimate of the curvature, answers for a part of the surface that carries
    nothing. On flat parts nothing shows, and at a bend every formulation may differ from every other.

    **How it is judged.** The largest change of a nodal force counts over Σ|R| of the slave, that of an entry of the
    tangent over max|K|. The slave stays away from the ends of the flat part by more than two penetrations, so no point
    comes nearer to a bent segment than to the flat part, along any normal. The tolerance is u(8Z/min(g, ℓ) + 4N),
    because a right formulation may subtract the mean of all nodes first. Formulations that compare nodes of facing
    segments alone give 0. Smoothed masters do not promise `local`, and may say so.

    **Undecided.** A failing case is undecided where a state lies at a kink, or where moving the nodes by 64 u X changes
    the answer by a quarter of the error or more.
    """
    bent = replace(case, z=case.parameters["bent"])
    return compare(AFTER_A_BEND, subject, case, bent, Carry(np.arange(case.interface.n_nodes)))
