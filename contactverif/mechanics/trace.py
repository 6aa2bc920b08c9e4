"""The history of a solution by Newton's method: every iterate, and how the iteration ended.

Rule for the next editor: a solution that does not converge is data, not an error. Every iterate is recorded, and `End`
says how the iteration ended.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray, freeze
from contactverif.contract.pairing import Pairing
from contactverif.mechanics.scene import Scene


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
        last: FloatArray = self.q[-1]
        return last

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
class Record:
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
    pairings: list[Pairing | None] = field(default_factory=list)
    forces: FloatArray = field(default_factory=lambda: np.zeros(0))

    def add(
        self, u: FloatArray, factor: float, residual: FloatArray, floor: FloatArray, comparable: Any, changes: int
    ) -> None:
        """Add an iterate. `comparable` are the factors (n,) of the entries of the residual, or one for all."""
        self.u.append(u)
        self.factors.append(factor)
        self.residuals.append(float(np.abs(comparable * residual).max(initial=0.0)))
        self.floors.append(float((comparable * floor).max(initial=0.0)))
        self.roundings.append(largest_rounding(residual, floor))
        self.changes.append(changes)
        self.energies.append(np.nan)
        self.conditions.append(np.nan)
        self.deficiencies.append(0)

    def trace(self, scene: Scene, end: End) -> Trace:
        """Return the trace of the iterates so far."""
        names = ("factors", "residuals", "energies", "floors", "roundings", "conditions", "forces")
        arrays: dict[str, Any] = {name: freeze(getattr(self, name), np.float64) for name in names}
        arrays |= {name: freeze(getattr(self, name), np.int64) for name in ("changes", "deficiencies")}
        u = freeze(np.array(self.u), np.float64)
        return Trace(scene, end, u, pairings=tuple(self.pairings), **arrays)


def largest_rounding(residual: FloatArray, floor: FloatArray) -> float:
    """Return the largest ratio of an entry of the residual (n,) to what roundoff may cause in it."""
    with np.errstate(divide="ignore"):  # An entry without any term has no roundoff: only zero is converged.
        roundings = np.divide(np.abs(residual), floor, where=residual != 0, out=0 * floor)
    return float(roundings.max(initial=0.0))
