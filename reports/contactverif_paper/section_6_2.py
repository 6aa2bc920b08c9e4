"""Section 6.2: the consistent tangent of VTS-PPT is exact, unsymmetric, and converges quadratically.

All is computed in the solution of Example 1bis with a foundation half as stiff as the punch and free sides: nothing is
exact after one step there, and no end of a segment lies on another, as in case C, where segment-to-segment has a kink.
A complex step tells whether K is the derivative; its error is roundoff alone.

Source: Zavarise & De Lorenzis (2009), Section 6.2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Annotated

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray, dense
from contactverif.mechanics import newton
from contactverif.mechanics.newton import Trace
from contactverif.problems import catalogue
from contactverif_paper.paper_columns import Column, Formulations
from contactverif_paper.paper_formulations import BASIC, STS, VTS_ME, VTS_PPT, PaperFormulation, measure, subject_of
from contactverif_paper.paper_item import Agreement, Item, Progress, Statement
from contactverif_reports.html.pages import number

FORMULATIONS = (VTS_ME, BASIC, VTS_PPT, STS)
SCENE = "example-1bis"
OPTIONS = {"ratio": 0.5, "pressure": 100.0, "penalty": 1e4, "lowered": 0.0, "sides": "free"}  # Here ε̂ = E.
DIRECTIONS = 8
ROUNDOFF = 1e-12  # The error of a complex step: a few hundred roundoffs of sums of a few dozen terms.
_TINY = 2.0**-100  # The length of a complex step; lengths are about 1, so it rounds nothing away.


@dataclass(frozen=True, slots=True, eq=False)
class Tangents:
    """Properties of the tangents in the solution."""

    # The largest difference over the largest entry of K d, over random d.
    error: Annotated[FloatArray, Column("formulation", "1", "difference of K d from a complex step, over K d")]
    asymmetry: Annotated[FloatArray, Column("formulation", "1", "largest entry of K − Kᵀ over that of K")]
    # Towards the solution; infinite if the step is exact.
    order: Annotated[FloatArray, Column("formulation", "1", "order of one Newton step", "NaN: not decided", np.nan)]
    # From the slave just touching to roundoff.
    iterations: Annotated[IntArray, Column("formulation", "1", "linear systems solved")]
    formulations: Formulations = FORMULATIONS


@cache
def tangents() -> Tangents:
    """Compute the tangents of VTS-ME, of both versions of VTS-PPT, and of segment-to-segment."""
    rows = np.array([_row(formulation) for formulation in FORMULATIONS])
    return Tangents(rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3].astype(np.int64))


def compute(report_progress: Progress) -> Tangents:
    """Compute the tangents."""
    report_progress("Section 6.2, tangents")
    return tangents()


def statements(result: Tangents) -> Iterator[Statement]:
    """Compare order and symmetry."""
    me, basic, ppt = (FORMULATIONS.index(row) for row in (VTS_ME, BASIC, VTS_PPT))
    yield Statement(
        "Section 6.2",
        "with the consistent tangent VTS-PPT converges quadratically",
        f"one Newton step is of order {result.order[ppt]:.2f}, with the basic tangent of order "
        f"{result.order[basic]:.2f}; the tangent differs from a complex step by {number(result.error[ppt], 2)}",
        Agreement.decide(result.order[ppt] >= 1.9 and result.error[ppt] <= ROUNDOFF),
        "fig30",
    )
    yield Statement(
        "Section 6.2",
        "the consistent tangent is unsymmetric",
        f"largest entry of K − Kᵀ over that of K: {number(result.asymmetry[ppt], 2)}; that of VTS-ME is "
        f"unsymmetric too, by {number(result.asymmetry[me], 2)}, since areas are measured in the current "
        "configuration",
        Agreement.decide(result.asymmetry[ppt] > ROUNDOFF),
    )


def _row(formulation: PaperFormulation) -> tuple[float, float, float, int]:
    scene = catalogue.make_scene(SCENE, **OPTIONS)
    plugin = subject_of(formulation).for_case(scene.case())
    trace = newton.solve(scene, plugin)
    z = trace.z
    pairing = plugin.pair(scene.interface, z)
    matrix = dense(plugin.tangent(scene.interface, pairing, z))
    directions = np.random.default_rng(0).uniform(-1.0, 1.0, (DIRECTIONS, z.size))
    exact = plugin.residual(scene.interface, pairing, z + 1j * _TINY * directions).imag / _TINY
    products = directions @ matrix.T
    error = float((np.abs(products - exact).max(axis=1) / np.abs(exact).max(axis=1)).max())
    asymmetry = float(np.abs(matrix - matrix.T).max() / np.abs(matrix).max())
    return error, asymmetry, _order(formulation, trace), trace.n_iterations


def _order(formulation: PaperFormulation, trace: Trace) -> float:
    """Return what the property `newton.order` measures on this scene; NaN if it decides nothing."""
    measurement = measure("newton.order", trace.scene.case(), formulation)
    if measurement is None or measurement.undecided:
        return np.nan
    return measurement.values.get("order of one Newton step", np.inf)


ITEM = Item(
    name="section_6_2",
    title="Section 6.2: the consistent tangent",
    compute=compute,
    statements=statements,
    attributes={"scene": SCENE, "comment": "in the solution, free sides, a master half as stiff as the slave"},
)
