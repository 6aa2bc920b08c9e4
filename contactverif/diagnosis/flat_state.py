"""Flat interfaces, with the exact force of each piece on which two faces meet: three segments on four, and in space.

On one segment a side every place is an end and all ratios are the same. Here no node faces another, the slave ends
inside the master, and no two segments are alike, so that each mistake has a pattern of its own.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import pairwise, product

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE, SEGMENT, TRIANGLE, Interface, Surface
from contactverif.contract.subject import Subject
from contactverif.oracle.flat_answers import cut_polygon, uniform_surface_weights

SLAVE = np.array([0.0, 1.0, 2.25, 3.125])
MASTER = np.array([3.625, 2.625, 1.5, 0.6875, -0.5])  # The master runs the other way.
# Six segments on two, so that some have no node of the master; and one on four, which reaches over whole segments.
FINE = np.array([0.0, 0.5, 1.0, 1.625, 2.0, 2.625, 3.125]), np.array([3.625, 1.25, -0.5])
COARSE = np.array([0.0, 3.125]), MASTER
DEPTH = 2.0**-10  # So small that a slave that is tilted by it is as long as its projection, to 5e-7.
PENALTY = 2.0**10
# Two sizes are the same within this share of the largest. A tilt of the state by DEPTH changes them by less, and so do
# all roundings, even if forces are summed in single precision.
SAME = 1e-4
_GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)  # Two points integrate cubic functions exactly.


@dataclass(frozen=True, slots=True, eq=False)
class FlatState:
    """A state of the flat interface with its exact forces, piece by piece."""

    case: Case  # Its normal, out of the master, is y, or z.
    pieces: FloatArray  # (n_pieces, n_nodes) The size of the force by which the pressure on a piece pushes each node.
    starts: FloatArray  # (n_pieces,) The place along the interface where a piece begins, and its length.
    lengths: FloatArray
    segments: tuple[IntArray, IntArray]  # (n_pieces,) The segments of slave and master that face each other there.
    ends: tuple[IntArray, IntArray]  # (n_pieces, n_corners) The nodes of these segments.
    n_slave_nodes: int  # The slave nodes come first.
    depth: float = DEPTH  # At slave node 0, or everywhere.

    @property
    def sides(self) -> tuple[slice, slice]:
        """The nodes of the slave, and those of the master."""
        return slice(self.n_slave_nodes), slice(self.n_slave_nodes, None)

    @property
    def in_plane(self) -> bool:
        """True for segments, False for faces in space."""
        return self.case.interface.dim == PLANE

    @property
    def exact(self) -> FloatArray:
        """The exact size (n_nodes,) of the force on each node."""
        exact: FloatArray = self.pieces.sum(axis=0)
        return exact

    @property
    def along(self) -> FloatArray:
        """The places (n_nodes,) of the nodes along the interface."""
        return self.case.positions[:, 0]


def flat_state(
    slope: float = 0.0,
    depth: float = DEPTH,
    places: tuple[FloatArray, FloatArray] = (SLAVE, MASTER),
    depths: FloatArray | None = None,
) -> FlatState:
    """Return the state whose penetration is `depth` (1 + slope x) at the place x along the slave.

    Or the penetrations of the slave's nodes are `depths`, of which no segment has both signs.
    """
    slave, master = places
    depths = depth * (1 + slope * slave) if depths is None else depths
    n_slave, along = len(slave), np.concatenate(places)
    points = np.column_stack([along, np.zeros(len(along))])
    interface = Interface.from_chains(points[:n_slave], points[n_slave:])
    z = points.copy()
    z[:n_slave, 1] = -depths
    case = Case(interface, z.reshape(-1), PENALTY, name="flat")
    low, high = max(slave[0], master[-1]), min(slave[-1], master[0])
    ends = np.unique(along[(along >= low) & (along <= high)])
    middles = (ends[1:] + ends[:-1]) / 2
    segments = np.searchsorted(slave, middles) - 1, len(master) - 1 - np.searchsorted(master[::-1], middles)
    nodes = interface.slave.segments[segments[0]], interface.master.segments[segments[1]]
    pieces = np.zeros((len(middles), len(along)))
    for piece, (first, last) in enumerate(pairwise(ends)):
        for x in (first + last) / 2 + _GAUSS * (last - first) / 2:
            force = PENALTY * max(np.interp(x, slave, depths), 0.0) * (last - first) / 2
            for pair in (side[piece] for side in nodes):
                share = (x - along[pair[0]]) / (along[pair[1]] - along[pair[0]])
                pieces[piece, pair] += force * np.array([1 - share, share])
    return FlatState(case, pieces, ends[:-1], np.diff(ends), segments, nodes, n_slave, depth)


@cache
def flat_state_of(corners: int, depth: float = DEPTH) -> FlatState:
    """Return a uniform state of segments, or of faces: a slave of 2 × 2 cells inside a master of 3 × 2."""
    if corners == SEGMENT:
        return flat_state(depth=depth)
    upper, slave = grid(corners, np.array([0.0, 1.0, 2.25]), np.array([0.0, 1.25, 2.0]))
    steps = np.array([-0.75, 0.3125, 1.5, 3.5]), np.array([-0.375, 0.875, 2.25])
    lower, master = grid(corners, *steps, shear=-0.125)
    nodes, n_slave = np.vstack([upper, lower]), len(upper)
    interface = Interface(nodes, Surface(slave[:, ::-1]), Surface(master + n_slave))
    places = [(Fraction(x), Fraction(y)) for x, y in nodes[:, :2].tolist()]
    pieces, areas, numbers = [], [], []
    for (a, above), (b, below) in product(enumerate(slave), enumerate(master + n_slave)):
        part = cut_polygon(*([places[node] for node in face] for face in (above, below)))
        if len(part) >= TRIANGLE:
            weights = uniform_surface_weights(interface, nodes[:, :2], np.array(part, np.float64))
            pieces.append(PENALTY * max(depth, 0.0) * weights)
            areas.append(weights[:n_slave].sum())
            numbers.append((a, b))
    of_slave, of_master = np.array(numbers).T
    z = nodes - np.where(np.arange(len(nodes)) < n_slave, depth, 0.0)[:, None] * [0.0, 0.0, 1.0]
    ends = interface.slave.faces[of_slave], interface.master.faces[of_master]
    case, starts = Case(interface, z.reshape(-1), PENALTY, name="flat"), np.zeros(len(areas))
    return FlatState(case, np.array(pieces), starts, np.array(areas), (of_slave, of_master), ends, n_slave, depth)


def grid(corners: int, *steps: FloatArray, shear: float = 0.25) -> tuple[FloatArray, IntArray]:
    """Return points (n, dim) of a flat surface with cells between steps along its axes, and faces as a master has them.

    Quadrilaterals are parallelograms: there all rules of integration agree.
    """
    if corners == SEGMENT:
        x, numbers = steps[0][::-1], np.arange(len(steps[0]))
        return np.column_stack([x, 0 * x]), np.column_stack([numbers[:-1], numbers[1:]])
    points = np.array([[x + shear * y, y, 0.0] for y, x in product(steps[1], steps[0])])
    n = len(steps[0])
    faces: IntArray = np.arange(len(points)).reshape(-1, n)[:-1, :-1].reshape(-1, 1) + np.array([0, 1, n + 1, n])
    return points, faces[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3) if corners == TRIANGLE else faces


def residual_of(subject: Subject, interface: Interface, z: FloatArray, pressure: float = 0.0) -> FloatArray:
    """Return the residual with the penalty of the flat states; all multipliers, if there are any, have a pressure."""
    formulation = subject.for_interface(interface, PENALTY)
    z = np.append(z, np.full(formulation.n_multipliers(interface), pressure))
    return formulation.residual(interface, formulation.pair(interface, z), z)


def pushes_of(subject: Subject, state: FlatState) -> FloatArray:
    """Return the forces (n_nodes, dim) that push the surfaces apart: positive along the last axis if all is right."""
    forces: FloatArray = -residual_of(subject, state.case.interface, state.case.z).reshape(state.case.positions.shape)
    sides = np.where(np.arange(len(forces)) < state.n_slave_nodes, 1.0, -1.0)
    return forces * sides[:, None]


def equal(a: FloatArray, b: FloatArray) -> BoolArray:
    """Return which numbers are the same, over the largest of the second list."""
    result: BoolArray = np.abs(a - b) <= SAME * np.abs(b).max()
    return result


def same(a: FloatArray, b: FloatArray) -> bool:
    """Return whether all numbers are the same, over the largest of the second list."""
    return bool(equal(a, b).all())


def spell(name: str, numbers: Iterable[object]) -> str:
    """Return what has these numbers, in words: `slave node 1`, or `slave nodes 1, 2`."""
    words = [*map(str, numbers)]
    return f"{name}{'s' * (len(words) > 1)} {', '.join(words)}"
