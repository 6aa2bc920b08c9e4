"""Formulations whose rounding errors are larger than their condition number allows, though not by moving far away."""

from __future__ import annotations

from typing import Any

from gauss_springs import GaussSprings, by_differences, single_precision_at_first_node
from mutate import Mutant, Wrapped

import contactverif_nts

SWEEP, STIFFNESS = "stability.sweep", "stability.stiffness"
STIFF = 1e3  # The penalty from which on the springs below lose digits.


def _keeps_differences_in_single_precision(penalty: float) -> Any:
    """Round what an exact translation leaves as it is, so that only a rotation or an exact answer shows the error."""
    return GaussSprings(penalty, by_differences, single_precision_at_first_node, translation_stable=True)


def _adds_large_numbers(penalty: float) -> Any:
    """Add a number to the stiffest forces and subtract it again."""

    def residual(right: Any, *arguments: Any) -> Any:
        large = 1e4 * penalty if penalty > STIFF else 0.0
        return (right(*arguments) + large) - large

    return Wrapped(penalty, contactverif_nts.nts_ar, residual=residual)


MUTANTS = (
    Mutant("differences in single precision, of named states", SWEEP,
           lambda *, penalty: _keeps_differences_in_single_precision(penalty)),
    Mutant("stiff springs that lose digits", STIFFNESS, lambda *, penalty: _adds_large_numbers(penalty)),
)  # fmt: skip
