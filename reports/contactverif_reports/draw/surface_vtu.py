"""A case in space as a file for ParaView: both surfaces in their current positions, with forces and pressures."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.faces import turns_of
from contactverif.contract.result import NodalForces
from contactverif_reports.draw.vtu import KINDS, SIDES, SUFFIXES
from contactverif_reports.files import checked_name, whole


def write_surfaces(case: Case, forces: NodalForces | None, path: str | os.PathLike[str]) -> None:
    """Write a case in space to a .vtu file.

    On points: `node` (its number), and where they are known `force` and `exact_force`, which push the node, and
    `pressure` and `exact_pressure` (against the mean normal of the faces at the node, over its share of their areas).
    On cells: `face` (its number on its surface) and `side` (0 slave, 1 master).
    """
    import meshio

    target = checked_name(path, SUFFIXES)
    point_data: dict[str, IntArray | FloatArray] = {"node": np.arange(case.interface.n_nodes)}
    for prefix, values in _kinds(forces).items():
        point_data |= {f"{prefix}force": values, f"{prefix}pressure": _node_pressures(case, values)}
    sides = {"slave": case.interface.slave.faces, "master": case.interface.master.faces}
    mesh = meshio.Mesh(
        points=case.positions,
        cells=[(KINDS[faces.shape[1]], faces) for faces in sides.values()],
        point_data=point_data,
        cell_data={
            "face": [np.arange(len(faces)) for faces in sides.values()],
            "side": [np.full(len(faces), SIDES[name]) for name, faces in sides.items()],
        },
    )
    try:
        with whole(target) as part:
            meshio.write(part, mesh, file_format="vtu")
    except OSError as error:
        raise MisuseError("path", f"{Path(path)}: {error.strerror}", "a file that can be written") from error


def _kinds(forces: NodalForces | None) -> dict[str, FloatArray]:
    """Return the forces (n_nodes, 3) by the beginning of their name in the file."""
    kinds = {} if forces is None else {"": forces.of_formulation, "exact_": forces.exact}
    return {prefix: values for prefix, values in kinds.items() if values is not None}


def _node_pressures(case: Case, forces: FloatArray) -> FloatArray:
    """Return the pressures (n_nodes,) of nodal forces; 0 at a node whose faces have no mean normal."""
    shares = np.zeros_like(case.positions)  # (n_nodes, 3) Along the normal, as long as the node's share of the area.
    for surface in (case.interface.slave, case.interface.master):
        corners = case.positions[surface.faces]
        normals = turns_of(corners).sum(axis=1)
        areas = normals / np.linalg.norm(normals, axis=1, keepdims=True) * surface.measures(case.positions)[:, None]
        np.add.at(shares, surface.faces, areas[:, None] / surface.faces.shape[1])
    squares = (shares**2).sum(axis=1)
    pressures: FloatArray = np.divide(
        -(forces * shares).sum(axis=1), squares, np.zeros(len(squares)), where=squares > 0
    )
    return pressures
