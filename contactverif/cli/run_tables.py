"""How a run reads in a terminal: tables that line up, counterexamples drawn in text, one line that sums up."""

from __future__ import annotations

import os
import shlex
import sys
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from rich import box
from rich.console import Console, ConsoleOptions, RenderableType
from rich.table import Table
from rich.text import Text

from contactverif.contract.formulation import Traits
from contactverif.contract.property import Measurement, Outcome, Property, Verdict, excess
from contactverif.contract.result import NotLoaded, Row, Run
from contactverif.contract.subject import OPTIONAL_PARTS, Subject
from contactverif.mechanics.newton import End
from contactverif.run.registry import Wrapper
from contactverif_reports.draw import as_text
from contactverif_reports.netcdf.read import StoredCase
from contactverif_reports.netcdf.schema import case_id

if TYPE_CHECKING:  # slow to import
    from contactverif_reports.compare.cells import Cell
    from contactverif_reports.netcdf.stored import StoredReport, StoredRow

_STYLES = {Verdict.PASS: "green", Verdict.FAIL: "red", Verdict.CRASHED: "red", Verdict.NOT_JUDGED: "yellow"}
_PROMISES = {True: "passes", False: "fails", None: "–"}
_PIPE_WIDTH = 140  # columns where no terminal says how many there are
_COLUMNS = ("property", "promise", "verdict", "judged", "worst", "tolerance")
_FEW = 3  # quantities that are written with their formulas
_NUMBERS = _COLUMNS[3:]  # at the right end of their columns


class _Console(Console):
    """One that does not end the process by itself where nobody reads on; `cli.main` knows what that is worth."""

    def on_broken_pipe(self) -> NoReturn:
        raise BrokenPipeError


def show(what: RenderableType) -> None:
    """Print to standard output, as wide as the terminal, or wide enough where there is none."""
    told = sys.stdout.isatty() or "COLUMNS" in os.environ
    # Words of a plugin may hold square brackets, which are no markup.
    console = _Console(width=None if told else _PIPE_WIDTH, highlight=False, markup=False)
    console.print(what)


def show_as_it_is(text: Text) -> None:
    """Print without folding a line: a drawing, or a command that is to be copied."""
    _Console(highlight=False, markup=False).print(text, soft_wrap=True)


@dataclass(frozen=True, slots=True)
class _Line:
    """One formulation, one property, in words; `quantity` names the worst number where there are several."""

    formulation: str
    verdict: Verdict
    cells: tuple[str, ...]
    quantity: str
    remark: str


@dataclass(frozen=True, slots=True)
class RunTable:
    """A line for each formulation and property: what was promised, what it does, how close to the tolerance.

    It needs no more than 80 columns; a remark stands behind its line where there is room, else below it. Which of
    several quantities came closest is left out where there is none: the drawing of a failure says it again.
    """

    found: Run

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        not_loaded = {item.formulation: item.reason for item in self.found.not_loaded}
        yield from _verdicts(self.found.provenance, map(_line, self.found.rows), not_loaded, options.max_width)


@dataclass(frozen=True, slots=True)
class StoredTable:
    """The same of a stored report."""

    found: StoredReport

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        lines = map(_stored_line, self.found.rows.values())
        yield from _verdicts(self.found.provenance, lines, self.found.not_loaded, options.max_width)


def _verdicts(
    provenance: Mapping[str, str], found: Iterable[_Line], not_loaded: Mapping[str, str], max_width: int
) -> Iterator[Text]:
    yield Text(_asked(provenance))
    lines = list(found)
    widths = [max(map(len, column)) for column in zip(_COLUMNS, *(line.cells for line in lines), strict=True)]
    if lines:
        yield Text("")
        yield Text("  " + _aligned(_COLUMNS, widths), style="bold")
    at_verdict = 2 + widths[0] + 2 + widths[1] + 2
    previous = None
    for one in lines:
        if one.formulation != previous:
            yield Text(one.formulation, style="bold")
        previous = one.formulation
        line = "  " + _aligned(one.cells, widths)
        said = [text for text in (one.remark, one.quantity) if text]
        behind = next((text for text in ("; ".join(said), one.remark) if len(line) + 2 + len(text) <= max_width), "")
        text = Text(f"{line}  {behind}".rstrip(), no_wrap=True, overflow="ignore")
        text.stylize(_STYLES.get(one.verdict, "dim"), at_verdict, at_verdict + len(one.cells[2]))
        yield text
        if one.remark and not behind:
            yield _folded(one.remark, max_width)
    for name, reason in not_loaded.items():
        yield Text(name, style="bold")
        yield _folded(f"{Verdict.NOT_LOADED}: {reason}", max_width, style="red")


def _line(row: Row) -> _Line:
    value, tolerance, quantity = _worst(row)
    judged = f"{row.judged}/{row.planned}" if row.planned else "–"
    cells = row.question.id, _PROMISES[row.promise], str(row.verdict), judged, value, tolerance
    undecided = sum(outcome.verdict is Verdict.UNDECIDED for outcome in row.outcomes)
    return _Line(row.formulation, row.verdict, cells, quantity, _remark(row, row.known, undecided))


def _stored_line(row: StoredRow) -> _Line:
    cell, worst = row.cell, row.furthest
    value = f"{worst.value:.2g}" if worst else ""
    tolerance = f"{worst.sign} {worst.tolerance:.2g}" if worst else ""
    judged = f"{cell.judged}/{cell.planned}" if cell.planned else "–"
    cells = cell.property_id, _PROMISES[cell.promise], str(cell.verdict), judged, value, tolerance
    quantity = worst.quantity.name if worst and row.n_quantities > 1 else ""
    return _Line(cell.formulation, cell.verdict, cells, quantity, _remark(cell, row.known, row.undecided))


def _aligned(cells: Sequence[str], widths: Sequence[int]) -> str:
    return "  ".join(
        cell.rjust(width) if name in _NUMBERS else cell.ljust(width)
        for name, cell, width in zip(_COLUMNS, cells, widths, strict=True)
    )


def _folded(words: str, width: int, style: str = "") -> Text:
    """Words of any length below a line, indented."""
    lines = textwrap.wrap(words, max(width - 6, 20))
    return Text("\n".join("      " + line for line in lines), style=style, no_wrap=True, overflow="ignore")


def counterexample(row: Row, report: Path | None) -> Text | None:
    """What failed, on the smallest mesh found, and the line that replays it; None where nothing failed."""
    outcome = row.shrunk or row.witness
    if row.verdict not in (Verdict.FAIL, Verdict.CRASHED) or outcome is None:
        return None
    of_witness = f" (witness {outcome.case.name})" if outcome is row.witness else ""
    lines = [
        f"{row.formulation}, {row.question.id}: {outcome.verdict}{of_witness}",
        *(f"    {line}" for line in _numbers(row.question, outcome)),
        *(f"    {line}" for line in as_text(outcome.case).splitlines()),
    ]
    if report is None:
        lines.append("    to keep and replay it, run again with --report FILE.nc and the same --seed")
    else:
        name = case_id(row.formulation, row.question.id, witness=outcome is row.witness)
        lines.append(f"    contactverif replay {shlex.quote(str(report))} --case {shlex.quote(name)}")
    return Text("\n".join(["", *lines]))


def summary(found: Run) -> Text:
    """One line: how it came out, and why if not well."""
    wrong = [f"{row.formulation} {row.question.id} ({row.unexpected})" for row in found.rows if row.unexpected]
    wrong += [f"{item.formulation} (not loaded)" for item in found.not_loaded]
    return _summed_up(found.passed, wrong)


def stored_summary(found: StoredReport) -> Text:
    """The same of a stored report."""
    cells = [row.cell for row in found.unexpected]
    wrong = [f"{cell.formulation} {cell.property_id} ({cell.unexpected})" for cell in cells]
    wrong += [f"{name} (not loaded)" for name in found.not_loaded]
    return _summed_up(found.passed, wrong)


def _summed_up(passed: bool, wrong: Sequence[str]) -> Text:
    if passed:
        return Text("every promise kept, every property judged", style="green")
    return Text(f"{len(wrong)} unexpected: {'; '.join(wrong)}" if wrong else "nothing was asked", style="red")


def replayed(stored: StoredCase, name: str, outcome: Outcome) -> Table:
    """What the report says of a case beside what comes out now."""
    table = plain_table("")
    for column in ("", "formulation", "verdict", "reason"):
        table.add_column(column)
    table.add_row("stored", stored.formulation, str(stored.verdict), stored.reason)
    table.add_row("now", name, str(outcome.verdict), outcome.reason)
    return table


def formulations_table(formulations: Sequence[Subject | Wrapper | NotLoaded], *, every_trait: bool) -> Table:
    """The installed formulations: what each promises, or why it does not load; how a wrapper is used."""
    table = plain_table("formulations")
    table.add_column("name", no_wrap=True)
    table.add_column("promises")
    for item in formulations:
        if isinstance(item, NotLoaded):
            table.add_row(item.formulation, Text(f"not loaded: {item.reason}", style="red"))
            continue
        if isinstance(item, Wrapper):
            about = f": {item.summary}" if item.summary else ""
            table.add_row(item.name, f"wraps another, {item.name}/NAME{about}")
            continue
        said = _promises(item.traits, every_trait) or ["nothing"]
        missing = ", ".join(part for part in OPTIONAL_PARTS if part not in item.provides)
        said += [f"not provided: {missing}"] if missing else []
        table.add_row(item.name, "; ".join(said))
    return table


def properties_table(properties: Sequence[Property | NotLoaded]) -> Table:
    """The installed properties: what each asks."""
    table = plain_table("properties")
    table.add_column("id", no_wrap=True)
    table.add_column("asks")
    for item in properties:
        if isinstance(item, NotLoaded):
            table.add_row(item.formulation, Text(f"not loaded: {item.reason}", style="red"))
        else:
            table.add_row(item.id, item.summary)
    return table


def plain_table(title: str) -> Table:
    """A table without lines that a narrow terminal would break."""
    return Table(
        title=title or None, title_justify="left", title_style="bold", header_style="bold", box=box.SIMPLE_HEAD
    )


def _asked(about: Mapping[str, str]) -> str:
    return f"profile {about.get('profile')}, {about.get('examples')} examples a property, seed {about.get('seed')}"


def _promises(traits: Traits, every_trait: bool) -> list[str]:
    said: list[str] = [] if traits.enforcement == "penalty" else [f"by {traits.enforcement}"]
    if traits.passes_flat_patch is not None:
        said.append("passes the flat patch test" if traits.passes_flat_patch else "fails the flat patch test")
    if traits.tangent is not None:
        said.append(f"{traits.tangent} tangent")
    if not every_trait:
        return said
    for name, positive, negative in (
        ("covers_overhang", "passes where the slave overhangs", "fails where the slave overhangs"),
        ("independent_multipliers", "independent multipliers", "dependent multipliers"),
        ("conserves_force", "conserves force", "does not conserve force"),
        ("conserves_moment", "conserves moment", "does not conserve moment"),
        ("symmetric", "symmetric", "unsymmetric"),
    ):
        value = getattr(traits, name)
        if value is not None:
            said.append(positive if value else negative)
    said += [f"{word} {value}" for word, value in (("area", traits.area), ("penalty", traits.penalty)) if value]
    said += [f"{traits.continuity} when sliding"] if traits.continuity else []
    return said + [f"{property_id} fails on {case}" for property_id, case in sorted(traits.witnesses.items())]


def _worst(row: Row) -> tuple[str, str, str]:
    """Value and tolerance of what came closest to its tolerance, or farthest beyond it; its name if one of several."""
    worst: tuple[float, str, str, str] | None = None
    for outcome in (*row.outcomes, *((row.witness,) if row.witness else ())):
        measured = outcome.measurement
        if measured is None or outcome.verdict is Verdict.UNDECIDED:
            continue
        for quantity in row.question.quantities:
            if quantity.name not in measured.values:
                continue
            value, tolerance = measured.values[quantity.name], measured.tolerances[quantity.name]
            far = excess(quantity, value, tolerance)
            if worst is None or far > worst[0]:
                sign = "≤" if quantity.sense == "at most" else "≥"
                name = quantity.name if len(row.question.quantities) > 1 else ""
                worst = far, f"{value:.2g}", f"{sign} {tolerance:.2g}", name
    return worst[1:] if worst else ("", "", "")


def _remark(row: Row | Cell, known: str, undecided: int) -> str:
    parts = [
        row.unexpected.upper() if row.unexpected else "",
        f"known: {known}" if known else "",
        row.reason if row.verdict not in (Verdict.PASS, Verdict.FAIL) else "",
        f"{undecided} undecided" if undecided else "",
    ]
    return "; ".join(part for part in parts if part)


def _numbers(question: Property, outcome: Outcome) -> list[str]:
    """Each quantity against its tolerance; the reason where there are none."""
    measured: Measurement | None = outcome.measurement
    if measured is None:
        return [outcome.reason]
    lines = [measured.broken] if measured.broken else []
    told = [quantity for quantity in question.quantities if quantity.name in measured.values]
    apart = len(told) > _FEW  # then a formula that several share is written once, below
    for quantity in told:
        value, tolerance = measured.values[quantity.name], measured.tolerances[quantity.name]
        mark = "✗" if excess(quantity, value, tolerance) > 1 else "✓"
        formula = "" if apart else f" = {quantity.tolerance}"
        lines.append(f"{mark} {quantity.name} {value:.3g}, {quantity.sense} {tolerance:.3g}{formula}")
    if apart:
        formulas: dict[str, list[str]] = {}
        for quantity in told:
            formulas.setdefault(quantity.tolerance, []).append(quantity.name)
        most = max(formulas, key=lambda formula: len(formulas[formula]))
        lines.append(f"tolerance: {most}")
        lines += [f"of {', '.join(names)}: {formula}" for formula, names in formulas.items() if formula != most]
    if measured.details:
        lines.append("; ".join(_detail(name, value) for name, value in measured.details.items()))
    return lines


def _detail(name: str, value: float) -> str:
    """A further number; how Newton ended, in words."""
    what, _, of = name.partition(", ")
    words = End(int(value)).words if what == "end" and value in list(End) else f"{value:.3g}"
    return f"{what} {words}{f' ({of})' if of else ''}"
