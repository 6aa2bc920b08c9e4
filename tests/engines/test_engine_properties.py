"""Each question for engines alone catches an engine with the fault that it is about, and accuses no right one."""

import numpy as np
import pytest
from plain_engine import Plain
from planned_cases import draw_cases

from contactverif import Property, Verdict, judge_case
from contactverif.contract.property import Quantity
from contactverif.contract.subject import EngineSubject
from contactverif.plugins.registry import load_properties, property_ids
from contactverif.sampling.draw import Sampling
from contactverif_properties.patch_bent import count_bare
from contactverif_properties.patch_solved import REPORTED_FORCES, REPORTED_PRESSURES

MUTANTS = {
    "engine.purity": "softer at every call",
    "engine.mirror": "the second node gets more",
    "engine.renumbering": "the first edge is soft",
    "engine.units": "an absolute length",
    "engine.swap": "",  # Springs along the slave's normals are no two-sided method.
    "engine.objectivity": "upright normals",
    "engine.remote": "as stiff as the mean body",
    "engine.c": "the second node gets more",
    "engine.short-segment": "a tiny edge spoils the first one",
    "engine.zero-load": "thick surfaces",
    "engine.kinked": "upright normals",
    "engine.locking": "",  # Three springs between the nodes of both surfaces lock.
}
EXAMPLES = 12


def question_of(name: str) -> Property:
    (question,) = load_properties([name], engines=True)
    assert isinstance(question, Property)
    return question


def verdicts(name: str, engine: Plain) -> list[Verdict]:
    question, subject = question_of(name), EngineSubject("engine/plain", engine)
    cases = question.cases(None)
    if not isinstance(cases, tuple):
        cases = draw_cases(cases, seed=Sampling(examples=EXAMPLES, seed=1).key(question), examples=EXAMPLES).cases
    return [judge_case(question, case, subject).verdict for case in cases]


def test_every_question_for_engines_alone_has_its_mutant() -> None:
    assert set(MUTANTS) == set(property_ids(engines=True)) - set(property_ids())


@pytest.mark.parametrize("name", MUTANTS)
def test_the_mutant_is_caught(name: str) -> None:
    assert Verdict.FAIL in verdicts(name, Plain(MUTANTS[name]))


@pytest.mark.parametrize("name", [name for name, fault in MUTANTS.items() if fault])
def test_a_right_engine_passes(name: str) -> None:
    assert set(verdicts(name, Plain())) == {Verdict.PASS}


@pytest.mark.parametrize(
    ("fault", "wrong"),
    [
        ("reports everything", None),
        ("reports what pushes the other side", REPORTED_FORCES),
        ("reports a pressure that is too small", REPORTED_PRESSURES),
    ],
)
@pytest.mark.parametrize("name", ["patch.flat.solve", "patch.dead-zone"])
def test_what_a_code_reports_is_judged(name: str, fault: str, wrong: Quantity | None) -> None:
    question, subject = question_of(name), EngineSubject("engine/plain", Plain(fault, inclined=False))
    cases = draw_cases(question.cases(None), seed=Sampling(examples=6, seed=1).key(question), examples=6).cases
    judged, too_large = set(), set()
    for case in cases:
        for number in judge_case(question, case, subject).measurement.numbers:
            quantity = number.quantity.name.removesuffix(", high penalty")
            judged.add(quantity)
            too_large |= {quantity} if number.value > number.tolerance else set()
    assert {REPORTED_FORCES.name, REPORTED_PRESSURES.name} <= judged
    assert too_large == ({wrong.name} if wrong else set())


def test_springs_at_the_nodes_do_not_lock() -> None:
    assert set(verdicts("engine.locking", Plain("glued at the nodes"))) == {Verdict.PASS}


def test_nobody_is_turned_who_takes_no_inclined_supports() -> None:
    assert set(verdicts("engine.objectivity", Plain(inclined=False))) == {Verdict.UNDECIDED}


def test_nodes_of_a_ring_that_a_search_loses_are_counted_whatever_the_mean_is() -> None:
    interface = question_of("patch.curved").cases(None)[0].interface
    forces = np.zeros((interface.n_nodes, 2))
    for end in (0, 1):
        np.add.at(forces[:, 0], interface.slave.segments[:, end], interface.slave.lengths(interface.nodes))
    assert count_bare(interface, forces) == 0
    forces[8:14:2] = 0.0
    assert count_bare(interface, forces * 24 / 21) == 3
    assert count_bare(interface, 0 * forces) == 0  # Without a force there is nothing to share.
