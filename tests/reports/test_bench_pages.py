"""Conclusions from a bench, its file, pictures and pages: fronts, times to reach an error, profiles, slowdowns."""

import re
from math import inf, isnan
from pathlib import Path

import numpy as np
import pytest
from page_reader import complaints
from studies.bench_results import make_results

from contactverif.contract.errors import MisuseError
from contactverif_reports.bench.bench_text import bench_markdown
from contactverif_reports.bench.clocks import clock_sentences
from contactverif_reports.bench.results import Cell
from contactverif_reports.bench.slowdown import slowdowns
from contactverif_reports.bench.work_precision import (
    cost_ratio,
    cost_sentence,
    figure_sentence,
    harness_sentence,
    harness_share,
    pair_profiles,
    pareto_front,
    time_to_reach,
)
from contactverif_reports.draw.bench_figures import draw_bench, make_work_precision_figure
from contactverif_reports.html.bench_page import bench_page
from contactverif_reports.netcdf.bench_file import read_bench, write_bench

CELLS = [
    Cell("wavy", 1, 10.0),
    Cell("wavy", 2, 10.0),
    Cell("wavy", 2, 1e3),
    Cell("random", 0, 1.0),
    Cell("random", 1, 1.0),
]
RUNS = {
    "vts-ppt": [(1.0, 0.05), (2.0, 0.004), (9.0, 0.004), (1.0, 1e-9), (3.0, 1e-9)],
    "quick": [(0.5, 0.2), (1.0, 0.009), (3.0, 0.009), (2.0, 1e-9), (1.0, 0.5)],
    "poor": [(0.1, 0.3), (0.2, 0.25), (0.2, inf), (0.1, inf), (1.0, 1e-9)],
}
RESULTS = make_results(CELLS, RUNS)


def test_a_run_on_the_front_is_beaten_by_none() -> None:
    times, errors = np.array([1.0, 2.0, 2.0, 3.0, 4.0, inf]), np.array([0.3, 0.2, 0.1, 0.1, np.nan, 0.01])
    assert pareto_front(times, errors).tolist() == [True, False, True, False, False, False]


def test_the_cheapest_run_that_reaches_an_error_counts_and_a_failure_is_infinite() -> None:
    assert time_to_reach(RESULTS, "vts-ppt", "wavy", 1e-1) == 1.0
    assert time_to_reach(RESULTS, "vts-ppt", "wavy", 1e-2) == 2.0
    assert time_to_reach(RESULTS, "vts-ppt", "wavy", 1e-3) == inf
    assert time_to_reach(RESULTS, "poor", "wavy", 1e-1) == inf
    assert cost_ratio(RESULTS, "quick", "wavy") == 0.5
    assert cost_ratio(RESULTS, "poor", "wavy") == inf
    assert isnan(cost_ratio(RESULTS, "quick", "rings"))


def test_the_sentence_names_who_costs_what_and_who_never_gets_there() -> None:
    assert cost_sentence(RESULTS, "wavy") == (
        "On wavy, at an error of 1 % in the forces, the time over that of vts-ppt is: quick 0.5; poor never gets there."
    )
    assert "does not reach" in cost_sentence(RESULTS, "rings")


def test_profiles_compare_pairs_alone_and_an_inexact_solution_is_a_failure() -> None:
    quick, poor = pair_profiles(RESULTS)
    assert quick.factors.tolist() == [2.0, inf]
    assert quick.reference_factors.tolist() == [1.0, 1.0]
    assert (quick.share(1), quick.share(2), quick.share_solved, quick.median_ratio) == (0, 0.5, 0.5, 2.0)
    assert poor.factors.tolist() == [inf, 1.0]
    assert poor.reference_factors.tolist() == [1.0, 3.0]


def test_a_slowdown_is_a_ratio_to_the_yardstick() -> None:
    """A machine that is three times slower makes nothing slower; a formulation that is, is told."""
    slower = make_results(CELLS, RUNS, slower=1.5)
    changes = {change.formulation: change for change in slowdowns(slower, RESULTS)}
    assert changes["quick"].ratio == pytest.approx(1.5)
    assert changes["quick"].slower
    assert changes["quick"].parts["pair"] == pytest.approx(1.5)
    machine = make_results(CELLS, RUNS, slower=3.0)
    machine.yardstick[:] *= 3
    assert not any(change.slower for change in slowdowns(machine, RESULTS))


@pytest.mark.parametrize(
    ("wall", "words"), [(1.0, ""), (1.9, ""), (3.0, "works in other processes"), (0.5, "uses several threads")]
)
def test_what_the_clock_of_the_processor_does_not_show_is_said(wall: float, words: str) -> None:
    """One undisturbed repeat is enough to tell a busy machine from a plugin that waits."""
    results = make_results(CELLS, RUNS)
    results.wall[:] *= wall
    assert [words in sentence for sentence in clock_sentences(results)] == [True] * len(RUNS) * bool(words)
    if wall > 1:
        results.wall[:, 0, 0] /= wall
        assert clock_sentences(results) == []


def test_the_file_holds_everything(tmp_path: Path) -> None:
    write_bench(RESULTS, tmp_path / "a.nc")
    again = read_bench(tmp_path / "a.nc")
    for name in ("formulations", "cells", "remarks", "not_loaded", "provenance"):
        assert getattr(again, name) == getattr(RESULTS, name), name
    for name in ("segments", "unknowns", "outcomes", "errors", "counts", "seconds", "wall", "yardstick"):
        np.testing.assert_array_equal(getattr(again, name), getattr(RESULTS, name), name)


def test_another_file_is_no_bench(tmp_path: Path) -> None:
    with pytest.raises(MisuseError, match="which does not exist"):
        read_bench(tmp_path / "a.nc")
    (tmp_path / "a.nc").write_text("no netCDF")
    with pytest.raises(MisuseError, match="a file that `contactverif bench"):
        read_bench(tmp_path / "a.nc")


def test_a_run_without_a_solution_is_drawn_at_the_edge() -> None:
    figure = make_work_precision_figure(RESULTS, "wavy")
    panel = figure.axes[1]  # The stiff penalty, at which `poor` finds no solution.
    (edge,) = [
        line.get_ydata()[0]
        for line in panel.lines
        if line.get_linestyle() == "-" and len(set(line.get_ydata())) == 1 and len(line.get_ydata()) == 2
    ]
    crosses = [line for line in panel.lines if line.get_marker() == "x" and len(line.get_xdata())]
    assert [line.get_ydata().tolist() for line in crosses] == [[edge]]
    assert edge > 0.25


def test_many_formulations_have_a_panel_each_with_their_failures_at_the_edge() -> None:
    many = make_results(
        CELLS, {f"f{n}": RUNS["poor" if n == 1 else "quick"] for n in range(7)} | {"vts-ppt": RUNS["vts-ppt"]}
    )
    figure = make_work_precision_figure(many, "wavy")
    panels = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title() for axes in panels] == list(many.formulations)
    (edge,) = {
        line.get_ydata()[0]
        for axes in panels
        for line in axes.lines
        if line.get_marker() == "None" and len(set(line.get_ydata())) == 1
    }
    crosses = {
        axes.get_title(): line.get_ydata().tolist()
        for axes in panels
        for line in axes.lines
        if line.get_marker() == "x" and len(line.get_xdata())
    }
    assert crosses == {"f1": [edge]}


def test_sentences_about_many_formulations_stay_short() -> None:
    many = make_results(CELLS, {f"f{n}": RUNS["quick"] for n in range(8)} | {"vts-ppt": RUNS["vts-ppt"]})
    assert "f4 0.5, 3 more up to 0.5." in cost_sentence(many, "wavy")
    none = make_results(CELLS, {f"f{n}": RUNS["poor"] for n in range(8)} | {"vts-ppt": RUNS["vts-ppt"]})
    assert cost_sentence(none, "wavy").endswith("in the forces; 8 of 9 formulations never get there.")


def test_the_caption_says_who_is_exact_and_who_is_first() -> None:
    assert figure_sentence(RESULTS, "wavy") == (
        "The smallest error of the forces is 0.004, by vts-ppt; quick is the first of 2 to reach 1 %, after 1e+03 ms."
    )
    poor = make_results(CELLS, {"poor": RUNS["poor"]})
    assert (
        figure_sentence(poor, "wavy") == "The smallest error of the forces is 0.2, by poor; no formulation reaches 1 %."
    )
    nothing = make_results(CELLS, {"poor": [(1.0, inf)] * len(CELLS)})
    assert figure_sentence(nothing, "wavy") == "No formulation has an error of the forces on wavy."


def test_every_picture_is_drawn_and_the_pages_need_nothing_else(tmp_path: Path) -> None:
    draw_bench(RESULTS, tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == {"wavy.svg", "cost.svg", "profiles.svg"}
    page = bench_page(RESULTS, slowdowns(make_results(CELLS, RUNS, slower=2.0), RESULTS))
    assert not complaints(page)
    assert not re.search(r'(src|href)="http', page)
    assert "poor never gets there" in page
    assert "absent did not load: no such module" in page
    text = bench_markdown(RESULTS, "bench.nc", with_pictures=True)
    assert set(re.findall(r"\]\(([^)]+)\)", text)) == {"cost.svg", "wavy.svg", "profiles.svg"}
    assert "| `poor` | ∞ | ∞ | ∞ | ∞ |" in text


def test_the_share_of_the_harness_is_what_no_part_of_a_solution_takes() -> None:
    """The search takes a quarter of each time, and no other part takes any."""
    assert harness_share(RESULTS, "vts-ppt") == 0.75
    assert harness_sentence(RESULTS).startswith("Of the time of vts-ppt, 25 % goes into its own calls")
    assert harness_sentence(make_results(CELLS, {"poor": RUNS["poor"]})) == ""
    assert isnan(harness_share(make_results(CELLS, {"nobody": [(1.0, inf)] * len(CELLS)}), "nobody"))
