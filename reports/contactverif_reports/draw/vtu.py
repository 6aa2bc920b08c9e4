"""A solved scene as a file for ParaView: all bodies in one unstructured grid, in their reference configuration."""

from __future__ import annotations

import itertools
import os
from pathlib import Path

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif_reports.draw.solved_scene import Solution, SolvedScene, pressures_across
from contactverif_reports.files import checked_name, whole

SUFFIXES = (".vtu",)
KINDS = {2: "line", 3: "triangle", 4: "quad"}
_CELL_DATA = ("stress_xx", "stress_yy", "stress_xy", "pressure", "body", "side")
SIDES = {"slave": 0, "master": 1, "": -1}


def write_vtu(solved: SolvedScene, solution: Solution, path: str | os.PathLike[str]) -> None:
    """Write one solution to a .vtu file.

    On points: `displacement` and `contact_force` (three components, the last 0), `contact_pressure` (nodal force over
    the node's share of the interface; 0 off the interface). On cells: `stress_xx`, `stress_yy`, `stress_xy` (means
    over the Gauss points), `pressure` (−σ across the body's first axis; 0 in a rigid body), `body` (its number) and
    `side` (0 slave, 1 master, −1 out of reach). A rigid body is the line cells of its surface.
    """
    import meshio

    target = checked_name(path, SUFFIXES)
    mesh = meshio.Mesh(**_grid(solved, solution))
    try:
        with whole(target) as part:
            meshio.write(part, mesh, file_format="vtu")
    except OSError as error:
        raise MisuseError("path", f"{Path(path)}: {error.strerror}", "a file that can be written") from error


def _grid(solved: SolvedScene, solution: Solution) -> dict[str, object]:
    """Return the arguments of a `meshio.Mesh`."""
    cells, on_cells = _cells(solved, solution)
    forces, pressures = _contact(solved, solution)
    return {
        "points": _in_space(np.vstack([body.nodes for body in solved.bodies])),
        "cells": cells,
        "point_data": {
            "displacement": _in_space(np.vstack(solution.displacements)),
            "contact_force": _in_space(forces),
            "contact_pressure": pressures,
        },
        "cell_data": on_cells,
    }


def _contact(solved: SolvedScene, solution: Solution) -> tuple[FloatArray, FloatArray]:
    """Return forces (n_points, 2) and pressures (n_points,) of all bodies' nodes, 0 off the interface."""
    sizes = [len(body.nodes) for body in solved.bodies]
    forces, pressures = np.zeros((sum(sizes), 2)), np.zeros(sum(sizes))
    node_pressures = solved.node_pressures(solution)
    for body, on, first in zip(solved.bodies, solved.on_interface, _first_nodes(solved), strict=True):
        if len(on):
            forces[first + body.contact_nodes] = solution.forces[on]
            pressures[first + body.contact_nodes] = np.nan_to_num(node_pressures[on])
    return np.nan_to_num(forces), pressures


def _cells(
    solved: SolvedScene, solution: Solution
) -> tuple[list[tuple[str, IntArray]], dict[str, list[FloatArray] | list[IntArray]]]:
    """Return the cells by kind and their data; a file may hold triangles and quadrilaterals, each kind in one block."""
    cells: dict[str, list[IntArray]] = {}
    data: dict[str, list[FloatArray]] = {}
    for number, (body, first) in enumerate(zip(solved.bodies, _first_nodes(solved), strict=True)):
        numbers = body.contact if body.rigid else body.cells
        stresses = np.zeros((len(numbers), 3)) if body.rigid else solution.stresses[number]
        side = np.full(len(numbers), SIDES[solved.sides[number]])
        columns = [stresses, pressures_across(body, stresses), np.full(len(numbers), number), side]
        kind = KINDS[numbers.shape[1]]
        cells.setdefault(kind, []).append(numbers + first)
        data.setdefault(kind, []).append(np.column_stack(columns))
    blocks = [np.vstack(parts) for parts in data.values()]
    on_cells: dict[str, list[FloatArray] | list[IntArray]] = {}
    for column, name in enumerate(_CELL_DATA):
        values = [block[:, column] for block in blocks]
        on_cells[name] = [array.astype(np.int64) for array in values] if name in ("body", "side") else values
    return [(kind, np.vstack(parts)) for kind, parts in cells.items()], on_cells


def _first_nodes(solved: SolvedScene) -> list[int]:
    """Return the number of each body's first node among the nodes of all bodies."""
    return list(itertools.accumulate((len(body.nodes) for body in solved.bodies[:-1]), initial=0))


def _in_space(vectors: FloatArray) -> FloatArray:
    """Return vectors (n, 3) with a third component 0, which ParaView needs, from vectors (n, 2)."""
    return np.column_stack([vectors, np.zeros(len(vectors))])
