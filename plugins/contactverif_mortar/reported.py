"""What the formulations of this family say of their points."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import Interface
from contactverif_mortar.cells import GAP, NORMAL_X, WEIGHT, XI, C, Cells, Quadrature


def at_points(
    interface: Interface, cells: Cells, points: FloatArray, z: FloatArray, pressure: FloatArray, active: BoolArray
) -> ContactPoints:
    """The quadrature points (n_points, 6) of the cells.

    The ends of their areas of competence are NaN: they lie at master nodes by construction, and decide nothing.
    """
    n_q = len(points) // max(len(cells.slave), 1)
    segment, master = np.repeat(cells.slave, n_q), np.repeat(cells.master, n_q)
    c = points[:, C, None]
    ends = z[: interface.n_unknowns].reshape(-1, 2)[interface.slave.segments[segment]]  # (n_points, 2, dim)
    nowhere = np.full(len(points), np.nan)
    return ContactPoints(
        slave_segment=segment,
        c=points[:, C],
        master_segment=master,
        xi=points[:, XI],
        position=(1 - c) / 2 * ends[:, 0] + (1 + c) / 2 * ends[:, 1],
        normal=-points[:, NORMAL_X:],
        gap=points[:, GAP],
        pressure=pressure,
        weight=points[:, WEIGHT],
        active=active,
        area_from=nowhere,
        area_to=nowhere,
    )


def at_nodes(
    interface: Interface,
    cells: Cells,
    x: FloatArray,
    areas: FloatArray,
    gaps: FloatArray,
    pressure: FloatArray,
    active: BoolArray,
) -> ContactPoints:
    """The slave nodes (n_slave_nodes,) with ∫N_j, weighted gap and nodal pressure.

    A node is measured against the master segment that it sees itself, the one behind it along the slave where two cells
    meet there, and against none (−1) if it overhangs.
    """
    n_nodes = interface.n_slave_nodes
    carrier, place = np.full(n_nodes, -1), np.full(n_nodes, np.nan)
    for end, own in ((1, interface.slave.segments[:, 1]), (0, interface.slave.segments[:, 0])):
        carrier[own], place[own] = np.arange(len(own)), 2.0 * end - 1
    seen, xi, normal = np.full(n_nodes, -1), np.full(n_nodes, np.nan), np.full((n_nodes, 2), np.nan)
    for end, c in ((1, 1.0), (0, -1.0)):
        at_end = Quadrature(np.array([c]), np.ones(1), current=True)
        here = np.flatnonzero(~(cells.cut_high if end else cells.cut_low))  # cells that end at the node
        number = interface.slave.segments[cells.slave[here], end]
        carrier[number], place[number] = cells.slave[here], c
        ends = at_end.points(interface, cells.where(here), x[None])[0]
        seen[number], xi[number], normal[number] = cells.master[here], ends[:, XI], -ends[:, NORMAL_X:]
    nowhere = np.full(n_nodes, np.nan)
    return ContactPoints(
        slave_segment=carrier,
        c=place,
        master_segment=seen,
        xi=xi,
        position=x[:n_nodes],
        normal=normal,
        gap=gaps,
        pressure=pressure,
        weight=areas,
        active=active,
        area_from=nowhere,
        area_to=nowhere,
    )
