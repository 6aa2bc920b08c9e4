"""The bench: all is counted, a failure is kept, a killed bench goes on, and a stranger is one more curve."""

import os
import re
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
from contactverif.contract.arrays import dense
from contactverif.contract.errors import PluginError
from contactverif.contract.interface import PLANE
from contactverif.contract.result import NotLoaded
from contactverif.isolation import remote
from contactverif.isolation.host import answer_of
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote import RemoteSubject
from contactverif.mechanics.accuracy import solution_of, solve_for_accuracy, solve_in_tries
from contactverif.mechanics.bulk import condense
from contactverif.mechanics.scene import WholeScene
from contactverif.mechanics.system import System
from contactverif.plugins import registry
from contactverif.plugins.registry import load_formulation, load_problems
from contactverif.problems.problem import FORCES, MOTIONS, PRESSURE, Problem, ProblemInstance, Variation
from contactverif.problems.space_problems import EGG_BOX, HERTZ_IN_SPACE
from contactverif.run.journal import RecordFile, journal_folder, read_messages, record_files
from contactverif.studies import bench_plan
from contactverif.studies.bench_cells import (
    CellRecord,
    Header,
    RunRecord,
    SolutionRecord,
    open_journal,
    run_bench,
    run_cell,
)
from contactverif.studies.bench_plan import BenchPlan, largest_errors, make_plan, pose, vary
from contactverif_mortar import segment_to_segment
from contactverif_reports import bench_costs
from contactverif_reports.bench_results import COUNTS, RULE, VARIANTS, Cell, Outcome
from contactverif_reports.netcdf.bench_file import read_bench, write_bench

WAVY = Cell("wavy", 8, 0)
PROBLEMS = {name: problem for name, problem in load_problems().items() if isinstance(problem, Problem)}
IN_PLANE = [name for name, problem in PROBLEMS.items() if problem.dim == PLANE]
ARGUMENTS = ["bench", "nts-ar", "vts-ppt", "--scene", "kinked", "--instances", "2", "--processes", "2"]
VARIATIONS = [Variation(), *(vary(Cell("any", 1, number), 0) for number in range(2))]


def solve_cell(cell: Cell, subject: Subject) -> list[SolutionRecord]:
    """Return the solutions of a cell by one formulation, by variant."""
    return run_cell(cell, [subject], 0).runs[subject.name].solutions


@pytest.mark.parametrize("variation", VARIATIONS, ids=["mesh itself", *"01"])
@pytest.mark.parametrize("scene", IN_PLANE)
def test_errors_are_small_from_both_starts_and_fall_on_a_finer_mesh(scene: str, variation: Variation) -> None:
    """On the zigzag the exact solution is in the space of the meshes, so that only roundoff is left."""
    subject, problem = load_subject("vts-ppt"), PROBLEMS[scene]
    errors: list[list[float]] = []
    for mesh in problem.meshes[:3:2]:
        instance = problem.pose(mesh, 10.0, subject.traits, variation)
        assert list(instance.starts) == ["near", "deep", "deepest"]
        formulation = subject.for_case(instance.first_guess)
        errors.append([])
        for name in ("near", "deep"):
            (trace,) = solve_in_tries(instance.scene, formulation, instance.starts[name], instance.step)
            assert trace.n_iterations <= 20
            of_solution = instance.errors(solution_of(trace, formulation, nodal=False))
            errors[-1].append(max(of_solution[kind] for kind in FORCES))
        assert errors[-1][0] == pytest.approx(errors[-1][1], rel=1e-5, abs=1e-8)
    assert errors[-1][0] < 0.9 * errors[0][0] or errors[0][0] < 1e-5


@pytest.mark.parametrize("scene", IN_PLANE)
def test_a_deep_start_is_ten_times_as_deep_and_no_start_is_the_solution(scene: str) -> None:
    subject, problem = load_subject("sts"), PROBLEMS[scene]
    instance = problem.pose(problem.meshes[0], 10.0, subject.traits, Variation())
    formulation, scene_ = subject.for_case(instance.first_guess), instance.scene
    depths = []
    for start in map(instance.starts.__getitem__, ("near", "deep")):
        z = scene_.positions(start)
        points = formulation.contact_points(scene_.interface, formulation.pair(scene_.interface, z), z)
        depths.append(-np.nanmin(points.gap))
        (trace,) = solve_in_tries(scene_, formulation, start, instance.step)
        assert trace.n_iterations >= 1
    assert depths[1] == pytest.approx(10 * depths[0], rel=0.3)
    near, deep, deepest = (instance.starts[name] for name in ("near", "deep", "deepest"))
    # Both moves are the same products but for roundoff: 1e-12 of the longest is far above it.
    np.testing.assert_allclose(deepest - near, 999 / 9 * (deep - near), rtol=1e-9, atol=1e-12 * np.abs(deepest).max())


def test_instances_differ_in_all_that_a_problem_leaves_open_and_are_the_same_for_the_same_seed() -> None:
    variations = [vary(Cell("wavy", 8, number), 0) for number in range(15)]
    assert len({item.grading for item in variations}) == 15
    assert {item.swapped for item in variations} == {False, True}
    assert all(0.8 <= item.size <= 1.2 and 0.8 <= item.load <= 1.2 for item in variations)
    assert all(abs(item.shift) <= 0.5 and abs(item.grading) <= 1 for item in variations)
    assert variations == [vary(Cell("wavy", 16, number), 0) for number in range(15)]
    assert variations != [vary(Cell("wavy", 8, number), 1) for number in range(15)]
    assert variations != [vary(Cell("rings", 8, number), 0) for number in range(15)]
    meshes = {pose(Cell("hertz", 20, number), 10.0, Traits(), 0).scene.interface.nodes.tobytes() for number in range(5)}
    assert len(meshes) == 5


def test_errors_are_those_of_the_properties() -> None:
    """Properties keep the matrix of Newton's method, a bench does not: both are out of balance by 1e-9 at most."""
    subject, cell = load_subject("nts-ar"), Cell("hertz", 20, 0)
    instance = pose(cell, 10.0, subject.traits, 0)
    expected = instance.errors(solve_for_accuracy(instance.scene, subject, instance.start, instance.step))
    errors = solve_cell(cell, subject)[0].errors
    assert errors["forces"] == pytest.approx(max(expected[kind] for kind in FORCES), rel=1e-6)
    assert errors["pressure"] == pytest.approx(expected[PRESSURE], rel=1e-6)
    assert errors["displacement"] == pytest.approx(expected[MOTIONS[0]], rel=1e-6)


def test_counts_are_those_of_newtons_method_whatever_verb_it_uses() -> None:
    subject = load_subject("vts-ppt")
    instance = pose(WAVY, 10.0, subject.traits, 0)
    (trace,) = solve_in_tries(instance.scene, subject.for_case(instance.first_guess), None, instance.step)
    n_steps, n_states = trace.n_iterations, len(trace.residuals)
    counts = zip(COUNTS, (n_steps, n_states, n_states, n_steps, 0), strict=True)
    assert list(solve_cell(WAVY, subject)[0].counts.items()) == list(counts)


def test_an_exact_tangent_that_does_not_help_costs_no_difference_for_each_unknown() -> None:
    """Newton's method cycles here. One difference in each iteration says that differences would do the same."""
    subject = load_subject("vts-ppt-balanced")
    stiff = solve_cell(Cell("rings", 15, 0), subject)[-1]
    assert stiff.outcome == Outcome.NOT_SOLVED
    assert 0 < stiff.counts["differences"] <= stiff.counts["iterations"] + 2


def test_counts_and_nonzeros_are_the_same_in_every_run_and_in_every_place() -> None:
    """A plugin in a process of its own has the same outcomes, errors and counts; no process tells them."""
    far = load_formulation("vts-ppt", Limits())
    assert isinstance(far, Subject)
    runs = [run_cell(WAVY, [subject], 0).runs["vts-ppt"] for subject in (load_subject("vts-ppt"), far, far)]
    first, *others = ((run.solutions, run.nonzeros, run.calls) for run in runs)
    assert others == [first, first]
    assert runs[0].calls > 0
    assert [solution.outcome for solution in runs[0].solutions] == [Outcome.SOLVED] * len(VARIANTS)
    assert all(run.evaluation > 0 and run.factorisation > 0 for run in runs)


def test_the_whole_system_is_that_of_newtons_method_before_it_is_condensed() -> None:
    subject = load_subject("mortar-lm")
    instance = pose(Cell("rings", 12, 0), 10.0, subject.traits, 0)
    scene, formulation = instance.scene, subject.for_case(instance.first_guess)
    system, whole = System(scene, formulation), System(WholeScene.of_scene(scene), formulation)
    u = np.append(scene.start, np.full(system.n_multipliers, 1e-2))
    tangent = system.tangent(u, system.pair(u))
    matrix = dense(whole.stiffness + whole.contact_stiffness(u, None, tangent))
    assert matrix.shape == (whole.size, whole.size)
    free = [np.flatnonzero(~body.fixed.reshape(-1)) for body in scene.bodies]
    starts = np.cumsum([0, *map(len, free)])
    outer = np.concatenate([np.searchsorted(free[k], scene.unknowns[k]) + starts[k] for k in range(2)])
    outer = np.append(outer, np.arange(whole.scene.n_free, len(matrix)))
    inner = np.setdiff1d(np.arange(len(matrix)), outer)
    schur = matrix[np.ix_(outer, outer)] - matrix[np.ix_(outer, inner)] @ np.linalg.solve(
        matrix[np.ix_(inner, inner)], matrix[np.ix_(inner, outer)]
    )
    expected = system.stiffness + system.contact_stiffness(u, system.pair(u), tangent)
    np.testing.assert_allclose(schur, dense(expected), atol=1e-9 * np.abs(matrix).max())


def test_the_factors_of_bodies_do_not_outlive_their_cell() -> None:
    """The scene of a cell is remembered, and so are its stiffness and its load."""
    subject, cell = load_subject("vts-ppt"), Cell("wavy", 32, 0)
    solve_cell(cell, subject)
    scene = pose(cell, 10.0, subject.traits, 0).scene
    assert {"stiffness", "load"} <= vars(scene).keys()
    assert "condensed_bodies" not in vars(scene)
    assert condense.cache_info().currsize == 0


def test_a_residual_alone_is_one_more_curve_and_its_differences_are_counted_as_such() -> None:
    record = run_cell(WAVY, [alone("vts-ppt"), load_subject("vts-ppt")], 0)
    single, whole = (record.runs[name] for name in ("alone", "vts-ppt"))
    assert single.solutions[0].outcome == Outcome.SOLVED
    assert single.solutions[0].errors["forces"] == pytest.approx(whole.solutions[0].errors["forces"], rel=1e-6)
    counts = single.solutions[0].counts
    assert (counts["pairs"], counts["tangents"]) == (0, 0)
    n_unknowns = pose(WAVY, 10.0, Traits(), 0).scene.interface.n_unknowns
    assert counts["differences"] == 2 * n_unknowns * counts["iterations"]
    assert single.evaluation > whole.evaluation
    assert single.nonzeros[0] > 0


def test_a_failure_is_kept_and_stops_no_one() -> None:
    def make_broken(*, penalty: float) -> Any:
        return Changed(load_subject("vts-ppt").with_penalty(penalty).plugin, residual=lambda *_: 1 / 0)

    def make_pulling(*, penalty: float) -> Any:
        inner = load_subject("vts-ppt").with_penalty(penalty).plugin
        return Changed(inner, residual=lambda *arguments: -inner.residual(*arguments))

    subjects = [Subject("broken", make_broken), Subject("pulling", make_pulling), load_subject("vts-ppt")]
    absent = NotLoaded("absent", "no such module")
    results = run_bench([absent, *subjects], BenchPlan((WAVY,), processes=2))
    outcomes = [int(outcome) for outcome in results.outcomes[:, 0, 0]]
    assert outcomes == [Outcome.CRASHED, Outcome.NOT_SOLVED, Outcome.SOLVED]
    assert "ZeroDivisionError" in results.remarks["broken", 0, 0]
    assert results.remarks["pulling", 0, 0]
    assert np.isinf([results.errors_of(name)[0, 0] for name in ("broken", "pulling")]).all()
    assert np.isfinite(results.evaluation[1:]).all()
    assert results.work[:2, :, 1:].sum() == 0
    assert results.not_loaded == {"absent": "no such module"}
    assert results.provenance["isolation"] == "inline"


def test_a_plugin_that_always_ends_its_process_is_asked_no_further_mesh_of_the_scene() -> None:
    states: list[int] = []

    def die(interface: Any, pairing: Any, z: Any) -> Any:
        states.append(len(interface.slave))
        raise PluginError("residual: its process ended with status 0", "exit", ended=True)

    def make_dying(*, penalty: float) -> Any:
        return Changed(load_subject("vts-ppt").with_penalty(penalty).plugin, residual=die)

    cells = (WAVY, Cell("wavy", 16, 0), Cell("kinked", 1, 0))
    results = run_bench([Subject("dying", make_dying), load_subject("vts-ppt")], BenchPlan(cells, processes=2))
    assert [set(row.ravel().tolist()) for row in results.outcomes] == [{Outcome.CRASHED}, {Outcome.SOLVED}]
    assert np.isnan(results.evaluation[0]).all()
    assert np.isfinite(results.evaluation[1]).all()
    assert len(states) == 2 * len(VARIANTS)
    assert "ended with status 0" in results.remarks["dying", 2, 0]
    assert "not asked: the plugin ended its process in all solutions" in results.remarks["dying", 1, 0]


@pytest.mark.parametrize("seconds", [-1.0, float("nan"), 1e300])
def test_times_that_cannot_be_are_no_times(seconds: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remote, "answer_of", lambda question: structs.replace(answer_of(question), seconds=seconds))
    assert np.isnan(run_cell(WAVY, [load_formulation("vts-ppt", Limits())], 0, solve=False).runs["vts-ppt"].evaluation)


def test_each_process_of_a_formulation_is_another_one() -> None:
    far = load_formulation("vts-ppt", Limits(seconds=31.0))  # Its host is that of no other test.
    assert isinstance(far, RemoteSubject)
    before = far.host.n_started
    results = run_bench([far], BenchPlan((Cell("kinked", 1, 0),), processes=3))
    assert far.host.n_started - before >= 2
    assert results.evaluation.shape == (1, 1, 3)
    assert results.provenance["isolation"] == "process"


HEADER = Header(make_plan(["wavy"], quick=True), ("a",), {"numpy_version": "2"})
SOLUTION = SolutionRecord(0, "", {"error": np.float64(1.5)}, {"steps": 3})
RECORD = CellRecord(4, 10, {"a": RunRecord([SOLUTION], (5, 6), 7, 0.5, 0.25)})


def note(output: Path, *cells: tuple[int, CellRecord]) -> None:
    """Append finished cells to the journal of an output file."""
    with open_journal(output, HEADER) as finished:
        for number, record in cells:
            finished.add(number, record)


def finished_cells(output: Path, header: Header = HEADER) -> dict[int, CellRecord]:
    with open_journal(output, header) as finished:
        return finished.records


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
            finished_cells(output, msgspec.structs.replace(HEADER, **other))


def test_two_benches_do_not_share_a_journal(tmp_path: Path) -> None:
    with open_journal(tmp_path / "a.nc", HEADER), pytest.raises(MisuseError, match="of a run that is going on"):
        finished_cells(tmp_path / "a.nc")


def test_a_record_that_is_none_is_not_believed(tmp_path: Path) -> None:
    output = tmp_path / "a.nc"
    note(output, (0, RECORD), (1, replace(RECORD, runs={"b": RunRecord()})))
    with closing(RecordFile(tmp_path / "a.nc.journal")) as file:
        for message in (b"\xff", b"\x90", msgspec.msgpack.encode({"number": "x", "record": {}})):
            file.append(message)
    assert finished_cells(output) == {0: RECORD}


def test_a_damaged_journal_is_one_line(tmp_path: Path) -> None:
    finished_cells(tmp_path / "a.nc")
    for header in (b"", b"{", b"\xff" * 100):
        (tmp_path / "a.nc.journal" / "header").write_bytes(header)
        with pytest.raises(MisuseError, match=r"--out: found a.nc.journal with a damaged header; needed an undamaged"):
            finished_cells(tmp_path / "a.nc")


def install_problems(monkeypatch: pytest.MonkeyPatch, **strangers: Any) -> None:
    """Install problems {name: problem} beside those that are there."""
    module = ModuleType("a_strangers_problems")
    module.__dict__.update(strangers)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    more = [EntryPoint(name, f"{module.__name__}:{name}", registry.PROBLEMS) for name in strangers]

    def list_entry_points(*, group: str) -> list[EntryPoint]:
        return [*find_entries(group=group), *(more if group == registry.PROBLEMS else [])]

    monkeypatch.setattr(registry, "entry_points", list_entry_points)
    bench_plan._problem.cache_clear()


def test_a_stranger_takes_no_problem_away(monkeypatch: pytest.MonkeyPatch) -> None:
    install_problems(monkeypatch, wavy=replace(PROBLEMS["kinked"], label="another wave"))
    problems = load_problems()
    assert problems["wavy"] is PROBLEMS["wavy"]
    name = "a_strangers_problems:wavy"
    words = f"{name} is registered as wavy, the name of a problem of contactverif; needed another name"
    assert make_plan(instances=1).not_loaded == {name: words}


def test_a_strangers_problem_is_one_more_scene(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """One entry point is all that it takes; the results say in words what it is."""
    stranger = replace(PROBLEMS["kinked"], label="a stranger's zigzag", meshes=(1, 2), rank=7)
    install_problems(monkeypatch, zigzag=stranger, number=3)
    problems = PROBLEMS | {"zigzag": stranger}
    assert list(load_problems()) == [*sorted(problems, key=lambda name: problems[name].rank), "number"]
    plan = make_plan(["number", "zigzag"], instances=1, processes=1)
    results = run_bench([load_subject("vts-ppt")], plan)
    assert results.not_loaded == {"number": "the entry point gives a int, not a contactverif.problems.problem.Problem"}
    assert [cell.scene for cell in results.cells] == ["zigzag", "zigzag"]
    assert (results.outcomes == Outcome.SOLVED).all()
    assert results.errors_of("vts-ppt").max() < 1e-5
    write_bench(results, tmp_path / "a.nc")
    again = read_bench(tmp_path / "a.nc")
    facts = (again.cells, again.label("zigzag"), again.targets)
    assert facts == (results.cells, "a stranger's zigzag", {"zigzag": stranger.targets})
    with pytest.raises(MisuseError, match="--scene: found number: the entry point gives a int"):
        make_plan(["number"])


@pytest.mark.parametrize(("problem", "meshes"), [(EGG_BOX, (1, 2)), (HERTZ_IN_SPACE, (3, 5))], ids=["egg-box", "hertz"])
def test_errors_in_space_are_small_and_fall_on_a_finer_mesh(problem: Problem, meshes: tuple[int, int]) -> None:
    subject, errors = load_subject("sts-3d"), []
    for mesh in meshes:
        instance = problem.pose(mesh, 10.0, subject.traits, Variation(load=1.1, swapped=True))
        errors.append(instance.errors(solve_for_accuracy(instance.scene, subject, instance.start, instance.step)))
    assert max(errors[1][kind] for kind in FORCES) < problem.targets[0]
    assert all(errors[1][kind] < 0.85 * errors[0][kind] for kind in (*FORCES, PRESSURE))


def test_a_bench_is_in_the_plane_or_in_space_and_says_who_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    install_problems(monkeypatch, eggs=replace(EGG_BOX, meshes=(1,)), zigzag=replace(PROBLEMS["kinked"], meshes=(1,)))
    plan = make_plan(["eggs", "zigzag"], instances=1, processes=1)
    faces, segments = load_subject("sts-3d"), load_subject("sts")
    results = run_bench([faces, segments], plan)
    assert (results.formulations, results.scenes) == (("sts-3d",), ("eggs",))
    assert results.not_loaded == {
        "zigzag": "another dimension: it is in the plane, the bench in space",
        "sts": "another dimension: it takes no triangles in space",
    }
    cost = bench_costs.cost_of(results, "sts-3d", "eggs", EGG_BOX.targets[0])
    assert all(np.isfinite(cost.middle(number)) for number in ("evaluation", "systems", "factorisation", "factors"))
    assert run_bench([segments, faces], plan).scenes == ("zigzag",)
    with pytest.raises(MisuseError, match=r"^NAME: found sts: .*no triangles in space; needed a formulation for eggs"):
        run_bench([segments], make_plan(["eggs"], instances=1, processes=1))


def _fail(mesh: int, penalty: float, traits: Traits, variation: Variation) -> ProblemInstance:
    raise ValueError(f"no mesh {mesh}")


NO_MESH = r"ValueError: no mesh 1 \(test_bench.py, line \d+\)"


def _pose_no_forces(mesh: int, penalty: float, traits: Traits, variation: Variation) -> ProblemInstance:
    return replace(PROBLEMS["kinked"].pose(mesh, penalty, traits, variation), forces=lambda positions: 1 // 0)


def _pose_flat_forces(mesh: int, penalty: float, traits: Traits, variation: Variation) -> ProblemInstance:
    instance = PROBLEMS["kinked"].pose(mesh, penalty, traits, variation)
    return replace(instance, forces=lambda positions: instance.forces(positions).reshape(-1))


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (_fail, rf"pose of the problem mine: found {NO_MESH}, on mesh 1 at the penalty 10; needed a Problem"),
        (
            _pose_no_forces,
            r"ProblemInstance.forces: found ZeroDivisionError: .* \(test_bench.py, line \d+\); needed values",
        ),
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
        run_cell(Cell("mine", 1, 0), [subject], 0)


def test_a_problem_that_is_posed_wrongly_is_not_measured_and_the_others_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """It may fail on its second mesh alone."""

    def pose_once(mesh: int, *others: Any) -> ProblemInstance:
        return PROBLEMS["kinked"].pose(mesh, *others) if mesh == 2 else _fail(mesh, *others)

    mine = replace(PROBLEMS["kinked"], meshes=(2, 1), pose=pose_once)
    install_problems(monkeypatch, mine=mine, zigzag=replace(PROBLEMS["kinked"], meshes=(1,)))
    subjects = [load_subject("vts-ppt")]
    plan = make_plan(["mine", "zigzag"], instances=1, processes=1)
    results = run_bench(subjects, plan)
    assert results.cells == (Cell("zigzag", 1, 0),)
    assert re.fullmatch(f"pose of the problem mine: found {NO_MESH}, on mesh 1 .*", results.not_loaded.pop("mine"))
    assert (results.outcomes == Outcome.SOLVED).all()
    assert not results.not_loaded
    with pytest.raises(MisuseError, match=r"--scene: found mine: pose of .*; needed a problem that can be posed"):
        run_bench(subjects, make_plan(["mine"], instances=1, processes=1))


def test_a_plan_of_nothing_is_refused() -> None:
    for options, message in (
        ({"scenes": ["disk"]}, "--scene: found 'disk'; needed one of " + ", ".join(PROBLEMS)),
        ({"instances": 0}, "--instances: found 0; needed at least 1, at most 1000"),
        ({"processes": 1001}, "--processes: found 1001; needed at least 1, at most 1000"),
    ):
        with pytest.raises(MisuseError, match=message):
            make_plan(**options)  # type: ignore[arg-type]


def test_a_bench_that_is_killed_goes_on_and_equals_an_unbroken_one_but_for_seconds(tmp_path: Path) -> None:
    environment = {**os.environ, "NO_COLOR": "1"}
    arguments = [*MAIN, *ARGUMENTS, "--out"]
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
    first, *_ = (message for _, message in read_messages(record_files(journal)[0]))
    for target in (killed, unbroken):
        subprocess.run([*arguments, str(target)], env=environment, check=True, stdout=subprocess.DEVNULL)
    assert not journal.exists()
    with xr.open_datatree(killed, engine="netcdf4") as resumed, xr.open_datatree(unbroken, engine="netcdf4") as other:
        xr.testing.assert_identical(resumed.to_dataset().drop_attrs(), other.to_dataset().drop_attrs())
        record = msgspec.msgpack.decode(first)["record"]
        stored = resumed["timing/evaluation_seconds"].values[:, 0, 0].tolist()
    expected = [run["evaluation"] for run in record["runs"].values()]
    assert stored == expected  # What was measured before the kill was not measured again.


@pytest.mark.parametrize(("cell", "change"), [(Cell("wavy", 16, 0), 1e-10), (Cell("hertz", 20, 0), 0.03)])
def test_more_points_on_a_cell_do_not_change_the_errors_of_sts(
    cell: Cell, change: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page says so: its curve is the floor of forces and displacements."""
    errors = []
    for count in (3, 12):
        monkeypatch.setattr(segment_to_segment, "N_POINTS", count)
        subject = Subject("sts", segment_to_segment.sts)
        instance = pose(cell, RULE.penalty, subject.traits, 0)
        errors.append(largest_errors(instance, solve_for_accuracy(instance.scene, subject)))
    for kind in ("forces", "displacement"):
        assert errors[1][kind] == pytest.approx(errors[0][kind], rel=change)


@pytest.mark.parametrize("scene", ["wavy", "hertz"])
def test_the_best_pressure_is_that_of_the_normal_equations_and_no_formulation_is_far_better(scene: str) -> None:
    """Its error is p1 k² h²/√720 of a wave on equal segments, and of first order of Hertz' pressure."""
    meshes = {"wavy": (16, 32), "hertz": (20, 40)}[scene]
    instances = [PROBLEMS[scene].pose(mesh, RULE.penalty, Traits(), Variation()) for mesh in meshes]
    coarse, fine = (instance.best_pressure for instance in instances)
    assert 0.6 < np.log2(coarse / fine) < 2.1
    if scene == "wavy":
        formula = (2 * np.pi / 16) ** 2 / np.sqrt(720) / np.sqrt(2)
        assert coarse == pytest.approx(formula, rel=0.03)
    points = solve_for_accuracy(instances[0].scene, load_subject("sts"))
    assert instances[0].errors(points)[PRESSURE] > 0.5 * coarse
