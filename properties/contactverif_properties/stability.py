"""Roundoff in the forces on an interface: far from the origin, at small gaps, and at stiff springs; and locking."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import NamedTuple

import numpy as np
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.case import Case, Cases, random_source
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import SOLVE, EngineSubject, Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import shape_integrals, solve_by_engine
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.mechanics.system import System
from contactverif.oracle.flat_answers import uniform_pressure_weights_exact
from contactverif.problems import refined_blocks
from contactverif.problems.blocks import exact_unknowns, pressure_of
from contactverif.problems.flat_states import rotation
from contactverif.problems.space_scenes import stability_space_scenes
from contactverif.problems.stability_states import stability_scenes, stability_states
from contactverif.strategies.flat import exact_flat_cases, linear_flat_cases
from contactverif.strategies.surfaces import translated_surface_cases
from contactverif.strategies.translations import translated_cases
from contactverif_properties import exact_forces, roundoff
from contactverif_properties.applicability import LINEAR_FORCES, knows_total, refuse_unknown_pressure
from contactverif_properties.kinks import explain_by_rounded_decision
from contactverif_properties.states import FrozenState, ask_forces_and_tangents, freeze_state, move_state

FORCES = roundoff.forces_quantity("change of the forces in roundings")
TANGENT = Quantity(
    "change of the tangent in roundings",
    "16 (times u D max(max|K|/ℓ, max|dK/dx|))",
    "Rounding the positions relative to one another by uD turns a segment by uD/ℓ, and changes the stiffness of a law "
    "that is not linear by uD max|dK/dx|.",
)
SEARCH = roundoff.forces_quantity("change of the forces with a new pairing in roundings")
FORCES_THERE = roundoff.forces_quantity("error of the forces in roundings")
TOTAL_THERE = roundoff.forces_quantity("error of the total force in roundings")
KINDS = ("uniform penetration", "linear penetration")
LARGEST_DENOMINATOR = 13  # The hypotenuses of the triples are 5 and 13.
SWEPT_ROUNDINGS = roundoff.forces_quantity("error of a force in roundings")


@Property.define(
    id="stability.translation",
    rank=150,
    quantities=(FORCES, TANGENT, SEARCH),
    cases=Cases.random(translated_cases),
    cases_in_space=Cases.random(translated_surface_cases),
    promise=lambda traits: traits.promises.translation_stable,
)
def stability_translation(case: Case, subject: Subject) -> Measurement:
    """A part far from the origin gets the same forces as the same part at the origin.

    **Question.** State and reference are moved by up to 2^20, while segments have lengths of 1 to 4. The move is exact:
    no coordinate is rounded. Do forces and tangent stay what they were?

    **Why it matters.** Assemblies, bridges and maps have coordinates of 10⁵ to 10⁷ and penetrations of 10⁻⁶. A
    formulation that forms a point of a segment there rounds it at its distance from the origin. What it subtracts
    afterwards is lost: forces are wrong by 10⁻⁴, and Newton's method stops at that.

    **How it is judged.** The forces are compared on the pairing of the state at the origin. The difference is counted
    in roundings (ω): how many times more it is than rounding all positions relative to their centroid, to 53 bits,
    would make it. A kernel that takes differences of nodes first gives 0, or a few where it centres its coordinates.
    The tolerance is 16, at any distance and any gap. A kernel that rounds points far away has 10⁵ and more at 2^20. The
    tangent may differ by 16 u D max(max|K|/ℓ, max|dK/dx|): a rounding turns a segment by u D/ℓ, and changes the
    stiffness of a law that is not linear. The state's own pairing at the far place must give these forces too. Without
    a promise (trait `translation_stable`), a failure is shown and breaks nothing: kernels that form points first are
    common, and right near the origin.

    **Undecided.** Never, if the plugin has a pairing. Without one, or with the far state's own pairing, a case is
    undecided where a decision hangs on less than 64 u D: there a right search may decide otherwise.
    """
    near = freeze_state(case, subject)
    far = replace(near, case=move_state(near.case, case.parameters["shift"]))
    (forces, forces_there), tangents = ask_forces_and_tangents(subject, near, far)
    conditioning = roundoff.measure_conditioning(near, forces)
    values = {FORCES: conditioning.count_roundings(forces_there - forces)}
    if tangents:
        here, there = tangents
        values[TANGENT] = roundoff.count_tangent_roundings(
            near.case, here, there, roundoff.measure_tangent_slope(near, here)
        )
    # A plugin without a pairing decides anew in each residual. A frozen pairing decides the same in both places.
    excusable = near.pairing is None or max(values.values()) <= roundoff.MOST_ROUNDINGS
    if near.pairing is not None:
        searched = FrozenState.at(near.formulation, far.case)
        values[SEARCH] = conditioning.count_roundings(searched.residual - forces)
    undecided = ""
    if excusable and max(values.values()) > roundoff.MOST_ROUNDINGS:
        undecided = explain_by_rounded_decision(near)
    idle = not forces[: case.interface.n_unknowns].any()
    return Measurement(check_all(values, roundoff.MOST_ROUNDINGS), undecided, idle=idle).after(_moved_by(case))


def refuse_unknown_forces(traits: Traits) -> str:
    """Return why no exact force is known, or an empty string if one is."""
    known = _knows_forces(traits) or _knows_total_of_springs(traits) or traits.abilities.takes_longdouble
    return "" if known else "no exact force is known: the traits promise no patch test, no area and no long double"


@random_source("contactverif_properties.stability_local.local_cases")
def _local_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | None:
    uniform, linear = exact_flat_cases(interface), linear_flat_cases(interface)
    return None if uniform is None or linear is None else dict(zip(KINDS, (uniform, linear), strict=True))


@Property.define(
    id="stability.local",
    rank=170,
    quantities=(FORCES_THERE, TOTAL_THERE),
    cases=Cases.random(_local_cases),
    linear=LINEAR_FORCES,
    kinds=KINDS,
    promise=lambda traits: True if traits.promises.translation_stable else None,
    applicable=refuse_unknown_forces,
)
def stability_local(case: Case, subject: Subject) -> Measurement:
    """Forces are as exact as the positions allow, whatever the gap and the distance from the origin.

    **Question.** A turned flat interface penetrates by 10⁻² to 10⁻⁸ of a segment, near the origin or far from it. The
    penetration is uniform, or linear along a straight slave. Are the forces as near to the exact ones as rounding the
    positions relative to one another lets them be?

    **Why it matters.** A small gap is a difference of large numbers, so an error of 10⁻⁷ at a gap of 10⁻⁹ is no fault:
    the positions do not contain more digits. The same error at a gap of 10⁻² is one. A tolerance that grows with the
    coordinates cannot tell them apart. And a formulation may be wrong by the same amount everywhere, as one in single
    precision, so that a translation does not show it.

    **How it is judged.** The error is counted in roundings (ω), as in `stability.translation`, with the same tolerance
    of 16 at any gap, distance and penalty. What is exact depends on the traits. Where the flat patch test is promised,
    it is the force on every node, in rationals on the stored positions. Else it is the answer in long double, if the
    plugin says that it can (`takes_longdouble`), and the total force ε̂ |g| A, if `area` and `penalty` say that springs
    are distributed. Multipliers that are pressures are all ε̂ |g|, and only the distribution of their forces counts.

    Under a linear penetration, the force on each slave node is exact where `integrates_linear_gap` is promised. The
    total on the slave is exact where `gap`, `force_along`, `penalty` and `area` state it. Where nothing is stated, and
    with multipliers, the forces are compared with those near the origin.

    A formulation promises this if it promises `translation_stable` and one of the above. Ratios of lengths stay below
    5: a kernel that moves the origin to a node rounds at the diameter, which is right, but costs digits on much shorter
    segments.

    **Undecided.** A failing case is undecided where a slave point faces a master node to within 64 u D. Both partners
    give the same gap there, but a search that asks for 0 ≤ ξ ≤ 1 may lose the point between them.
    """
    linear = "slope" in case.parameters
    pressure = exact_forces.uniform_multiplier(case) if linear else case.penalty * case.parameter("penetration")
    far = FrozenState.with_multiplier(subject.for_case(case), move_state(case, case.parameters["shift"]), pressure)
    near = replace(far, case=case.with_multipliers(far.case.multipliers))
    forces = far.residual
    conditioning = roundoff.measure_conditioning(near, near.residual)
    errors = (_errors_of_linear if linear else _errors_of_uniform)(near.case, subject.traits, forces)
    if FORCES_THERE not in errors and subject.traits.abilities.takes_longdouble:
        errors[FORCES_THERE] = forces - far.residual_at(far.case.z.astype(np.longdouble))
    if not errors:
        errors[FORCES_THERE] = forces - near.residual
    values: dict[Quantity, float] = {}
    if FORCES_THERE in errors:
        values[FORCES_THERE] = conditioning.count_roundings(errors[FORCES_THERE])
    if TOTAL_THERE in errors:
        reach = float(conditioning.reach[: case.interface.n_slave_nodes].sum())
        values[TOTAL_THERE] = roundoff.ratio(float(np.hypot(*errors[TOTAL_THERE])), UNIT_ROUNDOFF * reach)
    failed = max(values.values()) > roundoff.MOST_ROUNDINGS
    undecided = explain_by_rounded_decision(near) if failed else ""
    return Measurement(check_all(values, roundoff.MOST_ROUNDINGS), undecided).after(_moved_by(case))


def _moved_by(case: Case) -> str:
    return f"moved by ({', '.join(f'{length:.4g}' for length in case.parameters['shift'])})"


def _errors_of_uniform(case: Case, traits: Traits, forces: FloatArray) -> dict[Quantity, FloatArray]:
    """Return the errors {quantity: of each row, or of the total force} that the traits make known."""
    knows_forces = _knows_forces(traits)
    if not knows_forces and not _knows_total_of_springs(traits):
        return {}
    exact, pulls, n_slave = exact_residual(case), list(map(Fraction, forces.tolist())), 2 * case.interface.n_slave_nodes
    total, exact_total = ([sum(part[axis:n_slave:2], Fraction()) for axis in (0, 1)] for part in (pulls, exact))
    if not knows_forces:
        return {TOTAL_THERE: np.array([float(x - right) for x, right in zip(total, exact_total, strict=True)])}
    scale = Fraction(1)
    if case.n_multipliers:
        projection = total[0] * exact_total[0] + total[1] * exact_total[1]
        if projection > 0:
            scale = (exact_total[0] * exact_total[0] + exact_total[1] * exact_total[1]) / projection
    errors = [float(pull * scale - right) for pull, right in zip(pulls, exact, strict=False)]
    return {FORCES_THERE: np.array([*errors, *([0.0] * case.n_multipliers)])}


def _errors_of_linear(case: Case, traits: Traits, forces: FloatArray) -> dict[Quantity, FloatArray]:
    if traits.rules.enforcement != "penalty" or not exact_forces.knows_linear_total(traits):
        return {}
    n_slave = case.interface.n_slave_nodes
    error = forces[: 2 * n_slave].reshape(-1, 2) + exact_forces.exact_slave_forces(case, traits)
    errors = {TOTAL_THERE: error.sum(axis=0)}
    if traits.promises.integrates_linear_gap:
        errors[FORCES_THERE] = np.concatenate([error.reshape(-1), np.zeros(len(forces) - 2 * n_slave)])
    return errors


def exact_residual(case: Case) -> list[Fraction]:
    """Return the exact residual of a uniform pressure ε̂ |g| (n_unknowns entries), which pulls nodes back."""
    weights = uniform_pressure_weights_exact(case.interface, case.parameters["along"])
    x, y = (Fraction(entry).limit_denominator(LARGEST_DENOMINATOR) for entry in case.parameters["direction"].tolist())
    pressure = Fraction(case.penalty) * Fraction(case.parameter("penetration"))
    forces = []
    for node, weight in enumerate(weights):
        size = -pressure * weight if node < case.interface.n_slave_nodes else pressure * weight
        forces += [-y * size, x * size]  # The normal points to the left of the way the slave runs.
    return forces


def _knows_forces(traits: Traits) -> bool:
    """Return whether the traits say what the force on each node is: that of springs, or of uniform pressures."""
    if traits.rules.enforcement == "multiplier" and traits.rules.penalty != "distributed":
        return False
    return traits.promises.patch.flat is True


def _knows_total_of_springs(traits: Traits) -> bool:
    return traits.rules.enforcement == "penalty" and knows_total(traits)


def move_swept(case: Case) -> Case:
    """Return the state after its exact motion, multipliers included."""
    motion = ExactMotion.from_case(case)
    positions = motion.move(case.positions)
    z = np.concatenate([positions.reshape(-1), case.multipliers])
    return replace(case, interface=case.interface.at(motion.move(case.interface.nodes)), z=z)


@Property.define(
    id="stability.sweep",
    rank=330,
    quantities=(SWEPT_ROUNDINGS,),
    cases=Cases.from_list(stability_states),
    promise=lambda traits: traits.promises.translation_stable,
)
def stability_sweep(case: Case, subject: Subject) -> Measurement:
    """Small gaps, short segments and a place far away cost no more digits than the condition number says.

    **Question.** A flat interface lies turned and far from the origin, with gaps down to 1e-12, segments down to 1e-9
    and offsets up to 1e9. Is the error of each nodal force at most sixteen times what rounding the positions relative
    to one another would change?

    **Why it matters.** A small gap is a difference of nearly equal coordinates. Then digits are lost in any
    formulation, and the condition number says how many. A kernel that rounds a point at its distance from the origin
    loses more. No test near the origin shows that, and in a model in global coordinates it looks like bad contact.

    **How it is judged.** The same state, flat and at the origin, is the reference: there every product is nearly exact.
    It is turned by a rational rotation and shifted, and neither rounds anything. Both residuals are evaluated on the
    pairing of the flat state. The error is counted in roundings, ω (see the shared measure of conditioning). The
    tolerance is 16. The states are a finite list. Besides ω, the error and the
    condition number of the worst force are kept.

    **Undecided.** Never, since no decision is made anew. A formulation without `pair` decides anew inside its residual.
    One that prefers an axis fails in every state: look at `objectivity` first.
    """
    state = freeze_state(case, subject)
    there = replace(state, case=move_swept(state.case))
    expected: FloatArray = np.array(state.residual)
    expected[: case.interface.n_unknowns] = ExactMotion.from_case(case).turn(state.forces).reshape(-1)
    error, conditioning = there.residual - expected, roundoff.measure_conditioning(state, state.residual)
    idle, action = not state.residual.any(), f"turned and {_moved_by(case)}"
    return roundoff.make_sweep_measurement(SWEPT_ROUNDINGS, conditioning, error, idle=idle, action=action)


@dataclass(frozen=True, slots=True, eq=False)
class ExactMotion:
    """A rotation by a Pythagorean triple, or by a quaternion of integers, and a translation behind it."""

    matrix: FloatArray  # (dim, dim) The rotation times its size, in integers.
    size: float  # The hypotenuse of the triple, or the square of the quaternion's length.
    shift: FloatArray  # (dim,) The translation, a length each.

    @classmethod
    def from_case(cls, case: Case) -> ExactMotion:
        """Return the motion of the parameters "turn", the legs of the triple or the quaternion, and "shift"."""
        a, b, *others = turn = case.parameters["turn"].astype(int).tolist()
        matrix, size = rotation(turn) if others else ([[a, -b], [b, a]], np.hypot(a, b))
        return cls(np.array(matrix, dtype=np.float64), float(size), case.parameters["shift"])

    def move(self, positions: FloatArray) -> FloatArray:
        """Return the positions (n, dim) after the motion, exact for multiples of the rotation's size."""
        return (positions / self.size) @ self.matrix.T + self.shift

    def turn(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (n, dim) after the rotation, each component rounded like a sum of products."""
        return (vectors @ self.matrix.T) / self.size

    def turn_back(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (n, dim) before the rotation."""
        return (vectors @ self.matrix) / self.size


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
    "Without locking it was at most 0.002 at any penalty, with locking at least 0.32 at the highest.",
)
ROUGHNESS = Quantity(
    "roughness of the pressure",
    "2",
    "Without locking it was at most 1.4 at any penalty, with springs between the nodes at least 90 at the highest.",
)
_UNSOLVED = "Newton's method finds no solution on the pairing of the uniform state"


def _refuse_without_solution(traits: Traits) -> str:
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
        displacements = self.system.state(u).reshape(nodes.shape) - nodes
        z = (self.interface.nodes + self.motion.turn(displacements)).reshape(-1)
        return self.system.formulation.residual(self.interface, self.pairing, z)

    def residual(self, u: FloatArray) -> FloatArray:
        """Return the residual (n_free,) of bodies and contact at the unknowns u (n_free,)."""
        forces = self.motion.turn_back(self.forces(u).reshape(self.interface.nodes.shape)).reshape(-1)
        residual: FloatArray = self.system.transformation.T @ forces + self.system.scene.bulk_forces(u)
        return residual


@Property.define(
    id="stability.stiffness",
    rank=580,
    quantities=(ROUNDINGS,),
    cases=Cases.from_list(stability_scenes),
    cases_in_space=Cases.from_list(stability_space_scenes),
    linear=LINEAR_FORCES,
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
    are a finite list. In space there are five penalties from 1 to 1e12 E/h, each on 16 rectangles against 9, and with
    these cut into triangles.

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
        mean_face = float(case.interface.slave.measures(case.interface.nodes).mean())
        settled = (SETTLED_SHARE * pressure_of(case, penalty) + rounding) * mean_face
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
    reach[: scene.interface.n_nodes] += np.hypot.reduce(bulk.reshape(positions.shape), axis=1)
    conditioning = replace(conditioning, reach=reach)
    idle, action = not state.forces.any(), f"solved at ε̂ = {case.penalty:.4g}, then turned and {_moved_by(case)}"
    return roundoff.make_sweep_measurement(ROUNDINGS, conditioning, error, idle=idle, action=action)


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


_define_locking = partial(
    Property.define,
    quantities=(DRIFT, ROUGHNESS),
    cases=Cases.from_list(refined_blocks.wave_cases),
    bodies=True,
    linear=LINEAR_FORCES,
)


@_define_locking(
    id="stability.locking",
    rank=510,
    cases_in_space=Cases.from_list(refined_blocks.wave_space_cases),
    needs=frozenset({"pair"}),
    promise=lambda traits: None if traits.promises.locks is None else not traits.promises.locks,
    applicable=refuse_unknown_pressure,
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

    In space the blocks are as wide as they are high, with 8 × 2 and 12 × 3 rectangles at the interface, or these cut
    into triangles. They are solved at 1e2 and at 1e8 E/h. Methods lock as they do in the plane: mortar, dual mortar and
    NTS have a drift of at most 0.2 % and a roughness of at most 1.4; what locks has a drift of 32 % to 35 %.

    **Undecided.** Where Newton's method finds no solution on that pairing.
    """
    return _measure_locking(case, subject, partial(answer_to_wave, subject=subject), _UNSOLVED)


def _measure_locking(
    case: Case, subject: Subject, answer_of: Callable[[Scene, Scene], _InterfaceAnswer | None], unsolved: str
) -> Measurement:
    """Return the drift and the roughness of answers to the wave, of two blocks without it and with it."""
    n_slave, n_master = case.parameters["columns"].astype(int).tolist()
    corners = case.interface.slave.faces.shape[1]

    def blocks(penalty: float, wave: float) -> Scene:
        return refined_blocks.wave_blocks(n_slave, n_master, penalty, wave=wave, corners=corners)

    def answer_at(penalty: float) -> _InterfaceAnswer | None:
        return answer_of(blocks(penalty, 0.0), blocks(penalty, refined_blocks.WAVE))

    answer = answer_at(case.parameter("stiffness"))
    if answer is None:
        return Measurement(undecided=unsolved)

    def matching(distributed: float) -> float:
        """Return the mean compliance of matching meshes with the segments of the slave, and of the master."""
        both = (refined_blocks.matching_answer(n, distributed, corners) for n in (n_slave, n_master))
        return sum(answer.compliance for answer in both) / 2

    smooth = refined_blocks.matching_answer(n_slave, case.penalty, corners).pressure_range
    by_forces, by_points = answer.force_range / smooth, answer.point_range / smooth
    values = {ROUGHNESS: float(np.fmax(by_forces, by_points))}
    details = {"roughness of nodal forces": by_forces}
    if np.isfinite(by_points):
        details["roughness of reported pressures"] = by_points
    if subject.traits.rules.enforcement == "penalty":
        soft = answer_at(refined_blocks.SOFT)
        if soft is None:
            return Measurement(undecided=unsolved)
        at_soft = blocks(refined_blocks.SOFT, 0.0).penalty
        factor = soft.stiffness / at_soft  # Springs may act twice.
        share = answer.compliance / matching(factor * case.penalty)
        values[DRIFT] = 1 - share * matching(factor * at_soft) / soft.compliance
        details["stiffness of the springs over the penalty"] = factor
    measurement = Measurement(check_all(values, {DRIFT: MOST_DRIFT, ROUGHNESS: MOST_ROUGHNESS}), details=details)
    return measurement.after(f"solved with a wave of pressure at ε̂ = {case.penalty:.4g}")


MOST_WAVE_STEPS = 12
# Springs that add less than this share s to the compliance of the bodies count as adding so much. They are 1/s times as
# stiff, which is the condition of the matrix, so that roundoff of the solution adds u/s. Both are equal at s = √u.
_LEAST_SHARE = UNIT_ROUNDOFF**0.5


class _InterfaceAnswer(NamedTuple):
    compliance: float  # The work of the wave's load on the displacements that it causes.
    stiffness: float  # The distributed stiffness of the springs under the mean pressure.
    # The largest minus the smallest pressure from nodal forces, over the amplitude of the wave. The surface with the
    # larger one counts.
    force_range: float
    # The same of the pressures that the formulation reports; NaN if it reports none, or nodal forces.
    point_range: float = np.nan


def answer_to_wave(uniform: Scene, wavy: Scene, subject: Subject) -> _InterfaceAnswer | None:
    """Solve two blocks without the wave and with it."""
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


def _answer_of_code(uniform: Scene, wavy: Scene, subject: EngineSubject) -> _InterfaceAnswer | None:
    before, after = (solve_by_engine(scene, subject, linear=True)[0] for scene in (uniform, wavy))
    if before.no_solution or after.no_solution:
        return None
    q = [np.asarray(uniform.transformation.T @ item.displacements.reshape(-1)) for item in (before, after)]
    return _interface_answer(uniform, wavy, q[0], q[1], after.forces - before.forces)


def _interface_answer(
    uniform: Scene, wavy: Scene, before: FloatArray, after: FloatArray, forces: FloatArray
) -> _InterfaceAnswer:
    """Return the answer of two solutions (n_free,) and of the forces (n_nodes, dim) that the wave adds."""
    total = -float((uniform.bodies[0].load * uniform.displacements(before)[0]).sum())
    bodies = float(uniform.facts["compliance"].sum())
    interface, n = uniform.interface, uniform.interface.n_slave_nodes
    area = interface.slave.measures(interface.nodes).sum()
    springs = abs(total) / (refined_blocks.MEAN_PRESSURE**2 * area) - bodies
    ranges = [
        float(np.ptp(forces[nodes, -1] / shape_integrals(side, interface.nodes)[nodes]))
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


@_define_locking(id="engine.locking", promise=lambda traits: None, needs=frozenset({SOLVE}))
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
    return _measure_locking(case, subject, partial(_answer_of_code, subject=subject), "the code finds no solution")
