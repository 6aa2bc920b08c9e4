"""The part of an interface that an element of a C library is shown, in the form of `cv_view` of `contactverif.h`."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np

from contactverif.compiler import compile_kernel
from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.interface import Interface
from contactverif.geometry.projection import PointOnSegment, nearest_segment, node, search_tree
from contactverif_foreign.element_pairs import walk_chains
from contactverif_foreign.guarded_slot import Argument

OUTSIDE = -2  # The neighbour does not belong to the element.
_PLACES = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])  # Places on a slave segment whose nearest master segments it is shown.
_ARRAYS = ("reference", "x", "slave", "master", "slave_neighbours", "master_neighbours", "props")
_NUMBERS = ("n_slave_nodes", "n_master_nodes", "n_slave_segments", "n_master_segments", "n_props", "number")


class _View(ctypes.Structure):
    """The structure `cv_view`."""

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

    @property
    def shape(self) -> tuple[int, ...]:
        """The numbers of slave nodes, master nodes, slave segments and master segments."""
        segments = (self.arrays[name].shape[-2] for name in ("slave", "master"))
        return (self.n_slave_nodes, self.nodes.shape[1] - self.n_slave_nodes, *segments)

    def select(self, selection: BoolArray) -> Views:
        """Return some of the elements, selected by mask (n,)."""
        arrays = {name: array if array.ndim == 2 else array[selection] for name, array in self.arrays.items()}
        return Views(self.places[selection], self.labels[selection], self.nodes[selection], self.n_slave_nodes, arrays)


def arguments_of(shape: tuple[int, ...], n_props: int, n_decisions: int, *, pairs: bool) -> list[Argument]:
    """Return the arguments of a call: those of `cv_pair`, or of `cv_element`."""
    n_slave, n_master, n_slave_segments, n_master_segments = shape
    n_nodes, size = n_slave + n_master, 2 * (n_slave + n_master)
    arguments = [
        Argument("view", (ctypes.sizeof(_View) // 4,), "integer"),
        Argument("reference", (n_nodes, 2)),
        Argument("x", (n_nodes, 2)),
        *(Argument(name, (n_slave_segments, 2), "integer") for name in ("slave", "slave_neighbours")),
        *(Argument(name, (n_master_segments, 2), "integer") for name in ("master", "master_neighbours")),
        Argument("props", (n_props,)),
        Argument("decisions", (n_decisions,), "integer", not pairs),
    ]
    if not pairs:
        outputs = {"residual": (size,), "tangent": (size, size)}
        arguments += [Argument(name, output, is_input=False) for name, output in outputs.items()]
    return arguments


def view_words(addresses: dict[str, int], shape: tuple[int, ...], n_props: int) -> Array:
    """Return a structure `cv_view` with these addresses as an array of integers; number and penalty are zero."""
    view = _View(*shape, n_props, 0, 0.0, *(addresses[name] for name in _ARRAYS))
    return np.frombuffer(bytes(view), np.int32)


def view_numbers(words: Array, labels: IntArray, penalty: float) -> None:
    """Write labels (n,) and penalty into structures (n, n_words)."""
    words[:, _View.number.offset // 4] = labels
    start = _View.penalty.offset // 4
    words[:, start : start + 2] = np.array([penalty]).view(np.int32)


def whole_interface(interface: Interface) -> list[Views]:
    """Return the one element that has all nodes."""
    arrays = {
        "slave": interface.slave.segments,
        "master": interface.master.segments,
        "slave_neighbours": interface.slave.neighbours,
        "master_neighbours": interface.master.neighbours,
    }
    label: IntArray = np.array([-1])
    return [Views(label + 1, label, np.arange(interface.n_nodes)[None], interface.n_slave_nodes, arrays)]


def find_windows(interface: Interface, x: FloatArray) -> dict[str, IntArray]:
    """Return the slave segments of elements at x (n_nodes, 2), and the master segments that each is shown.

    A slave segment is shown the master segments nearest to five places on it, those between them and one more on each
    side, in the order of a walk along their chain. If they belong to several chains, there are several elements.
    """
    slave, master = interface.slave, interface.master
    nearest = np.empty((len(slave), len(_PLACES)), dtype=np.int64)
    _find_nearest(nearest, x, slave.segments, master.segments, *search_tree(master, x), _PLACES)
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
        if is_closed:
            windows.append(segments[_window_on_ring(places[element == number], len(segments))])
        else:
            windows.append(segments[max(first - 1, 0) : last + 2])
    starts = np.cumsum([0, *map(len, windows)])
    return {
        "slave_segment": every // len(chains),
        "master_segment": np.concatenate(windows),
        "master_start": starts,
    }


@compile_kernel
def _find_nearest(
    nearest: IntArray,
    x: FloatArray,
    slave: IntArray,
    master: IntArray,
    order: IntArray,
    boxes: FloatArray,
    places: FloatArray,
) -> None:
    """Write the nearest master segment of each place on each slave segment."""
    for s in range(len(slave)):
        for i in range(len(places)):
            v = PointOnSegment(node(x, slave[s, 0]), node(x, slave[s, 1]), places[i])
            nearest[s, i] = max(nearest_segment(v, x, master, order, boxes), 0)


def _window_on_ring(places: IntArray, length: int) -> IntArray:
    """Return the places on a closed chain from the first to the last of some, and one more on each side."""
    ordered = np.unique(places)
    gaps = np.diff(ordered, append=ordered[0] + length)  # The largest of them is outside.
    widest = int(np.argmax(gaps))
    first, n_segments = ordered[(widest + 1) % len(ordered)] - 1, min(length - gaps[widest] + 3, length)
    window: IntArray = (first + np.arange(n_segments)) % length
    return window


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
            if ring:
                neighbours[:, 0, 0], neighbours[:, -1, 1] = width - 1, 0
            else:
                neighbours[:, 0, 0] = _hide(master.neighbours[segments[:, 0], 0])
                neighbours[:, -1, 1] = _hide(master.neighbours[segments[:, -1], 1])
            arrays = {
                "slave": np.array([[0, 1]]),
                "master": 2 + np.column_stack([number, (number + 1) % width if ring else number + 1]),
                "slave_neighbours": _hide(slave.neighbours[labels])[:, None],
                "master_neighbours": neighbours,
            }
            views.append(Views(places, labels, np.hstack(nodes), 2, arrays))
    return views


def _hide(neighbours: IntArray) -> IntArray:
    """Return −1 for a free end and −2 for a neighbour outside of the element."""
    hidden: IntArray = np.where(neighbours < 0, -1, OUTSIDE)
    return hidden
