"""Formulations that lose digits on the way, and promise that they do not.

Each is right near the origin, or up to the precision of its numbers; `gauss_springs` has the ways of writing.
"""

from __future__ import annotations

from typing import Any

from gauss_springs import (
    RIGHT,
    WRONG,
    GaussSprings,
    by_differences,
    by_points_first,
    in_single_precision,
    single_precision_at_first_node,
)
from mutate import Mutant

TRANSLATION, LOCAL = "stability.translation", "stability.local"


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


def _rounds_differences(penalty: float) -> Any:
    """Round differences of positions to single precision, which no translation changes."""
    traits = {"translation_stable": True, "takes_longdouble": False}
    return GaussSprings(penalty, by_differences, single_precision_at_first_node, **traits)


MUTANTS = (
    *(Mutant(f"{name}, far from the origin", TRANSLATION, _write_as(name)) for name in WRONG),
    Mutant("tangent from points that are rounded first", TRANSLATION,
           lambda *, penalty: _rounds_points_in_tangent(penalty)),
    Mutant("search in single precision", TRANSLATION, lambda *, penalty: _searches_in_single_precision(penalty)),
    Mutant("differences in single precision", LOCAL, lambda *, penalty: _rounds_differences(penalty)),
)  # fmt: skip
