"""A run that asks a formulation nothing more once its first answers explain all that would follow."""

from collections.abc import Callable, Mapping
from typing import Any

import pytest
from subjects import Changed, ResidualAlone, load_property

import contactverif_nts
from contactverif.contract.result import NotLoaded, Result, Run
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Promises, Traits
from contactverif.run.run import Stop, run
from contactverif_nts import nts

FAILS = Promises(conserves_force=False)
IDS = ("balance.force", "hard.node-hit", "purity")


class Wrong(ResidualAlone):
    """Springs at slave nodes with a mistake, which promise nothing."""

    def __init__(self, mistake: Callable[[int, Any], Any], penalty: float) -> None:
        super().__init__(contactverif_nts.nts_ar(penalty=penalty))
        self.traits, self.mistake, self.calls = Traits(), mistake, 0

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        self.calls += 1
        return self.mistake(self.calls, super().residual(interface, pairing, z))


def crash(calls: int, forces: Any) -> Any:
    raise IndexError(f"call {calls}")


MISTAKES: Mapping[str, tuple[Callable[[int, Any], Any], str]] = {
    "sign": (lambda _, forces: -forces, "not asked: the forces have the opposite sign"),
    "state": (lambda calls, forces: forces * (1 + calls / 1024), "not asked: purity fails"),
    "crash": (crash, "not asked: the plugin crashes in "),
    "shape": (lambda _, forces: forces[1:], "not asked: the contract is broken in "),
}


STOPS: tuple[tuple[Stop, Result], ...] = (("foundation", Result.OMITTED), ("never", Result.PASS))


def judge_few(name: str, *, known: str = "", stop: Stop = "foundation", ids: tuple[str, ...] = IDS) -> Run:
    subject = Subject(name, lambda *, penalty: Wrong(MISTAKES[name][0], penalty))
    reasons = {known: "known"} if known else {}
    questions = [load_property(id_) for id_ in ids]
    return run([subject], questions, examples=4, seed=1, known=reasons, stop=stop, shrink="none")


@pytest.mark.parametrize("name", MISTAKES)
def test_what_follows_from_the_first_answers_is_left_out(name: str) -> None:
    result = judge_few(name)
    reasons = [row.reason for row in result.rows if row.result is Result.OMITTED]
    assert reasons
    assert all(reason.startswith(MISTAKES[name][1]) for reason in reasons)
    assert not result.promises_kept
    assert "hard.node-hit" in [row.property_id for row in result.rows if row.omitted]


@pytest.mark.parametrize("name", MISTAKES)
def test_everything_is_asked_if_the_user_wants_that(name: str) -> None:
    assert not [row for row in judge_few(name, stop="never").rows if row.omitted]


def test_a_known_failure_stops_nothing() -> None:
    assert not [row for row in judge_few("state", known="purity").rows if row.omitted]


def test_who_does_not_load_is_asked_nothing() -> None:
    plugin = NotLoaded("mine", "no module")
    assert run([plugin], [load_property("purity")], examples=4, stop="foundation").not_loaded == (plugin,)


def test_what_is_asked_alone_is_asked() -> None:
    (row,) = judge_few("state", ids=("hard.node-hit",)).rows
    assert row.judged == row.planned > 0


def test_traits_that_name_no_witness_are_told_before_anything_is_asked() -> None:
    """The person mends the traits first; what else there is would have to be asked again."""
    questions = [load_property(id_) for id_ in IDS]
    unproven = Subject("mine", lambda *, penalty: Changed(nts(penalty=penalty), traits=Traits(FAILS)))
    for stop, others in STOPS:
        rows = {
            row.property_id: row
            for row in run([unproven], questions, examples=4, seed=1, stop=stop, shrink="none").rows
        }
        assert rows["balance.force"].result is Result.WRONG_TRAITS
        assert "witness" in rows["balance.force"].reason
        assert rows["purity"].result is others
    assert rows["purity"].judged == 4
