"""Ask whether slave and master may exchange their roles.

**Question.** The slave of a random state becomes the master, and the master the slave. Are the forces on each node the
old ones?

**Why it matters.** An analyst must choose one surface as the slave, and in a stack of bodies or in self-contact no
choice is natural. A formulation without that choice promises `unbiased`. All others give another answer, by as much as
the detail says.

**How it is judged.** Changes of the forces count over Σ|R| of the slave, those of the tangent over max|K|. The penalty
stays the same number, also for nodal springs. The tolerance is u(8Z/min(g, ℓ) + 4N), because sums run in another order.
Multipliers are uniform, because their order changes.

**Undecided.** A failing case of a formulation that promises `unbiased` is undecided where the state lies at a kink, or
where moving the nodes by 64 u X changes the answer by a quarter of the error or more.
"""

from __future__ import annotations

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.strategies import smooth_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.relabelled import exchange_roles
from contactverif_properties.shared.same_answer import answer_alike, compare, same_answer_quantities

QUANTITIES = same_answer_quantities("with roles exchanged")


def measure_swap(case: Case, subject: Subject) -> Measurement:
    """Compare the forces and the tangent with roles exchanged with those of the state.

    Parameters
    ----------
    case : Case
        A random state.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The largest change of a force over Σ|R| of the slave, and of an entry of the tangent over max|K|.
    """
    exchanged, carry = exchange_roles(case)
    return compare(
        QUANTITIES, subject, *answer_alike(case, exchanged, subject), carry, explain=bool(subject.traits.unbiased)
    )


SWAP = Property(
    id="swap",
    family="invariants",
    summary="Slave and master may exchange their roles.",
    quantities=QUANTITIES,
    cases=smooth_cases,
    measure=measure_swap,
    promise=lambda traits: traits.unbiased,
    applicable=refuse_barrier,
)
