"""The command `report`: the table of the run again, a page; and what a report names is said before it runs."""

import re
from pathlib import Path

import pytest
from asking import Ask
from handmade_run import run_with

from contactverif import MisuseError, named_case
from contactverif.cli.replay import announce_stored
from contactverif.plugins.registry import the_property
from contactverif_reports.netcdf.write import write


@pytest.mark.parametrize("files", [("page.html",), ("words.nc", "page.html")])
def test_verify_writes_the_page_with_or_without_the_report(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, files: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    answer = ask(f"verify nts -p patch.flat.transmission --examples 4 --seed 3 --out {' --out '.join(files)}")
    assert (answer.status, answer.err) == (0, "")
    assert "\npage: page.html\n" in answer.out
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(files)
    name = "words.nc" if "words.nc" in files else "FILE.nc"
    command = f"contactverif replay {name} --case nts.patch.flat.transmission.witness"
    assert command in Path("page.html").read_text()


def test_the_table_and_the_page_are_those_of_the_run(ask: Ask, tmp_path: Path) -> None:
    """NTS fails the patch test as it states."""
    path, page = tmp_path / "nts.nc", tmp_path / "nts.html"
    words = "verify nts vts-ppt -p patch.flat.* -p tangent.* --examples 4 --seed 3 --shrink all -v --out"
    verified = ask(words, path)
    answer = ask("report -v", path)
    assert (answer.status, answer.err) == (0, "")
    *table, verdict, promises = answer.out.splitlines()
    assert len(table) > 8
    assert verified.out.splitlines()[: len(table)] == table
    assert verified.out.splitlines()[-2:] == [f"{verdict[:-1]} (exit 0).", promises]  # A report ends no run.
    assert ask("report", path, "--out", page) == (0, f"page: {page}\n", "")
    text = page.read_text(encoding="utf-8")
    assert text.startswith("<!DOCTYPE html>")
    assert "Verification of nts, vts-ppt" in text
    assert f"contactverif replay {path} --case nts.patch.flat.transmission" in text
    assert not re.search(r'(?:src|href)="(?!#)', text)
    ask("report", path, "--out", page)
    assert page.read_text(encoding="utf-8") == text


def test_a_report_with_failures_is_shown_all_the_same(ask: Ask, tmp_path: Path) -> None:
    path = tmp_path / "wrong.nc"
    write(run_with(named_case("a1"), "nts"), path)
    answer = ask("report", path)
    assert answer.status == 0
    assert "patch.flat.transmission" in answer.out
    assert ask("report", path, "--out", tmp_path / "wrong.html").status == 0


def test_what_a_report_names_is_said_before_it_runs(capsys: pytest.CaptureFixture[str]) -> None:
    assert announce_stored("two-pass/vts-me:n=4,area=reference") == "two-pass/vts-me:n=4,area=reference"
    words = "the report names the formulation two-pass/vts-me, n = 4, area = 'reference'\n"
    assert capsys.readouterr() == ("", words)
    announce_stored("nts")
    assert capsys.readouterr().err == "the report names the formulation nts, without options\n"


@pytest.mark.parametrize("name", ["os.system", "two-pass/\x1b[31mevil", "vts-me/../x:n=4", "NTS", " ", "c:file=x"])
def test_a_report_runs_nothing_that_is_not_installed(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(MisuseError, match=r"REPORT: found the formulation .*, which (is not|loads) .*; needed"):
        announce_stored(name)
    assert capsys.readouterr() == ("", "")


def test_a_pattern_is_no_property() -> None:
    with pytest.raises(MisuseError, match="property: found 'patch"):
        the_property("patch.*")
