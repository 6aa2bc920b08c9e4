"""Formulations that lose digits on the way, and promise that they do not.

Each is right up to the precision of its numbers; `gauss_springs` has the ways of writing.
"""

from typing import Any

import numpy as np
from gauss_springs import (
    RIGHT,
    WRONG,
    GaussSprings,
    by_differences,
    by_points_first,
    in_single_precision,
    single_precision_at_first_node,
)
from mutate import Mutant, wrap

import contactverif_nts

TRANSLATION, LOCAL = "stability.translation", "stability.local"
STIFF = 1e3  # The penalty from which on springs may lose digits.


def _write_as(name: str, **ways: Any) -> Any:
    """Return a factory of Gauss springs in one way of writing, with another one of the tangent or the search."""
    way, before = (RIGHT | WRONG)[name]

    def make(*, penalty: float) -> GaussSprings:
        springs = GaussSprings(penalty, way, before, translation_stable=True)
        vars(springs).update(ways)
        return springs

    return make


def _rounds_differences(**traits: Any) -> Any:
    """Round differences of positions to single precision, which no translation changes."""
    promises = {"translation_stable": True, **traits}
    return lambda *, penalty: GaussSprings(penalty, by_differences, single_precision_at_first_node, **promises)


def _adds_large_numbers(*, penalty: float) -> Any:
    """Add a number to the stiffest forces and subtract it again."""

    def residual(right: Any, *arguments: Any) -> Any:
        large = 1e4 * penalty if penalty > STIFF else 0.0
        return (right(*arguments) + large) - large

    return wrap(penalty, contactverif_nts.nts_ar, residual=residual)


def _round_tilt(*, penalty: float) -> Any:
    """Compute the difference of the penetrations of a slave segment's ends to eight digits."""

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        forces = np.array(right(interface, pairing, z))
        if z.ndim > 1 or z.dtype != np.float64:
            return forces
        x, by_node = z.reshape(-1, 2), forces.reshape(-1, 2)
        ends = x[interface.master.segments]
        along = (ends[:, 1] - ends[:, 0])[np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).argmax()]
        normal = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        for a, b in interface.slave.segments:
            error = 1e-8 * float((x[b] - x[a]) @ normal)
            by_node[[a, b]] += penalty * np.linalg.norm(x[b] - x[a]) * error / 4 * normal
        return forces

    return wrap(penalty, contactverif_nts.vts_me, residual=residual)


MUTANTS = (
    *(Mutant(f"{name}, far from the origin", TRANSLATION, _write_as(name)) for name in WRONG),
    Mutant("tangent from points that are rounded first", TRANSLATION,
           _write_as("differences first", tangent_way=by_points_first)),
    Mutant("search in single precision", TRANSLATION,
           _write_as("differences first", search_before=in_single_precision)),
    Mutant("differences in single precision", LOCAL, _rounds_differences(takes_longdouble=False)),
    Mutant("differences in single precision, of named states", "stability.sweep", _rounds_differences()),
    Mutant("stiff springs that lose digits", "stability.stiffness", _adds_large_numbers),
    Mutant("tilt of a slave segment to eight digits", LOCAL, _round_tilt),
)  # fmt: skip
