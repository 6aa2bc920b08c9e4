"""Case test C: one area of competence crosses a master node. VTS-ME fails, VTS-PPT passes.

The virtual slave node at x = 9 lies exactly on a master node. There VTS-ME is pushed by one master segment or by the
other, and Newton's method may take turns between the two states.

Source: Zavarise & De Lorenzis (2009), Section 5.2.3, Figs. 20–22.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from contactverif.contract.arrays import IntArray
from contactverif.mechanics import newton
from contactverif.mechanics.newton import End
from contactverif.problems import catalogue
from contactverif_paper.paper_columns import WORDS, Column
from contactverif_paper.paper_formulations import NTS_AR, VTS_ME, VTS_PPT, subject_of
from contactverif_paper.paper_item import Agreement, Statement
from contactverif_paper.patch_item import PatchTests, PrintedForces, Study, patch_item
from contactverif_paper.patch_solutions import FIVE, YOUNG, PatchSetup

PATCH = PatchSetup("c", "Case C", "22", "21", (0.0, 12.0), (0.7, 1.7), 0.06, FIVE)
SCENES = ("c", "c-prime")  # The virtual slave nodes of C′ lie beside master nodes.
STIFFNESS = (0.01, 0.03, 0.06, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
_EXACT = "3/2 3 3 3 3/2"
_ENDS = {end.label.replace(" ", "_"): int(end) for end in End}


@dataclass(frozen=True, slots=True, eq=False)
class Ends:
    """The end of Newton's method with VTS-ME, over the penalty."""

    end: Annotated[IntArray, Column("scene penalty", "1", "how Newton's method ended with VTS-ME", meanings=_ENDS)]
    scene: Annotated[tuple[str, ...], Column("scene", WORDS, "scene, as on the command line")] = SCENES
    stiffness: Annotated[tuple[float, ...], Column("penalty", "m-1", "penalty over E")] = STIFFNESS


def compute_ends() -> Ends:
    """Solve both scenes with VTS-ME at all penalties."""
    return Ends(np.array([[_end(scene, stiffness) for stiffness in STIFFNESS] for scene in SCENES]))


def _end(scene_name: str, stiffness: float) -> int:
    scene = catalogue.make_scene(scene_name, penalty=stiffness * YOUNG)
    return int(newton.solve(scene, subject_of(VTS_ME).for_case(scene.case())).end)


def _convergence_statement(tests: PatchTests) -> Statement:
    curve = tests.patches[0].curve(VTS_ME)
    printed, beside = tests.study.end == End.CONVERGED
    result = f"at ε̂ = {PATCH.stiffness:g} × E Newton’s method ends: {curve.end}"
    if not printed.all():
        share = "at all" if beside.all() else f"at {int(beside.sum())} of"
        missed = np.array(STIFFNESS)[~printed]
        result += (
            f". It does not converge for ε̂/E from {missed.min():g} to {missed.max():g}: a virtual slave node lies "
            f"exactly on the master node x = 9, and its two segments take turns. On C′, where it lies beside the "
            f"node, VTS-ME converges {share} {len(STIFFNESS)} penalties"
        )
    return Statement(
        "Figs. 21, 22",
        "case C: VTS-ME has a solution, of which the mesh and the pressure are shown",
        result,
        Agreement.decide(curve.solution.converged),
        "fig22",
    )


ITEM = patch_item(
    "case_c",
    "Case C: an area of competence over two master segments",
    PATCH,
    captions={
        21: "Case C: magnified penetrations.",
        22: "Case C: contact pressure over the exact one. VTS-ME is in a 2-cycle, of which one state is drawn.",
    },
    printed=PrintedForces(
        "Fig. 20",
        "NTS and VTS-ME hand wrong forces to the master; VTS-PPT hands over the right ones",
        _EXACT,
        {NTS_AR: "5/3 10/3 7/3 8/3 2", VTS_ME: "3/2 3 17/6 10/3 4/3", VTS_PPT: _EXACT},
    ),
    study=Study("vts_me", compute_ends, _convergence_statement, {"figure": "Figs. 21, 22"}),
)
