"""Ask whether a uniform penetration of a flat interface gives the right total force.

**Question.** Two flat surfaces penetrate each other by the same depth everywhere. Is the total force on the slave the
penalty times the penetration times the slave's area, in the configuration that the traits name?

**Why it matters.** A formulation with distributed springs must get the total right, whether it passes the patch test
or not. A wrong total means a wrong area of competence, and so a wrong stiffness of the contact.

**How it is judged.** The measured number is |ΣF − ε̂ |g| A n| / (ε̂ |g| A) over the slave's nodes, with the current
or the reference length A. The reference is scaled by a power of two, so that the two configurations differ.
Multipliers that are pressures are all ε̂ |g| here. The tolerance is u(8X/|g| + 4N): a gap is a difference of
coordinates, each rounded to uX, and N forces are summed. X stands here for every formulation, because the state is
turned and moved, and stored as it is rounded.

**Undecided.** A failing case is undecided where a slave node faces a free end of the master exactly: roundoff decides
whether the node is over the master.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.strategies import flat_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.kinks import explain_by_kink
from contactverif_properties.shared.roundoff import COORDINATE_ROUNDING, gap_quantity, gap_tolerance
from contactverif_properties.shared.uniform_pressure import forces_of_penetration, unit_forces

TOTAL_ERROR = gap_quantity("error of the total force")


def measure_resultant(case: Case, subject: Subject) -> Measurement:
    """Compare the total force on the slave with ε̂ |g| times its area.

    Parameters
    ----------
    case : Case
        A flat case with the parameter `penetration`, a length.
    subject : Subject
        The formulation; its trait `area` names the configuration of A.

    Returns
    -------
    Measurement
        |ΣF − ε̂ |g| A n| / (ε̂ |g| A) over the slave's nodes, dimensionless.
    """
    stretch = 2.0 ** int(np.random.default_rng(case.seed).integers(-2, 3))
    interface = case.interface.at(case.interface.nodes * stretch)
    formulation = subject.for_case(case)
    count = formulation.n_multipliers(interface)
    case = case.with_multipliers(np.full(count, case.penalty * case.parameter("penetration")))
    stretched = replace(case, interface=interface)
    pairing = formulation.pair(interface, case.z)
    if count:
        forces = -(unit_forces(stretched, formulation, pairing) @ case.multipliers).reshape(-1, 2)
    else:
        forces = -formulation.residual(interface, pairing, case.z).reshape(-1, 2)
    exact = forces_of_penetration(case)[: interface.n_slave_nodes].sum(axis=0)
    if subject.traits.area == "reference":
        exact = exact * stretch
    error = float(np.linalg.norm(forces[: interface.n_slave_nodes].sum(axis=0) - exact))
    value, tolerance = error / float(np.linalg.norm(exact)), gap_tolerance(case, case.parameter("penetration"))
    undecided = ""
    if value > tolerance:
        rounding = COORDINATE_ROUNDING * case.largest_coordinate
        pairing = formulation.pair(interface, case.z)
        undecided = explain_by_kink(stretched, formulation, pairing, rounding, {"forces": error})
    return Measurement([TOTAL_ERROR.check(value, tolerance)], undecided)


def refuse_unknown_total(traits: Traits) -> str:
    """Return why the total force is unknown from the traits, or an empty string if they say enough."""
    if traits.penalty == "nodal":
        return "there are no distributed springs"
    if traits.penalty is None or traits.area is None:
        return "the traits `penalty` and `area` are not both stated, so the total is unknown"
    return refuse_barrier(traits)


FLAT_RESULTANT = Property(
    id="patch.flat.resultant",
    family="patch",
    summary="A uniform penetration of a flat interface gives the total force penalty × penetration × area.",
    quantities=(TOTAL_ERROR,),
    cases=flat_cases,
    measure=measure_resultant,
    promise=lambda traits: None if refuse_unknown_total(traits) else True,
    applicable=refuse_unknown_total,
    usual_undecided=0.004,  # Eleven of 3330 cases of right formulations, all of one that takes the last of ties.
)
