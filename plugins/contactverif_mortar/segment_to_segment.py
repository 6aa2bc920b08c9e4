"""Segment-to-segment contact with exact segmentation: a gap and a pressure at three Gauss points of each cell.

Force and moment balance point by point, and a uniform pressure is integrated exactly over what is covered. So the flat
patch test is passed, with an overhang too.

Source: Zavarise & Wriggers (1998); segmentation and tangent: here.
"""

from dataclasses import dataclass

import numpy as np

from contactverif.compiler import compile_inline, compile_maker
from contactverif.contract.arrays import Array, BoolArray, FloatArray
from contactverif.contract.formulation import ContactPoints, Pairing, check_penalty, choose
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits
from contactverif.geometry.block_rows import Couplings, Csr, Fields, NumberArray, TangentOfBoth, zero_matrix
from contactverif_mortar.cell_frame import (
    N_NUMBERS,
    ForcesAndTangent,
    add_cell,
    cell_arguments,
    cell_at,
    finish_rows,
    place_point,
    push_point,
)
from contactverif_mortar.integration_cells import (
    AREAS,
    CELL_TRAITS,
    GAP,
    LOCKING_WITNESSES,
    Cells,
    Quadrature,
    forces,
    report_points,
)

N_POINTS = 3  # The Gauss points of a cell: exact up to degree 5, and a pressure × a shape function has degree 2.


@dataclass(frozen=True, slots=True, eq=False)
class SegmentToSegment(TangentOfBoth):
    """The formulation: pressure −ε̂ g at each Gauss point of a cell where g ≤ 0."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.
    quadrature: Quadrature  # The points on a cell, and the configuration in which lengths are measured.

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells, and which of their points are in contact (n_cells × 3, flat)."""
        x = np.array(z).reshape(-1, 2)
        cells = Cells.find(interface, x, averaged=False)
        return Pairing(
            {**cells._asdict(), "active": _touching_points(x, *cell_arguments(interface, cells, self.quadrature))}
        )

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        active = pairing["active"].reshape(-1, len(self.quadrature))
        mask = np.logical_or.reduce(active, axis=1)  # The cells that have a point in contact.
        cells = Cells.from_pairing(pairing).select(mask)
        x = np.array(z).reshape(-1, interface.n_nodes, 2)
        points = self.quadrature.points(interface, cells, x)
        pressure = np.where(active[mask].reshape(-1), -self.penalty * points[..., GAP], 0.0)
        return forces(points, pressure, cells.local_nodes(interface), interface.n_nodes).reshape(z.shape)

    def residual_and_tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ForcesAndTangent:
        """Compute forces (n_unknowns,) and their derivative from the same points."""
        x, active = np.array(z).reshape(-1, 2), pairing["active"]
        cells, rule = cell_arguments(interface, Cells.from_pairing(pairing), self.quadrature)
        nodes = _nodes_of_cells(cells, active)
        starts = np.arange(0, len(nodes) + 1, 4)
        matrix = zero_matrix(interface.n_nodes, 0, Couplings(nodes, starts, starts[:-1]))
        forces, csr = np.zeros(interface.n_unknowns), (matrix.indptr, matrix.indices, matrix.data)
        _add_springs(forces, csr, x, cells, rule, self.penalty, active)
        return forces, matrix

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the Gauss points of all cells, with their own gaps and pressures."""
        cells = Cells.from_pairing(pairing)
        points = self.quadrature.points(interface, cells, np.array(z).reshape(1, -1, 2))[0]
        pressure = np.where(pairing["active"], -self.penalty * points[:, GAP], 0.0)
        return report_points(interface, cells, points, z, pressure, pairing["active"])


@compile_maker
def _touching_points(x: FloatArray, cells: Fields, rule: Fields) -> BoolArray:
    """Return the points (n_points,) of cells whose gap is zero or negative, at the positions x (n_nodes, 2)."""
    places, weights = rule
    n_q, n_cells = len(places), len(cells[3])
    touching = np.empty(n_cells * n_q, dtype=np.bool_)
    for i in range(n_cells):
        cell = cell_at(x, cells, i)
        for q in range(n_q):
            touching[i * n_q + q] = place_point(cell, places[q], weights[q]).gap <= 0
    return touching


@compile_maker
def _nodes_of_cells(cells: Fields, active: BoolArray) -> NumberArray:
    """Return the nodes A, B, 1, 2 of each cell that has an active point, one cell after the other."""
    _, slave, master, cell_slave, cell_master, _, _ = cells
    nodes, count = np.empty(4 * len(cell_slave), dtype=np.int32), 0
    n_q = len(active) // max(len(cell_slave), 1)
    for cell in range(len(cell_slave)):
        if not _any_active(active, cell * n_q, n_q):
            continue
        s, m = cell_slave[cell], cell_master[cell]
        nodes[count], nodes[count + 1] = slave[s, 0], slave[s, 1]
        nodes[count + 2], nodes[count + 3] = master[m, 0], master[m, 1]
        count += 4
    return nodes[:count]


@compile_inline
def _any_active(active: BoolArray, begin: int, count: int) -> bool:
    for i in range(begin, begin + count):  # noqa: SIM110 - a compiled kernel knows no generators
        if active[i]:
            return True
    return False


@compile_maker
def _add_springs(
    forces: FloatArray, csr: Csr, x: FloatArray, cells: Fields, rule: Fields, penalty: float, active: BoolArray
) -> None:
    places, weights = rule
    n_q = len(places)
    rows, pushes = np.empty((4, N_NUMBERS)), np.empty(4)
    for i in range(len(active) // n_q):
        if not _any_active(active, i * n_q, n_q):
            continue
        cell = cell_at(x, cells, i)
        rows[:], pushes[:] = 0.0, 0.0
        for q in range(n_q):
            if active[i * n_q + q]:
                point = place_point(cell, places[q], weights[q])
                push_point(rows, pushes, cell, point, -penalty * point.gap, 0.0, -penalty)
        finish_rows(rows, 4, cell)
        add_cell(forces, csr, rows, pushes, cell)


def sts(*, penalty: float, area: str = "current") -> SegmentToSegment:
    """Segment to segment: pressures at Gauss points of the overlaps of slave and master segments.

    Slave and master segments that face each other are cut to their overlap. Gap and force are along the normal of the
    slave segment, and the force acts at both facing points. So force and moment are conserved exactly, the flat patch
    test is passed, and an overhang is covered. At a high penalty its springs are more conditions than the surfaces can
    follow, and it locks. The tangent is exact and unsymmetric: the gradient of the gap is not along the slave's normal.

    Source: Zavarise & Wriggers, Math. Comput. Modelling 28 (1998) 497–515; segmentation and tangent: here.
    """
    quadrature = Quadrature.gauss(N_POINTS, choose("area", area, AREAS))
    source = "Zavarise & Wriggers, Math. Comput. Modelling 28 (1998) 497–515; segmentation and tangent: here"
    witnesses = {**CELL_TRAITS.evidence.witnesses, **LOCKING_WITNESSES}
    traits = CELL_TRAITS.revise(locks=True, area=area, witnesses=witnesses, source=source)
    return SegmentToSegment(traits, check_penalty(penalty), quadrature)
