"""The tables and sentences of a bench as text, the same for terminal, Markdown and page.

Rule: a sentence has only ratios whose interval excludes 1, and says of which formulations nothing is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isinf, isnan

from contactverif_reports.bench.costs import (
    BODIES,
    NUMBERS,
    REFERENCE,
    Cost,
    best_of,
    cost_of,
    cost_ratio,
    iterations_by_start,
    start_names,
    total_ratio,
)
from contactverif_reports.bench.intervals import Ratio
from contactverif_reports.bench.results import BenchResults

Table = tuple[list[str], list[list[str]]]  # Heads and rows, the formulation first
MOST_NAMES = 4  # A sentence names no more formulations of a kind than these; the table has all.


def costs_at(results: BenchResults, scene: str, target: float) -> dict[str, Cost]:
    """Return {formulation: what an error costs it}."""
    return {name: cost_of(results, name, scene, target) for name in results.formulations}


def ratios_at(results: BenchResults, scene: str, target: float, number: str) -> dict[str, Ratio]:
    """Return {formulation: ratio of a number to that of the reference} of all others; empty without the reference."""
    costs = costs_at(results, scene, target)
    if REFERENCE not in costs:
        return {}
    return {name: cost_ratio(cost, costs[REFERENCE], number) for name, cost in costs.items() if name != REFERENCE}


def cost_table(results: BenchResults, scene: str, target: float) -> Table:
    """Return the three numbers of each formulation at an error, with the ratios to the reference."""
    heads = ["reached", "segments", "best", "evaluation", "ratio", "systems", "factors", "factorisation", "ratio"]
    ratios = {number: ratios_at(results, scene, target, number) for number in ("evaluation", "factorisation")}
    rows = []
    for name, cost in costs_at(results, scene, target).items():
        share = f"{int(cost.reached.sum())}/{len(cost.reached)}"
        texts = {number: ratio[name].text if name in ratio else "1" for number, ratio in ratios.items()}
        if not cost.is_usual:
            best = best_of(results, name, scene, target)
            rows.append([name, share, "∞", _count(best.middle("segments")), *["∞"] * 6])
            continue
        row = [
            name,
            share,
            _count(cost.middle("segments")),
            _count(best_of(results, name, scene, target).middle("segments")),
        ]
        row += [format_seconds(cost.middle("evaluation")), texts["evaluation"], _count(cost.middle("systems"))]
        row += [_count(cost.middle("factors")), format_seconds(cost.middle("factorisation")), texts["factorisation"]]
        rows.append(row)
    return heads, rows


def split_targets(results: BenchResults, scene: str) -> tuple[list[float], str]:
    """Return the errors that a formulation reaches, at the fixed penalty or the best, and a sentence of the rest."""
    reached = [target for target in results.targets[scene] if _is_reached(results, scene, target)]
    others = [format_share(target) for target in results.targets[scene] if target not in reached]
    words = f"No formulation comes to an error of {' or '.join(others)} on the meshes of {scene}."
    return reached, words if others else ""


def _is_reached(results: BenchResults, scene: str, target: float) -> bool:
    costs = costs_at(results, scene, target)
    return any(cost.is_usual or best_of(results, name, scene, target).is_usual for name, cost in costs.items())


def totals_table(results: BenchResults, scene: str, target: float) -> Table:
    """Return the ratios of whole solutions to the reference, for bodies that are cheap, even and dear."""
    costs = costs_at(results, scene, target)
    rows = [
        [name, *(total_ratio(cost, costs[REFERENCE], share).text for share in BODIES.values())]
        for name, cost in costs.items()
        if name != REFERENCE and REFERENCE in costs
    ]
    return list(BODIES), rows


def starts_table(results: BenchResults, scene: str) -> Table:
    """Return the linear systems from each start on each mesh, a row for each formulation and start."""
    rows = [
        [f"{name}, {start}", *iterations_by_start(results, name, scene, variant)]
        for name in results.formulations
        for start, variant in start_names().items()
    ]
    return list(map(str, results.meshes_of(scene))), rows


def cost_sentences(results: BenchResults, scene: str, target: float) -> list[str]:
    """Return what can be said of one evaluation and of linear systems at an error; nothing without the reference."""
    if REFERENCE not in results.formulations or len(results.formulations) < 2:
        return []
    start = f"On {scene}, at an error of {format_share(target)} in the forces"
    if not cost_of(results, REFERENCE, scene, target).is_usual:
        return [f"{start}, there is no ratio, since {REFERENCE} does not get there."]
    words = {number: _put_in_words(ratios_at(results, scene, target, number)) for number in ("evaluation", "systems")}
    return [f"{start}, {NUMBERS[number]} over those of {REFERENCE}: {text}." for number, text in words.items()]


def _put_in_words(ratios: dict[str, Ratio]) -> str:
    """Return who is faster and slower by how much, who is as fast, who is not told apart, and who never gets there."""
    groups: dict[str, list[str]] = {"faster": [], "slower": [], "as fast": [], "not told apart": [], "never": []}
    for name, ratio in sorted(ratios.items(), key=lambda pair: pair[1].middle):
        word = "not told apart" if isnan(ratio.middle) else ratio.word
        groups[word].append(f"{name} {ratio.text}" if word in ("faster", "slower") else name)
    titles = {"faster": "less", "slower": "more", "as fast": "alike within 5 %", "never": "never there"}
    return "; ".join(f"{titles.get(word, word)}: {_enumerate(names)}" for word, names in groups.items() if names)


def _enumerate(names: Sequence[str]) -> str:
    """Return some names, and how many more there are."""
    more = len(names) - MOST_NAMES
    return ", ".join([*names[:MOST_NAMES], *([f"{more} more"] if more > 0 else [])])


def format_share(target: float) -> str:
    """Return an error as a share, as "1 %"."""
    return f"{100 * target:g} %"


def format_seconds(seconds: float) -> str:
    """Return seconds with three digits and their unit; ∞ for never, a dash for no number."""
    if isnan(seconds) or isinf(seconds):
        return "–" if isnan(seconds) else "∞"
    unit, factor = ("µs", 1e6) if seconds < 1e-3 else ("ms", 1e3) if seconds < 1 else ("s", 1.0)
    return f"{factor * seconds:.3g} {unit}"


def _count(number: float) -> str:
    return "∞" if isinf(number) else f"{number:.0f}"
