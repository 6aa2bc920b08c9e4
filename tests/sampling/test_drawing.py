"""The drawing of cases: shared by properties with the same strategy, block by block, and the same for hypothesis."""

import gc
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any

import pytest
from hypothesis import strategies as st
from planned_cases import draw_cases
from subjects import same_case

from contactverif import Case, Interface, Measurement, Property, Quantity, Subject, Traits, Verdict, load_properties
from contactverif.contract.case import random_source
from contactverif.run.rows import WHOLE
from contactverif.run.run import run
from contactverif.sampling.draw import BLOCK, draw_block, draw_case, shrink, strategy_name
from contactverif.sampling.hypothesis_draws import draw_different, find_difference, shrink_case

INTERFACE = Interface.from_chains([[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]])
ERROR = Quantity("error", "1e-6", "a number for a test")


def a_case(penalty: int) -> Case:
    return Case(INTERFACE, INTERFACE.nodes.ravel(), penalty=float(penalty))


@random_source("stiff")
def stiff_cases(_: object = None) -> st.SearchStrategy[Case]:
    return st.integers(1, 10**9).map(a_case)


class Cases:
    def make(self, _: object) -> st.SearchStrategy[Case]:
        return stiff_cases()


def no_error(case: Case, subject: Subject) -> Measurement:
    return Measurement([ERROR.check(0.0, 1e-6)])


ANY = Property("patch.any", "patch", "No error.", (ERROR,), stiff_cases, no_error, lambda _: True)


class Silent:
    traits = Traits()

    def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
        return 0 * z


SILENT = Subject("silent", lambda *, penalty: Silent())


def penalties(cases: Any) -> list[float]:
    return [case.penalty for case in cases]


INSTALLED = [question for question in load_properties() if isinstance(question, Property)]


def test_properties_with_the_same_strategy_share_their_cases() -> None:
    others = replace(ANY, id="patch.other"), replace(ANY, id="patch.further", cases=lambda _: stiff_cases())
    mine, other, further = run([SILENT], [ANY, *others], examples=30, seed=1).rows
    assert all(a.case is b.case for a, b in zip(mine.outcomes, other.outcomes, strict=True))
    assert penalties(a.case for a in mine.outcomes) != penalties(a.case for a in further.outcomes)


@pytest.mark.parametrize(
    ("cases", "name"),
    [
        (stiff_cases, "stiff"),
        (lambda _: stiff_cases(), "patch.any"),
        (partial(stiff_cases), "patch.any"),
        (Cases().make, "patch.any"),
    ],
)
def test_a_strategy_has_its_stored_name_or_that_of_its_property(cases: Callable[..., Any], name: str) -> None:
    assert strategy_name(replace(ANY, cases=cases)) == name


def test_installed_properties_share_strategies_of_different_names() -> None:
    names = [strategy_name(question) for question in INSTALLED]
    functions = {(strategy_name(question), getattr(question.cases, "make", question.cases)) for question in INSTALLED}
    assert len(functions) == len(set(names))
    assert names.count("contactverif.strategies.general.smooth_cases") >= 6


def test_the_choice_and_the_order_of_properties_change_no_case() -> None:
    def cases(*ids: str) -> list[Case]:
        rows = run([SILENT], load_properties(list(ids)), examples=10, seed=1).rows
        return [outcome.case for row in rows if row.property_id == "swap" for outcome in row.outcomes]

    alone = cases("swap")
    for ids in (("mirror", "swap"), ("swap", "mirror"), ("balance.force", "swap", "symmetric")):
        assert all(same_case(*pair) for pair in zip(alone, cases(*ids), strict=True))


def test_hypothesis_makes_the_same_case_of_the_same_choices() -> None:
    """Hypothesis shrinks a case from its choices, so the choices must be what hypothesis itself would have drawn."""
    sources = {strategy_name(question): question.cases(None) for question in INSTALLED}
    random_sources = {name: source for name, source in sources.items() if not isinstance(source, tuple)}
    assert len(random_sources) <= 24
    for name, source in random_sources.items():
        strategy = next(iter(source.values())) if isinstance(source, Mapping) else source
        for draw in islice(draw_different(strategy, seed=name, simplest=True), 4):
            replayed: list[Case] = []
            shrink_case(strategy, choices=draw.stored_choices(), seed="", fails=replayed.append, limit=5)
            assert same_case(replayed[0], draw.case), name


def test_all_kinds_of_choices_are_stored() -> None:
    parts = st.tuples(st.floats(), st.text(), st.binary(), st.booleans(), st.integers(), st.integers(0, 5), st.just(1))
    strategy: Any = parts.filter(lambda values: values[3])
    for draw in islice(draw_different(strategy, seed="1", simplest=False), 50):
        replayed: list[Any] = []
        shrink_case(strategy, choices=draw.stored_choices(), seed="", fails=replayed.append, limit=1)
        assert repr(replayed[0]) == repr(draw.case)


def test_a_block_depends_on_no_other_block() -> None:
    everything = draw_cases(stiff_cases(), seed="1", examples=3 * BLOCK).cases
    for number in (2, 0):
        block = draw_block(stiff_cases(), seed="1", examples=3 * BLOCK, number=number)
        assert penalties(block.cases) == penalties(everything[number * BLOCK : (number + 1) * BLOCK])
        assert block.last is (number == 2)
        assert len(set(penalties(block.cases))) == BLOCK
    case = draw_case(stiff_cases(), seed="1", examples=3 * BLOCK, number=BLOCK + 7)
    assert same_case(case, everything[BLOCK + 7])


def test_more_examples_begin_with_the_same_cases() -> None:
    few, many = (draw_cases(stiff_cases(), seed="1", examples=n).cases for n in (20, BLOCK + 20))
    assert penalties(few) == penalties(many[:20])


def test_a_case_of_a_late_block_is_shrunk_from_where_it_was_drawn() -> None:
    judged: list[Case] = []

    def fails(case: Case) -> bool:
        judged.append(case)
        return case.penalty >= 1000

    everything = draw_cases(stiff_cases(), seed="1", examples=2 * BLOCK).cases
    first = next(n for n, case in enumerate(everything) if n > BLOCK and case.penalty >= 1000)
    shrink(stiff_cases(), seed="1", examples=2 * BLOCK, first=first, fails=fails)
    assert judged[0].penalty == everything[first].penalty
    assert min(case.penalty for case in judged if case.penalty >= 1000) == 1000


def test_a_run_of_many_cases_keeps_few_of_them() -> None:
    counts: list[int] = []

    def count_cases(case: Case, subject: Subject) -> Measurement:
        counts.append(0)
        if len(counts) % BLOCK == 0:
            counts[-1] = sum(type(item) is Case for item in gc.get_objects())
        return no_error(case, subject)

    before = sum(type(item) is Case for item in gc.get_objects())
    [row] = run([SILENT], [replace(ANY, measure=count_cases)], examples=4 * BLOCK, seed=1).rows
    assert row.judged == 4 * BLOCK
    assert max(counts) - before <= 2 * BLOCK + WHOLE


@pytest.mark.parametrize("source", [stiff_cases(), {"soft": stiff_cases(), "hard": stiff_cases()}])
def test_without_the_inside_of_hypothesis_its_engine_draws_and_shrinks(
    monkeypatch: pytest.MonkeyPatch, source: Any
) -> None:
    monkeypatch.setattr("contactverif.sampling.hypothesis_draws.find_difference", lambda: "another version")
    planned = draw_cases(source, seed="1", examples=40)
    assert len(planned.cases) == 40
    judged: list[Case] = []
    shrink(source, seed="1", examples=40, first=30, fails=lambda case: judged.append(case) or case.penalty >= 3)
    assert judged[0].penalty == planned.cases[30].penalty
    assert min(case.penalty for case in judged if case.penalty >= 3) == 3


def test_a_strategy_with_few_cases_gives_all_of_them_in_many_examples() -> None:
    few = replace(ANY, cases=lambda _: st.integers(1, 30).map(a_case))
    [row] = run([SILENT], [few], examples=3 * BLOCK, seed=1).rows
    assert (row.verdict, row.planned, row.judged) == (Verdict.PASS, 30, 30)


def test_this_version_of_hypothesis_draws_what_is_stored(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every environment of tox asks its own version."""
    assert find_difference() == ""
    for name, value in (("_STORED_PARTS", [0]), ("ConjectureData", object)):
        with monkeypatch.context() as patch:
            patch.setattr(f"contactverif.sampling.hypothesis_draws.{name}", value)
            assert re.match(r"hypothesis [\d.]+ (draws otherwise|has another inside)", find_difference.__wrapped__())
