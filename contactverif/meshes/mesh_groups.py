"""The groups of a mesh file: sets of cells and physical groups by name, numbered groups by number as text."""

from __future__ import annotations

from difflib import get_close_matches

import numpy as np

from contactverif.contract.arrays import IntArray
from contactverif.contract.errors import MisuseError
from contactverif.meshes.plain_mesh import PlainMesh

Group = list[IntArray]  # For each block of cells in the file: 0 no member, 1 a member, −1 a member to be reversed.

MOST_MEMBERS = 10**8  # Groups times cells: so many take 1 GB. A mesh of a million cells may have a hundred groups.


def groups_of(mesh: PlainMesh) -> dict[str, Group]:
    """Return all groups of a mesh: sets of cells and physical groups by name, numbered groups by number as text."""
    named, numbered = _cell_sets(mesh), _tagged_cells(mesh)
    for name, (number, dim) in mesh.field_data.items():
        group = numbered.get(str(number), [np.zeros(len(block), dtype=np.int64) for block in mesh.cells])
        _include(named, name, [part * (block.dim == dim) for block, part in zip(mesh.cells, group, strict=True)])
        # A line in two groups has only the number of the first, but is in the sets of both (.msh 4.1).
        _include(numbered, str(number), named[name])
    return numbered | named


def _cell_sets(mesh: PlainMesh) -> dict[str, Group]:
    """Return the sets of cells by name."""
    numbers = [np.arange(len(block)) for block in mesh.cells]
    return {
        name: [np.isin(every, part).astype(np.int64) for every, part in zip(numbers, sets, strict=True)]
        for name, sets in mesh.cell_sets.items()
    }


def _tagged_cells(mesh: PlainMesh) -> dict[str, Group]:
    """Return the groups that the cell data number, by number as text."""
    groups: dict[str, Group] = {}
    n_cells = sum(map(len, mesh.cells))
    for key, parts in mesh.cell_data.items():
        tags = sorted({int(tag) for values in parts for tag in np.unique(values)} - {0})
        if len(tags) * n_cells > MOST_MEMBERS:
            raise MisuseError("--mesh", f"{len(tags)} groups of {n_cells} cells", "fewer groups")
        for tag in tags:
            group = [np.asarray(values == tag, dtype=np.int64) for values in parts]
            if key == "gmsh:physical" and tag < 0:  # In Gmsh, a negative number reverses the lines of a curve.
                _include(groups, str(-tag), [-part for part in group])
            else:
                _include(groups, str(tag), group)
    return groups


def _include(groups: dict[str, Group], name: str, group: Group) -> None:
    """Add the members of a group to those that the name has already."""
    known = groups.get(name, group)
    groups[name] = [np.where(part != 0, part, more) for part, more in zip(known, group, strict=True)]


def kinds_in(mesh: PlainMesh, group: Group) -> list[str]:
    """Return the types of the cells in a group."""
    return sorted({block.type for block, members in zip(mesh.cells, group, strict=True) if members.any()})


def unknown_group_error(mesh: PlainMesh, groups: dict[str, Group], argument: str, name: str) -> MisuseError:
    """Return the error for a group that the file does not have; it names near groups and lists all."""
    listed = ", ".join(f"{each!r} ({', '.join(kinds_in(mesh, group)) or 'empty'})" for each, group in groups.items())
    by_case = {each.casefold(): each for each in groups}
    near = [repr(by_case[each]) for each in get_close_matches(name.casefold(), by_case)]
    needed = (f"{' or '.join(near)}? The groups are " if near else "one of ") + listed
    return MisuseError(argument, f"{name!r}, which is no group of the file", needed if listed else "groups in the file")
