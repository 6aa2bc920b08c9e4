"""Flat interfaces in 2-D and 3-D, exact in binary: turned, far away, deep, in touch, or misleading a search.

A state is laid out in a frame of its own and turned by a rational rotation, in 2-D by a Pythagorean triple. It becomes
longer by the denominator, so that coordinates of few bits stay exact. What a case says is read off the stored nodes in
rationals: near 1e8 the stored penetration is another one than the penetration that was asked for.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, partial, wraps
from itertools import accumulate, cycle, pairwise, product
from math import cos, ldexp, radians, sin
from operator import mul
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import QUADRILATERAL, TRIANGLE, Interface, Surface
from contactverif.oracle.flat_answers import uniform_pressure_weights, uniform_surface_weights


def collect(make: Callable[[], Iterator[Case]]) -> Callable[[], tuple[Case, ...]]:
    """Return a function that returns the cases of a generator, made once."""

    @cache
    @wraps(make)
    def cases() -> tuple[Case, ...]:
        return tuple(make())

    return cases


def collect_on_faces(make: Callable[[int], Iterator[Case]]) -> Callable[..., tuple[Case, ...]]:
    """Return a function that returns the cases of a generator for each number of corners of a face, made once.

    The generator takes the number. On quadrilaterals, the name of a case says so.
    """

    @cache
    def on_corners(corners: int) -> tuple[Case, ...]:
        ending = "" if corners == TRIANGLE else ", quadrilaterals"
        return tuple(replace(case, name=f"{case.name}{ending}") for case in make(corners))

    @wraps(make)
    def cases(faces: tuple[int, ...] = (TRIANGLE,)) -> tuple[Case, ...]:
        return tuple(case for corners in faces for case in on_corners(corners))

    return cases


Turn = tuple[int, int, int]  # Legs p, q and hypotenuse r: a unit of the frame along the interface becomes (p, q).
UPRIGHT, TURNED, STEEP = (1, 0, 1), (4, 3, 5), (-5, 12, 13)


class Master(NamedTuple):
    """The master in the frame: all its chains, of which one has the flat part that the slave penetrates."""

    points: Sequence[tuple[float, float]]  # The nodes: their places along the flat part and their heights above it.
    segments: Sequence[tuple[int, int]]  # The segments as pairs of nodes, the body on the left.
    flat: Sequence[int]  # The nodes of the flat part, from right to left.


def flat_master(places: Sequence[float]) -> Master:
    """Return a master that is flat from end to end, with nodes at these ascending places."""
    return _chain([(place, 0.0) for place in reversed(places)], range(len(places)))


def _chain(points: Sequence[tuple[float, float]], flat: Sequence[int], *, closed: bool = False) -> Master:
    count = len(points)
    return Master(points, [(node, (node + 1) % count) for node in range(count if closed else count - 1)], flat)


def flat_state(
    name: str,
    slave: Sequence[float],
    master: Master,
    depth: float,
    *,
    turn: Turn = UPRIGHT,
    offset: tuple[float, float] = (0.0, 0.0),
    penalty: float = 16.0,
) -> Case:
    """Return a straight slave that penetrates the flat part of a master by the same depth everywhere.

    Places of the slave's nodes ascend in the frame, whose origin lies at the offset; its lengths become r times as long
    by the turn. The parameters of the case are `penetration`, `along` (n_nodes,), `direction` (2,) and `weights`
    (n_nodes,). A weight is the length that a uniform pressure on the node acts on; it is 0 off the flat part.
    """
    p, q, r = turn

    def place(points: Sequence[tuple[float, float]]) -> FloatArray:
        along, heights = np.array(points, dtype=np.float64).T
        return np.column_stack([offset[0] + (along * p - heights * q), offset[1] + (along * q + heights * p)])

    count, master_nodes = len(slave), place(master.points)
    slave_segments = np.array([(node, node + 1) for node in range(count - 1)])
    reference = np.vstack([place([(x, 0.0) for x in slave]), master_nodes])
    interface = Interface(reference, Surface(slave_segments), Surface(np.array(master.segments) + count))
    nodes = np.vstack([place([(x, -depth) for x in slave]), master_nodes])
    along, heights = zip(*read_frame(nodes, [(p, q), (-q, p)], r, nodes[count + master.flat[0]]), strict=True)
    flat = [*range(count), *(count + node for node in master.flat)]
    floats, weights = np.array(along, dtype=np.float64), np.zeros(len(nodes))
    line = np.column_stack([floats[flat], np.zeros(len(flat))])
    weights[flat] = uniform_pressure_weights(Interface.from_chains(line[:count], line[count:]), line[:, 0])
    parameters = {
        "penetration": np.array(float(-heights[0])),
        "along": floats,
        "direction": np.array([p, q]) / r,
        "weights": weights,
    }
    return Case(interface, nodes.reshape(-1), penalty, parameters, name=name)


def overhangs(case: Case) -> bool:
    """Return whether the slave of a flat case extends beyond its master at either end."""
    slave, master = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    return bool(slave.min() < master.min() or slave.max() > master.max())


def read_frame(nodes: FloatArray, axes: Sequence[Sequence[int]], size: int, origin: FloatArray) -> list[list[Fraction]]:
    """Return the exact places of nodes (n, dim) along axes of integers, as lengths from a point; `size` is theirs."""
    steps = [[Fraction(a) - Fraction(b) for a, b in zip(node, origin.tolist(), strict=True)] for node in nodes.tolist()]
    return [[sum(map(mul, step, axis), Fraction(0)) / size for axis in axes] for step in steps]


_TURNS = {"": UPRIGHT, ", turned 3-4-5": TURNED, ", turned 5-12-13": STEEP}
_TWO_TURNS = {"": UPRIGHT, ", turned 3-4-5": TURNED}
_OFFSETS = (("1e6, gap 1e-6", 1e6, 2.0**-20), ("2^10, gap 1e-9", 2.0**10, 2.0**-30), ("1e8, gap 1e-6", 1e8, 2.0**-20))
_DEPTHS = {"h/2": 0.5, "2h": 2.0}
_TINY = 1.2e-5  # The length of the shortest segment in an interface of length 12.
TINY_MESHES: dict[str, tuple[list[float], list[float]]] = {
    "slave": ([0, 2, 4, 4 + _TINY, 8, 12], [0, 3, 6, 9, 12]),
    "master": ([0, 2, 4, 8, 12], [0, 3, 6, 6 + _TINY, 9, 12]),
    "both": ([0, 2, 6, 6 + _TINY, 12], [0, 3, 6 - _TINY / 2, 6 + _TINY / 2, 12]),
    "end": ([_TINY, 2 * _TINY, 4, 8, 12], [0, _TINY, 5, 12]),
}
TINY_PENALTIES = (1.0, 1e4, 1e8)


@collect
def tiny_segment_states() -> Iterator[Case]:
    """Return flat states of length 12 with a segment of 1.2e-5 on a side or both, at three penalties."""
    for (side, (slave, master)), penalty in product(TINY_MESHES.items(), TINY_PENALTIES):
        yield flat_state(f"{side}, ε̂ = {penalty:g}", slave, flat_master(master), 2.0**-4, penalty=penalty)


@collect
def offset_states() -> Iterator[Case]:
    """Return flat states whose distance from the origin is 1e9 to 1e15 times their penetration.

    Lengths are near 1. Near 1e8 neighbouring doubles are 1.5e-8 apart, so that the smallest penetration there is one
    such step.
    """
    slave, master = [0.25, 1.375, 1.625, 3.0], flat_master([-0.5, 0.875, 1.75, 2.5, 3.5])
    for (label, offset, depth), (turn_label, turn), (side, ratio) in product(
        _OFFSETS, _TURNS.items(), (("", 1.0), (", below", -0.5))
    ):
        depth = depth if turn is UPRIGHT else depth / 4
        name, place = f"{label}{turn_label}{side}", (offset, ratio * offset)
        yield flat_state(name, slave, master, depth, turn=turn, offset=place)
    # The stored gap is one step of the doubles there, 1.49e-8, and not the 2e-8 that is asked for.
    yield flat_state("1e8, gap of one step", slave, master, 2e-8, offset=(1e8, 1e8))
    yield flat_state("1e6, gap 1e-6 in decimals", slave, master, 1e-6, offset=(1e6, 1e6))


@collect
def deep_states() -> Iterator[Case]:
    """Return flat states that penetrate by half a segment and by two segments."""
    slave, master = [2.0, 3.0, 4.25, 5.0], flat_master([-1.0, 0.0, 1.0, 2.5, 3.0, 4.0, 5.5, 6.0, 7.0, 8.0])
    for (depth, share), (label, turn) in product(_DEPTHS.items(), _TURNS.items()):
        yield flat_state(f"{depth}{label}", slave, master, share, turn=turn)


@collect
def node_hit_states() -> Iterator[Case]:
    """Return flat states in which a slave node or a quarter point is over a master node, or beside it.

    First by a rounding, so that ξ is 0, 1, −u or 1 + u of the master segments there; then by each power of two of a
    segment, so that two segments overlap on a strip of any width.
    """
    steps = {"on it": 0.0, "one rounding left": -1.0, "one rounding right": 1.0}
    slave, spots = [0.0, 1.0, 2.0], {"slave node": 1.0, "quarter point": 1.25, "middle": 1.5}
    for (place, x), (label, step), (turn_label, turn) in product(spots.items(), steps.items(), _TWO_TURNS.items()):
        rounding = 2.0**-52 if turn is UPRIGHT else 2.0**-50  # Turned nodes have two bits more.
        master = flat_master([-1.0, x + step * rounding, 3.0])
        yield flat_state(f"{place} {label}{turn_label}", slave, master, 2.0**-4, turn=turn)
    for exponent, (place, x) in zip(range(3, 50), cycle(spots.items()), strict=False):
        turn_label, turn = [*_TWO_TURNS.items()][exponent // 3 % 2]
        label, step = (("left", -1.0), ("right", 1.0))[exponent // 6 % 2]
        master = flat_master([-1.0, x + step * 2.0**-exponent, 3.0])
        yield flat_state(f"{place} 2^-{exponent} {label}{turn_label}", slave, master, 2.0**-4, turn=turn)


_EIGHT = (1.0, 0.75, 1.25, 1.0, 0.5, 1.5, 1.25, 0.75), (0.75, 1.25, 1.5, 0.875, 1.25, 0.875, 0.5, 1.0)
# So many of these make more segments than a number of one byte tells apart, or more than 1024, and pairs of them more
# than one of two bytes.
MANY_EIGHTS, MOST_EIGHTS = 38, 129


@collect
def equal_length_states() -> Iterator[Case]:
    """Return flat states whose slave and master are equally long, with as many segments of the mean length 1.

    No segment at an end is longer than that, and inner nodes do not face each other. One spring more at each node, or
    one less at an end, is then no more than 1/n of all springs, whatever the unit of the penalty.
    """
    slave, master = _EIGHT
    sixteen, many, most = (
        (slave * count, (master[0] - 0.125, *master[1:], *master * (count - 2), master[0] + 0.125, *master[1:]))
        for count in (2, MANY_EIGHTS, MOST_EIGHTS)
    )
    for name, (lengths, opposite), depth, turn, penalty in (
        ("8 segments", _EIGHT, 2.0**-4, UPRIGHT, 16.0),
        ("8 segments, upright, soft and shallow", _EIGHT, 2.0**-12, (0, 1, 1), 2.0**-4),
        ("16 segments, stiff", sixteen, 2.0**-4, UPRIGHT, 2.0**20),
        (f"{8 * MANY_EIGHTS} segments", many, 2.0**-4, UPRIGHT, 16.0),
        (f"{8 * MOST_EIGHTS} segments", most, 2.0**-4, UPRIGHT, 16.0),
    ):
        places, below = ([*accumulate(each, initial=0.0)] for each in (lengths, opposite))
        yield flat_state(name, places, flat_master(below), depth, turn=turn, penalty=penalty)


@collect
def search_states() -> Iterator[Case]:
    """Return states on which a search is known to go wrong: the flat part is right, and something else is near."""
    plate = [8.0, 5.0, 2.5, 0.0]
    first, second = _plate(plate, [0.0, 3.0, 8.0], 0.5), [(9.0, -0.75), (3.5, -0.75), (-1.0, -0.75)]
    count = len(first.points)
    behind = [(count, count + 1), (count + 1, count + 2)]
    wedges = {
        angle: _chain([(8.0, 0.0), (4.0, 0.0), (0.0, 0.0), (4.0, -4 * slope), (8.0, -8 * slope)], range(3))
        for angle, slope in (("37°", 0.75), ("14°", 0.25))
    }
    masters = {
        "nearest node not on the nearest segment": ([3.0, 3.5, 4.0], _plate([8.0, 0.0], [0.0, 3.5, 8.0], 0.5)),
        "a thin plate": ([2.0, 3.0, 4.5], _plate(plate, [0.0, 3.0, 8.0], 0.125)),
        "master angle of 37°": ([0.5, 1.0, 2.0, 3.0], wedges["37°"]),
        "master angle of 14°": ([1.0, 2.0, 3.0, 3.5], wedges["14°"]),
        "a second body behind the first": (
            [2.0, 3.0, 4.5],
            Master([*first.points, *second], [*first.segments, *behind], first.flat),
        ),
        "a seam under a segment": ([2.0, 3.0, 6.0], _plate(plate, [0.0, 8.0], 2.0, seam=2)),
        "a seam at a node": ([2.0, 5.0, 6.0], _plate(plate, [0.0, 8.0], 2.0, seam=1)),
    }
    for (name, (slave, master)), (label, turn) in product(masters.items(), _TWO_TURNS.items()):
        yield flat_state(f"{name}{label}", slave, master, 2.0**-5, turn=turn)
    for seam in range(len(plate) + 2):
        hole = _plate(plate, [0.0, 8.0], -3.0, seam)  # A plate that is turned inside out.
        yield flat_state(f"in a hole, seam {seam}", [2.0, 3.0, 6.0], hole, 2.0**-5, turn=(UPRIGHT, TURNED)[seam % 2])


def _plate(top: list[float], bottom: list[float], thickness: float, seam: int = 0) -> Master:
    """Return a closed chain: the top from right to left, then the bottom; node 0 is number `seam` of these."""
    points = [(x, 0.0) for x in top] + [(x, -thickness) for x in bottom]
    count = len(points)
    flat = [(node - seam) % count for node in range(len(top))]
    return _chain([*points[seam:], *points[:seam]], flat, closed=True)


_ANGLES_IN_A_CASE = 4
_CASES = 250  # They make 1000 angles.
_SINGLE_ANGLES = 24
_PENALTY = 16.0
# Four pairs of surfaces lie in a row, each within 1° of the direction of the row. So no surface is above or below
# another pair, and a formulation without a search, which takes all that its slave's normal meets for its master, is
# asked about touch alone. Angles are those of integer directions, so that nodes on a line are on it to the last bit.
_SPACING = 4.0  # From one pair of surfaces to the next, more than twice the length of either.
_FINENESS = 2.0**20


@collect
def touching_states() -> Iterator[Case]:
    """Return states that touch exactly at about 1000 angles, four each, and states with a gap of ±1e-16.

    The parameters are `directions` (n_nodes, 2), that of the flat surface of each node, and `shift`, the gap before it
    is stored, a length.
    """
    step = 360 / (_CASES * _ANGLES_IN_A_CASE)
    for number in range(_CASES):
        angles = [step * (number * _ANGLES_IN_A_CASE + index) for index in range(_ANGLES_IN_A_CASE)]
        name = f"gap 0, {angles[0]:.2f}° to {angles[-1]:.2f}°"
        yield _touching(name, angles, 0.0, (0.25, 1.0), (1.75, 1.0, 0.0))
    for shift, number in product((1e-16, -1e-16), range(_SINGLE_ANGLES)):
        angle = 360 / _SINGLE_ANGLES * number + 1
        name = f"gap {shift:g}, {angle:g}°"
        yield _touching(name, [angle], shift, (0.25, 1.0, 1.375), (1.75, 1.0, 0.5, 0.0))


def _touching(
    name: str, angles: list[float], shift: float, slave: tuple[float, ...], master: tuple[float, ...]
) -> Case:
    """Return one pair of surfaces, one node meeting one, for each angle, in a row along the angle in the middle."""
    # Integer directions over a power of two, nearest to the angles; they are nearly unit vectors.
    exact = [[cos(radians(angle)), sin(radians(angle))] for angle in angles]
    along = np.round(np.array(exact) * _FINENESS) / _FINENESS  # (n_angles, 2)
    middle = len(angles) // 2
    origins = _SPACING * (np.arange(len(angles)) - middle)[:, None] * along[middle]
    normals = np.column_stack([-along[:, 1], along[:, 0]])
    sides, surfaces, count = [], [], 0
    for places, lift in ((slave, shift), (master, 0.0)):
        points = origins[:, None] + np.array(places)[:, None] * along[:, None] + lift * normals[:, None]
        number = count + np.arange(points[..., 0].size).reshape(points.shape[:2])
        sides.append(points.reshape(-1, 2))
        surfaces.append(Surface(np.stack([number[:, :-1], number[:, 1:]], axis=-1).reshape(-1, 2)))
        count += number.size
    nodes = np.vstack(sides)
    directions = np.vstack([np.repeat(along, len(places), axis=0) for places in (slave, master)])
    parameters = {"directions": directions, "shift": np.array(shift)}
    return Case(Interface(nodes, *surfaces), nodes.reshape(-1), _PENALTY, parameters, name=name)


Quaternion = tuple[int, int, int, int]
Points = Sequence[Sequence[float]]
Faces = Sequence[Sequence[int]]
LEVEL, BY_THIRDS, BY_SEVENTHS = (1, 0, 0, 0), (1, 1, 1, 0), (1, 2, -1, 1)
_SPACE_TURNS = {"": LEVEL, ", turned by thirds": BY_THIRDS, ", turned by sevenths": BY_SEVENTHS}
_TWO_SPACE_TURNS = {"": LEVEL, ", turned by thirds": BY_THIRDS}
_FACE_PENALTY = 50 / 3  # No number of single precision, in which all penalties of random cases are exact.


@dataclass(frozen=True, slots=True)
class Sheet:
    """Triangles or quadrilaterals, counter-clockwise seen from outside of their body."""

    points: Points  # (x, y, z)
    faces: Faces

    def __add__(self, other: "Sheet") -> "Sheet":
        moved = [[node + len(self.points) for node in face] for face in other.faces]
        return Sheet([*self.points, *other.points], [*self.faces, *moved])


def grid(xs: Sequence[float], ys: Sequence[float], height: float = 0.0, corners: int = TRIANGLE) -> Sheet:
    """Return a grid with nodes at these places.

    Its cells are quadrilaterals, or are cut into triangles along one diagonal and the other in turn.
    """
    rows = len(ys)
    faces = []
    for i, j in product(range(len(xs) - 1), range(rows - 1)):
        a, b, c, d = i * rows + j, (i + 1) * rows + j, (i + 1) * rows + j + 1, i * rows + j + 1
        cut = [[a, b, c], [a, c, d]] if (i + j) % 2 == 0 else [[a, b, d], [b, c, d]]
        faces += [[a, b, c, d]] if corners == QUADRILATERAL else cut
    return Sheet([(x, y, height) for x, y in product(xs, ys)], faces)


def fan(centre: tuple[float, float], low: float, high: float, parts: int = 1, corners: int = TRIANGLE) -> Sheet:
    """Return the square [low, high]² as a fan around a node; each of its sides has so many edges.

    Around a node there are four rectangles, whatever the number of edges.
    """
    if corners == QUADRILATERAL:
        xs, ys = ([low, place, high] for place in centre)
        return grid(xs, ys, corners=corners)
    steps = [low + (high - low) * k / parts for k in range(parts)]
    border = [(x, low) for x in steps] + [(high, y) for y in steps]
    border += [(low + high - x, high) for x in steps] + [(low, low + high - y) for y in steps]
    count = len(border)
    faces = [[0, 1 + k, 1 + (k + 1) % count] for k in range(count)]
    return Sheet([(*centre, 0.0), *((x, y, 0.0) for x, y in border)], faces)


def shuffle(sheet: Sheet) -> Sheet:
    """Return the same faces in a random order, the same at each call."""
    order = np.random.default_rng(len(sheet.faces)).permutation(len(sheet.faces))
    return Sheet(sheet.points, [sheet.faces[k] for k in order])


def plate(top: Sheet, thickness: float, below: tuple[float, float]) -> Sheet:
    """Return a closed plate under a flat sheet; its lower side is a fan around the node `below`.

    Of quadrilaterals, it is the sheet again, a quarter as large around `below`, with a ring of others around it.
    """
    edges = {edge for face in top.faces for edge in zip(face, [*face[1:], face[0]], strict=True)}
    border = {start: end for start, end in edges if (end, start) not in edges}
    loop = [min(border)]
    while (following := border[loop[-1]]) != loop[0]:
        loop.append(following)
    count = len(top.points)
    points = [*top.points, *((*top.points[node][:2], -thickness) for node in loop)]
    under = {node: count + k for k, node in enumerate(loop)}
    faces, sides = [*top.faces], pairwise([*loop, loop[0]])
    if len(top.faces[0]) == QUADRILATERAL:
        for a, b in sides:
            faces += [[b, a, under[a], under[b]], [under[b], under[a], len(points) + a, len(points) + b]]
        faces += [[len(points) + node for node in face[::-1]] for face in top.faces]
        inner = [[(3 * low + place) / 4 for low, place in zip(below, point, strict=False)] for point in top.points]
        return Sheet([*points, *((x, y, -thickness) for x, y in inner)], faces)
    points.append((*below, -thickness))
    for a, b in sides:
        faces += [[b, a, under[a]], [b, under[a], under[b]], [under[b], under[a], len(points) - 1]]
    return Sheet(points, faces)


def wedge(slope: float, corners: int = TRIANGLE) -> Sheet:
    """Return a wedge over [0, 8]² with its edge at x = 0: the upper side is flat, the lower side falls by `slope`."""
    top, rows = grid([0.0, 4.0, 8.0], [0.0, 3.0, 8.0], corners=corners), 3
    # The nodes on the edge, which come first, belong to both sides.
    number = [node if node < rows else node + len(top.points) - rows for node in range(len(top.points))]
    points = [*top.points, *((x, y, -slope * x) for x, y, _ in top.points[rows:])]
    return Sheet(points, [*top.faces, *([number[node] for node in face[::-1]] for face in top.faces)])


def rotation(quaternion: Quaternion) -> tuple[list[list[int]], int]:
    """Return a rotation as integers over one denominator."""
    a, b, c, d = quaternion
    rows = [
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ]
    return rows, a * a + b * b + c * c + d * d


@dataclass(frozen=True, slots=True)
class SpaceMotion:
    """A similarity x → 2^k (Q x + shift). The rotation Q is that of a quaternion of integers.

    A whole one leaves Q undivided, a matrix of integers that stretches too: so it rounds no point of a lattice.
    """

    quaternion: tuple[int, int, int, int] = (1, 0, 0, 0)
    shift: tuple[int, int, int] = (0, 0, 0)  # In units of the lattice.
    exponent: int = 0
    whole: bool = False

    @property
    def scale(self) -> float:
        """The factor of all lengths: 2^k, or an integer × 2^k."""
        return ldexp(float(rotation(self.quaternion)[1] if self.whole else 1), self.exponent)

    @property
    def axes(self) -> FloatArray:
        """The unit vectors (3, 3) that the axes become, as rows."""
        rows, size = rotation(self.quaternion)
        return np.asarray(np.array(rows).T / size)

    @property
    def normal(self) -> FloatArray:
        """The unit vector (3,) that the z-axis becomes."""
        return np.asarray(self.axes[2])

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the points (n, 3), moved; each coordinate is rounded once, from extended precision."""
        rows, size = rotation(self.quaternion)
        turned = points.astype(np.longdouble) @ np.array(rows, dtype=np.longdouble).T
        moved = turned / np.longdouble(1 if self.whole else size) + np.array(self.shift, dtype=np.longdouble)
        return (moved * ldexp(1.0, self.exponent)).astype(np.float64)


AT_REST = SpaceMotion()


def flat_face_state(
    name: str,
    slave: Sheet,
    master: Sheet,
    depth: float,
    *,
    turn: Quaternion = LEVEL,
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
    faces = np.array(master.faces)
    corners = np.array(master.points)[faces]  # (n_faces, n_corners, 3)
    (ax, ay), (bx, by) = (corners[:, end, :2].T - corners[:, 0, :2].T for end in (1, 2))
    flat = faces[(corners[..., 2] == 0).all(axis=1) & (ax * by - ay * bx > 0)]  # In z = 0, and seen from above.
    frame = read_frame(nodes, [*zip(*matrix, strict=True)], size, master_nodes[flat[0, 0]])
    plane = np.array(frame, dtype=np.float64)[:, :2]
    low, high = plane[:count].min(axis=0), plane[:count].max(axis=0)
    of_flat = np.unique(flat)
    counted = np.concatenate([np.arange(count), count + of_flat])
    points, weights = np.column_stack([plane, np.zeros(len(plane))])[counted], np.zeros(len(plane))
    level = Interface.from_faces(points[:count], below, points[count:], np.searchsorted(of_flat, flat))
    domain = [low, [high[0], low[1]], high, [low[0], high[1]]]
    weights[counted] = uniform_surface_weights(level, plane[counted], domain)
    parameters = {
        "penetration": np.array(float(-frame[0][2])),
        "normal": np.array([row[2] / size for row in matrix]),
        "directions": place[:2] / size,
        "weights": weights,
    }
    return Case(interface, nodes.reshape(-1), _FACE_PENALTY, parameters, name=name)


def _sheets(corners: int) -> tuple[Sheet, Sheet]:
    slave, master = ([0.25, 1.375, 3.0], [0.5, 1.75, 2.5]), ([-0.5, 0.875, 1.75, 3.5], [-0.25, 1.0, 2.0, 3.25])
    return grid(*slave, corners=corners), grid(*master, corners=corners)


@collect_on_faces
def node_hit_face_states(corners: int) -> Iterator[Case]:
    """Return flat states in which a node of the master lies under a node, an edge or a centre, or a rounding beside.

    Under a slave node it has four edges, two of which lie under edges of the slave, or 32. In the last states it is the
    slave node that has 32. Quadrilaterals are rectangles, of which four meet.
    """
    slave, below = (grid(places, places, corners=corners) for places in ([0.0, 3.0, 6.0], [-3.0, 3.0, 9.0]))
    places = {"node": (3.0, 3.0, 1), "node, fan of 32": (3.0, 3.0, 8), "edge": (4.5, 3.0, 1)}
    if corners == QUADRILATERAL:
        del places["node, fan of 32"]
    places |= {"diagonal": (1.5, 1.5, 1), "centre": (2.0, 1.0, 1)}
    steps = {"on it": (0, 0), "one rounding left": (-1, 0), "one rounding right": (1, 0), "one rounding up": (0, 1)}
    for (place, (x, y, parts)), (label, step), (turn_label, turn) in product(
        places.items(), steps.items(), _TWO_SPACE_TURNS.items()
    ):
        rounding = 2.0**-50 if turn is LEVEL else 2.0**-47  # Turned nodes have up to three bits more.
        centre = x + step[0] * rounding, y + step[1] * rounding
        pairs = {place: (slave, fan(centre, -3.0, 9.0, parts, corners))}
        if place == "node, fan of 32":
            pairs["slave fan of 32"] = fan(centre, 0.0, 6.0, parts), below
        for name, pair in pairs.items():
            yield flat_face_state(f"{name} {label}{turn_label}", *pair, 2.0**-4, turn=turn)


@collect_on_faces
def offset_face_states(corners: int) -> Iterator[Case]:
    """Return flat states whose distance from the origin is 1e9 to 1e15 times their penetration; lengths are near 1."""
    sheets = _sheets(corners)
    for (label, offset, depth), (turn_label, turn) in product(_OFFSETS, _SPACE_TURNS.items()):
        place = (offset, -offset / 2, offset / 4)
        yield flat_face_state(f"{label}{turn_label}", *sheets, depth, turn=turn, offset=place)
    # The stored gap is one step of the doubles there, 1.49e-8, and not the 2e-8 that is asked for.
    yield flat_face_state("1e8, gap of one step", *sheets, 2e-8, offset=(1e8, 1e8, 1e8))
    yield flat_face_state("1e6, gap 1e-6 in decimals", *sheets, 1e-6, offset=(1e6, 1e6, 1e6))


@collect_on_faces
def deep_face_states(corners: int) -> Iterator[Case]:
    """Return flat states that penetrate by half a length and by two lengths, where edges have about one."""
    for (name, depth), (label, turn) in product(_DEPTHS.items(), _SPACE_TURNS.items()):
        yield flat_face_state(f"{name}{label}", *_sheets(corners), depth, turn=turn)


@collect_on_faces
def equal_area_states(corners: int) -> Iterator[Case]:
    """Return flat states whose slave has as much area as nodes, and a master with as many nodes on that area.

    So it does not matter whether the unit of the penalty is stated, and two passes have twice the springs. The master
    reaches farther by more than a length, and no node of it faces the border of the slave.
    """
    for name, n, depth, penalty in (
        ("25 nodes", 5, 2.0**-4, _FACE_PENALTY),
        ("25 nodes, soft and shallow", 5, 2.0**-12, 2.0**-4),
        ("144 nodes", 12, 2.0**-4, _FACE_PENALTY),
    ):
        places, below = [0.0, *accumulate([1.5, *[1.0] * (n - 3), 1.5])], [-1.375 + k for k in range(n + 4)]
        slave, master = (shuffle(grid(lines, lines, corners=corners)) for lines in (places, below))
        yield replace(flat_face_state(name, slave, master, depth), penalty=penalty)


@collect_on_faces
def search_face_states(corners: int) -> Iterator[Case]:
    """Return states on which a search is known to go wrong: something else is near the flat part, or faces are many.

    Many faces are numbered at random, as a mesh generator may do.
    """
    cut = partial(grid, corners=corners)
    big, cells = cut([0.0, 8.0], [0.0, 8.0]), cut([0.0, 2.5, 5.0, 8.0], [0.0, 4.0, 8.0])
    slave, beside = cut([3.0, 3.5, 4.0], [3.0, 3.5, 4.0]), cut([1.0, 2.0, 3.5], [2.0, 4.0, 4.5])
    lower = cut([-1.0, 3.5, 9.0], [-1.0, 3.5, 9.0], -0.75)
    many = shuffle(cut([-0.5 + 0.75 * i for i in range(12)], [-0.25 + 0.75 * i for i in range(13)]))
    states = {
        "nearest node not on the nearest face": (slave, plate(big, 0.5, (3.5, 3.5))),
        "a thin plate": (beside, plate(cells, 0.125, (3.0, 3.0))),
        "master angle of 37°": (beside, wedge(0.75, corners)),
        "master angle of 14°": (beside, wedge(0.25, corners)),
        "a second body behind the first": (beside, plate(cells, 0.5, (3.0, 3.0)) + lower),
        f"{len(many.faces)} master faces": (shuffle(cut([0.0, 1.0, 3.0, 5.0, 7.5], [0.0, 2.5, 4.0, 7.0])), many),
    }
    for (name, (here, master)), (label, turn) in product(states.items(), _SPACE_TURNS.items()):
        yield flat_face_state(f"{name}{label}", here, master, 2.0**-5, turn=turn)
    few, fine = [3.0, 3.5, 4.25, 4.75], [0.1875 * i - 0.25 for i in range(46)]
    most = shuffle(cut(fine, fine))
    yield flat_face_state(f"{len(most.faces)} master faces", shuffle(cut(few, few)), most, 2.0**-5)


@collect_on_faces
def touching_face_states(corners: int) -> Iterator[Case]:
    """Return states that touch exactly at some 160 rotations, and states with a gap of ±1e-16 at a tenth of them.

    Quadrilaterals do at a quarter of these rotations. The parameters are those of `flat_face_state` and `shift`, the
    gap before it is stored, a length. Nodes over nodes and edges are among them.
    """
    parts = range(-3, 4)
    turns = [(a, b, c, d) for a, b, c, d in product((1, 2), parts, parts, parts) if np.gcd.reduce([a, b, c, d]) == 1]
    turns = turns[:: len(turns) // (150 if corners == TRIANGLE else 40)]
    slave = grid([0.25, 1.0, 1.375], [0.25, 1.0, 1.5], corners=corners)
    master = grid([0.0, 0.5, 1.0, 1.75], [0.0, 1.0, 1.75], corners=corners)
    for shift, turn in [(0.0, turn) for turn in turns] + list(product((1e-16, -1e-16), turns[::10])):
        case = flat_face_state(f"gap {shift:g}, turned by {turn}", slave, master, 0.0, turn=turn)
        moved = case.positions.copy()
        moved[: len(slave.points)] += shift * case.parameters["normal"]
        yield replace(case, z=moved.reshape(-1), parameters={**case.parameters, "shift": np.array(shift)})
