"""The patch test solved: two elastic bodies under a uniform pressure find the exact stress, forces and gap.

The patch test asks about the residual alone, so Newton's method differentiates the residual by itself. The
formulation's own tangent serves only where a difference confirms it. A whole code is judged by its displacements:
a is the accuracy that it states, M the stiffer body's oedometer modulus, U the largest displacement, ℓ the shortest
segment, p the exact pressure, and κ the condition of the bodies' condensed stiffness.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray, dense
from contactverif.contract.case import Case, Cases
from contactverif.contract.engine import EngineAnswer
from contactverif.contract.interface import PLANE
from contactverif.contract.property import Finding, Measurement, Property, Quantity, check_all
from contactverif.contract.subject import CheckedFormulation, EngineSubject, Subject
from contactverif.mechanics.accuracy import Solution, shape_integrals, solve_by_engine
from contactverif.mechanics.linear import RANK_ROUNDOFF
from contactverif.mechanics.newton import NEAR_CONVERGENCE, Trace, solve
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.oracle.flat_answers import is_of_class
from contactverif.problems import own_law
from contactverif.problems.block_scenes import normal_scenes, single_scenes
from contactverif.problems.blocks import exact_unknowns, pressure_of
from contactverif.problems.uniform_stress import PRESSURE_TOLERANCE, STRESS_TOLERANCE, stress_error, uniform_tolerances
from contactverif.strategies import space_solids
from contactverif.strategies.solids import UNIFORM, block_cases, dead_zone_cases, variant_cases
from contactverif_properties import exact_forces
from contactverif_properties.applicability import promise_normal, promise_single
from contactverif_properties.newton_method import end_details
from contactverif_properties.states import FrozenState

OWN_PRESSURE = "mean pressure over that of hard contact"
CODE_ITERATIONS = "iterations until the code said that it converged"
ALMOST = UNIT_ROUNDOFF**0.5  # A node is covered up to this share of its length.
POSITION_ROUNDINGS = 64.0  # A node balances about 8 springs to 8 roundoffs.
_TERMS = "a (1 + M U/(ℓ p)) + 1e-12 κ + 64 u X ε̂/p"
_REASON = "It is that of the forces that the bodies need, and a stiff spring turns rounded positions X into a force"
REPORTED_FORCES = Quantity("error of a contact force that the code reports", _TERMS, f"{_REASON}.")
REPORTED_PRESSURES = Quantity(
    "error of a contact pressure that the code reports", f"({_TERMS}) L/m", f"{_REASON}, on the length m of a node."
)


def _measure_engine(case: Case, subject: EngineSubject, penalty: float) -> Measurement:
    """Return the errors of stress, slave forces, master forces and gap of a scene whose pressure is uniform.

    Forces are those that the bodies need; what a rigid body needs is not known. A code with a stiffness of its own is
    judged by its own mean pressure, and neither its gap nor what it reports is asked. Forces and pressures that other
    codes report are judged.
    """
    traits, scene = subject.engine_traits, replace(scene_of(case), penalty=penalty)
    solution, answer = solve_by_engine(scene, subject, linear=True)
    details = {} if answer is None else {CODE_ITERATIONS: float(answer.iterations)}
    if answer is None or solution.no_solution:
        return Measurement(undecided=solution.no_solution, details=details)
    pressure = float(pressure_of(case, penalty if traits.enforcement == "penalty" else np.inf))
    if traits.enforcement == "own":  # The mean pressure on the slave where the master covers it.
        normal, n_slave = exact_forces.normal_of(case), case.interface.n_slave_nodes
        sides = (solution.forces[:n_slave], exact_forces.consistent_forces(case, 1.0)[:n_slave])
        force, length = (float((forces @ normal).sum()) for forces in sides)
        mean = force / length
        details[OWN_PRESSURE] = mean / pressure
        pressure = mean if mean > 0 else pressure
    q = np.asarray(scene.transformation.T @ solution.displacements.reshape(-1))
    errors = np.linalg.norm(solution.forces - exact_forces.consistent_forces(case, pressure), axis=1)
    errors[_rigid_nodes(scene)] = 0.0
    slave, master = _by_side(case, errors, pressure)
    values = {STRESS: stress_error(scene, scene.stresses(q), pressure), SLAVE_FORCES: slave, MASTER_FORCES: master}
    tolerance = engine_tolerance(scene, solution, traits.accuracy, pressure)
    tolerances = dict.fromkeys(values, tolerance)
    if traits.enforcement != "own":
        rounding = POSITION_ROUNDINGS * UNIT_ROUNDOFF * case.largest_coordinate * penalty / pressure
        for quantity, (error, share) in _judge_reports(answer, case, scene, pressure).items():
            values[quantity], tolerances[quantity] = error, (tolerance + rounding) / share
        penetration = pressure / penalty if traits.enforcement == "penalty" else 0.0
        state = replace(case, z=solution.state.z, penalty=penalty)
        values[GAP] = exact_forces.gap_error(state, penetration, pressure / penalty)
        tolerances[GAP] = tolerance * (1 + penalty * float(case.parameters["compliance"].sum()))
    return Measurement(check_all(values, tolerances), details=details)


def _judge_reports(
    answer: EngineAnswer, case: Case, scene: Scene, pressure: float
) -> dict[Quantity, tuple[float, float]]:
    """Return the largest error of a nodal force that a code reports, over p L, and of a pressure, over p.

    Beside each stands the share of the slave's length L that carries it: all, or the shortest length of a node. The
    pressures are those of nodes of the slave that the master covers with both their segments.
    """
    errors: dict[Quantity, tuple[float, float]] = {}
    exact, n_slave = exact_forces.consistent_forces(case, pressure), case.interface.n_slave_nodes
    if answer.contact_forces is not None:
        differences = np.linalg.norm(answer.contact_forces[scene.nodes_in_reach] - exact, axis=1)
        errors[REPORTED_FORCES] = float(differences.max() / (pressure * case.slave_measure)), 1.0
    if answer.pressures is not None:
        places = np.argsort(np.argsort(scene.nodes_in_reach[:n_slave]))  # Reports are in the order of the numbers.
        lengths = shape_integrals(case.interface.slave, case.interface.nodes)[:n_slave]
        covered = np.linalg.norm(exact[:n_slave], axis=1) >= (1 - ALMOST) * pressure * lengths
        shares = lengths[covered] / case.slave_measure
        differences = np.abs(answer.pressures[places][covered] / pressure - 1)
        errors[REPORTED_PRESSURES] = float(differences.max(initial=0.0)), float(shares.min(initial=1.0))
    return errors


def _rigid_nodes(scene: Scene) -> BoolArray:
    """Return which nodes (n_nodes,) of the interface are those of rigid bodies; what these need is not known."""
    bodies = [scene.bodies[index] for index in scene.bodies_in_reach]
    return np.concatenate([np.full(len(body.contact_nodes), body.rigid) for body in bodies])


def _by_side(case: Case, errors: FloatArray, pressure: float) -> tuple[float, float]:
    """Return the largest error of a nodal force (n_nodes,) on the slave and on the master, over p L."""
    slave, master = np.split(errors / (pressure * case.slave_measure), [case.interface.n_slave_nodes])
    return float(slave.max()), float(master.max())


def engine_tolerance(scene: Scene, solution: Solution, accuracy: float, pressure: float) -> float:
    """Return a (1 + M U/(ℓ p)) + 1e-12 κ: displacements that are wrong by a U strain the shortest segment.

    U is at most the size of the interface, or a body that flies away would excuse itself.
    """
    modulus = max(body.oedometric_modulus for body in scene.bodies if not body.rigid)
    nodes, stiffness = scene.interface.nodes, dense(scene.stiffness)
    shortest = min(float(side.heights(nodes).min()) for side in (scene.interface.slave, scene.interface.master))
    displacement = min(float(np.abs(solution.displacements).max()), float(np.ptp(nodes, axis=0).max()))
    sizes: FloatArray = np.abs(np.linalg.eigvalsh(stiffness)) if len(stiffness) else np.ones(1)
    resisted = sizes[sizes > len(sizes) * UNIT_ROUNDOFF * sizes.max()]  # Motions of a free body are not resisted.
    condition = float(resisted.max() / resisted.min())
    return float(accuracy * (1 + modulus * displacement / (shortest * pressure)) + 1e-12 * condition)


ITERATIONS = 25  # A method that transmits a uniform pressure needs one iteration. The others need a few more.
SAME_SOLUTION = 2.0**-10  # A solution this close to the exact one, over the penetration, counts as the same one.

REASON = (
    "κ, the greater of ε̂h and the stiffer body's E over the softer body's E, measures the condition of the matrix. "
    "r is the shortest segment over the longest. "
    "A gap p/ε̂ is a difference of positions X, and a node balances about 8 springs to 8 roundoffs. "
    "Displacements U are rounded, which makes stresses M U/ℓ on the shortest segment."
)
STRESS = Quantity("stress error", STRESS_TOLERANCE, REASON)
SLAVE_FORCES = Quantity("slave force error", STRESS_TOLERANCE, REASON)
MASTER_FORCES = Quantity("master force error", STRESS_TOLERANCE, REASON)
GAP = Quantity(
    "gap error",
    f"({STRESS_TOLERANCE}) (1 + ε̂ ΣH/M)",
    f"{REASON} Where no spring measures a height, the bodies hold it, and they give way by ΣH/M under a unit pressure.",
)
PRESSURE = Quantity(
    "pressure error",
    PRESSURE_TOLERANCE,
    f"{REASON} The shortest segment carries what the force of the longest one lacks.",
)
MULTIPLIERS = Quantity(
    "multiplier error",
    f"({STRESS_TOLERANCE})/s",
    f"{REASON} s is the smallest singular value of the loads of unit multipliers on the bodies over the largest one.",
)
QUANTITIES = (STRESS, SLAVE_FORCES, MASTER_FORCES, GAP, PRESSURE, REPORTED_FORCES, REPORTED_PRESSURES)


def measure_once(case: Case, subject: Subject) -> Measurement:
    """Solve the scene of the case at its own penalty, or with multipliers, and return the errors."""
    if subject.traits.rules.enforcement == "multiplier" and not isinstance(subject, EngineSubject):
        return _measure_with_multipliers(case, subject)
    return measure_at_penalty(case, subject, case.penalty)


def measure_at_penalty(case: Case, subject: Subject, penalty: float) -> Measurement:
    """Solve the scene of the case with a penalty method at a distributed penalty ε̂, and return its errors.

    Stress error: the largest entry of σ − σ_exact at the Gauss points over p. Slave and master force errors: the
    largest error of a nodal force over p L. Gap error: the largest error of a node's height, or of a
    reported gap, over p/ε̂. Pressure error: the largest error of a reported pressure over p; it is missing where the
    formulation reports none, or is nodal and so knows forces only. A law of its own gets the penalty with which it
    gives the exact pressure at the exact gap, and the tolerances are those of its stiffness there.
    """
    if isinstance(subject, EngineSubject):
        return _measure_engine(case, subject, penalty)
    scene, pressure = scene_of(case), pressure_of(case, penalty)
    formulation, stiffness = subject.for_interface(case.interface, penalty), penalty
    if subject.traits.rules.own_law:
        own_penalty = own_law.penalty_for(case, subject, penalty, pressure / penalty)
        formulation = subject.with_penalty(own_penalty)
        stiffness = max(penalty, own_law.stiffness_at(case, subject, own_penalty, pressure / penalty))
    exact = exact_unknowns(scene, pressure, penalty)
    trace, q = _solve_patch(scene, formulation, exact, pressure / penalty)
    state = replace(case, z=scene.positions(q), penalty=penalty)
    # A state that is not Newton's last iterate has a pairing of its own.
    is_last = np.array_equal(state.z, trace.z)
    contact = FrozenState(formulation, state, trace.pairing if is_last else formulation.pair(case.interface, state.z))
    values, worst = _errors(contact, scene, q, pressure)
    values[GAP] = exact_forces.gap_error(state, pressure / penalty, pressure / penalty)
    if contact.has_points:
        gap, reported = exact_forces.point_errors(contact, penalty, pressure)
        values[GAP] = max(values[GAP], gap)
        if subject.traits.rules.penalty != "nodal":
            values[PRESSURE] = reported
    roundoff = uniform_tolerances(replace(state, penalty=stiffness), scene, pressure)
    tolerances = _tolerances(case, penalty, roundoff.stress) | {PRESSURE: roundoff.pressure}
    return Measurement(check_all(values, tolerances), details=end_details(trace)).after("", finding=worst)


def _errors(
    state: FrozenState, scene: Scene, q: FloatArray, pressure: float
) -> tuple[dict[Quantity, float], Finding | None]:
    """Return the errors of stresses and forces in the state at the unknowns q (n_free,), and the worst force.

    Forces are judged twice: those that the bodies need to be in balance, and those that the formulation gives. They
    differ where the formulation found no balance, and at rollers, which take what the bodies do not need.
    """
    by_contact, exact = -state.forces, exact_forces.consistent_forces(state.case, pressure)
    by_bodies = np.where(_rigid_nodes(scene)[:, None], by_contact, scene.nodal_forces(q))
    sizes = [np.linalg.norm(forces - exact, axis=1) for forces in (by_bodies, by_contact)]
    slave, master = _by_side(state.case, np.maximum(*sizes), pressure)
    worst = by_bodies if sizes[0].max() >= sizes[1].max() else by_contact
    finding = exact_forces.worst_force(state.case.interface, worst, exact) if (worst != exact).any() else None
    values = {STRESS: stress_error(scene, scene.stresses(q), pressure), SLAVE_FORCES: slave, MASTER_FORCES: master}
    return values, finding


def _tolerances(case: Case, penalty: float, tolerance: float) -> dict[Quantity, float]:
    """Return one tolerance for stresses and forces; that of gaps is 1 + ε̂ ΣH/M times as large."""
    factor = 1 + penalty * float(case.parameters["compliance"].sum())
    return dict.fromkeys((STRESS, SLAVE_FORCES, MASTER_FORCES), tolerance) | {GAP: tolerance * factor}


def _measure_with_multipliers(case: Case, subject: Subject) -> Measurement:
    """Solve the scene of the case as a saddle point and return its errors against the solution without penetration.

    Where the exact solution is a solution of the formulation, to roundoff, it counts in place of one that Newton's
    method found less exactly: a saddle point that is nearly singular spoils what Newton's method finds, and not the
    fact that the exact solution is one. The penalty ε̂ serves as the scale c, and as the measure of gaps. Multipliers
    are compared with p where they are pressures; where they are not unique, those nearest to the exact ones count.
    """
    scene, pressure, penalty = scene_of(case), pressure_of(case, np.inf), case.penalty
    formulation = subject.for_case(case)
    exact = exact_solution(scene, case, subject, formulation)
    multipliers = exact[scene.n_free :]

    def measure_errors(u: FloatArray) -> Measurement:

        q = u[: scene.n_free]
        state = replace(case, z=scene.positions(q)).with_multipliers(u[scene.n_free :])
        nearest, sharpness = _nearest_multipliers(state, scene, formulation, multipliers)
        state = state.with_multipliers(nearest)
        values, worst = _errors(FrozenState.at(formulation, state), scene, q, pressure)
        values[GAP] = exact_forces.gap_error(state, 0.0, pressure / penalty)
        tolerance = uniform_tolerances(state, scene, pressure).stress
        tolerances = _tolerances(case, penalty, tolerance)
        if subject.traits.rules.penalty == "distributed":
            loaded = multipliers != 0  # The multiplier of a node that faces nothing is 0.
            values[MULTIPLIERS] = float(np.abs(nearest[loaded] / pressure - 1).max(initial=0.0))
            tolerances[MULTIPLIERS] = tolerance / sharpness
        return Measurement(check_all(values, tolerances)).after("", finding=worst)

    trace, u = _solve_patch(scene, formulation, exact, pressure / penalty)
    measurement = measure_errors(u)
    fails = any(number.value > number.tolerance for number in measurement.numbers)
    if fails and trace.roundings[0] <= NEAR_CONVERGENCE:
        measurement = measure_errors(exact)
    return replace(measurement, details=end_details(trace))


def exact_solution(scene: Scene, case: Case, subject: Subject, formulation: CheckedFormulation) -> FloatArray:
    """Return the unknowns of the exact solution of a uniform scene, and the multipliers behind them if there are any.

    Where multipliers enforce contact, nothing penetrates, whatever the penalty of the case.
    """
    penalty = np.inf if subject.traits.rules.enforcement == "multiplier" else case.penalty
    pressure = pressure_of(case, penalty)
    exact = exact_unknowns(scene, pressure, penalty)
    if not formulation.n_multipliers(case.interface):
        return exact
    state = replace(case, z=scene.positions(exact))
    return np.append(exact, exact_forces.exact_multipliers(state, subject, formulation, pressure))


def _nearest_multipliers(
    case: Case, scene: Scene, formulation: CheckedFormulation, exact: FloatArray
) -> tuple[FloatArray, float]:
    """Return, of all multipliers that load the bodies as those of a solved case do, the nearest to the exact ones.

    A combination of multipliers that loads no body may be added to a solution. Such combinations exist where
    multipliers are not unique, and on a rigid master, where only the sum of the nodal forces counts. The second number
    is the smallest singular value of the loads of unit multipliers on the bodies over the largest one: forces that are
    wrong by roundoff leave the multipliers uncertain by roundoff over that number.
    """
    solution = case.multipliers
    loads = scene.transformation.T @ exact_forces.unit_forces(FrozenState.at(formulation, case))
    _, sizes, directions = linalg.svd(loads)
    rank = int((sizes > RANK_ROUNDOFF * max(loads.shape) * UNIT_ROUNDOFF * sizes.max(initial=0.0)).sum())
    free = directions[rank:]
    nearest: FloatArray = solution + free.T @ (free @ (exact - solution))
    return nearest, float(sizes[rank - 1] / sizes[0]) if rank else 1.0


def _solve_patch(
    scene: Scene, formulation: CheckedFormulation, exact: FloatArray, penetration: float
) -> tuple[Trace, FloatArray]:
    """Solve a scene from its exact solution; return Newton's trace and the unknowns (n_free + n_multipliers,) to judge.

    A formulation that passes is in balance there and does not move. Large motions have other solutions too, which
    nobody asks for. A formulation that is not in balance there is judged where it comes nearest to balance afterwards.
    """
    trace = solve(scene, formulation, start=exact, iterations=ITERATIONS, use_tangent=False, solution_only=True)
    return trace, trace.u[-1] if is_solved(trace, exact, penetration) else nearest_to_balance(trace)


def is_solved(trace: Trace, exact: FloatArray, penetration: float) -> bool:
    """Return whether Newton's method converged to the exact solution (n_free + n_multipliers,)."""
    distance = np.abs(trace.solution - exact[: trace.scene.n_free]).max(initial=0.0)
    return trace.converged and bool(distance <= SAME_SOLUTION * penetration)


def nearest_to_balance(trace: Trace) -> FloatArray:
    """Return the start (n_free + n_multipliers,) if it is nearly in balance, else the later iterate nearest to it."""
    balanced = trace.roundings[0] <= NEAR_CONVERGENCE or len(trace.u) == 1
    return np.asarray(trace.u[0 if balanced else 1 + np.argmin(trace.roundings[1:])])


def forces_to_draw(case: Case) -> FloatArray:
    """Return the exact forces (n_nodes, 2) at the penalty of the case, for pictures."""
    return exact_forces.consistent_forces(case, pressure_of(case, case.penalty))


HIGH, AT_HIGH = 1e3, ", high penalty"  # The high penalty over the moderate one of a case, and its words.
SLOPE = "slope over penalties (−1 if it locks)"


def measure_two_penalties(case: Case, subject: Subject) -> Measurement:
    """Solve two blocks at the penalty of the case and at a HIGH one; one with multipliers has none, and is solved once.

    The details are how each solution ended, and the slope of the logarithm of the stress error over that of the
    penalty.
    """
    if subject.traits.rules.enforcement == "multiplier":
        return measure_once(case, subject)
    moderate = measure_at_penalty(case, subject, case.penalty)
    high = measure_at_penalty(case, subject, HIGH * case.penalty)
    if not (moderate.numbers and high.numbers):  # A whole code may find no solution.
        return moderate if moderate.undecided else high
    errors = moderate.values[STRESS.name], high.values[STRESS.name]
    slope = float(np.log(errors[1] / errors[0]) / np.log(HIGH)) if min(errors) > 0 else 0.0
    return Measurement(
        [*moderate.numbers, *(replace(number, quantity=_at_high(number.quantity)) for number in high.numbers)],
        undecided=moderate.undecided or high.undecided,
        details={**moderate.details, **{name + AT_HIGH: value for name, value in high.details.items()}, SLOPE: slope},
        finding=moderate.finding or high.finding,
    ).after(f"solved at ε̂ = {case.penalty:.4g} and {HIGH * case.penalty:.4g}")


def _at_high(quantity: Quantity) -> Quantity:
    return replace(quantity, name=f"{quantity.name}{AT_HIGH}")


def _scenes_of_class(make: Callable[[], tuple[Case, ...]], *, midpoints: bool) -> Cases:
    """Return a list of scenes; in its place random states of a scene that is given, if it is of the class."""

    def on_scene(scene: Case) -> Any:
        states = block_cases(scene)
        fits = states is not None and is_of_class(scene.interface, scene.parameters["along"], midpoints=midpoints)
        return states if fits else None

    return Cases.from_list(make, on_place=on_scene, needs=UNIFORM)


_define = partial(Property.define, bodies=True, engines=True, exact=forces_to_draw)
_define_at_two_penalties = partial(_define, quantities=(*QUANTITIES, *map(_at_high, QUANTITIES), MULTIPLIERS))


@_define_at_two_penalties(
    id="patch.flat.solve",
    rank=675,
    cases=Cases.random(block_cases),
    cases_in_space=Cases.random(space_solids.space_block_cases),
    promise=lambda traits: traits.promises.patch.flat,
)
def patch_flat_solve(case: Case, subject: Subject) -> Measurement:
    """Two elastic blocks under a uniform pressure find the exact stress, forces and gap at two penalties.

    **Question.** Two random elastic blocks on rollers are pressed together. Are the stress, the forces on both sides,
    the gap and the reported pressure the exact ones?

    **Why it matters.** This is the patch test as an engineer runs it. The two penalties say different things. At a
    moderate penalty a wrong distribution of forces bends the bodies. As the penalty grows, a method that only
    interpolates the gap well locks into the right pressure and seems to pass. The slope of the stress error over the
    penalty, a detail of every measurement, tells them apart: near 0 the method fails at any penalty, near −1 it passes
    because it locks.

    **How it is judged.** The blocks cannot strain sideways, so the exact pressure is p = Δ / (H1/M1 + H2/M2 + 1/ε̂).
    Stress is compared at the Gauss points over p, nodal forces over p L, heights and reported gaps over p/ε̂, and
    reported pressures over p. The tolerance of a stress is 1e-11 + 1e-13 κ + 5e-15/r + 64 u (X ε̂ + M U/ℓ)/p: the
    condition of the matrix, the ratio of segments, and the rounding of positions and displacements. The other
    tolerances follow from it (`docs/concepts/tolerances.md`). Newton's method differentiates the residual by itself
    here, so a wrong tangent does no harm. A formulation with multipliers has no penalty and is asked once; its
    multipliers are compared with p.

    **Undecided.** Never: Newton's method starts at the exact solution, where a formulation that passes is in balance.
    """
    return measure_two_penalties(case, subject)


@_define_at_two_penalties(
    id="patch.flat.normal.solve",
    rank=605,
    cases=_scenes_of_class(normal_scenes, midpoints=False),
    cases_in_space=Cases.random(space_solids.space_matched_cases),
    promise=promise_normal,
)
def patch_flat_normal_solve(case: Case, subject: Subject) -> Measurement:
    """Two blocks find the exact stress, forces and gap where each inner master node lies on a slave node.

    **Question.** Two elastic blocks, or a block and a rigid floor, are pressed together. Each inner master node lies on
    a slave node. Are stress, forces on both sides, gap and reported pressure exact at a moderate and at a high penalty?

    **Why it matters.** It is the patch test that the reference paper begins with. A formulation that fails the general
    one must pass this one if its theory says so, and then its failure elsewhere is that of the theory.

    **How it is judged.** Seven scenes: the paper's A1 and A2 (uniform and graded, on a rigid floor), and four of ours,
    with moduli that differ by 1/8 to 1000, inclined, and 1/500 as large. Errors and tolerances are those of
    `patch.flat.solve`. The promise is that of `patch.flat.normal`.

    **Undecided.** Never, as in `patch.flat.solve`. No slave node faces a free end of the master but in upright scenes
    of the paper, whose coordinates along the interface are exact.

    **Source.** Zavarise & De Lorenzis (2009), Figs. 8 to 12, Section 4.
    """
    return measure_two_penalties(case, subject)


@_define_at_two_penalties(
    id="patch.flat.single.solve",
    rank=610,
    cases=_scenes_of_class(single_scenes, midpoints=True),
    promise=promise_single,
)
def patch_flat_single_solve(case: Case, subject: Subject) -> Measurement:
    """Two blocks find them too where inner master nodes lie in the middle of slave segments.

    **Question.** Two elastic blocks are pressed together. Each inner master node lies on a slave node or in the middle
    of a slave segment. Are stress, forces on both sides, gap and reported pressure exact at a moderate and at a high
    penalty?

    **Why it matters.** It is the patch test that VTS-ME was made for. It fails on other meshes, and only here a mistake
    of its code can be told from what it cannot do.

    **How it is judged.** Six scenes: the paper's B and Example 1 (a punch on a wider block), and four of ours, with
    moduli that differ by 1/8 to 1000, inclined, and 1/500 as large. Errors and tolerances are those of
    `patch.flat.solve`. The promise is that of `patch.flat.single`.

    **Undecided.** Never, as in `patch.flat.normal.solve`.

    **Source.** Zavarise & De Lorenzis (2009), Figs. 16 to 19 and 31, Sections 5.1.2 and 7.1.
    """
    return measure_two_penalties(case, subject)


@_define(
    id="patch.variants",
    rank=680,
    quantities=(*QUANTITIES, MULTIPLIERS),
    cases=Cases.random(variant_cases),
    cases_in_space=Cases.random(space_solids.space_variant_cases),
    promise=lambda traits: traits.promises.patch.flat,
)
def patch_variants(case: Case, subject: Subject) -> Measurement:
    """A uniform pressure stays exact with a rigid master, unequal materials, an inclined interface or a punch.

    **Question.** Does a uniform pressure stay exact on a rigid master, with materials whose stiffness differs by 1e-6
    to 1e6, inclined by 1° to 179°, slid to 200 positions, and under a punch that is narrower than its base?

    **Why it matters.** Codes that pass the textbook patch test often fail when the interface is inclined, when one body
    is rigid, or when nodes nearly coincide. These are the everyday cases of an engineer.

    **How it is judged.** As in `patch.flat.solve`, at ε̂ = 10 E/h alone, with the same tolerances.

    **Undecided.** Never, as in `patch.flat.solve`.
    """
    return measure_once(case, subject)


def _widen_tolerance(quantity: Quantity) -> Quantity:
    reason = "Loads on the whole slave, of length L, are rounded, and the part A that faces the master bears that."
    return replace(quantity, tolerance=f"({quantity.tolerance}) L/A", reason=f"{quantity.reason} {reason}")


@_define(
    id="patch.dead-zone",
    rank=620,
    quantities=tuple(map(_widen_tolerance, (*QUANTITIES, MULTIPLIERS))),
    cases=Cases.random(dead_zone_cases),
    cases_in_space=Cases.random(space_solids.space_dead_zone_cases),
    promise=lambda traits: traits.promises.patch.overhang,
)
def patch_dead_zone(case: Case, subject: Subject) -> Measurement:
    """A uniform pressure stays exact where the slave overhangs the master inside a slave segment.

    **Question.** The master ends inside a slave segment. Do the contact forces end where the master ends?

    **Why it matters.** Every punch, gasket and lap joint has such an end. A method that decides about whole slave nodes
    or whole areas of competence has too much slave in contact there, or too little.

    **How it is judged.** The pressure acts on what the master does not cover too, so that the exact stress is as
    uniform as without an overhang. The errors are those of `patch.flat.solve` at ε̂ = 1, 10 or 100 E/h, and gaps count
    where there is a master opposite. The tolerances are those of `patch.flat.solve` times L/A: loads on the whole
    slave, of length L, are rounded, and the part A that has the master opposite bears that.

    **Undecided.** Never, as in `patch.flat.solve`.
    """
    measurement = measure_once(case, subject)
    if case.interface.dim == PLANE:
        slave, master = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
        ratio = float(np.ptp(slave) / (min(slave.max(), master.max()) - max(slave.min(), master.min())))
    else:
        ratio = case.slave_measure / float(np.prod(np.ptp(case.parameters["domain"], axis=0)))
    numbers = [replace(number, tolerance=ratio * number.tolerance) for number in measurement.numbers]
    return replace(measurement, numbers=numbers)
