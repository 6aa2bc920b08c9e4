"""A cylinder pressed on a flat without friction: Hertz' answer, and Hertz on a Winkler layer.

Both are answers for half-planes: the contact is small against the bodies, and its slope small against 1. A penalty ε̂
makes a layer of springs of the interface, so a penalty method converges to the second answer, not to the first.

Rule for the next editor: nothing here knows a mesh or a formulation.

References ---------- K. L. Johnson, Contact Mechanics (1985), Sections 4.2(c) (line contact) and 4.3 (elastic
foundation). The equation on the layer is his (2.24) for the half-planes with the layer's own deflection p/ε̂ added, as
in 5.8.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from numpy.polynomial import legendre

from contactverif.contract.arrays import FloatArray
from contactverif.problems.line_pressure import gauss_rule, near_integrals

TERMS = 24  # Number of even Legendre polynomials: 12 more change the peak by 2e-8 at E*/(ε̂ a) = 0.24, by 2e-6 at 0.01.
_WIDEST = 64.0  # No contact is wider than this factor times the larger half-width, of Hertz or of the layer alone.


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


@dataclass(frozen=True, slots=True, eq=False)
class WinklerContact:
    """The contact of a cylinder with a flat, with a layer of springs between them."""

    half_width: float  # The half-width of the contact, a length.
    # (n,) The pressure in Legendre polynomials of x over the half-width, force per length; odd ones are 0.
    coefficients: FloatArray

    @property
    def peak(self) -> float:
        """The pressure in the middle, force per length."""
        return float(legendre.legval(0.0, self.coefficients))

    @property
    def force(self) -> float:
        """The total force per unit of thickness: that of the first polynomial, since the others have none."""
        return 2 * self.half_width * float(self.coefficients[0])

    def pressure(self, x: FloatArray) -> FloatArray:
        """Return the pressure at x from the middle, in the shape of x; 0 outside."""
        t = np.asarray(x, dtype=np.float64) / self.half_width
        return np.where(np.abs(t) < 1, legendre.legval(np.clip(t, -1, 1), self.coefficients), 0.0)


def solve_winkler_contact(
    force: float, radius: float, stiffness: float, penalty: float, terms: int = TERMS
) -> WinklerContact:
    """Solve Hertz on a Winkler layer.

    The equation is p/ε̂ − (2/πE*) ∫ p(s) ln|x − s| ds = δ − x²/2R in contact, and p = 0 at its edge. There the layer is
    not pressed any more: p falls to 0 with a finite slope. Collocation at Gauss points with even Legendre polynomials,
    whose integrals with the logarithm are known; the half-width is the one that gives the force F > 0 per thickness.
    """
    widest = _WIDEST * max(half_width(force, radius, stiffness), layer_half_width(force, radius, penalty))

    def missing(a: float) -> float:
        return _solve_width(a, radius, stiffness, penalty, terms).force - force

    from scipy.optimize import brentq  # It takes long to import, and the first rows of a run do not need it.

    a = brentq(missing, widest * 1e-6, widest, xtol=1e-14 * widest, rtol=1e-14)
    return _solve_width(a, radius, stiffness, penalty, terms)


def _solve_width(a: float, radius: float, stiffness: float, penalty: float, terms: int) -> WinklerContact:
    """Return the solution of half-width a, whatever its force."""
    orders = 2 * np.arange(terms)
    points = gauss_rule(2 * terms)[0][terms:]  # (terms,), in (0, 1), since all is even.
    polynomials = legendre.legvander(points, orders[-1])[:, orders]
    compliance = 1 / penalty + a / stiffness  # A length per pressure: it and a²/2R make the matrix dimensionless.
    local, distant = 1 / (penalty * compliance), 2 * a / (pi * stiffness * compliance)
    matrix = np.zeros((terms + 1, terms + 1))
    matrix[:-1, :-1] = local * polynomials - distant * near_integrals(points, orders[-1] + 1)[:, orders]
    matrix[:-1, -1] = -1.0  # The approach δ, which includes what ln a adds.
    matrix[-1, :-1] = 1.0  # The pressure is 0 at the edge, where all polynomials are 1.
    solution = np.linalg.solve(matrix, np.append(-(points**2), 0.0)) * a**2 / (2 * radius * compliance)
    coefficients = np.zeros(orders[-1] + 1)
    coefficients[orders] = solution[:-1]
    return WinklerContact(a, coefficients)
