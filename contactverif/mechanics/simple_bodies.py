"""Bodies that need no mesh generator: a rectangle of quadrilaterals, and a rigid surface.

Both are drawn upright, in a plane of their own, and then placed: rotated, shifted and scaled. Rule for the next editor:
`Body` checks whatever can be wrong with a body. This file checks grid lines and what is lost once the body is made.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
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

    Both vertical sides stand on rollers unless they are free.

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

    Returns
    -------
    Body
        The block; its nodes are numbered row by row, from bottom to top.

    Raises
    ------
    MisuseError
        If grid lines do not ascend, or as `Body` does.

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
    x, y = _grid_lines(f"{name}: x", rectangle.x), _grid_lines(f"{name}: y", rectangle.y)
    axis = as_floats(f"{name}: axis", placing.axis, (2,))
    as_floats(f"{name}: shift", placing.shift, (2,))
    if contact not in ("bottom", "top"):
        raise MisuseError(f"{name}: contact", repr(contact), "'bottom' or 'top'")
    number = _node_numbers(len(y), len(x))
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
    """Return a rigid surface.

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

    Returns
    -------
    Body
        A body without cells.

    Raises
    ------
    MisuseError
        If the points form no surface, or as `Body` does.

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


def _grid_lines(argument: str, values: ArrayLike) -> FloatArray:
    """Return ascending coordinates (n,) as floats, checked."""
    coordinates = as_floats(argument, values, (-1,))
    if len(coordinates) < 2 or not (np.isfinite(coordinates).all() and (np.diff(coordinates) > 0).all()):
        raise MisuseError(argument, f"{coordinates.tolist()}", "at least two ascending coordinates")
    return coordinates


def _node_numbers(n_rows: int, n_columns: int) -> IntArray:
    """Return the numbers of the nodes of a rectangle (n_rows, n_columns), row by row."""
    return np.arange(n_rows * n_columns).reshape(n_rows, n_columns)


@lru_cache(maxsize=256)
def _cells_of_grid(n_rows: int, n_columns: int) -> IntArray:
    """Return the cells (n_cells, 4) of a rectangle with so many rows and columns of nodes."""
    return freeze(grid_cells(_node_numbers(n_rows, n_columns)), np.int64)


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
