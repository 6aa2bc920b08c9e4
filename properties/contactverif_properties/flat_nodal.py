"""Ask whether the springs of a nodal method give ε |g| at each node, shared by the lever rule, on flat surfaces.

**Question.** Two flat surfaces penetrate each other by the same depth everywhere. Does each slave node get the force
ε |g| of its spring, and each master node what the lever rule makes of those?

**Why it matters.** A nodal method such as NTS fails every patch test but the simplest, because its springs know no
areas. Yet what it must do is known exactly. Without this question any mistake in it would hide behind that failure.

**How it is judged.** The measured numbers are the largest |F − F_exact| over all nodes, over the forces of all springs,
and the errors of reported gaps over |g| and of reported nodal forces over ε |g|. A method whose traits say `unbiased`
has springs at the nodes of both surfaces, all with the same stiffness. How they share the penalty is its own choice, so
their size is not judged here, but in `patch.flat.published`. The meshes are those of `patch.flat.single`, with a master
that goes beyond the slave. The exact shares are computed in rationals. The tolerance is u(8X/|g| + 4N).

**Undecided.** Never: no node faces a free end of the other surface, and at a kink of a flat interface both partners
give the same gap and the same force.

**Source.** Zavarise & De Lorenzis (2009), Section 4.1, Eq. 6 with F = ε g.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.oracle import nodal_spring_weights
from contactverif.strategies import overhung_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.patch_errors import point_errors
from contactverif_properties.shared.roundoff import gap_quantity, gap_tolerance

FORCE = gap_quantity("error of a nodal force")
GAP = gap_quantity("error of a reported gap")
REPORTED_FORCE = gap_quantity("error of a reported nodal force")


def measure_springs(case: Case, subject: Subject) -> Measurement:
    """Compare nodal forces, reported gaps and reported forces with those of springs at the nodes.

    Parameters
    ----------
    case : Case
        A flat case with the parameter `penetration`, a length.
    subject : Subject
        A nodal formulation with a penalty.
    """
    formulation, interface, depth = subject.for_case(case), case.interface, case.parameter("penetration")
    pairing, spring = formulation.pair(interface, case.z), subject.penalty(case) * depth
    unbiased = bool(subject.traits.unbiased)
    weights = nodal_spring_weights(interface, case.parameters["along"], both_surfaces=unbiased)
    exact = spring * _push(case, weights)
    forces = -formulation.residual(interface, pairing, case.z).reshape(-1, 2)
    if unbiased:
        likeness = float((forces * exact).sum())
        forces = forces * (float((exact**2).sum()) / likeness if likeness > 0 else 1.0)
    tolerance, size = gap_tolerance(case, depth), spring * float(weights[: interface.n_slave_nodes].sum())
    values = {FORCE: float(np.linalg.norm(forces - exact, axis=1).max()) / size}
    if "contact_points" in formulation.provides:
        points = formulation.contact_points(interface, pairing, case.z)
        values[GAP] = point_errors(case, points, case.penalty, case.penalty * depth)[0]
        if not unbiased:
            values[REPORTED_FORCE] = point_errors(case, points, case.penalty, spring)[1]
    return Measurement(check_all(values, tolerance))


def _push(case: Case, weights: FloatArray) -> FloatArray:
    """Return the weights as forces (n_nodes, 2) that push the two surfaces apart."""
    along = case.parameters["direction"]
    sides = np.where(np.arange(len(weights)) < case.interface.n_slave_nodes, 1.0, -1.0)
    forces: FloatArray = (sides * weights)[:, None] * [-along[1], along[0]]
    return forces


def refuse_without_nodal_springs(traits: Traits) -> str:
    """Return why a formulation has no nodal springs, or an empty string if it has."""
    if traits.penalty == "nodal" and traits.enforcement == "penalty":
        return ""
    return refuse_barrier(traits) or "there are no nodal springs"


FLAT_NODAL = Property(
    id="patch.flat.nodal",
    family="patch",
    summary="Nodal springs push each node with their stiffness times the gap, shared by the lever rule.",
    quantities=(FORCE, GAP, REPORTED_FORCE),
    cases=overhung_cases,
    measure=measure_springs,
    promise=lambda traits: None if refuse_without_nodal_springs(traits) else True,
    applicable=refuse_without_nodal_springs,
)
