"""The check of the bodies that a stored case holds, for pictures: they are drawn from the plain arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

_PREFIX = "bodies_"
_OF_NODES = ("nodes", "fixed", "imposed", "load")  # Arrays (n_nodes, 2).
_OF_BODIES = {"count": (), "is_slave": (), "young": (), "poisson": (), "axis": (2,), "start": (2,)}


def check_bodies(parameters: Mapping[str, NDArray[Any]]) -> None:
    """Check shapes, finite numbers and node numbers of the bodies of a case, if it holds any."""
    packed = {name.removeprefix(_PREFIX): values for name, values in parameters.items() if name.startswith(_PREFIX)}
    if not packed:
        return
    n_nodes = len(np.atleast_1d(packed["nodes"]))
    _check_shapes(packed, n_nodes)
    for name, low, high in (("cells", -1, n_nodes - 1), ("contact", 0, n_nodes - 1), ("count", 1, n_nodes)):
        numbers = packed[name]
        if (numbers != np.round(numbers)).any() or not ((numbers >= low) & (numbers <= high)).all():
            raise ValueError(f"{_PREFIX}{name} holds a number that no node has")
    if packed["count"].sum() != n_nodes or (packed["cells"][:, :3] < 0).any():
        raise ValueError(f"the nodes of {_PREFIX}count or {_PREFIX}cells are not those that are there")


def _check_shapes(packed: Mapping[str, NDArray[Any]], n_nodes: int) -> None:
    """Check that all arrays have their shapes, and no NaN or infinity."""
    shapes: dict[str, tuple[int, ...]] = dict.fromkeys(_OF_NODES, (n_nodes, 2))
    shapes |= {name: (packed["count"].size, *rest) for name, rest in _OF_BODIES.items()}
    shapes |= {name: (len(np.atleast_1d(packed[name])), width) for name, width in (("cells", 4), ("contact", 2))}
    for name, shape in shapes.items():
        if packed[name].shape != shape or not np.isfinite(packed[name]).all():
            raise ValueError(f"{_PREFIX}{name} has the shape {packed[name].shape} or NaN; needed {shape}")
