"""Forces on cells, and their tangent, in the frame (τ, n) of a slave segment, for slaves that look along their normal.

All points of such a cell have one frame: τ along the slave, n out of it, l = |x_B − x_A|. With ω = n·(Δx_B − Δx_A)/l,
L = (x_2 − x_1)·τ, λ = (x_2 − x_1)·n and the rows N = ((1−c)/2, (1+c)/2, ξ−1, −ξ) of the nodes A, B, 1, 2:

    (1)  l/2 Δc_e = τ·(Δx_e − (1−c_e)/2 Δx_A − (1+c_e)/2 Δx_B) + g_e ω       the end of the cell that node e cuts
    (2)  Δc = (1−a)/2 Δc_low + (1+a)/2 Δc_high                               the point at the place a of the rule
    (3)  L Δξ = Σ N_m τ·Δx_m + l/2 Δc − g ω
    (4)  Δg = λ Δξ − Σ N_m n·Δx_m
    (5)  Δw = w_a [l_w/2 (Δc_high − Δc_low) + (c_high − c_low)/2 σ]          σ = τ·(Δx_B − Δx_A) for current lengths

l_w is the length that weights are measured with. A method adds up rows: linear functions of the movements,

    (6)  Σ over points of  α Δw + β Δc + γ Δξ + δ Δg

So a row of a cell is twelve numbers: what it gains for τ·Δx_m and for n·Δx_m of the four nodes, for Δc_low, Δc_high,
ω and σ. `add_to_row` adds a point to them. `turn_row` puts in (1), and turns the result into the global frame.
`cell_geometry` and `shape_rows` have the same for directions that turn; tests hold one against the other.

With F = w p and the N_k as above forces and their derivative, written straight into compressed rows, are

    R_k = Σ N_k F n        ΔR_k = Σ (N_k ΔF + F ΔN_k) n − N_k F ω τ        ΔF = p Δw + w (p_c Δc + p_g Δg)

So ΔR_k·n is a row. A method is p, p_c and p_g at each point.

A mortar method has shapes φ_A, φ_B of the slave nodes, and p = Σ p_j φ_j at fixed p_j. Row j of the factors is

    B_j = Σ w φ_j (N_A, N_B, ξ−1, −ξ) n        D_j = Σ [w φ_j Δg + (g − G_j) Δ(w φ_j)] / divisor_j

Standard shapes are φ_B = (1 + c)/2. A dual shape φ_B = (1 + c̄)/2 + κ (c − c̄) depends on the mean c̄ and the variance
v of c on what is covered of its segment, too: κ = (1 − c̄²)/2v. So each slave segment has two rows more. They hold in
`right` the Δ of c̄ and of v, and in `left` the forces of a unit of each. D_j gains from both by the chain rule:

    ∫1 Δc̄ = Σ (c − c̄) Δw + w Δc        ∫1 Δv = Σ ((c − c̄)² − v) Δw + 2 w (c − c̄) Δc
    ∂φ_B/∂c̄ = 1/2 − κ − c̄ (c − c̄)/v        ∂φ_B/∂v = −κ (c − c̄)/v

Gaps may be weighted with standard shapes though pressures have dual ones (not `alike`). Then D_j has those in place of
φ_j, and gains nothing from c̄ and v.

Rule for the next editor: nothing is allocated for a cell. The array `rows` is room that a caller reuses.
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from contactverif.compiler import compile_inline, compile_maker
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.interface import Interface
from contactverif.geometry.block_rows import Couplings, Csr, Fields, NumberArray, add_block, find_entry, zero_matrix
from contactverif.geometry.projection import Vector, dot, frame, minus, node
from contactverif_mortar.cell_geometry import NODE_1, NODE_2, A, B, SlaveView, facing_point, seen_from, slave_view
from contactverif_mortar.integration_cells import Cells, Quadrature, read_only
from contactverif_mortar.node_factors import NodeRows, RowGroups

ForcesAndTangent = tuple[FloatArray, sparse.csr_array]  # (n_unknowns,) and (n_unknowns, n_unknowns)
Slopes = tuple[float, float, float, float]  # α, β, γ and δ of Eq. (6)

# The twelve numbers of a row; the first two stand for four, one for each node A, B, 1, 2.
ALONG_TAU, ALONG_N, BY_LOW, BY_HIGH, BY_OMEGA, BY_SIGMA, N_NUMBERS = 0, 4, 8, 9, 10, 11, 12


class CellFrame(NamedTuple):
    """A cell, its frame, and the numbers that all its points share."""

    nodes: tuple[int, int, int, int]  # A, B, 1, 2
    slave: SlaveView
    x_1: Vector
    x_2: Vector
    length: float  # l
    measured: float  # l_w
    tau: Vector
    n: Vector
    along: float  # L, negative
    lean: float  # λ
    low: float  # c_low
    high: float
    cut_low: float  # 1 where node 2 cuts the lower end, else 0
    cut_high: float  # 1 where node 1 cuts the upper end, else 0
    gap_low: float
    gap_high: float
    current: float  # 1 where weights are measured with current lengths, else 0


class CellPoint(NamedTuple):
    """A point of a cell."""

    place: float  # a
    share: float  # w_a
    c: float
    xi: float
    gap: float
    weight: float  # w


def cell_arguments(interface: Interface, cells: Cells, rule: Quadrature) -> tuple[Fields, Fields]:
    """Return the arrays of segments, cells and rule, as kernels unpack them; a length of −1 is the current one."""
    slave, master = interface.slave, interface.master
    lengths = np.full(len(slave), -1.0) if rule.current else slave.lengths(interface.nodes)
    pairs_and_cuts = map(read_only, (cells.slave, cells.master, cells.cut_low, cells.cut_high))
    return (lengths, slave.segments, master.segments, *pairs_and_cuts), (rule.places, rule.weights)


@compile_inline
def cell_at(x: FloatArray, segments_and_cells: Fields, i: int) -> CellFrame:
    """Return cell i at the positions x (n_nodes, 2)."""
    lengths, slave, master, cell_slave, cell_master, cut_low, cut_high = segments_and_cells
    s, m = cell_slave[i], cell_master[i]
    nodes = (slave[s, A], slave[s, B], master[m, 0], master[m, 1])
    view, x_1, x_2 = slave_view(x, slave, s, -1, -1), node(x, nodes[NODE_1]), node(x, nodes[NODE_2])
    length, tau, n = frame(view.x_a, view.x_b)
    low, high, gap_low, gap_high = -1.0, 1.0, 0.0, 0.0
    if cut_low[i]:
        low = seen_from(x_2, view)
        gap_low = facing_point(view, x_1, x_2, low)[1]
    if cut_high[i]:
        high = seen_from(x_1, view)
        gap_high = facing_point(view, x_1, x_2, high)[1]
    d, is_current = minus(x_2, x_1), lengths[s] < 0
    measured, current = (length, 1.0) if is_current else (lengths[s], 0.0)
    along, lean = dot(d, tau), dot(d, n)
    cuts = (1.0 if cut_low[i] else 0.0, 1.0 if cut_high[i] else 0.0)
    numbers = (low, high, *cuts, gap_low, gap_high, current)
    return CellFrame(nodes, view, x_1, x_2, length, measured, tau, n, along, lean, *numbers)


@compile_inline
def place_point(cell: CellFrame, place: float, share: float) -> CellPoint:
    """Return the point at a place of the rule, whose weight there is `share`."""
    c = (cell.low + cell.high) / 2 + (cell.high - cell.low) / 2 * place
    xi, gap, _ = facing_point(cell.slave, cell.x_1, cell.x_2, c)
    return CellPoint(place, share, c, xi, gap, share * (cell.high - cell.low) / 2 * cell.measured)


@compile_inline
def add_to_row(rows: FloatArray, row: int, cell: CellFrame, point: CellPoint, by: Slopes) -> None:
    """Add α Δw + β Δc + γ Δξ + δ Δg of a point, Eqs. (2)–(6), to a row of `rows` (n_rows, 12)."""
    (place, share, c, xi, gap, _), (by_weight, by_c, by_xi, by_gap) = point, by
    slope = (by_xi + by_gap * cell.lean) / cell.along  # for L Δξ
    along_c = by_c + slope * cell.length / 2
    spread = by_weight * share * cell.measured / 2
    rows[row, BY_LOW] += (1 - place) / 2 * along_c - spread
    rows[row, BY_HIGH] += (1 + place) / 2 * along_c + spread
    rows[row, BY_OMEGA] -= slope * gap
    rows[row, BY_SIGMA] += by_weight * share * (cell.high - cell.low) / 2
    for m, shape in enumerate(((1 - c) / 2, (1 + c) / 2, xi - 1, -xi)):
        rows[row, ALONG_TAU + m] += slope * shape
        rows[row, ALONG_N + m] -= by_gap * shape


@compile_inline
def finish_rows(rows: FloatArray, n_rows: int, cell: CellFrame) -> None:
    """Put Δc_low and Δc_high of Eq. (1), ω and σ into the numbers of the four nodes."""
    per_length = 1 / cell.length
    for row in range(n_rows):
        low = 2 * per_length * cell.cut_low * rows[row, BY_LOW]
        high = 2 * per_length * cell.cut_high * rows[row, BY_HIGH]
        omega = (rows[row, BY_OMEGA] + low * cell.gap_low + high * cell.gap_high) * per_length
        sigma = rows[row, BY_SIGMA] * cell.current
        rows[row, ALONG_TAU] -= (1 - cell.low) / 2 * low + (1 - cell.high) / 2 * high + sigma
        rows[row, ALONG_TAU + 1] += sigma - (1 + cell.low) / 2 * low - (1 + cell.high) / 2 * high
        rows[row, ALONG_TAU + 2] += high
        rows[row, ALONG_TAU + 3] += low
        rows[row, ALONG_N] -= omega
        rows[row, ALONG_N + 1] += omega


@compile_inline
def turn_row(rows: FloatArray, row: int, m: int, cell: CellFrame) -> Vector:
    """Return what a row gains for a movement of local node m, in the global frame."""
    a, b = rows[row, ALONG_TAU + m], rows[row, ALONG_N + m]
    return a * cell.tau[0] + b * cell.n[0], a * cell.tau[1] + b * cell.n[1]


@compile_inline
def push_point(
    rows: FloatArray, pushes: FloatArray, cell: CellFrame, point: CellPoint, p: float, p_c: float, p_g: float
) -> None:
    """Add N_k ΔF + F ΔN_k of a point to the first four `rows`, and N_k F to `pushes` (4,)."""
    c, xi, w = point.c, point.xi, point.weight
    f = w * p
    for k, (shape, by_c, by_xi) in enumerate(
        (((1 - c) / 2, -0.5, 0.0), ((1 + c) / 2, 0.5, 0.0), (xi - 1, 0.0, 1.0), (-xi, 0.0, -1.0))
    ):
        pushes[k] += shape * f
        add_to_row(rows, k, cell, point, (shape * p, shape * w * p_c + f * by_c, f * by_xi, shape * w * p_g))


@compile_inline
def add_cell(forces: FloatArray, csr: Csr, rows: FloatArray, pushes: FloatArray, cell: CellFrame) -> None:
    """Add `pushes` n to forces, and n ⊗ `rows` − `pushes` τ ⊗ ω to compressed rows, in the global frame."""
    local, tau, n = cell.nodes, cell.tau, cell.n
    for k in range(4):
        forces[2 * local[k]] += pushes[k] * n[0]
        forces[2 * local[k] + 1] += pushes[k] * n[1]
        turn = pushes[k] / cell.length
        for column, omega in enumerate((-turn, turn, 0.0, 0.0)):
            x, y = turn_row(rows, k, column, cell)
            xx, xy = n[0] * x - omega * tau[0] * n[0], n[0] * y - omega * tau[0] * n[1]
            yx, yy = n[1] * x - omega * tau[1] * n[0], n[1] * y - omega * tau[1] * n[1]
            add_block(csr, local[k], local[column], xx, xy, yx, yy)


# What is known of the shapes on a slave segment: a place c_0 on it, c̄ − c_0, κ, v and ∫1; 1 if gaps have them, or 0.
ORIGIN, MEAN, KAPPA, VARIANCE, EXTENT, ALIKE, N_SHAPE = range(7)


Weights = tuple[FloatArray, FloatArray, FloatArray]  # ∫φ_j and ∫φ_j g (n_slave_nodes,), and the numbers of the shapes.


class NodeState(NamedTuple):
    """The slave nodes of a method at one state."""

    pressure: FloatArray  # (n_slave_nodes,) The pressures p_j, zero where a node is not active.
    weights: FloatArray  # (n_slave_nodes,) Δp_j for each unit of row j of `Factors.right`.
    gaps: FloatArray  # (n_slave_nodes,) G_j and ∫φ_j, if that row is ΔG_j. Zero and one, if it is Δ∫φ_j g.
    divisor: FloatArray


def weigh(
    interface: Interface, cells: Cells, rule: Quadrature, x: FloatArray, dual: bool, alike: bool = True
) -> Weights:
    """Compute the integrals of the shapes on some cells, at the positions x (n_nodes, 2).

    Shapes of gaps are standard if not `alike`. The numbers (n_slave_segments, 6) are undefined for a segment without
    cells.
    """
    areas, with_gap = np.zeros((2, interface.n_slave_nodes))
    shapes = np.empty((len(interface.slave), N_SHAPE))
    _weigh((areas, with_gap, shapes), x, *cell_arguments(interface, cells, rule), dual, alike)
    return areas, with_gap, shapes


@compile_maker
def _weigh(written: Weights, x: FloatArray, segments_and_cells: Fields, rule: Fields, dual: bool, alike: bool) -> None:
    """Add ∫φ_j and ∫φ_j g of all slave segments, and write what is known of their shapes."""
    areas, with_gap, shapes = written
    slave, cell_slave = segments_and_cells[1], segments_and_cells[3]
    places, weights = rule
    points = np.empty((16, 3))  # c, gap and weight of the points of a segment
    begin = 0
    while begin < len(cell_slave):
        s, end = cell_slave[begin], begin
        while end < len(cell_slave) and cell_slave[end] == s:
            end += 1
        if (end - begin) * len(places) > len(points):
            points = np.empty((2 * (end - begin) * len(places), 3))
        count = 0
        for i in range(begin, end):
            cell = cell_at(x, segments_and_cells, i)
            for q in range(len(places)):
                point = place_point(cell, places[q], weights[q])
                points[count, 0], points[count, 1], points[count, 2] = point.c, point.gap, point.weight
                count += 1
        _write_shape(shapes, s, points, count, dual)
        shapes[s, ALIKE] = alike
        for i in range(count):
            first, second, _ = _weights_at(shapes, s, points[i, 0])
            a, b, gap, w = slave[s, A], slave[s, B], points[i, 1], points[i, 2]
            areas[a] += w * first
            areas[b] += w * second
            with_gap[a] += w * first * gap
            with_gap[b] += w * second * gap
        begin = end


@compile_inline
def _write_shape(shapes: FloatArray, s: int, points: FloatArray, count: int, dual: bool) -> None:
    """Write the shapes of segment s. c̄ is measured from a covered point, so that c − c̄ is as exact as c."""
    shapes[s, ORIGIN], shapes[s, MEAN], shapes[s, KAPPA] = 0.0, 0.0, 0.5
    shapes[s, VARIANCE], shapes[s, EXTENT] = 0.0, 0.0
    if not dual:
        return
    origin, extent, moment, second_moment = points[0, 0], 0.0, 0.0, 0.0
    for i in range(count):
        extent += points[i, 2]
        moment += points[i, 2] * (points[i, 0] - origin)
    mean = moment / extent
    for i in range(count):
        centred = (points[i, 0] - origin) - mean
        second_moment += points[i, 2] * centred * centred
    variance, c_mean = second_moment / extent, origin + mean
    shapes[s, ORIGIN], shapes[s, MEAN], shapes[s, KAPPA] = origin, mean, (1 - c_mean) * (1 + c_mean) / (2 * variance)
    shapes[s, VARIANCE], shapes[s, EXTENT] = variance, extent


@compile_inline
def _shapes_at(shapes: FloatArray, s: int, c: float) -> tuple[float, float]:
    mean = shapes[s, ORIGIN] + shapes[s, MEAN]
    bent = shapes[s, KAPPA] * ((c - shapes[s, ORIGIN]) - shapes[s, MEAN])
    return (1 - mean) / 2 - bent, (1 + mean) / 2 + bent


@compile_inline
def _weights_at(shapes: FloatArray, s: int, c: float) -> tuple[float, float, float]:
    """Return the shapes by which gaps are weighted, and the slope of the second."""
    if not shapes[s, ALIKE]:
        return (1 - c) / 2, (1 + c) / 2, 0.5
    first, second = _shapes_at(shapes, s, c)
    return first, second, shapes[s, KAPPA]


def node_rows(
    interface: Interface,
    cells: Cells,
    rule: Quadrature,
    x: FloatArray,
    shapes: FloatArray,
    state: NodeState,
    groups: RowGroups,
    pattern: Couplings,
) -> NodeRows:
    """Compute forces and factors on cells with no averaged normals, with `shapes` of `weigh` at the same state."""
    matrix = zero_matrix(interface.n_nodes, 0, pattern)
    forces, left, right = np.zeros(interface.n_unknowns), *np.zeros((2, 2 * len(groups.nodes)))
    written = forces, (matrix.indptr, matrix.indices, matrix.data), (groups.nodes, groups.starts, left, right)
    at_nodes = state.pressure, state.gaps, state.divisor
    _add_rows(written, x, *cell_arguments(interface, cells, rule), shapes, at_nodes)
    return NodeRows(forces, matrix, groups, left, right, state.weights)


@compile_maker
def _add_rows(
    written: Fields, x: FloatArray, segments_and_cells: Fields, rule: Fields, shapes: FloatArray, at_nodes: Fields
) -> None:
    """Add what all cells give to the forces, to compressed rows, and to the rows of the factors."""
    forces, csr, factors = written
    slave, cell_slave = segments_and_cells[1], segments_and_cells[3]
    places, weights = rule
    pressure, gaps, divisor = at_nodes
    nodes, starts, left, right = factors
    n_nodes, n_segments = len(pressure), len(slave)
    dual = len(starts) - 1 > n_nodes
    n_rows = 4 if dual else 2
    rows, pushes, units = np.empty((4 + n_rows, N_NUMBERS)), np.empty(4), np.empty((n_rows, 4))
    chain = np.zeros((n_segments if dual else 0, 2, 2))  # ∂∫φ_j (g − G_j) of both ends of a segment by c̄ and by v
    for i in range(len(cell_slave)):
        s, cell = cell_slave[i], cell_at(x, segments_and_cells, i)
        a, b = cell.nodes[A], cell.nodes[B]
        rows[:], pushes[:], units[:] = 0.0, 0.0, 0.0
        for q in range(len(places)):
            point = place_point(cell, places[q], weights[q])
            first, second = _shapes_at(shapes, s, point.c)
            kappa, difference = shapes[s, KAPPA], pressure[b] - pressure[a]
            p = pressure[a] * first + pressure[b] * second
            push_point(rows, pushes, cell, point, p, difference * kappa, 0.0)
            by_first, by_second, slope = _weights_at(shapes, s, point.c)
            w = point.weight
            for end, (shape, by, sign, j) in enumerate(((first, by_first, -1, a), (second, by_second, 1, b))):
                above = point.gap - gaps[j]
                add_to_row(rows, 4 + end, cell, point, (above * by, above * w * sign * slope, 0.0, w * by))
                _add_unit(units, end, point, shape)
            if dual:
                _add_moments((rows, units, chain), cell, point, shapes, s, difference, (gaps[a], gaps[b]))
        finish_rows(rows, 4 + n_rows, cell)
        add_cell(forces, csr, rows, pushes, cell)
        shares = (1 / divisor[a], 1 / divisor[b], 1.0, 1.0)  # Those of the rows of `right`
        numbers = (a, b, n_nodes + s, n_nodes + n_segments + s)
        for row in range(n_rows):
            j, share = numbers[row], shares[row]
            if starts[j + 1] == starts[j]:
                continue
            for k in range(4):
                place = 2 * find_entry(nodes, starts[j], starts[j + 1], cell.nodes[k])
                d_x, d_y = turn_row(rows, 4 + row, k, cell)
                left[place] += units[row, k] * cell.n[0]
                left[place + 1] += units[row, k] * cell.n[1]
                right[place] += share * d_x
                right[place + 1] += share * d_y
    if dual:
        add_chains(slave, chain, divisor, nodes, starts, right)


@compile_inline
def _add_unit(units: FloatArray, row: int, point: CellPoint, pressure: float) -> None:
    f = point.weight * pressure
    for k, shape in enumerate(((1 - point.c) / 2, (1 + point.c) / 2, point.xi - 1, -point.xi)):
        units[row, k] += shape * f


@compile_inline
def _add_moments(
    sums: Fields, cell: CellFrame, point: CellPoint, shapes: FloatArray, s: int, difference: float, gaps: Vector
) -> None:
    """Add what a point gives to the rows of c̄ and v of its segment; `difference` is p_B − p_A, `gaps` are G_A, G_B."""
    rows, units, chain = sums
    kappa, variance, extent = shapes[s, KAPPA], shapes[s, VARIANCE], shapes[s, EXTENT]
    centred = (point.c - shapes[s, ORIGIN]) - shapes[s, MEAN]
    by_mean = 0.5 - kappa - (shapes[s, ORIGIN] + shapes[s, MEAN]) / variance * centred
    by_variance, w = -kappa / variance * centred, point.weight
    add_to_row(rows, 6, cell, point, (centred / extent, w / extent, 0.0, 0.0))
    add_to_row(rows, 7, cell, point, ((centred * centred - variance) / extent, 2 * w * centred / extent, 0.0, 0.0))
    _add_unit(units, 2, point, difference * by_mean)
    _add_unit(units, 3, point, difference * by_variance)
    for end, sign in enumerate((-shapes[s, ALIKE], shapes[s, ALIKE])):
        chain[s, end, 0] += sign * (point.gap - gaps[end]) * w * by_mean
        chain[s, end, 1] += sign * (point.gap - gaps[end]) * w * by_variance


@compile_maker
def add_chains(
    slave: IntArray, chain: FloatArray, divisor: FloatArray, nodes: NumberArray, starts: IntArray, right: FloatArray
) -> None:
    """Add to the row of each active node what it gains from c̄ and v of its segments.

    `chain` (n_segments, 2 ends, 2) are the factors. The group of a node holds those of its segments, and all ascend.
    """
    n_nodes = len(divisor)
    for s in range(len(slave)):
        for end in range(2):
            j = slave[s, end]
            if starts[j + 1] == starts[j]:
                continue
            for moment in range(2):
                row, factor, place = n_nodes + moment * len(slave) + s, chain[s, end, moment] / divisor[j], starts[j]
                for member in range(starts[row], starts[row + 1]):
                    while nodes[place] != nodes[member]:
                        place += 1
                    right[2 * place] += factor * right[2 * member]
                    right[2 * place + 1] += factor * right[2 * member + 1]
