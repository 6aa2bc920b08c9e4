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

_Fault = tuple[str, str, str]  # The attribute of a `Body` that is wrong, what was found and what is needed.
_POISSON = "Poisson's ratio above −1 and below 0.5 (an incompressible body has no stiffness matrix in displacements)"


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A linear elastic body in plane strain, or a rigid surface.

    A body without cells is rigid: each of its nodes is a boundary condition. For a rectangle and for a rigid surface
    there are `block` and `rigid_surface`, for a mesh of scikit-fem `body_from_mesh`.

    Attributes
    ----------
    nodes : FloatArray, shape (n_nodes, 2)
        The reference positions, a length each.
    cells : IntArray, shape (n_cells, 3 or 4)
        The node numbers of each triangle or quadrilateral, counter-clockwise; shape (0, 4) for a rigid body.
    contact : IntArray, shape (n_segments, 2)
        The edges that may touch another body, each with this body on its left.
    young : float
        Young's modulus E > 0, force per length squared. A rigid body ignores it.
    poisson : float
        Poisson's ratio, −1 < ν < 1/2. A rigid body ignores it.
    fixed : BoolArray, shape (n_nodes, 2)
        True for each component of the displacement that is imposed, in the body's axes. Optional: nothing is fixed.
    imposed : FloatArray, shape (n_nodes, 2)
        The displacements imposed on fixed components, a length each; 0 elsewhere. Optional: 0.
    load : FloatArray, shape (n_nodes, 2)
        The nodal forces, in the body's axes, per unit of thickness. Optional: 0.
    axis : FloatArray, shape (2,)
        The unit vector of the body's first axis. The second is a quarter turn counter-clockwise from it.
    start : FloatArray, shape (2,)
        The displacement, in the body's axes, of all free nodes in the first guess of a solution.
    name : str
        The name in messages and drawings.
    contact_nodes : IntArray, shape (n_contact_nodes,)
        The numbers of the nodes on the contact boundary, ascending. Computed by the constructor.
    frame : FloatArray, shape (2, 2)
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
    axis: FloatArray = field(default_factory=lambda: np.array([1.0, 0.0]))
    start: FloatArray = field(default_factory=lambda: np.zeros(2))
    name: str = "body"
    contact_nodes: IntArray = field(init=False)
    frame: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        self._set_array("nodes", np.float64, (-1, 2))
        n_nodes, cells = len(self.nodes), as_array(f"{self.name}: cells", self.cells).shape
        n_corners = cells[1] if len(cells) == 2 and cells[1] in (3, 4) else 4
        self._set_array("cells", np.int64, (-1, n_corners), default=0)
        self._set_array("contact", np.int64, (-1, 2))
        self._set_array("fixed", np.bool_, (n_nodes, 2), default=False)
        for name in ("imposed", "load"):
            self._set_array(name, np.float64, (n_nodes, 2), default=0.0)
        for name in ("axis", "start"):
            self._set_array(name, np.float64, (2,))
        if abs(np.hypot(*self.axis) - 1) > 1e-12:
            self._refuse("axis", f"({self.axis[0]}, {self.axis[1]})", "a unit vector")
        frame = [[self.axis[0], -self.axis[1]], [self.axis[1], self.axis[0]]]
        object.__setattr__(self, "frame", freeze(frame, np.float64))
        if fault := _find_wrong_number(n_nodes, self.cells, self.contact):
            self._refuse(*fault)
        check = _check_small_mesh if self.cells.size <= _SMALL else _check_mesh
        contact_nodes, fault = check(n_nodes, self.cells.shape, self.cells.tobytes(), self.contact.tobytes())
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
        corners = self.nodes[self.cells]  # (n_cells, n_corners, 2)
        to_next = np.roll(corners, -1, axis=1) - corners
        after = np.roll(to_next, -1, axis=1)
        turn = to_next[..., 0] * after[..., 1] - to_next[..., 1] * after[..., 0]
        if not (turn > 0).all():
            bad = np.flatnonzero((turn <= 0).any(axis=1))
            self._refuse("cells", f"cell {bad[0]}, which is clockwise, folded or flat", "convex, counter-clockwise")
        if fault:
            self._refuse(*fault)

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
        return "contact", "no edges", "the edges that may touch something (of a mesh: a tag that has some)"
    return None


def _check_mesh(
    n_nodes: int, shape: tuple[int, int], cell_bytes: bytes, contact_bytes: bytes
) -> tuple[IntArray, _Fault | None]:
    """Return the contact nodes, and what is wrong with cells, of that shape, and edges, both bytes of int64 arrays."""
    cells = np.frombuffer(cell_bytes, np.int64).reshape(shape)
    contact = np.frombuffer(contact_bytes, np.int64).reshape(-1, 2)
    fault = _find_wrong_cell(n_nodes, cells, contact) if len(cells) else None
    if fault is None and any(len(set(ends)) < len(ends) for ends in contact.T.tolist()):
        fault = "contact", "two edges that begin or end at one node", "each edge once, in chains"
    return freeze(np.unique(contact), np.int64), fault


_SMALL = 512  # Number of node numbers of a mesh that is remembered: random meshes share few ways to hang together.
_check_small_mesh = lru_cache(maxsize=1024)(_check_mesh)


def _find_wrong_cell(n_nodes: int, cells: IntArray, contact: IntArray) -> _Fault | None:
    unused = np.setdiff1d(np.arange(n_nodes), cells)
    if len(unused):
        return "nodes", f"node {unused[0]} in no cell", "every node in a cell"
    following = np.roll(cells, -1, axis=1)
    edges = cells * n_nodes + following  # Each edge as one number, the cell on its left.
    ordered = np.sort(edges, axis=None)
    if (ordered[1:] == ordered[:-1]).any():
        return "cells", "two cells on the same side of an edge", "cells that do not overlap"
    outer = edges[~np.isin(edges, following * n_nodes + cells)]
    wrong = np.flatnonzero(~np.isin(contact[:, 0] * n_nodes + contact[:, 1], outer))
    if not len(wrong):
        return None
    first, second = contact[wrong[0]]
    return (
        "contact",
        f"the edge from node {first} to node {second}",
        "edges of the boundary, each with the body on its left",
    )
