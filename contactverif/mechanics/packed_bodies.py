"""Bodies as a few arrays of floats, which a `Case` stores: what is packed is unpacked to the last bit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.body import Body


def pack_bodies(bodies: Sequence[Body], slave: Sequence[int]) -> dict[str, FloatArray]:
    """Return all bodies in a few arrays of floats, whose integers are exact; a triangle has −1 for its fourth node."""
    counts = [len(body.nodes) for body in bodies]
    first = np.cumsum([0, *counts[:-1]]).tolist()
    contact = [body.contact + start for body, start in zip(bodies, first, strict=True)]
    stacks = {name: np.vstack([getattr(body, name) for body in bodies]) for name in ("nodes", "imposed", "load")}
    rows = {name: np.array([getattr(body, name) for body in bodies]) for name in ("young", "poisson", "axis", "start")}
    return {
        "nodes": stacks["nodes"],
        "cells": _pack_cells(bodies, first),
        "contact": np.vstack(contact).astype(np.float64),
        "fixed": np.vstack([body.fixed for body in bodies]).astype(np.float64),
        "imposed": stacks["imposed"],
        "load": stacks["load"],
        "count": np.array(counts, dtype=np.float64),
        "is_slave": np.array([index in slave for index in range(len(bodies))], dtype=np.float64),
        **rows,
    }


def _pack_cells(bodies: Sequence[Body], first: Sequence[int]) -> FloatArray:
    """Return the cells of all bodies (n_cells, 4), each body's nodes numbered from its first."""
    cells = np.full((sum(len(body.cells) for body in bodies), 4), -1.0)
    row = 0
    for body, start in zip(bodies, first, strict=True):
        n_cells, n_corners = body.cells.shape
        cells[row : row + n_cells, :n_corners] = body.cells + start
        row += n_cells
    return cells


def unpack_bodies(packed: Mapping[str, FloatArray]) -> tuple[tuple[Body, ...], tuple[int, ...], tuple[int, ...]]:
    """Return bodies, slave indices and master indices from the arrays that `pack_bodies` made."""
    count = packed["count"].astype(np.int64)
    ends = np.cumsum(count).tolist()
    cells, contact = (packed[name].astype(np.int64) for name in ("cells", "contact"))
    bodies = []
    for index, (start, end) in enumerate(zip([0, *ends], ends, strict=False)):
        corners = cells[(cells[:, 0] >= start) & (cells[:, 0] < end)] if len(cells) else cells.reshape(0, 4)
        corners = corners[:, :3] if len(corners) and (corners[:, 3] < 0).all() else corners
        bodies.append(
            Body(
                nodes=packed["nodes"][start:end],
                cells=corners - start,
                contact=contact[(contact[:, 0] >= start) & (contact[:, 0] < end)] - start,
                young=float(packed["young"][index]),
                poisson=float(packed["poisson"][index]),
                fixed=packed["fixed"][start:end] != 0,
                imposed=packed["imposed"][start:end],
                load=packed["load"][start:end],
                axis=packed["axis"][index],
                start=packed["start"][index],
                name=body_name(packed["is_slave"], index),
            )
        )
    slave = np.flatnonzero(packed["is_slave"] != 0)
    master = np.flatnonzero(packed["is_slave"] == 0)
    return tuple(bodies), tuple(slave.tolist()), tuple(master.tolist())


def body_name(is_slave: FloatArray, index: int) -> str:
    """Return "slave" or "master", with a number where there are several."""
    same = np.flatnonzero(is_slave == is_slave[index])
    side = "slave" if is_slave[index] else "master"
    return side if len(same) == 1 else f"{side} {int(np.searchsorted(same, index)) + 1}"
