"""Section 6.2: the consistent tangent of VTS-PPT is exact, unsymmetric, and converges quadratically.

All is computed in the solution of Example 1bis with a foundation half as stiff as the punch and free sides: nothing is
exact after one step there, and no end of a segment lies on another, as in case C, where segment-to-segment has a kink.
A complex step tells whether K is the derivative; its error is roundoff alone.

Source: Zavarise & De Lorenzis (2009), Section 6.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import xarray as xr

from contactverif.contract.arrays import FloatArray, IntArray, dense
from contactverif.contract.result import NotLoaded
from contactverif.mechanics import newton
from contactverif.mechanics.trace import Trace
from contactverif.problems import catalogue
from contactverif.run.judge import judge_case
from contactverif.run.registry import load_properties
from contactverif_paper import paper_formulations as formulations
from contactverif_paper.paper_formulations import PaperFormulation, name_variables, subject_of
from contactverif_paper.paper_item import Agreement, Item, Progress, Statement
from contactverif_reports.html.pages import number
from contactverif_reports.netcdf.variables import numbers

FORMULATIONS = (formulations.VTS_ME, formulations.BASIC, formulations.VTS_PPT, formulations.STS)
SCENE = "example-1bis"
OPTIONS = {"ratio": 0.5, "pressure": 100.0, "penalty": 1e4, "lowered": 0.0, "sides": "free"}  # Here ε̂ = E.
DIRECTIONS = 8
ROUNDOFF = 1e-12  # The error of a complex step: a few hundred roundoffs of sums of a few dozen terms.
_TINY = 2.0**-100  # The length of a complex step; lengths are about 1, so it rounds nothing away.


@dataclass(frozen=True, slots=True, eq=False)
class Tangents:
    """Properties of the tangents in the solution, each (n_formulations,)."""

    # (n_formulations,) Largest difference of K d from a complex step along d, over the largest entry of K d, over
    # random d.
    error: FloatArray
    asymmetry: FloatArray  # (n_formulations,) Largest entry of K − Kᵀ over that of K.
    # (n_formulations,) Order of one Newton step towards the solution; infinite if the step is exact, NaN if nothing
    # decides.
    order: FloatArray
    iterations: IntArray  # (n_formulations,) Linear systems solved from the slave just touching to roundoff.


@cache
def tangents() -> Tangents:
    """Compute the tangents of VTS-ME, of both versions of VTS-PPT, and of segment-to-segment."""
    rows = np.array([_row(formulation) for formulation in FORMULATIONS])
    return Tangents(rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3].astype(np.int64))


def compute(report_progress: Progress) -> Tangents:
    """Compute the tangents."""
    report_progress("Section 6.2, tangents")
    return tangents()


def statements(result: Tangents) -> tuple[Statement, ...]:
    """Compare order and symmetry."""
    me, basic, ppt = (
        FORMULATIONS.index(row) for row in (formulations.VTS_ME, formulations.BASIC, formulations.VTS_PPT)
    )
    return (
        Statement(
            "Section 6.2",
            "with the consistent tangent VTS-PPT converges quadratically",
            f"one Newton step is of order {result.order[ppt]:.2f}, with the basic tangent of order "
            f"{result.order[basic]:.2f}; the tangent differs from a complex step by {number(result.error[ppt], 2)}",
            Agreement.decide(result.order[ppt] >= 1.9 and result.error[ppt] <= ROUNDOFF),
            "fig30",
        ),
        Statement(
            "Section 6.2",
            "the consistent tangent is unsymmetric",
            f"largest entry of K − Kᵀ over that of K: {number(result.asymmetry[ppt], 2)}; that of VTS-ME is "
            f"unsymmetric too, by {number(result.asymmetry[me], 2)}, since areas are measured in the current "
            "configuration",
            Agreement.decide(result.asymmetry[ppt] > ROUNDOFF),
        ),
    )


def datasets(result: Tangents) -> dict[str, xr.Dataset]:
    """Return the properties of the tangents."""
    dims = ["formulation"]
    table = name_variables(FORMULATIONS) | {
        "error": numbers(dims, result.error, "difference of K d from a complex step, over K d", "1"),
        "asymmetry": numbers(dims, result.asymmetry, "largest entry of K − Kᵀ over that of K", "1"),
        "order": numbers(dims, result.order, "order of one Newton step", "1", "NaN: not decided", fill=np.nan),
        "iterations": numbers(dims, result.iterations.astype(np.int32), "linear systems solved", "1"),
    }
    comment = "in the solution, free sides, a master half as stiff as the slave"
    return {"": xr.Dataset(table, attrs={"scene": SCENE, "comment": comment})}


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
    (question,) = load_properties(["newton.order"])
    assert not isinstance(question, NotLoaded)
    measurement = judge_case(question, trace.scene.case(), subject_of(formulation)).measurement
    if measurement is None or measurement.undecided:
        return np.nan
    return measurement.values.get("order of one Newton step", np.inf)


ITEM = Item(
    name="section_6_2",
    title="Section 6.2: the consistent tangent",
    compute=compute,
    statements=statements,
    datasets=datasets,
)
