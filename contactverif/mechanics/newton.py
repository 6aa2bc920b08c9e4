"""Newton's method on the unknowns of a scene, with its whole trace.

The method is plain Newton, without line search, as a finite element code would run it with this formulation's tangent.
The active set is decided anew at each iterate, by the pairing. With multipliers the unknowns u are those of the scene,
q, and the multipliers behind them; the system is a saddle point.

Rule for the next editor: a solution that does not converge is data, not an error. Every iterate is recorded, `End` says
how the iteration ended, and only a plugin that breaks the contract raises an exception.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from time import perf_counter
from typing import Any

import numpy as np
from scipy import linalg, sparse

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray, dense, freeze
from contactverif.contract.errors import MisuseError
from contactverif.contract.formulation import Pairing
from contactverif.contract.subject import CheckedFormulation
from contactverif.mechanics import linear
from contactverif.mechanics.scene import Scene

MAX_ITERATIONS = 40
ROUNDOFF_FACTOR = 8.0  # A residual is zero if it is at most this many units of roundoff of its largest terms.
STAGNATION_ITERATIONS = 4  # Newton's method stagnates if the residual has not decreased in so many iterations.
# A residual within this factor of the roundoff that counts as converged is nearly converged: cancellation that the
# bound does not know of may keep it there.
NEAR_CONVERGENCE = 1e3
# Newton has diverged once the residual exceeds the first one, or the iterate the size of the interface, by this factor.
DIVERGENCE_FACTOR = 1e8
KEPT_FALL = 16.0  # A matrix may be kept while each iteration makes the residual at least this many times smaller.

TIMED_PARTS = ("pair", "residual", "tangent", "solve")


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
    seconds : dict[str, float]
        The time spent in "pair", "residual", "tangent" and "solve".

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
    seconds: dict[str, float]

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
        last: FloatArray = self.q[-1]
        return last

    @property
    def multipliers(self) -> FloatArray:
        """The multipliers at the last iterate (n_multipliers,)."""
        last: FloatArray = self.u[-1, self.scene.n_free :]
        return last

    @property
    def deficiency(self) -> int:
        """The largest number of multipliers that were not unique in a step."""
        return int(self.deficiencies.max(initial=0))

    @property
    def z(self) -> FloatArray:
        """The state of the interface at the last iterate: positions (n_unknowns,), then multipliers."""
        return np.concatenate([self.scene.positions(self.solution, float(self.factors[-1])), self.multipliers])


@dataclass(slots=True)
class System:
    """The equations S q − g + R(z(u)) = 0 of a scene and a formulation.

    S is the stiffness of the bodies, g their load, and R the contact forces on the unknowns. The scene's symbols are
    those of `contactverif.mechanics.scene`.

    Attributes
    ----------
    scene : Scene
        The bodies.
    formulation : CheckedFormulation
        The formulation with its penalty.
    factor : float
        The share of loads and imposed displacements.
    use_tangent : bool
        False differentiates the residual on the frozen pairing, even if the formulation has a tangent.
    difference_step : float | None
        The step of differences in positions, a length; None for the one that suits smooth residuals.
    seconds : dict[str, float]
        The time spent in "pair", "residual", "tangent" and "solve" so far.
    n_multipliers : int
        The number of multipliers of the formulation on the scene's interface.
    transformation : FloatArray or scipy.sparse array, shape (n_unknowns + n_multipliers, n)
        The scene's transformation from unknowns to positions, with the multipliers behind both.
    stiffness : FloatArray or scipy.sparse array, shape (n, n)
        The scene's stiffness, 0 for multipliers.
    """

    scene: Scene
    formulation: CheckedFormulation
    factor: float = 1.0
    use_tangent: bool = True
    difference_step: float | None = None
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(TIMED_PARTS, 0.0))
    n_multipliers: int = field(init=False)
    transformation: Any = field(init=False)
    stiffness: Any = field(init=False)

    def __post_init__(self) -> None:
        scene, count = self.scene, self.formulation.n_multipliers(self.scene.interface)
        self.n_multipliers, self.transformation, self.stiffness = count, scene.transformation, scene.stiffness
        if count:
            if isinstance(scene.transformation, np.ndarray):
                self.transformation = linalg.block_diag(scene.transformation, np.eye(count))
                self.stiffness = linalg.block_diag(scene.stiffness, np.zeros((count, count)))
            else:
                unit, nothing = sparse.eye_array(count), sparse.csr_array((count, count))
                self.transformation = sparse.csr_array(sparse.block_diag([scene.transformation, unit]))
                self.stiffness = sparse.csr_array(sparse.block_diag([scene.stiffness, nothing]))

    @property
    def size(self) -> int:
        """The number n of unknowns u: n_free + n_multipliers."""
        return self.scene.n_free + self.n_multipliers

    def state(self, u: FloatArray) -> FloatArray:
        """Return the state z that a formulation gets at the unknowns u (n,): positions, then multipliers."""
        n_free = self.scene.n_free
        return np.concatenate([self.scene.positions(u[:n_free], self.factor), u[n_free:]])

    def pair(self, u: FloatArray) -> Pairing | None:
        """Return the pairing at the unknowns u (n,), None if the formulation has none."""
        start = perf_counter()
        pairing = self.formulation.pair(self.scene.interface, self.state(u))
        self.seconds["pair"] += perf_counter() - start
        return pairing

    def forces(self, u: FloatArray, pairing: Pairing | None) -> FloatArray:
        """Return the residual of the formulation alone, (n_unknowns + n_multipliers,), at the unknowns u (n,)."""
        start = perf_counter()
        forces = self.formulation.residual(self.scene.interface, pairing, self.state(u))
        self.seconds["residual"] += perf_counter() - start
        return forces

    def tangent(self, u: FloatArray, pairing: Pairing | None) -> Any:
        """Return the derivative of `forces` at the unknowns u (n,); differences where it must not ask for a tangent."""
        start, z = perf_counter(), self.state(u)
        if self._asks_tangent:
            tangent = self.formulation.tangent(self.scene.interface, pairing, z)
        else:
            tangent = self.differences(pairing, z)
        self.seconds["tangent"] += perf_counter() - start
        return tangent

    def forces_and_tangent(
        self, u: FloatArray, pairing: Pairing | None, *, later: bool = False
    ) -> tuple[FloatArray, Any]:
        """Return `forces` and `tangent` at the unknowns u (n,), in one call where the formulation offers that.

        The time of one call counts as that of the tangent, which is the larger part. With `later`, the tangent is None:
        it may not be needed.
        """
        if later:
            return self.forces(u, pairing), None
        if not (self._asks_tangent and "residual_and_tangent" in self.formulation.provides):
            return self.forces(u, pairing), self.tangent(u, pairing)
        start = perf_counter()
        both = self.formulation.residual_and_tangent(self.scene.interface, pairing, self.state(u))
        self.seconds["tangent"] += perf_counter() - start
        return both

    @property
    def _asks_tangent(self) -> bool:
        return self.use_tangent and "tangent" in self.formulation.provides

    def residual(self, u: FloatArray, pairing: Pairing | None) -> FloatArray:
        """Return the residual (n,) at the unknowns u (n,): forces out of balance, then constraint rows."""
        return self.balance(u, self.forces(u, pairing))

    def balance(self, u: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the residual (n,) at the unknowns u (n,) where the formulation returns these forces."""
        start, n_free = perf_counter(), self.scene.n_free
        residual: FloatArray = self.transformation.T @ forces
        residual[:n_free] += self.scene.bulk_forces(u[:n_free], self.factor)
        self.seconds["residual"] += perf_counter() - start
        return residual

    def is_balanced(self, residual: FloatArray, forces: FloatArray, tolerance: float) -> bool:
        """Return whether a residual (n,) is at most `tolerance` of the largest contact force; False with multipliers.

        Without any contact force nothing is balanced. `forces` are those of the formulation at the same unknowns.
        """
        if self.n_multipliers or tolerance == 0:
            return False
        largest = float(np.abs(self.transformation.T @ forces).max(initial=0.0))
        return bool(largest > 0 and np.abs(residual).max(initial=0.0) <= tolerance * largest)

    def matrix(self, u: FloatArray, pairing: Pairing | None) -> tuple[Any, FloatArray]:
        """Return the derivative of the residual, and the part of the residual that roundoff alone may cause.

        The residual of a formulation without a tangent is differentiated on the frozen pairing.

        Parameters
        ----------
        u : FloatArray, shape (n,)
            The unknowns.
        pairing : Pairing | None
            The frozen pairing.

        Returns
        -------
        matrix : FloatArray or scipy.sparse array, shape (n, n)
            The derivative.
        floor : FloatArray, shape (n,)
            The effect of the roundoff of positions and forces on each entry of the residual.
        """
        return self.assemble(u, pairing, *self.forces_and_tangent(u, pairing))

    def assemble(
        self, u: FloatArray, pairing: Pairing | None, forces: FloatArray, tangent: Any
    ) -> tuple[Any, FloatArray]:
        """Return what `matrix` does, with the `forces` and the `tangent` at the unknowns u (n,); None asks for that."""
        contact = self.contact_stiffness(u, pairing, tangent)
        return self.stiffness + contact, self.floor(u, contact, forces)

    def contact_stiffness(self, u: FloatArray, pairing: Pairing | None, tangent: Any) -> Any:
        """Return the derivative (n, n) of the contact forces on the unknowns, of a `tangent`; None asks for that."""
        tangent = self.tangent(u, pairing) if tangent is None else tangent
        start = perf_counter()
        tangent = dense(tangent) if isinstance(self.transformation, np.ndarray) else sparse.csr_array(tangent)
        contact = self.transformation.T @ tangent @ self.transformation
        self.seconds["tangent"] += perf_counter() - start
        return contact

    def floor(self, u: FloatArray, contact: Any, forces: FloatArray) -> FloatArray:
        """Return the part of the residual (n,) that roundoff of positions and forces alone may cause.

        Parameters
        ----------
        u : FloatArray, shape (n,)
            The unknowns.
        contact : FloatArray or scipy.sparse array, shape (n, n)
            The derivative of the contact forces there, or nearby.
        forces : FloatArray, shape (n_unknowns + n_multipliers,)
            The contact forces.
        """
        start = perf_counter()
        scene, n_free = self.scene, self.scene.n_free
        # A gap is rounded like the largest coordinate, even where the node that it is measured from moves no force.
        largest = np.abs(scene.positions(u[:n_free], self.factor)).max()
        sizes = np.full(self.size, largest)
        sizes[n_free:] = np.abs(u[n_free:]).max(initial=0.0)  # This includes multipliers that become inactive.
        # A force along an inclined normal is rounded in both of its components.
        terms = abs(contact) @ sizes + abs(self.transformation).T @ np.abs(forces)
        # A displacement below uX moves no node. Displacements of a body that nothing presses shrink by 1e-16 in each
        # iteration, and so do its forces: counted over those displacements alone, they would never be small.
        displacements = np.maximum(np.abs(u[:n_free]), UNIT_ROUNDOFF * largest)
        terms[:n_free] += abs(scene.stiffness) @ displacements + self.factor * np.abs(scene.load)
        self.seconds["tangent"] += perf_counter() - start
        floor: FloatArray = ROUNDOFF_FACTOR * UNIT_ROUNDOFF * terms
        return floor

    def row_factors(self, matrix: Any) -> FloatArray | float:
        """Return the factors (n,) that make constraint rows comparable with forces; 1 without multipliers."""
        return linear.scale_factors(matrix, self.scene.n_free)[0] if self.n_multipliers else 1.0

    def step(self, matrix: Any, right: FloatArray, floor: FloatArray | None = None) -> linear.Step:
        """Solve matrix · step = right; roundoff alone may cause `floor` (n,) of the right-hand side."""
        start = perf_counter()
        step = linear.solve_step(matrix, right, self.scene.n_free, floor)
        self.seconds["solve"] += perf_counter() - start
        return step

    def differences(self, pairing: Pairing | None, z: FloatArray) -> FloatArray:
        """Return the derivative (n_unknowns, n_unknowns) of the contact forces at z, by central differences."""
        n_positions = self.scene.interface.n_unknowns
        positions, multipliers = z[:n_positions], z[n_positions:]
        shortest = min(side.lengths(positions.reshape(-1, 2)).min() for side in self._sides())
        smooth = shortest * (UNIT_ROUNDOFF * np.abs(positions).max() / shortest) ** (1 / 3)
        steps = np.full(z.size, smooth if self.difference_step is None else self.difference_step)
        if len(multipliers):  # The residual is linear in them: a step of their size, or of the bodies' stiffness.
            size = np.abs(multipliers).max() or (abs(self.scene.stiffness).max() if self.scene.n_free else 0.0)
            steps[n_positions:] = size or 1.0
        shifts = np.diag(steps)
        states = np.concatenate([z + shifts, z - shifts])
        forces = self.formulation.residual(self.scene.interface, pairing, states)
        derivative: FloatArray = (forces[: z.size] - forces[z.size :]).T / (2 * steps)
        return derivative

    def _sides(self) -> tuple[Any, Any]:
        return self.scene.interface.slave, self.scene.interface.master


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
    keep_matrix: bool = False,
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
    keep_matrix : bool
        True keeps the matrix while each iteration makes the residual `KEPT_FALL` times smaller: for whoever asks for
        the solution alone. The same residual decides about convergence. It does not apply to multipliers, since the
        matrix says which of them are active.

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
    system, record = System(scene, formulation, use_tangent=use_tangent, difference_step=difference_step), _Record()
    keep_matrix = keep_matrix and not system.n_multipliers
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
    return record.trace(scene, end, system.seconds)


def _load_step(
    system: System, record: _Record, u: FloatArray, iterations: int, tolerance: float, keep_matrix: bool
) -> tuple[End, FloatArray]:
    """Iterate from u (n,) at the system's load factor; return how that ended and the last iterate."""
    first, before, n_free = len(record.u), None, system.scene.n_free
    contact: Any = None
    floor = np.zeros(system.size)
    size = float(np.abs(system.scene.interface.nodes).max())
    for iteration in range(iterations + 1):
        if not _is_near(u[:n_free], u, size):
            return End.DIVERGED, u  # No plugin is called for such a state.
        pairing = system.pair(u)
        share = tolerance * (iteration > 0)
        # The last iterate needs no tangent, nor does one that keeps the matrix.
        forces, tangent = system.forces_and_tangent(u, pairing, later=share > 0 or keep_matrix)
        residual = system.balance(u, forces)
        changes = _count_changes(pairing, before)
        if system.is_balanced(residual, forces, share):
            record.add(u, system.factor, residual, floor, 1.0, changes)
            return End.CONVERGED, u
        if not (keep_matrix and _falls_fast(record, first, residual, floor)):
            contact = system.contact_stiffness(u, pairing, tangent)
        matrix, floor = system.stiffness + contact, system.floor(u, contact, forces)
        comparable = system.row_factors(matrix)
        record.add(u, system.factor, residual, floor, comparable, changes)
        end = _end(record, first, n_free)
        if end is not None:
            return end, u
        if iteration == iterations:
            return End.EXHAUSTED, u
        step = system.step(matrix, -residual, floor)
        record.conditions[-1], record.deficiencies[-1] = step.condition, step.deficiency
        if step.change is None:
            return End.SINGULAR, u
        record.energies[-1] = abs(float(step.change @ residual))
        u, before = u + step.change, pairing
    raise AssertionError("the loop returns")


def _is_near(q: FloatArray, u: FloatArray, size: float) -> bool:
    """Return whether the unknowns u are finite, and the displacements q no longer than the interface many times."""
    return bool(np.isfinite(u).all() and np.abs(q).max(initial=0.0) <= DIVERGENCE_FACTOR * size)


def _falls_fast(record: _Record, first: int, residual: FloatArray, floor: FloatArray) -> bool:
    """Return whether a residual (n,) is small enough against the last one of this load step to keep the matrix."""
    return len(record.u) > first and _largest_rounding(residual, floor) <= record.roundings[-1] / KEPT_FALL


def _largest_rounding(residual: FloatArray, floor: FloatArray) -> float:
    """Return the largest ratio of an entry of the residual (n,) to what roundoff may cause in it."""
    with np.errstate(divide="ignore"):  # An entry without any term has no roundoff: only zero is converged.
        roundings = np.divide(np.abs(residual), floor, where=residual != 0, out=0 * floor)
    return float(roundings.max(initial=0.0))


@dataclass(slots=True)
class _Record:
    """The trace of a solution that is still running."""

    u: list[FloatArray] = field(default_factory=list)
    factors: list[float] = field(default_factory=list)
    residuals: list[float] = field(default_factory=list)
    energies: list[float] = field(default_factory=list)
    floors: list[float] = field(default_factory=list)
    roundings: list[float] = field(default_factory=list)
    changes: list[int] = field(default_factory=list)
    conditions: list[float] = field(default_factory=list)
    deficiencies: list[int] = field(default_factory=list)

    def add(
        self, u: FloatArray, factor: float, residual: FloatArray, floor: FloatArray, comparable: Any, changes: int
    ) -> None:
        self.u.append(u)
        self.factors.append(factor)
        self.residuals.append(float(np.abs(comparable * residual).max(initial=0.0)))
        self.floors.append(float((comparable * floor).max(initial=0.0)))
        self.roundings.append(_largest_rounding(residual, floor))
        self.changes.append(changes)
        self.energies.append(np.nan)
        self.conditions.append(np.nan)
        self.deficiencies.append(0)

    def trace(self, scene: Scene, end: End, seconds: dict[str, float]) -> Trace:
        return Trace(
            scene=scene,
            end=end,
            u=freeze(np.array(self.u), np.float64),
            factors=freeze(self.factors, np.float64),
            residuals=freeze(self.residuals, np.float64),
            energies=freeze(self.energies, np.float64),
            floors=freeze(self.floors, np.float64),
            roundings=freeze(self.roundings, np.float64),
            changes=freeze(self.changes, np.int64),
            conditions=freeze(self.conditions, np.float64),
            deficiencies=freeze(self.deficiencies, np.int64),
            seconds=seconds,
        )


def _end(record: _Record, first: int, n_free: int) -> End | None:
    """Return how the load step whose iterates begin at number `first` has ended, None if it goes on."""
    residuals, roundings = record.residuals[first:], record.roundings[first:]
    if roundings[-1] <= 1:
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
    return sum(
        int((values != before[name]).sum()) if name in before and before[name].shape == values.shape else values.size
        for name, values in pairing.items()
    )
