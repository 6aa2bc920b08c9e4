"""The items of Taylor and Papadopoulos' punch: Examples 1 and 1bis have the same three figures on two meshes."""

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
from contactverif_paper.patch_solutions import PatchSetup, PatchSolution, patch_item_data


def punch_item(
    name: str, patch: PatchSetup, figures: tuple[int, int, int], *, title: str, meshes: str, choice: str
) -> Item:
    """Return the item of one example."""
    example = patch.title
    captions = (
        f"{example}: the meshes. {meshes}",
        f"{example}: magnified penetrations.",
        f"{example}: contact pressure over the exact one; (b) is a close-up.",
    )
    plots = (lambda patches: plot_meshes(patches[0].solved), plot_penetrations, plot_pressures)
    return Item(
        name=name,
        title=f"{example}: {title}",
        compute=patch_item_data(patch),
        statements=_statements,
        datasets=_datasets,
        figures=tuple(
            PaperFigure(f"fig{number}", f"Fig. {number}", caption, plot)
            for number, caption, plot in zip(figures, captions, plots, strict=True)
        ),
        choices={example: choice},
    )


def _statements(patches: tuple[PatchSolution, ...]) -> tuple[Statement, ...]:
    """Compare the printed axis."""
    return (range_statement(patches[0]),)


def _datasets(patches: tuple[PatchSolution, ...]) -> dict[str, xr.Dataset]:
    """Return the numbers of the example."""
    return {"patch": patch_dataset(patches)}
