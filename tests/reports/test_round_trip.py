"""A run comes back from its report as it was: every table, page and comparison is the same from memory and from a file.

Rule for the next editor: what a new table or page shows belongs into `everything_shown`.
"""

from collections.abc import Callable
from dataclasses import replace
from operator import attrgetter
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from handmade_report import ERROR, SLOPE, awkward, flat, outcome, question, run_with_kinds, small_run
from rich.console import Console, Group, RenderableType

from contactverif import Finding, Measurement, MisuseError, Outcome, Verdict, load_formulation, load_properties
from contactverif.cli.compare import changes_screen, regressions_text
from contactverif.cli.run_screen import counterexample_text, run_screen, run_table, summary
from contactverif.contract.counterexample import counterexamples, failing_examples
from contactverif.contract.result import NotLoaded, Result, Row, Run
from contactverif.run.run import run as verify
from contactverif_reports.comparisons import Comparison, RowNumbers, errors_table, iterations_table, results_table
from contactverif_reports.html.comparison_page import changes_page, comparison_page
from contactverif_reports.html.report_page import report_page
from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.read import case_ids, read_run
from contactverif_reports.netcdf.write import write
from contactverif_reports.regressions import Changes, NamedRun


def hard_run() -> Run:
    """Rows that are hard to store: NaN, kinks, breaches, series with gaps, no quantities, fewer cases than planned."""
    info = question("newton.history", "newton", ERROR, SLOPE)
    info = replace(info, series={"residual": "N", "a/b ′": "1"}, needs=frozenset({"pair", "tangent"}))
    info = replace(info, least_contact=0.0, usual_undecided=0.1)
    case, other = flat([2, 2], [4]), flat([1, 1, 2], [2, 2])
    series = {"residual": np.array([1.0, np.nan, 1e-9, np.nan]), "a/b ′": np.array([np.inf])}
    good = Measurement([ERROR.check(1e-15, 1e-12), SLOPE.check(2.0, 1.9)], series=series)
    beside = Finding("row 3", (0.25, np.nan), (-0.0, 5e-324), "N", "force", "exact", "free end")
    details = {"iterations": 4.0, "end": 1.0, "x": np.nan}
    outcomes = (
        Outcome(case, Verdict.PASS, "", good, 0.5),
        Outcome(other, Verdict.FAIL, "force error is nan", Measurement([ERROR.check(np.nan, 1e-12)], finding=beside)),
        Outcome(case, Verdict.UNDECIDED, "a kink", replace(good, undecided="a kink", idle=True), 0.25),
        Outcome(case, Verdict.UNDECIDED, "roundoff", replace(good, undecided="roundoff", finding=Finding("row 4"))),
        Outcome(case, Verdict.UNDECIDED, "a kink", replace(good, undecided="a kink")),
        Outcome(other, Verdict.FAIL, "changed its input", replace(good, broken="changed its input", series={})),
        Outcome(other, Verdict.FAIL, "breaks the contract: shape (3,)", None, breach=True),
        Outcome(awkward(), Verdict.PASS, "", Measurement(details={"end": 0.0, "iterations": 3.0})),
        Outcome(case, Verdict.PASS, "", Measurement(details=details)),
    )
    rows = [
        Row("mine", info, Verdict.FAIL, True, "area='current'", reason="breaks the contract", planned=12,
            outcomes=outcomes, shrunk=outcomes[6], seconds=3.0),
        Row("mine", question("a.b", "a"), Verdict.NOT_JUDGED, None, reason="0 of 9 cases judged", planned=9),
        Row("mine", question("patch", "patch", ERROR), Verdict.PASS, False, planned=1, outcomes=(outcome(case, 0.0),),
            witness=replace(outcome(case, 0.0), case_or_summary=awkward())),
        Row("mine", question("patch.x", "patch", ERROR), Verdict.FAIL, None, known="issue 7", planned=1,
            outcomes=(outcome(case, 0.5),), shrunk=outcome(case, 0.5)),
        Row("yours", info, Verdict.PASS, True, planned=1, outcomes=outcomes[:1]),
        Row("yours", question("patch", "patch", ERROR), Verdict.NOT_APPLICABLE, None, reason="no springs"),
    ]  # fmt: skip
    parts = {"pair": True, "tangent": False, "contact_points": True}
    provided, origin = {"mine": parts, "yours": parts, "idle": parts}, {"seed": "1", "examples": "9"}
    return Run(tuple(rows), (), provided, origin, opposite_signs=("yours",))


def real_run() -> Run:
    """Two formulations as `verify` finds them, one of which fails as it states."""
    subjects = [load_formulation(name) for name in ("vts-ppt", "nts")]
    return verify(subjects, load_properties(["patch.flat.*", "newton.*", "purity"]), examples=4, seed=3)


RUNS: dict[str, Callable[[], Run]] = {
    "small": small_run,
    "passing": lambda: small_run(passing=True),
    "hard": hard_run,
    "kinds": run_with_kinds,
    "nothing": lambda: Run((), (NotLoaded("mine", "no such module"),), {}, {"seed": "1"}),
    "real": real_run,
}


@pytest.fixture(params=RUNS, scope="module")
def live(request: pytest.FixtureRequest) -> Run:
    return RUNS[request.param]()


@pytest.fixture(scope="module")
def report(live: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "report.nc"
    write(live, path)
    return path


@pytest.fixture(scope="module")
def reread(report: Path) -> Run:
    return read_run(report)


def text_of(content: RenderableType, width: int = 100) -> str:
    console = Console(width=width, record=True, file=None, quiet=True, highlight=False, markup=False)
    console.print(content)
    return console.export_text(styles=True)


def everything_shown(run: Run) -> dict[str, str]:
    """Return everything that a reader is shown of a run, by name."""
    texts = {"page": report_page(run, "report.nc"), "last line": text_of(summary(run))}
    for width in (80, 140):
        texts |= {
            f"{view.__name__}, {width}": text_of(Group(*view(run, width)), width) for view in (run_screen, run_table)
        }
    texts |= {example.id: text_of(counterexample_text(example, Path("r.nc"))) for example in failing_examples(run)}
    for reference in run.formulations[:1] if run.rows else ():
        comparison = Comparison.from_run(run, reference)
        tables = (results_table, errors_table, iterations_table)
        texts |= {table.__name__: text_of(table(comparison).terminal()) for table in tables}
        texts["last line of the comparison"] = text_of(summary(comparison.candidates))
        texts["comparison"] = comparison_page(comparison, (), (), ())
    named = NamedRun.from_run("r.nc", run)
    changes = Changes.between(named, named)
    texts |= {"changes": text_of(Group(*changes_screen(changes))), "regressions": text_of(regressions_text(changes))}
    return texts | {"page of changes": changes_page(changes, counterexamples(run))}


def test_a_report_that_is_read_and_written_again_is_the_same(
    report: Path, live: Run, reread: Run, tmp_path: Path
) -> None:
    write(reread, tmp_path / "again.nc")
    assert same_data(report, tmp_path / "again.nc") == []
    assert case_ids(report)[: len(counterexamples(live))] == list(counterexamples(live))


def test_all_that_is_shown_is_the_same_from_memory_and_from_a_file(
    live: Run, reread: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("contactverif_reports.html.report_page.MOST_FIGURES", 1)  # The other meshes are text.
    ours, theirs = everything_shown(live), everything_shown(reread)
    assert list(ours) == list(theirs)
    for name, text in ours.items():
        assert text == theirs[name], name


def test_what_is_counted_is_the_same(live: Run, reread: Run) -> None:
    assert [reread.count(result) for result in Result] == [live.count(result) for result in Result]
    assert list(reread.properties) == list(live.properties)
    of_run = attrgetter("promises_kept", "formulations", "provided", "provenance", "opposite_signs")
    assert of_run(reread) == of_run(live)
    of_row = attrgetter(
        "verdict", "promise", "known", "reason", "planned", "judged", "undecided", "breach", "idle", "tally.counts",
        "contact_share", "suspicion", "info.kinds", "info.least_contact", "info.usual_undecided", "info.quantities",
        "info.needs", "info.series", "info.summary",
    )  # fmt: skip
    for ours, theirs in zip(live.rows, reread.rows, strict=True):
        assert of_row(ours) == of_row(theirs)
        assert list(ours.tally.reasons.items()) == list(theirs.tally.reasons.items())
        assert list(ours.tally.kinds.items()) == list(theirs.tally.kinds.items())


def test_every_outcome_comes_back(live: Run, reread: Run) -> None:
    for ours, theirs in zip(live.rows, reread.rows, strict=True):
        pairs = zip((*ours.outcomes, ours.witness), (*theirs.outcomes, theirs.witness), strict=True)
        assert all(facts(our) == facts(their) for our, their in pairs), ours.property_id


def facts(outcome: Outcome | None) -> object:
    """Return all but the time of an outcome; NaN equals NaN, and a mapping has no order."""
    if outcome is None:
        return None
    words = outcome.verdict, outcome.reason, outcome.breach, repr(outcome.summary)
    if (measurement := outcome.measurement) is None:
        return words
    numbers = (measurement.values, measurement.tolerances, measurement.details)
    series = {name: np.asarray(values).tobytes() for name, values in measurement.series.items()}
    words += measurement.undecided, measurement.broken, repr(measurement.finding)
    return [repr(sorted(entry.items())) for entry in numbers], series, words


def test_the_cases_of_a_row_are_a_sequence(tmp_path: Path) -> None:
    write(hard_run(), tmp_path / "report.nc")
    outcomes = read_run(tmp_path / "report.nc").rows[0].outcomes
    assert len(outcomes) == 9
    assert outcomes[-1].verdict is Verdict.PASS
    assert [outcome.verdict for outcome in outcomes[5:7]] == [Verdict.FAIL, Verdict.FAIL]
    with pytest.raises(IndexError):
        outcomes[9]
    with pytest.raises(MisuseError, match="case: found the summary of a case; needed a counterexample"):
        _ = outcomes[0].case


def test_a_number_that_was_not_measured_has_no_margin() -> None:
    """A tolerance without its value is no failure; a value that is NaN is one."""
    cell = RowNumbers.from_row(hard_run().rows[0])
    assert cell.margins[0] == pytest.approx(0.95)
    assert np.isinf(cell.margins[[1, 5, 6]]).all()
    assert np.isnan(cell.margins[[2, 3, 4, 7, 8]]).all()


def test_the_counts_say_whether_anything_was_judged(tmp_path: Path) -> None:
    """A run whose only property fails as announced keeps its promises, and says that nothing passed."""
    run = small_run()
    write(replace(run, rows=run.rows[3:4], not_loaded=()), tmp_path / "report.nc")
    with netCDF4.Dataset(tmp_path / "report.nc") as file:
        assert file.promises_kept == "true"
        counts = {name: int(file.getncattr(name)) for name in file.ncattrs() if name.startswith("n_")}
    assert counts.pop("n_properties_planned") == counts.pop("n_judged") == counts.pop("n_failed_as_stated") == 1
    assert set(counts.values()) == {0}


def test_a_code_without_a_meaning_is_damage(tmp_path: Path) -> None:
    write(small_run(), tmp_path / "report.nc")
    with netCDF4.Dataset(tmp_path / "report.nc", "a") as file:
        file["patch/flat/transmission/verdict"][0, 0] = 77
    with pytest.raises(MisuseError, match="verdict holds a code without a meaning"):
        read_run(tmp_path / "report.nc")
