"""The page of a bench as Markdown, for a folder of results that is kept."""

from __future__ import annotations

from math import isinf, isnan

from contactverif_reports.bench.clocks import clock_sentences
from contactverif_reports.bench.results import BenchResults
from contactverif_reports.bench.work_precision import (
    REFERENCE,
    TARGETS,
    cost_ratio,
    cost_sentence,
    figure_sentence,
    harness_sentence,
    pair_profiles,
    time_to_reach,
)

COST_PICTURE, PROFILE_PICTURE = "cost.svg", "profiles.svg"


def picture_of(scene: str) -> str:
    """Return the file name of the figure of a scene."""
    return f"{scene}.svg"


def bench_markdown(results: BenchResults, report: str, with_pictures: bool) -> str:
    """Return the page."""
    facts = results.provenance
    version, commit = (facts.get(name, "unknown") for name in ("contactverif_version", "commit"))
    n_repeats = results.seconds.shape[-1]
    costs = filter(None, (cost_sentence(results, scene) for scene in results.scenes))
    parts = [
        "# Speed against error",
        f"`{facts.get('command', '')}`",
        f"The command above wrote these files with contactverif {version}, commit {commit}.",
        "Each formulation solves the same scenes, whose exact solution is known, on meshes fine and coarse and at "
        f"penalties soft to stiff. All take turns, {n_repeats} times, on one thread; the least time of a run counts, "
        "in seconds of the processor. The time is that of a whole solution by Newton's method, from the first iterate "
        "to the last. Bodies are condensed before.",
        "\n".join(f"- {text}" for text in [*costs, *clock_sentences(results)]),
        harness_sentence(results),
    ]
    if with_pictures:
        parts.append(f"![Time to an error of 1 % in the forces, over that of {REFERENCE}]({COST_PICTURE})")
    parts += ["## Error against time", _HOW_TO_READ]
    for scene in results.scenes:
        label = results.label(scene)
        parts.append(f"### {label[:1].upper()}{label[1:]}")
        if with_pictures:
            parts.append(f"![Error of the forces against time: {label}]({picture_of(scene)})")
        parts += [figure_sentence(results, scene), _table(results, scene)]
    parts.append(_profiles(results, with_pictures))
    if report:
        parts.append(
            f"`{report}` holds every repeat; `contactverif bench {report} --out bench.html` makes a page of it, and "
            f"`contactverif bench NAME … --against {report}` says what became slower."
        )
    return "\n\n".join(part for part in parts if part) + "\n"


_HOW_TO_READ = (
    "A line is one formulation at one penalty on finer and finer meshes. A run without a solution is a cross at the "
    "upper edge. The grey steps are the Pareto front of all formulations. The tables say how long the cheapest run "
    "takes whose error of the nodal forces is at most the number above, in milliseconds; ∞ where no run gets there."
)


def _table(results: BenchResults, scene: str) -> str:
    heads = ["", *(f"{target:g}" for target in TARGETS), f"at 0.01 over {REFERENCE}"]
    lines = [f"| {' | '.join(heads)} |", f"|---|{'--:|' * (len(heads) - 1)}"]
    for name in results.formulations:
        times = [_milliseconds(time_to_reach(results, name, scene, target)) for target in TARGETS]
        lines.append(f"| `{name}` | {' | '.join(times)} | {format_ratio(cost_ratio(results, name, scene))} |")
    return "\n".join(lines)


def _profiles(results: BenchResults, with_pictures: bool) -> str:
    profiles = pair_profiles(results)
    if not profiles:
        return ""
    lines = [
        f"## Random scenes, in pairs with {REFERENCE}",
        "",
        "Blocks with random meshes, materials and penalties under a uniform pressure. A scene counts as solved if the "
        "forces are exact up to 1 %. The ratio is the median over the scenes that both solve.",
        "",
    ]
    if with_pictures:
        lines += [f"![Performance profiles in pairs]({PROFILE_PICTURE})", ""]
    lines += ["| | solved | faster | within twice | ratio |", "|---|--:|--:|--:|--:|"]
    for pair in profiles:
        shares = (f"{share:.0%}" for share in (pair.share_solved, pair.share(1), pair.share(2)))
        lines.append(f"| `{pair.formulation}` | {' | '.join(shares)} | {format_ratio(pair.median_ratio)} |")
    return "\n".join(lines)


def _milliseconds(seconds: float) -> str:
    return "∞" if isinf(seconds) else f"{1e3 * seconds:.3g}"


def format_ratio(ratio: float) -> str:
    """Return a ratio with two digits; ∞ for a formulation that never gets there, a dash where there is no ratio."""
    return "–" if isnan(ratio) else "∞" if isinf(ratio) else f"{ratio:.2g}"
