"""The HTML page of a run: results, distributions, the smallest meshes that fail, provenance. Nothing is solved here."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from contactverif.contract.counterexample import Counterexample, counterexamples
from contactverif.contract.measurement import CheckedNumber
from contactverif.contract.property import checked_numbers
from contactverif.contract.result import OPPOSITE_SIGN, Result, Row, Run, coverage_of
from contactverif_reports.comparisons import Iterations, RowNumbers, count_iterations
from contactverif_reports.html.margin_strips import Axis, strip, ticks
from contactverif_reports.html.pages import render, svg_inline
from contactverif_reports.plot.text import as_text

MOST_FIGURES = 24  # Counterexamples that are drawn as figures, the unexpected ones first; the others are text.
_WIDTH = 5.4  # The width of a figure in inches: on a phone its labels can still be read.
_COLUMNS = 14  # Properties beside each other, so that a table fits on a page of paper.
_OPEN_SECTIONS = 8  # With more formulations than this, only sections with something unexpected are open.
_MOST_NOTEBOOK_ROWS = 10  # Rows that fail and have a line each in a notebook.
_PROMISES = {True: "passes", False: "fails", None: "–"}


@dataclass(frozen=True, slots=True, eq=False)
class Example:
    """A counterexample on the page."""

    counterexample: Counterexample  # The case with its row.
    figure: Markup  # The figure; empty where `text` draws the case.
    text: str  # The drawing in text; empty where there is a figure.
    numbers: tuple[CheckedNumber, ...]  # The measured numbers beside their tolerances.
    # The reason of the failure where the numbers do not say it, else the place of the worst number, if it has one.
    reason: str
    replay: str  # The command that judges the case again.


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A row of the table of a formulation."""

    cell: RowNumbers  # The row, and its numbers by case.
    promise: str  # What the formulation states, in a word.
    strip: Markup  # The distribution of value over tolerance.
    example: str  # The id of its counterexample, empty if it has none.


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """The part of the page about one formulation."""

    formulation: str  # The name on the command line.
    number: int  # The number of the section, from 1, for anchors.
    open: bool  # The section is unfolded.
    missing: tuple[str, ...]  # Parts of the contract that the formulation does not provide.
    lines: tuple[Line, ...]  # A line for each property that applies.
    inapplicable: tuple[tuple[str, list[str]], ...]  # Reasons why properties do not apply, and the properties.
    examples: tuple[Example, ...]  # Its counterexamples.
    iterations: tuple[Iterations, ...]  # Newton's iterations where a property solved.

    @property
    def counts(self) -> str:
        """The numbers of properties with each result, in words."""
        results = [line.cell.row.result for line in self.lines]
        results += [Result.NOT_APPLICABLE for _, ids in self.inapplicable for _ in ids]
        return ", ".join(f"{results.count(result)} {result}" for result in Result if result in results)


def report_page(run: Run, path: str | os.PathLike[str]) -> str:
    """Return the page of a run. The same run and the same path give the same text."""
    cells = {key: RowNumbers.from_row(row) for key, row in run.row_of.items()}
    axis = Axis.from_margins(cell.margins for cell in cells.values())
    examples = _examples(run, os.fspath(path))
    names, ids = run.formulations, list(run.properties)
    subject = (
        "contact formulations" if not names else f"{len(names)} formulations" if len(names) > 3 else ", ".join(names)
    )
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
    """Say in one line how the run came out."""
    if run.promises_kept:
        return f"{run.praise} {run.promises}"
    counts = (
        ("formulation with the opposite sign", "formulations with the opposite sign", len(run.opposite_signs)),
        ("broken promise", "broken promises", run.count(Result.BROKEN_PROMISE)),
        ("crash", "crashes", sum(row.result is Result.CRASHED for row in run.unexpected)),
        ("mistake in the traits", "mistakes in the traits", run.count(Result.WRONG_TRAITS)),
        ("property not judged", "properties not judged", run.count(Result.NOT_JUDGED)),
        ("plugin not loaded", "plugins not loaded", len(run.not_loaded)),
    )
    words = [f"{count} {singular if count == 1 else plural}" for singular, plural, count in counts if count]
    return f"{', '.join(words)}." if words else "Nothing was checked."


def _section(
    run: Run, name: str, cells: Mapping[tuple[str, str], RowNumbers], examples: Sequence[Example], axis: Axis
) -> Section:
    """Return the section of one formulation."""
    own_cells = [cells[name, row.property_id] for row in run.rows_of(name)]
    own_examples = [example for example in examples if example.counterexample.formulation == name]
    example_of = {example.counterexample.property_id: example.counterexample.id for example in own_examples}
    lines, inapplicable = [], dict[str, list[str]]()
    for cell in own_cells:
        id_ = cell.row.property_id
        if cell.row.result is Result.NOT_APPLICABLE:
            inapplicable.setdefault(cell.row.reason, []).append(id_)
        else:
            promise = _PROMISES[cell.row.promise]
            lines.append(Line(cell, promise, strip(cell.margins, axis), example_of.get(id_, "")))
    return Section(
        formulation=name,
        number=run.formulations.index(name) + 1,
        open=len(run.formulations) <= _OPEN_SECTIONS or any(row.unexpected for row in run.rows_of(name)),
        missing=tuple(part for part, provided in run.provided.get(name, {}).items() if not provided),
        lines=tuple(lines),
        inapplicable=tuple(inapplicable.items()),
        examples=tuple(own_examples),
        iterations=tuple(line for cell in own_cells for line in count_iterations([cell])),
    )


def _examples(run: Run, path: str) -> list[Example]:
    """Return all counterexamples, as many of them drawn as figures as the page holds."""
    by_id = counterexamples(run)
    figures = _figures(by_id)
    examples = []
    for id_, counterexample in by_id.items():
        measurement = counterexample.outcome.measurement
        numbers = checked_numbers(counterexample.row.info, measurement)
        finding = measurement.finding if measurement is not None else None
        numbers_say_it = any(number.value == number.value and number.ratio > 1 for number in numbers)
        examples.append(
            Example(
                counterexample=counterexample,
                figure=figures.get(id_, Markup("")),
                text="" if id_ in figures else as_text(counterexample.case),
                numbers=numbers,
                reason=str(finding or "") if numbers_say_it else counterexample.reason,
                replay=counterexample.replay_command(path),
            )
        )
    return examples


def _figures(examples: Mapping[str, Counterexample]) -> dict[str, Markup]:
    """Return {id: figure} of as many counterexamples as are drawn."""
    if not examples:
        return {}
    from contactverif_reports.plot.case_figures import make_mesh_figure  # Importing matplotlib is slow.

    ids = sorted(examples, key=lambda id_: not examples[id_].row.unexpected)
    figures = {}
    for id_ in ids[:MOST_FIGURES]:
        case, forces = examples[id_].case, examples[id_].row.forces
        of_formulation, exact = (None, None) if forces is None else (forces.of_formulation, forces.exact)
        figure = make_mesh_figure(case, _WIDTH, forces=of_formulation, exact=exact)
        figures[id_] = svg_inline(figure, as_text(case).splitlines()[0])
    return figures


def run_view(run: Run, rows: Sequence[Row], remarks: Sequence[str], example: Counterexample | None) -> str:
    """Return the output of a notebook cell: the rows that fail, and a failing mesh; no formulation is asked."""
    figure = Markup("")
    if example is not None:
        from contactverif_reports.plot.case_figures import make_mesh_figure  # Importing matplotlib is slow.

        figure = svg_inline(make_mesh_figure(example.case, _WIDTH))
    return render(
        "notebook.html.j2",
        headline=headline(run),
        remarks=remarks,
        rows=rows[:_MOST_NOTEBOOK_ROWS],
        n_more=max(len(rows) - _MOST_NOTEBOOK_ROWS, 0),
        words=[] if example is None else example.words,
        figure=figure,
    )
