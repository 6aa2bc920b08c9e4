"""The exact forces of a uniform pressure on a flat interface, and the forces that multipliers give."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import Pairing
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.oracle import uniform_pressure_weights
from contactverif_properties.shared.roundoff import gap_tolerance


def consistent_forces(case: Case, pressure: float) -> FloatArray:
    """Return the forces by which a uniform pressure pushes the nodes of a flat interface, exact to the last digit.

    Parameters
    ----------
    case : Case
        A flat case. Its parameters `along` (n_nodes,) and `direction` (2,) say where the nodes lie on the line.
    pressure : float
        The pressure p ≥ 0, a force per length.

    Returns
    -------
    FloatArray, shape (n_nodes, 2)
        Forces that push the two bodies apart: p ∫N_i over the part of the line that both surfaces cover, computed in
        rationals.
    """
    weights = uniform_pressure_weights(case.interface, case.parameters["along"])
    along = case.parameters["direction"]
    normal = np.array([-along[1], along[0]])  # It points out of the master: to the left of the way the slave runs.
    sides = np.where(np.arange(len(weights)) < case.interface.n_slave_nodes, 1.0, -1.0)
    forces: FloatArray = pressure * (sides * weights)[:, None] * normal
    return forces


def forces_of_penetration(case: Case) -> FloatArray:
    """Return the consistent forces (n_nodes, 2) of the pressure ε̂ |g| of a flat case with a uniform penetration."""
    return consistent_forces(case, case.penalty * case.parameter("penetration"))


def forces_of_gap(case: Case, subject: Subject, exact: FloatArray) -> tuple[FloatArray, float]:
    """Return the forces of a formulation in a state that penetrates uniformly, to compare them with the exact ones.

    With multipliers only the distribution of the forces can be right or wrong, and not their size. Uniform multipliers
    count if they are pressures, scaled to the exact total. If they are nodal forces, those count that come nearest to
    the exact forces.

    Parameters
    ----------
    case : Case
        A case with the parameter `penetration`, a length.
    subject : Subject
        The formulation.
    exact : FloatArray, shape (n_nodes, 2)
        The exact forces.

    Returns
    -------
    forces : FloatArray, shape (n_nodes, 2)
        The forces that push the nodes.
    largest : float
        The largest multiplier over the mean one, by which roundoff grows; 1 without nodal multipliers.
    """
    formulation = subject.for_case(case)
    count = formulation.n_multipliers(case.interface)
    if not count:
        forces = -formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z)
        return forces.reshape(-1, 2), 1.0
    uniform = np.full(count, case.penalty * case.parameter("penetration"))
    state = case.with_multipliers(uniform)
    transfer = -unit_forces(state, formulation, formulation.pair(case.interface, state.z))
    if subject.traits.penalty == "nodal":
        multipliers = np.linalg.lstsq(transfer, exact.reshape(-1), rcond=None)[0]
        mean = float(np.abs(multipliers).mean())
        largest = float(np.abs(multipliers).max()) / mean if mean > 0 else 1.0
        return (transfer @ multipliers).reshape(-1, 2), largest
    nodal: FloatArray = (transfer @ uniform).reshape(-1, 2)
    n = case.interface.n_slave_nodes
    total, exact_total = nodal[:n].sum(axis=0), exact[:n].sum(axis=0)
    projection = float(total @ exact_total)
    return nodal * (float(exact_total @ exact_total) / projection if projection > 0 else 1.0), 1.0


def transmission_error(case: Case, subject: Subject) -> tuple[float, float]:
    """Return the largest error of a nodal force of a uniform penetration over ε̂ |g| L, and its tolerance.

    Parameters
    ----------
    case : Case
        A flat case with the parameter `penetration`, a length.
    subject : Subject
        The formulation.

    Returns
    -------
    error : float
        The largest |F − F_exact| over the nodes of both surfaces, over the total force on the slave; dimensionless.
    tolerance : float
        `GAP_TOLERANCE`, times the largest nodal multiplier over the mean one.
    """
    exact = forces_of_penetration(case)
    size = float(np.linalg.norm(exact[: case.interface.n_slave_nodes].sum(axis=0)))
    forces, largest = forces_of_gap(case, subject, exact)
    error = float(np.linalg.norm(forces - exact, axis=1).max())
    return error / size, gap_tolerance(case, case.parameter("penetration")) * largest


def unit_forces(case: Case, formulation: CheckedFormulation, pairing: Pairing | None) -> FloatArray:
    """Return what a unit of each multiplier adds to the position rows of the residual.

    On a frozen pairing the residual is affine in the multipliers. What it holds without any multiplier, as that of an
    augmented Lagrangian does, is subtracted. The formulation is asked with multipliers as large as those of the case,
    rounded to a power of two: roundoff would hide a unit beside a large penalty force.

    Parameters
    ----------
    case : Case
        A case with multipliers.
    formulation : CheckedFormulation
        The formulation that has them.
    pairing : Pairing | None
        The pairing, which stays frozen.

    Returns
    -------
    FloatArray, shape (n_unknowns, n_multipliers)
        One column for each multiplier.
    """
    n, count = case.interface.n_unknowns, case.n_multipliers
    largest = float(np.abs(case.multipliers).max(initial=0.0))
    size = 2.0 ** round(np.log2(largest)) if largest > 0 else 1.0
    multipliers = np.vstack([size * np.eye(count), np.zeros(count)])
    states = np.hstack([np.broadcast_to(case.z[:n], (count + 1, n)), multipliers])
    forces = formulation.residual(case.interface, pairing, states)[:, :n]
    columns: FloatArray = (forces[:-1] - forces[-1]).T / size
    return columns
