"""An elastic body as data: mesh, material, supports, loads, and the part of its boundary that may touch something.

What is wrong with a body is said here, once; what a body does under load is in `bulk`. Vectors of supports and loads
are in the body's own axes, so that a roller on an inclined side is a fixed component like any other.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray, freeze
from contactverif.contract.errors import MisuseError

_CORNERS = (3, 4)  # nodes of a cell: triangles or quadrilaterals


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A linear elastic body in plane strain; without cells it is rigid, and every node is a boundary condition.

    Attributes
    ----------
    nodes : FloatArray, shape (n_nodes, 2)
        Reference positions, a length each.
    cells : IntArray, shape (n_cells, 3 or 4)
        Node numbers, counter-clockwise; (0, …) for a rigid body.
    contact : IntArray, shape (n_segments, 2)
        Edges that may touch another body, each with the body on its left.
    young : float
        E > 0, force per length squared; ignored if rigid.
    poisson : float
        −1 < ν < 1/2; ignored if rigid.
    fixed : BoolArray, shape (n_nodes, 2)
        Components of the displacement that are imposed, in the body's axes.
    imposed : FloatArray, shape (n_nodes, 2)
        What is imposed there, a length each; 0 elsewhere.
    load : FloatArray, shape (n_nodes, 2)
        Nodal forces in the body's axes, per unit of thickness.
    axis : FloatArray, shape (2,)
        Unit vector of the body's first axis; the second is a quarter turn counter-clockwise from it.
    start : FloatArray, shape (2,)
        Displacement, in the body's axes, of all that is free in the first guess of a solution.
    name : str
        For messages and drawings.
    contact_nodes : IntArray, shape (n_contact,)
        The numbers of the nodes on the contact boundary, ascending.
    frame : FloatArray, shape (2, 2)
        The rotation from the body's axes to the global ones: its columns are the axes.

    Raises
    ------
    MisuseError
        For anything that no body can have, by the attribute's name.
    """

    nodes: FloatArray
    cells: IntArray
    contact: IntArray
    young: float = 1.0
    poisson: float = 0.0
    fixed: BoolArray = field(default_factory=lambda: np.zeros(0, bool))
    imposed: FloatArray = field(default_factory=lambda: np.zeros(0))
    load: FloatArray = field(default_factory=lambda: np.zeros(0))
    axis: FloatArray = field(default_factory=lambda: np.array([1.0, 0.0]))
    start: FloatArray = field(default_factory=lambda: np.zeros(2))
    name: str = "body"
    contact_nodes: IntArray = field(init=False)
    frame: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        self._settle("nodes", np.float64, (-1, 2))
        n_nodes = len(self.nodes)
        self._settle("cells", np.int64, (-1, self._corners()))
        self._settle("contact", np.int64, (-1, 2))
        self._settle("fixed", np.bool_, (n_nodes, 2), default=False)
        for name in ("imposed", "load"):
            self._settle(name, np.float64, (n_nodes, 2), default=0.0)
        self._settle("axis", np.float64, (2,))
        self._settle("start", np.float64, (2,))
        if abs(np.hypot(*self.axis) - 1) > 1e-12:
            self._refuse("axis", f"({self.axis[0]}, {self.axis[1]})", "a unit vector")
        for name in ("cells", "contact"):
            numbers = getattr(self, name)
            if numbers.size and not 0 <= numbers.min() <= numbers.max() < n_nodes:
                outlier = numbers.min() if numbers.min() < 0 else numbers.max()
                self._refuse(name, f"node number {outlier}", f"numbers from 0 to {n_nodes - 1}")
        if not len(self.contact):
            self._refuse("contact", "no edges", "the edges that may touch something (of a mesh: a tag that has some)")
        frame = [[self.axis[0], -self.axis[1]], [self.axis[1], self.axis[0]]]
        object.__setattr__(self, "frame", freeze(frame, np.float64))
        object.__setattr__(self, "contact_nodes", freeze(np.unique(self.contact), np.int64))
        if (self.imposed[~self.fixed] != 0).any():
            self._refuse("imposed", "a displacement of a free component", "0 where nothing is fixed")
        for name, low, high, needed in (
            ("young", 0.0, np.inf, "Young's modulus > 0"),
            ("poisson", -1.0, 0.5, _POISSON),
        ):
            number = np.asarray(getattr(self, name))
            if number.shape != () or number.dtype.kind not in "fiu" or not (self.rigid or low < number < high):
                self._refuse(name, f"{getattr(self, name)!r}", needed)
            object.__setattr__(self, name, float(number))
        if self.rigid:
            if not self.fixed.all():
                self._refuse("fixed", "a free node of a rigid body", "every component of every node fixed")
        else:
            self._check_cells()
            self._check_contact()
        if any(len(set(ends)) < len(ends) for ends in self.contact.T.tolist()):
            self._refuse("contact", "two edges that begin or end at one node", "each edge once, in chains")

    @property
    def rigid(self) -> bool:
        """Whether there is nothing to deform."""
        return len(self.cells) == 0

    @property
    def oedometric_modulus(self) -> float:
        """M = E(1−ν)/((1+ν)(1−2ν)): stress over strain where there is no lateral strain."""
        return self.young * (1 - self.poisson) / ((1 + self.poisson) * (1 - 2 * self.poisson))

    def _corners(self) -> int:
        shape = _array(f"{self.name}: cells", self.cells).shape
        return shape[1] if len(shape) == 2 and shape[1] in _CORNERS else 4

    def _settle(self, name: str, dtype: Any, shape: tuple[int, ...], default: Any = None) -> None:
        """Make the attribute a read-only array of that dtype and shape; empty becomes the default everywhere."""
        raw = _array(f"{self.name}: {name}", getattr(self, name))
        if default is not None and raw.size == 0:
            raw = np.full(shape, default)
        if name == "cells" and raw.size == 0:
            raw = np.zeros((0, self._corners()), np.int64)
        if not _fits(raw, shape):
            self._refuse(name, f"shape {raw.shape}", _words(shape))
        kinds = {np.float64: "fiu", np.int64: "iu", np.bool_: "b"}[dtype]
        if raw.dtype.kind not in kinds:
            self._refuse(name, f"dtype {raw.dtype}", f"{np.dtype(dtype).name}")
        if raw.dtype.kind == "f" and not np.isfinite(raw).all():
            self._refuse(name, "NaN or infinity", "finite numbers")
        object.__setattr__(self, name, freeze(raw, dtype))

    def _check_cells(self) -> None:
        corners = self.nodes[self.cells]  # (n_cells, n_corners, 2)
        to_next = np.roll(corners, -1, axis=1) - corners
        turn = to_next[:, :, 0] * np.roll(to_next, -1, axis=1)[:, :, 1]
        turn = turn - to_next[:, :, 1] * np.roll(to_next, -1, axis=1)[:, :, 0]
        bad = np.flatnonzero((turn <= 0).any(axis=1))
        if len(bad):
            self._refuse("cells", f"cell {bad[0]}, which is clockwise, folded or flat", "convex, counter-clockwise")
        unused = np.setdiff1d(np.arange(len(self.nodes)), self.cells)
        if len(unused):
            self._refuse("nodes", f"node {unused[0]} in no cell", "every node in a cell")

    def _check_contact(self) -> None:
        n_nodes = len(self.nodes)
        following = np.roll(self.cells, -1, axis=1)
        edges = self.cells * n_nodes + following  # each edge as one number, the cell on its left
        ordered = np.sort(edges, axis=None)
        if (ordered[1:] == ordered[:-1]).any():
            self._refuse("cells", "two cells on the same side of an edge", "cells that do not overlap")
        inside = np.isin(edges, following * n_nodes + self.cells)
        outer = edges[~inside]
        wrong = np.flatnonzero(~np.isin(self.contact[:, 0] * n_nodes + self.contact[:, 1], outer))
        if len(wrong):
            first, second = self.contact[wrong[0]]
            needed = "edges of the boundary, each with the body on its left"
            self._refuse("contact", f"the edge from node {first} to node {second}", needed)

    def _refuse(self, name: str, found: str, needed: str) -> None:
        raise MisuseError(f"{self.name}: {name}", found, needed)


_POISSON = "Poisson's ratio above −1 and below 0.5 (an incompressible body has no stiffness matrix in displacements)"


def block(
    x: ArrayLike,
    y: ArrayLike,
    *,
    contact: str,
    young: float = 1.0,
    poisson: float = 0.0,
    pressure: float = 0.0,
    approach: float | None = None,
    tilt: float = 0.0,
    lowered: float = 0.0,
    free_sides: bool = False,
    over: tuple[float, float] | None = None,
    axis: ArrayLike = (1.0, 0.0),
    shift: ArrayLike = (0.0, 0.0),
    scale: float = 1.0,
    name: str = "block",
) -> Body:
    """A rectangle of Q4 cells, on rollers at both vertical sides unless those are free.

    Parameters
    ----------
    x, y : ArrayLike
        Ascending coordinates of the grid lines, before rotation and translation.
    contact : str
        "bottom" or "top", the side that may touch something; the opposite side is loaded or held.
    pressure : float
        On the opposite side, towards the contact; that side is free then. Also on what `over` leaves.
    approach : float | None
        Instead, a displacement of the opposite side towards the contact, 0 to hold it.
    tilt : float
        By how much more than in the middle the last node of that side approaches, and the first less.
    lowered : float
        Towards the contact, the first guess of what is free.
    free_sides : bool
        The vertical sides strain freely; the first node opposite the contact is held from sliding.
    over : tuple[float, float] | None, shape (from, to)
        Where on the contact side somebody else presses; the pressure acts on the rest of that side too.
    axis, shift, scale : ArrayLike or float
        Where the block lies: points become scale × (x along axis, y across it, + shift).

    Raises
    ------
    MisuseError
        As `Body` does, and for grid lines that do not ascend.
    """
    x, y = _floats(f"{name}: x", x, (-1,)), _floats(f"{name}: y", y, (-1,))
    axis, shift = _floats(f"{name}: axis", axis, (2,)), _floats(f"{name}: shift", shift, (2,))
    for word, values in (("x", x), ("y", y)):
        if len(values) < 2 or not (np.isfinite(values).all() and (np.diff(values) > 0).all()):
            raise MisuseError(f"{name}: {word}", f"{values.tolist()}", "at least two ascending coordinates")
    if contact not in ("bottom", "top"):
        raise MisuseError(f"{name}: contact", repr(contact), "'bottom' or 'top'")
    columns, rows = len(x), len(y)
    number = np.arange(columns * rows).reshape(rows, columns)
    cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)
    bottom, top = number[0], number[-1]
    near, far = (bottom, top) if contact == "bottom" else (top[::-1], bottom)
    down = -1.0 if contact == "bottom" else 1.0  # from the far side towards the contact
    nodes = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    fixed, imposed, load = np.zeros(nodes.shape, bool), np.zeros(nodes.shape), np.zeros(nodes.shape)
    fixed[far[0] if free_sides else number[:, [0, -1]], 0] = True
    if approach is not None:
        lean = tilt * (2 * (x - x[0]) / (x[-1] - x[0]) - 1)
        fixed[far, 1], imposed[far, 1] = True, down * (approach + lean) * scale
    else:
        load[far, 1] = down * pressure * scale * _lengths(x, x[0], x[-1])
    if over is not None:
        outside = _lengths(x, x[0], over[0]) + _lengths(x, over[1], x[-1])
        load[near if contact == "bottom" else near[::-1], 1] -= down * pressure * scale * outside
    placed = placed_at(nodes, axis, shift, scale)
    return Body(
        nodes=placed,
        cells=cells,
        contact=np.column_stack([near[:-1], near[1:]]),
        young=young,
        poisson=poisson,
        fixed=fixed,
        imposed=imposed,
        load=load,
        axis=axis,
        start=np.array([0.0, down * lowered * scale]),
        name=name,
    )


def rigid_surface(
    points: ArrayLike, *, axis: ArrayLike = (1.0, 0.0), moved: ArrayLike = (0.0, 0.0), name: str = "rigid"
) -> Body:
    """A rigid surface through the points (n, 2) in walking order, the body on the left; `moved` is imposed on it."""
    nodes = _floats(f"{name}: points", points, (-1, 2))
    numbers = np.arange(len(nodes))
    return Body(
        nodes=nodes,
        cells=np.zeros((0, 4), np.int64),
        contact=np.column_stack([numbers[:-1], numbers[1:]]),
        fixed=np.ones(nodes.shape, bool),
        imposed=np.broadcast_to(_floats(f"{name}: moved", moved, (2,)), nodes.shape),
        axis=np.asarray(axis, dtype=np.float64),
        name=name,
    )


def placed_at(points: FloatArray, axis: ArrayLike, shift: ArrayLike, scale: float) -> FloatArray:
    """Points (n, 2) of a drawing turned so that its x runs along `axis`, shifted, then scaled."""
    cos, sin = np.asarray(axis, dtype=np.float64)
    turned = points @ np.array([[cos, sin], [-sin, cos]]) if sin else points * cos
    placed: FloatArray = (turned + np.asarray(shift, dtype=np.float64)) * scale
    return placed


def _lengths(x: FloatArray, low: float, high: float) -> FloatArray:
    """∫ N over [low, high] for each grid line (n,): what a uniform pressure there is multiplied by."""
    weights = np.zeros(len(x))
    a, b = (np.clip(bound, x[:-1], x[1:]) for bound in (low, high))
    lengths = np.diff(x)
    part = np.where(b > a, b - a, 0.0)
    towards_second = part * ((a + b) / 2 - x[:-1]) / lengths
    weights[1:] += towards_second
    weights[:-1] += part - towards_second
    return weights


def _fits(array: NDArray[Any], shape: tuple[int, ...]) -> bool:
    return array.ndim == len(shape) and all(want in (-1, have) for want, have in zip(shape, array.shape, strict=True))


def _words(shape: tuple[int, ...]) -> str:
    lengths = ["n" if length < 0 else str(length) for length in shape]
    return f"shape ({lengths[0]},)" if len(shape) == 1 else f"shape ({', '.join(lengths)})"


def _floats(argument: str, values: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    raw = _array(argument, values)
    if raw.dtype.kind not in "fiu":
        raise MisuseError(argument, f"dtype {raw.dtype}", "numbers")
    if not _fits(raw, shape):
        raise MisuseError(argument, f"shape {raw.shape}", _words(shape))
    return raw.astype(np.float64)


def _array(argument: str, values: ArrayLike) -> NDArray[Any]:
    try:
        return np.asarray(values)
    except ValueError as error:
        raise MisuseError(argument, "rows of different lengths", "an array") from error
