"""The screen of a run: few lines, of which the first says what is wrong, and the most telling mesh is drawn."""

import sys
from typing import Any

import pytest
from asking import Ask, install_formulations
from subjects import ResidualAlone, load_property

import contactverif_nts
from contactverif.cli.run_screen import run_screen
from contactverif.contract.property import Measurement, Outcome, Verdict
from contactverif.contract.result import Row, Run
from contactverif.contract.traits import PatchPromises, Promises, Traits
from contactverif.problems.named_states import named_case
from contactverif.run.ranking import by_rank

CHEAP = ("purity", "balance.*", "patch.flat.*", "hard.node-hit", "swap", "total-stiffness", "unilateral")
OPTIONS = (*(word for name in CHEAP for word in ("-p", name)), "--examples", "4", "--seed", "1")
MOST_LINES, MOST_LINES_OF_WRONG, COLUMNS = 25, 60, 80


class HalfEnds(ResidualAlone):
    """Springs at slave nodes that promise an exact patch, with half of the force at the first node."""

    traits = Traits(promises=Promises(patch=PatchPromises(flat=True)))

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = super().residual(interface, pairing, z)
        forces[:2] /= 2
        return forces


class Remembering(ResidualAlone):
    """Springs that grow with every call."""

    traits, calls = Traits(), 0

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        self.calls += 1
        return super().residual(interface, pairing, z) * (1 + self.calls / 1024)


def half_ends(*, penalty: float) -> HalfEnds:
    return HalfEnds(contactverif_nts.nts_ar(penalty=penalty))


def remembering(*, penalty: float) -> Remembering:
    return Remembering(contactverif_nts.nts_ar(penalty=penalty))


@pytest.fixture(autouse=True)
def wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, __name__, sys.modules[__name__])
    install_formulations(monkeypatch, half=f"{__name__}:half_ends", remembering=f"{__name__}:remembering")


def test_a_right_formulation_takes_few_lines_and_every_property_has_one_place(ask: Ask) -> None:
    answer = ask("verify", "vts-ppt", *OPTIONS, columns=COLUMNS)
    lines = answer.out.splitlines()
    assert answer.status == 0
    assert len(lines) <= MOST_LINES
    assert max(map(len, lines)) <= COLUMNS
    assert lines[2].startswith("vts-ppt: ")
    assert "  swap " in answer.out
    assert "\npasses: " in answer.out
    assert "✗" not in answer.out


def test_a_wrong_formulation_shows_one_mesh_and_a_line_for_all_else(ask: Ask) -> None:
    answer = ask("verify", "half", *OPTIONS, columns=COLUMNS)
    lines = answer.out.splitlines()
    assert answer.status == 1
    assert len(lines) <= MOST_LINES_OF_WRONG
    assert max(map(len, lines)) <= COLUMNS
    assert "wrong" in lines[2]
    assert answer.out.count("●──") == 1
    mesh, others = answer.out.split("also wrong:\n")
    assert "BROKEN PROMISE" in mesh
    assert "BROKEN PROMISE" not in others
    assert "  patch.flat.resultant  " in others
    assert "patch.flat.transmission" in others
    assert answer.out.endswith(" more.\n")


def test_every_counterexample_is_drawn_if_the_user_wants_that(ask: Ask) -> None:
    answer = ask("verify", "half", *OPTIONS, "--show", "all")
    assert answer.out.count("half, patch.flat.") > 2


def test_one_line_is_enough_for_a_script(ask: Ask) -> None:
    answer = ask("verify", "vts-ppt", "-q", *OPTIONS)
    assert answer.out == "Every promise is kept and every property was judged.\n"
    assert ask("verify", "half", "-q", "-p", "swap", "-p", "total-stiffness", *OPTIONS[-4:]).out.count("\n") == 1


def test_what_is_left_out_has_one_line_that_says_why_and_how_to_ask_it(ask: Ask) -> None:
    answer = ask("verify", "remembering", *OPTIONS, columns=COLUMNS)
    assert answer.status == 1
    assert "not asked: purity fails. --keep-going asks them all." in " ".join(answer.out.split())
    assert "✗ entries that change" in answer.out
    assert len(answer.out.splitlines()) <= MOST_LINES_OF_WRONG
    assert "not asked" not in ask("verify", "remembering", "--keep-going", *OPTIONS).out


def test_what_could_not_be_judged_is_not_called_wrong() -> None:
    question = load_property("purity")
    row = Row("mine", question.info, Verdict.NOT_JUDGED, True, reason="stopped: 3 of 100 cases judged", planned=100)
    screen = "\n".join(map(str, run_screen(Run((row,)), COLUMNS)))
    assert "mine: 1 not judged\nnot judged:\n  purity  stopped: 3 of 100 cases judged\n" in screen


def test_a_wrong_force_beside_an_exact_one_is_shown_before_two_answers_that_differ() -> None:
    rows = [
        Row("mine", load_property(name).info, verdict, True)
        for name, verdict in (
            ("mirror", Verdict.FAIL),
            ("patch.flat.resultant", Verdict.FAIL),
            ("purity", Verdict.FAIL),
        )
    ]
    assert [row.property_id for row in by_rank(rows)] == ["purity", "patch.flat.resultant", "mirror"]
    alone = [rows[0], Row("mine", load_property("patch.flat.resultant").info, Verdict.PASS, True)]
    assert by_rank(alone)[0].property_id == "mirror"


def test_a_failure_in_words_is_not_shown_by_a_number_that_keeps_its_tolerance() -> None:
    question = load_property("hard.free-end")
    number = next(iter(question.info.quantities)).check(0.5, 4.0)
    case = named_case("a1")
    measured = Measurement([number], broken="a force of 2 on a slave that faces no master")
    outcomes = (Outcome(case, Verdict.FAIL, measured.broken, measured),)
    other = Row("mine", load_property("purity").info, Verdict.FAIL, True, reason="it remembers")
    row = Row("mine", question.info, Verdict.FAIL, True, reason=measured.broken, planned=1, outcomes=outcomes)
    screen = "\n".join(map(str, run_screen(Run((other, row)), COLUMNS)))
    assert "hard.free-end  a force of 2 on a slave that faces no master\n" in screen


def test_a_run_that_judges_nothing_does_not_say_that_all_was_judged() -> None:
    info = load_property("purity").info
    rows = (Row("barrier", info, Verdict.NOT_APPLICABLE, None, reason="not defined in penetration"),)
    assert Run(rows).praise == "Nothing was judged of barrier: no property applies. What was judged is kept."
    judged = Row("mine", info, Verdict.PASS, True, planned=1, outcomes=(Outcome(named_case("a1"), Verdict.PASS),))
    assert Run((judged,)).praise == "Every promise is kept and every property was judged."
