"""Example 1bis: the punch of Example 1 on a mesh where areas of competence cross master nodes.

Source: Zavarise & De Lorenzis (2009), Section 7.1, Figs. 34–36.
"""

from __future__ import annotations

import xarray as xr

from contactverif_paper.paper_item import Item, PaperFigure, Statement
from contactverif_paper.patch_plots import (
    patch_dataset,
    plot_meshes,
    plot_penetrations,
    plot_pressures,
    range_statement,
)
from contactverif_paper.patch_solutions import FIVE, PatchSetup, PatchSolution, patch_item_data

PATCH = PatchSetup("example-1bis", "Example 1bis", "36", "35", (-3.0, 3.0), (0.6, 1.4), 0.06, FIVE, close_up=(0.8, 1.2))


def statements(patches: tuple[PatchSolution, ...]) -> tuple[Statement, ...]:
    """Compare the printed axis."""
    return (range_statement(patches[0]),)


def datasets(patches: tuple[PatchSolution, ...]) -> dict[str, xr.Dataset]:
    """Return the numbers of the example."""
    return {"patch": patch_dataset(patches)}


ITEM = Item(
    name="example_1bis",
    title="Example 1bis: the same punch on another mesh",
    compute=patch_item_data(PATCH),
    statements=statements,
    datasets=datasets,
    figures=(
        PaperFigure(
            "fig34",
            "Fig. 34",
            "Example 1bis: the meshes. Slave lengths 2 2 2 over master lengths 1.625, five of 1.75, 1.625; the paper "
            "draws them and prints no lengths.",
            lambda patches: plot_meshes(patches[0].solved),
        ),
        PaperFigure("fig35", "Fig. 35", "Example 1bis: magnified penetrations.", plot_penetrations),
        PaperFigure(
            "fig36",
            "Fig. 36",
            "Example 1bis: contact pressure over the exact one; (b) is a close-up.",
            plot_pressures,
        ),
    ),
    choices={"Example 1bis": "the lengths of the segments: 1.625 1.75 1.75 1.75 1.75 1.75 1.625 in the master"},
)
