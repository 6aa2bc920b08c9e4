"""The items that show patch tests of the paper: solved at a soft penalty, some with a table of nodal forces.

Such an item gives its patch tests, its captions and what the paper prints; all else is the same for all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from contactverif_paper.force_transmission import (
    ForceTable,
    force_dataset,
    force_page_table,
    force_statement,
    force_table,
)
from contactverif_paper.paper_columns import name_columns, to_group, variables_of
from contactverif_paper.paper_formulations import PaperFormulation
from contactverif_paper.paper_item import Agreement, Item, PaperFigure, Progress, Statement
from contactverif_paper.patch_plots import plot_meshes, plot_penetrations, plot_pressures, shown_formulations
from contactverif_paper.patch_solutions import PatchSetup, PatchSolution, patch_solution
from contactverif_reports.netcdf.groups import Group


@dataclass(frozen=True, slots=True)
class PrintedForces:
    """The forces on the master that a figure of the paper prints, from left to right: "3/2 3 7/2 3 1"."""

    figure: str
    claim: str
    exact: str
    transmitted: Mapping[PaperFormulation, str]  # By each formulation that the paper shows.


@dataclass(frozen=True, slots=True)
class Study:
    """The numbers that an item computes beside its patch tests."""

    name: str  # Its group.
    compute: Callable[[], Any]
    statement: Callable[[PatchTests], Statement]
    attributes: Mapping[str, str]


@dataclass(frozen=True, slots=True, eq=False)
class PatchTests:
    """The solved patch tests of an item, the forces of a uniform pressure, and the data of a study."""

    patches: tuple[PatchSolution, ...]
    forces: ForceTable | None
    study: Any


def patch_item(
    name: str,
    title: str,
    *setups: PatchSetup,
    captions: Mapping[int, str],
    printed: PrintedForces | None = None,
    study: Study | None = None,
    text: str = "",
    choices: Mapping[str, str] | None = None,
) -> Item:
    """Return the item of some patch tests; the last two figures show penetrations and pressures, one before meshes."""
    plots = (plot_meshes, plot_penetrations, plot_pressures)[-len(captions) :]
    return Item(
        name=name,
        title=title,
        compute=partial(_compute, setups, printed, study),
        statements=partial(_statements, printed, study),
        datasets=partial(_datasets, printed, study),
        figures=tuple(
            PaperFigure(f"fig{number:02}", caption, partial(_plot, plot))
            for (number, caption), plot in zip(captions.items(), plots, strict=True)
        ),
        tables=lambda tests: () if tests.forces is None else (force_page_table(tests.forces),),
        text=text,
        choices=choices or {},
        n_steps=len(setups),
    )


def _compute(
    setups: tuple[PatchSetup, ...], printed: PrintedForces | None, study: Study | None, report_progress: Progress
) -> PatchTests:
    patches = []
    for setup in setups:
        report_progress(setup.title)
        patches.append(patch_solution(setup))
    first = setups[0]
    forces = force_table(first.scene, first.title, printed.exact, printed.transmitted) if printed else None
    return PatchTests(tuple(patches), forces, study.compute() if study else None)


def _statements(printed: PrintedForces | None, study: Study | None, tests: PatchTests) -> tuple[Statement, ...]:
    """Compare the printed forces and axes, and what the study finds."""
    statements = [range_statement(patch) for patch in tests.patches]
    if printed and tests.forces:
        statements.insert(0, force_statement(tests.forces, printed.figure, printed.claim))
    if study:
        statements.append(study.statement(tests))
    return tuple(statements)


def _datasets(printed: PrintedForces | None, study: Study | None, tests: PatchTests) -> dict[str, Group]:
    datasets = {"patch": _patch_dataset(tests.patches)}
    if printed and tests.forces:
        datasets["forces"] = force_dataset(tests.forces, printed.figure)
    if study:
        datasets[study.name] = to_group(tests.study, **study.attributes)
    return datasets


def _patch_dataset(patches: tuple[PatchSolution, ...]) -> Group:
    """Return pressures, stress errors and displacements; nothing stands where a figure does not show a formulation."""
    rows = tuple(shown_formulations(patches))
    cells = [[{curve.formulation: curve for curve in patch.curves}.get(row) for row in rows] for patch in patches]
    comment = "pressures at virtual slave nodes where at_points, else nodal forces over the nodes' shares"
    return Group(
        {column.name: column.variable([rows], "", ()) for column in name_columns("formulation")}
        | variables_of([patch.setup for patch in patches], "scene")
        | variables_of(patches, "scene")
        | variables_of(cells, "scene formulation"),
        attrs={"comment": comment},
    )


def _plot(plot: Callable[[tuple[PatchSolution, ...]], Any], tests: PatchTests) -> Any:
    return plot(tests.patches)


def range_statement(patch: PatchSolution) -> Statement:
    """Say what the printed pressure axis and our curves have in common; the paper prints no penalty."""
    setup = patch.setup
    low, high = setup.axis
    least, largest = patch.pressure_range
    inside = low <= least and largest <= high
    share = (largest - least) / (high - low)
    result = f"at ε̂ = {setup.stiffness:g} × E, which we chose, curves run from {least:.3f} to {largest:.3f}: "
    result += f"{share:.0%} of that axis" if inside else "they leave that axis"
    return Statement(
        f"Fig. {setup.pressures}",
        f"{setup.title}: the axis runs from {low:.2f} to {high:.2f} of the exact pressure; no penalty is printed",
        result,
        Agreement.SILENT if inside else Agreement.DIFFERS,
        f"fig{setup.pressures.partition('(')[0].zfill(2)}",
    )
