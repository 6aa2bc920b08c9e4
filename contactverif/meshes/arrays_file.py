"""Scenes as arrays in any format that meshio writes: a mesh of all bodies, with what acts on its nodes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from contactverif.contract.engine import SceneArrays
from contactverif.contract.errors import MisuseError

SLAVE, MASTER = 1, 2  # The roles of contact edges in a file; 0 is neither.


def write_arrays(arrays: SceneArrays, path: str | Path) -> None:
    """Write a scene to a file of which meshio knows the format by its ending, such as `.vtu` or `.msh`.

    Parameters
    ----------
    arrays : SceneArrays
        The scene. Its contact edges are lines of the mesh.
    path : str | Path
        The file.

    Raises
    ------
    MisuseError
        If meshio does not know the ending.
    """
    import meshio

    triangles = arrays.cells[:, 3] < 0
    blocks: list[tuple[str, Any, Any, int]] = [  # (kind, corners, body, role)
        ("line", arrays.slave, np.full(len(arrays.slave), -1), SLAVE),
        ("line", arrays.master, np.full(len(arrays.master), -1), MASTER),
        ("triangle", arrays.cells[triangles, :3], arrays.body_of_cell[triangles], 0),
        ("quad", arrays.cells[~triangles], arrays.body_of_cell[~triangles], 0),
    ]
    blocks = [block for block in blocks if len(block[1])]
    mesh = meshio.Mesh(
        np.column_stack([arrays.nodes, np.zeros(len(arrays.nodes))]),
        [(kind, corners) for kind, corners, _, _ in blocks],
        point_data={
            "fixed": arrays.fixed.astype(np.int64),
            "imposed": arrays.imposed,
            "load": arrays.load,
            "start": arrays.start,
            "body": arrays.body_of_node,
        },
        cell_data={
            "body_of_cell": [body for _, _, body, _ in blocks],
            "role": [np.full(len(corners), role) for _, corners, _, role in blocks],
        },
    )
    try:
        mesh.write(path)
    except meshio.ReadError as error:
        raise MisuseError("path", f"{path} ({error})", "an ending that meshio writes, such as .vtu") from None
