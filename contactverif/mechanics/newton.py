"""Newton's method on the unknowns of a scene, with its whole trace. That it does not converge is data, not an error.

No line search: what is traced is the method as a finite element code would run it with this formulation's tangent. With
multipliers the unknowns u are those of the scene, q, and behind them the multipliers: a saddle point. Which constraints
are active is decided anew at each iterate, by the pairing.
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
ROUNDOFF_FACTOR = 8.0  # of a residual: how many units of roundoff of its largest terms count as zero
STAGNATION_ITERATIONS = 4  # iterations without a smaller residual
NEAR_CONVERGENCE = 1e3  # roundoffs above convergence: what stops there is cancellation that we do not know of
DIVERGENCE_FACTOR = 1e8  # times the first residual, or the size of the interface: it will not come back

TIMED_PARTS = ("pair", "residual", "tangent", "solve")  # of the time


class End(IntEnum):
    """How a solution ended. The numbers are those of a report."""

    CONVERGED = 0
    CYCLE = 1
    STAGNATED = 2
    SINGULAR = 3
    DIVERGED = 4
    EXHAUSTED = 5

    @property
    def label(self) -> str:
        """Short, for a table."""
        return _WORDS[self][0]

    @property
    def advice(self) -> str:
        """What happened, and what to try next."""
        return _WORDS[self][1]


_WORDS = {
    End.CONVERGED: ("converged", "the residual is down to its own roundoff"),
    End.CYCLE: ("2-cycle", "two states and their pairings take turns; move the node that sits on a decision"),
    End.STAGNATED: ("stagnated at roundoff", "the residual stays just above its roundoff; look at cancellation"),
    End.SINGULAR: ("singular", "the matrix has no inverse: is anything in contact? Lower a body until it touches"),
    End.DIVERGED: ("diverged", "the iterates left for infinity; try load steps, or a start nearer to the solution"),
    End.EXHAUSTED: ("out of iterations", "still falling or wandering; try load steps or more iterations"),
}


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """A solution, iterate by iterate; all iterates of all load steps in one row.

    Attributes
    ----------
    scene : Scene
        What was solved.
    end : End
        How it ended.
    u : FloatArray, shape (n_iterates, n_free + n_multipliers)
        Unknowns: those of the scene, and multipliers behind them.
    factors : FloatArray, shape (n_iterates,)
        Share of loads and imposed displacements, 1 at the last load step.
    residuals : FloatArray, shape (n_iterates,)
        Largest entry of S q − g + R, a force; where there are multipliers, of the constraint rows too, each
        with the factor that makes it comparable (`linear.scale_factors`).
    energies : FloatArray, shape (n_iterates,)
        |Δq · residual| of the step that was taken from there, an energy; NaN at the last.
    floors : FloatArray, shape (n_iterates,)
        What roundoff alone makes of the residual, a force.
    roundings : FloatArray, shape (n_iterates,)
        Largest entry of the residual over what roundoff makes of that entry; up to 1 is converged.
    changes : IntArray, shape (n_iterates,)
        Entries of the pairing that differ from the iterate before; −1 where there is no pairing or none before.
    conditions : FloatArray, shape (n_iterates,)
        Estimate of 1/cond of the matrix, 0 where it has no inverse; NaN at the last.
    deficiencies : IntArray, shape (n_iterates,)
        How many multipliers were not unique in the step from there, 0 where none was taken.
    seconds : dict[str, float]
        {"pair", "residual", "tangent", "solve"}: time spent in each.
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
        """Whether the last iterate is a solution."""
        return self.end is End.CONVERGED

    @property
    def n_iterations(self) -> int:
        """Linear systems solved."""
        return int(np.isfinite(self.energies).sum())

    @property
    def q(self) -> FloatArray:
        """The unknowns of the scene (n_iterates, n_free)."""
        return self.u[:, : self.scene.n_free]

    @property
    def solution(self) -> FloatArray:
        """The unknowns of the scene at the last iterate (n_free,)."""
        last: FloatArray = self.q[-1]
        return last

    @property
    def multipliers(self) -> FloatArray:
        """At the last iterate (n_multipliers,)."""
        last: FloatArray = self.u[-1, self.scene.n_free :]
        return last

    @property
    def deficiency(self) -> int:
        """How many multipliers were not unique, in any step."""
        return int(self.deficiencies.max(initial=0))

    @property
    def z(self) -> FloatArray:
        """The state of the interface at the last iterate: positions (n_unknowns,), multipliers behind them."""
        return np.concatenate([self.scene.positions(self.solution, float(self.factors[-1])), self.multipliers])


@dataclass(slots=True)
class System:
    """The equations S q − g + R(z(u)) = 0 of a scene and a formulation, and what evaluating them costs."""

    scene: Scene
    formulation: CheckedFormulation
    factor: float = 1.0
    use_tangent: bool = True
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
        """Number of unknowns u."""
        return self.scene.n_free + self.n_multipliers

    def state(self, u: FloatArray) -> FloatArray:
        """What a formulation is asked about: positions, multipliers behind them."""
        n_free = self.scene.n_free
        return np.concatenate([self.scene.positions(u[:n_free], self.factor), u[n_free:]])

    def pair(self, u: FloatArray) -> Pairing | None:
        """Who touches whom at u."""
        start = perf_counter()
        pairing = self.formulation.pair(self.scene.interface, self.state(u))
        self.seconds["pair"] += perf_counter() - start
        return pairing

    def residual(self, u: FloatArray, pairing: Pairing | None) -> FloatArray:
        """(n,) forces that are not in balance, and constraints that are not met."""
        start = perf_counter()
        n_free = self.scene.n_free
        forces = self.formulation.residual(self.scene.interface, pairing, self.state(u))
        residual: FloatArray = self.transformation.T @ forces
        residual[:n_free] += self.scene.bulk_forces(u[:n_free], self.factor)
        self.seconds["residual"] += perf_counter() - start
        return residual

    def matrix(self, u: FloatArray, pairing: Pairing | None) -> tuple[Any, FloatArray]:
        """Derivative (n, n) of the residual, and what the roundoff of positions and forces makes of the residual (n,).

        A formulation without a tangent is differentiated on the frozen pairing.
        """
        start = perf_counter()
        scene, n_free, z = self.scene, self.scene.n_free, self.state(u)
        if self.use_tangent and "tangent" in self.formulation.provides:
            tangent = self.formulation.tangent(scene.interface, pairing, z)
        else:
            tangent = self.differences(pairing, z)
        tangent = dense(tangent) if isinstance(self.transformation, np.ndarray) else sparse.csr_array(tangent)
        contact = self.transformation.T @ tangent @ self.transformation
        matrix = self.stiffness + contact
        # a gap is rounded like the largest coordinate, also where the node that it is measured from moves no force
        sizes = np.full(self.size, np.abs(z[: scene.interface.n_unknowns]).max())
        sizes[n_free:] = np.abs(u[n_free:]).max(initial=0.0)  # also of one that is let go
        # and a force along an inclined normal is rounded in both of its components
        forces = abs(self.transformation).T @ np.abs(self.formulation.residual(scene.interface, pairing, z))
        terms = abs(contact) @ sizes + forces
        terms[:n_free] += abs(scene.stiffness) @ np.abs(u[:n_free]) + self.factor * np.abs(scene.load)
        self.seconds["tangent"] += perf_counter() - start
        return matrix, ROUNDOFF_FACTOR * UNIT_ROUNDOFF * terms

    def step(self, matrix: Any, right: FloatArray, floor: FloatArray | None = None) -> linear.Step:
        """The solution of matrix · step = right; `floor` (n,) is what roundoff makes of the right-hand side."""
        start = perf_counter()
        step = linear.solve_step(matrix, right, self.scene.n_free, floor)
        self.seconds["solve"] += perf_counter() - start
        return step

    def differences(self, pairing: Pairing | None, z: FloatArray) -> FloatArray:
        """Derivative (n_unknowns, n_unknowns) of the contact forces at the state z, by central differences."""
        n_positions = self.scene.interface.n_unknowns
        positions, multipliers = z[:n_positions], z[n_positions:]
        shortest = min(side.lengths(positions.reshape(-1, 2)).min() for side in self._sides())
        steps = np.full(z.size, shortest * (UNIT_ROUNDOFF * np.abs(positions).max() / shortest) ** (1 / 3))
        if len(multipliers):  # all is linear in them: a step as large as they are, or as the bodies are stiff
            steps[n_positions:] = max(np.abs(multipliers).max(), abs(self.scene.stiffness).max(initial=1.0))
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
) -> Trace:
    """Solve the scene with full Newton steps, in one load step unless more are asked for.

    Parameters
    ----------
    formulation : CheckedFormulation
        With its penalty, `subject.for_case(case)` or `subject.with_penalty(…)`.
    start : FloatArray | None, shape (n_free,)
        First iterate, or (n_free + n_multipliers,); the scene's own by default, and no multipliers.
    load_steps : int
        Loads and imposed displacements grow in that many equal steps, each solved from the one before.
    iterations : int
        Linear systems solved at most, in each load step.
    use_tangent : bool
        The formulation's, if it has one; else its residual is differentiated on the frozen pairing.

    Raises
    ------
    ContractError
        What the plugin raises or breaks.
    """
    if load_steps < 1 or iterations < 1:
        name, number = ("load_steps", load_steps) if load_steps < 1 else ("iterations", iterations)
        raise MisuseError(name, f"{number}", "at least 1")
    system, record = System(scene, formulation, use_tangent=use_tangent), _Record()
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
        end, u = _load_step(system, record, u, iterations)
        if end is not End.CONVERGED:
            break
    return record.trace(scene, end, system.seconds)


def _load_step(system: System, record: _Record, u: FloatArray, iterations: int) -> tuple[End, FloatArray]:
    first, before, n_free = len(record.u), None, system.scene.n_free
    size = float(np.abs(system.scene.interface.nodes).max())
    for iteration in range(iterations + 1):
        if not (np.isfinite(u).all() and np.abs(u[:n_free]).max(initial=0.0) <= DIVERGENCE_FACTOR * size):
            return End.DIVERGED, u  # no plugin is asked about such a state
        pairing = system.pair(u)
        residual = system.residual(u, pairing)
        matrix, floor = system.matrix(u, pairing)
        comparable = linear.scale_factors(matrix, n_free)[0] if system.n_multipliers else 1.0
        record.add(u, system.factor, residual, floor, comparable, _changed(pairing, before))
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
    raise AssertionError("the loop ends by itself")


@dataclass(slots=True)
class _Record:
    """A trace in the making."""

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
        with np.errstate(divide="ignore"):  # an entry without any term has no roundoff, and nothing but zero will do
            roundings = np.divide(np.abs(residual), floor, where=residual != 0, out=0 * floor)
        self.roundings.append(float(roundings.max(initial=0.0)))
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
    """What the iterates of a load step, which begin at `first`, say about its end; None to go on."""
    residuals, roundings = record.residuals[first:], record.roundings[first:]
    q = [u[:n_free] for u in record.u[first:]]
    if roundings[-1] <= 1:
        return End.CONVERGED
    if not np.isfinite(residuals[-1]) or residuals[-1] > DIVERGENCE_FACTOR * max(residuals[0], record.floors[first]):
        return End.DIVERGED
    if len(q) > 4:
        back, steps = [np.abs(q[-1 - k] - q[-3 - k]).max() for k in (0, 1)], np.abs(q[-1] - q[-2]).max()
        if max(back) <= 2.0**-20 * steps and min(roundings[-4:]) > NEAR_CONVERGENCE:
            return End.CYCLE
    earlier, latest = roundings[:-STAGNATION_ITERATIONS], roundings[-STAGNATION_ITERATIONS:]
    if earlier and min(latest) >= min(earlier) <= NEAR_CONVERGENCE:
        return End.STAGNATED
    return None


def _changed(pairing: Pairing | None, before: Pairing | None) -> int:
    """Entries that differ, or all of them where shapes do."""
    if pairing is None or before is None:
        return -1
    return sum(
        int((values != before[name]).sum()) if name in before and before[name].shape == values.shape else values.size
        for name, values in pairing.items()
    )
