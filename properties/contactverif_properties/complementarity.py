"""Multipliers in a solution: none of them pulls, and the scale by which contact is decided has no part in it."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import Traits
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import Subject
from contactverif.mechanics.newton import System, Trace, solve
from contactverif.mechanics.scene import scene_of
from contactverif.strategies.solids import solid_cases
from contactverif_properties.newton import ended, floor_of, solutions_are_unique, units_of, untouched

SCALE = 8.0  # times smaller, the other one
TOLERANCE = "max(1e3 u/cond, 30 u X)/ℓ"
PULLING = Quantity(
    "multiplier that pulls",
    "1",
    TOLERANCE,
    "one below zero is let go, here as the length that does as much to forces; the rest is what a system is solved to",
)
MOVED = Quantity(
    "moved by another scale c",
    "1",
    TOLERANCE,
    "the scale of the decision λ − c g ≥ 0 has no part in the solution; the rest is what a linear system is solved to",
)


def solved_with_multipliers(case: Case, subject: Subject) -> Measurement:
    """A tilted block pressed on another, in many cases so that contact ends within the interface.

    Returns
    -------
    Measurement
        The most negative multiplier, and how far positions and multipliers move if contact is decided with another
        scale c; both over ℓ, a multiplier as the length that does as much to the forces. Details: how it ended, and
        whether the solution was found again with the other scale.

    Source: verification 10, complementarity.
    """
    scene = scene_of(case)
    system = System(scene, subject.for_case(case))
    trace = _solution(system)
    if not trace.converged:
        return Measurement({}, {}, details=ended(trace), undecided=f"Newton found no solution: {trace.end.label}")
    solution, n_free = trace.u[-1], scene.n_free
    pairing = system.pair(solution)
    condition = system.step(system.matrix(solution, pairing)[0], np.zeros(system.size)).condition
    if condition <= 0:
        return Measurement({}, {}, details=ended(trace), undecided="the matrix has no inverse at the solution")
    units, length = units_of(system, solution, pairing), case.shortest_segment
    floor = floor_of(system, solution, pairing, condition) / length
    lengths: FloatArray = solution / units / length
    values = {PULLING.name: float(np.maximum(-lengths[n_free:], 0.0).max(initial=0.0))}
    other = subject.with_penalty(subject.penalty(case) / SCALE)
    again = solve(scene, other, start=solution)
    if again.converged:
        values[MOVED.name] = float((np.abs(again.u[-1] - solution) / units).max()) / length
    details = ended(trace) | {"found with another scale": float(again.converged)}
    return Measurement(values, dict.fromkeys(values, floor), details=details, idle=untouched(system, trace))


def _solution(system: System) -> Trace:
    trace = solve(system.scene, system.formulation)
    if trace.converged:
        return trace
    return solve(system.scene, system.formulation, use_tangent=False)  # a wrong tangent may never get there


def _has_multipliers(traits: Traits) -> str:
    if traits.enforcement != "multiplier":
        return f"the enforcement is by a {traits.enforcement}"
    return solutions_are_unique(traits)


COMPLEMENTARITY = Property(
    id="complementarity",
    family="multipliers",
    summary="no multiplier of a solution pulls, and the scale that contact is decided by has no part in the solution",
    quantities=(PULLING, MOVED),
    cases=solid_cases,
    measure=solved_with_multipliers,
    promise=lambda traits: None if _has_multipliers(traits) else True,
    applicable=_has_multipliers,
    bodies=True,
)
