"""Newton's method on the unknowns of a scene.

The method is plain Newton, without line search, as a finite element code would run it with this formulation's tangent.
The active set is decided anew at each iterate, by the pairing. Only where a tie leaves a singular matrix beside the
solution, the matrix before is taken once more.

Rule for the next editor: a solution that does not converge is data, not an error. Every iterate is recorded, `End` says
how the iteration ended, and only a plugin that breaks the contract raises an exception.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.pairing import Pairing
from contactverif.contract.subject import CheckedFormulation
from contactverif.mechanics.linear import Step
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.system import System
from contactverif.mechanics.trace import End, Record, Trace, largest_rounding

MAX_ITERATIONS = 40
STAGNATION_ITERATIONS = 4  # Newton's method stagnates if the residual has not decreased in so many iterations.
# A residual within this factor of the roundoff that counts as converged is nearly converged: cancellation that the
# bound does not know of may keep it there.
NEAR_CONVERGENCE = 1e3
# Newton has diverged once the residual exceeds the first one, or the iterate the size of the interface, by this factor.
DIVERGENCE_FACTOR = 1e8
KEPT_FALL = 16.0  # A matrix may be kept while each iteration makes the residual at least this many times smaller.


def solve(
    scene: Scene,
    formulation: CheckedFormulation,
    *,
    start: FloatArray | None = None,
    load_steps: int = 1,
    iterations: int = MAX_ITERATIONS,
    use_tangent: bool = True,
    tolerance: float = 0.0,
    difference_step: float | None = None,
    any_matrix: bool = False,
    solution_only: bool = False,
) -> Trace:
    """Solve a scene by Newton's method with full steps.

    Parameters
    ----------
    scene : Scene
        Bodies, supports and loads. Its own penalty is not used here.
    formulation : CheckedFormulation
        The formulation with its penalty: ``subject.for_case(scene.case())`` takes the penalty of the scene,
        ``subject.with_penalty(…)`` any other.
    start : FloatArray | None, shape (n_free,) or (n_free + n_multipliers,)
        The first iterate; by default the first guess of the scene, and no multipliers.
    load_steps : int
        The number of equal steps in which loads and imposed displacements grow. Each starts from the solution before.
    iterations : int
        The largest number of linear systems in each load step.
    use_tangent : bool
        True uses the tangent of the formulation, if it has one. False differentiates its residual on the frozen
        pairing.
    tolerance : float
        From the second iterate on, forces out of balance by no more than this share of the largest contact force count
        as converged. By default only roundoff does. It saves the last matrix, whose floors are then those before, and
        does not apply to multipliers.
    difference_step : float | None
        The step of differences in positions, a length; None for the one that suits smooth residuals.
    any_matrix : bool
        True takes, in place of differences for each unknown, any matrix that one difference confirms: the formulation's
        own tangent, or differences of many unknowns at a time.
    solution_only : bool
        True saves calls where the iterates do not matter. The same residual decides about convergence. It takes any
        matrix, too. The matrix is kept while each iteration makes the residual `KEPT_FALL` times smaller, but not with
        multipliers, since it says which of them are active.

    Returns
    -------
    Trace
        Every iterate, and how the iteration ended: a solution that does not converge raises no exception.

    Raises
    ------
    MisuseError
        If `load_steps` or `iterations` is below 1, or `start` has another shape or is not finite.
    ContractError
        If the plugin breaks the contract, or raises an exception itself.

    See Also
    --------
    Trace : The result, with an example.
    """
    for name, number in (("load_steps", load_steps), ("iterations", iterations)):
        if number < 1:
            raise MisuseError(name, f"{number}", "at least 1")
    any_matrix = any_matrix or solution_only
    system = System(scene, formulation, use_tangent=use_tangent, difference_step=difference_step, any_matrix=any_matrix)
    record, keep_matrix = Record(), solution_only and not system.n_multipliers
    u = scene.start / load_steps if start is None else np.array(start, dtype=np.float64)
    if u.shape not in ((scene.n_free,), (system.size,)):
        behind = f", or ({system.size},) with multipliers" if system.n_multipliers else ""
        raise MisuseError("start", f"shape {u.shape}", f"shape ({scene.n_free},){behind}")
    if not np.isfinite(u).all():
        raise MisuseError("start", "NaN or infinity", "finite numbers")
    u = np.append(u, np.zeros(system.size - len(u)))
    end = End.CONVERGED
    for number in range(1, load_steps + 1):
        system.factor = number / load_steps
        end, u = _load_step(system, record, u, iterations, tolerance, keep_matrix)
        if end is not End.CONVERGED:
            break
    return record.trace(scene, end)


def _load_step(
    system: System, record: Record, u: FloatArray, iterations: int, tolerance: float, keep_matrix: bool
) -> tuple[End, FloatArray]:
    """Iterate from u (n,) at the system's load factor; return how that ended and the last iterate."""
    first, before, n_free = len(record.u), None, system.scene.n_free
    contact: Any = None
    last: Any = None
    floor = np.zeros(system.size)
    size = float(np.abs(system.scene.interface.nodes).max())
    for iteration in range(iterations + 1):
        if not _is_near(u[:n_free], u, size):
            return End.DIVERGED, u  # No plugin is called for such a state.
        pairing = system.pair(u)
        share = tolerance * (iteration > 0)
        # The last iterate needs no tangent, nor does one that keeps the matrix.
        forces, tangent = system.forces_and_tangent(u, pairing, later=share > 0 or keep_matrix)
        record.pairings.append(pairing)
        record.forces = forces
        residual = system.balance(u, forces)
        changes = _count_changes(pairing, before)
        if system.is_balanced(residual, forces, share):
            record.add(u, system.factor, residual, floor, 1.0, changes)
            return End.CONVERGED, u
        keeps = keep_matrix and _falls_fast(record, first, residual, floor)
        if not keeps:
            contact = system.contact_stiffness(u, pairing, tangent)
        matrix, floor = system.stiffness + contact, system.floor(u, contact, forces)
        comparable = system.row_factors(matrix)
        record.add(u, system.factor, residual, floor, comparable, changes)
        end = _end(record, first, n_free, keeps=keeps)
        if end is not None:
            return end, u
        if iteration == iterations:
            return End.EXHAUSTED, u
        step, last = _solve_for_step(system, matrix, last, -residual, floor, record.roundings[-1])
        record.conditions[-1], record.deficiencies[-1] = step.condition, step.deficiency
        if step.change is None:
            return End.SINGULAR, u
        record.energies[-1] = abs(float(step.change @ residual))
        u, before = u + step.change, pairing
    raise AssertionError("the loop returns")


def _solve_for_step(
    system: System, matrix: Any, last: Any, right: FloatArray, floor: FloatArray, rounding: float
) -> tuple[Step, Any]:
    """Return the step of a matrix (n, n), and that matrix.

    Near the solution of a tie, where the residual is some `rounding` of its floor, roundoff decides who faces whom. If
    that leaves a singular matrix, the one before, `last`, is as right.
    """
    step = system.step(matrix, right, floor)
    if step.change is None and last is not None and rounding <= NEAR_CONVERGENCE:
        return system.step(last, right, floor), last
    return step, matrix


def _is_near(q: FloatArray, u: FloatArray, size: float) -> bool:
    """Return whether the unknowns u are finite, and the displacements q no longer than the interface many times."""
    return bool(np.isfinite(u).all() and np.abs(q).max(initial=0.0) <= DIVERGENCE_FACTOR * size)


def _falls_fast(record: Record, first: int, residual: FloatArray, floor: FloatArray) -> bool:
    """Return whether a residual (n,) is small enough against the last one of this load step to keep the matrix."""
    return len(record.u) > first and largest_rounding(residual, floor) <= record.roundings[-1] / KEPT_FALL


def _end(record: Record, first: int, n_free: int, *, keeps: bool) -> End | None:
    """Return how the load step whose iterates begin at number `first` has ended, None if it goes on."""
    residuals, roundings = record.residuals[first:], record.roundings[first:]
    # The floor of a matrix that is kept is that of another state, whose forces may be larger. So what still falls fast,
    # `keeps`, is not at rest, however small it is.
    if roundings[-1] <= (0 if keeps else 1):
        return End.CONVERGED
    if not np.isfinite(residuals[-1]) or residuals[-1] > DIVERGENCE_FACTOR * max(residuals[0], record.floors[first]):
        return End.DIVERGED
    if _alternates([u[:n_free] for u in record.u[first:]]) and min(roundings[-4:]) > NEAR_CONVERGENCE:
        return End.CYCLE
    earlier, latest = roundings[:-STAGNATION_ITERATIONS], roundings[-STAGNATION_ITERATIONS:]
    if earlier and min(latest) >= min(earlier) <= NEAR_CONVERGENCE:
        return End.STAGNATED
    return None


def _alternates(q: list[FloatArray]) -> bool:
    """Return whether the last four iterates are two states that alternate."""
    if len(q) <= 4:
        return False
    returns = [np.abs(q[-1 - k] - q[-3 - k]).max() for k in (0, 1)]
    return bool(max(returns) <= 2.0**-20 * np.abs(q[-1] - q[-2]).max())


def _count_changes(pairing: Pairing | None, before: Pairing | None) -> int:
    """Return how many entries of the pairing differ; an entry of another shape counts with its size."""
    if pairing is None or before is None:
        return -1
    earlier = dict(before.items())
    return sum(
        int(np.count_nonzero(values != earlier[name]))
        if name in earlier and earlier[name].shape == values.shape
        else values.size
        for name, values in pairing.items()
    )
