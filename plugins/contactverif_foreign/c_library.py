"""Libraries with the functions of `contactverif.h` as formulations: decisions in integers, elements, assembly.

With `cv_pair` the decisions are a pairing like any other. Without it the element decides by itself, and what the
harness chooses travels in a `Handle`. An element is shown a part of the interface, in the form of `cv_view`.
"""

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from contactverif.compiler import compile_maker
from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.formulation import Handle, Pairing, check_penalty
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits
from contactverif.geometry.block_rows import TangentOfBoth
from contactverif.geometry.projection import PointOnSegment, Tree, nearest_segment, node, search_tree
from contactverif_foreign import shared_library
from contactverif_foreign.element_pairs import walk_chains
from contactverif_foreign.shared_library import Argument, GuardedSlot, SlotRows
from contactverif_foreign.user_element import assemble, unknowns_of

OUTSIDE = -2  # The neighbour does not belong to the element.
_PLACES = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])  # Places on a slave segment whose nearest master segments it is shown.
_ARRAYS = ("reference", "x", "slave", "master", "slave_neighbours", "master_neighbours", "props")
_NUMBERS = ("n_slave_nodes", "n_master_nodes", "n_slave_segments", "n_master_segments", "n_props", "number")


class _View(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_int) for name in _NUMBERS),
        ("penalty", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in _ARRAYS),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """Elements that have the same numbers of nodes and segments."""

    places: IntArray  # (n,), the places of the elements in the pairing.
    labels: IntArray  # (n,), their slave segments; −1 for the whole interface.
    nodes: IntArray  # (n, n_nodes), slave nodes first.
    n_slave_nodes: int
    arrays: dict[str, Array]  # The arrays of segments and neighbours, (n_segments, 2) or (n, n_segments, 2).

    def describe(self, row: int) -> str:
        """Return which part of the interface an element is."""
        return "the interface" if self.labels[row] < 0 else f"slave segment {self.labels[row]}"

    @property
    def shape(self) -> tuple[int, ...]:
        """The numbers of slave nodes, master nodes, slave segments and master segments."""
        segments = (self.arrays[name].shape[-2] for name in ("slave", "master"))
        return (self.n_slave_nodes, self.nodes.shape[1] - self.n_slave_nodes, *segments)

    def select(self, selection: BoolArray) -> "Views":
        """Return some of the elements, selected by mask (n,)."""
        arrays = {name: array if array.ndim == 2 else array[selection] for name, array in self.arrays.items()}
        return Views(self.places[selection], self.labels[selection], self.nodes[selection], self.n_slave_nodes, arrays)


def find_windows(interface: Interface, x: FloatArray) -> dict[str, IntArray]:
    """Return the slave segments of elements at x (n_nodes, 2), and the master segments that each is shown.

    A slave segment is shown the master segments nearest to five places on it, those between them and one more on each
    side, in the order of a walk along their chain. If they belong to several chains, there are several elements.
    """
    slave, master = interface.slave, interface.master
    nearest = _find_nearest(x, slave.segments, master.segments, search_tree(master, x), _PLACES)
    chains = [(segments, is_closed) for segments, _, is_closed in walk_chains(master)]
    chain_of, place_of = np.empty(len(master), dtype=np.int64), np.empty(len(master), dtype=np.int64)
    for number, (segments, _) in enumerate(chains):
        chain_of[segments], place_of[segments] = number, np.arange(len(segments))
    places, keys = place_of[nearest], chain_of[nearest] + len(chains) * np.arange(len(slave))[:, None]
    every, element = np.unique(keys, return_inverse=True)  # An element for each slave segment and chain.
    element = element.reshape(keys.shape)
    low, high = np.full(len(every), len(master)), np.full(len(every), -1)
    np.minimum.at(low, element, places)
    np.maximum.at(high, element, places)
    windows = []
    for number, (first, last) in enumerate(zip(low.tolist(), high.tolist(), strict=True)):
        segments, is_closed = chains[every[number] % len(chains)]
        if is_closed:  # From the first to the last of the places, around the largest gap between them.
            ordered, length = np.unique(places[element == number]), len(segments)
            gaps = np.diff(ordered, append=ordered[0] + length)
            widest = int(np.argmax(gaps))
            start, count = ordered[(widest + 1) % len(ordered)] - 1, min(length - gaps[widest] + 3, length)
            windows.append(segments[(start + np.arange(count)) % length])
        else:
            windows.append(segments[max(first - 1, 0) : last + 2])
    starts, segments = np.cumsum([0, *map(len, windows)]), np.concatenate(windows)
    return {"slave_segment": every // len(chains), "master_segment": segments, "master_start": starts}


@compile_maker
def _find_nearest(x: FloatArray, slave: IntArray, master: IntArray, tree: Tree, places: FloatArray) -> IntArray:
    order, boxes = tree
    nearest = np.empty((len(slave), len(places)), dtype=np.int64)
    for s in range(len(slave)):
        for i in range(len(places)):
            v = PointOnSegment(node(x, slave[s, 0]), node(x, slave[s, 1]), places[i])
            nearest[s, i] = max(nearest_segment(v, x, master, order, boxes), 0)
    return nearest


def segment_views(interface: Interface, pairing: Any) -> list[Views]:
    """Return the elements of a pairing of `find_windows`, those with equally many master segments together."""
    starts, views = pairing["master_start"], []
    widths = np.diff(starts)
    master, slave = interface.master, interface.slave
    for width in np.unique(widths):
        among = np.flatnonzero(widths == width)
        window = pairing["master_segment"][starts[among][:, None] + np.arange(width)]  # (n, width)
        is_ring = master.neighbours[window[:, -1], 1] == window[:, 0]
        for ring in np.unique(is_ring):
            places, segments = among[is_ring == ring], window[is_ring == ring]
            labels = pairing["slave_segment"][places]
            nodes = [slave.segments[labels], master.segments[segments, 0]]
            if not ring:
                nodes.append(master.segments[segments[:, -1:], 1])
            number = np.arange(width)
            neighbours = np.tile(np.column_stack([number - 1, number + 1]), (len(places), 1, 1))
            for place, way, other_end in ((0, 0, width - 1), (-1, 1, 0)):
                behind = master.neighbours[segments[:, place], way]
                neighbours[:, place, way] = other_end if ring else np.where(behind < 0, -1, OUTSIDE)
            arrays = {
                "slave": np.array([[0, 1]]),
                "master": 2 + np.column_stack([number, (number + 1) % width if ring else number + 1]),
                "slave_neighbours": np.where(slave.neighbours[labels] < 0, -1, OUTSIDE)[:, None],
                "master_neighbours": neighbours,
            }
            views.append(Views(places, labels, np.hstack(nodes), 2, arrays))
    return views


VERSION = 1  # `CV_VERSION` of `contactverif.h`.
_ROOM = 16  # Integers that `cv_pair` may write in its first call.


@dataclass(frozen=True, slots=True, eq=False)
class _Functions:
    element: Any
    pair: Any  # None if the library has none.
    slots: dict[tuple[Any, ...], GuardedSlot] = field(default_factory=dict)

    def slot(self, shape: tuple[int, ...], n_props: int, n_decisions: int, *, pairs: bool) -> GuardedSlot:
        """Return the memory of a call of `cv_pair` or of `cv_element`."""
        key = shape, n_props, n_decisions, pairs
        if key not in self.slots:
            n_slave, n_master, n_slave_segments, n_master_segments = shape
            n_nodes, size = n_slave + n_master, 2 * (n_slave + n_master)
            arguments = [
                Argument("view", (ctypes.sizeof(_View) // 4,), "integer"),
                *(Argument(name, (n_nodes, 2)) for name in ("reference", "x")),
                *(Argument(name, (n_slave_segments, 2), "integer") for name in ("slave", "slave_neighbours")),
                *(Argument(name, (n_master_segments, 2), "integer") for name in ("master", "master_neighbours")),
                Argument("props", (n_props,)),
                Argument("decisions", (n_decisions,), "integer", not pairs),
            ]
            if not pairs:
                arguments.append(Argument("residual", (size,), is_input=False))
                arguments.append(Argument("tangent", (size, size), is_input=False))
            slot = GuardedSlot(arguments, size)
            view = _View(*shape, n_props, 0, 0.0, *(slot.addresses[name] for name in _ARRAYS))
            slot.preset({"view": np.frombuffer(bytes(view), np.int32)})  # `_rows` writes number and penalty.
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
        if self.elements == "segment":
            return segment_views(interface, windows)
        label: IntArray = np.array([-1])
        sides = {"slave": interface.slave, "master": interface.master}
        arrays = {name: side.segments for name, side in sides.items()}
        arrays |= {f"{name}_neighbours": side.neighbours for name, side in sides.items()}
        return [Views(label + 1, label, np.arange(interface.n_nodes)[None], interface.n_slave_nodes, arrays)]

    def _groups(self, interface: Interface, pairing: Pairing) -> list[tuple[Views, IntArray]]:
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
        n_elements = len(views.nodes)
        rows = slot.rows(n_elements)
        content = {"reference": interface.nodes[views.nodes], "x": x[views.nodes], **views.arrays}
        for name, array in content.items():
            rows[name][...] = array.reshape(1 if array.ndim == 2 else n_elements, -1)
        rows.fill({"props": self.props})
        start = _View.penalty.offset // 4
        rows["view"][:, _View.number.offset // 4] = views.labels
        rows["view"][:, start : start + 2] = np.array([self.penalty]).view(np.int32)
        return rows

    def _decide(self, interface: Interface, views: Views, x: FloatArray) -> dict[int, IntArray]:
        room = _ROOM
        while True:
            slot = self.functions.slot(views.shape, len(self.props), room, pairs=True)
            rows = self._rows(slot, interface, views, x)
            values = [slot.addresses["view"], room, slot.addresses["decisions"]]
            counts = rows.call(self.functions.pair, values, lambda row: f"cv_pair: {views.describe(row)}")
            if (least := min(counts)) < 0:
                raise ContractError(f"cv_pair: {views.describe(counts.index(least))}: returned {least}; needed ≥ 0")
            if max(counts) <= room:
                integers = rows["decisions"].astype(np.int64)
                return {int(place): integers[row, : counts[row]] for row, place in enumerate(views.places)}
            room = max(counts)
            if room > (most := 1000 * interface.n_unknowns):
                raise ContractError(f"cv_pair: returned {room}; needed at most {most} on this interface")

    def _call(
        self, interface: Interface, views: Views, decisions: IntArray, x: FloatArray, *, with_tangent: bool
    ) -> SlotRows:
        slot = self.functions.slot(views.shape, len(self.props), decisions.shape[1], pairs=False)
        rows = self._rows(slot, interface, views, x)
        rows.fill({"decisions": decisions})
        address = slot.addresses
        values = [address["view"], decisions.shape[1], address["decisions"], address["residual"]]
        values.append(address["tangent"] if with_tangent else None)
        statuses = rows.call(self.functions.element, values, lambda row: f"cv_element: {views.describe(row)}")
        for row, status in enumerate(statuses):
            if status:
                raise ContractError(f"cv_element: {views.describe(row)}: returned {status}; needed 0")
        return rows


@dataclass(frozen=True, slots=True, eq=False)
class LibraryElements(TangentOfBoth, LibraryForces):
    """A formulation whose forces and tangents come from a library."""

    def residual_and_tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> tuple[FloatArray, Any]:
        """Return the residual and its derivative from one call of each element."""
        parts = []
        for views, decisions in self._groups(interface, pairing):
            answer = self._call(interface, views, decisions, z.reshape(-1, 2), with_tangent=True)
            parts.append((unknowns_of(views.nodes), answer["residual"], answer["tangent"]))
        return assemble(z.size, parts, by_columns=self.order == "column")


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
    path = shared_library.find_file(file)
    make = LibraryElements if tangent else LibraryForces
    numbers = shared_library.parse_props(props)
    return make(_read_traits(path, traits), float(penalty), _load_functions(path), elements, numbers, order)


@lru_cache(maxsize=16)  # A formulation is made anew for the penalty of each case.
def _load_functions(path: Path) -> _Functions:
    library = shared_library.load_library(path)
    version = shared_library.find_function(library, path, "cv_version")()
    if version != VERSION:
        needed = f"{VERSION}, that of contactverif.h of this contactverif"
        raise MisuseError("option file", f"{path.name} of version {version}", needed)
    pointer, number = ctypes.c_void_p, ctypes.c_int
    element = shared_library.find_function(library, path, "cv_element")
    element.argtypes = [pointer, number, pointer, pointer, pointer]
    pair = shared_library.find_function(library, path, "cv_pair") if hasattr(library, "cv_pair") else None
    if pair is not None:
        pair.argtypes = [pointer, number, pointer]
    return _Functions(element, pair)


@lru_cache(maxsize=16)
def _read_traits(path: Path, file: str) -> Traits:
    """Return the traits of a library: those of a file that the user names, what it says itself, or a file beside it."""
    library = shared_library.load_library(path)
    if file or not hasattr(library, "cv_traits"):
        return shared_library.traits_beside(path, file)
    function = shared_library.find_function(library, path, "cv_traits")
    function.restype = ctypes.c_char_p
    text = function()
    if text is None:
        return shared_library.traits_beside(path)
    return shared_library.parse_traits_text(text.decode("utf-8", "replace"), "cv_traits")
