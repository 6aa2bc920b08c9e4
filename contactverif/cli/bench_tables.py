"""The terminal's view of a bench: the time to reach an error, in 80 columns, and what became slower."""

from __future__ import annotations

from collections.abc import Sequence
from math import isinf, isnan

from rich.table import Table
from rich.text import Text

from contactverif.cli.console import plain_table
from contactverif_reports.bench.results import PARTS, BenchResults, Outcome
from contactverif_reports.bench.slowdown import SLOWER, Slowdown
from contactverif_reports.bench.work_precision import REFERENCE, TARGETS, cost_ratio, time_to_reach


def targets_table(results: BenchResults, scene: str) -> Table:
    """Return the time to reach each error on a scene, in milliseconds, and the parts of the time."""
    times = [f"ms to\n{target:g}" for target in TARGETS]
    numbers = (*times, f"{REFERENCE}\n= 1", "plugin\n%", "linear\n%", "failed")
    table = plain_table(f"{scene}: {results.label(scene)}", "formulation", numbers=numbers, dense=True)
    for name in results.formulations:
        table.add_row(name, *_cells(results, name, scene))
    return table


def slowdown_table(changes: Sequence[Slowdown]) -> Table:
    """Return the ratios to an earlier bench."""
    title = "time over that of the earlier bench, in units of the yardstick"
    table = plain_table(title, "formulation", numbers=("runs", "ratio", "quartiles", ""), dense=True)
    for change in changes:
        quartiles = f"{change.low:.2f} to {change.high:.2f}"
        word = Text("slower", style="magenta") if change.slower else Text("")
        table.add_row(change.formulation, f"{change.n_runs}", f"{change.ratio:.2f}", quartiles, word)
    return table


def slowdown_sentence(changes: Sequence[Slowdown]) -> str:
    """Return which formulations became slower."""
    slower = [change.formulation for change in changes if change.slower]
    if not changes:
        return "The earlier bench has none of these formulations."
    if slower:
        return f"Slower than {SLOWER:g} times: {', '.join(slower)}."
    return "Nothing became slower."


def _cells(results: BenchResults, name: str, scene: str) -> list[str]:
    selection, row = results.cells_of(scene), results.formulations.index(name)
    times = [_milliseconds(time_to_reach(results, name, scene, target)) for target in TARGETS]
    ratio = cost_ratio(results, name, scene) if REFERENCE in results.formulations else float("nan")
    solved = selection & (results.outcomes[row] == Outcome.SOLVED)
    sums = dict(zip(PARTS, results.fastest[row, solved].sum(axis=0), strict=True))
    shares = ["–", "–"]
    if solved.any():
        plugin = sum(sums[part] for part in ("pair", "residual", "tangent", "differences"))
        shares = [f"{100 * part / sums['total']:.0f}" for part in (plugin, sums["solve"])]
    n_failed = int((selection & ~solved).sum())
    word = "∞" if isinf(ratio) else "–" if isnan(ratio) else f"{ratio:.2g}"
    differences = "*" if results.uses_differences(name) else ""
    return [*times, word, f"{shares[0]}{differences}", shares[1], f"{n_failed}/{int(selection.sum())}"]


def _milliseconds(seconds: float) -> str:
    return "∞" if isinf(seconds) else f"{1e3 * seconds:.3g}"
