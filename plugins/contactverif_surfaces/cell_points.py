"""The cells of an interface and their points: where these lie on both faces, what they weigh, and their gaps.

Every number is a smooth function of the positions of the cell's nodes, real or complex, on the integers of
`face_search`. Points and gaps are made of differences from the slave's first corner, so a far translation rounds no
more than the positions. Gaps are along the slave's normal.

A cell has a dozen or two of coordinates. One complex step in each of them, for all cells at once, gives the derivatives
of what it computes without truncation (`differentiate`): f(x + ih) = f(x) + ih f′(x) + O(h²), and h² is lost in
roundoff for h = 2^-200.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import TRIANGLE, Interface
from contactverif.contract.traits import Abilities, Evidence, PatchPromises, Promises, Rules, Traits
from contactverif_surfaces.face_search import find_cells, longest_edges

STEP = 2.0**-200
CHUNK = 100  # The number of cells that are differentiated together, so that memory stays small.
# A foot past the border of a face by this share of it still counts, since one on an edge between two faces must stand
# on one of them. Shape functions are rounded by 2⁻⁵³ × how slender a face is: enough for faces of 1 : 10⁶.
PAST_BORDER = 2.0**-30
# Rules of Gauss points on a triangle, in its three corner coordinates, with weights that add up to 1. Three points are
# exact for degree 2, which a gap × a shape function has; six for degree 4.
_A, _B = 0.445948490915965, 0.091576213509771
_THREE = np.array([[4.0, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
_SIX = np.array([[1 - 2 * c if i == j else c for j in range(3)] for c in (_A, _B) for i in range(3)])
_SIX_WEIGHTS = np.repeat([0.223381589678011, 0.109951743655322], 3)
GAUSS = {3: (_THREE, np.full(3, 1 / 3)), 6: (_SIX, _SIX_WEIGHTS / _SIX_WEIGHTS.sum())}
# The promises that the methods on cells have in common; each method says what it changes.
SURFACE_TRAITS = Traits(
    promises=Promises(
        patch=PatchPromises(flat=True),
        tangent="exact",
        symmetric=False,
        conserves_force=True,
        conserves_moment=True,
        unbiased=False,
        nodes_push=True,
        translation_stable=True,
        locks=True,
    ),
    rules=Rules(gap="cells", force_along="slave normal", penalty="distributed", area="current"),
    abilities=Abilities(dimensions=(3,), faces=(3,), batched=True, takes_complex=True),
    evidence=Evidence(
        witnesses={"symmetric": "tilted-faces", "swap": "tilted-faces", "stability.locking": "12 on 8, ε̂ = 1e8 E/h"}
    ),
)


@dataclass(frozen=True, slots=True, eq=False)
class FacePairs:
    """The cells of an interface: pairs of a slave and a master face, and the codes of the corners of their overlap."""

    slave_face: IntArray  # (n_cells,)
    master_face: IntArray  # (n_cells,)
    codes: IntArray  # (n_cells, most_corners, 2) See `face_search`.
    slave_nodes: IntArray  # (n_cells, n_slave_corners) The nodes of the slave face of each cell.
    master_nodes: IntArray  # (n_cells, n_master_corners)

    @classmethod
    def find(cls, interface: Interface, z: FloatArray) -> Self:
        """Return the cells of an interface at a state z (n_unknowns,)."""
        return cls.from_pairing(interface, pair_faces(interface, z))

    @classmethod
    def from_pairing(cls, interface: Interface, pairing: Mapping[str, IntArray]) -> Self:
        """Return the cells that a pairing holds."""
        slave, master = pairing["slave_face"], pairing["master_face"]
        return cls(slave, master, pairing["corners"], interface.slave.faces[slave], interface.master.faces[master])

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

    def view_at(self, z: FloatArray) -> "SlaveView":
        """Return the cells as their slave faces see them at a state z (n_unknowns,)."""
        return SlaveView.of_corners(positions_of(z, self.slave_nodes), positions_of(z, self.master_nodes))


def pair_faces(interface: Interface, z: FloatArray) -> dict[str, IntArray]:
    """Return the integers of the cells of an interface at a state z (n_unknowns,), as a pairing has them."""
    x, slave, master = np.array(z).reshape(-1, 3), interface.slave, interface.master
    faces, codes = find_cells(x, slave.faces, master.faces, longest_edges(slave, x), longest_edges(master, x))
    return {"slave_face": faces[:, 0].copy(), "master_face": faces[:, 1].copy(), "corners": codes}


def first_faces(faces: IntArray, nodes: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the first of the faces at each node (n,), and the shape functions of its corners there (n, n_corners)."""
    holds = faces[None] == nodes[:, None, None]  # (n_nodes, n_faces, n_corners)
    first = holds.any(axis=2).argmax(axis=1)
    return first, holds[np.arange(len(nodes)), first].astype(np.float64)


def positions_of(z: Array, nodes: IntArray) -> Array:
    """Return the positions (..., n, k, 3) of nodes (n, k) at states z (..., n_unknowns)."""
    positions: Array = z.reshape(*z.shape[:-1], -1, 3)[..., nodes, :]
    return positions


def cross_plane(first: Array, second: Array) -> Array:
    """Return the cross products (...,) of plane vectors (..., 2)."""
    product: Array = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return product


def plane_areas(corners: Array) -> Array:
    """Return the areas (...,) of polygons with plane corners (..., n_corners, 2)."""
    arms = corners[..., 1:, :] - corners[..., :1, :]
    area: Array = cross_plane(arms[..., :-1, :], arms[..., 1:, :]).sum(axis=-1) / 2
    return area


def evaluate_shapes(corners: Array, points: Array) -> Array:
    """Return shape functions (..., n_points, n_corners) of faces (..., n_corners, 2) at points (..., n_points, 2)."""
    arm = points - corners[..., :1, :]
    if corners.shape[-2] == TRIANGLE:
        first, second = corners[..., 1:2, :] - corners[..., :1, :], corners[..., 2:, :] - corners[..., :1, :]
        area = cross_plane(first, second)
        s, t = cross_plane(arm, second) / area, cross_plane(first, arm) / area
        return np.stack([1 - s - t, s, t], axis=-1)
    # With edges a and b at corner 0 and the twist w, a point is at p = s a + t b + s t w. Its cross product with
    # b + s w leaves s alone, that with a + t w leaves t. The root of the discriminant of both is the Jacobian at the
    # point. It has the sign of the face's area, and so has what it is added to: nothing cancels where the twist is 0.
    first, second, third, last = (corners[..., i : i + 1, :] for i in range(4))
    a, b, w = second - first, last - first, (first - second) + (third - last)
    area, turn = cross_plane(a, b), cross_plane(arm, w)
    by_s, by_t = cross_plane(arm, b), cross_plane(a, arm)
    jacobian_s = _root((area - turn) ** 2 + 4 * cross_plane(a, w) * by_s, area)
    jacobian_t = _root((area + turn) ** 2 + 4 * cross_plane(w, b) * by_t, area)
    s, t = 2 * by_s / (area - turn + jacobian_s), 2 * by_t / (area + turn + jacobian_t)
    return np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=-1)


def _root(square: Array, sign: Array) -> Array:
    """Return the root with a sign; 0 for a negative number, since far outside of a face a point has no place."""
    root = np.sqrt(np.where(square.real > 0, square, 0.0))
    return np.where(sign.real < 0, -root, root)


@dataclass(frozen=True, slots=True, eq=False)
class CellPoints:
    """Points of cells, with any leading axes."""

    slave_shape: Array  # (..., n_cells, n_points, n_slave_corners)
    master_shape: Array  # (..., n_cells, n_points, n_master_corners)
    weight: Array  # (..., n_cells, n_points) The area of a point, in the plane of the slave face.
    gap: Array  # (..., n_cells, n_points) The gap along the slave's normal, negative in penetration.
    normal: Array  # (..., n_cells, 3) The unit normal out of the slave.

    def push(self, force: Array) -> tuple[Array, Array]:
        """Return the residuals (..., n_cells, n_corners, 3) on slave and master corners of forces at the points.

        A positive force (..., n_cells, n_points) presses the faces apart.
        """
        normal = self.normal[..., None, :]
        slave, master = (force[..., None, :] @ shape for shape in (self.slave_shape, self.master_shape))
        return np.swapaxes(slave, -2, -1) * normal, -np.swapaxes(master, -2, -1) * normal


@dataclass(frozen=True, slots=True, eq=False)
class SlaveView:
    """Cells as their slave faces see them: plane coordinates from the slave's first corner."""

    slave: Array  # (..., n_cells, n_slave_corners, 2)
    master: Array  # (..., n_cells, n_master_corners, 2) The corners in the order of the face.
    slave_height: Array  # (..., n_cells, n_slave_corners) Heights along the normal, 0 on a triangle.
    master_height: Array  # (..., n_cells, n_master_corners)
    normal: Array  # (..., n_cells, 3)

    @classmethod
    def of_corners(cls, slave: Array, master: Array) -> Self:
        """Return the view of slave corners and master corners (..., n_cells, n_corners, 3)."""
        arms = [side - slave[..., :1, :] for side in (slave, master)]
        along, across, normal = axes_of(slave)
        plane = [np.stack([_dot(arm, along), _dot(arm, across)], axis=-1) for arm in arms]
        return cls(plane[0], plane[1], _dot(arms[0], normal), _dot(arms[1], normal), normal)

    def points_at(self, places: Array, weight: Array) -> CellPoints:
        """Return the points at places (..., n_cells, n_points, 2) of the plane, with their areas."""
        slave, master = evaluate_shapes(self.slave, places), evaluate_shapes(self.master, places)
        gap = (master @ self.master_height[..., None] - slave @ self.slave_height[..., None])[..., 0]
        return CellPoints(slave, master, weight, gap, self.normal)

    def cell_corners(self, codes: IntArray) -> Array:
        """Return the corners (..., n_cells, most_corners, 2) with these codes (n_cells, most_corners, 2)."""
        n_slave, n_master, cells = self.slave.shape[-2], self.master.shape[-2], np.arange(len(codes))[:, None]
        i, j = codes[..., 0], codes[..., 1]
        start, end = (self.slave[..., cells, (i + step) % n_slave, :] for step in (0, 1))
        before, behind = (self.master[..., ::-1, :][..., cells, (j + step) % n_master, :] for step in (0, 1))
        here, there = cross_plane(end - start, before - start), cross_plane(end - start, behind - start)
        crossing = (i >= 0) & (j >= 0)
        share = here / np.where(crossing, here - there, 1.0)
        corner = np.where((j < 0)[..., None], start, before)
        return np.where(crossing[..., None], before + share[..., None] * (behind - before), corner)


def flatten_pushes(*sides: Array) -> Array:
    """Return residuals (..., n, n_corners, 3) on the corners of one or two faces as rows (..., n, n_corners · 3)."""
    pushes = np.concatenate(sides, axis=-2)
    return pushes.reshape(*pushes.shape[:-2], 3 * pushes.shape[-2])


def axes_of(slave: Array) -> tuple[Array, Array, Array]:
    """Return the axes (..., n_cells, 3) of slave faces (..., n_cells, n_corners, 3): along, across, unit normal."""
    first, last = slave[..., 0, :], slave[..., -1, :]
    if slave.shape[-2] == TRIANGLE:
        normal = np.cross(slave[..., 1, :] - first, last - first)
    else:
        normal = np.cross(slave[..., 2, :] - first, last - slave[..., 1, :])
    normal = unit_vectors(normal)
    edge = slave[..., 1, :] - first
    along = unit_vectors(edge - (edge * normal).sum(axis=-1)[..., None] * normal)
    return along, np.cross(normal, along), normal


def unit_vectors(vectors: Array) -> Array:
    """Return vectors (..., 3) over their lengths; a length is a root of squares, so that it takes complex numbers."""
    units: Array = vectors / np.sqrt((vectors * vectors).sum(axis=-1))[..., None]
    return units


def gauss_points(view: SlaveView, codes: IntArray, n_points: int) -> CellPoints:
    """Return the Gauss points of each cell, `n_points` on each triangle between its middle and two corners.

    Triangles around a corner would do as well where all of a cell is in contact. Where a part is open, their points
    would depend on which corner is the first, and so on the numbers of the nodes.
    """
    places, weights = GAUSS[n_points]
    corners = view.cell_corners(codes)
    following = np.roll(corners, -1, axis=-2)
    # The middle is the mean of the edges by their squared lengths. It lies inside however thin the cell is, and corners
    # that are listed twice do not count. The centroid of a cell without area would be a quotient of two roundoffs.
    squares = ((following - corners) ** 2).sum(axis=-1)[..., None]
    total = squares.sum(axis=-2, keepdims=True)
    middle = (squares * (corners + following)).sum(axis=-2, keepdims=True) / np.where(total == 0, 1.0, 2 * total)
    middle = np.broadcast_to(np.where(total == 0, corners[..., :1, :], middle), corners.shape)
    triangles = np.stack([middle, corners, following], axis=-2)
    points = places @ triangles
    count = points.shape[-3] * n_points
    first, others = triangles[..., 0, :], triangles[..., 1:, :]
    area = (cross_plane(others[..., 0, :] - first, others[..., 1, :] - first) / 2)[..., None] * weights
    return view.points_at(points.reshape(*points.shape[:-3], count, 2), area.reshape(*area.shape[:-2], count))


def _dot(arms: Array, axis: Array) -> Array:
    product: Array = (arms @ axis[..., None])[..., 0]
    return product


def report_points(
    pairs: FacePairs, points: CellPoints, z: FloatArray, penalty: float, active: BoolArray
) -> ContactPoints:
    """Return points of cells at a state z as contact points, with pressures −ε̂ g where `active` (n_cells, n_points)."""
    n_points = points.gap.shape[1]
    place = np.einsum("cqk,cki->cqi", points.slave_shape, positions_of(z, pairs.slave_nodes))
    return ContactPoints.on_faces(
        slave_segment=np.repeat(pairs.slave_face, n_points),
        slave_shape=points.slave_shape.reshape(-1, points.slave_shape.shape[-1]),
        master_segment=np.repeat(pairs.master_face, n_points),
        master_shape=points.master_shape.reshape(-1, points.master_shape.shape[-1]),
        position=place.reshape(-1, 3),
        normal=np.repeat(-points.normal, n_points, axis=0),
        gap=points.gap.reshape(-1),
        pressure=np.where(active, -penalty * points.gap, 0.0).reshape(-1),
        weight=points.weight.reshape(-1),
        active=active.reshape(-1),
    )


def differentiate(function: Callable[..., Array], corners: FloatArray, *others: Array) -> FloatArray:
    """Return the derivatives (n_cells, …, n_corners · 3) of a function of each cell's corners (n_cells, n_corners, 3).

    The function takes corners (..., n_cells, n_corners, 3) and other arrays (n_cells, …), such as codes of corners, and
    returns an array (..., n_cells, …).
    """
    n_cells, n_corners, _ = corners.shape
    directions = 1j * STEP * np.eye(3 * n_corners).reshape(3 * n_corners, 1, n_corners, 3)
    parts = []
    for first in range(0, max(n_cells, 1), CHUNK):
        chunk = slice(first, first + CHUNK)
        moved = function(corners[chunk] + directions, *(values[chunk] for values in others))
        parts.append(np.moveaxis(moved.imag / STEP, 0, -1))
    return np.concatenate(parts)


def unknowns_of(nodes: IntArray) -> IntArray:
    """Return the unknowns (n_cells, n_corners · 3) of nodes (n_cells, n_corners)."""
    unknowns: IntArray = (3 * nodes[..., None] + np.arange(3)).reshape(len(nodes), 3 * nodes.shape[1])
    return unknowns


def add_blocks(blocks: FloatArray, rows: IntArray, columns: IntArray, shape: tuple[int, int]) -> sparse.csr_array:
    """Return the sum of blocks (n_cells, a, b) at rows (n_cells, a) and columns (n_cells, b) of a matrix."""
    numbers = (rows.astype(np.int32)[:, :, None], columns.astype(np.int32)[:, None, :])  # As scipy numbers them.
    places = tuple(np.broadcast_to(each, blocks.shape).reshape(-1) for each in numbers)
    return sparse.coo_array((blocks.reshape(-1), places), shape=shape).tocsr()


def add_rows(values: Array, rows: IntArray, count: int) -> Array:
    """Return the sums (..., count) of values (..., n_cells, a) at rows (n_cells, a)."""
    sums = np.zeros((count, *values.shape[:-2]), values.dtype)
    np.add.at(sums, rows, np.moveaxis(values, (-2, -1), (0, 1)))
    return np.moveaxis(sums, 0, -1)
