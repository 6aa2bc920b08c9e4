"""Properties about each entry of the tangent: the worst block by name, and what excuses one.

A block is excused where the residual is not smooth, and where it bends over a length too short for differences. Both
are seen in differences of the residual; the tangent has no part in it. One excused block excuses no other.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.measurement import Finding, Measurement
from contactverif.contract.property import WITH_BARRIER, Property
from contactverif.contract.subject import Subject
from contactverif.problems.long_states import long_face_states, long_states
from contactverif.strategies import smooth_cases
from contactverif.strategies.surfaces import smooth_surface_cases
from contactverif_properties.shared.applicability import promise_exact_tangent
from contactverif_properties.shared.block_derivatives import STEPS, differences_on_both_sides, single_moves, step
from contactverif_properties.shared.kinks import excuse_barrier
from contactverif_properties.shared.tangent_blocks import (
    BLOCK,
    COMPLEX_BLOCK,
    EXACT,
    JUMP,
    LACKING,
    SHORTEST_BENDING,
    BlockJudge,
    Comparison,
    compare_blocks,
    judge_of,
)

_define = partial(
    Property.define,
    family="tangent",
    quantities=(BLOCK, COMPLEX_BLOCK, LACKING),
    promise=promise_exact_tangent,
    needs=frozenset({"tangent"}),
    asks=WITH_BARRIER,
)


@_define(
    id="tangent.sparsity",
    rank=30,
    turn=5,
    cases=Cases.random(smooth_cases),
    cases_in_space=Cases.random(smooth_surface_cases),
)
def tangent_sparsity(case: Case, subject: Subject) -> Measurement:
    """Each block of the tangent is the derivative of the residual, and the pattern lacks no entry.

    **Question.** Every unknown moves by itself. Is the change of each nodal force the entry of the tangent, and has the
    tangent an entry wherever a force changes?

    **Why it matters.** In a random direction, and in a norm of the whole matrix, a large entry hides a small one. A
    code that allots its matrix from the mesh alone loses what couples a slave node with the second neighbour of a
    master node.

    **How it is judged.** A block is the rows of a node × the columns of a node; a multiplier counts as a node. Each
    block counts over its own largest entry, so that the tolerance does not grow with the size of the problem:

    - Against a complex step, where the plugin takes complex positions: 1e-11 + 1024 s uS/ℓ. Here s is the largest block
      in the row or the column over this one, since roundoff is in proportion to that.
    - Otherwise against the best of three central differences: (30 + 32 s) (uS/ℓ)^(2/3) + 1024 s uS/ℓ. Where the plugin
      takes long doubles, u is that of long doubles in the first term.
    - A derivative beyond that tolerance needs an entry in the matrix. In an array an entry that is exactly zero is
      none.

    Where the residual of a failing block bends over a length λ < ℓ, the block is judged again with λ in place of ℓ. A
    failure names row and column of the worst entry, its value and the derivative.

    **Undecided.** Only where nothing else fails: a failing block whose one-sided differences disagree, unless the
    tangent is the derivative to one side; and a failing block whose residual bends over less than ℓ/1024.
    """
    return measure_blocks(case, subject)


@_define(
    id="tangent.long", rank=20, cases=Cases.from_list(long_states), cases_in_space=Cases.from_list(long_face_states)
)
def tangent_long(case: Case, subject: Subject) -> Measurement:
    """Each block of the tangent of a long interface is the derivative of the residual.

    **Question.** Six interfaces have 104 to 200 segments on one side: wavy, graded, a ring, three chains, many segments
    on few, and few on many. In space four have 128 triangles. Is each block of the tangent the derivative of the
    residual?

    **Why it matters.** Some errors need size: a table that is too short, a block of rows that is forgotten behind the
    hundredth segment, a wrong entry among a hundred thousand. A norm of the whole matrix loses that entry, and the more
    so the longer the interface.

    **How it is judged.** As in `tangent.sparsity`, with the same tolerances: each block counts over its own largest
    entry. One entry that is wrong by 1e-6 of its block is found. Unknowns that no row feels together move at the same
    time, so that some 30 moves are enough. What looks wrong is measured again, one unknown at a time.

    **Undecided.** As in `tangent.sparsity`.
    """
    return measure_blocks(case, subject)


def measure_blocks(case: Case, subject: Subject) -> Measurement:
    """Compare each block of the tangent, rows of a node × columns of a node, with the derivative of the residual."""
    judge = judge_of(case, subject)
    comparison = compare_blocks(judge)
    excess, excuses = comparison.excess, Excuses(0, 0)
    if (excess > 1).any():
        excess, excuses = _excuse(judge, comparison)
    lacking = len(lacking_entries(judge, comparison, excess)) if (excess > 1).any() else 0
    row, column = np.unravel_index(int(excess.argmax()), excess.shape)
    size = float(comparison.largest[row, column]) or 1.0
    value = float(excess[row, column])
    error = float(comparison.error[row, column]) / size if value else 0.0  # A block that is excused has none.
    quantity = COMPLEX_BLOCK if judge.by_complex_step else BLOCK
    undecided = "" if value > 1 or lacking else excuses.reason
    if value > 1:
        length = step(case, np.float64)
        undecided = excuse_barrier(judge.state, max(STEPS) * length, length, float(comparison.error[row, column]))
    tolerance = error / value if value else EXACT
    numbers = [] if undecided and value <= 1 else [quantity.check(error, tolerance), LACKING.check(float(lacking), 0.0)]
    return Measurement(
        numbers,
        undecided=undecided,
        finding=worst_entry(judge, comparison, int(row), int(column)) if value > 1 else None,
        details={
            "blocks": float((comparison.largest > 0).sum()),
            "blocks at a kink": float(excuses.kinked),
            "blocks that bend too sharply": float(excuses.bent),
        },
        idle=not judge.tangent.any() and not comparison.derivative.any(),
    )


def worst_entry(judge: BlockJudge, comparison: Comparison, row: int, column: int) -> Finding:
    """Return the worst entry of a block, by nodes or multipliers, beside its derivative."""
    of_unknowns, groups = judge.groups.of_unknowns, judge.groups
    rows, columns = np.flatnonzero(of_unknowns == row), np.flatnonzero(of_unknowns == column)
    part = np.ix_(rows, columns)
    errors = np.abs(judge.tangent[part] - comparison.derivative[part])
    first, second = divmod(int(errors.argmax()), errors.shape[1])
    i, j = int(rows[first]), int(columns[second])
    missing = "" if judge.pattern[i, j] else ", not in the pattern"
    return Finding(
        f"row {i} ({groups.describe(i)}), column {j} ({groups.describe(j)}){missing}",
        (judge.tangent[i, j],),
        (comparison.derivative[i, j],),
        "N m-1",
        "tangent",
        "derivative",
        f"largest entry of the block {comparison.largest[row, column]:.3g}",
    )


def lacking_entries(judge: BlockJudge, comparison: Comparison, excess: FloatArray) -> IntArray:
    """Return rows and columns (n_entries, 2) of derivatives that are not zero where the tangent has no entry.

    Blocks of which `excess` (count, count) says that they do not fail lack nothing.
    """
    of_unknowns = judge.groups.of_unknowns
    part = np.ix_(of_unknowns, of_unknowns)
    lacking = ~judge.pattern & (np.abs(comparison.derivative) > comparison.tolerance[part]) & (excess[part] > 1)
    return np.argwhere(lacking)


@dataclass(frozen=True, slots=True)
class Excuses:
    """The numbers of blocks that fail and are excused, by a kink or because the residual bends too sharply."""

    kinked: int
    bent: int

    @property
    def reason(self) -> str:
        """The reason why such a block decides nothing; empty if there is none."""
        if self.kinked:
            return f"a kink: one-sided differences disagree in {self.kinked} blocks"
        if self.bent:
            return f"roundoff: {self.bent} blocks bend over lengths that are too short for differences"
        return ""


def _excuse(judge: BlockJudge, comparison: Comparison) -> tuple[FloatArray, Excuses]:
    """Return the excess (count, count) of the blocks without those that are excused, and how many those are.

    The worst blocks that fail are looked at first. As soon as one has no excuse, it decides.
    """
    excess, kinked, bent = comparison.excess.copy(), 0, 0
    order = np.argsort(-excess, axis=None)[: int((excess > 1).sum())]
    columns: dict[int, _Sides] = {}
    for place in order:
        row, column = divmod(int(place), excess.shape[1])
        if column not in columns:
            columns[column] = _Sides.of_column(judge, column)
        sides = columns[column].in_row(judge, row)
        block, around = (getattr(comparison, name)[row, column] for name in ("largest", "surroundings"))
        bending = sides.bending(float(around))
        allowed = float(judge.tolerate(block, around, np.asarray(max(bending, SHORTEST_BENDING))))
        excess[row, column] = comparison.error[row, column] / allowed
        if excess[row, column] <= 1:
            continue
        if bending < SHORTEST_BENDING:
            excess[row, column], bent = 0.0, bent + 1
        elif sides.jump() > JUMP * sides.accuracy * around and not judge.by_complex_step:
            excess[row, column] = 0.0
            kinked += not sides.is_one_sided(2 * allowed)
        else:
            break
    return excess, Excuses(kinked, bent)


@dataclass(frozen=True, slots=True, eq=False)
class _Sides:
    """One-sided differences of some rows and columns, in doubles or better."""

    ahead: FloatArray  # (n_steps, n_columns, n_rows) The differences to both sides, for the steps in STEPS.
    behind: FloatArray
    tangent: FloatArray  # (n_columns, n_rows) The columns of the tangent.
    step: float  # The step h over ℓ.

    @classmethod
    def of_column(cls, judge: BlockJudge, column: int) -> _Sides:
        """Return all rows of the columns of a node or multiplier."""
        columns, case = np.flatnonzero(judge.groups.of_unknowns == column), judge.state.case
        dtype = np.float64 if judge.by_complex_step else judge.dtype
        directions = single_moves(columns, judge.groups.size).directions()
        ahead, behind = differences_on_both_sides(judge.state, directions, dtype)
        return cls(ahead, behind, judge.tangent[:, columns].T, step(case, dtype) / case.resolution)

    def in_row(self, judge: BlockJudge, row: int) -> _Sides:
        """Return the rows of a node or multiplier alone."""
        rows = judge.groups.of_unknowns == row
        return _Sides(self.ahead[..., rows], self.behind[..., rows], self.tangent[:, rows], self.step)

    @property
    def accuracy(self) -> float:
        """(uS/ℓ)^(2/3), the accuracy of a difference."""
        return self.step**2

    def bending(self, size: float) -> float:
        """Return the length over ℓ over which a residual with derivatives of this size bends; 1 if it is longer."""
        central = (self.ahead + self.behind) / 2
        third = np.abs(central[0] - central[1]).max() / ((STEPS[0] ** 2 - STEPS[1] ** 2) * self.step**2)
        bending = float(np.sqrt(size / third)) if third > 0 else 1.0
        return bending if bending < 0.5 else 1.0

    def jump(self) -> float:
        """Return by how much the derivative jumps at the state, without what a smooth residual bends by."""
        bends = self.ahead - self.behind
        return float(np.abs(_extrapolate(bends)).max())

    def is_one_sided(self, tolerance: float) -> bool:
        """Return whether the block of the tangent is the derivative to one side."""
        return any(
            bool((np.abs(_extrapolate(side) - self.tangent) <= tolerance).all()) for side in (self.ahead, self.behind)
        )


def _extrapolate(differences: FloatArray) -> FloatArray:
    """Return one-sided differences (n_steps, …) extrapolated to a step of zero, from the two shorter steps."""
    ratio = STEPS[1] / STEPS[2]
    limit: FloatArray = (ratio * differences[2] - differences[1]) / (ratio - 1)
    return limit
