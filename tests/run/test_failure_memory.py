"""The memory of failures: what failed once is asked first, fails its row again, and goes once it passes."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_run import ZERO, a_case, from_size, subject

from contactverif import Verdict
from contactverif.contract.counterexample import Origin, counterexamples
from contactverif.contract.result import Result, Run
from contactverif.run import failure_memory
from contactverif.run.failure_memory import FailureMemory, Failures
from contactverif.run.run import run
from contactverif.run.scheduler import Progress
from contactverif.run.store import Store
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.netcdf.write import write

KEY = "mine", ZERO.id
LARGE = 100  # No planned case has so many segments.


def ask(least: int, remembered: Failures, progress: Callable[[Progress], None] | None = None, seed: int = 1) -> Run:
    """Return the run of a formulation that promises to pass, and fails with so many segments."""
    wrong = subject(from_size(least), flat=True)
    return run([wrong], [ZERO], examples=20, seed=seed, store=store_with(remembered), progress=progress)


def store_with(failures: Failures) -> Store:
    store = Store()
    store.failures = failures
    return store


def test_what_failed_once_is_asked_first_and_fails_the_row_beside_the_planned_cases(tmp_path: Path) -> None:
    steps: list[Progress] = []
    result = ask(LARGE, {KEY: a_case(2 * LARGE)}, steps.append)
    phases = list(dict.fromkeys(step.phase for step in steps))
    assert phases[:3] == ["first call (compiles)", "asking again", "drawing"]
    (row,) = result.rows
    assert (row.verdict, row.result) == (Verdict.FAIL, Result.BROKEN_PROMISE)
    assert (row.planned, row.judged, row.tally.verdicts[Verdict.PASS]) == (20, 20, 20)
    write(result, tmp_path / "run.nc")
    for each in (result, read_run(tmp_path / "run.nc")):
        (example,) = counterexamples(each).values()
        assert (example.id, example.origin) == ("mine.patch.zero", Origin.EARLIER)
        assert len(example.case.interface.slave) == 2 * LARGE


def test_what_failed_once_and_passes_now_changes_nothing() -> None:
    (now,), (before,) = ask(LARGE, {KEY: a_case(3)}).rows, ask(LARGE, {}).rows
    assert (now.verdict, now.witness, now.planned) == (Verdict.PASS, None, 20)
    assert now.tally == before.tally


def test_a_case_is_kept_bit_by_bit_until_its_property_passes(tmp_path: Path) -> None:
    memory = FailureMemory(tmp_path / "kept")
    assert memory.recall(["mine"], [ZERO.id]) == {}
    (row,) = ask(3, {}).rows
    assert row.shrunk is not None
    memory.update([row])
    case = memory.recall(["mine", "other"], [ZERO.id])[KEY]
    for name, values in row.shrunk.case.to_arrays().items():
        np.testing.assert_array_equal(case.to_arrays()[name], values, strict=True)
    assert (tmp_path / "kept" / ".gitignore").read_text() == "*\n"
    memory.update([replace(row, verdict=Verdict.NOT_JUDGED)])  # Nothing is known of it now.
    assert KEY in memory.recall(["mine"], [ZERO.id])
    memory.update(ask(LARGE, {}).rows)
    assert memory.recall(["mine"], [ZERO.id]) == {}


def test_the_smallest_case_stays_while_it_fails(tmp_path: Path) -> None:
    memory = FailureMemory(tmp_path)
    memory.update(ask(3, {}).rows)
    memory.update(ask(3, memory.recall(["mine"], [ZERO.id]), seed=2).rows)
    assert len(memory.recall(["mine"], [ZERO.id])[KEY].interface.slave) == 3


def test_other_code_and_damage_are_forgotten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    memory = FailureMemory(tmp_path)
    memory.update(ask(3, {}).rows)
    (file,) = (tmp_path / "failures").iterdir()
    whole = file.read_bytes()
    failure_memory._owner.cache_clear()
    with monkeypatch.context() as patch:
        patch.setattr(failure_memory, "code_digests", lambda *_: {"code of contactverif": "another"})
        assert memory.recall(["mine"], [ZERO.id]) == {}
    failure_memory._owner.cache_clear()
    assert KEY in memory.recall(["mine"], [ZERO.id])
    np.savez(file, owner=np.array([{"any": "object"}], dtype=object))  # An object could run code as it is read.
    assert memory.recall(["mine"], [ZERO.id]) == {}
    for damaged in (whole[: len(whole) // 2], b"", b"no arrays"):
        file.write_bytes(damaged)
        assert memory.recall(["mine"], [ZERO.id]) == {}
