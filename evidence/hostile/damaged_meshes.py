"""Damage mesh files of many formats, and count how reading them ends.

`python evidence/hostile/damaged_meshes.py COUNT SEED` makes that many damaged files and prints the table; a file that
does harm is kept in the folder damaged/. An ending is good if the file is read, or refused in one line.
"""

import os
import random
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import meshlane
import netCDF4
import numpy as np
from damage import BYTES, ENDINGS, GOOD, Campaign, Ending, main, run_command

from contactverif import MisuseError, read_interface

PUNCH = Path(__file__).parents[2] / "tests" / "data" / "punch.msh"
# {file: (format of meshlane, options of its writer, the groups)}
NAMES, BY_NUMBER = ("punch", "base"), ("-1", "2")
FORMATS = {
    "ascii22.msh": ("gmsh22", {"binary": False}, NAMES),
    "binary22.msh": ("gmsh22", {"binary": True}, NAMES),
    "ascii41.msh": ("gmsh", {"binary": False}, NAMES),
    "binary41.msh": ("gmsh", {"binary": True}, NAMES),
    "ascii.vtk": ("vtk", {"binary": False}, ("1", "2")),
    "binary.vtk": ("vtk", {"binary": True}, ("1", "2")),
    "plain.vtu": ("vtu", {"binary": False}, ("1", "2")),
    "packed.vtu": ("vtu", {"binary": True}, ("1", "2")),
    "a.inp": ("abaqus", {}, NAMES),
    "a.mesh": ("medit", {}, BY_NUMBER),
    "a.meshb": ("medit", {}, BY_NUMBER),
    "a.med": ("med", {}, NAMES),
    "a.xdmf": ("xdmf", {"data_format": "XML"}, ("1", "2")),
    "a.bdf": ("nastran", {}, ("1", "2")),
    "a.avs": ("avsucd", {}, ("1", "2")),
    "a.g": ("exodus", {}, NAMES),
    "a.mdpa": ("", {}, NAMES),
    "pair.inp": ("", {}, (None, None)),
}
SPLIT = {"triangle": ([0, 1, 2],), "quad": ([0, 1, 2], [0, 2, 3])}
KEYS = {"medit": "medit:ref", "nastran": "nastran:ref", "avsucd": "avsucd:material"}
SUFFIXES = (".msh", ".vtk", ".vtu", ".inp", ".mesh", ".su2", ".xdmf", ".med", ".e", ".cgns", ".h5m", ".stl", ".xyz")
NUMBERS = (b"-1", b"0", b"99999999", b"9999999999999999999", b"nan", b"inf", b"1e400", b"x", b"", b"2147483648", b"1.5")


def members(mesh: meshlane.Mesh, tags: list[np.ndarray], number: int) -> list[np.ndarray]:
    """Return for each block the lines of a group."""
    return [
        np.flatnonzero((np.abs(part) == number) & (block.dim == 1))
        for block, part in zip(mesh.cells, tags, strict=True)
    ]


def write_meshes(folder: Path) -> dict[str, bytes]:
    """Return the bytes of the same mesh in many formats, by the name of a file."""
    for name, (format_, options, _) in FORMATS.items():
        with redirect_stdout(StringIO()):
            mesh = meshlane.read(PUNCH, file_format="gmsh")
            tags = mesh.cell_data["gmsh:physical"]
            if format_ not in ("gmsh22", "gmsh"):
                tags = tags if format_ in ("vtk", "vtu", "medit") else [np.abs(part) for part in tags]
                mesh.cell_data, mesh.point_data = {KEYS.get(format_, "gmsh:physical"): tags}, {}
                sets = {name: members(mesh, tags, number) for number, name in enumerate(NAMES, 1)}
                mesh.cell_sets = sets if format_ in ("abaqus", "med", "") else {}
            if format_ in ("med", "exodus", ""):
                mesh = merge(mesh, sets)
            if format_:
                meshlane.write(folder / name, mesh, file_format=format_, **options)
        if format_ in ("exodus", ""):
            {".g": add_side_sets, ".mdpa": write_mdpa, ".inp": write_pair}[Path(name).suffix](folder / name, mesh)
    return {name: (folder / name).read_bytes() for name in FORMATS}


def merge(mesh: meshlane.Mesh, sets: dict[str, list[np.ndarray]]) -> meshlane.Mesh:
    """Return a mesh with the lines of each set in one block, and its triangles in another."""
    lines = [
        np.vstack([b.data[part] for b, part in zip(mesh.cells, each, strict=True) if len(part)])
        for each in sets.values()
    ]
    cells = np.vstack([block.data[:, c] for block in mesh.cells for c in SPLIT.get(block.type, ())])
    numbers = np.split(np.arange(sum(map(len, lines))), [len(lines[0])])
    blocks = [("line", np.vstack(lines)), ("triangle", cells)]
    return meshlane.Mesh(
        mesh.points, blocks, cell_sets={name: [n, n[:0]] for name, n in zip(sets, numbers, strict=True)}
    )


def sides(mesh: meshlane.Mesh) -> list[np.ndarray]:
    """Return (cell, side) of the lines of each set, both counted from 1."""
    cells = mesh.cells[1].data
    edges = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1)).tolist()
    place = {tuple(edge): (c + 1, s + 1) for c, cell in enumerate(edges) for s, edge in enumerate(cell)}
    lines = np.sort(mesh.cells[0].data).tolist()
    return [np.array([place[tuple(lines[n])] for n in part]) for part, _ in mesh.cell_sets.values()]


def add_side_sets(path: Path, mesh: meshlane.Mesh) -> None:
    """Add side sets to a file of Exodus, whose first block is the lines."""
    with netCDF4.Dataset(path, "a") as data:
        data.createDimension("num_side_sets", 2)
        data.createVariable("ss_names", "S1", ("num_side_sets", "len_string"))[:, :5] = [[*"punch"], [*"base\0"]]
        for k, part in enumerate(sides(mesh), 1):
            size = data.createDimension(f"num_side_ss{k}", len(part)).name
            data.createVariable(f"elem_ss{k}", "i4", size)[:] = part[:, 0] + len(mesh.cells[0].data)
            data.createVariable(f"side_ss{k}", "i4", size)[:] = part[:, 1]


def write_mdpa(path: Path, mesh: meshlane.Mesh) -> None:
    """Write a file of Kratos with conditions in sub model parts. The numbers of its nodes have gaps."""
    lines = ["Begin Nodes", *(f"{10 * n} {x} {y} {z}" for n, (x, y, z) in enumerate(mesh.points, 1)), "End Nodes"]
    for block, word in zip(mesh.cells, ("Condition", "Element"), strict=True):
        rows = [f"{n} 0 {' '.join(map(str, 10 * row + 10))} // as drawn" for n, row in enumerate(block.data)]
        name = f"{word}{'2D' if mesh.cells[0].type == 'line' else '3D'}{block.data.shape[1]}N"
        lines += [f"Begin {word}s {name}", *rows, f"End {word}s"]
    for name, (part, _) in mesh.cell_sets.items():
        lines += [f"Begin SubModelPart {name}", "Begin SubModelPartConditions", *map(str, part)]
        lines += ["End SubModelPartConditions", "End SubModelPart"]
    path.write_text("\n".join(lines) + "\n")


def write_pair(path: Path, mesh: meshlane.Mesh) -> None:
    """Write a deck with a contact pair of two surfaces of sides of elements."""
    cells = mesh.cells[1].data
    lines = ["*NODE", *(f"{n}, {x}, {y}" for n, (x, y, _) in enumerate(mesh.points, 1))]
    lines += [
        f"*ELEMENT, TYPE=CPE{cells.shape[1]}",
        *(f"{n}, {', '.join(map(str, row + 1))}" for n, row in enumerate(cells, 1)),
    ]
    for name, part in zip(NAMES, sides(mesh), strict=True):
        lines += [f"*SURFACE, NAME={name}", *(f"{cell}, S{side}" for cell, side in part)]
    path.write_text("\n".join([*lines, "*CONTACT PAIR, INTERACTION=hard", "punch, base", ""]))


def lie(whole: bytes, chance: random.Random) -> bytes:
    """Return the text with one of its words exchanged for a number that means nothing there."""
    words = whole.split(b" ")
    place = chance.randrange(len(words))
    lines = words[place].split(b"\n")
    lines[chance.randrange(len(lines))] = chance.choice(NUMBERS)
    return b" ".join([*words[:place], b"\n".join(lines), *words[place + 1 :]])


def lie_in_integer(whole: bytes, chance: random.Random) -> bytes:
    """Return the bytes with a number of four or eight bytes that means nothing there."""
    size = chance.choice([4, 8])
    place = chance.randrange(max(1, len(whole) - size))
    number = chance.choice([-1, 2**31 - 1, -(2**31), 10**6, 0, 255])
    return whole[:place] + number.to_bytes(size, "little", signed=True) + whole[place + size :]


def rubbish(whole: bytes, chance: random.Random) -> bytes:
    """Return random bytes behind the beginning of the file."""
    return whole[: chance.choice([0, 1, 20, 200])] + chance.randbytes(3000)


def mix(whole: bytes, chance: random.Random) -> bytes:
    """Return the lines in another order."""
    lines = whole.split(b"\n")
    place, other = chance.randrange(len(lines)), chance.randrange(len(lines))
    lines[place], lines[other] = lines[other], lines[place]
    return b"\n".join(lines)


def swap_cards(whole: bytes, chance: random.Random) -> bytes:
    """Return the cards of a file, each with the lines below it, in another order."""
    cards = re.split(rb"(?m)^(?=[*$<]|Begin|[A-Z]{3})", whole)
    place, other = chance.randrange(len(cards)), chance.randrange(len(cards))
    cards[place], cards[other] = cards[other], cards[place]
    return b"".join(cards)


def rename(whole: bytes, chance: random.Random) -> bytes:
    """Return the bytes with a letter of one of the longer words changed."""
    word = chance.choice(list(re.finditer(rb"[A-Za-z_]{4,}", whole)) or [re.match(b"", whole)])
    place = chance.randrange(word.start(), max(word.end(), word.start() + 1))
    return whole[:place] + chance.choice([b"a", b"X", b"_", b"base"]) + whole[place + 1 :]


KINDS: dict[str, Callable[[bytes, random.Random], bytes]] = {
    **BYTES,
    "a word that lies": lie,
    "an integer that lies": lie_in_integer,
    "lines exchanged": mix,
    "rubbish": rubbish,
    "cards exchanged": swap_cards,
    "a name changed": rename,
}


def read(path: Path) -> None:
    """Read the interface of a mesh as a command does: a number on standard output, or one line of errors."""
    slave, master = FORMATS.get(path.name.removeprefix("damaged-"), ("", {}, NAMES))[2]
    try:
        interface = read_interface(path, slave=slave, master=master)
    except MisuseError as error:
        print(f"contactverif: {' '.join(str(error).split())}", file=sys.stderr)
        sys.exit(2)
    sides = interface.slave.segments, interface.master.segments
    places = [sorted(interface.nodes[side].tolist()) for side in sides]
    print(places, [side.tolist() for side in sides], sorted(places), sep="\n")


def strange_files(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield names that are no meshes at all, with a word for each."""
    for suffix in SUFFIXES:
        for word, content in {
            "empty": b"",
            "text": b"no mesh\n" * 50,
            "zeros": bytes(5000),
            "HDF5": b"\x89HDF\r\n\x1a\n" + bytes(3000),
        }.items():
            path = folder / f"{word}{suffix}"
            path.write_bytes(content)
            yield word, path
    (folder / "folder.msh").mkdir()
    os.mkfifo(folder / "pipe.msh")
    os.symlink(folder / "loop.msh", folder / "loop.msh")
    for word in ("folder", "pipe", "loop", "absent"):
        yield word, folder / f"{word}.msh"
    yield "a device", Path("/dev/zero")


class Reading(Ending):
    """The end of reading an interface. A number or a name that is another one makes a mesh that is right, too."""

    def word(self, undamaged: Ending) -> str:
        """Return one of `Damage.endings`."""
        if self.status or not self.output or ".py:" in self.errors:
            return super().word(undamaged)
        (where, elements, exchanged), before = self.output.splitlines(), undamaged.output.splitlines()
        if where == before[0]:
            return "as before"
        if self.errors:
            return "told"
        return "numbers, names" if elements == before[1] or exchanged == before[2] else "other elements"


class Damage(Campaign):
    """Damaged mesh files of all formats."""

    kinds = tuple(KINDS)
    endings = ("as before", "numbers, names", "told", "other elements", *ENDINGS[2:])
    harmful = frozenset(ENDINGS) - GOOD | {"other elements"}

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.files = write_meshes(folder)
        self.undamaged = {name: run_command([], main=lambda name=name: read(folder / name)) for name in self.files}
        for name, ending in self.undamaged.items():
            print(f"{name}: {ending.output.strip() or ending.errors.strip()}", file=sys.stderr)

    def begin(self) -> None:
        """Read what is no mesh at all."""
        for word, path in strange_files(self.folder):
            ending = run_command([], main=lambda path=path: read(path))
            self.judge_file(f"no mesh: {word}", ending, Ending(), "", "", b"")

    def attack(self, kind: str, chance: random.Random, name: str = "") -> str:
        """Read one damaged file."""
        file = chance.choice(list(self.files))
        path = self.folder / f"damaged-{file}"
        path.write_bytes(KINDS[kind](self.files[file], chance))
        ending, title = Reading(**vars(run_command([], main=lambda: read(path)))), f"{name}-{file}"
        return self.judge_file(kind, ending, self.undamaged[file], title, title, path.read_bytes())


if __name__ == "__main__":
    main(Damage)
