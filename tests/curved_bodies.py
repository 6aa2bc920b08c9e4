"""A mesh file of two curved bodies: an arc punch above a base whose upper boundary is a sine, open everywhere."""

from pathlib import Path

import meshlane
import numpy as np

NUMBERS = {"top": (1, 1), "bottom": (2, 1), "arc": (3, 1), "lid": (4, 1), "base": (5, 2), "punch": (6, 2)}
_BASE, _PUNCH = np.linspace(-1, 1, 13), np.linspace(-0.6, 0.6, 8)
_RADIUS, _GAP = 2.0, 0.12


def write_curved_bodies(path: Path, *, cells: str = "quad", with_base: bool = True) -> Path:
    """Write the bodies as Gmsh's .msh 2.2, of cells "quad", "triangle" or "mixed", the base with cells or not."""
    base = _grid(_BASE, np.full(len(_BASE), -1.0), 0.1 * np.sin(2 * np.pi * _BASE))
    punch = _grid(_PUNCH, _GAP + _RADIUS - np.sqrt(_RADIUS**2 - _PUNCH**2), np.ones(len(_PUNCH)))
    points = np.vstack([base, punch])
    quads = [_cells(len(_BASE), 0), _cells(len(_PUNCH), len(base))]
    of_base, of_punch = (len(_BASE), 0), (len(_PUNCH), len(base))
    rows = [_row(3, *of_base), _row(0, *of_base), _row(0, *of_punch), _row(3, *of_punch)]
    split = {"quad": 0, "triangle": 100, "mixed": 3}[cells]
    blocks = [("line", row, number) for number, row in enumerate(rows, 1)]
    for number, quad in list(enumerate(quads, 5))[0 if with_base else 1 :]:
        triangles = np.vstack([quad[:split, [0, 1, 2]], quad[:split, [0, 2, 3]]])
        parts = (("triangle", triangles), ("quad", quad[split:]))
        blocks += [(kind, part, number) for kind, part in parts if len(part)]
    tags = [np.full(len(part), number) for _, part, number in blocks]
    mesh = meshlane.Mesh(
        np.column_stack([points, np.zeros(len(points))]),
        [(kind, part) for kind, part, _ in blocks],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={name: np.array(value) for name, value in NUMBERS.items()},
    )
    meshlane.write(path, mesh, file_format="gmsh22", binary=False)
    return path


def _grid(x: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the nodes (4 rows × len(x), 2) between two curves, row by row from below."""
    return np.vstack([np.column_stack([x, low + share * (high - low)]) for share in np.linspace(0, 1, 4)])


def _cells(width: int, first: int) -> np.ndarray:
    corner = np.array([row * width + column for row in range(3) for column in range(width - 1)]) + first
    return np.column_stack([corner, corner + 1, corner + width + 1, corner + width])


def _row(row: int, width: int, first: int) -> np.ndarray:
    start = np.arange(width - 1) + row * width + first
    return np.column_stack([start, start + 1])
