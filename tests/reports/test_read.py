"""A stored case comes back bit by bit; what is no report is named as what it is."""

import re
from operator import attrgetter
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from handmade_report import ERROR, awkward, small_run
from subjects import same_case

from contactverif import MisuseError, Verdict
from contactverif.contract import schema
from contactverif.contract.counterexample import Origin
from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.read import case_ids, open_report, read_case
from contactverif_reports.netcdf.write import write


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("whole") / "report.nc"
    write(small_run(), path)
    return path.read_bytes()


@pytest.fixture
def report(whole: bytes, tmp_path: Path) -> Path:
    """Return a report that a test may damage."""
    (tmp_path / "report.nc").write_bytes(whole)
    return tmp_path / "report.nc"


def test_ids_in_the_order_of_the_run(report: Path) -> None:
    assert case_ids(report) == [
        "vts-me_n_4.patch.flat.transmission",
        "vts-me_n_4.tangent.directional.witness",
        "vts-me_n_4.objectivity",
    ]


def test_every_bit_of_a_case_comes_back(report: Path) -> None:
    stored = read_case(report, "vts-me_n_4.tangent.directional.witness")
    assert same_case(stored.case, awkward())
    assert np.signbit(stored.case.z[3])


def test_a_counterexample_comes_back_with_its_numbers(report: Path) -> None:
    example = read_case(report, "vts-me_n_4.patch.flat.transmission")
    assert (example.formulation, example.property_id) == ("vts-me:n=4", "patch.flat.transmission")
    assert (example.verdict, example.reason) == (Verdict.FAIL, "force error 0.25, at most 1e-12")
    measured = attrgetter("outcome.measurement.values", "outcome.measurement.tolerances")
    assert measured(example) == ({ERROR.name: 0.25}, {ERROR.name: 1e-12})
    crashed = read_case(report, "vts-me_n_4.objectivity")
    assert (crashed.verdict, crashed.outcome.measurement) == (Verdict.CRASHED, None)
    partly = read_case(report, "vts-me_n_4.tangent.directional.witness")
    assert partly.origin is Origin.WITNESS
    assert list(measured(partly)[0]) == [ERROR.name], "the slope was not measured"


def test_an_unknown_id_suggests_the_nearest(report: Path, tmp_path: Path) -> None:
    passing = tmp_path / "passing.nc"
    write(small_run(passing=True), passing)
    assert case_ids(passing) == []
    for path, id_, words in (
        (report, "vts-me.patch.flat.transmision", "an id like vts-me_n_4.patch.flat.transmission"),
        (report, "§", "one of vts-me_n_4.patch"),
        (passing, "x", "this one has none"),
    ):
        with pytest.raises(MisuseError, match=re.escape(words)):
            read_case(path, id_)


def test_what_is_no_report(report: Path, tmp_path: Path) -> None:
    (tmp_path / "text.nc").write_text("not a report")
    (tmp_path / "cut.nc").write_bytes(report.read_bytes()[:5000])
    netCDF4.Dataset(tmp_path / "other.nc", "w").close()
    for name, version in (("newer", "99"), ("older", "1"), ("empty", schema.SCHEMA)):
        with netCDF4.Dataset(tmp_path / f"{name}.nc", "w") as file:
            file.title, file.schema = schema.TITLE, version
    for name, words in {
        "missing.nc": "does not exist",
        ".": "is a folder",
        "text.nc": "no netCDF file",
        "cut.nc": "which is damaged",
        "other.nc": "of something else",
        "newer.nc": "schema 99; needed schema 4; install a newer contactverif",
        "older.nc": "schema 1, which an older contactverif wrote; needed schema 4; run the same command again",
        "empty.nc": "without the group 'summary'; needed an undamaged report",
    }.items():
        with pytest.raises(MisuseError, match=words) as error:
            case_ids(tmp_path / name)
        assert error.value.argument == "REPORT"
    with pytest.raises(MisuseError, match="no netCDF file"):
        same_data(report, tmp_path / "text.nc")


def test_a_damaged_case_is_said_to_be_one(report: Path) -> None:
    with netCDF4.Dataset(report, "a") as file:
        file["counterexamples/vts-me_n_4.objectivity/case"].renameVariable("z", "zz")
        file["counterexamples/vts-me_n_4.objectivity/case/zz"].delncattr("case_array")
    with pytest.raises(MisuseError, match="undamaged"):
        read_case(report, "vts-me_n_4.objectivity")


@pytest.mark.parametrize(
    "error", [RuntimeError("NetCDF: HDF error"), KeyError("gone"), ValueError("99"), ZeroDivisionError()]
)
def test_what_is_damaged_in_a_report_is_one_line(report: Path, error: Exception) -> None:
    message = r"report.nc, which cannot be read \(.*\); needed an undamaged report"
    with pytest.raises(MisuseError, match=message) as caught, open_report(report):
        raise error
    assert "\n" not in str(caught.value)
