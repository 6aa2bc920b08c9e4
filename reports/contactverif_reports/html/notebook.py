"""The output of a notebook cell for a run: what fails, and the first failing mesh."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

from contactverif.contract.counterexample import Counterexample
from contactverif.contract.result import Row, Run
from contactverif_reports.html.pages import render, svg_inline
from contactverif_reports.html.report_page import headline

_MOST_ROWS = 10  # Rows that fail and have a line each.
_WIDTH = 5.4  # The width of a figure in inches.


def run_view(run: Run, rows: Sequence[Row], remarks: Sequence[str], example: Counterexample | None) -> str:
    """Return the rows that fail as a table, with the mesh of a counterexample; no formulation is asked."""
    figure = Markup("")
    if example is not None:
        from contactverif_reports.draw.scene_outline import make_mesh_figure  # It brings matplotlib, which is slow.

        figure = svg_inline(make_mesh_figure(example.case, _WIDTH))
    return render(
        "notebook.html.j2",
        headline=headline(run),
        remarks=remarks,
        rows=rows[:_MOST_ROWS],
        n_more=max(len(rows) - _MOST_ROWS, 0),
        words=[] if example is None else example.words,
        figure=figure,
    )
