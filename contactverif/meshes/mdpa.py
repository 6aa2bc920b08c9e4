"""Files of Kratos (`.mdpa`): elements, and the conditions, elements or nodes of sub model parts by name."""

import re
from collections import defaultdict

import numpy as np

from contactverif.meshes.plain_mesh import Group, PlainMesh

_LINES = {1: "vertex", 2: "line"}
_SURFACES = {**_LINES, 3: "triangle", 4: "quad"}
_VOLUMES = {**_SURFACES, 4: "tetra", 5: "pyramid", 6: "wedge", 8: "hexahedron"}
_FLAT = re.compile("Surface|Shell|Membrane|Triang|Quad")  # Words in the name of an element that is a surface in space.
_ENTITIES = ("Elements", "Conditions", "Geometries")


def read_mdpa(path: str) -> PlainMesh:
    """Read a file of Kratos; one that is not whole, or has elements of higher order, is a ValueError."""
    points: dict[int, list[float]] = {}
    entities: dict[str, dict[int, tuple[str, list[int]]]] = {word: {} for word in _ENTITIES}  # {number: (kind, nodes)}
    parts: dict[str, dict[str, list[int]]] = defaultdict(
        lambda: defaultdict(list)
    )  # {sub model part: {section: numbers}}
    blocks: list[list[str]] = []  # The words of each `Begin` that has no `End` yet.
    with open(path, encoding="utf-8", errors="replace") as stream:
        for number, line in enumerate(stream, 1):
            try:
                match line.partition("//")[0].split():
                    case ["Begin", *words]:
                        blocks.append(words)
                    case ["End", *_]:
                        blocks.pop()
                    case [first, x, y, z] if blocks and blocks[-1][0] == "Nodes":
                        points[int(first)] = [float(x), float(y), float(z)]
                    case [first, *words] if blocks and (section := blocks[-1][0]) in _ENTITIES:
                        nodes = [int(word) for word in words[section != "Geometries" :]]  # Properties come first.
                        entities[section][int(first)] = _kind(section, blocks[-1][1], len(nodes)), nodes
                        parts[""][section] += [int(first)] if section == "Elements" else []
                    case [first] if blocks and (section := blocks[-1][0]).startswith("SubModelPart"):
                        name = ".".join(name for word, name, *_ in blocks[:-1] if word == "SubModelPart")
                        parts[name][section.removeprefix("SubModelPart")].append(int(first))
            except (ValueError, IndexError) as error:
                raise ValueError(f"line {number}, {line.strip()[:60]!r}: {error}") from error
    if blocks:
        raise ValueError(f"no 'End {' '.join(blocks[-1][:1])}': the file is not whole")
    places = {node: place for place, node in enumerate(points)}
    groups: dict[str, Group] = {}
    for name, numbers in parts.items():
        rows: dict[str, list[list[int]]] = defaultdict(list)
        try:
            members = [entities[section][number] for section in _ENTITIES for number in numbers[section]]
            # A part with conditions lists their nodes too.
            for kind, nodes in members or [("vertex", [node]) for node in numbers["Nodes"]]:
                rows[kind].append([places[node] for node in nodes])
        except KeyError as error:
            raise ValueError(f"number {error}, which the file does not define (sub model part {name!r})") from error
        groups[name] = {kind: np.array(each) for kind, each in rows.items()}
    return PlainMesh(np.array(list(points.values())), groups.pop("", {}), groups)


def _kind(section: str, name: str, n_nodes: int) -> str:
    """Return the kind of an element or condition such as `Element2D4N` or `SurfaceCondition3D3N`."""
    is_side, is_plane = section == "Conditions", "2D" in name
    is_line, is_flat = "Line" in name or (is_side and is_plane), is_side or is_plane or _FLAT.search(name)
    kinds = _LINES if is_line else _SURFACES if is_flat else _VOLUMES
    if n_nodes not in kinds:
        raise ValueError(f"{name} of {n_nodes} nodes; mesh at first order")
    return kinds[n_nodes]
