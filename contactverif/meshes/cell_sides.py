"""The sides of cells: the edges of cells in a plane, the faces of cells in space, each with its cell behind it.

Two surfaces of a mesh can touch if their normals oppose each other, and no body lies between them.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.body import SIDES
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import ONE_SIDED, SEGMENT, Interface, Surface, turns_of, unit_normals
from contactverif.meshes.plain_mesh import CORNERS, Group

_RAYS = 50  # So many elements of a surface look behind them.


def check_facing(interface: Interface, can_turn: Collection[str] = ("slave", "master")) -> None:
    """Refuse two surfaces whose mean normals, weighted by length or area, do not oppose each other.

    `can_turn` are those without cells beside them; the one whose body lies on the side of the other is named.
    """
    nodes, n_slave = interface.nodes, interface.n_slave_nodes
    slave, master = (mean_direction(surface, nodes) for surface in (interface.slave, interface.master))
    if slave is None or master is None or slave @ master < 0:
        return
    wrong = "slave" if slave @ (nodes[:n_slave].mean(axis=0) - nodes[n_slave:].mean(axis=0)) > 0 else "master"
    needed = f"--flip {wrong} turns that one" if wrong in can_turn else "other groups"
    places = [describe(0.0 - normal.round(3)) for normal in (slave, master)]
    actual = f"bodies on the same side: that of the slave lies towards {places[0]}, that of the master {places[1]}"
    raise MisuseError("--mesh", actual, f"two sides that face each other: {needed}")


def mean_direction(surface: Surface, nodes: FloatArray) -> FloatArray | None:
    """Return the mean normal (dim,) out of the body; None where the surface is closed, or nearly so in space."""
    if nodes.shape[1] == 3:
        turns = turns_of(nodes[surface.faces]).sum(axis=1)
        mean: FloatArray = turns.sum(axis=0) / np.linalg.norm(turns, axis=1).sum()
        return mean if np.linalg.norm(mean) >= ONE_SIDED else None
    # The normals of a closed chain sum to zero whichever way it runs. The sum over an open one telescopes.
    starts = surface.segments[surface.neighbours[:, 0] < 0, 0]
    ends = surface.segments[surface.neighbours[:, 1] < 0, 1]
    if not len(starts):
        return None
    along = nodes[ends].sum(axis=0) - nodes[starts].sum(axis=0)
    normal: FloatArray = np.array([along[1], -along[0]]) / surface.lengths(nodes).sum()
    return normal


def back_to_back(points: FloatArray, slave: IntArray, master: IntArray, boundary: IntArray) -> str:
    """Return in words where two surfaces turn their backs to each other; empty if they do not.

    Most elements of the slave see no master before them, and behind them the slave's own body ends before the master
    comes. In a shrink fit, however deep, the master comes first. The elements of both surfaces, (n, n_corners) at
    points (n_points, dim), have their bodies behind them. `boundary` are all others around the bodies, and the master
    too if both are of one body. Where there are none, a body ends behind an element as far away as the element is wide.
    """
    master, boundary = _simplices(master), _simplices(boundary)
    of_master, of_boundary = unit_normals(points[master]), unit_normals(points[boundary])
    rays = slave[np.unique(np.linspace(0, len(slave) - 1, _RAYS).astype(np.int64))]
    origins, normals = points[rays].mean(axis=1), unit_normals(points[_simplices(rays)[: len(rays)]])
    votes, places = 0, ""
    for origin, normal, element in zip(origins, normals, rays, strict=True):
        ways = _ways(origin, normal, points[master])[of_master @ normal < 0]
        behind = -ways[ways < 0].max(initial=-np.inf)
        is_back = not np.isfinite(ways[ways >= 0]).any() and np.isfinite(behind)
        if is_back:
            ends = -_ways(origin, normal, points[boundary])[of_boundary @ normal < 0]
            width = np.ptp(points[element], axis=0).max()
            is_back = behind >= (ends[ends > 0].min(initial=np.inf) if len(boundary) else width)
        votes += 1 if is_back else -1
        if is_back and not places:
            there = origin - behind * normal
            places = f"the slave at {describe(origin)} and the master at {describe(there)}"
    return places if votes > 0 else ""


def describe(place: FloatArray) -> str:
    """Return a position in words."""
    return f"({', '.join(f'{part:g}' for part in place)})"


def _simplices(elements: IntArray) -> IntArray:
    """Return lines, and faces as triangles: first a triangle of each face, then the other ones of quadrilaterals."""
    return np.vstack([elements[:, :3], elements[:, [0, 2, 3]]]) if elements.shape[1] == 4 else elements


def _ways(origin: FloatArray, direction: FloatArray, corners: FloatArray) -> FloatArray:
    """Return how far along a unit vector lines or triangles are met, negative if backwards; infinity if not."""
    relative = corners - origin
    if corners.shape[2] == 2:
        weights = (relative @ [-direction[1], direction[0]])[:, ::-1] * [1, -1]
    else:
        across = np.linalg.svd(direction[None])[2][1:]  # Two unit vectors normal to the direction and to each other.
        second, third = (np.roll(relative @ across.T, -step, axis=1) for step in (1, 2))
        weights = second[..., 0] * third[..., 1] - second[..., 1] * third[..., 0]
    total = weights.sum(axis=1)
    is_met = ((weights >= 0).all(axis=1) | (weights <= 0).all(axis=1)) & (total != 0)
    return np.where(is_met, (weights * (relative @ direction)).sum(axis=1) / np.where(is_met, total, 1.0), np.inf)


# {kind: the corners of its faces}; which way round is found by the middle of the cell.
_FACES = {
    "tetra": SIDES[4],
    "pyramid": ((0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "wedge": ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "hexahedron": SIDES[8],
}
_PLANE = ("triangle", "quad", "polygon")


def corners_of(cells: Group, bases: tuple[str, ...]) -> dict[str, IntArray]:
    """Return the corners (n_cells, n_corners) of the cells of some kinds, also of those of higher order."""
    of_kind: dict[str, list[IntArray]] = {}
    for kind, data in cells.items():
        base = next((base for base in bases if base in kind.lower()), None)
        if base is not None:  # Corners come first, nodes on edges last.
            corners = data[:, : CORNERS.get(base)]
            of_kind.setdefault(base if base in CORNERS else kind, []).append(corners)
    return {kind: np.concatenate(parts) for kind, parts in of_kind.items()}


def plane_cells(cells: Group) -> dict[str, IntArray]:
    """Return the corners of the cells of two dimensions."""
    return corners_of(cells, _PLANE)


def label_bodies(parts: Iterable[IntArray], n_points: int) -> IntArray:
    """Return a label of each point (n_points,); those that cells or lines join have the same one."""
    ends = [np.column_stack([part[:, 0], corner]) for part in parts for corner in part.T[1:]]
    first, second = np.vstack([np.empty((0, 2), dtype=np.int64), *ends]).T
    graph = sparse.coo_array((np.ones(len(first)), (first, second)), shape=(n_points, n_points))
    labels: IntArray = csgraph.connected_components(graph, directed=False)[1].astype(np.int64)
    return labels


@dataclass(frozen=True, slots=True, eq=False)
class CellSides:
    """The sides of all cells of a mesh, by the number of their corners."""

    points: FloatArray
    outer: dict[int, IntArray]  # Those of one cell: the boundary of all bodies, each with its body behind it.
    inner: dict[int, IntArray]  # Those of several cells, their nodes ascending.

    @classmethod
    def collect(cls, cells: Group, points: FloatArray) -> "CellSides":
        """Return the sides of the cells of a mesh in a plane, or in space if its points have three coordinates."""
        sides: dict[int, list[IntArray]] = {}
        if points.shape[1] == 2:
            for corners in plane_cells(cells).values():
                x, y = np.moveaxis(points[corners] - points[corners[:, :1]], -1, 0)  # (n_cells, n_corners) each
                with np.errstate(over="ignore", invalid="ignore"):  # Damaged coordinates are refused later.
                    twice_area = (x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1)
                turned = np.where(twice_area[:, None] < 0, corners[:, ::-1], corners)[twice_area != 0]
                edges = np.stack([turned, np.roll(turned, -1, axis=1)], axis=-1).reshape(-1, 2)
                sides.setdefault(SEGMENT, []).append(edges)
        else:
            for kind, corners in corners_of(cells, tuple(_FACES)).items():
                middles = points[corners].mean(axis=1)
                for face in _FACES[kind]:
                    nodes = corners[:, face]
                    ways = points[nodes].mean(axis=1) - middles
                    out = (turns_of(points[nodes]).sum(axis=1) * ways).sum(axis=1)
                    turned = np.where(out[:, None] < 0, nodes[:, ::-1], nodes)[out != 0]
                    sides.setdefault(len(face), []).append(turned)
        outer, inner = {}, {}
        for count, parts in sides.items():
            every = np.concatenate(parts)
            ascending = np.sort(every, axis=1)
            order = np.lexsort(ascending.T)
            is_new = np.r_[True, (np.diff(ascending[order], axis=0) != 0).any(axis=1)][: len(every)]
            counts = np.diff(np.r_[np.flatnonzero(is_new), len(every)])
            outer[count] = every[np.sort(order[is_new][counts == 1])]
            inner[count] = ascending[order[is_new][counts > 1]]
        return cls(points, outer, inner)

    def between(self, nodes: IntArray, count: int) -> IntArray:
        """Return the boundary (n, count) all corners of which are in a set of nodes."""
        outer = self.outer.get(count, np.empty((0, count), dtype=np.int64))
        return outer[np.isin(outer, nodes).all(axis=1)]

    def around(self, *elements: IntArray) -> IntArray:
        """Return the boundary without some elements of a surface; quadrilaterals are split into triangles."""
        excluded = {tuple(sorted(corners)) for part in elements for corners in part.tolist()}
        parts = []
        for count, outer in self.outer.items():
            others = outer[[tuple(sorted(corners)) not in excluded for corners in outer.tolist()]]
            parts += [others] if count != 4 else [others[:, :3], others[:, [0, 2, 3]]]
        return np.vstack(parts) if parts else np.empty((0, self.points.shape[1]), dtype=np.int64)

    def signs(self, argument: str, elements: IntArray) -> IntArray:
        """Return 1 for each element (n, n_corners) with a cell behind it, −1 with one before it, 0 without a cell."""
        count = elements.shape[1]
        inner = self.inner.get(count, np.empty((0, count), dtype=np.int64))
        inside = set(map(tuple, inner[np.isin(inner, elements).all(axis=1)].tolist()))
        outer = {tuple(sorted(side)): side for side in self.between(np.unique(elements), count).tolist()}
        signs = np.zeros(len(elements), dtype=np.int64)
        for number, corners in enumerate(elements.tolist()):
            key = tuple(sorted(corners))
            if key in inside:
                kind, needed = ("line", "lines") if count == SEGMENT else ("face", "faces")
                actual = f"a {kind} with cells on both sides, at {describe(self.points[corners[0]])}"
                raise MisuseError(argument, actual, f"{needed} on the boundary of a body")
            if key in outer:
                first, second, *_ = outer[key]
                place = corners.index(first)
                follows = place == 0 if count == SEGMENT else corners[(place + 1) % count] == second
                signs[number] = 1 if follows else -1
        return signs
