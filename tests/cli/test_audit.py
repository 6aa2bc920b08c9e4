"""The command `audit`: an honest report passes, and what disagrees with its numbers or with today is listed."""

import re
from dataclasses import replace
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from asking import Ask, check_mistake

from contactverif.plugins import provenance
from contactverif.run.audit import Audit
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.netcdf.write import write

WORDS = "verify nts vts-ppt -p patch.flat.transmission -p hard.deep --examples 12 --seed 1 --jobs 1 --out"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a path at which the first test that needs a report writes it."""
    return tmp_path_factory.mktemp("audit") / "r.nc"


@pytest.fixture
def report(ask: Ask, whole: Path, tmp_path: Path) -> Path:
    """Return a report that a test may change."""
    if not whole.exists():
        assert ask(WORDS, whole).status == 0
    (tmp_path / "r.nc").write_bytes(whole.read_bytes())
    return tmp_path / "r.nc"


def test_an_honest_report_agrees_bit_for_bit(ask: Ask, report: Path) -> None:
    answer = ask("audit", report)
    assert (answer.status, answer.err) == (0, "")
    lines = answer.out.splitlines()
    assert lines[:3] == [
        "4 rows, 36 outcomes, 2 witnesses and counterexamples",
        "derived again: all verdicts and counts; 0 disagree",
        "judged again: 4 of 36 outcomes and all 2 others; 0 differ, bit for bit",
    ]
    assert re.fullmatch(r"seconds: \d+\.\d, and \d+\.\d in the run", lines[3])
    assert lines[4:] == [
        "chance to see one forged outcome among so many: 1: 11%, 10: 75%",
        "not derived: command, commit, date, isolation, platform, profile, seconds",
        "Nothing differs.",
    ]
    assert max(map(len, lines)) <= 80


def test_a_verdict_that_disagrees_with_its_number_is_listed(ask: Ask, report: Path) -> None:
    with netCDF4.Dataset(report, "a") as file:
        variable = file["patch/flat/transmission/verdict"]
        variable.set_auto_mask(False)
        variable[0, 3] = 0
    answer = ask("audit", report)
    assert answer.status == 1
    assert "  /patch/flat/transmission/verdict: 0 and 1 at (0, 3), and 0 more" in answer.out.splitlines()
    assert "Something differs." in answer.out


def test_a_changed_number_is_listed_if_all_are_judged_again(ask: Ask, report: Path) -> None:
    with netCDF4.Dataset(report, "a") as file:
        variable = file["patch/flat/transmission/value"]
        variable.set_auto_mask(False)
        values = np.array(variable[...])
        values[1, 5, 0] *= 1 + 1e-12
        variable[...] = values
    answer = ask("audit", report, "--share", "1")
    assert answer.status == 1
    assert "  vts-ppt patch.flat.transmission: case 5: error of a nodal force is " in answer.out


def test_a_witness_on_another_mesh_is_found(ask: Ask, report: Path) -> None:
    """Its numbers alone may not show it: they do not know where a node is that nothing touches."""
    run = read_run(report)
    (row,) = [row for row in run.rows if row.witness is not None and row.formulation == "nts"]
    assert row.witness is not None
    case = row.witness.case
    z = np.array(case.z)
    z[2 * case.interface.n_slave_nodes + np.argmax(z[2 * case.interface.n_slave_nodes :: 2]) * 2] += 1e-3
    witness = replace(row.witness, case_or_summary=replace(case, z=z))
    rows = tuple(replace(each, witness=witness) if each is row else each for each in run.rows)
    write(replace(run, rows=rows), report)
    answer = ask("audit", report)
    assert answer.status == 1
    lines = [line for line in answer.out.splitlines() if line.startswith("  ")]
    assert f"  nts.patch.flat.transmission.witness: its mesh is not that of {case.name} today" in lines


def test_another_seed_is_found(ask: Ask, report: Path) -> None:
    with netCDF4.Dataset(report, "a") as file:
        file.setncattr("seed", "2")
    answer = ask("audit", report, "--share", "1")
    assert answer.status == 1
    assert answer.out.count("number of") + answer.out.count("is ") > 10


def test_other_versions_are_said_and_numbers_agree_up_to_roundoff(
    ask: Ask, report: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(provenance, "digest_files", lambda files: "another")
    answer = ask("audit", report)
    assert answer.status == 0
    assert "  code_of_contactverif_nts: " in answer.out
    assert "0 differ, up to roundoff" in answer.out


@pytest.mark.parametrize("share", ["0", "-1", "1.5", "nan"])
def test_a_share_is_a_part_of_all(ask: Ask, report: Path, share: str) -> None:
    check_mistake(ask("audit", report, f"--share={share}"), "--share: found .*; needed a number above 0, and at most 1")


def test_a_report_on_a_scene_needs_that_scene(ask: Ask, tmp_path: Path) -> None:
    report = tmp_path / "r.nc"
    assert ask("verify nts -p balance.force --scene c --examples 5 --out", report).status == 0
    check_mistake(ask("audit", report), "REPORT: found a run with --scene c, and here none; needed the same options")
    assert ask("audit", report, "--scene", "c").status == 0


@pytest.mark.parametrize("typed", [False, True])
def test_a_library_that_is_not_typed_or_is_another_one_is_not_loaded(ask: Ask, report: Path, typed: bool) -> None:
    library = report.with_name("x.so")
    library.write_bytes(b"no library")
    run, name = read_run(report), f"c:file={library}"
    rows = tuple(replace(row, formulation=name) if row.formulation == "nts" else row for row in run.rows)
    write(replace(run, rows=rows, provenance=run.provenance | {"code_of_x.so": "another"}), report)
    words = f"{name}, which loads a file; needed {name} typed behind it, if you trust the file"
    if typed:
        words = "code of x.so: another in the report and [0-9a-f]{16} here; needed the library with which it was judged"
    check_mistake(ask("audit", report, *([name] if typed else [])), f"REPORT: found {words}")


def test_merge_can_audit_what_it_makes(ask: Ask, tmp_path: Path) -> None:
    shards = tmp_path / "shards"
    assert ask("campaign nts -p patch.flat.transmission --examples 8 --shard 1/1 --out", shards).status == 0
    without = ask("merge --audit --out", tmp_path / "r.html", shards)
    check_mistake(without, "--audit: found no report; needed --out FILE.nc beside it")
    answer = ask("merge --audit --share 0.5 --out", tmp_path / "r.nc", shards)
    assert answer.status == 0
    assert "judged again: 4 of 8 outcomes and all " in answer.out
    assert "outcomes that were judged before: 9, of which 1 were judged again" in answer.out
    assert read_run(tmp_path / "r.nc").provenance["stored_outcomes"] == "9, of which 1 were judged again"


def test_the_chance_is_that_of_a_draw_without_return() -> None:
    audit = Audit.__new__(Audit)
    for name, value in {"n_outcomes": 10, "n_judged": 3}.items():
        object.__setattr__(audit, name, value)
    assert audit.chance(1) == pytest.approx(0.3)
    assert audit.chance(2) == pytest.approx(1 - 7 * 6 / (10 * 9))
    assert audit.chance(8) == 1.0
