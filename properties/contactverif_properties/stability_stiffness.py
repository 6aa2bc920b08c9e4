"""Ask whether the contact forces of a solution keep their digits as far as the penalty lets them.

**Question.** Two blocks under a uniform pressure are solved with ε̂h/E from 1e-2 to 1e12. Is the error of each contact
force at most sixteen times what rounding the positions would change?

**Why it matters.** A stiff spring turns the rounding of a position into a force: the relative error of the pressure is
about u ε̂ X/p. Users who raise the penalty until nothing penetrates lose these digits. They should lose no more.

**How it is judged.** The blocks are solved as they lie at the origin, and again with the interface turned by an exact
rotation. Both use the same stiffness of the bodies, so that only contact sees the rotation, and the pairing of the
exact solution. Newton's method, with the tangent that the formulation calls exact, goes on down to roundoff. The forces
are compared, and the error is counted in roundings, ω (see the shared measure of conditioning). The derivative K is
here that of bodies and contact together, the matrix of the system. The tolerance is 16. The scenes are a finite list,
and `contactverif stability` draws them.

**Undecided.** A case is undecided if the system has no inverse in floats, or if Newton's method does not settle on the
frozen pairing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.scene import scene_of
from contactverif.mechanics.system import System
from contactverif.problems.blocks import exact_unknowns, pressure_of
from contactverif.problems.stability_states import stability_scenes
from contactverif_properties.shared.conditioning import Conditioning, forces_quantity, measure_conditioning
from contactverif_properties.shared.exact_motions import ExactMotion
from contactverif_properties.shared.sweep_measurement import make_sweep_measurement

ROUNDINGS = forces_quantity("error of a solved force in roundings")
MOST_STEPS = 30  # Newton's steps at each penalty. Linear springs take about four.
STEPS = 5  # Steps of the turned system, which start at its solution but for roundoff.
# The penalty grows by this factor at most from one solution to the next. A larger one gives forces that buckle springs.
GROWTH = 100.0
# Newton's method has settled once no pressure is out of balance by more than this share of p, and so many u ε̂ X.
SETTLED_SHARE, SETTLED_ROUNDINGS = 1e-3, 1e3


@random_source("contactverif_properties.stability_stiffness.stiffness_cases")
def stiffness_cases(scene: Case | None = None) -> tuple[Case, ...] | None:
    """Return the named scenes; None for a given scene, which is none of them."""
    return stability_scenes() if scene is None else None


def refuse_without_solution(traits: Traits) -> str:
    """Return why a formulation is not asked, or an empty string if it has springs that Newton's method can solve."""
    if traits.enforcement != "penalty" or traits.penalty is None:
        return f"the enforcement is by a {traits.enforcement}, not by springs of a stated stiffness"
    return "" if traits.tangent == "exact" else "no exact tangent, with which Newton's method settles at any penalty"


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
        forces: FloatArray = self.system.formulation.residual(self.interface, self.pairing, z)
        return forces

    def residual(self, u: FloatArray) -> FloatArray:
        """Return the residual (n_free,) of bodies and contact at the unknowns u (n_free,)."""
        forces = self.motion.turn_back(self.forces(u).reshape(-1, 2)).reshape(-1)
        residual: FloatArray = self.system.transformation.T @ forces + self.system.scene.bulk_forces(u)
        return residual


def measure_stiffness(case: Case, subject: Subject) -> Measurement:
    """Compare the contact forces of a turned interface with the turned contact forces, both solved.

    Parameters
    ----------
    case : Case
        A scene from `stability_scenes`.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The number of roundings ω, dimensionless, with the details of `stability.sweep`.
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
    state = replace(case, z=system.state(u))
    forces = system.formulation.residual(scene.interface, pairing, state.z)
    expected = motion.turn(forces.reshape(-1, 2)).reshape(-1)
    conditioning = _conditioning(state, system, pairing, forces)
    return make_sweep_measurement(ROUNDINGS, conditioning, turned.forces(u_turned) - expected, idle=not forces.any())


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
    matrix: FloatArray = dense(system.stiffness) + transformation.T @ contact @ transformation
    return matrix


def _conditioning(state: Case, system: System, pairing: Pairing | None, forces: FloatArray) -> Conditioning:
    """Return the conditioning of the contact forces, to which the bodies add |S| |z − z̄| at their contact nodes."""
    conditioning = measure_conditioning(state, system.formulation, pairing, forces)
    scene = system.scene
    transformation = abs(dense(scene.transformation))
    distances = np.abs(state.positions - state.positions.mean(axis=0)).reshape(-1)
    bulk = transformation @ (abs(dense(scene.stiffness)) @ (transformation.T @ distances))
    reach = np.array(conditioning.reach)
    reach[: scene.interface.n_nodes] += np.hypot(*bulk.reshape(-1, 2).T)
    return replace(conditioning, reach=reach)


STABILITY_STIFFNESS = Property(
    id="stability.stiffness",
    family="stability",
    summary="The contact forces of a solution keep their digits as far as the penalty lets them, up to 1e12 E/h.",
    quantities=(ROUNDINGS,),
    cases=stiffness_cases,
    measure=measure_stiffness,
    promise=lambda traits: traits.translation_stable,
    applicable=refuse_without_solution,
    needs=frozenset({"tangent"}),
    bodies=True,
)
