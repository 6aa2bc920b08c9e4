"""The text of a case in space: its nodes and its faces in tables, for a person who rebuilds the mesh by hand."""

from __future__ import annotations

import textwrap

import numpy as np

from contactverif.contract.arrays import IntArray
from contactverif.contract.case import Case
from contactverif_reports.draw.lengths import format_number, unit_of

_LISTED = 12  # The nodes and faces of at most so many a side are listed.
KINDS = {3: "triangle", 4: "quadrilateral"}


def surfaces_as_text(case: Case, width: int) -> str:
    """Return the numbers of faces, the nodes with their current positions, and the corners of the faces."""
    interface, n_slave = case.interface, case.interface.n_slave_nodes
    unit, unit_name = unit_of(np.array([case.shortest_segment, case.diameter]))
    lines = [headline(case)]
    sides = (
        ("slave", slice(0, n_slave), interface.slave.faces),
        ("master", slice(n_slave, None), interface.master.faces),
    )
    for name, part, faces in sides:
        numbers = np.arange(interface.n_nodes)[part]
        if max(len(numbers), len(faces)) <= _LISTED:
            lines += _list_nodes(name, numbers, case.positions[part] / unit) + _list_faces(faces)
        else:
            lines.append(f"  {name}: {len(numbers)} nodes, too many to be listed")
    notes = [f"lengths and positions in units of {unit_name}"] if unit_name else []
    notes += [f"seen from outside its body, a {KINDS[interface.slave.faces.shape[1]]}'s corners run counter-clockwise"]
    if "penetration" in case.parameters:
        notes.append(f"penetration {format_number(case.parameter('penetration') / unit)} everywhere")
    notes.append(f"penalty {format_number(case.penalty)}   seed {case.seed}")
    return "\n".join([*lines, *(line for note in notes for line in textwrap.wrap(note, width, subsequent_indent="  "))])


def headline(case: Case) -> str:
    """Return the numbers of faces in words: "2 slave on 8 master triangles, in space"."""
    slave, master = case.interface.slave.faces, case.interface.master.faces
    name = f"{case.name}: " if case.name else ""
    kinds = [f"{KINDS[faces.shape[1]]}{'s' * (len(faces) > 1)}" for faces in (slave, master)]
    first = f"{len(slave)} slave" if kinds[0].rstrip("s") == kinds[1].rstrip("s") else f"{len(slave)} slave {kinds[0]}"
    return f"{name}{first} on {len(master)} master {kinds[1]}, in space"


def _list_nodes(name: str, numbers: IntArray, positions: np.ndarray) -> list[str]:
    """Return a table of nodes with their positions (n, 3)."""
    rows = [[name, "x", "y", "z"]]
    for node, place in zip(numbers.tolist(), positions.tolist(), strict=True):
        rows.append([str(node), *(format_number(value, 0.0, 6) for value in place)])
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  " + "  ".join(entry.rjust(size) for entry, size in zip(row, widths, strict=True)) for row in rows]


def _list_faces(faces: IntArray) -> list[str]:
    """Return the corners of each face, with the number of the face before them."""
    words = "   ".join(f"{number}: {' '.join(map(str, corners))}" for number, corners in enumerate(faces.tolist()))
    return [f"  {line}" for line in textwrap.wrap(f"faces   {words}", 68, subsequent_indent="        ")]
