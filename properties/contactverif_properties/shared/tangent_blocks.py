"""The tangent against the derivative of the residual, block by block: rows of a node × columns of a node.

Each block counts over its own largest entry. So a small block is judged as sharply as a large one, and the tolerance
does not grow with the size of the problem. What roundoff does to a block is in proportion to the largest block of its
row or its column, and that is the only larger scale.

Rule for the next editor: whether a block is excused, by a kink or because the residual bends too sharply, is decided
by the residual alone and never by the tangent that is judged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import BoolArray, FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.measurement import Quantity
from contactverif.contract.subject import Subject
from contactverif_properties.shared.any_state import freeze_state
from contactverif_properties.shared.block_derivatives import (
    Groups,
    Moves,
    differences_by_complex_step,
    differences_on_both_sides,
    groups_of,
    plan_moves,
    roundoff,
    single_moves,
)
from contactverif_properties.shared.frozen_state import FrozenState

LARGEST, SURROUNDINGS = 30.0, 32.0  # Allowed errors of a difference, over (uS/ℓ)^(2/3) of a block and its surroundings.
EXACT, ROUNDINGS = 1e-11, 1024.0  # Allowed errors of a complex step, of a block and over uS/ℓ of its surroundings.
JUMP = 64.0  # A jump between both sides that a difference cannot hide, over (uS/ℓ)^(2/3) of the surroundings.
SHORTEST_BENDING = 2.0**-10  # Over less than this share of ℓ, differences decide nothing.

BLOCK = Quantity(
    "error of a block against a difference",
    "(30 + 32 s) (uS/ℓ)^(2/3) + 1024 s uS/ℓ",
    "Truncation and roundoff of a difference, as in tangent.directional; roundoff is in proportion to s, the largest "
    "block of the row or the column over this one. In long double u is smaller.",
)
COMPLEX_BLOCK = Quantity(
    "error of a block against a complex step",
    "1e-11 + 1024 s uS/ℓ",
    "A complex step has no truncation; s is the largest block of the row or the column over this one. An error below "
    "uS/ℓ of the largest derivative is that of a node which a cell reaches by a rounding.",
)
LACKING = Quantity("entries that the pattern lacks", "0", "A derivative that is not zero needs an entry in the matrix.")


MOST_REPEATED = 3  # So many moves of a long interface that look wrong are taken apart, the worst first.


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """The blocks of a tangent beside those of the derivative of the residual."""

    # (count, count) The largest error of an entry of each block, and what is allowed, both in the unit of the entry.
    error: FloatArray
    tolerance: FloatArray
    largest: FloatArray  # (count, count) The largest entry of each block, of tangent or derivative.
    surroundings: FloatArray  # (count, count) The largest block in the row or the column of each.
    derivative: FloatArray  # (size, size) The derivative, by the step that agrees best with the tangent in each block.

    @property
    def excess(self) -> FloatArray:
        """Error over tolerance of each block (count, count); 0 where both are 0."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.error > 0, self.error / self.tolerance, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class BlockJudge:
    """The tangent of a state, and how it is compared with the derivative of the residual."""

    state: FrozenState
    tangent: FloatArray  # (size, size) The tangent K.
    pattern: BoolArray  # (size, size) The entries that the tangent has.
    groups: Groups  # Nodes and multipliers.
    dtype: type  # The precision of the differences; complex for a complex step.

    @property
    def by_complex_step(self) -> bool:
        """True if the derivative is taken by a complex step."""
        return self.dtype is np.complex128

    def answers(self, moves: Moves) -> FloatArray:
        """Return the derivatives (n_steps, n_moves, size) along the moves; by a complex step there is one."""
        if self.by_complex_step:
            return differences_by_complex_step(self.state, moves.directions())[None]
        ahead, behind = differences_on_both_sides(self.state, moves.directions(), self.dtype)
        return (ahead + behind) / 2

    def compare(self, derivatives: FloatArray) -> Comparison:
        """Compare the tangent with derivatives (n_steps, size, size), the best step of each block."""
        groups, numbers = self.groups, self.groups.of_unknowns
        errors = np.array([groups.largest(self.tangent - derivative) for derivative in derivatives])
        best = errors.argmin(axis=0)
        derivative = derivatives[0]
        if len(derivatives) > 1:
            derivative = np.take_along_axis(derivatives, best[np.ix_(numbers, numbers)][None], axis=0)[0]
        largest = np.maximum(groups.largest(self.tangent), groups.largest(derivative))
        surroundings = groups.surroundings(largest)
        # Rounding moves the ends of cells and areas by uS. A node that they reach by no more has blocks of so little.
        dust = roundoff(self.state.case, np.float64) * np.abs(derivative).max(initial=0.0)
        tolerance = self.tolerate(largest, surroundings, np.ones_like(largest)) + dust
        return Comparison(errors.min(axis=0), tolerance, largest, surroundings, derivative)

    def tolerate(self, largest: FloatArray, surroundings: FloatArray, bending: FloatArray) -> FloatArray:
        """Return the tolerance of blocks, given the lengths over ℓ over which they bend; arrays of one shape."""
        rounding = ROUNDINGS * roundoff(self.state.case, np.float64) / bending * surroundings
        if self.by_complex_step:
            return EXACT * largest + rounding
        accuracy = (roundoff(self.state.case, self.dtype) / bending) ** (2 / 3)
        return accuracy * (LARGEST * largest + SURROUNDINGS * surroundings) + rounding


def judge_of(case: Case, subject: Subject) -> BlockJudge:
    """Return the judge of a formulation with a tangent at a state."""
    state = freeze_state(case, subject)
    formulation, case, pairing = state.formulation, state.case, state.pairing
    tangent = formulation.tangent(case.interface, pairing, case.z)
    dtype: type = np.float64
    if formulation.decides_anew(pairing):  # No smaller step is exact where decisions may change with it.
        pass
    elif subject.traits.abilities.takes_complex:
        dtype = np.complex128
    elif subject.traits.abilities.takes_longdouble:
        dtype = np.longdouble
    return BlockJudge(state, dense(tangent), pattern_of(tangent), groups_of(case), dtype)


def pattern_of(tangent: Any) -> BoolArray:
    """Return the entries (size, size) that a matrix stores; of an array, those that are not zero."""
    if not sparse.issparse(tangent):
        pattern: BoolArray = np.asarray(tangent) != 0
        return pattern
    pattern = np.zeros(tangent.shape, dtype=np.bool_)
    pattern[tangent.tocoo().coords] = True
    return pattern


def scatter(answers: FloatArray, moves: Moves) -> FloatArray:
    """Return answers (n_steps, n_moves, size) as columns of matrices (n_steps, size, size)."""
    number, row = np.nonzero(moves.owner >= 0)
    matrices = np.zeros((len(answers), answers.shape[2], answers.shape[2]))
    matrices[:, row, moves.owner[number, row]] = answers[:, number, row]
    return matrices


def compare_blocks(judge: BlockJudge) -> Comparison:
    """Compare all blocks; on a long interface, what looks wrong is measured again, one unknown at a time."""
    moves = plan_moves(judge.state.case, judge.pattern)
    answers = judge.answers(moves)
    derivatives = scatter(answers, moves)
    comparison = judge.compare(derivatives)
    if all(len(members) == 1 for members in moves.members):
        return comparison
    excess = _excess_of_moves(judge, comparison, answers, moves)
    if (excess <= 1).all():
        return comparison
    worst = np.argsort(-excess)[:MOST_REPEATED]
    trusted = np.zeros(judge.groups.count, dtype=np.bool_)
    for number in worst[excess[worst] > 1]:
        columns = moves.members[number]
        derivatives[:, :, columns] = judge.answers(single_moves(columns, judge.groups.size)).transpose(0, 2, 1)
        trusted[judge.groups.of_unknowns[columns]] = True
    comparison = judge.compare(derivatives)
    error = np.where(trusted, comparison.error, 0.0)
    return Comparison(error, comparison.tolerance, comparison.largest, comparison.surroundings, comparison.derivative)


def _excess_of_moves(judge: BlockJudge, comparison: Comparison, answers: FloatArray, moves: Moves) -> FloatArray:
    """Return the largest error over its tolerance of each move (n_moves,), in rows that it owns and in others."""
    of_unknowns = judge.groups.of_unknowns
    by_column = comparison.excess.max(axis=0)
    excess = np.array([by_column[of_unknowns[members]].max() for members in moves.members])
    strangers = np.where(moves.owner < 0, np.abs(answers).min(axis=0), 0.0)  # Rows in which nothing should be felt.
    # The surroundings of a row are those of its largest block.
    around = comparison.surroundings.max(axis=1)
    allowed = judge.tolerate(np.zeros_like(around), around, np.ones_like(around))[of_unknowns]
    with np.errstate(divide="ignore", invalid="ignore"):
        beyond = np.where(strangers > 0, strangers / allowed, 0.0)
    worst: FloatArray = np.maximum(excess, beyond.max(axis=1))
    return worst
