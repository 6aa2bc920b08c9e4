"""Ask whether the solved patch test holds where the slave overhangs the master inside a slave segment.

**Question.** The master ends inside a slave segment. Do the contact forces end where the master ends?

**Why it matters.** Every punch, gasket and lap joint has such an end. A method that decides about whole slave nodes
or whole areas of competence has too much slave in contact there, or too little.

**How it is judged.** The pressure acts on what the master does not cover too, so that the exact stress is as uniform
as without an overhang. The errors are those of `patch.flat.solve` at ε̂ = 1, 10 or 100 E/h, and gaps count where
there is a master opposite. The tolerances are those of `patch.flat.solve` times L/A: loads on the whole slave, of
length L, are rounded, and the part A that has the master opposite bears that.

**Undecided.** Never, as in `patch.flat.solve`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import Subject
from contactverif.strategies.solids import dead_zone_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.solved_patch import MULTIPLIERS, QUANTITIES, forces_to_draw, measure_once


def measure_overhang(case: Case, subject: Subject) -> Measurement:
    """Return the errors of `measure_once` with tolerances L/A times as large.

    Parameters
    ----------
    case : Case
        A uniform scene whose slave overhangs the master.
    subject : Subject
        The formulation.
    """
    measurement = measure_once(case, subject)
    slave, master = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    covered = min(slave.max(), master.max()) - max(slave.min(), master.min())
    ratio = float(np.ptp(slave) / covered)
    numbers = [replace(number, tolerance=ratio * number.tolerance) for number in measurement.numbers]
    return replace(measurement, numbers=numbers)


def _widen_tolerance(quantity: Quantity) -> Quantity:
    """Return the quantity with L/A times its tolerance."""
    reason = "Loads on the whole slave, of length L, are rounded, and the part A that faces the master bears that."
    return replace(quantity, tolerance=f"({quantity.tolerance}) L/A", reason=f"{quantity.reason} {reason}")


DEAD_ZONE = Property(
    id="patch.dead-zone",
    family="patch",
    summary="A uniform pressure stays exact where the slave overhangs the master inside a slave segment.",
    quantities=tuple(map(_widen_tolerance, (*QUANTITIES, MULTIPLIERS))),
    cases=dead_zone_cases,
    measure=measure_overhang,
    promise=lambda traits: traits.covers_overhang,
    applicable=refuse_barrier,
    bodies=True,
    exact=forces_to_draw,
)
