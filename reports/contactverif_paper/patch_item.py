"""The items that show patch tests of the paper: solved at a soft penalty, some with a table of nodal forces.

Such an item gives its patch tests, its captions and what the paper prints; all else is the same for all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from contactverif.contract.columns import Group
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


@dataclass(frozen=True, slots=True)
class _Plan:
    """The parts of an item of patch tests: it computes, declares and states what they say."""

    setups: tuple[PatchSetup, ...]
    printed: PrintedForces | None
    study: Study | None

    def compute(self, report_progress: Progress) -> PatchTests:
        """Solve the patch tests, and compute forces and numbers beside them."""
        patches = []
        for setup in self.setups:
            report_progress(setup.title)
            patches.append(patch_solution(setup))
        first, printed = self.setups[0], self.printed
        forces = force_table(first.scene, first.title, printed.exact, printed.transmitted) if printed else None
        return PatchTests(tuple(patches), forces, self.study.compute() if self.study else None)

    def statements(self, tests: PatchTests) -> Iterator[Statement]:
        """Compare the printed forces and axes, and what the study finds."""
        if self.printed and tests.forces:
            yield force_statement(tests.forces, self.printed.figure, self.printed.claim)
        yield from map(range_statement, tests.patches)
        if self.study:
            yield self.study.statement(tests)

    def datasets(self, tests: PatchTests) -> dict[str, Group]:
        """Return patch tests, forces and numbers beside them, a group each."""
        datasets = {"patch": _patch_dataset(tests.patches)}
        if self.printed and tests.forces:
            datasets["forces"] = force_dataset(tests.forces, self.printed.figure)
        if self.study:
            datasets[self.study.name] = to_group(tests.study, **self.study.attributes)
        return datasets


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
    plots, plan = (plot_meshes, plot_penetrations, plot_pressures)[-len(captions) :], _Plan(setups, printed, study)
    return Item(
        name=name,
        title=title,
        compute=plan.compute,
        statements=plan.statements,
        datasets=plan.datasets,
        figures=tuple(
            PaperFigure(f"fig{number:02}", caption, partial(_plot, plot))
            for (number, caption), plot in zip(captions.items(), plots, strict=True)
        ),
        tables=lambda tests: [force_page_table(tests.forces)] if tests.forces else [],
        text=text,
        choices=choices or {},
        n_steps=len(setups),
    )


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
