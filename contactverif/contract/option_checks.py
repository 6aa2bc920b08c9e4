"""Check the options that formulations have in common: penalty, counts, tolerances and words.

A factory calls these functions on its arguments before it does anything else, so that a user who misspells an option
reads which one it is and what was needed. Every function returns the value that the formulation stores.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import TypeVar

from contactverif.contract.errors import MisuseError

MOST_POINTS = 1000  # Virtual slave nodes, or Gauss points, on a slave segment.

_Choice = TypeVar("_Choice")


def choose(option: str, word: str, choices: Mapping[str, _Choice]) -> _Choice:
    """Return the value that the word of an option stands for."""
    if not isinstance(word, str) or word not in choices:
        raise MisuseError(option, repr(word), " or ".join(map(repr, choices)))
    return choices[word]


def check_penalty(penalty: float) -> float:
    """Return the penalty as a float."""
    if isinstance(penalty, bool) or not isinstance(penalty, int | float) or not (isfinite(penalty) and penalty > 0):
        raise MisuseError("penalty", repr(penalty), "a finite number > 0")
    return float(penalty)


def check_count(n: int, name: str = "n", least: int = 1) -> int:
    """Return the option n, the number of points on a slave segment, or another option that counts, by its name."""
    if isinstance(n, bool) or not isinstance(n, int) or not least <= n <= MOST_POINTS:
        raise MisuseError(name, repr(n), f"a whole number from {least} to {MOST_POINTS}")
    return n


def check_tau(tau: float) -> float:
    """Return τ, the part of a master segment by which a foot may lie past its free end, as a float."""
    if isinstance(tau, bool) or not isinstance(tau, int | float) or not 0 <= tau < 1:
        raise MisuseError("tau", repr(tau), "a number ≥ 0 and < 1")
    return float(tau)
