"""Solve scenes for their errors, in one way for whoever solves them: formulations by Newton's method, whole codes."""

from __future__ import annotations

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.engine_subject import EngineSubject
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.mechanics.accuracy import Solution
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.scene_arrays import solve_by_engine
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

    The arguments are those of `solve_for_accuracy`. With `solution_only`, calls are saved, see `solve`.
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
