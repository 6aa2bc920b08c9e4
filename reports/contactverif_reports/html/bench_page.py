"""The page of a bench: sentences, the time to reach an error, figures, the parts of the time, and profiles."""

from __future__ import annotations

from collections.abc import Sequence
from math import isinf, isnan
from typing import Any

import numpy as np
from markupsafe import Markup

from contactverif_reports.bench.bench_text import format_ratio
from contactverif_reports.bench.clocks import clock_sentences
from contactverif_reports.bench.results import COUNTS, ERRORS, PARTS, BenchResults, Outcome
from contactverif_reports.bench.slowdown import Slowdown
from contactverif_reports.bench.work_precision import (
    REFERENCE,
    TARGETS,
    cost_ratio,
    cost_sentence,
    figure_sentence,
    pair_profiles,
    time_to_reach,
)
from contactverif_reports.html.pages import origin, render, svg_inline

_FACTS = ("command", "created", "commit", "contactverif_version", "numpy_version", "blas", "platform", "threads")


def bench_page(results: BenchResults, changes: Sequence[Slowdown] = ()) -> str:
    """Return the page of a bench."""
    from contactverif_reports.draw.bench_figures import make_cost_figure, make_profile_figure  # Importing it is slow.

    scenes = results.scenes
    profile = make_profile_figure(results)
    return render(
        "bench.html.j2",
        results=results,
        reference=REFERENCE,
        scenes=scenes,
        sentences=list(filter(None, (cost_sentence(results, scene) for scene in scenes))),
        clocks=clock_sentences(results),
        cost=svg_inline(make_cost_figure(results), f"cost beside {REFERENCE}") if _has_costs(results) else "",
        targets=[(kind, [_target_rows(results, scene, kind) for scene in scenes]) for kind in ERRORS],
        target_heads=[f"{target:g}" for target in TARGETS],
        figures=[
            (scene, [(kind, _figure(results, scene, kind), figure_sentence(results, scene, kind)) for kind in ERRORS])
            for scene in scenes
        ],
        parts=PARTS,
        shares=[_shares(results, name) for name in results.formulations],
        counts=COUNTS,
        failures=_list_failures(results),
        profiles=pair_profiles(results),
        profile=svg_inline(profile, "performance profiles") if profile is not None else "",
        changes=changes,
        n_repeats=results.seconds.shape[-1],
        about=origin(results.provenance, _FACTS),
    )


def _figure(results: BenchResults, scene: str, kind: str) -> Markup:
    """Return error against time of a scene as SVG."""
    from contactverif_reports.draw.bench_figures import make_work_precision_figure

    return svg_inline(make_work_precision_figure(results, scene, kind), f"error of the {kind} against time, {scene}")


def _has_costs(results: BenchResults) -> bool:
    """Return whether there is anything to compare the reference with."""
    return REFERENCE in results.formulations and len(results.formulations) > 1 and bool(results.scenes)


def format_time(seconds: float) -> str:
    """Return a time with two digits and its unit; ∞ for never."""
    if isnan(seconds):
        return "–"
    if isinf(seconds):
        return "∞"
    return f"{1e3 * seconds:.2g} ms" if seconds < 0.1 else f"{seconds:.2g} s"


def _target_rows(results: BenchResults, scene: str, kind: str) -> dict[str, Any]:
    """Return the rows of a scene: formulation, times to the targets, ratio to the reference."""
    rows = []
    for name in results.formulations:
        times = [format_time(time_to_reach(results, name, scene, target, kind)) for target in TARGETS]
        ratio = cost_ratio(results, name, scene) if kind == "forces" else np.nan
        rows.append((name, times, format_ratio(ratio)))
    return {"scene": scene, "rows": rows}


def _shares(results: BenchResults, name: str) -> tuple[str, list[str], list[str]]:
    """Return the share of each part in the time of all solved runs, and the mean counts of a run."""
    row = results.formulations.index(name)
    solved = results.outcomes[row] == Outcome.SOLVED
    if not solved.any():
        return name, ["–"] * len(PARTS), ["–"] * len(COUNTS)
    sums = results.fastest[row, solved].sum(axis=0)
    shares = [f"{100 * part / sums[-1]:.0f} %" for part in sums[:-1]] + [format_time(float(sums[-1] / solved.sum()))]
    return name, shares, [f"{mean:.3g}" for mean in results.counts[row, solved].mean(axis=0)]


def _list_failures(results: BenchResults) -> list[tuple[str, int, str]]:
    """Return formulation, number of runs without a solution, and how they ended."""
    rows = []
    for name in results.formulations:
        ends = [remark for (formulation, _), remark in results.remarks.items() if formulation == name]
        if ends:
            kinds = sorted(set(ends), key=ends.count, reverse=True)
            rows.append((name, len(ends), "; ".join(f"{ends.count(kind)} {kind}" for kind in kinds[:3])))
    return rows
