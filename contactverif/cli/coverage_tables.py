"""Tables of what the cases of a run were worth: shares of undecided and idle cases, and the cases of each kind.

As in `run_tables`, a table reads a `Run` from memory or from a file, and needs no more than
80 columns.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from rich.text import Text

from contactverif.cli.console import fold, line
from contactverif.contract.case_counts import CaseCounts, add_by_kind, percent, total
from contactverif.contract.result import Coverage, Run, coverage_of

_MOST_REASONS = 3  # The most frequent reasons of undecided cases that are shown.
_KIND_COLUMNS = ("planned", "judged", "failed", "undecided", "idle")
_NO_KIND = "other"  # The line of the cases that name no kind.
_LONGEST_KIND = 35  # A longer name is cut, or the table would not fit into 80 columns.


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
        yield from _reasons(each.reasons, width)
    if len(incomplete) < len(everything):
        words = "In all other properties every case was decided, and something was in contact."
        yield fold(words, width, "dim", indent=2)
    yield Text("")


def _together(group: Sequence[Coverage]) -> str:
    n_formulations = max(each.n_formulations for each in group)
    return f", {n_formulations} formulations together" if n_formulations > 1 else ""


def _reasons(reasons: Mapping[str, int], width: int) -> Iterator[Text]:
    """Yield the most frequent reasons of undecided cases."""
    for reason, number in list(reasons.items())[:_MOST_REASONS]:
        yield fold(f"{number} undecided: {reason}", width, "dim")
    if len(reasons) > _MOST_REASONS:
        more = sum(list(reasons.values())[_MOST_REASONS:])
        yield fold(f"{more} undecided for {len(reasons) - _MOST_REASONS} other reasons", width, "dim")


def _kinds(group: Sequence[Coverage], width: int) -> Iterator[Text]:
    """Yield how many cases of each kind were judged, in all properties of a group together."""
    kinds = add_by_kind(each.kinds for each in group)
    properties = ", ".join(each.info.id for each in group)
    yield fold(f"Cases of each kind in {properties}{_together(group)}", width, "bold", indent=0)
    size = min(max(len("kind"), *map(len, kinds)), _LONGEST_KIND)
    yield line(f"  {'kind':{size}}  {_row(_KIND_COLUMNS)}", style="bold")
    for kind, counts in kinds.items():
        style = "yellow" if counts.judged == counts.idle else ""  # Nothing of this kind was judged in contact.
        yield line(f"  {(kind or _NO_KIND)[:size]:{size}}  {_row(_numbers(counts))}", style=style)
    yield line(f"  {'all':{size}}  {_row(_numbers(total(kinds.values())))}", style="dim")
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


def _numbers(counts: CaseCounts) -> tuple[str, ...]:
    return tuple(map(str, (counts.cases, counts.judged, counts.failed, counts.undecided, counts.idle)))


def _row(cells: Sequence[str]) -> str:
    return "  ".join(f"{cell:>{len(name)}}" for name, cell in zip(_KIND_COLUMNS, cells, strict=True)).rstrip()
