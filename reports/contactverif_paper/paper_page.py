"""The page and the files of the reproduction of the paper: one netCDF file, figures as SVG, one HTML page."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib
from markupsafe import Markup
from matplotlib.figure import Figure

from contactverif_paper.paper_data import MultiplierRow, Paper, Said
from contactverif_paper.paper_figures import drawings
from contactverif_paper.paper_tree import REFERENCE, tree_of
from contactverif_reports.files import check_writable, made_folder, whole
from contactverif_reports.html.pages import render, svg_inline, write_page

NUMBERS, PAGE = "paper.nc", "paper.html"
MARKS = {Said.AGREES: "✓", Said.DIFFERS: "✗", Said.SILENT: "–", Said.DEFECT: "!"}
CLASSES = {Said.AGREES: "good", Said.DIFFERS: "bad", Said.SILENT: "soft", Said.DEFECT: "warn"}
N_FIGURES = 19  # drawn by `write`
CHOICES = (
    ("Patch tests", "E = 10⁴ and ν = 0.3 in both bodies, heights 4, two layers of cells, rollers at all sides"),
    (
        "Case A2, Examples 1 and 1bis",
        "the lengths of the segments, which are drawn but not printed. Master lengths 3 1 4 1 3 in Example 1: of six "
        "equal ones each faces a slave node in its middle, and two-pass NTS-AR passes by symmetry",
    ),
    ("Penalty of the figures", "one for each figure, with which the curves fill the pressure axis that it prints"),
    ("Penalty of the pass/fail table", "ε̂ = 10 E/h with the mean slave segment h; NTS: ε = ε̂ h"),
    ("Pressure of NTS and of two passes", "nodal force over the node's share of the interface, Eq. 3"),
    ("VTS-G", "two Gauss points on each slave segment"),
    (
        "Fig. 30",
        "ε̂ = E, p = E/100, free sides, the slave begins where it touches; both blocks alike, and one half as stiff",
    ),
    (
        "Convergence",
        "largest entry of the residual, to its own roundoff; the paper: an energy norm of 1e−15 in Example 2",
    ),
    (
        "Example 2",
        "plane strain, the whole disk held on its axis, a foundation 20 wide and 10 deep, clamped below, free at its "
        "sides, 160 × 30 elements of which 61 are equally wide over |x| ≤ 0.6; four segments of the disk to five of "
        "them; the disk begins as deep as Hertz on springs ε̂ has it",
    ),
    ("Ties at a vertex, feet past a free end, the end of a walk", "see plugins/README.md and the docstrings there"),
)


def check_folder(folder: Path, argument: str = "--out") -> None:
    """Makes the folder, and says before anything takes long what would stop files from being written to it.

    Raises
    ------
    MisuseError
        If it cannot be made or written to.
    """
    made_folder(folder, argument)
    for name in (NUMBERS, PAGE):
        check_writable(folder / name, argument, f"a folder that may hold {name}")


def write(
    paper: Paper, folder: Path, told: Callable[[str], None] = lambda _: None, argument: str = "--out"
) -> tuple[Path, ...]:
    """Writes all files, each whole or not at all, and returns their paths; `told` hears of each figure.

    Raises
    ------
    MisuseError
        As `check_folder`.
    """
    check_folder(folder, argument)
    written = [folder / NUMBERS]
    with whole(folder / NUMBERS) as part:
        tree_of(paper).to_netcdf(part, engine="netcdf4", format="NETCDF4")
    inlined: dict[str, Markup] = {}
    for drawing in drawings(paper):
        told(drawing.caption)
        figure = drawing.drawn()
        written.append(folder / f"{drawing.name}.svg")
        with whole(written[-1]) as part:
            part.write_text(svg(figure), encoding="utf-8", newline="\n")
        inlined[drawing.name] = svg_inline(figure, f"{drawing.figure}. {drawing.caption}")
    written.append(folder / PAGE)
    write_page(written[-1], page(paper, inlined), argument)
    return tuple(written)


def page(paper: Paper, figures: dict[str, Markup]) -> str:
    """The page, with the figures by name."""
    return render(
        "paper.html.j2",
        package="contactverif_paper",
        paper=paper,
        figures=figures,
        drawings=[drawing for drawing in drawings(paper) if not drawing.name.startswith("defect")],
        defects=[drawing for drawing in drawings(paper) if drawing.name.startswith("defect")],
        said=Said,
        marks_of=MARKS,
        class_of=CLASSES,
        choices=CHOICES,
        reference=REFERENCE,
        counts={verdict: sum(one.verdict is verdict for one in paper.statements) for verdict in Said},
        about=_about(paper),
        titles=_titles(paper),
        scenes=list(dict.fromkeys(row.scene for row in paper.multipliers)),
        multipliers=_by_legend(paper.multipliers),
        rounding=max(row.rounding for table in paper.forces for row in table.rows),
    )


def summary(paper: Paper) -> str:
    """Every statement that does not merely note a silence, a line each."""
    return "\n".join(
        f"  {MARKS[one.verdict]} {one.verdict.mark:8} {one.figure}: {one.found}"
        for one in paper.statements
        if one.verdict is not Said.SILENT
    )


def _by_legend(rows: Sequence[MultiplierRow]) -> dict[str, list[MultiplierRow]]:
    """{legend: its rows, a scene each}."""
    found: dict[str, list[MultiplierRow]] = {}
    for row in rows:
        found.setdefault(row.member.legend, []).append(row)
    return found


def _titles(paper: Paper) -> dict[str, str]:
    """{scene: what the paper calls it}, as the head of a column."""
    return {"c-prime": "C′ (ours)"} | {patch.scene: patch.title.removeprefix("Case ") for patch in paper.patches}


def _about(paper: Paper) -> dict[str, list[int]]:
    """{drawing: numbers of the statements that it shows}."""
    found: dict[str, list[int]] = {}
    for number, statement in enumerate(paper.statements):
        found.setdefault(statement.drawing, []).append(number)
    return found


def svg(figure: Figure) -> str:
    """The figure with its letters as paths, the same for the same figure, without what nothing is drawn from.

    Lengths are rounded to a hundredth of a point, which nobody sees; matplotlib writes a millionth.
    """
    buffer = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "contactverif"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = re.sub(r"<!--.*?-->\s*", "", buffer.getvalue(), flags=re.DOTALL)
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'(?<= )(?:d|x|y)="[^"]*"|translate\([^)]*\)', _rounded, text)
    text = re.sub(r'<g id="[^"]*"', "<g", text)  # to which nothing refers
    text = re.sub(r'(?<= )style="[^"]*"', lambda style: style[0].replace(": ", ":").replace("; ", ";"), text)
    text = text.replace("stroke-dashoffset:0;", "")  # which it is anyway
    return "\n".join(line.strip() for line in text.splitlines()) + "\n"


def _rounded(attribute: re.Match[str]) -> str:
    """Its numbers with two decimals at most, and a blank for each end of a line."""
    short = re.sub(r"-?\d+\.\d{3,}", lambda found: f"{float(found[0]):.2f}".rstrip("0").rstrip("."), attribute[0])
    return " ".join(short.split())
