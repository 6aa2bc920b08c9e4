"""One step of Newton's method: a linear system solved, its condition estimated, its rank told if it has multipliers.

Multipliers that are not unique (constraints that depend on one another) leave the positions unique. That is told by
the number of multipliers too many, and the step has the shortest change of them; nothing else singular is solved.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg, sparse
from scipy.linalg import lapack
from scipy.sparse.linalg import LinearOperator, onenormest, splu

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense

RANK_ROUNDOFF = 8.0  # of a singular value: how many units of roundoff, times the size of the matrix, count as zero


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """What a linear system gave.

    Attributes
    ----------
    change : FloatArray | None, shape (n,)
        The step, None where the matrix has no inverse in floats.
    condition : float
        Estimate of 1/cond of the matrix, rows and columns of multipliers scaled; 0 where it has no inverse,
        also where multipliers are not unique and there is a step all the same.
    deficiency : int
        How many of the multipliers are not unique.
    """

    change: FloatArray | None
    condition: float
    deficiency: int = 0


def solve_step(matrix: Any, right: FloatArray, n_positions: int, floor: FloatArray | None = None) -> Step:
    """The solution of matrix · step = right.

    Parameters
    ----------
    matrix : Any, shape (n, n)
        Dense or sparse.
    n_positions : int
        How many of the unknowns are positions; behind them are multipliers.
    floor : FloatArray | None, shape (n,)
        What roundoff makes of `right`. Constraints that depend on one another must not contradict one another
        by more; zero by default.
    """
    if n_positions == len(right):
        step, condition = _factorised(matrix, right)
        singular = step is None or condition <= UNIT_ROUNDOFF * len(right) or not np.isfinite(step).all()
        return Step(None if singular else step, condition)
    rows, columns = scale_factors(matrix, n_positions)
    scaled = _scaled(matrix, rows, columns)
    step, condition = _factorised(scaled, rows * right)
    # a matrix whose rank is short may still have factors in floats, with a condition of some units of roundoff
    if step is not None and condition > RANK_ROUNDOFF * UNIT_ROUNDOFF * len(right) and np.isfinite(step).all():
        return Step(columns * step, condition)
    if not np.isfinite(scaled.data if sparse.issparse(scaled) else scaled).all():
        return Step(None, 0.0)
    step, deficiency = _shortest(scaled, rows * right, n_positions, 0 * rows if floor is None else rows * floor)
    return Step(None if step is None else columns * step, 0.0, deficiency)


def scale_factors(matrix: Any, n_positions: int) -> tuple[FloatArray, FloatArray]:
    """(n,) factors of rows and of columns that make constraints and multipliers comparable with forces and positions.

    A column's factor is the multiplier, a pressure or a force, that does as much as a unit of displacement.
    """
    bulk, transfer = abs(matrix[:n_positions, :n_positions]), abs(matrix[:n_positions, n_positions:])
    stiffest, widest = (float(part.max()) if min(part.shape) else 0.0 for part in (bulk, transfer))
    columns, rows = np.ones((2, matrix.shape[0]))
    if stiffest > 0 and widest > 0:
        columns[n_positions:] = stiffest / widest
        constraints = abs(_scaled(matrix, rows, columns)[n_positions:])
        largest = constraints.toarray().max(axis=1) if sparse.issparse(constraints) else constraints.max(axis=1)
        rows[n_positions:] = np.where(largest > 0, stiffest / np.where(largest > 0, largest, 1.0), 1.0)
    return rows, columns


def _scaled(matrix: Any, rows: FloatArray, columns: FloatArray) -> Any:
    if isinstance(matrix, np.ndarray):
        return rows[:, None] * matrix * columns
    return sparse.csr_array(sparse.diags_array(rows) @ matrix @ sparse.diags_array(columns))


def _shortest(matrix: Any, right: FloatArray, n_positions: int, floor: FloatArray) -> tuple[FloatArray | None, int]:
    """The shortest solution, None where positions are not unique or nothing solves; how many multipliers are not."""
    left, values, right_vectors = linalg.svd(dense(matrix))
    rank = int((values > RANK_ROUNDOFF * len(values) * UNIT_ROUNDOFF * values[0]).sum())
    deficiency = len(values) - rank
    if rank == 0:
        return None, deficiency
    blur = RANK_ROUNDOFF * len(values) * UNIT_ROUNDOFF * values[0] / values[rank - 1]  # of computed singular vectors
    moving = np.abs(right_vectors[rank:, :n_positions]).max(initial=0.0)
    contradiction = np.abs(left[:, rank:].T @ right)
    rounding = np.abs(left[:, rank:].T) @ floor + blur * np.abs(right).max(initial=0.0)
    if moving > blur or (contradiction > rounding).any():
        return None, deficiency
    coordinates = left[:, :rank].T @ right / values[:rank]
    step: FloatArray = right_vectors[:rank].T @ coordinates
    return step, deficiency


def _factorised(matrix: Any, right: FloatArray) -> tuple[FloatArray | None, float]:
    return (_dense if isinstance(matrix, np.ndarray) else _sparse)(matrix, right)


def _dense(matrix: FloatArray, right: FloatArray) -> tuple[FloatArray | None, float]:
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


def _sparse(matrix: Any, right: FloatArray) -> tuple[FloatArray | None, float]:
    try:
        factors = splu(matrix.tocsc())
    except RuntimeError:  # scipy's word for an exactly singular matrix
        return None, 0.0
    step = factors.solve(right)
    return step, float(1 / (abs(matrix).sum(axis=0).max() * _size_of_inverse(factors, matrix.shape[0], right, step)))


def _size_of_inverse(factors: Any, n: int, right: FloatArray, step: FloatArray) -> float:
    """A lower bound of the one-norm of the inverse, rarely far below it; pivots alone do not tell a singular matrix.

    The largest of three: the estimate that begins with equal entries (one column, since more would be random ones),
    which misses what is orthogonal to them; as in LAPACK's dlacn2 the growth of a vector of alternating signs; and that
    of the right-hand side.

    Source: Higham, ACM Trans. Math. Software 14 (1988) 381–396.
    """
    inverse = LinearOperator((n, n), factors.solve, lambda v: factors.solve(v, "T"), dtype=np.float64)
    alternating = np.where(np.arange(n) % 2, -1.0, 1.0) * (1 + np.arange(n) / max(n - 1, 1))
    found = [float(onenormest(inverse, t=1)), 2 * float(np.abs(factors.solve(alternating)).sum()) / (3 * n)]
    if right.any():
        found.append(float(np.abs(step).sum() / np.abs(right).sum()))
    return max(found)
