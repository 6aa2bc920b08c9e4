"""The chance of a count: whether more cases are undecided than a share explains."""

from __future__ import annotations

from math import exp, lgamma, log, log1p

from contactverif.contract.arrays import UNIT_ROUNDOFF

# A run has about a thousand rows, and accuses one of them by chance once in ten runs.
BY_CHANCE = 1e-4


def exceeds(count: int, number: int, share: float) -> bool:
    """Return whether `count` or more of `number` cases, each of probability `share`, are rarer than `BY_CHANCE`."""
    if count <= number * share:
        return False
    return _at_least(count, number, share) < BY_CHANCE


def _at_least(count: int, number: int, share: float) -> float:
    """Return the binomial probability of `count` or more, for a count above `number` × `share`.

    The term of n + 1 is ratio × the term of n, with ratio = (N − n) p / ((n + 1) (1 − p)). It is below 1 for n above
    N p, and falls with n. So all terms behind n add up to at most term × ratio / (1 − ratio). They are left out as soon
    as this is below the roundoff of the sum.
    """
    total = 0.0
    for n in range(count, number + 1):
        term = _probability(n, number, share)
        total += term
        ratio = (number - n) * share / ((n + 1) * (1 - share)) if share < 1 else 0.0
        if term * ratio <= UNIT_ROUNDOFF * total * (1 - ratio):
            break
    return total


def _probability(count: int, number: int, share: float) -> float:
    if not 0 < share < 1:
        return float(count == number * share)
    exponent = count * log(share) + (number - count) * log1p(-share)
    return exp(exponent + lgamma(number + 1) - lgamma(count + 1) - lgamma(number - count + 1))
