"""The patch test where the interface is a circle, as of two rings that are shrunk on each other, or a broken line."""

from dataclasses import replace
from functools import cache, partial
from itertools import product
from math import inf, pi
from typing import Literal

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case, Cases
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import PLANE, Interface
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import SOLVE, CheckedFormulation, EngineSubject, Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import Solution, shape_integrals, solve_by_engine, solve_for_accuracy
from contactverif.mechanics.newton import End, Trace, solve
from contactverif.mechanics.scene import Scene
from contactverif.problems.kinked_patch import KinkedPatch, exact_unknowns, kinked_patch, patch_of
from contactverif.problems.problem import FORCES
from contactverif.problems.shrink_fit import FIT, SEGMENTS, FiniteFit, RingStudy, Role, shrink_fit
from contactverif.problems.space_problems import SHELLS, shell_cases
from contactverif.problems.uniform_stress import uniform_forces
from contactverif_properties.applicability import LINEAR_FORCES, refuse_dependent_multipliers, refuse_unknown_total
from contactverif_properties.newton_method import end_details
from contactverif_properties.patch_solved import ITERATIONS, engine_tolerance, is_solved, nearest_to_balance
from contactverif_properties.states import FrozenState, nearest_sum

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


MOST_OF_MEAN, MOST_OF_NODES = 0.05, 0.2
SHELL_MEAN = Quantity("error of the mean traction on a sphere", f"{MOST_OF_MEAN:g}", "Right ones have at most 0.03.")
SHELL_COARSE = Quantity(
    "error of the mean traction on a sphere, r = 1",
    f"{4 * MOST_OF_MEAN:g}",
    "Lengths are twice those of the other mesh, and the error is of second order. Right ones have at most 0.07.",
)
SHELL_NODES = Quantity(
    "error of nodal tractions on a sphere",
    f"{MOST_OF_NODES:g}",
    "Right ones have at most 0.06; a dual mortar method of a stranger has 0.14.",
)


@cache
def _rings() -> tuple[Case, ...]:
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


def _refuse_unknown_mean(traits: Traits) -> str:
    if traits.rules.enforcement == "multiplier":
        return refuse_dependent_multipliers(traits)
    return refuse_unknown_total(traits)


def _promise_mean(traits: Traits) -> bool | None:
    """Return True where the traits say what the mean pressure is.

    Of multipliers it is known if they are unique, unless their inf-sup constant falls as meshes are refined: then
    pressures that alternate from node to node are part of the solution, and what they add to the mean is no second
    order of the mesh.
    """
    promises, multiplier = traits.promises, traits.rules.enforcement == "multiplier"
    if not traits.abilities.in_plane and promises.patch.flat is not True:
        return (
            None  # Nodes lie outside of their sphere by a third of the penetration, where facets are right in the mean.
        )
    unsure = not promises.independent_multipliers or promises.inf_sup is False
    return None if _refuse_unknown_mean(traits) or (multiplier and unsure) else True


@Property.define(
    id="patch.curved",
    rank=485,
    quantities=(SLAVE_MEAN, MASTER_MEAN, REPORTED, BESIDE, BARE_NODES, SHELL_MEAN, SHELL_COARSE, SHELL_NODES),
    cases=Cases.from_list(_rings),
    cases_in_space=Cases.from_list(shell_cases),
    linear=LINEAR_FORCES,
    promise=_promise_mean,
    applicable=_refuse_unknown_mean,
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

    In space two spherical shells are shrunk onto each other by δ = c/30, an octant with 8 faces along an edge of the
    inner one on 6, at ε̂ c = E/2. The nodes of both surfaces lie a little outside of their spheres, so that facets
    enclose the volume of the ball. The mean of radial forces over the slave's area is right to 0.05, and that of each
    node, in the mean square, to 0.2; right ones have 0.03 and 0.14. With 4 faces on 3 facets that meet are inclined by
    15° in the middle, and by up to 23°; the mean is right to 0.2, where right ones have 0.07, and a search that leaves
    out faces above 13° loses 0.3. Who fails is judged on whole spheres, since on an octant the foot of a node on a
    plane of symmetry may lie past the border.

    The total is known from the traits only if `penalty` is "distributed" and `area` is stated, or for multipliers that
    are independent. These formulations are asked to pass, but not multipliers that state `inf_sup=False`.

    **Undecided.** A case whose solution Newton's method does not find.
    """
    if case.interface.dim != PLANE:
        measurement = _measure_shells(case, subject)
        if measurement.undecided or all(number.ratio <= 1 for number in measurement.numbers):
            return measurement
        return _measure_shells(case, subject, whole=True).after("solved as whole spheres")
    study = RingStudy.from_case(case)
    coarser = len(case.interface.slave) // SEGMENTS[study.slave]
    measurement = _measure(study, coarser, subject, quarters=1)
    passes = all(number.ratio <= 1 for number in measurement.numbers)
    errors = [value for name, value in measurement.values.items() if name != BARE_NODES.name]
    if measurement.undecided or passes or max(errors) > 2 / len(case.interface.slave):
        return measurement  # The two segments at the ends bear no more than that.
    whole = _measure(study, coarser, subject, quarters=4)
    return replace(measurement, undecided=f"whole rings: {whole.undecided}") if whole.undecided else whole


def _measure_shells(case: Case, subject: Subject, *, whole: bool = False) -> Measurement:
    """Solve both shells on two meshes; return the errors of the mean radial force over the slave's area, and of each.

    On the coarser one normals of facets that meet differ by up to 23°.
    """
    inner_slave, errors = bool(case.parameter("inner_slave")), []
    exact = SHELLS.traction(inner_slave=inner_slave, traits=subject.traits)
    for refine in (1, 2):
        scene = SHELLS.scene(inner_slave=inner_slave, refine=refine, whole=whole)
        solution = solve_for_accuracy(scene, subject)
        nodes, n_slave = scene.interface.nodes, scene.interface.n_slave_nodes
        outwards = nodes[:n_slave] / np.linalg.norm(nodes[:n_slave], axis=1)[:, None]
        radial = np.abs((solution.forces[:n_slave] * outwards).sum(axis=1))
        areas = shape_integrals(scene.interface.slave, nodes)[:n_slave]
        errors.append(abs(float(radial.sum() / areas.sum()) / exact - 1))
    each = float(np.sqrt(np.mean((radial / areas / exact - 1) ** 2)))
    undecided = "" if solution.balanced else f"no solution: {solution.end}"
    values = {SHELL_MEAN: errors[1], SHELL_COARSE: errors[0], SHELL_NODES: each}
    return Measurement(
        check_all(values, {SHELL_MEAN: MOST_OF_MEAN, SHELL_COARSE: 4 * MOST_OF_MEAN, SHELL_NODES: MOST_OF_NODES}),
        undecided,
    )


def _measure(study: RingStudy, coarser: int, subject: Subject, quarters: Literal[1, 4]) -> Measurement:
    """Solve a quarter of the rings, or whole ones, on a mesh and one that is twice as fine, and return their errors."""
    fits, meshes = study.fits(subject.traits), (coarser, 2 * coarser)
    means: list[FloatArray] = []  # For each fit: of the slave, of the master, and as reported
    details: dict[str, float] = {}
    bare = 0
    for refine in meshes:
        instance = study.pose(refine, subject.traits, quarters=quarters)
        solution = solve_for_accuracy(instance.scene, subject)
        if not solution.balanced:
            method = "Newton's method: " if solution.trace is not None else ""
            return Measurement(undecided=f"{method}{solution.end} at refine = {refine}")
        means.append(np.stack([_mean_errors(solution, fit, study.slave, quarters * pi / 2) for fit in fits]))
        bare = max(bare, count_bare(solution.interface, solution.forces))
        details[f"E_F at refine = {refine}"] = instance.errors(solution)[FORCES[0]]
    nearest = np.abs(4 * means[1] - means[0])[:, :2].max(axis=1).argmin()  # The fit that the forces come nearest to.
    coarse, fine = means[0][nearest], means[1][nearest]
    details |= {f"e_{refine}": float(mean[0]) for refine, mean in zip(meshes, (coarse, fine), strict=True)}
    details["rate"] = float(np.log2(abs(coarse[0] / fine[0]))) if coarse[0] * fine[0] else inf
    slave, master, reported = (np.abs(4 * fine - coarse) / 3).tolist()  # Without their parts of second order
    values = {SLAVE_MEAN: slave, MASTER_MEAN: master}
    if not np.isnan(fine[2]):
        values |= {REPORTED: reported, BESIDE: float(abs(fine[2] - fine[0]))}
    is_code = isinstance(subject, EngineSubject)
    bound = WHOLE_CODES if is_code else bound_of_rings(coarser, study.penalty, subject.traits)
    nodes = (BARE_NODES.check(float(bare), 4.0),) if is_code else ()
    action = f"solved {'as whole rings ' if quarters == 4 else ''}on this mesh and on one that is twice as fine"
    return Measurement([*check_all(values, bound), *nodes], details=details).after(action)


def count_bare(interface: Interface, forces: FloatArray) -> int:
    """Return how many slave nodes have less than a tenth of the force that the lengths of their segments give them."""
    n_slave = interface.n_slave_nodes
    shares = shape_integrals(interface.slave, interface.nodes)[:n_slave]
    sizes = np.linalg.norm(forces[:n_slave], axis=1)
    return int((sizes < sizes.sum() / shares.sum() * shares / 10).sum())


def _mean_errors(solution: Solution, fit: FiniteFit, slave: Role, angle: float) -> FloatArray:
    """Return the relative errors (3,) of the mean pressure over an angle: slave, master, reported points (or NaN)."""
    nodes, n_slave = solution.interface.nodes, solution.interface.n_slave_nodes
    outwards = nodes / np.linalg.norm(nodes, axis=1)[:, None]
    radial = (solution.forces * outwards).sum(axis=1) * (-1 if slave == "inner" else 1)
    exact, exact_on_master, points = fit.force * angle, fit.master_force * angle, solution.points
    reported = np.nan
    if points is not None:
        reported = nearest_sum(points, float(radial[:n_slave].sum())) / exact - 1
    return np.array([radial[:n_slave].sum() / exact - 1, -radial[n_slave:].sum() / exact_on_master - 1, reported])


LINES = {
    "roof of 41°": ((0.0, 0.0), (4.0, 1.5), (8.0, 0.0)),
    # At 90° the slave's normal sees the other facet edge-on, and the tolerance has no bound.
    "roof of 80°": ((0.0, -1.68), (4.0, 1.68), (8.0, -1.68)),
    "edge of 53°": ((0.0, 0.0), (4.0, 0.0), (7.0, -4.0)),
}
MODERATE = 10.0  # ε̂ ℓ/E with two normals.
STIFF = (3e3, 3e4, 3e5)  # ε̂ ℓ/E with three normals.
# p/E with two and three normals: roundoff is over the penetration, which stiff springs make small.
STRAINS = (1e-6, 1e-4)
SHARE = 4.0  # Bound of the stress error with three normals over E/(ε̂ ℓ); 0.01 to 2.4 is measured.
SLOPE = 0.95  # Decades by which the error falls over a decade of the penalty; 0.99 to 1.00 is measured.

_TOLERANCE = "(g/ℓ) tan(φ/2) (4 + tan(φ/2) tan(φ)/2) + u (8X/g + 4N)"
_REASON = (
    "The kink moves along a facet by w = g tan(φ/2). Springs along the slave's normal see the other facet from a strip "
    "of width w, where the gap grows by s tan(φ). Gaps are differences of positions, and N forces are summed."
)
STRESS = Quantity("stress error", _TOLERANCE, _REASON)
_LENGTHS = f"{_TOLERANCE} + p (1 + ν)(1 − 2ν)/E"
_CONTRACTION = f"{_REASON} Lengths of the reference are longer than current ones by the contraction of the blocks."
SLAVE = Quantity("slave force error", _LENGTHS, _CONTRACTION)
MASTER = Quantity("master force error", _LENGTHS, _CONTRACTION)
PRESSURE = Quantity("reported pressure error", _LENGTHS, _CONTRACTION)
APPROACH = Quantity(
    "error of the approach",
    "((1 + ε̂ h/E) T + p (1 + ν)(1 − 2ν)/E)/sin(φ/2)",
    "Balance gives the mean pressure of each facet, up to the tolerance T of forces and the contraction of lengths. "
    "Two gaps on normals at the angle φ give a translation. Errors of forces that balance one another bend a body as "
    "deep as the longest segment h.",
)
CUT = Quantity(
    "stress error, three normals",
    f"max({SHARE:g} E/(ε̂ ℓ), {_TOLERANCE})",
    "Springs give way unequally, by 1/ε̂ over ℓ/E.",
)
FALL = Quantity(
    "fall of the stress error over a decade of ε̂",
    f"{SLOPE}",
    "The error is of first order in 1/ε̂; its part of second order is left.",
    sense="at least",
)


@cache
def _kinked_cases() -> tuple[Case, ...]:
    return tuple(
        replace(
            kinked_patch(KinkedPatch(line, pressure=STRAINS[0]), upper_slave=upper, penalty=MODERATE),
            name=f"{name}, {'upper' if upper else 'lower'} slave",
        ).case()
        for (name, line), upper in product(LINES.items(), (True, False))
    )


_define_kinked = partial(
    Property.define,
    cases=Cases.from_list(_kinked_cases),
    linear=LINEAR_FORCES,
    promise=lambda traits: traits.promises.patch.kinked,
    bodies=True,
)


@_define_kinked(
    id="patch.kinked",
    rank=500,
    quantities=(STRESS, SLAVE, MASTER, PRESSURE, APPROACH, CUT, FALL),
    exact=lambda case: uniform_forces(case.interface, patch_of(case)[0].pressure),
)
def patch_kinked(case: Case, subject: Subject) -> Measurement:
    """A uniform pressure stays exact on an interface with a kink.

    **Question.** The interface of two blocks of one material is a broken line, and the same pressure acts on all sides.
    Are the stress, the forces on both sides and the reported pressure the exact ones, on both sides of the kink?

    **Why it matters.** Corners, chamfers and the facets of any curved mesh are kinks. A normal that is averaged over a
    kink, or a slave node at a kink that is pushed along one facet alone, gives wrong forces there, whatever the mesh.

    **How it is judged.** The stress is hydrostatic. Nodes of both meshes lie at the kink and nowhere else on one
    another.

    - *Two normals.* Springs of ε̂ = 10 E/ℓ give way by g = p/ε̂, which is a translation of one block, so that the
      uniform state is exact. The stress at Gauss points over p, the nodal forces over the largest exact one, and the
      mean absolute error of the reported pressures, with the plugin's weights, over p are at most T = (g/ℓ) tan(φ/2) (4
      + tan(φ/2) tan(φ)/2) + u (8X/g + 4N) at p = 1e-6 E: penetration moves the slave's kink along the facet by g
      tan(φ/2), beyond which the gap along the slave's normal grows by tan(φ), and gaps are differences of positions.
      Forces and reported pressures may count current or reference lengths, which differ by the contraction of the
      blocks. As in `patch.flat.solve` the residual alone is asked, by differences. Newton's method starts at the first
      guess, and where it ends elsewhere, again at the exact solution.
    - *The approach.* Where the traits say how stiff the springs are, and for multipliers, the mean motion of the
      slave's nodes past those of the master is the exact one, g along each normal. Right formulations are within 1.1e-6
      g; springs that are 1 % too stiff are off by 1e-2 g, and no stress shows it.
    - *Three normals.* The ridge is cut off. Springs cannot give way uniformly along three normals, so that the stress
      error falls like 1/ε̂. At ε̂ = 3e4 E/ℓ it is at most 4 E/(ε̂ ℓ). From 3e3 to 3e4 E/ℓ, or from there to 3e5 E/ℓ, it
      falls by at least 0.95 decades: earlier the part of second order counts, later roundoff may. Where the error is
      below T, as that of multipliers, nothing need fall.

    The trait `patch.kinked` promises it.

    **Undecided.** A case whose uniform state is exact, but whose solution with three normals Newton's method does not
    find. A failing case in which the matrix at the exact state is singular, although there are forces: then that state
    was judged, and nobody knows whether a solution is near.
    """
    problem, upper_slave = patch_of(case)
    return _add_three_normals(_measure_two_normals(case, subject), problem, upper_slave, subject)


def _measure_two_normals(case: Case, subject: Subject) -> Measurement:
    problem, upper_slave = patch_of(case)
    penalty, traits, pressure = case.penalty, subject.traits, problem.pressure
    scene, gap = kinked_patch(problem, upper_slave=upper_slave, penalty=penalty), pressure / penalty
    start = Case(scene.interface, scene.positions(scene.start), penalty)
    formulation, multiplier = subject.for_case(start), traits.rules.enforcement == "multiplier"
    uniform = exact_unknowns(problem, scene, 0.0 if multiplier else gap)
    trace, u, singular = _solve(scene, formulation, uniform, gap)
    q, multipliers = u[: scene.n_free], u[scene.n_free :]
    contact = FrozenState.at(formulation, replace(start, z=scene.positions(q)).with_multipliers(multipliers))
    by_contact, by_bodies = -contact.forces, scene.nodal_forces(q)
    exact, n_slave = uniform_forces(scene.interface, pressure), scene.interface.n_slave_nodes
    errors = np.maximum(*(np.linalg.norm(forces - exact, axis=1) for forces in (by_bodies, by_contact)))
    slave, master = np.split(errors / np.linalg.norm(exact, axis=1).max(), [n_slave])
    values = {STRESS: _kink_stress_error(problem, scene, q), SLAVE: float(slave.max()), MASTER: float(master.max())}
    unique = not multiplier or traits.promises.independent_multipliers is True
    # Nobody says how two passes share the pressure.
    if unique and traits.rules.penalty == "distributed" and contact.has_points and not contact.points.on_master.any():
        values[PRESSURE] = _pressure_error(contact.points, pressure)
    floor = _kink_floor(problem, start, gap)
    tolerances = dict.fromkeys(values, floor + problem.contraction) | {STRESS: floor}
    if multiplier or not refuse_unknown_total(traits):
        # The mean motion of the slave's nodes past those of the master, less that of the uniform state, over g.
        motion = (scene.positions(q) - scene.positions(uniform[: scene.n_free])).reshape(-1, 2) / gap
        of_slave, of_master = (part.mean(axis=0) for part in np.split(motion, [n_slave]))
        values[APPROACH] = float(np.linalg.norm(of_slave - of_master))
        sides = start.interface.slave, start.interface.master
        bent = penalty * max(side.lengths(start.positions).max() for side in sides) / problem.young
        sine = problem.sharpest / np.hypot(1, problem.sharpest)
        tolerances[APPROACH] = float(((1 + bent) * floor + problem.contraction) / sine)
    idle = not by_contact.any()
    undecided = "Newton's method: the matrix at the exact state is singular" if singular and not idle else ""
    return Measurement(check_all(values, tolerances), undecided, details=end_details(trace), idle=idle)


def _solve(
    scene: Scene, formulation: CheckedFormulation, exact: FloatArray, penetration: float
) -> tuple[Trace, FloatArray, bool]:
    """Return Newton's trace, the solution (n_free + n_multipliers,) that is judged, and whether no step led to it.

    Newton's method may end elsewhere than at the exact solution, since large motions have other solutions too. Then it
    starts again at the exact solution, where a formulation that passes is in balance and does not move. A formulation
    that is not in balance there is judged where it comes nearest to balance afterwards. Distances from the exact
    solution are measured by its penetration p/ε̂.
    """
    trace = solve(scene, formulation, iterations=ITERATIONS, use_tangent=False, solution_only=True)
    if is_solved(trace, exact, penetration):
        return trace, trace.u[-1], False
    again = solve(scene, formulation, start=exact, iterations=ITERATIONS, use_tangent=False, solution_only=True)
    return trace, nearest_to_balance(again), again.end is End.SINGULAR and len(again.u) == 1


def _add_three_normals(
    measurement: Measurement, problem: KinkedPatch, upper_slave: bool, subject: Subject
) -> Measurement:
    """Return the measurement with what the cut ridge adds; a failure of the uniform state decides without it."""
    stiff = replace(problem.cut(), pressure=STRAINS[1] * problem.young)
    errors, floors = [], []
    for stiffness in STIFF:
        penalty = stiffness * problem.young
        scene = kinked_patch(stiff, upper_slave=upper_slave, penalty=penalty)
        solution = solve_for_accuracy(scene, subject)
        if solution.trace is None or not solution.balanced:
            break
        errors.append(_kink_stress_error(stiff, scene, solution.trace.solution))
        floors.append(_kink_floor(stiff, solution.state, stiff.pressure / penalty))
    if len(errors) < 2:
        fails = any(number.value > number.tolerance for number in measurement.numbers)
        reason = f"Newton's method with three normals: {solution.end}"
        return measurement if fails else Measurement(undecided=reason, details=measurement.details)
    numbers = [*measurement.numbers, CUT.check(errors[1], max(SHARE / STIFF[1], floors[1]))]
    if errors[1] > floors[1]:
        numbers.append(FALL.check(float(-np.diff(np.log10(errors)).min()), SLOPE))
    names = [f"stress error, three normals, ε̂ = {stiffness:g} E/ℓ" for stiffness in STIFF]
    details = {**measurement.details, **dict(zip(names, errors, strict=False))}
    action = f"with the ridge cut, solved at ε̂ = {' · '.join(f'{each:g}' for each in STIFF)} E/ℓ"
    return replace(measurement, numbers=numbers, details=details).after(action, CUT, FALL)


def _kink_floor(problem: KinkedPatch, state: Case, gap: float) -> float:
    half = problem.sharpest  # With t = tan(φ/2), tan(φ) = 2t/(1 − t²).
    moved = gap / state.shortest_segment * half * (4 + half**2 / (1 - half**2))
    return moved + UNIT_ROUNDOFF * (8 * state.largest_coordinate / gap + 4 * state.n_segments)


def _kink_stress_error(problem: KinkedPatch, scene: Scene, q: FloatArray) -> float:
    exact = np.array([-problem.pressure, -problem.pressure, 0.0])
    return max(float(np.abs(stresses - exact).max()) for stresses in scene.stresses(q)) / problem.pressure


def _pressure_error(points: ContactPoints, pressure: float) -> float:
    """Return the mean of |p − p_exact|/p over the weights; infinite if no point has any."""
    counted = points.weight > 0
    if not counted.any():
        return np.inf
    errors = np.abs(np.where(points.active, points.pressure, 0.0)[counted] / pressure - 1)
    return float(np.average(errors, weights=points.weight[counted]))


KINK_TERMS = (
    "(g/ℓ) tan(φ/2) (4 + tan(φ/2) tan(φ)/2) + u (8X/g + 4N) + p (1 + ν)(1 − 2ν)/E + a (1 + M U/(ℓ p)) + 1e-12 κ"
)
KINK_REASON = "Penetration moves the kink along a facet, and blocks contract; displacements are wrong by a U."
KINK_STRESS = Quantity("stress error", KINK_TERMS, KINK_REASON)
KINK_FORCES = Quantity("error of a nodal force", KINK_TERMS, KINK_REASON)


@_define_kinked(id="engine.kinked", needs=frozenset({SOLVE}), quantities=(KINK_STRESS, KINK_FORCES))
def engine_kinked(case: Case, subject: Subject) -> Measurement:
    """A uniform pressure stays exact on an interface with a kink.

    **Question.** The scenes of `patch.kinked`: two blocks of one material on a broken line, under the same pressure
    from all sides. Are the stress and the forces on both sides exact?

    **Why it matters.** Corners, chamfers and the facets of any curved mesh are kinks, and many codes average normals
    there.

    **How it is judged.** As the uniform state of `patch.kinked`, with the accuracy of the code in the tolerance. Only a
    code that states `patch.kinked` in its traits promises it.

    **Undecided.** Where the code finds no solution.
    """
    assert isinstance(subject, EngineSubject)
    problem, upper_slave = patch_of(case)
    scene = kinked_patch(problem, upper_slave=upper_slave, penalty=case.penalty)
    solution, _ = solve_by_engine(scene, subject, linear=True)
    if solution.no_solution:
        return Measurement(undecided=solution.no_solution)
    q = np.asarray(scene.transformation.T @ solution.displacements.reshape(-1))
    exact = uniform_forces(scene.interface, problem.pressure)
    errors = np.linalg.norm(solution.forces - exact, axis=1) / np.linalg.norm(exact, axis=1).max()
    tolerance = _kink_floor(problem, case, problem.pressure / case.penalty) + problem.contraction
    tolerance += engine_tolerance(scene, solution, subject.engine_traits.accuracy, problem.pressure)
    values = {KINK_STRESS: _kink_stress_error(problem, scene, q), KINK_FORCES: float(errors.max())}
    return Measurement(check_all(values, tolerance))
