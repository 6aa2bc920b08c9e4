"""Properties about roundoff, rank and locking of solutions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.interface import Interface
from contactverif.contract.measurement import Measurement, Quantity, check_all
from contactverif.contract.pairing import Pairing
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.inf_sup import inf_sup_constant
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.mechanics.system import System
from contactverif.problems.blocks import exact_unknowns, pressure_of
from contactverif.problems.refined_blocks import refinement_cases, refinements
from contactverif.problems.stability_states import stability_scenes
from contactverif.problems.wave_blocks import SOFT, WaveAnswer, matching_answer, wave_blocks, wave_cases
from contactverif_properties.shared.applicability import refuse_unknown_pressure, refuse_unstated_penalty
from contactverif_properties.shared.conditioning import (
    Conditioning,
    forces_quantity,
    make_sweep_measurement,
    measure_conditioning,
)
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.wave_answer import InterfaceAnswer, answer_to_wave
from contactverif_properties.stability_forces import ExactMotion

ROUNDINGS = forces_quantity("error of a solved force in roundings")
MOST_STEPS = 30  # Newton's steps at each penalty. Linear springs take about four.
STEPS = 5  # Steps of the turned system, which start at its solution but for roundoff.
# The penalty grows by this factor at most from one solution to the next. A larger one gives forces that buckle springs.
GROWTH = 100.0
# Newton's method has settled once no pressure is out of balance by more than this share of p, and so many u ε̂ X.
SETTLED_SHARE, SETTLED_ROUNDINGS = 1e-3, 1e3
MOST_SLOPE = 0.1
# The names of the series, which have a number for each mesh.
CONSTANT, SEGMENT, ZERO_COUNT, MULTIPLIER_COUNT = "inf-sup constant", "slave segment", "zero eigenvalues", "multipliers"
N_FITTED = 3  # The finest meshes: on coarse ones the ends of the interface count as much as its inside.
ZEROS = Quantity(
    "pressures that move nothing",
    "0",
    "Of such a pressure nothing says how large it is. A singular value below √u of the largest one counts as zero.",
)
SLOPE = Quantity(
    "slope of log β against log h",
    "0.1",
    "A constant has a slope of 0, and constraints that a mesh cannot follow have a slope of 1.",
)
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


def refuse_without_solution(traits: Traits) -> str:
    """Return why a formulation is not asked, or an empty string if it has springs that Newton's method can solve."""
    if traits.rules.enforcement != "penalty" or traits.rules.penalty is None:
        return f"the enforcement is by a {traits.rules.enforcement}, not by springs of a stated stiffness"
    return (
        ""
        if traits.promises.tangent == "exact"
        else "no exact tangent, with which Newton's method settles at any penalty"
    )


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
    applicable=refuse_without_solution,
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
    are a finite list, and `contactverif stability` draws them.

    **Undecided.** A case is undecided if the system has no inverse in floats, or if Newton's method does not settle on
    the frozen pairing.
    """
    scene, motion = scene_of(case), ExactMotion.from_case(case)
    u = exact_unknowns(scene, pressure_of(case, case.penalty), case.penalty)
    pairing = subject.for_case(case).pair(scene.interface, _system(case, subject, case.penalty).state(u))
    try:
        for penalty in _penalties(case):
            system = _system(case, subject, penalty)
            u, matrix = _solve(system, pairing, u)
        if np.abs(system.residual(u, pairing)).max() > _settled_residual(case):
            return Measurement(undecided="Newton's method does not settle on the frozen pairing")
        turned = _TurnedSystem(system, motion, scene.interface.at(motion.move(scene.interface.nodes)), pairing)
        u_turned = _nearest_to_balance(turned, matrix, u)
    except _SingularMatrix:
        return Measurement(undecided="the matrix has no inverse in floats")
    state = FrozenState(system.formulation, replace(case, z=system.state(u)), pairing)
    error = turned.forces(u_turned) - motion.turn(state.forces).reshape(-1)
    return make_sweep_measurement(ROUNDINGS, _conditioning(state, scene), error, idle=not state.forces.any())


def _solve(system: System, pairing: Pairing | None, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the solution (n,) on a frozen pairing, and the last matrix (n, n).

    Newton's method ends once the residual was not halved twice in succession: it is down to its roundoff then.
    """
    largest, n_strikes = np.inf, 0
    for _ in range(MOST_STEPS):
        matrix = _matrix(system, pairing, u)
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


def _settled_residual(case: Case) -> float:
    """Return the largest force out of balance once Newton's method has settled."""
    lengths = case.interface.slave.lengths(case.interface.nodes)
    rounding = SETTLED_ROUNDINGS * UNIT_ROUNDOFF * case.penalty * case.largest_coordinate
    return (SETTLED_SHARE * pressure_of(case, case.penalty) + rounding) * float(lengths.mean())


class _SingularMatrix(Exception):
    """The end of Newton's method: the matrix has no inverse in floats. It never leaves this file."""


def _step(system: System, matrix: FloatArray, residual: FloatArray) -> FloatArray:
    """Return the step of Newton's method (n,)."""
    change = system.step(matrix, -residual).change
    if change is None:
        raise _SingularMatrix
    return change


def _penalties(case: Case) -> list[float]:
    """Return the penalties ε̂ of the solutions, one after the other, up to that of the case."""
    modulus = max(body.young for body in scene_of(case).bodies)
    n_steps = max(0, math.ceil(math.log(case.penalty / modulus, GROWTH)))
    return [case.penalty / GROWTH**n for n in range(n_steps, -1, -1)]


def _system(case: Case, subject: Subject, penalty: float) -> System:
    """Return the equations of the scene at a penalty ε̂."""
    return System(scene_of(case), subject.for_case(replace(case, penalty=penalty)))


def _matrix(system: System, pairing: Pairing | None, u: FloatArray) -> FloatArray:
    """Return the derivative (n_free, n_free) of the residual by the formulation's tangent.

    A difference quotient is no use: at 1e11 E/h its truncation is as stiff as the bodies.
    """
    contact = dense(system.formulation.tangent(system.scene.interface, pairing, system.state(u)))
    transformation = dense(system.transformation)
    return dense(system.stiffness) + transformation.T @ contact @ transformation


def _conditioning(state: FrozenState, scene: Scene) -> Conditioning:
    """Return the conditioning of the contact forces, to which the bodies add |S| |z − z̄| at their contact nodes."""
    conditioning, positions = measure_conditioning(state, state.residual), state.case.positions
    transformation = abs(dense(scene.transformation))
    distances = np.abs(positions - positions.mean(axis=0)).reshape(-1)
    bulk = transformation @ (abs(dense(scene.stiffness)) @ (transformation.T @ distances))
    reach = np.array(conditioning.reach)
    reach[: scene.interface.n_nodes] += np.hypot(*bulk.reshape(-1, 2).T)
    return replace(conditioning, reach=reach)


@Property.define(
    id="stability.inf-sup",
    rank=490,
    family="stability",
    quantities=(ZEROS, SLOPE),
    series={CONSTANT: "1", SEGMENT: "length", ZERO_COUNT: "1", MULTIPLIER_COUNT: "1"},
    cases=Cases.from_list(refinement_cases),
    promise=lambda traits: traits.promises.inf_sup,
    asks=frozenset({"multiplier"}),
    applicable=refuse_unstated_penalty,
    bodies=True,
)
def inf_sup(case: Case, subject: Subject) -> Measurement:
    """The bodies resist every pressure of the multipliers, as much on a fine mesh as on a coarse one.

    **Question.** Two blocks touch. How much does a pressure of unit size move them, if it is the one that moves them
    least? Does that number β stay above zero as both meshes are refined?

    **Why it matters.** Existence, uniqueness and convergence of the pressures rest on it: it is the inf-sup condition
    of Ladyzhenskaya, Babuška and Brezzi. Where β falls, pressures oscillate from point to point, and a finer mesh makes
    it worse. Where β is zero, there is a pressure that moves nothing, and so nothing decides how large it is. With a
    penalty in place of multipliers, the same constraints lock as the penalty grows (`stability.locking`).

    **How it is judged.** B are the rows of the formulation where both bodies touch, S the condensed stiffness of both,
    A the areas of the multipliers, and h the mean slave segment: B S⁻¹ Bᵀ λ = β² h A λ / E. There are three families of
    five meshes each: a slave that is coarser than the master (2:3), a finer one (3:2), and nodes on nodes. Rows of
    forces and rows of gaps are derived from the residual. Where they differ, the smaller β counts.

    The first number counts the eigenvalues that are zero; the tolerance is 0. They are then left out. The second number
    is the slope of log β against log h, fitted to the three finest meshes. β falls with h if it is positive. The
    tolerance is 0.1: a constant has a slope of 0, and constraints that a mesh cannot follow have a slope of 1. NTS,
    mortar and dual mortar have less than 0.001 on all families.

    **Undecided.** Never.

    **Source.** Section 6.3 of Zavarise & De Lorenzis (2009) leaves open whether VTS-PPT satisfies the condition. It
    does not: with two virtual slave nodes a segment, β falls like h on a coarser slave, and a third of all pressures
    move nothing on a finer one. The numerical test is that of Chapelle & Bathe, Computers & Structures 47 (1993)
    537–545.
    """
    nodal = subject.traits.rules.penalty == "nodal"
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


@Property.define(
    id="stability.locking",
    rank=510,
    family="stability",
    quantities=(DRIFT, ROUGHNESS),
    needs=frozenset({"pair"}),
    cases=Cases.from_list(wave_cases),
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
    return measure_locking(case, subject, lambda columns, penalty: answer_to_wave(columns, penalty, subject), _UNSOLVED)


def measure_locking(
    case: Case, subject: Subject, answer_at: Callable[[tuple[int, int], float], InterfaceAnswer | None], unsolved: str
) -> Measurement:
    """Return the drift and the roughness of answers to the wave, which have the numbers of segments and ε̂ h/E."""
    n_slave, n_master = case.parameters["columns"].astype(int).tolist()
    columns = (n_slave, n_master)
    answer = answer_at(columns, case.parameter("stiffness"))
    if answer is None:
        return Measurement(undecided=unsolved)
    smooth = matching_answer(n_slave, case.penalty).pressure_range
    by_forces, by_points = answer.force_range / smooth, answer.point_range / smooth
    values = {ROUGHNESS: float(np.fmax(by_forces, by_points))}
    details = {"roughness of nodal forces": by_forces}
    if np.isfinite(by_points):
        details["roughness of reported pressures"] = by_points
    if subject.traits.rules.enforcement == "penalty":
        soft = answer_at(columns, SOFT)
        if soft is None:
            return Measurement(undecided=unsolved)
        at_soft = wave_blocks(*columns, SOFT, wave=0.0).penalty
        factor = soft.stiffness / at_soft  # Springs may act twice.
        ratio = answer.compliance / mean_of_matching(columns, factor * case.penalty)
        values[DRIFT] = 1 - ratio * mean_of_matching(columns, factor * at_soft) / soft.compliance
        details["stiffness of the springs over the penalty"] = factor
    tolerances = {DRIFT: MOST_DRIFT, ROUGHNESS: MOST_ROUGHNESS}
    return Measurement(check_all(values, tolerances), details=details)


def mean_of_matching(columns: tuple[int, int], distributed: float) -> float:
    """Return the mean compliance of matching meshes with the segments of the slave and with those of the master."""
    answers: list[WaveAnswer] = [matching_answer(number, distributed) for number in columns]
    return sum(answer.compliance for answer in answers) / len(answers)
