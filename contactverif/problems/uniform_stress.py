"""The uniform stress of a solved patch test: its exact value, the error of a solution, and what roundoff may do to it.

Properties, studies, the paper's room and the tests judge solved patch tests. All of them use these functions, so that
the same solution has the same error and the same tolerance everywhere.

Rules for the next editor: a formula is written once as text, beside the function that computes it, and whoever prints a
tolerance prints that text. A change of a formula changes both, and `docs/concepts/tolerances.md`.

Symbols: κ is the greater of ε̂h and the stiffer body's E over the softer body's E; h is the mean slave segment, in
space the root of the mean face; r is the ratio of the shortest to the longest segment, in space of heights of
faces; u = 2⁻⁵³; X is the largest coordinate; M is the stiffer body's oedometer modulus; U is the largest
displacement; ℓ is the shortest segment; p is the exact pressure.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE, Interface
from contactverif.mechanics.accuracy import Solution, shape_integrals
from contactverif.mechanics.scene import Scene
from contactverif.problems.blocks import pressure_of
from contactverif.problems.problem import Errors, ProblemInstance

CONDITION_TOLERANCE = "1e-11 + 1e-13 κ + 5e-15/r"
STRESS_TOLERANCE = f"{CONDITION_TOLERANCE} + 64 u (X ε̂ + M U/ℓ)/p"
PRESSURE_TOLERANCE = f"{CONDITION_TOLERANCE} + 64 u (X ε̂/r + M U/ℓ)/p"


def stress_error(scene: Scene, stresses: Sequence[FloatArray], pressure: float | None = None) -> float:
    """Return the largest error of a stress component at a Gauss point over the exact pressure, dimensionless.

    Each body has stresses (n_cells, n_points, 3). Rigid bodies have none, and bodies that touch nothing carry no
    pressure; both are left out. The exact pressure is that of the scene at its own penalty by default. The exact stress
    on rollers is −p ν/(1−ν) along the interface, −p across it, and the shear 0.
    """
    if pressure is None:
        pressure = pressure_of(scene.case(), scene.penalty)
    largest = 0.0
    for index in scene.bodies_in_reach:
        body = scene.bodies[index]
        if not body.rigid:
            aside, shears = -pressure * body.poisson / (1 - body.poisson), 1 if scene.dim == PLANE else 3
            exact = np.array([*[aside] * (scene.dim - 1), -pressure, *[0.0] * shears])
            largest = max(largest, float(np.abs(stresses[index] - exact).max(initial=0.0)))
    return largest / pressure


def _segment_lengths(scene: Scene) -> tuple[float, float]:
    """Return the shortest reference length of all segments, or least height of faces, and its ratio to the longest."""
    interface = scene.interface
    lengths = np.concatenate([side.heights(interface.nodes) for side in (interface.slave, interface.master)])
    return float(lengths.min()), float(lengths.min() / lengths.max())


def condition_tolerance(scene: Scene, penalty: float) -> float:
    """Return what the solution of the linear system may add to a stress over p: CONDITION_TOLERANCE as a number."""
    young = [body.young for body in scene.bodies if not body.rigid]
    mean = float(scene.interface.slave.measures(scene.interface.nodes).mean())
    h = mean if scene.dim == PLANE else math.sqrt(mean)
    return 1e-11 + 1e-13 * max(penalty * h, *young) / min(young) + 5e-15 / _segment_lengths(scene)[1]


class UniformTolerances(NamedTuple):
    """The tolerances of a solved patch test in one state, all dimensionless."""

    stress: float  # STRESS_TOLERANCE, for stresses over p and nodal forces over p L.
    pressure: float  # PRESSURE_TOLERANCE, for the pressure that a formulation reports, over p.


def uniform_tolerances(case: Case, scene: Scene, pressure: float) -> UniformTolerances:
    """Return the tolerances of a solved scene in the state of the case."""
    shortest, ratio = _segment_lengths(scene)
    modulus = max(body.oedometric_modulus for body in scene.bodies if not body.rigid)
    displacement = float(np.abs(case.positions - scene.interface.nodes).max())
    solution = condition_tolerance(scene, case.penalty)
    solution += 64 * UNIT_ROUNDOFF * modulus * displacement / shortest / pressure
    gap = 64 * UNIT_ROUNDOFF * case.largest_coordinate * case.penalty / pressure
    return UniformTolerances(stress=solution + gap, pressure=solution + gap / ratio)


def uniform_forces(interface: Interface, pressure: float) -> FloatArray:
    """Return the exact forces (n_nodes, 2) that push the nodes of an interface under a uniform pressure."""
    forces = np.zeros(interface.nodes.shape)
    for surface in (interface.slave, interface.master):
        along = np.diff(interface.nodes[surface.segments], axis=1)[:, 0]
        inwards = pressure / 2 * np.column_stack([-along[:, 1], along[:, 0]])  # The body is on the left.
        np.add.at(forces, surface.segments, inwards[:, None])
    return forces


def pose_uniform(scene: Scene, pressure: float, exact: FloatArray) -> ProblemInstance:
    """Return the problem of a scene whose exact pressure is uniform, with its exact unknowns (n_free,)."""
    interface = scene.interface
    exact_moves = scene.positions(exact).reshape(-1, 2) - interface.nodes

    def motion_error(solution: Solution) -> Errors:
        squares = np.zeros(2)
        for surface in (interface.slave, interface.master):
            integrals = shape_integrals(surface, interface.nodes)
            fields = (solution.displacements - exact_moves, exact_moves)
            squares += [integrals @ (field**2).sum(axis=1) for field in fields]
        return {"displacement": float(np.sqrt(squares[0] / squares[1]))}

    return ProblemInstance(
        scene=scene,
        forces=lambda _: uniform_forces(interface, pressure),
        pressure=lambda places: np.full(len(places), pressure),
        pressure_scale=pressure,
        deformed=False,
        further=motion_error,
    )
