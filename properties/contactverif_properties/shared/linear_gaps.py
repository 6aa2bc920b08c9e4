"""The forces of a straight or plane slave on a flat master: the gap is linear, so its integrals are exact.

A formulation measures the gap along the master's normal or along the slave's, and pushes along one of them. Its traits
`gap` and `force_along` say which. Gaps are computed in rationals from the stored nodes.
"""

from __future__ import annotations

from fractions import Fraction
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE, Surface
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif_properties.shared.uniform_pressure import pushing_forces, uniform_state

ALONG_MASTER = ("closest point", "cells and nodes")  # The rules `gap` that measure along the master's normal.


def knows_linear_total(traits: Traits) -> bool:
    """Return whether the traits say what the total force of a linear gap is."""
    stated = traits.rules.penalty == "distributed" and None not in (traits.rules.area, traits.rules.force_along)
    return stated and (traits.rules.gap is not None or traits.rules.enforcement == "multiplier")


def slave_forces(case: Case, subject: Subject) -> FloatArray:
    """Return the forces (n_slave_nodes, dim) that push the slave; multipliers are all `uniform_multiplier`."""
    forces = pushing_forces(uniform_state(case, subject, uniform_multiplier(case)))
    return forces[: case.interface.n_slave_nodes]


def uniform_multiplier(case: Case) -> float:
    """Return the pressure of a mean gap along the master's normal, ε̂ |g|."""
    return case.penalty * abs(float(node_gaps(case).mean()))


def node_gaps(case: Case) -> FloatArray:
    """Return the gaps (n_slave_nodes,) of the slave's nodes along the master's normal, each rounded once."""
    if case.interface.dim != PLANE:
        corners = _largest_face(case, case.interface.master)
        normal = _normal_of_face(corners)
        heights = (_exact(case.positions[: case.interface.n_slave_nodes]) - corners[0]) @ normal
        return np.array([float(height) for height in heights]) / sqrt(normal @ normal)
    first, second = _longest_segment(case)
    along, arms = second - first, _exact(case.positions[: case.interface.n_slave_nodes]) - first
    areas = arms[:, 0] * along[1] - arms[:, 1] * along[0]
    return np.array([float(area) for area in areas]) / sqrt(along @ along)


def directions(case: Case) -> tuple[FloatArray, FloatArray]:
    """Return the unit normals (dim,) along the master's and along the slave's, both out of the master."""
    if case.interface.dim != PLANE:
        faces = [_largest_face(case, side) for side in (case.interface.master, case.interface.slave)]
        of_master, of_slave = (_unit(_normal_of_face(corners)) for corners in faces)
        return of_master, -of_slave
    ends = _longest_segment(case), _exact(case.positions[case.interface.slave.segments[0]])
    (x, y), (x_slave, y_slave) = (second - first for first, second in ends)
    return (
        np.array([float(y), -float(x)]) / sqrt(x * x + y * y),
        np.array([-float(y_slave), float(x_slave)]) / sqrt(x_slave * x_slave + y_slave * y_slave),
    )


def exact_slave_forces(case: Case, traits: Traits) -> FloatArray:
    """Return the exact integrals ε̂ ∫N_i |g| ds n (n_slave_nodes, dim) that push the slave's nodes.

    The traits `gap` and `force_along` name the normals, `area` the configuration of ds. With multipliers the pressure
    is `uniform_multiplier` everywhere. The sum is the total of every formulation with these traits.
    """
    interface, (of_master, of_slave) = case.interface, directions(case)
    measures = interface.slave.measures(interface.nodes if traits.rules.area == "reference" else case.positions)
    depths = -node_gaps(case) / (1.0 if traits.rules.gap in ALONG_MASTER else float(of_master @ of_slave))
    pressures = case.penalty * depths
    if traits.rules.enforcement == "multiplier":
        pressures = np.full_like(pressures, uniform_multiplier(case))
    nodal = np.zeros(interface.n_slave_nodes)
    if interface.dim == PLANE:
        for (a, b), length in zip(interface.slave.segments, measures, strict=True):
            nodal[a] += length * (2 * pressures[a] + pressures[b]) / 6
            nodal[b] += length * (pressures[a] + 2 * pressures[b]) / 6
    else:  # ∫ N_i N_j over a triangle is a twelfth of its area, and a sixth for i = j.
        for face, area in zip(interface.slave.faces, measures, strict=True):
            nodal[face] += area * (pressures[face] + pressures[face].sum()) / 12
    return np.outer(nodal, of_master if traits.rules.force_along == "master normal" else of_slave)


def _longest_segment(case: Case) -> NDArray[Any]:
    """Return the exact ends (2, 2) of the longest master segment, on whose line all others lie."""
    master = case.interface.master
    return _exact(case.positions[master.segments[int(np.argmax(master.lengths(case.positions)))]])


def _largest_face(case: Case, surface: Surface) -> NDArray[Any]:
    """Return the exact corners (3, 3) of the largest triangle of a plane surface."""
    return _exact(case.positions[surface.faces[int(np.argmax(surface.measures(case.positions)))]])


def _normal_of_face(corners: NDArray[Any]) -> NDArray[Any]:
    """Return the exact normal (3,) of a triangle, as long as twice its area, out of its body."""
    (a, b, c), (d, e, f) = corners[1] - corners[0], corners[2] - corners[0]
    return np.array([b * f - c * e, c * d - a * f, a * e - b * d], dtype=object)


def _unit(vector: NDArray[Any]) -> FloatArray:
    """Return an exact vector (3,) over its length."""
    return np.array([float(entry) for entry in vector]) / sqrt(vector @ vector)


def _exact(points: FloatArray) -> NDArray[Any]:
    """Return points as an array of fractions."""
    return np.array([Fraction(value) for value in points.reshape(-1).tolist()], dtype=object).reshape(points.shape)
