"""Section 6.3: whether VTS-PPT with Lagrange multipliers satisfies the inf-sup condition, which the paper leaves open.

The constant β of five meshes is that of the property `stability.inf-sup`. Its three families of meshes have a slave
that is coarser than the master, a finer one, and nodes on nodes.

Source: Zavarise & De Lorenzis (2009), Section 6.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.problems.refined_blocks import FAMILIES, N_MESHES, refinement_cases
from contactverif_paper.figure_style import add_legend, line_style, new_panels, use_decades
from contactverif_paper.paper_columns import WORDS, Column, Formulations
from contactverif_paper.paper_formulations import PaperFormulation, measure
from contactverif_paper.paper_item import Agreement, Cell, Item, PageTable, PaperFigure, Progress, Statement
from contactverif_reports.html.pages import number

VTS_PPT = PaperFormulation("VTS-PPT", "vts-ppt-lm", 0)
ONE_POINT = PaperFormulation("VTS-PPT, n = 1", "vts-ppt-lm:n=1", 4)
TWO_PASS = PaperFormulation("two-pass NTS", "two-pass/nts-lm", 2)
NTS = PaperFormulation("NTS", "nts-lm", 3)
MORTAR = PaperFormulation("mortar", "mortar-lm", 5)
DUAL = PaperFormulation("dual mortar", "mortar-dual-lm", 1)
FORMULATIONS = (VTS_PPT, ONE_POINT, TWO_PASS, NTS, MORTAR, DUAL)
STABLE_SLOPE = 0.1  # The tolerance of the property.
_SERIES = ("inf-sup constant", "slave segment", "zero eigenvalues", "multipliers")


@dataclass(frozen=True, slots=True, eq=False)
class Constants:
    """The inf-sup constants."""

    beta: Annotated[
        FloatArray, Column("formulation family mesh", "1", "smallest inf-sup constant that is not 0", name="constant")
    ]
    segments: Annotated[FloatArray, Column("family mesh", "length", "slave segment h", name="segment")]
    zeros: Annotated[FloatArray, Column("formulation family", "1", "share of pressures that move nothing, finest mesh")]
    slope: Annotated[FloatArray, Column("formulation family", "1", "slope of log β against log h, two finest meshes")]
    formulations: Formulations = FORMULATIONS
    family: Annotated[tuple[str, ...], Column("family", WORDS, "slave against master")] = tuple(FAMILIES)

    def stable(self, formulation: PaperFormulation) -> bool:
        """Return whether β does not fall, and every pressure moves something, on all families."""
        row = FORMULATIONS.index(formulation)
        return bool((self.zeros[row] == 0).all() and (self.slope[row] <= STABLE_SLOPE).all())


def compute(report_progress: Progress) -> Constants:
    """Compute the constants of all formulations and families."""
    report_progress("Section 6.3, inf-sup constants")
    table = np.array(
        [[_series(case, formulation) for case in refinement_cases()] for formulation in FORMULATIONS]
    )  # (n_formulations, n_families, 4, n_meshes)
    beta, segments = table[:, :, 0], table[0, :, 1]
    slopes = np.diff(np.log(beta[..., -2:]))[..., 0] / np.diff(np.log(segments[:, -2:]))[:, 0]
    return Constants(beta, segments, table[:, :, 2, -1] / table[:, :, 3, -1], slopes)


def _series(case: Case, formulation: PaperFormulation) -> list[FloatArray]:
    measurement = measure("stability.inf-sup", case, formulation)
    assert measurement is not None
    return [measurement.series[name] for name in _SERIES]


def statements(constants: Constants) -> Iterator[Statement]:
    """Answer the question that the paper leaves open."""
    coarser, finer, matching = range(len(FAMILIES))
    pair, single, passes = (FORMULATIONS.index(row) for row in (VTS_PPT, ONE_POINT, TWO_PASS))
    stable = [row.legend for row in FORMULATIONS if constants.stable(row)]
    yield Statement(
        "Section 6.3",
        "it is not proved that VTS-PPT satisfies the inf-sup condition, and it is possible that it shares what the "
        "mortar method has",
        "it does not: with two virtual slave nodes a segment, β falls like h to the power "
        f"{constants.slope[pair, coarser]:.2f} on a slave that is coarser than the master (2:3), if pressures are "
        "measured by √h times their L2 norm, and "
        f"{constants.zeros[pair, finer]:.0%} of all pressures move nothing on a finer one (3:2). With one virtual "
        f"slave node, β falls like h to the power {constants.slope[single, matching]:.2f} on matching meshes. "
        f"β is constant on all meshes for: {', '.join(stable)}. In two passes, "
        f"{constants.zeros[passes, coarser]:.0%} (2:3) to {constants.zeros[passes, matching]:.0%} (matching) of "
        "all pressures move nothing: one for each pair of nodes in one place",
        Agreement.decide(constants.stable(VTS_PPT) is constants.stable(MORTAR)),
        "inf-sup",
    )


@PaperFigure.define(
    "inf-sup",
    "The inf-sup constant on five meshes, (a) with a slave that is coarser than the master, (b) with a finer "
    "one, and (c) with nodes on nodes; pressures are measured by √(h/E) times their L2 norm. Where some pressures move "
    "nothing, their constant is 0, and the pale curve is that of the others. NTS (large) and dual mortar coincide.",
)
def plot(constants: Constants) -> Figure:
    """Draw β over h, a panel a family."""
    figure, panels = new_panels(3.6, len(FAMILIES), sharey=True)
    for column, (axes, name) in enumerate(zip(panels, FAMILIES, strict=True)):
        for row, formulation in enumerate(FORMULATIONS):
            more: dict[str, Any] = {} if constants.zeros[row, column] == 0 else {"alpha": 0.35}
            if formulation is NTS:  # Dual mortar has the same curve.
                more |= {"markersize": 8.0, "zorder": 2}
            axes.plot(constants.segments[column], constants.beta[row, column], **line_style(formulation, 1, **more))
        axes.set_xscale("log", base=2)
        axes.set(xlabel="h (length)", title=name)
        use_decades(axes)
        _label_left_out(axes, constants, column)
    panels[0].set_ylabel("inf-sup constant β (–)")
    add_legend(figure, FORMULATIONS, columns=3)
    return figure


def _label_left_out(axes: Axes, constants: Constants, column: int) -> None:
    """Say which share of the pressures of whom moves nothing."""
    lines = [
        f"{constants.zeros[row, column]:.0%} of {formulation.legend}"
        for row, formulation in enumerate(FORMULATIONS)
        if constants.zeros[row, column]
    ]
    words_ = "\n".join(["move nothing:", *lines])
    top = 0.36 if constants.zeros[FORMULATIONS.index(VTS_PPT), column] else 0.52  # Above the low curve of VTS-PPT.
    axes.text(0.04, top, words_, transform=axes.transAxes, va="top", color="0.25", fontsize=9, linespacing=1.4)


def tables(constants: Constants) -> Iterator[PageTable]:
    """Yield β on the finest mesh, its slope, and the share of pressures that move nothing."""
    rows = []
    for row, formulation in enumerate(FORMULATIONS):
        cells = [Cell((formulation.legend,))]
        for column in range(len(FAMILIES)):
            zeros, slope = constants.zeros[row, column], constants.slope[row, column]
            tone = "n good" if zeros == 0 and slope <= STABLE_SLOPE else "n bad"
            slope = 0.0 if abs(slope) < 0.005 else slope  # No −0.00.
            details = (f"slope {slope:.2f}", f"{zeros:.0%} move nothing")
            cells.append(Cell((number(constants.beta[row, column, -1], 2),), details, tone))
        rows.append(tuple(cells))
    caption = "Inf-sup constant β on the finest of five meshes; below, its slope against h, and how many pressures move"
    yield PageTable(f"{caption} nothing", ("Formulation", *FAMILIES), tuple(rows))


ITEM = Item(
    name="inf_sup_condition",
    title="Section 6.3: the inf-sup condition",
    compute=compute,
    statements=statements,
    attributes={"n_meshes": N_MESHES},
    figures=(plot,),
    tables=tables,
    text="The paper has no proof that VTS-PPT satisfies the inf-sup condition, and supposes that it does what the "
    "mortar method does. With multipliers it does not. B S⁻¹ Bᵀ λ = β² h A λ / E has an eigenvalue for "
    "each multiplier: B are the rows of "
    "forces or of gaps where two blocks touch (the smaller β counts), S is the condensed stiffness of both blocks, A "
    "holds the areas, and h is the slave segment. A pressure at two points of each segment can vary in more ways than "
    "the gap between two meshes. Some of those ways are held by next to nothing, or by nothing at all. The patch test "
    "does not see them, since a uniform pressure is none of them. As a penalty in place of the multipliers rises, "
    "the same points lock.",
)
