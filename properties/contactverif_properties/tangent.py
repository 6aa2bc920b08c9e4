"""The tangent against the derivative of the residual: along some directions, and block by block, as large as it is.

A block is the rows of a node × the columns of a node, and counts over its own largest entry. What roundoff does to it
is in proportion to the largest block of its row or its column, and that is the only larger scale. Whether a block is
excused, by a kink or because the residual bends too sharply, is decided by the residual alone. On a long interface
unknowns that no row feels together move together. The pattern of the tangent saves calls there and decides nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, combinations, permutations, product
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph, csr_array

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, BoolArray, FloatArray, IntArray, dense
from contactverif.contract.case import Case, Cases
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import PLANE, Surface
from contactverif.contract.property import (
    WITH_BARRIER,
    Finding,
    Measurement,
    Property,
    Quantity,
    Verdict,
    check_all,
    judge,
)
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.problems.long_states import long_face_states, long_states
from contactverif.strategies import smooth_cases
from contactverif.strategies.surfaces import smooth_surface_cases
from contactverif_properties.applicability import promise_exact_tangent, tangent_error
from contactverif_properties.kinks import excuse_barrier, find_kink
from contactverif_properties.roundoff import COORDINATE_ROUNDING
from contactverif_properties.states import FrozenState, freeze_state, random_directions

STEPS = (8.0, 1.0, 0.125)  # Steps over the one at which truncation and roundoff are equal.
MOST_SINGLE = 48  # Up to so many nodes and multipliers, unknowns move one by one.
COMPLEX_STEP = 2.0**-100  # The imaginary step over ℓ; its square vanishes.


@dataclass(frozen=True, slots=True)
class Groups:
    """The nodes and multipliers of a problem: a node has an unknown for each axis, a multiplier has one."""

    n_slave: int  # The numbers of slave nodes, of all nodes and of multipliers.
    n_nodes: int
    n_multipliers: int
    dim: int = PLANE  # The number of unknowns of a node.

    @property
    def count(self) -> int:
        """The number of nodes and multipliers."""
        return self.n_nodes + self.n_multipliers

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return self.dim * self.n_nodes + self.n_multipliers

    @property
    def unknowns(self) -> IntArray:
        """The unknowns (count, dim) of each node; of a multiplier its own one, and −1 behind it."""
        unknowns = np.full((self.count, self.dim), -1)
        unknowns[: self.n_nodes] = np.arange(self.dim * self.n_nodes).reshape(-1, self.dim)
        unknowns[self.n_nodes :, 0] = self.dim * self.n_nodes + np.arange(self.n_multipliers)
        return unknowns

    @property
    def of_unknowns(self) -> IntArray:
        """The node or multiplier (size,) that each unknown belongs to."""
        return np.nonzero(self.unknowns >= 0)[0]

    def largest(self, matrix: FloatArray) -> FloatArray:
        """Return the largest absolute entry of each block (count, count) of a matrix (size, size)."""
        first = self.unknowns[:, 0]
        return np.asarray(np.maximum.reduceat(np.maximum.reduceat(np.abs(matrix), first), first, axis=1))

    def surroundings(self, blocks: FloatArray) -> FloatArray:
        """Return for each block the largest block of its row or its column, all (count, count).

        Columns of nodes and of multipliers have different units, and so have rows. Each kind counts apart.
        """
        scale = np.empty_like(blocks)
        for kinds in product((slice(0, self.n_nodes), slice(self.n_nodes, self.count)), repeat=2):
            rows, columns = (blocks[kinds].max(axis=axis, keepdims=True, initial=0.0) for axis in (1, 0))
            scale[kinds] = np.maximum(rows, columns)
        return scale

    def describe(self, unknown: int) -> str:
        """Return the kind and number of an unknown in words: "y of slave node 3"."""
        if unknown >= self.dim * self.n_nodes:
            return f"multiplier {unknown - self.dim * self.n_nodes}"
        node, axis = divmod(unknown, self.dim)
        return f"{'xyz'[axis]} of {'slave' if node < self.n_slave else 'master'} node {node}"


def _groups_of(case: Case) -> Groups:
    return Groups(case.interface.n_slave_nodes, case.interface.n_nodes, case.n_multipliers, case.interface.dim)


class Moves(NamedTuple):
    """Sets of unknowns that move together."""

    members: Sequence[IntArray]  # The unknowns of each move.
    # (n_moves, size) The unknown whose column an entry of the answer belongs to; −1 where no member may be felt.
    owner: IntArray

    def directions(self) -> FloatArray:
        """Return the moves (n_moves, size), 1 for each member."""
        directions = np.zeros(self.owner.shape)
        for number, members in enumerate(self.members):
            directions[number, members] = 1.0
        return directions


def single_moves(columns: IntArray, size: int) -> Moves:
    """Return one move for each of some unknowns (n_columns,); `size` is the number of all unknowns."""
    return Moves(list(columns[:, None]), np.repeat(columns[:, None], size, axis=1))


def plan_moves(case: Case, pattern: BoolArray) -> Moves:
    """Return moves that cover all unknowns: one by one on a short interface, many together on a long one.

    The pattern (size, size) are the entries that the tangent has.
    """
    groups = _groups_of(case)
    if groups.count <= MOST_SINGLE:
        return single_moves(np.arange(groups.size), groups.size)
    unknowns, of_unknowns = groups.unknowns, groups.of_unknowns
    # Which nodes and multipliers feel each other: by the tangent, or in one segment or face.
    rows, columns = (of_unknowns[index] for index in np.nonzero(pattern))
    corners = [surface.faces.T for surface in (case.interface.slave, case.interface.master)]
    pairs = [side[[first, second]] for side in corners for first, second in combinations(range(len(side)), 2)]
    first, second = np.concatenate(pairs, axis=1)
    itself = np.arange(groups.count)
    i, j = np.hstack([[rows, columns], [columns, rows], [first, second], [second, first], [itself, itself]])
    contacts = csr_array((np.ones(len(i)), (i, j)), shape=(groups.count, groups.count))
    members, owners = [], []
    for colour in _colours(contacts):
        owner = np.full(groups.count, -1)
        for group in colour:
            owner[contacts.indices[contacts.indptr[group] : contacts.indptr[group + 1]]] = group
        of_rows = owner[of_unknowns]
        for axis in range(groups.dim):
            moved = unknowns[colour, axis]
            if (moved >= 0).any():  # A multiplier has one unknown.
                members.append(moved[moved >= 0])
                owners.append(np.where(of_rows >= 0, unknowns[of_rows, axis], -1))
    return Moves(members, np.array(owners))


def _colours(contacts: csr_array) -> list[IntArray]:
    """Return sets of nodes and multipliers of which no two are felt in one row."""
    conflicts = csr_array(contacts @ contacts)
    colour = np.full(contacts.shape[0], -1)
    for group in range(len(colour)):
        used = set(colour[conflicts.indices[conflicts.indptr[group] : conflicts.indptr[group + 1]]].tolist())
        colour[group] = next(number for number in range(len(colour)) if number not in used)
    return [np.flatnonzero(colour == number) for number in range(int(colour.max()) + 1)]


def _roundoff(case: Case, dtype: type) -> float:
    """Return u S/ℓ in a precision; u is 2⁻⁵³ for doubles."""
    unit = UNIT_ROUNDOFF if dtype is np.float64 else float(np.finfo(dtype).eps) / 2
    return unit * case.largest_coordinate / case.resolution


def _stated_error(case: Case, traits: Traits) -> float:
    return tangent_error(traits) * max(_roundoff(case, np.float64) / UNIT_ROUNDOFF, 1.0)


def _step(case: Case, dtype: type) -> float:
    """Return the step h = ℓ (u S/ℓ)^(1/3), a length, at which truncation and roundoff are equal."""
    return case.resolution * float(np.cbrt(_roundoff(case, dtype)))


def _complex_step(state: FrozenState, directions: FloatArray) -> FloatArray:
    """Return Im R(x + ihd)/h (n_directions, size) along directions d (n_directions, size) at a state x."""
    h = state.case.resolution * COMPLEX_STEP
    forces = state.residual_at(state.case.z + 1j * h * directions)
    return np.asarray(forces.imag / h, dtype=np.float64)


def _both_sides(state: FrozenState, directions: FloatArray, dtype: type) -> tuple[FloatArray, FloatArray]:
    """Return the differences ahead and behind, each (n_steps, n_directions, size), for the steps in STEPS."""
    steps = _step(state.case, dtype) * np.array(STEPS, dtype=dtype)[:, None, None]
    z: Array = state.case.z.astype(dtype)
    states = np.stack([z + steps * directions, z - steps * directions])
    forces = state.residual_at(states.reshape(-1, z.size)).reshape(states.shape)
    here = state.residual_at(z[None])[0]
    ahead, behind = (forces[0] - here) / steps, (here - forces[1]) / steps
    return ahead.astype(np.float64), behind.astype(np.float64)


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
class _Comparison:
    error: FloatArray  # (count, count) The largest error of an entry of each block, and what is allowed.
    tolerance: FloatArray
    largest: FloatArray  # (count, count) The largest entry of each block, of tangent or derivative.
    surroundings: FloatArray  # (count, count) The largest block in the row or the column of each.
    derivative: FloatArray  # (size, size) The derivative, by the step that agrees best with the tangent in each block.

    @property
    def excess(self) -> FloatArray:
        """Error over tolerance of each block (count, count); 0 where both are 0."""
        return _over(self.error, self.tolerance)


def _over(errors: FloatArray, sizes: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(errors > 0, errors / sizes, 0.0)


class BlockJudge(NamedTuple):
    """The tangent of a state, and how it is compared with the derivative of the residual."""

    state: FrozenState
    tangent: FloatArray  # (size, size) The tangent K.
    pattern: BoolArray  # (size, size) The entries that the tangent has.
    groups: Groups  # Nodes and multipliers.
    dtype: type  # The precision of the differences; complex for a complex step.
    stated: float  # The error that the traits state of the tangent, over the surroundings of a block.

    @property
    def by_complex_step(self) -> bool:
        """True if the derivative is taken by a complex step."""
        return self.dtype is np.complex128

    def answers(self, moves: Moves) -> FloatArray:
        """Return the derivatives (n_steps, n_moves, size) along the moves; by a complex step there is one."""
        if self.by_complex_step:
            return _complex_step(self.state, moves.directions())[None]
        ahead, behind = _both_sides(self.state, moves.directions(), self.dtype)
        return (ahead + behind) / 2

    def compare(self, derivatives: FloatArray) -> _Comparison:
        """Compare the tangent with derivatives (n_steps, size, size), the best step of each block."""
        groups, numbers = self.groups, self.groups.of_unknowns
        errors = np.array([groups.largest(self.tangent - derivative) for derivative in derivatives])
        best = errors.argmin(axis=0)[np.ix_(numbers, numbers)]
        derivative = np.take_along_axis(derivatives, best[None], axis=0)[0]
        largest = np.maximum(groups.largest(self.tangent), groups.largest(derivative))
        surroundings = groups.surroundings(largest)
        # Rounding moves the ends of cells and areas by uS. A node that they reach by no more has blocks of so little.
        dust = _roundoff(self.state.case, np.float64) * np.abs(derivative).max(initial=0.0)
        tolerance = self.tolerate(largest, surroundings, np.ones_like(largest)) + dust
        return _Comparison(errors.min(axis=0), tolerance, largest, surroundings, derivative)

    def tolerate(self, largest: FloatArray, surroundings: FloatArray, bending: FloatArray) -> FloatArray:
        """Return the tolerance of blocks, given the lengths over ℓ over which they bend; arrays of one shape."""
        rounding = (ROUNDINGS * _roundoff(self.state.case, np.float64) + self.stated) / bending * surroundings
        if self.by_complex_step:
            return EXACT * largest + rounding
        accuracy = (_roundoff(self.state.case, self.dtype) / bending) ** (2 / 3)
        return accuracy * (LARGEST * largest + SURROUNDINGS * surroundings) + rounding


def judge_of(case: Case, subject: Subject) -> BlockJudge:
    """Return the judge of a formulation with a tangent at a state."""
    state = freeze_state(case, subject)
    formulation, abilities = state.formulation, subject.traits.abilities
    tangent = formulation.tangent(state.case.interface, state.pairing, state.case.z)
    sharpest = np.complex128 if abilities.takes_complex else np.longdouble if abilities.takes_longdouble else np.float64
    # No smaller step is exact where decisions may change with it.
    dtype: type = np.float64 if formulation.decides_anew(state.pairing) else sharpest
    matrix = dense(tangent)
    pattern = matrix != 0
    if sparse.issparse(tangent):  # A sparse tangent has an entry where it stores a zero, too.
        pattern[tangent.tocoo().coords] = True
    stated = _stated_error(state.case, subject.traits)
    return BlockJudge(state, matrix, pattern, _groups_of(state.case), dtype, stated)


def scatter(answers: FloatArray, moves: Moves) -> FloatArray:
    """Return answers (n_steps, n_moves, size) as columns of matrices (n_steps, size, size)."""
    number, row = np.nonzero(moves.owner >= 0)
    matrices = np.zeros((len(answers), answers.shape[2], answers.shape[2]))
    matrices[:, row, moves.owner[number, row]] = answers[:, number, row]
    return matrices


def _compare_blocks(judge: BlockJudge) -> _Comparison:
    """Compare all blocks; on a long interface, what looks wrong is measured again, one unknown at a time."""
    groups, moves = judge.groups, plan_moves(judge.state.case, judge.pattern)
    answers = judge.answers(moves)
    derivatives = scatter(answers, moves)
    comparison = judge.compare(derivatives)
    if all(len(members) == 1 for members in moves.members):
        return comparison
    of_unknowns, by_column = groups.of_unknowns, comparison.excess.max(axis=0)
    strangers = np.where(moves.owner < 0, np.abs(answers).min(axis=0), 0.0)  # Rows in which nothing should be felt.
    around = comparison.surroundings.max(axis=1)  # The surroundings of a row are those of its largest block.
    allowed = judge.tolerate(np.zeros_like(around), around, np.ones_like(around))[of_unknowns]
    owned = np.array([by_column[of_unknowns[members]].max() for members in moves.members])
    excess = np.maximum(owned, _over(strangers, allowed).max(axis=1))
    if (excess <= 1).all():
        return comparison
    worst = np.argsort(-excess)[:MOST_REPEATED]
    trusted = np.zeros(groups.count, dtype=np.bool_)
    for number in worst[excess[worst] > 1]:
        columns = moves.members[number]
        derivatives[:, :, columns] = judge.answers(single_moves(columns, groups.size)).transpose(0, 2, 1)
        trusted[of_unknowns[columns]] = True
    comparison = judge.compare(derivatives)
    return replace(comparison, error=np.where(trusted, comparison.error, 0.0))


_define = partial(
    Property.define,
    cases=Cases.random(smooth_cases),
    cases_in_space=Cases.random(smooth_surface_cases),
    promise=promise_exact_tangent,
    needs=frozenset({"tangent"}),
    asks=WITH_BARRIER,
)


@_define(id="tangent.sparsity", rank=30, turn=9, quantities=(BLOCK, COMPLEX_BLOCK, LACKING))
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

    A tangent of which the traits state an error δ may be wrong by s δ max(S/ℓ, 1) more. Where the residual of a failing
    block bends over a length λ < ℓ, the block is judged again with λ in place of ℓ. A failure names row and column of
    the worst entry, its value and the derivative.

    **Undecided.** Only where nothing else fails: a failing block whose one-sided differences disagree, unless the
    tangent is the derivative to one side; and a failing block whose residual bends over less than ℓ/1024.
    """
    return measure_blocks(case, subject)


@_define(
    id="tangent.long",
    rank=20,
    quantities=(BLOCK, COMPLEX_BLOCK, LACKING),
    cases=Cases.from_list(long_states),
    cases_in_space=Cases.from_list(long_face_states),
)
def tangent_long(case: Case, subject: Subject) -> Measurement:
    """Each block of the tangent of a long interface is the derivative of the residual.

    **Question.** Six interfaces have 104 to 200 segments on one side: wavy, graded, a ring, three chains, many segments
    on few, and few on many. In space four have 128 triangles or 64 quadrilaterals. Is each block of the tangent the
    derivative of the residual?

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
    comparison = _compare_blocks(judge)
    excess, kinked, bent = _excuse(judge, comparison)
    part = np.ix_(judge.groups.of_unknowns, judge.groups.of_unknowns)
    # Blocks that do not fail lack nothing.
    unstored = ~judge.pattern & (np.abs(comparison.derivative) > comparison.tolerance[part]) & (excess[part] > 1)
    row, column = map(int, np.unravel_index(int(excess.argmax()), excess.shape))
    size = float(comparison.largest[row, column]) or 1.0
    value, lacking = float(excess[row, column]), int(unstored.sum())
    error = float(comparison.error[row, column]) / size if value else 0.0  # A block that is excused has none.
    undecided, finding = "", None
    if value > 1:
        length = _step(case, np.float64)
        undecided = excuse_barrier(judge.state, max(STEPS) * length, length, float(comparison.error[row, column]))
        finding = _worst_entry(judge, comparison, row, column)
    elif kinked and not lacking:
        undecided = f"a kink: one-sided differences disagree in {kinked} blocks"
    elif bent and not lacking:
        undecided = f"roundoff: {bent} blocks bend over lengths that are too short for differences"
    quantity = COMPLEX_BLOCK if judge.by_complex_step else BLOCK
    numbers = [quantity.check(error, error / value if value else EXACT), LACKING.check(float(lacking), 0.0)]
    return Measurement(
        [] if undecided and value <= 1 else numbers,
        undecided=undecided,
        finding=finding,
        details={
            "blocks": float((comparison.largest > 0).sum()),
            "blocks at a kink": float(kinked),
            "blocks that bend too sharply": float(bent),
        },
        idle=not judge.tangent.any() and not comparison.derivative.any(),
    )


def _worst_entry(judge: BlockJudge, comparison: _Comparison, row: int, column: int) -> Finding:
    groups = judge.groups
    part = np.ix_(*(unknowns[unknowns >= 0] for unknowns in groups.unknowns[[row, column]]))
    errors = np.abs(judge.tangent[part] - comparison.derivative[part])
    first, second = divmod(int(errors.argmax()), errors.shape[1])
    i, j = int(part[0][first, 0]), int(part[1][0, second])
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


def _excuse(judge: BlockJudge, comparison: _Comparison) -> tuple[FloatArray, int, int]:
    """Return the excess (count, count) of the blocks that are not excused, and how many kinks and bends excuse."""
    excess, kinked, bent = comparison.excess, 0, 0
    order = np.argsort(-excess, axis=None)[: int((excess > 1).sum())]
    columns: dict[int, _Sides] = {}
    for place in order:
        row, column = divmod(int(place), excess.shape[1])
        if column not in columns:
            columns[column] = _Sides.of_column(judge, column)
        sides = columns[column].in_row(judge, row)
        block, around = comparison.largest[row, column], comparison.surroundings[row, column]
        bending = sides.bending(float(around))
        allowed = float(judge.tolerate(block, around, np.asarray(max(bending, SHORTEST_BENDING))))
        excess[row, column] = comparison.error[row, column] / allowed
        if excess[row, column] <= 1:
            continue
        if bending < SHORTEST_BENDING:
            excess[row, column], bent = 0.0, bent + 1
        elif sides.jump() > JUMP * sides.step**2 * around and not judge.by_complex_step:
            excess[row, column] = 0.0
            kinked += not sides.is_one_sided(2 * allowed)
        else:
            break
    return excess, kinked, bent


class _Sides(NamedTuple):
    """One-sided differences of some rows and columns, in doubles or better."""

    ahead: FloatArray  # (n_steps, n_columns, n_rows) The differences to both sides, for the steps in STEPS.
    behind: FloatArray
    tangent: FloatArray  # (n_columns, n_rows) The columns of the tangent.
    step: float  # The step h over ℓ; its square is the accuracy of a difference, (uS/ℓ)^(2/3).

    @classmethod
    def of_column(cls, judge: BlockJudge, column: int) -> _Sides:
        columns, case = np.flatnonzero(judge.groups.of_unknowns == column), judge.state.case
        dtype = np.float64 if judge.by_complex_step else judge.dtype
        ahead, behind = _both_sides(judge.state, single_moves(columns, judge.groups.size).directions(), dtype)
        return cls(ahead, behind, judge.tangent[:, columns].T, _step(case, dtype) / case.resolution)

    def in_row(self, judge: BlockJudge, row: int) -> _Sides:
        rows = judge.groups.of_unknowns == row
        return _Sides(self.ahead[..., rows], self.behind[..., rows], self.tangent[:, rows], self.step)

    def bending(self, size: float) -> float:
        """Return the length over ℓ over which a residual with derivatives of this size bends; 1 if it is longer."""
        central = (self.ahead + self.behind) / 2
        third = np.abs(central[0] - central[1]).max() / ((STEPS[0] ** 2 - STEPS[1] ** 2) * self.step**2)
        bending = float(np.sqrt(size / third)) if third > 0 else 1.0
        return bending if bending < 0.5 else 1.0

    def jump(self) -> float:
        """Return by how much the derivative jumps at the state, without what a smooth residual bends by."""
        return float(np.abs(_extrapolate(self.ahead - self.behind)).max())

    def is_one_sided(self, tolerance: float) -> bool:
        """Return whether the block of the tangent is the derivative to one side."""
        sides = (np.abs(_extrapolate(side) - self.tangent) <= tolerance for side in (self.ahead, self.behind))
        return any(bool(side.all()) for side in sides)


def _extrapolate(differences: FloatArray) -> FloatArray:
    """Return one-sided differences (n_steps, …) at a step of zero, from the two shorter steps."""
    ratio = STEPS[1] / STEPS[2]
    return np.asarray((ratio * differences[2] - differences[1]) / (ratio - 1))


# Combinations of directions that are shorter than this share s of the longest are left out. A central difference is
# exact to u^(2/3), and its noise grows by 1/s as the combination is made as long as the others. Both are equal at
# s = u^(1/3): what is left out is no larger than the noise of what stays.
_SMALLEST_SHARE = UNIT_ROUNDOFF ** (1 / 3)
NOT_ANALYTIC = "real differences agree with the tangent: is a norm, abs, conj or real part in the residual?"
N_DIRECTIONS = 8
TAYLOR_STEPS = (2.0**-8, 2.0**-12)  # Steps over ℓ.
STEP_RATIO = 8.0  # A slope is taken between two steps only if one is so many times the other.
SLOPE = 1.9
CENTRAL = Quantity(
    "error against a central difference",
    "30 (uS/ℓ)^(2/3)",
    "Truncation (h/ℓ)² and roundoff uS/h are equal at h = ℓ (uS/ℓ)^(1/3). The factor 30 is for the third derivative.",
)
TAYLOR = Quantity(
    "slope of the Taylor remainder",
    "1.9",
    "The remainder |R(x+hd) − R − hKd| falls like h², less what is left of h³.",
    sense="at least",
)
COMPLEX = Quantity(
    "error against a complex step",
    "1e-11 + 64 uS/ℓ",
    "A complex step has no truncation. Rounding the ends of a segment turns it by uS/ℓ.",
)


@_define(id="tangent.directional", rank=0, quantities=(CENTRAL, TAYLOR, COMPLEX))
def tangent_directional(case: Case, subject: Subject) -> Measurement:
    """The tangent is the derivative of the residual on a frozen pairing.

    **Question.** Along some directions, does the tangent give the same change as differences of the residual?

    **Why it matters.** A wrong term in the tangent does not change the result, so no patch test finds it. It costs
    iterations, and makes an analysis diverge where the right tangent converges.

    **How it is judged.** The pairing stays frozen, so the residual is smooth. Eight directions move all unknowns at
    random, and others the nodes of one chain, or the multipliers. Two more follow from what was found: the defect of
    the worst direction, and the leading singular direction of the tangent minus its difference quotient on all
    directions before. Two conditions hold together, since the steps of the Taylor slope, ℓ/256 and ℓ/4096, are too long
    to show an error of 1e-4 in one entry, and a central difference has an error of its own:

    - The best central difference over three steps differs by at most 30 (uS/ℓ)^(2/3) at each node. That is relative to
      the largest derivative there, or its change over ℓ, or the largest block of the tangent in the columns that the
      node feels. No norm over the whole matrix hides a small row, unless it is below uS/ℓ of the largest derivative:
      so much roundoff leaves at a node that a cell reaches by a rounding.
    - The Taylor remainder |R(x+hd) − R − hKd| falls with a slope of at least 1.9. A remainder at roundoff is exact.

    Where the plugin takes complex positions, a complex step differs by at most 1e-11 + 64 uS/ℓ, likewise. Of an error δ
    that the traits state, δ max(S/ℓ, 1) is allowed beside it, and a remainder below it is exact. Where the
    residual itself bends over a length λ < ℓ, as a segment seen nearly edge-on does, a failing case is judged again
    with λ in place of ℓ. Each block of the tangent by itself is the question of `tangent.sparsity`.

    Without a pairing, or where it has a handle, the residual decides anew at each state, and there is no complex step.

    **Undecided.** A failing case is undecided near a kink that the pairing does not freeze, or where the residual bends
    over less than ℓ/1024. A pairing that is another one wherever the nodes move holds numbers and not decisions; that
    fails, unless all of these pairings give the same forces to roundoff, in all states that differences are taken of.
    """
    state = freeze_state(case, subject)
    case, shortest = state.case, state.case.resolution
    stated = _stated_error(case, subject.traits)
    directions = first_directions(case, N_DIRECTIONS)
    undecided, broken = _check_pairing(state, directions)
    by_complex_step = subject.traits.abilities.takes_complex and not state.formulation.decides_anew(state.pairing)

    def measure_over(length: float) -> tuple[Measurement, float]:
        comparison = _compare(state, directions, length, stated)
        more = defect_directions(directions, comparison.defects)
        if len(more):
            comparison = comparison.join(_compare(state, more, length, stated))
        conditioning = UNIT_ROUNDOFF * case.largest_coordinate / length
        central, complex_step = 30 * conditioning ** (2 / 3) + stated, 1e-11 + 64 * conditioning + stated
        tolerances = {CENTRAL: central, TAYLOR: SLOPE, COMPLEX: complex_step}
        values, finding = {CENTRAL: comparison.error}, comparison.finding
        if np.isfinite(comparison.slope):
            values[TAYLOR] = comparison.slope
        if by_complex_step:
            along = np.vstack([directions, more])
            derivative, exact = along @ state.tangent.T, _complex_step(state, along)
            largest = np.maximum(np.abs(exact).max(axis=0), np.abs(derivative).max(axis=0))
            sizes = _row_sizes(state, largest, comparison.turns)
            values[COMPLEX], worst = _worst_row(case, np.abs(exact - derivative), sizes, derivative, exact)
            if values[COMPLEX] > tolerances[COMPLEX]:
                # Real differences would have seen an error of the tangent that is so large.
                real_agrees = values[CENTRAL] <= tolerances[CENTRAL] < values[COMPLEX] / 2
                finding = replace(worst, remark=NOT_ANALYTIC if real_agrees else "")
        numbers, idle = check_all(values, tolerances), comparison.bending == np.inf
        measurement = Measurement(numbers, undecided, broken, {"length": length}, idle=idle, finding=finding)
        return measurement, comparison.bending

    first, bending = measure_over(shortest)
    if judge(tangent_directional, first)[0] is not Verdict.FAIL:
        return replace(first, finding=None)
    if first.finding is not None:
        longest, step, _ = _central_steps(case, shortest)
        error = abs(first.finding.found[0] - first.finding.right[0])
        if excuse := excuse_barrier(state, longest, step, error):
            return replace(first, undecided=excuse)
    if bending >= shortest / 2:
        return first
    second, _ = measure_over(max(bending, SHORTEST_BENDING * shortest))
    if bending < SHORTEST_BENDING * shortest and not undecided:
        return replace(second, undecided=f"roundoff: the residual bends over {bending:.2g}, too short for differences")
    return second


@dataclass(frozen=True, slots=True, eq=False)
class _Directional:
    error: float  # The largest error against the best central difference, over the size of the derivative at its node.
    # The least slope of the Taylor remainder; infinite where all remainders are roundoff, or the residual has none.
    slope: float
    bending: float  # The length over which the residual is seen to bend, see `_compare`.
    defects: FloatArray  # (n_directions, n_unknowns) The tangent times each direction, minus the central difference.
    finding: Finding | None  # The row of the largest error.
    # (n_unknowns,) The change of the derivative in each row over a length ℓ, from the third derivative.
    turns: FloatArray

    def join(self, other: _Directional) -> _Directional:
        """Return the worse of both."""
        return replace(
            self if self.error >= other.error else other,
            slope=min(self.slope, other.slope),
            bending=min(self.bending, other.bending),
            turns=np.maximum(self.turns, other.turns),
        )


def _compare(state: FrozenState, directions: FloatArray, length: float, stated: float) -> _Directional:
    """Compare derivatives along directions (n, n_unknowns) with central differences and Taylor remainders, all at once.

    Steps are shares of the length over which the residual is taken to bend. The length over which it does bend is the
    root of its size over its third derivative, from the central differences of two steps. The tangent plays no part in
    it. `stated` is the relative error that the traits state of the tangent.
    """
    case, n = state.case, len(STEPS)
    derivative = directions @ state.tangent.T  # (n_directions, n_unknowns)
    steps = _all_steps(case, length)
    central = steps[:n]
    batch = case.z + steps[:, None, None] * directions  # (n_steps, n_directions, n_unknowns)
    forces = state.residual_at(np.concatenate([batch.reshape(-1, case.z.size), case.z[None]]))
    here, moved = forces[-1], forces[:-1].reshape(batch.shape)

    slopes = (moved[:n] - moved[n : 2 * n]) / (2 * central[:, None, None])
    size = max(np.abs(derivative).max(), np.abs(slopes).max())
    if size == 0:
        return _Directional(0.0, np.inf, np.inf, 0 * derivative, None, 0 * case.z)
    errors = np.abs(slopes - derivative)  # (n_steps, n_directions, n_unknowns)
    best = errors.max(axis=2).argmin(axis=0)
    closest = np.take_along_axis(slopes, best[None, :, None], axis=0)[0]
    third = np.abs(slopes[0] - slopes[1]).max(axis=0) / (central[0] ** 2 - central[1] ** 2)  # Third derivative / 6.
    turns = third * case.resolution**2
    sizes = _row_sizes(state, np.maximum(np.abs(derivative).max(axis=0), np.abs(slopes).max(axis=(0, 1))), turns)
    error, finding = _worst_row(case, errors.min(axis=0), sizes, derivative, closest)
    forward = np.r_[0, 2 * n : len(steps)]  # The longest central step serves here too.
    floors = size * (1e3 * UNIT_ROUNDOFF * case.largest_coordinate + stated * steps[forward])

    def slope_of(derivatives: FloatArray) -> float:
        remainders = moved[forward] - here - steps[forward, None, None] * derivatives
        return taylor_slope(np.abs(remainders).max(axis=2), steps[forward], floors)

    slope = slope_of(derivative)
    if slope < SLOPE and slope_of(closest) < SLOPE:  # The best difference has no better one: no smooth residual.
        slope = np.inf
    bending = float(np.sqrt(size / third.max())) if third.any() else np.inf
    return _Directional(error, slope, bending, derivative - closest, finding, turns)


def _row_sizes(state: FrozenState, derivatives: FloatArray, turns: FloatArray) -> FloatArray:
    """Return the size (n_unknowns,) of the derivative at the node of each row.

    It is the largest of these derivatives (n_unknowns,) there, or their change over ℓ, `turns` (n_unknowns,), or
    the largest block of the tangent in a column that the node feels: what cancels in a row is rounded like that.
    """
    groups = _groups_of(state.case)
    blocks = groups.largest(state.tangent)
    around = np.where(blocks > 0, groups.surroundings(blocks), 0.0).max(axis=1)
    at_nodes = np.zeros(groups.count)
    np.maximum.at(at_nodes, groups.of_unknowns, np.maximum(derivatives, turns))
    return np.asarray(np.maximum(at_nodes, around)[groups.of_unknowns])


def _worst_row(
    case: Case, errors: FloatArray, sizes: FloatArray, derivative: FloatArray, difference: FloatArray
) -> tuple[float, Finding]:
    """Return the largest error over the size of its row, and that row.

    Rounding the positions moves the ends of what a point, a cell or an area reaches by uS. A node that is reached by no
    more than that has a derivative of uS/ℓ of the largest one, and whether it is 0 or as large is no error.
    """
    dust = _roundoff(case, np.float64) * np.abs(difference).max()
    relative = _over(np.where(errors > dust, errors, 0.0), sizes)
    number, row = divmod(int(relative.argmax()), relative.shape[1])
    place = f"row {row} ({_groups_of(case).describe(row)})"
    found, right = (derivative[number, row],), (difference[number, row],)
    finding = Finding(place, found, right, "N m-1", found_name="tangent times direction", right_name="derivative")
    return float(relative[number, row]), finding


def taylor_slope(remainders: FloatArray, steps: FloatArray, floors: FloatArray) -> float:
    """Return the slope of log |remainder| over log h: the best between two steps, the worst over the directions.

    Remainders are (n_steps, n_directions), the steps h (n_steps,) in any order. Two steps count only where one is
    `STEP_RATIO` times the other: between two that are nearly equal, the slope is noise. A remainder below its floor
    (n_steps,) is roundoff, and a direction that has no slope because of that is exact.
    """
    best = np.full(remainders.shape[1], -np.inf)
    decided = np.zeros(remainders.shape[1], dtype=bool)
    for long, short in permutations(range(len(steps)), 2):
        if steps[long] < STEP_RATIO * steps[short]:
            continue
        above = remainders[short] > floors[short]
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.log(remainders[long] / remainders[short]) / np.log(steps[long] / steps[short])
        best = np.where(above, np.maximum(best, slope), best)
        decided |= above
    return float(best[decided].min(initial=np.inf))


def _central_steps(case: Case, length: float) -> FloatArray:
    return np.asarray(np.array(STEPS) * length * (UNIT_ROUNDOFF * case.largest_coordinate / length) ** (1 / 3))


def _all_steps(case: Case, length: float) -> FloatArray:
    """Return the steps of central differences, the same backwards, and those of Taylor remainders."""
    central = _central_steps(case, length)
    return np.concatenate([central, -central, np.array(TAYLOR_STEPS) * length])


def _check_pairing(state: FrozenState, directions: FloatArray) -> tuple[str, str]:
    """Return why the pairing makes a failure undecided, and how it breaks the contract; both empty if it does neither.

    A pairing that is another one at every place, however near, holds numbers and not decisions, and on such a pairing
    no difference shows a missing term. A pairing that changes here and there, as ties by roundoff do, is no breach, nor
    is one whose changes do not count, as those of points that are not active.
    """
    case, direction = state.case, directions[0]
    step = _central_steps(case, case.resolution)[-1]

    def pair(shifts: Iterable[float]) -> list[Pairing | None]:
        return [state.formulation.pair(case.interface, case.z + shift * step * direction) for shift in shifts]

    if state.pairing is not None and pair((1, -1)) == [state.pairing] * 2:
        return "", ""
    if (kink := find_kink(state, 4 * step, direction)) or state.pairing is None:
        return kink, ""
    beside = [pair(sign * 2.0**-10 * np.arange(1, 4)) for sign in (1, -1)]
    if all(pairing == first for first, *others in beside for pairing in others):
        return "a kink: the pairing changes here, and is steady on either side", ""
    around = [pair(scale * np.arange(-2, 4)) for scale in (1, 2.0**-5, 2.0**-10)]
    differ = all(first != second for pairings in around for first, second in combinations(pairings, 2))
    if differ and _change_forces(list(chain(*around)), state, directions):
        return "", "the pairing is another one wherever the nodes move: it holds numbers, not decisions"
    return "", ""


def _change_forces(pairings: Sequence[Pairing | None], state: FrozenState, directions: FloatArray) -> bool:
    """Return whether any pairing changes the residual by more than roundoff, where differences are taken of it."""
    case = state.case
    moves = (_all_steps(case, case.resolution)[:, None, None] * directions).reshape(-1, case.z.size)
    places = np.concatenate([case.z[None], case.z + moves])
    forces = state.residual_at(places)
    slope = (np.abs(forces[1:] - forces[0]).max(axis=1) / np.abs(moves).max(axis=1)).max()
    roundoff = COORDINATE_ROUNDING * case.largest_coordinate * slope
    others = (replace(state, pairing=pairing).residual_at(places) for pairing in pairings)
    return any(np.abs(other - forces).max() > roundoff for other in others)


def first_directions(case: Case, n_random: int) -> FloatArray:
    """Return random directions (n, n_unknowns) that move all unknowns, one for each chain, and one for the multipliers.

    The largest entry of each is ±1.
    """
    dim, nodes = case.interface.dim, [*_chains(case.interface.slave), *_chains(case.interface.master)]
    regions = [(dim * np.sort(chain)[:, None] + np.arange(dim)).reshape(-1) for chain in nodes]
    if case.n_multipliers:
        regions.append(np.arange(case.interface.n_unknowns, case.z.size))
    moves = random_directions(case.seed, n_random + len(regions), case.z.size)
    local = np.zeros((len(regions), case.z.size))
    for number, unknowns in enumerate(regions):
        part = moves[n_random + number, unknowns]
        local[number, unknowns] = part / np.abs(part).max()
    return np.vstack([moves[:n_random], local])


def defect_directions(directions: FloatArray, defects: FloatArray) -> FloatArray:
    """Return the largest defect, and the leading singular direction of what maps directions to defects, (2, n).

    Defects (n_directions, n) are the tangent times a direction, minus the difference quotient along it. The singular
    direction is the one in the span of the directions with the largest defect for its length. Where there is no defect,
    there are no directions, (0, n). The largest entry of each is ±1.
    """
    worst = defects[np.abs(defects).max(axis=1).argmax()]
    if not worst.any():
        return np.empty((0, directions.shape[1]))
    basis, sizes, weights = np.linalg.svd(directions.T, full_matrices=False)
    spanned = sizes > _SMALLEST_SHARE * sizes[0]  # There may be more directions than unknowns.
    on_basis = defects.T @ (weights[spanned].T / sizes[spanned])  # The map on the basis, (n, n_spanned).
    singular = basis[:, spanned] @ np.linalg.svd(on_basis, full_matrices=False)[2][0]
    both = np.array([worst, singular])
    return np.asarray(both / np.abs(both).max(axis=1, keepdims=True))


def _chains(surface: Surface) -> list[IntArray]:
    """Return the nodes of each chain of a surface, or of each part of it that hangs together."""
    n_nodes, corners = int(surface.faces.max()) + 1, surface.faces.T
    edges = np.concatenate([corners[[k, k + 1]] for k in range(len(corners) - 1)], axis=1)
    links = csr_array((np.ones(edges.shape[1]), tuple(edges)), shape=(n_nodes, n_nodes))
    _, label = csgraph.connected_components(links, directed=False)
    nodes = surface.nodes
    return [nodes[label[nodes] == number] for number in np.unique(label[nodes])]
