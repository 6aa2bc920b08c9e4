"""The tangent of forces on cells in the frame (τ, n) of a slave segment, for slaves that look along their normal.

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
`cell_geometry` has the same Δ for directions that turn; tests hold one against the other.

With F = w p and the N_k as above forces and their derivative, written straight into compressed rows, are

    R_k = Σ N_k F n        ΔR_k = Σ (N_k ΔF + F ΔN_k) n − N_k F ω τ        ΔF = p Δw + w (p_c Δc + p_g Δg)

So ΔR_k·n is a row. A method is p, p_c and p_g at each point.

Rule for the next editor: nothing is allocated for a cell. The array `rows` is room that a caller reuses.
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from contactverif.compiler import compile_inline
from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Interface
from contactverif.geometry.block_rows import Csr, Fields, add_block
from contactverif.geometry.projection import Vector, dot, frame, minus, node
from contactverif_mortar.cell_geometry import NODE_1, NODE_2, A, B, SlaveView, facing_point, seen_from, slave_view
from contactverif_mortar.integration_cells import Cells, Quadrature, read_only

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
    """Return the arrays of segments and cells and those of the rule, as kernels unpack them.

    A length of −1 stands for the current length of a slave segment.
    """
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
