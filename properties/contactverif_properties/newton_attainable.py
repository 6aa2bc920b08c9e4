"""Ask whether Newton's method attains the accuracy that the conditioning allows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import frexp, ldexp
from typing import NamedTuple

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.interface import Interface
from contactverif.contract.measurement import Measurement, Quantity, check_all
from contactverif.contract.pairing import Pairing
from contactverif.contract.property import Property
from contactverif.contract.subject import Call, Subject
from contactverif.mechanics.changed_scenes import move, snap
from contactverif.mechanics.linear import scale_factors
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.mechanics.system import ROUNDOFF_FACTOR, System
from contactverif.strategies.solids import closed_cases
from contactverif_properties.shared.applicability import refuse_dependent_multipliers
from contactverif_properties.shared.conditioning import (
    MOST_ROUNDINGS,
    Conditioning,
    conditioning_of,
    difference_quotient,
    forces_quantity,
)
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.kinks import find_kink
from contactverif_properties.shared.newton_solution import find_solution, is_untouched, solution_details
from contactverif_properties.shared.roundoff import COORDINATE_ROUNDING, ratio

DIGITS = 32  # Coordinates are multiples of 2^-32 segments, so that the longest way rounds none.
OFFSETS = (0, 5, 10, 15, 20)  # The ways: 2 to these powers, in segments.
LOAD_SHARES = (1.0, 0.875, 0.75)  # If a jump of the forces leaves no solution under one load, another load has one.
N_STEPS = 3  # From the solution near the origin, with the matrix there, a step leaves what roundoff does.
ADDED = forces_quantity("roundings that the formulation adds")
RESIDUAL = Quantity(
    "attained residual",
    "1 (times its roundoff)",
    "A stored position is rounded to uX twice, and the bodies' forces to u(|S| |q| + |g|); 8 roundings allow for it.",
)
ERROR = Quantity(
    "attained error of the solution",
    "1 (times what that residual makes of it)",
    "A residual r moves the solution by J⁻¹ r.",
)


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """The solution of the scene near the origin, and what roundoff may do to it."""

    system: System  # The scene with its formulation.
    u: FloatArray  # (n_free + n_multipliers,) The unknowns.
    pairing: Pairing | None  # The pairing.
    # (n_free + n_multipliers, n_free + n_multipliers) The derivative J of the residual there, by differences.
    matrix: FloatArray
    units: FloatArray  # (n_free + n_multipliers,) The unit of each unknown that corresponds to a unit of length.
    inverse: FloatArray  # (n_free + n_multipliers, n_free + n_multipliers) |J⁻¹|, entry by entry.
    # (n_free + n_multipliers,) The change of the residual by a move of all nodes by a unit of length, Σ |K|.
    contact: FloatArray
    # (n_free + n_multipliers,) The sizes of the other terms of the residual, |S| |q| + |g| + |R| and those of
    # multipliers.
    terms: FloatArray
    # What roundings of the positions relative to one another may change in the contact forces.
    conditioning: Conditioning

    def roundoff(self, largest: float) -> FloatArray:
        """Return the roundoff (n_free + n_multipliers,) of the residual where the largest coordinate is `largest`."""
        return ROUNDOFF_FACTOR * UNIT_ROUNDOFF * (self.contact * largest + self.terms)


@dataclass(frozen=True, slots=True)
class Attained:
    """The residual and the accuracy that Newton's method attains in one place."""

    added: float  # ω, the roundings that the formulation adds.
    residual: float  # The attained residual over its roundoff.
    error: float  # The distance from the solution over what that roundoff makes of it.
    length: float  # That distance, a length.
    undecided: str  # The reason why residual and error decide nothing; empty if they do.


@Property.define(
    id="newton.attainable",
    rank=550,
    family="newton",
    quantities=(ADDED, RESIDUAL, ERROR),
    cases=Cases.random(closed_cases),
    promise=lambda traits: traits.promises.translation_stable,
    applicable=refuse_dependent_multipliers,
    bodies=True,
    usual_undecided=0.002,
)
def newton_attainable(case: Case, subject: Subject) -> Measurement:
    """Far from the origin, residual and accuracy are limited by the stored positions alone.

    **Question.** A scene is solved, moved by an exact way of 2^0 to 2^20 segments, and solved again from its own
    solution. At which residual does Newton's method come to rest, how far from the solution, and how much of that is
    the fault of the formulation?

    **Why it matters.** The unknowns are displacements, but a formulation gets positions, and these are stored to u
    times the distance X from the origin. So a residual cannot fall below roundoff of the stored positions, and no
    tolerance tighter than that ever ends the iterations. A formulation that rounds points at the same distance adds its
    own errors to that.

    **How it is judged.** First, the residual of the moved scene is compared with that of the same stored positions
    moved back, which rounds nothing unless the way is shorter than the scene. A formulation that is stable under
    translations differs by at most 16 roundings of the positions relative to one another (ω). Secondly, the residual at
    which three more steps come to rest counts over its roundoff, 8u (|K| X + |S| |q| + |g| + |R|). K is a difference
    quotient of the contact forces, S the stiffness and g the load of the bodies. Thirdly, the distance from the
    solution counts over what a residual of that size makes of it, max |J⁻¹| 8u (…), with J = S + K. The largest number
    of all ways is judged, and those of each way are kept as details.

    **Undecided.** Where Newton's method finds no solution, under 7/8 and 3/4 of the load neither, where the matrix has
    no inverse there, and where the solution is so near a kink that roundoff of the stored positions decides the
    pairing.
    """
    segment = ldexp(0.5, frexp(case.shortest_segment)[1])  # The power of two below the shortest segment.
    scene = snap(scene_of(case), segment * 2.0**-DIGITS)
    for share in LOAD_SHARES:
        system = System(_load_less(scene, share), subject.for_case(case))
        trace = find_solution(system)
        if trace.converged:
            break
    details = solution_details(trace) | {"share of the load": share}
    if not trace.converged:
        return Measurement(details=details, undecided=f"Newton found no solution: {trace.end.label}")
    solution = examine(system, case, trace.u[-1])
    if solution is None:
        return Measurement(details=details, undecided="the matrix has no inverse at the solution")
    places = dict(zip(OFFSETS, settle(solution, case, [segment * 2.0**power for power in OFFSETS]), strict=True))
    for power, attained in places.items():
        details |= {
            f"{ADDED.name} at 2^{power}": attained.added,
            f"{RESIDUAL.name} at 2^{power}": attained.residual,
            f"{ERROR.name} at 2^{power}": attained.error,
            f"error over the shortest segment at 2^{power}": attained.length / case.shortest_segment,
        }
    decided = [attained for attained in places.values() if not attained.undecided]
    values = {ADDED: max(attained.added for attained in places.values())}
    tolerances = {ADDED: MOST_ROUNDINGS}
    if decided:
        values[RESIDUAL] = max(attained.residual for attained in decided)
        values[ERROR] = max(attained.error for attained in decided)
        tolerances |= {RESIDUAL: 1.0, ERROR: 1.0}
    return Measurement(check_all(values, tolerances), details=details, idle=is_untouched(trace))


def _load_less(scene: Scene, share: float) -> Scene:
    """Return the scene with a share of its loads and imposed displacements."""
    if share == 1:
        return scene
    bodies = tuple(replace(body, imposed=share * body.imposed, load=share * body.load) for body in scene.bodies)
    return replace(scene, bodies=bodies)


def examine(system: System, case: Case, u: FloatArray) -> Solution | None:
    """Return the solution u (n_unknowns,) with what roundoff may do to it; None if the matrix has no inverse there.

    The scene of the system lies near the origin.
    """
    scene, n_free, z = system.scene, system.scene.n_free, system.state(u)
    case = replace(case, interface=scene.interface, z=z, n_multipliers=system.n_multipliers)
    state = FrozenState(system.formulation, case, system.pair(u))
    forces = state.residual
    to_unknowns = dense(system.transformation).T  # (n_free + n_multipliers, n_unknowns + n_multipliers)
    derivative = difference_quotient(state)
    rows = to_unknowns @ derivative
    matrix = dense(system.stiffness) + rows @ to_unknowns.T
    condition = system.step(matrix, np.zeros(system.size)).condition
    if condition <= system.size * UNIT_ROUNDOFF:
        return None
    # Supported nodes count too: where an axis is inclined, rounding moves a node off its support.
    contact = np.abs(rows[:, : scene.interface.n_unknowns]).sum(axis=1)
    terms = np.abs(rows[:, scene.interface.n_unknowns :]) @ np.abs(case.multipliers) + np.abs(to_unknowns) @ abs(forces)
    terms[:n_free] += abs(scene.stiffness) @ np.abs(u[:n_free]) + np.abs(scene.load)
    return Solution(
        system=system,
        u=u,
        pairing=state.pairing,
        matrix=matrix,
        units=scale_factors(matrix, n_free)[1],
        inverse=np.abs(linalg.inv(matrix)),
        contact=contact,
        terms=terms,
        conditioning=conditioning_of(case, derivative, forces),
    )


@dataclass(slots=True, eq=False)
class Place:
    """The scene in another place, and how far Newton's method has come there."""

    interface: Interface  # The moved interface.
    way: float  # The move along both axes, a length.
    u: FloatArray  # (n_free + n_multipliers,) The unknowns.
    z: FloatArray = field(default_factory=lambda: np.zeros(0))  # The stored positions, multipliers behind them.
    pairing: Pairing | None = None  # The pairing and the forces there.
    forces: FloatArray = field(init=False)
    residual: FloatArray = field(init=False)  # (n_free + n_multipliers,) The residual there.
    added: float = 0.0  # The largest ω of all steps.
    rests: list[Rest] = field(default_factory=list)  # The state after each step.

    def moves(self, scene: Scene) -> bool:
        """Store the positions at the unknowns, in the place of the scene's own; return whether one has changed."""
        q, multipliers = np.split(self.u, [scene.n_free])
        positions = self.interface.nodes.reshape(-1) + scene.imposed_displacements + scene.transformation @ q
        before, self.z = self.z, np.concatenate([positions, multipliers])
        return not np.array_equal(self.z, before)


class Rest(NamedTuple):
    """A state: its residual over its roundoff, its unknowns, its largest coordinate, its pairing."""

    residual: float
    u: FloatArray
    largest: float
    pairing: Pairing | None


def settle(solution: Solution, case: Case, ways: Sequence[float]) -> list[Attained]:
    """Let Newton's method come to rest in other places, from the solution near the origin."""
    near = solution.system
    places = [Place(move(near.scene.interface, way), way, solution.u) for way in ways]
    take_forces(solution, places)
    for _ in range(N_STEPS):
        for place in places:
            change = near.step(solution.matrix, -place.residual).change
            assert change is not None  # The matrix has an inverse.
            place.u = place.u + change
        take_forces(solution, places)
    return [_attain(solution, case, place) for place in places]


def take_forces(solution: Solution, places: Sequence[Place]) -> None:
    """Ask for the forces where stored positions have changed, and for those of the same positions moved back."""
    near, n = solution.system, solution.system.scene.interface.n_unknowns
    changed = [place for place in places if place.moves(near.scene)]
    calls: list[Call] = []
    for place in changed:
        place.pairing = near.formulation.pair(place.interface, place.z)
        back = np.concatenate([place.z[:n] - place.way, place.z[n:]])
        calls += [
            ("residual", place.interface, place.pairing, place.z),
            ("residual", near.scene.interface, place.pairing, back),
        ]
    answers = near.formulation.answers(calls)
    for place, forces, same in zip(changed, answers[::2], answers[1::2], strict=True):
        place.added = max(place.added, solution.conditioning.count_roundings(forces - same))
        place.forces = forces
    for place in places:
        place.residual = near.balance(place.u, place.forces)
        largest = float(np.abs(place.z[:n]).max())
        attained = over(np.abs(place.residual), solution.roundoff(largest))
        place.rests.append(Rest(attained, place.u, largest, place.pairing))


def _attain(solution: Solution, case: Case, place: Place) -> Attained:
    """Return what the best of the states after the first step has attained."""
    near = solution.system
    rest = min(place.rests[1:], key=lambda rest: rest.residual)
    allowed = float((solution.inverse @ solution.roundoff(rest.largest) / solution.units).max())
    length = float(np.abs((rest.u - solution.u) / solution.units).max())
    undecided = ""
    if rest.pairing != solution.pairing or rest.pairing is None:
        state = replace(case, interface=near.scene.interface, z=near.state(rest.u), n_multipliers=near.n_multipliers)
        frozen = FrozenState(near.formulation, state, near.pair(rest.u))
        undecided = find_kink(frozen, COORDINATE_ROUNDING * rest.largest)
    return Attained(place.added, rest.residual, ratio(length, allowed), length, undecided)


def over(sizes: FloatArray, floor: FloatArray) -> float:
    """Return the largest ratio of two arrays (n,), entry by entry; 0/0 counts as 0."""
    return max((ratio(float(size), float(least)) for size, least in zip(sizes, floor, strict=True)), default=0.0)
