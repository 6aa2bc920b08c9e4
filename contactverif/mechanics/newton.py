"""Newton's method on the unknowns of a scene, and the history of a solution.

The method is plain Newton, without line search, as a finite element code would run it with this formulation's tangent.
The active set is decided anew at each iterate, by the pairing. Only where a tie leaves a singular matrix beside the
solution, the matrix before is taken once more. A solution that does not converge is data, not an error: every iterate
is recorded, `End` says how the iteration ended, and only a plugin that breaks the contract raises an exception.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray, freeze
from contactverif.contract.errors import MisuseError
from contactverif.contract.formulation import Pairing
from contactverif.contract.subject import CheckedFormulation
from contactverif.mechanics.linear import scale_factors
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.system import System


class End(IntEnum):
    """The way in which Newton's method ended. The numbers are those of a report.

    `label` is short, for a table; `advice` says what happened and what to try next.

    Examples
    --------
    >>> from contactverif import End
    >>> End.CYCLE.label
    '2-cycle'
    >>> End.SINGULAR.advice
    'the matrix has no inverse: is anything in contact? Lower a body until it touches'
    """

    CONVERGED = 0
    CYCLE = 1
    STAGNATED = 2
    SINGULAR = 3
    DIVERGED = 4
    EXHAUSTED = 5

    @property
    def label(self) -> str:
        """A few words for a table."""
        return _TEXTS[self][0]

    @property
    def advice(self) -> str:
        """One sentence that says what happened, and what to try next."""
        return _TEXTS[self][1]


_TEXTS = {
    End.CONVERGED: ("converged", "the residual is down to its own roundoff"),
    End.CYCLE: ("2-cycle", "two states and their pairings take turns; move the node that sits on a decision"),
    End.STAGNATED: ("stagnated at roundoff", "the residual stays just above its roundoff; look at cancellation"),
    End.SINGULAR: ("singular", "the matrix has no inverse: is anything in contact? Lower a body until it touches"),
    End.DIVERGED: ("diverged", "the iterates left for infinity; try load steps, or a start nearer to the solution"),
    End.EXHAUSTED: ("out of iterations", "still falling or wandering; try load steps or more iterations"),
}


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """The whole history of a solution by Newton's method, iterate by iterate; `solve` returns it.

    The iterates of all load steps stand in one row. The last entry of each array belongs to the last iterate.

    Attributes
    ----------
    scene : Scene
        The scene that was solved.
    end : End
        How the iteration ended.
    u : FloatArray, shape (n_iterates, n_free + n_multipliers)
        The unknowns: those of the scene, q, and the multipliers behind them.
    factors : FloatArray, shape (n_iterates,)
        The share of loads and imposed displacements, 1 in the last load step.
    residuals : FloatArray, shape (n_iterates,)
        The largest entry of the residual S q − g + R, a force. With multipliers, the constraint rows count too, each
        with the factor that makes it comparable, see `contactverif.mechanics.linear.scale_factors`.
    energies : FloatArray, shape (n_iterates,)
        |Δu · residual| of the step that was taken from the iterate, an energy; NaN at the last iterate.
    floors : FloatArray, shape (n_iterates,)
        The part of the residual that roundoff alone may cause, a force.
    roundings : FloatArray, shape (n_iterates,)
        The largest ratio of an entry of the residual to what roundoff may cause in that entry. Up to 1 is converged.
    changes : IntArray, shape (n_iterates,)
        The number of entries of the pairing that differ from those of the iterate before; −1 where there is no pairing,
        or no iterate before.
    conditions : FloatArray, shape (n_iterates,)
        An estimate of 1/cond of the matrix, 0 where it has no inverse; NaN at the last iterate.
    deficiencies : IntArray, shape (n_iterates,)
        The number of multipliers that were not unique in the step from the iterate; 0 where none was taken.
    pairings : tuple[Pairing | None, ...]
        The pairing at each iterate; None if the formulation has none.
    forces : FloatArray, shape (n_unknowns + n_multipliers,)
        The residual of the formulation alone at the last iterate.

    Examples
    --------
    >>> from contactverif import load_formulation, load_scene, solve
    >>> scene, subject = load_scene("c-prime"), load_formulation("vts-ppt")
    >>> trace = solve(scene, subject.for_case(scene.case()))
    >>> trace.converged, trace.n_iterations, trace.end.label
    (True, 1, 'converged')
    >>> stresses = scene.stresses(trace.solution)  # one array (n_cells, n_points, 3) for each body
    >>> abs(stresses[0][..., 1] + 100.0).max() < 1e-9  # the stress across the interface is minus the pressure
    np.True_
    """

    scene: Scene
    end: End
    u: FloatArray
    factors: FloatArray
    residuals: FloatArray
    energies: FloatArray
    floors: FloatArray
    roundings: FloatArray
    changes: IntArray
    conditions: FloatArray
    deficiencies: IntArray
    pairings: tuple[Pairing | None, ...]
    forces: FloatArray

    @property
    def pairing(self) -> Pairing | None:
        """The pairing at the last iterate."""
        return self.pairings[-1]

    @property
    def converged(self) -> bool:
        """True if the last iterate is a solution."""
        return self.end is End.CONVERGED

    @property
    def n_iterations(self) -> int:
        """The number of linear systems that were solved."""
        return int(np.isfinite(self.energies).sum())

    @property
    def q(self) -> FloatArray:
        """The unknowns of the scene at each iterate (n_iterates, n_free)."""
        return self.u[:, : self.scene.n_free]

    @property
    def solution(self) -> FloatArray:
        """The unknowns of the scene at the last iterate (n_free,)."""
        return np.asarray(self.q[-1])

    @property
    def multipliers(self) -> FloatArray:
        """The multipliers at the last iterate (n_multipliers,)."""
        return self.u[-1, self.scene.n_free :]

    @property
    def deficiency(self) -> int:
        """The largest number of multipliers that were not unique in a step."""
        return int(self.deficiencies.max(initial=0))

    @property
    def z(self) -> FloatArray:
        """The state of the interface at the last iterate: positions (n_unknowns,), then multipliers."""
        return np.concatenate([self.scene.positions(self.solution, float(self.factors[-1])), self.multipliers])


@dataclass(slots=True)
class _Iterate:
    """An entry of each array of a `Trace`."""

    u: FloatArray
    pairings: Pairing | None
    forces: FloatArray
    changes: int
    factors: float
    residuals: float
    floors: float
    roundings: float
    energies: float = np.nan
    conditions: float = np.nan
    deficiencies: int = 0


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
    system = System(scene, formulation, 1.0, use_tangent, difference_step, any_matrix or solution_only)
    keep_matrix = solution_only and not system.n_multipliers
    u = scene.start / load_steps if start is None else np.array(start, dtype=np.float64)
    if u.shape not in ((scene.n_free,), (system.size,)):
        behind = f", or ({system.size},) with multipliers" if system.n_multipliers else ""
        raise MisuseError("start", f"shape {u.shape}", f"shape ({scene.n_free},){behind}")
    if not np.isfinite(u).all():
        raise MisuseError("start", "NaN or infinity", "finite numbers")
    u = np.append(u, np.zeros(system.size - len(u)))
    iterates: list[_Iterate] = []
    for number in range(1, load_steps + 1):
        system.factor = number / load_steps
        end, further = _load_step(system, u, iterations, tolerance, keep_matrix)
        iterates += further
        if end is not End.CONVERGED:
            break
        u = iterates[-1].u
    return _trace(scene, end, iterates)


def _trace(scene: Scene, end: End, iterates: list[_Iterate]) -> Trace:
    def column(name: str) -> list[Any]:
        return [getattr(iterate, name) for iterate in iterates]

    reals = ("u", "factors", "residuals", "energies", "floors", "roundings", "conditions")
    arrays: dict[str, Any] = {name: freeze(np.array(column(name)), np.float64) for name in reals}
    arrays |= {name: freeze(column(name), np.int64) for name in ("changes", "deficiencies")}
    forces = freeze(iterates[-1].forces if iterates else np.zeros(0), np.float64)
    return Trace(scene, end, pairings=tuple(column("pairings")), forces=forces, **arrays)


def _load_step(
    system: System, u: FloatArray, iterations: int, tolerance: float, keep_matrix: bool
) -> tuple[End, list[_Iterate]]:
    """Iterate from u (n,) at the system's load factor; return how that ended and the iterates."""
    iterates: list[_Iterate] = []
    before: Pairing | None = None
    contact: Any = None
    last: Any = None
    n_free, floor = system.scene.n_free, np.zeros(system.size)
    size = float(np.abs(system.scene.interface.nodes).max())
    while True:
        if not np.isfinite(u).all() or np.abs(u[:n_free]).max(initial=0.0) > DIVERGENCE_FACTOR * size:
            return End.DIVERGED, iterates  # No plugin is called for such a state.
        pairing, tangent = system.pair(u), None
        comparable: Any = 1.0
        share = tolerance if iterates else 0.0
        if share > 0 or keep_matrix:  # The last iterate needs no tangent, nor does one that keeps the matrix.
            forces = system.forces(u, pairing)
        else:
            forces, tangent = system.forces_and_tangent(u, pairing)
        residual = system.balance(u, forces)
        balanced = False  # Without any contact force nothing is balanced.
        if share > 0 and not system.n_multipliers:
            largest = float(np.abs(system.transformation.T @ forces).max(initial=0.0))
            balanced = largest > 0 and bool(np.abs(residual).max(initial=0.0) <= share * largest)
        # The matrix is kept while a residual is small enough against the last one of this load step.
        keeps = keep_matrix and bool(iterates)
        keeps = keeps and _largest_rounding(residual, floor) <= iterates[-1].roundings / KEPT_FALL
        if not balanced:
            if not keeps:
                contact = system.contact_stiffness(u, pairing, tangent)
            matrix, floor = system.stiffness + contact, system.floor(u, contact, forces)
            comparable = scale_factors(matrix, n_free)[0] if system.n_multipliers else 1.0
        iterate = _Iterate(
            u,
            pairing,
            forces,
            _count_changes(pairing, before),
            system.factor,
            residuals=float(np.abs(comparable * residual).max(initial=0.0)),
            floors=float((comparable * floor).max(initial=0.0)),
            roundings=_largest_rounding(residual, floor),
        )
        iterates.append(iterate)
        end = End.CONVERGED if balanced else _end(iterates, n_free, keeps=keeps)
        if end is None and len(iterates) > iterations:
            end = End.EXHAUSTED
        if end is not None:
            return end, iterates
        step = system.step(matrix, -residual, floor)
        if step.change is None and last is not None and iterate.roundings <= NEAR_CONVERGENCE:
            # Near the solution of a tie, where the residual is some units of its floor, roundoff decides who faces
            # whom. If that leaves a singular matrix, the one before is as right.
            step = system.step(last, -residual, floor)
        else:
            last = matrix
        iterate.conditions, iterate.deficiencies = step.condition, step.deficiency
        if step.change is None:
            return End.SINGULAR, iterates
        iterate.energies = abs(float(step.change @ residual))
        u, before = u + step.change, pairing


def _largest_rounding(residual: FloatArray, floor: FloatArray) -> float:
    """Return the largest ratio of an entry of the residual (n,) to what roundoff may cause in it."""
    with np.errstate(divide="ignore"):  # An entry without any term has no roundoff: only zero is converged.
        roundings = np.divide(np.abs(residual), floor, where=residual != 0, out=0 * floor)
    return float(roundings.max(initial=0.0))


def _end(iterates: list[_Iterate], n_free: int, *, keeps: bool) -> End | None:
    """Return how a load step has ended, None if it goes on."""
    first, last, roundings = iterates[0], iterates[-1], [iterate.roundings for iterate in iterates]
    # The floor of a matrix that is kept is that of another state, whose forces may be larger. So what still falls fast,
    # `keeps`, is not at rest, however small it is.
    if last.roundings <= (0 if keeps else 1):
        return End.CONVERGED
    if not np.isfinite(last.residuals) or last.residuals > DIVERGENCE_FACTOR * max(first.residuals, first.floors):
        return End.DIVERGED
    q = [iterate.u[:n_free] for iterate in iterates[-5:]]
    if len(q) > 4 and min(roundings[-4:]) > NEAR_CONVERGENCE:
        returns = [np.abs(q[-1 - k] - q[-3 - k]).max() for k in (0, 1)]
        if max(returns) <= 2.0**-20 * np.abs(q[-1] - q[-2]).max():  # Two states alternate.
            return End.CYCLE
    earlier, latest = roundings[:-STAGNATION_ITERATIONS], roundings[-STAGNATION_ITERATIONS:]
    if earlier and min(latest) >= min(earlier) <= NEAR_CONVERGENCE:
        return End.STAGNATED
    return None


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
