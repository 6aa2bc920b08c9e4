"""The errors of a solved patch test: nodal forces, heights, and what the formulation reports at its contact points."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import Surface
from contactverif.mechanics.scene import Scene
from contactverif.problems.blocks import overhangs
from contactverif_properties.shared.roundoff import COORDINATE_ROUNDING
from contactverif_properties.shared.uniform_pressure import consistent_forces, normal_of


def force_errors(case: Case, scene: Scene, forces: FloatArray, q: FloatArray, pressure: float) -> tuple[float, float]:
    """Return the largest error of a nodal force on the slave and on the master, over p L.

    Forces are judged twice: those that the bodies need to be in balance with the unknowns q (n_free,), and those that
    the formulation gives (n_unknowns + n_multipliers,). They differ where the formulation found no balance, and at
    rollers, which take what the bodies do not need.
    """
    by_bodies = scene.nodal_forces(q)
    by_contact = -forces[: case.interface.n_unknowns].reshape(-1, 2)
    first = 0
    for index in scene.bodies_in_reach:
        last = first + len(scene.bodies[index].contact_nodes)
        if scene.bodies[index].rigid:
            by_bodies[first:last] = by_contact[first:last]
        first = last
    exact = consistent_forces(case, pressure)
    errors = np.maximum(*(np.linalg.norm(forces - exact, axis=1) for forces in (by_bodies, by_contact)))
    errors /= pressure * case.slave_length
    n_slave = case.interface.n_slave_nodes
    return float(errors[:n_slave].max()), float(errors[n_slave:].max())


def gap_error(case: Case, penetration: float, size: float) -> float:
    """Return by how much a node departs from a plane slave at `penetration` below a plane master, over `size`.

    A slave node beside the master stands for the place opposite the master's end, since what overhangs may bend.
    """
    heights = case.positions @ normal_of(case)
    n_slave = case.interface.n_slave_nodes
    slave, master = np.split(case.parameters["along"], [n_slave])
    order = np.argsort(slave)
    heights[:n_slave] = np.interp(np.clip(slave, master.min(), master.max()), slave[order], heights[:n_slave][order])
    level = heights[n_slave:].mean()
    errors = np.abs(heights - level + np.where(np.arange(len(heights)) < n_slave, penetration, 0.0))
    return float(errors.max() / size)


def point_errors(case: Case, points: ContactPoints, penalty: float, pressure: float) -> tuple[float, float]:
    """Return the largest error of a reported gap over p/ε̂, and of a reported pressure over p.

    Idle points do not count if they have no weight, no master segment, or lie beside the master. The error of the
    pressure is infinite if no point counts.
    """
    in_contact = points.active | (points.master_segment >= 0) & ~beside_master(case, points)
    counted = (points.weight != 0) & in_contact
    gaps = np.where(counted, points.gap, -pressure / penalty)  # A gap is NaN where it is meaningless.
    gap = float(np.nanmax(np.abs(gaps * penalty / pressure + 1), initial=0.0))
    pressures = np.where(points.active, points.pressure, 0.0)[counted]
    if not len(pressures):
        return gap, np.inf
    return gap, float(np.abs(pressures - pressure).max(initial=0.0) / pressure)


def beside_master(case: Case, points: ContactPoints) -> BoolArray:
    """Return which points (n_points,) lie beside the other surface, or within roundoff of its end.

    A point that names no place on its surface does not lie beside the other. Where the master covers the slave, no
    point of the slave does. A point of a second pass lies on the master, and the other surface is the slave.
    """
    beside = np.zeros(len(points.c), bool)
    covered = not overhangs(case)
    rounding = COORDINATE_ROUNDING * case.largest_coordinate
    interface, along = case.interface, case.parameters["along"]
    for surface, other, second in (
        (interface.slave, interface.master, False),
        (interface.master, interface.slave, True),
    ):
        here = (points.on_master == second) & (points.slave_segment >= 0)
        if here.any() and (second or not covered):
            ends, c = along[surface.segments[points.slave_segment[here]]], points.c[here]
            place = (1 - c) / 2 * ends[:, 0] + (1 + c) / 2 * ends[:, 1]
            beside[here] = ~_faces(place, other, along, rounding)
    return beside


def _faces(place: FloatArray, surface: Surface, along: FloatArray, rounding: float) -> BoolArray:
    """Return which places (n,) along the interface a surface covers, up to `rounding` from its free ends."""
    ends = along[surface.segments]  # (n_segments, 2)
    inwards = np.sign(ends[:, ::-1] - ends)
    ends = ends + np.where(surface.neighbours < 0, rounding, -rounding) * inwards
    low, high = ends.min(axis=1), ends.max(axis=1)
    covered: BoolArray = ((place[:, None] >= low) & (place[:, None] <= high)).any(axis=1)
    return covered
