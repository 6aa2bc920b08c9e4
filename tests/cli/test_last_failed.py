"""The failures that a command remembers in its folder, and asks first, or alone with `--last-failed`."""

import sys
from pathlib import Path
from typing import Any

import pytest
from asking import Ask, check_mistake, install_formulations
from subjects import ResidualAlone

import contactverif_nts
from contactverif.cli import progress
from contactverif.run.scheduler import Progress

ID = "patch.flat.transmission"
OPTIONS = ("-p", ID, "-p", "balance.force", "--examples", "5", "--isolation", "inline")
FACTOR = {"now": 2.0}  # The factor by which it is too stiff; its author mends it.


class Promising(ResidualAlone):
    """Springs that promise the patch test."""


def make(*, penalty: float) -> Any:
    return Promising(contactverif_nts.vts_ppt(penalty=FACTOR["now"] * penalty))


@pytest.fixture(autouse=True)
def folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setitem(FACTOR, "now", 2.0)
    monkeypatch.chdir(tmp_path)
    install_formulations(monkeypatch, mine=f"{__name__}:make")
    monkeypatch.setitem(sys.modules, __name__, sys.modules[__name__])
    return tmp_path / ".contactverif" / "failures"


def test_what_fails_is_kept_and_asked_first_until_it_passes(
    ask: Ask, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines: list[str] = []

    def show_progress(bar: progress.Bar, step: Progress) -> None:
        if step.row is not None:
            lines.append(f"{step.row.property_id} {step.row.planned}")

    monkeypatch.setattr(progress.Bar, "show_progress", show_progress)
    assert ask("verify", "mine", *OPTIONS, "--seed", "1").status == 1
    assert [file.name for file in folder.iterdir()] == [f"mine.{ID}.npz"]
    assert lines == ["balance.force 5", f"{ID} 5"]
    lines.clear()
    assert ask("verify", "mine", *OPTIONS, "--seed", "2").status == 1
    assert lines == [f"{ID} 0", "balance.force 5", f"{ID} 5"]
    again = ask("verify", "mine", *OPTIONS, "--last-failed")
    assert again.status == 1
    assert f"mine, {ID}: BROKEN PROMISE, a case that failed in an earlier run\n" in again.out
    assert again.out.endswith("1 of 1 failures of earlier runs are left.\n")
    FACTOR["now"] = 1.0
    mended = ask("verify", "mine", *OPTIONS, "--last-failed")
    assert (mended.status, list(folder.iterdir())) == (0, [])
    assert mended.out.endswith("0 of 1 failures of earlier runs are left.\n")
    needed = "a run of `verify` here in which something fails"
    message = f"--last-failed: found no failure of 'mine' in .contactverif; needed {needed}"
    check_mistake(ask("verify", "mine", *OPTIONS, "--last-failed"), message)


def test_nothing_is_kept_without_a_memory(ask: Ask, folder: Path) -> None:
    assert ask("verify", "mine", *OPTIONS, "--no-memory").status == 1
    (folder.parents[1] / "pyproject.toml").write_text("[tool.contactverif]\nmemory = false\n", encoding="utf-8")
    assert ask("verify", "mine", *OPTIONS).status == 1
    assert not folder.exists()


def test_what_cannot_be_judged_is_left(ask: Ask, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert ask("verify", "mine", *OPTIONS, "--seed", "1").status == 1
    check_mistake(
        ask("verify", "mine", *OPTIONS, "--last-failed", "--out", "mine.nc"), "--last-failed: found --out beside it; .*"
    )
    install_formulations(monkeypatch, mine="no_such_module:make")
    answer = ask("verify", "mine", *OPTIONS, "--last-failed")
    assert (answer.status, len(list(folder.iterdir()))) == (1, 1)
    assert "mine: not loaded: ModuleNotFoundError" in answer.out
    assert answer.out.endswith("1 of 1 failures of earlier runs are left.\n")
