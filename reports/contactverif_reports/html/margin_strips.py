"""A histogram of the margins of a row's cases, as a small SVG strip that fits into a table.

The strips are written without matplotlib, which would take a thousand times the bytes and the time. A page may have
thousands of strips.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil, inf

import numpy as np
from markupsafe import Markup

from contactverif.contract.arrays import FloatArray

LEAST = -4  # Decades below the tolerance: smaller margins are drawn at the left end.
_MOST = 16  # Decades beyond the tolerance: larger margins, and failures without a number, are drawn at the right end.
_FEWEST = 2  # Decades beyond the tolerance that every axis has.
_WIDTH, _HEIGHT, _TOP = 200, 26, 7  # User units of the SVG; the mark of the worst margin is above the bars.
_BINS_A_DECADE = 2


@dataclass(frozen=True, slots=True)
class Axis:
    """A logarithmic axis of value/tolerance, the same for all strips of a page: from 10^LEAST to 10^most."""

    most: int

    @classmethod
    def from_margins(cls, margins: Iterable[FloatArray]) -> Axis:
        """Return the shortest axis that holds every finite margin, up to 10^16."""
        tops = [float(finite.max()) for sample in margins if len(finite := sample[np.isfinite(sample)])]
        top = max(tops, default=1.0)
        return cls(int(np.clip(ceil(np.log10(top)) if top > 0 else 0, _FEWEST, _MOST)))

    @property
    def n_bins(self) -> int:
        """The number of bins, half a decade each; the last one is for failures without a number."""
        return (self.most - LEAST) * _BINS_A_DECADE + 1

    def bins(self, margins: FloatArray) -> FloatArray:
        """Return the bin numbers (n,) of margins; a margin of exactly 1 is on the left of the tolerance."""
        with np.errstate(divide="ignore"):
            places = np.ceil((np.log10(margins) - LEAST) * _BINS_A_DECADE) - 1
        last = self.n_bins - 1
        return np.where(np.isinf(margins), last, np.clip(places, 0, last - 1)).astype(np.int64)

    def x(self, decade: float) -> float:
        """Return the position of a power of ten on the axis, in user units."""
        return _WIDTH * (decade - LEAST) * _BINS_A_DECADE / self.n_bins


def strip(margins: FloatArray, axis: Axis) -> Markup:
    """Draw the histogram of margins (n,), with a line at the tolerance and a mark at the worst; empty for none.

    Heights are the square roots of the shares, so that one case of thousands is visible.
    """
    known = margins[~np.isnan(margins)]
    if not len(known):
        return Markup("")
    numbers, counts = np.unique(axis.bins(known), return_counts=True)
    width, room = _WIDTH / axis.n_bins, _HEIGHT - _TOP
    tolerance = -LEAST * _BINS_A_DECADE  # The first bin beyond the tolerance.
    bars = []
    for number, count in zip(numbers.tolist(), counts.tolist(), strict=True):
        height = max(2.0, room * (count / len(known)) ** 0.5)
        kind = "within" if number < tolerance else "beyond"
        bars.append(
            f'<rect class="{kind}" x="{number * width + 0.5:.1f}" y="{_HEIGHT - height:.1f}" '
            f'width="{width - 1:.1f}" height="{height:.1f}"/>'
        )
    at = (numbers[-1] + 0.5) * width
    line = axis.x(0)
    median, worst = _in_words(float(np.median(known))), _in_words(float(known.max()))
    label = f"{len(known)} case{'s' * (len(known) > 1)}, median {median}, worst {worst} the tolerance"
    return Markup(
        f'<svg class="strip" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{label}">'
        f'<path class="base" d="M0 {_HEIGHT}H{_WIDTH}"/>{"".join(bars)}'
        f'<path class="tolerance" d="M{line:.1f} 0V{_HEIGHT}"/>'
        f'<path class="worst" d="M{at - 3:.1f} 0H{at + 3:.1f}L{at:.1f} 5z"/></svg>'
    )


def ticks(axis: Axis) -> Markup:
    """Draw the labels of the axis, for the head of the column."""
    step = 4 if axis.most <= 8 else 8
    decades = [LEAST, 0, *range(step, axis.most + 1, step)]
    labels = []
    for decade in decades:
        anchor = "start" if decade == LEAST else "middle" if axis.x(decade) < 0.93 * _WIDTH else "end"
        power = "1" if decade == 0 else f'10<tspan dy="-4" font-size="8">{str(decade).replace("-", "−")}</tspan>'
        labels.append(f'<text x="{axis.x(decade):.1f}" y="13" text-anchor="{anchor}">{power}</text>')
    return Markup(f'<svg class="strip ticks" viewBox="0 0 {_WIDTH} 16" aria-hidden="true">{"".join(labels)}</svg>')


def _in_words(margin: float) -> str:
    return "infinitely" if margin == inf else f"{margin:.2g} times"
