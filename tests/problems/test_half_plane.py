"""Fields of a half-plane: equilibrium, Hooke's law, McEwan against superposed Flamant, and the surface."""

import numpy as np
import pytest

from contactverif.contract.arrays import FloatArray
from contactverif.problems.hertz import (
    LinePressure,
    displacements,
    hertz_pressure,
    layer_contact,
    stresses,
    surface_displacements,
)

YOUNG, POISSON = 2.0, 0.3
PRESSURES = {"Hertz": hertz_pressure(1.0, 1.0), "layer": layer_contact(1.0, 1.0, 2.0, 20.0)}
STEP = 1e-3


def _places(least: float) -> tuple[FloatArray, FloatArray]:
    x, depth = np.meshgrid(np.linspace(-4, 4, 9) + 0.1, np.geomspace(least, 8, 7))
    return x.ravel(), depth.ravel()


def _slopes(field: object, x: FloatArray, depth: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return ∂/∂x and ∂/∂η by differences of fourth order."""
    assert callable(field)

    def slope(along: float, down: float) -> FloatArray:
        values = [field(x + n * along, depth + n * down) for n in (-2, -1, 1, 2)]
        result: FloatArray = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * STEP)
        return result

    return slope(STEP, 0.0), slope(0.0, STEP)


def mcewan_stresses(x: FloatArray, depth: FloatArray, half_width: float, peak: float) -> FloatArray:
    """Return the stresses σ_xx, σ_ηη and σ_xη (..., 3) under Hertz' pressure in closed form (McEwan; Johnson, 4.49)."""
    inside = half_width**2 - x**2 + depth**2
    root = np.hypot(inside, 2 * x * depth)
    m = np.sqrt((root + inside) / 2)
    n = np.copysign(np.sqrt(np.maximum(root - inside, 0.0) / 2), x)
    square = np.maximum(m**2 + n**2, np.finfo(float).tiny)
    share = (depth**2 + n**2) / square
    normal = [m * (1 + share) - 2 * depth, m * (1 - share)]
    shear = n * (m**2 - depth**2) / square
    return -peak / half_width * np.stack([*normal, shear], axis=-1)


@pytest.mark.parametrize(("least", "bound"), [(1.0, 1e-11), (0.25, 1e-8), (0.1, 1e-4)])
def test_superposed_line_loads_give_the_stresses_of_mcewan(least: float, bound: float) -> None:
    x, depth = _places(least)
    errors = np.abs(stresses(PRESSURES["Hertz"], x, depth) - mcewan_stresses(x, depth, 1.0, 1.0))
    assert errors.max() <= bound


def test_the_stresses_of_mcewan_end_at_the_surface_as_the_pressure_does() -> None:
    x = np.array([-1.5, -0.6, 0.0, 0.3, 0.9, 2.0])
    along, into, shear = mcewan_stresses(x, np.zeros(6), 1.0, 1.0).T
    pressure = np.sqrt(np.maximum(1 - x**2, 0))
    assert into == pytest.approx(-pressure, abs=1e-14)
    assert along == pytest.approx(-pressure, abs=1e-14)
    assert shear == pytest.approx(0, abs=1e-14)


@pytest.mark.parametrize("pressure", PRESSURES.values(), ids=PRESSURES)
def test_the_stresses_are_in_equilibrium(pressure: LinePressure) -> None:
    x, depth = _places(0.5)
    along, down = _slopes(lambda at, down: stresses(pressure, at, down), x, depth)
    assert np.abs(along[:, 0] + down[:, 2]).max() <= 1e-9 * pressure.peak
    assert np.abs(along[:, 2] + down[:, 1]).max() <= 1e-9 * pressure.peak


@pytest.mark.parametrize("pressure", PRESSURES.values(), ids=PRESSURES)
def test_the_displacements_obey_the_law_of_hooke(pressure: LinePressure) -> None:
    x, depth = _places(0.5)
    along, down = _slopes(lambda at, down: displacements(pressure, at, down, YOUNG, POISSON), x, depth)
    s_x, s_y, s_xy = stresses(pressure, x, depth).T
    square, product = 1 - POISSON**2, POISSON * (1 + POISSON)
    assert YOUNG * along[:, 0] == pytest.approx(square * s_x - product * s_y, abs=1e-9 * pressure.peak)
    assert YOUNG * down[:, 1] == pytest.approx(square * s_y - product * s_x, abs=1e-9 * pressure.peak)
    shear = YOUNG / (2 * (1 + POISSON)) * (along[:, 1] + down[:, 0])
    assert shear == pytest.approx(s_xy, abs=1e-9 * pressure.peak)


@pytest.mark.parametrize("pressure", PRESSURES.values(), ids=PRESSURES)
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
