"""The cells of a pairing, and the quadrature points on them with their Δ.

`Cells` are decisions: they come from `cell_search` and are stored in a pairing. `Quadrature` puts points on them and
computes every real number from the positions: `points` of many states, real or complex, `gains` of one real state.

A kernel gets the fields of a class of arrays as a plain tuple and unpacks them first: numba reads that in half
the time.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_maker, compile_part, match_precision
from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.interface import Interface, Surface
from contactverif.contract.pairing import Pairing
from contactverif.geometry.block_rows import AnyIntArray, NumberArray
from contactverif.geometry.projection import Vector, frame, node, search_tree
from contactverif_mortar.cell_geometry import (
    D_C,
    D_WEIGHT,
    NODE_1,
    NODE_2,
    A,
    B,
    SlaveView,
    cut_gains,
    facing_point,
    point_gains,
    seen_from,
    slave_view,
    turn_of_ends,
)
from contactverif_mortar.cell_search import averaging, find_cells, longest_of_chain

C, XI, GAP, WEIGHT, NORMAL_X, NORMAL_Y = range(6)  # The numbers of a point, in this order.
AREAS = {"current": True, "reference": False}  # The words of the option `area`.

Fields = tuple[Any, ...]  # The fields of a class of arrays, as a plain tuple.
Csr = tuple[AnyIntArray, AnyIntArray, FloatArray]  # The indptr, indices and data of compressed rows.


class Sides(NamedTuple):
    """The surfaces of an interface in their roles, or with the roles exchanged; the nodes keep their numbers."""

    nodes: FloatArray  # (n_nodes, 2), reference positions
    slave: Surface
    master: Surface

    @property
    def n_slave_nodes(self) -> int:
        """A number above those of all slave nodes."""
        return len(self.nodes)


class Segments(NamedTuple):
    """The arrays of an interface that the kernels read."""

    reference_length: FloatArray  # (n_slave_segments,)
    slave: IntArray  # (n_slave_segments, 2), nodes
    master: IntArray  # (n_master_segments, 2), nodes


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Pairs of a slave and a master segment, in the order of the slave segments."""

    slave: IntArray  # (n_cells,) The segments.
    master: IntArray
    # (n_cells,) A master node cuts the lower end (the second node) and the upper end (the first node).
    cut_low: BoolArray
    cut_high: BoolArray
    before: IntArray  # (n_slave_segments,) The segments with which normals at the two ends are averaged, −1 for none.
    behind: IntArray

    @classmethod
    def find(cls, interface: Interface | Sides, x: FloatArray, averaged: bool) -> Cells:
        """Find the cells at the positions x (n_nodes, 2)."""
        slave, master = interface.slave, interface.master
        before = behind = np.full(len(slave), -1)
        if averaged:
            before, behind = averaging(x, slave.segments, slave.neighbours)
        longest = longest_of_chain(slave, x), longest_of_chain(master, x)
        segments = slave.segments, master.segments
        return cls(*find_cells(x, *segments, before, behind, *longest, search_tree(master, x)), before, behind)

    @classmethod
    def from_pairing(cls, pairing: Pairing, prefix: str = "") -> Cells:
        """Return the cells of a pairing, whose names begin with a prefix."""
        return cls(*(pairing[prefix + entry.name] for entry in fields(cls)))

    def as_arrays(self, prefix: str = "") -> dict[str, IntArray | BoolArray]:
        """Return the arrays by name, for a pairing."""
        return {prefix + entry.name: getattr(self, entry.name) for entry in fields(self)}

    def select(self, selection: BoolArray | IntArray | slice) -> Cells:
        """Return some of the cells, selected by mask, number or range."""
        slave, master = self.slave[selection], self.master[selection]
        return Cells(slave, master, self.cut_low[selection], self.cut_high[selection], self.before, self.behind)

    def near(self, nodes: BoolArray, interface: Interface) -> Cells:
        """Return the cells whose slave segment has at least one of some slave nodes, given by mask (n_slave_nodes,)."""
        carrying = any_end(nodes, interface.slave.segments, self.slave)
        return self if carrying.all() else self.select(carrying)

    def local_nodes(self, interface: Interface | Sides) -> NumberArray:
        """Return the nodes (n_cells, n_local): A, B, 1, 2, and with averaged normals those before A and behind B."""
        arrays = (self.slave, self.master, self.before, self.behind)
        return _local_nodes(interface.slave.segments, interface.master.segments, *arrays, self.averaged)

    @property
    def averaged(self) -> bool:
        """True if any normals are averaged."""
        return bool((self.before >= 0).any() or (self.behind >= 0).any())


@dataclass(frozen=True, slots=True, eq=False)
class Quadrature:
    """A quadrature rule for each cell."""

    places: FloatArray  # (n_q,) Places on [−1, 1], and weights that add up to 1.
    weights: FloatArray
    current: bool  # Lengths are those of the current configuration; else those of the reference configuration.

    @classmethod
    def gauss(cls, n: int, current: bool) -> Quadrature:
        """Return the rule with n Gauss points, exact for polynomials of degree 2n − 1."""
        places, weights = np.polynomial.legendre.leggauss(n)
        return cls(places, weights / 2, current)

    def __len__(self) -> int:
        return len(self.places)

    def points(self, interface: Interface | Sides, cells: Cells, x: Array) -> Array:
        """Compute the points (n_states, n_cells × n_q, 6) at real or complex x (n_states, n_nodes, 2).

        Their numbers are c, ξ, gap (negative in penetration), weight (a length), and the normal out of the slave.
        """
        return _points(x, *self._arguments(interface, cells, x))

    def gains(self, interface: Interface, cells: Cells, x: FloatArray) -> FloatArray:
        """Compute Δ of c, ξ, gap, weight, and the turn ω of the normal: (n_cells × n_q, 5, n_local, 2)."""
        n_local = 6 if cells.averaged else 4
        return _gains(x, n_local, *self._arguments(interface, cells, x))

    def _arguments(self, interface: Interface | Sides, cells: Cells, x: Array) -> tuple[Fields, Fields, Fields]:
        """Return the fields of `Segments`, `Cells` and `Quadrature`."""
        reference, places, weights = match_precision(x, interface.nodes, self.places, self.weights)
        return (
            (interface.slave.lengths(reference), interface.slave.segments, interface.master.segments),
            (cells.slave, cells.master, cells.cut_low, cells.cut_high, cells.before, cells.behind),
            (places, weights, self.current),
        )


@compile_maker
def any_end(nodes: BoolArray, slave: IntArray, cell_slave: IntArray) -> BoolArray:
    """Return for each cell whether one of the ends of its slave segment is among some nodes, given by mask."""
    selection = np.empty(len(cell_slave), dtype=np.bool_)
    for cell in range(len(cell_slave)):
        s = cell_slave[cell]
        selection[cell] = nodes[slave[s, 0]] or nodes[slave[s, 1]]
    return selection


@compile_maker
def _local_nodes(
    slave: IntArray,
    master: IntArray,
    cell_slave: IntArray,
    cell_master: IntArray,
    before: IntArray,
    behind: IntArray,
    averaged: bool,
) -> NumberArray:
    """Return the local nodes of each cell; where a segment to average with is missing, A stands for it."""
    nodes = np.empty((len(cell_slave), 6 if averaged else 4), dtype=np.int32)
    for cell in range(len(cell_slave)):
        s, m = cell_slave[cell], cell_master[cell]
        nodes[cell, 0], nodes[cell, 1] = slave[s, 0], slave[s, 1]
        nodes[cell, 2], nodes[cell, 3] = master[m, 0], master[m, 1]
        if averaged:
            nodes[cell, 4] = slave[before[s], 0] if before[s] >= 0 else slave[s, 0]
            nodes[cell, 5] = slave[behind[s], 1] if behind[s] >= 0 else slave[s, 0]
    return nodes


@compile_part
def ends_of_part(view: SlaveView, x_low: Vector, x_high: Vector, cut_low: bool, cut_high: bool) -> tuple[float, float]:
    """Return the lower and the upper end of a part of a slave segment, as c, cut by master nodes or not."""
    zero = 0 * view.x_a[0]  # has the type of the positions
    low, high = zero - 1, zero + 1
    if cut_low:
        low = seen_from(x_low, view)
    if cut_high:
        high = seen_from(x_high, view)
    return low, high


@compile_inline
def write_point(
    point: Array,
    view: SlaveView,
    x_1: Vector,
    x_2: Vector,
    low: float,
    high: float,
    place: float,
    weight: float,
    length: float,
) -> None:
    """Write the six numbers of the point at a place of the rule on the part [low, high] of a slave segment."""
    c = (low + high) / 2 + (high - low) / 2 * place
    xi, gap, n = facing_point(view, x_1, x_2, c)
    point[C], point[XI], point[GAP] = c, xi, gap
    point[WEIGHT] = weight * (high - low) / 2 * length
    point[NORMAL_X], point[NORMAL_Y] = n


@compile_maker
def _points(x: Array, segments: Fields, cells: Fields, rule: Fields) -> Array:
    """Compute the points (n_states, n_points, 6) at positions x (n_states, n_nodes, 2)."""
    reference_length, slave, master = segments
    cell_slave, cell_master, cut_low, cut_high, before, behind = cells
    places, weights, current = rule
    n_q = len(places)
    points = np.empty((x.shape[0], len(cell_slave) * n_q, 6), dtype=x.dtype)
    for state in range(x.shape[0]):
        now = x[state]
        for cell in range(len(cell_slave)):
            s, m = cell_slave[cell], cell_master[cell]
            view = slave_view(now, slave, s, before[s], behind[s])
            x_1, x_2 = node(now, master[m, 0]), node(now, master[m, 1])
            low, high = ends_of_part(view, x_2, x_1, cut_low[cell], cut_high[cell])
            length, _, _ = frame(view.x_a, view.x_b)
            if not current:
                length = 0 * length + reference_length[s]
            for q in range(n_q):
                write_point(points[state, cell * n_q + q], view, x_1, x_2, low, high, places[q], weights[q], length)
    return points


@compile_maker
def _gains(x: FloatArray, n_local: int, segments: Fields, cells: Fields, rule: Fields) -> FloatArray:
    """Compute the Δ (n_points, 5, n_local, 2) of the points at positions x (n_nodes, 2)."""
    reference_length, slave, master = segments
    cell_slave, cell_master, cut_low, cut_high, before, behind = cells
    places, weights, current = rule
    n_q = len(places)
    gains = np.zeros((len(cell_slave) * n_q, 5, n_local, 2))
    d_omega_a, d_omega_b, d_low, d_high = np.zeros((4, n_local, 2))
    for cell in range(len(cell_slave)):
        s, m = cell_slave[cell], cell_master[cell]
        view = slave_view(x, slave, s, before[s], behind[s])
        x_1, x_2 = node(x, master[m, 0]), node(x, master[m, 1])
        low, high = ends_of_part(view, x_2, x_1, cut_low[cell], cut_high[cell])
        turn_of_ends(x, slave, s, before[s], behind[s], d_omega_a, d_omega_b)
        d_low[:], d_high[:] = 0.0, 0.0
        if cut_low[cell]:
            cut_gains(d_low, low, NODE_2, x_2, view, d_omega_a, d_omega_b)
        if cut_high[cell]:
            cut_gains(d_high, high, NODE_1, x_1, view, d_omega_a, d_omega_b)
        length = -1.0 if current else reference_length[s]
        ends, d_ends, d_omega = (low, high), (d_low, d_high), (d_omega_a, d_omega_b)
        for q in range(n_q):
            write_gains(gains[cell * n_q + q], view, x_1, x_2, ends, d_ends, d_omega, places[q], weights[q], length)
    return gains


@compile_part
def write_gains(
    d: FloatArray,
    view: SlaveView,
    x_1: Vector,
    x_2: Vector,
    ends: tuple[float, float],
    d_ends: Fields,
    d_omega: Fields,
    place: float,
    weight: float,
    length: float,
) -> None:
    """Write the Δ (5, n_local, 2) of the point at a place of the rule between two ends on a slave segment.

    `d_ends` are Δ of the ends, `d_omega` those of the directions of A and B. A length of −1 stands for the current one.
    """
    (low, high), (d_low, d_high) = ends, d_ends
    l_ab, t_ab, _ = frame(view.x_a, view.x_b)
    measured = l_ab if length < 0 else length
    for k in range(d.shape[1]):
        for i in range(2):
            spread = d_high[k, i] - d_low[k, i]
            d[D_C, k, i] = (d_low[k, i] + d_high[k, i]) / 2 + spread / 2 * place
            d[D_WEIGHT, k, i] = weight * spread / 2 * measured
    if length < 0:  # Δl_AB = t_AB·(Δx_B − Δx_A)
        share = weight * (high - low) / 2
        for i in range(2):
            d[D_WEIGHT, A, i] -= share * t_ab[i]
            d[D_WEIGHT, B, i] += share * t_ab[i]
    point_gains(d, (low + high) / 2 + (high - low) / 2 * place, view, x_1, x_2, *d_omega)
