"""Section 5.1.3: with a penalty, two passes of NTS-AR are no better than one on case B.

How large both errors are depends on the penalty, which the paper does not print. So the claim is checked at the soft
penalty of Fig. 18 and at the moderate one, and the penalty up to which it holds is computed.

Source: Zavarise & De Lorenzis (2009), Section 5.1.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from contactverif_paper import case_b
from contactverif_paper.paper_columns import Column
from contactverif_paper.paper_formulations import NTS_AR, TWO_PASS, PaperFormulation
from contactverif_paper.paper_item import Agreement, Item, Progress, Statement
from contactverif_paper.patch_solutions import moderate_error, patch_solution, stiffness_limit


@dataclass(frozen=True, slots=True)
class TwoPasses:
    """Errors of one and of two passes on case B."""

    departure: Annotated[tuple[float, float], Column("passes", "1", "largest |p/p_exact − 1|, Fig. 18")]
    stress_error: Annotated[tuple[float, float], Column("passes", "1", "stress error at 10 E/h")]
    limit: Annotated[float, Column("", "m-1", "penalty over E up to which two passes are no better")]


def compute(report_progress: Progress) -> TwoPasses:
    """Compute the errors, and the penalty up to which the claim holds."""
    report_progress("Section 5.1.3, over the penalty")
    patch = patch_solution(case_b.PATCH)
    passes = (NTS_AR, TWO_PASS)
    single, double = (patch.curve(row).departure for row in passes)
    moderate_one, moderate_two = (moderate_error(row, "b") for row in passes)
    limit = stiffness_limit(case_b.PATCH, two_passes_are_no_better)
    return TwoPasses((single, double), (moderate_one, moderate_two), limit)


def two_passes_are_no_better(departure: dict[PaperFormulation, float]) -> bool:
    """Return whether the pressures of two passes depart at least as far as those of one."""
    return departure[TWO_PASS] >= departure[NTS_AR]


def statements(errors: TwoPasses) -> Iterator[Statement]:
    """Say up to which penalty the claim holds."""
    (single, double), (moderate_one, moderate_two) = errors.departure, errors.stress_error
    yield Statement(
        "Section 5.1.3",
        "case B: two passes with a penalty do not come nearer than one",
        f"at the soft penalty of Fig. 18 pressures depart by up to {double:.2f} from the exact one with "
        f"two passes and by {single:.2f} with one. At ε̂ = 10 E/h the error of the stress is "
        f"{moderate_one / moderate_two:.0f} times smaller with two, which lock",
        Agreement.decide(double >= single, always=moderate_two >= moderate_one),
        "fig18",
        f"ε̂ ≤ {errors.limit:.2f} E per unit of length",
    )


ITEM = Item(name="section_5_1_3", title="Section 5.1.3: one pass and two", compute=compute, statements=statements)
