"""Section 5.1.3: with a penalty, two passes of NTS-AR are no better than one on case B.

How large both errors are depends on the penalty, which the paper does not print. So the claim is checked at the soft
penalty of Fig. 18 and at the moderate one, and the penalty up to which it holds is computed.

Source: Zavarise & De Lorenzis (2009), Section 5.1.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import xarray as xr

from contactverif_paper import case_b
from contactverif_paper import paper_formulations as formulations
from contactverif_paper.paper_formulations import PaperFormulation
from contactverif_paper.paper_item import Agreement, Item, Progress, Statement
from contactverif_paper.patch_solutions import moderate_error, patch_solution, stiffness_limit
from contactverif_reports.netcdf.variables import numbers


@dataclass(frozen=True, slots=True)
class TwoPasses:
    """Errors of one and of two passes on case B."""

    one_pass: float  # The largest |p/p_exact − 1| at the penalty of Fig. 18.
    two_passes: float
    moderate_one_pass: float  # The stress errors at ε̂ = 10 E/h, over the pressure.
    moderate_two_passes: float
    limit: float  # The ε̂/E up to which two passes are no better, per unit of length.


def compute(report_progress: Progress) -> TwoPasses:
    """Compute the errors, and the penalty up to which the claim holds."""
    report_progress("Section 5.1.3, over the penalty")
    patch = patch_solution(case_b.PATCH)
    return TwoPasses(
        patch.curve(formulations.NTS_AR).departure,
        patch.curve(formulations.TWO_PASS).departure,
        moderate_error(formulations.NTS_AR, "b"),
        moderate_error(formulations.TWO_PASS, "b"),
        stiffness_limit(case_b.PATCH, two_passes_are_no_better),
    )


def two_passes_are_no_better(departure: dict[PaperFormulation, float]) -> bool:
    """Return whether the pressures of two passes depart at least as far as those of one."""
    return departure[formulations.TWO_PASS] >= departure[formulations.NTS_AR]


def statements(errors: TwoPasses) -> tuple[Statement, ...]:
    """Say up to which penalty the claim holds."""
    holds, always = errors.two_passes >= errors.one_pass, errors.moderate_two_passes >= errors.moderate_one_pass
    agreement = Agreement.CONDITIONAL if holds and not always else Agreement.decide(holds)
    condition = f"ε̂ ≤ {errors.limit:.2f} E per unit of length" if agreement is Agreement.CONDITIONAL else ""
    return (
        Statement(
            "Section 5.1.3",
            "case B: two passes with a penalty do not come nearer than one",
            f"at the soft penalty of Fig. 18 pressures depart by up to {errors.two_passes:.2f} from the exact one with "
            f"two passes and by {errors.one_pass:.2f} with one. At ε̂ = 10 E/h the error of the stress is "
            f"{errors.moderate_one_pass / errors.moderate_two_passes:.0f} times smaller with two, which lock",
            agreement,
            "fig18",
            condition,
        ),
    )


def datasets(errors: TwoPasses) -> dict[str, xr.Dataset]:
    """Return the errors."""
    return {
        "": xr.Dataset(
            {
                "departure": numbers(
                    ["passes"], [errors.one_pass, errors.two_passes], "largest |p/p_exact − 1|, Fig. 18", "1"
                ),
                "stress_error": numbers(
                    ["passes"], [errors.moderate_one_pass, errors.moderate_two_passes], "stress error at 10 E/h", "1"
                ),
                "limit": numbers([], errors.limit, "penalty over E up to which two passes are no better", "m-1"),
            }
        )
    }


ITEM = Item(
    name="section_5_1_3",
    title="Section 5.1.3: one pass and two",
    compute=compute,
    statements=statements,
    datasets=datasets,
)
