"""Ask whether every pressure of the multipliers is resisted by the bodies, however fine the mesh.

**Question.** Two blocks touch. How much does a pressure of unit size move them, if it is the one that moves them least?
Does that number β stay above zero as both meshes are refined?

**Why it matters.** Existence, uniqueness and convergence of the pressures rest on it: it is the inf-sup condition of
Ladyzhenskaya, Babuška and Brezzi. Where β falls, pressures oscillate from point to point, and a finer mesh makes it
worse. Where β is zero, there is a pressure that moves nothing, and so nothing decides how large it is. With a penalty
in place of multipliers, the same constraints lock as the penalty grows (`stability.locking`).

**How it is judged.** B are the rows of the formulation where both bodies touch, S the condensed stiffness of both, A
the areas of the multipliers, and h the mean slave segment: B S⁻¹ Bᵀ λ = β² h A λ / E. There are three families of five
meshes each: a slave that is coarser than the master (2:3), a finer one (3:2), and nodes on nodes. Rows of forces and
rows of gaps are derived from the residual. Where they differ, the smaller β counts.

The first number counts the eigenvalues that are zero; the tolerance is 0. They are then left out. The second number is
the slope of log β against log h, fitted to the three finest meshes. β falls with h if it is positive. The tolerance is
0.1: a constant has a slope of 0, and constraints that a mesh cannot follow have a slope of 1. NTS, mortar and dual
mortar have less than 0.001 on all families.

**Undecided.** Never.

**Source.** Section 6.3 of Zavarise & De Lorenzis (2009) leaves open whether VTS-PPT satisfies the condition. It does
not: with two virtual slave nodes a segment, β falls like h on a coarser slave, and a third of all pressures move
nothing on a finer one. The numerical test is that of Chapelle & Bathe, Computers & Structures 47 (1993) 537–545.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.inf_sup import inf_sup_constant
from contactverif.problems.refined_blocks import refinement_cases, refinements
from contactverif_properties.shared.applicability import refuse_unstated_penalty, refuse_without_multipliers
from contactverif_properties.shared.finite_lists import unless_given

MOST_SLOPE = 0.1
# The names of the series, which have a number for each mesh.
CONSTANT, SEGMENT, ZERO_COUNT, MULTIPLIER_COUNT = "inf-sup constant", "slave segment", "zero eigenvalues", "multipliers"
N_FITTED = 3  # The finest meshes: on coarse ones the ends of the interface count as much as its inside.
ZEROS = Quantity(
    "pressures that move nothing",
    "1",
    "0",
    "Of such a pressure nothing says how large it is. A singular value below √u of the largest one counts as zero.",
)
SLOPE = Quantity(
    "slope of log β against log h",
    "1",
    "0.1",
    "A constant has a slope of 0, and constraints that a mesh cannot follow have a slope of 1.",
)


def measure_inf_sup(case: Case, subject: Subject) -> Measurement:
    """Compute the inf-sup constant on a family of meshes.

    Parameters
    ----------
    case : Case
        The coarsest mesh of the family, from `refinement_cases`.
    subject : Subject
        A formulation with multipliers.

    Returns
    -------
    Measurement
        The largest number of zero eigenvalues of a mesh, and the slope of the constants. Series: β, h, the numbers of
        zeros and of multipliers of each mesh.
    """
    nodal = subject.traits.penalty == "nodal"
    meshes = [inf_sup_constant(scene, subject.for_case(scene.case()), nodal=nodal) for scene in refinements(case)]
    segments, constants = (np.array([getattr(mesh, name) for mesh in meshes]) for name in ("segment", "constant"))
    series = {
        CONSTANT: constants,
        SEGMENT: segments,
        ZERO_COUNT: np.array([mesh.n_zero for mesh in meshes], dtype=np.float64),
        MULTIPLIER_COUNT: np.array([mesh.n_multipliers for mesh in meshes], dtype=np.float64),
    }
    values = {ZEROS: float(series[ZERO_COUNT].max())}
    if (constants > 0).all():
        values[SLOPE] = float(np.polyfit(np.log(segments[-N_FITTED:]), np.log(constants[-N_FITTED:]), 1)[0])
    tolerances = {ZEROS: 0.0, SLOPE: MOST_SLOPE}
    details = {"β on the finest mesh": float(constants[-1])}
    return Measurement(check_all(values, tolerances), details=details, series=series)


def refuse_without_pressures(traits: Traits) -> str:
    """Return why there are no multipliers, or none whose unit is known, or an empty string."""
    return refuse_without_multipliers(traits) or refuse_unstated_penalty(traits)


INF_SUP = Property(
    id="stability.inf-sup",
    family="stability",
    summary="The bodies resist every pressure of the multipliers, as much on a fine mesh as on a coarse one.",
    quantities=(ZEROS, SLOPE),
    series={CONSTANT: "1", SEGMENT: "length", ZERO_COUNT: "1", MULTIPLIER_COUNT: "1"},
    cases=unless_given(refinement_cases),
    measure=measure_inf_sup,
    promise=lambda traits: traits.inf_sup,
    applicable=refuse_without_pressures,
    bodies=True,
)
