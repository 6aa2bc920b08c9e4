"""The terminal's view of the stability sweeps: the table of ω, and what is above the line."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from math import isnan
from pathlib import Path

from rich.table import Table
from rich.text import Text

from contactverif.cli.console import plain_table
from contactverif_reports.stability.sentences import sentence_of
from contactverif_reports.stability.sweep_points import COLUMNS, FAR_AND_CLOSE, LINE_FACTOR, SweepPanel, short_number

_MOST_IDS = 3  # Cases of a formulation whose command is printed.


def roundings_table(panels: Sequence[SweepPanel]) -> Table:
    """Return ω by formulation and state; the last column is the relative error of the forces."""
    table = plain_table(f"ω: the error over u × condition number (stable: at most {LINE_FACTOR:g})")
    table.padding = (0, 1, 0, 0)
    table.add_column("formulation", overflow="fold")
    for heading in COLUMNS:
        table.add_column(heading.replace(" ", "\n").replace(",", ""), justify="right", no_wrap=True)
    table.add_column("error of\nforces*", justify="right", no_wrap=True)
    for panel in panels:
        numbers = [panel.roundings_at(stem) for stem in COLUMNS.values()]
        cells = [Text(short_number(number), style=_style(number)) for number in numbers]
        table.add_row(panel.formulation, *cells, short_number(panel.force_error_at(FAR_AND_CLOSE)))
    return table


def sentence_text(panel: SweepPanel) -> Text:
    """Return the sentence of a formulation."""
    return Text(
        f"{panel.formulation} {sentence_of(panel).replace('`', '')}", style="" if not panel.above else "magenta"
    )


def replay_lines(panel: SweepPanel, report: Path) -> list[Text]:
    """Return the commands that judge the worst points above the line again."""
    file = shlex.quote(str(report))
    ids = [shlex.quote(point.case_id) for point in panel.above[:_MOST_IDS]]
    return [Text(f"    contactverif replay {file} --case {id_}") for id_ in ids]


def _style(number: float) -> str:
    return "dim" if isnan(number) else "magenta" if number > LINE_FACTOR else "green"
