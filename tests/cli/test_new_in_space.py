"""The command `new --3d`: the files of a project in space. `tests/docs/test_new_project.py` runs one."""

import importlib
import tomllib
from pathlib import Path

import pytest
from asking import Ask, check_mistake

from contactverif import Subject, Verdict, verify


def test_a_project_in_space_registers_a_formulation_on_faces(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    answer = ask("new", "my-faces", "--3d")
    assert (answer.status, answer.err) == (0, "")
    assert answer.out.endswith("pytest && contactverif verify my-faces\n")
    files = {
        path.name: path.read_text(encoding="utf-8") for path in (tmp_path / "my-faces").iterdir() if path.is_file()
    }
    entries = tomllib.loads(files["pyproject.toml"])["project"]["entry-points"]["contactverif.formulations"]
    assert entries == {"my-faces": "my_faces:FaceToFace"}
    assert "dimensions=(3,), faces=(3,)" in files["my_faces.py"]
    assert not [name for name, text in files.items() if "{%" in text or max(map(len, text.splitlines())) > 200]
    assert max(map(len, files["my_faces.py"].splitlines())) <= 120
    compile(files["my_faces.py"], "my_faces.py", "exec")


def test_its_formulation_does_not_depend_on_the_corner_at_which_a_face_begins(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its search reached as far as a face does from its first corner: 2 of 100 mirror images had other cells."""
    monkeypatch.chdir(tmp_path)
    ask("new", "first-corner", "--3d")
    monkeypatch.syspath_prepend(tmp_path / "first-corner")
    subject = Subject("first-corner", importlib.import_module("first_corner").FaceToFace)
    run = verify(subject, ["mirror", "renumbering"], seed=2, shrink="none")
    assert [row.verdict for row in run.rows if row.planned] == [Verdict.PASS, Verdict.PASS]


def test_a_project_is_in_space_or_of_another_kind(ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    check_mistake(ask("new", "mine", "--3d", "--c"), "NAME: found --3d and --c; needed one of them")
