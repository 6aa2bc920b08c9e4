"""An elastic body as data: mesh, material, supports, loads, and the part of its boundary that may touch something.

Whatever can be wrong with a body is found here, in the constructor, once. What a body does under load is in
`contactverif.mechanics.bulk`. Vectors of supports and loads are in the body's own axes, so that a
roller on an inclined side is a fixed component like any other.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray, as_array, check_shape, freeze
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import PLANE, SPACE

_Fault = tuple[str, str, str]  # The attribute of a `Body` that is wrong, what was found and what is needed.
_POISSON = "Poisson's ratio above −1 and below 0.5 (an incompressible body has no stiffness matrix in displacements)"


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A linear elastic body in plane strain or in space, or a rigid surface.

    A body without cells is rigid: each of its nodes is a boundary condition. For a rectangle and for a rigid surface
    there are `block` and `rigid_surface`, for a mesh of scikit-fem `body_from_mesh`.

    Attributes
    ----------
    nodes : FloatArray, shape (n_nodes, 2 or 3)
        The reference positions, a length each; two coordinates are a body in the plane, three one in space.
    cells : IntArray, shape (n_cells, n_corners)
        The node numbers of each triangle or quadrilateral, counter-clockwise, or of each tetrahedron or hexahedron. In
        space the first face (3 or 4 nodes) runs counter-clockwise seen from the other nodes, and the opposite one
        of a hexahedron follows in the same order. A rigid body has none.
    contact : IntArray, shape (n_faces, n_corners)
        The edges that may touch another body, each with this body on its left; in space the triangles or
        quadrilaterals, counter-clockwise seen from outside.
    young : float
        Young's modulus E > 0, force per length squared. A rigid body ignores it.
    poisson : float
        Poisson's ratio, −1 < ν < 1/2. A rigid body ignores it.
    fixed : BoolArray, shape (n_nodes, dim)
        True for each component of the displacement that is imposed, in the body's axes. Optional: nothing is fixed.
    imposed : FloatArray, shape (n_nodes, dim)
        The displacements imposed on fixed components, a length each; 0 elsewhere. Optional: 0.
    load : FloatArray, shape (n_nodes, dim)
        The nodal forces, in the body's axes, in the plane per unit of thickness. Optional: 0.
    axis : FloatArray, shape (2,) or (2, 3)
        The unit vector of the body's first axis. The second is a quarter turn counter-clockwise from it. In space the
        first two axes, to which the third is normal. Optional: the global ones.
    start : FloatArray, shape (dim,)
        The displacement, in the body's axes, of all free nodes in the first guess of a solution. Optional: 0.
    name : str
        The name in messages and drawings.
    contact_nodes : IntArray, shape (n_contact_nodes,)
        The numbers of the nodes on the contact boundary, ascending. Computed by the constructor.
    frame : FloatArray, shape (dim, dim)
        The rotation from the body's axes to the global ones; its columns are the axes. Computed by the constructor.

    Raises
    ------
    MisuseError
        If an attribute is one that no body can have; the message begins with the names of body and attribute.
    """

    nodes: FloatArray
    cells: IntArray
    contact: IntArray
    young: float = 1.0
    poisson: float = 0.0
    fixed: BoolArray = field(default_factory=lambda: np.zeros(0, bool))
    imposed: FloatArray = field(default_factory=lambda: np.zeros(0))
    load: FloatArray = field(default_factory=lambda: np.zeros(0))
    axis: FloatArray = field(default_factory=lambda: np.zeros(0))
    start: FloatArray = field(default_factory=lambda: np.zeros(0))
    name: str = "body"
    contact_nodes: IntArray = field(init=False)
    frame: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        shape = as_array(f"{self.name}: nodes", self.nodes).shape
        dim = shape[1] if len(shape) == 2 and shape[1] in (PLANE, SPACE) else PLANE
        self._set_array("nodes", np.float64, (-1, dim))
        n_nodes = len(self.nodes)
        for name, kinds in (("cells", (3, 4) if dim == PLANE else (4, 8)), ("contact", _CONTACT[dim])):
            shape = as_array(f"{self.name}: {name}", getattr(self, name)).shape
            self._set_array(name, np.int64, (-1, shape[1] if len(shape) == 2 and shape[1] in kinds else kinds[-1]), 0)
        self._set_array("fixed", np.bool_, (n_nodes, dim), default=False)
        for name in ("imposed", "load"):
            self._set_array(name, np.float64, (n_nodes, dim), default=0.0)
        self._set_array("start", np.float64, (dim,), default=0.0)
        if as_array(f"{self.name}: axis", self.axis).size == 0:
            object.__setattr__(self, "axis", np.array([1.0, 0.0]) if dim == PLANE else np.eye(3)[:2])
        self._set_array("axis", np.float64, (2,) if dim == PLANE else (2, 3))
        if not np.allclose(self.axis @ self.axis.T, 1.0 if dim == PLANE else np.eye(2), rtol=0, atol=1e-12):
            needed = "a unit vector" if dim == PLANE else "two unit vectors, normal to each other"
            self._refuse("axis", f"({', '.join(map(str, self.axis.reshape(-1).tolist()))})", needed)
        across = [-self.axis[1], self.axis[0]] if dim == PLANE else np.cross(*self.axis)
        object.__setattr__(self, "frame", freeze(np.vstack([self.axis, across]).T, np.float64))
        if fault := _find_wrong_number(n_nodes, self.cells, self.contact):
            self._refuse(*fault)
        check = _check_small_mesh if self.cells.size <= _SMALL else _check_mesh
        shapes = self.cells.shape, self.contact.shape
        contact_nodes, fault = check(n_nodes, shapes, self.cells.tobytes(), self.contact.tobytes())
        object.__setattr__(self, "contact_nodes", contact_nodes)
        if (self.imposed[~self.fixed] != 0).any():
            self._refuse("imposed", "a displacement of a free component", "0 where nothing is fixed")
        for name, low, high, needed in (
            ("young", 0.0, np.inf, "Young's modulus > 0"),
            ("poisson", -1.0, 0.5, _POISSON),
        ):
            number = np.asarray(value := getattr(self, name))
            if number.shape != () or number.dtype.kind not in "fiu" or not (self.rigid or low < number < high):
                self._refuse(name, f"{value!r}", needed)
            object.__setattr__(self, name, float(number))
        if self.rigid and not self.fixed.all():
            self._refuse("fixed", "a free node of a rigid body", "every component of every node fixed")
        if len(bad := np.flatnonzero((self._turns <= 0).any(axis=1))):
            flaw, needed = ("clockwise", "convex, counter-clockwise") if dim == PLANE else ("inside out", "convex")
            self._refuse("cells", f"cell {bad[0]}, which is {flaw}, folded or flat", needed)
        if fault:
            self._refuse(*fault)

    @property
    def dim(self) -> int:
        """The number of coordinates of a node."""
        return int(self.nodes.shape[1])

    @property
    def _turns(self) -> FloatArray:
        """The area or volume (n_cells, n_corners) that the edges at each corner of each cell span, signed."""
        corners = self.nodes[self.cells]
        if self.dim == PLANE:
            to_next = np.roll(corners, -1, axis=1) - corners
            after = np.roll(to_next, -1, axis=1)
            return np.asarray(to_next[..., 0] * after[..., 1] - to_next[..., 1] * after[..., 0])
        first, second, third = (corners[:, list(ends)] - corners for ends in _EDGES[self.cells.shape[1]])
        return np.asarray((np.cross(first, second) * third).sum(axis=-1))

    @property
    def rigid(self) -> bool:
        """True if the body has no cells, so that nothing of it can deform."""
        return len(self.cells) == 0

    @property
    def oedometric_modulus(self) -> float:
        """The oedometric modulus M = E(1−ν)/((1+ν)(1−2ν)): stress over strain without lateral strain."""
        return self.young * (1 - self.poisson) / ((1 + self.poisson) * (1 - 2 * self.poisson))

    def _set_array(self, name: str, dtype: Any, shape: tuple[int, ...], default: Any = None) -> None:
        """Make the attribute a read-only array of that dtype and shape; an empty one becomes the default everywhere."""
        argument, values = f"{self.name}: {name}", getattr(self, name)
        raw = as_array(argument, values)
        if default is not None and raw.size == 0:
            raw = np.full([max(length, 0) for length in shape], default)
        check_shape(argument, raw, shape)
        if raw.dtype.kind not in {np.float64: "fiu", np.int64: "iu", np.bool_: "b"}[dtype]:
            self._refuse(name, f"dtype {raw.dtype}", f"{np.dtype(dtype).name}")
        if raw.dtype.kind == "f" and not np.isfinite(raw).all():
            self._refuse(name, "NaN or infinity", "finite numbers")
        object.__setattr__(self, name, freeze(raw, dtype))

    def _refuse(self, name: str, found: str, needed: str) -> None:
        raise MisuseError(f"{self.name}: {name}", found, needed)


def _find_wrong_number(n_nodes: int, cells: IntArray, contact: IntArray) -> _Fault | None:
    for name, numbers in (("cells", cells), ("contact", contact)):
        if numbers.size and not 0 <= numbers.min() <= numbers.max() < n_nodes:
            outlier = numbers.min() if numbers.min() < 0 else numbers.max()
            return name, f"node number {outlier}", f"numbers from 0 to {n_nodes - 1}"
    if not len(contact):
        return (
            "contact",
            "no edges",
            "the edges that may touch something, in space the faces (of a mesh: a tag that has some)",
        )
    return None


def _check_mesh(
    n_nodes: int, shapes: tuple[tuple[int, ...], tuple[int, ...]], cell_bytes: bytes, contact_bytes: bytes
) -> tuple[IntArray, _Fault | None]:
    """Return the contact nodes, and what is wrong with cells and contact, arrays of these shapes, bytes of int64."""
    cells, contact = (
        np.frombuffer(data, np.int64).reshape(shape)
        for data, shape in zip((cell_bytes, contact_bytes), shapes, strict=True)
    )
    fault = _find_wrong_cell(n_nodes, cells, contact) if len(cells) else None
    if fault is None and contact.shape[1] == 2 and any(len(set(ends)) < len(ends) for ends in contact.T.tolist()):
        fault = "contact", "two edges that begin or end at one node", "each edge once, in chains"
    return freeze(np.unique(contact), np.int64), fault


_SMALL = 512  # Number of node numbers of a mesh that is remembered: random meshes share few ways to hang together.
_check_small_mesh = lru_cache(maxsize=1024)(_check_mesh)


# {number of corners of a cell in space: its faces, counter-clockwise seen from outside}
SIDES = {
    4: ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    8: ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
# {the same: the other ends of three edges at each corner, in a right-handed order}
_EDGES = {
    4: ((1, 2, 0, 0), (2, 0, 1, 2), (3, 3, 3, 1)),
    8: ((1, 2, 3, 0, 7, 4, 5, 6), (3, 0, 1, 2, 5, 6, 7, 4), (4, 5, 6, 7, 0, 1, 2, 3)),
}
_CONTACT = {PLANE: (2,), SPACE: (3, 4)}


def _find_wrong_cell(n_nodes: int, cells: IntArray, contact: IntArray) -> _Fault | None:
    unused = np.setdiff1d(np.arange(n_nodes), cells)
    if len(unused):
        return "nodes", f"node {unused[0]} in no cell", "every node in a cell"
    word, verb, plane = "edge", "on its left", contact.shape[1] == 2
    if plane:
        sides = np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)  # The cell is on the left.
    else:
        sides = np.concatenate([cells[:, side] for side in SIDES[cells.shape[1]]])
        word, verb = "face", "behind it"
    keys = _number_sides(sides, n_nodes)
    ordered = np.sort(keys)
    if (ordered[1:] == ordered[:-1]).any():
        return "cells", f"two cells on the same side of {'an edge' if plane else 'a face'}", "cells that do not overlap"
    outer = keys[~np.isin(keys, _number_sides(sides[:, ::-1], n_nodes))]
    fits = contact.shape[1] == sides.shape[1]
    wrong = np.flatnonzero(~np.isin(_number_sides(contact, n_nodes), outer)) if fits else np.arange(len(contact))
    if not len(wrong):
        return None
    nodes = " to node ".join(map(str, contact[wrong[0]]))
    return "contact", f"the {word} from node {nodes}", f"{word}s of the boundary, each with the body {verb}"


def _number_sides(sides: IntArray, n_nodes: int) -> IntArray:
    """Return a number (n,) for each side (n, n_corners): the same wherever a face begins, another one in reverse."""
    n, n_corners = sides.shape
    if n_corners > 2:
        first = sides.argmin(axis=1)[:, None]
        sides = np.take_along_axis(sides, (first + np.arange(n_corners)) % n_corners, axis=1)
        sides = sides[:, [0, 1, -1]]  # Three corners of a face tell it from every other face.
    numbers = np.zeros(n, np.int64)
    for column in sides.T:
        numbers = numbers * n_nodes + column
    return numbers
