"""How a run reads in a terminal: tables that line up, counterexamples drawn in text, one line that sums up."""

from __future__ import annotations

import os
import shlex
import sys
import textwrap
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from rich import box
from rich.console import Console, ConsoleOptions, RenderableType
from rich.table import Table
from rich.text import Text

from contactverif.contract.formulation import Traits
from contactverif.contract.property import Measurement, Outcome, Property, Verdict, excess
from contactverif.contract.result import NotLoaded, Result, Row, Run, result_of
from contactverif.contract.subject import OPTIONAL_PARTS, Subject
from contactverif.run.registry import Wrapper
from contactverif_reports.draw import as_text
from contactverif_reports.netcdf.read import StoredCase
from contactverif_reports.netcdf.schema import case_id

if TYPE_CHECKING:  # slow to import
    from contactverif_reports.compare.cells import Cell
    from contactverif_reports.netcdf.stored import StoredReport, StoredRow

STYLES = {  # Red only where the run fails by it; what a formulation states itself is no news.
    Result.PASS: "green",
    Result.FAIL: "magenta",
    Result.BROKEN_PROMISE: "bold red",
    Result.CRASHED: "red",
    Result.NOT_LOADED: "red",
    Result.NOT_JUDGED: "yellow",
    Result.UNDECIDED: "yellow",
}
PLAIN_STYLE = "dim"  # The style of the other results.
_PROMISES = {True: "passes", False: "fails", None: "–"}
_PIPE_WIDTH = 140  # columns where no terminal says how many there are
_COLUMNS = ("property", "promise", "result", "judged", "closest", "tolerance")
_RIGHT_ALIGNED = _COLUMNS[3:]
_LEGEND = {
    "promise": "what the formulation states about itself: it passes, it fails, or – nothing",
    "judged": "random cases that could be decided, of those planned",
    "closest": "of all measured numbers the one nearest to its tolerance, or furthest beyond it",
}
_PLURALS = {
    "broken promise": "broken promises",
    "crash": "crashes",
    "property not judged": "properties not judged",
    "plugin not loaded": "plugins not loaded",
}
_MEANINGS = {  # Results that are explained below the table where they occur in it.
    Result.FAIL: "the formulation fails, and states nothing about this property: news, but no broken promise",
    Result.FAILS_AS_STATED: "the formulation states itself that it fails here, or --known lists it",
    Result.BROKEN_PROMISE: "the formulation does not do what it states",
    Result.UNDECIDED: "roundoff or a kink leaves open whether it passes; the reason stands beside it",
    Result.NOT_JUDGED: "fewer than 90 % of the planned cases could be decided",
    Result.NOT_APPLICABLE: "the property makes no sense for this formulation",
    Result.NOT_PROVIDED: "the formulation leaves out a part that the property needs",
}


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
    result: Result
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
    yield Text(headline(provenance))
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
        text.stylize(STYLES.get(one.result, PLAIN_STYLE), at_verdict, at_verdict + len(one.cells[2]))
        yield text
        if one.remark and not behind:
            yield _folded(one.remark, max_width)
    for name, reason in not_loaded.items():
        yield Text(name, style="bold")
        yield _folded(f"{Verdict.NOT_LOADED}: {reason}", max_width, style="red")
    if lines:
        yield from _legend({line.result for line in lines}, max_width)


def _legend(results: Collection[Result], max_width: int) -> Iterator[Text]:
    """Explain the columns, and those of the results that do not explain themselves."""
    entries = _LEGEND | {str(result): words for result, words in _MEANINGS.items() if result in results}
    width = max(map(len, entries))
    yield Text("")
    for name, words in entries.items():
        indent = " " * (width + 4)
        folded = textwrap.wrap(words, max(max_width - len(indent), 20))
        yield Text(f"  {name:{width}}  " + f"\n{indent}".join(folded), style="dim", no_wrap=True, overflow="ignore")
    yield Text("")


def _line(row: Row) -> _Line:
    value, tolerance, quantity = _worst(row)
    judged = f"{row.judged}/{row.planned}" if row.planned else "–"
    cells = row.question.id, _PROMISES[row.promise], str(row.result), judged, value, tolerance
    undecided = sum(outcome.verdict is Verdict.UNDECIDED for outcome in row.outcomes)
    return _Line(row.formulation, row.result, cells, quantity, _remark(row, row.known, undecided))


def _stored_line(row: StoredRow) -> _Line:
    cell, worst = row.cell, row.furthest
    value = f"{worst.value:.2g}" if worst else ""
    tolerance = f"{worst.sign} {worst.tolerance:.2g}" if worst else ""
    judged = f"{cell.judged}/{cell.planned}" if cell.planned else "–"
    result = result_of(cell.verdict, cell.promise, row.known, cell.unexpected)
    cells = cell.property_id, _PROMISES[cell.promise], str(result), judged, value, tolerance
    quantity = worst.quantity.name if worst and row.n_quantities > 1 else ""
    return _Line(cell.formulation, result, cells, quantity, _remark(cell, row.known, row.undecided))


def _aligned(cells: Sequence[str], widths: Sequence[int]) -> str:
    return "  ".join(
        cell.rjust(width) if name in _RIGHT_ALIGNED else cell.ljust(width)
        for name, cell, width in zip(_COLUMNS, cells, widths, strict=True)
    )


def _folded(words: str, width: int, style: str = "") -> Text:
    """Words of any length below a line, indented."""
    lines = textwrap.wrap(words, max(width - 6, 20))
    return Text("\n".join("      " + line for line in lines), style=style, no_wrap=True, overflow="ignore")


def counterexample(row: Row, report: Path | None) -> Text | None:
    """Draw the smallest mesh found on which the row fails, with the line that replays it; None if nothing failed."""
    outcome = row.shrunk or row.witness
    if row.verdict not in (Verdict.FAIL, Verdict.CRASHED) or outcome is None:
        return None
    which = f"the case {outcome.case.name}" if outcome is row.witness else "the smallest case found"
    lines = [
        f"{row.formulation}, {row.question.id}: {row.result}, {which}",
        *(f"    {line}" for line in _numbers(row.question, outcome)),
        *(f"    {line}" for line in as_text(outcome.case).splitlines()),
    ]
    if report is not None:
        name = case_id(row.formulation, row.question.id, witness=outcome is row.witness)
        lines.append(f"    contactverif replay {shlex.quote(str(report))} --case {shlex.quote(name)}")
    return Text("\n".join(["", *lines]))


def how_to_keep(found: Run) -> Text | None:
    """Say how the drawn cases are stored, so that they can be replayed; None where none was drawn."""
    if all(counterexample(row, None) is None for row in found.rows):
        return None
    seed = found.provenance.get("seed")
    return Text(f"\nTo keep these cases and replay them, run the same command with --seed {seed} --out FILE.nc\n")


def summary(found: Run) -> Text:
    """Say in the last line whether every promise is kept, and if not what is wrong."""
    wrong = [(row.result, f"{row.formulation} {row.question.id}", row.unexpected) for row in found.rows]
    return conclusion(wrong, [item.formulation for item in found.not_loaded])


def stored_summary(found: StoredReport) -> Text:
    """Say the same of a stored report."""
    wrong = []
    for row in found.rows.values():
        cell = row.cell
        result = result_of(cell.verdict, cell.promise, row.known, cell.unexpected)
        wrong.append((result, f"{cell.formulation} {cell.property_id}", cell.unexpected))
    return conclusion(wrong, list(found.not_loaded))


def conclusion(rows: Sequence[tuple[Result, str, str]], not_loaded: Sequence[str]) -> Text:
    """Sum up rows (result, formulation and property, why it fails the run) and plugins that did not load."""
    wrong = {result: [(name, why) for found, name, why in rows if found is result and why] for result in Result}
    said = [
        *_counted("broken promise", [f"{name} ({why})" for name, why in wrong[Result.BROKEN_PROMISE]]),
        *_counted("crash", [name for name, _ in wrong[Result.CRASHED]]),
        *_counted("property not judged", [name for name, _ in wrong[Result.NOT_JUDGED]]),
        *_counted("plugin not loaded", not_loaded),
    ]
    if said:
        return Text(". ".join(said) + ".", style="red")
    if not rows:
        return Text("Nothing was checked.", style="red")
    return Text("Every promise is kept and every property was judged.", style="green")


def _counted(what: str, names: Sequence[str]) -> list[str]:
    """Return "2 broken promises: …" in a list, or an empty one where there are no names."""
    if not names:
        return []
    return [f"{len(names)} {what if len(names) == 1 else _PLURALS[what]}: {'; '.join(names)}"]


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


def headline(about: Mapping[str, str]) -> str:
    """Say how much was asked, from the root attributes of a run."""
    profile, examples, seed = (about.get(name) for name in ("profile", "examples", "seed"))
    return f"profile {profile}: {examples} random cases for each property, seed {seed}"


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
        row.unexpected if row.unexpected not in ("", "crashed", "not judged") else "",
        f"known: {known}" if known else "",
        row.reason if row.verdict not in (Verdict.PASS, Verdict.FAIL) else "",
        f"{undecided} undecided" if undecided else "",
    ]
    return "; ".join(part for part in parts if part)


def _numbers(question: Property, outcome: Outcome) -> list[str]:
    """Write each quantity beside its tolerance and how Newton ended; the reason where nothing was measured."""
    measured: Measurement | None = outcome.measurement
    if measured is None:
        return [outcome.reason]
    lines = [measured.broken] if measured.broken else []
    for quantity in question.quantities:
        if quantity.name in measured.values:
            value, tolerance = measured.values[quantity.name], measured.tolerances[quantity.name]
            mark = "✗" if excess(quantity, value, tolerance) > 1 else "✓"
            lines.append(f"{mark} {quantity.name}: {value:.3g}, must be {quantity.sense} {tolerance:.3g}")
    return lines + _details(measured.details)


def _details(details: Mapping[str, float]) -> list[str]:
    """Write how each solution ended, a line each, then the other details in one line."""
    lines, others = [], []
    for name, value in details.items():
        what, _, which = name.partition(", ")
        behind = f" ({which})" if which else ""
        iterations = details.get(name.replace("end", "iterations", 1))
        if what == "end" and iterations is not None:
            lines.append(f"Newton's method{behind}: {_ending(value, iterations)}")
        elif what != "iterations":
            others.append(f"{what}{behind}: {value:.3g}")
    return lines + (["; ".join(others)] if others else [])


def _ending(value: float, iterations: float) -> str:
    """Say how a solution ended and, if it did not converge, what to try next."""
    from contactverif.mechanics.newton import End  # only where a property has solved a scene

    end = End(int(value))
    after = f"after {iterations:g} iteration{'s' * (iterations != 1)}"
    return f"{end.label} {after}" if end is End.CONVERGED else f"{end.label} {after}: {end.advice}"
