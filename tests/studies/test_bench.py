"""The bench: all is counted, a failure is kept, a killed bench goes on, and a stranger is one more curve."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from importlib.metadata import EntryPoint
from importlib.metadata import entry_points as find_entries
from pathlib import Path
from types import ModuleType
from typing import Any

import msgspec
import numpy as np
import pytest
import xarray as xr
from fresh_process import MAIN
from msgspec import structs
from subjects import Changed, alone, load_subject

from contactverif import MisuseError, Subject, Traits
from contactverif.contract.result import NotLoaded
from contactverif.isolation import remote_formulation
from contactverif.isolation.host import answer_of
from contactverif.isolation.limits import Limits
from contactverif.isolation.messages import Answer
from contactverif.isolation.process import Question
from contactverif.mechanics.accuracy import solve_for_accuracy, solve_in_tries
from contactverif.problems.problem import FORCES, MOTIONS, PRESSURE, Problem, ProblemInstance
from contactverif.run import registry
from contactverif.run.journal import JournalKey, RecordFile, journal_folder, read_messages, record_files
from contactverif.run.keys import remove_key
from contactverif.run.registry import load_formulation, load_problems
from contactverif.studies.bench import bench_plan
from contactverif.studies.bench.bench_journal import FinishedCell, Header, Journal
from contactverif.studies.bench.bench_plan import BenchPlan, make_plan, pose
from contactverif.studies.bench.bench_study import run_bench
from contactverif.studies.bench.cell_runs import CellRecord, RunRecord, run_cell
from contactverif_reports.bench.results import COUNTS, PARTS, Cell, Outcome
from contactverif_reports.netcdf.bench_file import read_bench, write_bench

WAVY = Cell("wavy", 1, 30.0)
PROBLEMS = {name: problem for name, problem in load_problems().items() if isinstance(problem, Problem)}
ARGUMENTS = ["bench", "nts-ar", "vts-ppt", "--scene", "wavy", "--scene", "kinked", "--repeats", "2"]


@pytest.mark.parametrize("scene", PROBLEMS)
def test_errors_are_small_where_vts_ppt_solves_and_fall_on_a_finer_mesh(scene: str) -> None:
    """On the zigzag the exact solution is in the space of the meshes, so that only roundoff is left."""
    problem = PROBLEMS[scene]
    cells = [Cell(scene, mesh, problem.penalties[1]) for mesh in problem.meshes[:3:2]]
    records = [run_cell(cell, [load_subject("vts-ppt")], 1, 0) for cell in cells]
    runs = [record.runs["vts-ppt"] for record in records]
    assert [run.outcome for run in runs] == [Outcome.SOLVED, Outcome.SOLVED]
    assert {"forces", "pressure"} <= set(runs[0].errors)
    for kind in runs[0].errors.keys() - {"iterations"}:
        coarse, fine = (run.errors[kind] for run in runs)
        assert fine < 0.8 * coarse or coarse < 1e-5, kind
    assert set(runs[0].seconds) == set(PARTS)
    assert all(seconds[0] >= 0 for seconds in runs[0].seconds.values())
    assert runs[0].seconds["total"][0] > sum(runs[0].seconds[part][0] for part in PARTS if part != "total")


def test_errors_are_those_of_the_properties() -> None:
    """Properties keep the matrix of Newton's method, a bench does not: both are out of balance by 1e-9 at most."""
    subject = load_subject("nts-ar")
    instance = PROBLEMS["hertz"].pose(16, 10.0, subject.traits)
    expected = instance.errors(solve_for_accuracy(instance.scene, subject, instance.start, instance.step))
    errors = run_cell(Cell("hertz", 16, 10.0), [subject], 1, 0).runs["nts-ar"].errors
    assert errors["forces"] == pytest.approx(max(expected[kind] for kind in FORCES), rel=1e-6)
    assert errors["pressure"] == pytest.approx(expected[PRESSURE], rel=1e-6)
    assert errors["displacement"] == pytest.approx(expected[MOTIONS[0]], rel=1e-6)


def test_counts_are_those_of_newtons_method_whatever_verb_it_uses() -> None:
    subject = load_subject("vts-ppt")
    instance = pose(WAVY, subject, 0)
    (trace,) = solve_in_tries(instance.scene, subject.for_case(instance.first_guess), instance.start, instance.step)
    counts = run_cell(WAVY, [subject], 1, 0).runs["vts-ppt"].counts
    assert list(counts) == list(COUNTS)
    assert counts["iterations"] == trace.n_iterations
    assert counts["pairs"] == len(trace.residuals)
    assert counts["tangents"] >= trace.n_iterations
    assert counts["differences"] == 0


def test_a_residual_alone_is_one_more_curve_and_its_differences_are_counted_as_such() -> None:
    record = run_cell(WAVY, [alone("vts-ppt"), load_subject("vts-ppt")], 1, 0)
    single, whole = (record.runs[name] for name in ("alone", "vts-ppt"))
    assert single.outcome == Outcome.SOLVED
    assert single.errors["forces"] == pytest.approx(whole.errors["forces"], rel=1e-6)
    assert (single.counts["pairs"], single.counts["tangents"]) == (0, 0)
    assert single.counts["differences"] >= 2 * record.unknowns * single.counts["iterations"]
    assert single.seconds["differences"][0] > 0
    assert single.seconds["tangent"] == [0.0]


def test_a_failure_is_kept_and_stops_no_one() -> None:
    def make_broken(*, penalty: float) -> Any:
        return Changed(load_subject("vts-ppt").with_penalty(penalty).plugin, residual=lambda *_: 1 / 0)

    def make_pulling(*, penalty: float) -> Any:
        inner = load_subject("vts-ppt").with_penalty(penalty).plugin
        return Changed(inner, residual=lambda *arguments: -inner.residual(*arguments))

    subjects = [Subject("broken", make_broken), Subject("pulling", make_pulling), load_subject("vts-ppt")]
    absent = NotLoaded("absent", "no such module")
    results = run_bench([absent, *subjects], BenchPlan((WAVY,), repeats=2))
    assert [int(outcome) for outcome in results.outcomes[:, 0]] == [Outcome.CRASHED, Outcome.NOT_SOLVED, Outcome.SOLVED]
    assert "ZeroDivisionError" in results.remarks["broken", 0]
    assert results.remarks["pulling", 0]
    assert np.isinf(results.times("broken")).all()
    assert np.isinf(results.errors_of("pulling")).all()
    assert np.isfinite(results.seconds[1:]).all()
    assert results.not_loaded == {"absent": "no such module"}


def test_a_plugin_in_a_process_of_its_own_has_the_same_outcome_errors_and_counts() -> None:
    far = load_formulation("vts-ppt", Limits())
    assert isinstance(far, Subject)
    runs = [run_cell(WAVY, [subject], 2, 0).runs["vts-ppt"] for subject in (load_subject("vts-ppt"), far)]
    assert runs[0].errors == runs[1].errors
    assert runs[0].counts == runs[1].counts
    assert [run.outcome for run in runs] == [Outcome.SOLVED, Outcome.SOLVED]
    assert all(len(seconds) == 2 for seconds in runs[1].seconds.values())


@pytest.mark.parametrize("seconds", [-1.0, float("nan"), 1e300])
def test_times_that_cannot_be_are_a_crash(seconds: float, monkeypatch: pytest.MonkeyPatch) -> None:
    def lie(question: Question) -> Answer:
        return structs.replace(answer_of(question), processor_seconds=seconds)

    monkeypatch.setattr(remote_formulation, "answer_of", lie)
    run = run_cell(WAVY, [load_formulation("vts-ppt", Limits())], 1, 0).runs["vts-ppt"]
    assert run.outcome == Outcome.CRASHED
    assert "times that cannot be" in run.remark


def test_random_scenes_are_the_same_for_the_same_seed() -> None:
    subject, cell = load_subject("vts-ppt"), Cell("random", 1, 1.0)
    scenes = [pose(cell, subject, seed).scene for seed in (0, 0, 1)]
    assert scenes[0] is scenes[1]
    assert scenes[0].interface.nodes.tolist() != scenes[2].interface.nodes.tolist()


HEADER = Header(make_plan(["wavy"], quick=True), ("a",), {"numpy_version": "2"})
RECORD = CellRecord(4, 10, [0.5], {"a": RunRecord(0, "", {"error": np.float64(1.5)}, {"steps": 3}, {"all": [0.25]})})


def note(output: Path, *cells: tuple[int, CellRecord]) -> None:
    """Append finished cells to the journal of an output file."""
    with closing(Journal(output, HEADER)) as journal:
        for number, record in cells:
            journal.add(number, record)


def finished_cells(output: Path, header: Header = HEADER) -> dict[int, CellRecord]:
    with closing(Journal(output, header)) as journal:
        return journal.finished


def test_a_torn_record_is_left_out_and_another_plan_is_refused(tmp_path: Path) -> None:
    output = tmp_path / "a.nc"
    note(output, (0, RECORD), (2, RECORD))
    (path,) = record_files(tmp_path / "a.nc.journal")
    path.write_bytes(path.read_bytes()[:-1])
    assert finished_cells(output) == {0: RECORD}
    note(output, (1, RECORD))
    assert finished_cells(output) == {0: RECORD, 1: RECORD}
    for other in ({"formulations": ("b",)}, {"versions": {}}):
        with pytest.raises(MisuseError, match="the journal of another bench"):
            Journal(output, msgspec.structs.replace(HEADER, **other))


@pytest.mark.parametrize("message", [b"\xff", b"\x90", msgspec.msgpack.encode({"number": "x", "record": {}})])
def test_a_record_that_is_none_is_not_believed(tmp_path: Path, message: bytes) -> None:
    output = tmp_path / "a.nc"
    note(output, (0, RECORD), (1, replace(RECORD, runs={"b": RunRecord()})))
    folder = tmp_path / "a.nc.journal"
    with closing(RecordFile(folder, JournalKey.read(folder))) as file:
        file.append(message)
    assert finished_cells(output) == {0: RECORD}


def test_a_cell_without_the_key_is_run_again_and_a_journal_without_its_key_is_refused(tmp_path: Path) -> None:
    output, folder = tmp_path / "a.nc", tmp_path / "a.nc.journal"
    note(output, (0, RECORD))
    with closing(RecordFile(folder, JournalKey())) as file:
        file.append(msgspec.msgpack.encode(FinishedCell(1, RECORD), enc_hook=float))
    assert finished_cells(output) == {0: RECORD}
    remove_key(JournalKey.read(folder).identity)
    with pytest.raises(MisuseError, match=r"a journal that proves nothing; needed its key, which .* has"):
        Journal(output, HEADER)


@pytest.mark.parametrize("header", [b"", b"{", b"\xff" * 100])
def test_a_damaged_journal_is_one_line(tmp_path: Path, header: bytes) -> None:
    finished_cells(tmp_path / "a.nc")
    (tmp_path / "a.nc.journal" / "header").write_bytes(header)
    with pytest.raises(MisuseError, match=r"--out: found a.nc.journal with a damaged header; needed an undamaged"):
        Journal(tmp_path / "a.nc", HEADER)


def test_a_strangers_problem_is_one_more_scene(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """One entry point is all that it takes; the results say in words what it is."""
    stranger = replace(PROBLEMS["kinked"], label="a stranger's zigzag", unit="E/m", meshes=(1, 2), rank=7)
    module = ModuleType("a_strangers_problems")
    module.__dict__.update(ZIGZAG=stranger, NUMBER=3)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    entries = [
        *find_entries(group=registry.PROBLEMS),
        EntryPoint("zigzag", "a_strangers_problems:ZIGZAG", registry.PROBLEMS),
        EntryPoint("number", "a_strangers_problems:NUMBER", registry.PROBLEMS),
    ]
    installed = {group: find_entries(group=group) for group in (registry.FORMULATIONS, registry.PROPERTIES)}
    monkeypatch.setattr(registry, "entry_points", lambda *, group: {**installed, registry.PROBLEMS: entries}[group])
    problems = PROBLEMS | {"zigzag": stranger}
    assert list(load_problems()) == [*sorted(problems, key=lambda name: problems[name].rank), "number"]
    plan = make_plan(["number", "zigzag"], quick=True, repeats=1)
    results = run_bench([load_subject("vts-ppt")], plan)
    assert results.not_loaded == {"number": "the entry point gives a int, not a contactverif.problems.problem.Problem"}
    assert [cell.scene for cell in results.cells] == ["zigzag", "zigzag"]
    assert (results.outcomes == Outcome.SOLVED).all()
    assert results.errors_of("vts-ppt").max() < 1e-5
    write_bench(results, tmp_path / "a.nc")
    again = read_bench(tmp_path / "a.nc")
    assert again.cells == results.cells
    assert again.label("zigzag") == "a stranger's zigzag"
    assert again.penalty_name("zigzag", 30.0) == "ε̂ = 30 E/m"
    with pytest.raises(MisuseError, match="--scene: found number: the entry point gives a int"):
        make_plan(["number"])


def _fail(mesh: int, penalty: float, traits: Traits) -> ProblemInstance:
    raise ValueError(f"no mesh {mesh}")


def _pose_flat_forces(mesh: int, penalty: float, traits: Traits) -> ProblemInstance:
    instance = PROBLEMS["kinked"].pose(mesh, penalty, traits)
    return replace(instance, forces=lambda positions: instance.forces(positions).reshape(-1))


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (_fail, "pose of the problem mine: found ValueError: no mesh 1, on mesh 1 at the penalty 30; needed a Problem"),
        (lambda *arguments: 3, "pose of the problem mine: found a int; needed a ProblemInstance"),
        (_pose_flat_forces, r"ProblemInstance.forces: found shape \(.*,\); needed \(.*, 2\), a force for each node"),
    ],
)
def test_a_strangers_mistake_in_a_problem_is_named(
    monkeypatch: pytest.MonkeyPatch, pose: Callable[..., Any], message: str
) -> None:
    monkeypatch.setattr(bench_plan, "_problem", lambda name: replace(PROBLEMS["kinked"], pose=pose))
    subject = load_subject("vts-ppt")
    with pytest.raises(MisuseError, match=message):
        run_cell(Cell("mine", 1, 30.0), [subject], 1, 0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scenes": ["disk"]}, "--scene: found 'disk'; needed one of " + ", ".join([*PROBLEMS, "random"])),
        ({"repeats": 0}, "--repeats: found 0; needed at least 1, at most 1000"),
        ({"n_random": -1}, "--random: found -1; needed at least 0"),
        ({"scenes": ["random"], "n_random": 0}, "--random: found 0 random scenes and no other"),
    ],
)
def test_a_plan_of_nothing_is_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(MisuseError, match=message):
        make_plan(**options)


def test_a_bench_that_is_killed_goes_on_and_equals_an_unbroken_one_but_for_seconds(tmp_path: Path) -> None:
    environment = {**os.environ, "NO_COLOR": "1"}
    arguments = [*MAIN, *ARGUMENTS, "--quick", "--out"]
    killed, unbroken = tmp_path / "killed.nc", tmp_path / "unbroken.nc"
    process = subprocess.Popen([*arguments, str(killed)], env=environment, stdout=subprocess.DEVNULL)
    journal, deadline = journal_folder(killed), time.monotonic() + 120
    while not any(path.stat().st_size for path in record_files(journal)):  # One finished cell.
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert not killed.exists()
    first, *_ = (record.message for record in read_messages(record_files(journal)[0], JournalKey()))
    for target in (killed, unbroken):
        subprocess.run([*arguments, str(target)], env=environment, check=True, stdout=subprocess.DEVNULL)
    assert not journal.exists()
    with xr.open_datatree(killed, engine="netcdf4") as resumed, xr.open_datatree(unbroken, engine="netcdf4") as other:
        xr.testing.assert_identical(resumed.to_dataset().drop_attrs(), other.to_dataset().drop_attrs())
        assert resumed["timing/seconds"].shape == other["timing/seconds"].shape
        record = msgspec.msgpack.decode(first)["record"]
        stored = resumed["timing/yardstick_seconds"].values[0].tolist()
    assert stored == record["yardstick"]  # What was measured before the kill was not measured again.
