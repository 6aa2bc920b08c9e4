"""The patch test solved by an engine, judged by its displacements alone.

Symbols: a is the accuracy that the engine states; M is the stiffer body's oedometer modulus, U the largest
displacement, ℓ the shortest segment, p the exact pressure, κ the condition of the bodies' condensed stiffness.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.engine import EngineAnswer
from contactverif.contract.engine_subject import EngineSubject
from contactverif.contract.measurement import Measurement, Quantity, check_all
from contactverif.mechanics.accuracy import Solution, shape_integrals
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.mechanics.solving import solve_by_engine
from contactverif.problems.blocks import pressure_of
from contactverif.problems.uniform_stress import stress_error
from contactverif_properties.shared.uniform_pressure import consistent_forces, gap_error, normal_of

OWN_PRESSURE = "mean pressure over that of hard contact"
ITERATIONS = "iterations until the code said that it converged"
ALMOST = UNIT_ROUNDOFF**0.5  # A node is covered up to this share of its length.
POSITION_ROUNDINGS = 64.0  # A node balances about 8 springs to 8 roundoffs.
_TERMS = "a (1 + M U/(ℓ p)) + 1e-12 κ + 64 u X ε̂/p"
_REASON = "It is that of the forces that the bodies need, and a stiff spring turns rounded positions X into a force"
REPORTED_FORCES = Quantity("error of a contact force that the code reports", _TERMS, f"{_REASON}.")
REPORTED_PRESSURES = Quantity(
    "error of a contact pressure that the code reports",
    f"({_TERMS}) L/m",
    f"{_REASON}, on the length m of a node.",
)


def measure_engine(
    case: Case, subject: EngineSubject, penalty: float, quantities: tuple[Quantity, Quantity, Quantity, Quantity]
) -> Measurement:
    """Return the errors of stress, slave forces, master forces and gap of a scene whose pressure is uniform.

    Forces are those that the bodies need; what a rigid body needs is not known. A code with a stiffness of its own is
    judged by its own mean pressure, and neither its gap nor what it reports is asked. Forces and pressures that other
    codes report are judged.
    """
    traits, stress, gap = subject.engine_traits, quantities[0], quantities[3]
    scene = replace(scene_of(case), penalty=penalty)
    solution, answer = solve_by_engine(scene, subject, linear=True)
    if answer is None:
        return Measurement(undecided=solution.no_solution)
    details = {ITERATIONS: float(answer.iterations)}
    if solution.no_solution:
        return Measurement(undecided=solution.no_solution, details=details)
    pressure = float(pressure_of(case, penalty if traits.enforcement == "penalty" else np.inf))
    if traits.enforcement == "own":
        mean = _mean_pressure(case, solution)
        details[OWN_PRESSURE] = mean / pressure
        pressure = mean if mean > 0 else pressure
    q = np.asarray(scene.transformation.T @ solution.displacements.reshape(-1))
    values = {stress: stress_error(scene, scene.stresses(q), pressure)}
    values |= dict(zip(quantities[1:3], _force_errors(case, scene, solution, pressure), strict=True))
    tolerance = engine_tolerance(scene, solution, traits.accuracy, pressure)
    tolerances = dict.fromkeys(values, tolerance)
    if traits.enforcement != "own":
        rounding = POSITION_ROUNDINGS * UNIT_ROUNDOFF * case.largest_coordinate * penalty / pressure
        reported = _judge_reports(answer, case, scene, pressure)
        values |= {quantity: error for quantity, (error, _) in reported.items()}
        tolerances |= {quantity: (tolerance + rounding) / share for quantity, (_, share) in reported.items()}
        penetration = pressure / penalty if traits.enforcement == "penalty" else 0.0
        state = replace(case, z=solution.state.z, penalty=penalty)
        values[gap] = gap_error(state, penetration, pressure / penalty)
        tolerances[gap] = tolerance * (1 + penalty * float(case.parameters["compliance"].sum()))
    return Measurement(check_all(values, tolerances), details=details)


def _judge_reports(
    answer: EngineAnswer, case: Case, scene: Scene, pressure: float
) -> dict[Quantity, tuple[float, float]]:
    """Return the largest error of a nodal force that a code reports, over p L, and of a pressure, over p.

    Beside each stands the share of the slave's length L that carries it: all, or the shortest length of a node. The
    pressures are those of nodes of the slave that the master covers with both their segments.
    """
    errors: dict[Quantity, tuple[float, float]] = {}
    exact, n_slave = consistent_forces(case, pressure), case.interface.n_slave_nodes
    if answer.contact_forces is not None:
        differences = np.linalg.norm(answer.contact_forces[scene.nodes_in_reach] - exact, axis=1)
        errors[REPORTED_FORCES] = float(differences.max() / (pressure * case.slave_length)), 1.0
    if answer.pressures is not None:
        places = np.argsort(np.argsort(scene.nodes_in_reach[:n_slave]))  # Reports are in the order of the numbers.
        lengths = shape_integrals(case.interface.slave, case.interface.nodes)[:n_slave]
        covered = np.linalg.norm(exact[:n_slave], axis=1) >= (1 - ALMOST) * pressure * lengths
        shares = lengths[covered] / case.slave_length
        differences = np.abs(answer.pressures[places][covered] / pressure - 1)
        errors[REPORTED_PRESSURES] = float(differences.max(initial=0.0)), float(shares.min(initial=1.0))
    return errors


def _mean_pressure(case: Case, solution: Solution) -> float:
    """Return the mean pressure on the slave where the master covers it."""
    normal, n_slave = normal_of(case), case.interface.n_slave_nodes
    force, length = (
        float((forces[:n_slave] @ normal).sum()) for forces in (solution.forces, consistent_forces(case, 1.0))
    )
    return force / length


def _force_errors(case: Case, scene: Scene, solution: Solution, pressure: float) -> tuple[float, float]:
    """Return the largest error of a nodal force on the slave and on the master, over p L."""
    errors = np.linalg.norm(solution.forces - consistent_forces(case, pressure), axis=1)
    rigid = np.concatenate(
        [np.full(len(body.contact_nodes), body.rigid) for body in (scene.bodies[i] for i in scene.bodies_in_reach)]
    )
    errors[rigid] = 0.0
    slave, master = np.split(errors / (pressure * case.slave_length), [case.interface.n_slave_nodes])
    return float(slave.max()), float(master.max())


def engine_tolerance(scene: Scene, solution: Solution, accuracy: float, pressure: float) -> float:
    """Return a (1 + M U/(ℓ p)) + 1e-12 κ: displacements that are wrong by a U strain the shortest segment.

    U is at most the size of the interface, or a body that flies away would excuse itself.
    """
    modulus = max(body.oedometric_modulus for body in scene.bodies if not body.rigid)
    nodes = scene.interface.nodes
    shortest = min(float(side.lengths(nodes).min()) for side in (scene.interface.slave, scene.interface.master))
    displacement = min(float(np.abs(solution.displacements).max()), float(np.ptp(nodes, axis=0).max()))
    return float(accuracy * (1 + modulus * displacement / (shortest * pressure)) + 1e-12 * _condition(scene))


def _condition(scene: Scene) -> float:
    """Return the condition κ of the condensed stiffness, without the motions that it does not resist."""
    stiffness = scene.stiffness if isinstance(scene.stiffness, np.ndarray) else scene.stiffness.toarray()
    sizes: FloatArray = np.abs(np.linalg.eigvalsh(stiffness)) if len(stiffness) else np.ones(1)
    resisted = sizes[sizes > len(sizes) * UNIT_ROUNDOFF * sizes.max()]
    return float(resisted.max() / resisted.min())
