"""A pairing: the discrete decisions of a formulation at one state, as read-only integers and booleans.

Rule for the next editor: a `Pairing` holds integers and booleans only, so that the residual is a smooth function of the
positions on a frozen pairing. One `Handle` is the exception, and the harness does not use such a pairing.
"""

from __future__ import annotations

from collections.abc import ItemsView, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactverif.contract.arrays import IntArray, freeze, freeze_together
from contactverif.contract.errors import ContractError
from contactverif.contract.interface import Interface

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
        return isinstance(other, Pairing) and self.same_as(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        entries = [f"{name}{values.shape}" for name, values in self._arrays.items()]
        return f"Pairing({', '.join([*entries, *(['a handle'] if self.opaque else [])])})"

    def check_bounds(self, interface: Interface) -> None:
        """Check that every integer can number something of the problem: a segment, node, unknown or entry, or −1.

        Parameters
        ----------
        interface : Interface
            The interface that the pairing belongs to.

        Raises
        ------
        ContractError
            If an integer is below −1, or larger than both the number of unknowns and the longest array of the pairing.
        """
        lowest, highest = self._integers.min(initial=0), self._integers.max(initial=0)
        if lowest >= -1 and highest <= interface.n_unknowns:
            return
        most = max(interface.n_unknowns, *(values.size for values in self._arrays.values()))
        if not -1 <= lowest <= highest <= most:
            outlier = lowest if lowest < -1 else highest
            name = next(name for name, values in self.items() if values.dtype == _INTEGER and (values == outlier).any())
            raise ContractError(f"pair: {name!r} holds {outlier}; needed integers from −1 to {most}")

    def same_as(self, other: Pairing) -> bool:
        """Return whether names, shapes and all values agree; what is in handles is not compared."""
        mine, others = self._arrays, other._arrays
        return (
            self.opaque is other.opaque
            and mine.keys() == others.keys()
            and all(
                values.shape == others[name].shape and values.tobytes() == others[name].tobytes()
                for name, values in mine.items()
            )
        )
