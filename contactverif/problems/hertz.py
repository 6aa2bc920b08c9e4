"""A cylinder pressed on a flat without friction: Hertz' answer, and Hertz on a Winkler layer.

Both are answers for half-planes: the contact is small against the bodies, and its slope small against 1. A penalty ε̂
makes a layer of springs of the interface, so a penalty method converges to the second answer, not to the first.

Rule for the next editor: nothing here knows a mesh or a formulation.

References
----------
K. L. Johnson, Contact Mechanics (1985), Sections 4.2(c) (line contact) and 4.3 (elastic foundation). The equation on
the layer is his (2.24) for the half-planes with the layer's own deflection p/ε̂ added, as in 5.8.
"""

from __future__ import annotations

from functools import lru_cache
from math import pi, sqrt

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.problems.line_pressure import LinePressure, layer_contact

_ROUNDED = 1 - 1e-7  # The least half-width over that without a layer, or without half-planes: roundoff may lower it.


def half_width(force: float, radius: float, stiffness: float) -> float:
    """Return the half-width a = √(4FR / πE*) of the contact, a length; F per unit of thickness (Johnson, 4.43)."""
    return sqrt(4 * force * radius / (pi * stiffness))


def layer_half_width(force: float, radius: float, penalty: float) -> float:
    """Return the half-width (3FR / 2ε̂)^⅓ if the layer alone gives way: p = ε̂ (a² − x²) / 2R (Johnson, 4.3)."""
    return float((1.5 * force * radius / penalty) ** (1 / 3))


def peak(force: float, radius: float, stiffness: float) -> float:
    """Return the pressure p0 = 2F / πa in the middle, force per length (Johnson, 4.45)."""
    return 2 * force / (pi * half_width(force, radius, stiffness))


def pressure(x: FloatArray, force: float, radius: float, stiffness: float) -> FloatArray:
    """Return the pressure p0 √(1 − x²/a²) at x from the middle, in the shape of x; 0 outside (Johnson, 4.44)."""
    inside = 1 - (np.asarray(x, dtype=np.float64) / half_width(force, radius, stiffness)) ** 2
    return peak(force, radius, stiffness) * np.sqrt(np.maximum(inside, 0.0))


@lru_cache(maxsize=32)  # A root of some ten solutions: tests and tables ask for the same disk again and again.
def solve_winkler_contact(force: float, radius: float, stiffness: float, penalty: float) -> LinePressure:
    """Solve Hertz on a Winkler layer for the force F > 0 per unit of thickness.

    The equation is p/ε̂ − (2/πE*) ∫ p(s) ln|x − s| ds = δ − x²/2R in contact, and p = 0 at its edge: there the layer is
    not pressed any more. It is solved to 1e-10 for a given half-width, or to 1e-8 if E*/(ε̂ a) is below 1e-8. The
    half-width is the one that carries F.
    """

    def missing(half_width: float) -> float:
        return layer_contact(half_width, radius, stiffness, penalty).force - force

    from scipy.optimize import brentq  # It takes long to import, and the first rows of a run do not need it.

    # Half-planes and layer together give way by more than each of them alone, and by less than one after the other.
    alone = half_width(force, radius, stiffness), layer_half_width(force, radius, penalty)
    width = brentq(missing, _ROUNDED * max(alone), sum(alone), xtol=1e-14 * max(alone), rtol=1e-14)
    return layer_contact(width, radius, stiffness, penalty)
