"""Section 6.3: terms and cost of the consistent tangent, of VTS-PPT and of segment-to-segment.

The paper counts terms of a formula. Here the terms are counted in the tangent itself: it is a sum of dyads a ⊗ b of the
tangential and normal vectors (t ⊗ t, t ⊗ n, n ⊗ t, n ⊗ n) for each pair of nodes, and a term is a coefficient that does
not vanish. The states are one slave segment with one virtual slave node over one, two and three master segments, all of
them bent and tilted. Cost is counted as entries of the sparse tangent on a long interface, and measured in seconds.

Source: Zavarise & De Lorenzis (2009), Section 6.3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from contactverif.contract.arrays import FloatArray, IntArray, dense
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.studies.evaluation_cost import measure_costs
from contactverif_paper import paper_formulations as formulations
from contactverif_paper.paper_formulations import PaperFormulation, name_variables, subject_of
from contactverif_paper.paper_item import Agreement, Cell, Item, PageTable, Progress, Statement
from contactverif_paper.section_6_2 import FORMULATIONS as TANGENT_FORMULATIONS
from contactverif_paper.section_6_2 import ROUNDOFF, Tangents, tangents
from contactverif_reports.html.pages import number
from contactverif_reports.netcdf.variables import numbers

FORMULATIONS = (
    PaperFormulation("VTS-ME", "vts-me:n=1"),
    PaperFormulation("VTS-PPT basic", "vts-ppt-basic:n=1"),
    PaperFormulation("VTS-PPT", "vts-ppt:n=1"),
    PaperFormulation("segment-to-segment", "sts"),
)
TIMED = (formulations.VTS_ME, formulations.VTS_PPT, formulations.STS)
PRINTED_TERMS = 392  # The paper's count for the exact tangent of segment-to-segment.
MASTERS: Mapping[str, tuple[tuple[float, float], ...]] = {  # {head of a column: nodes of the master}
    "1 segment": ((2.3, 0.02), (-0.4, -0.03)),
    "2 segments": ((2.3, 0.02), (0.9, 0.03), (-0.4, -0.03)),
    "3 segments": ((2.3, 0.02), (1.3, 0.03), (0.6, 0.01), (-0.4, -0.03)),
}
SLAVE = ((0.0, -0.11), (1.9, -0.17))
MESH_RATIOS: Mapping[str, float] = {"coarser": 0.5, "as fine": 1.0, "finer": 2.0}  # Master segments a slave segment.
PENALTY = 16.0
_N_SEGMENTS = 64  # Slave segments of the interface on which cost is counted.
_VANISHES = 1e-12  # A coefficient below this share of the largest one is zero.


@dataclass(frozen=True, slots=True, eq=False)
class Cost:
    """Terms and cost."""

    # (n_formulations, n_masters) Coefficients of dyads in the tangent of one slave segment, for each of `FORMULATIONS`
    # and `MASTERS`.
    terms: IntArray
    # (n_timed, n_ratios) Entries of the tangent that do not vanish, for each slave segment, of `TIMED` and
    # `MESH_RATIOS`.
    entries: FloatArray
    seconds: FloatArray  # (n_timed, n_ratios, 2) Measured time of a residual and of a tangent, for each slave segment.
    tangents: Tangents  # The tangents of Section 6.2.


def compute(report_progress: Progress) -> Cost:
    """Count and measure."""
    report_progress("Section 6.3, terms and cost")
    terms = [[count_terms(formulation, master) for master in MASTERS.values()] for formulation in FORMULATIONS]
    cases = [long_interface(ratio) for ratio in MESH_RATIOS.values()]
    entries = [[_entries(formulation, case) / _N_SEGMENTS for case in cases] for formulation in TIMED]
    costs = measure_costs([subject_of(formulation) for formulation in TIMED], cases)
    seconds = np.array([[row.seconds["residual"], row.seconds["tangent"]] for row in costs]) / _N_SEGMENTS
    by_formulation = seconds.reshape(len(cases), len(TIMED), 2).swapaxes(0, 1)
    return Cost(np.array(terms, dtype=np.int64), np.array(entries), by_formulation, tangents())


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


def long_interface(ratio: float) -> Case:
    """Return a flat interface of unit slave segments with `ratio` master segments for each, all of it in contact."""
    n_master = max(1, round(_N_SEGMENTS * ratio))
    slave_x = np.arange(_N_SEGMENTS + 1.0)
    master_x = np.linspace(-0.4, _N_SEGMENTS + 0.6, n_master + 1)[::-1]
    upper, lower = (np.column_stack([x, np.zeros_like(x)]) for x in (slave_x, master_x))
    interface = Interface.from_chains(upper, lower)
    upper[:, 1] = -(1 + slave_x % 3) / 64
    return Case(interface, np.vstack([upper, lower]).reshape(-1), penalty=PENALTY)


def statements(cost: Cost) -> tuple[Statement, ...]:
    """Compare terms, feasibility and cost."""
    return _feasible_statement(cost), _terms_statement(cost), _cost_statement(cost)


def _feasible_statement(cost: Cost) -> Statement:
    row, result = TANGENT_FORMULATIONS.index(formulations.STS), cost.tangents
    return Statement(
        "Section 6.3",
        f"an exact tangent of a segment-to-segment formulation is practically unfeasible, with up to {PRINTED_TERMS} "
        "vector product terms",
        f"the plugin sts has one, of at most {cost.terms[-1].max()} terms for a slave segment when equal dyads are "
        f"collected: it differs from a complex step by {number(result.error[row], 2)}, a step of Newton’s method is of "
        f"order {result.order[row]:.2f}, and {result.iterations[row]} iterations solve Example 1bis. Each number of a "
        "point carries its derivatives along, so that no term is written by hand",
        Agreement.decide(not result.error[row] <= ROUNDOFF),
    )


def _terms_statement(cost: Cost) -> Statement:
    standard, _, consistent, _ = cost.terms
    holds = consistent == standard
    agreement = Agreement.CONDITIONAL if holds.any() and not holds.all() else Agreement.decide(bool(holds.all()))
    heads = [head for head, same in zip(MASTERS, holds, strict=True) if same]
    counts = "; ".join(f"{head}: {b} (standard: {a})" for head, a, b in zip(MASTERS, standard, consistent, strict=True))
    return Statement(
        "Section 6.3",
        "the consistent tangent of VTS-PPT needs as many terms as the standard formulation",
        f"terms for a virtual slave node whose area lies over {counts}",
        agreement,
        "",
        f"the area of competence lies over {', '.join(heads)}" if agreement is Agreement.CONDITIONAL else "",
    )


def _cost_statement(cost: Cost) -> Statement:
    standard, consistent, _ = cost.entries
    ratios = consistent / standard
    ratio_words = ", ".join(f"{ratio:.2f} ({head})" for head, ratio in zip(MESH_RATIOS, ratios, strict=True))
    return Statement(
        "Section 6.3",
        "the cost stays reasonable, above all where the master is as fine as the slave or coarser",
        f"entries of the tangent of VTS-PPT over those of VTS-ME, by how fine the master is: {ratio_words}; the page "
        "has measured times",
        Agreement.decide(bool(ratios[0] <= ratios[1] <= ratios[2] and ratios[1] <= 2)),
    )


def tables(cost: Cost) -> tuple[PageTable, ...]:
    """Return the tables of terms and of cost."""
    terms = tuple(
        (Cell((row.legend,)), *(Cell((str(count),), tone="n") for count in counts))
        for row, counts in zip(FORMULATIONS, cost.terms.tolist(), strict=True)
    )
    costs = tuple(
        (
            Cell((row.legend,)),
            *(
                Cell((f"{entries:.1f}",), (f"{1e6 * seconds[0]:.2f} µs, {1e6 * seconds[1]:.2f} µs",), "n")
                for entries, seconds in zip(cost.entries[index], cost.seconds[index], strict=True)
            ),
        )
        for index, row in enumerate(TIMED)
    )
    return (
        PageTable(
            "Terms of the tangent: coefficients of dyads of t and n for one slave segment with one virtual slave node "
            "(segment-to-segment: all of it), by master segments under it",
            ("Formulation", *MASTERS),
            terms,
        ),
        PageTable(
            f"Cost for each of {_N_SEGMENTS} slave segments: entries of the tangent; below, measured times of a "
            "residual and of a tangent on this machine",
            ("Formulation", *(f"master {head}" for head in MESH_RATIOS)),
            costs,
        ),
    )


def datasets(cost: Cost) -> dict[str, xr.Dataset]:
    """Return the counts; measured times are in a group of their own, since no two runs agree on them."""
    counts = name_variables(FORMULATIONS) | {
        "terms": numbers(
            ["formulation", "master"],
            cost.terms.astype(np.int32),
            "coefficients of dyads in the tangent of one slave segment, over 1, 2 and 3 master segments",
            "1",
        )
    }
    ratio = numbers(["ratio"], list(MESH_RATIOS.values()), "master segments for each slave segment", "1")
    entries = name_variables(TIMED) | {
        "ratio": ratio,
        "entries": numbers(["formulation", "ratio"], cost.entries, "entries of the tangent a slave segment", "1"),
    }
    timing = name_variables(TIMED) | {
        "ratio": ratio,
        "residual": numbers(["formulation", "ratio"], cost.seconds[..., 0], "time a slave segment", "s"),
        "tangent": numbers(["formulation", "ratio"], cost.seconds[..., 1], "time a slave segment", "s"),
    }
    return {"terms": xr.Dataset(counts), "cost": xr.Dataset(entries), "timing": xr.Dataset(timing)}


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


ITEM = Item(
    name="section_6_3",
    title="Section 6.3: terms and cost",
    compute=compute,
    statements=statements,
    datasets=datasets,
    tables=tables,
)
