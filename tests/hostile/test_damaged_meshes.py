"""A damaged mesh file is read or refused in one line. `damaged_meshes.py` makes many more."""

import random
import sys
import warnings
from pathlib import Path

import meshlane
import numpy as np
import pytest
from damaged_meshes import FORMATS, KINDS, NAMES, strange_files, write_meshes

from contactverif import MisuseError, read_interface
from contactverif.isolation.limits import Limits
from contactverif.meshes import plain_mesh
from contactverif.meshes.plain_mesh import read_mesh

N_FILES = 12  # The number of files with each kind of damage.


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # meshlane's writers.
        return write_meshes(tmp_path_factory.mktemp("meshes"))


def reason_of(path: Path, slave: str, master: str) -> str:
    """Return why a file is refused; empty if it is read."""
    try:
        interface = read_interface(path, slave=slave, master=master)
    except MisuseError as error:
        return str(error)
    assert np.isfinite(interface.nodes).all()
    return ""


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_mesh_is_read_or_refused_in_one_line(kind: str, files: dict[str, bytes], tmp_path: Path) -> None:
    reasons = []
    for number in range(N_FILES):
        chance = random.Random(f"{kind}/{number}")
        name = chance.choice(list(files))
        (tmp_path / name).write_bytes(KINDS[kind](files[name], chance))
        reasons.append(reason_of(tmp_path / name, *FORMATS[name][2]))
        assert "\n" not in reasons[-1]
        assert len(reasons[-1]) < 1000
    assert any(reasons)


def test_what_is_no_mesh_is_refused_in_one_line(tmp_path: Path) -> None:
    for _, path in strange_files(tmp_path):
        reason = reason_of(path, *NAMES)
        assert reason.startswith("--mesh: found")
        assert "\n" not in reason


def write_text(path: Path, lines: str, points: str = "1 0 0 0\n2 1 0 0\n3 1 1 0\n") -> Path:
    """Write a mesh of three points in Gmsh's format 2.2."""
    count = len(lines.splitlines())
    path.write_text(
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n{points}$EndNodes\n$Elements\n{count}\n{lines}$EndElements\n"
    )
    return path


def test_cells_name_points_that_are_there(tmp_path: Path) -> None:
    path = write_text(tmp_path / "a.msh", "1 1 2 1 1 1 2\n2 1 2 2 2 2 3\n")
    assert len(read_mesh(path).cells["line"]) == 2
    for nodes, words in {"2 9": r"with a line on point -?\d+ of 3 points", "0 3": "with a line on point -1"}.items():
        mesh = meshlane.Mesh(np.zeros((3, 2)), [("line", np.array([[int(node) - 1 for node in nodes.split()]]))])
        meshlane.write(tmp_path / "a.vtu", mesh, binary=False)
        with pytest.raises(MisuseError, match=words):
            read_mesh(tmp_path / "a.vtu")


def test_what_python_warns_of_in_a_library_is_not_shown(tmp_path: Path) -> None:
    path = tmp_path / "a.mesh"
    # numpy warns where the number of a point is not whole.
    path.write_text("MeshVersionFormatted 2\nDimension 2\nVertices\n2\n0 0 1\n1 0 nan\nEdges\n1\n1 2 1\nEnd\n")
    assert read_mesh(path).warnings == ""


def test_points_are_numbers(tmp_path: Path) -> None:
    path = write_text(tmp_path / "a.msh", "1 1 2 1 1 1 2\n2 1 2 2 2 2 3\n", "1 0 0 0\n2 nan 0 0\n3 1 1 0\n")
    with pytest.raises(MisuseError, match="--mesh: found NaN or infinity among its coordinates"):
        read_interface(path, slave="1", master="2")


def test_a_format_that_needs_a_package_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "h5py", None)
    (tmp_path / "a.med").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    with pytest.raises(MisuseError, match="its format needs the package h5py: pip install h5py"):
        read_mesh(tmp_path / "a.med")


def test_a_reader_without_an_end_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_text(tmp_path / "a.msh", "1 1 2 1 1 1 2\n")
    monkeypatch.setattr(plain_mesh, "limits_for", lambda size: Limits(1e-6, 500))
    with pytest.raises(MisuseError, match=r"cannot be read \(reading it takes longer than .* s\)"):
        read_mesh(path)


def test_so_many_groups_are_no_groups(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_text(tmp_path / "a.msh", "1 1 2 1 1 1 2\n2 1 2 2 2 2 3\n")
    monkeypatch.setattr("contactverif.meshes.read_file._MOST_VALUES", 1)
    with pytest.raises(
        MisuseError, match="--slave: found '1', which is no group of the file; needed a group of line or vertex"
    ):
        read_interface(path, slave="1", master="2")
