"""Case test C: one area of competence crosses a master node. VTS-ME fails, VTS-PPT passes.

The virtual slave node at x = 9 lies exactly on a master node. There VTS-ME is pushed by one master segment or by the
other, and Newton's method may take turns between the two states.

Source: Zavarise & De Lorenzis (2009), Section 5.2.3, Figs. 20–22.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.mechanics import newton
from contactverif.mechanics.trace import End
from contactverif.problems import catalogue
from contactverif_paper import paper_formulations as formulations
from contactverif_paper.force_transmission import (
    ForceTable,
    force_dataset,
    force_page_table,
    force_statement,
    force_table,
)
from contactverif_paper.paper_formulations import subject_of
from contactverif_paper.paper_item import Agreement, Item, PaperFigure, Progress, Statement
from contactverif_paper.patch_plots import patch_dataset, plot_penetrations, plot_pressures, range_statement
from contactverif_paper.patch_solutions import FIVE, YOUNG, PatchSetup, PatchSolution, patch_solution
from contactverif_reports.netcdf.variables import codes, numbers, words

PATCH = PatchSetup("c", "Case C", "22", "21", (0.0, 12.0), (0.7, 1.7), 0.06, FIVE)
EXACT = "3/2 3 3 3 3/2"
PRINTED = {
    formulations.NTS_AR: "5/3 10/3 7/3 8/3 2",
    formulations.VTS_ME: "3/2 3 17/6 10/3 4/3",
    formulations.VTS_PPT: EXACT,
}
SCENES = ("c", "c-prime")
STIFFNESS = np.array([0.01, 0.03, 0.06, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0])  # ε̂ over E, per unit of length.


@dataclass(frozen=True, slots=True, eq=False)
class CaseC:
    """The forces of a uniform pressure, the solved patch test, and how VTS-ME ends over the penalty."""

    forces: ForceTable
    patch: PatchSolution
    # (n_scenes, n_penalties) The `End` of VTS-ME on case C and on C′, whose virtual slave nodes lie beside master
    # nodes.
    ends: IntArray


def compute(report_progress: Progress) -> CaseC:
    """Compute the case."""
    report_progress(PATCH.title)
    ends = np.array([[_end(scene, stiffness) for stiffness in STIFFNESS] for scene in SCENES])
    return CaseC(force_table("c", PATCH.title, EXACT, PRINTED), patch_solution(PATCH), ends)


def statements(case: CaseC) -> tuple[Statement, ...]:
    """Compare the printed forces, the printed axis and the curve of VTS-ME."""
    claim = "NTS and VTS-ME hand wrong forces to the master; VTS-PPT hands over the right ones"
    return force_statement(case.forces, "Fig. 20", claim), range_statement(case.patch), _convergence_statement(case)


def datasets(case: CaseC) -> dict[str, xr.Dataset]:
    """Return the numbers of the case."""
    meanings = {end.label.replace(" ", "_"): int(end) for end in End}
    ends = {
        "scene": words(["scene"], SCENES, "scene, as on the command line"),
        "stiffness": numbers(["penalty"], STIFFNESS, "penalty over E", "m-1"),
        "end": codes(["scene", "penalty"], case.ends, meanings, "how Newton's method ended with VTS-ME"),
    }
    return {
        "forces": force_dataset(case.forces, "Fig. 20"),
        "patch": patch_dataset([case.patch]),
        "vts_me": xr.Dataset(ends, attrs={"figure": "Figs. 21, 22"}),
    }


def _end(scene_name: str, stiffness: float) -> int:
    scene = catalogue.make_scene(scene_name, penalty=stiffness * YOUNG)
    return int(newton.solve(scene, subject_of(formulations.VTS_ME).for_case(scene.case())).end)


def _convergence_statement(case: CaseC) -> Statement:
    curve = case.patch.curve(formulations.VTS_ME)
    printed, beside = case.ends == End.CONVERGED
    result = f"at ε̂ = {PATCH.stiffness:g} × E Newton’s method ends: {curve.solution.end}"
    if not printed.all():
        result += (
            f". It does not converge for ε̂/E from {_ends_of(STIFFNESS[~printed])}: a virtual slave node lies exactly "
            f"on the master node x = 9, and its two segments take turns. On C′, where it lies beside the node, VTS-ME "
            f"converges {'at all' if beside.all() else f'at {int(beside.sum())} of'} {len(STIFFNESS)} penalties"
        )
    return Statement(
        "Figs. 21, 22",
        "case C: VTS-ME has a solution, of which the mesh and the pressure are shown",
        result,
        Agreement.decide(curve.solution.converged),
        "fig22",
    )


def _ends_of(values: FloatArray) -> str:
    return f"{values.min():g} to {values.max():g}"


ITEM = Item(
    name="case_c",
    title="Case C: an area of competence over two master segments",
    compute=compute,
    statements=statements,
    datasets=datasets,
    figures=(
        PaperFigure(
            "fig21", "Fig. 21", "Case C: magnified penetrations.", lambda case: plot_penetrations([case.patch])
        ),
        PaperFigure(
            "fig22",
            "Fig. 22",
            "Case C: contact pressure over the exact one. VTS-ME is in a 2-cycle, of which one state is drawn.",
            lambda case: plot_pressures([case.patch]),
        ),
    ),
    tables=lambda case: (force_page_table(case.forces),),
)
