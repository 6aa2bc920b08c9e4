"""The terminal's view of a bench in 80 columns: what an error costs."""

from __future__ import annotations

from rich.table import Table

from contactverif.cli.console import plain_table
from contactverif_reports.bench.cost_tables import costs_at, format_seconds, format_share, ratios_at
from contactverif_reports.bench.costs import REFERENCE
from contactverif_reports.bench.results import RULE, BenchResults


def costs_table(results: BenchResults, scene: str) -> Table:
    """Return what the largest target of a scene costs, and how many of all runs failed."""
    target = results.targets[scene][0]
    title = f"{scene}: {results.label(scene)}\nto an error of {format_share(target)} in the forces, at {RULE.label}"
    heads = ("reached", "evaluation", f"over {REFERENCE}", "systems", "factor", "failed")
    table = plain_table(title, "formulation", numbers=heads, dense=True)
    ratios = ratios_at(results, scene, target, "evaluation")
    for name, cost in costs_at(results, scene, target).items():
        differences = "*" if results.uses_differences(name, scene) else ""
        reached = f"{int(cost.reached.sum())}/{len(cost.reached)}"
        systems = f"{cost.middle('systems'):.0f}" if cost.is_usual else "∞"
        seconds = [format_seconds(cost.middle(number)) for number in ("evaluation", "factorisation")]
        ratio = ratios[name].text if name in ratios else ""
        failed = results.failures(name, scene)
        table.add_row(
            f"{name}{differences}", reached, seconds[0], ratio, systems, seconds[1], f"{failed.sum()}/{failed.size}"
        )
    return table
