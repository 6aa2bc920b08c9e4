"""Action and reaction: do the forces of slave and master balance, and their moments, on tilts, kinks and curves?"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif_properties import roundoff
from contactverif_properties.anywhere import any_cases, no_barrier, posed

FORCE_DEFECT = roundoff.gap_quantity("force defect")
MOMENT_DEFECT = roundoff.gap_quantity("moment defect")


def _forces(case: Case, subject: Subject) -> tuple[Case, FloatArray]:
    """The case as it was asked, and the forces (n_nodes, 2)."""
    formulation, case = posed(case, subject)
    pairing = formulation.pair(case.interface, case.z)
    forces = formulation.residual(case.interface, pairing, case.z)
    return case, forces[: case.interface.n_unknowns].reshape(-1, 2)


def force_defect(case: Case, subject: Subject) -> Measurement:
    """|ΣR| over Σ|R| of the slave, dimensionless. VTS-PPT as printed: 1 − cos θ of the slave force under a tilt θ."""
    case, forces = _forces(case, subject)
    defect = roundoff.share(float(np.linalg.norm(forces.sum(axis=0))), roundoff.slave_forces(case, forces))
    tolerance = roundoff.of_gap(case, roundoff.mean_penetration(case, forces))
    return Measurement({FORCE_DEFECT.name: defect}, {FORCE_DEFECT.name: tolerance}, idle=not forces.any())


def moment_defect(case: Case, subject: Subject) -> Measurement:
    """|Σ x×R| about the centroid of the nodes over D Σ|R| of the slave, dimensionless."""
    case, forces = _forces(case, subject)
    arms = case.positions - case.positions.mean(axis=0)
    moment = abs(float((arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]).sum()))
    defect = roundoff.share(moment, case.diameter * roundoff.slave_forces(case, forces))
    tolerance = roundoff.of_gap(case, roundoff.mean_penetration(case, forces))
    return Measurement({MOMENT_DEFECT.name: defect}, {MOMENT_DEFECT.name: tolerance}, idle=not forces.any())


FORCE = Property(
    id="balance.force",
    family="balance",
    summary="the forces on slave and master add up to zero on tilts, kinks and curves",
    quantities=(FORCE_DEFECT,),
    cases=any_cases,
    measure=force_defect,
    promise=lambda traits: traits.conserves_force,
    applicable=no_barrier,
)
MOMENT = Property(
    id="balance.moment",
    family="balance",
    summary="the moments of the forces on slave and master add up to zero on tilts, kinks and curves",
    quantities=(MOMENT_DEFECT,),
    cases=any_cases,
    measure=moment_defect,
    promise=lambda traits: traits.conserves_moment,
    applicable=no_barrier,
)
