"""Contact pushes and never pulls: no force across an open gap, none of a multiplier that pulls; and it does begin."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contactverif.arrays import UNIT_ROUNDOFF, Array
from contactverif.case import Case
from contactverif.property import Measurement, Property, Quantity
from contactverif.strategies import flat_cases
from contactverif.subject import Guarded, Subject
from contactverif_properties.anywhere import no_barrier, with_multipliers
from contactverif_properties.patch import force_columns

MOVES = 8
EXACTLY = "a contact that is open is left out, not rounded away"
OPEN = Quantity("force across an open gap", "1", "0", EXACTLY)
PULLING = Quantity("force of multipliers that pull", "1", "0", EXACTLY)


def open_and_closed(case: Case, subject: Subject) -> Measurement:
    """A flat interface lifted until all gaps are as wide as the penetration was deep.

    Returns
    -------
    Measurement
        Largest nodal force there over ε̂ |g| L, dimensionless. Of a formulation with multipliers those are 0 there, and
        the force of ones that pull by ε̂ |g| is asked too, across the open gap and where the surfaces touch. Broken:
        nothing begins where the surfaces penetrate.

    Source: verification 10, for frictionless contact without adhesion.
    """
    formulation, interface = subject.on(case), case.interface
    depth, n = case.parameter("penetration"), case.interface.n_unknowns
    count = formulation.n_multipliers(interface)
    pull = -subject.penalty(case) * depth
    size = case.penalty * depth * case.slave_length

    def largest(raised: float, multiplier: float) -> float:
        there = with_multipliers(lifted(case, raised), np.full(count, multiplier))
        return float(np.abs(_forces(formulation, there)[:n]).max()) / size

    def begins(there: Case) -> bool:
        if not count:
            return bool(_forces(formulation, there).any())
        waiting = with_multipliers(there, np.zeros(count))
        return bool(force_columns(waiting, formulation, formulation.pair(interface, waiting.z)).any())

    values = {OPEN.name: largest(2 * depth, 0.0)}
    if count:
        values[PULLING.name] = max(largest(2 * depth, pull), largest(depth, pull))
    broken = "" if begins(case) else "nothing begins where the surfaces penetrate"
    undecided = "a kink: moved by roundoff, it begins" if broken and any(map(begins, _moved(case))) else ""
    return Measurement(values, dict.fromkeys(values, 0.0), undecided, broken)


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


def _forces(formulation: Guarded, case: Case) -> Array:
    return formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z)


UNILATERAL = Property(
    id="unilateral",
    family="invariants",
    summary="contact pushes and never pulls: no force across an open gap, and some where surfaces penetrate",
    quantities=(OPEN, PULLING),
    cases=flat_cases,
    measure=open_and_closed,
    promise=lambda traits: True,
    applicable=no_barrier,
)
