"""A counterexample for its reader: numbers, drawing and picture, and the line that replays it."""

from __future__ import annotations

import shlex
import textwrap
from collections.abc import Mapping
from itertools import chain
from pathlib import Path

import typer
from rich.table import Table
from rich.text import Text

from contactverif.api.drawing import make_drawing
from contactverif.cli.console import indent_below, plain_table
from contactverif.cli.output_files import SOLVED_SCENE, OutputFiles
from contactverif.contract.case import Case
from contactverif.contract.counterexample import Counterexample, failing_examples
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import PLANE
from contactverif.contract.measurement import CheckedNumber
from contactverif.contract.names import parse_name
from contactverif.contract.property import Outcome, Property, PropertyInfo, Verdict, checked_numbers
from contactverif.contract.result import Result, Run
from contactverif.contract.subject import Subject
from contactverif.plugins.registry import formulation_names
from contactverif.run.judge import forces_to_draw
from contactverif.run.ranking import by_rank, first_failure
from contactverif_reports.draw import as_text


def counterexample_text(example: Counterexample, report: Path | None, width: int = 10**4) -> Text:
    """Return numbers and drawing of a counterexample, and the line that replays it if there is a report.

    Words are folded to a width. A drawing and a command are not.
    """
    row, outcome = example.row, example.outcome
    words = (textwrap.wrap(each, max(width - 4, 20), subsequent_indent="  ") for each in _numbers(row.info, outcome))
    title = f"{row.formulation}, {row.property_id}: {row.result}, {example.label}"
    text = indent_below(
        "\n".join(textwrap.wrap(title, max(width, 20), subsequent_indent="  ", break_on_hyphens=False)),
        *chain.from_iterable(words),
        *([f"promised by {row.promised_by}"] if row.promised_by else []),
        *as_text(outcome.case).splitlines(),
        *([] if report is None else [example.replay_command(str(report))]),
    )
    text.no_wrap, text.overflow = True, "ignore"
    return text


def how_to_keep(run: Run) -> str:
    """Say how the cases that fail are stored, so that they can be replayed; empty where there is none."""
    seed = run.provenance.get("seed")
    return f"to keep these cases: the same command with --seed {seed} --out FILE.nc" if failing_examples(run) else ""


def how_to_explain(run: Run, report: Path | None) -> str:
    """Return the line that explains the first row of the screen that fails, with its numbers if a report has them."""
    failing = by_rank(row for row in run.rows if row.verdict in (Verdict.FAIL, Verdict.CRASHED))
    news = [row for row in failing if row.result is Result.FAIL]
    row = first_failure(failing) or next(iter([*news, *failing]), None)
    if row is None:
        return ""
    stored = report is not None and any(example.row is row for example in failing_examples(run))
    option = f" --report {shlex.quote(str(report))}" if stored else ""
    return f"to have a row explained: contactverif explain {row.property_id}{option}"


def replay_table(example: Counterexample, formulation: str, outcome: Outcome) -> Table:
    """Return the verdict that the report stores beside the verdict now."""
    table = plain_table()
    for column in ("", "formulation", "verdict", "reason"):
        table.add_column(column)
    table.add_row("stored", example.formulation, str(example.verdict), example.reason)
    table.add_row("now", formulation, str(outcome.verdict), outcome.reason)
    return table


def draw_outcome(subject: Subject, question: Property, outcome: Outcome, path: Path, argument: str) -> None:
    """Draw the case of an outcome to a picture, or write a case in space for ParaView."""
    try:
        if path.suffix.lower() == SOLVED_SCENE:
            from contactverif_reports.draw.surface_vtu import write_surfaces

            write_surfaces(outcome.case, forces_to_draw(question, outcome.case, subject), path)
            return
        make_drawing(subject, question, outcome).write(path)
    except MisuseError as error:
        raise MisuseError(argument, error.found, error.needed) from None


def check_surfaces(case: Case, files: OutputFiles) -> None:
    """Refuse a file for ParaView of an interface in the plane."""
    if case.interface.dim == PLANE and SOLVED_SCENE in files.names:
        raise MisuseError("--out", f"{files.names[SOLVED_SCENE]} for a case without bodies", "a .png or .svg file")


def announce_stored(name: str) -> str:
    """Say on standard error which formulation a report names, before it is loaded; return the name.

    Running it runs installed code with options that a stranger may have chosen.
    """
    base, options = parse_name("REPORT", name)
    installed = formulation_names()
    for part in base.split("/"):
        if part not in installed:
            needed = "an installed one: install its plugin, or give --formulation NAME"
            raise MisuseError("REPORT", f"the formulation {part!r}, which is not installed", needed)
    listed = ", ".join(f"{option} = {value!r}" for option, value in options.items())
    typer.echo(f"the report names the formulation {base}, {listed or 'without options'}", err=True)
    return name


def ending_lines(outcome: Outcome) -> list[str]:
    """Return how Newton's method ended where a property solved, with advice where it did not converge."""
    details: Mapping[str, float] = outcome.measurement.details if outcome.measurement is not None else {}
    lines = []
    for name, value in details.items():
        kind, _, solution = name.partition(", ")
        iterations = details.get(name.replace("end", "iterations", 1))
        if kind == "end" and iterations is not None:
            label = f" ({solution})" if solution else ""
            lines.append(f"Newton's method{label}: {_ending(value, iterations)}")
    return lines


def _ending(value: float, iterations: float) -> str:
    from contactverif.mechanics.trace import End  # It brings scipy, and is needed only where a property solved.

    end = End(int(value))
    after = f"after {iterations:g} iteration{'s' * (iterations != 1)}"
    return f"{end.label} {after}" if end is End.CONVERGED else f"{end.label} {after}: {end.advice}"


def _numbers(info: PropertyInfo, outcome: Outcome) -> list[str]:
    """Return the numbers that fail, or all, beside their tolerances, and how Newton ended; else the reason."""
    measurement = outcome.measurement
    if measurement is None:
        return [outcome.reason]
    lines = [f"✗ {measurement.broken}"] if measurement.broken else []
    lines += [str(measurement.finding)] if measurement.finding is not None else []
    numbers = checked_numbers(info, measurement)
    wrong = [number for number in numbers if number.ratio > 1]
    judged = wrong or ([] if measurement.broken else numbers)
    lines += [_checked_line(number, "✗" if wrong else "✓") for number in judged]
    others = [_detail(name, value) for name, value in measurement.details.items() if not _is_ending(name)]
    return lines + ending_lines(outcome) + (["; ".join(others)] if others else [])


def _checked_line(number: CheckedNumber, mark: str) -> str:
    quantity = number.quantity
    return f"{mark} {quantity.name}: {number.value:.3g}, must be {quantity.sense} {number.tolerance:.3g}"


def _is_ending(detail: str) -> bool:
    return detail.partition(", ")[0] in ("end", "iterations")


def _detail(name: str, value: float) -> str:
    kind, _, solution = name.partition(", ")
    return f"{kind}{f' ({solution})' if solution else ''}: {value:.3g}"
