"""Section 7.1: NTS-AR does well on both examples although it fails, and different materials change nothing.

How large the errors are depends on the penalty, which the paper does not print. So the penalty up to which the first
claim holds is computed.

Source: Zavarise & De Lorenzis (2009), Section 7.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import xarray as xr

from contactverif.problems import catalogue
from contactverif.problems.uniform_stress import condition_tolerance
from contactverif_paper import example_1, example_1bis
from contactverif_paper import paper_formulations as formulations
from contactverif_paper.paper_formulations import PaperFormulation
from contactverif_paper.paper_item import Agreement, Item, Progress, Statement
from contactverif_paper.patch_solutions import moderate_error, patch_solution, stiffness_limit
from contactverif_reports.html.pages import number
from contactverif_reports.netcdf.variables import numbers, words

UNEQUAL = 10.0  # The stiffness of the other foundation over that of the punch.
_SETUPS = (example_1.PATCH, example_1bis.PATCH)
_COMPARED = (formulations.NTS_AR, formulations.NTS, formulations.TWO_PASS)


@dataclass(frozen=True, slots=True)
class Section71:
    """Errors on Examples 1 and 1bis."""

    # The largest |p/p_exact − 1| at the penalty of the figures: (example, formulation) with NTS-AR first.
    departures: tuple[tuple[float, ...], ...]
    # For each example the ε̂/E up to which NTS-AR is the best of the three, per unit of length.
    limits: tuple[float, ...]
    moderate_one: float  # Stress errors of NTS-AR and of two passes on Example 1 at ε̂ = 10 E/h.
    moderate_two: float
    unequal_error: float  # Stress error of VTS-PPT on Example 1bis with the other foundation, and its roundoff.
    tolerance: float


def compute(report_progress: Progress) -> Section71:
    """Compute the errors, and the penalty up to which the claim holds."""
    report_progress("Section 7.1, over the penalty")
    patches = [patch_solution(setup) for setup in _SETUPS]
    scene = catalogue.make_scene("example-1bis", ratio=UNEQUAL)
    return Section71(
        tuple(tuple(patch.curve(formulation).departure for formulation in _COMPARED) for patch in patches),
        tuple(stiffness_limit(setup, areas_are_best) for setup in _SETUPS),
        moderate_error(formulations.NTS_AR, "example-1"),
        moderate_error(formulations.TWO_PASS, "example-1"),
        moderate_error(formulations.VTS_PPT, "example-1bis", UNEQUAL),
        condition_tolerance(scene, scene.penalty),
    )


def areas_are_best(departure: dict[PaperFormulation, float]) -> bool:
    """Return whether NTS-AR departs least of NTS, NTS-AR and two passes."""
    return departure[formulations.NTS_AR] <= min(departure[formulations.NTS], departure[formulations.TWO_PASS])


def statements(section: Section71) -> tuple[Statement, ...]:
    """Compare both claims."""
    return _quality_statement(section), _material_statement(section)


def _quality_statement(section: Section71) -> Statement:
    holds = all(row[0] <= min(row[1:]) for row in section.departures)
    always = section.moderate_one <= section.moderate_two
    agreement = Agreement.CONDITIONAL if holds and not always else Agreement.decide(holds)
    rows = " and ".join(f"{ar:.2f} (NTS {nts:.2f}, two-pass {two:.2f})" for ar, nts, two in section.departures)
    limits = ", ".join(
        f"ε̂ ≤ {limit:.2f} E per unit of length in {setup.title}"
        for limit, setup in zip(section.limits, _SETUPS, strict=True)
    )
    return Statement(
        "Section 7.1",
        "Examples 1 and 1bis: NTS-AR fails, but does well beside NTS and two-pass NTS-AR",
        f"at the soft penalty of the figures pressures of NTS-AR depart by up to {rows}. At ε̂ = 10 E/h two passes have "
        f"the smaller error of the stress, {number(section.moderate_two, 2)} to {number(section.moderate_one, 2)} in "
        "Example 1",
        agreement,
        "fig33",
        limits if agreement is Agreement.CONDITIONAL else "",
    )


def _material_statement(section: Section71) -> Statement:
    return Statement(
        "Section 7.1",
        "punch and foundation of different materials would have a constant pressure too",
        f"VTS-PPT finds it on Example 1bis with a foundation {UNEQUAL:g} times as stiff: error of the stress "
        f"{number(section.unequal_error, 2)}",
        Agreement.decide(section.unequal_error <= section.tolerance),
    )


def datasets(section: Section71) -> dict[str, xr.Dataset]:
    """Return the errors."""
    names = words(["scene"], [setup.scene for setup in _SETUPS], "scene, as on the command line")
    compared = words(["formulation"], [row.name for row in _COMPARED], "formulation, as on the command line")
    departures = numbers(["scene", "formulation"], section.departures, "largest |p/p_exact − 1| of the figures", "1")
    return {
        "": xr.Dataset(
            {
                "scene": names,
                "formulation": compared,
                "departure": departures,
                "limit": numbers(["scene"], section.limits, "penalty over E up to which NTS-AR departs least", "m-1"),
                "stress_error": numbers(
                    ["passes"], [section.moderate_one, section.moderate_two], "Example 1: stress error at 10 E/h", "1"
                ),
                "unequal": numbers(
                    ["bound"],
                    [section.unequal_error, section.tolerance],
                    "VTS-PPT on Example 1bis, the foundation ten times as stiff: error of the stress, and tolerance",
                    "1",
                ),
            }
        )
    }


ITEM = Item(
    name="section_7_1",
    title="Section 7.1: what is said of both examples",
    compute=compute,
    statements=statements,
    datasets=datasets,
)
