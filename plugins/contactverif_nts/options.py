"""The options that the formulations of this family share, checked where they come in."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import TypeVar

from contactverif.contract.errors import MisuseError
from contactverif_nts.eq6 import CURRENT, REFERENCE

AREAS = {"current": CURRENT, "reference": REFERENCE}

_Choice = TypeVar("_Choice")


def chosen(option: str, value: str, choices: Mapping[str, _Choice]) -> _Choice:
    """What an option's word stands for.

    Raises
    ------
    MisuseError
        If the word is none of the choices.
    """
    if value not in choices:
        raise MisuseError(option, repr(value), " or ".join(map(repr, choices)))
    return choices[value]


def check_penalty(penalty: float) -> float:
    """The penalty, a finite number above zero."""
    if isinstance(penalty, bool) or not isinstance(penalty, int | float) or not (isfinite(penalty) and penalty > 0):
        raise MisuseError("penalty", repr(penalty), "a finite number > 0")
    return float(penalty)


def check_count(n: int) -> int:
    """The number of virtual slave nodes on a slave segment, at least one."""
    if isinstance(n, bool) or not isinstance(n, int) or n < 1:
        raise MisuseError("n", repr(n), "a whole number ≥ 1")
    return n


def check_free_end(tau: float) -> float:
    """τ, a share of a segment, at least zero and below one."""
    if isinstance(tau, bool) or not isinstance(tau, int | float) or not 0 <= tau < 1:
        raise MisuseError("tau", repr(tau), "a number ≥ 0 and < 1")
    return float(tau)
