"""The clocks of a bench: what the seconds of the processor leave out, work in other processes and in several threads.

A bench counts the seconds of the processor in its own process, because another program may take the core away. The wall
clock beside it gives away what they leave out.
"""

from __future__ import annotations

import numpy as np

from contactverif_reports.bench.results import BenchResults

WAITING = 2.0  # On a machine with time to spare the least ratio is 1; a plugin that waits for others exceeds this.
THREADED = 0.8  # One thread cannot need fewer seconds of the wall clock than of the processor.


def wall_ratio(results: BenchResults, formulation: str) -> float:
    """Return the least ratio of wall clock to processor over all repeats of a formulation; NaN if none is known."""
    row = results.formulations.index(formulation)
    ratios = results.wall[row] / results.seconds[row, :, -1]
    return float(np.nanmin(ratios)) if np.isfinite(ratios).any() else float("nan")


def clock_sentences(results: BenchResults) -> list[str]:
    """Return a sentence for each formulation whose time the processor's clock of one process may not show."""
    sentences = []
    for name in results.formulations:
        ratio = wall_ratio(results, name)
        if ratio > WAITING:
            sentences.append(
                f"{name}: the wall clock never showed less than {ratio:.2g} times the processor's seconds. The machine "
                "was always busy, or the plugin works in other processes, whose seconds are not counted."
            )
        elif ratio < THREADED:
            sentences.append(
                f"{name}: the wall clock showed {ratio:.2g} times the processor's seconds. The plugin uses several "
                "threads, whose seconds are added up."
            )
    return sentences
