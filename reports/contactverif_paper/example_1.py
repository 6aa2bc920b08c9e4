"""Example 1: Taylor and Papadopoulos' punch, whose areas of competence each lie over one master segment.

Source: Zavarise & De Lorenzis (2009), Section 7.1, Figs. 31–33.
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
from contactverif_paper.patch_solutions import FOUR, PatchSetup, PatchSolution, patch_item_data

PATCH = PatchSetup("example-1", "Example 1", "33", "32", (-3.0, 3.0), (0.6, 2.2), 0.06, FOUR, close_up=(0.8, 1.2))


def statements(patches: tuple[PatchSolution, ...]) -> tuple[Statement, ...]:
    """Compare the printed axis."""
    return (range_statement(patches[0]),)


def datasets(patches: tuple[PatchSolution, ...]) -> dict[str, xr.Dataset]:
    """Return the numbers of the example."""
    return {"patch": patch_dataset(patches)}


ITEM = Item(
    name="example_1",
    title="Example 1: the punch of Taylor and Papadopoulos",
    compute=patch_item_data(PATCH),
    statements=statements,
    datasets=datasets,
    figures=(
        PaperFigure(
            "fig31",
            "Fig. 31",
            "Example 1: the meshes. Slave lengths 2 2 2 over master lengths 3 1 4 1 3; the paper draws them and prints "
            "no lengths.",
            lambda patches: plot_meshes(patches[0].solved),
        ),
        PaperFigure("fig32", "Fig. 32", "Example 1: magnified penetrations.", plot_penetrations),
        PaperFigure(
            "fig33",
            "Fig. 33",
            "Example 1: contact pressure over the exact one; (b) is a close-up.",
            plot_pressures,
        ),
    ),
    choices={
        "Example 1": "master lengths 3 1 4 1 3. With six equal ones each slave node faces the middle of one, and "
        "two-pass NTS-AR passes by symmetry"
    },
)
