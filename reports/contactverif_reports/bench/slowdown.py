"""Slowdowns since an earlier bench, told by ratios, since seconds depend on the machine.

The time of each run counts in units of the yardstick, a fixed piece of work that was done in the same repeats. The
ratio of a formulation is the median over all runs that both benches have; a quarter of the runs may be disturbed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif_reports.bench.results import PARTS, BenchResults, Cell

SLOWER = 1.25  # A median ratio above this is a slowdown: repeats of one bench differ by less than a tenth.


@dataclass(frozen=True, slots=True)
class Slowdown:
    """The time of a formulation over that of the earlier bench."""

    formulation: str  # The formulation.
    n_runs: int  # The number of runs that both benches have, with a time.
    ratio: float  # The median of the ratios; NaN without runs.
    low: float  # The quartiles of the ratios.
    high: float
    parts: Mapping[str, float]  # The median ratio of each part.

    @property
    def slower(self) -> bool:
        """Return whether the formulation became slower: by its median, and in three quarters of the runs."""
        return self.ratio > SLOWER and self.low > 1


def slowdowns(new: BenchResults, old: BenchResults) -> tuple[Slowdown, ...]:
    """Return the ratio of each formulation that both benches have."""
    names = [name for name in new.formulations if name in old.formulations]
    common = [cell for cell in new.cells if cell in old.cells]
    return tuple(_slowdown(name, common, new, old) for name in names)


def _slowdown(name: str, cells: list[Cell], new: BenchResults, old: BenchResults) -> Slowdown:
    times = [_in_yardsticks(results, name, cells) for results in (new, old)]
    with np.errstate(invalid="ignore", divide="ignore"):
        ratios = times[0] / times[1]  # (n_cells, n_parts)
    totals = ratios[:, list(PARTS).index("total")]
    totals = totals[np.isfinite(totals)]
    low, middle, high = np.quantile(totals, [0.25, 0.5, 0.75]) if len(totals) else (nan, nan, nan)
    parts = {part: _median(ratios[:, place]) for place, part in enumerate(PARTS)}
    return Slowdown(name, len(totals), float(middle), float(low), float(high), parts)


def _in_yardsticks(results: BenchResults, name: str, cells: list[Cell]) -> FloatArray:
    """Return the least times (n_cells, n_parts) over the least time of the yardstick in the same cell."""
    places = [results.cells.index(cell) for cell in cells]
    times = results.fastest[results.formulations.index(name), places]
    over: FloatArray = times / results.yardstick[places].min(axis=-1, keepdims=True)
    return over


def _median(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else nan
