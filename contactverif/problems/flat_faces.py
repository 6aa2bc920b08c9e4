"""Flat interfaces in space, exact in binary: nodes over edges, far away, deep, in touch, or misleading a search.

They are to `flat_states` what faces are to segments. A state is laid out in the plane z = 0, with the slave's body
above. It is turned by a rotation whose entries are integers over one denominator, and becomes as many times longer, so
that coordinates of few bits stay exact. What a case says is read off the stored nodes in rationals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from itertools import accumulate, pairwise, product
from operator import mul

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.oracle import uniform_surface_weights

Quaternion = tuple[int, int, int, int]
Points = Sequence[Sequence[float]]
Faces = Sequence[Sequence[int]]
UPRIGHT, TURNED, STEEP = (1, 0, 0, 0), (1, 1, 1, 0), (1, 2, -1, 1)
_TURNS = {"": UPRIGHT, ", turned by thirds": TURNED, ", turned by sevenths": STEEP}
_TWO_TURNS = {"": UPRIGHT, ", turned by thirds": TURNED}
_PENALTY = 50 / 3  # No number of single precision, in which all penalties of random cases are exact.


@dataclass(frozen=True, slots=True)
class Sheet:
    """Triangles, counter-clockwise seen from outside of their body."""

    points: Points  # (x, y, z)
    faces: Faces

    @property
    def is_flat(self) -> list[bool]:
        """True for each face in the plane z = 0 that is seen from above."""
        corners = [[self.points[node] for node in face] for face in self.faces]
        return [all(z == 0 for _, _, z in face) and _area(face) > 0 for face in corners]

    def __add__(self, other: Sheet) -> Sheet:
        """Return both, which have no node in common."""
        count = len(self.points)
        moved = [[node + count for node in face] for face in other.faces]
        return Sheet([*self.points, *other.points], [*self.faces, *moved])


def _area(face: Points) -> float:
    """Return twice the area of a triangle in the plane, positive if its corners run counter-clockwise."""
    (ax, ay, _), (bx, by, _), (cx, cy, _) = face
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


def grid(xs: Sequence[float], ys: Sequence[float], height: float = 0.0) -> Sheet:
    """Return a grid with nodes at these places, its cells cut along one diagonal and the other in turn."""
    rows = len(ys)
    faces = []
    for i, j in product(range(len(xs) - 1), range(rows - 1)):
        a, b, c, d = i * rows + j, (i + 1) * rows + j, (i + 1) * rows + j + 1, i * rows + j + 1
        faces += [[a, b, c], [a, c, d]] if (i + j) % 2 == 0 else [[a, b, d], [b, c, d]]
    return Sheet([(x, y, height) for x, y in product(xs, ys)], faces)


def fan(centre: tuple[float, float], low: float, high: float, parts: int = 1) -> Sheet:
    """Return the square [low, high]² as a fan around a node; each of its sides has so many edges."""
    steps = [low + (high - low) * k / parts for k in range(parts)]
    border = [(x, low) for x in steps] + [(high, y) for y in steps]
    border += [(low + high - x, high) for x in steps] + [(low, low + high - y) for y in steps]
    count = len(border)
    faces = [[0, 1 + k, 1 + (k + 1) % count] for k in range(count)]
    return Sheet([(*centre, 0.0), *((x, y, 0.0) for x, y in border)], faces)


def shuffle(sheet: Sheet) -> Sheet:
    """Return the same triangles in a random order, the same at each call."""
    order = np.random.default_rng(len(sheet.faces)).permutation(len(sheet.faces))
    return Sheet(sheet.points, [sheet.faces[k] for k in order])


def plate(top: Sheet, thickness: float, below: tuple[float, float]) -> Sheet:
    """Return a closed plate under a flat sheet; its lower side is a fan around the node `below`."""
    edges = {edge for face in top.faces for edge in zip(face, [*face[1:], face[0]], strict=True)}
    border = {start: end for start, end in edges if (end, start) not in edges}
    loop = [min(border)]
    while (following := border[loop[-1]]) != loop[0]:
        loop.append(following)
    count = len(top.points)
    points = [*top.points, *((*top.points[node][:2], -thickness) for node in loop), (*below, -thickness)]
    under = {node: count + k for k, node in enumerate(loop)}
    faces = [*top.faces]
    for a, b in pairwise([*loop, loop[0]]):
        faces += [[b, a, under[a]], [b, under[a], under[b]], [under[b], under[a], len(points) - 1]]
    return Sheet(points, faces)


def wedge(slope: float) -> Sheet:
    """Return a wedge over [0, 8]² with its edge at x = 0: the upper side is flat, the lower side falls by `slope`."""
    top, bottom = grid([0.0, 4.0, 8.0], [0.0, 3.0, 8.0]), grid([0.0, 4.0, 8.0], [0.0, 3.0, 8.0])
    rows = 3  # The nodes on the edge, which come first, belong to both sides.
    number = [node if node < rows else node + len(top.points) - rows for node in range(len(bottom.points))]
    points = [*top.points, *((x, y, -slope * x) for x, y, _ in bottom.points[rows:])]
    return Sheet(points, [*top.faces, *([number[node] for node in face[::-1]] for face in bottom.faces)])


def rotation(quaternion: Quaternion) -> tuple[list[list[int]], int]:
    """Return a rotation as integers over one denominator."""
    a, b, c, d = quaternion
    rows = [
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ]
    return rows, a * a + b * b + c * c + d * d


def flat_face_state(
    name: str,
    slave: Sheet,
    master: Sheet,
    depth: float,
    *,
    turn: Quaternion = UPRIGHT,
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Case:
    """Return a flat slave that penetrates the flat faces of a master by the same depth everywhere.

    The slave covers a rectangle, and is given as its master would be, seen from above. The flat faces of the master
    cover all of it. The parameters are `penetration`, `normal` (3,), the tangents `directions` (2, 3), and `weights`
    (n_nodes,): the area that a uniform pressure on a node acts on, 0 off the flat part.
    """
    matrix, size = rotation(turn)
    place = np.array(matrix, dtype=np.float64).T
    slave_nodes = np.array(slave.points) @ place + offset
    master_nodes = np.array(master.points) @ place + offset
    current = np.array([(x, y, z - depth) for x, y, z in slave.points]) @ place + offset
    below = [face[::-1] for face in slave.faces]
    interface = Interface.from_faces(slave_nodes, below, master_nodes, master.faces)
    nodes, count = np.vstack([current, master_nodes]), len(current)
    flat = [face for face, is_flat in zip(master.faces, master.is_flat, strict=True) if is_flat]
    frame = read_frame(nodes, matrix, size, master_nodes[flat[0][0]])
    parameters = {
        "penetration": np.array(float(-frame[0][2])),
        "normal": np.array([row[2] / size for row in matrix]),
        "directions": np.array(matrix, dtype=np.float64).T[:2] / size,
        "weights": _weights(below, flat, [place[:2] for place in frame], count),
    }
    return Case(interface, nodes.reshape(-1), _PENALTY, parameters, name=name)


def read_frame(nodes: FloatArray, matrix: list[list[int]], size: int, origin: FloatArray) -> list[list[Fraction]]:
    """Return the exact places x, y and height z of nodes (n, 3) in the frame of a rotation, as lengths from a node."""
    steps = [[Fraction(a) - Fraction(b) for a, b in zip(node, origin.tolist(), strict=True)] for node in nodes.tolist()]
    axes = [[Fraction(matrix[k][axis], size) for k in range(3)] for axis in range(3)]
    return [[sum(map(mul, step, axis), Fraction(0)) for axis in axes] for step in steps]


def _weights(slave: Faces, flat: Faces, frame: Sequence[Sequence[Fraction]], count: int) -> FloatArray:
    """Return the weights (n_nodes,) of the nodes of a slave, and of the flat faces of a master behind `count` nodes."""
    plane = np.array([[float(x), float(y)] for x, y in frame])
    at = sorted({node for face in flat for node in face})
    number = {node: k for k, node in enumerate(at)}
    faces = [[number[node] for node in face] for face in flat]
    points = np.column_stack([plane, np.zeros(len(plane))])
    low, high = plane[:count].min(axis=0), plane[:count].max(axis=0)
    domain = [low, [high[0], low[1]], high, [low[0], high[1]]]
    places = [*range(count), *(count + node for node in at)]
    interface = Interface.from_faces(points[:count], slave, points[[count + node for node in at]], faces)
    weights = np.zeros(len(plane))
    weights[places] = uniform_surface_weights(interface, plane[places], domain)
    return weights


_SLAVE = grid([0.25, 1.375, 3.0], [0.5, 1.75, 2.5])
_MASTER = grid([-0.5, 0.875, 1.75, 3.5], [-0.25, 1.0, 2.0, 3.25])


@cache
def node_hit_face_states() -> tuple[Case, ...]:
    """Return flat states in which a node of the master lies under a node, an edge or a centre, or a rounding beside.

    Under a slave node it has four edges, two of which lie under edges of the slave, or 32. In the last states it is the
    slave node that has 32.
    """
    cases = []
    slave, below = grid([0.0, 3.0, 6.0], [0.0, 3.0, 6.0]), grid([-3.0, 3.0, 9.0], [-3.0, 3.0, 9.0])
    places = {"node": (3.0, 3.0, 1), "node, fan of 32": (3.0, 3.0, 8), "edge": (4.5, 3.0, 1)}
    places |= {"diagonal": (1.5, 1.5, 1), "centre": (2.0, 1.0, 1)}
    steps = {"on it": (0, 0), "one rounding left": (-1, 0), "one rounding right": (1, 0), "one rounding up": (0, 1)}
    for (place, (x, y, parts)), (label, step), (turn_label, turn) in product(
        places.items(), steps.items(), _TWO_TURNS.items()
    ):
        rounding = 2.0**-50 if turn is UPRIGHT else 2.0**-47  # Turned nodes have up to three bits more.
        master = fan((x + step[0] * rounding, y + step[1] * rounding), -3.0, 9.0, parts)
        cases.append(flat_face_state(f"{place} {label}{turn_label}", slave, master, 2.0**-4, turn=turn))
        if place == "node, fan of 32":
            above = fan((x + step[0] * rounding, y + step[1] * rounding), 0.0, 6.0, parts)
            cases.append(flat_face_state(f"slave fan of 32 {label}{turn_label}", above, below, 2.0**-4, turn=turn))
    return tuple(cases)


@cache
def offset_face_states() -> tuple[Case, ...]:
    """Return flat states whose distance from the origin is 1e9 to 1e15 times their penetration; lengths are near 1."""
    cases = []
    for (label, offset, depth), (turn_label, turn) in product(
        (("1e6, gap 1e-6", 1e6, 2.0**-20), ("2^10, gap 1e-9", 2.0**10, 2.0**-30), ("1e8, gap 1e-6", 1e8, 2.0**-20)),
        _TURNS.items(),
    ):
        place = (offset, -offset / 2, offset / 4)
        cases.append(flat_face_state(f"{label}{turn_label}", _SLAVE, _MASTER, depth, turn=turn, offset=place))
    # The stored gap is one step of the doubles there, 1.49e-8, and not the 2e-8 that is asked for.
    cases.append(flat_face_state("1e8, gap of one step", _SLAVE, _MASTER, 2e-8, offset=(1e8, 1e8, 1e8)))
    cases.append(flat_face_state("1e6, gap 1e-6 in decimals", _SLAVE, _MASTER, 1e-6, offset=(1e6, 1e6, 1e6)))
    return tuple(cases)


@cache
def deep_face_states() -> tuple[Case, ...]:
    """Return flat states that penetrate by half a length and by two lengths, where edges have about one."""
    return tuple(
        flat_face_state(f"{name}{label}", _SLAVE, _MASTER, depth, turn=turn)
        for (name, depth), (label, turn) in product({"h/2": 0.5, "2h": 2.0}.items(), _TURNS.items())
    )


@cache
def equal_area_states() -> tuple[Case, ...]:
    """Return flat states whose slave has as much area as nodes, and a master with as many nodes on that area.

    So it does not matter whether the unit of the penalty is stated, and two passes have twice the springs. The master
    reaches farther by more than a length, and no node of it faces the border of the slave.
    """
    cases = []
    for name, n, depth, penalty in (
        ("25 nodes", 5, 2.0**-4, _PENALTY),
        ("25 nodes, soft and shallow", 5, 2.0**-12, 2.0**-4),
        ("144 nodes", 12, 2.0**-4, _PENALTY),
    ):
        places = [0.0, *accumulate([1.5, *[1.0] * (n - 3), 1.5])]
        below = [-1.375 + k for k in range(n + 4)]
        slave, master = shuffle(grid(places, places)), shuffle(grid(below, below))
        cases.append(replace(flat_face_state(name, slave, master, depth), penalty=penalty))
    return tuple(cases)


@cache
def search_face_states() -> tuple[Case, ...]:
    """Return states on which a search is known to go wrong: something else is near the flat part, or faces are many.

    Many faces are numbered at random, as a mesh generator may do.
    """
    big, cells = grid([0.0, 8.0], [0.0, 8.0]), grid([0.0, 2.5, 5.0, 8.0], [0.0, 4.0, 8.0])
    slave, beside = grid([3.0, 3.5, 4.0], [3.0, 3.5, 4.0]), grid([1.0, 2.0, 3.5], [2.0, 4.0, 4.5])
    lower = grid([-1.0, 3.5, 9.0], [-1.0, 3.5, 9.0], -0.75)
    many = shuffle(grid([-0.5 + 0.75 * i for i in range(12)], [-0.25 + 0.75 * i for i in range(13)]))
    states = {
        "nearest node not on the nearest face": (slave, plate(big, 0.5, (3.5, 3.5))),
        "a thin plate": (beside, plate(cells, 0.125, (3.0, 3.0))),
        "master angle of 37°": (beside, wedge(0.75)),
        "master angle of 14°": (beside, wedge(0.25)),
        "a second body behind the first": (beside, plate(cells, 0.5, (3.0, 3.0)) + lower),
        "264 master faces": (shuffle(grid([0.0, 1.0, 3.0, 5.0, 7.5], [0.0, 2.5, 4.0, 7.0])), many),
    }
    return tuple(
        flat_face_state(f"{name}{label}", here, master, 2.0**-5, turn=turn)
        for (name, (here, master)), (label, turn) in product(states.items(), _TURNS.items())
    )


@cache
def touching_face_states() -> tuple[Case, ...]:
    """Return states that touch exactly at some 160 rotations, and states with a gap of ±1e-16 at a tenth of them.

    The parameters are those of `flat_face_state` and `shift`, the gap before it is stored, a length. Nodes over nodes
    and edges are among them.
    """
    parts = range(-3, 4)
    turns = [(a, b, c, d) for a, b, c, d in product((1, 2), parts, parts, parts) if np.gcd.reduce([a, b, c, d]) == 1]
    turns = turns[:: len(turns) // 150]
    slave = grid([0.25, 1.0, 1.375], [0.25, 1.0, 1.5])
    master = grid([0.0, 0.5, 1.0, 1.75], [0.0, 1.0, 1.75])
    cases = []
    for shift, turn in [(0.0, turn) for turn in turns] + list(product((1e-16, -1e-16), turns[::10])):
        case = flat_face_state(f"gap {shift:g}, turned by {turn}", slave, master, 0.0, turn=turn)
        moved = case.positions.copy()
        moved[: len(slave.points)] += shift * case.parameters["normal"]
        parameters = {**case.parameters, "shift": np.array(shift)}
        cases.append(replace(case, z=moved.reshape(-1), parameters=parameters))
    return tuple(cases)
