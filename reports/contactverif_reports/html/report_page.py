"""The HTML page of a run: results, distributions, the smallest meshes that fail, provenance. Nothing is solved here."""

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from contactverif.contract.counterexample import Counterexample, counterexamples
from contactverif.contract.property import checked_numbers
from contactverif.contract.result import NOTHING_JUDGED, OPPOSITE_SIGN, Result, Row, Run, coverage_of, describe
from contactverif_reports.comparisons import RowNumbers, count_iterations
from contactverif_reports.html.pages import Axis, render, strip, svg_inline, ticks
from contactverif_reports.plot.text import as_text
from contactverif_reports.tables import PROMISES, WRONG_RESULTS

MOST_FIGURES = 24  # Counterexamples that are drawn as figures, the unexpected ones first; the others are text.
_WIDTH = 5.4  # The width of a figure in inches: on a phone its labels can still be read.
_COLUMNS = 14  # Properties beside each other, so that a table fits on a page of paper.
_OPEN_SECTIONS = 8  # With more formulations than this, only sections with something unexpected are open.
_MOST_NOTEBOOK_ROWS = 10  # Rows that fail and have a line each in a notebook.


def report_page(run: Run, path: str | os.PathLike[str]) -> str:
    """Return the page of a run. The same run and the same path give the same text."""
    cells = {key: RowNumbers.from_row(row) for key, row in run.row_of.items()}
    axis = Axis.from_margins(cell.margins for cell in cells.values())
    examples = _examples(run, os.fspath(path))
    names, ids = run.formulations, list(run.properties)
    subject = f"{len(names)} formulations" if len(names) > 3 else ", ".join(names) or "contact formulations"
    applicable = {row.property_id for row in run.rows if row.result is not Result.NOT_APPLICABLE}
    # Tables that are about equally wide.
    n_columns = max(1, -(-len(ids) // max(1, -(-len(ids) // _COLUMNS))))
    return render(
        "report.html.j2",
        run=run,
        opposite_sign=OPPOSITE_SIGN,
        row_of=run.row_of,
        title=f"Verification of {subject}",
        headline=headline(run),
        sections=[_section(run, name, cells, examples, axis) for name in names],
        chunks=[ids[start : start + n_columns] for start in range(0, len(ids), n_columns)],
        anchors={id_: f"property-{n}" for n, id_ in enumerate(ids, 1) if id_ in applicable},
        numbers={name: n for n, name in enumerate(names, 1)},
        results=[result for result in Result if run.count(result)],
        ticks=ticks(axis),
        coverages=coverage_of(run),
        beyond=axis.most,
        n_examples=len(examples),
        n_figures=MOST_FIGURES,
        planned=sum(row.planned for row in run.rows),
        judged=sum(row.judged for row in run.rows),
        file=os.path.basename(path),
    )


def headline(run: Run) -> str:
    """Say in one line how the run came out: what is wrong, or what fails all the same."""
    if run.promises_kept:
        return f"{run.conclusion} {run.promises}"
    counts = Counter(row.result for row in run.rows if not (row.omitted or row.is_trait))
    counts[Result.NOT_LOADED] = len(run.not_loaded)
    signs = ("formulation with the opposite sign", "formulations with the opposite sign")
    others = (Result.FAIL, ("failure without a promise", "failures without a promise"))
    kinds = ((counts[result], text) for result, text in [*WRONG_RESULTS.items(), others])
    words = ", ".join(f"{n} {text[n > 1]}" for n, text in [(len(run.opposite_signs), signs), *kinds] if n)
    return f"{words}." if words else NOTHING_JUDGED


def _section(
    run: Run, name: str, cells: Mapping[tuple[str, str], RowNumbers], every: Sequence[dict[str, Any]], axis: Axis
) -> dict[str, Any]:
    rows = list(run.rows_of(name))
    examples = [example for example in every if example["row"].formulation == name]
    example_of = {example["row"].property_id: example["id"] for example in examples}
    inapplicable: dict[str, list[str]] = {}  # {reason: properties that do not apply}
    for row in rows:
        if row.result is Result.NOT_APPLICABLE:
            inapplicable.setdefault(row.reason, []).append(row.property_id)
    its_cells = [cells[name, row.property_id] for row in rows]
    return {
        "formulation": name,
        "number": run.formulations.index(name) + 1,  # For anchors.
        "open": len(run.formulations) <= _OPEN_SECTIONS or any(row.unexpected for row in rows),
        "words": describe(rows),
        "missing": [part for part, provided in run.provided.get(name, {}).items() if not provided],
        "lines": [
            {
                "cell": cell,
                "promise": PROMISES[cell.row.promise],
                "strip": strip(cell.margins, axis),
                "example": example_of.get(cell.row.property_id, ""),
            }
            for cell in its_cells
            if cell.row.result is not Result.NOT_APPLICABLE
        ],
        "inapplicable": list(inapplicable.items()),
        "examples": examples,
        "iterations": [line for cell in its_cells for line in count_iterations([cell])],
    }


def _examples(run: Run, path: str) -> list[dict[str, Any]]:
    """Return what the page shows of all counterexamples, as many of them drawn as figures as the page holds."""
    by_id = counterexamples(run)
    in_order = sorted(by_id, key=lambda id_: not by_id[id_].row.unexpected)
    figures = {id_: _figure(by_id[id_]) for id_ in in_order[:MOST_FIGURES]}
    examples = []
    for id_, counterexample in by_id.items():
        measurement = counterexample.outcome.measurement
        numbers = checked_numbers(counterexample.row.info, measurement)
        finding = measurement.finding if measurement is not None else None
        numbers_say_it = any(number.value == number.value and number.ratio > 1 for number in numbers)
        examples.append(
            {
                "id": id_,
                "row": counterexample.row,
                "label": counterexample.label,
                "figure": figures.get(id_, ""),
                "text": "" if id_ in figures else as_text(counterexample.case),
                "numbers": numbers,
                # The reason of the failure where the numbers do not say it, else the worst place, if it has one.
                "reason": str(finding or "") if numbers_say_it else counterexample.reason,
                "replay": counterexample.replay_command(path),
            }
        )
    return examples


def _figure(example: Counterexample) -> Markup:
    from contactverif_reports.plot.case_figures import make_mesh_figure  # Importing matplotlib is slow.

    forces = example.row.forces
    arrows = {} if forces is None else {"forces": forces.of_formulation, "exact": forces.exact}
    return svg_inline(make_mesh_figure(example.case, _WIDTH, **arrows), as_text(example.case).splitlines()[0])


def run_view(run: Run, rows: Sequence[Row], remarks: Sequence[str], example: Counterexample | None) -> str:
    """Return the output of a notebook cell: the rows that fail, and a failing mesh; no formulation is asked."""
    return render(
        "notebook.html.j2",
        headline=headline(run),
        remarks=remarks,
        rows=rows[:_MOST_NOTEBOOK_ROWS],
        n_more=max(len(rows) - _MOST_NOTEBOOK_ROWS, 0),
        words=[] if example is None else example.words,
        figure="" if example is None else _figure(example),
    )
