"""All rows of a run in the terminal with the coverage of its cases, and the line that sums it up.

A table reads a `Run`, from memory or from a file, and needs no more than 80 columns. Every word in it that does not
explain itself is explained in the legend below it.
"""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from rich.console import Console, ConsoleOptions
from rich.text import Text

from contactverif.cli.console import fold, line
from contactverif.contract.property import Verdict
from contactverif.contract.result import (
    BROKEN_BY_FAILING,
    OPPOSITE_SIGN,
    CaseCounts,
    Coverage,
    Result,
    Row,
    Run,
    add_by_kind,
    coverage_of,
    percent,
    total,
    whole_percent,
)
from contactverif.run.ranking import by_rank
from contactverif_reports.tables import PLAIN_STYLE, STYLES

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
_MOST_REASONS = 3  # The most frequent reasons of undecided cases that are shown.
_KIND_COLUMNS = ("planned", "judged", "failed", "undecided", "idle")
_NO_KIND = "other"  # The line of the cases that name no kind.
_LONGEST_KIND = 35  # A longer name is cut, or the table would not fit into 80 columns.


@dataclass(frozen=True, slots=True)
class RunTable:
    """A line for each formulation and property: promise, result, and how close it came to the tolerance.

    A remark stands behind its line if there is room, else below it. The name of the closest number is left out if there
    is no room. Below the table stands the coverage.
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
        named_rows = [row for row in by_rank(rows) if row.result is result and row.unexpected]
        names = [f"{row.formulation} {row.property_id}{_broken_otherwise(row)}" for row in named_rows]
        names += not_loaded if result is Result.NOT_LOADED else []
        if names:
            named = f": {_list(names, _MOST_SUMMED_UP)}" if result is not Result.OMITTED else ""
            sentences.append(f"{len(names)} {singular if len(names) == 1 else plural}{named}.")
    return Text(" ".join(sentences) or "Nothing was checked.", style="red")


def _broken_otherwise(row: Row) -> str:
    """Return in parentheses why a promise is broken, where it is not by failing."""
    broken = row.result is Result.BROKEN_PROMISE and row.unexpected != BROKEN_BY_FAILING
    return f" ({row.unexpected})" if broken else ""


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


def coverage_text(run: Run, width: int) -> Iterator[Text]:
    """Yield the shares of undecided and idle cases, then the cases of each kind; properties of equal kinds together."""
    everything = coverage_of(run)
    if not everything:
        return
    yield from _shares(everything, width)
    with_kinds: dict[tuple[str, ...], list[Coverage]] = {}
    for coverage in everything:
        if coverage.kinds:
            with_kinds.setdefault(tuple(coverage.kinds), []).append(coverage)
    for group in with_kinds.values():
        yield from _kinds(group, width)


def _shares(everything: Sequence[Coverage], width: int) -> Iterator[Text]:
    together = _together(everything)
    incomplete = [each for each in everything if each.counts.undecided or each.counts.idle]
    if not incomplete:
        yield fold(f"No case was undecided, and none was idle (nothing in contact){together}.", width, "dim", indent=0)
        yield Text("")
        return
    title = f"Undecided cases, and idle ones (nothing in contact){together}"
    yield fold(title, width, "bold", indent=0)
    size = max(len("property"), *(len(each.info.id) for each in incomplete))
    yield line(f"  {'property':{size}}  {'cases':>7}  {'undecided':>9}  {'idle':>7}", style="bold")
    for each in incomplete:
        counts = each.counts
        shares = f"{percent(counts.undecided_share):>9}  {percent(counts.idle_share):>7}"
        yield line(f"  {each.info.id:{size}}  {counts.cases:7}  {shares}")
        reasons = [*each.reasons.items()]
        for reason, number in reasons[:_MOST_REASONS]:
            yield fold(f"{number} undecided: {reason}", width, "dim")
        if others := reasons[_MOST_REASONS:]:
            more = sum(number for _, number in others)
            yield fold(f"{more} undecided for {len(others)} other reasons", width, "dim")
    if len(incomplete) < len(everything):
        words = "In all other properties every case was decided, and something was in contact."
        yield fold(words, width, "dim", indent=2)
    yield Text("")


def _together(group: Sequence[Coverage]) -> str:
    n_formulations = max(each.n_formulations for each in group)
    return f", {n_formulations} formulations together" if n_formulations > 1 else ""


def _kinds(group: Sequence[Coverage], width: int) -> Iterator[Text]:
    """Yield how many cases of each kind were judged, in all properties of a group together."""
    kinds = add_by_kind(each.kinds for each in group)
    properties = ", ".join(each.info.id for each in group)
    yield fold(f"Cases of each kind in {properties}{_together(group)}", width, "bold", indent=0)
    size = min(max(len("kind"), *map(len, kinds)), _LONGEST_KIND)
    yield line(f"  {'kind':{size}}  {_row(*_KIND_COLUMNS)}", style="bold")
    for kind, counts in kinds.items():
        style = "yellow" if counts.judged == counts.idle else ""  # Nothing of this kind was judged in contact.
        yield line(f"  {(kind or _NO_KIND)[:size]:{size}}  {_counts(counts)}", style=style)
    yield line(f"  {'all':{size}}  {_counts(total(kinds.values()))}", style="dim")
    weak = [f"{each.info.id}: {text}" for each in group if (text := _weak_kinds(each))] if len(group) > 1 else []
    if weak:
        yield line("  Kinds of which a property could judge less than half:", style="yellow")
    for text in weak:
        yield fold(text, width, "dim")
    yield Text("")


def _weak_kinds(coverage: Coverage) -> str:
    """Return the kinds of which less than half of the cases were judged, with the numbers."""
    weak = {kind: counts for kind, counts in coverage.kinds.items() if counts.judged < counts.cases / 2}
    return ", ".join(f"{kind or _NO_KIND} {counts.judged}/{counts.cases}" for kind, counts in weak.items())


def _counts(counts: CaseCounts) -> str:
    return _row(*map(str, (counts.cases, counts.judged, counts.failed, counts.undecided, counts.idle)))


def _row(*cells: str) -> str:
    return "  ".join(f"{cell:>{len(name)}}" for name, cell in zip(_KIND_COLUMNS, cells, strict=True)).rstrip()
