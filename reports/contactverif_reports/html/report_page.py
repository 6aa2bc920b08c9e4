"""The HTML page of a stored report: verdicts, worst meshes drawn, distributions, provenance. Nothing is solved here."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from markupsafe import Markup

from contactverif.contract.property import Verdict
from contactverif_reports.compare.comparison import Iterations, iterations
from contactverif_reports.draw import as_text
from contactverif_reports.html.margin_strips import Axis, strip, ticks
from contactverif_reports.html.pages import render, svg_inline
from contactverif_reports.netcdf.read import StoredCase
from contactverif_reports.netcdf.stored import Held, StoredReport, StoredRow

DRAWN = 24  # counterexamples drawn as figures, the unexpected ones first; the others are drawn in text
_WIDTH = 5.4  # inches of a figure: on a phone its labels can still be read
_COLUMNS = 14  # properties beside each other, so that a table fits on a page of paper
_FEW = 8  # formulations whose sections are all open
_PROMISES = {True: "passes", False: "fails", None: "–"}


@dataclass(frozen=True, slots=True, eq=False)
class Example:
    """A counterexample as the page shows it.

    Attributes
    ----------
    id, stored : str or StoredCase
        Of the report.
    unexpected : str
        Why it makes the run fail, empty if it does not.
    figure : Markup
        Empty where `text` draws it.
    numbers : tuple[Held, ...]
        Against their tolerances.
    reason : str
        Why it fails, where the numbers do not say it.
    replay : str
        The command that judges it again.
    """

    id: str
    stored: StoredCase
    unexpected: str
    figure: Markup
    text: str
    numbers: tuple[Held, ...]
    reason: str
    replay: str


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A row of the table of a formulation."""

    property_id: str
    row: StoredRow
    promise: str
    strip: Markup
    median: float
    worst: float
    example: str


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """What the page says of one formulation.

    Attributes
    ----------
    number : int
        From 1, for anchors.
    open : bool
        Shown without being asked for.
    missing : tuple[str, ...]
        Parts of the contract that it does not provide.
    """

    formulation: str
    number: int
    open: bool
    missing: tuple[str, ...]
    lines: tuple[Line, ...]
    examples: tuple[Example, ...]
    iterations: tuple[Iterations, ...] = field(default=())

    @property
    def counts(self) -> str:
        """How many properties came out how, in words."""
        verdicts = [line.row.cell.verdict for line in self.lines]
        told = [(verdict, verdicts.count(verdict)) for verdict in Verdict]
        return ", ".join(f"{count} {verdict}" for verdict, count in told if count)


def report_page(report: StoredReport) -> str:
    """The page: the same report, read from the same path, gives the same text."""
    axis = Axis.of(row.cell.margins for row in report.rows.values())
    return render(
        "report.html.j2",
        report=report,
        title=_title(report),
        headline=headline(report),
        sections=tuple(_sections(report, axis)),
        chunks=_chunks(list(report.properties)),
        anchors={id_: f"property-{n}" for n, id_ in enumerate(report.properties, 1)},
        numbers={name: n for n, name in enumerate(report.formulations, 1)},
        verdicts=[verdict for verdict in Verdict if any(row.cell.verdict is verdict for row in report.rows.values())],
        ticks=ticks(axis),
        beyond=axis.most,
        drawn=DRAWN,
        planned=sum(row.cell.planned for row in report.rows.values()),
        judged=sum(row.cell.judged for row in report.rows.values()),
        file=os.path.basename(report.path),
    )


def headline(report: StoredReport) -> str:
    """How it came out, in one line."""
    if report.passed:
        return "Every promise kept, every property judged."
    told = [f"{len(report.unexpected)} unexpected"] if report.unexpected else []
    told += [f"{len(report.not_loaded)} not loaded"] if report.not_loaded else []
    return f"{' and '.join(told)}." if told else "Nothing was asked."


def _title(report: StoredReport) -> str:
    names = report.formulations
    if not names:
        return "Verification of contact formulations"
    return f"Verification of {', '.join(names)}" if len(names) <= 3 else f"Verification of {len(names)} formulations"


def _sections(report: StoredReport, axis: Axis) -> Iterator[Section]:
    figures = _figures(report)
    few = len(report.formulations) <= _FEW
    for n, name in enumerate(report.formulations, 1):
        rows = {id_: report.rows[name, id_] for id_ in report.properties if (name, id_) in report.rows}
        examples = tuple(_examples(report, name, figures))
        of_property = {example.stored.property_id: example.id for example in examples}
        yield Section(
            formulation=name,
            number=n,
            open=few or any(row.cell.unexpected for row in rows.values()),
            missing=tuple(part for part, has in report.provided.get(name, {}).items() if not has),
            lines=tuple(_line(id_, row, axis, of_property.get(id_, "")) for id_, row in rows.items()),
            examples=examples,
            iterations=tuple(line for row in rows.values() for line in iterations([row.cell])),
        )


def _line(id_: str, row: StoredRow, axis: Axis, example: str) -> Line:
    return Line(
        property_id=id_,
        row=row,
        promise=_PROMISES[row.cell.promise],
        strip=strip(row.cell.margins, axis),
        median=row.cell.median,
        worst=row.cell.worst,
        example=example,
    )


def _figures(report: StoredReport) -> dict[str, Markup]:
    """{id: figure} of as many counterexamples as are drawn."""
    if not report.examples:
        return {}
    from contactverif_reports.draw.case_figure import make_case_figure  # matplotlib takes its time
    from contactverif_reports.draw.scene_outline import has_outline, make_outline_figure

    ids = sorted(report.examples, key=lambda id_: not _unexpected(report, report.examples[id_]))
    figures = {}
    for id_ in ids[:DRAWN]:
        case = report.examples[id_].case
        figure = (
            make_outline_figure(case, _WIDTH)
            if has_outline(case)
            else make_case_figure(case, title="", forces=None, exact=None, width=_WIDTH)
        )
        figures[id_] = svg_inline(figure, as_text(case).splitlines()[0])
    return figures


def _examples(report: StoredReport, name: str, figures: Mapping[str, Markup]) -> Iterator[Example]:
    for id_, stored in report.examples_of(name).items():
        asked = report.properties.get(stored.property_id)
        told = [quantity for quantity in asked.quantities if quantity.name in stored.values] if asked else []
        held = [Held(quantity, stored.values[quantity.name], stored.tolerances[quantity.name]) for quantity in told]
        said = any(one.value == one.value and one.excess > 1 for one in held)
        yield Example(
            id=id_,
            stored=stored,
            unexpected=_unexpected(report, stored),
            figure=figures.get(id_, Markup("")),
            text="" if id_ in figures else as_text(stored.case),
            numbers=tuple(held),
            reason="" if said else stored.reason,
            replay=f"contactverif replay {shlex.quote(report.path)} --case {shlex.quote(id_)}",
        )


def _unexpected(report: StoredReport, stored: StoredCase) -> str:
    row = report.rows.get((stored.formulation, stored.property_id))
    return row.cell.unexpected if row else ""


def _chunks(ids: list[str]) -> list[list[str]]:
    """The properties in tables that are about equally wide."""
    n_tables = -(-len(ids) // _COLUMNS)
    size = -(-len(ids) // n_tables) if n_tables else 0
    return [ids[start : start + size] for start in range(0, len(ids), size or 1)]
