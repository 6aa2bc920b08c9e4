"""The stiffness of all springs together: everybody is asked, and a factor of 2 shows in the number."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hard_strangers import PointSprings, Softened, simpson, trapezoid
from subjects import change_verbs, judge_as, load_property, load_subject, with_promises

import contactverif_nts
from contactverif import Subject, Verdict, judge_case
from contactverif.contract.traits import Rules, Traits

SCALE = load_property("total-stiffness")
CASES = {case.name: case for case in SCALE.cases(None)}
SILENT = Traits()


def scale_springs(factor: float, traits: Traits) -> Subject:
    """Return quarter-point springs of another stiffness, which state these traits."""

    class Scaled(PointSprings):
        def __init__(self, penalty: float) -> None:
            super().__init__(factor * penalty)
            self.traits = traits

    return Subject("scaled", lambda *, penalty: Scaled(penalty))


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_without_a_trait_one_pass_and_two_passes_pass(factor: float, name: str) -> None:
    outcome = judge_as(Verdict.PASS, SCALE, CASES[name], scale_springs(factor, SILENT))
    assert outcome.measurement is not None
    assert outcome.measurement.details["springs over ε̂ L"] == pytest.approx(factor)
    sentences = {1.0: "None", 2.0: "your springs are 2.00 ε̂ L: two passes, or twice too stiff"}
    assert str(outcome.measurement.finding) == sentences[factor]


@pytest.mark.parametrize("factor", [3.0, 1 / 3, 1.5, 0.5, 4.0, -1.0, 0.0])
def test_another_factor_fails_in_silence_too(factor: float) -> None:
    for case in CASES.values():
        outcome = judge_as(Verdict.FAIL, SCALE, case, scale_springs(factor, SILENT))
        assert f"your springs are {factor:#.3g} ε̂ L: one pass has 1 ε̂ L, two passes have 2 ε̂ L" in outcome.reason


def test_a_long_interface_shows_what_a_short_one_hides() -> None:
    """Half a percent too stiff, and the number of a segment in one byte."""

    class OneByte(PointSprings):
        def pair(self, interface: Any, z: Any) -> Any:
            pairing = dict(super().pair(interface, z))
            (name,) = (key for key, numbers in pairing.items() if numbers.dtype == np.int64 and numbers.max() > 200)
            return {**pairing, name: pairing[name].astype(np.uint8).astype(np.int64)}

    long = CASES["304 segments"]
    judge_as(Verdict.FAIL, SCALE, long, scale_springs(1.005, SILENT))
    judge_as(Verdict.PASS, SCALE, CASES["16 segments, stiff"], scale_springs(1.005, SILENT))
    judge_as(Verdict.FAIL, SCALE, long, Subject("one byte", lambda *, penalty: OneByte(penalty)))


def test_a_master_that_gets_more_than_the_slave_fails_whatever_is_promised() -> None:
    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        forces = np.array(right(interface, pairing, z))
        forces[2 * interface.n_slave_nodes :] *= 1.5
        return forces

    subject = Subject("more", lambda *, penalty: change_verbs(contactverif_nts.nts(penalty=penalty), residual=residual))
    for case in CASES.values():
        outcome = judge_as(Verdict.FAIL, SCALE, case, subject)
        assert "the master gets 1.6" in outcome.reason or "the master gets 1.5" in outcome.reason


def test_springs_that_state_their_area_act_once() -> None:
    traits = Traits(rules=Rules(penalty="distributed", area="current"))
    outcome = judge_as(Verdict.FAIL, SCALE, CASES["8 segments"], scale_springs(2.0, traits))
    assert outcome.reason.endswith("your springs are 2.00 ε̂ L: one pass has 1 ε̂ L")


@pytest.mark.parametrize("name", ["nts", "two-pass/nts"])
def test_nodal_springs_pass_whether_they_state_their_unit_or_not(name: str) -> None:
    inner = load_subject(name)
    silent = with_promises(lambda *, penalty: inner.with_penalty(penalty).plugin, penalty=None, unbiased=None)
    for case in CASES.values():
        for subject in (inner, silent):
            judge_as(Verdict.PASS, SCALE, case, subject)


RIGHT_ONES = {  # Beside all `STRANGERS`, which `test_strangers.py` asks.
    "quarter points": PointSprings,
    "nodes": trapezoid,
    "Simpson's rule, the last of equals": lambda penalty: simpson(penalty, last=True),
    "no traits": lambda penalty: PointSprings(penalty, stated=False),
}


@pytest.mark.parametrize("name", RIGHT_ONES)
def test_a_right_formulation_of_a_stranger_is_not_accused(name: str) -> None:
    subject = Subject(name, lambda *, penalty: RIGHT_ONES[name](penalty=penalty))
    for case in CASES.values():
        judge_as(Verdict.PASS, SCALE, case, subject)


def test_springs_that_lose_both_ends_to_roundoff_pass() -> None:
    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        ends = np.zeros(interface.n_nodes, bool)
        ends[interface.slave.segments[interface.slave.neighbours < 0]] = True
        return np.where(np.repeat(ends, 2), 0.0, right(interface, pairing, z))

    subject = Subject(
        "open ends", lambda *, penalty: change_verbs(contactverif_nts.nts(penalty=penalty), residual=residual)
    )
    for case in CASES.values():
        judge_as(Verdict.PASS, SCALE, case, subject)


def test_a_law_that_is_not_linear_has_no_stiffness_and_is_not_judged() -> None:
    outcome = judge_case(SCALE, CASES["8 segments"], Subject("soft", lambda *, penalty: Softened(penalty)))
    assert outcome.verdict is Verdict.PASS
    assert outcome.measurement is not None
    assert not outcome.measurement.numbers
    assert 0 < outcome.measurement.details["springs over ε̂ L"] < 0.5


def test_multipliers_and_barriers_are_not_asked() -> None:
    assert SCALE.refusal(load_subject("nts-lm").traits)
    assert SCALE.refusal(Traits(rules=Rules(enforcement="barrier")))
    assert not SCALE.refusal(SILENT)
    assert SCALE.promise(SILENT)


def test_surfaces_are_equally_long_with_segments_of_the_mean_length_1() -> None:
    for case in CASES.values():
        along, interface = [Fraction(place) for place in case.parameters["along"].tolist()], case.interface
        slave, master = along[: interface.n_slave_nodes], along[interface.n_slave_nodes :]
        assert (min(slave), max(slave)) == (min(master), max(master))
        assert len(interface.slave) == len(interface.master) == max(slave) - min(slave) >= 8
        assert len(set(slave) & set(master)) == 2  # The ends.
