"""The screens of a run, in memory or from a file: a few lines, or every row with the coverage of its cases.

A screen needs no more than 80 columns. In few lines each formulation has what breaks a promise first, with the most
telling mesh, then what fails without one, what fails as stated, and the families of what passes.
"""

import shlex
import textwrap
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path

from rich.text import Text

from contactverif.api.run_files import REPORT, RUN_FILES, write_run
from contactverif.cli.console import columns, echo, fold, indent_below, line, show, show_verbatim
from contactverif.cli.options import OutputFiles, Screen
from contactverif.contract import result as results
from contactverif.contract.counterexample import Counterexample, counterexamples, failing_examples
from contactverif.contract.property import Finding, Outcome, PropertyInfo, Verdict, checked_numbers
from contactverif.contract.result import CaseCounts, Coverage, Result, Row, Run
from contactverif.run.ranking import by_rank, first_failure, wrong_rows
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.plot.text import as_text
from contactverif_reports.tables import PLAIN_STYLE, PROMISES, STYLES, WRONG_RESULTS

_MOST_ROWS = 12  # The rows of a part that have a line each.
_MOST_WRONG = 8  # The same of those that are wrong beside the most telling one.
_MOST_IDS = 4  # The ids of a family that are listed in a sentence.
_MOST_NAMES = 6  # Named cases that a remark lists.
_MOST_SUMMED_UP = 3  # Rows of one result that the last line names.
_MOST_REASONS = 3  # The most frequent reasons of undecided cases that are shown.
_LEAST_NAME = 12  # Columns of the name of a number that are left.
_LEAST_WORDS = 30  # Columns that are left for words beside a name, however long it is.
_LONGEST_KIND = 35  # A longer name is cut, or the table would not fit into 80 columns.
_PARTS = {  # The results that show no mistake and have a line for each row, and the title above them.
    Result.FAIL: "fails, and promises nothing",
    Result.FAILS_AS_STATED: "fails as stated",
    Result.UNDECIDED: "undecided",
    Result.NOT_JUDGED: "not judged",
}
COLUMNS = ("property", "promise", "result", "judged", "touch", "closest", "tolerance")
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
_KIND_COLUMNS = ("planned", "judged", "failed", "undecided", "idle")
_NO_KIND = "other"  # The line of the cases that name no kind.


def report(path: Path, out: Sequence[Path], screen: Screen) -> None:
    """Show a stored report, or write it as other files. Nothing is judged."""
    files = OutputFiles.check(out, [suffix for suffix in RUN_FILES if suffix != REPORT])
    run = read_run(path)
    if not files.paths:
        if not screen.quiet:
            show_run(run, screen, path)
        show(summary(run, quiet=screen.quiet))
        return
    for target in files.paths.values():
        write_run(run, target, path)
    files.announce()


def show_run(result: Run, screen: Screen, report: Path | None) -> None:
    """Show a run as the user wants it: its few telling lines, or every row, and counterexamples."""
    show(*(run_table(result, columns()) if screen.verbose else run_screen(result, columns(), report)))
    if screen.verbose or screen.show == "all":
        for example in failing_examples(result):
            show_verbatim(counterexample_text(example, report))
    failing = by_rank(row for row in result.rows if row.verdict in (Verdict.FAIL, Verdict.CRASHED))
    news = [row for row in failing if row.result is Result.FAIL]
    first = first_failure(failing) or next(iter([*news, *failing]), None)
    if first is not None:
        stored = report is not None and any(example.row is first for example in failing_examples(result))
        option = f" --report {shlex.quote(str(report))}" if stored else ""
        echo(f"to have a row explained: contactverif explain {first.property_id}{option}")


def headline(provenance: Mapping[str, str]) -> str:
    """Say how many cases there are, and where they come from."""
    if "asked" in provenance:
        return f"asked: {provenance['asked']}"
    profile, examples, seed = (provenance.get(name) for name in ("profile", "examples", "seed"))
    if profile is None:
        return "named cases alone, no random ones"
    return f"profile {profile}: {examples} random cases for each property, seed {seed}"


def summary(run: Run, *, quiet: bool = False, status: int | None = None) -> Text:
    """Say in the last lines what fails (and an exit status of 0 beside it), or is wrong, or that promises are kept."""
    if run.promises_kept:
        sentence = f"{'✗ ' if run.result is Result.FAIL else ''}{run.conclusion}"
        if status == 0 and run.result in (Result.FAIL, Result.FAILS_AS_STATED):
            sentence = f"{sentence.removesuffix('.')} (exit 0)."
        return Text(sentence if quiet else f"{sentence}\n{run.promises}", style=STYLES.get(run.result, ""))
    sentences = [f"The forces of {name} have the opposite sign." for name in run.opposite_signs]
    for result, words in WRONG_RESULTS.items():
        names = []
        for row in by_rank(run.rows):
            if row.result is result and row.unexpected:
                otherwise = result is Result.BROKEN_PROMISE and row.unexpected != results.BROKEN_BY_FAILING
                names.append(f"{row.formulation} {row.property_id}{f' ({row.unexpected})' if otherwise else ''}")
        names += [item.formulation for item in run.not_loaded] if result is Result.NOT_LOADED else []
        if names:
            named = f": {_list(names, _MOST_SUMMED_UP)}"
            if result is Result.OMITTED:  # What is wrong is said before, or it is the reason.
                reason = next(row.reason for row in run.rows if row.omitted)
                named = "" if sentences else f": {reason.removeprefix(results.OMITTED).partition(': ')[0]}"
            sentences.append(f"{len(names)} {words[len(names) > 1]}{named}.")
    return Text(" ".join(sentences) or results.NOTHING_JUDGED, style="red")


def _list(names: Sequence[str], most: int = _MOST_NAMES) -> str:
    return "; ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def _remark(row: Row) -> str:
    parts = [
        row.unexpected if row.result is Result.BROKEN_PROMISE else "",
        f"known: {row.known}" if row.known else "",
        row.reason if row.verdict not in (Verdict.PASS, Verdict.FAIL) or row.fails_in_words else "",
        f"fails in: {_list(row.failing_names)}" if row.failing_names else "",
        f"{row.undecided} undecided" if row.undecided else "",
        f"undecided in: {_list(row.undecided_names)}" if row.undecided_names else "",
        row.suspicion,
        _finding(row),
        "a trait of the method" if row.is_trait else "",
    ]
    return "; ".join(part for part in parts if part)


def _finding(row: Row) -> str:
    """Return the sentence that a property says of the case with the closest number although it passes."""
    finding = _closest_finding(row) if row.verdict is Verdict.PASS else None
    return "" if finding is None or finding.found else str(finding)


def _closest_finding(row: Row) -> Finding | None:
    outcome = None if row.closest is None or row.closest.case is None else row.outcomes[row.closest.case]
    return None if outcome is None or outcome.measurement is None else outcome.measurement.finding


# The screen of few lines.


def run_screen(run: Run, width: int, report: Path | None = None) -> Iterator[Text]:
    """Yield the results of a run for a person; a counterexample can be replayed from a report.

    One formulation that keeps its promises takes at most 25 lines, and one with a mistake at most 60. Where several
    are shown, those that keep their promises take a few lines each.
    """
    names = run.formulations
    yield Text(headline(run.provenance))
    for name in names:
        yield Text("")
        yield from _formulation(run, name, width, report, alone=len(names) == 1)
    for plugin in run.not_loaded:
        yield Text("")
        yield fold(f"{plugin.formulation}: {Result.NOT_LOADED}: {plugin.reason}", width, "red", indent=0)
    yield Text("")


def _formulation(run: Run, name: str, width: int, report: Path | None, *, alone: bool) -> Iterator[Text]:
    rows = list(run.rows_of(name))
    wrong = wrong_rows(rows)
    yield fold(f"{name}: {results.describe(rows)}", width, f"bold {STYLES.get(results.overall(rows), '')}", indent=0)
    if name in run.opposite_signs:
        yield fold(results.OPPOSITE_SIGN, width, "bold red", indent=2)
    if name in run.diagnoses:
        words, _, of_tangent = run.diagnoses[name].partition(results.OF_TANGENT)
        yield fold(f"diagnosis: {words}", width, "bold", indent=2)
        if of_tangent:
            yield fold(f"diagnosis of the tangent: {of_tangent}", width, "bold", indent=2)
    if (first := first_failure(rows)) is not None:
        examples = counterexamples(run).values() if first.verdict in (Verdict.FAIL, Verdict.CRASHED) else ()
        example = next((each for each in examples if each.row is first), None)
        if example is None:
            words = f"{first.property_id}: {first.result}: {_remark(first) or first.reason}"
            yield fold(words, width, STYLES[first.result], indent=2)
        else:
            yield counterexample_text(example, report, width)
        yield Text("")
    yield from _part("also wrong", wrong[1:], width, _MOST_WRONG)
    if omitted := [row for row in rows if row.omitted]:
        reason = omitted[0].reason.removeprefix(results.OMITTED)
        advice = "" if reason.endswith("(-x)") else " --keep-going asks them all."
        yield fold(f"{len(omitted)} properties were not asked: {reason}.{advice}", width, indent=0)
    for row in rows:  # A doubt about a formulation that passes, or how stiff its springs are.
        if row.result is Result.PASS and (remark := "; ".join(filter(None, (row.suspicion, _finding(row))))):
            yield fold(f"{row.property_id} passes, and says: {remark}", width, "yellow", indent=0)
    for result, title in _PARTS.items():
        part = by_rank(row for row in rows if row.result is result and not row.is_trait)
        # A row that was not judged makes a run fail, too: its reason is wanted.
        if (alone and not wrong) or result is Result.NOT_JUDGED:
            yield from _part(title, part, width)
        elif part:
            yield fold(f"{title}: {', '.join(row.property_id for row in part)}", width, indent=0)
    if traits := [row.property_id for row in rows if row.is_trait]:
        yield fold(f"traits of the method, no mistakes: fails {', '.join(traits)}", width, indent=0)
    yield from _families([row for row in rows if not row.is_trait], width)


def _part(title: str, rows: Sequence[Row], width: int, most: int = _MOST_ROWS) -> Iterator[Text]:
    """Yield a line for each row below a title, and if it is wrong its place; of many rows the last have names alone."""
    if not rows:
        return
    yield Text(f"{title}:", style="bold")
    listed = rows if len(rows) <= most + 1 else rows[:most]
    names = max(len(row.property_id) for row in listed)
    for row in listed:
        room = max(width - names - 4, _LEAST_WORDS)
        words, place = _words(row, room), _place(row, room) if row.unexpected else ""
        fits = len(words) + len(f"; {place}") <= room
        text = line(f"  {row.property_id:{names}}  {words}{f'; {place}' if place and fits else ''}".rstrip())
        text.stylize(STYLES.get(row.result, ""), 2, 2 + len(row.property_id))
        yield text
        if place and not fits:
            yield line(f"{'':{names + 4}}{place}")
    if others := rows[len(listed) :]:
        yield fold(f"and {len(others)} more: {', '.join(row.property_id for row in others)}", width, indent=2)


def _words(row: Row, room: int) -> str:
    """Return the number that is furthest beyond its tolerance, or why there is none; if room lacks, its name is cut."""
    known_ways = "", results.BROKEN_BY_FAILING, results.BREAKS_LAW, results.NOT_JUDGED
    before = f"{row.unexpected}; " if row.unexpected not in known_ways else ""
    behind = f"; known: {row.known}" if row.known else ""
    if row.verdict is not Verdict.FAIL or row.breach or row.closest is None or row.fails_in_words:
        return _shorten(f"{before}{row.reason}{behind}".removesuffix("; "), room)
    number = row.closest.number
    behind = f" {number.value:.3g}, {number.quantity.sense} {number.tolerance:.3g}{behind}{_judged_of_stopped(row)}"
    return _shorten(f"{before}{_shorten(number.quantity.name, room - len(before) - len(behind))}{behind}", room)


def _place(row: Row, room: int) -> str:
    """Return what was done to the case of the number in a line, and what is found there, as far as there is room."""
    in_words = row.verdict is not Verdict.FAIL or row.breach or row.fails_in_words
    if in_words or (finding := _closest_finding(row)) is None:
        return ""
    forms = (str(finding), finding.place, finding.place.partition(", ")[0])
    return next((each for each in forms if len(each) <= room), "")


def _judged_of_stopped(row: Row) -> str:
    return f"; {row.judged} of {row.planned} cases judged" if len(row.outcomes) < row.planned else ""


def _shorten(words: str, room: int) -> str:
    return words if len(words) <= room else f"{words[: max(room, _LEAST_NAME) - 1].rstrip()}…"


def _families(rows: Sequence[Row], width: int) -> Iterator[Text]:
    """Yield the families of what passes, such as `patch 12 of 14`, and what the mesh or scene lacks for the others."""
    passing: dict[str, list[bool]] = {}
    lacking: dict[str, dict[str, list[str]]] = {}  # {what is needed: {family: ids}}
    for row in rows:
        if row.result not in (Result.NOT_APPLICABLE, Result.NOT_PROVIDED):
            passing.setdefault(row.info.family, []).append(row.result is Result.PASS)
        if row.reason.startswith(results.NOT_HERE):
            families = lacking.setdefault(row.reason.removeprefix(results.NOT_HERE), {})
            families.setdefault(row.info.family, []).append(row.property_id)
    words = [f"{family} {sum(each)} of {len(each)}" for family, each in passing.items() if any(each)]
    if words:
        yield fold(f"passes: {', '.join(words)}", width, STYLES[Result.PASS], indent=0)
    if lacking:
        yield Text("not asked here, needs:", style="bold")
    for needs, families in lacking.items():
        lists = ([f"{len(ids)} of {family}"] if len(ids) > _MOST_IDS else ids for family, ids in families.items())
        yield fold(f"{needs}: {', '.join(chain.from_iterable(lists))}", width, indent=2)


def counterexample_text(example: Counterexample, report: Path | None, width: int = 10**4) -> Text:
    """Return numbers and drawing of a counterexample, and the line that replays it if there is a report.

    Words are folded to a width. A drawing and a command are not.
    """
    row, outcome = example.row, example.outcome
    words = (textwrap.wrap(each, max(width - 4, 20), subsequent_indent="  ") for each in _numbers(row.info, outcome))
    title = f"{row.formulation}, {row.property_id}: {row.result}, {example.label}{_judged_of_stopped(row)}"
    has_basis = row.promised_by or row.unexpected == results.BREAKS_LAW
    basis = [f"promised by {row.promised_by or 'no trait: it is a basic law of contact'}"] if has_basis else []
    text = indent_below(
        "\n".join(textwrap.wrap(title, max(width, 20), subsequent_indent="  ", break_on_hyphens=False)),
        *chain.from_iterable(words),
        *basis,
        *as_text(outcome.case).splitlines(),
        *([] if report is None else [example.replay_command(str(report))]),
    )
    text.no_wrap, text.overflow = True, "ignore"
    return text


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


def ending_lines(outcome: Outcome) -> list[str]:
    """Return how Newton's method ended where a property solved, with advice where it did not converge."""
    details: Mapping[str, float] = outcome.measurement.details if outcome.measurement is not None else {}
    lines = []
    for name, value in details.items():
        kind, _, solution = name.partition(", ")
        iterations = details.get(name.replace("end", "iterations", 1))
        if kind == "end" and iterations is not None:
            from contactverif.mechanics.newton import End  # It brings scipy; needed only where a property solved.

            end = End(int(value))
            words = f"{end.label} after {iterations:g} iteration{'s' * (iterations != 1)}"
            label = f" ({solution})" if solution else ""
            lines.append(f"Newton's method{label}: {words}{'' if end is End.CONVERGED else f': {end.advice}'}")
    return lines


# The table of all rows.


def run_table(run: Run, width: int) -> Iterator[Text]:
    """Yield a line for each formulation and property: promise, result, and how close it came to the tolerance.

    A remark stands behind its line if there is room, else below it. The name of the closest number is left out if there
    is no room. Below the table stands the coverage.
    """
    for name in run.opposite_signs:
        yield fold(f"{name}: {results.OPPOSITE_SIGN}", width, style="bold red", indent=0)
        yield Text("")
    yield Text(headline(run.provenance))
    if run.rows:
        yield from _lines(run.rows, width)
    for plugin in run.not_loaded:
        yield Text(plugin.formulation, style="bold")
        yield fold(f"{Result.NOT_LOADED}: {plugin.reason}", width, style="red")
    if run.rows:
        yield from _legend({row.result for row in run.rows}, width)
        yield from coverage_text(run, width)


def _lines(rows: Sequence[Row], max_width: int) -> Iterator[Text]:
    entries = [_entries(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(COLUMNS, *entries, strict=True)]
    # Where the columns are too many for the terminal, they stand closer together.
    space = " " * (2 if sum(widths) + 2 * len(widths) <= max_width else 1)

    def align(cells: Sequence[str]) -> str:
        places = enumerate(zip(cells, widths, strict=True))
        return space + space.join(cell.ljust(n) if place < 3 else cell.rjust(n) for place, (cell, n) in places)

    yield Text("")
    yield Text(align(COLUMNS), style="bold")
    start_of_result = widths[0] + widths[1] + 3 * len(space)
    previous = None
    for row, cells in zip(rows, entries, strict=True):
        if row.formulation != previous:
            yield Text(row.formulation, style="bold")
        previous = row.formulation
        quantity = ""  # The name of the closest number where a property measures several, and of its case.
        if row.closest is not None:
            name = row.closest.number.quantity.name if len(row.info.quantities) > 1 else ""
            quantity = " in ".join(text for text in (name, row.closest_name) if text)
        listed, remark = align(cells), _remark(row)
        options = ("; ".join(text for text in (remark, quantity) if text), remark)
        behind = next((text for text in options if len(listed) + 2 + len(text) <= max_width), "")
        text = line(f"{listed}  {behind}".rstrip())
        text.stylize(STYLES.get(row.result, PLAIN_STYLE), start_of_result, start_of_result + len(row.result))
        yield text
        if remark and not behind:
            yield fold(remark, max_width)


def _entries(row: Row) -> tuple[str, ...]:
    judged = f"{row.judged}/{row.planned}" if row.planned else "–"
    touch = results.whole_percent(row.contact_share) if row.contact_share is not None else ""
    closest = tolerance = ""
    if row.closest is not None:
        number = row.closest.number
        closest, tolerance = _short(number.value), f"{number.sign} {_short(number.tolerance)}"
    return row.property_id, PROMISES[row.promise], str(row.result), judged, touch, closest, tolerance


def _short(number: float) -> str:
    """Return two digits of a number, without zeros in its exponent: they make a column too wide for 80."""
    return f"{number:.2g}".replace("e-0", "e-").replace("e+0", "e+")


def _legend(results: Collection[Result], max_width: int) -> Iterator[Text]:
    entries = _LEGEND | {str(result): words for result, words in _MEANINGS.items() if result in results}
    width = max(map(len, entries))
    indent = " " * (width + 4)
    yield Text("")
    for name, words in entries.items():
        folded = textwrap.wrap(words, max(max_width - len(indent), 20))
        yield line(f"  {name:{width}}  " + f"\n{indent}".join(folded), "dim")
    yield Text("")


def coverage_text(run: Run, width: int) -> Iterator[Text]:
    """Yield the shares of undecided and idle cases, then the cases of each kind; properties of equal kinds together."""
    everything = results.coverage_of(run)
    if everything:
        yield from _shares(everything, width)
    groups: dict[tuple[str, ...], list[Coverage]] = {}
    for coverage in everything:
        if coverage.kinds:
            groups.setdefault(tuple(coverage.kinds), []).append(coverage)
    for group in groups.values():
        yield from _kinds(group, width)


def _shares(everything: Sequence[Coverage], width: int) -> Iterator[Text]:
    together = _together(everything)
    incomplete = [each for each in everything if each.counts.undecided or each.counts.idle]
    if not incomplete:
        yield fold(f"No case was undecided, and none was idle (nothing in contact){together}.", width, "dim", indent=0)
        yield Text("")
        return
    yield fold(f"Undecided cases, and idle ones (nothing in contact){together}", width, "bold", indent=0)
    size = max(len("property"), *(len(each.info.id) for each in incomplete))
    yield line(f"  {'property':{size}}  {'cases':>7}  {'undecided':>9}  {'idle':>7}", style="bold")
    for each in incomplete:
        shares = f"{results.percent(each.counts.undecided_share):>9}  {results.percent(each.counts.idle_share):>7}"
        yield line(f"  {each.info.id:{size}}  {each.counts.cases:7}  {shares}")
        for reason, number in [*each.reasons.items()][:_MOST_REASONS]:
            yield fold(f"{number} undecided: {reason}", width, "dim")
        if others := [*each.reasons.values()][_MOST_REASONS:]:
            yield fold(f"{sum(others)} undecided for {len(others)} other reasons", width, "dim")
    if len(incomplete) < len(everything):
        words = "In all other properties every case was decided, and something was in contact."
        yield fold(words, width, "dim", indent=2)
    yield Text("")


def _together(group: Sequence[Coverage]) -> str:
    n_formulations = max(each.n_formulations for each in group)
    return f", {n_formulations} formulations together" if n_formulations > 1 else ""


def _kinds(group: Sequence[Coverage], width: int) -> Iterator[Text]:

    def cells(counts: CaseCounts) -> str:
        numbers = counts.cases, counts.judged, counts.failed, counts.undecided, counts.idle
        return "  ".join(f"{n:>{len(name)}}" for name, n in zip(_KIND_COLUMNS, numbers, strict=True))

    kinds = results.add_by_kind(each.kinds for each in group)
    title = f"Cases of each kind in {', '.join(each.info.id for each in group)}{_together(group)}"
    yield fold(title, width, "bold", indent=0)
    size = min(max(len("kind"), *map(len, kinds)), _LONGEST_KIND)
    yield line(f"  {'kind':{size}}  {'  '.join(_KIND_COLUMNS)}", style="bold")
    for kind, counts in kinds.items():
        style = "yellow" if counts.judged == counts.idle else ""  # Nothing of this kind was judged in contact.
        yield line(f"  {(kind or _NO_KIND)[:size]:{size}}  {cells(counts)}", style=style)
    yield line(f"  {'all':{size}}  {cells(results.total(kinds.values()))}", style="dim")
    weak: dict[str, list[str]] = {}
    for each in group if len(group) > 1 else ():
        for kind, counts in each.kinds.items():
            if counts.judged < counts.cases / 2:
                weak.setdefault(each.info.id, []).append(f"{kind or _NO_KIND} {counts.judged}/{counts.cases}")
    if weak:
        yield line("  Kinds of which a property could judge less than half:", style="yellow")
    for id_, words in weak.items():
        yield fold(f"{id_}: {', '.join(words)}", width, "dim")
    yield Text("")
