"""Ask whether contact is where the surfaces penetrate, and nowhere else.

**Question.** A flat interface is lifted until all gaps are open, and until all but one end is open. Is there no force
across an open gap, none far from the contact zone, and some where the surfaces penetrate?

**Why it matters.** A force across an open gap is adhesion, or a force from nowhere. A contact that never begins lets
bodies pass through each other.

**How it is judged.** The first number is the largest nodal force across the open gap over ε̂ |g| L, with all
multipliers 0. The second is, with springs alone, the largest force of a slave node two or more segments from the
closed end over the largest force of a node. Both must be exactly 0: an open contact is left out, not rounded away.
Where the surfaces penetrate and nothing begins, the case fails in words.

**Undecided.** A case in which nothing begins is undecided if moving the nodes by 64 u X makes contact begin one way
and not another: a node that faces a free end exactly is over the master or not, as roundoff decides. Where contact
begins whichever way the nodes move, the case fails.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import Array, BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.strategies import flat_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.directions import random_moves
from contactverif_properties.shared.roundoff import COORDINATE_ROUNDING
from contactverif_properties.shared.uniform_pressure import unit_forces

N_MOVES = 64  # So many moves that a slave of two nodes that hang at free ends is moved off them in one of them.
CLOSED = 1 / 8  # The share of the slave's length, at one end, that is closed while the rest is open.
SHALLOW = 2.0**-6  # The deepest penetration there over the slave's length, so that the slave hardly tilts.
FAR = 2.0  # A distance in longest segments: the shapes of a mortar method reach over one, on either side.
REASON = "An open contact is left out, not rounded away."
OPEN = Quantity("force across an open gap", "1", "0", REASON)
DISTANT = Quantity("force far from the contact zone", "1", "0", REASON)


def measure_unilateral(case: Case, subject: Subject) -> Measurement:
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
        Broken: nothing begins where the surfaces penetrate.
    """
    formulation, interface = subject.for_case(case), case.interface
    depth, n = case.parameter("penetration"), interface.n_unknowns
    count = formulation.n_multipliers(interface)
    size = case.penalty * depth * case.slave_length
    raised = lift_slave(case, 2 * depth).with_multipliers(np.zeros(count))
    values = {OPEN.name: float(np.abs(_forces(formulation, raised)[:n]).max()) / size}
    distant = nodes_far_from_contact(case)
    if not count and distant.any():
        forces = np.linalg.norm(_forces(formulation, open_all_but_one_end(case)).reshape(-1, 2)[: len(distant)], axis=1)
        values[DISTANT.name] = float(forces[distant].max() / forces.max()) if forces.any() else 0.0
    broken = "" if _contact_begins(formulation, case) else "nothing begins where the surfaces penetrate"
    undecided = ""
    if broken:
        begins = [_contact_begins(formulation, moved) for moved in _move_by_roundoff(case)]
        undecided = "a kink: moved by roundoff, it begins one way and not another" if len(set(begins)) == 2 else ""
    return Measurement(values, dict.fromkeys(values, 0.0), undecided, broken)


def _contact_begins(formulation: CheckedFormulation, case: Case) -> bool:
    """Return whether springs push in this state, or whether a multiplier could."""
    count = formulation.n_multipliers(case.interface)
    if not count:
        return bool(_forces(formulation, case).any())
    state = case.with_multipliers(np.zeros(count))
    return bool(unit_forces(state, formulation, formulation.pair(case.interface, state.z)).any())


def lift_slave(case: Case, height: float) -> Case:
    """Return the case with its slave moved away from the master, across the interface, by a height (a length)."""
    along = case.parameters["direction"]
    positions = case.positions.copy()
    positions[: case.interface.n_slave_nodes] += height * np.array([-along[1], along[0]])
    return replace(case, z=positions.reshape(-1))


def open_all_but_one_end(case: Case) -> Case:
    """Return the case with its slave lifted so that the gap grows along it, and only its first eighth is closed.

    The gap grows linearly, and nodes move only across the interface, so that every slave stays straight.
    """
    interface, positions = case.interface, case.positions.copy()
    depth, places = case.parameter("penetration"), _slave_places(case)
    shallow = min(depth, SHALLOW * case.slave_length)
    x, y = case.parameters["direction"]
    positions[: interface.n_slave_nodes] += (depth + shallow * (places / CLOSED - 1))[:, None] * np.array([-y, x])
    return replace(case, z=positions.reshape(-1))


def nodes_far_from_contact(case: Case) -> BoolArray:
    """Return which slave nodes (n_slave_nodes,) are then FAR or more segments from the closed end."""
    interface, along = case.interface, case.parameters["along"]
    slave = along[: interface.n_slave_nodes]
    longest = max(float(np.abs(np.diff(along[side.segments])).max()) for side in (interface.slave, interface.master))
    distant: BoolArray = (_slave_places(case) - CLOSED) * np.ptp(slave) > FAR * longest
    return distant


def _slave_places(case: Case) -> FloatArray:
    """Return where the slave's nodes lie along the interface (n_slave_nodes,), from 0 to 1."""
    slave = case.parameters["along"][: case.interface.n_slave_nodes]
    places: FloatArray = (slave - slave.min()) / np.ptp(slave)
    return places


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
    summary="No force acts across an open gap or far from the contact zone, and some force acts under penetration.",
    quantities=(OPEN, DISTANT),
    cases=flat_cases,
    measure=measure_unilateral,
    promise=lambda traits: True,
    applicable=refuse_barrier,
)
