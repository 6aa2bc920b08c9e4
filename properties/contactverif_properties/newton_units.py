"""Ask whether Newton's method takes the same steps in other units."""

from __future__ import annotations

from dataclasses import dataclass, replace
from zlib import crc32

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.measurement import Measurement, Quantity
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.mechanics.changed_scenes import change_units
from contactverif.mechanics.linear import Step, scale_factors
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import scene_of
from contactverif.mechanics.system import System
from contactverif.mechanics.trace import End, Trace
from contactverif.strategies.solids import solid_cases
from contactverif_properties.shared.applicability import refuse_unknown_pressure
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.kinks import find_kink
from contactverif_properties.shared.newton_solution import is_untouched, solution_details
from contactverif_properties.shared.roundoff import COORDINATE_ROUNDING, ratio

LARGEST_LENGTH, LARGEST_MODULUS = 60, 30  # The largest exponents of 2 and of 4.
STEP_ROUNDINGS = 1e3  # A linear system is solved to so many roundoffs over its reciprocal condition.
ITERATIONS = 20  # A method that wanders longer takes steps like those before.
POSITION_ROUNDINGS = 30.0  # A position, and a difference quotient, are rounded to so many roundoffs.
STEPS = Quantity(
    "difference of a step in other units",
    "1 (times what roundoff does)",
    "Powers of two scale the four operations and square roots exactly. A power or an angle is rounded anew, and the "
    "matrix passes that on by its condition.",
)


@Property.define(
    id="newton.units",
    rank=570,
    family="newton",
    quantities=(STEPS,),
    cases=Cases.random(solid_cases),
    promise=lambda traits: True,
    applicable=refuse_unknown_pressure,
    bodies=True,
)
def newton_units(case: Case, subject: Subject) -> Measurement:
    """Newton's method takes the same steps in other units of length and force.

    **Question.** A scene is solved. At each iterate the same step is taken with all lengths multiplied by 2^k and all
    moduli by 4^j, penalty and loads with them. Are pairing and next iterate the same?

    **Why it matters.** A problem in millimetres and megapascals is the one in metres and pascals. A small number that a
    tangent or a decision on contact adds, to be safe from zero, has a unit: it is small in one system of units and
    decides in another. It shows only in solving, as slow convergence or as another active set.

    **How it is judged.** k and j are random, up to ±60 and ±30. Powers of two scale the four operations and square
    roots exactly, so a formulation that uses nothing else gives the next iterate to the last bit. A power or an angle
    is rounded anew. Then the difference of the two next iterates counts over what roundoff does to a step Δu, max(1e3 u
    (|u| + |Δu|)/cond, 30 uX), with 30 (uX/ℓ)^(2/3) |Δu|/cond more where the tangent is a difference quotient. The
    tolerance is 1. A pairing that differs, and a matrix that has an inverse in other units alone, fail in words.

    **Undecided.** Where the state of the first pairing that differs lies at a kink.
    """
    # Strategies repeat seeds from case to case, so the units hang on the state too.
    scene, random = scene_of(case), np.random.default_rng([case.seed, crc32(case.z.tobytes())])
    k = int(random.integers(-LARGEST_LENGTH, LARGEST_LENGTH + 1))
    j = int(random.integers(-LARGEST_MODULUS, LARGEST_MODULUS + 1))
    length, modulus, penalty = 2.0**k, 4.0**j, subject.penalty(case)
    distributed = subject.traits.rules.penalty == "distributed"
    system = System(scene, subject.with_penalty(penalty))
    rescaled = subject.with_penalty(penalty * modulus / (length if distributed else 1.0))
    other = System(change_units(scene, length, modulus), rescaled)
    factors = np.full(system.size, length)
    factors[scene.n_free :] = modulus * (1.0 if distributed else length)

    trace = solve(scene, system.formulation, iterations=ITERATIONS)
    units = Units(system, other, factors)
    differences, broken, undecided = [], "", ""
    for number in range(len(trace.u)):
        broken = units.compare_decisions(trace, number)
        if broken:
            undecided = explain_pairing(system, case, trace.u[number])
            break
        if number + 1 < len(trace.u):
            differences.append(units.compare_step(case, trace, number))
    details = solution_details(trace) | {"exponent of lengths": float(k), "exponent of moduli": 2.0 * j}
    return Measurement(
        [STEPS.check(max(differences, default=0.0), 1.0)],
        undecided=undecided,
        broken=broken,
        details=details | {"steps that agree to the last bit": float(differences.count(0.0))},
        idle=is_untouched(trace),
    )


@dataclass(frozen=True, slots=True)
class Units:
    """A scene in two systems of units."""

    system: System  # The scene in its own units and in others, with the formulation.
    other: System
    factors: FloatArray  # (n_free + n_multipliers,) The unit of each unknown in the other units.

    def step(self, trace: Trace, number: int) -> Step:
        """Return the Newton step in the other units from the iterate `number`, on the pairing of both."""
        u, pairing = trace.u[number] * self.factors, trace.pairings[number]
        # Asked as `solve` asks: forces of one call with the tangent may be rounded otherwise than forces alone.
        forces, tangent = self.other.forces_and_tangent(u, pairing)
        matrix, floor = self.other.assemble(u, pairing, forces, tangent)
        return self.other.step(matrix, -self.other.balance(u, forces), floor)

    def compare_decisions(self, trace: Trace, number: int) -> str:
        """Return in words what differs in the other units at the iterate `number`, or an empty string."""
        if trace.pairings[number] != self.other.pair(trace.u[number] * self.factors):
            return f"at iterate {number} the pairing is another one in other units"
        if number + 1 == len(trace.u) and trace.end is End.SINGULAR:
            step = self.step(trace, number)
            if step.change is not None and step.condition > STEP_ROUNDINGS * UNIT_ROUNDOFF * self.system.size:
                return f"at iterate {number} the matrix has an inverse in other units alone"
        return ""

    def compare_step(self, case: Case, trace: Trace, number: int) -> float:
        """Return the difference of the step from the iterate `number` over what roundoff does to it."""
        u, after, condition = trace.u[number], trace.u[number + 1], float(trace.conditions[number])
        change = self.step(trace, number).change
        if change is None:
            return np.inf if condition > STEP_ROUNDINGS * UNIT_ROUNDOFF * self.system.size else 0.0
        difference = (u * self.factors + change) / self.factors - after
        return measure_step(self.system, case, trace, number, difference) if difference.any() else 0.0


def measure_step(system: System, case: Case, trace: Trace, number: int, difference: FloatArray) -> float:
    """Return the difference (n_unknowns,) of the iterates after iterate `number` over what roundoff does to a step."""
    u, units = trace.u[number], np.ones(system.size)
    if system.n_multipliers:
        units = scale_factors(system.matrix(u, trace.pairings[number])[0], system.scene.n_free)[1]
    step = float(np.abs((trace.u[number + 1] - u) / units).max())
    size = float(np.abs(u / units).max() + np.abs(system.scene.imposed_displacements).max()) + step
    largest = float(np.abs(system.state(u)[: system.scene.interface.n_unknowns]).max())
    solved_to = STEP_ROUNDINGS * UNIT_ROUNDOFF * size
    quotient = 0.0
    if "tangent" not in system.formulation.provides:
        quotient = POSITION_ROUNDINGS * (UNIT_ROUNDOFF * largest / case.shortest_segment) ** (2 / 3) * step
    condition = float(trace.conditions[number])
    roundoff = max(ratio(solved_to, condition), POSITION_ROUNDINGS * UNIT_ROUNDOFF * largest)
    return ratio(float(np.abs(difference / units).max()), roundoff + ratio(quotient, condition))


def explain_pairing(system: System, case: Case, u: FloatArray) -> str:
    """Return why another pairing at the unknowns u (n,) may be the fault of a kink, or an empty string."""
    state = replace(case, z=system.state(u), n_multipliers=system.n_multipliers)
    reach = COORDINATE_ROUNDING * state.largest_coordinate
    return find_kink(FrozenState(system.formulation, state, system.pair(u)), reach)
