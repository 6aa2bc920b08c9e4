"""Formulations that lose digits on the way, and promise that they do not.

Each is right near the origin, or up to the precision of its numbers; `gauss_springs` has the ways of writing.
"""

from __future__ import annotations

from typing import Any

from gauss_springs import RIGHT, WRONG, GaussSprings, by_points_first, in_single_precision
from mutate import Mutant

TRANSLATION = "stability.translation"


def _write_as(name: str) -> Any:
    way, before = (RIGHT | WRONG)[name]
    return lambda *, penalty: GaussSprings(penalty, way, before, translation_stable=True)


def _rounds_points_in_tangent(penalty: float) -> Any:
    springs = _write_as("differences first")(penalty=penalty)
    springs.tangent_way = by_points_first
    return springs


def _searches_in_single_precision(penalty: float) -> Any:
    springs = _write_as("differences first")(penalty=penalty)
    springs.search_before = in_single_precision
    return springs


MUTANTS = (
    *(Mutant(f"{name}, far from the origin", TRANSLATION, _write_as(name)) for name in WRONG),
    Mutant("tangent from points that are rounded first", TRANSLATION,
           lambda *, penalty: _rounds_points_in_tangent(penalty)),
    Mutant("search in single precision", TRANSLATION, lambda *, penalty: _searches_in_single_precision(penalty)),
)  # fmt: skip
