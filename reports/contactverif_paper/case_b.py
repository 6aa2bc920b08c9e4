"""Case test B: each area of competence lies over one master segment. NTS-AR fails, VTS-ME passes.

Source: Zavarise & De Lorenzis (2009), Section 5.1.3, Figs. 16–18.
"""

from __future__ import annotations

from dataclasses import dataclass

import xarray as xr

from contactverif_paper import paper_formulations as formulations
from contactverif_paper.force_transmission import (
    ForceTable,
    force_dataset,
    force_page_table,
    force_statement,
    force_table,
)
from contactverif_paper.paper_item import Item, PaperFigure, Progress, Statement
from contactverif_paper.patch_plots import patch_dataset, plot_penetrations, plot_pressures, range_statement
from contactverif_paper.patch_solutions import FOUR, PatchSetup, PatchSolution, patch_solution

PATCH = PatchSetup("b", "Case B", "18", "17", (0.0, 12.0), (0.8, 1.6), 0.06, FOUR)
EXACT = "3/2 3 7/2 3 1"
PRINTED = {formulations.NTS_AR: "5/3 10/3 3 2 2", formulations.VTS_ME: EXACT}


@dataclass(frozen=True, slots=True, eq=False)
class CaseB:
    """The forces of a uniform pressure, and the solved patch test."""

    forces: ForceTable
    patch: PatchSolution


def compute(report_progress: Progress) -> CaseB:
    """Compute the case."""
    report_progress(PATCH.title)
    return CaseB(force_table("b", PATCH.title, EXACT, PRINTED), patch_solution(PATCH))


def statements(case: CaseB) -> tuple[Statement, ...]:
    """Compare the printed forces and the printed axis."""
    claim = (
        "NTS hands wrong forces to the master although those on the slave are right; VTS-ME hands over the right ones"
    )
    return force_statement(case.forces, "Fig. 16", claim), range_statement(case.patch)


def datasets(case: CaseB) -> dict[str, xr.Dataset]:
    """Return the numbers of the case."""
    return {"forces": force_dataset(case.forces, "Fig. 16"), "patch": patch_dataset([case.patch])}


ITEM = Item(
    name="case_b",
    title="Case B: non-matching meshes that VTS-ME can handle",
    compute=compute,
    statements=statements,
    datasets=datasets,
    figures=(
        PaperFigure(
            "fig17", "Fig. 17", "Case B: magnified penetrations.", lambda case: plot_penetrations([case.patch])
        ),
        PaperFigure(
            "fig18",
            "Fig. 18",
            "Case B: contact pressure over the exact one.",
            lambda case: plot_pressures([case.patch]),
        ),
    ),
    tables=lambda case: (force_page_table(case.forces),),
    text="In Fig. 16 the paper’s “NTS” starts from the right slave forces: that is NTS-AR.",
)
