"""The contract between the harness and a contact formulation, and the signs and words of the whole house.

A formulation comes as a plugin: an entry point of the group ``contactverif.formulations`` names a factory ``make(*,
penalty, **options)``, which returns an object with the methods of `Formulation`. Only ``residual`` is required. The
harness reports what is missing as "not provided" and judges the rest. The harness chooses the penalty of each case.

Signs and words, which hold in every module, message and report:

slave, master
    The two surfaces. A formulation looks for contact at points of the slave and measures it against the master.
gap
    The signed distance of a slave point from the master, a length. It is **negative in penetration**.
normal
    The unit vector that points **out of the master body**, towards the slave.
pressure
    Force per length of the interface, **≥ 0** in compression.
residual
    The nodal forces, **internal minus external**: a slave node in contact is pushed along +normal by ``-residual``.
penalty
    The distributed stiffness ε̂, force per length per length of penetration: pressure = ε̂ |gap|. A nodal formulation
    (trait ``penalty="nodal"``) gets ε̂ × the mean length of the slave segments, force per length; in space ε̂ ×
    the area of the slave over the number of its nodes.
area of competence
    The part of the slave surface for which a contact point stands, a length.
xi
    The place of a projection on a master segment: 0 at its first node, 1 at its second, unclipped.
c
    The place of a point on a slave segment: −1 at its first node, +1 at its second.
virtual slave node
    A contact point that lies between the nodes of a slave segment.
z
    The state of an interface: the current positions of all nodes, flat, slave nodes first; behind them the multipliers.

Multipliers: a formulation that enforces contact by multipliers says how many it has by a method
``n_multipliers(interface) -> int``. The multipliers stand behind the positions in z, and the constraint rows behind the
forces in the residual: −area · gap where a constraint is active, area · λ where it is not. λ ≥ 0 is a pressure (trait
``penalty="distributed"``) or a nodal force (``"nodal"``). The area turns it into a force: it is the area of competence,
and 1 for a nodal force. A multiplier that sees nothing is not active; its area is not 0, or its row would be 0 = 0. The
penalty that the factory gets is then the scale c of the decision λ − c gap ≥ 0; no solution and no row depends on it.

Rule for the next editor: signs and words change here first, or not at all.
"""

from __future__ import annotations

from collections.abc import ItemsView, Iterator, Mapping
from dataclasses import dataclass, field, fields
from math import isfinite
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray, freeze, freeze_together
from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits

_INTEGER = np.dtype(np.int64)
_NEEDED = "needed an array of int64 or bool"


@dataclass(frozen=True, slots=True, eq=False)
class Handle:
    """An object that a pairing carries and nobody but the plugin looks into, such as a collision set of a library.

    Nobody can tell whether it hides real numbers. So a plugin whose pairing has a handle is judged as one without a
    pairing: the harness pairs anew at each state that it asks at. The handle never leaves the process of the plugin.

    Attributes
    ----------
    content : Any
        The object. The harness passes it back, and does nothing else with it.

    Examples
    --------
    A plugin returns a handle as one of the entries of its pairing, and finds its object in the attribute ``handle``:

    >>> from contactverif import Handle, Pairing
    >>> pairing = Pairing({"collisions": Handle("any object")})
    >>> pairing.handle, len(pairing)
    ('any object', 0)
    """

    content: Any


class Pairing(Mapping[str, NDArray[Any]]):
    """The discrete decisions of a formulation at one state: who touches whom, as integers and booleans only.

    A pairing is a flat mapping from names, which the plugin chooses, to read-only arrays of int64 or bool. Typical
    entries are the master segment of each slave node, which nodes are active, or the sparsity pattern of the tangent.

    Every real number (ξ, the normal, the area of competence) is computed from the positions, never stored here. So the
    residual is a smooth function of the positions on a frozen pairing, and a finite difference shows a forgotten term.
    A method ``pair`` may return a plain dict of arrays; the harness makes a `Pairing` of it. One of its values may be a
    `Handle`, which is no entry of the mapping.

    Parameters
    ----------
    arrays : Mapping[str, NDArray | Handle]
        The arrays by name. Integers number something (a segment, a node, an unknown, an entry of a pattern); −1 stands
        for nothing. At most one handle.

    Raises
    ------
    ContractError
        If a value is no array of int64 or bool, a name is no string, or there are several handles.

    Examples
    --------
    >>> import numpy as np
    >>> from contactverif import Pairing
    >>> pairing = Pairing({"master_segment": np.array([0, 0, -1]), "active": np.array([True, True, False])})
    >>> pairing["active"].sum()
    np.int64(2)
    >>> pairing
    Pairing(master_segment(3,), active(3,))
    """

    __slots__ = ("_arrays", "_handle", "_integers")

    def __init__(self, arrays: Mapping[str, Any]) -> None:
        if not isinstance(arrays, Mapping):
            raise ContractError(f"pair: returned a {type(arrays).__name__}; needed a mapping from names to arrays")
        self._arrays: dict[str, NDArray[Any]] = {}
        integers: dict[str, IntArray] = {}
        handles = []
        for name, values in arrays.items():
            if not isinstance(name, str):
                raise ContractError(f"pair: the name {name!r} is a {type(name).__name__}; needed a string")
            if isinstance(values, Handle):
                handles.append(values)
                continue
            if not isinstance(values, np.ndarray):
                raise ContractError(f"pair: {name!r} is a {type(values).__name__}; {_NEEDED}")
            array = np.asarray(values)  # A subclass may say of itself what it likes.
            if array.dtype == _INTEGER:
                self._arrays[name] = integers[name] = array
            elif array.dtype == np.bool_:
                self._arrays[name] = freeze(array, np.bool_)
            else:
                raise ContractError(f"pair: {name!r} is dtype {array.dtype}; {_NEEDED}")
        if len(handles) > 1:
            raise ContractError(f"pair: returned {len(handles)} handles; needed at most one")
        *parts, self._integers = freeze_together(integers.values(), np.int64)
        self._arrays.update(zip(integers, parts, strict=True))
        self._handle = handles[0] if handles else None

    @property
    def opaque(self) -> bool:
        """Return whether the pairing has a handle, so that nobody knows all of it."""
        return self._handle is not None

    @property
    def handle(self) -> Any:
        """The object in the handle; None without a handle."""
        return None if self._handle is None else self._handle.content

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._arrays[name]

    def items(self) -> ItemsView[str, NDArray[Any]]:
        """Return the names with their arrays."""
        return self._arrays.items()

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __eq__(self, other: object) -> bool:
        """Return whether names, shapes and all values agree; what is in handles is not compared."""
        if not isinstance(other, Pairing) or self.opaque is not other.opaque:
            return False
        mine, others = ({name: (a.shape, a.tobytes()) for name, a in each.items()} for each in (self, other))
        return mine == others

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        entries = [f"{name}{values.shape}" for name, values in self._arrays.items()]
        return f"Pairing({', '.join([*entries, *(['a handle'] if self.opaque else [])])})"

    def check_bounds(self, interface: Interface) -> None:
        """Raise a ContractError unless every integer can number something of the problem.

        That is −1, a segment, node or unknown, a pair of these or a point, or an entry of the longest array.
        """
        lowest, highest = self._integers.min(initial=0), self._integers.max(initial=0)
        if lowest >= -1 and highest <= interface.n_unknowns:
            return
        # Where points that touch nothing are left out, the others have larger numbers than arrays are long.
        most = max(interface.n_unknowns**2, *(values.size for values in self._arrays.values()))
        if not -1 <= lowest <= highest <= most:
            outlier = lowest if lowest < -1 else highest
            name = next(name for name, values in self.items() if values.dtype == _INTEGER and (values == outlier).any())
            raise ContractError(f"pair: {name!r} holds {outlier}; needed integers from −1 to {most}")


@dataclass(frozen=True, slots=True, eq=False)
class ContactPoints:
    """The points at which a formulation looks for contact, and what it finds there.

    `Formulation.contact_points` returns them, for pictures and for properties that judge gaps and pressures. A number
    that means nothing for a formulation is NaN; an integer is −1. A point with a pressure has a normal. In space, where
    `on_faces` makes the points, segments are faces, and shape functions say where a point lies; `c`, `xi`, `area_from`
    and `area_to` are NaN.

    Attributes
    ----------
    slave_segment : IntArray, shape (n_points,)
        The number of the slave segment that carries the point.
    c : FloatArray, shape (n_points,)
        The place on that segment: −1 at its first node, +1 at its second.
    master_segment : IntArray, shape (n_points,)
        The number of the master segment that the gap is measured against.
    xi : FloatArray, shape (n_points,)
        The place of the foot on the master segment: 0 at its first node, 1 at its second, unclipped.
    position : FloatArray, shape (n_points, dim)
        The current position of the point, a length each.
    normal : FloatArray, shape (n_points, dim)
        The unit vector out of the master body.
    gap : FloatArray, shape (n_points,)
        The gap, a length, negative in penetration.
    pressure : FloatArray, shape (n_points,)
        The pressure, force per length of the interface, ≥ 0. A nodal formulation gives the nodal force instead.
    weight : FloatArray, shape (n_points,)
        The length that the pressure acts on, the area of competence. A nodal formulation gives 1.
    active : BoolArray, shape (n_points,)
        True where the point is in contact.
    area_from, area_to : FloatArray, shape (n_points,)
        The two ends of the area of competence on the slave segment, measured as `c`.
    weighted : BoolArray, shape (n_points,), optional
        False for a point: its gap is measured where it is, and its pressure acts there. True for a weighted node, as a
        mortar method has them: gap and pressure are means over the shape of the node, and `weight` is ∫ of the shape.
        One value stands for all points; False by default.
    on_master : BoolArray, shape (n_points,), optional
        True for a point of a second pass, which lies on the master and looks for the slave. All other fields of such a
        point have the roles exchanged: `slave_segment` is the number of the master segment that carries it,
        `master_segment` that of the slave segment opposite, and the normal points out of the slave body. One value
        stands for all points; False by default.
    slave_shape, master_shape : FloatArray, shape (n_points, n_corners), optional
        In space, the shape functions of the corners of the slave face at the point, and of those of the master face at
        its foot. In the plane there are none, shape (n_points, 0).

    See Also
    --------
    ContactPoints.on_faces : Make points of an interface in space.
    """

    slave_segment: IntArray
    c: FloatArray
    master_segment: IntArray
    xi: FloatArray
    position: FloatArray
    normal: FloatArray
    gap: FloatArray
    pressure: FloatArray
    weight: FloatArray
    active: BoolArray
    area_from: FloatArray
    area_to: FloatArray
    weighted: BoolArray = field(default_factory=lambda: np.zeros((), np.bool_))
    on_master: BoolArray = field(default_factory=lambda: np.zeros((), np.bool_))
    slave_shape: FloatArray = field(default_factory=lambda: np.zeros(()))
    master_shape: FloatArray = field(default_factory=lambda: np.zeros(()))

    def __post_init__(self) -> None:
        n_points = len(np.atleast_1d(np.asarray(self.slave_segment)))
        for name, dtype, n_axes in _COLUMNS:
            raw = np.asarray(getattr(self, name))
            # Otherwise 0.7 would become segment 0.
            if raw.dtype != dtype and raw.size and not np.can_cast(raw.dtype, dtype, casting="safe"):
                raise MisuseError(f"ContactPoints.{name}", f"dtype {raw.dtype}", dtype.name)
            if raw.ndim == 0 and name in _FOR_ALL_POINTS:
                raw = np.full((n_points, 0)[:n_axes], raw)
            values: NDArray[Any] = freeze(raw, dtype.type)
            if values.ndim != n_axes or len(values) != n_points:
                second = "" if n_axes == 1 else " n_corners" if name.endswith("shape") else " dim"
                raise MisuseError(f"ContactPoints.{name}", f"shape {values.shape}", f"({n_points},{second})")
            object.__setattr__(self, name, values)

    @classmethod
    def on_faces(cls, **arrays: Any) -> ContactPoints:
        """Return points of an interface in space, from the attributes by name; what is NaN there may be left out.

        Examples
        --------
        >>> import numpy as np
        >>> from contactverif import ContactPoints
        >>> third = np.full((1, 3), 1 / 3)
        >>> places = {"slave_segment": np.array([0]), "slave_shape": third, "position": np.zeros((1, 3))}
        >>> feet = {"master_segment": np.array([0]), "master_shape": third, "normal": np.array([[0.0, 0.0, 1.0]])}
        >>> numbers = {"gap": np.zeros(1), "pressure": np.zeros(1), "weight": np.ones(1), "active": np.array([False])}
        >>> ContactPoints.on_faces(**places, **feet, **numbers).c
        array([nan])
        """
        unknown = np.full(np.shape(arrays["slave_segment"]), np.nan)
        return cls(**(dict.fromkeys(("c", "xi", "area_from", "area_to"), unknown) | arrays))

    def select(self, selection: BoolArray | IntArray) -> ContactPoints:
        """Return some of the points, selected by mask (n_points,) or by number."""
        return ContactPoints(**{name: getattr(self, name)[selection] for name, *_ in _COLUMNS})


_OF_TWO_AXES = ("position", "normal", "slave_shape", "master_shape")
_FOR_ALL_POINTS = ("weighted", "on_master", "slave_shape", "master_shape")  # Fields of which one value is enough.
_DTYPES = {"IntArray": np.dtype(np.int64), "BoolArray": np.dtype(np.bool_), "FloatArray": np.dtype(np.float64)}
# The name of each field, its dtype and its number of axes.
_COLUMNS = [
    (entry.name, _DTYPES[str(entry.type)], 2 if entry.name in _OF_TWO_AXES else 1) for entry in fields(ContactPoints)
]


class ResidualOnly(Protocol):
    """The least that a plugin is: an object with a residual.

    Nothing else is required. Without ``pair`` the residual gets ``pairing=None``; without ``tangent`` the harness
    differentiates the residual where it needs a tangent. Each missing part is reported as "not provided".

    Examples
    --------
    A penalty on every slave node below the straight line y = 0, the whole plugin:

    >>> import numpy as np
    >>> from contactverif import Interface
    >>> class Floor:
    ...     def __init__(self, *, penalty):
    ...         self.penalty = penalty
    ...     def residual(self, interface, pairing, z):
    ...         n_slave = interface.n_slave_nodes
    ...         forces = np.zeros_like(z)
    ...         y = z[..., 1 : 2 * n_slave : 2]
    ...         forces[..., 1 : 2 * n_slave : 2] = self.penalty * np.where(y < 0, y, 0)
    ...         return forces
    >>> interface = Interface.from_chains([[0, 0], [1, 0]], [[1, 0], [0, 0]])
    >>> z = np.array([0, -0.5, 1, 0.25, 1, 0, 0, 0])  # the first slave node penetrates by 0.5
    >>> Floor(penalty=10.0).residual(interface, None, z)[:4]  # -residual pushes it upwards
    array([ 0., -5.,  0.,  0.])
    """

    def residual(self, interface: Interface, pairing: Pairing | None, z: Array, /) -> Array:
        """Return the nodal forces at a state, internal minus external. Required.

        Parameters
        ----------
        interface : Interface
            The meshes in their reference configuration.
        pairing : Pairing | None
            What ``pair`` returned; None if the plugin has no ``pair``. Decisions are taken from here, so that the
            residual is smooth on a frozen pairing.
        z : Array, shape (..., n_unknowns)
            The current positions of all nodes, flat, slave nodes first; behind them the multipliers, if the formulation
            has any. The leading axes are a batch of states; only plugins with the trait ``batched`` get one.

        Returns
        -------
        Array, shape (..., n_unknowns)
            The forces in the shape and dtype of z; behind them the constraint rows, if there are multipliers.
            A slave node in contact is pushed along +normal by ``-residual``.
        """
        ...


class Formulation(ResidualOnly, Protocol):
    """The whole contract of a contact formulation.

    A factory ``make(*, penalty, **options)`` returns an object with these methods. ``residual`` is required;
    ``traits``, ``pair``, ``tangent`` and ``contact_points`` are optional. ``residual_and_tangent`` is optional too: it
    saves time and answers nothing new. A formulation with multipliers has one method more, ``n_multipliers(interface)
    -> int``. The harness calls ``pair`` at a state, then the other methods with that
    pairing, at the same state or at states around it. The methods keep no state between calls: the same arguments give
    the same answer. All arrays that the harness passes are read-only.

    See Also
    --------
    ResidualOnly : The required part, with a small example.
    CheckedFormulation : A formulation as the harness uses it, every answer checked.
    """

    @property
    def traits(self) -> Traits:
        """The promises of the formulation. Optional; without it nothing is promised."""
        ...

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing | Mapping[str, NDArray[Any]]:
        """Decide who touches whom at one state z (n_unknowns,): current positions, then multipliers. Optional.

        The answer is named arrays of integers and booleans. Every real number is computed from z in the other methods.
        """
        ...

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> Any:
        """Return the derivative of the residual at one state z (n_unknowns,), on a frozen pairing. Optional.

        It is an array or a matrix of scipy.sparse, (n_unknowns, n_unknowns). Row i, column j holds ∂residual_i/∂z_j;
        rows and columns of multipliers come last.
        """
        ...

    def residual_and_tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> tuple[FloatArray, Any]:
        """Return the residual and its derivative at one state, in one sweep over the interface. Optional.

        Newton's method needs both at each iterate, and they share most of their work. A plugin that has this method has
        ``tangent`` too. The answers may differ from those of the two methods by roundoff; the property ``purity``
        compares them.
        """
        ...

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return where the formulation looks for contact at one state, and what it finds there. Optional.

        All contact points are told, active or not.
        """
        ...


def evaluate_both(plugin: Any, interface: Interface, pairing: Pairing | None, z: FloatArray) -> tuple[FloatArray, Any]:
    """Return residual and tangent of a plugin at one state: in one call where it offers that, else in two.

    The plugin is a formulation with a tangent, as its factory returned it or checked. The other arguments and both
    answers are those of `Formulation`.

    Examples
    --------
    >>> from contactverif import evaluate_both, load_formulation, named_case
    >>> case = named_case("offset-c")
    >>> formulation = load_formulation("vts-ppt").for_case(case)
    >>> pairing = formulation.pair(case.interface, case.z)
    >>> residual, tangent = evaluate_both(formulation, case.interface, pairing, case.z)
    >>> residual.shape, tangent.shape
    ((24,), (24, 24))
    """
    if callable(both := getattr(plugin, "residual_and_tangent", None)):
        residual, tangent = both(interface, pairing, z)
        return residual, tangent
    return plugin.residual(interface, pairing, z), plugin.tangent(interface, pairing, z)


MOST_POINTS = 1000  # Virtual slave nodes, or Gauss points, on a slave segment.

_Choice = TypeVar("_Choice")


def choose(option: str, word: str, choices: Mapping[str, _Choice]) -> _Choice:
    """Return the value that the word of an option stands for."""
    if not isinstance(word, str) or word not in choices:
        raise MisuseError(option, repr(word), " or ".join(map(repr, choices)))
    return choices[word]


def check_penalty(penalty: float) -> float:
    """Return the penalty as a float."""
    if isinstance(penalty, bool) or not isinstance(penalty, int | float) or not (isfinite(penalty) and penalty > 0):
        raise MisuseError("penalty", repr(penalty), "a finite number > 0")
    return float(penalty)


def check_count(n: int, name: str = "n", least: int = 1) -> int:
    """Return the option n, the number of points on a slave segment, or another option that counts, by its name."""
    if isinstance(n, bool) or not isinstance(n, int) or not least <= n <= MOST_POINTS:
        raise MisuseError(name, repr(n), f"a whole number from {least} to {MOST_POINTS}")
    return n


def check_tau(tau: float) -> float:
    """Return τ, the part of a master segment by which a foot may lie past its free end, as a float."""
    if isinstance(tau, bool) or not isinstance(tau, int | float) or not 0 <= tau < 1:
        raise MisuseError("tau", repr(tau), "a number ≥ 0 and < 1")
    return float(tau)
