"""The errors of a formulation on Hertz' contact in boxes, on one mesh: forces, pressures, peak, half-width, trace.

Rule for the next editor: the exact solution is that of the penalty of the mesh, or Hertz' own for multipliers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.subject import Subject
from contactverif.mechanics.accuracy import (
    Solution,
    displacement_error,
    force_error,
    pressure_error,
    shape_integrals,
    solve_for_accuracy,
)
from contactverif.mechanics.scene import Scene
from contactverif.problems.hertz_box import HertzBox, exact_displacements, exact_forces, exact_moves, hertz_box

BOX = HertzBox()
# An iterate that is out of balance by less than this share of the largest nodal force tells the errors of a solution.
# Newton's method may alternate over a kink there, where residuals are small.
NEARLY_BALANCED = 1e-4


@dataclass(frozen=True, slots=True)
class HertzStudy:
    """One choice of slave and penalty, on meshes of any fineness.

    Attributes
    ----------
    parabola_is_slave : bool
        The choice of the slave; the master is the other body.
    stiffness : float
        The penalty ε̂ over E/h, with Young's modulus E and the segments h of the parabola.
    fixed : bool
        True makes the stiffness ε̂ over E/a instead, with the half-width a, the same on all meshes.
    """

    parabola_is_slave: bool
    stiffness: float
    fixed: bool = False

    def penalty(self, across: int) -> float:
        """Return the penalty ε̂ on the mesh with so many segments of the parabola across the contact."""
        length = BOX.half_width if self.fixed else 2 * BOX.half_width / (across + 1 / 3)
        return self.stiffness * BOX.young[0] / length

    def scene(self, across: int, *, multipliers: bool) -> tuple[Scene, FloatArray | None]:
        """Return the scene on a mesh, and the first iterate (n_free,), which is the exact solution.

        Parameters
        ----------
        across : int
            The number of the parabola's segments across the contact.
        multipliers : bool
            True for a formulation with multipliers. It starts at the first guess of the scene: its exact gaps are 0,
            so they do not say which nodes are in contact; penetration does.
        """
        penalty, role = self.penalty(across), self.parabola_is_slave
        scene = hertz_box(BOX, penalty=penalty, rigid_layer=multipliers, across=across, parabola_is_slave=role)
        if multipliers:
            return scene, None
        return scene, scene.transformation.T @ exact_moves(BOX, penalty, scene, role, across).reshape(-1)


@dataclass(frozen=True, slots=True)
class HertzErrors:
    """The errors on one mesh, all dimensionless.

    Attributes
    ----------
    slave, master : float
        E_F, the error of nodal forces of either surface.
    pressure : float | None
        The root mean square error of reported pressures over the exact peak; None if there are none to compare.
    peak : float
        The error of the largest force over the length of its node.
    half_width : float
        The error of the width of the forces, 2 √(Σ F x² / Σ F), which is a for Hertz' pressure.
    displacement : float
        The error of the displacements of the slave relative to the named point of the flat, in L2.
    iterations : int
        The number of iterations of Newton's method.
    balanced : bool
        Newton's method found a solution.
    """

    slave: float
    master: float
    pressure: float | None
    peak: float
    half_width: float
    displacement: float
    iterations: int
    balanced: bool


def hertz_errors(study: HertzStudy, across: int, subject: Subject) -> HertzErrors:
    """Solve the study on one mesh and return the errors.

    Parameters
    ----------
    study : HertzStudy
        The choice of slave and penalty.
    across : int
        The number of the parabola's segments across the contact.
    subject : Subject
        The formulation.
    """
    multipliers = subject.traits.enforcement == "multiplier"
    scene, start = study.scene(across, multipliers=multipliers)
    return errors_of_solution(study, across, solve_for_accuracy(scene, subject, start), multipliers=multipliers)


def errors_of_solution(study: HertzStudy, across: int, solution: Solution, *, multipliers: bool) -> HertzErrors:
    """Return the errors of a solution of the study's scene.

    Parameters
    ----------
    study : HertzStudy
        The choice of slave and penalty.
    across : int
        The number of the parabola's segments across the contact.
    solution : Solution
        The solution.
    multipliers : bool
        True for a formulation with multipliers, whose exact solution is Hertz' own.
    """
    law, role, scene = None if multipliers else study.penalty(across), study.parabola_is_slave, solution.scene
    exact, pressure = exact_forces(BOX, law, scene, role), BOX.pressure(law)
    nodes = scene.interface.nodes
    lengths = [shape_integrals(surface, nodes) for surface in (scene.interface.slave, scene.interface.master)]
    errors = [force_error(solution.forces, exact, integrals) for integrals in lengths]
    peak, width = _peak_and_width(solution.forces, nodes, lengths[0])
    exact_peak, exact_width = _peak_and_width(exact, nodes, lengths[0])
    number = 0 if role else 1
    trace = displacement_error(
        scene.interface.slave,
        nodes,
        solution.displacements,
        lambda places: exact_displacements(BOX, law, number, places[:, 0], across),
    )
    return HertzErrors(
        slave=errors[0],
        master=errors[1],
        pressure=pressure_error(solution, lambda places: pressure.pressure(places[:, 0]), pressure.peak),
        peak=abs(peak / exact_peak - 1),
        half_width=abs(width / exact_width - 1),
        displacement=trace,
        iterations=solution.trace.n_iterations,
        balanced=_is_balanced(solution, float(np.abs(exact).max())),
    )


def _is_balanced(solution: Solution, largest: float) -> bool:
    """Return whether the last iterate is a solution, or out of balance by a small share of the largest force."""
    return solution.balanced or bool(solution.trace.residuals[-1] <= NEARLY_BALANCED * largest)


def _peak_and_width(forces: FloatArray, nodes: FloatArray, lengths: FloatArray) -> tuple[float, float]:
    """Return the largest force over its node's length, and 2 √(Σ F x² / Σ F), of the nodes that have a length."""
    counted = lengths > 0
    pushes = np.abs(forces[counted, 1])
    total = pushes.sum()
    width = 2 * np.sqrt(pushes @ nodes[counted, 0] ** 2 / total) if total > 0 else 0.0
    return float((pushes / lengths[counted]).max()), float(width)
