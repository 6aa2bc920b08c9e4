"""A case: one interface in one state with one penalty, on which a property judges a formulation.

A case is complete: its arrays can be judged again, in another process and with another version of hypothesis. So
`to_arrays` and `from_arrays` agree bit by bit. Lengths such as `diameter` are those of the tolerances.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from inspect import signature
from math import sqrt
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactverif.contract.arrays import FloatArray, freeze
from contactverif.contract.errors import MisuseError, clean, name_line
from contactverif.contract.interface import PLANE, TRIANGLE, Interface, Surface

BODIES = "bodies_"  # The prefix of the parameters that hold the bodies of a scene.
_PREFIX = "parameter_"
# The parameters of a state whose surfaces are apart, as a barrier needs it: two lengths.
LEAST_GAP, ACTIVATION = "least_gap", "activation"
# Those of a state that is asked of a law of its own: the penalty that the formulation gets there, and the length over
# which its forces change.
OWN_PENALTY, FORCE_LENGTH = "own_penalty", "force_length"


@dataclass(frozen=True, eq=False)
class Case:
    """One interface in one state with one penalty, on which a property judges a formulation.

    Attributes
    ----------
    interface : Interface
        The two meshes in their reference configuration.
    z : FloatArray, shape (n_unknowns + n_multipliers,)
        The state: current positions, a length each, flat, slave nodes first; behind them the multipliers, if any.
    penalty : float
        The distributed stiffness ε̂ > 0, force per length per length of penetration. A nodal formulation gets
        ε̂ × the mean length of the slave segments, and in space ε̂ × the area of the slave over the number of its nodes.
    parameters : Mapping[str, FloatArray]
        Whatever else the property that made the case needs to know: arrays of floats by name.
    seed : int
        The seed of everything random that the property does with the case, such as directions of a derivative.
    name : str
        The name of the case, if it has one (``"c"``, ``"c-prime"``); else empty.
    kind : str
        The kind of situation that the strategy made, in words (``"convex vertex"``), so that a run can count how many
        cases of each kind it judged; empty where a strategy makes no kinds.
    n_multipliers : int
        The number of multipliers in z. A case from a strategy or a report has none; the harness puts those of a
        formulation behind the positions.

    Raises
    ------
    MisuseError
        If z has another shape or is not finite, the penalty is not positive, or the seed is no integer from 0 to
        2^63 − 1.

    Examples
    --------
    A slave segment that penetrates the master by 0.1:

    >>> import numpy as np
    >>> from contactverif import Case, Interface
    >>> interface = Interface.from_chains(slave=[[0, 0], [1, 0]], master=[[2, 0], [-1, 0]])
    >>> case = Case(interface, np.array([0, -0.1, 1, -0.1, 2, 0, -1, 0]), penalty=100.0)
    >>> case.positions[0].tolist(), case.slave_length
    ([0.0, -0.1], 1.0)
    """

    interface: Interface
    z: FloatArray
    penalty: float = 1.0
    parameters: Mapping[str, FloatArray] = field(default_factory=dict)
    seed: int = 0
    name: str = ""
    n_multipliers: int = 0
    kind: str = ""

    def __post_init__(self) -> None:
        raw, n_entries = np.asarray(self.z), self.interface.n_unknowns + self.n_multipliers
        if raw.dtype.kind not in "fiu":
            raise MisuseError("z", f"dtype {raw.dtype}", "real numbers")
        if raw.shape != (n_entries,):
            needed = f"({n_entries},): n_nodes × dim, flat, then multipliers if any"
            raise MisuseError("z", f"shape {raw.shape}", needed)
        z = freeze(raw, np.float64)
        if not np.isfinite(z).all():
            raise MisuseError("z", "NaN or infinity", "finite positions")
        object.__setattr__(self, "z", z)
        for name, kind, dtypes, low, high, needed in (
            ("penalty", float, "fiu", 0, np.inf, "a finite number > 0"),
            ("seed", int, "iu", -1, 2**63, "an integer from 0 to 2^63 − 1"),
        ):
            number = np.asarray(value := getattr(self, name))
            if number.shape != () or number.dtype.kind not in dtypes or not low < number < high:
                raise MisuseError(name, f"{value!r}", needed)
            object.__setattr__(self, name, kind(value))
        clean(self, names=("name", "kind"))
        parameters = {name_line(name): freeze(values, np.float64) for name, values in self.parameters.items()}
        object.__setattr__(self, "parameters", parameters)

    @property
    def positions(self) -> FloatArray:
        """The current positions of all nodes (n_nodes, dim), a length each."""
        return self.z[: self.interface.n_unknowns].reshape(self.interface.nodes.shape)

    @property
    def multipliers(self) -> FloatArray:
        """The multipliers (n_multipliers,), which stand behind the positions."""
        return self.z[self.interface.n_unknowns :]

    def with_multipliers(self, multipliers: FloatArray) -> Case:
        """Return the case with multipliers (n_multipliers,) behind its positions, in place of any that it has."""
        positions = self.z[: self.interface.n_unknowns]
        return replace(self, z=np.concatenate([positions, multipliers]), n_multipliers=len(multipliers))

    @cached_property
    def largest_coordinate(self) -> float:
        """The largest coordinate of the state and of the reference, a length; X in the tolerances."""
        return float(max(np.abs(each).max() for each in (self.positions, self.interface.nodes)))

    @cached_property
    def shortest_segment(self) -> float:
        """The length of the shortest current segment of both sides, or the least height of a face."""
        sides = (self.interface.slave, self.interface.master)
        return float(min(side.heights(self.positions).min() for side in sides))

    @cached_property
    def resolution(self) -> float:
        """The length over which forces change; ℓ in the tolerances.

        It is the shortest segment, and for a barrier the gap, or what is left of it to the activation distance, where
        that is shorter.
        """
        if ACTIVATION not in self.parameters:
            return self.shortest_segment
        gap, activation = self.parameter(LEAST_GAP), self.parameter(ACTIVATION)
        return min(self.shortest_segment, gap, activation - gap)

    @property
    def slave_measure(self) -> float:
        """The current length of the slave surface, in space its area: what turns a pressure into a force."""
        return float(self.interface.slave.measures(self.positions).sum())

    @property
    def slave_length(self) -> float:
        """The current length of the slave surface, in space the root of its area; L in the tolerances."""
        return self.slave_measure if self.interface.dim == PLANE else sqrt(self.slave_measure)

    @property
    def diameter(self) -> float:
        """The diagonal of the box around the current state, a length; D in the tolerances."""
        return float(np.linalg.norm(np.ptp(self.positions, axis=0)))

    @property
    def n_segments(self) -> int:
        """The number of segments or faces of both sides; N in the tolerances."""
        return len(self.interface.slave) + len(self.interface.master)

    @property
    def packed_bodies(self) -> dict[str, FloatArray]:
        """The arrays that hold the bodies of a scene, by their names without prefix; none for a mere interface."""
        arrays = self.parameters.items()
        return {name.removeprefix(BODIES): values for name, values in arrays if name.startswith(BODIES)}

    def parameter(self, name: str) -> float:
        """Return a parameter that is one number."""
        return float(self.parameters[name])

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """Return the whole case as named arrays, from which `from_arrays` makes the same case."""
        arrays: dict[str, ArrayLike] = {
            "nodes": self.interface.nodes,
            "slave_segments": self.interface.slave.faces,
            "master_segments": self.interface.master.faces,
            **{name: getattr(self, name) for name in ("z", "penalty", "seed", "name", "kind")},
            **{_PREFIX + name: values for name, values in self.parameters.items()},
        }
        return {name: np.asarray(values) for name, values in arrays.items()}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, ArrayLike]) -> Case:
        """Return the case whose `to_arrays` gave these arrays; a KeyError or MisuseError says that they are damaged."""
        slave, master = (Surface(np.asarray(arrays[f"{side}_segments"])) for side in ("slave", "master"))
        return cls(
            Interface(np.asarray(arrays["nodes"], dtype=np.float64), slave, master),
            np.asarray(arrays["z"], dtype=np.float64),
            float(np.asarray(arrays["penalty"])),
            {
                name.removeprefix(_PREFIX): np.asarray(values, dtype=np.float64)
                for name, values in arrays.items()
                if name.startswith(_PREFIX)
            },
            int(np.asarray(arrays["seed"])),
            str(np.asarray(arrays["name"])),
            kind=str(np.asarray(arrays.get("kind", ""))),
        )


@dataclass(frozen=True, slots=True)
class CaseSummary:
    """A case without its meshes, as a report stores it; two with equal summaries are taken for the same case."""

    n_slave_segments: int  # Numbers of segments.
    n_master_segments: int
    penalty: float  # Distributed stiffness ε̂, force per length per length of penetration.
    largest_coordinate: float  # The largest coordinate of state and reference, a length.
    shortest_segment: float  # The shortest current segment of both sides, a length.
    # {name: number} of the parameters that are one number each.
    parameters: Mapping[str, float] = field(default_factory=dict)
    name: str = ""  # The name of a case that has one ("C", "C′"), else empty.
    kind: str = ""  # The kind of situation, in words, of a case that has one, else empty.

    def __post_init__(self) -> None:
        clean(self, names=("name", "kind"))

    @classmethod
    def from_case(cls, case: Case) -> CaseSummary:
        """Return the summary of a case."""
        interface = case.interface
        return cls(
            n_slave_segments=len(interface.slave),
            n_master_segments=len(interface.master),
            penalty=case.penalty,
            largest_coordinate=case.largest_coordinate,
            shortest_segment=case.shortest_segment,
            parameters={name: values.item() for name, values in case.parameters.items() if values.size == 1},
            name=case.name,
            kind=case.kind,
        )


_Function = TypeVar("_Function", bound=Callable[..., Any])
ANSWERED = "meshes with a known answer"


@dataclass(frozen=True, slots=True)
class Cases:
    """The source of the cases of a property: random ones, random ones of several kinds, or a list.

    Call it with None for the property's own cases. Call it with an interface (or with the case of a scene, if the
    property is about bodies) for cases there; None comes back if the property cannot be checked there.

    Attributes
    ----------
    make : Callable[..., Any]
        The function that makes the cases.
    is_list : bool
        Whether they are a list, of which all are judged, whatever the number of examples.
    on_place : Callable[[Any], Any] | None
        Makes the cases on an interface or a scene, in place of the list; None if there are none.
    needs : str
        What an interface or a scene must be so that there are cases on it: "a flat interface". A run says it where
        there are none.
    faces : tuple[int, ...]
        The numbers of corners of the faces on which cases in space are made; empty for triangles alone.
    """

    make: Callable[..., Any]
    is_list: bool = False
    on_place: Callable[[Any], Any] | None = None
    needs: str = ANSWERED
    faces: tuple[int, ...] = ()

    @classmethod
    def random(cls, make: Callable[..., Any]) -> Cases:
        """Return random cases, of one kind of situation or of several with the same share.

        `make` takes None, an interface or a scene, and returns a hypothesis strategy of `Case`, {kind: strategy}, or
        None. Properties for which the same function makes the cases are judged on the same ones, if it has a name
        (`random_source`).
        """
        return cls(make, needs=needs_of_place(make))

    @classmethod
    def from_list(
        cls, make: Callable[[], tuple[Case, ...]], on_place: Callable[[Any], Any] | None = None, needs: str = ANSWERED
    ) -> Cases:
        """Return a list of cases, each with a name of its own; tables and reports call it by that name.

        On an interface or a scene, which must be what `needs` says, `on_place` returns a strategy, or None.
        """
        return cls(make, is_list=True, on_place=on_place, needs=needs)

    @property
    def takes_faces(self) -> bool:
        """True if the function makes cases in space with other faces than triangles, by an argument `faces`."""
        return "faces" in signature(self.make, follow_wrapped=False).parameters

    def on_faces(self, faces: tuple[int, ...]) -> Cases:
        """Return the cases on faces with these numbers of corners."""
        return self if faces == (TRIANGLE,) else replace(self, faces=faces)

    @property
    def random_source(self) -> str:
        """The stored name of the function, and the faces, on which the cases are others; empty without a name."""
        name = name_of_source(self.make)
        return name and f"{name}{self.on_which_faces}"

    @property
    def on_which_faces(self) -> str:
        """The faces in words, which follow a stored name; empty for triangles alone."""
        return f" on faces of {' or '.join(map(str, self.faces))} corners" if self.faces else ""

    def __call__(self, place: Any) -> Any:
        """Return the cases on an interface or a scene; on None, the property's own."""
        if not self.is_list:
            return self.make(place, self.faces) if self.faces else self.make(place)
        if place is None:
            return self.make(self.faces) if self.faces else self.make()
        return None if self.on_place is None else self.on_place(place)


def random_source(name: str, needs: str = "") -> Callable[[_Function], _Function]:
    """Return a decorator that stores a name, which no other function has, at a function that makes cases.

    Properties with this function are judged on the same cases. A function without a stored name has the id of its
    property instead. `needs` says what an interface or a scene must be so that there are cases: "a flat interface".
    """

    def store(function: _Function) -> _Function:
        function.__dict__.update(random_source=name, needs=needs)
        return function

    return store


def name_of_source(function: Callable[..., Any]) -> str:
    """Return the stored name of a function, or an empty string."""
    return str(getattr(function, "random_source", ""))


def needs_of_place(function: Callable[..., Any]) -> str:
    """Return the stored words about what a function that makes cases needs of an interface or a scene."""
    return str(getattr(function, "needs", "") or ANSWERED)
