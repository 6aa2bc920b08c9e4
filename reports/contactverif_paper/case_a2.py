"""Case test A2: an elastic block on a rigid foundation, with a uniform and a graded mesh. NTS fails, NTS-AR passes.

The paper prints no lengths. Its axis runs from −5 to 5, so the block is 10 wide.

Source: Zavarise & De Lorenzis (2009), Section 4.4, Figs. 11 and 12.
"""

from __future__ import annotations

import xarray as xr

from contactverif_paper.paper_item import Item, PaperFigure, Statement
from contactverif_paper.patch_plots import patch_dataset, plot_penetrations, plot_pressures, range_statement
from contactverif_paper.patch_solutions import TWO, PatchSetup, PatchSolution, patch_item_data

_X_AXIS, _AXIS = (-5.0, 5.0), (0.8, 1.8)
UNIFORM = PatchSetup("a2-uniform", "Case A2, uniform mesh", "12(a)", "11(a, b)", _X_AXIS, _AXIS, 0.06, TWO)
GRADED = PatchSetup("a2-graded", "Case A2, graded mesh", "12(b)", "11(c, d)", _X_AXIS, _AXIS, 0.3, TWO)


def statements(patches: tuple[PatchSolution, ...]) -> tuple[Statement, ...]:
    """Compare the printed axes."""
    return tuple(range_statement(patch) for patch in patches)


def datasets(patches: tuple[PatchSolution, ...]) -> dict[str, xr.Dataset]:
    """Return the numbers of both meshes."""
    return {"patch": patch_dataset(patches)}


ITEM = Item(
    name="case_a2",
    title="Case A2: a block on a rigid foundation",
    compute=patch_item_data(UNIFORM, GRADED),
    statements=statements,
    datasets=datasets,
    figures=(
        PaperFigure(
            "fig11",
            "Fig. 11",
            "Case A2: magnified penetrations; (a, b) uniform mesh, (c, d) graded mesh.",
            plot_penetrations,
        ),
        PaperFigure(
            "fig12",
            "Fig. 12",
            "Case A2: contact pressure over the exact one; (a) uniform mesh, (b) graded mesh.",
            plot_pressures,
        ),
    ),
    choices={"Case A2": "the lengths of the segments: 2 2 2 2 2 in the uniform mesh, 1 2 3 4 in the graded one"},
    n_steps=2,
)
