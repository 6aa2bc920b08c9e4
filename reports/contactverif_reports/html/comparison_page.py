"""The pages of a comparison: formulations against a reference, and an old report against a new one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isnan
from typing import Any

from markupsafe import Markup

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.counterexample import Counterexample
from contactverif_reports.compare.cells import Cell
from contactverif_reports.compare.comparison import PARTS, Comparison, Cost, Differing
from contactverif_reports.compare.regression import Change, Changes
from contactverif_reports.draw.solved_scene import SolvedScene
from contactverif_reports.html.margin_strips import Axis, strip, ticks
from contactverif_reports.html.pages import origin, render, svg_inline

_FACTS = ("command", "created", "commit", "profile", "examples", "seed", "contactverif_version", "blas", "platform")
_FIGURE_WIDTH = 5.6  # The width of a figure in inches; two stand side by side on a wide page.
_LEGEND_SIZE = 7  # The size of the legend's letters in points; with larger ones it is wider than the figure.


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """The arrays that a picture of a differing case needs; without any of them the mesh alone is drawn."""

    candidate: FloatArray | None = None  # (n_nodes, 2) The nodal forces that each of them gives.
    reference: FloatArray | None = None
    exact: FloatArray | None = None  # (n_nodes, 2) The exact nodal forces.
    # A case with bodies, solved by both; it is drawn instead of the forces at its first guess.
    solved: SolvedScene | None = None


def comparison_page(
    comparison: Comparison, differing: Sequence[Differing], drawings: Sequence[Drawing], costs: Sequence[Cost]
) -> str:
    """Return the page of formulations against a reference."""
    axis = Axis.from_margins(cell.margins for cell in comparison.cells.values())
    return render(
        "compare.html.j2",
        found=comparison,
        candidates=comparison.formulations[1:],
        wrong=comparison.unexpected,
        differ=[id_ for id_ in comparison.properties if _verdicts_differ(comparison, id_)],
        results=[(id_, _results(comparison, id_)) for id_ in comparison.properties],
        errors=[(id_, lines) for id_ in comparison.properties if (lines := _errors(comparison, id_, axis))],
        ticks=ticks(axis),
        parts_of_time=PARTS,
        inf=inf,
        costs=_costs(costs, comparison.reference),
        meshes=[_mesh(*pair, comparison.reference) for pair in zip(differing, drawings, strict=True)],
        about=origin(comparison.provenance, _FACTS),
    )


def changes_page(changes: Changes, examples: Mapping[str, Counterexample]) -> str:
    """Return the page of an old report and a new one."""
    axis = Axis.from_margins(cell.margins for change in changes.changes for cell in (change.old, change.new))
    return render(
        "changes.html.j2",
        changes=changes,
        rows=_by_formulation(changes, axis),
        ticks=ticks(axis),
        meshes=[
            (example, example.replay_command(changes.new.path), _case_figure(example.case, None, None, id_))
            for id_, example in examples.items()
        ],
        n_others=sum(change.paired is None for change in changes.changes),
        old_about=origin(changes.old.run.provenance, _FACTS),
        new_about=origin(changes.new.run.provenance, _FACTS),
    )


def _by_formulation(changes: Changes, axis: Axis) -> list[tuple[str, list[tuple[Change, Markup, Markup]]]]:
    """Return the rows by formulation, with the strips of the old and the new margins."""
    rows: dict[str, list[tuple[Change, Markup, Markup]]] = {}
    for change in changes.changes:
        line = (change, strip(change.old.margins, axis), strip(change.new.margins, axis))
        rows.setdefault(change.new.row.formulation, []).append(line)
    return list(rows.items())


def _cells(comparison: Comparison, id_: str) -> list[Cell]:
    """Return the cells of one property, the reference first."""
    keys = ((name, id_) for name in comparison.formulations)
    return [comparison.cells[key] for key in keys if key in comparison.cells]


def _verdicts_differ(comparison: Comparison, id_: str) -> bool:
    return len({cell.row.verdict for cell in _cells(comparison, id_)}) > 1


def _results(comparison: Comparison, id_: str) -> list[dict[str, Any] | None]:
    """Return the results of one property, None where a formulation was not checked."""
    reference = comparison.cells.get((comparison.reference, id_))
    results: list[dict[str, Any] | None] = []
    for name in comparison.formulations:
        cell = comparison.cells.get((name, id_))
        if cell is None:
            results.append(None)
            continue
        differs = reference is not None and cell.row.verdict is not reference.row.verdict
        results.append({"word": str(cell.row.result), "unexpected": cell.row.unexpected, "differs": differs})
    return results


def _errors(comparison: Comparison, id_: str, axis: Axis) -> list[tuple[Cell, Any, Markup]]:
    """Return the lines of the table of errors of one property; none where nothing was measured."""
    return [
        (cell, comparison.paired.get((cell.row.formulation, id_)), strip(cell.margins, axis))
        for cell in _cells(comparison, id_)
        if not isnan(cell.worst)
    ]


def _costs(costs: Sequence[Cost], reference: str) -> list[tuple[int, list[dict[str, Any]]]]:
    """Return by number of slave segments the microseconds of each formulation, and its ratio to the reference's."""
    totals = {cost.n_segments: cost.total for cost in costs if cost.formulation == reference}
    lines: dict[int, list[dict[str, Any]]] = {cost.n_segments: [] for cost in costs}
    for cost in costs:
        seconds = [*(cost.seconds[part] for part in PARTS), cost.total]
        ratio = cost.total / totals[cost.n_segments]
        lines[cost.n_segments].append(
            {
                "formulation": cost.formulation,
                "failed": cost.failed,
                "times": [*map(_microseconds, seconds), _microseconds(cost.total / cost.n_segments, digits=2)],
                "ratio": "–" if isnan(ratio) else f"{ratio:.2f}",
            }
        )
    return list(lines.items())


def _microseconds(seconds: float, digits: int = 1) -> str:
    return "–" if isnan(seconds) else f"{1e6 * seconds:.{digits}f}"


def _mesh(differing: Differing, drawing: Drawing, reference: str) -> dict[str, Any]:
    """Return two figures with a caption each, or one with both."""
    sides = [
        (differing.formulation, differing.outcome, differing.margin),
        (reference, differing.reference_outcome, differing.reference_margin),
    ]
    id_ = differing.info.id
    if drawing.solved is not None and drawing.solved.solutions:
        from contactverif_reports.draw.scene_figures import make_scene_figure

        figures = [(svg_inline(make_scene_figure(drawing.solved), f"{id_}, solved"), sides)]
    else:
        figures = [
            (_case_figure(differing.case, forces, drawing.exact, f"{id_}: {side[0]}"), [side])
            for side, forces in zip(sides, (drawing.candidate, drawing.reference), strict=True)
        ]
    return {"differing": differing, "figures": figures}


def _case_figure(case: Case, forces: FloatArray | None, exact: FloatArray | None, label: str) -> Markup:
    """Return the figure of a case: its bodies, or its interface with forces."""
    import matplotlib  # Importing it is slow.

    from contactverif_reports.draw.scene_outline import make_mesh_figure

    with matplotlib.rc_context({"legend.fontsize": _LEGEND_SIZE}):
        beside = exact if forces is not None else None  # The exact multipliers are not known.
        return svg_inline(make_mesh_figure(case, _FIGURE_WIDTH, forces=forces, exact=beside), label)
