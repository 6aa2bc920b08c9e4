"""Ask whether two rings that are shrunk onto each other find Lamé's pressure.

**Question.** Two elastic rings do not fit by δ = c/150, and the interface is a circle of radius c. Do the mean of the
forces and the mean of the reported pressures tend to the exact pressure as the mesh is refined, whichever ring is the
slave, and whatever the penalty?

**Why it matters.** A patch test on flat surfaces says nothing of bent ones: pipes, shafts, bearings. Springs that are
too soft wherever the surface bends, or pressures that are reported right only between parallel surfaces, pass every
flat test (`docs/concepts/curved-surfaces.md`).

**How it is judged.** A quarter of both rings is solved on two meshes, of 24 on 32 and 48 on 64 segments, at two
penalties (ε̂ c = E/2 and 5 E, E that of the softer ring) or with multipliers. The exact pressure is uniform, so that its
mean is asked: the sum of radial forces over all nodes of one side. Straight segments have an error of second order, so
that the combination (4 e_4 − e_2)/3 of both errors is judged, which is free of it. It is at most 4e-3. Where both sides
get the same force, 1e-7 to 4e-4 is measured, and 2.4e-3 where each has the pressure on its own radius (half passes).
Springs a quarter as stiff where the surface bends have 0.1 and more. The exact forces are Lamé's with contact measured
after the fit (`contactverif.problems.shrink_fit`): his formula alone is wrong by δ/c. The sum of reported pressures
over their weights is judged in the same way, and also beside the forces on the finer mesh, where 1e-4 is usual. Of two
passes the slave's points count, or the points of both, whichever comes nearer to the forces. The formulation's tangent
plays no part in the verdict: where Newton's method does not converge with it, it differentiates the residual. The error
E_F of nodal forces is a detail, because facets press with their middles at a high penalty, and no formulation is to
blame for that.

The total is known from the traits only if `penalty` is "distributed" and `area` is stated, or for multipliers. These
formulations are asked to pass.

**Undecided.** A case whose solution Newton's method does not find. A failing case in which an end of the slave has no
force: it faces the end of the master, and without a tolerance there roundoff decides whether it is in contact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from math import inf, pi

import numpy as np

from contactverif.contract.arrays import BoolArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import Solution, solve_for_accuracy
from contactverif.problems.problem import FORCES
from contactverif.problems.shrink_fit import FIT, FiniteFit, RingStudy, Role, shrink_fit
from contactverif_properties.patch_flat import refuse_unknown_total
from contactverif_properties.shared.applicability import refuse_dependent_multipliers
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.passes import nearest_sum

REFINEMENTS = (2, 4)  # Two meshes, one twice as fine, so that an error of second order can be taken away.
PENALTIES = (1e2, 1e3)
ROLES: tuple[Role, Role] = ("inner", "outer")
BOUND = 4e-3  # Nearly twice the largest value of a right formulation, a thirtieth of the smallest of a wrong one.

_REASON = "Straight segments have an error of second order, which two meshes take away; what is left is below 2.4e-3."
SLAVE = Quantity("error of the mean force on the slave", "1", f"{BOUND:g}", _REASON)
MASTER = Quantity("error of the mean force on the master", "1", f"{BOUND:g}", _REASON)
REPORTED = Quantity("error of the mean reported pressure", "1", f"{BOUND:g}", _REASON)
BESIDE = Quantity(
    "mean reported pressure against the forces",
    "1",
    f"{BOUND:g}",
    "Both are of the same solution; normals of segments and of nodes differ by their half angle.",
)


@dataclass(frozen=True, slots=True)
class Means:
    """The relative errors of the mean pressure on one mesh, by forces and by what is reported (NaN if nothing is)."""

    slave: float
    master: float
    reported: float


def measure_rings(case: Case, subject: Subject) -> Measurement:
    """Solve the rings on two meshes and compare the mean pressure with Lamé's.

    Returns
    -------
    Measurement
        (4 e_4 − e_2)/3 of the mean pressures from both sides' forces and from contact points, and by how much the last
        differ from the forces on the finer mesh; all relative, so dimensionless. Details: e_2 and e_4 of the slave's
        forces, their rate, and the error E_F of the slave's nodal forces.
    """
    study = RingStudy.from_case(case)
    fit = study.fit(subject.traits)
    means: list[Means] = []
    details: dict[str, float] = {}
    undecided = ""
    for refine in REFINEMENTS:
        posed = study.pose(refine, subject.traits)
        solution = solve_for_accuracy(posed.scene, subject)
        if not solution.balanced:
            return Measurement(undecided=f"Newton's method: {solution.end} at refine = {refine}")
        undecided = undecided or _lost_end(solution)
        means.append(_mean_errors(solution, fit, study.slave))
        forces = posed.errors(solution)[FORCES[0]]
        details |= {f"e_{refine}": means[-1].slave, f"E_F at refine = {refine}": forces}
    coarse, fine = means
    details["rate"] = float(np.log2(abs(coarse.slave / fine.slave))) if coarse.slave * fine.slave else inf
    values = {SLAVE: _extrapolate(coarse.slave, fine.slave), MASTER: _extrapolate(coarse.master, fine.master)}
    if not np.isnan(fine.reported):
        values[REPORTED] = _extrapolate(coarse.reported, fine.reported)
        values[BESIDE] = abs(fine.reported - fine.slave)
    return Measurement(check_all(values, BOUND), undecided, details=details)


def _lost_end(solution: Solution) -> str:
    """Return the reason why a failure means nothing if an end of the slave, and no more, has no force at all."""
    segments = solution.interface.slave.segments
    at_end: BoolArray = np.asarray(np.bincount(segments.ravel()) == 1)
    idle: BoolArray = np.asarray(~solution.forces[: len(at_end)].any(axis=1))
    lost = bool(idle[at_end].any()) and not idle[~at_end].any()
    return "an end of the slave faces that of the master, and roundoff decides whether it is in contact" if lost else ""


def _mean_errors(solution: Solution, fit: FiniteFit, slave: Role) -> Means:
    """Return the relative errors of the mean pressure over a quarter turn."""
    nodes, n_slave = solution.interface.nodes, solution.interface.n_slave_nodes
    outwards = nodes / np.linalg.norm(nodes, axis=1)[:, None]
    radial = (solution.forces * outwards).sum(axis=1) * (-1 if slave == "inner" else 1)
    exact, points = fit.force * pi / 2, solution.points
    reported = np.nan
    if points is not None:
        reported = nearest_sum(points, float(radial[:n_slave].sum())) / exact - 1
    return Means(float(radial[:n_slave].sum() / exact - 1), float(-radial[n_slave:].sum() / exact - 1), reported)


def _extrapolate(coarse: float, fine: float) -> float:
    """Return the size of an error on two meshes, one twice as fine, without its part of second order."""
    return abs(4 * fine - coarse) / 3


@cache
def rings() -> tuple[Case, ...]:
    """Return the coarser of both meshes, with either ring as the slave and at two penalties."""
    return tuple(
        replace(
            shrink_fit(FIT, slave=slave, refine=REFINEMENTS[0]),
            penalty=penalty,
            name=f"{slave} slave, ε̂ = {penalty:g}",
        ).case()
        for slave, penalty in product(ROLES, PENALTIES)
    )


def refuse_unknown_mean(traits: Traits) -> str:
    """Return why the mean pressure is unknown from the traits, or an empty string if they say enough."""
    if traits.enforcement == "multiplier":
        return refuse_dependent_multipliers(traits)
    return refuse_unknown_total(traits)


def promise_mean(traits: Traits) -> bool | None:
    """Return True where the traits say what the mean pressure is, and for multipliers, that they are unique."""
    if refuse_unknown_mean(traits) or (traits.enforcement == "multiplier" and not traits.independent_multipliers):
        return None
    return True


PATCH_CURVED = Property(
    id="patch.curved",
    family="patch",
    summary="Two rings that are shrunk onto each other find Lamé's pressure, whichever is the slave.",
    quantities=(SLAVE, MASTER, REPORTED, BESIDE),
    cases=unless_given(rings),
    measure=measure_rings,
    promise=promise_mean,
    applicable=refuse_unknown_mean,
    bodies=True,
)
