"""The pages of a comparison: formulations against a reference, and an old report against a new one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

from markupsafe import Markup

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.counterexample import Counterexample
from contactverif.contract.property import Verdict
from contactverif_reports.comparisons import (
    Comparison,
    Cost,
    Differing,
    cost_table,
    errors_table,
    iterations_table,
    measured_cells,
    results_table,
)
from contactverif_reports.html.pages import Axis, origin, render, strip, svg_inline, ticks
from contactverif_reports.html.report_page import headline
from contactverif_reports.plot.solved_scene import SolvedScene
from contactverif_reports.regressions import Changes, changed_iterations_table, changes_table
from contactverif_reports.tables import Column

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
    errors = errors_table(comparison)
    head = Column("", wrap=True, page_head=Markup("error / tolerance{}").format(ticks(axis)))
    errors.insert(len(errors.columns) - 1, head, (strip(cell.margins, axis) for cell in measured_cells(comparison)))
    verdicts: dict[str, set[Verdict]] = {id_: set() for id_ in comparison.properties}
    for (_, id_), cell in comparison.cells.items():
        verdicts[id_].add(cell.row.verdict)
    return render(
        "compare.html.j2",
        found=comparison,
        candidates=comparison.formulations[1:],
        run=comparison.candidates,
        headline=headline(comparison.candidates),
        differ=[id_ for id_, every in verdicts.items() if len(every) > 1],
        results=results_table(comparison),
        errors=errors,
        iterations=iterations_table(comparison),
        inf=inf,
        costs=costs,
        times=cost_table(costs, comparison.reference),
        meshes=[_mesh(*pair) for pair in zip(differing, drawings, strict=True)],
        about=origin(comparison.provenance, _FACTS),
    )


def changes_page(changes: Changes, examples: Mapping[str, Counterexample]) -> str:
    """Return the page of an old report and a new one."""
    axis = Axis.from_margins(cell.margins for change in changes.changes for cell in (change.pair.new, change.pair.old))
    rows = changes_table(changes.changes)
    head = Column("", wrap=True, page_head=Markup("old above new{}").format(ticks(axis)))
    by_formulation = [each for name in rows.groups for each in changes.changes if each.pair.new.row.formulation == name]
    rows.insert(
        4, head, (strip(each.pair.old.margins, axis) + strip(each.pair.new.margins, axis) for each in by_formulation)
    )
    return render(
        "changes.html.j2",
        changes=changes,
        rows=rows,
        iterations=changed_iterations_table(changes) if changes.iterations else None,
        meshes=[
            (example, example.replay_command(changes.new.path), _case_figure(example.case, None, None, id_))
            for id_, example in examples.items()
        ],
        n_others=sum(not change.same_cases for change in changes.changes),
        old_about=origin(changes.old.run.provenance, _FACTS),
        new_about=origin(changes.new.run.provenance, _FACTS),
    )


def _mesh(differing: Differing, drawing: Drawing) -> dict[str, Any]:
    """Return two figures with a caption each, or one with both."""
    id_, sides = differing.info.id, differing.sides
    if drawing.solved is not None and drawing.solved.solutions:
        from contactverif_reports.plot.scene_figures import make_scene_figure

        figures = [(svg_inline(make_scene_figure(drawing.solved), f"{id_}, solved"), sides)]
    else:
        figures = [
            (_case_figure(side[1].case, forces, drawing.exact, f"{id_}: {side[0]}"), (side,))
            for side, forces in zip(sides, (drawing.candidate, drawing.reference), strict=True)
        ]
    return {"differing": differing, "figures": figures}


def _case_figure(case: Case, forces: FloatArray | None, exact: FloatArray | None, label: str) -> Markup:
    import matplotlib  # Importing it is slow.

    from contactverif_reports.plot.case_figures import make_mesh_figure

    with matplotlib.rc_context({"legend.fontsize": _LEGEND_SIZE}):
        beside = exact if forces is not None else None  # The exact multipliers are not known.
        return svg_inline(make_mesh_figure(case, _FIGURE_WIDTH, forces=forces, exact=beside), label)
