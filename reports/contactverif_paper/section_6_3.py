"""Section 6.3: terms and cost of the consistent tangent, of VTS-PPT and of segment-to-segment.

The paper counts terms of a formula. Here the terms are counted in the tangent itself: it is a sum of dyads a ⊗ b of the
tangential and normal vectors (t ⊗ t, t ⊗ n, n ⊗ t, n ⊗ n) for each pair of nodes, and a term is a coefficient that does
not vanish. The states are one slave segment with one virtual slave node over one, two and three master segments, all of
them bent and tilted. Cost is counted as entries of the sparse tangent on a long interface, and measured in seconds.

Source: Zavarise & De Lorenzis (2009), Section 6.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray, dense
from contactverif.contract.case import Case
from contactverif.contract.columns import Group
from contactverif.contract.interface import Interface
from contactverif.studies.comparison import make_state, measure_costs
from contactverif_paper.paper_columns import Column, Formulations, to_group
from contactverif_paper.paper_formulations import STS, VTS_ME, VTS_PPT, PaperFormulation, subject_of
from contactverif_paper.paper_item import Agreement, Cell, Item, PageTable, Progress, Statement
from contactverif_paper.section_6_2 import FORMULATIONS as TANGENT_FORMULATIONS
from contactverif_paper.section_6_2 import ROUNDOFF, Tangents, tangents
from contactverif_reports.html.pages import number

FORMULATIONS = (
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
class Terms:
    """The terms of each formulation."""

    terms: Annotated[IntArray, Column("formulation master", "1", _TERMS)]
    formulations: Formulations = FORMULATIONS


@dataclass(frozen=True, slots=True, eq=False)
class Cost:
    """The cost of each formulation, and measured times, on which no two runs agree."""

    entries: Annotated[FloatArray, Column("formulation ratio", "1", "entries of the tangent a slave segment")]
    residual: Annotated[FloatArray, Column("formulation ratio", "s", "time a slave segment")]
    tangent: Annotated[FloatArray, Column("formulation ratio", "s", "time a slave segment")]
    formulations: Formulations = TIMED
    ratio: Annotated[tuple[float, ...], Column("ratio", "1", "master segments for each slave segment")] = _RATIOS


@dataclass(frozen=True, slots=True, eq=False)
class Section63:
    """Terms and cost, and the tangents of Section 6.2."""

    terms: Terms
    cost: Cost
    tangents: Tangents


def compute(report_progress: Progress) -> Section63:
    """Count and measure."""
    report_progress("Section 6.3, terms and cost")
    terms = [[count_terms(formulation, master) for master in MASTERS.values()] for formulation in FORMULATIONS]
    cases = [make_state(_N_SEGMENTS, ratio, 0.4) for ratio in MESH_RATIOS.values()]
    entries = [[_entries(formulation, case) / _N_SEGMENTS for case in cases] for formulation in TIMED]
    costs = measure_costs([subject_of(formulation) for formulation in TIMED], cases)  # One case after the other.
    residual, tangent = (
        np.reshape([row.seconds[part] for row in costs], (len(cases), len(TIMED))).T / _N_SEGMENTS
        for part in ("residual", "tangent")
    )
    return Section63(Terms(np.array(terms)), Cost(np.array(entries), residual, tangent), tangents())


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


def statements(section: Section63) -> Iterator[Statement]:
    """Compare terms, feasibility and cost."""
    terms = section.terms.terms
    yield _feasible_statement(terms, section.tangents)
    yield _terms_statement(terms)
    yield _cost_statement(section.cost)


def _feasible_statement(terms: IntArray, result: Tangents) -> Statement:
    row = TANGENT_FORMULATIONS.index(STS)
    return Statement(
        "Section 6.3",
        f"an exact tangent of a segment-to-segment formulation is practically unfeasible, with up to {PRINTED_TERMS} "
        "vector product terms",
        f"the plugin sts has one, of at most {terms[-1].max()} terms for a slave segment when equal dyads are "
        f"collected: it differs from a complex step by {number(result.error[row], 2)}, a step of Newton’s method is of "
        f"order {result.order[row]:.2f}, and {result.iterations[row]} iterations solve Example 1bis. Each number of a "
        "point carries its derivatives along, so that no term is written by hand",
        Agreement.decide(not result.error[row] <= ROUNDOFF),
    )


def _terms_statement(terms: IntArray) -> Statement:
    standard, _, consistent, _ = terms
    holds = consistent == standard
    heads = [head for head, same in zip(MASTERS, holds, strict=True) if same]
    counts = "; ".join(f"{head}: {b} (standard: {a})" for head, a, b in zip(MASTERS, standard, consistent, strict=True))
    return Statement(
        "Section 6.3",
        "the consistent tangent of VTS-PPT needs as many terms as the standard formulation",
        f"terms for a virtual slave node whose area lies over {counts}",
        Agreement.decide(bool(holds.any()), always=bool(holds.all())),
        condition=f"the area of competence lies over {', '.join(heads)}",
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


def tables(section: Section63) -> Iterator[PageTable]:
    """Yield the tables of terms and of cost."""
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
        [(row.legend, *map(str, counts)) for row, counts in zip(FORMULATIONS, terms.tolist(), strict=True)],
    )
    yield PageTable(
        f"Cost for each of {_N_SEGMENTS} slave segments: entries of the tangent; below, measured times of a "
        "residual and of a tangent on this machine",
        ("Formulation", *(f"master {head}" for head in MESH_RATIOS)),
        tuple((Cell((row.legend,)), *its_cells) for row, its_cells in zip(TIMED, cells, strict=True)),
    )


def datasets(section: Section63) -> dict[str, Group]:
    """Return the counts, and the times in a group of their own."""
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


ITEM = Item(
    name="section_6_3",
    title="Section 6.3: terms and cost",
    compute=compute,
    statements=statements,
    datasets=datasets,
    tables=tables,
)
