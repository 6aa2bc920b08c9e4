"""Files for ParaView: a solved scene in one unstructured grid, or the surfaces of a case in space."""

import itertools
import os
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import PLANE, SPACE
from contactverif.contract.result import NodalForces
from contactverif_reports.files import checked_name, whole
from contactverif_reports.plot.solved_scene import (
    STRESSES,
    Solution,
    SolvedScene,
    pressures_across,
    pressures_of_forces,
)

_KINDS = {2: "line", 3: "triangle", 4: "quad"}
_SOLIDS = {4: "tetra", 8: "hexahedron"}
_SIDES = {"slave": 0, "master": 1, "": -1}


def write_vtu(solved: SolvedScene, solution: Solution, path: str | os.PathLike[str]) -> None:
    """Write one solution to a .vtu file: all bodies in their reference configuration.

    On points: `displacement` and `contact_force` (three components, the last 0), `contact_pressure` (nodal force over
    the node's share of the interface; 0 off the interface). On cells: `stress_xx` and so on (means over the Gauss
    points), `pressure` (−σ along the body's last axis; 0 in a rigid body), `body` (its number) and
    `side` (0 slave, 1 master, −1 out of reach). A rigid body is the lines or faces of its surface.
    """
    nodes, components = np.vstack([body.nodes for body in solved.bodies]), STRESSES[solved.bodies[0].dim]
    forces, pressures = np.zeros_like(nodes), np.zeros(len(nodes))
    node_pressures = solved.node_pressures(solution)
    firsts = itertools.accumulate((len(body.nodes) for body in solved.bodies[:-1]), initial=0)
    cells: dict[str, list[IntArray]] = {}  # A file has triangles and quadrilaterals in one block each.
    data: dict[str, list[FloatArray]] = {}
    for number, (body, on, first) in enumerate(zip(solved.bodies, solved.on_interface, firsts, strict=True)):
        if len(on):
            forces[first + body.contact_nodes] = solution.forces[on]
            pressures[first + body.contact_nodes] = np.nan_to_num(node_pressures[on])
        corners = body.contact if body.rigid else body.cells
        stresses = np.zeros((len(corners), len(components))) if body.rigid else solution.stresses[number]
        side = np.full(len(corners), _SIDES[solved.sides[number]])
        columns = [stresses, pressures_across(body, stresses), np.full(len(corners), number), side]
        kinds = _KINDS if body.rigid or body.dim == PLANE else _SOLIDS
        cells.setdefault(kinds[corners.shape[1]], []).append(corners + first)
        data.setdefault(kinds[corners.shape[1]], []).append(np.column_stack(columns))
    blocks = [np.vstack(parts) for parts in data.values()]
    names = [*(f"stress_{name}" for name in components), "pressure", "body", "side"]
    types = [np.int64 if name in ("body", "side") else np.float64 for name in names]
    _write(
        path,
        points=_in_space(nodes),
        cells=[(kind, np.vstack(parts)) for kind, parts in cells.items()],
        point_data={
            "displacement": _in_space(np.vstack(solution.displacements)),
            "contact_force": _in_space(np.nan_to_num(forces)),
            "contact_pressure": pressures,
        },
        cell_data={
            name: [block[:, column].astype(dtype) for block in blocks]
            for column, (name, dtype) in enumerate(zip(names, types, strict=True))
        },
    )


def write_surfaces(case: Case, forces: NodalForces | None, path: str | os.PathLike[str]) -> None:
    """Write a case in space to a .vtu file: both surfaces in their current positions.

    On points: `node` (its number), and where they are known `force` and `exact_force`, which push the node, and
    `pressure` and `exact_pressure` (against the mean normal of the faces at the node, over its share of their areas).
    On cells: `face` (its number on its surface) and `side` (0 slave, 1 master).
    """
    point_data: dict[str, IntArray | FloatArray] = {"node": np.arange(case.interface.n_nodes)}
    kinds = {} if forces is None else {"": forces.of_formulation, "exact_": forces.exact}
    for prefix, values in kinds.items():
        if values is not None:
            point_data |= {f"{prefix}force": values, f"{prefix}pressure": pressures_of_forces(case, values)}
    sides = {"slave": case.interface.slave.faces, "master": case.interface.master.faces}
    _write(
        path,
        points=case.positions,
        cells=[(_KINDS[faces.shape[1]], faces) for faces in sides.values()],
        point_data=point_data,
        cell_data={
            "face": [np.arange(len(faces)) for faces in sides.values()],
            "side": [np.full(len(faces), _SIDES[name]) for name, faces in sides.items()],
        },
    )


def _write(path: str | os.PathLike[str], **arrays: Any) -> None:
    import meshlane

    target = checked_name(path, (".vtu",))
    mesh = meshlane.Mesh(**arrays)
    try:
        with whole(target) as part:
            meshlane.write(part, mesh, file_format="vtu")
    except OSError as error:
        raise MisuseError("path", f"{target}: {error.strerror}", "a file that can be written") from error


def _in_space(vectors: FloatArray) -> FloatArray:
    """Return vectors (n, 3), which ParaView needs: those in the plane (n, 2) with a third component 0."""
    return np.column_stack([vectors, np.zeros((len(vectors), SPACE - vectors.shape[1]))])
