"""The patch test where the interface is a circle: two rings that are shrunk onto each other."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product
from math import inf, pi
from typing import Literal

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.engine_subject import EngineSubject
from contactverif.contract.interface import Interface
from contactverif.contract.measurement import Measurement, Quantity, check_all
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import Solution, shape_integrals
from contactverif.mechanics.solving import solve_for_accuracy
from contactverif.problems.problem import FORCES
from contactverif.problems.shrink_fit import FIT, SEGMENTS, FiniteFit, RingStudy, Role, shrink_fit
from contactverif_properties.patch_flat import refuse_unknown_total
from contactverif_properties.shared.applicability import refuse_dependent_multipliers
from contactverif_properties.shared.passes import nearest_sum

COARSE, FINE = 2, 4  # The coarser of two meshes; the other one is twice as fine. One case is asked on finer meshes.
PENALTIES = (1e2, 1e3)
ROLES: tuple[Role, Role] = ("inner", "outer")
# Right formulations have at most 5.4e-4 and 1.3e-4, strangers among them.
BOUNDS = {COARSE: 1e-3, FINE: 3e-4}
# Half passes have 2.7e-3 at the higher penalty, where facets are higher than the penetration.
HALF_PASSES = 4e-3
WHOLE_CODES = 4e-3  # CalculiX has 1.3e-3: a code averages normals as it likes, and rings of δ = c/150 show it.

_BOUND = f"{BOUNDS[COARSE]:g}, on finer meshes {BOUNDS[FINE]:g}"
_SECOND_ORDER = "Two meshes take away errors of second order; right formulations have at most 5.4e-4 and 1.3e-4 left."
SLAVE_MEAN = Quantity("error of the mean force on the slave", _BOUND, _SECOND_ORDER)
MASTER_MEAN = Quantity("error of the mean force on the master", _BOUND, _SECOND_ORDER)
REPORTED = Quantity("error of the mean reported pressure", _BOUND, _SECOND_ORDER)
BESIDE = Quantity(
    "mean reported pressure against the forces",
    _BOUND,
    "Both are of the same solution; normals of segments and of nodes differ by their half angle.",
)

BARE_NODES = Quantity(
    "slave nodes with less than a tenth of their share",
    "4",
    "A quarter has two ends, where a foot may lie just past the master's last node: a mortar method leaves out that "
    "segment with its two nodes. A mean hides what lacks.",
)


@cache
def rings() -> tuple[Case, ...]:
    """Return the coarser of both meshes, with either ring as the slave, at two penalties; one case on finer meshes."""
    choices = [(slave, penalty, COARSE, "") for slave, penalty in product(ROLES, PENALTIES)]
    choices.append((ROLES[0], PENALTIES[0], FINE, ", finer"))
    return tuple(
        replace(
            shrink_fit(FIT, slave=slave, refine=refine), penalty=penalty, name=f"{slave} slave, ε̂ = {penalty:g}{word}"
        ).case()
        for slave, penalty, refine, word in choices
    )


def bound_of_rings(refine: int, penalty: float, traits: Traits) -> float:
    """Return the bound on a mesh and the one that is twice as fine.

    Springs that are the same if slave and master exchange their roles, and do not balance, are two half passes.
    """
    half_passes = traits.promises.unbiased is True and traits.promises.conserves_force is not True
    return HALF_PASSES if half_passes and penalty == PENALTIES[1] else BOUNDS[refine]


def refuse_unknown_mean(traits: Traits) -> str:
    """Return why the mean pressure is unknown from the traits, or an empty string if they say enough."""
    if traits.rules.enforcement == "multiplier":
        return refuse_dependent_multipliers(traits)
    return refuse_unknown_total(traits)


def promise_mean(traits: Traits) -> bool | None:
    """Return True where the traits say what the mean pressure is.

    Of multipliers it is known if they are unique, unless their inf-sup constant falls as meshes are refined: then
    pressures that alternate from node to node are part of the solution, and what they add to the mean is no second
    order of the mesh.
    """
    promises = traits.promises
    unsure = not promises.independent_multipliers or promises.inf_sup is False
    if refuse_unknown_mean(traits) or (traits.rules.enforcement == "multiplier" and unsure):
        return None
    return True


@Property.define(
    id="patch.curved",
    rank=470,
    family="patch",
    quantities=(SLAVE_MEAN, MASTER_MEAN, REPORTED, BESIDE, BARE_NODES),
    cases=Cases.from_list(rings),
    promise=promise_mean,
    applicable=refuse_unknown_mean,
    bodies=True,
    engines=True,
)
def patch_curved(case: Case, subject: Subject) -> Measurement:
    """Two rings that are shrunk onto each other find Lamé's pressure, whichever is the slave.

    **Question.** Two elastic rings do not fit by δ = c/150, and the interface is a circle of radius c. Do the mean of
    the forces and the mean of the reported pressures tend to the exact pressure as the mesh is refined, whichever ring
    is the slave, and whatever the penalty?

    **Why it matters.** A patch test on flat surfaces says nothing of bent ones: pipes, shafts, bearings. Springs that
    are too soft wherever the surface bends, or pressures that are reported right only between parallel surfaces, pass
    every flat test (`docs/concepts/curved-surfaces.md`).

    **How it is judged.** A quarter of both rings is solved on two meshes, of 24 on 32 and 48 on 64 segments, at two
    penalties (ε̂ c = E/2 and 5 E, E that of the softer ring) or with multipliers, and once on 48 on 64 and 96 on 128
    segments. The exact pressure is uniform, so that its mean is asked: the sum of radial forces over all nodes of one
    side. Straight segments have an error of second order, so that the combination (4 e_4 − e_2)/3 of both errors is
    judged, which is free of it. Where both sides get the same force, at most 5.4e-4 is measured and 1e-3 allowed, and
    on the finer meshes 1.3e-4 and 3e-4. Springs a quarter as stiff where the surface bends have 0.1 and more. The exact
    forces are Lamé's with contact measured after the fit (`contactverif.problems.shrink_fit`): his formula alone is
    wrong by δ/c. Half passes, which prefer no side and do not balance (`unbiased`, `conserves_force`), push each ring
    with the pressure on that ring's own radius, and have their own exact forces. They have 2.7e-3 at the higher
    penalty, where facets of the coarser mesh are higher than the penetration, and 4e-3 is allowed there. Where the
    traits leave open whether a formulation is one of them, the exact forces count that it comes nearer to. The sum of
    reported pressures over their weights is judged in the same way, and also beside the forces on the finer mesh, where
    1e-4 is usual. A quarter has two ends, where the foot of the slave's last node may lie just past the master's last
    node. Who loses contact there is not wrong, so that whoever fails by no more than two segments bear is judged on
    whole rings, which have no ends. Of two passes the slave's points count, or the points of both, whichever comes
    nearer to the forces. The formulation's tangent plays no part in the verdict: where Newton's method does not
    converge with it, it differentiates the residual. The error E_F of nodal forces is a detail, because facets press
    with their middles at a high penalty, and no formulation is to blame for that.

    A whole code is allowed 4e-3, as it has normals of its own. No more than the four nodes at the ends may have less
    than a tenth of their share: a search that loses pairs leaves the mean as it is, where others bear more.

    The total is known from the traits only if `penalty` is "distributed" and `area` is stated, or for multipliers that
    are independent. These formulations are asked to pass, but not multipliers that state `inf_sup=False`.

    **Undecided.** A case whose solution Newton's method does not find.
    """
    study = RingStudy.from_case(case)
    coarser = len(case.interface.slave) // SEGMENTS[study.slave]
    measurement = _measure(study, coarser, subject, quarters=1)
    passes = all(number.ratio <= 1 for number in measurement.numbers)
    errors = [value for name, value in measurement.values.items() if name != BARE_NODES.name]
    if measurement.undecided or passes or max(errors) > 2 / len(case.interface.slave):
        return measurement  # The two segments at the ends bear no more than that.
    whole = _measure(study, coarser, subject, quarters=4)
    return replace(measurement, undecided=f"whole rings: {whole.undecided}") if whole.undecided else whole


def _measure(study: RingStudy, coarser: int, subject: Subject, quarters: Literal[1, 4]) -> Measurement:
    """Solve a quarter of the rings, or whole ones, on a mesh and one that is twice as fine, and return their errors."""
    fits = study.fits(subject.traits)
    means: list[FloatArray] = []  # For each fit: of the slave, of the master, and as reported
    details: dict[str, float] = {}
    bare = 0
    for refine in (coarser, 2 * coarser):
        instance = study.pose(refine, subject.traits, quarters=quarters)
        solution = solve_for_accuracy(instance.scene, subject)
        if not solution.balanced:
            method = "Newton's method: " if solution.trace is not None else ""
            return Measurement(undecided=f"{method}{solution.end} at refine = {refine}")
        means.append(np.stack([_mean_errors(solution, fit, study.slave, quarters * pi / 2) for fit in fits]))
        bare = max(bare, count_bare(solution.interface, solution.forces))
        details[f"E_F at refine = {refine}"] = instance.errors(solution)[FORCES[0]]
    coarse, fine = _nearest(*means)
    details |= {
        f"e_{refine}": float(mean[0]) for refine, mean in zip((coarser, 2 * coarser), (coarse, fine), strict=True)
    }
    details["rate"] = float(np.log2(abs(coarse[0] / fine[0]))) if coarse[0] * fine[0] else inf
    slave, master, reported = (np.abs(4 * fine - coarse) / 3).tolist()  # Without their parts of second order
    values = {SLAVE_MEAN: slave, MASTER_MEAN: master}
    if not np.isnan(fine[2]):
        values |= {REPORTED: reported, BESIDE: float(abs(fine[2] - fine[0]))}
    if isinstance(subject, EngineSubject):
        numbers = [*check_all(values, WHOLE_CODES), BARE_NODES.check(float(bare), 4.0)]
        return Measurement(numbers, details=details)
    return Measurement(check_all(values, bound_of_rings(coarser, study.penalty, subject.traits)), details=details)


def count_bare(interface: Interface, forces: FloatArray) -> int:
    """Return how many slave nodes have less than a tenth of the force that the lengths of their segments give them.

    The forces are those on all nodes (n_nodes, 2).
    """
    n_slave = interface.n_slave_nodes
    shares = shape_integrals(interface.slave, interface.nodes)[:n_slave]
    sizes = np.linalg.norm(forces[:n_slave], axis=1)
    return int((sizes < sizes.sum() / shares.sum() * shares / 10).sum())


def _nearest(coarse: FloatArray, fine: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the errors (3,) on both meshes by the fit of several (n_fits, 3) that the forces come nearest to."""
    fit = np.abs(4 * fine - coarse)[:, :2].max(axis=1).argmin()
    return coarse[fit], fine[fit]


def _mean_errors(solution: Solution, fit: FiniteFit, slave: Role, angle: float) -> FloatArray:
    """Return the relative errors (3,) of the mean pressure over an angle, by slave, master and reported points.

    The last is NaN if nothing is reported.
    """
    nodes, n_slave = solution.interface.nodes, solution.interface.n_slave_nodes
    outwards = nodes / np.linalg.norm(nodes, axis=1)[:, None]
    radial = (solution.forces * outwards).sum(axis=1) * (-1 if slave == "inner" else 1)
    exact, exact_on_master, points = fit.force * angle, fit.master_force * angle, solution.points
    reported = np.nan
    if points is not None:
        reported = nearest_sum(points, float(radial[:n_slave].sum())) / exact - 1
    return np.array([radial[:n_slave].sum() / exact - 1, -radial[n_slave:].sum() / exact_on_master - 1, reported])
