"""The table of who passes the elastic patch test: every formulation on every scene, at the moderate penalty ε̂ = 10 E/h.

Source: Zavarise & De Lorenzis (2009), Sections 4, 5 and 7.1, with Figs. 9–12, 17, 18, 21, 22, 32, 33, 35 and 36.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.problems import catalogue
from contactverif.problems.uniform_stress import CONDITION_TOLERANCE, condition_tolerance
from contactverif_paper import paper_formulations as paper
from contactverif_paper.paper_formulations import Formulations, PaperFormulation
from contactverif_paper.paper_item import WORDS, Agreement, Cell, Column, Item, PageTable, Statement
from contactverif_paper.patch_tests import FAILURE, PASSES, PRINTED_COLUMN, SILENT, STRESS_ERROR, moderate_error
from contactverif_reports.html.pages import number

FAILS = 1e-2  # A stress error above this share of the pressure is a failure.
FORMULATIONS = paper.ALL
SCENES: Mapping[str, str] = {  # {scene: head of its column}
    "a1": "A1",
    "a2-uniform": "A2, uniform mesh",
    "a2-graded": "A2, graded mesh",
    "b": "B",
    "example-1": "Example 1",
    "c": "C",
    "c-prime": "C′ (ours)",
    "example-1bis": "Example 1bis",
}
_NORMAL, _NON_MATCHING = ("a1", "a2-uniform", "a2-graded"), ("b", "c", "example-1", "example-1bis")
PRINTED: Mapping[PaperFormulation, Mapping[str, int]] = {  # What the paper says, by scene; else it is silent.
    paper.NTS: dict.fromkeys((*_NORMAL, *_NON_MATCHING), FAILURE),
    paper.NTS_AR: dict.fromkeys(_NORMAL, PASSES) | dict.fromkeys(_NON_MATCHING, FAILURE),
    paper.TWO_PASS: dict.fromkeys(_NON_MATCHING, FAILURE),
    paper.VTS_ME: dict.fromkeys(("b", "example-1"), PASSES) | dict.fromkeys(("c", "example-1bis"), FAILURE),
    paper.VTS_PPT: dict.fromkeys(("c", "example-1bis"), PASSES),
    paper.BASIC: {"c": PASSES},
}


@dataclass(frozen=True, slots=True, eq=False)
class _PassTable:
    """The largest error of a stress over the pressure, and what the paper says."""

    stress_error: Annotated[
        FloatArray, Column("formulation scene", "1", STRESS_ERROR, "NaN: Newton's method ended at no solution", np.nan)
    ]
    tolerance: Annotated[
        FloatArray, Column("scene", "1", "what roundoff explains: an error below it passes", CONDITION_TOLERANCE)
    ]
    printed: Annotated[IntArray, replace(PRINTED_COLUMN, dims="formulation scene")]
    formulations: Formulations = FORMULATIONS
    scene: Annotated[tuple[str, ...], Column("scene", WORDS, "scene, as on the command line")] = tuple(SCENES)

    @property
    def verdicts(self) -> np.ndarray:
        """The verdicts (n_formulations, n_scenes): pass, fail, between, or no solution."""
        conditions = [self.stress_error <= self.tolerance, self.stress_error > FAILS, np.isnan(self.stress_error)]
        return np.select(conditions, ["pass", "fail", "no solution"], "between")

    @property
    def same(self) -> np.ndarray:
        """True if the paper says the same (n_formulations, n_scenes); False also where it is silent."""
        same = np.where(self.printed == PASSES, self.verdicts == "pass", self.verdicts == "fail")
        return np.asarray(same & (self.printed != SILENT))


def _compute() -> _PassTable:
    errors = [[moderate_error(formulation, scene) for scene in SCENES] for formulation in FORMULATIONS]
    printed = [[PRINTED.get(formulation, {}).get(scene, SILENT) for scene in SCENES] for formulation in FORMULATIONS]
    scenes = map(catalogue.make_scene, SCENES)
    tolerances = np.array([condition_tolerance(scene, scene.penalty) for scene in scenes])
    return _PassTable(np.array(errors), tolerances, np.array(printed))


def _statements(table: _PassTable) -> Iterator[Statement]:
    spoken = table.printed != SILENT
    names = list(SCENES)
    wrong = [
        f"{FORMULATIONS[row].legend} on {names[column]}" for row, column in np.argwhere(spoken & ~table.same).tolist()
    ]
    result = f"{int(table.same.sum())} of {int(spoken.sum())} verdicts are the same"
    result += f"; others: {', '.join(wrong)}" if wrong else ""
    yield Statement(
        "Figs. 9–12, 17, 18, 21, 22, 32, 33, 35, 36",
        "NTS fails everywhere; NTS-AR passes where each slave segment faces one master segment; VTS-ME passes "
        "where each area of competence does; VTS-PPT passes C and Example 1bis; two-pass NTS-AR fails",
        result,
        Agreement.decide(not wrong),
    )
    between = int((table.verdicts == "between").sum())
    result = f"errors of the stress are at roundoff or above {FAILS:g} at ε̂ = 10 E/h; nothing lies between"
    if between:
        n_errors = table.stress_error.size
        result = f"{between} of {n_errors} errors of the stress lie between roundoff and {FAILS:g} at ε̂ = 10 E/h"
    yield Statement(
        "Sections 4, 5, 7.1",
        "no numbers are given for errors, materials, supports, heights or penalties of the patch tests",
        result,
        Agreement.SILENT,
    )


def _tables(table: _PassTable) -> Iterator[PageTable]:
    yield PageTable.of_cells(
        "Elastic patch tests of Sections 4, 5 and 7.1: largest error of a stress over the pressure",
        ("Formulation", *SCENES.values()),
        [
            (formulation.legend, [_cell(table, row, column) for column in range(len(SCENES))])
            for row, formulation in enumerate(FORMULATIONS)
        ],
    )


def _cell(table: _PassTable, row: int, column: int) -> Cell:
    word = str(table.verdicts[row, column])
    text = {"pass": "✓ pass", "fail": "✗ fail"}.get(word, word)
    if table.printed[row, column] != SILENT:
        text += " =" if table.same[row, column] else " ≠"
    tone = {"pass": "good", "fail": "bad"}.get(word, "")
    return Cell((text,), (number(float(table.stress_error[row, column]), 2),), f"row {tone}")


ITEM = Item(
    name="pass_table",
    title="Who passes the elastic patch test",
    compute=_compute,
    statements=_statements,
    attributes={"comment": f"elastic patch tests at the penalty 10 E/h; an error above {FAILS:g} fails"},
    tables=_tables,
    text="Largest error of a stress at a Gauss point over the pressure, at ε̂ = 10 E/h. Pass: roundoff, at most "
    f"{CONDITION_TOLERANCE} with κ = ε̂h/E and the smallest ratio r of two segments. Fail: above {FAILS:g}. “=” stands "
    "where the paper says the same, “≠” where it says otherwise; neither where it is silent.",
    choices={
        "Penalty of the pass/fail table": "ε̂ = 10 E/h with the mean slave segment h; NTS: ε = ε̂ h",
        "VTS-G": "two Gauss points on each slave segment",
    },
)
