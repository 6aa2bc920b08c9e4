"""Virtual slave nodes in four parts of each slave face, as the outlook of Zavarise & De Lorenzis (2009) describes.

A virtual slave node at the centre of each part has the gap to the master face opposite, along the slave's normal. It
presses its part of the slave by the shape functions at the node. The same pressure acts on every master face under the
part, integrated with the master's shape functions. On triangles both sides balance where the master covers the part; on
warped quadrilaterals they do not.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.contract.formulation import ContactPoints, Pairing, check_penalty
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits
from contactverif_surfaces.cell_points import (
    PAST_BORDER,
    SURFACE_TRAITS,
    TRIANGLE,
    CellPoints,
    SlaveView,
    add_blocks,
    add_rows,
    cross_plane,
    differentiate,
    evaluate_shapes,
    flatten_pushes,
    gauss_points,
    positions_of,
    unknowns_of,
)
from contactverif_surfaces.face_search import find_cells, longest_edges

N_PARTS = 4
N_POINTS = {3: 3, 4: 6}  # Gauss points on each triangle of a cell, by the number of corners of a master face.


def _quarter(n_corners: int) -> FloatArray:
    """Return the corners of the parts as shares of the corners of a face, (N_PARTS, corners of a part, n_corners).

    Each corner of the face has a part, between the middles of its edges. A triangle has a fourth part in its middle.
    """
    whole = np.eye(n_corners)
    after, before = (whole + np.roll(whole, step, axis=0) for step in (-1, 1))
    middle = np.full_like(whole, 1 / n_corners)
    if n_corners == TRIANGLE:
        corners = np.stack([whole, after / 2, before / 2], axis=1)
        return np.concatenate([corners, corners[None, :, 1]])
    return np.stack([whole, after / 2, middle, before / 2], axis=1)


PARTS = {n_corners: _quarter(n_corners) for n_corners in (3, 4)}


@dataclass(frozen=True, slots=True, eq=False)
class FaceQuarters:
    """The formulation: pressure −ε̂ g of each part of a slave face, where the gap g at its centre is below 0."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells of the parts, the master face under each centre (`home`), and the parts in contact."""
        slave, master, x = interface.slave.faces, interface.master, np.array(z).reshape(-1, 3)
        x = x - x[0]  # The middle of an edge is rounded at its distance from the origin.
        corners = np.einsum("pci,fij->fpcj", PARTS[slave.shape[1]], x[slave]).reshape(-1, slave.shape[1], 3)
        numbers = np.arange(corners.shape[0] * corners.shape[1]).reshape(corners.shape[:2])
        edges = np.repeat(longest_edges(interface.slave, x), N_PARTS), longest_edges(master, x)
        faces, codes = find_cells(np.vstack([corners.reshape(-1, 3), x]), numbers, master.faces + numbers.size, *edges)
        home = _find_homes(corners, x[master.faces], faces)
        parts = np.flatnonzero(home >= 0)
        active = np.zeros(len(home), bool)
        shares, nodes = _parts_on_faces(interface, parts, home[parts])
        active[parts] = _centre_points(positions_of(z, nodes), shares).gap[:, 0] < 0
        return Pairing(
            {"part": faces[:, 0], "master_face": faces[:, 1], "corners": codes, "home": home, "active": active}
        )

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        (shares, nodes), (cell_shares, cell_nodes), codes, part_of_cell = _in_contact(interface, pairing)
        n_slave, corners = shares.shape[-1], positions_of(z, nodes)
        on_slave = _press_slave(self.penalty, corners, shares)
        pressure = _pressure(self.penalty, corners, shares)[..., 0]
        on_master = _unit_master(positions_of(z, cell_nodes), cell_shares, codes) * pressure[..., part_of_cell, None]
        forces = add_rows(on_slave, unknowns_of(nodes[:, :n_slave]), z.shape[-1])
        return forces + add_rows(on_master, unknowns_of(cell_nodes[:, n_slave:]), z.shape[-1])

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.csr_array:
        """Compute the derivative of the residual: on the slave, and on the master at fixed pressures and by these."""
        (shares, nodes), (cell_shares, cell_nodes), codes, part_of_cell = _in_contact(interface, pairing)
        n, n_slave = interface.n_unknowns, shares.shape[-1]
        at_centres, at_cells = positions_of(z, nodes), positions_of(z, cell_nodes)
        pressure = _pressure(self.penalty, at_centres, shares)[..., 0]
        by_nodes, by_cells = unknowns_of(nodes), unknowns_of(cell_nodes)
        on_slave = differentiate(partial(_press_slave, self.penalty), at_centres, shares)
        fixed = differentiate(_unit_master, at_cells, cell_shares, codes) * pressure[part_of_cell, None, None]
        units = _unit_master(at_cells, cell_shares, codes)[..., None]
        slopes = differentiate(partial(_pressure, self.penalty), at_centres, shares)
        rows, columns = unknowns_of(cell_nodes[:, n_slave:]), part_of_cell[:, None]
        by_pressure = add_blocks(units, rows, columns, (n, len(pressure)))
        of_pressure = add_blocks(slopes, np.arange(len(pressure))[:, None], by_nodes, (len(pressure), n))
        direct = add_blocks(on_slave, unknowns_of(nodes[:, :n_slave]), by_nodes, (n, n))
        return sparse.csr_array(direct + add_blocks(fixed, rows, by_cells, (n, n)) + by_pressure @ of_pressure)

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the centres of all parts that have a master face under them."""
        parts = np.flatnonzero(pairing["home"] >= 0)
        home, active = pairing["home"][parts], pairing["active"][parts]
        shares, nodes = _parts_on_faces(interface, parts, home)
        corners = positions_of(z, nodes)
        points, slave = _centre_points(corners, shares), corners[:, : shares.shape[-1]]
        return ContactPoints.on_faces(
            slave_segment=parts // N_PARTS,
            slave_shape=points.slave_shape[:, 0],
            master_segment=home,
            master_shape=points.master_shape[:, 0],
            position=(points.slave_shape[:, 0, :, None] * slave).sum(axis=1),
            normal=-points.normal,
            gap=points.gap[:, 0],
            pressure=np.where(active, -self.penalty * points.gap[:, 0], 0.0),
            weight=points.weight[:, 0],
            active=active,
        )


def _parts_on_faces(interface: Interface, parts: IntArray, master: IntArray) -> tuple[FloatArray, IntArray]:
    """Return for parts (n,), numbered through all slave faces, and master faces (n,) two arrays.

    The corners of each part as shares of those of its face, (n, corners of a part, n_slave_corners), and the nodes of
    the slave face, then of the master face (n, n_corners).
    """
    slave = interface.slave.faces[parts // N_PARTS]
    nodes = np.concatenate([slave, interface.master.faces[master]], axis=1)
    return PARTS[slave.shape[1]][parts % N_PARTS], nodes


def _in_contact(
    interface: Interface, pairing: Pairing
) -> tuple[tuple[FloatArray, IntArray], tuple[FloatArray, IntArray], IntArray, IntArray]:
    """Return the parts in contact, the same for each of their cells, the codes of the cells, and their parts' numbers.

    A part has the master face under its centre, a cell its own. The numbers count parts in contact.
    """
    active = pairing["active"]
    parts, in_contact = np.flatnonzero(active), active[pairing["part"]]
    part, master, codes = (pairing[name][in_contact] for name in ("part", "master_face", "corners"))
    centres = _parts_on_faces(interface, parts, pairing["home"][parts])
    return centres, _parts_on_faces(interface, part, master), codes, np.searchsorted(parts, part)


def _centre_points(corners: Array, shares: FloatArray) -> CellPoints:
    """Return the centres of parts with face corners (..., n, n_corners, 3), and the areas of the parts."""
    n_slave = shares.shape[-1]
    view = SlaveView.of_corners(corners[..., :n_slave, :], corners[..., n_slave:, :])
    places = np.einsum("npk,...nkd->...npd", shares, view.slave)
    arms = places[..., 1:, :] - places[..., :1, :]
    area = cross_plane(arms[..., :-1, :], arms[..., 1:, :]).sum(axis=-1) / 2
    return view.points_at(places.mean(axis=-2, keepdims=True), area[..., None])


def _press_slave(penalty: float, corners: Array, shares: FloatArray) -> Array:
    """Return the residuals (..., n, n_slave_corners · 3) of pressures −ε̂ g on the slave faces of parts."""
    points = _centre_points(corners, shares)
    slave, _ = points.push(-penalty * points.gap * points.weight)
    return flatten_pushes(slave)


def _pressure(penalty: float, corners: Array, shares: FloatArray) -> Array:
    """Return the pressures (..., n, 1) of parts."""
    return -penalty * _centre_points(corners, shares).gap


def _unit_master(corners: Array, shares: FloatArray, codes: IntArray) -> Array:
    """Return the residuals (..., n, n_master_corners · 3) of a unit pressure on the master faces of cells."""
    n_slave, corners = shares.shape[-1], corners - corners[..., :1, :]
    part = np.einsum("npk,...nkd->...npd", shares, corners[..., :n_slave, :])
    points = gauss_points(SlaveView.of_corners(part, corners[..., n_slave:, :]), codes, N_POINTS[n_slave])
    _, master = points.push(points.weight)
    return flatten_pushes(master)


def _find_homes(parts: FloatArray, master: FloatArray, faces: IntArray) -> IntArray:
    """Return the master face under the centre of each part, −1 for none, of cells with these faces (n_cells, 2).

    Parts are (n_parts, n_corners, 3), and master faces (n_faces, n_corners, 3).
    """
    view = SlaveView.of_corners(parts[faces[:, 0]], master[faces[:, 1]])
    depth = evaluate_shapes(view.master, view.slave.mean(axis=1, keepdims=True))[:, 0].min(axis=1)
    home, deepest = np.full(len(parts), -1), np.full(len(parts), -PAST_BORDER)
    for (part, face), value in zip(faces.tolist(), depth.tolist(), strict=True):
        if value > deepest[part]:
            home[part], deepest[part] = face, value
    return home


def vts_ppt_3d(*, penalty: float) -> FaceQuarters:
    """Virtual slave nodes at the centres of four equal parts of each triangle, pressing on all master faces below.

    Parameters
    ----------
    penalty : float
        Distributed stiffness ε̂ > 0, force per area per length of penetration.

    References
    ----------
    Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416, Section 8.
    """
    source = "Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416, the outlook"
    # A part that overhangs the master presses the slave with all its area, and the master with what is covered.
    witnesses = {**SURFACE_TRAITS.evidence.witnesses, "balance": "tilted-faces"}
    traits = SURFACE_TRAITS.revise(
        gap="slave normal", conserves_force=False, conserves_moment=False, witnesses=witnesses, source=source
    )
    return FaceQuarters(traits, check_penalty(penalty))
