"""The pressure of Hertz and of a layer of springs: closed forms, the equation itself, both limits, and its digits."""

from itertools import pairwise
from math import pi

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from contactverif.contract.errors import MisuseError
from contactverif.problems.hertz import TERMS, hertz_contact, hertz_pressure, layer_contact, logarithm_integrals

# Relative shortfalls of the peak over E*/(ε̂ a), for values of E*/(ε̂ a), with the half-width a of Hertz.
SHORTFALLS = {0.01: 0.317, 0.03: 0.313, 0.1: 0.301}
RADIUS = 1000.0
PLACES = np.concatenate([np.linspace(-1, 1, 201), 1 - np.logspace(-8, -1, 40)])


def test_the_pressure_of_hertz_is_his() -> None:
    pressure = hertz_contact(1.0, RADIUS, 2.0)
    assert pressure.peak == pytest.approx(2.0 / (2 * RADIUS), rel=1e-13)
    exact = pressure.peak * np.sqrt(1 - PLACES**2)
    assert np.abs(pressure.pressure(PLACES) - exact).max() <= 1e-12 * pressure.peak
    assert pressure.pressure(np.array([-2.0, 1.0001])).tolist() == [0, 0]


def test_its_integrals_are_those_of_the_calculus() -> None:
    pressure, x = hertz_pressure(2.0, 3.0), np.array([-1.9, 0.3, 1.0, 2.0])
    t = x / 2
    force = 3 * 2 * (t * np.sqrt(1 - t**2) + np.arcsin(t) + pi / 2) / 2
    assert pressure.force_up_to(x) == pytest.approx(force, rel=1e-12)
    assert pressure.moment_up_to(x) == pytest.approx(-3 * 4 * (1 - t**2) ** 1.5 / 3, abs=1e-12)
    assert pressure.force == pytest.approx(3 * pi, rel=1e-13)
    places, forces = pressure.line_loads()
    assert forces.sum() == pytest.approx(pressure.force, rel=1e-13)
    assert forces @ places**2 == pytest.approx(pressure.force * 2.0**2 / 4, rel=1e-9)


@pytest.mark.parametrize("t", [-0.9999, 0.3, 0.999999, 1.0, 1.0026, 1.3, -2.9, 3.1, 40.0])
def test_integrals_with_the_logarithm_agree_with_adaptive_quadrature(t: float) -> None:
    edges = np.array([2.0, 5.0])  # The panel has the middle 3.5 and the half-length 1.5.
    x = 3.5 + 1.5 * t
    values = logarithm_integrals(np.array([x]), edges, TERMS)[0, 0]
    for n in (0, 1, 2, 7, 15):

        def term(s: float, n: int = n) -> float:
            return float(np.polynomial.legendre.Legendre.basis(n, [2, 5])(s) * np.log(abs(x - s)))

        parts = [2.0, x, 5.0] if 2 < x < 5 else [2.0, 5.0]
        exact = sum(quad(term, low, high, epsabs=1e-12, limit=400)[0] for low, high in pairwise(parts))
        assert values[n] == pytest.approx(exact, abs=1e-9)


@pytest.mark.parametrize("layer", [0.1, 1e-2, 1e-4])
def test_the_layer_is_solved_to_1e_10(layer: float) -> None:
    """E*/(ε̂ a) is given. Half as many terms more, and 8 more panels at each edge, change nothing."""
    coarse = layer_contact(1.0, RADIUS, 1.0, 1 / layer)
    fine = layer_contact(1.0, RADIUS, 1.0, 1 / layer, terms=24, more_levels=8)
    assert np.abs(coarse.pressure(PLACES) - fine.pressure(PLACES)).max() <= 1e-10 * fine.peak
    assert coarse.force == pytest.approx(fine.force, rel=1e-11)


def test_the_equation_holds_everywhere() -> None:
    penalty, stiffness = 50.0, 0.8
    pressure = layer_contact(1.0, RADIUS, stiffness, penalty)
    sides = pressure.pressure(PLACES) / penalty + pressure.deflection(PLACES) / stiffness + PLACES**2 / (2 * RADIUS)
    assert np.abs(sides - pressure.approach).max() <= 1e-12 / (2 * RADIUS)


@pytest.mark.parametrize(("ratio", "shortfall"), SHORTFALLS.items())
def test_a_stiff_layer_lowers_the_peak_of_a_given_force(ratio: float, shortfall: float) -> None:
    stiffness = 1.0
    rigid = hertz_contact(1.0, RADIUS, stiffness)
    penalty = stiffness / ratio

    def excess(half_width: float) -> float:
        return layer_contact(half_width, RADIUS, stiffness, penalty).force - rigid.force

    pressure = layer_contact(brentq(excess, 1.0, 2.0, xtol=1e-13), RADIUS, stiffness, penalty)
    assert (1 - pressure.peak / rigid.peak) / ratio == pytest.approx(shortfall, abs=1e-3)


@pytest.mark.parametrize("layer", [1e-12, 1e-15])
def test_a_layer_that_counts_for_nothing_leaves_the_pressure_of_hertz(layer: float) -> None:
    pressure, rigid = layer_contact(1.0, RADIUS, 1.0, 1 / layer), hertz_contact(1.0, RADIUS, 1.0)
    assert abs(pressure.force / rigid.force - 1) <= 1e-8


def test_a_stiffer_layer_comes_nearer_to_hertz() -> None:
    rigid = hertz_contact(1.0, RADIUS, 1.0)
    errors = [abs(layer_contact(1.0, RADIUS, 1.0, penalty).peak / rigid.peak - 1) for penalty in (1e3, 1e4, 1e5)]
    assert errors[1] <= 0.13 * errors[0]  # At a given half-width the error is that of δ ln δ, with δ = E*/(ε̂ a).
    assert errors[2] <= 0.13 * errors[1]


@pytest.mark.parametrize("name", ["half_width", "radius", "stiffness", "penalty"])
def test_a_number_that_is_not_positive_is_refused(name: str) -> None:
    numbers = [0.0 if word == name else 1.0 for word in ("half_width", "radius", "stiffness", "penalty")]
    with pytest.raises(MisuseError, match=rf"{name}: found 0\.0"):
        layer_contact(*numbers)
