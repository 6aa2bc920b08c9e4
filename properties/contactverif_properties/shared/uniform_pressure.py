"""The exact forces of a uniform pressure on a flat interface, and the multipliers that come nearest to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE
from contactverif.contract.measurement import Measurement, Quantity
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.mechanics.linear import RANK_ROUNDOFF
from contactverif.mechanics.scene import Scene
from contactverif.oracle import uniform_pressure_weights, uniform_surface_weights
from contactverif.problems.blocks import exact_unknowns, pressure_of
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.roundoff import gap_tolerance
from contactverif_properties.shared.worst_force import worst_force


def normal_of(case: Case) -> FloatArray:
    """Return the unit normal (dim,) out of the master of a flat case: in the plane, to the left of the slave's way."""
    if case.interface.dim != PLANE:
        return case.parameters["normal"]
    along = case.parameters["direction"]
    return np.array([-along[1], along[0]])


def gap_error(case: Case, penetration: float, size: float) -> float:
    """Return by how much a node departs from a plane slave at `penetration` below a plane master, over `size`.

    A slave node beside the master stands for the place opposite the master's end, since what overhangs may bend.
    """
    heights = case.positions @ normal_of(case)
    n_slave = case.interface.n_slave_nodes
    slave, master = np.split(case.parameters["along"], [n_slave])
    order = np.argsort(slave)
    heights[:n_slave] = np.interp(np.clip(slave, master.min(), master.max()), slave[order], heights[:n_slave][order])
    level = heights[n_slave:].mean()
    errors = np.abs(heights - level + np.where(np.arange(len(heights)) < n_slave, penetration, 0.0))
    return float(errors.max() / size)


def push_apart(case: Case, weights: FloatArray, pressure: float) -> FloatArray:
    """Return the forces (n_nodes, dim) of a pressure over weights (n_nodes,), which push the two bodies apart."""
    sides = np.where(np.arange(len(weights)) < case.interface.n_slave_nodes, 1.0, -1.0)
    return pressure * (sides * weights)[:, None] * normal_of(case)


def consistent_forces(case: Case, pressure: float) -> FloatArray:
    """Return the forces (n_nodes, dim) by which a uniform pressure pushes the nodes of a flat case, exactly.

    They are p ∫N_i over the part of the line that both surfaces cover, in rationals. The parameters `along` (n_nodes,)
    and `direction` (2,) say where the nodes lie on the line. In space `plane` (n_nodes, 2) says where they lie, and
    `domain` is what both surfaces cover.
    """
    if case.interface.dim != PLANE:
        plane, domain = case.parameters["plane"], case.parameters["domain"]
        return push_apart(case, uniform_surface_weights(case.interface, plane, domain), pressure)
    return push_apart(case, uniform_pressure_weights(case.interface, case.parameters["along"]), pressure)


def forces_of_penetration(case: Case) -> FloatArray:
    """Return the consistent forces (n_nodes, dim) of the pressure ε̂ |g| of a flat case with a uniform penetration."""
    return consistent_forces(case, case.penalty * case.parameter("penetration"))


def uniform_state(case: Case, subject: Subject, pressure: float | None = None) -> FrozenState:
    """Return the formulation in the state of a case; multipliers, if any, are all the pressure, ε̂ |g| by default."""
    if pressure is None:
        pressure = case.penalty * case.parameter("penetration")
    return FrozenState.with_multiplier(subject.for_case(case), case, pressure)


def pushing_forces(state: FrozenState) -> FloatArray:
    """Return the forces (n_nodes, dim) that push the nodes; of multipliers, if there are any, theirs alone."""
    if state.case.n_multipliers:
        return -(unit_forces(state) @ state.case.multipliers).reshape(state.case.interface.nodes.shape)
    return -state.forces


def forces_of_gap(case: Case, subject: Subject, exact: FloatArray) -> tuple[FloatArray, float]:
    """Return the forces (n_nodes, dim) of a state that penetrates uniformly, to be compared with the exact ones.

    With multipliers only the distribution of the forces can be right or wrong, and not their size. Uniform multipliers
    count if they are pressures, scaled to the exact total. If they are nodal forces, those count that come nearest to
    the exact forces. The second number is the largest multiplier over the mean one, by which roundoff grows; it is 1
    without nodal multipliers. Of a barrier, whose law is its own, the forces are scaled to the exact total, too.
    """
    state = uniform_state(case, subject)
    n = case.interface.n_slave_nodes
    if subject.traits.rules.enforcement == "barrier":
        return _scale_to_total(-state.forces, exact, n), 1.0
    if not state.case.n_multipliers:
        return -state.forces, 1.0
    transfer = -unit_forces(state)
    if subject.traits.rules.penalty == "nodal":
        multipliers = np.linalg.lstsq(transfer, exact.reshape(-1), rcond=None)[0]
        mean = float(np.abs(multipliers).mean())
        largest = float(np.abs(multipliers).max()) / mean if mean > 0 else 1.0
        return (transfer @ multipliers).reshape(exact.shape), largest
    return _scale_to_total((transfer @ state.case.multipliers).reshape(exact.shape), exact, n), 1.0


def _scale_to_total(forces: FloatArray, exact: FloatArray, n_slave: int) -> FloatArray:
    """Return forces (n_nodes, dim) times the factor with which those on the slave press as the exact ones do."""
    total, exact_total = forces[:n_slave].sum(axis=0), exact[:n_slave].sum(axis=0)
    projection = float(total @ exact_total)
    return forces * (float(exact_total @ exact_total) / projection if projection > 0 else 1.0)


def measure_transmission(quantity: Quantity, case: Case, subject: Subject) -> Measurement:
    """Measure the largest |F − F_exact| of a uniform penetration over the force on the slave.

    In space it counts over the largest exact force on a node, which is the larger share of meshes with more nodes.
    The tolerance is `GAP_TOLERANCE`, times the largest nodal multiplier over the mean one.
    """
    exact = forces_of_penetration(case)
    if case.interface.dim == PLANE:
        size = float(np.linalg.norm(exact[: case.interface.n_slave_nodes].sum(axis=0)))
    else:
        size = float(np.linalg.norm(exact, axis=1).max())
    forces, largest = forces_of_gap(case, subject, exact)
    error = float(np.linalg.norm(forces - exact, axis=1).max())
    number = quantity.check(error / size, gap_tolerance(case, case.parameter("penetration")) * largest)
    return Measurement([number], finding=worst_force(case.interface, forces, exact) if number.ratio > 1 else None)


def unit_forces(state: FrozenState) -> FloatArray:
    """Return what a unit of each multiplier adds to the position rows of the residual (n_unknowns, n_multipliers).

    On a frozen pairing the residual is affine in the multipliers. What it holds without any multiplier, as that of an
    augmented Lagrangian does, is subtracted. The formulation is asked with multipliers as large as those of the case,
    rounded to a power of two: roundoff would hide a unit beside a large penalty force.
    """
    case = state.case
    n, count = case.interface.n_unknowns, case.n_multipliers
    largest = float(np.abs(case.multipliers).max(initial=0.0))
    size = 2.0 ** round(np.log2(largest)) if largest > 0 else 1.0
    multipliers = np.vstack([size * np.eye(count), np.zeros(count)])
    states = np.hstack([np.broadcast_to(case.z[:n], (count + 1, n)), multipliers])
    forces = state.residual_at(states)[:, :n]
    columns: FloatArray = (forces[:-1] - forces[-1]).T / size
    return columns


def exact_multipliers(case: Case, subject: Subject, formulation: CheckedFormulation, pressure: float) -> FloatArray:
    """Return the multipliers (n_multipliers,) that stand for a uniform pressure in the exact state of the case.

    They are the pressure itself where it gives the exact forces. Else they are the multipliers ≥ 0 that come nearest to
    those. A multiplier that transmits nothing, as that of a node that faces nothing, is 0.
    """
    state = FrozenState.with_multiplier(formulation, case, pressure)
    uniform, transfer = state.case.multipliers.copy(), -unit_forces(state)
    exact = consistent_forces(case, pressure).reshape(-1)
    from scipy.optimize import nnls  # It takes long to import, and the first rows of a run do not need it.

    nearest: FloatArray = nnls(transfer, exact)[0]  # The formulation would release one below 0.
    if subject.traits.rules.penalty != "nodal":
        uniform[~transfer.any(axis=0)] = 0.0
        errors = [float(np.abs(transfer @ candidate - exact).max()) for candidate in (uniform, nearest)]
        if errors[0] <= max(2 * errors[1], 1e-12 * float(np.abs(exact).max())):
            return uniform
    return nearest


def exact_solution(scene: Scene, case: Case, subject: Subject, formulation: CheckedFormulation) -> FloatArray:
    """Return the unknowns of the exact solution of a uniform scene, and the multipliers behind them if there are any.

    Where multipliers enforce contact, nothing penetrates, whatever the penalty of the case.
    """
    penalty = np.inf if subject.traits.rules.enforcement == "multiplier" else case.penalty
    pressure = pressure_of(case, penalty)
    exact = exact_unknowns(scene, pressure, penalty)
    if not formulation.n_multipliers(case.interface):
        return exact
    state = replace(case, z=scene.positions(exact))
    return np.append(exact, exact_multipliers(state, subject, formulation, pressure))


def nearest_multipliers(
    case: Case, scene: Scene, formulation: CheckedFormulation, exact: FloatArray
) -> tuple[FloatArray, float]:
    """Return, of all multipliers that load the bodies as those of a solved case do, the nearest to the exact ones.

    A combination of multipliers that loads no body may be added to a solution. Such combinations exist where
    multipliers are not unique, and on a rigid master, where only the sum of the nodal forces counts. The second number
    is the smallest singular value of the loads of unit multipliers on the bodies over the largest one: forces that are
    wrong by roundoff leave the multipliers uncertain by roundoff over that number.
    """
    solution = case.multipliers
    loads = scene.transformation.T @ unit_forces(FrozenState.at(formulation, case))
    _, sizes, directions = linalg.svd(loads)
    rank = int((sizes > RANK_ROUNDOFF * max(loads.shape) * UNIT_ROUNDOFF * sizes.max(initial=0.0)).sum())
    free = directions[rank:]
    nearest: FloatArray = solution + free.T @ (free @ (exact - solution))
    return nearest, float(sizes[rank - 1] / sizes[0]) if rank else 1.0
