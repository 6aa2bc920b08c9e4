"""The scores of searches that are right, wrong on purpose, or silent."""

from dataclasses import replace
from math import inf, nan, sqrt

import pytest
from wrong_searches import (
    Search,
    answer_all,
    plain_search,
    search_at_nearest_node,
    search_from_origin,
    search_in_single_precision,
    search_with_clipped_xi,
    search_with_epsilon,
    search_without_overshoot,
)

from contactverif.studies.queries.answers import Answer, Answers
from contactverif.studies.queries.built_in_search import search_built_in
from contactverif.studies.queries.query_file import ExactAnswer, Queries
from contactverif.studies.queries.query_making import KINDS, make_queries
from contactverif.studies.queries.query_scores import Score, Scores, score_answers

N_EACH = 20
QUERIES, EXACT = make_queries(0, N_EACH * len(KINDS))
# The kinds in which neighbouring doubles decide: floats alone cannot always be right there.
BY_ROUNDOFF = {"near-tie", "node-hit", "node-almost-hit"}


def scores_of(search: Search) -> tuple[Score, dict[str, Score]]:
    scores = score_answers(QUERIES, EXACT, answer_all(QUERIES, search))
    return scores.total, {score.kind: score for score in scores.kinds}


def exact_floats() -> list[Answer]:
    """Return the exact answers, rounded once."""
    answers = []
    for truth in EXACT:
        near = truth.segments[0]
        gap = near.signed_squared_gap
        distance = sqrt(truth.squared_distance)
        answers.append(Answer(near.segment, (gap > 0) - (gap < 0), float(near.xi), distance))
    return answers


def score_one(truth: ExactAnswer, answer: Answer, number: int = 0) -> Scores:
    query = QUERIES.queries[number]
    return score_answers(Queries(QUERIES.surfaces, (query,)), [truth], Answers([answer], {}))


def number_of(kind: str) -> int:
    return next(number for number, query in enumerate(QUERIES.queries) if query.kind == kind)


def test_exact_answers_have_no_error_but_their_own_rounding() -> None:
    scores = score_answers(QUERIES, EXACT, Answers(exact_floats(), {"": 0.46}))
    total = scores.total
    assert (total.queries, total.wrong, total.undecided, total.other_rule) == (N_EACH * len(KINDS), 0, 0, 0)
    assert total.worst_xi <= 1.5
    assert total.worst_distance <= 1.5
    assert total.seconds_each == pytest.approx(1e-3)
    assert [score.kind for score in scores.kinds] == [kind.name for kind in KINDS]
    assert not scores.first_wrong


@pytest.mark.parametrize("search", ["plain", "built-in"])
def test_a_stable_search_is_wrong_only_where_neighbouring_doubles_decide(search: str) -> None:
    answers = answer_all(QUERIES, plain_search) if search == "plain" else search_built_in(QUERIES)
    scores = score_answers(QUERIES, EXACT, answers)
    assert {score.kind for score in scores.kinds if score.wrong} <= (BY_ROUNDOFF if search == "plain" else {"near-tie"})
    assert scores.total.worst_xi <= 4
    assert scores.total.worst_distance <= 4


def test_the_built_in_search_says_what_each_kind_took() -> None:
    answers = search_built_in(QUERIES)
    assert set(answers.seconds) == {kind.name for kind in KINDS}
    scores = score_answers(QUERIES, EXACT, answers)
    assert scores.total.seconds == pytest.approx(sum(answers.seconds.values()))


def test_the_segments_of_the_nearest_node_are_not_enough() -> None:
    total, kinds = scores_of(search_at_nearest_node)
    assert kinds["node-elsewhere"].wrong == kinds["node-elsewhere"].beyond_roundoff == N_EACH
    assert kinds["thin-body"].wrong > 0
    assert kinds["inside"].wrong + kinds["free-end"].wrong <= N_EACH / 2
    assert total.wrong_per_million > 1e4


def test_a_gap_from_absolute_coordinates_is_seen_at_an_offset() -> None:
    total, kinds = scores_of(search_from_origin)
    assert kinds["offset-1e8"].worst_distance > 1e6
    assert kinds["offset-1e8"].wrong_signs > 0
    assert kinds["offset-1e6"].worst_distance > 1e4
    assert total.beyond_roundoff > 0


def test_single_precision_is_seen_everywhere() -> None:
    total, kinds = scores_of(search_in_single_precision)
    assert kinds["inside"].worst_xi > 1e6
    assert total.beyond_roundoff > N_EACH


def test_an_absolute_epsilon_is_seen_in_other_units() -> None:
    _, kinds = scores_of(search_with_epsilon)
    assert kinds["other-units"].wrong_signs > N_EACH / 4


def test_a_clipped_foot_is_an_error_and_no_wrong_decision() -> None:
    total, kinds = scores_of(search_with_clipped_xi)
    assert kinds["free-end"].worst_xi > 1e6
    assert {name for name, score in kinds.items() if score.wrong} <= BY_ROUNDOFF
    assert total.worst_distance <= 4


def test_the_side_of_another_line_at_a_sharp_tip_is_a_wrong_sign() -> None:
    total, kinds = scores_of(search_without_overshoot)
    assert kinds["sharp-tip"].wrong_signs > N_EACH / 4
    assert kinds["sharp-tip"].wrong_signs == kinds["sharp-tip"].beyond_roundoff
    assert total.other_rule > 0


def test_a_tie_accepts_each_of_the_nearest_segments() -> None:
    number = number_of("three-feet")
    truth = EXACT[number]
    assert len(truth.segments) >= 3
    for near in truth.segments:
        gap = near.signed_squared_gap
        answer = Answer(near.segment, (gap > 0) - (gap < 0), float(near.xi), sqrt(truth.squared_distance))
        assert score_one(truth, answer, number).total.wrong == 0


def test_a_program_may_say_that_it_does_not_know() -> None:
    no_segment = score_one(EXACT[0], Answer(None)).total
    no_sign = score_one(EXACT[0], Answer(EXACT[0].segments[0].segment)).total
    assert (no_segment.undecided, no_segment.wrong) == (no_sign.undecided, no_sign.wrong) == (1, 0)


def test_a_sign_counts_from_four_roundings_on() -> None:
    number = number_of("inside")
    near, right = EXACT[number].segments[0], exact_floats()[number]
    wrong = replace(right, sign=-(right.sign or 1))
    assert score_one(EXACT[number], wrong, number).total.wrong_signs == 1
    tiny = replace(near, signed_squared_gap=near.signed_squared_gap / 10**40)
    on_surface = ExactAnswer(tiny.signed_squared_gap, (tiny,), 1)
    assert score_one(on_surface, wrong, number).total.wrong_signs == 0


def test_a_wrong_segment_that_is_nearly_as_near_needs_the_right_sign() -> None:
    """At 1e-30 farther only roundoff decides, but a gap of the wrong side is a mistake."""
    number = next(
        place
        for place, (query, truth) in enumerate(zip(QUERIES.queries, EXACT, strict=True))
        if query.kind == "near-tie" and truth.segments[0].segment in (1, 2)
    )
    truth, right = EXACT[number], exact_floats()[number]
    other = replace(right, segment=3 - truth.segments[0].segment)
    excused = score_one(truth, other, number).total
    assert (excused.wrong_segments, excused.beyond_roundoff) == (1, 0)
    accused = score_one(truth, replace(other, sign=-(right.sign or 1)), number)
    assert (accused.total.wrong_segments, accused.total.beyond_roundoff) == (1, 1)
    assert "with sign" in accused.first_wrong[0]


@pytest.mark.parametrize("bad", [nan, inf])
def test_a_number_that_is_not_finite_is_an_infinite_error(bad: float) -> None:
    right = exact_floats()[0]
    total = score_one(EXACT[0], replace(right, xi=bad, distance=bad)).total
    assert (total.worst_xi, total.worst_distance, total.wrong) == (inf, inf, 0)


def test_a_wrong_decision_is_told_in_words() -> None:
    truth, right = EXACT[0], exact_floats()[0]
    others = set(range(len(QUERIES.surfaces[0].segments))) - {truth.segments[0].segment}
    (words,) = score_one(truth, replace(right, segment=max(others))).first_wrong
    assert words.startswith(f"query 0, inside: segment {max(others)}, which is ")
    assert f"farther than segment {truth.segments[0].segment}" in words
