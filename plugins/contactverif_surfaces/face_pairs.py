"""The cells of an interface, as a pairing stores them, with the nodes and the positions that belong to each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.contract.interface import Interface
from contactverif.contract.pairing import Pairing
from contactverif_surfaces.face_search import find_cells, longest_edges


@dataclass(frozen=True, slots=True, eq=False)
class FacePairs:
    """The cells of an interface: pairs of a slave and a master face, and the codes of the corners of their overlap."""

    slave_face: IntArray  # (n_cells,)
    master_face: IntArray  # (n_cells,)
    codes: IntArray  # (n_cells, most_corners, 2) See `face_search`.
    slave_nodes: IntArray  # (n_cells, n_slave_corners) The nodes of the slave face of each cell.
    master_nodes: IntArray  # (n_cells, n_master_corners)

    @classmethod
    def find(cls, interface: Interface, z: FloatArray) -> FacePairs:
        """Return the cells of an interface at a state z (n_unknowns,)."""
        x, slave, master = np.array(z).reshape(-1, 3), interface.slave, interface.master
        faces, codes = find_cells(x, slave.faces, master.faces, longest_edges(slave, x), longest_edges(master, x))
        return cls.of_arrays(interface, faces[:, 0], faces[:, 1], codes)

    @classmethod
    def of_arrays(cls, interface: Interface, slave: IntArray, master: IntArray, codes: IntArray) -> FacePairs:
        """Return the cells of faces (n_cells,) of both sides."""
        return cls(slave, master, codes, interface.slave.faces[slave], interface.master.faces[master])

    @classmethod
    def from_pairing(cls, interface: Interface, pairing: Pairing) -> FacePairs:
        """Return the cells that a pairing holds."""
        return cls.of_arrays(interface, pairing["slave_face"], pairing["master_face"], pairing["corners"])

    def as_arrays(self) -> dict[str, IntArray]:
        """Return the integers of a pairing."""
        return {"slave_face": self.slave_face, "master_face": self.master_face, "corners": self.codes}

    @property
    def nodes(self) -> IntArray:
        """The nodes (n_cells, n_corners) of both faces of each cell, slave first."""
        return np.concatenate([self.slave_nodes, self.master_nodes], axis=1)

    @property
    def n_slave_corners(self) -> int:
        """The number of corners of a slave face."""
        return int(self.slave_nodes.shape[1])

    def corners_at(self, z: Array) -> Array:
        """Return the positions (..., n_cells, n_corners, 3) of these nodes at states z (..., n_unknowns)."""
        return positions_of(z, self.nodes)


def first_faces(faces: IntArray, nodes: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the first of the faces at each node (n,), and the shape functions of its corners there (n, n_corners)."""
    holds = faces[None] == nodes[:, None, None]  # (n_nodes, n_faces, n_corners)
    first = holds.any(axis=2).argmax(axis=1)
    return first, holds[np.arange(len(nodes)), first].astype(np.float64)


def positions_of(z: Array, nodes: IntArray) -> Array:
    """Return the positions (..., n, k, 3) of nodes (n, k) at states z (..., n_unknowns)."""
    positions: Array = z.reshape(*z.shape[:-1], -1, 3)[..., nodes, :]
    return positions
