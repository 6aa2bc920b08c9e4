"""The runner on formulations and properties made by hand: what is counted, what is shrunk, what fails a run."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from subjects import judge_as
from threadpoolctl import threadpool_info

from contactverif import Case, Interface, MisuseError, Outcome, Property, Subject, Verdict, judge_case
from contactverif.contract.counterexample import Origin, counterexamples
from contactverif.contract.property import Measurement, Quantity
from contactverif.contract.result import NotLoaded, Result, Row, Run
from contactverif.contract.traits import Traits
from contactverif.run.run import run
from contactverif.run.run_options import PROFILES
from contactverif.run.scheduler import Progress

ERROR = Quantity("error", "1e-6", "a number for a test")


def a_case(size: int, name: str = "") -> Case:
    """Return a case with `size` segments a side; the formulations here look at nothing else."""
    x = np.arange(size + 1.0)
    sides = [np.column_stack([x, 0 * x]), np.column_stack([x[::-1], 0 * x])]
    interface = Interface.from_chains(*sides)
    return Case(interface, interface.nodes.ravel(), name=name)


def sizes(most: int = 60) -> st.SearchStrategy[Case]:
    return st.integers(1, most).map(a_case)


def measure_residual(case: Case, subject: Subject) -> Measurement:
    """Measure the residual, which should be 0."""
    formulation = subject.for_case(case)
    pairing = formulation.pair(case.interface, case.z)
    forces = formulation.residual(case.interface, pairing, case.z)
    return Measurement([ERROR.check(float(np.abs(forces).max()), 1e-6)])


def list_sizes(*numbers: int) -> Property:
    """Return the property on a finite list of cases of these sizes."""
    return replace(ZERO, cases=lambda _: tuple(a_case(size, f"size {size}") for size in numbers))


ZERO = Property(
    "patch.zero",
    "patch",
    "No force.",
    (ERROR,),
    lambda _: sizes(),
    measure_residual,
    lambda traits: traits.promises.patch.flat,
)


class Plugin:
    """Its residual is what a function of the number of slave segments says, 0 if it says nothing."""

    def __init__(self, answer: Callable[[int], Any] = lambda size: 0.0, traits: Traits | None = None) -> None:
        self.answer = answer
        self.traits = traits or Traits()

    def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
        return self.answer(len(interface.slave)) + 0 * z


def subject(answer: Callable[[int], Any] = lambda size: 0.0, **traits: Any) -> Subject:
    return Subject("mine", lambda *, penalty: Plugin(answer, Traits().revise(**traits)))


def from_size(least: int, error: float = 1.0) -> Callable[[int], float]:
    return lambda size: error if size >= least else 0.0


def raising_from(least: int) -> Callable[[int], float]:
    def answer(size: int) -> float:
        if size >= least:
            raise IndexError(f"segment {least}")
        return 0.0

    return answer


def one_row(formulation: Subject, question: Property = ZERO, **options: Any) -> Row:
    [row] = run([formulation], [question], **{"examples": 40, "seed": 1, **options}).rows
    return row


def segments(outcome: Outcome | None) -> int:
    assert outcome is not None
    return len(outcome.case.interface.slave)


@pytest.fixture
def witnesses(monkeypatch: pytest.MonkeyPatch) -> None:
    def find_case(name: str) -> Case:
        if name != "C":
            raise MisuseError("case", repr(name), "C")
        return a_case(7, "C")

    monkeypatch.setattr("contactverif.run.rows.named_case", find_case)


def test_as_many_different_cases_are_judged_as_asked() -> None:
    penalties = st.integers(1, 10**6).map(float)
    question = replace(ZERO, cases=lambda _: penalties.map(lambda penalty: replace(a_case(1), penalty=penalty)))
    row = one_row(subject(), question, examples=150)
    assert (row.verdict, row.planned, row.judged) == (Verdict.PASS, 150, 150)
    assert len({outcome.summary.penalty for outcome in row.outcomes}) == 150
    assert not row.unexpected
    assert row.shrunk is None


def test_all_of_few_cases_and_of_a_finite_list_are_judged() -> None:
    row = one_row(subject(), replace(ZERO, cases=lambda _: sizes(5)), examples=100)
    assert (row.verdict, row.planned) == (Verdict.PASS, 5)
    assert sorted(map(segments, row.outcomes)) == [1, 2, 3, 4, 5]
    for examples in (1, 100):
        row = one_row(subject(), list_sizes(3, 1, 2), examples=examples)
        assert (row.verdict, row.planned, row.judged) == (Verdict.PASS, 3, 3)
        assert [outcome.case.name for outcome in row.outcomes] == ["size 3", "size 1", "size 2"]


@pytest.mark.parametrize(
    ("kinds", "counts"),
    [
        ({"small": (1, 61), "large": (9, 69), "long": (30, 90)}, {"small": 7, "large": 7, "long": 6}),
        ({"few": (1, 3), "many": (1, 60)}, {"few": 3, "many": 10}),
    ],
)
def test_kinds_share_the_cases_and_one_with_few_gives_all(
    kinds: dict[str, tuple[int, int]], counts: dict[str, int]
) -> None:
    strategies = {name: st.integers(*bounds).map(a_case) for name, bounds in kinds.items()}
    row = one_row(subject(), replace(ZERO, cases=lambda _: strategies, kinds=tuple(kinds)), examples=20)
    assert {kind: each.cases for kind, each in row.tally.kinds.items()} == counts
    assert (row.verdict, row.planned, row.judged) == (Verdict.PASS, sum(counts.values()), sum(counts.values()))


def test_a_case_of_a_kind_shrinks_to_one_of_its_kind() -> None:
    kinds = {"small": st.integers(1, 60).map(a_case), "large": st.integers(100, 160).map(a_case)}
    row = one_row(subject(from_size(90)), replace(ZERO, cases=lambda _: kinds), examples=20)
    assert row.shrunk is not None
    assert (row.shrunk.case.kind, row.shrunk.summary.n_slave_segments) == ("large", 100)


def test_the_case_of_a_finite_list_that_fails_is_called_by_its_name_and_not_shrunk() -> None:
    row = one_row(subject(from_size(2)), list_sizes(3, 1, 2))
    assert (row.verdict, row.failing_names) == (Verdict.FAIL, ("size 3", "size 2"))
    assert row.reason == "size 3: error 1, at most 1e-06"
    assert (row.shrunk, row.first) == (None, row.outcomes[0])
    assert row.closest_name == "size 3"


def test_cases_that_could_not_be_made_count_as_not_judged() -> None:
    question = replace(ZERO, cases=lambda _: st.integers(0, 10**9).filter(lambda size: size < 0).map(a_case))
    row = one_row(subject(), question, examples=100)
    assert (row.verdict, row.planned, row.judged) == (Verdict.NOT_JUDGED, 100, 0)
    assert row.reason == "0 of 100 cases judged; no more cases could be made"


def crash_if_large(size: int) -> float:
    if size > 3:
        raise IndexError("too many")
    return 0.0


@pytest.mark.parametrize("answer", [crash_if_large, lambda size: np.nan if size > 3 else 0.0], ids=["crash", "nan"])
def test_the_most_telling_failure_is_shrunk_also_if_it_crashes(answer: Callable[[int], float]) -> None:
    (row,) = run([subject(answer)], [ZERO], examples=30, seed=1, shrink="one").rows
    assert row.shrunk is not None
    assert len(row.shrunk.case.interface.slave) == 4


def test_all_planned_cases_are_judged_before_one_is_shrunk() -> None:
    log: list[Progress] = []
    row = one_row(subject(from_size(3)), progress=log.append)
    phases = ("first call (compiles)", "drawing", "judging", "shrinking", "diagnosis")
    assert [step.phase for step in log] == sorted((step.phase for step in log), key=phases.index)
    judging = [step for step in log if step.phase == "judging" and step.row is None]
    assert [(step.count, step.planned) for step in judging] == [(count, 40) for count in range(41)]
    assert {(step.formulation, step.property_id) for step in judging} == {("mine", "patch.zero")}
    assert sum(outcome.verdict is Verdict.FAIL for outcome in row.outcomes) > 20


def fails_grossly_later(size: int) -> float:
    """Fail by a hair from one segment on, clearly from ten, grossly from forty."""
    return 1.001e-6 + (1e-2 if size >= 10 else 0) + (1e2 if size >= 40 else 0)


def crashes_late(size: int) -> float:
    return raising_from(20)(size) + from_size(2)(size)


@pytest.mark.parametrize(
    ("answer", "size", "verdict", "reason"),
    [
        (from_size(5), 5, Verdict.FAIL, "error 1, at most 1e-06"),
        (fails_grossly_later, 10, Verdict.FAIL, "error 0.01, at most 1e-06"),
        (crashes_late, 20, Verdict.CRASHED, "exception: residual: IndexError: segment 20"),
        (lambda size: np.nan if size >= 30 else 1e9, 30, Verdict.FAIL, "not finite"),
    ],
)
def test_the_smallest_case_is_a_clear_one_of_the_worst_kind(
    answer: Callable[[int], float], size: int, verdict: Verdict, reason: str
) -> None:
    row = one_row(subject(answer))
    assert (row.verdict, row.planned, row.judged) == (verdict, 40, 40)
    assert row.shrunk is not None
    assert (row.shrunk.verdict, segments(row.shrunk)) == (verdict, size)
    assert row.shrunk.reason.startswith(reason)
    assert row.reason.startswith(reason.partition(" ")[0])


def test_the_same_seed_gives_the_same_rows() -> None:
    def facts(row: Row) -> Any:
        return [(segments(outcome), outcome.verdict) for outcome in (*row.outcomes, row.shrunk) if outcome]

    assert facts(one_row(subject(from_size(5)))) == facts(one_row(subject(from_size(5))))
    assert facts(one_row(subject(from_size(5)), seed=2)) != facts(one_row(subject(from_size(5))))


def test_cases_depend_neither_on_the_formulation_nor_on_what_else_is_asked() -> None:
    other = replace(ZERO, id="patch.other", cases=lambda _: sizes(50))
    alone = one_row(subject())
    among = run(
        [Subject("wrong", lambda *, penalty: Plugin(from_size(2))), subject()], [other, ZERO], examples=40, seed=1
    )
    for row in among.rows:
        if row.property_id == ZERO.id:
            assert [segments(outcome) for outcome in row.outcomes] == [segments(outcome) for outcome in alone.outcomes]


def test_cases_depend_on_no_loaded_module_and_nothing_is_written(tmp_path: Path) -> None:
    """Hypothesis draws constants from the source of loaded modules, and caches them in `.hypothesis`."""
    (tmp_path / "of_a_user.py").write_text("\n".join(f"a{n} = {1000 + 17 * n}" for n in range(400)))
    script = (
        "import sys\n"
        "if sys.argv[1] == 'with': import of_a_user\n"
        "from hypothesis import strategies as st\n"
        "from contactverif.sampling.draw import draw_block\n"
        "strategy = st.lists(st.one_of(st.integers(1000, 8000), st.floats(0, 1)), max_size=9)\n"
        "print(draw_block(strategy, seed='1', examples=200, number=0).cases)\n"
    )

    def output(argument: str, hash_seed: str) -> str:
        environment = {**os.environ, "PYTHONPATH": str(tmp_path), "PYTHONHASHSEED": hash_seed, "CI": argument}
        command = [sys.executable, "-c", script, argument]
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True).stdout

    assert output("with", "1") == output("without", "2")
    assert not (tmp_path / ".hypothesis").exists()


def test_hypothesis_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    one_row(subject(from_size(5)))
    one_row(subject(raising_from(5)))
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("error", "beginning"), [(MemoryError("full"), "memory"), (SystemExit(3), "exit: residual: SystemExit: 3")]
)
def test_how_it_crashed_is_said(error: BaseException, beginning: str) -> None:
    def answer(size: int) -> float:
        raise error

    outcome = judge_as(Verdict.CRASHED, ZERO, a_case(1), subject(answer))
    assert outcome.reason.startswith(beginning)


@pytest.mark.parametrize("promise", [True, False, None])
@pytest.mark.parametrize(
    ("answer", "verdict", "reason", "unexpected"),
    [
        (raising_from(6), Verdict.CRASHED,
         r"exception: residual: IndexError: segment 6 \(test_run\.py, line \d+\)", "crashed"),
        (lambda size: np.nan if size >= 6 else 0.0, Verdict.FAIL,
         "not finite: residual: nan in .*", "breaks the contract"),
        (lambda size: np.zeros((2, 1)) if size >= 6 else 0.0, Verdict.FAIL,
         "breaks the contract: residual: returned shape .*", "breaks the contract"),
    ],
)  # fmt: skip
@pytest.mark.usefixtures("witnesses")
def test_a_crash_or_a_breach_of_the_contract_fails_the_run_whatever_was_promised(
    promise: bool | None, answer: Callable[[int], Any], verdict: Verdict, reason: str, unexpected: str
) -> None:
    row = one_row(subject(answer, flat=promise, witnesses={"patch.zero": "C"}))
    assert (row.verdict, row.judged, row.unexpected, segments(row.shrunk)) == (verdict, 40, unexpected, 6)
    assert re.fullmatch(reason, row.reason)


def test_warnings_of_numpy_are_no_crash() -> None:
    """They are errors in many a test suite (this one), and only printed on the command line."""
    row = one_row(subject(lambda size: 0.0 if np.isnan(np.float64(0) / np.float64(0)) else 1.0))
    assert row.verdict is Verdict.PASS


def test_a_plugin_that_answers_differently_each_time_still_gives_a_case() -> None:
    calls = iter(range(10**9))
    row = one_row(subject(lambda size: 1.0 if next(calls) % 7 == 6 else 0.0))
    assert row.verdict is Verdict.FAIL
    example = row.shrunk or row.first
    assert example is not None
    assert example.verdict is Verdict.FAIL


@pytest.mark.parametrize(
    ("least", "verdict", "unexpected"),
    [
        (2, Verdict.FAIL, ""),  # random cases and the witness fail
        (7, Verdict.FAIL, ""),
        (8, Verdict.FAIL, ""),  # the witness passes, random cases fail
        (10**6, Verdict.PASS, "stated to fail, but passes"),
    ],
)
@pytest.mark.usefixtures("witnesses")
def test_a_promise_to_fail_is_broken_when_nothing_fails(least: int, verdict: Verdict, unexpected: str) -> None:
    row = one_row(subject(from_size(least), flat=False, witnesses={"patch.zero": "C"}))
    assert (row.verdict, row.unexpected) == (verdict, unexpected)
    assert row.witness is not None
    assert row.witness.case.name == "C"
    assert row.witness.verdict is (Verdict.FAIL if least <= 7 else Verdict.PASS)
    assert (row.planned, row.judged) == (40, 40)


def test_a_case_of_a_finite_list_is_a_witness_by_its_name_and_is_judged_once() -> None:
    row = one_row(subject(from_size(2), flat=False, witnesses={"patch.zero": "size 2"}), list_sizes(1, 2, 3))
    assert (row.verdict, row.unexpected) == (Verdict.FAIL, "")
    assert row.witness is row.outcomes[1]


@pytest.mark.parametrize(
    ("least", "shrink", "size", "origin"),
    [
        (5, "new", 7, Origin.WITNESS),
        (5, "none", 7, Origin.WITNESS),
        (8, "new", 59, Origin.FIRST),  # The witness passes.
        (5, "all", 5, Origin.SHRUNK),
    ],
)
@pytest.mark.usefixtures("witnesses")
def test_a_stated_failure_is_shrunk_only_when_that_is_wanted(
    least: int, shrink: str, size: int, origin: Origin
) -> None:
    formulation = subject(from_size(least), flat=False, witnesses={"patch.zero": "C"})
    [example] = counterexamples(run([formulation], [ZERO], examples=40, seed=1, shrink=shrink)).values()  # type: ignore[arg-type]
    assert (segments(example.outcome), example.origin) == (size, origin)
    assert ("smallest" in example.label) is (origin is Origin.SHRUNK)


def test_what_the_caller_knows_is_not_shrunk_and_what_nobody_stated_is() -> None:
    known, news = one_row(subject(from_size(5)), known={"patch.zero": "issue 12"}), one_row(subject(from_size(5)))
    assert (known.shrunk, segments(news.shrunk)) == (None, 5)
    assert known.first is next(outcome for outcome in known.outcomes if outcome.verdict is Verdict.FAIL)
    assert one_row(subject(from_size(5)), shrink="none").shrunk is None


@pytest.mark.usefixtures("witnesses")
def test_a_failure_of_the_witness_alone_keeps_the_promise_and_is_not_shrunk() -> None:
    question = replace(ZERO, cases=lambda _: sizes(5))
    row = one_row(subject(from_size(6), flat=False, witnesses={"patch.zero": "C"}), question)
    assert (row.verdict, row.unexpected, row.reason) == (Verdict.FAIL, "", "error 1, at most 1e-06")
    assert row.shrunk is None


@pytest.mark.parametrize(
    ("named", "reason"),
    [
        ({}, "traits: witnesses: found none for patch.zero"),
        ({"patch.zero": "D"}, "traits: witness of patch.zero: found 'D'"),
    ],
)
@pytest.mark.usefixtures("witnesses")
def test_a_promise_to_fail_needs_a_witness(named: dict[str, str], reason: str) -> None:
    row = one_row(subject(from_size(2), flat=False, witnesses=named))
    assert (row.verdict, row.result, row.unexpected) == (Verdict.CRASHED, Result.WRONG_TRAITS, "wrong traits")
    assert row.reason.startswith(reason)


@pytest.mark.usefixtures("witnesses")
def test_only_a_promise_to_fail_has_a_witness_and_only_a_broken_promise_fails_the_run() -> None:
    assert one_row(subject(flat=True, witnesses={"patch.zero": "C"})).witness is None
    assert one_row(subject(from_size(5), flat=True)).unexpected == "promised to pass, but fails"
    assert one_row(subject(from_size(5))).unexpected == ""


@pytest.mark.parametrize(
    ("undecided", "examples", "verdict"),
    [
        (10, 100, Verdict.PASS),
        (11, 100, Verdict.NOT_JUDGED),
        (1, 5, Verdict.PASS),  # One of a few random ones may be a kink.
        (2, 5, Verdict.NOT_JUDGED),
        (1, 1, Verdict.NOT_JUDGED),
    ],
)
def test_a_property_is_judged_with_nine_tenths_of_its_cases(undecided: int, examples: int, verdict: Verdict) -> None:
    def sometimes(case: Case, subject: Subject) -> Measurement:
        return Measurement([ERROR.check(1.0 * (case.seed <= undecided), 0.5)], "a kink")

    question = replace(
        ZERO,
        cases=lambda _: st.integers(1, examples).map(lambda seed: replace(a_case(1), seed=seed)),
        measure=sometimes,
    )
    if verdict is Verdict.NOT_JUDGED:  # Where nothing is promised, nothing can be kept or broken.
        stranger = one_row(subject(), question, examples=examples)
        assert (stranger.verdict, stranger.unexpected) == (Verdict.UNDECIDED, "")
    row = one_row(subject(flat=True), question, examples=examples)
    assert (row.planned, row.judged, row.verdict) == (examples, examples - undecided, verdict)
    assert row.unexpected == ("not judged" if verdict is Verdict.NOT_JUDGED else "")
    if verdict is Verdict.NOT_JUDGED:
        assert row.reason == f"{examples - undecided} of {examples} cases judged; most often because a kink"


@pytest.mark.parametrize(
    ("changes", "verdict", "reason", "unexpected"),
    [
        ({"applicable": lambda traits: "no such thing"}, Verdict.NOT_APPLICABLE, "no such thing", ""),
        (
            {"cases": lambda _: None},
            Verdict.NOT_APPLICABLE,
            "needs meshes with a known answer",
            "",
        ),
        (
            {"needs": frozenset({"tangent", "pair"})},
            Verdict.NOT_PROVIDED,
            "pair, tangent: not provided",
            "promised to pass, but a part that it needs is not provided",
        ),
        ({"needs": frozenset({"contact_points"})}, Verdict.NOT_PROVIDED, "contact_points: not provided", ""),
    ],
)
@pytest.mark.parametrize("promise", [True, None])
def test_what_cannot_be_asked_is_a_row_without_cases(
    changes: dict[str, Any], verdict: Verdict, reason: str, unexpected: str, promise: bool | None
) -> None:
    """Only of a missing tangent a trait speaks, so that a promise about it is broken."""
    row = one_row(subject(flat=promise), replace(ZERO, **changes))
    assert (row.verdict, row.reason, row.planned, row.outcomes) == (verdict, reason, 0, ())
    assert row.unexpected == (unexpected if promise else "")
    assert row.promise is (None if "contact_points" in reason else promise)


def test_the_given_interface_reaches_the_strategy() -> None:
    interface = a_case(4).interface
    question = replace(ZERO, cases=lambda argument: sizes(3) if argument is interface else None)
    assert one_row(subject(), question, place=interface).planned == 3


@pytest.mark.usefixtures("witnesses")
@pytest.mark.parametrize(
    ("first", "verdict", "result", "promise"),
    [(5, Verdict.FAIL, "fails as stated", False), (99, Verdict.PASS, "pass", None)],
)
def test_on_a_place_every_number_is_of_that_place(
    first: int, verdict: Verdict, result: str, promise: bool | None
) -> None:
    """A formulation states that it fails on its witness, not on the mesh of the user."""
    row = one_row(subject(from_size(first), flat=False, witnesses={"patch.zero": "C"}), place=a_case(4).interface)
    assert (row.verdict, row.result, row.promise, row.witness) == (verdict, result, promise, None)
    assert row.closest is not None
    assert row.closest.case is not None


def test_a_known_failure_is_expected_and_a_known_pass_is_not() -> None:
    known = {"patch.zero": "issue 12"}
    fails = one_row(subject(from_size(5), flat=True), known=known)
    assert (fails.verdict, fails.known, fails.unexpected) == (Verdict.FAIL, "issue 12", "")
    assert one_row(subject(raising_from(5)), known=known).unexpected == ""
    assert one_row(subject(lambda size: np.nan), known=known).unexpected == ""
    assert one_row(subject(), known=known).unexpected == "listed as a known failure, but passes"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"profile": "nightl"}, r"profile: found 'nightl'; .* nearest: nightly"),
        ({"examples": 0}, "examples: found 0; needed at least 1, at most 1000000000"),
        ({"seed": -1}, "seed: found -1"),
        ({"shrink": "some"}, "shrink: found 'some'; needed one, new, all or none"),
        ({"known": {"patch.zeros": "issue 12"}}, r"known failure: found 'patch.zeros'; .* nearest: patch.zero"),
        ({"question": list_sizes(1, 1)}, "cases: found 2 times 'size 1'"),
        ({"question": replace(ZERO, cases=lambda _: (a_case(1),))}, "cases: found a case without a name"),
    ],
)
def test_impossible_requests_are_said(options: dict[str, Any], message: str) -> None:
    with pytest.raises(MisuseError, match=message):
        one_row(subject(), **options)


@pytest.mark.parametrize(
    ("times", "message"), [((2, 1), "formulation: found mine 2 times"), ((1, 2), "property: found patch.zero 2 times")]
)
def test_nothing_is_asked_twice(times: tuple[int, int], message: str) -> None:
    with pytest.raises(MisuseError, match=message):
        run([subject()] * times[0], [ZERO] * times[1])


def test_what_did_not_load_fails_the_run_and_the_others_run() -> None:
    not_loaded = [NotLoaded("other", "ImportError: x"), NotLoaded("patch.other", "ImportError: y")]
    result = run([not_loaded[0], subject()], [ZERO, not_loaded[1]], examples=5, seed=1, known={"patch.other": "lost"})
    assert [row.formulation for row in result.rows] == ["mine"]
    assert result.not_loaded == tuple(not_loaded)
    assert not result.promises_kept
    assert run([subject()], [ZERO], examples=5, seed=1).promises_kept


def test_a_run_knows_what_is_provided_and_where_it_comes_from() -> None:
    result = run([subject()], [ZERO], profile="ci", examples=5)
    assert result.provided == {"mine": {"pair": False, "tangent": False, "contact_points": False}}
    facts = result.provenance
    assert (facts["profile"], facts["examples"], facts["seed"]) == ("ci", "5", "0")
    assert facts["numpy_version"] == np.__version__
    kernels = {entry["architecture"] for entry in threadpool_info() if entry.get("architecture")}
    assert all(kernel in facts["blas"] for kernel in kernels)
    assert set(np.show_config(mode="dicts")["SIMD Extensions"]["found"]) <= set(facts["cpu_features"].split())
    needed = "commit platform created command python_version contactverif_version blas cpu_features"
    assert facts.keys() >= set(needed.split())
    assert all(isinstance(value, str) and value for value in facts.values())


def test_a_fresh_seed_can_be_given_again() -> None:
    def answer(result: Run) -> Any:
        return result.provenance["seed"], [segments(outcome) for outcome in result.rows[0].outcomes]

    first = answer(run([subject()], [ZERO], examples=20))
    assert answer(run([subject()], [ZERO], examples=20, seed=int(first[0]))) == first
    assert answer(run([subject()], [ZERO], examples=20)) != first


def test_profiles() -> None:
    sizes_and_kinds = {name: (profile.examples, profile.seed is not None) for name, profile in PROFILES.items()}
    assert sizes_and_kinds == {"dev": (100, False), "ci": (100, True), "nightly": (2000, False)}
    assert PROFILES["ci"].resolve().seed == 0


@pytest.mark.parametrize("largest", [0.0, 1.0])
def test_a_property_that_raises_is_not_judged_whatever_else_it_finds(largest: float) -> None:
    """A failure that is stated would let the mistake of the property pass."""

    def mistaken(case: Case, subject: Subject) -> Measurement:
        if len(case.interface.slave) == 1:
            raise ZeroDivisionError("in a property")
        return Measurement([ERROR.check(largest, 0.5)])

    row = one_row(subject(), replace(ZERO, measure=mistaken, cases=lambda _: sizes(2)))
    assert row.verdict is Verdict.NOT_JUDGED
    assert row.reason.startswith("the property raised ZeroDivisionError: in a property (test_run.py, line ")
    assert row.unexpected


def test_a_property_that_raises_while_its_failure_is_shrunk_has_failed() -> None:
    failed = False

    def mistaken(case: Case, subject: Subject) -> Measurement:
        nonlocal failed
        if failed:
            raise ZeroDivisionError("in a property")
        failed = len(case.interface.slave) > 1
        return Measurement([ERROR.check(float(failed), 0.5)])

    assert one_row(subject(), replace(ZERO, measure=mistaken, cases=lambda _: sizes(2))).verdict is Verdict.FAIL


@pytest.mark.parametrize("call", [3, 45])
def test_an_interrupt_comes_through(call: int) -> None:
    """In the judging (of 40 cases) and in the shrinking."""
    calls = iter(range(1, 10**6))

    def interrupt(size: int) -> float:
        if next(calls) == call:
            raise KeyboardInterrupt
        return 1.0 if size >= 20 else 0.0

    with pytest.raises(KeyboardInterrupt):
        one_row(subject(interrupt))


def test_a_stored_case_is_judged_again() -> None:
    row = one_row(subject(from_size(5)))
    assert row.shrunk is not None
    again = judge_case(ZERO, Case.from_arrays(row.shrunk.case.to_arrays()), subject(from_size(5)))
    assert (again.verdict, again.reason, again.measurement) == (Verdict.FAIL, row.shrunk.reason, row.shrunk.measurement)


def test_a_run_says_where_the_engine_of_hypothesis_drew_all_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "drawing" not in run([subject()], [ZERO], examples=2, seed=1).provenance
    monkeypatch.setattr(
        "contactverif.sampling.hypothesis_draws.find_difference", lambda: "hypothesis 7 draws otherwise"
    )
    facts = run([subject()], [ZERO], examples=2, seed=1).provenance
    assert facts["drawing"] == "hypothesis 7 draws otherwise, so its engine drew all cases"
