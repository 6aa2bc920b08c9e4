"""The page of a bench as Markdown, for a folder of results that is kept."""

from __future__ import annotations

from contactverif_reports.bench.cost_tables import (
    Table,
    cost_sentences,
    cost_table,
    format_share,
    split_targets,
    starts_table,
    totals_table,
)
from contactverif_reports.bench.costs import REFERENCE
from contactverif_reports.bench.results import RULE, BenchResults

COST_PICTURE, RUNTIME_PICTURE, STARTS_PICTURE = "cost.svg", "runtimes.svg", "starts.svg"
MOST_CURVES = 6  # More curves in one panel cannot be told apart.


def picture_of(scene: str) -> str:
    """Return the file name of the figure of a scene."""
    return f"{scene}.svg"


def picture_of_each(scene: str) -> str:
    """Return the file name of the figure with a panel for each formulation."""
    return f"{scene}-each.svg"


HOW_TO_READ = (
    f"The penalty is {RULE.penalty:g} E/h, fixed beforehand; dashed lines and the column “best” have the best of three "
    "penalties, chosen afterwards. All start from the same guess. A point is the median over the instances of a mesh: "
    "the other body is the slave, the master is graded, the edge shifted, the size changed by up to a fifth. Contact "
    "no longer limits an error at its floor. Of pressures that is the L2 error of the best linear one on the slave's "
    f"mesh (dotted, at the times of {REFERENCE}); at reported points alone an error may be lower. Of forces and "
    "displacements it is the curve of sts, which integrates each overlap of two segments exactly where it is closed: "
    "with 12 points in place of 3 its errors are the same on wavy to 1e-10, and on hertz to 3 %."
)
THREE_NUMBERS = (
    "An error costs three numbers, and they are not added up, since what a linear system costs depends on the bodies. "
    "One evaluation is search, forces and tangent, timed by the plugin's process. Linear systems are counted. One "
    "factorisation is that of the whole system with all bodies, by SuperLU. The coarsest mesh that reaches the error "
    "counts. A ratio is a geometric mean over instances and processes, with an interval of 95 % that resamples both."
)
TOTALS = (
    "The ratio of whole solutions if one linear system costs the reader a tenth of an evaluation of "
    f"{REFERENCE} (cheap bodies), as much (even), or ten times as much (dear)."
)
DEEPEST_START = "The median number of linear systems from there, on all meshes, and the share that find no solution."
STARTS = (
    "Linear systems on each mesh from the guess (near), from ten times its depth (deep), and from a thousand times "
    "(deepest)."
)


def bench_markdown(results: BenchResults, report: str, with_pictures: bool) -> str:
    """Return the page."""
    facts = results.provenance
    version, commit = (facts.get(name, "unknown") for name in ("contactverif_version", "commit"))
    parts = [
        "# Speed against error",
        f"`{facts.get('command', '')}`",
        f"The command above wrote these files with contactverif {version}, commit {commit}: {results.settings}.",
        THREE_NUMBERS,
    ]
    if with_pictures:
        parts.append(f"![What an error costs: evaluation, linear systems, factorisation]({COST_PICTURE})")
    parts.append(HOW_TO_READ)
    for scene in results.scenes:
        parts += _scene(results, scene, with_pictures)
    if with_pictures:
        parts += [
            "## A thousand times as deep",
            DEEPEST_START,
            f"![Who fails from a thousand times the depth of the guess]({STARTS_PICTURE})",
        ]
        parts += ["## Runtimes", f"![Share of targets that are reached within a time]({RUNTIME_PICTURE})"]
    if report:
        parts.append(
            f"`{report}` holds every instance; `contactverif bench {report} --out bench.html` makes a page of it, and "
            f"`contactverif bench NAME … --against {report}` says what became slower."
        )
    return "\n\n".join(part for part in parts if part) + "\n"


def _scene(results: BenchResults, scene: str, with_pictures: bool) -> list[str]:
    """Return the part of a scene."""
    label = results.label(scene)
    parts = [f"## {label[:1].upper()}{label[1:]}"]
    if with_pictures and len(results.meshes_of(scene)) > 1:
        parts.append(f"![Errors against one evaluation and one factorisation: {label}]({picture_of(scene)})")
        if len(results.formulations) > MOST_CURVES:
            parts.append(f"[Each formulation in a panel of its own]({picture_of_each(scene)})")
    reached, words = split_targets(results, scene)
    for target in reached:
        sentences = cost_sentences(results, scene, target)
        parts += [f"### {format_share(target)} on {scene}", "\n".join(f"- {sentence}" for sentence in sentences)]
        parts.append(_markdown(cost_table(results, scene, target)))
    parts.append(words)
    heads, rows = totals_table(results, scene, results.targets[scene][0])
    if rows:
        parts += [f"### Whole solutions on {scene}", TOTALS, _markdown((heads, rows))]
    return [*parts, f"### Starts on {scene}", STARTS, _markdown(starts_table(results, scene))]


def _markdown(table: Table) -> str:
    """Return a table in Markdown."""
    heads, rows = table
    lines = [f"| | {' | '.join(heads)} |", f"|---|{'--:|' * len(heads)}"]
    lines += [f"| `{name}` | {' | '.join(cells)} |" for name, *cells in rows]
    return "\n".join(lines)
