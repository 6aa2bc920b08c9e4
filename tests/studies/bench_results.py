"""Results of a bench made by hand, for the tests of what is read from them."""

from collections.abc import Mapping, Sequence

import numpy as np

from contactverif_reports.bench.results import COUNTS, ERRORS, PARTS, BenchResults, Cell, Outcome


def make_results(
    cells: Sequence[Cell], runs: Mapping[str, Sequence[tuple[float, float]]], *, slower: float = 1.0
) -> BenchResults:
    """Return results of {formulation: (least total time, error of the forces) of each cell}; an error of inf failed.

    All times, but not the yardstick, are multiplied by `slower`. The second of two repeats takes twice as long.
    """
    shape = len(runs), len(cells)
    times, errors = (np.array([[run[place] for run in row] for row in runs.values()]) for place in (0, 1))
    seconds = np.zeros((*shape, len(PARTS), 2))
    seconds[..., -1, :] = slower * times[..., None] * [1, 2]
    seconds[..., 0, :] = seconds[..., -1, :] / 4
    unsolved = np.isinf(errors)
    kinds = np.repeat(np.where(unsolved, np.nan, errors)[..., None], len(ERRORS), axis=-1)
    return BenchResults(
        formulations=tuple(runs),
        cells=tuple(cells),
        labels={cell.scene: f"the scene {cell.scene}" for cell in cells},
        units={cell.scene: "E/h" for cell in cells if cell.scene != "rings"},
        segments=np.full(len(cells), 6),
        unknowns=np.full(len(cells), 28),
        outcomes=np.where(unsolved, int(Outcome.NOT_SOLVED), int(Outcome.SOLVED)),
        errors=kinds,
        counts=np.ones((*shape, len(COUNTS)), np.int64),
        seconds=seconds,
        wall=seconds[:, :, -1].copy(),
        yardstick=np.full((len(cells), 2), 0.5),
        remarks={(list(runs)[row], int(cell)): "2-cycle" for row, cell in np.argwhere(unsolved).tolist()},
        not_loaded={"absent": "no such module"},
        provenance={"command": "contactverif bench", "seed": "0"},
    )
