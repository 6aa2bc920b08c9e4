"""Ask whether a tilted slave's nodes share the force of a linear gap exactly.

**Question.** A straight slave is tilted against a flat master and penetrates it with all its length, so that the gap
is linear. Is the force on each node of the slave ε̂ ∫ N_i |g| ds?

**Why it matters.** A method that integrates a linear pressure exactly takes bending and Hertz-like pressures on coarse
meshes better than one that knows constant pressures alone. Many good methods do not: those with points in the middle of
parts, and mortar methods, whose pressures come from weighted means.

**How it is judged.** The largest error of a nodal force on the slave counts over the total. Gap, direction and lengths
follow from the traits as in `patch.tilted.resultant`. The tolerance is u(8Z/|g| + 4N), likewise.

**Undecided.** Never: the slave is in contact with all its length, and far from the ends of the master.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.strategies.straight import tilted_cases
from contactverif_properties.shared.linear_gaps import (
    exact_slave_forces,
    knows_linear_total,
    node_gaps,
    refuse_unknown_direction,
    slave_forces,
)
from contactverif_properties.shared.roundoff import gap_tolerance, rounding_distance, stated_gap_quantity

NODAL = stated_gap_quantity("error of a nodal force")


def measure_tilted_nodal(case: Case, subject: Subject) -> Measurement:
    """Return the largest error of a nodal force on the tilted slave over the exact total, dimensionless."""
    exact, forces = exact_slave_forces(case, subject.traits), slave_forces(case, subject)
    error = float(np.linalg.norm(forces - exact, axis=1).max()) / float(np.linalg.norm(exact.sum(axis=0)))
    depth = abs(float(node_gaps(case).mean()))
    tolerance = gap_tolerance(case, depth, rounding_distance(case, subject.traits))
    return Measurement([NODAL.check(error, tolerance)], idle=not forces.any())


def refuse_unknown_integral(traits: Traits) -> str:
    """Return why no exact nodal force follows from the traits, or an empty string if one does."""
    if traits.enforcement == "multiplier":
        return "multipliers have pressures of their own, not those of a gap"
    if not knows_linear_total(traits):
        return "the traits `penalty`, `area`, `gap` and `force_along` do not state all of the integral"
    return refuse_unknown_direction(traits)


TILTED_NODAL = Property(
    id="patch.tilted.nodal",
    family="patch",
    summary="Each node of a straight, tilted slave gets the exact integral of its linear gap.",
    quantities=(NODAL,),
    cases=tilted_cases,
    measure=measure_tilted_nodal,
    promise=lambda traits: traits.integrates_linear_gap,
    applicable=refuse_unknown_integral,
)
