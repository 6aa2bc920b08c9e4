"""Writes a solved scene for ParaView: all bodies in one unstructured grid, in their reference configuration."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif_reports.draw.solved_scene import Solution, SolvedScene, pressures_across
from contactverif_reports.files import checked_name, whole

SUFFIXES = (".vtu",)
_KINDS = {2: "line", 3: "triangle", 4: "quad"}
SIDES = {"slave": 0, "master": 1, "": -1}


def write_vtu(solved: SolvedScene, solution: Solution, path: str | os.PathLike[str]) -> None:
    """Writes one solution to a .vtu file, replacing a file that is there.

    On points: `displacement` and `contact_force` (three components, the last 0), `contact_pressure` (nodal force over
    the node's share of the interface; 0 off the interface). On cells: `stress_xx`, `stress_yy`, `stress_xy` (means
    over the Gauss points), `pressure` (−σ across the body's first axis; 0 in a rigid body), `body` (its number) and
    `side` (0 slave, 1 master, −1 out of reach). A rigid body is the line cells of its surface.

    Raises
    ------
    MisuseError
        If the file cannot be written, or its name ends otherwise.
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
    """The arguments of a `meshio.Mesh`; cells of one kind lie together, since a file may hold triangles and quads."""
    points = np.vstack([body.nodes for body in solved.bodies])
    forces, pressures = np.zeros_like(points), np.zeros(len(points))
    found = solved.node_pressures(solution)
    cells: dict[str, list[IntArray]] = {}
    data: dict[str, list[FloatArray]] = {}
    first = 0
    for number, (body, side) in enumerate(zip(solved.bodies, solved.sides, strict=True)):
        on = solved.on_interface[number]
        if len(on):
            forces[first + body.contact_nodes] = solution.forces[on]
            pressures[first + body.contact_nodes] = np.nan_to_num(found[on])
        numbers = body.contact if body.rigid else body.cells
        kind = _KINDS[numbers.shape[1]]
        stresses = np.zeros((len(numbers), 3)) if body.rigid else solution.stresses[number]
        columns = [
            stresses,
            pressures_across(body, stresses),
            np.full(len(numbers), number),
            np.full(len(numbers), SIDES[side]),
        ]
        cells.setdefault(kind, []).append(numbers + first)
        data.setdefault(kind, []).append(np.column_stack(columns))
        first += len(body.nodes)
    names = ("stress_xx", "stress_yy", "stress_xy", "pressure", "body", "side")
    blocks = {kind: np.vstack(parts) for kind, parts in data.items()}
    on_cells = {name: [block[:, column] for block in blocks.values()] for column, name in enumerate(names)}
    for name in ("body", "side"):
        on_cells[name] = [values.astype(np.int64) for values in on_cells[name]]
    return {
        "points": _in_space(points),
        "cells": [(kind, np.vstack(parts)) for kind, parts in cells.items()],
        "point_data": {
            "displacement": _in_space(np.vstack(solution.displacements)),
            "contact_force": _in_space(np.nan_to_num(forces)),
            "contact_pressure": pressures,
        },
        "cell_data": on_cells,
    }


def _in_space(vectors: FloatArray) -> FloatArray:
    """Vectors (n, 2) with a third component 0, which ParaView wants."""
    return np.column_stack([vectors, np.zeros(len(vectors))])
