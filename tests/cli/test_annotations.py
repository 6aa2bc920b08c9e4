"""A workflow of GitHub shows all that makes a run fail where the factory of the formulation stands."""

import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from contactverif import Run, load_formulation, load_properties, verify
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

    def entries(group: str, name: str) -> list[EntryPoint]:
        return [EntryPoint(name, names[name], group)] if name in names else []

    monkeypatch.setattr("contactverif.cli.annotations.entry_points", entries)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    factory_place.cache_clear()
    yield tmp_path
    factory_place.cache_clear()


@pytest.fixture
def run(project: Path) -> Run:
    """Return a run with a broken promise and a plugin that does not load."""
    result = verify([load_formulation("nts")], load_properties(["patch.flat.single"]), examples=2, seed=1)
    rows = tuple(replace(row, promise=True) for row in result.rows)
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
