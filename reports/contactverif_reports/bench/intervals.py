"""Ratios with intervals: a ratio is a geometric mean over instances and processes, and the interval resamples both.

Within one process of a plugin intervals are too narrow: those of two processes may exclude one another.

References
----------
Efron & Tibshirani, An Introduction to the Bootstrap (1993), Chapter 13 (percentile intervals).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isinf, isnan, nan

import numpy as np

from contactverif.contract.arrays import FloatArray

ALIKE = 0.05  # Two formulations are as fast if the whole interval of their ratio is this near to 1.
_RESAMPLES = 2000
_LEAST = 5  # Fewer instances give no interval.
_SEED = 27


@dataclass(frozen=True, slots=True)
class Ratio:
    """A ratio with its interval of 95 %."""

    middle: float  # Infinite if the formulation does not get there; NaN if the reference does not.
    low: float = nan  # NaN where there is no interval.
    high: float = nan

    @property
    def word(self) -> str:
        """The conclusion: as fast, faster, slower, or not told apart; "never" and nothing where there is no ratio."""
        if isnan(self.middle):
            return ""
        if isinf(self.middle):
            return "never"
        if self.low >= 1 / (1 + ALIKE) and self.high <= 1 + ALIKE:
            return "as fast"
        return "slower" if self.low > 1 else "faster" if self.high < 1 else "not told apart"

    @property
    def text(self) -> str:
        """The ratio with its interval, as "1.10 [1.08, 1.11]"; ∞ or a dash where there is none."""
        if isnan(self.middle) or isinf(self.middle):
            return "–" if isnan(self.middle) else "∞"
        digits = 0 if self.middle >= 100 else 1 if self.middle >= 10 else 2
        interval = "" if isnan(self.low) else f" [{self.low:.{digits}f}, {self.high:.{digits}f}]"
        return f"{self.middle:.{digits}f}{interval}"


def ratio_of(values: FloatArray, others: FloatArray) -> Ratio:
    """Return the ratio of positive values (n_instances, n_processes) to those of another on the same instances.

    Entries that are not finite are left out with their whole instance.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        logarithms = np.log(values) - np.log(others)
    logarithms = logarithms[np.isfinite(logarithms).all(axis=1)]
    n_instances, n_processes = logarithms.shape
    if not n_instances:
        return Ratio(nan)
    middle = float(np.exp(logarithms.mean()))
    if n_instances < _LEAST:
        return Ratio(middle)
    dice = np.random.default_rng(_SEED)
    shares = [dice.multinomial(n, np.full(n, 1 / n), _RESAMPLES) / n for n in (n_instances, n_processes)]
    means = np.einsum("bi,ip,bp->b", shares[0], logarithms, shares[1])
    low, high = np.exp(np.quantile(means, [0.025, 0.975]))
    return Ratio(middle, float(low), float(high))
