"""Changes since an earlier bench: counts are compared exactly, and seconds by ratios with intervals.

Counts need no clock. Seconds count in those of the factorisations, which are the same work where counts agree, so that
another machine changes nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif_reports.bench.intervals import Ratio, ratio_of
from contactverif_reports.bench.results import COUNTS, WORK, BenchResults


@dataclass(frozen=True, slots=True)
class Change:
    """A formulation beside itself in an earlier bench."""

    formulation: str
    n_cells: int  # The number of cells that both benches have
    counts: Mapping[str, tuple[int, int]]  # {count: (sum here, sum there)} of the counts that differ in some run
    evaluation: Ratio  # The seconds of one evaluation over those there

    @property
    def counts_text(self) -> str:
        """The counts that differ, in words."""
        texts = [f"{kind}: {new} instead of {old}" for kind, (new, old) in self.counts.items()]
        return "; ".join(texts) or "all counts are equal"

    @property
    def sentence(self) -> str:
        """The change in words."""
        return (
            f"{self.formulation}, {self.n_cells} cells: one evaluation takes {self.evaluation.text} times as long "
            f"({self.evaluation.word}); {self.counts_text}."
        )

    @property
    def worse(self) -> bool:
        """True if some count grew, or an evaluation takes longer."""
        return any(new > old for new, old in self.counts.values()) or self.evaluation.word == "slower"


def changes(new: BenchResults, old: BenchResults) -> tuple[Change, ...]:
    """Return the change of each formulation that both benches have."""
    common = [cell for cell in new.cells if cell in old.cells]
    places = [[results.cells.index(cell) for cell in common] for results in (new, old)]
    names = [name for name in new.formulations if name in old.formulations] if common else []
    machine = _speed(new, places[0], names) / _speed(old, places[1], names) if names else 1.0
    return tuple(_change(name, (new, old), places, machine) for name in names)


def _speed(results: BenchResults, cells: list[int], names: list[str]) -> float:
    """Return the median of the seconds of a factorisation."""
    rows = [results.formulations.index(name) for name in names]
    seconds = results.factorisation[np.ix_(rows, cells)]
    finite = seconds[np.isfinite(seconds)]
    return float(np.median(finite)) if len(finite) else 1.0


def _change(name: str, benches: tuple[BenchResults, BenchResults], places: list[list[int]], machine: float) -> Change:
    seconds: list[FloatArray] = []
    counts = []
    for results, cells in zip(benches, places, strict=True):
        row = results.formulations.index(name)
        seconds.append(results.evaluation[row, cells])
        table = {kind: results.counts[row, cells, :, place] for place, kind in enumerate(COUNTS)}
        entries = {kind.replace("_", " "): results.work[row, cells, place] for place, kind in enumerate(WORK)}
        counts.append(table | entries)
    differing = {
        kind: (int(counts[0][kind].sum()), int(counts[1][kind].sum()))
        for kind in counts[0]
        if (counts[0][kind] != counts[1][kind]).any()
    }
    n_processes = min(values.shape[1] for values in seconds)
    new, old = (values[:, :n_processes] for values in seconds)
    return Change(name, len(places[0]), differing, ratio_of(new / machine, old))
