"""Numbers about speed: those of README.md and of the site are those of `reports/bench`."""

import csv
import re
from math import log
from pathlib import Path

import pytest
from quotes import DOCS, README, ROOT

from contactverif_reports.bench_costs import REFERENCE, ratios_at
from contactverif_reports.bench_results import BenchResults
from contactverif_reports.html.bench_page import bench_markdown
from contactverif_reports.netcdf.bench_file import read_bench

BENCH = ROOT / "reports" / "bench"
HOW_TO = (DOCS / "how-to" / "speed-against-error.md").read_text(encoding="utf-8")
PEER = "ipctk"


@pytest.fixture(scope="module")
def results() -> BenchResults:
    return read_bench(BENCH / "bench.nc")


def rows(name: str) -> list[dict[str, str]]:
    with (BENCH / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def table(head: str) -> list[list[str]]:
    """Return the cells of the table of the how-to page whose first line begins with `head`."""
    lines = HOW_TO[HOW_TO.index(head) :].partition("\n\n")[0].splitlines()[2:]
    return [[cell.strip(" `") for cell in line.strip("|").split("|")] for line in lines]


def test_the_page_says_what_the_file_says(results: BenchResults) -> None:
    assert (BENCH / "README.md").read_text(encoding="utf-8") == bench_markdown(results, "bench.nc", with_pictures=True)


@pytest.mark.parametrize("page", [README, DOCS / "index.md"], ids=lambda page: page.name)
def test_a_sentence_on_cost_has_only_ratios_that_the_intervals_allow(page: Path, results: BenchResults) -> None:
    text = " ".join(page.read_text(encoding="utf-8").split())
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


def test_the_table_of_the_race_is_that_of_the_file() -> None:
    race = {(row["formulation"], row["segments"]): row for row in rows("kernels.csv")}
    names = list(dict.fromkeys(row["formulation"] for row in rows("kernels.csv")))
    expected = [
        [
            name,
            *(f"{float(race[name, size]['faster, median']):.1f}" for size in ("1000", "10000", "100000")),
            f"{float(race[name, '10000']['median / µs']):.2f}",
            f"{float(race[name, '100000']['peak / bytes']):.0f}",
        ]
        for name in names
    ]
    assert table("| | at 1,000 |") == expected
    assert PEER in names


def test_the_table_of_the_race_on_faces_is_that_of_the_file() -> None:
    race = {(row["formulation"], row["segments"]): row for row in rows("faces.csv")}
    names = list(dict.fromkeys(row["formulation"] for row in rows("faces.csv")))
    *ours, (peer, *_, peers_time, peers_bytes) = table("| on faces |")
    assert len(ours) == len(names) - 1
    assert [peer] == [PEER]
    for name, (words, *ratios, time, size) in zip(names, ours, strict=False):
        assert words.replace("`", "") == name
        for cell, segments in zip(ratios, ("1000", "10000", "100000"), strict=True):
            median, least, greatest = (
                f"{float(race[name, segments][f'faster{each}']):.1f}"
                for each in (", median", " than ipctk, least", ", greatest")
            )
            assert cell == f"{median} ({least} to {greatest})"
        assert time == f"{float(race[name, '10000']['median / µs']):.1f}"
        assert size == f"{float(race[name, '100000']['peak / bytes']):.0f}"
    ratio = float(race[names[0], "1000000"]["median / µs"]) / float(race[names[0], "10000"]["median / µs"])
    assert f"to the power {1 + log(ratio) / log(100):.2f}." in HOW_TO
    assert peers_time == f"{float(race[names[-1], '10000']['median / µs']):.1f}"
    assert peers_bytes == f"{float(race[names[-1], '100000']['peak / bytes']):.0f}"


def test_the_table_of_fine_waves_is_that_of_the_file() -> None:
    expected = [[row["formulation"], row["forces"], row["systems"]] for row in rows("fine_waves.csv")]
    assert table("| | error of the forces |") == expected[: len(table("| | error of the forces |"))]


def test_the_powers_of_the_cost_are_those_of_the_file() -> None:
    time = {(row["formulation"], row["segments"]): float(row["median / µs"]) for row in rows("kernels.csv")}
    text = HOW_TO[HOW_TO.index("From 10,000 to 1,000,000 segments") :].partition("\n\n")[0]
    powers = re.findall(r"`([\w-]+)`(?: grows\s+like their number to the power)? ([\d.]+\d)", text)
    assert len(powers) == 3
    for name, power in powers:
        ratio = time[name, "1000000"] / time[name, "10000"]
        assert power == f"{1 + log(ratio) / log(100):.2f}", name


def test_the_table_of_the_steps_is_that_of_the_file() -> None:
    head, *_ = rows("steps.csv")[0]
    steps = {row[head]: float(row["10000"]) for row in rows("steps.csv")}
    names = {"search and walk": "search and walk, with a tree"}
    for name, value in table("| step | µs a slave segment"):
        assert value == f"{steps[names.get(name, name)]:.2f}", name
