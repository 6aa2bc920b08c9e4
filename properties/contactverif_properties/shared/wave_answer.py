"""The answer of a formulation or of a whole code to a wave of pressure between two blocks that are pressed together.

Everything is the difference between two solutions, with the wave and without it. Those of a formulation are on the
pairing of the uniform state.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.engine_subject import EngineSubject
from contactverif.contract.interface import Interface
from contactverif.contract.pairing import Pairing
from contactverif.contract.subject import Subject
from contactverif.mechanics.accuracy import shape_integrals
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.solving import solve_by_engine
from contactverif.mechanics.system import System
from contactverif.problems.blocks import exact_unknowns
from contactverif.problems.wave_blocks import LENGTH, MEAN_PRESSURE, WAVE, wave_blocks, wave_work
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.uniform_pressure import exact_multipliers

MOST_STEPS = 12
# Springs that add less than this share s to the compliance of the bodies count as adding so much. They are 1/s times as
# stiff, which is the condition of the matrix, so that roundoff of the solution adds u/s. Both are equal at s = √u.
_LEAST_SHARE = UNIT_ROUNDOFF**0.5


@dataclass(frozen=True, slots=True)
class InterfaceAnswer:
    """The answer of a formulation or a code to the wave."""

    compliance: float  # The work of the wave's load on the displacements that it causes.
    stiffness: float  # The distributed stiffness of the springs under the mean pressure.
    # The largest minus the smallest pressure from nodal forces, over the amplitude of the wave. The surface with the
    # larger one counts.
    force_range: float
    # The same of the pressures that the formulation reports; NaN if it reports none, or nodal forces.
    point_range: float = np.nan


def answer_to_wave(columns: tuple[int, int], penalty: float, subject: Subject) -> InterfaceAnswer | None:
    """Solve two blocks with the wave and without it."""
    uniform, wavy = (wave_blocks(*columns, penalty, wave=wave) for wave in (0.0, WAVE))
    formulation = subject.for_case(uniform.case())
    systems = System(uniform, formulation), System(wavy, formulation)
    start = _uniform_state(systems[0], subject)
    pairing = systems[0].pair(start)
    before = solve_frozen(systems[0], start, pairing)
    after = None if before is None else solve_frozen(systems[1], before, pairing)
    if before is None or after is None:
        return None
    n_free, case = uniform.n_free, uniform.case()
    states = [
        FrozenState(formulation, replace(case, z=system.state(u), n_multipliers=system.n_multipliers), pairing)
        for system, u in zip(systems, (before, after), strict=True)
    ]
    answer = _interface_answer(uniform, wavy, before[:n_free], after[:n_free], states[1].forces - states[0].forces)
    nodal = subject.traits.rules.penalty == "nodal" or not states[0].has_points
    return answer if nodal else replace(answer, point_range=_point_range(*states))


def answer_of_code(columns: tuple[int, int], penalty: float, subject: EngineSubject) -> InterfaceAnswer | None:
    """Let a whole code solve two blocks with the wave and without it."""
    uniform, wavy = (wave_blocks(*columns, penalty, wave=wave) for wave in (0.0, WAVE))
    before, after = (solve_by_engine(scene, subject, linear=True)[0] for scene in (uniform, wavy))
    if before.no_solution or after.no_solution:
        return None
    q = [np.asarray(uniform.transformation.T @ item.displacements.reshape(-1)) for item in (before, after)]
    return _interface_answer(uniform, wavy, q[0], q[1], after.forces - before.forces)


def _interface_answer(
    uniform: Scene, wavy: Scene, before: FloatArray, after: FloatArray, forces: FloatArray
) -> InterfaceAnswer:
    """Return the answer of two solutions (n_free,), and the forces (n_nodes, 2) that the wave adds at the interface."""
    total = -float((uniform.bodies[0].load * uniform.displacements(before)[0]).sum())
    bodies = float(uniform.facts["compliance"].sum())
    springs = abs(total) / (MEAN_PRESSURE**2 * LENGTH) - bodies
    return InterfaceAnswer(
        compliance=wave_work(uniform, wavy, before, after),
        stiffness=1 / max(springs, _LEAST_SHARE * bodies),
        force_range=_force_range(uniform.interface, forces[:, 1]),
    )


def _uniform_state(system: System, subject: Subject) -> FloatArray:
    """Return the unknowns, and the multipliers behind them, of the exact uniform pressure."""
    scene = system.scene
    if not system.n_multipliers:
        return exact_unknowns(scene, MEAN_PRESSURE, scene.penalty)
    exact = exact_unknowns(scene, MEAN_PRESSURE, np.inf)
    state = replace(scene.case(), z=scene.positions(exact))
    return np.append(exact, exact_multipliers(state, subject, system.formulation, MEAN_PRESSURE))


def _force_range(interface: Interface, across: FloatArray) -> float:
    """Return the range of the pressures of nodal forces (n_nodes,) across the interface, over the wave's."""
    sides = (
        (interface.slave, slice(0, interface.n_slave_nodes)),
        (interface.master, slice(interface.n_slave_nodes, None)),
    )
    lengths = [(shape_integrals(surface, interface.nodes), nodes) for surface, nodes in sides]
    return max(float(np.ptp(across[nodes] / length[nodes])) for length, nodes in lengths) / WAVE


def _point_range(before: FrozenState, after: FrozenState) -> float:
    pressures = [state.points.pressure for state in (before, after)]
    if pressures[0].shape != pressures[1].shape:
        return np.nan  # A formulation without a pairing may have other points.
    change = pressures[1] - pressures[0]
    return float(np.ptp(change[np.isfinite(change)])) / WAVE


def solve_frozen(system: System, start: FloatArray, pairing: Pairing | None) -> FloatArray | None:
    """Solve a scene on one pairing, with the formulation's tangent or, where that does not converge, by differences.

    Start and solution are (n_free + n_multipliers,). The solution is None unless the residual gets down to its own
    roundoff. A formulation without a pairing decides anew at each iterate.
    """
    system.any_matrix = True
    for use_tangent in (True, False):
        system.use_tangent = use_tangent
        if (solution := _iterate(system, start, pairing)) is not None:
            return solution
    return None


def _iterate(system: System, start: FloatArray, pairing: Pairing | None) -> FloatArray | None:
    u = start
    for _ in range(MOST_STEPS):
        residual = system.residual(u, pairing)
        matrix, floor = system.matrix(u, pairing)
        if (np.abs(residual) <= floor).all():
            return u
        change = system.step(matrix, -residual, floor).change
        if change is None or not np.isfinite(change).all():
            return None
        u = u + change
    return None
