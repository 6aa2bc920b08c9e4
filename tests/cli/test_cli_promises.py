"""The words of a run about formulations that promise nothing: their stiffness, and the number of promises."""

import sys
from typing import Any

import pytest
from asking import Ask, install_formulations
from subjects import ResidualAlone

import contactverif_nts
from contactverif.contract.traits import Traits


class Silent(ResidualAlone):
    """Springs that promise nothing."""

    def __init__(self, inner: Any) -> None:
        super().__init__(inner)
        self.traits = Traits()


def make_twice(*, penalty: float) -> Silent:
    return Silent(contactverif_nts.nts_ar(penalty=2 * penalty))


def make_three_times(*, penalty: float) -> Silent:
    return Silent(contactverif_nts.nts_ar(penalty=3 * penalty))


@pytest.fixture
def silent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, __name__, sys.modules[__name__])
    install_formulations(monkeypatch, twice=f"{__name__}:make_twice", three_times=f"{__name__}:make_three_times")


OPTIONS = ("-p", "total-stiffness", "-p", "swap", "-p", "patch.flat.transmission", "--examples", "2", "--seed", "1")


@pytest.mark.usefixtures("silent")
def test_who_promises_nothing_is_told_so_and_how_stiff_its_springs_are(ask: Ask) -> None:
    answer = ask("verify", "twice", *OPTIONS)
    assert answer.status == 0
    assert "your springs are 2.00 ε̂ L: two passes, or twice too stiff" in answer.out
    lines = answer.out.splitlines()[-2:]
    assert lines == [
        "Every promise is kept and every property was judged.",
        "Properties promised to pass: 1, to fail: 0, neither: 2.",
    ]


@pytest.mark.usefixtures("silent")
def test_a_wrong_stiffness_breaks_a_promise_that_everybody_makes(ask: Ask) -> None:
    answer = ask("verify", "three_times", *OPTIONS)
    assert answer.status == 1
    assert "your springs are 3.00 ε̂ L: one pass has 1 ε̂ L, two passes have 2 ε̂ L" in answer.out
    assert answer.out.endswith("1 broken promise: three_times total-stiffness.\n")
    assert "Properties promised" not in answer.out


def test_what_makes_no_sense_for_a_formulation_is_no_promise(ask: Ask) -> None:
    answer = ask("verify", "nts", "nts-lm", *OPTIONS)
    assert answer.status == 0
    assert answer.out.endswith("\nProperties promised to pass: 1, to fail: 4, neither: 0.\n")


def test_nobody_says_that_all_was_judged_where_something_is_undecided(ask: Ask) -> None:
    """On scene c a kink is so near that the order of Newton's method cannot be told."""
    answer = ask("verify", "vts-ppt-balanced", "--scene", "c", "-p", "newton.*", "--seed", "1")
    assert answer.status == 0
    assert "\nEvery promise that was judged is kept. Undecided: vts-ppt-balanced newton.order.\n" in answer.out
    assert "every property was judged" not in answer.out
