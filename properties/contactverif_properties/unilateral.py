"""Ask whether contact pushes, is where the surfaces penetrate, and nowhere else.

**Question.** A flat interface is lifted until all gaps are open, and until all but one end is open. Is there no force
across an open gap, none far from the contact zone, and some where the surfaces penetrate? Does that force push the
slave, and does no contact point pull, there and on interfaces of any shape?

**Why it matters.** A force across an open gap is adhesion, or a force from nowhere. A contact that never begins lets
bodies pass through each other. A point that pulls where its gap has opened beside others that are closed is adhesion
too; it hides in nodal forces that push as a whole.

**How it is judged.** The first number is the largest nodal force across the open gap over ε̂ |g| L, with all
multipliers 0. The second is, with springs alone, the largest force of a slave node two or more segments from the
closed end over the largest force of a node. Both must be exactly 0: an open contact is left out, not rounded away.
The third is the largest negative pressure of a contact point over the largest of all points, where points are
reported; it may be as large as rounding the positions makes a gap. Where the surfaces penetrate and nothing begins, or
the slave is pulled as a whole, the case fails in words. What single nodes may do is asked by `nodal-push`.

**Undecided.** A case in which nothing begins is undecided if moving the nodes by 64 u X makes contact begin one way
and not another: a node that faces a free end exactly is over the master or not, as roundoff decides. Where contact
begins whichever way the nodes move, the case fails.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import Array, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.result import OPPOSITE_SIGN
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif_properties.shared.any_state import prepare_state
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.directions import random_moves
from contactverif_properties.shared.openings import (
    ANY_SHAPE,
    FLAT,
    lift_slave,
    nodes_far_from_contact,
    open_all_but_one_end,
    pushing_cases,
)
from contactverif_properties.shared.roundoff import (
    COORDINATE_ROUNDING,
    SEGMENT_REASON,
    SEGMENT_TOLERANCE,
    segment_tolerance,
)
from contactverif_properties.shared.uniform_pressure import unit_forces

N_MOVES = 64  # So many moves that a slave of two nodes that hang at free ends is moved off them in one of them.
REASON = "An open contact is left out, not rounded away."
OPEN = Quantity("force across an open gap", "1", "0", REASON)
DISTANT = Quantity("force far from the contact zone", "1", "0", REASON)
PULL = Quantity("pull of a contact point", "1", SEGMENT_TOLERANCE, SEGMENT_REASON)


def measure_unilateral(case: Case, subject: Subject) -> Measurement:
    """Measure forces where there may be none, and pressures that pull.

    Parameters
    ----------
    case : Case
        A case of `pushing_cases`; only a flat one, with the parameter `penetration`, is lifted.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        Those of `measure_flat_contact`, or the pull of a contact point alone.
    """
    if "penetration" in case.parameters:
        return measure_flat_contact(case, subject)
    formulation, state = prepare_state(case, subject)
    forces = _forces(formulation, state)[: case.interface.n_unknowns]
    values, tolerances = _pull_of_points(formulation, state)
    return Measurement(check_all(values, tolerances), idle=not forces.any())


def measure_flat_contact(case: Case, subject: Subject) -> Measurement:
    """Lift a flat interface until all gaps are as wide as the penetration was deep, and until all but an end is open.

    Parameters
    ----------
    case : Case
        A flat case with the parameter `penetration`, a length.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The largest force across the open gap over ε̂ |g| L. The largest force far from the contact zone over the largest
        force; missing where no node is that far, and with multipliers, since `complementarity` judges those that pull.
        The pull of a contact point, in the flat state and where one end alone is closed. Broken: nothing begins where
        the surfaces penetrate, or the slave is pulled.
    """
    formulation, interface = subject.for_case(case), case.interface
    depth, n = case.parameter("penetration"), interface.n_unknowns
    count = formulation.n_multipliers(interface)
    size = case.penalty * depth * case.slave_length
    raised = lift_slave(case, 2 * depth).with_multipliers(np.zeros(count))
    values = {OPEN: float(np.abs(_forces(formulation, raised)[:n]).max()) / size}
    distant, one_end = nodes_far_from_contact(case), open_all_but_one_end(case)
    if not count and distant.any():
        forces = np.linalg.norm(_forces(formulation, one_end).reshape(-1, 2)[: len(distant)], axis=1)
        values[DISTANT] = float(forces[distant].max() / forces.max()) if forces.any() else 0.0
    tolerances = dict.fromkeys(values, 0.0)
    pulls = [_pull_of_points(formulation, prepare_state(state, subject)[1]) for state in (case, one_end)]
    pull, tolerance = max(pulls, key=lambda each: each[0].get(PULL, 0.0) / each[1].get(PULL, 1.0))
    pushes = _contact_forces(formulation, case)
    broken = "" if pushes.any() else "nothing begins where the surfaces penetrate"
    undecided = ""
    if broken:
        begins = {bool(_contact_forces(formulation, moved).any()) for moved in _move_by_roundoff(case)}
        undecided = "a kink: moved by roundoff, it begins one way and not another" if len(begins) == 2 else ""
    elif _push_of_slave(pushes, case) < 0:
        broken = OPPOSITE_SIGN
    return Measurement(check_all(values | pull, tolerances | tolerance), undecided, broken, idle=bool(undecided))


def _contact_forces(formulation: CheckedFormulation, case: Case) -> Array:
    """Return the residual of the nodes (n_unknowns,): of springs, or of multipliers that are all 1."""
    count = formulation.n_multipliers(case.interface)
    if not count:
        return _forces(formulation, case)
    state = case.with_multipliers(np.zeros(count))
    columns = unit_forces(state, formulation, formulation.pair(case.interface, state.z))
    total: FloatArray = columns.sum(axis=1)
    return total


def _push_of_slave(residual: Array, case: Case) -> float:
    """Return the total force on the slave along the master's outward normal."""
    x, y = case.parameters["direction"]
    return -float((residual.reshape(-1, 2)[: case.interface.n_slave_nodes] @ np.array([-y, x])).sum())


def _pull_of_points(
    formulation: CheckedFormulation, state: Case
) -> tuple[dict[Quantity, float], dict[Quantity, float]]:
    """Return the largest negative pressure over the largest of all, and its tolerance; nothing without points."""
    if "contact_points" not in formulation.provides:
        return {}, {}
    pairing = formulation.pair(state.interface, state.z)
    points = formulation.contact_points(state.interface, pairing, state.z)
    pressure = points.pressure[np.isfinite(points.pressure)]
    largest, pull = (float(np.max(sign * pressure, initial=0.0)) for sign in (1, -1))
    forces = formulation.residual(state.interface, pairing, state.z)
    value = pull / max(largest, pull) if pull else 0.0
    return {PULL: value}, {PULL: segment_tolerance(state, forces, state.largest_coordinate)}


def _move_by_roundoff(case: Case) -> Iterator[Case]:
    """Yield the case with its nodes moved at random by what roundoff may do."""
    reach = COORDINATE_ROUNDING * case.largest_coordinate
    for direction in random_moves(case.seed, N_MOVES, case.z.size):
        yield replace(case, z=case.z + reach * direction)


def _forces(formulation: CheckedFormulation, case: Case) -> Array:
    return formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z)


UNILATERAL = Property(
    id="unilateral",
    family="invariants",
    summary="Contact pushes where surfaces penetrate; no force acts across an open gap or far from the contact zone.",
    quantities=(OPEN, DISTANT, PULL),
    cases=pushing_cases,
    kinds=(FLAT, ANY_SHAPE),
    measure=measure_unilateral,
    promise=lambda traits: True,
    applicable=refuse_barrier,
)
