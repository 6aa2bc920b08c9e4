"""The errors of a formulation on the disk on its foundation, against a solution on a finer mesh.

No exact solution is known of bodies of this size, so the reference is a solution too, and has an error of its own. Its
size is seen from other references, by another formulation or on another mesh, measured against the first one: that is
the error bar. An error that is not much larger says nothing.

Rule for the next editor: the measures are those of `contactverif.mechanics.accuracy`. No property judges these errors.
Against a mortar solution on a mesh four times finer, E_F of right formulations is 1e-3 to 5e-3, and the bar is 3e-3: on
any mesh VTS-PPT is that far from mortar, segment-to-segment and Chen–Hisada. So no rate can be judged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Surface
from contactverif.contract.subject import Subject
from contactverif.mechanics.accuracy import (
    Solution,
    displacement_error,
    force_error,
    pressure_error,
    shape_integrals,
    solve_for_accuracy,
    traction_forces,
)
from contactverif.mechanics.scene import Scene
from contactverif.problems.disk import DiskProblem, disk_on_foundation

PAPER = DiskProblem()
FINER = 4  # The mesh of the reference is so many times finer.


@dataclass(frozen=True, slots=True)
class DiskErrors:
    """The errors on one mesh, all dimensionless."""

    slave: float  # E_F, the error of nodal forces of disk and foundation.
    master: float
    # The root mean square error of reported pressures over the largest of the reference; None if there are none to
    # compare.
    pressure: float | None
    displacement: float  # The error of the displacements of the disk's surface, in L2.


def solve_disk_for_accuracy(subject: Subject, refine: int = 1, problem: DiskProblem = PAPER) -> Solution:
    """Solve the disk on its foundation.

    Parameters
    ----------
    subject : Subject
        The formulation.
    refine : int
        The number of parts that each side of each cell is divided into; `FINER` for a reference of refine = 1.
    problem : DiskProblem
        The radius, the force, the materials and the penalty.
    """
    return solve_for_accuracy(_scene(problem, refine), subject)


@lru_cache(maxsize=2)
def _scene(problem: DiskProblem, refine: int) -> Scene:
    """Return a scene; the last two are kept, because condensing a scene takes longer than solving it."""
    return disk_on_foundation(problem, refine=refine)


def disk_errors(solution: Solution, reference: Solution) -> DiskErrors:
    """Return the errors of a solution against one on a finer mesh, whose pressures are forces over ∫N ds."""
    interface, current = solution.interface, solution.state.positions
    sides = zip(
        (interface.slave, interface.master), (reference.interface.slave, reference.interface.master), strict=True
    )
    errors, pushes = [], []
    for surface, finer in sides:
        pushes.append(_pressure_field(reference, finer))
        expected = traction_forces(surface, current, pushes[-1], parts=FINER)
        errors.append(force_error(solution.forces, expected, shape_integrals(surface, current)))
    nodes = interface.nodes

    def pressure(places: FloatArray) -> FloatArray:
        pressures: FloatArray = np.linalg.norm(pushes[0](places), axis=1)
        return pressures

    motion = _along(reference.interface.slave, reference.interface.nodes, reference.displacements)
    peak = float(pressure(reference.state.positions[: reference.interface.n_slave_nodes]).max())
    return DiskErrors(
        slave=errors[0],
        master=errors[1],
        pressure=pressure_error(solution, pressure, peak),
        displacement=displacement_error(interface.slave, nodes, solution.displacements, motion, parts=FINER),
    )


def _pressure_field(solution: Solution, surface: Surface) -> Callable[[FloatArray], FloatArray]:
    """Return the traction (n, 2) at current places (n, 2) of a surface: F/∫N ds at nodes, linear between them."""
    positions = solution.state.positions
    integrals = shape_integrals(surface, positions)
    tractions = solution.forces / np.where(integrals > 0, integrals, 1.0)[:, None]
    return _along(surface, positions, tractions)


def _along(surface: Surface, places: FloatArray, values: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Return the vectors (n, 2) at places (n, 2) between those of a surface's nodes, linear along x."""
    numbers = np.unique(surface.segments)
    numbers = numbers[np.argsort(places[numbers, 0])]
    return partial(_interpolate, places[numbers, 0], values[numbers])


def _interpolate(x: FloatArray, values: FloatArray, places: FloatArray) -> FloatArray:
    return np.column_stack([np.interp(places[:, 0], x, column) for column in values.T])
