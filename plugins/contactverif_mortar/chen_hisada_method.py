"""Contact after Chen & Hisada: gaps of nodes as in NTS, their pressures interpolated and integrated over cells.

Zavarise & De Lorenzis (2009), Section 1, describe the method in one paragraph; what is written down here is ours. The
gap of a slave node is the one to its nearest master segment, along the master's normal. Pressures are linear along the
slave. ∫ p n·(δx_s − δx_m) ds is taken over the cells of segment-to-segment, n normal to the slave, with two Gauss
points, which is exact. So the flat patch test is passed, and force and moment balance. The gradient of a node's gap has
nothing to do with where its pressure acts, so the tangent is unsymmetric.
"""

from dataclasses import dataclass

import numpy as np

from contactverif.compiler import compile_maker
from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.formulation import ContactPoints, Pairing, check_penalty, check_tau, choose
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits, promise_at_ends
from contactverif.geometry.block_rows import Couplings, Csr, NumberArray, TangentOfBoth, add_block
from contactverif.geometry.projection import (
    PointOnSegment,
    Tree,
    cross,
    dot,
    foot_on_surface,
    frame,
    minus,
    nearest_segment,
    node,
    search_tree,
)
from contactverif_mortar.cell_frame import ForcesAndTangent, NodeState, node_rows, weigh
from contactverif_mortar.integration_cells import AREAS, CELL_TRAITS, C, Cells, Quadrature, forces, near, report_points
from contactverif_mortar.node_factors import group_nodes

N_POINTS = 2  # The Gauss points of a cell: exact up to degree 3, and a pressure × a shape function has degree 2.


@dataclass(frozen=True, slots=True, eq=False)
class ChenHisada(TangentOfBoth):
    """The formulation: nodal pressures −ε̂ g_i where g_i ≤ 0 and the foot is on the master."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.
    quadrature: Quadrature  # The points on a cell, and the configuration in which lengths are measured.
    tau: float  # The part of a master segment by which a node's foot may lie past its free end and still count.

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells, the nearest master segment of each slave node, and which slave nodes are in contact."""
        x = np.array(z).reshape(-1, 2)
        master = interface.master
        nearest, active = _pair_nodes(
            x, interface.n_slave_nodes, master.segments, master.neighbours, search_tree(master, x), self.tau
        )
        cells = Cells.find(interface, x, averaged=False)
        return Pairing({**cells._asdict(), "nearest": nearest, "active": active})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        x = np.array(z).reshape(-1, interface.n_nodes, 2)
        cells = near(Cells.from_pairing(pairing), pairing["active"], interface)
        ends = interface.slave.segments[cells.carriers(len(self.quadrature))]
        points = self.quadrature.points(interface, cells, x)
        pressure = self._node_pressures(interface, pairing, x)[:, ends]  # (n_states, n_points, 2)
        c = points[..., C]
        at_points = (1 - c) / 2 * pressure[..., 0] + (1 + c) / 2 * pressure[..., 1]
        return forces(points, at_points, cells.local_nodes(interface), interface.n_nodes).reshape(z.shape)

    def residual_and_tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ForcesAndTangent:
        """Compute forces (n_unknowns,) and their derivative, Σ p_i ΔB_i + B Δp, from the same points."""
        x, active, nearest = np.array(z).reshape(-1, 2), pairing["active"], pairing["nearest"]
        cells = near(Cells.from_pairing(pairing), active, interface)
        groups = group_nodes(
            interface.n_nodes, interface.slave.segments, cells.slave, cells.local_nodes(interface), active, dual=False
        )
        facing = np.column_stack([np.arange(len(active)), interface.master.segments[nearest]])  # V, 1, 2 of a node gap
        pattern = _couple(interface, cells, np.where(active[:, None], facing[:, 1:], facing[:, :1]))
        zeros, ones = np.zeros(len(active)), np.ones(len(active))
        state = NodeState(self._node_pressures(interface, pairing, x[None])[0], ones, zeros, ones)
        _, _, shapes = weigh(interface, cells, self.quadrature, x, dual=False)
        rows = node_rows(interface, cells, self.quadrature, x, shapes, state, groups, pattern)
        csr = rows.rest.indptr, rows.rest.indices, rows.rest.data
        d_pressure = -self.penalty * _node_gap_rows(x, interface.master.segments, nearest)
        _add_springs(csr, groups.nodes, groups.starts, rows.left, facing, d_pressure)
        return rows.forces, rows.rest

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the Gauss points of all cells, with gaps along the slave's normal and interpolated pressures."""
        cells = Cells.from_pairing(pairing)
        x = np.array(z).reshape(1, -1, 2)
        points = self.quadrature.points(interface, cells, x)[0]
        ends = interface.slave.segments[cells.carriers(len(self.quadrature))]
        nodal = self._node_pressures(interface, pairing, x)[0][ends]
        pressure = (1 - points[:, C]) / 2 * nodal[:, 0] + (1 + points[:, C]) / 2 * nodal[:, 1]
        active = np.logical_or.reduce(pairing["active"][ends], axis=1)
        return report_points(interface, cells, points, z, pressure, active)

    def _node_pressures(self, interface: Interface, pairing: Pairing, x: Array) -> Array:
        gaps = _node_gaps(x, interface.master.segments, pairing["nearest"])
        return np.where(pairing["active"], -self.penalty * gaps, 0.0)


def _couple(interface: Interface, cells: Cells, facing: IntArray) -> Couplings:
    """Return the couplings of each cell: forces on A, B, 1, 2 depend on them, and on what A and B see.

    `facing` (n_slave_nodes, 2) are the two master nodes that the gap of a slave node depends on; the slave node itself
    where it is not active.
    """
    ends = interface.slave.segments[cells.slave]
    nodes = np.hstack([facing[ends].reshape(-1, 4), ends, interface.master.segments[cells.master]])
    starts = np.arange(0, nodes.size + 1, 8)
    return Couplings(nodes.astype(np.int32).ravel(), starts, starts[:-1] + 4)


@compile_maker
def _add_springs(
    csr: Csr, nodes: NumberArray, starts: IntArray, influence: FloatArray, facing: IntArray, d_pressure: FloatArray
) -> None:
    """Add B_i ⊗ Δp_i of all slave nodes; B_i are the entries of group i, and Δp_i (3, 2) belongs to V, 1, 2."""
    for i in range(len(facing)):
        for row in range(starts[i], starts[i + 1]):
            b_x, b_y = influence[2 * row], influence[2 * row + 1]
            for k in range(3):
                p_x, p_y = d_pressure[i, k, 0], d_pressure[i, k, 1]
                add_block(csr, nodes[row], facing[i, k], b_x * p_x, b_x * p_y, b_y * p_x, b_y * p_y)


@compile_maker
def _pair_nodes(
    x: FloatArray, n_nodes: int, master: IntArray, neighbours: IntArray, tree: Tree, tau: float
) -> tuple[IntArray, BoolArray]:
    order, boxes = tree
    nearest = np.empty(n_nodes, dtype=np.int64)
    active = np.empty(n_nodes, dtype=np.bool_)
    for number in range(n_nodes):
        p = node(x, number)
        m = nearest_segment(PointOnSegment(p, p, -1.0), x, master, order, boxes)
        x_1, x_2 = node(x, master[m, 0]), node(x, master[m, 1])
        length, t, _ = frame(x_1, x_2)
        d = minus(p, x_1)
        on_surface = foot_on_surface(dot(d, t), length, neighbours[m, 0] < 0, neighbours[m, 1] < 0, tau)
        nearest[number] = m
        active[number] = cross(d, minus(x_2, x_1)) <= 0 and on_surface
    return nearest, active


@compile_maker
def _node_gaps(x: Array, master: IntArray, nearest: IntArray) -> Array:
    gaps = np.empty((x.shape[0], len(nearest)), dtype=x.dtype)
    for state in range(x.shape[0]):
        for number in range(len(nearest)):
            x_1, x_2 = node(x[state], master[nearest[number], 0]), node(x[state], master[nearest[number], 1])
            length, _, _ = frame(x_1, x_2)
            gaps[state, number] = cross(minus(node(x[state], number), x_1), minus(x_2, x_1)) / length
    return gaps


@compile_maker
def _node_gap_rows(x: FloatArray, master: IntArray, nearest: IntArray) -> FloatArray:
    """Return Δg = n·(Δx_V − (1−ξ)Δx_1 − ξΔx_2) of each slave node, (n_slave_nodes, 3 nodes V, 1, 2, 2)."""
    d_gaps = np.empty((len(nearest), 3, 2))
    for number in range(len(nearest)):
        x_1, x_2 = node(x, master[nearest[number], 0]), node(x, master[nearest[number], 1])
        length, t, n = frame(x_1, x_2)
        xi = dot(minus(node(x, number), x_1), t) / length
        for i in range(2):
            d_gaps[number, 0, i], d_gaps[number, 1, i], d_gaps[number, 2, i] = n[i], (xi - 1) * n[i], -xi * n[i]
    return d_gaps


def chen_hisada(*, penalty: float, area: str = "current", tau: float = 1e-2) -> ChenHisada:
    """Chen & Hisada: node gaps as in NTS, pressures interpolated along the slave and integrated over cells.

    It passes the flat patch test and conserves force and moment. It does not cover an overhang: the pressure falls to
    zero at the node that overhangs, not at the end of the master. `tau` is the part of a master segment by which a foot
    may lie past its free end and still count.

    Source: Chen & Hisada, as Zavarise & De Lorenzis (2009), Section 1, describe their method; tangent: here.
    """
    quadrature = Quadrature.gauss(N_POINTS, choose("area", area, AREAS))
    traits = CELL_TRAITS.revise(
        # With τ = 0 roundoff decides whether a node is in contact that faces a free end exactly.
        **(dict.fromkeys(("flat", "normal", "single", "kinked", "converges"), None) if tau == 0 else {}),
        overhang=False,
        area=area if tau > 0 else None,
        gap="cells and nodes",
        witnesses={"patch.dead-zone": "dead-zone", **CELL_TRAITS.evidence.witnesses},
        source="Chen & Hisada, as in Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416",
    )
    return ChenHisada(promise_at_ends(traits, tau), check_penalty(penalty), quadrature, check_tau(tau))
