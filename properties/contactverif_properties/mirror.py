"""Ask whether the mirror image of a state has the mirror image of its forces.

**Question.** A random state is mirrored, and its segments run the other way, so that the bodies stay on the left. Are
the forces and the tangent the old ones, mirrored?

**Why it matters.** Left and right are alike in mechanics. A formulation that treats the first node of a segment
otherwise than the second, or walks one way only, gives an unsymmetric answer to a symmetric part.

**How it is judged.** A coordinate changes its sign, which rounds nothing. Changes of the forces count over Σ|R| of the
slave, those of the tangent over max|K|. The tolerance is u(8Z/min(g, ℓ) + 4N), because sums run the other way.
Multipliers are uniform, because their order may change.

**Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X changes
the answer by a quarter of the error or more. On an exact bisector, and in the normal cone of a re-entrant vertex, a
point is as near to one segment as to another, and the mirror image may choose the other.
"""

from __future__ import annotations

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.strategies import smooth_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.relabelled import mirror
from contactverif_properties.shared.same_answer import answer_alike, compare, same_answer_quantities

QUANTITIES = same_answer_quantities("in the mirror image")


def measure_mirror(case: Case, subject: Subject) -> Measurement:
    """Compare the forces and the tangent of the mirror image with those of the state, mirrored.

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
    image, carry = mirror(case)
    return compare(QUANTITIES, subject, *answer_alike(case, image, subject), carry)


MIRROR = Property(
    id="mirror",
    family="invariants",
    summary="The mirror image of a state has the mirror image of its forces and of its tangent.",
    quantities=QUANTITIES,
    cases=smooth_cases,
    measure=measure_mirror,
    promise=lambda traits: True,
    applicable=refuse_barrier,
)
