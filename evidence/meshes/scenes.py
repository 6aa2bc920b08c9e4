"""Contact scenes of two bodies whose meshes do not match, with the sides that a reader has to find."""

from itertools import product
from typing import NamedTuple

import numpy as np

SIDES = {  # {kind of cells: the nodes of their sides, seen from outside, as Exodus numbers them}
    "triangle": [(0, 1), (1, 2), (2, 0)],
    "quad": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "tetra": [(0, 1, 3), (1, 2, 3), (0, 3, 2), (0, 2, 1)],
    "hexahedron": [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1), (4, 5, 6, 7)],
}
SPLIT = {  # Boxes, and squares, into simplices
    "triangle": [(0, 1, 2), (0, 2, 3)],
    "tetra": [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)],
}
NAMES = ("punch", "base")


class Scene(NamedTuple):
    """Two bodies: the punch is a side of the upper one, the base one of the lower one."""

    kind: str  # That of the cells
    side_kind: str
    points: np.ndarray  # (n_points, 3)
    parts: list[tuple[str, int, str, np.ndarray]]  # (name, number, kind, nodes): both sides, then both bodies
    owners: list[np.ndarray]  # (cell, number of its side) of each member of the sides, counted from 0

    @property
    def dim(self) -> int:
        """2 or 3."""
        return 2 if self.side_kind == "line" else 3

    def truth(self) -> list:
        """Return the corners of each member of the punch and of the base."""
        return [rounded(self.points[part[3]][..., : self.dim]) for part in self.parts[:2]]


def rounded(elements: np.ndarray) -> list:
    """Return elements (n, n_corners, dim) as lists that can be compared: begun at the least corner, and sorted."""
    rows = np.round(elements, 4).tolist()
    return sorted(row if len(row) == 2 else min(row[k:] + row[:k] for k in range(len(row))) for row in rows)


def make(kind: str, shapes: tuple, places: tuple, axis: int, ends: tuple = (0, 1)) -> Scene:
    """Return a scene of two grids, each a map of the unit cube; the sides are at the ends of an axis of it."""
    points, bodies, sides, owners = np.empty((0, 3)), [], [], []
    for shape, place, end in zip(shapes, places, ends, strict=True):
        unit = np.array(list(product(*(np.linspace(0, 1, count) for count in shape))))
        steps = [int(np.prod(shape[k + 1 :])) for k in range(len(shape))]
        corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
        corners = corners if len(shape) == 2 else [(*corner, k) for k in (0, 1) for corner in corners]
        first = [np.dot(cell, steps) for cell in product(*(range(count - 1) for count in shape))]
        cells = np.array(first)[:, None] + np.array([np.dot(corner, steps) for corner in corners])
        cells = np.vstack([cells[:, nodes] for nodes in SPLIT[kind]]) if kind in SPLIT else cells
        # The ends of a ring are the same points.
        where, numbers = np.unique(np.round([place(*each) for each in unit], 9), axis=0, return_inverse=True)
        is_on = unit[:, axis] == end
        owner = [
            (c, s) for c, cell in enumerate(cells) for s, n in enumerate(SIDES[kind]) if is_on[cell[list(n)]].all()
        ]
        cells = numbers.reshape(-1)[cells] + len(points)
        sides.append(np.array([cells[c, list(SIDES[kind][s])] for c, s in owner]))
        bodies.append(cells)
        owners.append(np.array(owner))
        points = np.vstack([points, np.pad(where, ((0, 0), (0, 3 - where.shape[1])))])
    side_kind = {2: "line", 3: "triangle", 4: "quad"}[sides[0].shape[1]]
    parts = [(name, n, side_kind, nodes) for n, (name, nodes) in enumerate(zip(NAMES, sides, strict=True), 1)]
    parts += [("upper", 3, kind, bodies[0]), ("lower", 4, kind, bodies[1])]
    return Scene(kind, side_kind, points, parts, owners)


def scenes() -> dict[str, Scene]:
    """Return blocks of each kind of cells, one pressed on the other, and a ring in a hole."""

    def bent(x: float) -> float:
        return 0.98 + 0.1 * (x - 0.5) ** 2

    def ring(inner: float, outer: float, s: float, t: float) -> tuple[float, float]:
        radius, angle = outer + (inner - outer) * s, 2 * np.pi * t
        return radius * np.sin(angle), radius * np.cos(angle)

    plane = (lambda s, t: (1 + 2 * s, bent(s) + t)), (lambda s, t: (4 * s, t))
    space = (lambda s, t, u: (1 + 2 * s, 0.5 + 2 * t, bent(s) + u)), (lambda s, t, u: (4 * s, 3 * t, u))
    rings = (lambda s, t: ring(0.4, 1.0, s, t)), (lambda s, t: ring(1.01, 2.0, s, t))
    return {
        **{f"{kind}s": make(kind, ((4, 3), (6, 4)), plane, 1) for kind in ("quad", "triangle")},
        **{f"{kind}s": make(kind, ((3, 4, 3), (5, 4, 3)), space, 2) for kind in ("hexahedron", "tetra")},
        "ring": make("quad", ((3, 13), (3, 17)), rings, 0),
    }
