"""Put the same state in other numbers: nodes and segments in another order, roles exchanged, the mirror image.

Each function returns a new case and how the old one becomes it. All are exact: nothing is rounded.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface, Surface
from contactverif_properties.shared.same_answer import Carry

MIRROR = np.diag([-1.0, 1.0])


def renumber(case: Case, nodes: IntArray, slave: IntArray, master: IntArray) -> tuple[Case, Carry]:
    """Return a case with other numbers.

    Parameters
    ----------
    case : Case
        The case.
    nodes : IntArray, shape (n_nodes,)
        The new number of each node; slave nodes stay before those of the master.
    slave, master : IntArray, shape (n_segments,)
        The old numbers of the segments in their new order.

    Returns
    -------
    renumbered : Case
        The same meshes in the same state.
    carry : Carry
        The new number of each node.
    """
    interface, old = case.interface, np.argsort(nodes)
    sides = (
        Surface(nodes[side.segments[order]]) for side, order in ((interface.slave, slave), (interface.master, master))
    )
    renumbered = Interface(interface.nodes[old], *sides)
    return replace(case, interface=renumbered, z=case.positions[old].reshape(-1)), Carry(nodes)


def mirror_case(case: Case) -> tuple[Case, Carry]:
    """Return the mirror image in the y-axis; segments run the other way, so that the body stays on the left."""
    interface = case.interface
    sides = (Surface(side.segments[:, ::-1]) for side in (interface.slave, interface.master))
    image = Interface(reflect(interface.nodes), *sides)
    return replace(case, interface=image, z=reflect(case.positions).reshape(-1)), Carry(
        np.arange(len(image.nodes)), MIRROR
    )


def exchange_roles(case: Case) -> tuple[Case, Carry]:
    """Return the case in which the slave is the master, and the other way round."""
    interface = case.interface
    n_slave, n_master = interface.n_slave_nodes, interface.n_nodes - interface.n_slave_nodes
    nodes = np.concatenate([n_master + np.arange(n_slave), np.arange(n_master)])
    sides = (Surface(nodes[side.segments]) for side in (interface.master, interface.slave))
    old = np.argsort(nodes)
    exchanged = Interface(interface.nodes[old], *sides)
    return replace(case, interface=exchanged, z=case.positions[old].reshape(-1)), Carry(nodes)


def reflect(points: FloatArray) -> FloatArray:
    """Return the points (n, 2), mirrored; no zero becomes −0."""
    mirrored: FloatArray = points * [-1.0, 1.0] + 0.0
    return mirrored
