"""The errors of a formulation on wavy half-planes in full contact: forces, displacements and pressures of a solution.

Rule for the next editor: the exact field is in `contactverif.problems.wavy`, the measures are those of
`contactverif.mechanics.accuracy`. Nothing is solved here.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Surface
from contactverif.mechanics.accuracy import (
    Solution,
    displacement_error,
    force_error,
    pressure_error,
    shape_integrals,
    traction_forces,
)
from contactverif.problems.wavy import UPPER, WavyProblem, wavy_displacements, wavy_pressure

SLAVE_FORCES, MASTER_FORCES = "slave force error", "master force error"
SLAVE_MOTION, MASTER_MOTION = "slave displacement error", "master displacement error"
PRESSURE = "pressure error"


def wavy_errors(solution: Solution, problem: WavyProblem, slave: int) -> dict[str, float]:
    """Return the errors of a solution by name, that of the pressure only if it is reported.

    Forces and displacements are over the exact ones, pressures over the amplitude p1 of their wave.

    Parameters
    ----------
    solution : Solution
        The solved scene of a mesh.
    problem : WavyProblem
        The problem on that mesh.
    slave : int
        The body that is the slave, `UPPER` or `LOWER`.
    """
    interface, current = solution.interface, solution.state.positions
    errors = {}
    for surface, body, names in (
        (interface.slave, slave, (SLAVE_FORCES, SLAVE_MOTION)),
        (interface.master, 1 - slave, (MASTER_FORCES, MASTER_MOTION)),
    ):
        exact = wavy_forces(surface, current, problem, body)
        errors[names[0]] = force_error(solution.forces, exact, shape_integrals(surface, current))
        field = partial(_displacements, problem, body)
        errors[names[1]] = displacement_error(surface, interface.nodes, solution.displacements, field)
    pressure = pressure_error(solution, lambda places: wavy_pressure(problem, places[:, 0]), problem.wave)
    return errors if pressure is None else errors | {PRESSURE: pressure}


def wavy_forces(surface: Surface, positions: FloatArray, problem: WavyProblem, body: int) -> FloatArray:
    """Return the exact forces (n_nodes, 2) that push the nodes of the surface of a body; 0 at other nodes.

    Parameters
    ----------
    surface : Surface
        The slave or the master.
    positions : FloatArray, shape (n_nodes, 2)
        The positions of all nodes of the interface.
    problem : WavyProblem
        The problem.
    body : int
        The body of this surface, `UPPER` or `LOWER`.
    """
    return traction_forces(surface, positions, partial(_traction, problem, body))


def _traction(problem: WavyProblem, body: int, places: FloatArray) -> FloatArray:
    """Return the traction (n, 2) on a body: the surface is flat but for slopes of 1e-6."""
    pressure = wavy_pressure(problem, places[:, 0])
    return np.column_stack([0 * pressure, pressure if body == UPPER else -pressure])


def _displacements(problem: WavyProblem, body: int, places: FloatArray) -> FloatArray:
    """Return the displacements (n, 2) of the surface, whose waviness counts for nothing."""
    return wavy_displacements(problem, body, np.column_stack([places[:, 0], 0 * places[:, 0]]))
