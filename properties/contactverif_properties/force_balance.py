"""Ask whether the forces on slave and master add up to zero.

**Question.** In a random state with tilts, kinks and curves, is the sum of all nodal forces zero?

**Why it matters.** Contact is internal to the pair of bodies: action equals reaction. A formulation that loses a part
of a force accelerates a free body, and the reactions at the supports do not add up to the load.

**How it is judged.** The measured number is |ΣR| over Σ|R| of the slave. The tolerance is u(8X/|g| + 4N): a gap is a
difference of coordinates, each rounded to uX, and N forces are summed. The printed VTS-PPT fails by 1 − cos θ of the
slave's force on a tilt θ.

**Undecided.** Never: a change of partner moves forces between nodes and leaves their sum as it is.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif_properties.shared.any_state import any_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.nodal_forces import forces_of_any_state
from contactverif_properties.shared.roundoff import (
    gap_quantity,
    gap_tolerance,
    mean_penetration,
    ratio,
    sum_slave_forces,
)

IMBALANCE = gap_quantity("force imbalance")


def measure_force_imbalance(case: Case, subject: Subject) -> Measurement:
    """Return |ΣR| over Σ|R| of the slave, dimensionless."""
    state, forces = forces_of_any_state(case, subject)
    imbalance = ratio(float(np.linalg.norm(forces.sum(axis=0))), sum_slave_forces(state, forces))
    tolerance = gap_tolerance(state, mean_penetration(state, forces))
    return Measurement({IMBALANCE.name: imbalance}, {IMBALANCE.name: tolerance}, idle=not forces.any())


FORCE_BALANCE = Property(
    id="balance.force",
    family="balance",
    summary="The forces on slave and master add up to zero on tilts, kinks and curves.",
    quantities=(IMBALANCE,),
    cases=any_cases,
    measure=measure_force_imbalance,
    promise=lambda traits: traits.conserves_force,
    applicable=refuse_barrier,
)
