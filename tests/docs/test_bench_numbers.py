"""Sentences about speed say what intervals allow, and the page of the bench is that of its file."""

import re
from pathlib import Path

import pytest
from quotes import DOCS, README, ROOT

from contactverif_reports.bench_costs import REFERENCE, ratios_at
from contactverif_reports.bench_results import BenchResults
from contactverif_reports.html.bench_page import bench_markdown
from contactverif_reports.netcdf.bench_file import read_bench

BENCH = ROOT / "reports" / "bench"


@pytest.fixture(scope="module")
def results() -> BenchResults:
    return read_bench(BENCH / "bench.nc")


def test_the_page_says_what_the_file_says(results: BenchResults) -> None:
    assert (BENCH / "README.md").read_text(encoding="utf-8") == bench_markdown(results, "bench.nc", with_pictures=True)


@pytest.mark.parametrize("page", [README, DOCS / "index.md"], ids=lambda page: page.name)
def test_a_sentence_on_cost_has_only_ratios_that_the_intervals_allow(page: Path, results: BenchResults) -> None:
    text = " ".join(re.sub("<!--.*?-->", "", page.read_text(encoding="utf-8")).split())
    (sentence,) = re.findall(r"At an error of 1 % in the forces on wavy half-planes,? (.*?)(?: \(\[|\. )", text)
    ratios = ratios_at(results, "wavy", 1e-2, "evaluation")
    costs = dict(re.findall(rf"`([\w-]+)` (?:takes )?([\d.]+) times(?: as long as `{REFERENCE}`)?", sentence))
    never = re.findall(r"`([\w-]+)` never gets there", sentence)
    assert set(costs) | set(never) == set(re.findall(r"`([\w-]+)`", sentence)) - {REFERENCE}
    assert costs == {name: ratios[name].text.partition(" ")[0] for name in costs} != {}
    assert {ratios[name].word for name in costs} <= {"slower", "faster"}
    assert {ratios[name].word for name in never} == {"never"}


def test_no_formulation_of_the_bench_is_drawn_that_did_not_run(results: BenchResults) -> None:
    assert not results.not_loaded
