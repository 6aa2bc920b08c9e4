"""A workflow of GitHub shows all that makes a run fail where the factory of the formulation stands."""

from dataclasses import replace
from pathlib import Path

import pytest

from contactverif import Run, load_formulation, load_properties, verify
from contactverif.cli.annotations import annotate
from contactverif.cli.factory_places import factory_place
from contactverif.contract.result import NotLoaded

ROOT = Path(__file__).parents[2]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Run:
    """Return a run with a broken promise and a plugin that does not load, in the folder of the repository."""
    monkeypatch.chdir(ROOT)
    factory_place.cache_clear()
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
    assert second.startswith("::error file=plugins/contactverif_nts/point_contact.py,line=")
    assert ",title=nts patch.flat.single%3A promised to pass%2C but fails::" in second


def test_elsewhere_nothing_is_printed(
    run: Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("GITHUB_ACTIONS", raising=False)
    annotate(run)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("name", "file", "line"),
    [
        ("vts-ppt:n=3", "plugins/contactverif_nts/patch_test_passing.py", "def vts_ppt("),
        ("two-pass/mortar-dual-lm", "plugins/contactverif_mortar/mortar_methods.py", "def mortar_dual_lm("),
    ],
)
def test_a_factory_stands_where_it_is_defined(
    name: str, file: str, line: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """It is looked up through the imports of its package, and it is nowhere if its file is no part of the project."""
    monkeypatch.chdir(ROOT)
    factory_place.cache_clear()
    place = factory_place(name)
    assert place is not None
    assert place[0] == file
    assert (ROOT / file).read_text(encoding="utf-8").splitlines()[place[1] - 1].startswith(line)
    factory_place.cache_clear()
    monkeypatch.chdir(tmp_path)
    assert factory_place(name) is None
    factory_place.cache_clear()
