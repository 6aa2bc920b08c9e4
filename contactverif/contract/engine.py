"""The contract of an engine: a whole contact code that is given a scene and returns displacements.

Rule for the next editor: this file imports numpy and the standard library alone, since it is imported in the
interpreter of the code, which may have nothing else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
EngineEnforcement = Literal["penalty", "multiplier", "barrier", "own"]

_KINDS: dict[str, type[np.generic]] = {"FloatArray": np.float64, "IntArray": np.int64, "BoolArray": np.bool_}


@dataclass(frozen=True, slots=True)
class EngineTraits:
    """The statements of an engine about itself.

    Attributes
    ----------
    enforcement : Literal['penalty', 'multiplier', 'barrier', 'own']
        The way in which contact is enforced. ``"own"``: the code chooses its stiffness itself, so that ε̂ means nothing.
    accuracy : float
        The relative accuracy a of the displacements that it returns.
    inclined_supports : bool
        It takes supports that are inclined against the axes. Other engines are given no scene that has one.
    load_scale : float
        The factor, at most 1, of all loads and imposed displacements. It is below 1 for codes of finite strains, whose
        answers are those of small strains only under small loads.
    passes_flat_patch : bool | None
        A uniform pressure is found exactly on flat meshes that do not match; None promises nothing.
    converges : bool | None
        On finer meshes the answers converge to the exact ones; None promises nothing.
    source : str
        The documentation or publication of the code.
    dimensions : tuple[int, ...]
        The numbers of coordinates that it takes: (2,), (3,) or (2, 3). An engine that takes both is asked in the plane.
    """

    enforcement: EngineEnforcement
    accuracy: float = 1e-9
    inclined_supports: bool = False
    load_scale: float = 1.0
    passes_flat_patch: bool | None = None
    converges: bool | None = None
    source: str = ""
    dimensions: tuple[int, ...] = (2,)

    def __post_init__(self) -> None:
        if self.enforcement not in get_args(EngineEnforcement):
            raise ValueError(f"enforcement: found {self.enforcement!r}; needed one of {get_args(EngineEnforcement)}")
        for name in ("accuracy", "load_scale"):
            if not 0 < getattr(self, name) <= 1:
                raise ValueError(f"{name}: found {getattr(self, name)!r}; needed a number above 0, at most 1")
        if self.dimensions not in ((2,), (3,), (2, 3)):
            raise ValueError(f"dimensions: found {self.dimensions!r}; needed (2,), (3,) or (2, 3)")


@dataclass(frozen=True, slots=True, eq=False)
class SceneArrays:
    """A scene as plain arrays, which any code can read: linear elastic or rigid bodies, no friction.

    In the plane (dim = 2) the strain is plane. In space (dim = 3) cells are solids, and contact edges are faces.

    Attributes
    ----------
    nodes : FloatArray, shape (n_nodes, dim)
        The reference positions of all bodies, a length each.
    cells : IntArray, shape (n_cells, 4 or 8)
        The node numbers of each triangle or quadrilateral, counter-clockwise; −1 is the fourth of a triangle. In space
        those of each tetrahedron or hexahedron as `contactverif.Body` orders them; −1 stands behind a tetrahedron's
        four. The nodes of a rigid body have no cells.
    body_of_cell, body_of_node : IntArray, shape (n_cells,) and (n_nodes,)
        The body that each cell and each node belongs to, 0 to n_bodies − 1.
    slave, master : IntArray, shape (n_segments, 2 or 4)
        The contact edges of both sides, each with its body on the left. In space the faces, counter-clockwise seen from
        outside of the body; −1 is the fourth of a triangle.
    fixed : BoolArray, shape (n_nodes, dim)
        True for each imposed component of a displacement, in the axes of the body.
    imposed : FloatArray, shape (n_nodes, dim)
        The imposed displacements, a length each, in the axes of the body; 0 where nothing is fixed.
    load : FloatArray, shape (n_nodes, dim)
        The nodal forces, in the plane per unit of thickness, in the axes of the body.
    start : FloatArray, shape (n_nodes, dim)
        A first guess of the displacements, in global axes.
    axes : FloatArray, shape (n_bodies, 2) or (n_bodies, 2, 3)
        The first axis of each body, a unit vector. The second is a quarter turn counter-clockwise from it. In space the
        first two axes, to which the third is normal.
    young, poisson : FloatArray, shape (n_bodies,)
        Young's modulus, force per length squared, and Poisson's ratio. A rigid body ignores them.
    penalty : float
        The distributed stiffness ε̂ of contact, force per length per length of penetration.
    unit : float
        The size of the largest body, a length, for steps and tolerances that need one.
    """

    nodes: FloatArray
    cells: IntArray
    body_of_cell: IntArray
    body_of_node: IntArray
    slave: IntArray
    master: IntArray
    fixed: BoolArray
    imposed: FloatArray
    load: FloatArray
    start: FloatArray
    axes: FloatArray
    young: FloatArray
    poisson: FloatArray
    penalty: float
    unit: float

    def __post_init__(self) -> None:
        for entry in fields(self):
            if entry.type in _KINDS:
                array = np.array(getattr(self, entry.name), _KINDS[str(entry.type)])
                array.flags.writeable = False
                object.__setattr__(self, entry.name, array)
        if self.nodes.shape[1] == 2:  # The first rows of a frame are one axis there.
            object.__setattr__(self, "axes", self.axes.reshape(-1, 2))

    @property
    def rigid(self) -> BoolArray:
        """The bodies without cells (n_bodies,), of which each node is imposed."""
        return ~np.isin(np.arange(len(self.axes)), self.body_of_cell)

    def frames(self) -> FloatArray:
        """Return the rotation (n_nodes, dim, dim) from the axes of each node's body to the global ones."""
        first = self.axes[self.body_of_node]
        if self.nodes.shape[1] == 3:
            return np.stack([first[:, 0], first[:, 1], np.cross(first[:, 0], first[:, 1])], axis=2)
        return np.stack([first, np.column_stack([-first[:, 1], first[:, 0]])], axis=2)

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """Return all of it as arrays by name; `from_arrays` makes the scene again."""
        return {entry.name: np.asarray(getattr(self, entry.name)) for entry in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> SceneArrays:
        """Return the scene that `to_arrays` made arrays of."""
        values: dict[str, Any] = {name: array if array.ndim else array.item() for name, array in arrays.items()}
        return cls(**values)


@dataclass(frozen=True, slots=True, eq=False)
class EngineAnswer:
    """The answer of an engine to a scene.

    Attributes
    ----------
    displacements : FloatArray, shape (n_nodes, dim)
        The displacements of all nodes in global axes, a length each.
    converged : bool
        The code says that it has found a solution.
    iterations : int
        The number of iterations that it took; −1 if it is not known.
    message : str
        What the code says of its end, in a line.
    contact_forces : FloatArray | None, shape (n_nodes, dim)
        The forces by which contact pushes the nodes, in global axes, if the code reports them.
    pressures : FloatArray | None, shape (n_slave_nodes,)
        The contact pressures at the nodes of the slave in the order of their numbers, if the code reports them.
    """

    displacements: FloatArray
    converged: bool
    iterations: int = -1
    message: str = ""
    contact_forces: FloatArray | None = None
    pressures: FloatArray | None = None

    def flaw(self, scene: SceneArrays) -> str:
        """Return what is wrong with the answer to a scene, whatever its numbers mean; empty if nothing is."""
        n_slave = len(np.unique(scene.slave[scene.slave >= 0]))
        shapes = {"displacements": scene.nodes.shape, "contact_forces": scene.nodes.shape, "pressures": (n_slave,)}
        for name, shape in shapes.items():
            array = getattr(self, name)
            if array is None and name != "displacements":
                continue
            if not isinstance(array, np.ndarray):
                return f"{name}: returned a {type(array).__name__}; needed shape {shape}"
            if array.shape != shape:
                return f"{name}: returned shape {array.shape}; needed shape {shape}"
            if array.dtype != np.float64:
                return f"{name}: returned dtype {array.dtype}; needed float64"
        return ""


class Engine(Protocol):
    """A whole contact code. Its entry point, of the group `contactverif.engines`, is a factory ``make(**options)``."""

    @property
    def traits(self) -> EngineTraits:
        """The statements of the engine about itself."""

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Solve a scene; a code that finds no solution returns what it has, with ``converged=False``."""
