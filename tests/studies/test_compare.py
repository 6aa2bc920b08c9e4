"""Side by side: margins, pairs and medians that can be counted by hand, and what is a regression and what is none."""

from dataclasses import replace
from math import inf, isnan, log, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from subjects import load_subject

from contactverif import Case, End, Interface, Subject, load_properties, load_scene, solve
from contactverif.cli.compare import regressions_text
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Measurement, Outcome, Property, Quantity, Verdict, judge
from contactverif.contract.result import NotLoaded, Row, Run
from contactverif.run.worker_pool import worker_pool
from contactverif.studies.comparison import make_state, measure_costs, run_comparison
from contactverif_properties.newton_method import newton_order, solution_details
from contactverif_reports.comparisons import CONVERGED, END, ITERATIONS, ORDER, Comparison, Pair, RowNumbers
from contactverif_reports.html.comparison_page import changes_page, comparison_page
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.netcdf.write import write
from contactverif_reports.regressions import (
    ALPHA,
    Changes,
    NamedRun,
    changes_table,
    compare_rows,
    few,
    shift,
    wandering,
)

ERROR = Quantity("force error", "u(8X/|g| + 4N)", "rounding")
SLOPE = Quantity("order of one Newton step", "1.9", "second order", sense="at least")
TOLERANCE = 2.0**-40  # A power of two, so that margins are exact.


def question(id_: str = "patch.flat.transmission", *quantities: Quantity) -> Property:
    return Property(
        id=id_,
        family=id_.partition(".")[0],
        summary="a question made by hand",
        quantities=quantities or (ERROR,),
        cases=lambda interface: None,
        measure=lambda case, subject: Measurement(),
        promise=lambda traits: None,
    )


def a_case(size: int) -> Case:
    x = np.arange(size + 1.0)
    interface = Interface.from_chains(np.column_stack([x, 0 * x]), np.column_stack([x[::-1], 0 * x]))
    return Case(interface, interface.nodes.ravel())


def outcome(margin: float | Verdict, size: int = 1, **details: float) -> Outcome:
    """Return the outcome of a case of `size` segments: a number of `margin` tolerances, or a verdict without one."""
    if isinstance(margin, Verdict):
        return Outcome(a_case(size), margin, "" if margin is Verdict.PASS else "made by hand", seconds=0.25)
    measurement = Measurement([ERROR.check(margin * TOLERANCE, TOLERANCE)], details=details)
    return Outcome(a_case(size), *judge(question(), measurement), measurement, seconds=0.25)


def row(
    formulation: str, *margins: float | Verdict, promise: bool | None = None, sizes: list[int] | None = None
) -> Row:
    sizes = sizes or [1] * len(margins)
    outcomes = tuple(outcome(margin, size) for margin, size in zip(margins, sizes, strict=True))
    verdicts = [item.verdict for item in outcomes]
    worst = next((bad for bad in (Verdict.CRASHED, Verdict.FAIL) if bad in verdicts), Verdict.PASS)
    return Row(formulation, question(), worst, promise, planned=len(outcomes), outcomes=outcomes, seconds=1.0)


OF_ROWS = {"formulation", "info", "verdict", "promise", "reason"}  # Attributes that a cell takes from its row.


KEY = ("vts-me", "patch.flat.transmission")


def cell(*margins: float | Verdict, **changes: Any) -> RowNumbers:
    return with_changes(RowNumbers.from_row(row("vts-me", *margins)), **changes)


def with_changes(old: RowNumbers, **changes: Any) -> RowNumbers:
    """Replace attributes of the cell or of its row."""
    row_changes = {name: value for name, value in changes.items() if name in OF_ROWS}
    others = {name: value for name, value in changes.items() if name not in OF_ROWS}
    return replace(old, row=replace(old.row, **row_changes), **others)


def failed_cell(prop: Property, measurement: Measurement) -> RowNumbers:
    outcomes = (Outcome(a_case(1), Verdict.FAIL, "made by hand", measurement),)
    return RowNumbers.from_row(Row("nts", prop, Verdict.FAIL, None, planned=1, outcomes=outcomes))


def test_a_margin_is_the_quantity_that_went_furthest() -> None:
    order = question("newton.order", ERROR, SLOPE)
    result = failed_cell(order, Measurement([ERROR.check(0.5, 1.0), SLOPE.check(0.95, 1.9)]))
    assert result.margins.tolist() == [2.0]  # 1.9 / 0.95, the quantity that must be at least its tolerance
    assert result.orders.tolist() == [0.95]


def test_medians_and_worst_are_over_what_was_decided() -> None:
    result = cell(0.5, 0.25, 8.0, 4.0, 0.125, Verdict.UNDECIDED, Verdict.PASS)
    assert (result.median, result.worst, result.row.judged) == (0.5, 8.0, 6)
    assert np.isnan(result.margins[[5, 6]]).all()
    assert result.standing[6] == 0.0  # it passes, without a number
    assert isnan(result.standing[5])


def test_a_failure_without_a_number_is_infinitely_far() -> None:
    assert cell(Verdict.CRASHED, Verdict.FAIL).margins.tolist() == [inf, inf]
    broken = Measurement([ERROR.check(0.0, TOLERANCE)], broken="changes its input")
    assert failed_cell(question(), broken).margins.tolist() == [inf]


def test_a_row_that_was_not_asked_is_an_empty_cell() -> None:
    result = RowNumbers.from_row(Row("nts", question(), Verdict.NOT_APPLICABLE, None, reason="no springs"))
    assert np.isnan([result.median, result.worst, result.seconds]).all()
    assert Pair.from_cells(result, result).n == 0


def test_pairs_are_counted_case_by_case() -> None:
    #                within  worse  better  both fail: near  worse  better  undecided        crash
    first = cell(0.25, 2.0, 0.5, 100.0, 100.0, 8.0, Verdict.UNDECIDED, Verdict.CRASHED)
    other = cell(0.75, 1.0, 2.0, 100.5, 10.0, 80.0, 4.0, Verdict.CRASHED)
    pairs = Pair.from_cells(first, other)
    assert (pairs.n, pairs.better, pairs.equal, pairs.worse) == (7, 2, 3, 2)
    assert pairs.apart.tolist() == [False, True, True, False, False, False, False, False]
    assert pairs.decades[[0, 3, 4, 5, 7]] == pytest.approx([0.0, np.log10(100 / 100.5), 1.0, -1.0, 0.0])
    assert isnan(pairs.decades[6])


@pytest.mark.parametrize(
    ("first", "other", "ratio"),
    [
        ((2.0, 8.0, 64.0), (1.0, 2.0, 8.0), 4.0),
        ((0.0, 0.0), (0.0, 0.0), 1.0),
        ((0.5,), (0.0,), 1.0),  # within the tolerance all is roundoff
        ((40.0,), (1e-6,), 40.0),
        ((Verdict.FAIL,), (0.5,), inf),
        ((Verdict.UNDECIDED,), (1.0,), np.nan),
    ],
)
def test_the_ratio_is_the_median_of_ratios_on_the_same_cases(first: Any, other: Any, ratio: float) -> None:
    assert Pair.from_cells(cell(*first), cell(*other)).ratio == pytest.approx(ratio, nan_ok=True)


def test_beyond_the_tolerance_one_tolerance_is_roundoff() -> None:
    pairs = Pair.from_cells(cell(100.0, 100.0, 100.0), cell(100.0, 101.0, 101.5))
    assert (pairs.better, pairs.equal, pairs.worse) == (1, 2, 0)


def test_the_mesh_to_draw_is_a_small_one_that_differs_much() -> None:
    kinds = np.zeros((4, 5))
    kinds[:, 0] = 40.0, 4.0, 2.0, 9.0  # Segments of the slave.
    reference = cell(1e12, 1e8, 10.0, 0.5, kinds=kinds)
    for margins, number in (
        ((0.5, 0.5, 0.5, 0.5), 1),  # Case 1 shows 8 of the 12 decades of case 0; the 1 decade of case 2 is too little.
        # One passes and the other does not: before those where both fail, however far.
        ((2.0, 2.0, 0.5, 0.5), 2),
    ):
        assert Pair.from_cells(reference, cell(*margins, kinds=kinds)).furthest() == number
    # Within the tolerance nothing differs.
    assert Pair.from_cells(cell(0.1, 0.9), cell(0.9, 0.1)).furthest() is None


def small_run() -> Run:
    rows = (
        row("vts-ppt", 0.5, 0.25, 0.125, promise=True, sizes=[3, 2, 1]),
        row("vts-me", 64.0, 0.25, 32.0, promise=True, sizes=[3, 2, 1]),
        row("nts", 0.5, 0.5, 0.5, sizes=[3, 2, 1]),
    )
    return Run(rows, (NotLoaded("mine", "no module"),), {}, {"seed": "1", "examples": "3", "profile": "dev"})


def test_a_comparison_puts_the_reference_first_and_not_on_trial() -> None:
    run = small_run()
    comparison = Comparison.from_run(run, "vts-me")
    assert comparison.formulations == ("vts-me", "vts-ppt", "nts")
    assert comparison.candidates.unexpected == ()  # vts-me promised to pass, but it is the reference
    assert not comparison.candidates.promises_kept  # `mine` did not load
    comparison = Comparison.from_run(run, "vts-ppt")
    assert [row.formulation for row in comparison.candidates.unexpected] == ["vts-me"]
    assert comparison.not_loaded == {"mine": "no module"}
    paired = comparison.pairs["vts-me", "patch.flat.transmission"]
    assert (paired.better, paired.equal, paired.worse) == (0, 1, 2)
    assert paired.ratio == pytest.approx(32.0)  # the median of 64, 1 (both within) and 32


def test_the_mesh_that_is_drawn_is_the_small_one() -> None:
    (differing,) = Comparison.from_run(small_run(), "vts-ppt").differing
    (name, outcome, margin), (_, _, reference_margin) = differing.sides
    assert (name, differing.number, differing.rank[0]) == ("vts-me", 2, True)
    assert len(outcome.case.interface.slave) == 1
    assert (margin, reference_margin) == (32.0, 0.125)


def test_iterations_are_counted_where_both_converged() -> None:
    solves = {  # iterations, end
        "vts-ppt": [(3, 0), (4, 0), (9, 5), (2, 0)],
        "vts-me": [(5, 0), (4, 0), (3, 0), (7, 1)],
    }
    outcomes = {
        name: tuple(outcome(0.5, iterations=float(n), end=float(end)) for n, end in pairs)
        for name, pairs in solves.items()
    }
    rows = (Row(name, question(), Verdict.PASS, None, planned=4, outcomes=each) for name, each in outcomes.items())
    first, other = Comparison.from_run(Run(tuple(rows)), "vts-ppt").iterations
    assert (first.formulation, first.converged, first.solved, first.median, first.most) == ("vts-ppt", 3, 4, 3.0, 4.0)
    assert (other.converged, other.median, other.most) == (3, 4.0, 5.0)
    assert (other.fewer, other.same, other.more) == (0, 1, 1)


def test_the_reference_is_no_candidate() -> None:
    subject, questions = load_subject("nts"), load_properties(["purity"])
    for candidates, words in (([subject], "--against: found nts, which is compared too"), ([], "NAME: found nothing")):
        with pytest.raises(MisuseError, match=words):
            run_comparison(subject, candidates, questions)


def test_all_are_asked_the_same_cases() -> None:
    subjects = [load_subject(name) for name in ("vts-ppt", "vts-me")]
    study = run_comparison(subjects[0], subjects[1:], load_properties(["patch.flat.transmission"]), examples=12, seed=1)
    ours, theirs = (result.outcomes for result in study.run.rows)
    assert [our.case for our in ours] == [their.case for their in theirs]
    (name, _, _), (_, outcome, _) = study.differing[0].sides
    assert (name, outcome.verdict) == ("vts-me", Verdict.PASS)


def test_two_processes_find_the_same_differences() -> None:
    subjects = [load_subject(name) for name in ("vts-ppt", "vts-me")]
    questions = load_properties(["patch.flat.transmission", "balance.force"])
    with worker_pool(2) as executor:
        shared = run_comparison(subjects[0], subjects[1:], questions, examples=30, seed=1, executor=executor)
    alone = run_comparison(subjects[0], subjects[1:], questions, examples=30, seed=1)
    for ours, theirs in zip(shared.differing, alone.differing, strict=True):
        assert (ours.info.id, ours.number, ours.rank) == (theirs.info.id, theirs.number, theirs.rank)
        for our, their in zip(ours.sides, theirs.sides, strict=True):
            assert (our[0], our[2]) == (their[0], their[2])
            np.testing.assert_array_equal(our[1].case.z, their[1].case.z)
    assert shared.comparison.pairs.keys() == alone.comparison.pairs.keys()
    for key, pair in shared.comparison.pairs.items():
        np.testing.assert_array_equal(pair.decades, alone.comparison.pairs[key].decades)


class Counting:
    """A plugin without pairing or tangent that counts how often it is called."""

    n_calls = 0

    def residual(self, interface: Interface, pairing: None, z: Any) -> Any:
        type(self).n_calls += 1
        return 0 * z


class Raising:
    def residual(self, interface: Interface, pairing: None, z: Any) -> Any:
        raise ZeroDivisionError("by hand")


def test_cost_is_of_what_is_provided_and_a_failure_has_none() -> None:
    subjects = [Subject("counting", lambda penalty: Counting()), Subject("raising", lambda penalty: Raising())]
    good, bad = measure_costs(subjects, [make_state(4)], turns=3)
    assert Counting.n_calls >= 4  # once to warm up
    assert good.n_segments == 4
    assert good.total == good.seconds["residual"] > 0
    assert np.isnan([good.seconds["pair"], good.seconds["tangent"]]).all()
    assert "by hand" in bad.failed
    assert isnan(bad.total)


def test_the_shared_state_is_in_contact_everywhere() -> None:
    case = make_state(16)
    assert (len(case.interface.slave), len(case.interface.master)) == (16, 12)
    assert (case.positions[: case.interface.n_slave_nodes, 1] < 0).all()
    subject = load_subject("vts-ppt")
    formulation = subject.for_case(case)
    assert formulation.contact_points(case.interface, formulation.pair(case.interface, case.z), case.z).active.all()


def test_the_same_again_is_no_regression() -> None:
    same = cell(0.5, 1e12, Verdict.CRASHED, Verdict.UNDECIDED)
    change = compare_rows(same, replace(same, seconds=100 * same.seconds), same_seed=True)
    assert change.same_cases
    assert (change.slower, change.regressions) == (pytest.approx(100.0), ())


@pytest.mark.parametrize(
    ("old", "new", "regressions"),
    [
        (Verdict.PASS, Verdict.FAIL, ["pass → fail"]),
        (Verdict.PASS, Verdict.CRASHED, ["pass → crashed"]),
        (Verdict.PASS, Verdict.NOT_JUDGED, ["pass → not judged"]),
        (Verdict.PASS, Verdict.NOT_PROVIDED, ["pass → not provided"]),
        (Verdict.PASS, Verdict.NOT_APPLICABLE, ["pass → not applicable"]),
        (Verdict.FAIL, Verdict.CRASHED, ["fail → crashed"]),
        (Verdict.CRASHED, Verdict.FAIL, []),
        (Verdict.FAIL, Verdict.PASS, []),
        (Verdict.NOT_JUDGED, Verdict.FAIL, []),  # it failed the run before, too
        (Verdict.NOT_APPLICABLE, Verdict.FAIL, []),  # it was not asked before
    ],
)
def test_a_verdict_that_got_worse(old: Verdict, new: Verdict, regressions: list[str]) -> None:
    change = compare_rows(cell(verdict=old), cell(verdict=new), same_seed=True)
    assert list(change.regressions) == regressions
    ((_, result, *_),) = next(iter(changes_table([change]).groups.values()))
    assert result.style == ("red" if regressions else "green" if new is Verdict.PASS else "")


def test_a_promise_that_is_not_kept_any_more() -> None:
    old, new = cell(0.5, promise=None), cell(0.5, promise=False)
    assert compare_rows(old, new, same_seed=True).regressions == ("promises kept → stated to fail, but passes",)
    assert compare_rows(new, new, same_seed=True).regressions == ()


@pytest.mark.parametrize(
    ("old", "new", "grew"),
    [
        ((0.01,), (0.99,), False),  # within the tolerance, whatever the factor
        ((0.0,), (2.0,), False),  # two tolerances, one for each report
        ((0.0,), (2.0 + 2**-40,), True),
        ((100.0,), (202.0,), False),  # and a factor of two
        ((100.0,), (202.0 + 2**-40,), True),
        ((1.22e11,), (1.29e11,), False),  # as seen where one residual was ±1 ulp off the other
        ((100.0, 100.0, 100.0), (100.0, 100.0, 203.0), True),  # the worst alone
        ((2.0, 2.0, 900.0), (7.0, 7.0, 900.0), True),  # the median alone
        ((100.0,), (Verdict.CRASHED,), True),
        ((Verdict.CRASHED,), (100.0,), False),
    ],
)
def test_an_error_more_than_doubles_and_two_tolerances(old: tuple[Any, ...], new: tuple[Any, ...], grew: bool) -> None:
    before, after = (cell(*margins, verdict=Verdict.FAIL) for margins in (old, new))
    regressions = compare_rows(before, after, same_seed=True).regressions
    growth = [words for words in regressions if "passed and fail now" not in words]
    assert bool(growth) is grew
    assert all(words.startswith("error grew, in tolerances, on the same") for words in growth)


def test_a_case_that_passed_and_fails_is_named_in_a_row_that_failed_already() -> None:
    change = compare_rows(cell(0.5, 0.5, 64.0), cell(0.5, 2.0, 64.0), same_seed=True)
    assert change.regressions == ("1 of 3 cases passed and fail now, the first is case 1",)


@pytest.mark.parametrize("n", [60, 500])
def test_cases_that_were_judged_and_are_undecided_now(n: int) -> None:
    old, some = cell(*[0.5] * n), int(few(n))
    assert some == {60: 1, 500: 5}[n]
    for n_undecided, regressed in ((some, False), (some + 1, True)):
        new = cell(*[Verdict.UNDECIDED] * n_undecided, *[0.5] * (n - n_undecided))
        lines = (f"{n_undecided} of the same {n} cases were judged and are undecided now",) * regressed
        assert compare_rows(old, new, same_seed=True).regressions == lines
        assert compare_rows(new, old, same_seed=True).regressions == ()
    back = cell(*[Verdict.UNDECIDED] * 2, *[0.5] * (n - 2))
    other = cell(0.5, 0.5, *[Verdict.UNDECIDED] * (some + 2), *[0.5] * (n - some - 4))
    assert compare_rows(back, other, same_seed=True).regressions == ()  # noise goes both ways
    other = cell(0.5, 0.5, *[Verdict.UNDECIDED] * (some + 3), *[0.5] * (n - some - 5))
    (line,) = compare_rows(back, other, same_seed=True).regressions
    assert line.endswith("undecided now, 2 the other way round")


@pytest.mark.parametrize(("left", "regressed"), [(60, False), (59, False), (58, True), (3, True), (0, True)])
def test_fewer_cases_at_the_same_seed_and_number_of_examples(left: int, regressed: bool) -> None:
    old, new = cell(*[0.5] * 60), cell(*[0.5] * left)
    lines = (f"{left} cases, 60 before, at the same seed and number of examples",) * regressed
    assert compare_rows(old, new, same_seed=True).regressions == lines
    assert compare_rows(new, old, same_seed=True).regressions == ()
    assert compare_rows(old, new, same_seed=True, same_examples=False).regressions == ()
    assert compare_rows(old, new, same_seed=False).regressions == ()


def test_fewer_examples_are_no_fewer_cases() -> None:
    old, new = named_run({KEY: cell(*[0.5] * 60)}), named_run({KEY: cell(0.5, 0.5, 0.5)})
    assert len(Changes.between(old, new).regressions) == 1  # neither says how many were asked
    reports = [
        replace(report, run=replace(report.run, provenance={"seed": "1", "examples": n}))
        for report, n in ((old, "60"), (new, "3"))
    ]
    assert Changes.between(*reports).regressions == ()


def solved_cell(ends: list[End], iterations: float = 3.0, suffix: str = "") -> RowNumbers:
    numbers = {"end": np.array([float(end) for end in ends]), "iterations": np.full(len(ends), iterations)}
    return cell(*[0.5] * len(ends), details={f"{name}{suffix}": values for name, values in numbers.items()})


@pytest.mark.parametrize("end", [end for end in End if end is not End.CONVERGED])
@pytest.mark.parametrize("suffix", ["", ", high penalty"])
def test_solutions_that_converged_and_do_not_any_more(end: End, suffix: str) -> None:
    n, some = 60, int(wandering(60))
    assert some == 5
    old = solved_cell([End.CONVERGED] * n, suffix=suffix)
    for n_other, regressed in ((some, False), (some + 1, True)):
        new = solved_cell([end] * n_other + [End.CONVERGED] * (n - n_other), suffix=suffix)
        kind = f"{n} solutions{' (high penalty)' if suffix else ''}"
        lines = (f"{n_other} of the same {kind} converged and do not any more",) * regressed
        assert compare_rows(old, new, same_seed=True).regressions == lines
        assert compare_rows(new, old, same_seed=True).regressions == ()


def test_roundoff_takes_solutions_both_ways_and_one_that_was_not_kept_says_nothing() -> None:
    good, bad = End.CONVERGED, End.CYCLE
    old = solved_cell([bad] * 20 + [good] * 40)
    assert compare_rows(old, solved_cell([good] * 20 + [bad] * 25 + [good] * 15), same_seed=True).regressions == ()
    (line,) = compare_rows(old, solved_cell([good] * 20 + [bad] * 26 + [good] * 14), same_seed=True).regressions
    assert line == "26 of the same 60 solutions converged and do not any more, 20 the other way round"
    unknown = replace(old, details={"end": np.full(60, np.nan)})
    assert compare_rows(old, unknown, same_seed=True).regressions == ()
    assert compare_rows(old, replace(old, details={}), same_seed=True).regressions == ()


@pytest.mark.parametrize(
    ("old", "new", "statistics"),
    [
        ((1e-6,), (0.5,), ["median", "worst"]),
        ((0.5, 1e-4, 1e-4), (0.5, 0.2, 0.2), ["median"]),
        ((1e-6,), (0.1,), []),  # no more than a few roundoffs
        ((1e-6,), (0.11,), ["median", "worst"]),
        ((2.0**-8,), (0.39,), []),  # not more than 100-fold
        ((2.0**-8,), (0.3907,), ["median", "worst"]),
        ((0.5,), (1e-6,), []),
        ((1e-6,), (64.0,), []),  # that is no look but a regression
    ],
)
def test_an_error_that_leaps_within_its_tolerance_is_worth_a_look(
    old: tuple[float, ...], new: tuple[float, ...], statistics: list[str]
) -> None:
    change = compare_rows(cell(*old), cell(*new), same_seed=True)
    assert [words.partition(" ")[0] for words in change.noteworthy] == statistics
    assert bool(change.regressions) is (new == (64.0,))


@pytest.mark.parametrize(("iterations", "noteworthy"), [(8.0, False), (8.5, True), (15.0, True)])
def test_iterations_that_more_than_double_are_worth_a_look(iterations: float, noteworthy: bool) -> None:
    ends = [End.CONVERGED] * 4
    for suffix in ("", ", high penalty"):
        change = compare_rows(solved_cell(ends, suffix=suffix), solved_cell(ends, iterations, suffix), same_seed=True)
        words = f"Newton iterations{' (high penalty)' if suffix else ''}, median 3 → {iterations:g}"
        assert (change.regressions, change.noteworthy) == ((), (words,) * noteworthy)


def test_a_row_is_one_regression_however_much_of_it_got_worse() -> None:
    bad = changes_of(cell(0.5, 0.5), cell(64.0, 64.0, details={"x": np.zeros(2)}, verdict=Verdict.FAIL))
    assert len(bad.changes[0].regressions) == 2
    (line,) = bad.regressions
    assert line == f"vts-me, patch.flat.transmission: {'; '.join(bad.changes[0].regressions)}"
    assert regressions_text(bad).plain.splitlines() == ["1 regression", f"  {line}"]
    assert "1 regression." in changes_page(bad, {})


def test_what_is_worth_a_look_is_told_and_no_regression() -> None:
    changes = changes_of(cell(1e-6), cell(0.5))
    line = "vts-me, patch.flat.transmission: median error grew within its tolerance, 1e-06 → 0.5 of it; worst"
    assert changes.regressions == ()
    first, last = regressions_text(changes).plain.splitlines()
    assert first.startswith(f"worth a look: {line}")
    assert last == "Nothing got worse."
    page = changes_page(changes, {})
    assert "<h2>Worth a look</h2>" in page
    assert f"<li>{line}" in page
    assert "What got worse" not in page
    same = changes_of(cell(0.5), cell(0.5))
    assert regressions_text(same).plain == "Nothing got worse."
    assert "Worth a look" not in changes_page(same, {})


def test_other_cases_are_compared_as_distributions() -> None:
    n = 40
    allowed = sqrt(log(1 / ALPHA) * (1 / n + 1 / n))  # The distance that chance allows half as many independent cases.
    just, beyond = int(allowed * n), int(allowed * n) + 1  # cases that may be worse, and one more
    old = cell(*[10.0] * n)
    for worse, regressed in ((just, False), (beyond, True)):
        new = cell(*[10.0] * (n - worse), *[1000.0] * worse)
        change = compare_rows(old, new, same_seed=False)
        assert not change.same_cases
        assert bool(change.regressions) is regressed
        assert compare_rows(new, old, same_seed=False).regressions == ()  # it got better
    within = compare_rows(cell(*[0.01] * n), cell(*[0.99] * n), same_seed=False)
    assert within.regressions == ()


@pytest.mark.parametrize(
    ("before", "after", "regressed"),
    [
        (1e12, 1.05e12, False),  # every rank moves, by nothing
        (100.0, 202.0, False),
        (100.0, 202.5, True),
        (0.5, 1.5, True),  # all passed, and all fail
        (inf, inf, False),
    ],
)
def test_distributions_on_other_cases_know_the_same_factor(before: float, after: float, regressed: bool) -> None:
    old, new = cell(*[before] * 40), cell(*[after] * 40, verdict=cell(before).row.verdict)
    assert bool(compare_rows(old, new, same_seed=False).regressions) is regressed


def test_cases_are_the_same_only_if_the_meshes_are() -> None:
    old, new = row("vts-me", 0.5, 2.0, sizes=[1, 2]), row("vts-me", 0.5, 9.0, sizes=[1, 3])
    assert not compare_rows(RowNumbers.from_row(old), RowNumbers.from_row(new), same_seed=True).same_cases
    longer = RowNumbers.from_row(row("vts-me", 0.5, 9.0, 64.0, sizes=[1, 2, 7]))
    change = compare_rows(RowNumbers.from_row(old), longer, same_seed=True)
    assert change.same_cases
    assert change.pair.n == 2  # the first ones


def test_the_distance_of_two_samples() -> None:
    for before, after, distance in (
        ([1, 2], [1, 2], 0.0), ([1, 2], [3, inf], 1.0), ([3, 4], [1, 2], 0.0), ([1, 2, 3, 4], [1, 2, 5, 6], 0.5),
    ):  # fmt: skip
        assert shift(np.array(before, float), np.array(after, float)) == distance


def named_run(cells: dict[tuple[str, str], RowNumbers], failures: dict[str, str] | None = None) -> NamedRun:
    """Return a report with these rows, {(formulation, property): cell}."""
    renamed = {
        (name, id_): with_changes(item, formulation=name, info=question(id_)) for (name, id_), item in cells.items()
    }
    not_loaded = tuple(NotLoaded(*item) for item in (failures or {}).items())
    run = Run(tuple(item.row for item in renamed.values()), not_loaded, {}, {"seed": "1"})
    return NamedRun("r.nc", run, renamed)


def changes_of(old: RowNumbers, new: RowNumbers) -> Changes:
    return Changes.between(named_run({KEY: old}), named_run({KEY: new}))


def test_what_is_missing_is_named_and_what_does_not_load_any_more_is_lost() -> None:
    same = cell(0.5)
    old = named_run({("nts", "purity"): same, ("vts-me", "purity"): same, ("nts", "units"): same})
    new = named_run(
        {("nts", "purity"): same, ("nts", "newton.order"): same}, {"vts-me": "no module", "other": "no module"}
    )
    changes = Changes.between(old, new)
    assert changes.removed == ("vts-me", "units")
    assert changes.added == ("newton.order",)
    assert changes.no_longer_loaded == {"vts-me": "no module"}
    assert changes.regressions == ("vts-me: not loaded any more: no module",)


def test_a_stored_report_gives_the_cells_of_its_run(tmp_path: Path) -> None:
    rows: tuple[Row, ...] = (row("vts-ppt", 0.5, 0.25, Verdict.UNDECIDED, promise=True, sizes=[3, 2, 1]),)
    order = question("newton.order", SLOPE)
    solved = Measurement([SLOPE.check(2.0, 1.9)], details={"iterations": 3.0, "end": 0.0})
    outcomes = (Outcome(a_case(1), Verdict.PASS, "", solved), Outcome(a_case(2), Verdict.CRASHED, "exception: x"))
    rows += (Row("vts-ppt", order, Verdict.CRASHED, True, planned=2, outcomes=outcomes, reason="exception: x"),)
    rows += (row("vts-me:n=4", 64.0, 0.25, promise=False, sizes=[3, 2]),)
    rows += (Row("nts", question(), Verdict.NOT_PROVIDED, None, reason="pair: not provided"),)
    run = Run(rows, (NotLoaded("mine", "no module"),), {}, {"seed": "1", "command": "", "platform": "", "created": ""})
    write(run, tmp_path / "r.nc")
    result = read_run(tmp_path / "r.nc")
    assert result.formulations == ("vts-ppt", "vts-me:n=4", "nts")
    assert list(result.properties) == ["patch.flat.transmission", "newton.order"]
    assert len(result.rows) == len(rows)
    for ours, theirs in zip(map(RowNumbers.from_row, rows), map(RowNumbers.from_row, result.rows), strict=True):
        assert ours.details.keys() == theirs.details.keys()
        assert all(np.array_equal(ours.details[name], theirs.details[name], equal_nan=True) for name in ours.details)
        for name in ("verdicts", "margins", "orders", "kinds"):
            assert np.array_equal(getattr(ours, name), getattr(theirs, name), equal_nan=True), name
        assert ours.closest == theirs.closest
        assert ours.seconds == theirs.seconds or (isnan(ours.seconds) and isnan(theirs.seconds))
    again = NamedRun.from_run("r.nc", result)
    assert Changes.between(again, again).regressions == ()


def test_a_page_escapes_what_a_plugin_calls_itself() -> None:
    evil = "<script>alert(1)</script>"
    bad = cell(64.0, reason=evil)
    key = (evil, "patch.flat.transmission")
    old, new = named_run({key: with_changes(bad, verdict=Verdict.PASS)}), named_run({key: bad}, {"nts": evil})
    page = changes_page(Changes.between(old, new), {})
    assert "<script" not in page
    assert "&lt;script&gt;" in page
    run = replace(small_run(), not_loaded=(NotLoaded(evil, evil),))
    comparison = Comparison.from_run(run, "vts-ppt")
    page = comparison_page(comparison, (), (), ())
    assert "<script" not in page
    assert page == comparison_page(comparison, (), (), ())


def test_reports_call_what_newton_tells_by_the_names_that_properties_give_it() -> None:
    """They share no code, so they must share words: else columns would be empty, and nobody would notice."""
    assert newton_order.quantities[0].name == ORDER == SLOPE.name
    scene = load_scene("c")
    subject = load_subject("vts-ppt")
    details = solution_details(solve(scene, subject.for_case(scene.case())))
    assert {ITERATIONS, END} <= set(details)
    assert details[END] == CONVERGED == End.CONVERGED
