"""Cases with a name: those of the reference paper, and witnesses of what a formulation says it does not do.

Source: Zavarise & De Lorenzis (2009). In a1 to c-prime the penetration is uniform and ε̂ |g| = 1, so that nodal forces
are the paper's. The paper prints no dimensions of A2; its lengths here are ours. In a1-swapped to c-prime-swapped the
lengths of slave and master are exchanged.
"""

from collections.abc import Callable, Sequence
from difflib import get_close_matches
from functools import partial

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import QUADRILATERAL, TRIANGLE, Interface
from contactverif.contract.traits import Traits
from contactverif.problems.open_states import fit_to_traits

_SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
_FIRST_DIAGONAL, _SECOND_DIAGONAL = [[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]
_WITH_MIDDLES = np.vstack([_SQUARE, [[0.5, 0, 0], [0.5, 1, 0]]])  # The nodes of a square that is cut in halves.
_HALVES = [[0, 4, 5, 3], [4, 1, 2, 5]]
_PENETRATION = 2.0**-4


def _squares(corners: int) -> tuple[Interface, FloatArray, FloatArray]:
    """Return a square of two faces over one that is cut otherwise, and the nodes (n, 3) of both."""
    slave = master = _SQUARE
    faces = [_FIRST_DIAGONAL, _SECOND_DIAGONAL]
    if corners == QUADRILATERAL:
        slave, master, faces = _WITH_MIDDLES, _WITH_MIDDLES[:, [1, 0, 2]], [_HALVES, [face[::-1] for face in _HALVES]]
    below = [face[::-1] for face in faces[0]]  # The slave's faces are seen from below.
    return Interface.from_faces(slave, below, master, faces[1]), slave, master


def _cross_cuts(name: str, corners: int) -> Case:
    """Return a square 1/16 deep in another one, cut otherwise, so that their consistent forces are different."""
    interface, slave, master = _squares(corners)
    parameters = {
        "penetration": np.array(_PENETRATION),
        "plane": np.vstack([slave, master])[:, :2],
        "domain": _SQUARE[:, :2],
        "normal": np.array([0.0, 0.0, 1.0]),
    }
    z = np.vstack([slave - [0, 0, _PENETRATION], master]).reshape(-1)
    return Case(interface, z, 1 / _PENETRATION, parameters, name=name)


def _tilt_faces(name: str, corners: int) -> Case:
    """Return a square with slopes of 1/4 and 1/8 that penetrates another one, and overhangs it along its own normal."""
    interface, slave, master = _squares(corners)
    tilted = slave + np.column_stack([np.zeros((len(slave), 2)), slave[:, :2] @ [0.25, 0.125] - 0.5])
    return Case(interface, np.vstack([tilted, master]).reshape(-1), 16.0, name=name)


def _move_diagonals() -> Case:
    """Return crossed-diagonals with the slave moved by 1/4 past the border of the master."""
    case = named_case("crossed-diagonals")
    positions = case.positions + np.outer(np.arange(len(case.positions)) < len(_SQUARE), [0.25, 0.0, 0.0])
    return Case(case.interface, positions.reshape(-1), case.penalty, name="moved-diagonals")


def _slide_faces() -> Case:
    """Return a triangle with a slope of 1/2 below two others; the parameter "path" moves it by 1 over their edge."""
    slave = np.array([[0.5, 0.25, -0.5], [1.5, 0.25, -1.0], [0.5, 1.25, -0.5]])
    master = np.array([[0.0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]])
    interface = Interface.from_faces(slave, [[0, 2, 1]], master, _FIRST_DIAGONAL)
    path = np.outer(np.arange(len(interface.nodes)) < len(slave), [0.0, 1.0, 0.0])
    return Case(interface, interface.nodes.reshape(-1), 16.0, {"path": path.reshape(-1)}, name="sliding-faces")


_LENGTHS: dict[str, tuple[Sequence[float], Sequence[float]]] = {
    "a1": ([2, 2], [4]),
    "a2": ([1, 1, 2, 4], [8]),  # graded, on one rigid segment
    "b": ([2, 2, 4, 4], [3, 3, 4, 2]),
    "c": ([2, 2, 4, 4], [3, 3, 3, 3]),
    "c-prime": ([2, 2, 4, 4], [3, 3, 3.2, 2.8]),  # c without the virtual slave node on a master node
}
_FLAT = _LENGTHS | {f"{name}-swapped": (master, slave) for name, (slave, master) in _LENGTHS.items()}


def named_case(name: str) -> Case:
    """Return the interface state of that name, a case which solves no bodies.

    Parameters
    ----------
    name : str
        One of `NAMED`, such as ``"c"``.

    Raises
    ------
    MisuseError
        If there is no such case; the message suggests the nearest names.
    """
    if name in _FLAT:  # Lengths from left to right; master nodes are numbered from right to left.
        slave_x, master_x = map(_places, _FLAT[name])
        slave, master = _points(slave_x), _points(master_x[::-1])
        parameters = {
            "penetration": np.array(_PENETRATION),
            "along": np.concatenate([slave_x, master_x[::-1]]),
            "direction": np.array([1.0, 0.0]),
        }
        z = np.vstack([_points(slave_x, -_PENETRATION), master]).reshape(-1)
        return Case(Interface.from_chains(slave, master), z, 1 / _PENETRATION, parameters, name=name)
    if name in _OTHERS:
        return _OTHERS[name]()
    near = get_close_matches(name, NAMED, n=3, cutoff=0.4) or NAMED
    raise MisuseError("name", repr(name), f"the name of a case, perhaps {' or '.join(map(repr, near))}")


def _tilt_segment() -> Case:
    """Return one slave segment of length 25/8 at cos θ = 24/25; the areas of both quarter points cover two segments.

    What VTS-PPT as printed transmits lacks 1 − cos θ = 0.04 of the slave force.
    """
    slave = np.array([[0.0, -1.25], [3.0, -0.375]])
    master = _points([5.0, 2.5, 0.5, -2.0])
    interface = Interface.from_chains(np.add(slave, [0.0, 1.25]), master)
    return Case(interface, np.vstack([slave, master]).reshape(-1), 16.0, {"cosine": np.array(0.96)}, name="tilted")


def _offset_case_c() -> Case:
    """Return c-prime off its kinks: moved by 1/14, over a longer master, with a penetration that varies."""
    slave_x = _places([2, 2, 4, 4]) + 1 / 14
    heights = -np.array([5, 7, 4, 6, 3]) / 64 - 1 / 448
    master = _points(_places([3, 3, 3, 3.2, 2.8, 3])[::-1] - 3)
    slave = np.column_stack([slave_x, heights])
    interface = Interface.from_chains(_points(slave_x), master)
    return Case(interface, np.vstack([slave, master]).reshape(-1), 16.0, name="offset-c")


def _moved_case_c() -> Case:
    """Return offset-c on coordinates of 2^-32, with the parameter "shift": a translation that rounds none of them."""
    case = _offset_case_c()
    nodes, z = (np.ldexp(np.round(np.ldexp(values, 32)), -32) for values in (case.interface.nodes, case.z))
    return Case(case.interface.at(nodes), z, case.penalty, {"shift": np.array([2.0**20, -(2.0**20)])}, name="moved")


def _slide_over_vertices() -> Case:
    """Return two slave segments below a zigzag; the parameter "path" moves them by 2, over a vertex and a valley."""
    slave = np.array([[0.0, -0.25], [1.5, -0.375], [3.0, -0.25]])
    master = np.array([[9.0, 0.0], [6.0, 0.5], [4.25, 0.0], [2.25, 0.5], [0.75, 0.0], [-1.0, 0.5], [-4.0, 0.0]])
    path = np.zeros((len(slave) + len(master), 2))
    path[: len(slave), 0] = 2.0
    interface = Interface.from_chains(slave, master)
    nodes = np.vstack([slave, master])
    return Case(interface, nodes.reshape(-1), 16.0, {"path": path.reshape(-1)}, name="sliding")


def _close_peak() -> Case:
    """Return a peak of the master that touches the middle of a slave segment, as `closing_cases` describes it."""
    slave, master = [[-4, 1], [-2, 0], [2, 0], [4, 1]], [[4, -2], [0, 0], [-4, -2]]
    numbers = {"penetration": 0, "direction": [1, 0], "room": 2, "closing": [5, 2, 1]}
    parameters = {name: np.array(values, dtype=np.float64) for name, values in numbers.items()}
    z = np.array(slave + master, dtype=np.float64).reshape(-1)
    return Case(Interface.from_chains(slave, master), z, 16.0, parameters, name="peak")


def _end_openly() -> Case:
    """Return a slave segment over a master that ends under its middle; the gap is open and grows inwards."""
    interface = Interface.from_chains([(0.0, 0.0), (1.0, 0.0)], [(1.5, -0.5), (0.5, -0.02)])
    return Case(interface, interface.nodes.reshape(-1), 16.0, name="open-end")


def _places(lengths: Sequence[float]) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(lengths)])


def _points(x: Sequence[float] | FloatArray, height: float = 0.0) -> FloatArray:
    return np.column_stack([x, np.full(len(x), height)])


_OTHERS: dict[str, Callable[[], Case]] = {
    "tilted": _tilt_segment,
    "offset-c": _offset_case_c,
    "moved": _moved_case_c,
    "sliding": _slide_over_vertices,
    "peak": _close_peak,
    "open-end": _end_openly,
    "crossed-diagonals": partial(_cross_cuts, "crossed-diagonals", TRIANGLE),
    "tilted-faces": partial(_tilt_faces, "tilted-faces", TRIANGLE),
    "crossed-halves": partial(_cross_cuts, "crossed-halves", QUADRILATERAL),
    "moved-diagonals": _move_diagonals,
    "sliding-faces": _slide_faces,
    "tilted-halves": partial(_tilt_faces, "tilted-halves", QUADRILATERAL),
}
FLAT_NAMES: tuple[str, ...] = tuple(_FLAT)
NAMED: tuple[str, ...] = (*FLAT_NAMES, *_OTHERS)
FLAT_IN_SPACE = {TRIANGLE: "crossed-diagonals", QUADRILATERAL: "crossed-halves"}  # They penetrate uniformly.
_TILTED_IN_SPACE = {TRIANGLE: "tilted-faces", QUADRILATERAL: "tilted-halves"}
# Its lengths of 3.2 and 2.8 are rounded: on A1 single precision makes no error.
_FIRST = "c-prime"


def flat_in_space(traits: Traits) -> str:
    """Return the name of a flat interface in space that penetrates uniformly, of faces that a formulation takes."""
    return FLAT_IN_SPACE[min(traits.abilities.faces)]


def tilted_in_space(faces: tuple[int, ...] = (TRIANGLE,)) -> tuple[Case, ...]:
    """Return a tilted square over a square for each number of corners that a face may have."""
    return tuple(named_case(_TILTED_IN_SPACE[corners]) for corners in faces)


def first_state(traits: Traits) -> tuple[Case, str]:
    """Return the state of the first answers of a process, and why a formulation takes it not, or an empty string."""
    return fit_to_traits(named_case(_FIRST if traits.abilities.in_plane else flat_in_space(traits)), traits)
