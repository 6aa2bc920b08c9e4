"""The report that `verify` returns: short when printed, a table, a picture, the data of the file, and files."""

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import xarray as xr
from formulations_of_a_session import Half, Right

from contactverif import MisuseError, Report, Subject, Verdict, load_formulation, verify
from contactverif_reports.netcdf.read import read_run

PROPERTIES = ["mirror", "patch.flat.transmission"]


@pytest.fixture(scope="module")
def report() -> Report:
    return verify(["vts-me", Half, Right], PROPERTIES, examples=10, seed=1)


def test_it_prints_counts_and_the_first_failure_in_a_few_lines(report: Report) -> None:
    lines = repr(report).splitlines()
    assert lines[0] == "vts-me: fails 1 of 2, the patch test among them, as it states"
    assert "Right: 2 pass" in lines
    at = next(n for n, line in enumerate(lines) if line.startswith("first failure"))
    assert lines[at] == "first failure: Half, patch.flat.transmission: fail, the smallest case found"
    assert lines[at + 1].startswith("    error of a nodal force 0.25, at most ")
    assert len(lines) <= 10


def test_many_formulations_are_counted_together() -> None:
    many = [Subject(f"right-{number}", Right) for number in range(7)]
    assert repr(verify(many, "mirror", examples=1, seed=1)).startswith("7 formulations: 7 pass\n")


def test_failures_begin_with_news_and_end_with_what_is_stated(report: Report) -> None:
    assert [failure.formulation for failure in report.failures] == ["Half", "vts-me"]
    first = report.failures[0]
    assert first.verdict is Verdict.FAIL
    assert len(first.case.interface.slave) == 1
    assert repr(first) in repr(report)


def test_a_failure_is_drawn_with_its_forces_beside_the_exact_ones(report: Report, tmp_path: Path) -> None:
    drawing = report.failures[0].draw()
    svg = drawing._repr_html_()
    assert "force of the formulation" in svg
    assert "exact force" in svg
    assert svg == report.failures[0]._repr_html_()
    drawing.write(tmp_path / "failure.svg")
    assert ET.parse(tmp_path / "failure.svg").getroot().tag.endswith("svg")
    with pytest.raises(MisuseError, match=r"path: found .*failure\.pdf'; needed a name that ends in \.png or \.svg"):
        drawing.write(tmp_path / "failure.pdf")


def test_a_notebook_shows_what_fails_and_one_mesh(report: Report) -> None:
    page = report._repr_html_()
    root = ET.fromstring(page)
    assert [[cell.text for cell in row][:3] for row in root.iter("tr")][1:] == [
        ["Half", "patch.flat.transmission", "fail"],
        ["vts-me", "patch.flat.transmission", "fails as stated"],
    ]
    assert len(list(root.iter("svg"))) == 1
    assert len(page) < 40_000


def test_a_notebook_shows_no_mesh_where_nothing_fails() -> None:
    page = verify(Right, "mirror", examples=2, seed=1)._repr_html_()
    assert "Every promise is kept" in page
    assert "<svg" not in page
    assert "<table" not in page


def test_a_notebook_shows_names_as_words(report: Report) -> None:
    page = verify(Subject("<b>mine</b>", Half), PROPERTIES, examples=2, seed=1)._repr_html_()
    assert "<b>" not in page
    assert "&lt;b&gt;mine" in page


def test_a_long_list_of_failures_is_cut() -> None:
    many = [Subject(f"half-{number}", Half) for number in range(12)]
    page = verify(many, "patch.flat.transmission", examples=1, seed=1, shrink="none")._repr_html_()
    assert page.count("<tr>") == 11
    assert "and 2 more" in page


def test_the_table_has_a_line_for_each_row(report: Report) -> None:
    table = report.table().set_index(["formulation", "property"])
    assert len(table) == len(report.rows) == 6
    line = table.loc[("Half", "patch.flat.transmission")]
    assert (line.result, line.judged, line.failed) == ("fail", 10, 10)
    assert line.quantity == "error of a nodal force"
    assert line.value > line.tolerance
    assert table.loc[("vts-me", "patch.flat.transmission")].promise is False


def test_xarray_gets_what_it_reads_from_the_file(report: Report, tmp_path: Path) -> None:
    report.write(tmp_path / "report.nc")
    tree = report.to_xarray()
    with xr.open_datatree(tmp_path / "report.nc", engine="netcdf4") as stored:
        assert tree.identical(stored)
    patch = tree["patch/flat/transmission"].to_dataset()
    assert bool((patch.value / patch.tolerance).sel(formulation="Right").max() < 1)


@pytest.mark.parametrize("suffix", [".nc", ".html", ".json", ".xml"])
def test_the_suffix_says_what_is_written(report: Report, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"mine{suffix}"
    report.write(path)
    if suffix == ".nc":
        assert [row.result for row in read_run(path).rows] == [row.result for row in report.rows]
    else:
        assert "patch.flat.transmission" in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("mine.txt", r"path: found '.*mine\.txt'; needed a name that ends in \.nc, \.html, \.json or \.xml"),
        ("no/mine.nc", r"path: found .*no/mine\.nc in .*, which is no folder; needed a folder that exists"),
    ],
)
def test_a_file_that_cannot_be_written_is_told(report: Report, tmp_path: Path, name: str, message: str) -> None:
    with pytest.raises(MisuseError, match=message):
        report.write(tmp_path / name)


def test_a_part_of_a_report_is_a_report(report: Report) -> None:
    part = report.only(["mirror"])
    assert isinstance(part, Report)
    assert part.failures == []


def test_opposite_signs_are_told() -> None:
    assert "opposite sign" in repr(verify(Negative, "mirror", examples=1, seed=1))


class Negative(Right):
    """The right forces with the opposite sign."""

    def __init__(self, *, penalty: float) -> None:
        super().__init__(penalty=penalty, factor=-1.0)


def test_a_formulation_that_was_loaded_before_is_the_same_one() -> None:
    subject = load_formulation("vts-me")
    assert verify([subject], "mirror", examples=1, seed=1).subjects["vts-me"] is subject
