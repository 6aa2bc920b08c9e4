"""How far the cases of a row went towards their tolerance, as a strip that fits into a table: a small SVG of its own.

matplotlib would take a thousand times the bytes and the time of such a strip, and a page may have thousands.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil, inf

import numpy as np
from markupsafe import Markup

from contactverif.contract.arrays import FloatArray

LEAST = -4  # decades below the tolerance; what is nearer to exact stands at the left end
_MOST = 16  # decades beyond it; what fails by more, or without a number, stands at the right end
_FEWEST = 2  # decades beyond the tolerance that every axis has
_WIDTH, _HEIGHT, _TOP = 200, 26, 7  # user units; above the bars is the mark of the worst
_BINS_A_DECADE = 2


@dataclass(frozen=True, slots=True)
class Axis:
    """A logarithmic axis of value/tolerance, the same for all strips of a page: from 10^LEAST to 10^most."""

    most: int

    @classmethod
    def of(cls, margins: Iterable[FloatArray]) -> Axis:
        """That holds every finite margin, up to 10^16."""
        tops = [float(found.max()) for one in margins if len(found := one[np.isfinite(one)])]
        top = max(tops, default=1.0)
        return cls(int(np.clip(ceil(np.log10(top)) if top > 0 else 0, _FEWEST, _MOST)))

    @property
    def n_bins(self) -> int:
        """Of equal width, half a decade each; the last is for what fails without a number."""
        return (self.most - LEAST) * _BINS_A_DECADE + 1

    def bins(self, margins: FloatArray) -> FloatArray:
        """(n,) numbers of the bins of margins; a margin of exactly 1 is on the left of the tolerance."""
        with np.errstate(divide="ignore"):
            places = np.ceil((np.log10(margins) - LEAST) * _BINS_A_DECADE) - 1
        last = self.n_bins - 1
        found: FloatArray = np.where(np.isinf(margins), last, np.clip(places, 0, last - 1)).astype(np.int64)
        return found

    def x(self, decade: float) -> float:
        """Where a power of ten lies."""
        return _WIDTH * (decade - LEAST) * _BINS_A_DECADE / self.n_bins


def strip(margins: FloatArray, axis: Axis) -> Markup:
    """A histogram of the margins of decided cases (n,), the tolerance a line, the worst marked; empty for none.

    Heights are the square roots of the shares, so that one case of thousands is seen.
    """
    told = margins[~np.isnan(margins)]
    if not len(told):
        return Markup("")
    numbers, counts = np.unique(axis.bins(told), return_counts=True)
    width, room = _WIDTH / axis.n_bins, _HEIGHT - _TOP
    tolerance = -LEAST * _BINS_A_DECADE  # the first bin beyond it
    bars = []
    for number, count in zip(numbers.tolist(), counts.tolist(), strict=True):
        height = max(2.0, room * (count / len(told)) ** 0.5)
        kind = "within" if number < tolerance else "beyond"
        bars.append(
            f'<rect class="{kind}" x="{number * width + 0.5:.1f}" y="{_HEIGHT - height:.1f}" '
            f'width="{width - 1:.1f}" height="{height:.1f}"/>'
        )
    at = (numbers[-1] + 0.5) * width
    line = axis.x(0)
    median, worst = _said(float(np.median(told))), _said(float(told.max()))
    said = f"{len(told)} case{'s' * (len(told) > 1)}, median {median}, worst {worst} the tolerance"
    return Markup(
        f'<svg class="strip" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{said}">'
        f'<path class="base" d="M0 {_HEIGHT}H{_WIDTH}"/>{"".join(bars)}'
        f'<path class="tolerance" d="M{line:.1f} 0V{_HEIGHT}"/>'
        f'<path class="worst" d="M{at - 3:.1f} 0H{at + 3:.1f}L{at:.1f} 5z"/></svg>'
    )


def ticks(axis: Axis) -> Markup:
    """The labels of the axis, for the head of the column."""
    step = 4 if axis.most <= 8 else 8
    decades = [LEAST, 0, *range(step, axis.most + 1, step)]
    labels = []
    for decade in decades:
        anchor = "start" if decade == LEAST else "middle" if axis.x(decade) < 0.93 * _WIDTH else "end"
        label = "1" if decade == 0 else f'10<tspan dy="-4" font-size="8">{str(decade).replace("-", "−")}</tspan>'
        labels.append(f'<text x="{axis.x(decade):.1f}" y="13" text-anchor="{anchor}">{label}</text>')
    return Markup(f'<svg class="strip ticks" viewBox="0 0 {_WIDTH} 16" aria-hidden="true">{"".join(labels)}</svg>')


def _said(margin: float) -> str:
    return "infinitely" if margin == inf else f"{margin:.2g} times"
