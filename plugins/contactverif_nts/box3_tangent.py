"""The exact tangent of VTS-PPT: the derivative of `box3.residual`, as Appendix A of the paper derives it.

The small dense matrix `local` of a coupling (`box3_couplings`) takes the blocks of all its nodes, and no others. In the
frame n, t of the master segment of a virtual slave node the block

    Δ(F n) = n ΔF + F Δn,   Δn = −t ω

has three numbers: ΔF for a displacement along n, ΔF along t, and F Δω along n. `box3_gains` has the Δ. The same sweep
makes the forces, those of `box3.residual` up to roundoff. Nothing is allocated for a point: vectors and named tuples of
numbers are free, arrays are not.

Source: Zavarise & De Lorenzis (2009), Eqs. 8–11, A1–A28.
"""

from __future__ import annotations

import numpy as np

from contactverif.compiler import compile_inline, compile_kernel
from contactverif.contract.arrays import FloatArray
from contactverif.geometry.block_rows import (
    MOST_NODES,
    NO_NODE,
    WIDTH,
    NumberArray,
    add_column,
    add_entry,
    add_local_matrix,
    add_row,
    find_runs,
)
from contactverif.geometry.projection import Vector, node
from contactverif_nts.box3 import (
    BALANCED,
    Area,
    VirtualSlaveNode,
    area_of_competence,
    length_of_area,
    segment_length,
    virtual_slave_node,
)
from contactverif_nts.box3_couplings import WHOLE
from contactverif_nts.box3_gains import (
    FIXED,
    N_CORE,
    NO_GAIN,
    Cut,
    Ends,
    LinearizedNode,
    Part,
    Places,
    Pressure,
    cut_end,
    force_at,
    gain_of_constraint,
    gain_of_p,
    gain_of_q,
    gains_of_node,
    gains_of_sum,
    gains_on_part,
    gains_on_segment,
    part_under_area,
    pressure_on_master,
)
from contactverif_nts.eq6 import Csr, Fields


def add_forces_and_tangent(
    rows: FloatArray,
    csr: Csr,
    x: FloatArray,
    multipliers: FloatArray,
    surfaces: Fields,
    areas: Fields,
    options: Fields,
    couplings: Fields,
    share: Fields,
) -> None:
    """Add the residual (n_unknowns,) at one state, and its derivative, to the rows of one share of the work.

    `csr` has indptr, indices and data of a matrix with the pattern of the couplings.
    """
    slots, runs = np.empty(len(x), dtype=np.int64), np.empty(MOST_NODES, dtype=np.int32)
    room = slots, runs, np.empty((WIDTH, WIDTH)), np.empty(WIDTH)
    _sweep(rows, csr, x, multipliers, surfaces, areas, options, couplings, share, room)


@compile_kernel
def _sweep(
    rows: FloatArray,
    csr: Csr,
    x: FloatArray,
    multipliers: FloatArray,
    surfaces: Fields,
    areas: Fields,
    options: Fields,
    couplings: Fields,
    share: Fields,
    room: Fields,
) -> None:
    """Do so, with room for the first unknowns of nodes in a coupling, its runs, its matrix and its forces."""
    reference, slave, master, neighbours = surfaces
    partner, first, last, cutting, cut_p, cut_q, clip_p, clip_q, active = areas
    n, transmission, current_area, penalty = options
    nodes, starts, first_point, end_point, only = couplings
    owner, part, begin, end, others = share
    has_multipliers = len(multipliers) > 0
    slots, runs, local, push = room
    for number in range(end - begin + len(others)):
        coupling = begin + number if number < end - begin else others[number - (end - begin)]
        start, n_coupled = starts[coupling], starts[coupling + 1] - starts[coupling]
        if has_multipliers:
            n_coupled -= 1
        width = 2 * n_coupled
        for q in range(n_coupled):
            slots[nodes[start + q]] = 2 * q
        _clear(local, push, width + has_multipliers)
        for i in range(first_point[coupling], end_point[coupling]):
            if not active[i]:
                if has_multipliers:
                    local[width, width] = segment_length(reference, slave, i // n) / n
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
            force = force_at(v, l_ab, stiffness, e, has_multipliers, current_area)
            p_cut = cut_end(x, master, slots, v, v.c_p, area.frame, area.cut_p)
            q_cut = cut_end(x, master, slots, v, v.c_q, area.frame, area.cut_q)
            point = LinearizedNode(v, force, at, p_cut, q_cut)
            if only[coupling] in (WHOLE, area.first):
                _add_segment_forces(local, push, point, True)
                if has_multipliers:
                    _add_constraint(local, push, point)
            if area.first == area.last:  # IF only one segment is involved THEN Eq. 6
                _add_segment_forces(local, push, point, False)
            else:  # ELSE assembly of all the involved segments
                pressure = pressure_on_master(x, master, v, area, force, transmission == BALANCED)
                free_ends = slots[master[area.first, 0]], slots[master[area.last, 1]]
                j, j_last = (area.first, area.last) if only[coupling] == WHOLE else (only[coupling], only[coupling])
                while j >= 0:
                    f, m = master[j, 0], master[j, 1]
                    part_j = part_under_area(node(x, f), node(x, m), v, area, j)
                    _add_part_forces(local, push, point, pressure, part_j, slots[f], slots[m], free_ends)
                    j = neighbours[j, 1] if j != j_last else NO_NODE
        find_runs(runs, nodes, start, n_coupled)
        add_local_matrix(csr, nodes, start, n_coupled, runs, local, owner, part)
        _add_push(rows, nodes, start, n_coupled, push, owner, part)
        if has_multipliers:
            _add_multiplier(rows, csr, nodes, start, n_coupled, len(x), local, push, owner, part)


@compile_inline
def _clear(local: FloatArray, push: FloatArray, width: int) -> None:
    """Set the matrix and the forces of a coupling to zero."""
    for u in range(width):
        push[u] = 0.0
        for w in range(width):
            local[u, w] = 0.0


@compile_inline
def _add_push(
    rows: FloatArray, nodes: NumberArray, start: int, n_coupled: int, push: FloatArray, owner: NumberArray, part: int
) -> None:
    """Add the forces on the nodes of a coupling to the residual."""
    for q in range(n_coupled):
        row = nodes[start + q]
        if owner[row] == part:
            rows[2 * row] += push[2 * q]
            rows[2 * row + 1] += push[2 * q + 1]


@compile_inline
def _add_multiplier(
    rows: FloatArray,
    csr: Csr,
    nodes: NumberArray,
    start: int,
    n_coupled: int,
    n_nodes: int,
    local: FloatArray,
    push: FloatArray,
    owner: NumberArray,
    part: int,
) -> None:
    """Add row and column of the multiplier of a coupling, and its constraint."""
    number, width = nodes[start + n_coupled], 2 * n_coupled
    unknown, is_mine = n_nodes + number, owner[number] == part
    for q in range(n_coupled):
        row = nodes[start + q]
        if owner[row] == part:
            add_column(csr, row, unknown, local[2 * q, width], local[2 * q + 1, width])
        if is_mine:
            add_row(csr, unknown, row, local[width, 2 * q], local[width, 2 * q + 1])
    if is_mine:
        rows[unknown] += push[width]
        add_entry(csr, unknown, unknown, local[width, width])


@compile_inline
def _add_force(push: FloatArray, row: int, size: float, v: VirtualSlaveNode) -> None:
    """Add the force size × n."""
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
def _add_cut_blocks(local: FloatArray, row: int, gain: float, v: VirtualSlaveNode, at: Places, cut: Cut) -> None:
    """Add n gain Δc, where c is the end of an area that is cut, and a force n F gains this for each unit of c."""
    if not cut.is_cut:
        return
    _add_outer(local, row, at.a, gain, v.normal, cut.by_a)
    _add_outer(local, row, at.b, gain, v.normal, cut.by_b)
    _add_outer(local, row, cut.e, gain, v.normal, cut.by_e)
    _add_outer(local, row, cut.frame_1, gain, v.normal, cut.by_1)
    _add_outer(local, row, cut.frame_2, gain, v.normal, cut.by_2)


@compile_inline
def _add_outer(local: FloatArray, row: int, column: int, factor: float, first: Vector, second: Vector) -> None:
    """Add the block factor × first second."""
    for k in range(2):
        for m in range(2):
            local[row + k, column + m] += factor * first[k] * second[m]


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
    for k in range(N_CORE):
        column, d_n, d_t, _ = gains_of_node(k, v, force, at)
        on_1_n, on_2_n = gains_on_segment(d_n, v, force, share_1, share_2, is_slave)
        on_1_t, on_2_t = gains_on_segment(d_t, v, force, share_1, share_2, is_slave)
        _add_block(local, first, column, v, on_1_n, on_1_t, f_1 * d_n.omega)
        _add_block(local, second, column, v, on_2_n, on_2_t, f_2 * d_n.omega)
    if p_cut.is_cut or q_cut.is_cut:
        for d, cut in ((gain_of_p(force), p_cut), (gain_of_q(force), q_cut)):
            on_1, on_2 = gains_on_segment(d, v, force, share_1, share_2, is_slave)
            _add_cut_blocks(local, first, on_1, v, at, cut)
            _add_cut_blocks(local, second, on_2, v, at, cut)
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
    for k in range(N_CORE):
        column, d_n, d_t, ends = gains_of_node(k, v, force, at)
        f_n, m_n = gains_on_part(d_n, FIXED, force, pressure, part)
        f_t, m_t = gains_on_part(d_t, ends, force, pressure, part)
        _add_block(local, f, column, v, f_n, f_t, f_f * d_n.omega)
        _add_block(local, m, column, v, m_n, m_t, f_m * d_n.omega)
    for ends, column in ((Ends(0.0, 0.0, 1.0, 0.0), f), (Ends(0.0, 0.0, 0.0, 1.0), m)):
        d_f, d_m = gains_on_part(NO_GAIN, ends, force, pressure, part)
        _add_block(local, f, column, v, 0.0, d_f, 0.0)
        _add_block(local, m, column, v, 0.0, d_m, 0.0)
    if pressure.is_balanced:
        for moves, d_s, column in ((pressure.p_moves, -1.0, free_ends[0]), (pressure.q_moves, 1.0, free_ends[1])):
            if moves == 0.0:
                d_f, d_m = gains_of_sum(d_s, pressure, part)
                _add_block(local, f, column, v, 0.0, d_f, 0.0)
                _add_block(local, m, column, v, 0.0, d_m, 0.0)
    if p_cut.is_cut or q_cut.is_cut:
        for d, cut in ((gain_of_p(force), p_cut), (gain_of_q(force), q_cut)):
            d_f, d_m = gains_on_part(d, FIXED, force, pressure, part)
            _add_cut_blocks(local, f, d_f, v, at, cut)
            _add_cut_blocks(local, m, d_m, v, at, cut)
    if force.by_gap == 0.0:
        _add_unit(local, f, pressure.unit * part.w_f, v, at)
        _add_unit(local, m, pressure.unit * part.w_m, v, at)


@compile_inline
def _add_constraint(local: FloatArray, push: FloatArray, point: LinearizedNode) -> None:
    """Add the constraint −g × size of a multiplier, and its Δ."""
    v, force, at, p_cut, q_cut = point
    row, normal, t = at.multiplier, v.normal, v.t
    push[row] -= v.g * force.size
    for k in range(N_CORE):
        column, d_n, d_t, _ = gains_of_node(k, v, force, at)
        along_n, along_t = gain_of_constraint(d_n, v, force), gain_of_constraint(d_t, v, force)
        local[row, column] += along_n * normal[0] + along_t * t[0]
        local[row, column + 1] += along_n * normal[1] + along_t * t[1]
    for d, cut in ((gain_of_p(force), p_cut), (gain_of_q(force), q_cut)):
        gain = gain_of_constraint(d, v, force)
        if cut.is_cut:
            for column, by in (
                (at.a, cut.by_a),
                (at.b, cut.by_b),
                (cut.e, cut.by_e),
                (cut.frame_1, cut.by_1),
                (cut.frame_2, cut.by_2),
            ):
                local[row, column] += gain * by[0]
                local[row, column + 1] += gain * by[1]
