"""Exodus files: element blocks, side sets (which meshlane does not read) and node sets by name, read with netCDF4."""

from collections.abc import Iterator

import netCDF4
import numpy as np

from contactverif.contract.arrays import IntArray
from contactverif.meshes.plain_mesh import Group, PlainMesh

# {first letters of a type and number of its nodes: (kind, nodes of each side, counted from 1, seen from outside)}
_TYPES = {
    **dict.fromkeys(("SPH1", "CIR1"), ("vertex", "")),
    **dict.fromkeys(("BAR2", "BEA2", "TRU2", "ROD2", "EDG2", "SHE2"), ("line", "12 21")),
    "TRI3": ("triangle", "12 23 31"),
    "SHE3": ("triangle", "123 132 12 23 31"),
    "QUA4": ("quad", "12 23 34 41"),
    "SHE4": ("quad", "1234 1432 12 23 34 41"),
    "TET4": ("tetra", "124 234 143 132"),
    "PYR5": ("pyramid", "125 235 345 415 1432"),
    "WED6": ("wedge", "1254 2365 1463 132 456"),
    "HEX8": ("hexahedron", "1265 2376 3487 1584 1432 5678"),
}


def read_exodus(path: str) -> PlainMesh:
    """Read an Exodus file; one that is none, or is not whole, or has elements of higher order, is a ValueError."""
    try:
        with netCDF4.Dataset(path) as data:
            data.set_auto_mask(False)
            return _mesh(data)
    except (OSError, RuntimeError, AttributeError, LookupError) as error:
        raise ValueError(f"no whole Exodus file ({error}); write it again") from error


def _mesh(data: netCDF4.Dataset) -> PlainMesh:
    axes = "xyz"[: len(data.dimensions["num_dim"])]
    coordinates = data["coord"][:] if "coord" in data.variables else [data[f"coord{axis}"][:] for axis in axes]
    blocks: list[tuple[str, str, IntArray]] = []  # (name, key of `_TYPES`, nodes)
    cells: Group = {}
    side_sets = list(_entries(data, "num_side_sets", "ss", "num_side_ss"))
    least = min((data[f"side_ss{index}"][:].min(initial=3) for index, _ in side_sets), default=3)
    for index, name in _entries(data, "num_el_blk", "eb", "num_el_in_blk"):
        variable = data[f"connect{index}"]
        type_, n_nodes = str(variable.elem_type).strip("\0 ").upper(), variable.shape[-1]
        # The library takes triangles in space as shells, whose sides 1 and 2 are faces. In a plane others do not.
        is_shell = type_.startswith("TRI") and len(axes) == 3 and (least > 2 or np.ptp(coordinates[2]) > 0)
        key = f"{'SHE' if is_shell else type_[:3]}{n_nodes}"
        if key not in _TYPES:
            raise ValueError(f"elements {type_} of {n_nodes} nodes, block {name!r}; mesh at first order (QUAD4, HEX8)")
        nodes = variable[:].astype(np.int64) - 1
        blocks.append((name, key, nodes))
        cells[_TYPES[key][0]] = np.vstack([cells.get(_TYPES[key][0], nodes[:0]), nodes])
    if (n_elements := sum(len(nodes) for _, _, nodes in blocks)) != len(data.dimensions["num_elem"]):
        raise ValueError(f"{n_elements} elements in blocks, not {len(data.dimensions['num_elem'])}; write it again")
    entries: list[tuple[str, str, Group]] = []  # (what it is, name, members)
    for index, name in side_sets:
        elements, sides = (data[f"{word}_ss{index}"][:].astype(np.int64) - 1 for word in ("elem", "side"))
        entries.append(("side set", name, _sides(name, blocks, elements, sides)))
    entries += [("block", name, {_TYPES[key][0]: nodes}) for name, key, nodes in blocks]
    for index, name in _entries(data, "num_node_sets", "ns", "num_nod_ns"):
        entries.append(("node set", name, {"vertex": data[f"node_ns{index}"][:].astype(np.int64).reshape(-1, 1) - 1}))
    groups: dict[str, Group] = {}
    for word, name, group in entries:
        # A side set, a block and a set of nodes may have the same number. The first of them is called by it alone.
        while name in groups:
            name = f"{word} {name}"
        groups[name] = group
    return PlainMesh(np.array(coordinates, dtype=np.float64).T, cells, groups)


def _entries(data: netCDF4.Dataset, dimension: str, letters: str, size: str) -> Iterator[tuple[int, str]]:
    """Yield the place, counted from 1, and the name, or else the number, of each block or set that is not empty."""
    count = len(data.dimensions[dimension]) if dimension in data.dimensions else 0
    names = data[f"{letters}_names"][:] if f"{letters}_names" in data.variables else np.zeros((count, 1), dtype="S1")
    numbers = data[f"{letters}_prop1"][:] if f"{letters}_prop1" in data.variables else range(1, count + 1)
    for index in range(count):
        if f"{size}{index + 1}" in data.dimensions:
            name = names[index].tobytes().partition(b"\0")[0].decode(errors="replace").strip()
            yield index + 1, name or str(numbers[index])


def _sides(name: str, blocks: list[tuple[str, str, IntArray]], elements: IntArray, sides: IntArray) -> Group:
    """Return the nodes of sides of elements, both counted from 0; the elements are numbered from block to block."""
    group: Group = {}
    start = 0
    for _, key, nodes in blocks:
        inside = (elements >= start) & (elements < start + len(nodes))
        for side, columns in enumerate(_TYPES[key][1].split()):
            more = nodes[elements[inside & (sides == side)] - start][:, [int(column) - 1 for column in columns]]
            kind = {2: "line", 3: "triangle", 4: "quad"}[len(columns)]
            group[kind] = np.vstack([group.get(kind, more[:0]), more])
        start += len(nodes)
    if sum(map(len, group.values())) != len(elements):
        raise ValueError(f"the side set {name!r} with a side that no element has; write it again")
    if len(kinds := {kind for kind, members in group.items() if len(members)}) > 1 and "line" in kinds:
        raise ValueError(
            f"edges and faces in the side set {name!r}: in space, sides 1 and 2 of TRI3 and SHELL4 are faces"
        )
    return {kind: members for kind, members in group.items() if len(members)}
