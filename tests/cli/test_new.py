"""The command `new`: the files that it makes, and the names that it refuses; `docs/test_page_projects.py` runs some."""

import errno
import importlib
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from asking import Ask, check_mistake

from contactverif import Subject, Verdict, verify
from contactverif.cli import new as new_project

Make = Callable[..., Path]


@pytest.fixture
def make(ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Make:
    """Return a function that makes a project in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def make_project(name: str, *options: str) -> Path:
        answer = ask("new", name, *options)
        assert (answer.status, answer.err) == (0, "")
        assert answer.out.endswith(f"next: cd {name} && pip install -e . && pytest && contactverif verify {name}\n")
        return tmp_path / name

    return make_project


def read_toml(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize(("name", "module"), [("mine", "mine"), ("My-NTS.2", "my_nts_2")])
def test_a_project_has_the_files_of_its_name(make: Make, name: str, module: str, tmp_path: Path) -> None:
    project = make(name)
    files = {path.relative_to(project).as_posix() for path in project.rglob("*") if path.is_file()}
    modules = {f"{module}.py", f"test_{module}.py"}
    assert files == modules | {"pyproject.toml", "README.md", "tox.ini", ".gitignore", ".github/workflows/tests.yml"}
    settings = read_toml(project / "pyproject.toml")
    assert settings["project"]["name"] == name
    assert settings["project"]["entry-points"]["contactverif.formulations"] == {name: f"{module}:SegmentToSegment"}
    assert list(tmp_path.iterdir()) == [project]
    assert not [path for path in files if "{{" in (project / path).read_text() and "yml" not in path]


def test_a_project_of_jax_needs_the_extra(make: Make) -> None:
    assert "contactverif[jax]" in read_toml(make("mine", "--jax") / "pyproject.toml")["project"]["dependencies"]


@pytest.mark.parametrize(
    ("option", "source", "subject"), [("--c", "c", "c:file=my_nts.so"), ("--fortran", "f90", "uel:file=my_nts.so")]
)
def test_a_project_of_a_library_has_a_makefile(
    ask: Ask, option: str, source: str, subject: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    answer = ask("new", "my-nts", option)
    assert answer.out.endswith(f"next: cd my-nts && make && contactverif verify {subject}\n")
    files = {path.name: path.read_text(encoding="utf-8") for path in (tmp_path / "my-nts").iterdir()}
    header = {"contactverif.h"} if source == "c" else set()
    library = {f"my_nts.{source}", "my_nts.toml", "test_my_nts.py", "Makefile"} | header
    assert files.keys() == library | {"pyproject.toml", "README.md", ".gitignore"}
    assert f"\n\t{'cc' if source == 'c' else 'gfortran'} -shared -fPIC -O2" in files["Makefile"]
    assert tomllib.loads(files["my_nts.toml"])["promises"]["tangent"] == "exact"
    assert tomllib.loads(files["pyproject.toml"])["tool"]["contactverif"] == {"profile": "ci"}
    assert f'"{subject}"' in files["test_my_nts.py"]
    assert "/my_nts.so" in files[".gitignore"]
    assert not [name for name, text in files.items() if "{{" in text or "{%" in text]


def test_a_project_in_space_registers_a_formulation_on_faces(make: Make) -> None:
    project = make("my-faces", "--3d")
    files = {path.name: path.read_text(encoding="utf-8") for path in project.iterdir() if path.is_file()}
    entries = read_toml(project / "pyproject.toml")["project"]["entry-points"]["contactverif.formulations"]
    assert entries == {"my-faces": "my_faces:FaceToFace"}
    assert "dimensions=(3,), faces=(3,)" in files["my_faces.py"]
    assert not [name for name, text in files.items() if "{%" in text or max(map(len, text.splitlines())) > 200]
    assert max(map(len, files["my_faces.py"].splitlines())) <= 120
    compile(files["my_faces.py"], "my_faces.py", "exec")


def test_the_search_in_space_does_not_depend_on_the_corner_at_which_a_face_begins(
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It reached as far as a face does from its first corner: 2 of 100 mirror images had other cells."""
    monkeypatch.syspath_prepend(make("first-corner", "--3d"))
    subject = Subject("first-corner", importlib.import_module("first_corner").FaceToFace)
    run = verify(subject, ["mirror", "renumbering"], seed=2, shrink="none")
    assert [row.verdict for row in run.rows if row.planned] == [Verdict.PASS, Verdict.PASS]


def test_tox_and_the_workflow_run_the_tests_and_verify(make: Make) -> None:
    project = make("mine", "--jax")
    workflow = yaml.safe_load((project / ".github" / "workflows" / "tests.yml").read_text(encoding="utf-8"))
    (job,) = workflow["jobs"].values()
    assert job["env"] == {"CONTACTVERIF": "contactverif[box]"}
    commands = [step["run"] for step in job["steps"] if "run" in step]
    assert commands[-2:] == ['python -m pip install "tox>=4.18"', "python -m tox"]
    assert all(re.fullmatch(r"[\w-]+/[\w-]+@v\d+", step["uses"]) for step in job["steps"] if "uses" in step)
    tox = (project / "tox.ini").read_text(encoding="utf-8")
    assert "contactverif verify mine mine-energy --out mine.nc --out mine.html" in tox


@pytest.mark.parametrize(
    ("source", "requirements"),
    [
        (None, ("contactverif[box]", "contactverif[box]")),
        (
            '{"url": "file:///a/clone", "dir_info": {}}',
            ("contactverif[box] @ file:///a/clone", "contactverif[box]"),
        ),
        (
            '{"url": "https://example.org/c", "vcs_info": {"vcs": "git", "commit_id": "1f"}}',
            ("contactverif[box] @ git+https://example.org/c@1f",) * 2,
        ),
    ],
)
def test_contactverif_comes_from_where_it_is_installed(
    make: Make, source: str | None, requirements: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Installed:
        def read_text(self, file: str) -> str | None:
            return source

    lookup = new_project._distribution
    monkeypatch.setattr(
        new_project, "_distribution", lambda name: Installed() if name == "contactverif" else lookup(name)
    )
    project = make("mine")
    assert f"deps = {{env:CONTACTVERIF:{requirements[0]}}}\n" in (project / "tox.ini").read_text()
    assert f"      CONTACTVERIF: {requirements[1]}\n" in (project / ".github" / "workflows" / "tests.yml").read_text()


def test_nothing_is_left_where_the_disk_is_full(ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write = Path.write_text

    def write_until_full(path: Path, text: str, **options: Any) -> int:
        if path.name == "tox.ini":
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        return write(path, text, **options)

    monkeypatch.setattr(Path, "write_text", write_until_full)
    check_mistake(ask("new", "mine"), r".*tox\.ini: No space left on device")
    assert not list(tmp_path.iterdir())
