"""A count is held against chance by the binomial distribution."""

from math import comb

import pytest

from contactverif.contract.result import BY_CHANCE, exceeds


@pytest.mark.parametrize(("number", "share"), [(100, 0.04), (900, 0.002), (20, 0.3)])
def test_a_count_exceeds_a_share_where_the_binomial_sum_says_so(number: int, share: float) -> None:
    terms = [comb(number, n) * share**n * (1 - share) ** (number - n) for n in range(number + 1)]
    answers = [exceeds(count, number, share) for count in range(number + 1)]
    assert answers == [sum(terms[count:]) < BY_CHANCE for count in range(number + 1)]
    assert not answers[0]
    assert answers[-1]


@pytest.mark.parametrize(
    ("count", "number", "share", "answer"),
    [(0, 0, 0.1, False), (0, 100, 0.0, False), (1, 100, 0.0, True), (100, 100, 1.0, False)],
)
def test_no_cases_and_certain_shares_need_no_luck(count: int, number: int, share: float, answer: bool) -> None:
    assert exceeds(count, number, share) is answer
