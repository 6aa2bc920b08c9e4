"""The work of `scenes FILE`: what is in a mesh file, by the names that `--slave` and `--master` take."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from rich.text import Text

from contactverif.cli.console import columns, line, show
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.meshes.cell_sides import CellSides, label_bodies
from contactverif.meshes.mesh_file import find_plane
from contactverif.meshes.plain_mesh import Group, PlainMesh, read_mesh
from contactverif_reports.plot.text import is_inside
from contactverif_reports.tables import Column, Table

_WORDS = {
    "vertex": "nodes",
    "line": "lines",
    "triangle": "triangles",
    "quad": "quadrilaterals",
    "tetra": "tetrahedra",
    "hexahedron": "hexahedra",
}
_INKS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
_ROWS, _ASPECT = 16, 2.2  # Rows of a drawing; a character is so many times as high as wide.


def show_mesh(path: Path) -> None:
    """Show the groups, the contact pairs and the materials of a mesh file, and draw a plane one."""
    mesh = read_mesh(path)
    points, remark = find_plane(mesh)
    kinds = ("line",) if points.shape[1] == 2 else ("triangle", "quad")
    labels = label_bodies(mesh.cells.values(), len(points))
    cells = [data for kind, data in mesh.cells.items() if kind not in ("vertex", "line")]
    bodies = {label: number for number, label in enumerate(dict.fromkeys(_labels(labels, cells)), 1)}
    able = [name for name, group in mesh.groups.items() if not group.keys().isdisjoint((*kinds, "vertex"))]
    names: dict[tuple[object, ...], list[str]] = {}  # Gmsh's groups have a name and a number.
    for name, group in mesh.groups.items():
        names.setdefault(tuple((kind, data.tobytes()) for kind, data in group.items()), []).insert(0, name)
    with_ink = (each[0] for each in names.values() if not set(kinds).isdisjoint(mesh.groups[each[0]]))
    inks = dict(zip(with_ink, _INKS, strict=False))
    listed = Table([Column("group", wrap=True), Column("of", wrap=True), Column("body"), Column("drawn")], str(path))
    for name, *others in names.values():
        group = mesh.groups[name]
        of_bodies = sorted({bodies[label] for label in _labels(labels, group.values()) if label in bodies})
        words = ", ".join(map(str, of_bodies[:5])) + (" …" if len(of_bodies) > 5 else "")
        listed.add(
            " or ".join([name, *others]), _count(group), words, inks.get(name, "" if name in able else "not a side")
        )
    show(
        line(f"{len(points)} nodes; {_count(mesh.cells)}; bodies (cells that hang together): {len(bodies)}"),
        listed.terminal(),
    )
    remarks = (mesh.warnings + remark).splitlines()
    remarks += [f"contact pair {n}: slave {slave}, master {master}" for n, (slave, master) in enumerate(mesh.pairs, 1)]
    remarks += [f"material of {name}: E = {law[0]:g}, ν = {law[1]:g}" for name, law in mesh.materials.items()]
    remarks += ["seen along y, with x to the right and z up"] * (points.shape[1] == 3)
    show(*map(line, remarks), *_drawing(mesh, points, kinds, inks))
    typed = "" if mesh.pairs else " --slave GROUP --master GROUP"
    more = " --pair N" if len(mesh.pairs) > 1 else ""
    show(line(f"to ask about it: contactverif verify NAME --mesh {path}{typed}{more}"))


def _labels(labels: IntArray, parts: Iterable[IntArray]) -> list[int]:
    return [int(label) for part in parts for label in labels[part[:, 0]]]


def _count(group: Group) -> str:
    return ", ".join(f"{len(data)} {_WORDS.get(kind, kind)}" for kind, data in group.items()) or "nothing"


def _drawing(mesh: PlainMesh, points: FloatArray, kinds: tuple[str, ...], inks: dict[str, str]) -> Iterator[Text]:
    """Yield a drawing to scale: bodies filled, and the lines or faces of groups by the letter of the table."""
    sides = CellSides.collect(mesh.cells, points).outer
    in_space, plane = points.shape[1] == 3, points[:, [0, -1]]
    strokes = {"░": _edges(sides.values())}
    for name, ink in inks.items():
        strokes[ink] = _edges(mesh.groups[name][kind] for kind in kinds if kind in mesh.groups[name])
    used = plane[np.unique(np.concatenate([part.reshape(-1) for part in strokes.values()]))]
    if not len(used):
        return
    (left, low), (right, high) = used.min(axis=0), used.max(axis=0)
    row = max((high - low) / _ROWS, (right - left) * _ASPECT / columns())
    n_columns, n_rows = int((right - left) * _ASPECT / row) + 1, int((high - low) / row) + 1
    x, y = left + (np.arange(n_columns) + 0.5) * row / _ASPECT, high - (np.arange(n_rows) + 0.5) * row
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    outer = plane[sides[2]] if 2 in sides else np.empty((0, 2, 2))
    is_body = is_inside(outer, places)  # In space the edges of bodies are drawn.
    canvas = np.where(is_body, "░", " ").reshape(n_rows, n_columns)
    for ink in ["░"] * in_space + [*inks.values()][::-1]:  # The first groups over the later ones.
        first, second = plane[strokes[ink]].swapaxes(0, 1)
        for share in np.linspace(0, 1, 2 + int(np.abs(second - first).max(initial=0) / row * _ASPECT)):
            along, down = ((1 - share) * first + share * second).T
            canvas[((high - down) / row).astype(int), ((along - left) / row * _ASPECT).astype(int)] = ink
    yield from (line("".join(each).rstrip()) for each in canvas.tolist())


def _edges(parts: Iterable[IntArray]) -> IntArray:
    """Return lines, and the edges of faces, as rows of two nodes."""
    rows = [np.stack([part, np.roll(part, -1, axis=1)], axis=-1).reshape(-1, 2) for part in parts if part.shape[1] > 1]
    return np.concatenate([np.empty((0, 2), dtype=np.int64), *rows])
