"""The covered ranges of slave segments, and Gauss points on them that no node inside the master cuts.

Cells that follow each other on a slave segment, and meet at one master node, make a range: the slave looks at one
unbroken surface. A range ends at an end of the segment, or where the slave sees an end of that surface. Gauss points
are spread over the range as a whole. So a gap that is smooth is integrated well, and one with a bend inside is not
integrated exactly. Methods without the forces of one body on the other need no more than that.

Rules for the next editor: `Ranges.find` decides, and a pairing holds what it found. `points` takes float64 and
complex128, for many states; `gains` takes one real state.

Source: the refined boundary quadrature of Duong, De Lorenzis & Sauer (2018), here with one cut for each boundary.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from contactverif.compiler import compile_maker, match_precision
from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.interface import Interface
from contactverif.contract.pairing import Pairing
from contactverif.geometry.block_rows import NumberArray
from contactverif.geometry.projection import frame, node
from contactverif_mortar.cell_geometry import cut_gains, seen_from, slave_view, turn_of_ends
from contactverif_mortar.integration_cells import (
    Cells,
    Fields,
    Quadrature,
    Sides,
    any_end,
    ends_of_part,
    write_gains,
    write_point,
)

LOW, HIGH = 4, 5  # The local nodes that cut a range, behind A, B, 1 and 2.
N_LOCAL = 6


@dataclass(frozen=True, slots=True, eq=False)
class Ranges:
    """The Gauss points of all covered ranges, in the order of the slave segments."""

    slave: IntArray  # (n_points,) The segment that carries the point, and the one that it sees.
    master: IntArray
    slot: IntArray  # (n_points,) The number of the point in the quadrature rule.
    # (n_points,) The master nodes that cut the lower and the upper end of its range, −1 where the segment ends there.
    low: IntArray
    high: IntArray

    @classmethod
    def find(cls, sides: Interface | Sides, x: FloatArray, cells: Cells, rule: Quadrature) -> Ranges:
        """Return the points of the ranges that the cells make at the positions x (n_nodes, 2)."""
        arrays = (cells.slave, cells.master, cells.cut_low, cells.cut_high)
        return cls(*_find(x, sides.slave.segments, sides.master.segments, arrays, rule.places))

    @classmethod
    def from_pairing(cls, pairing: Pairing, prefix: str) -> Ranges:
        """Return the points of a pairing, whose names begin with a prefix."""
        return cls(*(pairing[prefix + entry.name] for entry in fields(cls)))

    def as_arrays(self, prefix: str) -> dict[str, IntArray | BoolArray]:
        """Return the arrays by name, for a pairing."""
        return {prefix + entry.name: getattr(self, entry.name) for entry in fields(self)}

    def near(self, nodes: BoolArray, sides: Interface | Sides) -> Ranges:
        """Return the points whose slave segment has one of some slave nodes, given by mask (n_slave_nodes,)."""
        carrying = any_end(nodes, sides.slave.segments, self.slave)
        return self if carrying.all() else self.select(carrying)

    def select(self, selection: BoolArray | slice) -> Ranges:
        """Return some of the points, selected by mask or range."""
        return Ranges(*(getattr(self, entry.name)[selection] for entry in fields(self)))

    def local_nodes(self, sides: Interface | Sides) -> NumberArray:
        """Return the nodes (n_points, 6): A, B, 1, 2, and those that cut the range (any node where none does)."""
        ends = sides.slave.segments[self.slave]
        cuts = [np.where(cut >= 0, cut, ends[:, 0]) for cut in (self.low, self.high)]  # Their Δ is zero.
        return np.column_stack([ends, sides.master.segments[self.master], *cuts]).astype(np.int32)

    def points(self, sides: Interface | Sides, x: Array, rule: Quadrature) -> Array:
        """Compute the six numbers of each point, (n_states, n_points, 6), as `Quadrature.points` does."""
        return _points(x, *self._arguments(sides, x, rule))

    def gains(self, sides: Interface | Sides, x: FloatArray, rule: Quadrature) -> FloatArray:
        """Compute the Δ of the points, (n_points, 5, 6, 2), as `Quadrature.gains` does, at positions x (n_nodes, 2)."""
        return _gains(x, *self._arguments(sides, x, rule))

    def _arguments(self, sides: Interface | Sides, x: Array, rule: Quadrature) -> tuple[Fields, Fields, Fields]:
        """Return the fields of `Segments`, of these points, and of `Quadrature`."""
        reference, places, weights = match_precision(x, sides.nodes, rule.places, rule.weights)
        return (
            (sides.slave.lengths(reference), sides.slave.segments, sides.master.segments),
            (self.slave, self.master, self.slot, self.low, self.high),
            (places, weights, rule.current),
        )


@compile_maker
def _find(
    x: FloatArray, slave: IntArray, master: IntArray, cells: Fields, places: FloatArray
) -> tuple[IntArray, IntArray, IntArray, IntArray, IntArray]:
    """Return the arrays of `Ranges`. A point between two cells belongs to the first that reaches it."""
    cell_slave, cell_master, cut_low, cut_high = cells
    rows = [(0, 0, 0, 0, 0) for _ in range(0)]
    begin = 0
    while begin < len(cell_slave):
        s, end = cell_slave[begin], begin + 1
        while end < len(cell_slave) and cell_slave[end] == s and cut_high[end - 1] and cut_low[end]:
            if master[cell_master[end - 1], 0] != master[cell_master[end], 1]:
                break
            end += 1
        low = master[cell_master[begin], 1] if cut_low[begin] else -1
        high = master[cell_master[end - 1], 0] if cut_high[end - 1] else -1
        view = slave_view(x, slave, s, -1, -1)
        bottom, top = ends_of_part(view, node(x, low), node(x, high), low >= 0, high >= 0)
        cell = begin
        for q in range(len(places)):
            c = (bottom + top) / 2 + (top - bottom) / 2 * places[q]
            while cell < end - 1 and seen_from(node(x, master[cell_master[cell], 0]), view) < c:
                cell += 1
            rows.append((s, cell_master[cell], q, low, high))
        begin = end
    table = np.empty((5, len(rows)), dtype=np.int64)
    for number in range(len(rows)):
        s, m, q, low, high = rows[number]
        table[0, number], table[1, number], table[2, number], table[3, number], table[4, number] = s, m, q, low, high
    return table[0], table[1], table[2], table[3], table[4]


@compile_maker
def _points(x: Array, segments: Fields, ranges: Fields, rule: Fields) -> Array:
    """Compute the points (n_states, n_points, 6) at positions x (n_states, n_nodes, 2)."""
    reference_length, slave, master = segments
    carrier, partner, slot, low_node, high_node = ranges
    places, weights, current = rule
    points = np.empty((x.shape[0], len(carrier), 6), dtype=x.dtype)
    for state in range(x.shape[0]):
        now = x[state]
        for number in range(len(carrier)):
            s, q = carrier[number], slot[number]
            view = slave_view(now, slave, s, -1, -1)
            x_1, x_2 = node(now, master[partner[number], 0]), node(now, master[partner[number], 1])
            a, b = low_node[number], high_node[number]
            low, high = ends_of_part(view, node(now, a), node(now, b), a >= 0, b >= 0)
            length, _, _ = frame(view.x_a, view.x_b)
            if not current:
                length = 0 * length + reference_length[s]
            write_point(points[state, number], view, x_1, x_2, low, high, places[q], weights[q], length)
    return points


@compile_maker
def _gains(x: FloatArray, segments: Fields, ranges: Fields, rule: Fields) -> FloatArray:
    """Compute the Δ (n_points, 5, 6, 2) of the points at positions x (n_nodes, 2)."""
    reference_length, slave, master = segments
    carrier, partner, slot, low_node, high_node = ranges
    places, weights, current = rule
    gains = np.zeros((len(carrier), 5, N_LOCAL, 2))
    d_omega_a, d_omega_b, d_low, d_high = np.zeros((4, N_LOCAL, 2))
    for number in range(len(carrier)):
        s, q, a, b = carrier[number], slot[number], low_node[number], high_node[number]
        view = slave_view(x, slave, s, -1, -1)
        x_1, x_2 = node(x, master[partner[number], 0]), node(x, master[partner[number], 1])
        turn_of_ends(x, slave, s, -1, -1, d_omega_a, d_omega_b)
        low, high = ends_of_part(view, node(x, a), node(x, b), a >= 0, b >= 0)
        d_low[:], d_high[:] = 0.0, 0.0
        if a >= 0:
            cut_gains(d_low, low, LOW, node(x, a), view, d_omega_a, d_omega_b)
        if b >= 0:
            cut_gains(d_high, high, HIGH, node(x, b), view, d_omega_a, d_omega_b)
        length = -1.0 if current else reference_length[s]
        ends, d_ends, d_omega = (low, high), (d_low, d_high), (d_omega_a, d_omega_b)
        write_gains(gains[number], view, x_1, x_2, ends, d_ends, d_omega, places[q], weights[q], length)
    return gains
