"""Libraries with the functions of `contactverif.h` as formulations: decisions in integers, elements, assembly.

With `cv_pair` the decisions are a pairing like any other. Without it the element decides by itself, and what the
harness chooses travels in a `Handle`.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.interface import Interface
from contactverif.contract.option_checks import check_penalty
from contactverif.contract.pairing import Handle, Pairing
from contactverif.contract.traits import Traits
from contactverif_foreign.c_view import (
    Views,
    arguments_of,
    find_windows,
    segment_views,
    view_numbers,
    view_words,
    whole_interface,
)
from contactverif_foreign.guarded_slot import GuardedSlot, SlotRows
from contactverif_foreign.shared_library import find_file, find_function, load_library, parse_numbers
from contactverif_foreign.traits_file import parse_traits_text, traits_beside
from contactverif_foreign.user_element import assemble, unknowns_of

VERSION = 1  # `CV_VERSION` of `contactverif.h`.
_ROOM = 16  # Integers that `cv_pair` may write in its first call.


@dataclass(frozen=True, slots=True, eq=False)
class _Functions:
    """The functions of a library, with the memory of their calls."""

    element: Any
    pair: Any  # None if the library has none.
    slots: dict[tuple[Any, ...], GuardedSlot] = field(default_factory=dict)

    def slot(self, shape: tuple[int, ...], n_props: int, n_decisions: int, *, pairs: bool) -> GuardedSlot:
        """Return the memory of a call of `cv_pair` or of `cv_element`."""
        key = shape, n_props, n_decisions, pairs
        if key not in self.slots:
            slot = GuardedSlot(arguments_of(shape, n_props, n_decisions, pairs=pairs), 2 * (shape[0] + shape[1]))
            slot.preset({"view": view_words(slot.addresses, shape, n_props)})
            self.slots[key] = slot
        return self.slots[key]


@dataclass(frozen=True, slots=True, eq=False)
class LibraryForces:
    """A formulation whose forces come from a library."""

    traits: Traits
    penalty: float
    functions: _Functions
    elements: str  # "segment" or "interface".
    props: tuple[float, ...]
    order: str  # "row" or "column".

    def pair(self, interface: Interface, z: FloatArray, /) -> dict[str, Any]:
        """Choose what each element is shown, and let the library decide."""
        x = z.reshape(-1, 2)
        windows = find_windows(interface, x) if self.elements == "segment" else {}
        if self.functions.pair is None:
            return {"windows": Handle(windows)}
        lists: dict[int, IntArray] = {}
        for views in self._views(interface, windows):
            lists.update(self._decide(interface, views, x))
        decisions = [lists[place] for place in sorted(lists)]
        starts = np.cumsum([0, *map(len, decisions)])
        return {**windows, "decision": np.concatenate(decisions), "decision_start": starts}

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the nodal forces (n_unknowns,)."""
        forces: Array = np.zeros(z.size)
        for views, decisions in self._groups(interface, pairing):
            rows = self._call(interface, views, decisions, z.reshape(-1, 2), with_tangent=False)
            np.add.at(forces, unknowns_of(views.nodes), rows["residual"])
        return forces

    def _views(self, interface: Interface, windows: Mapping[str, Any]) -> list[Views]:
        return segment_views(interface, windows) if self.elements == "segment" else whole_interface(interface)

    def _groups(self, interface: Interface, pairing: Pairing) -> list[tuple[Views, IntArray]]:
        """Return elements with as many nodes and decisions together, and their decisions (n, n_decisions)."""
        if self.functions.pair is None:
            every = self._views(interface, pairing.handle)
            return [(views, np.zeros((len(views.places), 0), dtype=np.int64)) for views in every]
        starts, groups = pairing["decision_start"], []
        counts = np.diff(starts)
        for views in self._views(interface, pairing):
            for count in np.unique(counts[views.places]):
                some = views.select(counts[views.places] == count)
                decisions = pairing["decision"][starts[some.places][:, None] + np.arange(count)]
                groups.append((some, decisions))
        return groups

    def _rows(self, slot: GuardedSlot, interface: Interface, views: Views, x: FloatArray) -> SlotRows:
        """Return the memory of a sweep over elements, with all that they are shown."""
        n_elements = len(views.nodes)
        rows = slot.rows(n_elements)
        content = {"reference": interface.nodes[views.nodes], "x": x[views.nodes], **views.arrays}
        for name, array in content.items():
            rows[name][...] = array.reshape(1 if array.ndim == 2 else n_elements, -1)
        rows.fill({"props": self.props})
        view_numbers(rows["view"], views.labels, self.penalty)
        return rows

    def _decide(self, interface: Interface, views: Views, x: FloatArray) -> dict[int, IntArray]:
        """Return the integers of each element by its place."""
        room = _ROOM
        while True:
            slot = self.functions.slot(views.shape, len(self.props), room, pairs=True)
            rows = self._rows(slot, interface, views, x)
            values = [slot.addresses["view"], room, slot.addresses["decisions"]]
            counts = rows.call(self.functions.pair, values, lambda row: f"cv_pair: {_describe(views, row)}")
            if (least := min(counts)) < 0:
                raise ContractError(f"cv_pair: {_describe(views, counts.index(least))}: returned {least}; needed ≥ 0")
            if max(counts) <= room:
                integers = rows["decisions"].astype(np.int64)
                return {int(place): integers[row, : counts[row]] for row, place in enumerate(views.places)}
            _check_count(max(counts), interface)
            room = max(counts)

    def _call(
        self, interface: Interface, views: Views, decisions: IntArray, x: FloatArray, *, with_tangent: bool
    ) -> SlotRows:
        """Call `cv_element` for each element, and return its memory with the answers."""
        slot = self.functions.slot(views.shape, len(self.props), decisions.shape[1], pairs=False)
        rows = self._rows(slot, interface, views, x)
        rows.fill({"decisions": decisions})
        address = slot.addresses
        values = [address["view"], decisions.shape[1], address["decisions"], address["residual"]]
        values.append(address["tangent"] if with_tangent else None)
        statuses = rows.call(self.functions.element, values, lambda row: f"cv_element: {_describe(views, row)}")
        for row, status in enumerate(statuses):
            if status:
                raise ContractError(f"cv_element: {_describe(views, row)}: returned {status}; needed 0")
        return rows


@dataclass(frozen=True, slots=True, eq=False)
class LibraryElements(LibraryForces):
    """A formulation whose forces and tangents come from a library."""

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> Any:
        """Return the derivative of the residual as the library computes it, sparse."""
        return self.residual_and_tangent(interface, pairing, z)[1]

    def residual_and_tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> tuple[FloatArray, Any]:
        """Return the residual and its derivative from one call of each element."""
        parts = []
        for views, decisions in self._groups(interface, pairing):
            answer = self._call(interface, views, decisions, z.reshape(-1, 2), with_tangent=True)
            parts.append((unknowns_of(views.nodes), answer["residual"], answer["tangent"]))
        return assemble(z.size, parts, by_columns=self.order == "column")


def _describe(views: Views, row: int) -> str:
    return "the interface" if views.labels[row] < 0 else f"slave segment {views.labels[row]}"


def _check_count(count: int, interface: Interface) -> None:
    """Refuse a number of decisions for which there may be no room."""
    if count > (most := 1000 * interface.n_unknowns):
        raise ContractError(f"cv_pair: returned {count}; needed at most {most} on this interface")


def c(
    *,
    penalty: float,
    file: str,
    elements: Literal["segment", "interface"] = "segment",
    order: Literal["row", "column"] = "row",
    tangent: bool = True,
    props: float | str = "",
    traits: str = "",
) -> LibraryForces:
    """Load a formulation from a shared library with the functions of `contactverif.h`.

    Parameters
    ----------
    penalty : float
        The stiffness, nodal or distributed, as the trait `penalty` says.
    file : str
        The shared library, absolute or relative to the working folder.
    elements : Literal["segment", "interface"]
        "segment": an element is a slave segment with the part of a master chain near it. "interface": it is all nodes.
    order : Literal["row", "column"]
        The order of the tangent: row by row as in C, or column by column as in Fortran.
    tangent : bool
        False for a library that computes no tangent; it gets NULL in place of one.
    props : float | str
        The numbers that the library gets as `props`, with ":" between them.
    traits : str
        A TOML file with the traits. Without it `cv_traits` counts, and without that the file beside the library, see
        `traits_beside`.
    """
    check_penalty(penalty)
    path = find_file(file)
    make = LibraryElements if tangent else LibraryForces
    numbers = parse_numbers("option props", props)
    return make(_read_traits(path, traits), float(penalty), _load_functions(path), elements, numbers, order)


@lru_cache(maxsize=16)  # A formulation is made anew for the penalty of each case.
def _load_functions(path: Path) -> _Functions:
    """Return the functions of a library of this version."""
    library = load_library(path)
    version = find_function(library, path, "cv_version")()
    if version != VERSION:
        needed = f"{VERSION}, that of contactverif.h of this contactverif"
        raise MisuseError("option file", f"{path.name} of version {version}", needed)
    pointer, number = ctypes.c_void_p, ctypes.c_int
    element = find_function(library, path, "cv_element")
    element.argtypes = [pointer, number, pointer, pointer, pointer]
    pair = find_function(library, path, "cv_pair") if hasattr(library, "cv_pair") else None
    if pair is not None:
        pair.argtypes = [pointer, number, pointer]
    return _Functions(element, pair)


@lru_cache(maxsize=16)
def _read_traits(path: Path, file: str) -> Traits:
    """Return the traits of a library: those of a file that the user names, what it says itself, or a file beside it."""
    library = load_library(path)
    if file or not hasattr(library, "cv_traits"):
        return traits_beside(path, file)
    function = find_function(library, path, "cv_traits")
    function.restype = ctypes.c_char_p
    text = function()
    return traits_beside(path) if text is None else parse_traits_text(text.decode("utf-8", "replace"), "cv_traits")
