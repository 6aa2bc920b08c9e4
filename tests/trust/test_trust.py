"""The trust campaign: nobody who is right is accused, few cases are undecided, and every property is needed."""

import pytest
from option_names import all_variants
from page import PAGE, campaign_counts, catchers, caught_alone, kill_rows, option_rows, page, size_of, stranger_rows
from reasons import SHARED
from stranger_cases import SEEDS
from strangers import STRANGERS
from subjects import load_property
from tables import FOLDER, read

from contactverif.contract.property import NONE_UNDECIDED
from contactverif.plugins.registry import property_ids

LEAST_CASES = 100_000
# {wrong formulation: the segments below which it is right}. All others fail on few.
LARGE = {"wrong above 100 segments": 101, "wrong with 50 master segments under two slave segments": 65}
MEAN_MUTANTS = 10  # So many mutants of a mean property are added to those of each property.
MOST_UNDECIDED, MOST_UNDECIDED_NEWTON = 0.02, 0.05
COUNTS = campaign_counts()


def test_the_page_says_what_the_tables_say() -> None:
    assert (FOLDER / PAGE).read_text(encoding="utf-8") == page()


def test_nobody_who_is_right_is_accused() -> None:
    assert sum(count["cases"] for count in COUNTS.values()) >= LEAST_CASES
    assert not [row["accused"] for row in read("campaign.csv") if row["accused"] or row["accusations"] != "0"]


def test_no_stranger_who_is_right_is_accused() -> None:
    rows = stranger_rows()
    assert {row["seed/formulation"] for row in rows} == {f"{seed}/{name}" for seed in SEEDS for name in STRANGERS}
    assert not [row["accused"] for row in rows if row["accused"] or row["accusations"] != "0"]


def test_every_formulation_with_every_option_was_asked_and_nobody_is_accused() -> None:
    """A new option, or a new word of one, is missing in the table until `tox -e trust` has asked it."""
    rows = option_rows()
    assert {row["formulation"] for row in rows} == set(all_variants(2))
    assert not [(row["formulation"], row["accused"]) for row in rows if row["accused"]]


def test_every_property_with_random_cases_was_asked() -> None:
    random = {name for name in property_ids() if not isinstance(load_property(name).cases(None), tuple)}
    assert set(COUNTS) == random
    assert all(count["cases"] > 0 for count in COUNTS.values())


@pytest.mark.parametrize("name", COUNTS)
def test_few_cases_of_right_formulations_are_undecided(name: str) -> None:
    share = COUNTS[name]["undecided"] / COUNTS[name]["cases"]
    assert share <= (MOST_UNDECIDED_NEWTON if name.startswith("newton.") else MOST_UNDECIDED)
    # A formulation is suspected above twice the share that the property states, so that share is not below this one.
    assert share <= load_property(name).usual_undecided or share <= NONE_UNDECIDED


def test_failures_are_shown_in_the_order_of_the_kill_matrix() -> None:
    """Telling is a property if few others catch its mutants; with few mutants it counts as one of the mean."""
    ids, rows, _ = kill_rows()
    caught = [catchers(row, ids) for row in rows]
    mean = sum(len(names) ** 2 for names in caught) / sum(map(len, caught))

    def key(name: str) -> tuple[bool, float]:
        sizes = [len(names) for names in caught if name in names]
        mean_size = (sum(sizes) + MEAN_MUTANTS * mean) / (len(sizes) + MEAN_MUTANTS)
        return load_property(name).bodies or name == "accuracy.arc", mean_size

    assert sorted(property_ids(), key=lambda name: load_property(name).rank) == sorted(property_ids(), key=key)


def test_every_property_is_in_the_kill_matrix_and_catches_its_mutants() -> None:
    ids, rows, _ = kill_rows()
    assert set(ids) == {row["property"] for row in read("smallest_errors.csv")} == set(property_ids())
    assert {row["caught by"] for row in rows} == set(ids)
    assert all(row[row["caught by"]].isdigit() for row in rows)
    assert len(rows) >= 200


def test_a_property_without_a_mutant_of_its_own_has_a_reason() -> None:
    assert {name for name, mutants in caught_alone().items() if not mutants} == set(SHARED)


def test_most_counterexamples_have_a_segment_a_side_and_none_is_large() -> None:
    sizes = {row["mutant"]: size_of(row)[0] for row in read("smallest_cases.csv")}
    for mutant, n_segments in LARGE.items():
        assert sizes.pop(mutant) == n_segments
    assert len(sizes) >= 180
    assert sum(size == 2 for size in sizes.values()) >= 0.5 * len(sizes)
    assert sum(size <= 5 for size in sizes.values()) >= 0.85 * len(sizes)
    assert max(sizes.values()) <= 9
