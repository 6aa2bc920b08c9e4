"""Ask whether a bend elsewhere changes the forces.

**Question.** A slave lies on a flat part of the master. The unloaded segments on both sides of that part turn about its
ends by −0.3 to 0.9 rad. Are forces and tangent those of before?

**Why it matters.** Contact acts between what touches. A formulation that makes its springs softer where the surface
bends, by averaged normals or by an estimate of the curvature, answers for a part of the surface that carries nothing.
On flat parts nothing shows, and at a bend every formulation may differ from every other.

**How it is judged.** The largest change of a nodal force counts over Σ|R| of the slave, that of an entry of the tangent
over max|K|. The slave stays away from the ends of the flat part by more than two penetrations, so no point comes nearer
to a bent segment than to the flat part, along any normal. The tolerance is u(8Z/min(g, ℓ) + 4N), because a right
formulation may subtract the mean of all nodes first. Formulations that compare nodes of facing segments alone give 0.
Smoothed masters do not promise `local`, and may say so.

**Undecided.** A failing case is undecided where a state lies at a kink, or where moving the nodes by 64 u X changes the
answer by a quarter of the error or more.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.strategies.straight import bent_end_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.same_answer import Carry, answer_alike, compare, same_answer_quantities

QUANTITIES = same_answer_quantities("after a bend elsewhere")


def measure_bend(case: Case, subject: Subject) -> Measurement:
    """Compare forces and tangent before and after the ends of the master have turned.

    Parameters
    ----------
    case : Case
        A slave on the flat part of a master, with the parameter "bent", the positions (n_unknowns,) afterwards.
    subject : Subject
        The formulation; multipliers, if it has any, are uniform.

    Returns
    -------
    Measurement
        The largest change of a force over Σ|R| of the slave, and of an entry of the tangent over max|K|.
    """
    bent = replace(case, z=case.parameters["bent"])
    before, after = answer_alike(case, bent, subject)
    return compare(QUANTITIES, subject, before, after, Carry(np.arange(case.interface.n_nodes)))


LOCALITY_BEND = Property(
    id="locality.bend",
    family="invariants",
    summary="A bend of the master's unloaded neighbours changes neither forces nor tangent.",
    quantities=QUANTITIES,
    cases=bent_end_cases,
    measure=measure_bend,
    promise=lambda traits: traits.local,
    applicable=refuse_barrier,
)
