"""Writes the reproduction of the paper: one netCDF file, figures as SVG, one HTML page. This file names no item.

In `paper.nc` each item has a group of its own name; style and units are those of a report (`reports/README.md`).
"""

import io
import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import matplotlib
from markupsafe import Markup
from matplotlib.figure import Figure

from contactverif.contract import schema
from contactverif.contract.schema import Group
from contactverif_paper.figure_style import render_figure
from contactverif_paper.paper_item import (
    OURS,
    Agreement,
    Paper,
    PaperFigure,
    Progress,
    Statement,
    sentence,
    variables_of,
)
from contactverif_reports.files import check_writable, made_folder, whole
from contactverif_reports.html.pages import render, svg_inline, write_page
from contactverif_reports.netcdf.file_groups import write_tree

TITLE = "contactverif: the reference paper, computed again"
REFERENCE = "Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416"
NUMBERS, PAGE = "paper.nc", "paper.html"
LOOKS: Mapping[Agreement, tuple[str, str]] = {  # {verdict: (mark, CSS class)}
    Agreement.AGREES: ("✓", "good"),
    Agreement.DIFFERS: ("✗", "bad"),
    Agreement.SILENT: ("–", "soft"),
    Agreement.CONDITIONAL: ("(✓)", "warn"),
}


def check_folder(folder: Path) -> None:
    """Make the folder, and say before anything takes long what would stop files from being written to it."""
    made_folder(folder, "--out")
    for name in (NUMBERS, PAGE):
        check_writable(folder / name, "--out", f"a folder that may hold {name}")


def write(paper: Paper, folder: Path, report_progress: Progress = lambda _: None) -> tuple[Path, ...]:
    """Write all files, each whole or not at all."""
    check_folder(folder)
    paths = [folder / NUMBERS]
    with whole(folder / NUMBERS) as part:
        write_tree(tree_of(paper), part)
    inlined: dict[str, Markup] = {}
    for result in paper.results:
        for figure in result.item.figures:
            report_progress(figure.source if figure.source != OURS else figure.name)
            drawing = render_figure(figure, result.data)
            paths.append(folder / f"{figure.name}.svg")
            with whole(paths[-1]) as part:
                part.write_text(svg(drawing), encoding="utf-8", newline="\n")
            inlined[figure.name] = svg_inline(drawing, f"{sentence(figure.source)}. {figure.caption}")
    paths.append(folder / PAGE)
    write_page(paths[-1], page(paper, inlined))
    return tuple(paths)


def tree_of(paper: Paper) -> dict[str, Group]:
    """Return the groups of `paper.nc`: one for each item, one of all statements, one that lists the figures."""
    root = {name: schema.text(value) for name, value in paper.provenance.items()}
    root |= {"Conventions": schema.CONVENTIONS, "title": TITLE, "references": REFERENCE, "comment": schema.UNITS_NOTE}
    statements = "the paper's statements beside what was computed"
    figures = "the figures, in the order of the page"
    groups = {
        "/": Group(attrs=root),
        "/statements": Group(variables_of(paper.statements, "statement", kind=Statement), {"comment": statements}),
        "/figures": Group(variables_of(paper.figures, "figure", kind=PaperFigure), {"comment": figures}),
    }
    for result in paper.results:
        for name, group in result.item.groups(result.data).items():
            path = f"/{result.item.name}/{name}".rstrip("/")
            if groups.setdefault(path, group) is not group:
                raise ValueError(f"{path}: two items have this group")
    return groups


def page(paper: Paper, figures: Mapping[str, Markup]) -> str:
    """Return the page."""

    def numbers(statements: tuple[Statement, ...], names: set[str], *, shown: bool) -> list[int]:
        return [number for number, statement in enumerate(statements) if (statement.figure in names) is shown]

    return render(
        "paper.html.j2",
        package="contactverif_paper",
        paper=paper,
        figures=figures,
        agreements=Agreement,
        look_of=LOOKS,
        counts=Counter(statement.agreement for statement in paper.statements),
        statements_of={figure.name: numbers(paper.statements, {figure.name}, shown=True) for figure in paper.figures},
        lone_statements_of={
            result.item.name: numbers(result.statements, {figure.name for figure in result.item.figures}, shown=False)
            for result in paper.results
        },
        reference=REFERENCE,
        sentence=sentence,
    )


def summary(paper: Paper) -> str:
    """Return every statement that does not merely note a silence, a line each."""
    return "\n".join(
        f"  {LOOKS[statement.agreement][0]:3} {statement.agreement.words:17} {statement.place}: {statement.result}"
        + (f". It holds if: {statement.condition}" if statement.condition else "")
        for statement in paper.statements
        if statement.agreement is not Agreement.SILENT
    )


def svg(figure: Figure) -> str:
    """Return the figure as SVG with its letters as paths: the same text for the same figure, and no unused parts.

    Lengths are rounded to a hundredth of a point, which nobody sees; matplotlib writes a millionth.
    """
    buffer = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "contactverif"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = re.sub(r"<!--.*?-->\s*", "", buffer.getvalue(), flags=re.DOTALL)
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'(?<= )(?:d|x|y)="[^"]*"|translate\([^)]*\)', _round_lengths, text)
    text = re.sub(r'<g id="[^"]*"', "<g", text)  # Nothing refers to the ids of groups.
    text = re.sub(r'(?<= )style="[^"]*"', lambda style: style[0].replace(": ", ":").replace("; ", ";"), text)
    text = text.replace("stroke-dashoffset:0;", "")  # Zero is the default.
    return "\n".join(line.strip() for line in text.splitlines()) + "\n"


def _round_lengths(attribute: re.Match[str]) -> str:
    """Return an attribute with two decimals at most, and a blank for each end of a line."""
    rounded = re.sub(r"-?\d+\.\d{3,}", lambda digits: f"{float(digits[0]):.2f}".rstrip("0").rstrip("."), attribute[0])
    return " ".join(rounded.split())
