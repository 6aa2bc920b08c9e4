"""The patch test solved where the slave overhangs the master inside a slave segment: forces end where the master does.

The pressure acts on what the master does not cover too, so the exact stress is as uniform as without an overhang. A
method that decides about whole slave nodes, or areas of competence, has either too much slave in contact or too little.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import Subject
from contactverif.strategies.solids import dead_zone_cases
from contactverif_properties.anywhere import no_barrier
from contactverif_properties.solved import MULTIPLIERS, QUANTITIES, exact_picture, solved_once


def overhanging(case: Case, subject: Subject) -> Measurement:
    """As `solved_once`, L/A as tolerant: the part A of the slave's length L bears the rounding of loads on all."""
    found = solved_once(case, subject)
    slave, master = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    covered = min(slave.max(), master.max()) - max(slave.min(), master.min())
    ratio = float(np.ptp(slave) / covered)
    return replace(found, tolerances={name: ratio * tolerance for name, tolerance in found.tolerances.items()})


def _on_a_part(quantity: Quantity) -> Quantity:
    why = "loads on all the slave, of length L, are rounded, and the part A that has the master opposite bears it"
    return replace(quantity, tolerance=f"({quantity.tolerance}) L/A", reason=f"{quantity.reason}; {why}")


DEAD_ZONE = Property(
    id="patch.dead-zone",
    family="patch",
    summary="two elastic blocks under a uniform pressure, the slave overhanging the master inside a slave segment",
    quantities=tuple(map(_on_a_part, (*QUANTITIES, MULTIPLIERS))),
    cases=dead_zone_cases,
    measure=overhanging,
    promise=lambda traits: traits.covers_overhang,
    applicable=no_barrier,
    bodies=True,
    exact=exact_picture,
)
