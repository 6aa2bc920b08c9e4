"""Free ends: what becomes of an area of competence that overhangs the end of the master. The paper is silent.

No case of the paper has such an area, and Boxes 2 and 3 do not say what to do. So what fails here is our reading of a
silent text, not the paper. Our reading is `free_end=truncate`: at a free end of the master, where several segments are
involved, the area is cut on the master's side only, and the slave keeps its force.

Source: Zavarise & De Lorenzis (2009), Boxes 2 and 3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from matplotlib.figure import Figure

from contactverif.mechanics.bodies import Rectangle
from contactverif.mechanics.scene import Scene
from contactverif.problems.blocks import two_blocks
from contactverif_paper.figure_style import Series, add_legend, line_style, new_panels, plot_logarithmic
from contactverif_paper.paper_columns import Formulations, series_columns
from contactverif_paper.paper_formulations import BALANCED, MORTAR, NTS_AR, STS, VTS_ME, VTS_PPT
from contactverif_paper.paper_item import Agreement, Item, PaperFigure, Progress, Statement
from contactverif_paper.patch_solutions import solved_error

FORMULATIONS = (NTS_AR, VTS_ME, VTS_PPT, BALANCED, STS, MORTAR)
OVERHANGS = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9])  # Parts of a slave segment.
_YOUNG, _POISSON, _PRESSURE = 1e4, 0.3, 100.0
_ERRORS = series_columns(
    "overhang", "1", "part of a slave segment that overhangs", "largest error of a stress over the pressure", np.nan
)
_SEGMENT = 2.0  # The length of a slave segment.
_PASSES = 1e-9  # Errors are at roundoff or far above this.


@dataclass(frozen=True, slots=True, eq=False)
class FreeEnds:
    """The error of the stress over the part of a slave segment that overhangs."""

    stress_error: Annotated[Series, _ERRORS]
    formulations: Formulations = FORMULATIONS


def compute(report_progress: Progress) -> FreeEnds:
    """Solve with all formulations and overhangs."""
    report_progress("free ends")
    errors = np.array([[solved_error(row, overhanging(part)) for part in OVERHANGS] for row in FORMULATIONS])
    return FreeEnds(Series(FORMULATIONS, OVERHANGS, errors))


def overhanging(part: float) -> Scene:
    """Return a slave block that overhangs a narrower master at both ends, by that part of a slave segment.

    The pressure acts on what overhangs of the slave too, so that the exact solution is a uniform stress.
    """
    layers = np.linspace(0.0, 4.0, 3)
    edge = 4.0 - _SEGMENT * part  # It lies inside the slave segment from 2 to 4.
    return two_blocks(
        Rectangle(np.linspace(-6.0, 6.0, 7), layers, young=_YOUNG, poisson=_POISSON),
        Rectangle(np.linspace(-edge, edge, 6), layers - 4.0, young=_YOUNG, poisson=_POISSON),
        penalty=10 * _YOUNG / _SEGMENT,
        pressure=_PRESSURE,
    )


def statements(result: FreeEnds) -> Iterator[Statement]:
    """Say what our reading leads to."""
    largest = float(np.nanmax(result.stress_error.row(VTS_PPT)))
    balanced = float(np.nanmax(result.stress_error.row(BALANCED)))
    yield Statement(
        "Boxes 2, 3",
        "nothing is said of an area of competence that overhangs the end of the master",
        "with our reading (cut at the free end on the master’s side only, free_end=truncate) the patch test fails, "
        f"with errors of the stress up to {largest:.2g} of the pressure; with vts-ppt-balanced, which takes only "
        f"what faces the master into the area, errors are {balanced:.1e} at most",
        Agreement.SILENT,
        "free-ends",
    )


@PaperFigure.define(
    "free-ends",
    "Error of the stress in a uniform patch test whose slave overhangs the master inside a segment. VTS-PPT passes "
    "where nothing is cut: without an overhang, and at half a segment, where an area of competence ends. At all "
    "other places it fails.",
)
def plot(result: FreeEnds) -> Figure:
    """Draw the errors over the overhang."""
    figure, (axes,) = new_panels(3.8, 1)
    errors = result.stress_error
    others = tuple(row for row in FORMULATIONS if row is not VTS_PPT)
    plot_logarithmic(axes, Series(others, errors.at, np.stack([errors.row(row) for row in others])))
    values, passes = errors.row(VTS_PPT), errors.row(VTS_PPT) < _PASSES
    style = line_style(VTS_PPT, 1)
    axes.plot(
        errors.at, np.where(passes, np.nan, values), **style
    )  # No line leads to the single places where it passes.
    axes.plot(errors.at[passes], values[passes], **style | {"linestyle": "none", "markersize": 7.0, "zorder": 4})
    for place, words_ in ((0.0, "VTS-PPT passes:\nno overhang"), (0.5, "VTS-PPT passes: an area of\ncompetence ends")):
        arrow = {"arrowstyle": "-|>", "linewidth": 0.8, "color": "black"}
        axes.annotate(words_, (place, 3e-14), (place + 0.03, 3e-10), va="center", arrowprops=arrow)
    axes.text(0.9, 3e-14, "the three that pass: roundoff", ha="right", color="0.35")
    axes.set_xlabel("part of a slave segment that overhangs the master (–)")
    axes.set_ylabel("largest error of the stress / p (–)")
    add_legend(figure, FORMULATIONS, columns=3)
    return figure


ITEM = Item(
    name="free_ends",
    title="Free ends of the master: the paper is silent",
    compute=compute,
    statements=statements,
    figures=(plot,),
    choices={
        "Free ends of the master": "free_end=truncate: where several segments are involved, the area of competence is "
        "cut at a free end on the master’s side only; elsewhere Box 3 holds as printed",
        "Ties at a vertex, feet past a free end, the end of a walk": "see plugins/README.md and the docstrings there",
    },
)
