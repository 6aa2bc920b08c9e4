"""Newton's method on the unknowns of a scene, with its whole trace. That it does not converge is data, not an error.

No line search: what is traced is the method as a finite element code would run it with this formulation's tangent.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from time import perf_counter
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.linalg import LinearOperator, onenormest, splu

from contactverif.arrays import UNIT_ROUNDOFF, FloatArray, IntArray, frozen
from contactverif.errors import MisuseError
from contactverif.formulation import Pairing
from contactverif.scene import Scene
from contactverif.subject import Guarded

ITERATIONS = 40
ROUNDINGS = 8.0  # of a residual: how many units of roundoff of its largest terms count as zero
STALLED = 4  # iterations without a smaller residual
NEARLY = 1e3  # roundoffs above convergence: what stops there is cancellation that we do not know of
GONE = 1e8  # times the first residual, or the size of the interface: it will not come back

PARTS = ("pair", "residual", "tangent", "solve")  # of the time


class End(IntEnum):
    """How a solution ended. The numbers are those of a report."""

    CONVERGED = 0
    CYCLE = 1
    STAGNATED = 2
    SINGULAR = 3
    DIVERGED = 4
    EXHAUSTED = 5

    @property
    def words(self) -> str:
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
    scene : what was solved.
    end : how it ended.
    q : (n_iterates, n_free) unknowns.
    factors : (n_iterates,) share of loads and imposed displacements, 1 at the last load step.
    residuals : (n_iterates,) largest entry of S q − g + R, a force.
    energies : (n_iterates,) |Δq · residual| of the step that was taken from there, an energy; NaN at the last.
    floors : (n_iterates,) what roundoff alone makes of the residual, a force.
    roundings : (n_iterates,) largest entry of the residual over what roundoff makes of that entry; up to 1 is
        converged.
    changes : (n_iterates,) entries of the pairing that differ from the iterate before; −1 where there is no pairing
        or none before.
    conditions : (n_iterates,) estimate of 1/cond of the matrix, 0 where it has no inverse; NaN at the last.
    seconds : {"pair", "residual", "tangent", "solve"}: time spent in each.
    """

    scene: Scene
    end: End
    q: FloatArray
    factors: FloatArray
    residuals: FloatArray
    energies: FloatArray
    floors: FloatArray
    roundings: FloatArray
    changes: IntArray
    conditions: FloatArray
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
    def solution(self) -> FloatArray:
        """The last iterate (n_free,)."""
        last: FloatArray = self.q[-1]
        return last

    @property
    def z(self) -> FloatArray:
        """Positions (n_unknowns,) of the interface at the last iterate."""
        return self.scene.positions(self.solution, float(self.factors[-1]))


@dataclass(slots=True)
class System:
    """The equations S q − g + R(z(q)) = 0 of a scene and a formulation, and what evaluating them costs."""

    scene: Scene
    formulation: Guarded
    factor: float = 1.0
    own_tangent: bool = True
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(PARTS, 0.0))

    def pair(self, q: FloatArray) -> Pairing | None:
        """Who touches whom at q."""
        start = perf_counter()
        pairing = self.formulation.pair(self.scene.interface, self.scene.positions(q, self.factor))
        self.seconds["pair"] += perf_counter() - start
        return pairing

    def residual(self, q: FloatArray, pairing: Pairing | None) -> FloatArray:
        """(n_free,) forces that are not in balance."""
        start = perf_counter()
        scene = self.scene
        contact = self.formulation.residual(scene.interface, pairing, scene.positions(q, self.factor))
        residual: FloatArray = scene.bulk_forces(q, self.factor) + scene.spread.T @ contact
        self.seconds["residual"] += perf_counter() - start
        return residual

    def matrix(self, q: FloatArray, pairing: Pairing | None) -> tuple[Any, FloatArray]:
        """S + ∂R/∂q (n_free, n_free), and what the roundoff of positions and forces makes of the residual (n_free,).

        A formulation without a tangent is differentiated on the frozen pairing.
        """
        start = perf_counter()
        scene, spread = self.scene, self.scene.spread
        z = scene.positions(q, self.factor)
        if self.own_tangent and "tangent" in self.formulation.provides:
            tangent = self.formulation.tangent(scene.interface, pairing, z)
        else:
            tangent = self.differences(pairing, z)
        if isinstance(spread, np.ndarray):
            tangent = tangent.toarray() if sparse.issparse(tangent) else tangent
        else:
            tangent = sparse.csr_array(tangent)
        contact = spread.T @ tangent @ spread
        matrix = scene.stiffness + contact
        bulk = abs(scene.stiffness) @ np.abs(q) + self.factor * np.abs(scene.load)
        # a gap is rounded like the largest coordinate, also where the node that it is measured from moves no force
        springs = np.asarray(abs(contact).sum(axis=1)).reshape(-1) * np.abs(z).max(initial=0.0)
        # and a force along an inclined normal is rounded in both of its components
        forces = abs(spread).T @ np.abs(self.formulation.residual(scene.interface, pairing, z))
        floor = ROUNDINGS * UNIT_ROUNDOFF * (bulk + springs + forces)
        self.seconds["tangent"] += perf_counter() - start
        return matrix, floor

    def step(self, matrix: Any, residual: FloatArray) -> tuple[FloatArray | None, float]:
        """The Newton step, None where the matrix has no inverse in floats, and an estimate of 1/cond."""
        start = perf_counter()
        solve = _dense_step if isinstance(matrix, np.ndarray) else _sparse_step
        step, condition = solve(matrix, residual)
        self.seconds["solve"] += perf_counter() - start
        if condition <= UNIT_ROUNDOFF * len(residual) or step is None or not np.isfinite(step).all():
            return None, condition
        return step, condition

    def differences(self, pairing: Pairing | None, z: FloatArray) -> FloatArray:
        """Derivative (n_unknowns, n_unknowns) of the contact forces at the positions z, by central differences."""
        shortest = min(side.lengths(z.reshape(-1, 2)).min() for side in self._sides())
        h = shortest * (UNIT_ROUNDOFF * np.abs(z).max() / shortest) ** (1 / 3)
        shifts = h * np.eye(z.size)
        states = np.concatenate([z + shifts, z - shifts])
        forces = self.formulation.residual(self.scene.interface, pairing, states)
        derivative: FloatArray = (forces[: z.size] - forces[z.size :]).T / (2 * h)
        return derivative

    def _sides(self) -> tuple[Any, Any]:
        return self.scene.interface.slave, self.scene.interface.master


def solve(
    scene: Scene,
    formulation: Guarded,
    *,
    start: FloatArray | None = None,
    load_steps: int = 1,
    iterations: int = ITERATIONS,
    own_tangent: bool = True,
) -> Trace:
    """Solve the scene with full Newton steps, in one load step unless more are asked for.

    Parameters
    ----------
    formulation : with its penalty, `subject.on(case)` or `subject.with_penalty(…)`.
    start : (n_free,) first iterate; the scene's own by default.
    load_steps : loads and imposed displacements grow in that many equal steps, each solved from the one before.
    iterations : linear systems solved at most, in each load step.
    own_tangent : the formulation's, if it has one; else its residual is differentiated on the frozen pairing.

    Raises
    ------
    ContractError : what the plugin raises or breaks.
    """
    if load_steps < 1 or iterations < 1:
        name, number = ("load_steps", load_steps) if load_steps < 1 else ("iterations", iterations)
        raise MisuseError(name, f"{number}", "at least 1")
    system, record = System(scene, formulation, own_tangent=own_tangent), _Record()
    q = scene.start / load_steps if start is None else np.array(start, dtype=np.float64)
    if q.shape != (scene.n_free,):
        raise MisuseError("start", f"shape {q.shape}", f"shape ({scene.n_free},)")
    if not np.isfinite(q).all():
        raise MisuseError("start", "NaN or infinity", "finite numbers")
    end = End.CONVERGED
    for number in range(1, load_steps + 1):
        system.factor = number / load_steps
        end, q = _load_step(system, record, q, iterations)
        if end is not End.CONVERGED:
            break
    return record.trace(scene, end, system.seconds)


def _load_step(system: System, record: _Record, q: FloatArray, iterations: int) -> tuple[End, FloatArray]:
    first, before = len(record.q), None
    size = float(np.abs(system.scene.interface.nodes).max())
    for iteration in range(iterations + 1):
        if not np.abs(q).max(initial=0.0) <= GONE * size:  # no plugin is asked about such a state
            return End.DIVERGED, q
        pairing = system.pair(q)
        residual = system.residual(q, pairing)
        matrix, floor = system.matrix(q, pairing)
        record.add(q, system.factor, residual, floor, _changed(pairing, before))
        end = _end(record, first)
        if end is not None:
            return end, q
        if iteration == iterations:
            return End.EXHAUSTED, q
        step, condition = system.step(matrix, -residual)
        record.conditions[-1] = condition
        if step is None:
            return End.SINGULAR, q
        record.energies[-1] = abs(float(step @ residual))
        q, before = q + step, pairing
    raise AssertionError("the loop ends by itself")


@dataclass(slots=True)
class _Record:
    """A trace in the making."""

    q: list[FloatArray] = field(default_factory=list)
    factors: list[float] = field(default_factory=list)
    residuals: list[float] = field(default_factory=list)
    energies: list[float] = field(default_factory=list)
    floors: list[float] = field(default_factory=list)
    roundings: list[float] = field(default_factory=list)
    changes: list[int] = field(default_factory=list)
    conditions: list[float] = field(default_factory=list)

    def add(self, q: FloatArray, factor: float, residual: FloatArray, floor: FloatArray, changes: int) -> None:
        self.q.append(q)
        self.factors.append(factor)
        self.residuals.append(float(np.abs(residual).max(initial=0.0)))
        self.floors.append(float(floor.max(initial=0.0)))
        with np.errstate(divide="ignore"):  # an entry without any term has no roundoff, and nothing but zero will do
            roundings = np.divide(np.abs(residual), floor, where=residual != 0, out=0 * floor)
        self.roundings.append(float(roundings.max(initial=0.0)))
        self.changes.append(changes)
        self.energies.append(np.nan)
        self.conditions.append(np.nan)

    def trace(self, scene: Scene, end: End, seconds: dict[str, float]) -> Trace:
        return Trace(
            scene=scene,
            end=end,
            q=frozen(np.array(self.q), np.float64),
            factors=frozen(self.factors, np.float64),
            residuals=frozen(self.residuals, np.float64),
            energies=frozen(self.energies, np.float64),
            floors=frozen(self.floors, np.float64),
            roundings=frozen(self.roundings, np.float64),
            changes=frozen(self.changes, np.int64),
            conditions=frozen(self.conditions, np.float64),
            seconds=seconds,
        )


def _end(record: _Record, first: int) -> End | None:
    """What the iterates of a load step, which begin at `first`, say about its end; None to go on."""
    residuals, roundings, q = record.residuals[first:], record.roundings[first:], record.q[first:]
    if roundings[-1] <= 1:
        return End.CONVERGED
    if not np.isfinite(residuals[-1]) or residuals[-1] > GONE * max(residuals[0], record.floors[first]):
        return End.DIVERGED
    if len(q) > 4:
        back, steps = [np.abs(q[-1 - k] - q[-3 - k]).max() for k in (0, 1)], np.abs(q[-1] - q[-2]).max()
        if max(back) <= 2.0**-20 * steps and min(roundings[-4:]) > NEARLY:
            return End.CYCLE
    if len(q) > STALLED and min(roundings[-STALLED:]) >= min(roundings[:-STALLED]) <= NEARLY:
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


def _dense_step(matrix: FloatArray, right: FloatArray) -> tuple[FloatArray | None, float]:
    if not len(right):
        return right, 1.0
    if not np.isfinite(matrix).all():
        return None, 0.0
    factors, pivots, info = lapack.dgetrf(matrix)
    if info > 0:
        return None, 0.0
    condition, _ = lapack.dgecon(factors, np.abs(matrix).sum(axis=0).max())
    step, _ = lapack.dgetrs(factors, pivots, right)
    return step, float(condition)


def _sparse_step(matrix: Any, right: FloatArray) -> tuple[FloatArray | None, float]:
    try:
        factors = splu(matrix.tocsc())
    except RuntimeError:  # scipy's word for an exactly singular matrix
        return None, 0.0
    inverse = LinearOperator(matrix.shape, factors.solve, lambda v: factors.solve(v, "T"), dtype=np.float64)
    # one column: more would be random ones; pivots alone do not tell a singular matrix
    return factors.solve(right), float(1 / (abs(matrix).sum(axis=0).max() * onenormest(inverse, t=1)))
