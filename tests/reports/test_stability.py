"""File, figure and page of the stability sweeps agree, and each point above the line can be replayed."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from expected_verdicts import FAILS
from gauss_springs import RIGHT, WRONG, springs_of
from matplotlib.axes import Axes
from matplotlib.text import Text

from contactverif import MisuseError, Outcome, Subject, Verdict
from contactverif.contract.counterexample import counterexamples, find_counterexample, named_failures
from contactverif.contract.result import NotLoaded, Row, Run
from contactverif.problems.stability_states import stability_scenes, stability_states
from contactverif.studies.stability_study import run_stability
from contactverif_properties.roundoff import CONDITION, ERROR, FORCE_ERROR, MOST_ROUNDINGS
from contactverif_reports.draw.stability_figure import draw_stability, make_stability_figure
from contactverif_reports.netcdf.read import case_ids, open_report, read_case, read_run
from contactverif_reports.netcdf.write import write
from contactverif_reports.stability import sweep_points
from contactverif_reports.stability.stability_page import sentence_of, stability_page
from contactverif_reports.stability.sweep_points import FAR_AND_CLOSE, SWEEPS, SweepPanel, short_number, sweep_panels

ABOVE = "unstable.stability.sweep.offset-1e6-a"


def rename(subject: Subject, name: str) -> Subject:
    return Subject(name, subject._make)


@cache
def small_run() -> Run:
    """Return a run of a stable and an unstable formulation, of a third that raises, and of one that does not load."""

    def make_broken(*, penalty: float) -> object:
        broken = springs_of(*RIGHT["differences first"])._make(penalty=penalty)
        broken.residual = lambda interface, pairing, z: 1 / 0
        return broken

    subjects = [
        rename(springs_of(*RIGHT["differences first"], translation_stable=True), "stable"),
        rename(springs_of(*WRONG["implicit line"]), "unstable"),
        Subject("broken", make_broken),
        NotLoaded("absent", "ImportError: no such module"),
    ]
    return run_stability(subjects, outputs=["a.nc"])


@cache
def short_run() -> Run:
    """Return the run with few states, so that its file is small."""
    names = {"gap-1e-9-a", "offset-1e2-a", "offset-1e6-a", "offset-1e9-gap-1e-6-b", "all-a", "stiffness-1e4"}
    rows = (
        replace(row, outcomes=tuple(outcome for outcome in row.outcomes if outcome.case.name in names))
        for row in small_run().rows
    )
    return replace(small_run(), rows=tuple(rows))


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("stability") / "a.nc"
    write(short_run(), path, with_named_cases=True)
    return path


def panels() -> dict[str, SweepPanel]:
    return {panel.formulation: panel for panel in sweep_panels(small_run())}


def test_reports_and_properties_use_the_same_words() -> None:
    assert (sweep_points.ERROR, sweep_points.CONDITION, sweep_points.FORCE_ERROR) == (ERROR, CONDITION, FORCE_ERROR)
    assert sweep_points.TOLERANCE == MOST_ROUNDINGS


def test_every_state_is_a_point_of_its_sweep() -> None:
    stable = panels()["stable"]
    names = [case.name for case in (*stability_states(), *stability_scenes())]
    assert sorted(point.name for point in stable.points) == sorted(names)
    assert {point.sweep for point in stable.points} == set(SWEEPS)
    by_name = {point.name: point.sweep for point in stable.points}
    assert by_name["offset-1e6-a"] == "offset"
    assert by_name["offset-1e6-gap-1e-6-a"] == "offset, gap 1e-6"


def test_the_three_numbers_of_a_point_belong_together() -> None:
    for panel in panels().values():
        for point in panel.points:
            assert point.error == pytest.approx(point.roundings * 2.0**-53 * point.condition)
            assert point.condition >= 1
            assert point.above is (point.roundings > 4)
            assert point.fails is (point.roundings > 16)


def test_the_reader_gives_the_same_points_back(report: Path) -> None:
    run, same = short_run(), read_run(report)
    for stored, panel in zip(sweep_panels(same), sweep_panels(run), strict=True):
        assert (stored.formulation, stored.points, stored.remarks) == (panel.formulation, panel.points, panel.remarks)
        assert (stored.n_undecided, stored.n_crashed) == (panel.n_undecided, panel.n_crashed)
    assert same.provenance == run.provenance


def test_each_point_above_the_line_can_be_replayed(report: Path) -> None:
    ids = [point.case_id for point in sweep_panels(short_run())[1].above if point.fails]
    assert ABOVE in ids
    assert set(ids) <= set(case_ids(report))
    for id_ in ids:
        stored, case = read_case(report, id_), find_counterexample(short_run(), id_).case
        assert stored.case.to_arrays().keys() == case.to_arrays().keys()
        for name, values in stored.case.to_arrays().items():
            assert values.tobytes() == case.to_arrays()[name].tobytes(), name
        assert (stored.formulation, stored.verdict) == ("unstable", Verdict.FAIL)


def test_a_case_that_several_formulations_fail_is_stored_once(report: Path) -> None:
    with open_report(report) as groups:
        stored = [path for path in groups if path.startswith("/named_cases/")]
    failures = named_failures(short_run()).values()
    assert len(stored) == len({(example.property_id, example.case.name) for example in failures}) < len(failures)


def test_an_ordinary_report_stores_the_worst_case_alone(tmp_path: Path) -> None:
    write(short_run(), tmp_path / "b.nc")
    assert case_ids(tmp_path / "b.nc") == list(counterexamples(short_run()))
    with pytest.raises(MisuseError, match=r"an id like unstable\.stability\.sweep"):
        read_case(tmp_path / "b.nc", ABOVE)


def test_the_same_run_gives_the_same_command_and_nothing_of_the_machine() -> None:
    assert small_run().provenance["command"] == "contactverif stability stable unstable broken absent --out a.nc"
    assert not {"platform", "created"} & small_run().provenance.keys()


def test_sentences_tell_instability_from_bad_conditioning() -> None:
    sentences = {name: sentence_of(panel) for name, panel in panels().items()}
    assert sentences["stable"].startswith("stays below the line in all 95 states; the largest error is ")
    assert "far from the origin: it rounds positions there before it subtracts them" in sentences["unstable"]
    assert sentences["broken"] == "was not measured; 95 without an answer."


def test_a_lost_digit_is_above_the_line_and_no_failure() -> None:
    stable = panels()["stable"]
    worst, *others = stable.points
    panel = SweepPanel("careless", (replace(worst, roundings=5.0), *others))
    sentence = sentence_of(panel)
    assert sentence.startswith("is above the line in 1 of 95 states, in the sweeps of ")
    assert "and never above 16 u κ: it loses a digit there; the largest error is 5 u κ" in sentence


def test_a_formulation_that_does_not_turn_is_told_so() -> None:
    stable = panels()["stable"]
    points = tuple(replace(point, roundings=1e12, verdict=Verdict.FAIL) for point in stable.points)
    assert "its forces do not turn with the state" in sentence_of(SweepPanel("fixed", points))


def test_an_undecided_state_is_counted_and_no_point() -> None:
    row = next(row for row in small_run().rows if row.formulation == "stable" and row.outcomes)
    outcomes = (Outcome(row.outcomes[0].case, Verdict.UNDECIDED, "singular"), *row.outcomes[1:])
    run = Run((Row("stable", row.info, Verdict.PASS, None, planned=len(outcomes), outcomes=outcomes),), (), {})
    (panel,) = sweep_panels(run)
    assert (panel.n_undecided, len(panel.points)) == (1, len(outcomes) - 1)
    assert sentence_of(panel).endswith("; 1 undecided.")


def test_the_page_has_a_sentence_and_a_line_of_numbers_for_each_formulation() -> None:
    page = stability_page(small_run(), {".nc": "a.nc", ".svg": "a.svg"})
    for name in ("stable", "unstable", "broken"):
        assert f"- `{name}` " in page
        assert f"| `{name}` | " in page
    assert "- `absent` was not loaded: ImportError: no such module" in page
    assert "![Error against condition number, one panel a formulation](a.svg)" in page
    assert "    contactverif replay a.nc --case unstable.stability.sweep." in page
    assert "| `broken` | – | – |" in page


def test_short_numbers_have_two_digits() -> None:
    values = [2.7e8, 1.44, 0.0, 5.04e-11, float("nan"), 16.2]
    assert [short_number(value) for value in values] == ["2.7e8", "1.4", "0", "5e-11", "–", "16"]


def texts_of(axes: Axes) -> list[Text]:
    return [text for text in (*axes.texts, axes.title, axes._left_title) if text.get_text()]


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 23])
def test_no_text_of_the_figure_leaves_its_panel_or_covers_another(count: int) -> None:
    few = list(panels().values())
    figure = make_stability_figure([few[number % 2] for number in range(count)])
    figure.draw_without_rendering()
    visible = [axes for axes in figure.axes if axes.axison]
    assert len(visible) == count
    boxes = []
    for axes in visible:
        low, high = axes.get_tightbbox().x0 - 1, axes.get_window_extent().x1 + 1
        for text in texts_of(axes):
            box = text.get_window_extent()
            assert low <= box.x0 < box.x1 <= high, text.get_text()
            boxes.append((text.get_text(), box))
    for number, (name, box) in enumerate(boxes):
        for other_name, other in boxes[:number]:
            assert not box.overlaps(other), (name, other_name)


def test_the_figure_draws_every_point_and_names_the_worst_above_the_line() -> None:
    few = panels()
    figure = make_stability_figure([few["stable"], few["unstable"]])
    for axes, panel in zip(figure.axes, (few["stable"], few["unstable"]), strict=True):
        n_drawn = sum(len(line.get_xdata()) for line in axes.lines if line.get_marker() not in ("None", "", None))
        assert n_drawn == len(panel.points)
    assert any(few["unstable"].above[0].name in text.get_text() for text in figure.axes[1].texts)


def test_an_error_of_zero_has_a_row_of_its_own() -> None:
    point = next(point for point in panels()["stable"].points if point.sweep == "gap")
    point = replace(point, error=0.0, roundings=0.0)
    figure = make_stability_figure([SweepPanel("exact", (point,))])
    (marker,) = [line for line in figure.axes[0].lines if line.get_marker() == "o" and len(line.get_xdata())]
    low, _ = figure.axes[0].get_ylim()
    assert low < marker.get_ydata()[0] < 1e-17


@pytest.mark.parametrize("name", ["a.svg", "a.png"])
def test_the_same_points_give_the_same_picture(tmp_path: Path, name: str) -> None:
    few = list(panels().values())
    draw_stability(few, tmp_path / name)
    first = (tmp_path / name).read_bytes()
    draw_stability(few, tmp_path / name)
    assert (tmp_path / name).read_bytes() == first


# ---------------------------------------------------------------------------------------------------------------------
# What is kept in the repository

FOLDER = Path(__file__).parents[2] / "reports" / "stability"


def test_the_kept_page_is_that_of_the_kept_numbers() -> None:
    run = read_run(FOLDER / "stability.nc")
    page = stability_page(run, {".nc": "stability.nc", ".svg": "stability.svg"})
    assert (FOLDER / "README.md").read_text(encoding="utf-8") == page
    assert not {"platform", "created"} & run.provenance.keys()


def test_no_kept_point_is_above_the_line() -> None:
    stored_panels = sweep_panels(read_run(FOLDER / "stability.nc"))
    assert len(stored_panels) == len(FAILS)
    assert {panel.formulation for panel in stored_panels} == set(FAILS)
    for panel in stored_panels:
        assert not panel.above
        assert panel.worst is not None
        assert panel.worst.roundings <= 1.8  # What 60 digits show on other states, too.
        assert len(panel.points) >= 80
        assert panel.force_error_at(FAR_AND_CLOSE) <= 1e-10
