"""One linear system of Newton's method: its solution, an estimate of its condition, and the rank of its multipliers.

Multipliers that are not unique, because constraints depend on one another, leave the positions unique. Then the step
has the shortest change of multipliers, and the number of multipliers too many is reported.

Rule for the next editor: no other singular system is solved. A step that a singular matrix happens to give in floats is
worse than none, because it looks like a solution.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy import linalg, sparse
from scipy.linalg import lapack
from scipy.sparse.linalg import LinearOperator, onenormest, splu

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense

# A singular value counts as zero if it is at most this many units of roundoff, times the size of the matrix, times the
# largest one.
RANK_ROUNDOFF = 8.0
# Positions are eliminated before multipliers if their stiffness has such a condition: what is left is rounded by less
# than a millionth then, and constraints that are nearly dependent are told from those that are.
_FAR_FROM_SINGULAR = 2.0**-20
# A whole system has the pattern of its bodies, which is symmetric, and then this ordering fills less.
_LARGE, _ORDERING = 10_000, {"permc_spec": "MMD_AT_PLUS_A"}


class Step(NamedTuple):
    """The answer of a linear system."""

    change: FloatArray | None  # (n,) The step; None if the matrix has no inverse in floats.
    # An estimate of 1/cond of the matrix in single precision, rows and columns of multipliers scaled. It is 0 if the
    # matrix has no inverse, even if multipliers are not unique and there is a step all the same.
    condition: float
    deficiency: int = 0  # The number of multipliers that are not unique.


def solve_step(matrix: Any, right: FloatArray, n_positions: int, floor: FloatArray | None = None) -> Step:
    """Solve matrix · step = right (n,), where multipliers come behind `n_positions` unknowns that are positions.

    `floor` (n,) is the largest part of `right` that roundoff alone may cause; 0 by default. Constraints that depend on
    one another must not contradict one another by more.
    """
    if n_positions == len(right):
        step, condition = _factorise(matrix, right)
        singular = step is None or condition <= UNIT_ROUNDOFF * len(right) or not np.isfinite(step).all()
        return Step(None if singular else step, condition)
    rows, columns = scale_factors(matrix, n_positions)
    scaled = _scale(matrix, rows, columns)
    step, condition = _factorise(scaled, rows * right)
    # A matrix of deficient rank may still have factors in floats, with a condition of some units of roundoff.
    if step is not None and condition > RANK_ROUNDOFF * UNIT_ROUNDOFF * len(right) and np.isfinite(step).all():
        return Step(columns * step, condition)
    if not np.isfinite(scaled.data if sparse.issparse(scaled) else scaled).all():
        return Step(None, 0.0)
    step, deficiency = _shortest(scaled, rows * right, n_positions, 0 * rows if floor is None else rows * floor)
    return Step(None if step is None else columns * step, 0.0, deficiency)


def scale_factors(matrix: Any, n_positions: int) -> tuple[FloatArray, FloatArray]:
    """Return factors (n,) of rows and of columns that make multipliers comparable with positions.

    They are 1 for forces and for positions. The factor of a multiplier's column is the pressure or force that has as
    much effect as a unit of displacement.
    """
    bulk, transfer = abs(matrix[:n_positions, :n_positions]), abs(matrix[:n_positions, n_positions:])
    stiffest, widest = (float(part.max()) if min(part.shape) else 0.0 for part in (bulk, transfer))
    columns, rows = np.ones((2, matrix.shape[0]))
    if stiffest > 0 and widest > 0:
        columns[n_positions:] = stiffest / widest
        constraints = abs(_scale(matrix, rows, columns)[n_positions:])
        largest = constraints.max(axis=1)
        largest = largest.toarray().reshape(-1) if sparse.issparse(largest) else largest
        rows[n_positions:] = np.where(largest > 0, stiffest / np.where(largest > 0, largest, 1.0), 1.0)
    return rows, columns


def _scale(matrix: Any, rows: FloatArray, columns: FloatArray) -> Any:
    if isinstance(matrix, np.ndarray):
        return rows[:, None] * matrix * columns
    return sparse.csr_array(sparse.diags_array(rows) @ matrix @ sparse.diags_array(columns))


def _shortest(matrix: Any, right: FloatArray, n_positions: int, floor: FloatArray) -> tuple[FloatArray | None, int]:
    """Return the shortest solution and the number of multipliers that are not unique.

    The solution is None if positions are not unique, or if constraints contradict one another. Positions that bodies
    and open contact hold are eliminated first, since singular values of so much less take a small part of the time: all
    positions or none, because the singular vectors of a stiffness near to singular are needed.
    """
    full = dense(matrix)
    stiffness = full[:n_positions, :n_positions]
    factors, pivots, info = lapack.dgetrf(stiffness)
    condition = lapack.dgecon(factors, np.abs(stiffness).sum(axis=0).max())[0] if info == 0 and len(stiffness) else 0.0
    eliminated = condition > _FAR_FROM_SINGULAR
    n, condition = (n_positions, float(np.float32(condition))) if eliminated else (0, 1.0)  # As in `_factorise`.

    def solve(forces: FloatArray, transposed: int = 0) -> FloatArray:
        answer = lapack.dgetrs(factors, pivots, forces, trans=transposed)[0] if eliminated else np.array(forces)
        return np.asarray(answer)

    effect, particular = solve(full[:n, n:]), solve(right[:n])  # On positions, of multipliers and of the right side
    left, values, right_vectors = linalg.svd(full[n:, n:] - full[n:, :n] @ effect)
    zero = RANK_ROUNDOFF * len(right) * UNIT_ROUNDOFF / condition  # As a share of the largest value
    rank = int((values > zero * values[0]).sum()) if len(values) else 0
    deficiency = len(values) - rank
    if rank == 0:
        return None, deficiency
    blur = zero * values[0] / values[rank - 1]  # Error of singular vectors.
    null, contradicting = right_vectors[rank:].T, left[:, rank:]
    moving = np.abs(np.concatenate([effect @ null, null])[:n_positions]).max(initial=0.0)
    contradicting = np.concatenate([-solve(full[n:, :n].T @ contradicting, 1), contradicting])
    contradiction = np.abs(contradicting.T @ right)
    rounding = np.abs(contradicting.T) @ floor + blur * np.abs(right).max(initial=0.0)
    if moving > blur or (contradiction > rounding).any():
        return None, deficiency
    rest = right[n:] - full[n:, :n] @ particular
    last: FloatArray = right_vectors[:rank].T @ (left[:, :rank].T @ rest / values[:rank])
    return np.concatenate([particular - effect @ last, last]), deficiency


def _factorise(matrix: Any, right: FloatArray) -> tuple[FloatArray | None, float]:
    """Return the solution, None if there is none, and an estimate of 1/cond, 0 then.

    It is in single precision: the last digits of LAPACK's estimate depend on where its workspace lies in memory, and so
    change from run to run.
    """
    if isinstance(matrix, np.ndarray):
        if not len(right):
            return right, 1.0
        if not np.isfinite(matrix).all():
            return None, 0.0
        factors, pivots, info = lapack.dgetrf(matrix)
        if info > 0:
            return None, 0.0
        condition = lapack.dgecon(factors, np.abs(matrix).sum(axis=0).max())[0]
        return lapack.dgetrs(factors, pivots, right)[0], float(np.float32(condition))
    try:
        factors = splu(matrix.tocsc(), **_ORDERING if len(right) > _LARGE else {})
    except RuntimeError:  # The matrix is exactly singular.
        return None, 0.0
    step = factors.solve(right)
    inverse_norm = _estimate_inverse_norm(factors, matrix.shape[0], right, step)
    return step, float(np.float32(1 / (abs(matrix).sum(axis=0).max() * inverse_norm)))


def _estimate_inverse_norm(factors: Any, n: int, right: FloatArray, step: FloatArray) -> float:
    """Return a lower bound of the one-norm of the inverse, which is rarely far below it.

    Pivots alone do not reveal a singular matrix. The bound is the largest of three growths: that of equal entries (one
    column, since more would be random), which misses what is orthogonal to them; that of a vector of alternating signs,
    as in LAPACK's dlacn2 (Higham, ACM Trans. Math. Software 14 (1988) 381–396); and that of the right-hand side.
    """
    inverse = LinearOperator((n, n), factors.solve, lambda v: factors.solve(v, "T"), dtype=np.float64)
    alternating = np.where(np.arange(n) % 2, -1.0, 1.0) * (1 + np.arange(n) / max(n - 1, 1))
    growths = [float(onenormest(inverse, t=1)), 2 * float(np.abs(factors.solve(alternating)).sum()) / (3 * n)]
    if right.any():
        growths.append(float(np.abs(step).sum() / np.abs(right).sum()))
    return max(growths)
