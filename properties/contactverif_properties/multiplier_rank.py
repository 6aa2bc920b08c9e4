"""Ask whether the constraints of the multipliers are independent, so that the multipliers are unique.

**Question.** In the exact solution of two blocks under a uniform pressure, how many multipliers are redundant?

**Why it matters.** A redundant constraint makes the matrix singular. A solver then stops, or returns multipliers (the
contact pressures) that are arbitrary.

**How it is judged.** The measured number counts the zero singular values of the saddle-point matrix. The tolerance is
0. A singular value counts as zero below 8 n u times the largest one, for n unknowns.

**Undecided.** Never.

**Source.** Section 6.3 of Zavarise & De Lorenzis (2009) leaves the question open for VTS-PPT. With eight slave
segments on two master segments, seven of its sixteen multipliers are redundant.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import Subject
from contactverif.mechanics.scene import scene_of
from contactverif.mechanics.system import System
from contactverif.problems.blocks import exact_unknowns, pressure_of
from contactverif.strategies.solids import block_cases
from contactverif_properties.shared.applicability import refuse_without_multipliers
from contactverif_properties.shared.uniform_pressure import exact_multipliers

REDUNDANT = Quantity(
    "redundant multipliers",
    "1",
    "0",
    "A dependent constraint leaves a zero singular value, which is below 8 n u of the largest one for n unknowns.",
)


def measure_rank(case: Case, subject: Subject) -> Measurement:
    """Count the multipliers that are not unique in the exact solution of two blocks under a uniform pressure.

    Parameters
    ----------
    case : Case
        A uniform scene.
    subject : Subject
        A formulation with multipliers.

    Returns
    -------
    Measurement
        The number of zero singular values of the saddle-point matrix. Detail: the number of multipliers.
    """
    scene, pressure = scene_of(case), pressure_of(case, np.inf)
    formulation = subject.for_case(case)
    exact = exact_unknowns(scene, pressure, np.inf)
    state = replace(case, z=scene.positions(exact))
    system = System(scene, formulation, use_tangent=False)
    u = np.concatenate([exact, exact_multipliers(state, subject, formulation, pressure)])
    matrix, floor = system.matrix(u, system.pair(u))
    step = system.step(matrix, np.zeros(system.size), floor)
    details = {"multipliers": float(system.n_multipliers)}
    return Measurement([REDUNDANT.check(float(step.deficiency), 0.0)], details=details)


MULTIPLIER_RANK = Property(
    id="multipliers.rank",
    family="multipliers",
    summary="The constraints are independent, so that the multipliers are unique.",
    quantities=(REDUNDANT,),
    cases=block_cases,
    measure=measure_rank,
    promise=lambda traits: traits.independent_multipliers,
    applicable=refuse_without_multipliers,
    bodies=True,
)
