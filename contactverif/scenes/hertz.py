"""What is known of a cylinder pressed on a flat without friction: Hertz' answer, and Hertz on a Winkler layer.

Both are of half-planes: the contact is small against the bodies and its slope small against 1. A penalty ε̂ makes of the
interface a layer of springs, so that it is the second that a penalty method converges to, not the first.

Sources: K. L. Johnson, Contact Mechanics (1985), Sections 4.2(c) (line contact) and 4.3 (elastic foundation); the
equation on the layer is his (2.24) for the half-planes with the layer's own yielding p/ε̂ added, as in 5.8.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from numpy.polynomial import legendre
from scipy.optimize import brentq

from contactverif.contract.arrays import FloatArray

TERMS = 24  # even Legendre polynomials; 12 more move the peak by 2e-8 of it at E*/(ε̂ a) = 0.24, by 2e-6 at 0.01
_WIDEST = 64.0  # times the larger of the half-widths of Hertz and of the layer alone: no contact is wider


def half_width(force: float, radius: float, stiffness: float) -> float:
    """Half-width a = √(4FR / πE*) of the contact, a length; F per unit of thickness (Johnson, 4.43)."""
    return sqrt(4 * force * radius / (pi * stiffness))


def layer_half_width(force: float, radius: float, penalty: float) -> float:
    """Half-width (3FR / 2ε̂)^⅓ if the layer alone gives way: p = ε̂ (a² − x²) / 2R (Johnson, 4.3)."""
    return float((1.5 * force * radius / penalty) ** (1 / 3))


def peak(force: float, radius: float, stiffness: float) -> float:
    """Pressure p0 = 2F / πa in the middle, force per length (Johnson, 4.45)."""
    return 2 * force / (pi * half_width(force, radius, stiffness))


def pressure(x: FloatArray, force: float, radius: float, stiffness: float) -> FloatArray:
    """p0 √(1 − x²/a²) at x, any shape, from the middle; 0 outside (Johnson, 4.44)."""
    inside = 1 - (np.asarray(x, dtype=np.float64) / half_width(force, radius, stiffness)) ** 2
    pressures: FloatArray = peak(force, radius, stiffness) * np.sqrt(np.maximum(inside, 0.0))
    return pressures


@dataclass(frozen=True, slots=True, eq=False)
class WinklerContact:
    """A cylinder on a flat with a layer of springs between.

    Attributes
    ----------
    half_width : float
        Of the contact, a length.
    coefficients : FloatArray, shape (n,)
        Of the pressure in Legendre polynomials of x over the half-width, force per length; even ones alone are
        not 0.
    """

    half_width: float
    coefficients: FloatArray

    @property
    def peak(self) -> float:
        """Pressure in the middle."""
        return float(legendre.legval(0.0, self.coefficients))

    @property
    def force(self) -> float:
        """Total, per unit of thickness: that of the first polynomial, since all others have none."""
        return 2 * self.half_width * float(self.coefficients[0])

    def pressure(self, x: FloatArray) -> FloatArray:
        """At x, any shape, from the middle; 0 outside."""
        t = np.asarray(x, dtype=np.float64) / self.half_width
        pressures: FloatArray = np.where(np.abs(t) < 1, legendre.legval(np.clip(t, -1, 1), self.coefficients), 0.0)
        return pressures


def solve_winkler_contact(
    force: float, radius: float, stiffness: float, penalty: float, terms: int = TERMS
) -> WinklerContact:
    """Hertz on a Winkler layer: p/ε̂ − (2/πE*) ∫ p(s) ln|x − s| ds = δ − x²/2R in contact, and p = 0 at its edge.

    There the layer is not pressed any more: p falls to 0 with a finite slope. Collocation at Gauss points with
    even Legendre polynomials, whose integrals with the logarithm are known; the half-width is the one that gives F.

    Parameters
    ----------
    force : float
        F > 0, per unit of thickness.
    radius, stiffness, penalty : float
        R, E* and ε̂.
    terms : int
        Polynomials.
    """
    widest = _WIDEST * max(half_width(force, radius, stiffness), layer_half_width(force, radius, penalty))

    def missing(a: float) -> float:
        return _of_width(a, radius, stiffness, penalty, terms).force - force

    a = brentq(missing, widest * 1e-6, widest, xtol=1e-14 * widest, rtol=1e-14)
    return _of_width(a, radius, stiffness, penalty, terms)


def _of_width(a: float, radius: float, stiffness: float, penalty: float, terms: int) -> WinklerContact:
    """The solution of half-width a, whatever its force."""
    orders = 2 * np.arange(terms)
    points = legendre.leggauss(2 * terms)[0][terms:]  # (terms,), in (0, 1): all is even
    polynomials = legendre.legvander(points, orders[-1])[:, orders]
    yielding = 1 / penalty + a / stiffness  # of all, a length per pressure: it and a²/2R free the matrix from units
    own, others = 1 / (penalty * yielding), 2 * a / (pi * stiffness * yielding)
    matrix = np.zeros((terms + 1, terms + 1))
    matrix[:-1, :-1] = own * polynomials - others * _logarithms(points, orders[-1])[:, orders]
    matrix[:-1, -1] = -1.0  # the approach δ, which takes in what ln a adds
    matrix[-1, :-1] = 1.0  # p = 0 at the edge, where all polynomials are 1
    solution = np.linalg.solve(matrix, np.append(-(points**2), 0.0)) * a**2 / (2 * radius * yielding)
    coefficients = np.zeros(orders[-1] + 1)
    coefficients[orders] = solution[:-1]
    return WinklerContact(a, coefficients)


def _logarithms(points: FloatArray, highest: int) -> FloatArray:
    """∫ P_n(s) ln|t − s| ds over [−1, 1] for n = 0 … highest, (n_points, highest + 1).

    For n ≥ 1 it is 2 (Q_{n+1} − Q_{n−1}) / (2n + 1), since its derivative is 2 Q_n; Q by its recurrence, which is
    stable within (−1, 1).
    """
    q = [np.arctanh(points), points * np.arctanh(points) - 1]
    for n in range(1, highest + 1):
        q.append(((2 * n + 1) * points * q[n] - n * q[n - 1]) / (n + 1))
    first = (1 - points) * np.log(1 - points) + (1 + points) * np.log(1 + points) - 2
    rest = [2 * (q[n + 1] - q[n - 1]) / (2 * n + 1) for n in range(1, highest + 1)]
    return np.column_stack([first, *rest])
