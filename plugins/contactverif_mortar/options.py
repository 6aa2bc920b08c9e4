"""The options that the formulations of this family share, checked where they come in."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import TypeVar

from contactverif.contract.errors import MisuseError

AREAS = {"current": True, "reference": False}  # whether lengths are those of the current configuration
NORMALS = {"segment": False, "averaged": True}  # whether normals of neighbouring slave segments are averaged

_Choice = TypeVar("_Choice")


def chosen(option: str, value: str, choices: Mapping[str, _Choice]) -> _Choice:
    """What an option's word stands for.

    Raises
    ------
    MisuseError
        If the word is none of the choices.
    """
    if not isinstance(value, str) or value not in choices:
        raise MisuseError(option, repr(value), " or ".join(map(repr, choices)))
    return choices[value]


def check_penalty(penalty: float) -> float:
    """The penalty, a finite number above zero."""
    if isinstance(penalty, bool) or not isinstance(penalty, int | float) or not (isfinite(penalty) and penalty > 0):
        raise MisuseError("penalty", repr(penalty), "a finite number > 0")
    return float(penalty)


def check_free_end(tau: float) -> float:
    """τ, a share of a segment, at least zero and below one."""
    if isinstance(tau, bool) or not isinstance(tau, int | float) or not 0 <= tau < 1:
        raise MisuseError("tau", repr(tau), "a number ≥ 0 and < 1")
    return float(tau)
