"""The table of a run in the terminal, and the line that sums it up.

A table reads a `Run`, from memory or from a file, and needs no more than 80 columns. Every word in it that does not
explain itself is explained in the legend below it.
"""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from rich.console import Console, ConsoleOptions
from rich.text import Text

from contactverif.cli.console import PLAIN_STYLE, STYLES, fold, line
from contactverif.cli.coverage_tables import coverage_text
from contactverif.contract.case_counts import whole_percent
from contactverif.contract.property import Verdict
from contactverif.contract.result import BROKEN_BY_FAILING, OPPOSITE_SIGN, Result, Row, Run
from contactverif.run.ranking import by_rank

_PROMISES = {True: "passes", False: "fails", None: "–"}
_COLUMNS = ("property", "promise", "result", "judged", "touch", "closest", "tolerance")
_RIGHT_ALIGNED = _COLUMNS[3:]
_LEGEND = {
    "promise": "what the formulation states about itself: it passes, it fails, or – nothing",
    "judged": "cases that could be decided, of those planned",
    "touch": "share of the judged cases in which something was in contact",
    "closest": "of all measured numbers the one nearest to its tolerance, or furthest beyond it",
}
_MEANINGS = {  # The results that are explained below the table where they occur in it.
    Result.FAIL: "the formulation fails, and states nothing about this property: news, but no broken promise",
    Result.FAILS_AS_STATED: "the formulation states itself that it fails here, or --known lists it",
    Result.BROKEN_PROMISE: "the formulation does not do what it states",
    Result.CRASHED: "the plugin raised an exception",
    Result.WRONG_TRAITS: "a mistake in the traits: they state a failure, and name no case that shows it (a witness)",
    Result.UNDECIDED: "roundoff or a kink leaves open whether it passes; the reason stands beside it",
    Result.NOT_JUDGED: "fewer than 90 % of the planned cases could be decided, or too few were in contact",
    Result.OMITTED: "an earlier property explains what all others would show; --keep-going asks them",
    Result.NOT_APPLICABLE: "the property makes no sense for this formulation, or for this mesh or scene",
    Result.NOT_PROVIDED: "the formulation leaves out a part that the property needs",
}
_MOST_NAMES = 6  # Named cases that a remark lists.
_COUNTED = {  # {result: (words for one, words for several)} in the last line
    Result.BROKEN_PROMISE: ("broken promise", "broken promises"),
    Result.CRASHED: ("crash", "crashes"),
    Result.WRONG_TRAITS: ("mistake in the traits", "mistakes in the traits"),
    Result.NOT_JUDGED: ("property not judged", "properties not judged"),
    Result.OMITTED: ("property not asked", "properties not asked"),
    Result.NOT_LOADED: ("plugin not loaded", "plugins not loaded"),
}
_MOST_SUMMED_UP = 3  # Rows of one result that the last line names.


@dataclass(frozen=True, slots=True)
class RunTable:
    """A line for each formulation and property: promise, result, and how close it came to the tolerance.

    A remark stands behind its line if there is room, else below it. The name of the closest number is left out if there
    is no room. Below the table stands what the cases were worth.
    """

    run: Run

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        width = options.max_width
        for name in self.run.opposite_signs:
            yield fold(f"{name}: {OPPOSITE_SIGN}", width, style="bold red", indent=0)
            yield Text("")
        yield Text(headline(self.run.provenance))
        yield from _lines(self.run.rows, width)
        for plugin in self.run.not_loaded:
            yield Text(plugin.formulation, style="bold")
            yield fold(f"{Result.NOT_LOADED}: {plugin.reason}", width, style="red")
        if self.run.rows:
            yield from _legend({row.result for row in self.run.rows}, width)
            yield from coverage_text(self.run, width)


def headline(provenance: Mapping[str, str]) -> str:
    """Say how many cases there are, and where they come from."""
    if "asked" in provenance:
        return f"asked: {provenance['asked']}"
    profile, examples, seed = (provenance.get(name) for name in ("profile", "examples", "seed"))
    if profile is None:
        return "named cases alone, no random ones"
    return f"profile {profile}: {examples} random cases for each property, seed {seed}"


def summary(run: Run, *, quiet: bool = False) -> Text:
    """Say in the last lines whether every promise is kept, and how many there are, or what is wrong."""
    if run.promises_kept:
        return Text(run.praise if quiet else f"{run.praise}\n{run.promises}", style="green")
    signs = [f"The forces of {name} have the opposite sign." for name in run.opposite_signs]
    return conclusion(run.rows, [item.formulation for item in run.not_loaded], signs)


def conclusion(rows: Sequence[Row], not_loaded: Sequence[str], accusations: Sequence[str] = ()) -> Text:
    """Sum up rows and plugins that did not load, behind sentences about whole formulations."""
    sentences = list(accusations)
    for result, (singular, plural) in _COUNTED.items():
        names = [_name(row) for row in by_rank(rows) if row.result is result and row.unexpected]
        names += not_loaded if result is Result.NOT_LOADED else []
        if names:
            named = f": {_list(names, _MOST_SUMMED_UP)}" if result is not Result.OMITTED else ""
            sentences.append(f"{len(names)} {singular if len(names) == 1 else plural}{named}.")
    return Text(" ".join(sentences) or "Nothing was checked.", style="red")


def _name(row: Row) -> str:
    reason = (
        f" ({row.unexpected})" if row.unexpected != BROKEN_BY_FAILING and row.result is Result.BROKEN_PROMISE else ""
    )
    return f"{row.formulation} {row.property_id}{reason}"


def _lines(rows: Sequence[Row], max_width: int) -> Iterator[Text]:
    """Yield the head of the table, and the lines of each formulation below its name."""
    if not rows:
        return
    entries = [_entries(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(_COLUMNS, *entries, strict=True)]
    # Where the columns are too many for the terminal, they stand closer together.
    space = " " * (2 if sum(widths) + 2 * len(widths) <= max_width else 1)
    yield Text("")
    yield Text(space + _align(_COLUMNS, widths, space), style="bold")
    start_of_result = widths[0] + widths[1] + 3 * len(space)
    previous = None
    for row, cells in zip(rows, entries, strict=True):
        if row.formulation != previous:
            yield Text(row.formulation, style="bold")
        previous = row.formulation
        columns = space + _align(cells, widths, space)
        remark = remark_of(row)
        options = ("; ".join(text for text in (remark, _quantity(row)) if text), remark)
        behind = next((text for text in options if len(columns) + 2 + len(text) <= max_width), "")
        text = line(f"{columns}  {behind}".rstrip())
        text.stylize(STYLES.get(row.result, PLAIN_STYLE), start_of_result, start_of_result + len(row.result))
        yield text
        if remark and not behind:
            yield fold(remark, max_width)


def _entries(row: Row) -> tuple[str, ...]:
    """Return the words and numbers of a row, one for each column."""
    number = row.closest.number if row.closest is not None else None
    return (
        row.property_id,
        _PROMISES[row.promise],
        str(row.result),
        f"{row.judged}/{row.planned}" if row.planned else "–",
        whole_percent(row.contact_share) if row.contact_share is not None else "",
        _short(number.value) if number is not None else "",
        f"{number.sign} {_short(number.tolerance)}" if number is not None else "",
    )


def _short(number: float) -> str:
    """Return two digits of a number, without zeros in its exponent: they make a column too wide for 80."""
    return f"{number:.2g}".replace("e-0", "e-").replace("e+0", "e+")


def _quantity(row: Row) -> str:
    """Return the name of the closest number, where a property measures several, and of its case, if that has one."""
    if row.closest is None:
        return ""
    quantity = row.closest.number.quantity.name if len(row.info.quantities) > 1 else ""
    return " in ".join(text for text in (quantity, row.closest_name) if text)


def remark_of(row: Row) -> str:
    """Return what a reader should know besides the result."""
    parts = [
        row.unexpected if row.result is Result.BROKEN_PROMISE else "",
        f"known: {row.known}" if row.known else "",
        row.reason if row.verdict not in (Verdict.PASS, Verdict.FAIL) or row.fails_in_words else "",
        f"fails in: {_list(row.failing_names)}" if row.failing_names else "",
        f"{row.undecided} undecided" if row.undecided else "",
        f"undecided in: {_list(row.undecided_names)}" if row.undecided_names else "",
        row.suspicion,
        finding_of(row),
    ]
    return "; ".join(part for part in parts if part)


def finding_of(row: Row) -> str:
    """Return the sentence that a property says of the case with the closest number although it passes."""
    if row.verdict is not Verdict.PASS or row.closest is None or row.closest.case is None:
        return ""
    measurement = row.outcomes[row.closest.case].measurement
    finding = measurement.finding if measurement is not None else None
    return "" if finding is None or finding.found else str(finding)


def _list(names: Sequence[str], most: int = _MOST_NAMES) -> str:
    """Return the first names of a list, and how many more there are."""
    return "; ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def _align(cells: Sequence[str], widths: Sequence[int], space: str) -> str:
    return space.join(
        cell.rjust(width) if name in _RIGHT_ALIGNED else cell.ljust(width)
        for name, cell, width in zip(_COLUMNS, cells, widths, strict=True)
    )


def _legend(results: Collection[Result], max_width: int) -> Iterator[Text]:
    """Explain the columns, and those of the results that do not explain themselves."""
    entries = _LEGEND | {str(result): words for result, words in _MEANINGS.items() if result in results}
    width = max(map(len, entries))
    yield Text("")
    for name, words in entries.items():
        indent = " " * (width + 4)
        folded = textwrap.wrap(words, max(max_width - len(indent), 20))
        yield line(f"  {name:{width}}  " + f"\n{indent}".join(folded), "dim")
    yield Text("")
