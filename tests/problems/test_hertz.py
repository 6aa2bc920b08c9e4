"""Hertz, alone and on a layer of springs: closed forms, the equation, both limits, and the fields of half-planes."""

from collections.abc import Callable
from itertools import pairwise
from math import log, pi

import numpy as np
import pytest
from scipy.integrate import quad

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.errors import MisuseError
from contactverif.problems import hertz
from contactverif.problems.hertz import (
    TERMS,
    LinePressure,
    displacements,
    hertz_contact,
    layer_contact,
    logarithm_integrals,
    solve_winkler_contact,
    stresses,
    surface_displacements,
)

# Example 2 of the paper
FORCE, RADIUS, PENALTY = 1e6, 10.0, 1e9
STIFFNESS = 1 / (1 / 1e8 + 1 / 1e9)
PLACES = np.concatenate([np.linspace(-1, 1, 201), 1 - np.logspace(-8, -1, 40)])
YOUNG, POISSON = 2.0, 0.3
PRESSURES = {"Hertz": hertz_contact(1.0, 1.0, 2.0), "layer": layer_contact(1.0, 1.0, 2.0, 20.0)}
EACH_PRESSURE = pytest.mark.parametrize("pressure", PRESSURES.values(), ids=PRESSURES)
STEP = 1e-3


def test_hertz_and_the_layer_of_example_2() -> None:
    assert hertz.half_width(FORCE, RADIUS, STIFFNESS) == pytest.approx(0.3742, abs=5e-5)
    assert hertz.peak(FORCE, RADIUS, STIFFNESS) == pytest.approx(1.701e6, abs=500)
    contact = solve_winkler_contact(FORCE, RADIUS, STIFFNESS, PENALTY)
    assert contact.peak == pytest.approx(1.586e6, abs=500)
    assert contact.half_width == pytest.approx(0.4291, abs=5e-5)
    assert contact.force == pytest.approx(FORCE, rel=1e-13)


def test_the_panels_have_the_pressure_of_hertz() -> None:
    pressure = hertz_contact(1.0, 1000.0, 2.0)
    assert pressure.peak == pytest.approx(2.0 / 2000, rel=1e-13)
    exact = pressure.peak * np.sqrt(1 - PLACES**2)
    assert np.abs(pressure.pressure(PLACES) - exact).max() <= 1e-12 * pressure.peak
    assert pressure.pressure(np.array([-2.0, 1.0001])).tolist() == [0, 0]


def test_its_integrals_are_those_of_the_calculus() -> None:
    pressure, x = hertz_contact(2.0, 1.0, 3.0), np.array([-1.9, 0.3, 1.0, 2.0])
    t = x / 2
    force = 3 * 2 * (t * np.sqrt(1 - t**2) + np.arcsin(t) + pi / 2) / 2
    forces, moments = pressure.integrals_up_to(x)
    assert forces == pytest.approx(force, rel=1e-12)
    assert moments == pytest.approx(-3 * 4 * (1 - t**2) ** 1.5 / 3, abs=1e-12)
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
    coarse = layer_contact(1.0, 1000.0, 1.0, 1 / layer)
    fine = layer_contact(1.0, 1000.0, 1.0, 1 / layer, terms=24, more_levels=8)
    assert np.abs(coarse.pressure(PLACES) - fine.pressure(PLACES)).max() <= 1e-10 * fine.peak
    assert coarse.force == pytest.approx(fine.force, rel=1e-11)


def test_the_equation_holds_by_another_quadrature() -> None:
    """The sum p/ε̂ − (2/πE*) ∫ p ln|x − s| ds + x²/2R is the same at all x, and so by the deflection of the panels."""
    contact = solve_winkler_contact(FORCE, RADIUS, STIFFNESS, PENALTY)
    a = contact.half_width

    def left_side(x: float) -> float:
        def pressure(s: float) -> float:
            return float(contact.pressure(np.array([s]))[0])

        parts = [quad(lambda s: pressure(s) * log(abs(x - s)), *ends, epsrel=1e-11)[0] for ends in ((-a, x), (x, a))]
        return pressure(x) / PENALTY - 2 / (np.pi * STIFFNESS) * float(sum(parts)) + x**2 / (2 * RADIUS)

    values = [left_side(x) for x in a * np.array([0.0, 0.21, 0.4, 0.77, 0.95])]
    assert np.ptp(values) <= 1e-8 * a**2 / (2 * RADIUS)
    x = a * PLACES
    sides = contact.pressure(x) / PENALTY + contact.deflection(x) / STIFFNESS + x**2 / (2 * RADIUS)
    assert np.abs(sides - contact.approach).max() <= 1e-12 * a**2 / (2 * RADIUS)


@pytest.mark.parametrize(("ratio", "shortfall"), [(0.01, 0.317), (0.03, 0.313), (0.1, 0.301)])
def test_a_stiff_layer_lowers_the_peak(ratio: float, shortfall: float) -> None:
    """The relative shortfall over the ratio E*/(ε̂ a), with the half-width a of Hertz, was computed apart."""
    a, p = hertz.half_width(FORCE, RADIUS, STIFFNESS), hertz.peak(FORCE, RADIUS, STIFFNESS)
    contact = solve_winkler_contact(FORCE, RADIUS, STIFFNESS, STIFFNESS / (ratio * a))
    assert (1 - contact.peak / p) / ratio == pytest.approx(shortfall, abs=1e-3)
    assert contact.half_width > a


@pytest.mark.parametrize("layer", [1e-12, 1e-15])
def test_a_layer_that_counts_for_nothing_leaves_the_pressure_of_hertz(layer: float) -> None:
    pressure, rigid = layer_contact(1.0, 1000.0, 1.0, 1 / layer), hertz_contact(1.0, 1000.0, 1.0)
    assert abs(pressure.force / rigid.force - 1) <= 1e-8


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
    numbers = FORCE * force / length, RADIUS * length, STIFFNESS * stress, PENALTY * stress / length
    other = solve_winkler_contact(*numbers)
    assert other.half_width / length == pytest.approx(plain.half_width, rel=1e4 * UNIT_ROUNDOFF)
    assert other.peak / stress == pytest.approx(plain.peak, rel=1e5 * UNIT_ROUNDOFF)


@pytest.mark.parametrize("name", ["half_width", "radius", "stiffness", "penalty"])
def test_a_number_that_is_not_positive_is_refused(name: str) -> None:
    numbers = {"half_width": 1.0, "radius": 1.0, "stiffness": 1.0, "penalty": 1.0} | {name: 0.0}
    with pytest.raises(MisuseError, match=rf"{name}: found 0\.0"):
        layer_contact(**numbers)


# --- fields of a half-plane -------------------------------------------------------------------------------------


def _places(least: float) -> tuple[FloatArray, FloatArray]:
    x, depth = np.meshgrid(np.linspace(-4, 4, 9) + 0.1, np.geomspace(least, 8, 7))
    return x.ravel(), depth.ravel()


def _slopes(
    field: Callable[[FloatArray, FloatArray], FloatArray], x: FloatArray, depth: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return ∂/∂x and ∂/∂η by differences of fourth order."""

    def slope(along: float, down: float) -> FloatArray:
        values = [field(x + n * along, depth + n * down) for n in (-2, -1, 1, 2)]
        return (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * STEP)

    return slope(STEP, 0.0), slope(0.0, STEP)


def mcewan_stresses(x: FloatArray, depth: FloatArray) -> FloatArray:
    """Return σ_xx, σ_ηη and σ_xη (..., 3) of Hertz' pressure, half-width and peak 1 (McEwan; Johnson, 4.49)."""
    inside = 1 - x**2 + depth**2
    root = np.hypot(inside, 2 * x * depth)
    m = np.sqrt((root + inside) / 2)
    n = np.copysign(np.sqrt(np.maximum(root - inside, 0.0) / 2), x)
    square = m**2 + n**2
    share = (depth**2 + n**2) / square
    return -np.stack([m * (1 + share) - 2 * depth, m * (1 - share), n * (m**2 - depth**2) / square], axis=-1)


@pytest.mark.parametrize(("least", "bound"), [(1.0, 1e-11), (0.25, 1e-8), (0.1, 1e-4)])
def test_superposed_line_loads_give_the_stresses_of_mcewan(least: float, bound: float) -> None:
    x, depth = _places(least)
    assert np.abs(stresses(PRESSURES["Hertz"], x, depth) - mcewan_stresses(x, depth)).max() <= bound


@EACH_PRESSURE
def test_stresses_are_in_equilibrium_and_displacements_obey_hookes_law(pressure: LinePressure) -> None:
    x, depth = _places(0.5)
    along, down = _slopes(lambda at, down: stresses(pressure, at, down), x, depth)
    assert np.abs(along[:, 0] + down[:, 2]).max() <= 1e-9 * pressure.peak
    assert np.abs(along[:, 2] + down[:, 1]).max() <= 1e-9 * pressure.peak
    along, down = _slopes(lambda at, down: displacements(pressure, at, down, YOUNG, POISSON), x, depth)
    s_x, s_y, s_xy = stresses(pressure, x, depth).T
    square, product = 1 - POISSON**2, POISSON * (1 + POISSON)
    shear = YOUNG / (2 * (1 + POISSON)) * (along[:, 1] + down[:, 0])
    for strain, expected in (
        (YOUNG * along[:, 0], square * s_x - product * s_y),
        (YOUNG * down[:, 1], square * s_y - product * s_x),
        (shear, s_xy),
    ):
        assert strain == pytest.approx(expected, abs=1e-9 * pressure.peak)


@EACH_PRESSURE
def test_the_surface_moves_as_the_limit_of_small_depths(pressure: LinePressure) -> None:
    beside = np.array([-4.0, -1.5, 2.0])
    expected = displacements(pressure, beside, np.zeros(3), YOUNG, POISSON)
    assert surface_displacements(pressure, beside, YOUNG, POISSON) == pytest.approx(expected, abs=1e-10)
    inside = np.array([-0.5, 0.0, 0.7])
    near, nearer = (displacements(pressure, inside, np.full(3, depth), YOUNG, POISSON) for depth in (0.1, 0.05))
    limit = surface_displacements(pressure, inside, YOUNG, POISSON)
    assert np.abs(2 * nearer - near - limit).max() <= 0.02 * pressure.peak  # Linear extrapolation to the surface.


def test_a_box_cut_out_of_the_half_plane_is_in_balance() -> None:
    pressure = PRESSURES["layer"]
    points, weights = np.polynomial.legendre.leggauss(80)
    depth, x = 4 + 4 * points, 4 * points
    right, left = (stresses(pressure, np.full(80, side), depth) for side in (4.0, -4.0))
    below = stresses(pressure, x, np.full(80, 8.0))
    total = 4 * weights @ (below[:, 1] + right[:, 2] - left[:, 2])
    assert total == pytest.approx(-pressure.force, rel=1e-10)
