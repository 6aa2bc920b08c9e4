"""The command `bench`: a table that fits 80 columns, files by suffix, and an exit status that follows the changes."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from asking import Ask
from studies.bench_results import make_cells, make_results
from subjects import change_verbs, load_subject

from contactverif import Subject
from contactverif.studies import bench_cells
from contactverif_reports.bench_costs import compare_benches
from contactverif_reports.netcdf.bench_file import read_bench, write_bench

QUICK = "bench nts-ar vts-ppt --quick --scene wavy"


def test_a_bench_has_a_table_of_80_columns_sentences_and_files(ask: Ask, tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("a.nc", "a.html", "a.md")]
    outputs = [word for file in files for word in ("--out", file)]
    answer = ask(f"{QUICK} --instances 2", *outputs, "--pictures", tmp_path / "figures", columns=80)
    assert (answer.status, answer.err) == (0, "")
    assert max(map(len, answer.out.replace(str(tmp_path), "").splitlines())) <= 80
    assert "On wavy, at an error of 1 % in the forces" in answer.out
    assert "no ratio has an interval, so nobody is known to be faster: that takes 5" in " ".join(answer.out.split())
    for file in files:
        assert file.stat().st_size > 0
        assert str(file) in answer.out
    figures = {f"{name}.svg" for name in ("wavy", "cost", "runtimes", "starts")}
    assert {file.name for file in (tmp_path / "figures").iterdir()} == figures
    assert not (tmp_path / "a.nc.journal").exists()
    again = ask("bench", files[0], "--out", tmp_path / "b.html", columns=80)
    assert again.status == 0
    assert (tmp_path / "b.html").read_text() == files[1].read_text()


def test_what_became_slower_is_told_by_its_interval(ask: Ask, tmp_path: Path) -> None:
    for name, seconds in (("old", 1e-3), ("new", 1.3e-3)):
        runs = {"vts-ppt": {8: (seconds, 0.1, 2), 16: (2 * seconds, 0.01, 3)}}
        write_bench(replace(make_results(make_cells(), runs, noise=0.02), not_loaded={}), tmp_path / f"{name}.nc")
    worse = ask("bench", tmp_path / "new.nc", "--against", tmp_path / "old.nc")
    assert worse.status == 1
    words = " ".join(worse.out.split())
    assert "vts-ppt, 12 cells: one evaluation takes 1.30 [1.30, 1.30] times as long (slower); all counts are" in words
    better = ask("bench", tmp_path / "old.nc", "--against", tmp_path / "new.nc")
    assert (better.status, "(faster)" in better.out) == (0, True)


class Counter:
    """A clock without time: a reading is one tick, and a plugin says how many ticks its work takes."""

    def __init__(self) -> None:
        self.ticks = 0.0

    def __call__(self) -> float:
        self.ticks += 1e-6
        return self.ticks


@pytest.fixture
def counter(monkeypatch: pytest.MonkeyPatch) -> Counter:
    """Put a counter in the place of the clocks of a bench."""
    clock = Counter()
    monkeypatch.setattr(bench_cells, "perf_counter", clock)
    return clock


def make_busy(name: str, counter: Counter, seconds: dict[str, float], needless: set[str]) -> Subject:
    """Return a formulation that works or sleeps for some seconds in each call, or computes forces that nobody needs."""

    def make(*, penalty: float) -> Any:
        inner = load_subject(name).with_penalty(penalty).plugin

        def work(right: Any, *arguments: Any) -> Any:
            counter.ticks += seconds[name]
            if name in needless:
                inner.residual(*arguments)
            return right(*arguments)

        verbs = [verb for verb in ("residual", "tangent", "residual_and_tangent") if hasattr(inner, verb)]
        return change_verbs(inner, **dict.fromkeys(verbs, work))

    return Subject(name, make)


@pytest.mark.parametrize(
    ("factor", "is_needless", "words"),
    [
        (1.0, False, "(as fast); all counts are equal."),
        (1.2, False, "(slower); all counts are equal."),
        (1.0, True, "(as fast); calls: "),
    ],
)
def test_one_that_sleeps_is_found_by_seconds_and_a_needless_residual_without_a_clock(
    ask: Ask,
    counter: Counter,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    factor: float,
    is_needless: bool,
    words: str,
) -> None:
    seconds, needless = {"vts-ppt": 1e-3, "nts-ar": 1e-3}, set[str]()
    monkeypatch.setattr(
        "contactverif.cli.bench.load_formulation", lambda name, limits: make_busy(name, counter, seconds, needless)
    )
    assert ask(f"{QUICK} --processes 1 --out", tmp_path / "old.nc").status == 0
    seconds["vts-ppt"] *= factor
    needless |= {"vts-ppt"} if is_needless else set()
    answer = ask(f"{QUICK} --processes 1 --out", tmp_path / "new.nc", "--against", tmp_path / "old.nc")
    assert answer.status == int(factor > 1 or is_needless), answer.out + answer.err
    lines = " ".join(answer.out.split())
    (other, ours) = re.findall(r"(?:nts-ar|vts-ppt), 10 cells: (?:(?!vts-ppt, ).)*", lines)
    assert words in ours
    assert "(as fast); all counts are equal." in other
    new, old = (read_bench(tmp_path / f"{name}.nc") for name in ("new", "old"))
    assert compare_benches(new, old)[1].evaluation.middle == pytest.approx(factor, rel=0.01)
