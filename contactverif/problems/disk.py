"""Example 2 of the reference paper: an elastic disk pressed on an elastic foundation, a contact that has an edge.

The paper states: R = 10, E = 1e8 and ν = 0 of the disk, a concentrated force 1e6 on its top, E = 1e9 of the foundation,
its 160 × 30 elements, a "very fine mesh close to the contact zone", and ε̂ = 1e9.

Assumptions: plane strain (with ν = 0 there is no other); the whole disk, which moves up and down only on its axis; the
foundation 2R wide and R deep, clamped below, free at its sides. With the half-width a = 0.374 of the contact after
Hertz, 61 elements of the foundation are equally wide over |x| ≤ 1.6 a = 0.6, and the segments of the disk are equally
long over |x| ≤ 2 a: five of the foundation's for four of the disk's, so that the meshes do not match. Contact starts
open, and without contact nothing holds the disk; so the first guess lowers it.

Rule for the next editor: the middle of an element of the foundation, not a node, lies in the middle of the contact. The
force of a node-to-segment formulation jumps at a slave node that symmetry keeps on a master node.

Source: Zavarise & De Lorenzis, IJNME 79 (2009) 379–416, Section 7.2.
"""

from dataclasses import dataclass, replace
from math import asin, atan, expm1, pi, tan

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.body import Body
from contactverif.contract.errors import MisuseError
from contactverif.mechanics.bodies import Rectangle, block, grid_cells
from contactverif.mechanics.scene import Scene
from contactverif.problems.hertz import LinePressure, half_width, layer_half_width, solve_winkler_contact

# Lengths in half-widths of the contact after Hertz.
UNIFORM = 1.6  # The foundation's elements are equally wide up to this distance from the middle.
FINE = 2.0  # The disk's segments are equally long up to this distance; they are its contact boundary.
REACH = 2.5  # The foundation's contact boundary ends at this distance.

# The numbers of elements of the foundation: in the uniform part (and one more), on either side of it (and one less),
# and in depth.
ELEMENTS = (60, 50, 30)
# The numbers of segments of the disk: in the fine part, in a quarter of the disk beside it, and in layers.
SEGMENTS = (60, 20, 18)
WIDEST = 0.9  # The largest share of the disk's contact boundary that may be in contact.
SLOPES = (5e-3, 0.2)  # The range of a/R that the meshes are made for. Hertz' answer holds for small ones.
_SQUARE = 0.45  # Half the side of the square in the middle of the unit disk that the mesh is drawn in.
_CORNER = pi / 4  # The blocks below, above, left and right of that square see it under twice this angle.


@dataclass(frozen=True, slots=True)
class DiskProblem:
    """The data of a disk that is pressed on a foundation; by default the paper's."""

    radius: float = 10.0  # The radius R of the disk, a length.
    young: tuple[float, float] = (1e8, 1e9)  # Young's moduli of disk and foundation, force per length squared.
    poisson: float = 0.0  # Poisson's ratio of both bodies.
    force: float = 1e6  # The force F on top of the disk, per unit of thickness.
    penalty: float = 1e9  # The distributed stiffness ε̂, force per length per length of penetration.
    size: float = 1.0  # The foundation is 2R × size wide and R × size deep.

    @property
    def stiffness(self) -> float:
        """The stiffness E* of both bodies together, 1/E* = Σ (1 − ν²)/E, force per length squared."""
        return 1 / sum((1 - self.poisson**2) / young for young in self.young)

    @property
    def half_width(self) -> float:
        """The half-width of the contact after Hertz, a length."""
        return half_width(self.force, self.radius, self.stiffness)

    def winkler_contact(self) -> LinePressure:
        """Return the contact after Hertz with the penalty as a Winkler layer, to which a penalty method converges."""
        return solve_winkler_contact(self.force, self.radius, self.stiffness, self.penalty)


def disk_on_foundation(
    problem: DiskProblem = DiskProblem(), *, refine: int = 1, lowered: float | None = None, name: str = ""
) -> Scene:
    """Return the scene of the disk (slave) on the foundation (master); they touch in the origin.

    `refine` is the number of parts that each side of each cell is divided into. `lowered` is the depth of the first
    guess; by default a²/2R with the half-width a that Hertz on a Winkler layer has, so that what is in contact hardly
    changes.
    """
    a = problem.half_width
    low, high = SLOPES[0] * problem.radius, SLOPES[1] * problem.radius
    if not low <= a <= high:
        actual = f"{problem.force:g}, with which Hertz' contact is {2 * a:.3g} wide"
        raise MisuseError("force", actual, f"a contact from {2 * low:.3g} to {2 * high:.3g} wide")
    widest = WIDEST * FINE * a
    wide = layer_half_width(problem.force, problem.radius, problem.penalty)
    wide = problem.winkler_contact().half_width if wide <= widest else wide
    if wide > widest:
        actual = f"{problem.penalty:g}, with which the contact is {2 * wide:.3g} wide"
        raise MisuseError("penalty", actual, f"a stiffer one: the meshes are made for at most {2 * widest:.3g}")
    if lowered is None:
        lowered = wide**2 / (2 * problem.radius)
    bodies = disk(problem, refine, lowered), foundation(problem, refine)
    return Scene(bodies, penalty=problem.penalty, name=name)


def foundation(problem: DiskProblem, refine: int = 1) -> Body:
    """Return the foundation, whose surface is y = 0; its contact boundary is |x| ≤ 2.5 a."""
    a, extent = problem.half_width, problem.size * problem.radius  # The extent is half the width, and the depth.
    inner, outer, deep = ELEMENTS
    size = 2 * UNIFORM * a / inner
    middle = (np.arange(inner // 2 * refine + 1) + 0.5) * size / refine
    left, right = (middle[-1] + grade(extent - middle[-1], size, outer, outer * refine - fewer)[1:] for fewer in (0, 1))
    whole = block(
        Rectangle(
            np.concatenate([-left[::-1], -middle[::-1], middle, right]),
            -grade(extent, size, deep, deep * refine)[::-1],
            young=problem.young[1],
            poisson=problem.poisson,
        ),
        contact="top",
        approach=0.0,
        free_sides=True,
        name="master",
    )
    near = np.abs(whole.nodes[whole.contact, 0]).max(axis=1) <= REACH * a
    return replace(whole, contact=whole.contact[near], fixed=np.repeat(whole.fixed[:, 1:], 2, axis=1))


def disk(problem: DiskProblem, refine: int = 1, lowered: float = 0.0) -> Body:
    """Return the disk, which stands on the origin and is loaded on top; its contact boundary is |x| ≤ 2 a."""
    nodes, cells, contact = disk_mesh(problem.radius, FINE * problem.half_width, refine)
    load = np.zeros(nodes.shape)
    load[np.argmax(nodes[:, 1]), 1] = -problem.force
    return Body(
        nodes,
        cells,
        contact,
        problem.young[0],
        problem.poisson,
        fixed=np.column_stack([nodes[:, 0] == 0, np.zeros(len(nodes), bool)]),
        load=load,
        start=np.array([0.0, -lowered]),
        name="slave",
    )


def disk_mesh(radius: float, fine: float, refine: int = 1) -> tuple[FloatArray, IntArray, IntArray]:
    """Return nodes (n_nodes, 2), cells (n_cells, 4) and contact edges (n_segments, 2) of a disk on the origin.

    A square in the middle of the unit disk and four blocks around it, pulled towards the lowest point by the conformal
    map z → (z − iα) / (1 + iαz). That keeps angles, so that cells are as well shaped as where the mesh is even, and as
    large as they are far from the contact. Segments within |x| ≤ fine are equally long, and are the contact edges.
    """
    columns, rows, _ = (count * refine for count in SEGMENTS)
    arc = asin(fine / radius)
    shrink = tan(arc / 2) / tan(_CORNER / 2)  # The factor of lengths at the lowest point, (1 − α)/(1 + α).
    rest = pi - 2 * atan(shrink / tan(_CORNER / 2))  # The angle of the circle above the square, to either side.
    below, above = (  # Angles from the lowest and the highest point, before the map.
        _mirror(2 * np.arctan(factor * np.tan(np.linspace(0, angle, columns // 2 + 1) / 2)))
        for factor, angle in ((1 / shrink, arc), (shrink, rest))
    )
    beside = _mirror(np.linspace(0, _CORNER, rows // 2 + 1))
    points, cells, lowest = _unit_disk(below, beside, above, refine)
    pull, z = (1 - shrink) / (1 + shrink), points @ np.array([1, 1j])
    pulled = (z - 1j * pull) / (1 + 1j * pull * z)
    nodes = radius * np.column_stack([pulled.real, pulled.imag + 1])
    return nodes, cells, np.column_stack([lowest[:-1], lowest[1:]])


def _unit_disk(
    below: FloatArray, beside: FloatArray, above: FloatArray, refine: int
) -> tuple[FloatArray, IntArray, IntArray]:
    """Return nodes, cells, and the nodes of the lower quarter of the circle from left to right.

    `below`, `beside` and `above` are angles from −π/4 to π/4 from the directions down, right (and left), and up.
    """
    up = beside[:, None] / _CORNER  # (n_rows, 1), −1 … 1
    across = ((1 - up) * below + (1 + up) * above) / (2 * _CORNER)  # (n_rows, n_columns)
    number = np.arange(across.size).reshape(across.shape)
    square = _SQUARE * np.column_stack([across.ravel(), np.broadcast_to(up, across.shape).ravel()])
    walk = np.concatenate([number[0, :-1], number[:-1, -1], number[-1, :0:-1], number[:0:-1, 0]])  # around it
    sides = ((below, 0, -1), (beside, 1, 0), (above, 0, 1), (beside, -1, 0))
    circle = np.vstack(
        [
            np.column_stack([x * np.cos(angles) - y * np.sin(angles), y * np.cos(angles) + x * np.sin(angles)])[:-1]
            for angles, x, y in sides
        ]
    )
    first, room = 2 * _CORNER / SEGMENTS[0], 1 - _SQUARE  # a layer at the contact, as thick as a segment is long
    outwards = 1 - grade(room, first, SEGMENTS[2], SEGMENTS[2] * refine)[-2::-1, None, None] / room
    rings = square[walk] + outwards * (circle - square[walk])  # (n_layers, n_around, 2)
    loops = np.vstack([walk, len(square) + np.arange(rings[..., 0].size).reshape(len(rings), -1)])
    following = np.roll(loops, -1, axis=1)
    around = np.stack([loops[:-1], loops[1:], following[1:], following[:-1]], axis=-1)
    cells = np.concatenate([grid_cells(number), around.reshape(-1, 4)])
    return np.vstack([square, rings.reshape(-1, 2)]), cells, loops[-1, : len(below)]


def grade(length: float, first: float, parts: int, steps: int) -> FloatArray:
    """Return ascending coordinates (steps + 1,) from 0 to the length, each step longer than the one before.

    As many steps as parts begin with one that is `first` long; more or fewer follow the same law.
    """
    if not first * parts < length:
        raise MisuseError("graded: length", f"{length:g}", f"more than {parts} parts of {first:g}")

    from scipy.optimize import brentq  # It takes long to import, and the first rows of a run do not need it.

    # The parts grow by e^growth from first to last. expm1 overflows beyond 709.
    growth = brentq(lambda growth: length * expm1(growth / parts) / expm1(growth) - first, 1e-9, 700.0)
    return np.asarray(length * np.expm1(growth * (np.arange(steps + 1) / steps)) / expm1(growth))


def _mirror(half: FloatArray) -> FloatArray:
    """Return −half backwards, then half, which begins with 0; the result is symmetrical to the last bit."""
    return np.concatenate([-half[:0:-1], half])
