"""A report is whole or not there; it opens anywhere; two equal runs give equal data."""

import os
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr
from handmade_report import ERROR, flat, outcome, question, small_run

from contactverif import MisuseError, Row, Run, Verdict, load_formulation, load_properties, verify
from contactverif.contract.counterexample import case_id
from contactverif.contract.schema import VERDICTS, Group, codes, numbers, words
from contactverif_reports.files import check_writable
from contactverif_reports.netcdf import write as writing
from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.file_groups import write_tree
from contactverif_reports.netcdf.write import group_names, tree_of, write


@pytest.fixture
def report(tmp_path: Path) -> Path:
    path = tmp_path / "report.nc"
    write(small_run(), path)
    return path


def variables(group: netCDF4.Dataset) -> list[netCDF4.Variable]:
    return [*group.variables.values(), *(entry for child in group.groups.values() for entry in variables(child))]


def test_opens_with_xarray(report: Path) -> None:
    with xr.open_datatree(report) as tree:
        assert list(tree.children) == [
            "summary", "patch", "tangent", "objectivity", "counterexamples", "timing",
        ]  # fmt: skip
        patch = tree["patch/flat/transmission"].to_dataset()
        assert patch.sizes == {"formulation": 2, "case": 4, "quantity": 1, "detail": 1, "parameter": 1}
        verdicts = patch.verdict.sel(formulation="vts-me:n=4").values
        np.testing.assert_array_equal(verdicts, [0, 0, 1, np.nan])
        assert patch.value.sel(formulation="vts-me:n=4", quantity=ERROR.name)[2] == 0.25
        assert patch.reason.sel(formulation="vts-me:n=4")[2] == "force error 0.25, at most 1e-12"
        assert patch.tolerance_formula.values == [ERROR.tolerance]
        assert patch.n_master_segments.sel(formulation="vts-ppt").values.tolist() == [1, 1, 1, 1]
        assert patch.parameter_units.sel(parameter="penetration") == "m"
        assert patch.witness_case_name.values.tolist() == ["", "C′ №1"]
        assert tree["tangent/directional"].sizes["quantity"] == 2
        assert "quantity" not in tree["objectivity"].sizes
        facts = {"seed": "7", "promises_kept": "false", "schema": "4", "Conventions": "CF-1.11 UGRID-1.0"}
        assert facts.items() <= tree.attrs.items()


def test_summary_counts_every_verdict(report: Path) -> None:
    with xr.open_datatree(report) as tree:
        summary = tree["summary"].to_dataset().load()
    row = summary.sel(formulation="vts-me:n=4", property="patch.flat.transmission")
    assert row["count"].sel(verdict="pass") == 2
    assert row["count"].sel(verdict="fail") == 1
    assert (row.planned, row.judged, row.row_verdict, row.promise) == (4, 3, VERDICTS["fail"], 2)
    assert (row.closest_value, row.closest_tolerance, row.closest_case) == (0.25, 1e-12, 2)
    assert summary.sizes["verdict"] == len(Verdict)
    assert summary.unexpected.sel(formulation="vts-me:n=4", property="objectivity").item() == "crashed"
    assert summary.provided.sel(formulation="vts-ppt", part="tangent") == 0
    assert "tangent: not provided" in summary.attrs["parts"]
    assert summary.not_loaded.values.tolist() == ["mine"]
    assert "No module named 'mine'" in summary.not_loaded_reason.item()


def test_reads_like_documentation(report: Path) -> None:
    with netCDF4.Dataset(report) as file:
        for variable in variables(file):
            assert variable.long_name, variable
            if variable.dtype.kind == "S":
                assert variable._Encoding == "utf-8"
                continue
            assert variable.units, variable
            filters = variable.filters()
            assert filters["zlib"] == (variable.ndim > 0 and variable.size * variable.dtype.itemsize >= 4096), variable
            assert filters["complevel"] == (4 if filters["zlib"] else 0)
            if hasattr(variable, "flag_meanings"):
                names = "flag_masks" if hasattr(variable, "flag_masks") else "flag_values"
                assert len(variable.flag_meanings.split()) == len(variable.getncattr(names))
            assert variable.dtype is not str  # those crash HDF5 when a file is opened twice


def test_counterexample_is_a_ugrid_mesh(report: Path) -> None:
    with xr.open_datatree(report) as tree:
        example = tree["counterexamples/vts-me_n_4.patch.flat.transmission"].to_dataset()
        mesh = example.mesh.attrs
        assert (mesh["cf_role"], mesh["topology_dimension"]) == ("mesh_topology", 1)
        assert example[mesh["edge_node_connectivity"]].attrs["start_index"] == 0
        x, y = (example[name] for name in mesh["node_coordinates"].split())
        assert x.dims == y.dims == ("node",)
        assert example.side.values.tolist() == [0] * 4 + [1] * 4
        np.testing.assert_array_equal(example.current_y.values[:5], -0.125)
        assert set(tree["counterexamples"].children) == {
            "vts-me_n_4.patch.flat.transmission", "vts-me_n_4.tangent.directional.witness", "vts-me_n_4.objectivity",
        }  # fmt: skip


def test_same_run_same_data(tmp_path: Path) -> None:
    run = small_run()
    slower = tuple(
        replace(row, seconds=9.0, outcomes=tuple(replace(case, seconds=3.0) for case in row.outcomes))
        for row in run.rows
    )
    other = {"created": "2026", "command": "again", "platform": "elsewhere"}
    write(run, tmp_path / "a.nc")
    write(replace(run, rows=slower, provenance={**run.provenance, **other}), tmp_path / "b.nc")
    assert same_data(tmp_path / "a.nc", tmp_path / "b.nc") == []


def test_a_report_is_the_same_however_many_cases_are_in_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    subjects = [load_formulation(name) for name in ("nts", "vts-me-lm")]
    questions = load_properties(["patch.flat.transmission", "hard.deep", "newton.order", "swap"])
    result = verify(subjects, questions, examples=12, seed=3)
    for name, size in (("whole.nc", 10_000), ("pieces.nc", 5)):
        monkeypatch.setattr(writing, "CASES_OF_A_BLOCK", size)
        write(result, tmp_path / name)
    assert same_data(tmp_path / "whole.nc", tmp_path / "pieces.nc") == []


def test_differences_are_told(tmp_path: Path) -> None:
    run = small_run()
    better = outcome(flat([2, 2], [4]), 2e-15)
    first = replace(run.rows[0], outcomes=(better, *run.rows[0].outcomes[1:]))
    changed = replace(run, rows=(first, *run.rows[1:]), provenance={**run.provenance, "seed": "8"})
    write(run, tmp_path / "a.nc")
    write(changed, tmp_path / "b.nc")
    assert same_data(tmp_path / "a.nc", tmp_path / "b.nc") == [
        "/:seed: 7 and 8",
        "/patch/flat/transmission/value: 1e-15 and 2e-15 at (0, 0, 0), and 0 more",
    ]
    write(small_run(passing=True), tmp_path / "b.nc")
    assert any(line.startswith("/counterexamples/") for line in same_data(tmp_path / "a.nc", tmp_path / "b.nc"))


def test_nothing_but_plugins_that_did_not_load(tmp_path: Path) -> None:
    write(Run((), small_run().not_loaded), tmp_path / "none.nc")
    with xr.open_datatree(tmp_path / "none.nc") as tree:
        assert tree["summary"].not_loaded.values.tolist() == ["mine"]
        assert tree.attrs["promises_kept"] == "false"


def test_words_that_netcdf_cannot_hold(tmp_path: Path) -> None:
    odd = outcome(flat([1], [1]), 1.0, reason="lone \udc80, NUL \0, tab \t, ℓ")
    row = Row("a b/c:d=é", question("a/b", "timing", ERROR), Verdict.FAIL, True, outcomes=(odd,), shrunk=odd)
    write(Run((row, replace(row, formulation="a b/c:d=è"))), tmp_path / "odd.nc")
    with xr.open_datatree(tmp_path / "odd.nc") as tree:
        assert list(tree["counterexamples"].children) == ["a_b_c_d_.a_b", "a_b_c_d_.a_b-2"]
        assert tree["a_b"].reason[0, 0].item() == "lone \\udc80, NUL \\x00, tab , ℓ"


def test_a_group_is_spelled_like_the_property_and_neither_a_folder_of_others_nor_one_of_the_report_itself() -> None:
    names = group_names(["patch", "patch.flat", "timing", "timing.fast", "a/b", "a_b"])
    assert list(names.values()) == ["/patch_", "/patch/flat", "/timing__", "/timing_/fast", "/a_b", "/a_b-2"]


def test_an_id_is_typeable() -> None:
    assert case_id("two-pass/nts-ar:area=reference", "patch", witness=True) == (
        "two-pass_nts-ar_area_reference.patch.witness"
    )


def test_the_closest_number_is_that_of_a_decided_case_or_of_the_witness() -> None:
    row = small_run().rows[0]
    assert replace(row, outcomes=()).closest is None
    nan = outcome(flat([1], [1]), float("nan"), Verdict.FAIL)
    doubtful = outcome(flat([1], [1]), 1.0, Verdict.UNDECIDED)
    doubted, proved = (*row.outcomes, doubtful, nan), outcome(flat([1], [1]), 0.5)
    for changes, number, value in (
        ({}, 3, 4e-15),
        ({"outcomes": doubted}, 5, np.nan),
        ({"witness": proved}, None, 0.5),
    ):
        closest = replace(row, **changes).closest
        assert closest is not None
        assert closest.case == number
        np.testing.assert_equal(closest.number.value, value)


def test_an_exception_leaves_what_was_there(report: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = report.read_bytes()

    def break_off(groups: object, path: Path) -> None:
        path.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr("contactverif_reports.netcdf.file_groups.write_tree", break_off)
    with pytest.raises(KeyboardInterrupt):
        write(small_run(passing=True), report)
    assert report.read_bytes() == before
    assert os.listdir(report.parent) == [report.name]


@pytest.mark.parametrize("there", [True, False])
def test_a_killed_run_leaves_what_was_there(tmp_path: Path, there: bool) -> None:
    report = tmp_path / "report.nc"
    if there:
        write(small_run(), report)
        before = report.read_bytes()
    script = textwrap.dedent("""
        import sys, time
        from handmade_report import small_run
        from contactverif_reports.netcdf import write as writing
        from contactverif_reports.netcdf import file_groups as file_writing
        whole = file_writing.write_tree
        def slow(tree, path):
            whole(tree, path)
            with open(path, "r+b") as file:
                file.truncate(5000)
            print("half-way", flush=True)
            time.sleep(600)
        file_writing.write_tree = slow
        writing.write(small_run(passing=True), sys.argv[1])
    """)
    with subprocess.Popen(
        [sys.executable, "-c", script, str(report)], cwd=Path(__file__).parent, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        try:
            assert process.stdout.readline() == "half-way\n"
        finally:
            process.kill()
    left = f".report.nc.{process.pid}.part"
    assert sorted(os.listdir(tmp_path)) == [left, "report.nc"] if there else [left]
    if there:
        assert report.read_bytes() == before
    mine = tmp_path / f".report.nc.{os.getppid()}.part"  # The process is alive.
    other = tmp_path / f".other.nc.{process.pid}.part"
    mine.touch()
    other.touch()
    write(small_run(), report)
    assert sorted(os.listdir(tmp_path)) == sorted([mine.name, other.name, "report.nc"])


def test_reads_while_xarray_has_it_open(report: Path) -> None:
    from contactverif_reports.netcdf.read import case_ids, read_case

    with xr.open_datatree(report) as tree:
        str(tree)
        for name in case_ids(report) * 3:
            read_case(report, name)
        assert tree["summary"].row_verdict.load().notnull().any()


def test_replaces_the_file_behind_a_link(tmp_path: Path, report: Path) -> None:
    link = tmp_path / "link.nc"
    link.symlink_to(report)
    write(small_run(passing=True), link)
    assert link.is_symlink()
    write(small_run(), tmp_path / "c.nc")
    assert any("promises_kept" in line for line in same_data(report, tmp_path / "c.nc"))


def test_what_cannot_be_written_is_said_at_once(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    os.mkfifo(tmp_path / "pipe")
    for path, reason in {
        tmp_path / "no" / "report.nc": "which is no folder",
        file / "report.nc": "which is no folder",
        tmp_path: "a folder",
        tmp_path / "pipe": "no ordinary file",
        tmp_path / ("long" * 62): "too long",
    }.items():
        with pytest.raises(MisuseError, match=reason) as error:
            check_writable(path)
        assert error.value.argument == "--out"
    for path_ in ("", "folder/"):
        with pytest.raises(MisuseError, match="names no file"):
            check_writable(path_)
    check_writable(tmp_path / "new.nc")
    assert sorted(os.listdir(tmp_path)) == ["file", "pipe"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written_to(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(MisuseError, match="Permission denied"):
            check_writable(tmp_path / "new.nc")
    finally:
        tmp_path.chmod(0o700)


@pytest.mark.skipif(shutil.which("ncdump") is None, reason="ncdump is not installed")
def test_ncdump_reads_it(report: Path) -> None:
    header = subprocess.run(["ncdump", "-h", report], capture_output=True, text=True, check=True).stdout
    assert "tangent: not provided" in header
    assert 'flag_meanings = "no_promise promised stated_to_fail"' in header


# Groups are written as xarray writes them, in another order.


def small_groups() -> dict[str, Group]:
    """Return groups with all kinds of variables: numbers, words, no dimension, no value, an inherited dimension."""
    root = {
        "word": words(["run"], ["one", "three"], "a word"),
        "number": numbers([], 3.5, "a number", "m"),
        "code": codes(["run"], [1, -1], {"good": 1}, "a code", fill=-1),
        "place": numbers(["run"], [0.5, np.nan], "a place", "m", fill=np.nan),
        "run": numbers(["run"], [4, 5], "a run", "1"),
    }
    inner = {"matrix": numbers(["run", "column"], np.ones((2, 300)), "a large one", "1")}
    nothing = {"empty": numbers(["none"], np.zeros(0), "an empty one", "1")}
    attributes = {"title": "ε", "counts": np.array([1, 2])}
    return {"/": Group(root, attributes), "/inner": Group(inner), "/inner/nothing": Group(nothing)}


def as_xarray(group: Group) -> xr.Dataset:
    """Return a group for xarray, with what is compressed."""
    table = {}
    for name, variable in group.items():
        large = variable.values.nbytes >= 4096
        encoding = ({"zlib": True, "complevel": 4} if large else {}) | (
            {} if "_FillValue" in variable.attrs or variable.values.dtype.kind == "S" else {"_FillValue": None}
        )
        table[name] = xr.Variable(variable.dims, variable.values, variable.attrs, encoding)
    return xr.Dataset(table, attrs=group.attrs)


def everything(group: Any) -> Iterator[tuple[Any, ...]]:
    """Yield all that a group and those below it say and hold."""
    yield group.path, _attributes(group), {name: len(dim) for name, dim in group.dimensions.items()}
    for name, variable in sorted(group.variables.items()):
        variable.set_auto_maskandscale(False)
        variable.set_auto_chartostring(False)
        facts = (variable.dtype, variable.dimensions, variable.shape, variable.filters(), variable.chunking())
        yield name, facts, _attributes(variable), variable[...].tobytes()
    for _, inner in sorted(group.groups.items()):
        yield from everything(inner)


def _attributes(owner: Any) -> dict[str, str]:
    return {name: repr(owner.getncattr(name)) for name in owner.ncattrs()}


@pytest.mark.parametrize("make", [small_groups, lambda: tree_of(small_run())])
def test_a_file_is_the_one_that_xarray_writes(make: Any, tmp_path: Path) -> None:
    write_tree(make(), tmp_path / "ours.nc")
    tree = xr.DataTree.from_dict({path: as_xarray(group) for path, group in make().items()})
    tree.to_netcdf(tmp_path / "xarray.nc", engine="netcdf4", format="NETCDF4")
    with netCDF4.Dataset(tmp_path / "ours.nc") as ours, netCDF4.Dataset(tmp_path / "xarray.nc") as theirs:
        assert list(everything(ours)) == list(everything(theirs))
