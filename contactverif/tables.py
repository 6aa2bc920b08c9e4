"""How a run reads in a terminal: tables that line up, counterexamples drawn in text, one line that sums up."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from contactverif.formulation import Traits
from contactverif.property import Measurement, Outcome, Property, Verdict, excess
from contactverif.result import NotLoaded, Row, Run
from contactverif.subject import Subject
from contactverif_reports.draw import as_text
from contactverif_reports.read import StoredCase
from contactverif_reports.schema import case_id

_STYLES = {Verdict.PASS: "green", Verdict.FAIL: "red", Verdict.CRASHED: "red", Verdict.NOT_JUDGED: "yellow"}
_PROMISES = {True: "passes", False: "fails", None: "–"}
_PIPE_WIDTH = 140  # columns where no terminal says how many there are


def show(what: RenderableType) -> None:
    """Print to standard output, as wide as the terminal, or wide enough where there is none."""
    console = Console(width=None if sys.stdout.isatty() else _PIPE_WIDTH, highlight=False, soft_wrap=False)
    console.print(what)


def run_table(found: Run) -> Table:
    """A line for each formulation and property: what was promised, what it does, how close to the tolerance."""
    table = Table(title=_asked(found), title_justify="left", title_style="", header_style="bold")
    for name in ("formulation", "property", "promise", "verdict"):
        table.add_column(name, no_wrap=True)
    for name in ("judged", "worst", "tolerance"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("remark")
    previous = None
    for row in found.rows:
        if previous not in (None, row.formulation):
            table.add_section()
        value, tolerance, quantity = _worst(row)
        judged = f"{row.judged}/{row.planned}" if row.planned else "–"
        table.add_row(
            "" if row.formulation == previous else row.formulation,
            row.question.id,
            _PROMISES[row.promise],
            Text(str(row.verdict), style=_STYLES.get(row.verdict, "dim")),
            judged,
            value,
            tolerance,
            _remark(row, quantity),
        )
        previous = row.formulation
    for item in found.not_loaded:
        table.add_row(item.formulation, "", "", Text(str(Verdict.NOT_LOADED), style="red"), "–", "", "", item.reason)
    return table


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
    if found.passed:
        return Text("every promise kept, every property judged", style="green")
    return Text(f"{len(wrong)} unexpected: {'; '.join(wrong)}" if wrong else "nothing was asked", style="red")


def replayed(stored: StoredCase, name: str, outcome: Outcome) -> Table:
    """What the report says of a case beside what comes out now."""
    table = Table(header_style="bold")
    for column in ("", "formulation", "verdict", "reason"):
        table.add_column(column)
    table.add_row("stored", stored.formulation, str(stored.verdict), stored.reason)
    table.add_row("now", name, str(outcome.verdict), outcome.reason)
    return table


def formulations_table(formulations: Sequence[Subject | NotLoaded], *, every_trait: bool) -> Table:
    """The installed formulations: what each promises, or why it does not load."""
    table = Table(title="formulations", title_justify="left", title_style="bold", header_style="bold")
    table.add_column("name", no_wrap=True)
    table.add_column("promises")
    table.add_column("not provided")
    for item in formulations:
        if isinstance(item, NotLoaded):
            table.add_row(item.formulation, Text(f"not loaded: {item.reason}", style="red"), "")
            continue
        missing = ", ".join(part for part in ("pair", "tangent", "contact_points") if part not in item.provides)
        table.add_row(item.name, "; ".join(_promises(item.traits, every_trait)) or "nothing", missing)
    return table


def properties_table(properties: Sequence[Property | NotLoaded]) -> Table:
    """The installed properties: what each asks."""
    table = Table(title="properties", title_justify="left", title_style="bold", header_style="bold")
    table.add_column("id", no_wrap=True)
    table.add_column("asks")
    for item in properties:
        if isinstance(item, NotLoaded):
            table.add_row(item.formulation, Text(f"not loaded: {item.reason}", style="red"))
        else:
            table.add_row(item.id, item.summary)
    return table


def _asked(found: Run) -> str:
    about = found.provenance
    return f"profile {about.get('profile')}, {about.get('examples')} examples a property, seed {about.get('seed')}"


def _promises(traits: Traits, every_trait: bool) -> list[str]:
    said = []
    if traits.passes_flat_patch is not None:
        said.append("passes the flat patch test" if traits.passes_flat_patch else "fails the flat patch test")
    if traits.tangent is not None:
        said.append(f"{traits.tangent} tangent")
    if not every_trait:
        return said
    for name, positive, negative in (
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
    """Value, tolerance and name of the quantity that came closest to its tolerance, or farthest beyond it."""
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
                worst = far, f"{value:.2g}", f"{sign} {tolerance:.2g}", quantity.name
    return worst[1:] if worst else ("", "", "")


def _remark(row: Row, quantity: str) -> str:
    undecided = sum(outcome.verdict is Verdict.UNDECIDED for outcome in row.outcomes)
    parts = [
        row.unexpected.upper() if row.unexpected else "",
        f"known: {row.known}" if row.known else "",
        quantity if row.verdict in (Verdict.PASS, Verdict.FAIL) and len(row.question.quantities) > 1 else "",
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
    for quantity in question.quantities:
        if quantity.name not in measured.values:
            continue
        value, tolerance = measured.values[quantity.name], measured.tolerances[quantity.name]
        mark = "✗" if excess(quantity, value, tolerance) > 1 else "✓"
        lines.append(f"{mark} {quantity.name} {value:.3g}, {quantity.sense} {tolerance:.3g} = {quantity.tolerance}")
    return lines
