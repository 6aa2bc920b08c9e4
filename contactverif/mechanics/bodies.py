"""Bodies: a rectangle of quadrilaterals, a rigid surface, and a mesh of scikit-fem with named boundaries.

`Body` checks whatever can be wrong with a body; what is lost once it is made is checked here, by the name of the
argument.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
import skfem
from numpy.typing import ArrayLike

from contactverif.contract.arrays import FloatArray, IntArray, as_floats, freeze
from contactverif.contract.body import Body
from contactverif.contract.errors import MisuseError


@dataclass(frozen=True, slots=True)
class Placing:
    """The place of a drawing: its point (x, y) goes to scale × (x along `axis`, y across it, + `shift`).

    Attributes
    ----------
    axis : tuple[float, float]
        The unit vector that the drawing's x-axis becomes.
    shift : tuple[float, float]
        The translation, in the unit of the drawing.
    scale : float
        The factor of all lengths, applied last.
    """

    axis: tuple[float, float] = (1.0, 0.0)
    shift: tuple[float, float] = (0.0, 0.0)
    scale: float = 1.0

    def place(self, points: FloatArray) -> FloatArray:
        """Return where the points (n, 2) of the drawing lie (n, 2)."""
        cos, sin = self.axis
        rotated = points @ np.array([[cos, sin], [-sin, cos]]) if sin else points * cos
        return (rotated + np.asarray(self.shift, dtype=np.float64)) * self.scale


UPRIGHT = Placing()  # The drawing as it is.


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A rectangle of quadrilaterals and its material.

    Attributes
    ----------
    x, y : ArrayLike, shape (n,)
        The ascending coordinates of the grid lines, a length each; at least two.
    young : float
        Young's modulus E > 0, force per length squared.
    poisson : float
        Poisson's ratio, −1 < ν < 1/2.
    """

    x: ArrayLike
    y: ArrayLike
    young: float = 1.0
    poisson: float = 0.0


def block(
    rectangle: Rectangle,
    *,
    contact: str,
    pressure: float = 0.0,
    approach: float | None = None,
    tilt: float = 0.0,
    lowered: float = 0.0,
    free_sides: bool = False,
    contact_range: tuple[float, float] | None = None,
    placing: Placing = UPRIGHT,
    name: str = "block",
) -> Body:
    """Return a rectangular body that may touch another one at its bottom or its top, and is loaded on the other side.

    Both vertical sides stand on rollers unless they are free. Nodes are numbered row by row, from bottom to top.

    Parameters
    ----------
    rectangle : Rectangle
        Grid lines and material.
    contact : str
        The side that may touch something, "bottom" or "top". The opposite side is loaded or held.
    pressure : float
        The pressure on the opposite side towards the contact, force per length. It also acts on the contact side
        outside `contact_range`.
    approach : float | None
        Displacement of the opposite side towards the contact, a length: 0 holds the side. None leaves it free under
        the pressure.
    tilt : float
        Part of the approach that varies linearly, a length: the last node of the side approaches by so much more than
        the middle, and the first node by so much less.
    lowered : float
        The displacement towards the contact, a length, of all free nodes in the first guess of a solution.
    free_sides : bool
        True leaves the vertical sides free; then only the first node opposite the contact is held from sliding.
    contact_range : tuple[float, float] | None
        The x from which and to which another body presses on the contact side. On the rest of that side the pressure
        acts. None is the whole side.
    placing : Placing
        Rotation, shift and scale; lengths of all other arguments are those before the scale.
    name : str
        The name of the body in messages and drawings.

    Examples
    --------
    A punch under pressure on a base that is held below:

    >>> from contactverif import Rectangle, Scene, block
    >>> punch = block(Rectangle([0, 1, 2], [0, 1]), contact="bottom", pressure=1.0, name="punch")
    >>> base = block(Rectangle([-1, 1, 3], [-2, 0], young=5.0), contact="top", approach=0.0, name="base")
    >>> scene = Scene((punch, base), penalty=100.0)
    >>> scene.interface.n_slave_nodes, scene.n_free
    (3, 8)
    """
    grid = []
    for word, values in (("x", rectangle.x), ("y", rectangle.y)):
        lines = as_floats(f"{name}: {word}", values, (-1,))
        if len(lines) < 2 or not (np.isfinite(lines).all() and (np.diff(lines) > 0).all()):
            raise MisuseError(f"{name}: {word}", f"{lines.tolist()}", "at least two ascending coordinates")
        grid.append(lines)
    x, y = grid
    axis = as_floats(f"{name}: axis", placing.axis, (2,))
    as_floats(f"{name}: shift", placing.shift, (2,))
    if contact not in ("bottom", "top"):
        raise MisuseError(f"{name}: contact", repr(contact), "'bottom' or 'top'")
    number = np.arange(len(y) * len(x)).reshape(len(y), len(x))
    near, far = (number[0], number[-1]) if contact == "bottom" else (number[-1], number[0])
    walk = near if contact == "bottom" else near[::-1]  # The body is on the left.
    towards_contact, scale = -1.0 if contact == "bottom" else 1.0, placing.scale
    nodes = np.empty((number.size, 2))
    nodes[:, 0], nodes[:, 1] = np.tile(x, len(y)), np.repeat(y, len(x))
    fixed, imposed, load = np.zeros(nodes.shape, bool), np.zeros(nodes.shape), np.zeros(nodes.shape)
    fixed[far[0] if free_sides else number[:, [0, -1]], 0] = True
    if approach is not None:
        lean = tilt * (2 * (x - x[0]) / (x[-1] - x[0]) - 1)
        fixed[far, 1], imposed[far, 1] = True, towards_contact * (approach + lean) * scale
    else:
        load[far, 1] = towards_contact * pressure * scale * _weights(x, x[0], x[-1])
    if contact_range is not None and pressure != 0:
        outside = _weights(x, x[0], contact_range[0]) + _weights(x, contact_range[1], x[-1])
        load[near, 1] -= towards_contact * pressure * scale * outside
    return Body(
        nodes=placing.place(nodes),
        cells=_cells_of_grid(len(y), len(x)),
        contact=np.column_stack([walk[:-1], walk[1:]]),
        young=rectangle.young,
        poisson=rectangle.poisson,
        fixed=fixed,
        imposed=imposed,
        load=load,
        axis=axis,
        start=np.array([0.0, towards_contact * lowered * scale]),
        name=name,
    )


def rigid_surface(
    points: ArrayLike, *, axis: ArrayLike = (1.0, 0.0), displacement: ArrayLike = (0.0, 0.0), name: str = "rigid"
) -> Body:
    """Return a rigid surface, a body without cells.

    Parameters
    ----------
    points : ArrayLike, shape (n, 2)
        The points of the surface in walking order, the body on the left; at least two.
    axis : ArrayLike, shape (2,)
        The unit vector of the body's first axis.
    displacement : ArrayLike, shape (2,)
        The displacement imposed on the surface, a length each, in the body's axes.
    name : str
        The name of the body in messages and drawings.

    Examples
    --------
    >>> from contactverif import rigid_surface
    >>> floor = rigid_surface([[4, 0], [0, 0]], name="floor")
    >>> floor.rigid
    True
    """
    nodes = as_floats(f"{name}: points", points, (-1, 2))
    numbers = np.arange(len(nodes))
    return Body(
        nodes=nodes,
        cells=np.zeros((0, 4), np.int64),
        contact=np.column_stack([numbers[:-1], numbers[1:]]),
        fixed=np.ones(nodes.shape, bool),
        imposed=np.broadcast_to(as_floats(f"{name}: displacement", displacement, (2,)), nodes.shape),
        axis=np.asarray(axis, dtype=np.float64),
        name=name,
    )


@lru_cache(maxsize=256)
def _cells_of_grid(n_rows: int, n_columns: int) -> IntArray:
    return freeze(grid_cells(np.arange(n_rows * n_columns).reshape(n_rows, n_columns)), np.int64)


def grid_cells(number: IntArray) -> IntArray:
    """Return the cells (n_cells, 4) between nodes that are numbered as the array (n_rows, n_columns) says."""
    return np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)


def _weights(x: FloatArray, low: float, high: float) -> FloatArray:
    """Return ∫ N over [low, high] for each grid line (n,): the lengths that a uniform pressure there acts on."""
    weights = np.zeros(len(x))
    a, b = (np.clip(bound, x[:-1], x[1:]) for bound in (low, high))
    lengths = np.diff(x)
    covered = np.where(b > a, b - a, 0.0)
    towards_second = covered * ((a + b) / 2 - x[:-1]) / lengths
    weights[1:] += towards_second
    weights[:-1] += covered - towards_second
    return weights


def body_from_mesh(
    mesh: Any,
    *,
    contact: str,
    supports: Mapping[str, Literal["along", "across", "both"]],
    young: float = 1.0,
    poisson: float = 0.0,
    displacements: Mapping[str, tuple[float, float]] | None = None,
    pressures: Mapping[str, float] | None = None,
    name: str = "mesh",
) -> Body:
    """Return a body from a scikit-fem mesh of first-order triangles or quadrilaterals with named boundaries.

    It has the nodes and cells of the mesh; its axes are x and y.

    Parameters
    ----------
    mesh : skfem.MeshTri or skfem.MeshQuad
        The mesh. ``mesh.with_boundaries({name: function})`` names its boundaries.
    contact : str
        The boundary that may touch something.
    supports : Mapping[str, Literal['along', 'across', 'both']]
        The components that are fixed on each supported boundary: "along" the x-axis, "across" it, or "both".
    young : float
        Young's modulus E > 0, force per length squared.
    poisson : float
        Poisson's ratio, −1 < ν < 1/2.
    displacements : Mapping[str, tuple[float, float]] | None
        The displacement (along, across), a length each, of each supported boundary that moves.
    pressures : Mapping[str, float] | None
        The pressure on each loaded boundary, force per length, positive towards the body.
    name : str
        The name of the body in messages and drawings.

    Raises
    ------
    MisuseError
        If the mesh has no such boundary, a displacement is imposed where nothing is fixed, or as `Body` does.

    Examples
    --------
    >>> import numpy as np, skfem
    >>> from contactverif import body_from_mesh
    >>> mesh = skfem.MeshTri().refined(2).with_boundaries({"low": lambda x: x[1] == 0, "top": lambda x: x[1] == 1})
    >>> body = body_from_mesh(mesh, contact="low", supports={"top": "both"}, displacements={"top": (0.0, -0.1)})
    >>> len(body.contact), body.fixed.sum()
    (4, np.int64(10))
    """
    if getattr(mesh, "elem", None) not in (skfem.ElementTriP1, skfem.ElementQuad1):
        raise MisuseError("mesh", f"a {type(mesh).__name__}", "a MeshTri or a MeshQuad of first order")
    if not isinstance(supports, Mapping):
        raise MisuseError("supports", f"a {type(supports).__name__}", "{boundary: 'along', 'across' or 'both'}")
    displacements, pressures = displacements or {}, pressures or {}
    points, cells = np.asarray(mesh.p).T, np.asarray(mesh.t).T
    cells = turn_counter_clockwise(points, cells)
    edges = {tag: _edges(mesh, cells, tag) for tag in dict.fromkeys([contact, *supports, *pressures])}
    fixed, imposed, load = np.zeros(points.shape, bool), np.zeros(points.shape), np.zeros(points.shape)
    for tag, direction in supports.items():
        components = {"along": [0], "across": [1], "both": [0, 1]}.get(direction)
        if components is None:
            raise MisuseError(f"supports[{tag!r}]", repr(direction), "'along', 'across' or 'both'")
        displacement = _check_displacement(tag, displacements.get(tag, (0.0, 0.0)), components)
        place = np.unique(edges[tag])[:, None], components
        fixed[place], imposed[place] = True, displacement[components]
    if unsupported := set(displacements) - set(supports):
        needed = "a boundary that supports name"
        raise MisuseError(f"displacements[{min(unsupported)!r}]", "no supports there", needed)
    for tag, pressure in pressures.items():
        if np.ndim(pressure) != 0 or np.asarray(pressure).dtype.kind not in "fiu":
            raise MisuseError(f"pressures[{tag!r}]", repr(pressure), "a number")
        first, second = edges[tag].T
        along = points[second] - points[first]
        for end in (first, second):
            np.add.at(load, end, pressure / 2 * np.column_stack([-along[:, 1], along[:, 0]]))
    return Body(points, cells, edges[contact], young, poisson, fixed, imposed, load, name=name)


def _check_displacement(tag: str, values: Any, components: list[int]) -> FloatArray:
    try:
        displacement = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        displacement = np.zeros(0)
    if displacement.shape != (2,):
        raise MisuseError(f"displacements[{tag!r}]", repr(values), "two numbers, along and across")
    if np.delete(displacement, components).any():
        raise MisuseError(f"displacements[{tag!r}]", "a displacement of a free component", "0 where nothing is fixed")
    return displacement


def turn_counter_clockwise(points: FloatArray, corners: IntArray) -> IntArray:
    """Return the corners of cells (n_cells, n_corners), those of clockwise cells in opposite order."""
    x, y = np.moveaxis(points[corners], -1, 0)
    twice_area = (x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1)
    return np.where(twice_area[:, None] < 0, corners[:, ::-1], corners)


def _edges(mesh: Any, cells: IntArray, tag: str) -> IntArray:
    """Return the edges (n, 2) of a named boundary, each with its cell on the left."""
    tags = getattr(mesh, "boundaries", None) or {}
    if tag not in tags:
        needed = f"one of {', '.join(sorted(tags))}" if tags else "a mesh with named boundaries (mesh.with_boundaries)"
        raise MisuseError("mesh", f"no boundary {tag!r}", needed)
    if not len(tags[tag]):
        raise MisuseError("mesh", f"no edges on boundary {tag!r}", "a boundary that has some")
    wanted = {tuple(sorted(edge)) for edge in np.asarray(mesh.facets).T[np.asarray(tags[tag])].tolist()}
    following = np.roll(cells, -1, axis=1)
    every = np.stack([cells, following], axis=-1).reshape(-1, 2).tolist()
    return np.array([edge for edge in every if tuple(sorted(edge)) in wanted], dtype=np.int64).reshape(-1, 2)
