"""Section 7.1: NTS-AR does well on both examples although it fails, and different materials change nothing.

How large the errors are depends on the penalty, which the paper does not print. So the penalty up to which the first
claim holds is computed.

Source: Zavarise & De Lorenzis (2009), Section 7.1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from contactverif.problems import catalogue
from contactverif.problems.uniform_stress import condition_tolerance
from contactverif_paper import example_1, example_1bis
from contactverif_paper.paper_columns import WORDS, Column, name_columns
from contactverif_paper.paper_formulations import NTS, NTS_AR, TWO_PASS, VTS_PPT, PaperFormulation
from contactverif_paper.paper_item import Agreement, Item, Progress, Statement
from contactverif_paper.patch_solutions import PatchSetup, moderate_error, patch_solution, stiffness_limit
from contactverif_reports.html.pages import number

UNEQUAL = 10.0  # The stiffness of the other foundation over that of the punch.
_SETUPS = (example_1.PATCH, example_1bis.PATCH)
_COMPARED = (NTS_AR, NTS, TWO_PASS)
_UNEQUAL = "VTS-PPT on Example 1bis, the foundation ten times as stiff: error of the stress, and tolerance"


@dataclass(frozen=True, slots=True)
class Section71:
    """Errors on Examples 1 and 1bis."""

    departure: Annotated[
        tuple[tuple[float, ...], ...], Column("scene formulation", "1", "largest |p/p_exact − 1| of the figures")
    ]
    limit: Annotated[tuple[float, ...], Column("scene", "m-1", "penalty over E up to which NTS-AR departs least")]
    # Of NTS-AR and of two passes.
    stress_error: Annotated[tuple[float, float], Column("passes", "1", "Example 1: stress error at 10 E/h")]
    unequal: Annotated[tuple[float, float], Column("bound", "1", _UNEQUAL)]
    setups: Annotated[
        tuple[PatchSetup, ...], Column("scene", WORDS, "scene, as on the command line", part="scene", name="scene")
    ] = _SETUPS
    formulations: Annotated[tuple[PaperFormulation, ...], name_columns("formulation")[0]] = _COMPARED


def compute(report_progress: Progress) -> Section71:
    """Compute the errors, and the penalty up to which the claim holds."""
    report_progress("Section 7.1, over the penalty")
    patches = [patch_solution(setup) for setup in _SETUPS]
    scene = catalogue.make_scene("example-1bis", ratio=UNEQUAL)
    return Section71(
        tuple(tuple(patch.curve(formulation).departure for formulation in _COMPARED) for patch in patches),
        tuple(stiffness_limit(setup, areas_are_best) for setup in _SETUPS),
        (moderate_error(NTS_AR, "example-1"), moderate_error(TWO_PASS, "example-1")),
        (moderate_error(VTS_PPT, "example-1bis", UNEQUAL), condition_tolerance(scene, scene.penalty)),
    )


def areas_are_best(departure: dict[PaperFormulation, float]) -> bool:
    """Return whether NTS-AR departs least of NTS, NTS-AR and two passes."""
    return departure[NTS_AR] <= min(departure[NTS], departure[TWO_PASS])


def statements(section: Section71) -> Iterator[Statement]:
    """Compare both claims."""
    yield _quality_statement(section)
    yield _material_statement(section)


def _quality_statement(section: Section71) -> Statement:
    holds = all(row[0] <= min(row[1:]) for row in section.departure)
    single, double = section.stress_error
    rows = " and ".join(f"{ar:.2f} (NTS {nts:.2f}, two-pass {passes:.2f})" for ar, nts, passes in section.departure)
    limits = ", ".join(
        f"ε̂ ≤ {limit:.2f} E per unit of length in {setup.title}"
        for limit, setup in zip(section.limit, _SETUPS, strict=True)
    )
    return Statement(
        "Section 7.1",
        "Examples 1 and 1bis: NTS-AR fails, but does well beside NTS and two-pass NTS-AR",
        f"at the soft penalty of the figures pressures of NTS-AR depart by up to {rows}. At ε̂ = 10 E/h two passes have "
        f"the smaller error of the stress, {number(double, 2)} to {number(single, 2)} in "
        "Example 1",
        Agreement.decide(holds, always=single <= double),
        "fig33",
        limits,
    )


def _material_statement(section: Section71) -> Statement:
    error, tolerance = section.unequal
    return Statement(
        "Section 7.1",
        "punch and foundation of different materials would have a constant pressure too",
        f"VTS-PPT finds it on Example 1bis with a foundation {UNEQUAL:g} times as stiff: error of the stress "
        f"{number(error, 2)}",
        Agreement.decide(error <= tolerance),
    )


ITEM = Item(
    name="section_7_1", title="Section 7.1: what is said of both examples", compute=compute, statements=statements
)
