"""Ask whether the patch test holds where the master covers almost nothing of the last slave segment.

**Question.** The master ends inside a slave segment, of which it covers 1e-1 to 1e-12. Is the stress of a uniform
pressure exact?

**Why it matters.** As a body slides off an edge, every such share occurs. A nodal gap is then an integral over the
share, divided by another one. A multiplier has next to nothing to act on, and the matrix loses rank.

**How it is judged.** As in `patch.dead-zone`, and promised by the same trait, `covers_overhang`. Where the master
covers a share s of a segment, roundoff of a gap there grows by 1/s. So what is measured at single points (gaps and
pressures) has the rounding term 64 u X ε̂/(p s) more, and with multipliers all that is measured has X/s in place of X:
a force that no gap holds is known no better. Details say what the matrix of the exact solution is like: its reciprocal
condition, with multipliers scaled to the bodies, and how many of its singular values are 0 to roundoff. Nobody promises
anything about these two. A rank that falls by one is what an overlap of 0 means for a method with multipliers.

**Undecided.** Never.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.linear import RANK_ROUNDOFF, scale_factors
from contactverif.mechanics.scene import scene_of
from contactverif.mechanics.system import System
from contactverif.problems.blocks import exact_unknowns, pressure_of
from contactverif.problems.hard_scenes import vanishing_overlap_scenes
from contactverif_properties.dead_zone import DEAD_ZONE, measure_overhang
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.exact_multipliers import exact_multipliers
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.solved_patch import GAP, PRESSURE, STRESS, forces_to_draw

_POINTWISE = (GAP.name, PRESSURE.name)


def measure_vanishing_overlap(case: Case, subject: Subject) -> Measurement:
    """Return the errors of `measure_overhang` with tolerances for the share, and the condition and rank as details.

    Parameters
    ----------
    case : Case
        A uniform scene whose master ends inside a slave segment.
    subject : Subject
        The formulation.
    """
    measurement = measure_overhang(case, subject)
    rounding = 64 * UNIT_ROUNDOFF * case.largest_coordinate * case.penalty / pressure_of(case, case.penalty)
    more = rounding / covered_share(case)
    if subject.traits.enforcement == "multiplier":
        growth = 1 + more / measurement.tolerances[STRESS.name]  # The other tolerances are multiples of this one.
        numbers = [replace(number, tolerance=growth * number.tolerance) for number in measurement.numbers]
    else:
        numbers = [
            replace(number, tolerance=number.tolerance + more) if number.quantity.name in _POINTWISE else number
            for number in measurement.numbers
        ]
    return replace(measurement, numbers=numbers, details={**measurement.details, **_rank(case, subject)})


def covered_share(case: Case) -> float:
    """Return the least share of a slave segment that the master covers, of those of which it covers something."""
    slave, master = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    ends = np.sort(slave[case.interface.slave.segments], axis=1)
    covered = np.minimum(ends[:, 1], master.max()) - np.maximum(ends[:, 0], master.min())
    shares = covered / (ends[:, 1] - ends[:, 0])
    return float(shares[shares > 0].min())


def _rank(case: Case, subject: Subject) -> dict[str, float]:
    """Return the reciprocal condition and the lack of rank of the matrix at the exact solution."""
    scene, formulation, multipliers = scene_of(case), subject.for_case(case), np.zeros(0)
    penalty = np.inf if subject.traits.enforcement == "multiplier" else case.penalty
    pressure = pressure_of(case, penalty)
    exact = exact_unknowns(scene, pressure, penalty)
    if formulation.n_multipliers(case.interface):
        state = replace(case, z=scene.positions(exact))
        multipliers = exact_multipliers(state, subject, formulation, pressure)
    system, u = System(scene, formulation, use_tangent=False), np.append(exact, multipliers)
    matrix = system.matrix(u, system.pair(u))[0]
    rows, columns = scale_factors(matrix, scene.n_free)
    sizes = linalg.svdvals(rows[:, None] * matrix * columns)
    floor = RANK_ROUNDOFF * len(sizes) * UNIT_ROUNDOFF * sizes[0]
    return {"reciprocal condition": float(sizes[-1] / sizes[0]), "lack of rank": float((sizes <= floor).sum())}


def _divide_by_share(quantity: Quantity) -> Quantity:
    """Return the quantity with the tolerance that the share adds."""
    term = " + 64 u X ε̂/(p s)" if quantity.name in _POINTWISE else ""
    tolerance = f"{quantity.tolerance}{term}; with multipliers X/s in place of X"
    reason = "s is the share of the slave segment that the master covers, by which roundoff of its gap grows."
    return replace(quantity, tolerance=tolerance, reason=f"{quantity.reason} {reason}")


def promise_overhang(traits: Traits) -> bool | None:
    """Return True where an overhang is promised, else None."""
    return True if traits.covers_overhang else None


HARD_DEAD_ZONE = Property(
    id="hard.dead-zone",
    family="hard",
    summary="A uniform pressure stays exact where the master covers 1e-1 to 1e-12 of a slave segment.",
    quantities=tuple(map(_divide_by_share, DEAD_ZONE.quantities)),
    cases=unless_given(vanishing_overlap_scenes),
    measure=measure_vanishing_overlap,
    promise=promise_overhang,
    applicable=refuse_barrier,
    bodies=True,
    exact=forces_to_draw,
)
