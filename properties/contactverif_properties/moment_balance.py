"""Ask whether the moments of the forces on slave and master add up to zero.

**Question.** In a random state with tilts, kinks and curves, is the sum of the moments of all nodal forces zero?

**Why it matters.** Two forces that balance but do not lie on one line turn a free body without any cause.

**How it is judged.** Moments are taken about the centroid of the nodes. The measured number is |Σ x×R| over D Σ|R| of
the slave, with the diameter D of the state. The tolerance is u(8Z/|g| + 4N), with the distance Z of
`balance.force`: a gap is a difference of positions, each rounded to uZ, and N forces are summed.

**Undecided.** Never: on either side of a kink a formulation that balances moments does so.
"""

from __future__ import annotations

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

IMBALANCE = stated_gap_quantity("moment imbalance")


def measure_moment_imbalance(case: Case, subject: Subject) -> Measurement:
    """Return |Σ x×R| about the centroid of the nodes over D Σ|R| of the slave, dimensionless."""
    state, forces = forces_of_any_state(case, subject)
    arms = state.positions - state.positions.mean(axis=0)
    moment = abs(float((arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]).sum()))
    imbalance = ratio(moment, state.diameter * sum_slave_forces(state, forces))
    tolerance = gap_tolerance(state, mean_penetration(state, forces), rounding_distance(state, subject.traits))
    return Measurement([IMBALANCE.check(imbalance, tolerance)], idle=not forces.any())


MOMENT_BALANCE = Property(
    id="balance.moment",
    family="balance",
    summary="The moments of the forces on slave and master add up to zero on tilts, kinks and curves.",
    quantities=(IMBALANCE,),
    cases=any_cases,
    measure=measure_moment_imbalance,
    promise=lambda traits: traits.conserves_moment,
    applicable=refuse_barrier,
)
