"""Ask whether the forces on slave and master add up to zero.

**Question.** In a random state with tilts, kinks and curves, is the sum of all nodal forces zero?

**Why it matters.** Contact is internal to the pair of bodies: action equals reaction. A formulation that loses a part
of a force accelerates a free body, and the reactions at the supports do not add up to the load.

**How it is judged.** The measured number is |ΣR| over Σ|R| of the slave. The tolerance is u(8Z/|g| + 4N): a gap is a
difference of positions, each rounded to uZ, and N forces are summed. Z is the diameter D of the state for a formulation
that promises `translation_stable`, and the largest coordinate X for any other: it may form points first, and measure
the gap of each side anew. The printed VTS-PPT fails by 1 − cos θ of the slave's force on a tilt θ.

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
    gap_tolerance,
    mean_penetration,
    ratio,
    rounding_distance,
    stated_gap_quantity,
    sum_slave_forces,
)

IMBALANCE = stated_gap_quantity("force imbalance")


def measure_force_imbalance(case: Case, subject: Subject) -> Measurement:
    """Return |ΣR| over Σ|R| of the slave, dimensionless."""
    state, forces = forces_of_any_state(case, subject)
    imbalance = ratio(float(np.linalg.norm(forces.sum(axis=0))), sum_slave_forces(state, forces))
    tolerance = gap_tolerance(state, mean_penetration(state, forces), rounding_distance(state, subject.traits))
    return Measurement([IMBALANCE.check(imbalance, tolerance)], idle=not forces.any())


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
