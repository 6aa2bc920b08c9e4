"""Multipliers under a uniform pressure: which ones are right, whether those found are, and whether they are unique."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.arrays import FloatArray
from contactverif.blocks import exact_unknowns, pressure_of
from contactverif.case import Case
from contactverif.formulation import Traits
from contactverif.newton import System
from contactverif.property import Measurement, Property, Quantity
from contactverif.scene import scene_of
from contactverif.strategies import block_cases
from contactverif.subject import Guarded, Subject
from contactverif_properties.anywhere import with_multipliers
from contactverif_properties.patch import consistent_forces, force_columns

TOO_MANY = Quantity(
    "multipliers too many",
    "1",
    "0",
    "a constraint that depends on others leaves a zero singular value: 8 n u of the largest one, of n unknowns",
)


def right_multipliers(case: Case, subject: Subject, formulation: Guarded, pressure: float) -> FloatArray:
    """Multipliers (n_multipliers,) that stand for a uniform pressure in the exact state of the case.

    The pressure itself where it transmits the right forces; else those that come nearest to the right forces.
    """
    uniform = np.full(formulation.n_multipliers(case.interface), pressure)
    pressed = with_multipliers(case, uniform)
    transfer = -force_columns(pressed, formulation, formulation.pair(case.interface, pressed.z))
    exact = consistent_forces(case, pressure).reshape(-1)
    nearest = np.linalg.lstsq(transfer, exact, rcond=None)[0].astype(np.float64)
    if subject.traits.penalty != "nodal":
        errors = [float(np.abs(transfer @ candidate - exact).max()) for candidate in (uniform, nearest)]
        if errors[0] <= max(2 * errors[1], 1e-12 * float(np.abs(exact).max())):
            return uniform
    return nearest


def uniformity_error(case: Case, formulation: Guarded, pressure: float) -> float:
    """Largest |λ − p| over p, of the multipliers of a solved case that are pressures; of any solution, if several are.

    What transmits no force, as multipliers do where they are not unique, is not counted.
    """
    pairing = formulation.pair(case.interface, case.z)
    transfer = force_columns(case, formulation, pairing)
    excess = case.z[case.interface.n_unknowns :] - pressure
    seen = np.linalg.lstsq(transfer, transfer @ excess, rcond=None)[0]
    return float(np.abs(seen).max(initial=0.0)) / pressure


def rank(case: Case, subject: Subject) -> Measurement:
    """How many multipliers are not unique in the exact solution of two blocks under a uniform pressure.

    Returns
    -------
    Measurement
        The number of zero singular values of the saddle-point matrix whose vectors move no body. Detail: the number of
        multipliers.

    Source: verification, "Lagrange multipliers" of the formulations; VTS-PPT has seven too many with eight slave
    segments on two master segments.
    """
    scene, pressure = scene_of(case), pressure_of(case, np.inf)
    formulation = subject.on(case)
    exact = exact_unknowns(scene, pressure, np.inf)
    here = replace(case, z=scene.positions(exact))
    system = System(scene, formulation, own_tangent=False)
    u = np.concatenate([exact, right_multipliers(here, subject, formulation, pressure)])
    matrix, floor = system.matrix(u, system.pair(u))
    step = system.step(matrix, np.zeros(system.size), floor)
    details = {"multipliers": float(system.n_multipliers)}
    if step.change is None:
        return Measurement({}, {}, details=details, undecided="the bodies are not held: the matrix has no inverse")
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
