"""The cells of a pairing, the quadrature points on them with their variations, and the forces of pressures there.

`Cells` are decisions: they come from `cell_search` and are stored in a pairing. `Quadrature` puts points on them, or on
other parts of slave segments, and computes every real number from the positions: `points` of many states, real or
complex, `variations` of one real state. With F = w p, w the weight (a length) of a point, p its pressure and n out of
the slave:

    R_A = (1−c)/2 F n    R_B = (1+c)/2 F n    R_1 = −(1−ξ) F n    R_2 = −ξ F n

Forces and moments balance point by point, whatever the pressures are, because x_m − x_s is along n.

A kernel gets the fields of a class of arrays as a plain tuple and unpacks them first: numba reads that in half
the time.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np

from contactverif.compiler import TAKES_LONGDOUBLE, compile_inline, compile_maker, compile_part, match_precision
from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.formulation import ContactPoints, Pairing
from contactverif.contract.interface import Interface, Surface
from contactverif.contract.traits import Abilities, Evidence, PatchPromises, Promises, Rules, Traits
from contactverif.geometry.block_rows import Fields, NumberArray
from contactverif.geometry.projection import frame, node, search_tree
from contactverif_mortar.cell_geometry import (
    D_C,
    D_WEIGHT,
    NODE_1,
    NODE_2,
    A,
    B,
    SlaveView,
    facing_point,
    seen_from,
    slave_view,
    turn_of_ends,
    variation_of_cut,
    variation_of_point,
)
from contactverif_mortar.cell_search import averaging, find_cells, longest_of_chain

C, XI, GAP, WEIGHT, NORMAL_X, NORMAL_Y = range(6)  # The numbers of a point, in this order.
AREAS = {"current": True, "reference": False}  # The words of the option `area`.
# The cases that show locking, for methods that lock.
LOCKING_WITNESSES = {"stability.locking": "12 on 8, ε̂ = 1e8 E/h", "accuracy.wavy-curved": "upper slave, 100 E/h"}
# The promises that the methods on cells have in common; each method says what it changes.
CELL_TRAITS = Traits(
    promises=Promises(
        patch=PatchPromises(flat=True, normal=True, single=True, kinked=True, overhang=True),
        converges=True,
        locks=False,
        tangent="exact",
        symmetric=False,
        conserves_force=True,
        conserves_moment=True,
        continuity="C0",
        integrates_linear_gap=True,
        local=True,
        nodes_push=True,
        opens_at_ends=True,
        unbiased=False,
        translation_stable=True,
    ),
    rules=Rules(gap="cells", force_along="slave normal", penalty="distributed"),
    abilities=Abilities(batched=True, takes_complex=True, takes_longdouble=TAKES_LONGDOUBLE),
    evidence=Evidence(witnesses={"symmetric": "offset-c", "swap": "tilted"}),
)


class Sides(NamedTuple):
    """The surfaces of an interface in their roles, or with the roles exchanged; the nodes keep their numbers."""

    nodes: FloatArray  # (n_nodes, 2), reference positions
    slave: Surface
    master: Surface

    @property
    def n_slave_nodes(self) -> int:
        """A number above those of all slave nodes."""
        return len(self.nodes)


class Cells(NamedTuple):
    """Pairs of a slave and a master segment, in the order of the slave segments."""

    slave: IntArray  # (n_cells,) The segments.
    master: IntArray
    # (n_cells,) A master node cuts the lower end (the second node) and the upper end (the first node).
    cut_low: BoolArray
    cut_high: BoolArray
    before: IntArray  # (n_slave_segments,) The segments with which normals at the two ends are averaged, −1 for none.
    behind: IntArray

    @classmethod
    def find(cls, sides: Interface | Sides, x: FloatArray, averaged: bool) -> Self:
        """Find the cells at the positions x (n_nodes, 2)."""
        slave, master = sides.slave, sides.master
        before = behind = np.full(len(slave), -1)
        if averaged:
            before, behind = averaging(x, slave.segments, slave.neighbours)
        slaves = slave.segments, before, behind, longest_of_chain(slave, x)
        masters = master.segments, longest_of_chain(master, x)
        return cls(*find_cells(x, slaves, masters, search_tree(master, x)), before, behind)

    @classmethod
    def from_pairing(cls, pairing: Pairing, prefix: str = "") -> Self:
        """Return the cells of a pairing, whose names begin with a prefix."""
        return cls(*(pairing[prefix + name] for name in cls._fields))

    def select(self, selection: BoolArray | IntArray | slice) -> "Cells":
        """Return some of the cells, selected by mask, number or range."""
        slave, master = self.slave[selection], self.master[selection]
        return Cells(slave, master, self.cut_low[selection], self.cut_high[selection], self.before, self.behind)

    def carriers(self, n_q: int) -> IntArray:
        """Return the slave segment of each point (n_cells × n_q,)."""
        return np.repeat(self.slave, n_q)

    def local_nodes(self, sides: Interface | Sides) -> NumberArray:
        """Return the nodes (n_cells, n_local): A, B, 1, 2, and with averaged normals those before A and behind B."""
        arrays = tuple(map(read_only, (self.slave, self.master, self.before, self.behind)))
        return _local_nodes(sides.slave.segments, sides.master.segments, arrays, self.averaged)

    def cuts(self, sides: Interface | Sides) -> tuple[Fields, tuple[int, int, int]]:
        """Return the arrays that kernels unpack, n_local, and the local nodes that cut the lower and the upper end.

        The arrays are slave and master segment of each part, the nodes that cut its ends (−1 for none), the segments
        with which normals are averaged, and the one point of the rule that each part has; none where it has all.
        """
        cells = tuple(map(read_only, (self.master, self.cut_low, self.cut_high)))
        low, high = _cutting_nodes(sides.master.segments, *cells)
        arrays = self.slave, self.master, low, high, self.before, self.behind, np.empty(0, np.int64)
        return tuple(map(read_only, arrays)), (6 if self.averaged else 4, NODE_2, NODE_1)

    @property
    def averaged(self) -> bool:
        """True if any normals are averaged."""
        return bool((self.before >= 0).any() or (self.behind >= 0).any())


class Ranges(NamedTuple):
    """The Gauss points of all covered ranges, in the order of the slave segments.

    Cells that follow each other on a slave segment, and meet at one master node, make a range: the slave looks at one
    unbroken surface. A range ends at an end of the segment, or where the slave sees an end of that surface.
    """

    slave: IntArray  # (n_points,) The segment that carries the point, and the one that it sees.
    master: IntArray
    slot: IntArray  # (n_points,) The number of the point in the quadrature rule.
    # (n_points,) The master nodes that cut the lower and the upper end of its range, −1 where the segment ends there.
    low: IntArray
    high: IntArray

    @classmethod
    def find(cls, sides: Interface | Sides, x: FloatArray, cells: Cells, rule: "Quadrature") -> Self:
        """Return the points of the ranges that the cells make at the positions x (n_nodes, 2)."""
        return cls(*_find_ranges(x, sides.slave.segments, sides.master.segments, cells[:4], rule.places))

    @classmethod
    def from_pairing(cls, pairing: Pairing, prefix: str) -> Self:
        """Return the points of a pairing, whose names begin with a prefix."""
        return cls(*(pairing[prefix + name] for name in cls._fields))

    def select(self, selection: BoolArray | slice) -> "Ranges":
        """Return some of the points, selected by mask or range."""
        return Ranges(*(array[selection] for array in self))

    def carriers(self, n_q: int) -> IntArray:
        """Return the slave segment of each point: each has one point of the rule."""
        return self.slave

    def local_nodes(self, sides: Interface | Sides) -> NumberArray:
        """Return the nodes (n_points, 6): A, B, 1, 2, and those that cut the range (any node where none does)."""
        ends = sides.slave.segments[self.slave]
        cuts = [np.where(cut >= 0, cut, ends[:, 0]) for cut in (self.low, self.high)]  # Their Δ is zero.
        return np.column_stack([ends, sides.master.segments[self.master], *cuts]).astype(np.int32)

    def cuts(self, sides: Interface | Sides) -> tuple[Fields, tuple[int, int, int]]:
        """Return what `Cells.cuts` says: behind A, B, 1 and 2 the nodes 4 and 5 cut a range."""
        not_averaged = np.full(len(sides.slave), -1)
        arrays = self.slave, self.master, self.low, self.high, not_averaged, not_averaged, self.slot
        return tuple(map(read_only, arrays)), (6, 4, 5)


Parts = Cells | Ranges  # Parts of slave segments, each with a master segment and some or all points of a rule.
_Parts = TypeVar("_Parts", Cells, Ranges)


def near(parts: _Parts, nodes: BoolArray, sides: Interface | Sides) -> _Parts:
    """Return the parts whose slave segment has at least one of some slave nodes, given by mask (n_slave_nodes,)."""
    carrying = _any_end(nodes, sides.slave.segments, parts.slave)
    return parts if carrying.all() else parts.select(carrying)


@dataclass(frozen=True, slots=True, eq=False)
class Quadrature:
    """A quadrature rule for each part of a slave segment."""

    places: FloatArray  # (n_q,) Places on [−1, 1], and weights that add up to 1.
    weights: FloatArray
    current: bool  # Lengths are those of the current configuration; else those of the reference configuration.

    @classmethod
    def gauss(cls, n: int, current: bool) -> Self:
        """Return the rule with n Gauss points, exact for polynomials of degree 2n − 1."""
        places, weights = np.polynomial.legendre.leggauss(n)
        return cls(places, weights / 2, current)

    def __len__(self) -> int:
        return len(self.places)

    def points(self, sides: Interface | Sides, parts: Parts, x: Array) -> Array:
        """Compute the points (n_states, n_points, 6) at real or complex x (n_states, n_nodes, 2).

        Their numbers are c, ξ, gap (negative in penetration), weight (a length), and the normal out of the slave.
        """
        reference, places, weights = match_precision(x, sides.nodes, self.places, self.weights)
        segments = self._reference_lengths(sides, reference), sides.slave.segments, sides.master.segments
        return _points(x, segments, parts.cuts(sides)[0], (places, weights, self.current))

    def variations(self, sides: Interface | Sides, parts: Parts, x: FloatArray) -> FloatArray:
        """Compute Δ of c, ξ, gap, weight, and the turn ω of the normal: (n_points, 5, n_local, 2)."""
        segments = self._reference_lengths(sides, sides.nodes), sides.slave.segments, sides.master.segments
        return _variations(x, segments, *parts.cuts(sides), (self.places, self.weights, self.current))

    def _reference_lengths(self, sides: Interface | Sides, reference: FloatArray) -> FloatArray:
        """Return the lengths (n_slave_segments,) at reference positions; none if current lengths count."""
        return np.empty(0, reference.dtype) if self.current else sides.slave.lengths(reference)


def read_only(array: Any) -> Any:
    """Return a read-only view: a kernel is compiled once for all arrays."""
    view = array.view()
    view.flags.writeable = False
    return view


@compile_maker
def _any_end(nodes: BoolArray, slave: IntArray, carrier: IntArray) -> BoolArray:
    """Return for each carrying slave segment whether one of its ends is among some nodes, given by mask."""
    selection = np.empty(len(carrier), dtype=np.bool_)
    for i in range(len(carrier)):
        selection[i] = nodes[slave[carrier[i], 0]] or nodes[slave[carrier[i], 1]]
    return selection


@compile_maker
def _find_ranges(
    x: FloatArray, slave: IntArray, master: IntArray, cells: Fields, places: FloatArray
) -> tuple[IntArray, IntArray, IntArray, IntArray, IntArray]:
    """Return the arrays of `Ranges`. A point between two cells belongs to the first that reaches it."""
    cell_slave, cell_master, cut_low, cut_high = cells
    table = np.empty((5, len(cell_slave) * len(places)), dtype=np.int64)
    begin, count = 0, 0
    while begin < len(cell_slave):
        s, end = cell_slave[begin], begin + 1
        while end < len(cell_slave) and cell_slave[end] == s and cut_high[end - 1] and cut_low[end]:
            if master[cell_master[end - 1], 0] != master[cell_master[end], 1]:
                break
            end += 1
        low = master[cell_master[begin], 1] if cut_low[begin] else -1
        high = master[cell_master[end - 1], 0] if cut_high[end - 1] else -1
        view = slave_view(x, slave, s, -1, -1)
        bottom, top = ends_of_part(view, x, low, high)
        cell = begin
        for q in range(len(places)):
            c = (bottom + top) / 2 + (top - bottom) / 2 * places[q]
            while cell < end - 1 and seen_from(node(x, master[cell_master[cell], 0]), view) < c:
                cell += 1
            table[0, count], table[1, count], table[2, count] = s, cell_master[cell], q
            table[3, count], table[4, count] = low, high
            count += 1
        begin = end
    return table[0, :count], table[1, :count], table[2, :count], table[3, :count], table[4, :count]


@compile_maker
def _cutting_nodes(
    master: IntArray, partner: IntArray, cut_low: BoolArray, cut_high: BoolArray
) -> tuple[IntArray, IntArray]:
    """Return the master nodes that cut the lower and the upper end of each cell, −1 for none."""
    low, high = np.full(len(partner), -1), np.full(len(partner), -1)
    for cell in range(len(partner)):
        if cut_low[cell]:
            low[cell] = master[partner[cell], 1]
        if cut_high[cell]:
            high[cell] = master[partner[cell], 0]
    return low, high


@compile_maker
def _local_nodes(slave: IntArray, master: IntArray, cells: Fields, averaged: bool) -> NumberArray:
    """Return the local nodes of each cell; where a segment to average with is missing, A stands for it."""
    cell_slave, cell_master, before, behind = cells
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
def ends_of_part(view: SlaveView, x: Array, low: int, high: int) -> tuple[float, float]:
    """Return the lower and the upper end of a part of a slave segment, as c, cut by master nodes or not (−1)."""
    zero = 0 * view.x_a[0]  # has the type of the positions
    c_low, c_high = zero - 1, zero + 1
    if low >= 0:
        c_low = seen_from(node(x, low), view)
    if high >= 0:
        c_high = seen_from(node(x, high), view)
    return c_low, c_high


@compile_inline
def _points_of_part(slot: IntArray, part: int, n_q: int) -> tuple[int, int]:
    return (slot[part], slot[part] + 1) if len(slot) > 0 else (0, n_q)


@compile_maker
def _points(x: Array, segments: Fields, parts: Fields, rule: Fields) -> Array:
    reference_length, slave, master = segments
    carrier, partner, low_node, high_node, before, behind, slot = parts
    places, weights, current = rule
    points = np.empty((x.shape[0], len(carrier) * (1 if len(slot) > 0 else len(places)), 6), dtype=x.dtype)
    for state in range(x.shape[0]):
        now, number = x[state], 0
        for part in range(len(carrier)):
            s, m = carrier[part], partner[part]
            view = slave_view(now, slave, s, before[s], behind[s])
            x_1, x_2 = node(now, master[m, 0]), node(now, master[m, 1])
            low, high = ends_of_part(view, now, low_node[part], high_node[part])
            length, _, _ = frame(view.x_a, view.x_b)
            if not current:
                length = 0 * length + reference_length[s]
            first, end = _points_of_part(slot, part, len(places))
            for q in range(first, end):
                point = points[state, number]
                c = (low + high) / 2 + (high - low) / 2 * places[q]
                xi, gap, n = facing_point(view, x_1, x_2, c)
                point[C], point[XI], point[GAP] = c, xi, gap
                point[WEIGHT] = weights[q] * (high - low) / 2 * length
                point[NORMAL_X], point[NORMAL_Y] = n
                number += 1
    return points


@compile_maker
def _variations(
    x: FloatArray, segments: Fields, parts: Fields, local: tuple[int, int, int], rule: Fields
) -> FloatArray:
    reference_length, slave, master = segments
    carrier, partner, low_node, high_node, before, behind, slot = parts
    n_local, cutting_low, cutting_high = local
    places, weights, current = rule
    variations = np.zeros((len(carrier) * (1 if len(slot) > 0 else len(places)), 5, n_local, 2))
    d_omega_a, d_omega_b, d_low, d_high = np.zeros((4, n_local, 2))
    number = 0
    for part in range(len(carrier)):
        s, m, a, b = carrier[part], partner[part], low_node[part], high_node[part]
        view = slave_view(x, slave, s, before[s], behind[s])
        x_1, x_2 = node(x, master[m, 0]), node(x, master[m, 1])
        low, high = ends_of_part(view, x, a, b)
        turn_of_ends(x, slave, s, before[s], behind[s], d_omega_a, d_omega_b)
        d_low[:], d_high[:] = 0.0, 0.0
        if a >= 0:
            variation_of_cut(d_low, low, cutting_low, node(x, a), view, d_omega_a, d_omega_b)
        if b >= 0:
            variation_of_cut(d_high, high, cutting_high, node(x, b), view, d_omega_a, d_omega_b)
        l_ab, t_ab, _ = frame(view.x_a, view.x_b)
        measured = l_ab if current else reference_length[s]
        first, end = _points_of_part(slot, part, len(places))
        for q in range(first, end):
            d, place, weight = variations[number], places[q], weights[q]
            for k in range(n_local):
                for i in range(2):
                    spread = d_high[k, i] - d_low[k, i]
                    d[D_C, k, i] = (d_low[k, i] + d_high[k, i]) / 2 + spread / 2 * place
                    d[D_WEIGHT, k, i] = weight * spread / 2 * measured
            if current:  # Δl_AB = t_AB·(Δx_B − Δx_A)
                share = weight * (high - low) / 2
                for i in range(2):
                    d[D_WEIGHT, A, i] -= share * t_ab[i]
                    d[D_WEIGHT, B, i] += share * t_ab[i]
            c = (low + high) / 2 + (high - low) / 2 * place
            variation_of_point(d, c, view, x_1, x_2, d_omega_a, d_omega_b)
            number += 1
    return variations


@compile_maker
def forces(points: Array, pressure: Array, nodes: NumberArray, n_nodes: int) -> Array:
    """Compute forces (n_states, n_nodes, 2) from pressures (n_states, n_points), positive where the surfaces press.

    The `points` (n_states, n_points, 6) of a part follow each other; of its `nodes` (n_parts, n_local) A, B, 1, 2 come
    first.
    """
    totals = np.zeros((points.shape[0], n_nodes, 2), dtype=points.dtype)
    n_q = points.shape[1] // max(len(nodes), 1)
    for state in range(points.shape[0]):
        for number in range(points.shape[1]):
            if pressure[state, number] == 0:
                continue
            point, local = points[state, number], nodes[number // n_q]
            f = point[WEIGHT] * pressure[state, number]
            c, xi = point[C], point[XI]
            for k, shape in enumerate(((1 - c) / 2, (1 + c) / 2, xi - 1, -xi)):
                totals[state, local[k], 0] += shape * f * point[NORMAL_X]
                totals[state, local[k], 1] += shape * f * point[NORMAL_Y]
    return totals


def report_points(
    interface: Interface, cells: Cells, points: FloatArray, z: FloatArray, pressure: FloatArray, active: BoolArray
) -> ContactPoints:
    """Return the quadrature points (n_points, 6) of the cells as contact points of the state z.

    The ends of areas of competence are NaN: cells end at nodes by construction, and no decision depends on that.
    """
    n_q = len(points) // max(len(cells.slave), 1)
    segment, c = cells.carriers(n_q), points[:, C, None]
    ends = z[: interface.n_unknowns].reshape(-1, 2)[interface.slave.segments[segment]]  # (n_points, 2, dim)
    undefined = np.full(len(points), np.nan)
    return ContactPoints(
        slave_segment=segment,
        c=points[:, C],
        master_segment=np.repeat(cells.master, n_q),
        xi=points[:, XI],
        position=(1 - c) / 2 * ends[:, 0] + (1 + c) / 2 * ends[:, 1],
        normal=-points[:, NORMAL_X:],
        gap=points[:, GAP],
        pressure=pressure,
        weight=points[:, WEIGHT],
        active=active,
        area_from=undefined,
        area_to=undefined,
    )


def report_nodes(
    sides: Interface | Sides,
    cells: Cells,
    x: FloatArray,
    areas: FloatArray,
    gaps: FloatArray,
    pressure: FloatArray,
    active: BoolArray,
) -> ContactPoints:
    """Return the slave nodes as contact points, with ∫N_j, weighted gap and nodal pressure (n_slave_nodes,).

    A node has the master segment that it sees itself. Where two cells meet there, that is the one behind it along the
    slave. A node that overhangs sees none (−1): it has the normal at the near end of the cell that begins beside it,
    and a node without such a cell has NaN.
    """
    n_nodes = sides.n_slave_nodes
    carrier, place = np.full(n_nodes, -1), np.full(n_nodes, np.nan)
    for end in (1, 0):
        numbers = sides.slave.segments[:, end]
        carrier[numbers], place[numbers] = np.arange(len(numbers)), 2.0 * end - 1
    master, xi, normal = np.full(n_nodes, -1), np.full(n_nodes, np.nan), np.full((n_nodes, 2), np.nan)
    for facing in (False, True):
        for end, c in ((1, 1.0), (0, -1.0)):
            at_end = Quadrature(np.array([c]), np.ones(1), current=True)
            first = np.diff(cells.slave, prepend=-1) != 0  # Cells are in the order in which one meets them.
            outermost = np.append(first[1:], True)[: len(first)] if end else first
            cut = cells.cut_high if end else cells.cut_low
            here = np.flatnonzero(~cut if facing else outermost)
            number = sides.slave.segments[cells.slave[here], end]
            carrier[number], place[number] = cells.slave[here], c
            ends = at_end.points(sides, cells.select(here), x[None])[0]
            normal[number] = -ends[:, NORMAL_X:]
            if facing:
                master[number], xi[number] = cells.master[here], ends[:, XI]
    undefined = np.full(n_nodes, np.nan)
    return ContactPoints(
        slave_segment=carrier,
        c=place,
        master_segment=master,
        xi=xi,
        position=x[:n_nodes],
        normal=normal,
        gap=gaps,
        pressure=pressure,
        weight=areas,
        active=active,
        area_from=undefined,
        area_to=undefined,
        weighted=np.ones(n_nodes, dtype=np.bool_),
    )
