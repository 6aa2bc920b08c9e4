"""Multipliers under a uniform pressure: which ones are right, whether those found are, and whether they are unique."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import linalg, optimize

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import Traits
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.mechanics.linear import RANK_ROUNDOFF
from contactverif.mechanics.newton import System
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.scenes.blocks import exact_unknowns, pressure_of
from contactverif.strategies.solids import block_cases
from contactverif_properties.patch import consistent_forces, force_columns

TOO_MANY = Quantity(
    "multipliers too many",
    "1",
    "0",
    "a constraint that depends on others leaves a zero singular value: 8 n u of the largest one, of n unknowns",
)


def right_multipliers(case: Case, subject: Subject, formulation: CheckedFormulation, pressure: float) -> FloatArray:
    """Multipliers (n_multipliers,) that stand for a uniform pressure in the exact state of the case.

    The pressure itself where it transmits the right forces; else those that come nearest to the right forces. 0 of one
    that transmits nothing, as that of a node which faces nothing.
    """
    uniform = np.full(formulation.n_multipliers(case.interface), pressure)
    pressed = case.with_multipliers(uniform)
    transfer = -force_columns(pressed, formulation, formulation.pair(case.interface, pressed.z))
    exact = consistent_forces(case, pressure).reshape(-1)
    nearest: FloatArray = optimize.nnls(transfer, exact)[0]  # one below 0 would be let go
    if subject.traits.penalty != "nodal":
        uniform[~transfer.any(axis=0)] = 0.0
        errors = [float(np.abs(transfer @ candidate - exact).max()) for candidate in (uniform, nearest)]
        if errors[0] <= max(2 * errors[1], 1e-12 * float(np.abs(exact).max())):
            return uniform
    return nearest


def nearest_solution(
    case: Case, scene: Scene, formulation: CheckedFormulation, right: FloatArray
) -> tuple[FloatArray, float]:
    """Multipliers as good as those of a solved case, and of all such the nearest to the right ones.

    What moves no body, as multipliers do where they are not unique, may be added; with a rigid master that is also what
    shares the forces out among its nodes.

    Returns
    -------
    (n_multipliers,), and the smallest singular value of what the bodies feel of them over the largest: forces that are
    wrong by roundoff leave the multipliers uncertain by roundoff over that.
    """
    found = case.z[case.interface.n_unknowns :]
    pairing = formulation.pair(case.interface, case.z)
    felt = scene.transformation.T @ force_columns(case, formulation, pairing)
    _, sizes, directions = linalg.svd(felt)
    told = int((sizes > RANK_ROUNDOFF * max(felt.shape) * UNIT_ROUNDOFF * sizes.max(initial=0.0)).sum())
    unfelt = directions[told:]
    nearest: FloatArray = found + unfelt.T @ (unfelt @ (right - found))
    return nearest, float(sizes[told - 1] / sizes[0]) if told else 1.0


def rank(case: Case, subject: Subject) -> Measurement:
    """How many multipliers are not unique in the exact solution of two blocks under a uniform pressure.

    Returns
    -------
    Measurement
        The number of zero singular values of the saddle-point matrix. Detail: the number of multipliers.

    Source: verification, "Lagrange multipliers" of the formulations; VTS-PPT has seven too many with eight slave
    segments on two master segments.
    """
    scene, pressure = scene_of(case), pressure_of(case, np.inf)
    formulation = subject.for_case(case)
    exact = exact_unknowns(scene, pressure, np.inf)
    here = replace(case, z=scene.positions(exact))
    system = System(scene, formulation, use_tangent=False)
    u = np.concatenate([exact, right_multipliers(here, subject, formulation, pressure)])
    matrix, floor = system.matrix(u, system.pair(u))
    step = system.step(matrix, np.zeros(system.size), floor)
    details = {"multipliers": float(system.n_multipliers)}
    return Measurement({TOO_MANY.name: float(step.deficiency)}, {TOO_MANY.name: 0.0}, details=details)


def _has_multipliers(traits: Traits) -> str:
    return "" if traits.enforcement == "multiplier" else f"the enforcement is by a {traits.enforcement}"


RANK = Property(
    id="multipliers.rank",
    family="multipliers",
    summary="the constraints of the multipliers are independent, so that the multipliers are unique",
    quantities=(TOO_MANY,),
    cases=block_cases,
    measure=rank,
    promise=lambda traits: traits.independent_multipliers,
    applicable=_has_multipliers,
    bodies=True,
)
