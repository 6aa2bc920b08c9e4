"""Methods in three dimensions: springs at Gauss points of cells, mortar, nodes.

Springs: a point has the pressure −ε̂ g where g < 0, along the slave's normal, and pushes both faces by their shape
functions there. So force and moment balance point by point, and a uniform pressure is integrated exactly over what is
covered.

Mortar: the gap of slave node i is G_i / W_i with G_i = ∫ N_i g and W_i = ∫ N_i over what the master covers. Its
pressure −ε̂ G_i / W_i, where that is above 0, acts with the same shape function. So a uniform pressure is exact, and
force and moment balance at each point of the integrals.

Nodes: a spring at each slave node acts along the normal of the nearest master face (`face_ppt_search`), if the gap is
at most 2 (h_s + h_m) either way, as for cells (`face_search`). The foot is straight below the node, past the edge of
its face if the node stands over one. The force is split by the shape functions of the foot. Neither
the same stiffness at each node nor that of the area around it transmits a uniform pressure between meshes that do not
match.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.formulation import ContactPoints, Pairing, check_penalty
from contactverif.contract.interface import TRIANGLE, Interface
from contactverif.contract.traits import Traits
from contactverif_surfaces.cell_points import (
    PAST_BORDER,
    SURFACE_TRAITS,
    CellPoints,
    FacePairs,
    SlaveView,
    add_blocks,
    add_rows,
    axes_of,
    differentiate,
    evaluate_shapes,
    first_faces,
    flatten_pushes,
    gauss_points,
    plane_areas,
    positions_of,
    report_points,
    unknowns_of,
)
from contactverif_surfaces.face_ppt_search import find_nearest_faces
from contactverif_surfaces.face_search import REACH, longest_edges

PointRule = Callable[[SlaveView, IntArray], CellPoints]  # It takes the view and the codes of cells.
MOST_STATES = 2000  # The number of cells, one in each state, whose forces are computed together.
N_POINTS = 6  # Gauss points a triangle of the mortar method: a gap × two shape functions has degree 3.


@dataclass(frozen=True, slots=True, eq=False)
class CellSprings:
    """The formulation: pressure −ε̂ g at each point of a cell where g < 0."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.
    rule: PointRule

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells, and which of their points are in contact (n_cells, n_points)."""
        pairs = FacePairs.find(interface, z)
        return Pairing({**pairs.as_arrays(), "active": self.rule(pairs.view_at(z), pairs.codes).gap < 0})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        pairs, states = FacePairs.from_pairing(interface, pairing), z.reshape(-1, z.shape[-1])
        places, step, forces = (
            unknowns_of(pairs.nodes),
            1 + MOST_STATES // (1 + len(pairs.codes)),
            np.empty_like(states),
        )
        for first in range(0, len(states), step):
            corners = pairs.corners_at(states[first : first + step])
            local = self._forces(pairs.n_slave_corners, corners, pairs.codes, pairing["active"])
            forces[first : first + step] = add_rows(local, places, z.shape[-1])
        return forces.reshape(z.shape)

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.csr_array:
        """Compute the derivative of the residual, sparse."""
        pairs, n = FacePairs.from_pairing(interface, pairing), interface.n_unknowns
        forces, places = partial(self._forces, pairs.n_slave_corners), unknowns_of(pairs.nodes)
        return add_blocks(
            differentiate(forces, pairs.corners_at(z), pairs.codes, pairing["active"]), places, places, (n, n)
        )

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the points of all cells."""
        pairs = FacePairs.from_pairing(interface, pairing)
        points = self.rule(pairs.view_at(z), pairs.codes)
        return report_points(pairs, points, z, self.penalty, pairing["active"])

    def _forces(self, n_slave: int, corners: Array, codes: IntArray, active: BoolArray) -> Array:
        """Return the residuals (..., n_cells, n_corners · 3) of cells with corners (..., n_cells, n_corners, 3)."""
        points = self.rule(SlaveView.of_corners(corners[..., :n_slave, :], corners[..., n_slave:, :]), codes)
        return flatten_pushes(*points.push(np.where(active, -self.penalty * points.gap, 0.0) * points.weight))


def sts_3d(*, penalty: float) -> CellSprings:
    """Segment to segment in three dimensions: pressures at Gauss points of the overlaps of slave and master faces.

    A cell of triangles has three points a triangle of its fan, which are exact for a linear gap × a shape function; of
    quadrilaterals it has six.

    Source: Zavarise & Wriggers, Math. Comput. Modelling 28 (1998) 497–515; on faces: here.
    """
    source = "Zavarise & Wriggers, Math. Comput. Modelling 28 (1998) 497–515; on faces: here"
    traits = SURFACE_TRAITS.revise(faces=(3, 4), integrates_linear_gap=True, source=source)
    return CellSprings(traits, check_penalty(penalty), _by_corners)


def _by_corners(view: SlaveView, codes: IntArray) -> CellPoints:
    triangles = view.slave.shape[-2] == view.master.shape[-2] == TRIANGLE
    return gauss_points(view, codes, 3 if triangles else 6)


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceMortar:
    """The formulation: nodal pressures −ε̂ G_i / W_i, where they are above 0."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells, which slave nodes they cover, and which of these nodes are in contact."""
        pairs = FacePairs.find(interface, z)
        gaps, weights = _node_sums(pairs, z, interface.n_slave_nodes)
        return Pairing({**pairs.as_arrays(), "active": (gaps < 0) & (weights > 0)})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        pairs = FacePairs.from_pairing(interface, pairing)
        pressure = self._pressures(*_node_sums(pairs, z, interface.n_slave_nodes), pairing)
        local = _forces(pairs.n_slave_corners, pairs.corners_at(z), pairs.codes, pressure[..., pairs.slave_nodes])
        return add_rows(local, unknowns_of(pairs.nodes), z.shape[-1])

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.csr_array:
        """Compute the derivative of the residual: of the cells at fixed pressures, and of the pressures."""
        pairs, active = FacePairs.from_pairing(interface, pairing), pairing["active"]
        n, n_nodes, n_slave = interface.n_unknowns, interface.n_slave_nodes, pairs.n_slave_corners
        corners, places, slave_nodes = pairs.corners_at(z), unknowns_of(pairs.nodes), pairs.slave_nodes
        gaps, weights = _node_sums(pairs, z, n_nodes)
        pressure = self._pressures(gaps, weights, pairing)
        fixed = differentiate(partial(_forces, n_slave), corners, pairs.codes, pressure[slave_nodes])
        units = np.eye(n_slave)[:, None, :]  # A unit pressure at each slave corner.
        forces_of_units = np.moveaxis(_forces(n_slave, corners, pairs.codes, units), 0, -1)
        by_pressure = add_blocks(forces_of_units, places, slave_nodes, (n, n_nodes))
        sums = differentiate(partial(_local_sums, n_slave), corners, pairs.codes)
        by_gap, by_weight = (add_blocks(sums[:, k], slave_nodes, places, (n_nodes, n)) for k in range(2))
        whole = np.where(active, weights, 1.0)
        scale, mean = np.where(active, -self.penalty / whole, 0.0), np.where(active, gaps / whole, 0.0)
        # The derivatives of the pressures: −ε̂ (∂G − G/W ∂W) / W.
        of_pressure = sparse.diags_array(scale) @ (by_gap - sparse.diags_array(mean) @ by_weight)
        of_cells = add_blocks(fixed, places, places, (n, n))
        return sparse.csr_array(of_cells + by_pressure @ sparse.csr_array(of_pressure))

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the slave nodes that the master covers: weighted nodes without a foot, on the first of their faces."""
        pairs, x, faces = FacePairs.from_pairing(interface, pairing), z.reshape(-1, 3), interface.slave.faces
        gaps, weights = _node_sums(pairs, z, interface.n_slave_nodes)
        nodes = np.flatnonzero(weights > 0)
        carrier, shape = first_faces(faces, nodes)
        return ContactPoints.on_faces(
            slave_segment=carrier,
            slave_shape=shape,
            master_segment=np.full(len(nodes), -1),
            master_shape=np.full((len(nodes), interface.master.faces.shape[1]), np.nan),
            position=x[nodes],
            normal=-axes_of(x[faces[carrier]])[2],
            gap=gaps[nodes] / weights[nodes],
            pressure=self._pressures(gaps, weights, pairing)[nodes],
            weight=weights[nodes],
            active=pairing["active"][nodes],
            weighted=True,
        )

    def _pressures(self, gaps: Array, weights: Array, pairing: Pairing) -> Array:
        active = pairing["active"]
        pressures: Array = np.where(active, -self.penalty * gaps / np.where(active, weights, 1.0), 0.0)
        return pressures


def _mortar_points(n_slave: int, corners: Array, codes: IntArray) -> CellPoints:
    return gauss_points(SlaveView.of_corners(corners[..., :n_slave, :], corners[..., n_slave:, :]), codes, N_POINTS)


def _local_sums(n_slave: int, corners: Array, codes: IntArray) -> Array:
    """Return ∫ N_i g and ∫ N_i of each cell, (..., n_cells, 2, n_slave_corners)."""
    points = _mortar_points(n_slave, corners, codes)
    weights = np.stack([points.weight * points.gap, points.weight], axis=-2)  # (..., n_cells, 2, n_points)
    sums: Array = weights @ points.slave_shape
    return sums


def _node_sums(pairs: FacePairs, z: Array, n_nodes: int) -> tuple[Array, Array]:
    """Return G_i and W_i (..., n_nodes) of the slave nodes."""
    sums = _local_sums(pairs.n_slave_corners, pairs.corners_at(z), pairs.codes)
    gaps, weights = (add_rows(sums[..., k, :], pairs.slave_nodes, n_nodes) for k in range(2))
    return gaps, weights


def _forces(n_slave: int, corners: Array, codes: IntArray, pressure: Array) -> Array:
    """Return the residuals (..., n_cells, n_corners · 3) of pressures (..., n_cells, n_slave_corners) there."""
    points = _mortar_points(n_slave, corners, codes)
    force = (points.slave_shape @ pressure[..., None])[..., 0] * points.weight
    return flatten_pushes(*points.push(force))


def mortar_3d(*, penalty: float) -> SurfaceMortar:
    """Mortar in three dimensions: nodal pressures from weighted gaps, over exactly cut cells.

    Source: Puso & Laursen, Comput. Methods Appl. Mech. Engrg. 193 (2004) 601–629, with the normal of the slave face:
    here.
    """
    source = "Puso & Laursen, Comput. Methods Appl. Mech. Engrg. 193 (2004) 601–629; the slave's normal: here"
    shapes = {"gap_shapes": "standard", "pressure_shapes": "standard"}
    return SurfaceMortar(
        SURFACE_TRAITS.revise(faces=(3, 4), locks=False, source=source, **shapes), check_penalty(penalty)
    )


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
        home = find_nearest_faces(x, len(edge), interface.master, PAST_BORDER)
        nodes = np.flatnonzero(home >= 0)
        gap = _feet(positions_of(x.reshape(-1), _nodes_and_faces(interface, nodes, home[nodes]))).gap[:, 0]
        is_near, active = np.abs(gap) <= reach[home[nodes]] + REACH * edge[nodes], np.zeros(len(edge), bool)
        home[nodes[~is_near]], active[nodes] = -1, is_near & (gap < 0)
        return Pairing({"home": home, "active": active})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        active, nodes = self._in_contact(interface, pairing)
        local = _spring_forces(self.penalty, positions_of(z, nodes))
        if self.by_area:
            local = local * _node_areas(interface, z)[..., active, None]
        return add_rows(local, unknowns_of(nodes), z.shape[-1])

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.csr_array:
        """Compute the derivative of the residual: at fixed areas, and by the areas."""
        active, nodes = self._in_contact(interface, pairing)
        n, corners, places = interface.n_unknowns, positions_of(z, nodes), unknowns_of(nodes)
        blocks = differentiate(partial(_spring_forces, self.penalty), corners)
        if not self.by_area:
            return add_blocks(blocks, places, places, (n, n))
        fixed = add_blocks(blocks * _node_areas(interface, z)[active, None, None], places, places, (n, n))
        forces = _spring_forces(self.penalty, corners)[..., None]
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
    """Return feet on faces (..., n, n_corners + 1, 3), the node last; the face is the view's slave, for its normal."""
    view = SlaveView.of_corners(corners[..., :-1, :], corners[..., -1:, :])
    shape = evaluate_shapes(view.slave, view.master)  # (..., n, 1, n_corners)
    gap = view.master_height - (shape * view.slave_height[..., None, :]).sum(axis=-1)
    whole = np.ones_like(gap)
    return CellPoints(shape, whole[..., None], whole, gap, view.normal)


def _spring_forces(penalty: float, corners: Array) -> Array:
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
    locks=False,
    gap="closest point",
    force_along="master normal",
    witnesses={**SURFACE_TRAITS.evidence.witnesses, "patch": "crossed-diagonals"},
    source="here, after Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416, Sections 4.1 and 4.2",
)
