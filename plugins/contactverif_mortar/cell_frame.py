"""The Δ of the points of a cell in the frame (τ, n) of its slave segment, for slaves that look along their own normal.

All points of such a cell have one frame: τ along the slave, n out of it, l = |x_B − x_A|. With ω = n·(Δx_B − Δx_A)/l,
L = (x_2 − x_1)·τ and λ = (x_2 − x_1)·n:

    l/2 Δc_e = τ·(Δx_e − (1−c_e)/2 Δx_A − (1+c_e)/2 Δx_B) + g_e ω          the end of the cell that node e cuts
    Δc = (1−a)/2 Δc_low + (1+a)/2 Δc_high                                   the point at the place a of the rule
    L Δξ = τ·(Δx_s − (1−ξ)Δx_1 − ξΔx_2) + l/2 Δc − g ω                      Δx_s at a fixed c
    Δg = n·((1−ξ)Δx_1 + ξΔx_2 − Δx_s) + λ Δξ
    Δw = w_a [l_w/2 (Δc_high − Δc_low) + (c_high − c_low)/2 τ·(Δx_B − Δx_A)]   the last term for current lengths

l_w is the length that weights are measured with. A Δ is an array (4 nodes A, B, 1, 2; 2): what a number gains if a node
moves along τ, and along n. `cell_geometry` has the same Δ for directions that turn, in the global frame; tests hold one
against the other.

Rule for the next editor: nothing is allocated here. The arrays `ends` and `d` are room that a caller reuses.
"""

from __future__ import annotations

from typing import NamedTuple

from contactverif.contract.arrays import FloatArray
from contactverif.geometry.compiled import compile_kernel
from contactverif.geometry.projection import Vector, dot, frame, minus
from contactverif_mortar.cell_geometry import NODE_1, NODE_2, A, B, SlaveView, facing_point, seen_from

TAU, N = range(2)  # The two directions in which a node moves.
C, XI, GAP, WEIGHT = range(4)  # The Δ of a point, in this order.


class CellFrame(NamedTuple):
    """The frame of a cell and the numbers that all its points share."""

    length: float  # l
    measured: float  # l_w
    tau: Vector
    n: Vector
    along: float  # L, negative
    lean: float  # λ
    low: float
    high: float
    current: float  # 1 where weights are measured with current lengths, else 0


@compile_kernel
def begin_cell(
    ends: FloatArray, view: SlaveView, x_1: Vector, x_2: Vector, cut_low: bool, cut_high: bool, measured: float
) -> CellFrame:
    """Return the frame of a cell, and write Δc_low and Δc_high into `ends` (2, 4, 2).

    The nodes 2 and 1 cut the lower and the upper end. A length `measured` of −1 stands for the current length.
    """
    length, tau, n = frame(view.x_a, view.x_b)
    for end in range(2):
        for k in range(4):
            ends[end, k, TAU] = ends[end, k, N] = 0.0
    low, high = -1.0, 1.0
    if cut_low:
        low = seen_from(x_2, view)
        _, gap, _ = facing_point(view, x_1, x_2, low)
        _cut_gains(ends, 0, low, gap, length, NODE_2)
    if cut_high:
        high = seen_from(x_1, view)
        _, gap, _ = facing_point(view, x_1, x_2, high)
        _cut_gains(ends, 1, high, gap, length, NODE_1)
    d, current = minus(x_2, x_1), measured < 0
    return CellFrame(
        length, length if current else measured, tau, n, dot(d, tau), dot(d, n), low, high, 1.0 if current else 0.0
    )


@compile_kernel
def _cut_gains(ends: FloatArray, end: int, c: float, gap: float, length: float, cutting: int) -> None:
    """Write Δ of the c from which the node `cutting` is seen."""
    ends[end, A, TAU] = -(1 - c) / length
    ends[end, B, TAU] = -(1 + c) / length
    ends[end, cutting, TAU] = 2 / length
    turned = 2 * gap / (length * length)
    ends[end, A, N] = -turned
    ends[end, B, N] = turned


@compile_kernel
def write_gains(
    d: FloatArray, ends: FloatArray, cell: CellFrame, place: float, share: float, c: float, xi: float, gap: float
) -> None:
    """Write Δc, Δξ, Δg and Δw of the point at a place of the rule, whose weight there is `share`, into d (4, 4, 2)."""
    half, spread = cell.length / 2, (cell.high - cell.low) / 2
    shape = ((1 - c) / 2, (1 + c) / 2, xi - 1, -xi)
    turn = (-1 / cell.length, 1 / cell.length, 0.0, 0.0)  # ω, of movements along n
    stretch = (-cell.current, cell.current, 0.0, 0.0)  # Δl_w, of movements along τ
    for k in range(4):
        for i in range(2):
            low, high = ends[0, k, i], ends[1, k, i]
            d[C, k, i] = ((1 - place) * low + (1 + place) * high) / 2
            d[XI, k, i] = half * d[C, k, i]
            d[WEIGHT, k, i] = share * cell.measured / 2 * (high - low)
        d[XI, k, TAU] = (d[XI, k, TAU] + shape[k]) / cell.along
        d[XI, k, N] = (d[XI, k, N] - gap * turn[k]) / cell.along
        d[GAP, k, TAU] = cell.lean * d[XI, k, TAU]
        d[GAP, k, N] = cell.lean * d[XI, k, N] - shape[k]
        d[WEIGHT, k, TAU] += share * spread * stretch[k]
