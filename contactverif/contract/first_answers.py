"""The first answers of a formulation in a process, kept to be compared with later answers to the same questions.

Whatever is asked first takes the first call: in a run that is the check of signs, in a test the property itself. So the
answers are noted where they are given, and travel with the `Subject`.
"""

from __future__ import annotations

from dataclasses import dataclass

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case


@dataclass(frozen=True, slots=True, eq=False)
class FirstAnswers:
    """The answers to the first questions, at one state."""

    case: Case  # The state, with its multipliers if there are any.
    residual: FloatArray  # (n,) with n = n_unknowns + n_multipliers
    tangent: FloatArray | None  # (n, n); None if it was not asked.
