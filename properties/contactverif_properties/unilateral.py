"""Contact is where surfaces penetrate and nowhere else: no force across an open gap, none far from what touches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.strategies import flat_cases
from contactverif_properties.anywhere import no_barrier
from contactverif_properties.patch import force_columns

MOVES = 8
CLOSED = 1 / 8  # of the slave's length, at one end of an interface that is open elsewhere
SHALLOW = 2.0**-6  # of that length, the deepest penetration there, so that it hardly tilts
FAR = 2.0  # × the longest segment: shapes of a mortar method reach over one, on either side
EXACTLY = "a contact that is open is left out, not rounded away"
OPEN = Quantity("force across an open gap", "1", "0", EXACTLY)
BEYOND = Quantity("force far from what touches", "1", "0", EXACTLY)


def open_and_closed(case: Case, subject: Subject) -> Measurement:
    """A flat interface lifted until all gaps are as wide as the penetration was deep, and until all but an end is open.

    Returns
    -------
    Measurement
        Largest nodal force across the open gap over ε̂ |g| L; of a formulation with multipliers those are 0 there.
        Far: the largest force of a slave node that is two segments or more from where it is closed, over the largest
        force of one; of springs alone, since multipliers that pull are a matter of solutions (`complementarity`), and
        missing where no node is that far. Broken: nothing begins where the surfaces penetrate.

    Source: verification 10, for frictionless contact without adhesion.
    """
    formulation, interface = subject.for_case(case), case.interface
    depth, n = case.parameter("penetration"), case.interface.n_unknowns
    count = formulation.n_multipliers(interface)
    size = case.penalty * depth * case.slave_length

    def begins(there: Case) -> bool:
        if not count:
            return bool(_forces(formulation, there).any())
        waiting = there.with_multipliers(np.zeros(count))
        return bool(force_columns(waiting, formulation, formulation.pair(interface, waiting.z)).any())

    raised = lifted(case, 2 * depth).with_multipliers(np.zeros(count))
    values = {OPEN.name: float(np.abs(_forces(formulation, raised)[:n]).max()) / size}
    tolerances = {OPEN.name: 0.0}
    far = beyond(case)
    if not count and far.any():
        forces = np.linalg.norm(_forces(formulation, nearly_open(case)).reshape(-1, 2)[: len(far)], axis=1)
        values[BEYOND.name] = float(forces[far].max() / forces.max()) if forces.any() else 0.0
        tolerances[BEYOND.name] = 0.0
    broken = "" if begins(case) else "nothing begins where the surfaces penetrate"
    undecided = "a kink: moved by roundoff, it begins" if broken and any(map(begins, _moved(case))) else ""
    return Measurement(values, tolerances, undecided, broken)


def nearly_open(case: Case) -> Case:
    """The case with its slave lifted so that the gap grows along it, linearly, and is closed in its first CLOSED only.

    Nodes move across the interface alone, and every slave stays straight.
    """
    interface, positions = case.interface, case.positions.copy()
    depth, place = case.parameter("penetration"), _places(case)
    shallow = min(depth, SHALLOW * case.slave_length)
    x, y = case.parameters["direction"]
    positions[: interface.n_slave_nodes] += (depth + shallow * (place / CLOSED - 1))[:, None] * np.array([-y, x])
    return replace(case, z=positions.reshape(-1))


def beyond(case: Case) -> BoolArray:
    """Which slave nodes (n_slave_nodes,) are then FAR or more segments from where it is closed."""
    interface, along = case.interface, case.parameters["along"]
    slave = along[: interface.n_slave_nodes]
    longest = max(float(np.abs(np.diff(along[side.segments])).max()) for side in (interface.slave, interface.master))
    reached: BoolArray = (_places(case) - CLOSED) * np.ptp(slave) > FAR * longest
    return reached


def _places(case: Case) -> FloatArray:
    """Of the slave's nodes along the interface, from 0 to 1."""
    slave = case.parameters["along"][: case.interface.n_slave_nodes]
    places: FloatArray = (slave - slave.min()) / np.ptp(slave)
    return places


def _moved(case: Case) -> Iterator[Case]:
    """The case with its nodes moved by roundoff: one that faces a free end exactly is over the master, or is not."""
    reach = 64 * UNIT_ROUNDOFF * case.largest_coordinate
    for direction in np.random.default_rng(case.seed).uniform(-1, 1, (MOVES, case.z.size)):
        yield replace(case, z=case.z + reach * direction)


def lifted(case: Case, height: float) -> Case:
    """The case with its slave moved away from the master, across the interface, by a length."""
    along = case.parameters["direction"]
    positions = case.positions.copy()
    positions[: case.interface.n_slave_nodes] += height * np.array([-along[1], along[0]])
    return replace(case, z=positions.reshape(-1))


def _forces(formulation: CheckedFormulation, case: Case) -> Array:
    return formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z)


UNILATERAL = Property(
    id="unilateral",
    family="invariants",
    summary="no force across an open gap, none far from what touches, and some where surfaces penetrate",
    quantities=(OPEN, BEYOND),
    cases=flat_cases,
    measure=open_and_closed,
    promise=lambda traits: True,
    applicable=no_barrier,
)
