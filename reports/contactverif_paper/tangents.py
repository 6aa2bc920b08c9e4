"""Sections 6.2 and 6.3: the consistent tangent of VTS-PPT is exact and unsymmetric; its terms and its cost.

Exactness and order are computed in the solution of Example 1bis with a foundation half as stiff as the punch and free
sides: nothing is exact after one step there, and no end of a segment lies on another, as in case C, where
segment-to-segment has a kink. A complex step tells whether K is the derivative; its error is roundoff alone.

The paper counts terms of a formula. Here the terms are counted in the tangent itself: it is a sum of dyads a ⊗ b of the
tangential and normal vectors (t ⊗ t, t ⊗ n, n ⊗ t, n ⊗ n) for each pair of nodes, and a term is a coefficient that does
not vanish. The states are one slave segment with one virtual slave node over one, two and three master segments, all of
them bent and tilted. Cost is counted as entries of the sparse tangent on a long interface, and measured in seconds.

Source: Zavarise & De Lorenzis (2009), Sections 6.2 and 6.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray, dense
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.contract.schema import Group
from contactverif.mechanics import newton
from contactverif.mechanics.newton import Trace
from contactverif.problems import catalogue
from contactverif.studies.comparison import make_state, measure_costs
from contactverif_paper.paper_columns import Column, Formulations, to_group
from contactverif_paper.paper_formulations import BASIC, STS, VTS_ME, VTS_PPT, PaperFormulation, measure, subject_of
from contactverif_paper.paper_item import Agreement, Cell, Item, PageTable, Progress, Statement
from contactverif_reports.html.pages import number

TANGENT_FORMULATIONS = (VTS_ME, BASIC, VTS_PPT, STS)
SCENE = "example-1bis"
OPTIONS = {"ratio": 0.5, "pressure": 100.0, "penalty": 1e4, "lowered": 0.0, "sides": "free"}  # Here ε̂ = E.
DIRECTIONS = 8
ROUNDOFF = 1e-12  # The error of a complex step: a few hundred roundoffs of sums of a few dozen terms.
_TINY = 2.0**-100  # The length of a complex step; lengths are about 1, so it rounds nothing away.


@dataclass(frozen=True, slots=True, eq=False)
class _Tangents:
    """Properties of the tangents in the solution."""

    # The largest difference over the largest entry of K d, over random d.
    error: Annotated[FloatArray, Column("formulation", "1", "difference of K d from a complex step, over K d")]
    asymmetry: Annotated[FloatArray, Column("formulation", "1", "largest entry of K − Kᵀ over that of K")]
    # Towards the solution; infinite if the step is exact.
    order: Annotated[FloatArray, Column("formulation", "1", "order of one Newton step", "NaN: not decided", np.nan)]
    # From the slave just touching to roundoff.
    iterations: Annotated[IntArray, Column("formulation", "1", "linear systems solved")]
    formulations: Formulations = TANGENT_FORMULATIONS


@cache
def tangents() -> _Tangents:
    """Compute the tangents of VTS-ME, of both versions of VTS-PPT, and of segment-to-segment."""
    rows = np.array([_tangent_row(formulation) for formulation in TANGENT_FORMULATIONS])
    return _Tangents(rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3].astype(np.int64))


def _compute_tangents(report_progress: Progress) -> _Tangents:
    report_progress("Section 6.2, tangents")
    return tangents()


def _tangent_statements(result: _Tangents) -> Iterator[Statement]:
    me, basic, ppt = (TANGENT_FORMULATIONS.index(row) for row in (VTS_ME, BASIC, VTS_PPT))
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


def _tangent_row(formulation: PaperFormulation) -> tuple[float, float, float, int]:
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


SECTION_6_2 = Item(
    name="section_6_2",
    title="Section 6.2: the consistent tangent",
    compute=_compute_tangents,
    statements=_tangent_statements,
    attributes={"scene": SCENE, "comment": "in the solution, free sides, a master half as stiff as the slave"},
)


TERM_FORMULATIONS = (
    PaperFormulation("VTS-ME", "vts-me:n=1"),
    PaperFormulation("VTS-PPT basic", "vts-ppt-basic:n=1"),
    PaperFormulation("VTS-PPT", "vts-ppt:n=1"),
    PaperFormulation("segment-to-segment", "sts"),
)
TIMED = (VTS_ME, VTS_PPT, STS)
PRINTED_TERMS = 392  # The paper's count for the exact tangent of segment-to-segment.
MASTERS: Mapping[str, tuple[tuple[float, float], ...]] = {  # {head of a column: nodes of the master}
    "1 segment": ((2.3, 0.02), (-0.4, -0.03)),
    "2 segments": ((2.3, 0.02), (0.9, 0.03), (-0.4, -0.03)),
    "3 segments": ((2.3, 0.02), (1.3, 0.03), (0.6, 0.01), (-0.4, -0.03)),
}
SLAVE = ((0.0, -0.11), (1.9, -0.17))
MESH_RATIOS: Mapping[str, float] = {"coarser": 0.5, "as fine": 1.0, "finer": 2.0}  # Master segments a slave segment.
_RATIOS = tuple(MESH_RATIOS.values())
PENALTY = 16.0
_N_SEGMENTS = 64  # Slave segments of the interface on which cost is counted.
_TERMS = "coefficients of dyads in the tangent of one slave segment, over 1, 2 and 3 master segments"
_VANISHES = 1e-12  # A coefficient below this share of the largest one is zero.


@dataclass(frozen=True, slots=True, eq=False)
class _Terms:
    """The terms of each formulation."""

    terms: Annotated[IntArray, Column("formulation master", "1", _TERMS)]
    formulations: Formulations = TERM_FORMULATIONS


@dataclass(frozen=True, slots=True, eq=False)
class _Cost:
    """The cost of each formulation, and measured times, on which no two runs agree."""

    entries: Annotated[FloatArray, Column("formulation ratio", "1", "entries of the tangent a slave segment")]
    residual: Annotated[FloatArray, Column("formulation ratio", "s", "time a slave segment")]
    tangent: Annotated[FloatArray, Column("formulation ratio", "s", "time a slave segment")]
    formulations: Formulations = TIMED
    ratio: Annotated[tuple[float, ...], Column("ratio", "1", "master segments for each slave segment")] = _RATIOS


@dataclass(frozen=True, slots=True, eq=False)
class _Section63:
    """Terms and cost, and the tangents of Section 6.2."""

    terms: _Terms
    cost: _Cost
    tangents: _Tangents


def _compute_cost(report_progress: Progress) -> _Section63:
    report_progress("Section 6.3, terms and cost")
    terms = [[count_terms(formulation, master) for master in MASTERS.values()] for formulation in TERM_FORMULATIONS]
    cases = [make_state(_N_SEGMENTS, ratio, 0.4) for ratio in MESH_RATIOS.values()]
    entries = [[_entries(formulation, case) / _N_SEGMENTS for case in cases] for formulation in TIMED]
    costs = measure_costs([subject_of(formulation) for formulation in TIMED], cases)  # One case after the other.
    residual, tangent = (
        np.reshape([row.seconds[part] for row in costs], (len(cases), len(TIMED))).T / _N_SEGMENTS
        for part in ("residual", "tangent")
    )
    return _Section63(_Terms(np.array(terms)), _Cost(np.array(entries), residual, tangent), tangents())


def count_terms(formulation: PaperFormulation, master: tuple[tuple[float, float], ...]) -> int:
    """Return the number of coefficients of dyads that do not vanish, in the frame of the middle master segment."""
    x = np.vstack([SLAVE, master])
    interface = Interface.from_chains(x[:2] * [1.0, 0.0], x[2:] * [1.0, 0.0])
    plugin, z = subject_of(formulation).with_penalty(PENALTY), x.reshape(-1)
    tangent = dense(plugin.tangent(interface, plugin.pair(interface, z), z))
    frame = _frame(formulation, x)
    n_nodes = len(x)
    blocks = np.einsum("ai,minj,bj->manb", frame, tangent.reshape(n_nodes, 2, n_nodes, 2), frame)
    return int((np.abs(blocks) > _VANISHES * np.abs(blocks).max()).sum())


def _cost_statements(section: _Section63) -> Iterator[Statement]:
    terms, cost, result = section.terms.terms, section.cost, section.tangents
    row = TANGENT_FORMULATIONS.index(STS)
    yield Statement(
        "Section 6.3",
        f"an exact tangent of a segment-to-segment formulation is practically unfeasible, with up to {PRINTED_TERMS} "
        "vector product terms",
        f"the plugin sts has one, of at most {terms[-1].max()} terms for a slave segment when equal dyads are "
        f"collected: it differs from a complex step by {number(result.error[row], 2)}, a step of Newton’s method is of "
        f"order {result.order[row]:.2f}, and {result.iterations[row]} iterations solve Example 1bis. Each number of a "
        "point carries its derivatives along, so that no term is written by hand",
        Agreement.decide(not result.error[row] <= ROUNDOFF),
    )
    standard, _, consistent, _ = terms
    holds = consistent == standard
    heads = [head for head, same in zip(MASTERS, holds, strict=True) if same]
    counts = "; ".join(f"{head}: {b} (standard: {a})" for head, a, b in zip(MASTERS, standard, consistent, strict=True))
    yield Statement(
        "Section 6.3",
        "the consistent tangent of VTS-PPT needs as many terms as the standard formulation",
        f"terms for a virtual slave node whose area lies over {counts}",
        Agreement.decide(bool(holds.any()), always=bool(holds.all())),
        condition=f"the area of competence lies over {', '.join(heads)}",
    )
    ratios = cost.entries[TIMED.index(VTS_PPT)] / cost.entries[TIMED.index(VTS_ME)]
    ratio_words = ", ".join(f"{ratio:.2f} ({head})" for head, ratio in zip(MESH_RATIOS, ratios, strict=True))
    yield Statement(
        "Section 6.3",
        "the cost stays reasonable, above all where the master is as fine as the slave or coarser",
        f"entries of the tangent of VTS-PPT over those of VTS-ME, by how fine the master is: {ratio_words}; the page "
        "has measured times",
        Agreement.decide(bool(ratios[0] <= ratios[1] <= ratios[2] and ratios[1] <= 2)),
    )


def _cost_tables(section: _Section63) -> Iterator[PageTable]:
    cost, terms = section.cost, section.terms.terms
    microseconds = np.stack([1e6 * cost.residual, 1e6 * cost.tangent], axis=-1)
    cells = [
        tuple(
            Cell((f"{entries:.1f}",), (f"{times[0]:.2f} µs, {times[1]:.2f} µs",), "n")
            for entries, times in zip(*row, strict=True)
        )
        for row in zip(cost.entries, microseconds, strict=True)
    ]
    yield PageTable.of_numbers(
        "Terms of the tangent: coefficients of dyads of t and n for one slave segment with one virtual slave node "
        "(segment-to-segment: all of it), by master segments under it",
        ("Formulation", *MASTERS),
        [(row.legend, *map(str, counts)) for row, counts in zip(TERM_FORMULATIONS, terms.tolist(), strict=True)],
    )
    yield PageTable(
        f"Cost for each of {_N_SEGMENTS} slave segments: entries of the tangent; below, measured times of a "
        "residual and of a tangent on this machine",
        ("Formulation", *(f"master {head}" for head in MESH_RATIOS)),
        tuple((Cell((row.legend,)), *its_cells) for row, its_cells in zip(TIMED, cells, strict=True)),
    )


def _cost_datasets(section: _Section63) -> dict[str, Group]:
    cost = to_group(section.cost)
    return {
        "terms": to_group(section.terms),
        "cost": Group({name: cost[name] for name in cost if name not in ("residual", "tangent")}, cost.attrs),
        "timing": Group({name: cost[name] for name in cost if name != "entries"}, cost.attrs),
    }


def _frame(formulation: PaperFormulation, x: FloatArray) -> FloatArray:
    """Return t and n (2, 2) of the segment whose frame the formulation uses."""
    if formulation.name == "sts":  # It works in the frame of the slave segment.
        chord = x[1] - x[0]
    else:
        middle = x[:2].mean(axis=0)
        first = next(i for i in range(2, len(x) - 1) if x[i + 1, 0] <= middle[0] <= x[i, 0])
        chord = x[first + 1] - x[first]
    t = chord / np.hypot(*chord)
    return np.array([t, [t[1], -t[0]]])


def _entries(formulation: PaperFormulation, case: Case) -> int:
    plugin = subject_of(formulation).with_penalty(case.penalty)
    tangent = dense(plugin.tangent(case.interface, plugin.pair(case.interface, case.z), case.z))
    return int((np.abs(tangent) > _VANISHES * np.abs(tangent).max()).sum())


SECTION_6_3 = Item(
    name="section_6_3",
    title="Section 6.3: terms and cost",
    compute=_compute_cost,
    statements=_cost_statements,
    datasets=_cost_datasets,
    tables=_cost_tables,
)
