"""Node-to-surface contact: a spring at each slave node, along the normal of the master face that it stands on.

The foot of a node is the point of a master face straight below it; of the faces that have one, the nearest counts, if
its gap is at most 2 (h_s + h_m) either way, as for cells (`face_search`). The force is split by the shape functions of
the foot. Neither the same stiffness at each node nor that of the area around it transmits a uniform pressure between
meshes that do not match.
"""

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
    CellPoints,
    SlaveView,
    add_blocks,
    add_rows,
    axes_of,
    differentiate,
    evaluate_shapes,
    first_faces,
    flatten_pushes,
    plane_areas,
    positions_of,
    unknowns_of,
)
from contactverif_surfaces.face_search import REACH, find_boxes_at, grow_tree, longest_edges


@dataclass(frozen=True, slots=True, eq=False)
class NodesOnFaces:
    """The formulation: a force −ε g, or −ε̂ g A with the area A of a node, at each slave node with a gap g < 0."""

    traits: Traits
    penalty: float  # Nodal stiffness ε, or distributed stiffness ε̂ with areas.
    by_area: bool

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the master face under each slave node, −1 for none, and the nodes in contact."""
        x, faces = np.array(z).reshape(-1, 3), interface.slave.faces
        edge, reach = np.zeros(interface.n_slave_nodes), REACH * longest_edges(interface.master, x)
        edge[faces] = longest_edges(interface.slave, x)[:, None]
        reach += REACH * edge.max()
        corners = x[interface.master.faces]
        # The boxes that hold all that a face reaches along its normal, and a little more for feet past the border.
        more = reach[:, None] * (np.abs(axes_of(corners)[2]) + 2 * PAST_BORDER)
        prisms = np.stack([corners.min(axis=1) - more, corners.max(axis=1) + more], axis=1)
        node, face = find_boxes_at(x[: len(edge)], grow_tree(prisms))
        points = _feet(positions_of(x.reshape(-1), _nodes_and_faces(interface, node, face)))
        gap = points.gap[:, 0]
        near = np.abs(gap) <= reach[face] - REACH * (edge.max() - edge[node])
        good = np.flatnonzero(near & (points.slave_shape[:, 0].min(axis=1) >= -PAST_BORDER))
        order = good[np.lexsort((face[good], np.abs(gap[good]), node[good]))]
        first = order[np.diff(node[order], prepend=-1) > 0]  # The nearest of each node.
        home, active = np.full(len(edge), -1), np.zeros(len(edge), bool)
        home[node[first]], active[node[first]] = face[first], gap[first] < 0
        return Pairing({"home": home, "active": active})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        active, nodes = self._in_contact(interface, pairing)
        local = _forces(self.penalty, positions_of(z, nodes))
        if self.by_area:
            local = local * _node_areas(interface, z)[..., active, None]
        return add_rows(local, unknowns_of(nodes), z.shape[-1])

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.csr_array:
        """Compute the derivative of the residual: at fixed areas, and by the areas."""
        active, nodes = self._in_contact(interface, pairing)
        n, corners, places = interface.n_unknowns, positions_of(z, nodes), unknowns_of(nodes)
        blocks = differentiate(partial(_forces, self.penalty), corners)
        if not self.by_area:
            return add_blocks(blocks, places, places, (n, n))
        fixed = add_blocks(blocks * _node_areas(interface, z)[active, None, None], places, places, (n, n))
        forces = _forces(self.penalty, corners)[..., None]
        by_area = add_blocks(forces, places, active[:, None], (n, interface.n_slave_nodes))
        faces = interface.slave.faces
        slopes = differentiate(_corner_areas, positions_of(z, faces))
        of_area = add_blocks(slopes, faces, unknowns_of(faces), (interface.n_slave_nodes, n))
        return sparse.csr_array(fixed + by_area @ of_area)

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the slave nodes with a foot, each on the first of its faces."""
        nodes = np.flatnonzero(pairing["home"] >= 0)
        home, active, faces = pairing["home"][nodes], pairing["active"][nodes], interface.slave.faces
        points = _feet(positions_of(z, _nodes_and_faces(interface, nodes, home)))
        carrier, shape = first_faces(faces, nodes)
        return ContactPoints.on_faces(
            slave_segment=carrier,
            slave_shape=shape,
            master_segment=home,
            master_shape=points.slave_shape[:, 0],
            position=z.reshape(-1, 3)[nodes],
            normal=points.normal,
            gap=points.gap[:, 0],
            pressure=np.where(active, -self.penalty * points.gap[:, 0], 0.0),
            weight=_node_areas(interface, z)[nodes] if self.by_area else np.ones(len(nodes)),
            active=active,
        )

    def _in_contact(self, interface: Interface, pairing: Pairing) -> tuple[IntArray, IntArray]:
        active = np.flatnonzero(pairing["active"])
        return active, _nodes_and_faces(interface, active, pairing["home"][active])


def _nodes_and_faces(interface: Interface, nodes: IntArray, faces: IntArray) -> IntArray:
    """Return the corners of master faces (n,), and behind them a node (n,) for each, (n, n_master_corners + 1)."""
    return np.concatenate([interface.master.faces[faces], nodes[:, None]], axis=1)


def _feet(corners: Array) -> CellPoints:
    """Return the feet of nodes on faces (..., n, n_corners + 1, 3), the node last.

    The face takes the place of the slave in the view, so that its normal is that of the gap.
    """
    view = SlaveView.of_corners(corners[..., :-1, :], corners[..., -1:, :])
    shape = evaluate_shapes(view.slave, view.master)  # (..., n, 1, n_corners)
    gap = view.master_height - (shape * view.slave_height[..., None, :]).sum(axis=-1)
    whole = np.ones_like(gap)
    return CellPoints(shape, whole[..., None], whole, gap, view.normal)


def _forces(penalty: float, corners: Array) -> Array:
    """Return the residuals (..., n, (n_corners + 1) · 3) of springs with a stiffness, for a unit area."""
    points = _feet(corners)
    return flatten_pushes(*points.push(-penalty * points.gap))


def _corner_areas(corners: Array) -> Array:
    """Return the area (..., n_faces, n_corners) of each corner of faces (..., n_faces, n_corners, 3): equal shares."""
    n_corners = corners.shape[-2]
    area = plane_areas(SlaveView.of_corners(corners, corners[..., :1, :]).slave)
    return np.repeat(area[..., None] / n_corners, n_corners, axis=-1)


def _node_areas(interface: Interface, z: Array) -> Array:
    """Return the areas (..., n_slave_nodes) around the slave nodes: an equal share of each face at a node."""
    faces = interface.slave.faces
    return add_rows(_corner_areas(positions_of(z, faces)), faces, interface.n_slave_nodes)


def nts_3d(*, penalty: float) -> NodesOnFaces:
    """Node to surface: a spring of the same stiffness at each slave node. It fails the patch test."""
    # The force is the derivative of ε g²/2, since the foot lies straight below the node.
    traits = _TRAITS.revise(penalty="nodal", area=None, symmetric=True, normal=None)
    return NodesOnFaces(traits, check_penalty(penalty), by_area=False)


def nts_ar_3d(*, penalty: float) -> NodesOnFaces:
    """Node to surface with the area around each node, an equal share of each face there. It fails the patch test."""
    return NodesOnFaces(_TRAITS, check_penalty(penalty), by_area=True)


_TRAITS = SURFACE_TRAITS.revise(
    flat=False,
    normal=True,
    gap="closest point",
    force_along="master normal",
    witnesses={**SURFACE_TRAITS.evidence.witnesses, "patch": "crossed-diagonals"},
    source="here, after Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416, Sections 4.1 and 4.2",
)
