"""The cells of a pairing and the quadrature points on them: c, ξ, gap, length, normal, and their Δ, for many states.

`Cells` are decisions, what a pairing holds; `Quadrature` puts points on them and computes every real number from the
positions, in float64 or complex128. What is done with the points is elsewhere: forces in `transmission`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
from contactverif.geometry.compiled import compiled
from contactverif.geometry.projection import frame, node, search_tree
from contactverif_mortar.geometry import (
    D_C,
    D_WEIGHT,
    ONE,
    TWO,
    cut_gains,
    end_normals,
    facing_point,
    point_gains,
    seen_from,
    turn_of_ends,
)
from contactverif_mortar.search import averaging, find_cells, longest_of_chain

C, XI, GAP, WEIGHT, NORMAL_X, NORMAL_Y = range(6)  # what a point is


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Pairs of a slave and a master segment, in the order of the slave segments.

    Attributes
    ----------
    slave, master : IntArray, shape (n_cells,)
        The segments.
    cut_low, cut_high : BoolArray, shape (n_cells,)
        A master node cuts the lower end (the second node) and the upper end (the first).
    before, behind : IntArray, shape (n_slave_segments,)
        The segments with which normals at the two ends are averaged, −1 none.
    """

    slave: IntArray
    master: IntArray
    cut_low: BoolArray
    cut_high: BoolArray
    before: IntArray
    behind: IntArray

    @classmethod
    def find(cls, interface: Interface, x: FloatArray, averaged: bool) -> Cells:
        """The cells at the positions x (n_nodes, 2)."""
        slave, master = interface.slave, interface.master
        before = behind = np.full(len(slave), -1)
        if averaged:
            before, behind = averaging(x, slave.segments, slave.neighbours)
        found = find_cells(
            x,
            slave.segments,
            master.segments,
            before,
            behind,
            longest_of_chain(slave, x),
            longest_of_chain(master, x),
            *search_tree(master, x),
        )
        return cls(*found, before, behind)

    @classmethod
    def of(cls, pairing: Pairing) -> Cells:
        """The cells that a pairing holds."""
        return cls(*(pairing[entry.name] for entry in fields(cls)))

    def as_arrays(self) -> dict[str, IntArray | BoolArray]:
        """For a pairing."""
        return {entry.name: getattr(self, entry.name) for entry in fields(self)}

    def where(self, some: BoolArray | IntArray) -> Cells:
        """Some of the cells, by mask or number."""
        return Cells(
            self.slave[some], self.master[some], self.cut_low[some], self.cut_high[some], self.before, self.behind
        )

    def near(self, nodes: BoolArray, interface: Interface) -> Cells:
        """Those whose slave segment has one of some slave nodes, by mask (n_slave_nodes,)."""
        first, second = nodes[interface.slave.segments].T
        return self.where((first | second)[self.slave])

    def local_nodes(self, interface: Interface) -> IntArray:
        """Node numbers (n_cells, n_local) of A, B, 1, 2, and with averaged normals of the slave's nodes around A B."""
        slave, master = interface.slave.segments, interface.master.segments
        ends = [slave[self.slave], master[self.master]]
        if self.averaged:
            around = [
                np.where(other >= 0, slave[other, end], slave[:, 0])  # of no segment: any node, its Δ is zero
                for end, other in enumerate((self.before, self.behind))
            ]
            ends.append(np.column_stack(around)[self.slave])
        return np.hstack(ends)

    @property
    def averaged(self) -> bool:
        """Whether any normals are averaged."""
        return bool((self.before >= 0).any() or (self.behind >= 0).any())


@dataclass(frozen=True, slots=True, eq=False)
class Quadrature:
    """Points on each cell, and where their lengths are measured.

    Attributes
    ----------
    places, weights : FloatArray, shape (n_q,)
        On [−1, 1], weights that add up to 1.
    current : bool
        Lengths are those of the current configuration, else of the reference.
    """

    places: FloatArray
    weights: FloatArray
    current: bool

    @classmethod
    def gauss(cls, n: int, current: bool) -> Quadrature:
        """n Gauss points, exact for polynomials of degree 2n − 1."""
        places, weights = np.polynomial.legendre.leggauss(n)
        return cls(places, weights / 2, current)

    def __len__(self) -> int:
        return len(self.places)

    def points(self, interface: Interface, cells: Cells, x: Array) -> Array:
        """The points (n_states, n_cells n_q, 6: c, ξ, gap, weight, normal out of the slave) at x (n_states, n, 2)."""
        return _points(x, *self._arguments(interface, cells))

    def gains(self, interface: Interface, cells: Cells, x: FloatArray) -> FloatArray:
        """Their Δ (n_cells n_q, 5: c, ξ, gap, weight, turn, n_local, 2) at x (n, 2)."""
        n_local = 6 if cells.averaged else 4
        return _gains(x, n_local, *self._arguments(interface, cells))

    def _arguments(self, interface: Interface, cells: Cells) -> tuple[Any, ...]:
        return (
            interface.slave.lengths(interface.nodes),
            interface.slave.segments,
            interface.master.segments,
            cells.slave,
            cells.master,
            cells.cut_low,
            cells.cut_high,
            cells.before,
            cells.behind,
            self.places,
            self.weights,
            self.current,
        )


@compiled
def _points(
    x: Array,
    reference_length: FloatArray,
    slave: IntArray,
    master: IntArray,
    cell_slave: IntArray,
    cell_master: IntArray,
    cut_low: BoolArray,
    cut_high: BoolArray,
    before: IntArray,
    behind: IntArray,
    places: FloatArray,
    weights: FloatArray,
    current: bool,
) -> Array:
    n_q = len(places)
    found = np.empty((x.shape[0], len(cell_slave) * n_q, 6), dtype=x.dtype)
    for state in range(x.shape[0]):
        now = x[state]
        for cell in range(len(cell_slave)):
            s, m = cell_slave[cell], cell_master[cell]
            x_a, x_b = node(now, slave[s, 0]), node(now, slave[s, 1])
            x_1, x_2 = node(now, master[m, 0]), node(now, master[m, 1])
            n_a, n_b = end_normals(now, slave, s, before[s], behind[s])
            straight = before[s] < 0 and behind[s] < 0
            low, high = 0 * x_a[0] - 1, 0 * x_a[0] + 1  # of the type of x
            if cut_low[cell]:
                low = seen_from(x_2, x_a, x_b, n_a, n_b, straight)
            if cut_high[cell]:
                high = seen_from(x_1, x_a, x_b, n_a, n_b, straight)
            length, _, _ = frame(x_a, x_b)
            if not current:
                length = 0 * length + reference_length[s]
            for q in range(n_q):
                c = (low + high) / 2 + (high - low) / 2 * places[q]
                xi, gap, n = facing_point(x_a, x_b, n_a, n_b, x_1, x_2, c)
                point = found[state, cell * n_q + q]
                point[C], point[XI], point[GAP] = c, xi, gap
                point[WEIGHT] = weights[q] * (high - low) / 2 * length
                point[NORMAL_X], point[NORMAL_Y] = n
    return found


@compiled
def _gains(
    x: FloatArray,
    n_local: int,
    reference_length: FloatArray,
    slave: IntArray,
    master: IntArray,
    cell_slave: IntArray,
    cell_master: IntArray,
    cut_low: BoolArray,
    cut_high: BoolArray,
    before: IntArray,
    behind: IntArray,
    places: FloatArray,
    weights: FloatArray,
    current: bool,
) -> FloatArray:
    n_q = len(places)
    found = np.zeros((len(cell_slave) * n_q, 5, n_local, 2))
    d_omega_a, d_omega_b, d_low, d_high = np.zeros((4, n_local, 2))
    for cell in range(len(cell_slave)):
        s, m = cell_slave[cell], cell_master[cell]
        x_a, x_b = node(x, slave[s, 0]), node(x, slave[s, 1])
        x_1, x_2 = node(x, master[m, 0]), node(x, master[m, 1])
        n_a, n_b = end_normals(x, slave, s, before[s], behind[s])
        straight = before[s] < 0 and behind[s] < 0
        d_omega_a[:], d_omega_b[:], d_low[:], d_high[:] = 0.0, 0.0, 0.0, 0.0
        turn_of_ends(x, slave, s, before[s], behind[s], d_omega_a, d_omega_b)
        low, high = -1.0, 1.0
        if cut_low[cell]:
            low = seen_from(x_2, x_a, x_b, n_a, n_b, straight)
            cut_gains(d_low, low, TWO, x_2, x_a, x_b, n_a, n_b, d_omega_a, d_omega_b)
        if cut_high[cell]:
            high = seen_from(x_1, x_a, x_b, n_a, n_b, straight)
            cut_gains(d_high, high, ONE, x_1, x_a, x_b, n_a, n_b, d_omega_a, d_omega_b)
        length, t_s, _ = frame(x_a, x_b)
        if not current:
            length = reference_length[s]
        for q in range(n_q):
            gains = found[cell * n_q + q]
            for k in range(n_local):
                for i in range(2):
                    spread = d_high[k, i] - d_low[k, i]
                    gains[D_C, k, i] = (d_low[k, i] + d_high[k, i]) / 2 + spread / 2 * places[q]
                    gains[D_WEIGHT, k, i] = weights[q] * spread / 2 * length
            if current:  # Δl_AB = t_AB·(Δx_B − Δx_A)
                share = weights[q] * (high - low) / 2
                for i in range(2):
                    gains[D_WEIGHT, 0, i] -= share * t_s[i]
                    gains[D_WEIGHT, 1, i] += share * t_s[i]
            c = (low + high) / 2 + (high - low) / 2 * places[q]
            point_gains(gains, c, x_a, x_b, n_a, n_b, x_1, x_2, d_omega_a, d_omega_b)
    return found
