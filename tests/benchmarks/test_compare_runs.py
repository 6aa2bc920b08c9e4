"""Two runs of the benchmarks are compared by the quotient of their ratios."""

import json
from pathlib import Path

import pytest
from compare_runs import Benchmarks, compare, lines_of_changes, lines_of_run

STORED = Path(__file__).parents[2] / "reports" / "bench" / "benchmarks.json"


def a_run(factor: float = 1.0, reference: str = "a copy") -> Benchmarks:
    """Return a run of one benchmark, so many times slower beside its reference."""
    ratio = {"least": 1.9 * factor, "median": 2.0 * factor, "greatest": 2.2 * factor}
    entry = {"name": "mine", "group": "search", "reference": reference, "seconds": 1.0, "ratio": ratio}
    return {("search", "mine"): entry}


@pytest.mark.parametrize(("factor", "word"), [(1.5, "slower"), (1.2, ""), (1.0, ""), (0.5, "faster")])
def test_a_change_is_told_by_medians_and_by_turns_that_do_not_overlap(factor: float, word: str) -> None:
    (change,) = compare(a_run(), a_run(factor))
    assert (change.quotient, change.word) == (pytest.approx(factor), word)


def test_a_wide_spread_is_no_change() -> None:
    old, new = a_run(), a_run(1.5)
    old["search", "mine"]["ratio"]["greatest"] = 9.0
    assert compare(old, new)[0].word == ""


def test_another_reference_is_not_compared_and_counted() -> None:
    assert compare(a_run(), a_run(3.0, "a sort")) == []
    assert lines_of_changes([], 1)[-1] == "0 compared: 0 slower, 0 faster; 1 in one file alone"


def test_the_tables_name_each_benchmark() -> None:
    assert any("mine" in line and "a copy" in line for line in lines_of_run(a_run()))
    assert "slower" in lines_of_changes(compare(a_run(), a_run(2.0)), 0)[1]


def test_the_stored_run_names_the_processor_and_no_machine() -> None:
    text = STORED.read_text()
    facts = json.loads(text)
    assert set(facts) == {"processor", "machine", "python", "versions", "commit", "created", "turns", "benchmarks"}
    assert str(STORED.parents[2]) not in text
    assert not [word for word in text.replace('"', " ").split() if word.startswith("/")]
    assert {entry["ratio"].keys() == {"least", "median", "greatest"} for entry in facts["benchmarks"]} == {True}
