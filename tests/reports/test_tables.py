"""A table is stated once, and says the same in the terminal, on a page and in Markdown."""

import io
from math import inf, nan

from markupsafe import Markup
from rich.console import Console

from contactverif.contract.result import Result
from contactverif_reports.html.pages import _environment
from contactverif_reports.tables import Change, Column, ResultCell, Table, numbers


def make_table() -> Table:
    table = Table([Column("formulation", wrap=True), Column("result"), *numbers("worst", "ratio")], "a title")
    table.add("nts", ResultCell(Result.FAIL, differs=True), 0.125, Change(1.0, inf))
    table.add("<b>", ResultCell(None), nan, Change(2, 2), group="others")
    return table


def print_table(table: Table) -> list[str]:
    console = Console(file=io.StringIO(), width=60)
    console.print(table.terminal())
    return [line.rstrip() for line in console.file.getvalue().splitlines()]  # type: ignore[attr-defined]


def test_the_terminal_has_groups_with_a_title_and_numbers_on_the_right() -> None:
    lines = [line for line in print_table(make_table()) if "─" not in line]
    assert lines == [
        "a title",
        "",
        "  formulation   result   worst   ratio",
        "  nts           ≠ fail    0.12   1 → ∞",
        "  others",
        "    <b>         –            –       2",
        "",
    ]


def test_markdown_has_names_in_the_first_column() -> None:
    assert make_table().without("ratio").markdown().splitlines() == [
        "| | result | worst |",
        "|---|---|--:|",
        "| `nts` | ≠ fail | 0.12 |",
        "| `<b>` | – | – |",
    ]


def test_a_page_escapes_words_and_marks_results() -> None:
    html = str(
        _environment()
        .from_string('{% import "parts.html.j2" as parts %}{{ parts.table(t, "l") }}')
        .render(t=make_table())
    )
    assert "&lt;b&gt;" in html
    assert '<th scope="rowgroup" colspan="4">others</th>' in html
    assert '<td class="n">1 → ∞</td>' in html
    assert '<span class="mark" aria-hidden="true">✗</span> fail</span> <span class="soft">(differs)</span></td>' in html
    bold = Table([Column("a")])
    bold.add(Markup("<b>x</b>"))
    page = _environment().from_string('{% import "parts.html.j2" as parts %}{{ parts.table(t, "l") }}').render(t=bold)
    assert '<th scope="row"><b>x</b></th>' in page
