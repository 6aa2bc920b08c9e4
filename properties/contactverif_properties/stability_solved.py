"""Springs as they grow stiff, solved: the digits that forces keep, and whether the interface locks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.case import Case, Cases
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import SOLVE, EngineSubject, Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import shape_integrals, solve_by_engine
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.mechanics.system import System
from contactverif.problems import refined_blocks
from contactverif.problems.blocks import exact_unknowns, pressure_of
from contactverif.problems.stability_states import stability_scenes
from contactverif_properties import exact_forces, roundoff
from contactverif_properties.applicability import refuse_unknown_pressure
from contactverif_properties.stability import ExactMotion
from contactverif_properties.states import FrozenState

ROUNDINGS = roundoff.forces_quantity("error of a solved force in roundings")
MOST_STEPS = 30  # Newton's steps at each penalty. Linear springs take about four.
STEPS = 5  # Steps of the turned system, which start at its solution but for roundoff.
# The penalty grows by this factor at most from one solution to the next. A larger one gives forces that buckle springs.
GROWTH = 100.0
# Newton's method has settled once no pressure is out of balance by more than this share of p, and so many u ε̂ X.
SETTLED_SHARE, SETTLED_ROUNDINGS = 1e-3, 1e3
MOST_DRIFT, MOST_ROUGHNESS = 0.01, 2.0
DRIFT = Quantity(
    "drift of the compliance",
    "0.01",
    "Without locking it was at most 0.001 at any penalty, with locking at least 0.33 at the highest.",
)
ROUGHNESS = Quantity(
    "roughness of the pressure",
    "2",
    "Without locking it was at most 1.2 at any penalty, with springs between the nodes at least 90 at the highest.",
)
_UNSOLVED = "Newton's method finds no solution on the pairing of the uniform state"


def _refuse_without_solution(traits: Traits) -> str:
    """Return why a formulation is not asked, or an empty string if it has springs that Newton's method can solve."""
    if traits.rules.enforcement != "penalty" or traits.rules.penalty is None:
        return f"the enforcement is by a {traits.rules.enforcement}, not by springs of a stated stiffness"
    exact = traits.promises.tangent == "exact"
    return "" if exact else "no exact tangent, with which Newton's method settles at any penalty"


@dataclass(frozen=True, slots=True, eq=False)
class _TurnedSystem:
    """The equations of a scene whose interface is turned, in the unknowns of the scene at the origin."""

    system: System
    motion: ExactMotion
    interface: Interface  # The interface after the motion.
    pairing: Pairing | None

    def forces(self, u: FloatArray) -> FloatArray:
        """Return the residual of the formulation (n_unknowns,) at the unknowns u (n_free,), turned."""
        nodes = self.system.scene.interface.nodes
        displacements = self.system.state(u).reshape(-1, 2) - nodes
        z = (self.interface.nodes + self.motion.turn(displacements)).reshape(-1)
        return self.system.formulation.residual(self.interface, self.pairing, z)

    def residual(self, u: FloatArray) -> FloatArray:
        """Return the residual (n_free,) of bodies and contact at the unknowns u (n_free,)."""
        forces = self.motion.turn_back(self.forces(u).reshape(-1, 2)).reshape(-1)
        residual: FloatArray = self.system.transformation.T @ forces + self.system.scene.bulk_forces(u)
        return residual


@Property.define(
    id="stability.stiffness",
    rank=580,
    family="stability",
    quantities=(ROUNDINGS,),
    cases=Cases.from_list(stability_scenes),
    promise=lambda traits: traits.promises.translation_stable,
    applicable=_refuse_without_solution,
    needs=frozenset({"tangent"}),
    bodies=True,
)
def stability_stiffness(case: Case, subject: Subject) -> Measurement:
    """The contact forces of a solution keep their digits as far as the penalty lets them, up to 1e12 E/h.

    **Question.** Two blocks under a uniform pressure are solved with ε̂h/E from 1e-2 to 1e12. Is the error of each
    contact force at most sixteen times what rounding the positions would change?

    **Why it matters.** A stiff spring turns the rounding of a position into a force: the relative error of the pressure
    is about u ε̂ X/p. Users who raise the penalty until nothing penetrates lose these digits. They should lose no more.

    **How it is judged.** The blocks are solved as they lie at the origin, and again with the interface turned by an
    exact rotation. Both use the same stiffness of the bodies, so that only contact sees the rotation, and the pairing
    of the exact solution. Newton's method, with the tangent that the formulation calls exact, goes on down to roundoff.
    The forces are compared, and the error is counted in roundings, ω (see the shared measure of conditioning). The
    derivative K is here that of bodies and contact together, the matrix of the system. The tolerance is 16. The scenes
    are a finite list.

    **Undecided.** A case is undecided if the system has no inverse in floats, or if Newton's method does not settle on
    the frozen pairing.
    """
    scene, motion, penalty = scene_of(case), ExactMotion.from_case(case), case.penalty
    u = exact_unknowns(scene, pressure_of(case, penalty), penalty)
    pairing = subject.for_case(case).pair(scene.interface, System(scene, subject.for_case(case)).state(u))
    try:
        modulus = max(body.young for body in scene.bodies)
        n_steps = max(0, math.ceil(math.log(penalty / modulus, GROWTH)))
        for n in range(n_steps, -1, -1):
            system = System(scene, subject.for_case(replace(case, penalty=penalty / GROWTH**n)))
            u, matrix = _solve(system, pairing, u)
        rounding = SETTLED_ROUNDINGS * UNIT_ROUNDOFF * penalty * case.largest_coordinate
        mean_segment = float(case.interface.slave.lengths(case.interface.nodes).mean())
        settled = (SETTLED_SHARE * pressure_of(case, penalty) + rounding) * mean_segment
        if np.abs(system.residual(u, pairing)).max() > settled:
            return Measurement(undecided="Newton's method does not settle on the frozen pairing")
        turned = _TurnedSystem(system, motion, scene.interface.at(motion.move(scene.interface.nodes)), pairing)
        u_turned = _nearest_to_balance(turned, matrix, u)
    except _SingularMatrix:
        return Measurement(undecided="the matrix has no inverse in floats")
    state = FrozenState(system.formulation, replace(case, z=system.state(u)), pairing)
    error = turned.forces(u_turned) - motion.turn(state.forces).reshape(-1)
    # To the conditioning of the contact forces the bodies add |S| |z − z̄| at their contact nodes.
    conditioning, positions = roundoff.measure_conditioning(state, state.residual), state.case.positions
    transformation = abs(dense(scene.transformation))
    distances = np.abs(positions - positions.mean(axis=0)).reshape(-1)
    bulk = transformation @ (abs(dense(scene.stiffness)) @ (transformation.T @ distances))
    reach = np.array(conditioning.reach)
    reach[: scene.interface.n_nodes] += np.hypot(*bulk.reshape(-1, 2).T)
    conditioning = replace(conditioning, reach=reach)
    return roundoff.make_sweep_measurement(ROUNDINGS, conditioning, error, idle=not state.forces.any())


def _solve(system: System, pairing: Pairing | None, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the solution (n,) on a frozen pairing, and the last matrix (n, n), by the formulation's tangent.

    A difference quotient is no use: at 1e11 E/h its truncation is as stiff as the bodies. Newton's method ends once the
    residual was not halved twice in succession: it is down to its roundoff then.
    """
    largest, n_strikes, transformation = np.inf, 0, dense(system.transformation)
    for _ in range(MOST_STEPS):
        contact = dense(system.formulation.tangent(system.scene.interface, pairing, system.state(u)))
        matrix = dense(system.stiffness) + transformation.T @ contact @ transformation
        u = u + _step(system, matrix, system.residual(u, pairing))
        before, largest = largest, float(np.abs(system.residual(u, pairing)).max())
        n_strikes = n_strikes + 1 if largest > before / 2 else 0
        if n_strikes == 2 or largest == 0:
            break
    return u, matrix


def _nearest_to_balance(turned: _TurnedSystem, matrix: FloatArray, u: FloatArray) -> FloatArray:
    """Return the unknowns (n,) with the least force out of balance, of a start u and of some steps from there.

    The start is the solution but for roundoff, and the matrix is the same, in other axes. Where springs push one way
    and pull another, a step from there need not come nearer.
    """
    states, residuals = [u], [turned.residual(u)]
    for _ in range(STEPS):
        states.append(states[-1] + _step(turned.system, matrix, residuals[-1]))
        residuals.append(turned.residual(states[-1]))
    return states[int(np.argmin([np.abs(residual).max() for residual in residuals]))]


class _SingularMatrix(Exception):
    """The end of Newton's method: the matrix has no inverse in floats. It never leaves this file."""


def _step(system: System, matrix: FloatArray, residual: FloatArray) -> FloatArray:
    change = system.step(matrix, -residual).change
    if change is None:
        raise _SingularMatrix
    return change


@Property.define(
    id="stability.locking",
    rank=510,
    family="stability",
    quantities=(DRIFT, ROUGHNESS),
    needs=frozenset({"pair"}),
    cases=Cases.from_list(refined_blocks.wave_cases),
    promise=lambda traits: None if traits.promises.locks is None else not traits.promises.locks,
    applicable=refuse_unknown_pressure,
    bodies=True,
)
def locking(case: Case, subject: Subject) -> Measurement:
    """With stiff springs the interface is no stiffer and its pressure no rougher than with matching meshes.

    **Question.** A block is pressed on another with meshes of 8 and 12 segments, and a pressure that varies as one wave
    is added. As the penalty rises from 10 to 1e8 E/h, does the interface become stiffer than matching meshes do? Does
    its pressure vary more than theirs?

    **Why it matters.** Springs at more points than the surfaces can follow are more conditions than unknowns. With a
    high penalty all gaps go to zero together, and the interface locks: it is too stiff, and its pressures are rough.
    The flat patch test does not see it, since a uniform pressure needs no gap to vary.

    **How it is judged.** No node of one mesh faces a node of the other, but for the ends. Both blocks are under a mean
    pressure of 64 times the wave. The answer to the wave is the difference between the solutions with it and without
    it, both on the pairing of the uniform state, so that nothing opens and the answer is linear.

    The *drift* is the loss of compliance from 10 E/h to the penalty of the case, beside that of matching meshes: 1 −
    (c/c_m)/(c/c_m at 10 E/h). The compliance c is the work of the wave's load, and c_m is the mean of two matching
    meshes, one with the segments of the slave and one with those of the master. Their springs are as stiff as those of
    the formulation are under the mean pressure at 10 E/h. So springs that act twice are held against springs twice as
    stiff. The drift is at most 1 %. With multipliers there is no soft penalty to begin with, and no drift is judged.

    The *roughness* is the largest minus the smallest pressure, over that of matching meshes. Pressures are nodal forces
    over the lengths beside their nodes, on both surfaces, and those that the formulation reports. The roughness is at
    most 2.

    The bounds were measured. NTS, NTS-AR, mortar, dual mortar and Chen–Hisada do not lock: at every penalty their drift
    is at most 0.1 % and their roughness at most 1.2. Springs at two points or more between the nodes (VTS-G, VTS-ME,
    VTS-PPT, segment-to-segment) and two passes lock. At 1e2 E/h their drift is 1 % to 3 % and their roughness 4; at 1e8
    E/h the drift is 33 % to 34 % and the roughness 90 to 400. (With two points a segment this needs a slave that is
    finer than the master.) Two half passes lock too: their drift is 33 %, though their pressures remain smooth.

    **Undecided.** Where Newton's method finds no solution on that pairing.
    """
    return _measure_locking(
        case, subject, lambda columns, penalty: answer_to_wave(columns, penalty, subject), _UNSOLVED
    )


def _measure_locking(
    case: Case, subject: Subject, answer_at: Callable[[tuple[int, int], float], _InterfaceAnswer | None], unsolved: str
) -> Measurement:
    """Return the drift and the roughness of answers to the wave, which have the numbers of segments and ε̂ h/E."""
    n_slave, n_master = case.parameters["columns"].astype(int).tolist()
    columns = (n_slave, n_master)
    answer = answer_at(columns, case.parameter("stiffness"))
    if answer is None:
        return Measurement(undecided=unsolved)

    def matching(distributed: float) -> float:
        """Return the mean compliance of matching meshes with the segments of the slave, and of the master."""
        return sum(refined_blocks.matching_answer(n, distributed).compliance for n in (n_slave, n_master)) / 2

    smooth = refined_blocks.matching_answer(n_slave, case.penalty).pressure_range
    by_forces, by_points = answer.force_range / smooth, answer.point_range / smooth
    values = {ROUGHNESS: float(np.fmax(by_forces, by_points))}
    details = {"roughness of nodal forces": by_forces}
    if np.isfinite(by_points):
        details["roughness of reported pressures"] = by_points
    if subject.traits.rules.enforcement == "penalty":
        soft = answer_at(columns, refined_blocks.SOFT)
        if soft is None:
            return Measurement(undecided=unsolved)
        at_soft = refined_blocks.wave_blocks(*columns, refined_blocks.SOFT, wave=0.0).penalty
        factor = soft.stiffness / at_soft  # Springs may act twice.
        share = answer.compliance / matching(factor * case.penalty)
        values[DRIFT] = 1 - share * matching(factor * at_soft) / soft.compliance
        details["stiffness of the springs over the penalty"] = factor
    return Measurement(check_all(values, {DRIFT: MOST_DRIFT, ROUGHNESS: MOST_ROUGHNESS}), details=details)


MOST_WAVE_STEPS = 12
# Springs that add less than this share s to the compliance of the bodies count as adding so much. They are 1/s times as
# stiff, which is the condition of the matrix, so that roundoff of the solution adds u/s. Both are equal at s = √u.
_LEAST_SHARE = UNIT_ROUNDOFF**0.5


class _InterfaceAnswer(NamedTuple):
    """The answer of a formulation or a code to the wave."""

    compliance: float  # The work of the wave's load on the displacements that it causes.
    stiffness: float  # The distributed stiffness of the springs under the mean pressure.
    # The largest minus the smallest pressure from nodal forces, over the amplitude of the wave. The surface with the
    # larger one counts.
    force_range: float
    # The same of the pressures that the formulation reports; NaN if it reports none, or nodal forces.
    point_range: float = np.nan


def answer_to_wave(columns: tuple[int, int], penalty: float, subject: Subject) -> _InterfaceAnswer | None:
    """Solve two blocks with the wave and without it."""
    uniform, wavy = (refined_blocks.wave_blocks(*columns, penalty, wave=wave) for wave in (0.0, refined_blocks.WAVE))
    formulation = subject.for_case(uniform.case())
    systems = System(uniform, formulation), System(wavy, formulation)
    start = _uniform_state(systems[0], subject)
    pairing = systems[0].pair(start)
    before = _solve_frozen(systems[0], start, pairing)
    after = None if before is None else _solve_frozen(systems[1], before, pairing)
    if before is None or after is None:
        return None
    case = uniform.case()
    states = [
        FrozenState(formulation, replace(case, z=system.state(u), n_multipliers=system.n_multipliers), pairing)
        for system, u in zip(systems, (before, after), strict=True)
    ]
    q = before[: uniform.n_free], after[: uniform.n_free]
    answer = _interface_answer(uniform, wavy, *q, states[1].forces - states[0].forces)
    if subject.traits.rules.penalty == "nodal" or not states[0].has_points:
        return answer
    pressures = [state.points.pressure for state in states]
    if pressures[0].shape != pressures[1].shape:
        return answer  # A formulation without a pairing may have other points.
    change = pressures[1] - pressures[0]
    return answer._replace(point_range=float(np.ptp(change[np.isfinite(change)])) / refined_blocks.WAVE)


def _answer_of_code(columns: tuple[int, int], penalty: float, subject: EngineSubject) -> _InterfaceAnswer | None:
    uniform, wavy = (refined_blocks.wave_blocks(*columns, penalty, wave=wave) for wave in (0.0, refined_blocks.WAVE))
    before, after = (solve_by_engine(scene, subject, linear=True)[0] for scene in (uniform, wavy))
    if before.no_solution or after.no_solution:
        return None
    q = [np.asarray(uniform.transformation.T @ item.displacements.reshape(-1)) for item in (before, after)]
    return _interface_answer(uniform, wavy, q[0], q[1], after.forces - before.forces)


def _interface_answer(
    uniform: Scene, wavy: Scene, before: FloatArray, after: FloatArray, forces: FloatArray
) -> _InterfaceAnswer:
    """Return the answer of two solutions (n_free,), and the forces (n_nodes, 2) that the wave adds at the interface."""
    total = -float((uniform.bodies[0].load * uniform.displacements(before)[0]).sum())
    bodies = float(uniform.facts["compliance"].sum())
    springs = abs(total) / (refined_blocks.MEAN_PRESSURE**2 * refined_blocks.LENGTH) - bodies
    interface, n = uniform.interface, uniform.interface.n_slave_nodes
    ranges = [
        float(np.ptp(forces[nodes, 1] / shape_integrals(side, interface.nodes)[nodes]))
        for side, nodes in ((interface.slave, slice(0, n)), (interface.master, slice(n, None)))
    ]
    return _InterfaceAnswer(
        compliance=refined_blocks.wave_work(uniform, wavy, before, after),
        stiffness=1 / max(springs, _LEAST_SHARE * bodies),
        force_range=max(ranges) / refined_blocks.WAVE,
    )


def _uniform_state(system: System, subject: Subject) -> FloatArray:
    """Return the unknowns, and the multipliers behind them, of the exact uniform pressure."""
    scene = system.scene
    if not system.n_multipliers:
        return exact_unknowns(scene, refined_blocks.MEAN_PRESSURE, scene.penalty)
    exact = exact_unknowns(scene, refined_blocks.MEAN_PRESSURE, np.inf)
    state = replace(scene.case(), z=scene.positions(exact))
    return np.append(
        exact, exact_forces.exact_multipliers(state, subject, system.formulation, refined_blocks.MEAN_PRESSURE)
    )


def _solve_frozen(system: System, start: FloatArray, pairing: Pairing | None) -> FloatArray | None:
    """Solve a scene on one pairing, with the formulation's tangent or, where that does not converge, by differences.

    Start and solution are (n_free + n_multipliers,). The solution is None unless the residual gets down to its own
    roundoff. A formulation without a pairing decides anew at each iterate.
    """
    system.any_matrix = True
    for use_tangent in (True, False):
        system.use_tangent, u = use_tangent, start
        for _ in range(MOST_WAVE_STEPS):
            residual = system.residual(u, pairing)
            matrix, floor = system.matrix(u, pairing)
            if (np.abs(residual) <= floor).all():
                return u
            change = system.step(matrix, -residual, floor).change
            if change is None or not np.isfinite(change).all():
                break
            u = u + change
    return None


@Property.define(
    id="engine.locking",
    family="engine",
    quantities=(DRIFT, ROUGHNESS),
    cases=Cases.from_list(refined_blocks.wave_cases),
    promise=lambda traits: None,
    needs=frozenset({SOLVE}),
    bodies=True,
)
def engine_locking(case: Case, subject: Subject) -> Measurement:
    """With stiff springs or multipliers the interface is no stiffer and its pressure no rougher than it should be.

    **Question.** The scenes of `stability.locking`: a block is pressed on another with meshes of 8 and 12 segments, and
    a wave of pressure is added. As the penalty rises from 10 to 1e8 E/h, is the interface as stiff, and its pressure as
    smooth, as on matching meshes?

    **Why it matters.** Users raise the penalty until nothing penetrates. A code whose springs ask for more than the
    surfaces can follow then answers with a stiffer joint and pressures that oscillate.

    **How it is judged.** As in `stability.locking`: the code solves the blocks with the wave and without it, and the
    difference counts. Pressures are the nodal forces that the bodies need over the lengths beside their nodes. A code
    with multipliers, or with a stiffness of its own, is judged by its roughness alone. No code promises this; the row
    says how it does.

    **Undecided.** Where the code finds no solution.
    """
    assert isinstance(subject, EngineSubject)
    unsolved = "the code finds no solution"
    return _measure_locking(
        case, subject, lambda columns, penalty: _answer_of_code(columns, penalty, subject), unsolved
    )
