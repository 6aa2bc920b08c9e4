"""The patch test of a class of flat meshes, on the interface alone and solved: forces, gaps and reported pressures.

Rule for the next editor: who passes the test of a class passes that of each smaller class. The traits are read so, and
a formulation that states the larger promise alone is asked about all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, check_all
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.contract.traits import Traits
from contactverif.oracle import is_of_class
from contactverif.strategies.solids import block_cases
from contactverif_properties.shared.finite_lists import Cases
from contactverif_properties.shared.patch_errors import point_errors
from contactverif_properties.shared.roundoff import COORDINATE_ROUNDING, gap_quantity, gap_tolerance
from contactverif_properties.shared.uniform_pressure import transmission_error

FORCE = gap_quantity("error of a nodal force")
GAP = gap_quantity("error of a reported gap")
PRESSURE = gap_quantity("error of a reported pressure")
LOST_END = "a slave node faces a free end of the master exactly, and roundoff decides whether it is over the master"
_MOVED = 16.0  # A moved end node bends shares by 128uX over a segment, which the tolerance 8uX/|g| does not cover.
USUAL_UNDECIDED = 0.07  # The share for NTS-AR without a tolerance past free ends; built-in formulations have 0.
CLASS_QUANTITIES = (FORCE, GAP, PRESSURE)


def promise_single(traits: Traits) -> bool | None:
    """Return the promise for meshes with master nodes on slave nodes and in the middle of slave segments."""
    return True if traits.passes_flat_patch else traits.passes_single_patch


def promise_normal(traits: Traits) -> bool | None:
    """Return the promise for meshes with master nodes on slave nodes."""
    return True if promise_single(traits) else traits.passes_normal_patch


def measure_class(case: Case, subject: Subject) -> Measurement:
    """Compare forces, reported gaps and reported pressures of a uniform penetration with the exact ones.

    Parameters
    ----------
    case : Case
        A flat case with the parameter `penetration`, a length.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        All dimensionless: the largest |F − F_exact| / (ε̂ |g| L) over the nodes of both surfaces; the largest error of
        a reported gap over |g|, and of a reported pressure over ε̂ |g|. The last two are missing where the formulation
        reports no contact points, and pressures also where it is nodal and so knows forces only.
    """
    measurement = _measure(case, subject)
    if _is_within(measurement, 1.0):
        return measurement
    inside = _end_inside(case)
    loses_end = inside is not None and _heals(measurement, _measure(inside, subject))
    return replace(measurement, undecided=LOST_END if loses_end else "")


def _measure(case: Case, subject: Subject) -> Measurement:
    """Return the numbers of `measure_class`; nothing is undecided yet."""
    error, tolerance = transmission_error(case, subject)
    values, tolerances = {FORCE: error}, {FORCE: tolerance}
    formulation = subject.for_case(case)
    if "contact_points" in formulation.provides:
        tolerance = gap_tolerance(case, case.parameter("penetration"))
        gap, pressure = _point_errors(case, formulation)
        values[GAP], tolerances[GAP] = gap, tolerance
        if subject.traits.penalty != "nodal":
            values[PRESSURE], tolerances[PRESSURE] = pressure, tolerance
    return Measurement(check_all(values, tolerances))


def _is_within(measurement: Measurement, factor: float) -> bool:
    """Return whether all values are at most `factor` times their tolerances."""
    return all(number.value <= factor * number.tolerance for number in measurement.numbers)


def _heals(before: Measurement, after: Measurement) -> bool:
    """Return whether values that failed are at roundoff afterwards, and a quarter of what they were or less."""
    failures = [number.quantity.name for number in before.numbers if number.value > number.tolerance]
    return _is_within(after, _MOVED) and all(4 * after.values[name] <= before.values[name] for name in failures)


def _point_errors(case: Case, formulation: CheckedFormulation) -> tuple[float, float]:
    """Return `point_errors` of a uniform penetration; multipliers, if any, are all ε̂ |g|."""
    pressure = case.penalty * case.parameter("penetration")
    state = case.with_multipliers(np.full(formulation.n_multipliers(case.interface), pressure))
    points = formulation.contact_points(state.interface, formulation.pair(state.interface, state.z), state.z)
    return point_errors(state, points, case.penalty, pressure)


def _end_inside(case: Case) -> Case | None:
    """Return the case with end nodes of the slave that face a free end of the master exactly moved inwards by roundoff.

    Roundoff decides whether such a node is over the master. None if there is no such node.
    """
    interface, along = case.interface, case.parameters["along"].copy()
    reach = COORDINATE_ROUNDING * case.largest_coordinate
    slave = interface.slave
    master_ends = along[interface.master.segments[interface.master.neighbours < 0]]
    positions = case.positions.copy()
    moved = False
    for segment, end in np.argwhere(slave.neighbours < 0):
        node, other = slave.segments[segment, [end, 1 - end]]
        if np.abs(master_ends - along[node]).min(initial=np.inf) <= reach:
            step = 2 * reach * np.sign(along[other] - along[node])
            along[node] += step
            positions[node] += step * case.parameters["direction"]
            moved = True
    if not moved:
        return None
    return replace(case, z=positions.reshape(-1), parameters={**case.parameters, "along": along})


def list_or_scene(make: Callable[[], Cases], *, midpoints: bool) -> Callable[[Any], Any]:
    """Return a function for `Property.cases`: the finite list, or a scene that is given, if it is of the class."""

    def cases(scene: Case | None) -> Any:
        if scene is None:
            return make()
        states = block_cases(scene)
        fits = states is not None and is_of_class(scene.interface, scene.parameters["along"], midpoints=midpoints)
        return states if fits else None

    return cases
