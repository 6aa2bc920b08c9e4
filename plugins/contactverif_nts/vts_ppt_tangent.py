"""The exact tangent of VTS-PPT: the derivative of `vts_ppt_force.add_residual`, as Appendix A of the paper derives it.

A coupling is the work that is done at once: all virtual slave nodes of a slave segment with all their master segments.
Where this has too many nodes for a small dense matrix, a coupling is one virtual slave node, and if that still has too
many, one virtual slave node with one master segment. So the tangent of a slave segment over n master segments has O(n)
entries. No two multipliers feel each other, so with multipliers a coupling is never more than one virtual slave node.

The matrix `local` of a coupling takes the blocks of all its nodes, and no others. In the frame n, t of the master
segment of a virtual slave node the block

    Δ(F n) = n ΔF + F Δn,   Δn = −t ω

has three numbers: ΔF for a displacement along n, ΔF along t, and F Δω along n. So a variation is one number, for one
node and one direction; Δω, Δg and many more are zero along t. What is frozen in the pairing has none.

Ends of areas that master nodes cut are moved by further nodes. By the chain rule a force F then gains ∂F/∂c Δc, too,
and ∂F/∂c is the variation in one more direction: c grows, and no node moves.

The same sweep makes the forces, those of `vts_ppt_force.add_residual` up to roundoff.

Rules for the next editor:

1. `_sweep` adds the matrix of a coupling as a whole. What it writes must be listed by `list_couplings`.
2. Nothing is allocated for a point: vectors and named tuples of numbers are free, arrays are not.

Source: Zavarise & De Lorenzis (2009), Eqs. 8–11, A1–A28.
"""

from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_kernel, constant
from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.geometry.block_rows import (
    MOST_NODES,
    NO_NODE,
    WIDTH,
    Csr,
    Fields,
    NumberArray,
    add_column,
    add_entry,
    add_local_matrix,
    add_row,
    find_runs,
    insert_node,
)
from contactverif.geometry.projection import ZERO, PointOnSegment, Vector, arm, dot, frame, minus, node, times
from contactverif_nts.nts_force import area_length
from contactverif_nts.vts_ppt_force import (
    BALANCED,
    NOT_CUT,
    Area,
    VirtualSlaveNode,
    across_parts,
    area_of_competence,
    length_of_area,
    sum_of_parts,
    virtual_slave_node,
)

WHOLE = constant(-1)  # All master segments, where the number of one may stand.
_BEGIN = constant(0)
_FEW = 2  # The nodes of a point over so many master segments always fit: A, B, four that cut, and three.


def list_couplings(surfaces: Fields, areas: Fields, n: int, group: int, first_multiplier: int) -> Fields:
    """List the couplings of all virtual slave nodes, n on each slave segment, at most `group` in a coupling.

    Return their nodes (n_entries,), ascending within a coupling, its multiplier last; where each begins
    (n_couplings + 1,); from which to which virtual slave node each goes; and its master segment, or WHOLE. The number
    of the first multiplier is NO_NODE for a penalty.
    """
    _, first, last, _, _, _, _, _, active = areas
    n_most, n_entries = _bound_couplings(surfaces[3], first, last, active, first_multiplier != NO_NODE)
    nodes, starts = np.empty(n_entries, dtype=np.int32), np.empty(n_most + 1, dtype=np.int64)
    work = (*np.empty((3, n_most), dtype=np.int64),)
    count, place = _write_couplings((nodes, starts, *work), surfaces, areas, n, group, first_multiplier)
    return nodes[:place], starts[: count + 1], *[each[:count] for each in work]


@compile_kernel
def _write_couplings(
    written: Fields, surfaces: Fields, areas: Fields, n: int, group: int, first_multiplier: int
) -> tuple[int, int]:
    """Write the answers; return the number of couplings, and of the entries of `nodes`."""
    _, slave, master, neighbours = surfaces
    partner, first, last, cutting, cut_p, cut_q, clip_p, clip_q, active = areas
    nodes, starts, first_point, end_point, segment = written
    has_multipliers = first_multiplier != NO_NODE
    coupling, place, starts[0] = 0, _BEGIN, 0
    for begin in range(0, len(active), group):
        i, end, j = begin, begin + group, WHOLE
        while i < begin + group:
            start = place
            for point in range(i, end):
                if active[point] and place - start <= MOST_NODES:
                    cuts = cutting[point], cut_p[point], cut_q[point], clip_p[point], clip_q[point]
                    area = Area(partner[point], first[point], last[point], *cuts)
                    place = _insert_segment(nodes, start, place, slave, point // n)
                    place = _insert_point(nodes, start, place, master, neighbours, area, j)
            if place - start > MOST_NODES:
                place = start
                end, j = (i + 1, WHOLE) if end - i > 1 else (end, first[i])
                continue
            if has_multipliers:
                nodes[place], place = first_multiplier + i, place + 1
            if place > start:
                first_point[coupling], end_point[coupling], segment[coupling] = i, end, j
                starts[coupling + 1], coupling = place, coupling + 1
            if j != WHOLE and j != last[i]:
                j = neighbours[j, 1]
            else:
                i, end, j = end, end + 1, WHOLE
    return coupling, place


@compile_inline
def _insert_point(
    nodes: NumberArray, start: int, place: int, master: IntArray, neighbours: IntArray, area: Area, j: int
) -> int:
    """Insert the nodes of a point with one or the WHOLE of its segments; return the end, past MOST_NODES if cut off."""
    if area.frame != NOT_CUT:
        place = _insert_segment(nodes, start, place, master, area.frame)
    if area.cut_p != NOT_CUT:
        place = insert_node(nodes, start, place, area.cut_p)
    if area.cut_q != NOT_CUT:
        place = insert_node(nodes, start, place, area.cut_q)
    place = _insert_segment(nodes, start, place, master, area.master)
    if area.clip_p != NOT_CUT:  # A free end that truncates an area, on which a balanced pressure depends
        place = insert_node(nodes, start, place, master[area.first, 0])
    if area.clip_q != NOT_CUT:
        place = insert_node(nodes, start, place, master[area.last, 1])
    k, k_last = (area.first, area.last) if j == WHOLE else (j, j)
    place = _insert_segment(nodes, start, place, master, k)
    while k != k_last and place - start <= MOST_NODES:
        k = neighbours[k, 1]
        place = _insert_segment(nodes, start, place, master, k)
    return place


@compile_inline
def _insert_segment(nodes: NumberArray, start: int, place: int, segments: IntArray, segment: int) -> int:
    place = insert_node(nodes, start, place, segments[segment, 0])
    return insert_node(nodes, start, place, segments[segment, 1])


@compile_kernel
def _bound_couplings(
    neighbours: IntArray, first: IntArray, last: IntArray, active: BoolArray, has_multipliers: bool
) -> tuple[int, int]:
    n_couplings, n_entries, most = 0, MOST_NODES + 2, MOST_NODES + 2
    for i in range(len(active)):
        if not active[i]:
            n_couplings, n_entries = n_couplings + has_multipliers, n_entries + has_multipliers
            continue
        n_segments, j = 1, first[i]
        while j != last[i]:
            n_segments, j = n_segments + 1, neighbours[j, 1]
        n_parts = n_segments if n_segments > _FEW else 1
        n_couplings, n_entries = n_couplings + n_parts, n_entries + n_parts * most
    return n_couplings, n_entries


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
    columns: tuple[int, int, int, int, int]  # first unknowns of A, B, e and the two nodes of the frame
    by: tuple[Vector, Vector, Vector, Vector, Vector]  # Δc for their displacements


class LinearizedNode(NamedTuple):
    """A virtual slave node with all that its derivatives need."""

    v: VirtualSlaveNode
    force: Force
    at: Places
    p_cut: Cut
    q_cut: Cut


class Variation(NamedTuple):
    """The variation of a virtual slave node for one displacement: Δω, Δg, l Δξ, Δl_AB, Δc_P and Δc_Q."""

    omega: float
    g: float
    s: float
    l_ab: float
    c_p: float
    c_q: float


class Ends(NamedTuple):
    """The variation of the part of a master segment at fixed ω and c: t·Δx_P, t·Δx_Q, and t·Δ of its nodes f and m."""

    p: float
    q: float
    f: float
    m: float


_N_CORE = 4  # A, B, 1 and 2
_N_CUTTING = 5  # The nodes of a `Cut`.
_FIXED = Ends(0.0, 0.0, 0.0, 0.0)
_NO_VARIATION = Variation(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@compile_inline
def _force_at(
    v: VirtualSlaveNode, l_ab: float, stiffness: float, e: float, has_multipliers: bool, current_area: bool
) -> Force:
    share = (v.c_p - v.c_q) / 2
    f_v = stiffness * e * l_ab * share
    ab, by_gap = minus(v.x_b, v.x_a), 0.0 if has_multipliers else 1.0
    _, t_ab, _ = frame(v.x_a, v.x_b)
    stretch_n, stretch_t = (dot(t_ab, v.normal), dot(t_ab, v.t)) if current_area else ZERO
    xi, along, across = dot(v.d, v.t) / v.l_12, dot(ab, v.t) / 2, dot(ab, v.normal) / 2
    return Force(stiffness, e, l_ab, share, l_ab * share, f_v, by_gap, xi, along, across, stretch_n, stretch_t)


@compile_inline
def _pressure_on_master(
    x: FloatArray, master: IntArray, v: VirtualSlaveNode, area: Area, force: Force, is_balanced: bool
) -> Pressure:
    s, turning = sum_of_parts(x, v, area, master), dot(across_parts(x, v, area, master), v.normal)
    p_moves, q_moves = 1.0 if area.clip_p == NOT_CUT else 0.0, 1.0 if area.clip_q == NOT_CUT else 0.0
    if is_balanced:
        return Pressure(True, s, turning, p_moves, q_moves, force.f_v / s, force.size / s)
    return Pressure(False, s, turning, p_moves, q_moves, force.stiffness * force.e, 1.0)


@compile_inline
def _cut_end(
    x: FloatArray, master: IntArray, slots: IntArray, v: VirtualSlaveNode, at: Places, c: float, segment: int, e: int
) -> Cut:
    """Return the end c of an area, cut by the master node e in the frame of a master segment unless e is NOT_CUT.

    Δc = −[t·(Δx_c − Δx_e) + ((x_c − x_e)·n) ω] / (t·(x_B − x_A)/2), Δx_c at fixed c.
    """
    if e == NOT_CUT:
        return Cut(False, (0, 0, 0, 0, 0), (ZERO, ZERO, ZERO, ZERO, ZERO))
    node_1, node_2 = master[segment, 0], master[segment, 1]
    l_12, t, normal = frame(node(x, node_1), node(x, node_2))
    half = dot(minus(v.x_b, v.x_a), t) / 2
    lever = dot(arm(node(x, e), PointOnSegment(v.x_a, v.x_b, c)), normal)
    along = times(-(1 - c) / 2 / half, t), times(-(1 + c) / 2 / half, t), times(1 / half, t)
    turning = times(lever / (l_12 * half), normal), times(-lever / (l_12 * half), normal)
    return Cut(True, (at.a, at.b, slots[e], slots[node_1], slots[node_2]), (*along, *turning))


@compile_inline
def _part_under_area(x_f: Vector, x_m: Vector, v: VirtualSlaveNode, area: Area, j: int) -> Part:
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
def _variation_of_node(k: int, v: VirtualSlaveNode, force: Force, at: Places) -> tuple[int, Variation, Variation, Ends]:
    """Return the first unknown of A, B, 1 or 2 (k = 0 … 3), and the variation for its displacement along n and along t.

    Δω = n·(Δx2 − Δx1)/l, Δg = n·(Δx_V − (1−ξ)Δx1 − ξΔx2), l Δξ = t·(Δx_V − (1−ξ)Δx1 − ξΔx2) + g ω, and
    Δl_AB = t_AB·(Δx_B − Δx_A). The ends move along t with A and B.
    """
    place, shape, omega, sign, ends = at.a, (1 - v.c) / 2, 0.0, -1.0, Ends((1 - v.c_p) / 2, (1 - v.c_q) / 2, 0.0, 0.0)
    if k == 1:
        place, shape, sign, ends = at.b, (1 + v.c) / 2, 1.0, Ends((1 + v.c_p) / 2, (1 + v.c_q) / 2, 0.0, 0.0)
    elif k == 2:
        place, shape, omega, sign, ends = at.node_1, -(1 - force.xi), -1 / v.l_12, 0.0, _FIXED
    elif k == 3:
        place, shape, omega, sign, ends = at.node_2, -force.xi, 1 / v.l_12, 0.0, _FIXED
    along_n = Variation(omega, shape, v.g * omega, sign * force.stretch_n, 0.0, 0.0)
    along_t = Variation(0.0, 0.0, shape, sign * force.stretch_t, 0.0, 0.0)
    return place, along_n, along_t, ends


@compile_inline
def _variations_of_cuts(point: LinearizedNode) -> tuple[tuple[Variation, Cut], tuple[Variation, Cut]]:
    """Return the variations where c_P or c_Q grows and no node moves, and the cuts of these ends.

    Δx_V = (x_B − x_A)/2 Δc_V, and c_V gains half of that.
    """
    across, along = point.force.across / 2, point.force.along / 2
    by_p, by_q = Variation(0.0, across, along, 0.0, 1.0, 0.0), Variation(0.0, across, along, 0.0, 0.0, 1.0)
    return (by_p, point.p_cut), (by_q, point.q_cut)


@compile_inline
def _variation_of_size(d: Variation, force: Force) -> float:
    """Return Δ(l_AB (c_P − c_Q)/2), that of the force of a unit pressure."""
    return force.share * d.l_ab + force.l_ab / 2 * (d.c_p - d.c_q)


@compile_inline
def _variation_of_force(d: Variation, force: Force) -> float:
    """Return ΔF_V = stiffness × (size Δe + e Δsize)."""
    return force.stiffness * (force.size * (force.by_gap * d.g) + force.e * _variation_of_size(d, force))


@compile_inline
def _variation_on_segment(
    d: Variation, v: VirtualSlaveNode, force: Force, share_1: float, share_2: float, is_slave: bool
) -> tuple[float, float]:
    """Return Δ of two shares of F_V: (1 ∓ c)/2 F_V on the slave segment, −(1−ξ) F_V and −ξ F_V on a master segment."""
    d_f, by_share = _variation_of_force(d, force), -force.f_v * (d.s / v.l_12)
    if is_slave:
        by_share = force.f_v / 2 * ((d.c_p + d.c_q) / 2)
    return share_1 * d_f - by_share, share_2 * d_f + by_share


@compile_inline
def _variation_on_part(d: Variation, ends: Ends, force: Force, pressure: Pressure, part: Part) -> tuple[float, float]:
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
        d_p = (_variation_of_force(d, force) - pressure.size * d_s) / pressure.s
    d_length = ends.m - ends.f + part.rise * d.omega
    d_a = part.a_moves * (x_p - (1 - a) * ends.f - a * ends.m + part.a_lever * d.omega)
    d_b = part.b_moves * (x_q - (1 - b) * ends.f - b * ends.m + part.b_lever * d.omega)
    moment, half = b * d_b - a * d_a, (b * b - a * a) / 2
    d_wm = moment + half * d_length
    d_wf = d_b - d_a - moment + ((b - a) - half) * d_length
    return -(part.w_f * d_p + pressure.size * d_wf), -(part.w_m * d_p + pressure.size * d_wm)


@compile_inline
def _variation_of_constraint(d: Variation, v: VirtualSlaveNode, force: Force) -> float:
    """Return Δ(−g × size)."""
    return -(force.size * d.g + v.g * _variation_of_size(d, force))


def add_forces_and_tangent(
    rows: FloatArray, csr: Csr, state: Fields, arguments: Fields, couplings: Fields, share: Fields
) -> None:
    """Add the residual (n_unknowns,) at one state, and its derivative, to the rows of one share of the work.

    `csr` is a matrix with the pattern of the couplings, `arguments` are those of the residual behind the state.
    """
    slots, runs = np.empty(len(state[0]), dtype=np.int64), np.empty(MOST_NODES, dtype=np.int32)
    room = slots, runs, np.empty((WIDTH, WIDTH)), np.empty(WIDTH)
    _sweep(rows, csr, state, arguments, couplings, share, room)


@compile_kernel
def _sweep(
    rows: FloatArray, csr: Csr, state: Fields, arguments: Fields, couplings: Fields, share: Fields, room: Fields
) -> None:
    """Do so, with room for the first unknowns of nodes in a coupling, its runs, its matrix and its forces."""
    (x, multipliers), (surfaces, areas, options) = state, arguments
    reference, slave, master, neighbours = surfaces
    partner, first, last, cutting, cut_p, cut_q, clip_p, clip_q, active = areas
    n, transmission, current_area, penalty = options
    nodes, starts, first_point, end_point, only = couplings
    owner, part, begin, end, others = share
    has_multipliers = len(multipliers) > 0
    slots, runs, local, push = room
    for number in range(end - begin + len(others)):
        coupling = begin + number if number < end - begin else others[number - (end - begin)]
        start, n_coupled = starts[coupling], starts[coupling + 1] - starts[coupling] - has_multipliers
        width = 2 * n_coupled
        for q in range(n_coupled):
            slots[nodes[start + q]] = 2 * q
        for u in range(width + has_multipliers):
            push[u] = 0.0
            for w in range(width + has_multipliers):
                local[u, w] = 0.0
        for i in range(first_point[coupling], end_point[coupling]):
            if not active[i]:
                if has_multipliers:
                    local[width, width] = area_length(reference, slave, i // n, -1) / n
                    push[width] = local[width, width] * multipliers[i]
                continue
            area = Area(partner[i], first[i], last[i], cutting[i], cut_p[i], cut_q[i], clip_p[i], clip_q[i])
            node_a, node_b = slave[i // n, 0], slave[i // n, 1]
            node_1, node_2 = master[area.master, 0], master[area.master, 1]
            x_a, x_b, x_1, x_2 = node(x, node_a), node(x, node_b), node(x, node_1), node(x, node_2)
            c_p, c_q = area_of_competence(x, slave, master, n, i, area.frame, area.cut_p, area.cut_q)
            l_ab = length_of_area(x_a, x_b, node(reference, node_a), node(reference, node_b), current_area)
            v = virtual_slave_node(x_a, x_b, x_1, x_2, c_p, c_q)
            at = Places(slots[node_a], slots[node_b], slots[node_1], slots[node_2], width)
            stiffness, e = (1.0, -multipliers[i]) if has_multipliers else (penalty, v.g)
            force = _force_at(v, l_ab, stiffness, e, has_multipliers, current_area)
            p_cut = _cut_end(x, master, slots, v, at, v.c_p, area.frame, area.cut_p)
            q_cut = _cut_end(x, master, slots, v, at, v.c_q, area.frame, area.cut_q)
            point = LinearizedNode(v, force, at, p_cut, q_cut)
            if only[coupling] in (WHOLE, area.first):
                _add_segment_forces(local, push, point, True)
                if has_multipliers:
                    _add_constraint(local, push, point)
            if area.first == area.last:  # IF only one segment is involved THEN Eq. 6
                _add_segment_forces(local, push, point, False)
            else:  # ELSE assembly of all the involved segments
                pressure = _pressure_on_master(x, master, v, area, force, transmission == BALANCED)
                free_ends = slots[master[area.first, 0]], slots[master[area.last, 1]]
                j, j_last = (area.first, area.last) if only[coupling] == WHOLE else (only[coupling], only[coupling])
                while j >= 0:
                    f, m = master[j, 0], master[j, 1]
                    part_j = _part_under_area(node(x, f), node(x, m), v, area, j)
                    _add_part_forces(local, push, point, pressure, part_j, slots[f], slots[m], free_ends)
                    j = neighbours[j, 1] if j != j_last else NO_NODE
        find_runs(runs, nodes, start, n_coupled)
        add_local_matrix(csr, (nodes, start, n_coupled), runs, local, owner, part)
        multiplier = nodes[start + n_coupled] if has_multipliers else NO_NODE
        members = nodes, start, n_coupled, multiplier
        _add_push_and_multiplier(rows, csr, members, local, push, owner, part, len(x) + multiplier)


@compile_inline
def _add_push_and_multiplier(
    rows: FloatArray,
    csr: Csr,
    members: Fields,
    local: FloatArray,
    push: FloatArray,
    owner: NumberArray,
    part: int,
    unknown: int,
) -> None:
    """Add the forces of a coupling, and row, column and constraint of its multiplier unless that is NO_NODE."""
    nodes, start, n_coupled, multiplier = members
    width = 2 * n_coupled
    is_mine = multiplier != NO_NODE and owner[multiplier] == part
    for q in range(n_coupled):
        row = nodes[start + q]
        if owner[row] == part:
            rows[2 * row] += push[2 * q]
            rows[2 * row + 1] += push[2 * q + 1]
            if multiplier != NO_NODE:
                add_column(csr, row, unknown, local[2 * q, width], local[2 * q + 1, width])
        if is_mine:
            add_row(csr, unknown, row, local[width, 2 * q], local[width, 2 * q + 1])
    if is_mine:
        rows[unknown] += push[width]
        add_entry(csr, unknown, unknown, local[width, width])


@compile_inline
def _add_force(push: FloatArray, row: int, size: float, v: VirtualSlaveNode) -> None:
    push[row] += size * v.normal[0]
    push[row + 1] += size * v.normal[1]


@compile_inline
def _add_block(
    local: FloatArray, row: int, column: int, v: VirtualSlaveNode, along_n: float, along_t: float, turn: float
) -> None:
    """Add the block n (along_n n + along_t t) − turn t n: what a force gains along n, along t, and by turning."""
    (n_x, n_y), (t_x, t_y) = v.normal, v.t
    u_x, u_y = along_n * n_x + along_t * t_x, along_n * n_y + along_t * t_y
    turn_x, turn_y = turn * n_x, turn * n_y
    local[row, column] += n_x * u_x - t_x * turn_x
    local[row, column + 1] += n_x * u_y - t_x * turn_y
    local[row + 1, column] += n_y * u_x - t_y * turn_x
    local[row + 1, column + 1] += n_y * u_y - t_y * turn_y


@compile_inline
def _add_cut_blocks(local: FloatArray, row: int, gain: float, v: VirtualSlaveNode, cut: Cut) -> None:
    """Add n gain Δc, where c is the end of an area that is cut, and a force n F gains this for each unit of c."""
    if cut.is_cut:
        for q in range(_N_CUTTING):
            for k in range(2):
                for m in range(2):
                    local[row + k, cut.columns[q] + m] += gain * v.normal[k] * cut.by[q][m]


@compile_inline
def _add_unit(local: FloatArray, row: int, size: float, v: VirtualSlaveNode, at: Places) -> None:
    """Add the force size × n, which a unit multiplier makes, to the column of the multiplier."""
    local[row, at.multiplier] += size * v.normal[0]
    local[row + 1, at.multiplier] += size * v.normal[1]


@compile_inline
def _add_segment_forces(local: FloatArray, push: FloatArray, point: LinearizedNode, is_slave: bool) -> None:
    """Add the forces on A and B, or on 1 and 2 (Eq. 6), and their Δ."""
    v, force, at, p_cut, q_cut = point
    first, second, share_1, share_2 = at.node_1, at.node_2, -(1 - force.xi), -force.xi
    if is_slave:
        first, second, share_1, share_2 = at.a, at.b, (1 - v.c) / 2, (1 + v.c) / 2
    f_1, f_2 = share_1 * force.f_v, share_2 * force.f_v
    _add_force(push, first, f_1, v)
    _add_force(push, second, f_2, v)
    for k in range(_N_CORE):
        column, d_n, d_t, _ = _variation_of_node(k, v, force, at)
        on_1_n, on_2_n = _variation_on_segment(d_n, v, force, share_1, share_2, is_slave)
        on_1_t, on_2_t = _variation_on_segment(d_t, v, force, share_1, share_2, is_slave)
        _add_block(local, first, column, v, on_1_n, on_1_t, f_1 * d_n.omega)
        _add_block(local, second, column, v, on_2_n, on_2_t, f_2 * d_n.omega)
    if p_cut.is_cut or q_cut.is_cut:
        for d, cut in _variations_of_cuts(point):
            on_1, on_2 = _variation_on_segment(d, v, force, share_1, share_2, is_slave)
            _add_cut_blocks(local, first, on_1, v, cut)
            _add_cut_blocks(local, second, on_2, v, cut)
    if force.by_gap == 0.0:
        _add_unit(local, first, -share_1 * force.size, v, at)
        _add_unit(local, second, -share_2 * force.size, v, at)


@compile_inline
def _add_part_forces(
    local: FloatArray,
    push: FloatArray,
    point: LinearizedNode,
    pressure: Pressure,
    part: Part,
    f: int,
    m: int,
    free_ends: tuple[int, int],
) -> None:
    """Add the forces −pressure × W n on the nodes f and m of one of several master segments, and their Δ.

    `free_ends` are the first unknowns of the first node of the first segment and of the last node of the last one.
    """
    v, force, at, p_cut, q_cut = point
    f_f, f_m = -pressure.size * part.w_f, -pressure.size * part.w_m
    _add_force(push, f, f_f, v)
    _add_force(push, m, f_m, v)
    for k in range(_N_CORE):
        column, d_n, d_t, ends = _variation_of_node(k, v, force, at)
        f_n, m_n = _variation_on_part(d_n, _FIXED, force, pressure, part)
        f_t, m_t = _variation_on_part(d_t, ends, force, pressure, part)
        _add_block(local, f, column, v, f_n, f_t, f_f * d_n.omega)
        _add_block(local, m, column, v, m_n, m_t, f_m * d_n.omega)
    for ends, column in ((Ends(0.0, 0.0, 1.0, 0.0), f), (Ends(0.0, 0.0, 0.0, 1.0), m)):
        d_f, d_m = _variation_on_part(_NO_VARIATION, ends, force, pressure, part)
        _add_block(local, f, column, v, 0.0, d_f, 0.0)
        _add_block(local, m, column, v, 0.0, d_m, 0.0)
    if pressure.is_balanced:
        # S reaches to this free end, whose displacement moves it.
        for moves, d_s, column in ((pressure.p_moves, -1.0, free_ends[0]), (pressure.q_moves, 1.0, free_ends[1])):
            if moves == 0.0:
                d_p = pressure.size * d_s / pressure.s
                _add_block(local, f, column, v, 0.0, part.w_f * d_p, 0.0)
                _add_block(local, m, column, v, 0.0, part.w_m * d_p, 0.0)
    if p_cut.is_cut or q_cut.is_cut:
        for d, cut in _variations_of_cuts(point):
            d_f, d_m = _variation_on_part(d, _FIXED, force, pressure, part)
            _add_cut_blocks(local, f, d_f, v, cut)
            _add_cut_blocks(local, m, d_m, v, cut)
    if force.by_gap == 0.0:
        _add_unit(local, f, pressure.unit * part.w_f, v, at)
        _add_unit(local, m, pressure.unit * part.w_m, v, at)


@compile_inline
def _add_constraint(local: FloatArray, push: FloatArray, point: LinearizedNode) -> None:
    v, force, at, _, _ = point
    row, normal, t = at.multiplier, v.normal, v.t
    push[row] -= v.g * force.size
    for k in range(_N_CORE):
        column, d_n, d_t, _ = _variation_of_node(k, v, force, at)
        along_n, along_t = _variation_of_constraint(d_n, v, force), _variation_of_constraint(d_t, v, force)
        local[row, column] += along_n * normal[0] + along_t * t[0]
        local[row, column + 1] += along_n * normal[1] + along_t * t[1]
    for d, cut in _variations_of_cuts(point):
        gain = _variation_of_constraint(d, v, force)
        if cut.is_cut:
            for q in range(_N_CUTTING):
                local[row, cut.columns[q]] += gain * cut.by[q][0]
                local[row, cut.columns[q] + 1] += gain * cut.by[q][1]
