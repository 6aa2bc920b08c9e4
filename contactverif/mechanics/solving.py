"""Solve scenes for their errors, in one way for whoever solves them: formulations by Newton's method, whole codes."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.engine import EngineAnswer
from contactverif.contract.engine_subject import EngineSubject
from contactverif.contract.errors import MisuseError
from contactverif.contract.foreign_text import one_line
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.mechanics.accuracy import Solution
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.trace import Trace

# Forces out of balance by this share of the largest one are a solution: errors of meshes are many times as large.
BALANCED = 1e-9


def solve_for_accuracy(
    scene: Scene, subject: Subject, start: FloatArray | None = None, step: float | None = None
) -> Solution:
    """Solve a scene at its own penalty, with the formulation's tangent, or with differences where that does not help.

    A nodal formulation gets ε̂ × the mean slave segment. The start (n_free,) is the first guess of the scene by
    default. The step of differences is a length that is small against the penetration. An engine solves it by itself.
    """
    if isinstance(subject, EngineSubject):
        return solve_by_engine(scene, subject)[0]
    interface = scene.interface
    guess = Case(interface, scene.positions(scene.start), scene.penalty, name=scene.name)
    formulation = subject.for_case(guess)
    trace = solve_in_tries(scene, formulation, start, step, solution_only=True)[-1]
    return solution_of(trace, formulation, nodal=subject.traits.rules.penalty == "nodal")


def solve_in_tries(
    scene: Scene,
    formulation: CheckedFormulation,
    start: FloatArray | None = None,
    step: float | None = None,
    *,
    solution_only: bool = False,
) -> tuple[Trace, ...]:
    """Solve a scene with the formulation's tangent; if that does not converge, once more with differences.

    The arguments are those of `solve_for_accuracy`. With `solution_only`, calls are saved, see `solve`. Where one
    difference confirms the tangent that did not help, it stands for differences of each unknown.
    """
    ways = (True, False) if "tangent" in formulation.provides else (True,)
    traces = []
    for use_tangent in ways:
        trace = solve(
            scene,
            formulation,
            start=start,
            tolerance=BALANCED,
            difference_step=step,
            use_tangent=use_tangent,
            any_matrix=not use_tangent,
            solution_only=solution_only,
        )
        traces.append(trace)
        if trace.converged:
            break
    return tuple(traces)


def solution_of(trace: Trace, formulation: CheckedFormulation, *, nodal: bool) -> Solution:
    """Return the last iterate of Newton's method with its forces and contact points."""
    scene, interface, z = trace.scene, trace.scene.interface, trace.z
    state = Case(interface, z, scene.penalty, name=scene.name, n_multipliers=len(trace.multipliers))
    pairing = formulation.pair(interface, z)
    forces = -formulation.residual(interface, pairing, z)[: interface.n_unknowns].reshape(-1, 2)
    points = formulation.contact_points(interface, pairing, z) if "contact_points" in formulation.provides else None
    return Solution(scene, state, forces, points, nodal, trace)


def solve_by_engine(
    scene: Scene, subject: EngineSubject, *, linear: bool = False
) -> tuple[Solution, EngineAnswer | None]:
    """Return the solution of a scene by an engine, with its restored answer; None if the scene cannot be posed to it.

    The scene is turned where the engine takes no inclined axes. Bodies that nothing holds are lowered, as in
    `Scene.pose`. Where its solution is linear in the loads, they are multiplied by the engine's `load_scale`.
    """
    traits = subject.engine_traits
    scale = traits.load_scale if linear else 1.0
    try:
        pose = scene.pose(upright=not traits.inclined_supports, lowered=True, scale=scale)
    except MisuseError as error:
        return Solution.from_displacements(scene, np.zeros_like(scene.interface.nodes), str(error)), None
    answer = pose.restore(subject.solve(pose.arrays))
    return engine_solution(scene, answer), answer


def engine_solution(scene: Scene, answer: EngineAnswer) -> Solution:
    """Return the solution of a scene that an answer is, which `Pose.restore` returned.

    Its forces are those that the condensed bodies need for the displacements of the interface's nodes, so that the
    cells of the code do not matter.
    """
    no_solution = "" if answer.converged else f"did not converge: {one_line(answer.message) or 'no words about it'}"
    return Solution.from_displacements(scene, answer.displacements[scene.nodes_in_reach], no_solution)
