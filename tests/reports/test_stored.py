"""A whole report comes back as it was found."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from made import ERROR, small_run

from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Verdict
from contactverif.contract.result import NotLoaded, Run
from contactverif_reports.netcdf.read import case_ids
from contactverif_reports.netcdf.stored import StoredReport, read_report
from contactverif_reports.netcdf.write import write


@pytest.fixture
def path(tmp_path: Path) -> Path:
    target = tmp_path / "report.nc"
    write(small_run(), target)
    return target


@pytest.fixture
def report(path: Path) -> StoredReport:
    return read_report(path)


def test_every_row_comes_back(report: StoredReport) -> None:
    run = small_run()
    assert list(report.formulations) == ["vts-ppt", "vts-me:n=4"]
    assert list(report.properties) == ["patch.flat.transmission", "tangent.directional", "objectivity"]
    assert set(report.rows) == {(row.formulation, row.question.id) for row in run.rows}
    for row in run.rows:
        stored = report.rows[row.formulation, row.question.id]
        cell = stored.cell
        assert (cell.verdict, cell.promise, cell.unexpected) == (row.verdict, row.promise, row.unexpected)
        assert (cell.reason, stored.known) == (row.reason, row.known)
        assert (cell.planned, cell.judged, stored.seconds) == (row.planned, row.judged, row.seconds)
        assert stored.undecided == sum(outcome.verdict is Verdict.UNDECIDED for outcome in row.outcomes)


def test_questions_come_back(report: StoredReport) -> None:
    asked = report.properties["patch.flat.transmission"]
    assert asked.summary == "a uniform pressure is transmitted exactly"
    assert asked.quantities == (ERROR,)
    assert report.properties["objectivity"].quantities == ()


def test_the_furthest_number_is_that_of_the_witness_where_it_is_worse(report: StoredReport) -> None:
    row = report.rows["vts-me:n=4", "tangent.directional"]
    assert row.worst is not None
    assert row.worst.value == 4e-15
    assert row.witness is not None
    assert (row.witness.name, row.witness.verdict) == ("C′ №1", Verdict.FAIL)
    assert [held.value for held in row.witness.numbers] == [0.1], "the slope was not measured"
    assert row.furthest is row.witness.numbers[0]
    assert row.furthest.excess == pytest.approx(1e11)
    assert row.furthest.sign == "≤"
    patch = report.rows["vts-me:n=4", "patch.flat.transmission"]
    assert patch.furthest is patch.worst
    assert patch.worst is not None
    assert patch.worst.value == 0.25


def test_cases_that_decide_nothing_are_counted_by_reason(tmp_path: Path) -> None:
    run = small_run()
    row = run.rows[3]
    undecided = replace(row.outcomes[0], verdict=Verdict.UNDECIDED, reason="a kink")
    other = replace(undecided, reason="roundoff")
    rows = (replace(row, outcomes=(other, undecided, *row.outcomes, undecided)),)
    write(replace(run, rows=rows), tmp_path / "kinks.nc")
    stored = read_report(tmp_path / "kinks.nc").rows["vts-me:n=4", "patch.flat.transmission"]
    assert list(stored.silences.items()) == [("a kink", 2), ("roundoff", 1)]
    assert stored.undecided == 3


def test_a_number_that_was_not_measured_has_no_margin(tmp_path: Path) -> None:
    """A tolerance without its value is no failure (a property may give one)."""
    run = small_run()
    row = run.rows[4]
    assert [quantity.name for quantity in row.question.quantities] == ["force error", "slope"]
    measured = row.outcomes[0].measurement
    assert measured is not None
    more = replace(measured, tolerances={**measured.tolerances, "slope": 1.9})
    rows = (replace(row, outcomes=(replace(row.outcomes[0], measurement=more),), witness=None),)
    write(replace(run, rows=rows), tmp_path / "partly.nc")
    stored = read_report(tmp_path / "partly.nc").rows["vts-me:n=4", "tangent.directional"]
    assert stored.cell.margins.tolist() == [1e-15 / 1e-12]


def test_counterexamples_parts_and_provenance(report: StoredReport, path: Path) -> None:
    assert list(report.examples) == case_ids(path)
    assert list(report.examples_of("vts-me:n=4")) == case_ids(path)
    assert report.examples_of("vts-ppt") == {}
    assert report.provided["vts-ppt"] == {"pair": True, "tangent": False, "contact_points": True}
    assert report.not_loaded == {"mine": "ModuleNotFoundError: No module named 'mine'"}
    assert not report.passed
    assert [row.cell.unexpected for row in report.unexpected] == ["crashed"]
    assert report.provenance["seed"] == "7"
    assert "title" not in report.provenance


def test_a_run_that_passed(tmp_path: Path) -> None:
    write(small_run(passing=True), tmp_path / "passed.nc")
    report = read_report(tmp_path / "passed.nc")
    assert report.passed
    assert report.unexpected == ()
    assert report.examples == {}


def test_a_run_of_nothing(tmp_path: Path) -> None:
    write(Run((), (NotLoaded("mine", "no such module"),), {}, {}), tmp_path / "nothing.nc")
    report = read_report(tmp_path / "nothing.nc")
    assert (report.rows, report.formulations, dict(report.properties)) == ({}, (), {})
    assert report.not_loaded == {"mine": "no such module"}


@pytest.mark.parametrize("group", ["summary", "timing", "counterexamples"])
def test_a_group_that_is_missing(path: Path, group: str) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file.renameGroup(group, "elsewhere")
    with pytest.raises(MisuseError, match="an undamaged report"):
        read_report(path)


def test_a_verdict_that_there_is_not(path: Path) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file["summary/row_verdict"][0, 0] = np.int8(99)
    with pytest.raises(MisuseError, match="an undamaged report"):
        read_report(path)


def test_a_file_cut_short(path: Path, tmp_path: Path) -> None:
    short = tmp_path / "short.nc"
    shutil.copy(path, short)
    with short.open("r+b") as file:
        file.truncate(short.stat().st_size // 2)
    with pytest.raises(MisuseError) as error:
        read_report(short)
    assert "\n" not in str(error.value)
