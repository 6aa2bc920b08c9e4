"""The command `stability`: a table that fits 80 columns, files by suffix, and an exit status that follows promises."""

import re
import sys
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from asking import Ask, check_mistake, install_formulations
from gauss_springs import GaussSprings, by_points_first

from contactverif_reports.netcdf.read import case_ids


class FarSprings(GaussSprings):
    """Springs that round a point before they subtract a node, and are a residual alone."""

    def __init__(self, penalty: float, promise: bool | None) -> None:
        super().__init__(penalty, by_points_first, translation_stable=promise, batched=False, tangent=None)

    def __getattribute__(self, name: str) -> Any:
        if name in ("pair", "tangent"):
            raise AttributeError(name)
        return super().__getattribute__(name)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return super().residual(interface, GaussSprings.pair(self, interface, z), z)


def make_modest(*, penalty: float) -> FarSprings:
    """Make springs that promise nothing."""
    return FarSprings(penalty, None)


def make_boaster(*, penalty: float) -> FarSprings:
    """Make springs that promise to be stable."""
    return FarSprings(penalty, True)


@pytest.fixture
def ask(ask: Ask) -> Ask:
    return partial(ask, "stability")


@pytest.fixture
def strangers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Install two formulations that are residuals alone, and one that does not load."""
    monkeypatch.setitem(sys.modules, __name__, sys.modules[__name__])
    places = {name: f"{__name__}:make_{name}" for name in ("modest", "boaster")}
    install_formulations(monkeypatch, absent="no_such_module:make", **places)


def test_a_stable_formulation_has_a_table_a_sentence_and_files(ask: Ask, tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("a.nc", "a.svg", "a.png", "a.md")]
    answer = ask("nts-ar", *(word for file in files for word in ("--out", file)), columns=80)
    assert (answer.status, answer.err) == (0, "")
    (line,) = [line for line in answer.out.splitlines() if line.startswith(" nts-ar ")]
    assert len(line.split()) == 8
    assert all(float(number) <= 4 for number in line.split()[1:7])
    assert float(line.split()[7]) <= 1e-10
    assert "nts-ar stays below the line in all 95 states;" in answer.out
    assert "\nEvery promise is kept and every property was judged.\n" in answer.out
    for file in files:
        assert file.stat().st_size > 0
        assert str(file) in answer.out
    assert case_ids(files[0]) == []


def test_the_table_fits_80_columns_and_cuts_no_number(ask: Ask) -> None:
    answer = ask("mortar:normals=averaged", "vts-ppt", columns=80)
    table = answer.out.partition("* relative")[0]
    assert max(map(len, answer.out.splitlines())) <= 80
    assert "…" not in table
    assert "mortar:normals=averaged" in table


@pytest.mark.usefixtures("strangers")
def test_a_stranger_that_is_a_residual_alone_has_a_panel(ask: Ask, tmp_path: Path) -> None:
    report = tmp_path / "a.nc"
    answer = ask("modest", "--out", report, columns=80)
    assert (answer.status, answer.err) == (0, "")  # It promises nothing, so nothing is broken.
    assert "modest is above the line in " in answer.out
    assert f"contactverif replay {report} --case modest.stability.sweep.offset-1e9" in answer.out
    assert "without stability.stiffness (no exact tangent" in " ".join(answer.out.split())
    assert "modest.stability.sweep.offset-1e6-a" in case_ids(report)


@pytest.mark.usefixtures("strangers")
def test_a_broken_promise_and_a_plugin_that_does_not_load_fail(ask: Ask) -> None:
    broken = ask("boaster")
    assert broken.status == 1
    assert broken.out.endswith("1 broken promise: boaster stability.sweep.\n")
    absent = ask("absent", "nts")
    assert absent.status == 1
    assert absent.out.endswith("1 plugin not loaded: absent.\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "NAME: found nothing; needed --all, or some of "),
        (["nts", "--all"], "NAME: found nts and --all; needed one of the two"),
        (["nts", "--out", "a.html"], "--out: found 'a.html'; needed a name that ends in .nc, .png, .svg or .md"),
        (["no-such"], "formulation: found 'no-such'; "),
    ],
)
def test_a_wrong_command_line_is_one_line(ask: Ask, arguments: list[str], message: str) -> None:
    answer = ask(*arguments)
    check_mistake(answer, re.escape(message) + ".*")
