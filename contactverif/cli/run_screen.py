"""The screen of a run in few lines: what is wrong, the most telling failure with its mesh, and what is kept.

Of each formulation it shows what breaks a promise first, then what fails without one, then what fails as stated, and
at last the families of what passes. `run_tables` has every row.
"""

from __future__ import annotations

import shlex
import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from rich.console import Console, ConsoleOptions
from rich.text import Text

from contactverif.cli.console import echo, fold, indent_below, line, show, show_verbatim
from contactverif.cli.options import Screen
from contactverif.cli.run_tables import RunTable, finding_of, headline, remark_of
from contactverif.contract.counterexample import Counterexample, counterexamples, failing_examples
from contactverif.contract.property import Outcome, PropertyInfo, Verdict, checked_numbers
from contactverif.contract.result import (
    BROKEN_BY_FAILING,
    NOT_HERE,
    NOT_JUDGED,
    OMITTED,
    OPPOSITE_SIGN,
    Result,
    Row,
    Run,
)
from contactverif.run.ranking import by_rank, first_failure, wrong_rows
from contactverif_reports.plot.text import as_text
from contactverif_reports.tables import STYLES

_MOST_ROWS = 12  # The rows of a part that have a line each.
_MOST_WRONG = 8  # The same of those that are wrong beside the most telling one.
_MOST_IDS = 4  # The ids of a family that are listed in a sentence.
_LEAST_NAME = 12  # Columns of the name of a number that are left.
_LEAST_WORDS = 30  # Columns that are left for words beside a name, however long it is.
_PARTS = {  # The results that show no mistake and have a line for each row, and the title above them.
    Result.FAIL: "fails, and promises nothing",
    Result.FAILS_AS_STATED: "fails as stated",
    Result.UNDECIDED: "undecided",
    Result.NOT_JUDGED: "not judged",
}
_COUNTED = {
    Result.PASS: "pass",
    Result.FAILS_AS_STATED: "fail as stated",
    Result.FAIL: "fail without a promise",
    Result.UNDECIDED: "undecided",
    Result.NOT_JUDGED: "not judged",
    Result.OMITTED: "not asked",
    Result.NOT_APPLICABLE: "do not apply",
    Result.NOT_PROVIDED: "need a missing part",
}


def show_run(result: Run, screen: Screen, report: Path | None) -> None:
    """Show a run as the user wants it: its few telling lines, or every row, and counterexamples."""
    show(RunTable(result) if screen.verbose else RunScreen(result, report))
    if screen.verbose or screen.show == "all":
        for example in failing_examples(result):
            show_verbatim(counterexample_text(example, report))
    if advice := how_to_explain(result, report):
        echo(advice)


@dataclass(frozen=True, slots=True)
class RunScreen:
    """The results of a run for a person, in at most 80 columns.

    One formulation that keeps its promises takes at most 25 lines, and one with a mistake at most 60. Where several
    are shown, those that keep their promises take a few lines each.
    """

    run: Run
    report: Path | None = None  # The report from which a counterexample can be replayed.

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        width, names = options.max_width, self.run.formulations
        yield Text(headline(self.run.provenance))
        for name in names:
            yield Text("")
            yield from self._formulation(name, width, alone=len(names) == 1)
        for plugin in self.run.not_loaded:
            yield Text("")
            yield fold(f"{plugin.formulation}: {Result.NOT_LOADED}: {plugin.reason}", width, "red", indent=0)
        yield Text("")

    def _formulation(self, name: str, width: int, *, alone: bool) -> Iterator[Text]:
        rows = [row for row in self.run.rows if row.formulation == name]
        wrong = wrong_rows(rows)
        yield _title(name, rows, wrong, width)
        if name in self.run.opposite_signs:
            yield fold(OPPOSITE_SIGN, width, "bold red", indent=2)
        if name in self.run.diagnoses:
            yield fold(f"diagnosis: {self.run.diagnoses[name]}", width, "bold", indent=2)
        if (row := first_failure(rows)) is not None:
            yield self._with_mesh(row, width)
            yield Text("")
        yield from _part("also wrong", wrong[1:], width, _MOST_WRONG)
        yield from _say_what_is_left_out(rows, width)
        yield from _remarks(rows, width)
        yield from _other_failures(rows, width, in_full=alone and not wrong)
        yield from _families(rows, width)
        yield from _say_what_the_place_lacks(rows, width)

    def _with_mesh(self, row: Row, width: int) -> Text:
        """Return a row that is wrong, with the mesh that shows it, if one does."""
        for example in counterexamples(self.run).values():
            if example.row is row and row.verdict in (Verdict.FAIL, Verdict.CRASHED):
                return counterexample_text(example, self.report, width)
        return fold(f"{row.property_id}: {row.result}: {remark_of(row)}", width, STYLES[row.result], indent=2)


def _title(name: str, rows: Sequence[Row], wrong: Sequence[Row], width: int) -> Text:
    """Return the line of a formulation: how many properties are wrong, or what the others come to."""
    counts = Counter(row.result for row in rows)
    words = [f"{len(wrong)} wrong"] if wrong else []
    words += [f"{counts[result]} {text}" for result, text in _COUNTED.items() if counts[result]]
    text = f"{name}: {', '.join(words)}" if words else name
    return fold(text, width, "bold red" if wrong else "bold", indent=0)


def _other_failures(rows: Sequence[Row], width: int, *, in_full: bool) -> Iterator[Text]:
    """Yield the failures that break no promise, and what was left open; in full with a line for each."""
    for result, title in _PARTS.items():
        part = by_rank(row for row in rows if row.result is result)
        if in_full or result is Result.NOT_JUDGED:  # Such a row makes a run fail, too: its reason is wanted.
            yield from _part(title, part, width)
        elif part:
            yield fold(f"{title}: {', '.join(row.property_id for row in part)}", width, indent=0)


def _part(title: str, rows: Sequence[Row], width: int, most: int = _MOST_ROWS) -> Iterator[Text]:
    """Yield a line for each row below a title; of many rows the last ones have their names alone."""
    if not rows:
        return
    yield Text(f"{title}:", style="bold")
    listed = rows if len(rows) <= most + 1 else rows[:most]
    names = max(len(row.property_id) for row in listed)
    for row in listed:
        room = max(width - names - 4, _LEAST_WORDS)
        text = line(f"  {row.property_id:{names}}  {_words(row, room)}".rstrip())
        text.stylize(STYLES.get(row.result, ""), 2, 2 + len(row.property_id))
        yield text
    if others := rows[len(listed) :]:
        yield fold(f"and {len(others)} more: {', '.join(row.property_id for row in others)}", width, indent=2)


def _remarks(rows: Sequence[Row], width: int) -> Iterator[Text]:
    """Yield what a property says of a formulation that passes it: a doubt, or how stiff its springs are."""
    for row in rows:
        words = "; ".join(filter(None, (row.suspicion, finding_of(row)))) if row.result is Result.PASS else ""
        if words:
            yield fold(f"{row.property_id} passes, and says: {words}", width, "yellow", indent=0)


def _words(row: Row, room: int) -> str:
    """Return what a line says of a row: the number that is furthest beyond its tolerance, or why there is none.

    Where there is no room for all, it is the name of the number that is cut.
    """
    before = f"{row.unexpected}; " if row.unexpected not in ("", BROKEN_BY_FAILING, NOT_JUDGED) else ""
    behind = f"; known: {row.known}" if row.known else ""
    if row.verdict is not Verdict.FAIL or row.breach or row.closest is None or row.fails_in_words:
        return _shorten(f"{before}{row.reason}{behind}".removesuffix("; "), room)
    number = row.closest.number
    behind = f" {number.value:.3g}, {number.quantity.sense} {number.tolerance:.3g}{behind}"
    return _shorten(f"{before}{_shorten(number.quantity.name, room - len(before) - len(behind))}{behind}", room)


def _shorten(words: str, room: int) -> str:
    """Return words that fit, with an ellipsis at their end where they do not."""
    return words if len(words) <= room else f"{words[: max(room, _LEAST_NAME) - 1].rstrip()}…"


def _families(rows: Sequence[Row], width: int) -> Iterator[Text]:
    """Yield the families of the properties that pass, such as `patch 12 of 14`."""
    members: dict[str, list[Row]] = {}
    for row in rows:
        if row.result not in (Result.NOT_APPLICABLE, Result.NOT_PROVIDED):
            members.setdefault(row.info.family, []).append(row)
    passing = {family: sum(row.result is Result.PASS for row in group) for family, group in members.items()}
    words = [f"{family} {count} of {len(members[family])}" for family, count in passing.items() if count]
    if words:
        yield fold(f"passes: {', '.join(words)}", width, STYLES[Result.PASS], indent=0)


def _say_what_is_left_out(rows: Sequence[Row], width: int) -> Iterator[Text]:
    """Say how many properties were not asked because of what the first ones had shown, and how to ask them."""
    rows = [row for row in rows if row.omitted]
    if rows:
        reason = rows[0].reason.removeprefix(OMITTED)
        yield fold(f"{len(rows)} properties were not asked: {reason}. --keep-going asks them all.", width, indent=0)


def _say_what_the_place_lacks(rows: Sequence[Row], width: int) -> Iterator[Text]:
    """Say what the mesh or the scene of the run lacks, and which properties were not asked for this reason."""
    lacking: dict[str, list[Row]] = {}
    for row in rows:
        if row.reason.startswith(NOT_HERE):
            lacking.setdefault(row.reason.removeprefix(NOT_HERE), []).append(row)
    if lacking:
        yield Text("not asked here, needs:", style="bold")
    for needs, group in lacking.items():
        yield fold(f"{needs}: {', '.join(_fold_families(group))}", width, indent=2)


def _fold_families(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the ids of rows, and of a family with many of them the number."""
    families: dict[str, list[str]] = {}
    for row in rows:
        families.setdefault(row.info.family, []).append(row.property_id)
    for family, ids in families.items():
        yield from [f"{len(ids)} of {family}"] if len(ids) > _MOST_IDS else ids


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


def ending_lines(outcome: Outcome) -> list[str]:
    """Return how Newton's method ended where a property solved, with advice where it did not converge."""
    details: Mapping[str, float] = outcome.measurement.details if outcome.measurement is not None else {}
    lines = []
    for name, value in details.items():
        kind, _, solution = name.partition(", ")
        iterations = details.get(name.replace("end", "iterations", 1))
        if kind == "end" and iterations is not None:
            from contactverif.mechanics.newton import (
                End,  # It brings scipy, and is needed only where a property solved.
            )

            end = End(int(value))
            words = f"{end.label} after {iterations:g} iteration{'s' * (iterations != 1)}"
            label = f" ({solution})" if solution else ""
            lines.append(f"Newton's method{label}: {words}{'' if end is End.CONVERGED else f': {end.advice}'}")
    return lines


def _numbers(info: PropertyInfo, outcome: Outcome) -> list[str]:
    """Return the numbers that fail, or all, beside their tolerances, and how Newton ended; else the reason."""
    measurement = outcome.measurement
    if measurement is None:
        return [outcome.reason]
    lines = [f"✗ {measurement.broken}"] if measurement.broken else []
    lines += [str(measurement.finding)] if measurement.finding is not None else []
    numbers = checked_numbers(info, measurement)
    wrong = [number for number in numbers if number.ratio > 1]
    for number in wrong or ([] if measurement.broken else numbers):
        mark, quantity = "✗" if wrong else "✓", number.quantity
        lines.append(f"{mark} {quantity.name}: {number.value:.3g}, must be {quantity.sense} {number.tolerance:.3g}")
    others = []
    for name, value in measurement.details.items():
        kind, _, solution = name.partition(", ")
        if kind not in ("end", "iterations"):
            others.append(f"{kind}{f' ({solution})' if solution else ''}: {value:.3g}")
    return lines + ending_lines(outcome) + (["; ".join(others)] if others else [])
