"""Properties about two states that a right formulation answers alike."""

from __future__ import annotations

from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.strategies import smooth_cases
from contactverif_properties.shared.relabelled import exchange_roles, mirror_case
from contactverif_properties.shared.same_answer import answer_alike, compare, same_answer_quantities

IN_MIRROR = same_answer_quantities("in the mirror image")
WITH_ROLES_EXCHANGED = same_answer_quantities("with roles exchanged")


@Property.define(
    id="mirror",
    family="invariants",
    summary="The mirror image of a state has the mirror image of its forces and of its tangent.",
    quantities=IN_MIRROR,
    cases=Cases.random(smooth_cases),
    promise=lambda traits: True,
)
def mirror(case: Case, subject: Subject) -> Measurement:
    """Ask whether the mirror image of a state has the mirror image of its forces.

    **Question.** A random state is mirrored, and its segments run the other way, so that the bodies stay on the left.
    Are the forces and the tangent the old ones, mirrored?

    **Why it matters.** Left and right are alike in mechanics. A formulation that treats the first node of a segment
    otherwise than the second, or walks one way only, gives an unsymmetric answer to a symmetric part.

    **How it is judged.** A coordinate changes its sign, which rounds nothing. Changes of the forces count over Σ|R| of
    the slave, those of the tangent over max|K|. The tolerance is u(8Z/min(g, ℓ) + 4N), because sums run the other way.
    Multipliers are uniform, because their order may change.

    **Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X
    changes the answer by a quarter of the error or more. On an exact bisector, and in the normal cone of a re-entrant
    vertex, a point is as near to one segment as to another, and the mirror image may choose the other.
    """
    image, carry = mirror_case(case)
    return compare(IN_MIRROR, subject, *answer_alike(case, image, subject), carry)


@Property.define(
    id="swap",
    family="invariants",
    summary="Slave and master may exchange their roles.",
    quantities=WITH_ROLES_EXCHANGED,
    cases=Cases.random(smooth_cases),
    promise=lambda traits: traits.unbiased,
)
def swap(case: Case, subject: Subject) -> Measurement:
    """Ask whether slave and master may exchange their roles.

    **Question.** The slave of a random state becomes the master, and the master the slave. Are the forces on each node
    the old ones?

    **Why it matters.** An analyst must choose one surface as the slave, and in a stack of bodies or in self-contact no
    choice is natural. A formulation without that choice promises `unbiased`. All others give another answer, by as much
    as the detail says.

    **How it is judged.** Changes of the forces count over Σ|R| of the slave, those of the tangent over max|K|. The
    penalty stays the same number, also for nodal springs. The tolerance is u(8Z/min(g, ℓ) + 4N), because sums run in
    another order. Multipliers are uniform, because their order changes.

    **Undecided.** A failing case of a formulation that promises `unbiased` is undecided where the state lies at a kink,
    or where moving the nodes by 64 u X changes the answer by a quarter of the error or more.
    """
    exchanged, carry = exchange_roles(case)
    answers, unbiased = answer_alike(case, exchanged, subject), bool(subject.traits.unbiased)
    return compare(WITH_ROLES_EXCHANGED, subject, *answers, carry, explain=unbiased)
