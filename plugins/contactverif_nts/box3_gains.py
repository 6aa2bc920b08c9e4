"""Appendix A of the paper: what the numbers of a virtual slave node gain when nodes are displaced.

Displacements have their components along n and t of the master segment of the virtual slave node: Δω, Δg and many more
are zero along t. So a Δ is one number, for one node and one direction (`Gain`). What is frozen in the pairing has no Δ.

Ends of areas that master nodes cut are moved by further nodes. By the chain rule a force F then gains ∂F/∂c Δc, too,
and ∂F/∂c is the gain of one more direction: c grows, and no node moves.

Source: Zavarise & De Lorenzis (2009), Eqs. 8–11, A1–A28.
"""

from __future__ import annotations

from typing import NamedTuple

from contactverif.compiler import compile_inline
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.geometry.projection import PointOnSegment, Vector, arm, dot, frame, minus, node
from contactverif_nts.box3 import Area, VirtualSlaveNode, across_parts, sum_of_parts
from contactverif_nts.turned_force import ZERO, times
from contactverif_nts.walk import NOT_CUT


class Places(NamedTuple):
    """The first unknowns of A, B, 1 and 2 in a coupling, and the place of its multiplier behind all nodes."""

    a: int
    b: int
    node_1: int
    node_2: int
    multiplier: int


class Force(NamedTuple):
    """The force of a virtual slave node, negative where it presses, and what its derivatives share."""

    stiffness: float  # the penalty, or 1 for a multiplier: the pressure is −stiffness × e
    e: float  # the gap, or −λ
    l_ab: float
    share: float  # (c_P − c_Q)/2
    size: float  # l_AB × share, the force of a unit pressure
    f_v: float  # F_V = stiffness × e × size
    by_gap: float  # 1, or 0 for a multiplier: e gains this × Δg
    xi: float
    along: float  # t·(x_B − x_A)/2
    across: float  # n·(x_B − x_A)/2
    stretch_n: float  # n·t_AB and t·t_AB, or zero where the length of A B is that of the reference configuration
    stretch_t: float


class Pressure(NamedTuple):
    """The pressure on the master segments of a virtual slave node, negative where it presses."""

    is_balanced: bool
    s: float  # S = ΣW
    turning: float  # (x_Q − x_P)·n, a free end in the place of the end that it truncates
    p_moves: float  # 1 where S begins at P, 0 where at a free end
    q_moves: float
    size: float  # F_V/S, or stiffness × e
    unit: float  # its derivative by the multiplier, sign reversed


class Part(NamedTuple):
    """The part [a, b] of one master segment f m under an area of competence (Box 3)."""

    length: float  # L_j
    rise: float  # (x_m − x_f)·n
    a: float
    b: float
    a_moves: float  # 1 where a is where P projects, 0 where it is fixed
    b_moves: float
    a_lever: float  # (x_P − (1−a)x_f − a x_m)·n
    b_lever: float
    w_f: float  # W_f and W_m (Eq. 9)
    w_m: float


class Cut(NamedTuple):
    """An end of an area of competence that a master node e cuts in the frame of a master segment, and its Δc."""

    is_cut: bool
    e: int  # first unknowns of the node e and of those of the frame
    frame_1: int
    frame_2: int
    by_a: Vector  # Δc for a displacement of A, B, e and the nodes of the frame
    by_b: Vector
    by_e: Vector
    by_1: Vector
    by_2: Vector


class LinearizedNode(NamedTuple):
    """A virtual slave node with all that its derivatives need."""

    v: VirtualSlaveNode
    force: Force
    at: Places
    p_cut: Cut
    q_cut: Cut


class Gain(NamedTuple):
    """The gains of a virtual slave node for one displacement: Δω, Δg, l Δξ, Δl_AB, Δc_P and Δc_Q."""

    omega: float
    g: float
    s: float
    l_ab: float
    c_p: float
    c_q: float


class Ends(NamedTuple):
    """The gains of the part of a master segment at fixed ω and c: t·Δx_P, t·Δx_Q, and t·Δ of its nodes f and m."""

    p: float
    q: float
    f: float
    m: float


N_CORE = 4  # A, B, 1 and 2
FIXED = Ends(0.0, 0.0, 0.0, 0.0)
NO_GAIN = Gain(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@compile_inline
def force_at(
    v: VirtualSlaveNode, l_ab: float, stiffness: float, e: float, has_multipliers: bool, current_area: bool
) -> Force:
    """Return the force of a virtual slave node."""
    share = (v.c_p - v.c_q) / 2
    f_v = stiffness * e * l_ab * share
    ab, by_gap = minus(v.x_b, v.x_a), 0.0 if has_multipliers else 1.0
    _, t_ab, _ = frame(v.x_a, v.x_b)
    stretch_n, stretch_t = (dot(t_ab, v.normal), dot(t_ab, v.t)) if current_area else ZERO
    xi, along, across = dot(v.d, v.t) / v.l_12, dot(ab, v.t) / 2, dot(ab, v.normal) / 2
    return Force(stiffness, e, l_ab, share, l_ab * share, f_v, by_gap, xi, along, across, stretch_n, stretch_t)


@compile_inline
def pressure_on_master(
    x: FloatArray, master: IntArray, v: VirtualSlaveNode, area: Area, force: Force, is_balanced: bool
) -> Pressure:
    """Return the pressure of a virtual slave node on several master segments."""
    s, turning = sum_of_parts(x, v, area, master), dot(across_parts(x, v, area, master), v.normal)
    p_moves, q_moves = 1.0 if area.clip_p == NOT_CUT else 0.0, 1.0 if area.clip_q == NOT_CUT else 0.0
    if is_balanced:
        return Pressure(True, s, turning, p_moves, q_moves, force.f_v / s, force.size / s)
    return Pressure(False, s, turning, p_moves, q_moves, force.stiffness * force.e, 1.0)


@compile_inline
def cut_end(
    x: FloatArray, master: IntArray, slots: IntArray, v: VirtualSlaveNode, c: float, segment: int, e: int
) -> Cut:
    """Return the end c of an area, cut by the master node e in the frame of a master segment unless e is NOT_CUT.

    Δc = −[t·(Δx_c − Δx_e) + ((x_c − x_e)·n) ω] / (t·(x_B − x_A)/2), Δx_c at fixed c.
    """
    if e == NOT_CUT:
        return Cut(False, 0, 0, 0, ZERO, ZERO, ZERO, ZERO, ZERO)
    node_1, node_2 = master[segment, 0], master[segment, 1]
    l_12, t, normal = frame(node(x, node_1), node(x, node_2))
    half = dot(minus(v.x_b, v.x_a), t) / 2
    lever = dot(arm(node(x, e), PointOnSegment(v.x_a, v.x_b, c)), normal)
    by_a, by_b, by_e = times(-(1 - c) / 2 / half, t), times(-(1 + c) / 2 / half, t), times(1 / half, t)
    by_1, by_2 = times(lever / (l_12 * half), normal), times(-lever / (l_12 * half), normal)
    return Cut(True, slots[e], slots[node_1], slots[node_2], by_a, by_b, by_e, by_1, by_2)


@compile_inline
def part_under_area(x_f: Vector, x_m: Vector, v: VirtualSlaveNode, area: Area, j: int) -> Part:
    """Return the part of master segment j with the nodes f and m, and what its derivative needs."""
    fm = minus(x_m, x_f)
    length, rise = dot(fm, v.t), dot(fm, v.normal)
    a, b, a_moves, b_moves, a_lever, b_lever = 0.0, 1.0, 0.0, 0.0, 0.0, 0.0
    if j == area.first:
        fp, a = arm(x_f, v.p), float(area.clip_p)
        if area.clip_p == NOT_CUT:
            a, a_moves = dot(fp, v.t) / length, 1.0
            a_lever = dot(fp, v.normal) - a * rise
    if j == area.last:
        fq, b = arm(x_f, v.q), float(area.clip_q)
        if area.clip_q == NOT_CUT:
            b, b_moves = dot(fq, v.t) / length, 1.0
            b_lever = dot(fq, v.normal) - b * rise
    half = (b * b - a * a) / 2
    return Part(length, rise, a, b, a_moves, b_moves, a_lever, b_lever, length * ((b - a) - half), length * half)


@compile_inline
def gains_of_node(k: int, v: VirtualSlaveNode, force: Force, at: Places) -> tuple[int, Gain, Gain, Ends]:
    """Return the first unknown of A, B, 1 or 2 (k = 0 … 3), and the gains for its displacement along n and along t.

    Δω = n·(Δx2 − Δx1)/l, Δg = n·(Δx_V − (1−ξ)Δx1 − ξΔx2), l Δξ = t·(Δx_V − (1−ξ)Δx1 − ξΔx2) + g ω, and
    Δl_AB = t_AB·(Δx_B − Δx_A). The ends move along t with A and B.
    """
    place, shape, omega, sign, ends = at.a, (1 - v.c) / 2, 0.0, -1.0, Ends((1 - v.c_p) / 2, (1 - v.c_q) / 2, 0.0, 0.0)
    if k == 1:
        place, shape, sign, ends = at.b, (1 + v.c) / 2, 1.0, Ends((1 + v.c_p) / 2, (1 + v.c_q) / 2, 0.0, 0.0)
    elif k == 2:
        place, shape, omega, sign, ends = at.node_1, -(1 - force.xi), -1 / v.l_12, 0.0, FIXED
    elif k == 3:
        place, shape, omega, sign, ends = at.node_2, -force.xi, 1 / v.l_12, 0.0, FIXED
    along_n = Gain(omega, shape, v.g * omega, sign * force.stretch_n, 0.0, 0.0)
    along_t = Gain(0.0, 0.0, shape, sign * force.stretch_t, 0.0, 0.0)
    return place, along_n, along_t, ends


@compile_inline
def gain_of_p(force: Force) -> Gain:
    """Return the gains where c_P grows and no node moves: Δx_V = (x_B − x_A)/2 Δc_V, and c_V gains half of that."""
    return Gain(0.0, force.across / 2, force.along / 2, 0.0, 1.0, 0.0)


@compile_inline
def gain_of_q(force: Force) -> Gain:
    """Return the gains where c_Q grows and no node moves."""
    return Gain(0.0, force.across / 2, force.along / 2, 0.0, 0.0, 1.0)


@compile_inline
def gain_of_size(d: Gain, force: Force) -> float:
    """Return Δ(l_AB (c_P − c_Q)/2), the gain of the force of a unit pressure."""
    return force.share * d.l_ab + force.l_ab / 2 * (d.c_p - d.c_q)


@compile_inline
def gain_of_force(d: Gain, force: Force) -> float:
    """Return ΔF_V = stiffness × (size Δe + e Δsize)."""
    return force.stiffness * (force.size * (force.by_gap * d.g) + force.e * gain_of_size(d, force))


@compile_inline
def gains_on_segment(
    d: Gain, v: VirtualSlaveNode, force: Force, share_1: float, share_2: float, is_slave: bool
) -> tuple[float, float]:
    """Return Δ of two shares of F_V: (1 ∓ c)/2 F_V on the slave segment, −(1−ξ) F_V and −ξ F_V on a master segment."""
    d_f, by_share = gain_of_force(d, force), -force.f_v * (d.s / v.l_12)
    if is_slave:
        by_share = force.f_v / 2 * ((d.c_p + d.c_q) / 2)
    return share_1 * d_f - by_share, share_2 * d_f + by_share


@compile_inline
def gains_on_part(d: Gain, ends: Ends, force: Force, pressure: Pressure, part: Part) -> tuple[float, float]:
    """Return Δ of −pressure × W_f and of −pressure × W_m (A13–A27).

    ΔL_j = t·(Δx_m − Δx_f) + ((x_m − x_f)·n) ω, and ΔS = t·(Δx_Q − Δx_P) + ((x_Q − x_P)·n) ω without free ends
    L_j Δa = t·(Δx_P − (1−a)Δx_f − aΔx_m) + ((x_P − (1−a)x_f − a x_m)·n) ω, and the same for b with Q
    ΔW_m = L (b Δb − a Δa) + (b² − a²)/2 ΔL
    ΔW_f = L (Δb − Δa) − L (b Δb − a Δa) + [(b − a) − (b² − a²)/2] ΔL
    """
    a, b = part.a, part.b
    d_p = force.stiffness * (force.by_gap * d.g)
    x_p, x_q = ends.p + force.along * d.c_p, ends.q + force.along * d.c_q
    if pressure.is_balanced:
        d_s = pressure.q_moves * x_q - pressure.p_moves * x_p + pressure.turning * d.omega
        d_p = (gain_of_force(d, force) - pressure.size * d_s) / pressure.s
    d_length = ends.m - ends.f + part.rise * d.omega
    d_a = part.a_moves * (x_p - (1 - a) * ends.f - a * ends.m + part.a_lever * d.omega)
    d_b = part.b_moves * (x_q - (1 - b) * ends.f - b * ends.m + part.b_lever * d.omega)
    moment, half = b * d_b - a * d_a, (b * b - a * a) / 2
    d_wm = moment + half * d_length
    d_wf = d_b - d_a - moment + ((b - a) - half) * d_length
    return -(part.w_f * d_p + pressure.size * d_wf), -(part.w_m * d_p + pressure.size * d_wm)


@compile_inline
def gains_of_sum(d_s: float, pressure: Pressure, part: Part) -> tuple[float, float]:
    """Return Δ of −pressure × W_f and of −pressure × W_m where a free end moves that S reaches to, by ΔS."""
    d_p = pressure.size * d_s / pressure.s
    return part.w_f * d_p, part.w_m * d_p


@compile_inline
def gain_of_constraint(d: Gain, v: VirtualSlaveNode, force: Force) -> float:
    """Return Δ(−g × size)."""
    return -(force.size * d.g + v.g * gain_of_size(d, force))
