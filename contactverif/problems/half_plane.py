"""Stresses and displacements in an elastic half-plane under a pressure on its surface.

Axes: x along the surface, the depth η ≥ 0 into the body. A stress is positive in tension. Displacements are those of
plane strain, with E' = E/(1 − ν²) and ν' = ν/(1 − ν); they grow like ln r, so that only differences mean something.

Rule for the next editor: nothing here knows a mesh, a body or a formulation.

References
----------
K. L. Johnson, Contact Mechanics (1985), equations 2.14 and 2.19 (line load, Flamant), 2.24 (displacements of the
surface) and 4.49 (McEwan's stresses under Hertz' pressure).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import pi

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.problems.line_pressure import LinePressure, gauss_rule

_POINTS = 8  # Number of Gauss points on each edge of a loaded side.
_CHUNK = 512  # Number of points that are superposed at once, so that tables stay in the cache.


def line_load_stresses(x: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the stresses σ_xx, σ_ηη and σ_xη (..., 3) of a line load of 1 that presses at x = 0 (Johnson, 2.14)."""
    factor = -2 * depth / (pi * (x**2 + depth**2) ** 2)
    return np.stack([factor * x**2, factor * depth**2, factor * x * depth], axis=-1)


def line_load_displacements(x: FloatArray, depth: FloatArray, poisson: float) -> FloatArray:
    """Return E/(1 − ν²) times the displacements (..., 2) of a line load of 1 per thickness at x = 0 (Johnson, 2.19).

    They are along x and into the body, without unit.
    """
    contraction, square = poisson / (1 - poisson), x**2 + depth**2
    along = -(1 - contraction) * np.arctan2(x, depth) + (1 + contraction) * x * depth / square
    into = -np.log(square) - (1 + contraction) * x**2 / square
    return np.stack([along, into], axis=-1) / pi


def stresses(pressure: LinePressure, x: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the stresses σ_xx, σ_ηη and σ_xη (n, 3) under a pressure, by superposing Flamant's solution.

    Places x and depth (n,) are some way from the loaded strip: the error is 1e-11 of the peak at a distance a, 1e-8 at
    a/4.
    """
    places, forces = pressure.line_loads()
    parts = [
        np.einsum("psk,s->pk", line_load_stresses(along[:, None] - places, down[:, None]), forces)
        for along, down in _chunks(x, depth)
    ]
    return np.concatenate(parts)


def displacements(pressure: LinePressure, x: FloatArray, depth: FloatArray, young: float, poisson: float) -> FloatArray:
    """Return the displacements (n, 2) along x and into the body under a pressure, by superposing Flamant's solution.

    Places x and depth (n,) are some way from the loaded strip. Lengths in the logarithm are over the half-width.
    """
    places, forces = pressure.line_loads()
    unit = pressure.half_width
    parts = [
        np.einsum(
            "psk,s->pk",
            line_load_displacements((along[:, None] - places) / unit, down[:, None] / unit, poisson),
            forces,
        )
        for along, down in _chunks(x, depth)
    ]
    return np.concatenate(parts) * (1 - poisson**2) / young


def surface_displacements(pressure: LinePressure, x: FloatArray, young: float, poisson: float) -> FloatArray:
    """Return the displacements (n, 2) of the surface at x (n,), anywhere, along x and into the body (Johnson, 2.24).

    Their constants are those of `displacements`.
    """
    beyond = pressure.force - 2 * pressure.force_up_to(x)
    contraction = poisson / (1 - poisson)
    along = (1 - contraction) / 2 * beyond
    into = pressure.deflection(x) - (1 + contraction) / pi * pressure.force
    return np.stack([along, into], axis=-1) * (1 - poisson**2) / young


def side_forces(pressure: LinePressure, x: FloatArray, depth: FloatArray) -> FloatArray:
    """Return the nodal forces (m, n, 2) of the half-plane's stresses on both sides and on the far edge of a box.

    They are along x and into the body, at columns x (n,) and rows (m,).
    """
    forces = np.zeros((len(depth), len(x), 2))

    def traction_on_side(place: float, depths: FloatArray) -> FloatArray:
        return stresses(pressure, np.full(len(depths), place), depths)[:, [0, 2]]

    def traction_below(places: FloatArray) -> FloatArray:
        return stresses(pressure, places, np.full(len(places), float(depth[-1])))[:, [2, 1]]

    for column, sign in ((0, -1), (-1, 1)):
        forces[:, column] += sign * _edge_forces(depth, partial(traction_on_side, float(x[column])))
    forces[-1] += _edge_forces(x, traction_below)
    return forces


def _edge_forces(lines: FloatArray, traction: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Return ∫ N_i t ds (n, 2) along a side with nodes at `lines` (n,)."""
    points, weights = gauss_rule(_POINTS)
    share, lengths = (points + 1) / 2, np.diff(lines)
    places = lines[:-1, None] + share * lengths[:, None]
    values = traction(places.reshape(-1)).reshape(*places.shape, 2) * (weights / 2 * lengths[:, None])[..., None]
    forces = np.zeros((len(lines), 2))
    forces[:-1] += np.einsum("p,epk->ek", 1 - share, values)
    forces[1:] += np.einsum("p,epk->ek", share, values)
    return forces


def _chunks(x: FloatArray, depth: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    count = max(1, -(-len(x) // _CHUNK))
    return list(zip(np.array_split(x, count), np.array_split(depth, count), strict=True))
