"""Case test A1: two slave segments over one master segment. NTS fails, NTS-AR passes.

Source: Zavarise & De Lorenzis (2009), Section 4.3, Figs. 8–10.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import xarray as xr

from contactverif_paper.force_transmission import (
    ForceTable,
    force_dataset,
    force_page_table,
    force_statement,
    force_table,
)
from contactverif_paper.paper_item import Item, PaperFigure, Progress, Statement
from contactverif_paper.patch_plots import patch_dataset, plot_penetrations, plot_pressures, range_statement
from contactverif_paper.patch_solutions import TWO, PatchSetup, PatchSolution, patch_solution

PATCH = PatchSetup("a1", "Case A1", "10", "9", (-2.0, 2.0), (0.9, 1.1), 1.0, TWO, origin=2.0)
CHOICES: Mapping[str, str] = {
    "Patch tests": "E = 10⁴ and ν = 0.3 in both bodies, heights 4, two layers of cells, rollers at all sides",
    "Penalty of the figures": "one for each panel, so that its curves use the pressure axis that the paper prints",
    "Pressure of NTS and of two passes": "the nodal force over the node's share of the interface, Eq. 3",
}


@dataclass(frozen=True, slots=True, eq=False)
class CaseA1:
    """The forces of a uniform pressure, and the solved patch test."""

    forces: ForceTable
    patch: PatchSolution


def compute(report_progress: Progress) -> CaseA1:
    """Compute the case."""
    report_progress(PATCH.title)
    return CaseA1(force_table("a1", PATCH.title, "2 2", {}), patch_solution(PATCH))


def statements(case: CaseA1) -> tuple[Statement, ...]:
    """Compare the printed forces and the printed axis."""
    return (
        force_statement(case.forces, "Fig. 8", "the right forces on the master are 2p, 2p"),
        range_statement(case.patch),
    )


def datasets(case: CaseA1) -> dict[str, xr.Dataset]:
    """Return the numbers of the case."""
    return {"forces": force_dataset(case.forces, "Fig. 8"), "patch": patch_dataset([case.patch])}


ITEM = Item(
    name="case_a1",
    title="Case A1: two slave segments over one master segment",
    compute=compute,
    statements=statements,
    datasets=datasets,
    figures=(
        PaperFigure(
            "fig09",
            "Fig. 9",
            "Case A1: magnified penetrations. Hatched is what penetrates. Solid and filled: slave; dashed and open: "
            "master.",
            lambda case: plot_penetrations([case.patch]),
        ),
        PaperFigure(
            "fig10",
            "Fig. 10",
            "Case A1: contact pressure over the exact one.",
            lambda case: plot_pressures([case.patch]),
        ),
    ),
    tables=lambda case: (force_page_table(case.forces),),
    choices=CHOICES,
)
