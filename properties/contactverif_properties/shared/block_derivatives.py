"""The derivative of a residual column by column, for each block: the rows of a node × the columns of a node.

Each column is the change of the residual when one unknown moves. On a long interface, unknowns that are far from each
other move together, since no row feels two of them. Which rows feel which unknown is read from the mesh and from the
pattern of the tangent. So a derivative that shows in any other row belongs to an entry that the pattern lacks.

Rules for the next editor:

- The pattern of the tangent saves calls and decides nothing: what looks wrong is measured again, one unknown at a time.
- Nothing here is scaled by a norm over the whole matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, BoolArray, FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE, Interface
from contactverif_properties.shared.frozen_state import FrozenState

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
    def of_unknowns(self) -> IntArray:
        """The node or multiplier (size,) that each unknown belongs to."""
        return np.concatenate(
            [np.repeat(np.arange(self.n_nodes), self.dim), self.n_nodes + np.arange(self.n_multipliers)]
        )

    def largest(self, matrix: FloatArray) -> FloatArray:
        """Return the largest absolute entry of each block (count, count) of a matrix (size, size)."""
        entries, dim, behind = np.abs(matrix), self.dim, self.dim * self.n_nodes
        largest = np.maximum.reduce([entries[axis:behind:dim] for axis in range(dim)])
        rows = np.concatenate([largest, entries[behind:]])
        columns = np.maximum.reduce([rows[:, axis:behind:dim] for axis in range(dim)])
        return np.concatenate([columns, rows[:, behind:]], axis=1)

    def surroundings(self, blocks: FloatArray) -> FloatArray:
        """Return for each block the largest block of its row or its column, all (count, count).

        Columns of nodes and of multipliers have different units, and so have rows. Each kind counts apart.
        """
        scale = np.empty_like(blocks)
        kinds = (slice(0, self.n_nodes), slice(self.n_nodes, self.count))
        for rows in kinds:
            for columns in kinds:
                part = blocks[rows, columns]
                if part.size:
                    scale[rows, columns] = np.maximum(part.max(axis=1, keepdims=True), part.max(axis=0, keepdims=True))
        return scale

    def describe(self, unknown: int) -> str:
        """Return the kind and number of an unknown in words: "y of slave node 3"."""
        if unknown >= self.dim * self.n_nodes:
            return f"multiplier {unknown - self.dim * self.n_nodes}"
        node, axis = divmod(unknown, self.dim)
        return f"{'xyz'[axis]} of {'slave' if node < self.n_slave else 'master'} node {node}"


def groups_of(case: Case) -> Groups:
    """Return the nodes and multipliers of a case."""
    return Groups(case.interface.n_slave_nodes, case.interface.n_nodes, case.n_multipliers, case.interface.dim)


@dataclass(frozen=True, slots=True, eq=False)
class Moves:
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
    return Moves([columns[k : k + 1] for k in range(len(columns))], np.repeat(columns[:, None], size, axis=1))


def plan_moves(case: Case, pattern: BoolArray) -> Moves:
    """Return moves that cover all unknowns: one by one on a short interface, many together on a long one.

    The pattern (size, size) are the entries that the tangent has.
    """
    groups = groups_of(case)
    if groups.count <= MOST_SINGLE:
        return single_moves(np.arange(groups.size), groups.size)
    contacts = _find_contacts(case.interface, groups, pattern)
    members, owners = [], []
    of_unknowns = groups.of_unknowns
    for colour in _colours(contacts):
        owner = np.full(groups.count, -1)
        for group in colour:
            owner[contacts.indices[contacts.indptr[group] : contacts.indptr[group + 1]]] = group
        for axis in range(groups.dim):
            moved = colour if axis == 0 else [group for group in colour if group < groups.n_nodes]
            columns = np.array([_unknown(groups, group, axis) for group in moved])
            if len(columns):
                of_rows = owner[of_unknowns]
                has = (of_rows >= 0) & ((axis == 0) | (of_rows < groups.n_nodes))
                members.append(columns)
                owners.append(np.where(has, _unknown(groups, of_rows, axis), -1))
    return Moves(members, np.array(owners))


def _unknown(groups: Groups, group: IntArray | int, axis: int) -> IntArray:
    """Return the unknown of a node along an axis, or the one of a multiplier."""
    behind = (groups.dim - 1) * groups.n_nodes
    return np.where(np.less(group, groups.n_nodes), np.multiply(group, groups.dim) + axis, np.add(group, behind))


def _find_contacts(interface: Interface, groups: Groups, pattern: BoolArray) -> sparse.csr_array:
    """Return which nodes and multipliers (count, count) feel each other, as a symmetric matrix."""
    rows, columns = (groups.of_unknowns[index] for index in np.nonzero(pattern))
    corners = [surface.faces.T for surface in (interface.slave, interface.master)]
    pairs = [side[[first, second]] for side in corners for first, second in combinations(range(len(side)), 2)]
    first, second = np.concatenate(pairs, axis=1)
    itself = np.arange(groups.count)
    i = np.concatenate([rows, columns, first, second, itself])
    j = np.concatenate([columns, rows, second, first, itself])
    return sparse.csr_array((np.ones(len(i)), (i, j)), shape=(groups.count, groups.count))


def _colours(contacts: sparse.csr_array) -> list[list[int]]:
    """Return sets of nodes and multipliers of which no two are felt in one row."""
    conflicts = sparse.csr_array(contacts @ contacts)
    colour = np.full(contacts.shape[0], -1)
    for group in range(len(colour)):
        used = set(colour[conflicts.indices[conflicts.indptr[group] : conflicts.indptr[group + 1]]].tolist())
        colour[group] = next(number for number in range(len(colour)) if number not in used)
    return [np.flatnonzero(colour == number).tolist() for number in range(int(colour.max()) + 1)]


def roundoff(case: Case, dtype: type) -> float:
    """Return u S/ℓ in a precision; u is 2⁻⁵³ for doubles."""
    unit = UNIT_ROUNDOFF if dtype is np.float64 else float(np.finfo(dtype).eps) / 2
    return unit * case.largest_coordinate / case.resolution


def step(case: Case, dtype: type) -> float:
    """Return the step h = ℓ (u S/ℓ)^(1/3), a length, at which truncation and roundoff are equal."""
    return case.resolution * float(np.cbrt(roundoff(case, dtype)))


def differences_by_complex_step(state: FrozenState, directions: FloatArray) -> FloatArray:
    """Return Im R(x + ihd)/h (n_directions, size) along directions d (n_directions, size) at a state x."""
    h = state.case.resolution * COMPLEX_STEP
    forces = state.residual_at(state.case.z + 1j * h * directions)
    return np.asarray(forces.imag / h, dtype=np.float64)


def differences_on_both_sides(state: FrozenState, directions: FloatArray, dtype: type) -> tuple[FloatArray, FloatArray]:
    """Return the differences ahead and behind, each (n_steps, n_directions, size), for the steps in STEPS."""
    steps = step(state.case, dtype) * np.array(STEPS, dtype=dtype)[:, None, None]
    z: Array = state.case.z.astype(dtype)
    states = np.stack([z + steps * directions, z - steps * directions])
    forces = state.residual_at(states.reshape(-1, z.size)).reshape(states.shape)
    here = state.residual_at(z[None])[0]
    ahead, behind = (forces[0] - here) / steps, (here - forces[1]) / steps
    return ahead.astype(np.float64), behind.astype(np.float64)
