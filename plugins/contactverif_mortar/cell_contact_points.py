"""Report the contact points of the formulations of this family.

The ends of areas of competence are NaN here: cells end at nodes by construction, and no decision depends on that.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import Interface
from contactverif_mortar.integration_cells import GAP, NORMAL_X, WEIGHT, XI, C, Cells, Quadrature, Sides


def at_points(
    interface: Interface, cells: Cells, points: FloatArray, z: FloatArray, pressure: FloatArray, active: BoolArray
) -> ContactPoints:
    """Return the quadrature points (n_points, 6) of the cells as contact points of the state z."""
    n_q = len(points) // max(len(cells.slave), 1)
    segment, master = np.repeat(cells.slave, n_q), np.repeat(cells.master, n_q)
    c = points[:, C, None]
    ends = z[: interface.n_unknowns].reshape(-1, 2)[interface.slave.segments[segment]]  # (n_points, 2, dim)
    undefined = np.full(len(points), np.nan)
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
        area_from=undefined,
        area_to=undefined,
    )


def at_nodes(
    interface: Interface | Sides,
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
    n_nodes = interface.n_slave_nodes
    carrier, place = np.full(n_nodes, -1), np.full(n_nodes, np.nan)
    for end in (1, 0):
        numbers = interface.slave.segments[:, end]
        carrier[numbers], place[numbers] = np.arange(len(numbers)), 2.0 * end - 1
    master, xi, normal = np.full(n_nodes, -1), np.full(n_nodes, np.nan), np.full((n_nodes, 2), np.nan)
    for facing in (False, True):
        for end, c in ((1, 1.0), (0, -1.0)):
            at_end = Quadrature(np.array([c]), np.ones(1), current=True)
            first = np.diff(cells.slave, prepend=-1) != 0  # Cells are in the order in which one meets them.
            outermost = np.append(first[1:], True)[: len(first)] if end else first
            cut = cells.cut_high if end else cells.cut_low
            here = np.flatnonzero(~cut if facing else outermost)
            number = interface.slave.segments[cells.slave[here], end]
            carrier[number], place[number] = cells.slave[here], c
            ends = at_end.points(interface, cells.select(here), x[None])[0]
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
