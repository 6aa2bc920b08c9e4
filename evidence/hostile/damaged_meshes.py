"""Damage mesh files of many formats, and count how reading them ends.

`python evidence/hostile/damaged_meshes.py COUNT SEED` makes that many damaged files and prints the table; a file that
does harm is kept in the folder damaged/. An ending is good if the file is read, or refused in one line.
"""

import os
import random
import sys
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import meshlane
import numpy as np
from damage import BYTES, Campaign, Ending, main, run_command

from contactverif import MisuseError, read_interface

PUNCH = Path(__file__).parents[2] / "tests" / "data" / "punch.msh"
# {file: (format of meshlane, options of its writer, the groups)}, without those that need a further package.
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
}
KEYS = {"medit": "medit:ref"}
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
    files = {}
    for name, (format_, options, _) in FORMATS.items():
        with redirect_stdout(StringIO()):
            mesh = meshlane.read(PUNCH, file_format="gmsh")
            tags = mesh.cell_data["gmsh:physical"]
            if format_ not in ("gmsh22", "gmsh"):
                mesh.cell_data, mesh.point_data = {KEYS.get(format_, "gmsh:physical"): tags}, {}
                mesh.cell_sets = (
                    {name: members(mesh, tags, number) for number, name in enumerate(NAMES, 1)}
                    if format_ == "abaqus"
                    else {}
                )
            meshlane.write(folder / name, mesh, file_format=format_, **options)
        files[name] = (folder / name).read_bytes()
    return files


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


KINDS: dict[str, Callable[[bytes, random.Random], bytes]] = {
    **BYTES,
    "a word that lies": lie,
    "an integer that lies": lie_in_integer,
    "lines exchanged": mix,
    "rubbish": rubbish,
}


def read(path: Path) -> None:
    """Read the interface of a mesh as a command does: a number on standard output, or one line of errors."""
    slave, master = FORMATS.get(path.name.removeprefix("damaged-"), ("", {}, NAMES))[2]
    try:
        interface = read_interface(path, slave=slave, master=master)
    except MisuseError as error:
        print(f"contactverif: {' '.join(str(error).split())}", file=sys.stderr)
        sys.exit(2)
    print(len(interface.slave), len(interface.master), float(np.abs(interface.nodes).max()))


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


class Damage(Campaign):
    """Damaged mesh files of all formats."""

    kinds = tuple(KINDS)

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
        ending, title = run_command([], main=lambda: read(path)), f"{name}-{file}"
        return self.judge_file(kind, ending, self.undamaged[file], title, title, path.read_bytes())


if __name__ == "__main__":
    main(Damage)
