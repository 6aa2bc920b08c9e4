"""The trust campaigns: nobody who is right is accused, few cases are undecided, and every property is needed."""

import pytest
from page import PAGE, campaign_counts, catchers, caught_alone, kill_rows, page, size_of
from planned_cases import draw_cases
from right import SEEDS, all_variants
from subjects import load_property, load_subject
from tables import FOLDER, read
from zoo.right import STRANGERS

from contactverif import Verdict, judge_case
from contactverif.contract.property import NONE_UNDECIDED
from contactverif.plugins.registry import property_ids

# Reasons why a property has no wrong formulation that it alone catches: {the properties: the reason}.
_SHARED = {
    "hard.c hard.concave-corner hard.contrast hard.convex-kink hard.deep hard.free-end hard.node-hit hard.offset "
    "hard.short-segment hard.steep-slave hard.stiff hard.touch hard.zero-load": "It is a named case of what random "
    "cases of other properties reach too, and is kept because it always runs.",
    "accuracy.hertz accuracy.wavy patch.curved patch.flat.solve patch.variants patch.dead-zone": "Whole solutions show "
    "how large an error is. Its cause also shows at single states, which others look at.",
    "balance.force balance.moment": "Forces out of balance are no exact forces either, so a patch or projection "
    "property catches them too.",
    "newton.history newton.order tangent.directional": "`tangent.sparsity` judges each block of the same derivative, "
    "and so sees what a direction or a solution sees.",
    "patch.flat.nodal patch.flat.normal patch.flat.normal.solve patch.flat.published patch.flat.resultant "
    "patch.flat.single patch.flat.single.solve": "The meshes of its class belong to larger classes, and the interface "
    "and the solved scene are asked the same.",
    "patch.tilted.nodal": "`stability.local` asks about forces of tilted states too, in roundings.",
    "nodal-push projection.activity projection.segment": "Another property computes the forces from the points that "
    "the formulation reports.",
    "newton.units units": "An absolute size is wrong in an exact answer too, where lengths are small or large enough.",
    "newton.attainable stability.local stability.stiffness stability.sweep stability.translation": "Lost digits show "
    "in several ways of asking: near or far, on named or on random states, solved or not.",
    "objectivity swap": "A formulation that prefers a side, an axis or a number gives forces that are wrong in an "
    "exact answer too.",
    "complementarity": "A pairing that is wrong in a solution is wrong at single states, and `unilateral` asks there.",
}
LEAST_CASES = 100_000
# {wrong formulation: the segments below which it is right}. All others fail on few.
LARGE = {"wrong above 100 segments": 101, "wrong with 50 master segments under two slave segments": 65}
MEAN_MUTANTS = 10  # So many mutants of a mean property are added to those of each property.
MOST_UNDECIDED, MOST_UNDECIDED_NEWTON = 0.02, 0.05
COUNTS = campaign_counts()
# Properties that solve nothing, and have hardly an idle or an undecided case.
QUICK = (
    *("balance.force", "balance.moment", "mirror", "objectivity", "projection.forces", "purity", "renumbering"),
    *("units", "swap", "symmetric", "unilateral", "nodal-push", "stability.translation", "tangent.sparsity"),
)
EXAMPLES, EACH = 2, 3  # Random cases of a property; properties for each name, in rotation.


def test_the_page_says_what_the_tables_say() -> None:
    assert (FOLDER / PAGE).read_text(encoding="utf-8") == page()


@pytest.mark.parametrize("name", ["campaign.csv", "strangers.csv", "options.csv", "faces.csv"])
def test_nobody_who_is_right_is_accused(name: str) -> None:
    assert not [row["accused"] for row in read(name) if row["accused"] or row["accusations"] != "0"]


def test_everything_was_asked() -> None:
    """A new option, or a new word of one, is missing in the table until `tox -e trust` has asked it."""
    random = {name for name in property_ids() if not isinstance(load_property(name).cases(None), tuple)}
    assert set(COUNTS) == random
    assert all(count["cases"] > 0 for count in COUNTS.values())
    assert sum(count["cases"] for count in COUNTS.values()) >= LEAST_CASES
    strangers = {row["seed/formulation"] for row in read("strangers.csv")}
    assert strangers == {f"{seed}/{name}" for seed in SEEDS for name in STRANGERS}
    assert {row["formulation"] for row in read("options.csv")} == set(all_variants(2))


@pytest.mark.parametrize("part", range(4))
def test_a_formulation_with_an_option_keeps_its_promises(part: int) -> None:
    """A few random cases of each; `tox -e trust` asks each of them everything."""
    accused = []
    for number, name in list(enumerate(all_variants()))[part::4]:
        subject = load_subject(name)
        for property_id in (QUICK[(EACH * number + each) % len(QUICK)] for each in range(EACH)):
            question = load_property(property_id).for_traits(subject.traits)
            if question.refusal_of(subject) or question.needs - subject.provides:
                continue
            for case in draw_cases(question.cases(None), seed=1, examples=EXAMPLES).cases:
                outcome = judge_case(question, case, subject)
                broken = question.promise(subject.traits) is True and outcome.verdict is Verdict.FAIL
                if broken or outcome.breach or outcome.verdict is Verdict.CRASHED:
                    accused.append(f"{name}, {property_id}: {outcome.reason}")
    assert not accused


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
    shared = [name for names in _SHARED for name in names.split()]
    assert sorted(name for name, mutants in caught_alone().items() if not mutants) == sorted(shared)


def test_most_counterexamples_have_a_segment_a_side_and_none_is_large() -> None:
    # What closes on a vertex has three segments at least.
    rows = [row for row in read("smallest_cases.csv") if row["caught by"] != "intersection-free"]
    sizes = {row["mutant"]: size_of(row)[0] for row in rows}
    for mutant, n_segments in LARGE.items():
        assert sizes.pop(mutant) == n_segments
    assert len(sizes) >= 180
    assert sum(size == 2 for size in sizes.values()) >= 0.5 * len(sizes)
    assert sum(size <= 5 for size in sizes.values()) >= 0.85 * len(sizes)
    assert max(sizes.values()) <= 9
