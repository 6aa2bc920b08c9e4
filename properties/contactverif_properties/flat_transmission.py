"""Ask whether a uniform penetration of a flat interface gives the exact nodal forces on both sides.

**Question.** Two flat surfaces with different meshes penetrate each other by the same depth everywhere. Are the nodal
forces the consistent forces of the pressure ε̂ |g|, on the slave and on the master?

**Why it matters.** This is the patch test on the interface alone. A formulation that fails it puts a pressure onto the
bodies that is not there. Finer meshes do not help, because the error is made anew at every node.

**How it is judged.** The measured number is the largest |F − F_exact| / (ε̂ |g| L) over the nodes of both surfaces. The
exact forces are computed in rationals, by code that plugins cannot use. The tolerance is u(8X/|g| + 4N): a gap is a
difference of coordinates, each rounded to uX, and N forces are summed. X stands here for every formulation, because the
state is turned and moved, and stored as it is rounded; `stability.local` asks on states that are exact. With
multipliers only the distribution of the forces is judged, and not their size: of uniform multipliers if they are
pressures, and of those that come nearest to the exact forces if they are nodal forces.

**Undecided.** Never: every slave point faces the master's interior, and at a kink of a flat interface both partners
give the same gap.

**Source.** Zavarise & De Lorenzis (2009), Figs. 8, 16 and 20.
"""

from __future__ import annotations

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.strategies import flat_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.roundoff import gap_quantity
from contactverif_properties.shared.uniform_pressure import forces_of_penetration, transmission_error

FORCE_ERROR = gap_quantity("error of a nodal force")


def measure_transmission(case: Case, subject: Subject) -> Measurement:
    """Compare the nodal forces of a uniform penetration with the exact consistent forces.

    Parameters
    ----------
    case : Case
        A flat case with the parameter `penetration`, a length.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The largest |F − F_exact| / (ε̂ |g| L) over the nodes of both surfaces, dimensionless.
    """
    error, tolerance = transmission_error(case, subject)
    return Measurement([FORCE_ERROR.check(error, tolerance)])


FLAT_TRANSMISSION = Property(
    id="patch.flat.transmission",
    family="patch",
    summary="A uniform penetration of a flat interface gives the exact nodal forces on both sides.",
    quantities=(FORCE_ERROR,),
    cases=flat_cases,
    measure=measure_transmission,
    promise=lambda traits: traits.passes_flat_patch,
    applicable=refuse_barrier,
    exact=forces_of_penetration,
)
