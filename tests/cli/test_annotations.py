"""A workflow of GitHub shows all that makes a run fail where the factory of the formulation stands."""

import os
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from contactverif import Run, load_formulation, load_properties, verify
from contactverif.cli import app as cli
from contactverif.cli import console
from contactverif.cli.annotations import annotate, factory_place
from contactverif.contract.result import NotLoaded

PACKAGE = {
    "mine/__init__.py": "from mine.methods import first\nfrom .methods import Second as second\n",
    "mine/methods.py": "from .deep import first\n\n\nclass Second:\n    pass\n",
    "mine/deep.py": "x = 1\n\ndef first(*, penalty):\n    return None\n",
}


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return the working folder of a project whose package has the factories of `nts` and `vts-ppt`."""
    for name, text in PACKAGE.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    names = {"nts": "mine:first", "vts-ppt": "mine:second"}
    entries = {name: [EntryPoint(name, value, "formulations")] for name, value in names.items()}
    monkeypatch.setattr("contactverif.cli.annotations.entries_by_name", lambda group: entries)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    factory_place.cache_clear()
    yield tmp_path
    factory_place.cache_clear()


@pytest.fixture
def run(project: Path) -> Run:
    """Return a run with a broken promise and a plugin that does not load."""
    result = verify([load_formulation("nts")], load_properties(["patch.flat.single"]), examples=2, seed=1)
    rows = tuple(replace(row, promise=True, promised_by="single=True") for row in result.rows)
    return replace(result, rows=rows, not_loaded=(NotLoaded("gone", "50% of it, and: nothing"),))


def test_a_workflow_gets_a_line_for_all_that_fails(
    run: Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    annotate(run)
    first, second = capsys.readouterr().out.splitlines()
    assert first == "::error title=gone is not loaded::50%25 of it, and: nothing"
    assert second.startswith("::error file=mine/deep.py,line=3,title=")
    assert "title=nts patch.flat.single%3A promised to pass%2C but fails::" in second


def test_elsewhere_nothing_is_printed(
    run: Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("GITHUB_ACTIONS", raising=False)
    annotate(run)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("nts", ("mine/deep.py", 3)),
        ("two-pass/nts:n=3", ("mine/deep.py", 3)),
        ("vts-ppt", ("mine/methods.py", 4)),
        ("absent", None),
    ],
)
def test_a_factory_stands_where_it_is_defined(project: Path, name: str, place: tuple[str, int] | None) -> None:
    """It is looked up through the imports of its package, of which nothing is imported."""
    assert factory_place(name) == place
    assert "mine" not in sys.modules


@pytest.mark.parametrize(
    "spoil",
    [
        lambda file: file.write_text("x = " + "(" * 100 + ")" * 100),
        lambda file: file.write_text("x = " + "-" * 200_000 + "1"),
        lambda file: file.write_text("x = 1\n" * (1 << 18)),
        lambda file: file.write_bytes(b"\xff\0"),
        os.mkfifo,
        lambda file: file.symlink_to("/dev/zero"),
        lambda file: file.symlink_to(file),
        lambda file: file.symlink_to("/etc/hostname"),
    ],
)
def test_a_source_that_cannot_be_read_ends_nothing(project: Path, spoil: Callable[[Path], object]) -> None:
    (project / "mine" / "deep.py").unlink()
    spoil(project / "mine" / "deep.py")
    assert factory_place("nts") in (None, ("mine/deep.py", 1))


@pytest.mark.parametrize("value", ["../..:!", "", "mine." + "x" * 300, ".".join("mine" * 2000)])
def test_an_entry_point_that_names_no_module_has_no_place(
    project: Path, monkeypatch: pytest.MonkeyPatch, value: str
) -> None:
    entries = {"nts": [EntryPoint("nts", value, "formulations")]}
    monkeypatch.setattr("contactverif.cli.annotations.entries_by_name", lambda group: entries)
    assert factory_place("nts") is None


@pytest.mark.parametrize("text", ["::error::a", "a\n \t::warning::b", "a\r::add-mask::c", "##[error]", "\u2003::a::b"])
def test_nothing_that_a_plugin_prints_is_a_command(
    text: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.setattr(console, "end_all", lambda: {text: text.encode()})
    monkeypatch.setattr(sys, "argv", ["contactverif", "verify", text])
    with pytest.raises(SystemExit):
        cli.main()
    console.print_plugin_output()
    console.show(text)
    sys.stdout.write(text)
    for line in re.split("[\r\n]", "\n".join(capsys.readouterr())):
        assert not line.strip().startswith("::")
        assert "##[" not in line


def test_a_factory_of_an_installed_package_stands_nowhere(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (project / "elsewhere").mkdir()
    monkeypatch.chdir(project / "elsewhere")
    assert factory_place("nts") is None
    factory_place.cache_clear()
    packages = project / ".venv" / "site-packages"
    packages.mkdir(parents=True)
    (project / "mine").rename(packages / "mine")
    monkeypatch.syspath_prepend(str(packages))
    monkeypatch.chdir(project)
    assert factory_place("nts") is None
