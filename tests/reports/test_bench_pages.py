"""Conclusions from a bench, its file, pictures and pages: costs of an error, intervals, sentences, changes."""

import re
from dataclasses import replace
from math import inf, isnan
from pathlib import Path

import numpy as np
import pytest
from page_reader import complaints
from studies.bench_results import make_cells, make_results

from contactverif.contract.errors import MisuseError
from contactverif_reports.bench_costs import (
    BODIES,
    Ratio,
    compare_benches,
    cost_of,
    cost_ratio,
    cost_sentences,
    cost_table,
    curve,
    format_seconds,
    rank,
    ratio_of,
    runtimes,
    starts_table,
    total_ratio,
)
from contactverif_reports.bench_results import BEST, DEEP, VARIANTS, Outcome
from contactverif_reports.html.bench_page import bench_markdown, bench_page
from contactverif_reports.netcdf.bench_file import read_bench, write_bench
from contactverif_reports.plot.bench_figures import highlights, make_scene_figure, plot_bench

RUNS = {
    "vts-ppt": {8: (1e-3, 0.02, 2), 16: (2e-3, 0.004, 3)},
    "exact": {8: (3e-3, 0.008, 4), 16: (6e-3, 9e-4, 5)},
    "poor": {8: (1e-4, 0.3, 2), 16: (2e-4, inf, 9)},
}
RESULTS = make_results(make_cells(), RUNS, noise=0.02)


def test_the_coarsest_mesh_that_reaches_an_error_counts_and_a_failure_never_does() -> None:
    reference, exact, poor = (cost_of(RESULTS, name, "wavy", 1e-2) for name in RUNS)
    assert (reference.middle("segments"), exact.middle("segments"), poor.middle("segments")) == (16, 8, inf)
    assert exact.evaluation.shape == (6, 3)
    assert exact.middle("evaluation") == pytest.approx(3e-3, rel=0.02)
    assert (exact.middle("systems"), exact.middle("factorisation")) == (4, 8e-3)
    assert cost_ratio(exact, reference, "evaluation").middle == pytest.approx(1.5, rel=0.02)
    assert cost_ratio(exact, reference, "factorisation").middle == pytest.approx(0.5)
    assert cost_ratio(poor, reference, "evaluation").middle == inf
    assert isnan(cost_ratio(reference, poor, "evaluation").middle)


def test_a_formulation_that_brings_half_of_the_instances_there_is_compared_on_those() -> None:
    results = make_results(make_cells(), RUNS)
    errors = results.errors.copy()
    errors[0, [6, 7]] = 0.5  # Two of six instances on the finer mesh.
    reference = cost_of(replace(results, errors=errors), "vts-ppt", "wavy", 1e-2)
    assert (reference.reached.sum(), reference.is_usual) == (4, True)
    errors[0, [8, 9]] = 0.5
    assert not cost_of(replace(results, errors=errors), "vts-ppt", "wavy", 1e-2).is_usual


def test_the_best_penalty_afterwards_is_told_from_that_of_the_rule() -> None:
    results = make_results(make_cells(), RUNS)
    errors = results.errors.copy()
    errors[0, :6, len(VARIANTS) - 1] = 1e-3  # At the stiffest penalty the coarse mesh is enough.
    errors[0, :6, VARIANTS.index(DEEP)] = 1e-9  # Another start is no other penalty.
    changed = replace(results, errors=errors)
    for target, variants, segments in ((1e-2, (0,), 16), (1e-2, BEST, 8), (1e-4, BEST, inf)):
        assert cost_of(changed, "vts-ppt", "wavy", target, variants).middle("segments") == segments
    table = cost_table(changed, "wavy", 1e-2)
    assert [column.head for column in table.columns[:4]] == ["formulation", "reached", "segments", "best"]
    assert table.groups[""][0][:4] == ("vts-ppt", "6/6", "16", "8")


def test_whole_solutions_go_from_evaluations_to_factorisations_as_bodies_get_dearer() -> None:
    """`exact` takes 4/3 of the systems, 3/2 of an evaluation and half of a factorisation of vts-ppt."""
    exact, reference = (cost_of(RESULTS, name, "wavy", 1e-2) for name in ("exact", "vts-ppt"))
    ratios = [total_ratio(exact, reference, share).middle for share in (0.0, *BODIES.values(), 1e6)]
    assert ratios[0] == pytest.approx(4 / 3 * 3 / 2, rel=0.02)
    assert ratios[-1] == pytest.approx(4 / 3 / 2, rel=0.02)
    assert ratios == sorted(ratios)[::-1]


def test_an_interval_holds_the_ratio_and_is_wider_with_more_noise_and_with_fewer_processes() -> None:
    dice = np.random.default_rng(3)
    of_process, of_instance = dice.normal(0, 0.05, (200, 1, 5)), dice.normal(0, 0.02, (200, 15, 1))
    n_inside = 0
    for process, instance in zip(of_process, of_instance, strict=True):
        ratio = ratio_of(1.2 * np.exp(process + instance), np.ones((15, 5)))
        n_inside += ratio.low <= 1.2 <= ratio.high
    assert 0.7 < n_inside / 200 < 0.99  # Five processes are few: a percentile interval is somewhat too narrow.
    narrow, wide = (ratio_of(np.exp(noise * of_instance[0]), np.ones((15, 1))) for noise in (1, 3))
    assert wide.high - wide.low > 2 * (narrow.high - narrow.low) > 0
    within_one = ratio_of(np.exp(of_process[0][:, :1] + of_instance[0]), np.ones((15, 1)))
    several = ratio_of(np.exp(of_process[0] + of_instance[0]), np.ones((15, 5)))
    assert several.high / several.low > within_one.high / within_one.low


@pytest.mark.parametrize(
    ("ratio", "word", "text"),
    [
        (Ratio(1.01, 0.97, 1.04), "as fast", "1.01 [0.97, 1.04]"),
        (Ratio(1.02, 1.01, 1.03), "as fast", "1.02 [1.01, 1.03]"),
        (Ratio(1.2, 1.1, 1.3), "slower", "1.20 [1.10, 1.30]"),
        (Ratio(0.8, 0.7, 0.9), "faster", "0.80 [0.70, 0.90]"),
        (Ratio(1.1, 0.9, 1.3), "not told apart", "1.10 [0.90, 1.30]"),
        (Ratio(2.0), "not told apart", "2.00"),
        (Ratio(12.34, 11.0, 14.0), "slower", "12.3 [11.0, 14.0]"),
        (Ratio(inf), "never", "∞"),
        (Ratio(float("nan")), "", "–"),
    ],
)
def test_a_ratio_says_only_what_its_interval_allows(ratio: Ratio, word: str, text: str) -> None:
    assert (ratio.word, ratio.text) == (word, text)


def test_few_instances_and_numbers_that_are_missing_give_no_interval() -> None:
    assert isnan(ratio_of(np.ones((4, 3)), np.ones((4, 3))).low)
    values = np.ones((6, 3))
    values[0, 1] = np.nan
    assert ratio_of(values, 2 * np.ones((6, 3))).text == "0.50 [0.50, 0.50]"
    assert isnan(ratio_of(np.full((6, 3), np.nan), values).middle)


def test_a_sentence_has_ratios_whose_interval_excludes_1_alone() -> None:
    runs = {"vts-ppt": RUNS["vts-ppt"], "alike": RUNS["vts-ppt"], **RUNS}
    first, second = cost_sentences(make_results(make_cells(), runs, noise=0.02), "wavy", 1e-2)
    start = "On wavy, at an error of 1 % in the forces, seconds of one evaluation"
    assert first.startswith(f"{start} over those of vts-ppt: more: exact 1.5")
    assert first.endswith("; alike within 5 %: alike; never there: poor.")
    assert "more: exact 1.33 [1.33, 1.33]; alike within 5 %: alike" in second
    noisy = cost_sentences(make_results(make_cells(), runs, noise=0.5), "wavy", 1e-2)[0]
    assert "not told apart: alike" in noisy
    (none,) = cost_sentences(RESULTS, "wavy", 1e-3)
    assert none.endswith("there is no ratio, since vts-ppt does not get there.")
    few = make_results(make_cells(n_instances=4), RUNS)
    assert cost_sentences(few, "wavy", 1e-2)[0].endswith("so nobody is known to be faster: that takes 5 instances.")
    assert cost_sentences(make_results(make_cells(), {"poor": RUNS["poor"]}), "wavy", 1e-2) == []


def test_runtimes_are_infinite_where_a_target_is_not_reached() -> None:
    seconds = runtimes(RESULTS, "exact", "wavy", "factorisation")
    assert seconds.tolist() == pytest.approx([4 * 8e-3] * 6 + [5 * 16e-3] * 6)
    assert np.isinf(runtimes(RESULTS, "poor", "wavy", "evaluation")).all()


def test_who_reaches_the_smallest_error_comes_first_and_at_most_six_have_a_colour() -> None:
    assert rank(RESULTS, "wavy") == ["exact", "vts-ppt", "poor"]
    assert list(highlights(RESULTS)) == ["vts-ppt", "exact", "poor"]
    many = make_results(make_cells(), {f"f{n}": RUNS["exact"] for n in range(8)} | {"vts-ppt": RUNS["vts-ppt"]})
    assert list(highlights(many))[:2] == ["vts-ppt", "f0"]
    assert len(highlights(many)) == 6


def test_a_curve_has_medians_and_failures_are_infinite() -> None:
    seconds, errors = curve(RESULTS, "poor", "wavy", "forces", "evaluation")
    assert seconds.tolist() == pytest.approx([1e-4, 2e-4], rel=0.02)
    assert errors.tolist() == [0.3, inf]


def test_an_instance_without_a_solution_takes_no_mesh_off_a_curve() -> None:
    results = make_results(make_cells(), RUNS)
    results.factorisation[0, [0, 6, 7]] = np.nan
    assert curve(results, "vts-ppt", "wavy", "forces", "factorisation")[0].tolist() == pytest.approx([8e-3, 16e-3])
    results.factorisation[0, :6] = np.nan
    assert np.isnan(curve(results, "vts-ppt", "wavy", "forces", "factorisation")[0]).tolist() == [True, False]


def test_the_table_of_starts_tells_failures_and_ranges() -> None:
    results = make_results(make_cells(), RUNS)
    results.counts[0, 0, 0, 0] = 7
    table = starts_table(results, "wavy")
    assert [column.head for column in table.columns] == ["formulation", "8", "16"]
    first, second, *_, last = table.groups[""]
    assert (first, second) == (("vts-ppt, near", "2–7", "3"), ("vts-ppt, deep", "2", "3"))
    assert last == ("poor, deepest", "2", "6 fail")


def test_counts_are_compared_exactly_and_seconds_in_factorisations() -> None:
    """A machine that is three times slower makes nothing slower; a formulation that is, is told."""
    slower = make_results(make_cells(), {**RUNS, "exact": {8: (3.6e-3, 0.008, 4), 16: (7.2e-3, 9e-4, 5)}}, noise=0.02)
    machine = replace(slower, evaluation=3 * slower.evaluation, factorisation=3 * slower.factorisation)
    for results in (slower, machine):
        reference, exact, _ = compare_benches(results, RESULTS)
        assert (reference.evaluation.word, exact.evaluation.word) == ("as fast", "slower")
        assert (reference.worse, exact.worse) == (False, True)
        assert exact.evaluation.middle == pytest.approx(1.2, rel=0.01)
        assert exact.counts_text == "all counts are equal"
    more = replace(RESULTS, counts=RESULTS.counts.copy())
    more.counts[1, 0, 0, 2] += 1  # One residual in one run.
    _, exact, _ = compare_benches(more, RESULTS)
    assert exact.worse
    assert "residuals: 271 instead of 270" in exact.sentence
    assert not compare_benches(RESULTS, more)[1].worse  # Fewer are no slowdown, and are told.
    assert compare_benches(RESULTS, more)[1].counts
    assert compare_benches(make_results(make_cells("rings"), RUNS), RESULTS) == ()


def test_the_file_holds_everything(tmp_path: Path) -> None:
    write_bench(RESULTS, tmp_path / "a.nc")
    again = read_bench(tmp_path / "a.nc")
    for name in RESULTS.__slots__:
        np.testing.assert_equal(getattr(again, name), getattr(RESULTS, name), name)


def test_another_file_is_no_bench(tmp_path: Path) -> None:
    (tmp_path / "b.nc").write_text("no netCDF")
    for name, words in (("a.nc", "which does not exist"), ("b.nc", "a file that `contactverif bench")):
        with pytest.raises(MisuseError, match=words):
            read_bench(tmp_path / name)


def test_every_picture_is_drawn_and_the_pages_need_nothing_else(tmp_path: Path) -> None:
    plot_bench(RESULTS, tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == {"wavy.svg", "cost.svg", "runtimes.svg", "starts.svg"}
    assert (RESULTS.outcomes == Outcome.NOT_SOLVED).any()
    page = bench_page(RESULTS, compare_benches(RESULTS, RESULTS))
    assert not complaints(page)
    assert not re.search(r'(src|href)="http', page)
    assert "never there: poor" in page
    assert "absent is not measured: no such module" in page
    text = bench_markdown(RESULTS, "bench.nc", with_pictures=True)
    assert set(re.findall(r"\]\(([^)]+)\)", text)) == {"cost.svg", "wavy.svg", "runtimes.svg", "starts.svg"}
    assert "| `poor` | 0/6 | ∞ |" in text


def test_many_formulations_have_a_picture_with_a_panel_each_and_one_mesh_has_no_curve(tmp_path: Path) -> None:
    many = {f"f{n}": RUNS["exact"] for n in range(7)}
    cells = (*make_cells(), *make_cells("kinked", meshes=(8,)))
    plot_bench(make_results(cells, many), tmp_path)
    names = {"wavy.svg", "wavy-each.svg", "cost.svg", "runtimes.svg", "starts.svg"}
    assert {file.name for file in tmp_path.iterdir()} == names


@pytest.mark.parametrize(
    ("seconds", "text"), [(inf, "∞"), (np.nan, "–"), (2e-6, "2 µs"), (0.0123, "12.3 ms"), (2.0, "2 s")]
)
def test_seconds_have_a_unit(seconds: float, text: str) -> None:
    assert format_seconds(seconds) == text


def test_each_curve_with_a_colour_is_named() -> None:
    figure = make_scene_figure(RESULTS, "wavy")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [*highlights(RESULTS), "best linear pressure"]
