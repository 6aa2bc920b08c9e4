"""The page of a bench: sentences, the cost of an error, figures, starts, and changes since an earlier bench.

The page in Markdown has the same sections. It stands in a folder beside its pictures.
"""

from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

from contactverif_reports import bench_costs as costs
from contactverif_reports.bench_results import VARIANTS, BenchResults
from contactverif_reports.html.pages import origin, render, svg_inline
from contactverif_reports.tables import Column, Table

_FACTS = ("command", "created", "commit", "contactverif_version", "numpy_version", "blas", "platform", "isolation")


def bench_page(results: BenchResults, changes: Sequence[costs.BenchChange] = ()) -> str:
    """Return the page of a bench."""
    from contactverif_reports.plot import bench_figures as plots  # Importing it is slow.

    figures: dict[str, list[Markup]] = {}
    for scene in results.scenes:
        figures[scene] = []
        if len(results.meshes_of(scene)) > 1:
            figures[scene].append(svg_inline(plots.make_scene_figure(results, scene), f"errors, {scene}"))
            if len(results.formulations) > costs.MOST_CURVES:
                figures[scene].append(svg_inline(plots.make_each_figure(results, scene), f"each formulation, {scene}"))
    since = Table([Column("formulation"), Column("evaluation", number=True), Column(""), Column("counts", wrap=True)])
    for change in changes:
        since.add(change.formulation, change.evaluation.text, change.evaluation.word, change.counts_text)
    return render(
        "bench.html.j2",
        results=results,
        texts=costs,
        cost=svg_inline(plots.make_cost_figure(results), "what an error costs"),
        runtimes=svg_inline(plots.make_runtime_figure(results), "runtimes"),
        deepest=svg_inline(plots.make_starts_figure(results), "who fails from the deepest start"),
        figures=figures,
        scenes=_sections(results),
        failures=_list_failures(results),
        changes=since,
        about=origin(results.provenance, _FACTS),
    )


def bench_markdown(results: BenchResults, report: str, with_pictures: bool) -> str:
    """Return the page in Markdown, for a folder of results that is kept."""
    scenes = _sections(results)
    return render("bench.md.j2", results=results, texts=costs, scenes=scenes, report=report, pictures=with_pictures)


def _sections(results: BenchResults) -> list[dict[str, Any]]:
    sections = []
    for scene in results.scenes:
        reached, words = costs.split_targets(results, scene)
        targets = [
            {
                "share": costs.format_share(target),
                "sentences": costs.cost_sentences(results, scene, target),
                "table": costs.cost_table(results, scene, target),
            }
            for target in reached
        ]
        tables = {"totals": costs.totals_table(results, scene), "starts": costs.starts_table(results, scene)}
        section = {"name": scene, "label": results.label(scene), "has_curves": len(results.meshes_of(scene)) > 1}
        sections.append({**section, **tables, "targets": targets, "out_of_reach": words})
    return sections


def _list_failures(results: BenchResults) -> list[tuple[str, int, str]]:
    rows = []
    for name in results.formulations:
        ends = [
            f"{VARIANTS[variant].label}: {remark}"
            for (formulation, _, variant), remark in results.remarks.items()
            if formulation == name
        ]
        if ends:
            kinds = sorted(dict.fromkeys(ends), key=ends.count, reverse=True)
            rows.append((name, len(ends), "; ".join(f"{ends.count(kind)} {kind}" for kind in kinds[:3])))
    return rows
