"""The errors of a formulation on two rings that are shrunk onto each other: forces, displacements and pressures.

Rule for the next editor: the exact answer is `ShrinkFit.finite`, which measures contact after the fit as a scene does;
the measures are those of `contactverif.mechanics.accuracy`. Nothing is solved here.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.mechanics.accuracy import (
    Solution,
    displacement_error,
    force_error,
    pressure_error,
    shape_integrals,
    traction_forces,
)
from contactverif.problems.shrink_fit import FiniteFit, Role, ShrinkFit


def ring_force_error(solution: Solution, fit: FiniteFit, slave: Role, *, of_master: bool = False) -> float:
    """Return the error E_F of the nodal forces of one ring, dimensionless.

    The ends of a quarter are held across their line of symmetry, and bear what contact does there.

    Parameters
    ----------
    solution : Solution
        The solution.
    fit : FiniteFit
        The exact fit.
    slave : Literal['inner', 'outer']
        The ring that is the slave.
    of_master : bool
        True measures the forces of the other ring, which bears the same force for each unit of angle.
    """
    surface = solution.interface.master if of_master else solution.interface.slave
    towards = -1.0 if (slave == "inner") is not of_master else 1.0

    def traction(places: FloatArray) -> FloatArray:
        radii = np.linalg.norm(places, axis=1)[:, None]
        pressures: FloatArray = towards * (fit.force / radii if of_master else fit.pressure) * places / radii
        return pressures

    positions = solution.state.positions
    return force_error(
        solution.forces, traction_forces(surface, positions, traction), shape_integrals(surface, positions)
    )


def ring_motion_error(solution: Solution, problem: ShrinkFit, fit: FiniteFit, slave: Role) -> float:
    """Return the error of the displacements of the slave, whose surface moves along its radius, in L2.

    Parameters
    ----------
    solution : Solution
        The solution.
    problem : ShrinkFit
        The rings.
    fit : FiniteFit
        The exact fit.
    slave : Literal['inner', 'outer']
        The ring that is the slave.
    """
    ring = int(slave == "outer")
    radius = problem.contact_radii[ring]
    outwards = (1 if ring else -1) * replace(problem, radius=radius).compliances[ring] / radius * fit.force

    def field(places: FloatArray) -> FloatArray:
        moves: FloatArray = outwards * places / np.linalg.norm(places, axis=1)[:, None]
        return moves

    interface = solution.interface
    return displacement_error(interface.slave, interface.nodes, solution.displacements, field)


def ring_pressure_error(solution: Solution, fit: FiniteFit) -> float | None:
    """Return the error of reported pressures over the exact one; None if none are reported."""
    return pressure_error(solution, lambda places: np.full(len(places), fit.pressure), fit.pressure)
