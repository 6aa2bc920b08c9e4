"""Hertz, and Hertz on a Winkler layer: the paper's numbers, the equation itself by quadrature, and both limits."""

from math import log

import numpy as np
import pytest
from scipy.integrate import quad

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.problems import hertz
from contactverif.problems.hertz import logarithm_integrals, solve_winkler_contact

FORCE, RADIUS, PENALTY = 1e6, 10.0, 1e9
STIFFNESS = 1 / (1 / 1e8 + 1 / 1e9)
# Relative shortfalls of the peak over E*/(ε̂ a), for values of E*/(ε̂ a); computed apart from this code.
SHORTFALLS = {0.01: 0.317, 0.03: 0.313, 0.1: 0.301}


def test_hertz_of_example_2() -> None:
    assert hertz.half_width(FORCE, RADIUS, STIFFNESS) == pytest.approx(0.3742, abs=5e-5)
    assert hertz.peak(FORCE, RADIUS, STIFFNESS) == pytest.approx(1.701e6, abs=500)


def test_the_pressure_of_hertz_carries_the_force() -> None:
    a = hertz.half_width(FORCE, RADIUS, STIFFNESS)
    angles, weights = np.polynomial.legendre.leggauss(40)
    x = a * np.sin(np.pi / 2 * angles)  # dx takes away the square root at the edge
    total = np.pi / 2 * a * weights @ (np.cos(np.pi / 2 * angles) * hertz.pressure(x, FORCE, RADIUS, STIFFNESS))
    assert total == pytest.approx(FORCE, rel=1e-14)
    assert hertz.pressure(np.array([-2 * a, 1.001 * a]), FORCE, RADIUS, STIFFNESS).tolist() == [0, 0]


def test_the_layer_of_example_2() -> None:
    contact = solve_winkler_contact(FORCE, RADIUS, STIFFNESS, PENALTY)
    assert contact.peak == pytest.approx(1.586e6, abs=500)
    assert contact.half_width == pytest.approx(0.4291, abs=5e-5)
    assert contact.force == pytest.approx(FORCE, rel=1e-13)


def collocated_pressure(terms: int, half_width: float, penalty: float) -> FloatArray:
    """Return the coefficients of the pressure of a given half-width in Legendre polynomials of x/a; odd ones are 0.

    One panel from edge to edge, and not many as in the code. The kink of the pressure at the edge makes it slow.
    """
    orders = 2 * np.arange(terms)
    points = np.polynomial.legendre.leggauss(2 * terms)[0][terms:]
    polynomials = np.polynomial.legendre.legvander(points, orders[-1])[:, orders]
    logarithms = logarithm_integrals(points, np.array([-1.0, 1.0]), int(orders[-1]) + 1)[:, 0, orders]
    matrix = np.zeros((terms + 1, terms + 1))
    matrix[:-1, :-1] = polynomials / penalty - 2 * half_width / (np.pi * STIFFNESS) * logarithms
    matrix[:-1, -1] = -half_width / STIFFNESS  # The approach, made as large as the other columns.
    matrix[-1, :-1] = half_width / STIFFNESS  # The pressure is 0 at the edge.
    load = np.append(-(points**2), 0.0) * half_width**2 / (2 * RADIUS)
    coefficients = np.zeros(int(orders[-1]) + 1)
    coefficients[orders] = np.linalg.solve(matrix, load)[:-1]
    return coefficients


@pytest.mark.parametrize("ratio", [0.24, 1e-2, 5e-4])
def test_global_polynomials_come_near_to_the_same_pressure(ratio: float) -> None:
    """The ratio is E*/(ε̂ a). Twice as many terms at least halve the difference between the forces."""
    penalty = STIFFNESS / (ratio * hertz.half_width(FORCE, RADIUS, STIFFNESS))
    contact = solve_winkler_contact(FORCE, RADIUS, STIFFNESS, penalty)
    solutions = [collocated_pressure(terms, contact.half_width, penalty) for terms in (24, 48, 96)]
    forces = np.array([2 * contact.half_width * coefficients[0] for coefficients in solutions])
    errors = np.abs(forces / FORCE - 1)
    assert (errors[1:] <= errors[:-1] / 2).all()
    assert errors[-1] <= 3e-4
    peak = np.polynomial.legendre.legval(0.0, solutions[-1])
    assert peak == pytest.approx(contact.peak, rel=1e-5)


def test_the_equation_holds_by_another_quadrature() -> None:
    """The sum p/ε̂ − (2/πE*) ∫ p ln|x − s| ds + x²/2R is the same at all x."""
    contact = solve_winkler_contact(FORCE, RADIUS, STIFFNESS, PENALTY)
    a = contact.half_width

    def left_side(x: float) -> float:
        def term(s: float) -> float:
            return float(contact.pressure(np.array([s]))[0]) * log(abs(x - s))

        integral = float(quad(term, -a, x, epsrel=1e-11, limit=200)[0] + quad(term, x, a, epsrel=1e-11, limit=200)[0])
        pressure = float(contact.pressure(np.array([x]))[0])
        return pressure / PENALTY - 2 / (np.pi * STIFFNESS) * integral + x**2 / (2 * RADIUS)

    values = np.array([left_side(x) for x in a * np.array([0.0, 0.21, 0.4, 0.77, 0.95])])
    assert np.ptp(values) <= 1e-8 * a**2 / (2 * RADIUS)


@pytest.mark.parametrize(("ratio", "shortfall"), SHORTFALLS.items())
def test_a_stiff_layer_lowers_the_peak(ratio: float, shortfall: float) -> None:
    a, p = hertz.half_width(FORCE, RADIUS, STIFFNESS), hertz.peak(FORCE, RADIUS, STIFFNESS)
    contact = solve_winkler_contact(FORCE, RADIUS, STIFFNESS, STIFFNESS / (ratio * a))
    assert (1 - contact.peak / p) / ratio == pytest.approx(shortfall, abs=1e-3)
    assert contact.half_width > a


def test_a_soft_layer_is_alone() -> None:
    """Its own contact is a parabola; the half-planes below add the less the softer it is."""
    for over in (1e2, 1e4):
        penalty = STIFFNESS / (over * hertz.half_width(FORCE, RADIUS, STIFFNESS))
        a = hertz.layer_half_width(FORCE, RADIUS, penalty)
        contact = solve_winkler_contact(FORCE, RADIUS, STIFFNESS, penalty)
        assert abs(contact.half_width / a - 1) <= over ** (-2 / 3)
        assert abs(contact.peak / (penalty * a**2 / (2 * RADIUS)) - 1) <= over ** (-2 / 3)


@pytest.mark.parametrize(("length", "force"), [(2.0**40, 1.0), (2.0**-40, 1.0), (1.0, 2.0**60)])
def test_units_change_nothing(length: float, force: float) -> None:
    """F is a force per length, E* and p are forces per length², ε̂ one per length³."""
    plain = solve_winkler_contact(FORCE, RADIUS, STIFFNESS, PENALTY)
    stress = force / length**2
    other = solve_winkler_contact(
        FORCE * force / length, RADIUS * length, STIFFNESS * stress, PENALTY * stress / length
    )
    assert other.half_width / length == pytest.approx(plain.half_width, rel=1e4 * UNIT_ROUNDOFF)
    assert other.peak / stress == pytest.approx(plain.peak, rel=1e5 * UNIT_ROUNDOFF)
