"""The solved patch test at a moderate and at a high penalty, which say different things.

At a moderate penalty a wrong distribution of forces bends the bodies. As the penalty grows, a method that only
interpolates the gap well locks into the right pressure and seems to pass.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Quantity
from contactverif.contract.subject import Subject
from contactverif_properties.shared.solved_patch import (
    MULTIPLIERS,
    QUANTITIES,
    STRESS,
    measure_at_penalty,
    measure_once,
)

HIGH = 1e3  # The high penalty over the moderate penalty of a case.
SLOPE = "slope over penalties (−1 if it locks)"


def high_name(name: str) -> str:
    """Return the name of a quantity at the high penalty."""
    return f"{name}, high penalty"


def measure_two_penalties(case: Case, subject: Subject) -> Measurement:
    """Solve two blocks at the penalty of the case and at a HIGH one, and return the errors of both.

    Parameters
    ----------
    case : Case
        A uniform scene.
    subject : Subject
        The formulation. One with multipliers has no penalty, and is solved once.

    Returns
    -------
    Measurement
        The quantities of `measure_at_penalty`, and the same again at the high penalty. Details: how each solution
        ended, and the slope of the logarithm of the stress error over that of the penalty.
    """
    if subject.traits.enforcement == "multiplier":
        return measure_once(case, subject)
    moderate = measure_at_penalty(case, subject, case.penalty)
    high = measure_at_penalty(case, subject, HIGH * case.penalty)
    errors = moderate.values[STRESS.name], high.values[STRESS.name]
    slope = float(np.log(errors[1] / errors[0]) / np.log(HIGH)) if min(errors) > 0 else 0.0
    return Measurement(
        [*moderate.numbers, *(replace(number, quantity=_at_high(number.quantity)) for number in high.numbers)],
        undecided=moderate.undecided or high.undecided,
        details={**moderate.details, **_rename_high(high.details), SLOPE: slope},
    )


def _at_high(quantity: Quantity) -> Quantity:
    return replace(quantity, name=high_name(quantity.name))


def _rename_high(numbers: Mapping[str, float]) -> dict[str, float]:
    return {high_name(name): number for name, number in numbers.items()}


TWO_PENALTIES = (
    *QUANTITIES,
    *map(_at_high, QUANTITIES),
    MULTIPLIERS,
)
