"""The command `bench`: a table that fits 80 columns, files by suffix, and an exit status that follows the ratios."""

import re
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from asking import Ask, check_mistake
from studies.bench_results import make_results
from subjects import Changed, load_subject

from contactverif.contract.subject import Subject
from contactverif.run import registry
from contactverif.studies.bench import cell_runs, meter, timed_solution
from contactverif_reports.bench.results import Cell
from contactverif_reports.bench.slowdown import slowdowns
from contactverif_reports.netcdf.bench_file import read_bench, write_bench

QUICK = ("nts-ar", "vts-ppt", "--quick", "--scene", "wavy", "--repeats", "1")


@pytest.fixture
def ask(ask: Ask) -> Ask:
    return partial(ask, "bench")


def test_a_bench_has_a_table_of_80_columns_sentences_and_files(ask: Ask, tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("a.nc", "a.html", "a.md")]
    outputs = [word for file in files for word in ("--out", file)]
    answer = ask(*QUICK, *outputs, "--pictures", tmp_path / "figures", columns=80)
    assert (answer.status, answer.err) == (0, "")
    assert max(map(len, answer.out.replace(str(tmp_path), "").splitlines())) <= 80
    assert "On wavy, at an error of 1 % in the forces" in answer.out
    assert "nts-ar never gets there." in " ".join(answer.out.split())
    for file in files:
        assert file.stat().st_size > 0
        assert str(file) in answer.out
    assert {file.name for file in (tmp_path / "figures").iterdir()} == {"wavy.svg", "cost.svg"}
    assert not (tmp_path / "a.nc.journal").exists()
    again = ask(files[0], "--out", tmp_path / "b.html", columns=80)
    assert again.status == 0
    assert (tmp_path / "b.html").read_text() == files[1].read_text()


def test_what_became_slower_is_told_by_ratio(ask: Ask, tmp_path: Path) -> None:
    cells = [Cell("wavy", mesh, 1.0) for mesh in (1, 2)]
    runs = {"vts-ppt": [(1.0, 0.1), (2.0, 0.01)]}
    for name, slower in (("old", 1.0), ("new", 2.0)):
        write_bench(make_results(cells, runs, slower=slower), tmp_path / f"{name}.nc")
    worse = ask(tmp_path / "new.nc", "--against", tmp_path / "old.nc")
    assert worse.status == 1
    assert "Slower than 1.25 times: vts-ppt." in worse.out
    better = ask(tmp_path / "old.nc", "--against", tmp_path / "new.nc")
    assert "Nothing became slower." in better.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "NAME: found nothing; needed --all, or some of "),
        (["nts", "--scene", "disk"], "--scene: found 'disk'; needed one of "),
        (["nts", "--jobs", "2"], "--jobs: found 2; needed 1: solutions side by side would disturb their times"),
        (["nts", "--repeats", "0"], "--repeats: found 0; needed at least 1, at most 1000"),
        (["nts", "--against", "no-such.nc"], "FILE: found no-such.nc, which does not exist; needed a file that "),
        (["a.nc", "nts"], "NAME: found a.nc and more; needed formulations alone, or one file of a bench"),
        (["nts", "--out", "a.svg"], "--out: found 'a.svg'; needed a name that ends in .nc, .html or .md"),
    ],
)
def test_a_wrong_command_line_is_one_line(ask: Ask, arguments: list[str], message: str) -> None:
    answer = ask(*arguments)
    check_mistake(answer, re.escape(message) + ".*")


class Counter:
    """A clock without time: a reading is one tick, and a plugin says how many ticks its work takes."""

    def __init__(self) -> None:
        self.ticks = 0.0

    def __call__(self) -> float:
        self.ticks += 1e-6
        return self.ticks


@pytest.fixture
def counter(monkeypatch: pytest.MonkeyPatch) -> Counter:
    """Put a counter in the place of both clocks of a bench."""
    clock = Counter()
    monkeypatch.setattr(meter, "process_time", clock)
    monkeypatch.setattr(cell_runs, "process_time", clock)
    monkeypatch.setattr(timed_solution, "process_time", clock)
    monkeypatch.setattr(timed_solution, "perf_counter", clock)
    return clock


def count_work(name: str, counter: Counter, work: float) -> Subject:
    """Return a formulation whose forces and tangents take so much work by the counter."""

    def make(*, penalty: float) -> Any:
        inner = load_subject(name).with_penalty(penalty).plugin

        def with_work(verb: Any) -> Any:
            def call(*arguments: Any) -> Any:
                counter.ticks += work
                return verb(*arguments)

            return call

        verbs = ("residual", "tangent", "residual_and_tangent")
        return Changed(inner, **{verb: with_work(getattr(inner, verb)) for verb in verbs if hasattr(inner, verb)})

    return Subject(name, make)


def test_a_formulation_that_does_more_work_is_found_end_to_end(
    ask: Ask, counter: Counter, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    works = {"vts-ppt": 1e-3, "nts-ar": 1e-3}
    monkeypatch.setattr(registry, "load_formulation", lambda name, limits: count_work(name, counter, works[name]))
    assert ask(*QUICK, "--out", tmp_path / "old.nc").status == 0
    for factor, status, words in ((1.2, 0, "Nothing became slower."), (1.5, 1, "Slower than 1.25 times: vts-ppt.")):
        works["vts-ppt"] = factor * works["nts-ar"]
        answer = ask(*QUICK, "--out", tmp_path / "new.nc", "--against", tmp_path / "old.nc")
        assert answer.status == status, answer.out + answer.err
        assert words in answer.out
        new, old = (read_bench(tmp_path / f"{name}.nc") for name in ("new", "old"))
        ratios = {change.formulation: change.ratio for change in slowdowns(new, old)}
        assert ratios == {"vts-ppt": pytest.approx(factor, rel=0.05), "nts-ar": pytest.approx(1, rel=0.05)}
