"""The solution of a scene by several formulations, as arrays for a picture.

Rule: a solution that did not converge is a result too, with its end; a mistake of a plugin becomes one line of text.
"""

from collections.abc import Sequence

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError
from contactverif.contract.interface import PLANE
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.mechanics.newton import End, Trace, solve
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.problems.blocks import is_uniform, pressure_of
from contactverif.problems.uniform_stress import stress_error
from contactverif_reports.plot.solved_scene import STRESSES, PointPressures, Solution, SolvedScene, as_tensors

_FAR = 1e3  # An iterate is not drawn if a displacement exceeds this multiple of the size of the scene.


def solve_scene(case: Case, subjects: Sequence[Subject | NotLoaded]) -> SolvedScene:
    """Solve the scene of a case with each formulation."""
    scene = scene_of(case)
    solutions, failures = [], {}
    for subject in subjects:
        if isinstance(subject, NotLoaded):
            failures[subject.formulation] = f"not loaded: {subject.reason}"
            continue
        try:
            solutions.append(_solution(scene, case, subject))
        except ContractError as error:
            failures[subject.name] = str(error)
    # For each body the interface's numbers of its contact nodes; none if it is out of reach.
    on_interface = [np.zeros(0, np.int64) for _ in scene.bodies]
    first = 0
    for index in scene.bodies_in_reach:
        end = first + len(scene.bodies[index].contact_nodes)
        on_interface[index], first = np.arange(first, end), end
    return SolvedScene(case, scene.bodies, tuple(on_interface), tuple(solutions), failures)


def _solution(scene: Scene, case: Case, subject: Subject) -> Solution:
    formulation = subject.for_case(case)
    with np.errstate(all="ignore"):  # A diverging iteration overflows; its end says so.
        trace = solve(scene, formulation)
        iterate = _last_to_be_drawn(trace)
    q, factor = trace.q[iterate], float(trace.factors[iterate])
    at_gauss_points = scene.stresses(q, factor)
    z = scene.positions(q, factor)
    state = np.concatenate([z, trace.u[iterate, scene.n_free :]])
    forces, points, remark = _contact(scene, subject, formulation, state)
    # Under an imposed approach the exact pressure is larger with multipliers, because a penalty gives way.
    penalty = np.inf if subject.traits.rules.enforcement == "multiplier" else case.penalty
    pressure = pressure_of(case, penalty) if is_uniform(case) else np.nan
    if trace.deficiency:
        rank = f"{trace.deficiency} of {len(trace.multipliers)} multipliers are not unique"
        remark = f"{remark}{'; ' if remark else ''}{rank}"
    if iterate != len(trace.q) - 1:
        remark = f"drawn is iterate {iterate}, the last one that is not far away{'; ' if remark else ''}{remark}"
    return Solution(
        formulation=subject.name,
        end=trace.end.label,
        converged=trace.converged,
        displacements=tuple(scene.displacements(q, factor)),
        stresses=tuple(_in_global_axes(body, s) for body, s in zip(scene.bodies, at_gauss_points, strict=True)),
        z=z,
        forces=forces,
        residuals=trace.residuals,
        energies=trace.energies,
        floors=trace.floors,
        factors=trace.factors,
        points=points,
        pressure=pressure,
        stress_error=stress_error(scene, at_gauss_points, pressure),
        remark=remark,
        advice="" if trace.converged else trace.end.advice,
    )


def _last_to_be_drawn(trace: Trace) -> int:
    """Return the number of the last iterate; after divergence, of the last one that is not far away."""
    if trace.end is not End.DIVERGED:
        return len(trace.q) - 1
    nodes = trace.scene.interface.nodes
    size = np.abs(trace.q).max(axis=1, initial=0.0)
    near = np.flatnonzero(size < _FAR * float(np.ptp(nodes, axis=0).max()))
    return int(near[-1]) if len(near) else 0


def _contact(
    scene: Scene, subject: Subject, formulation: CheckedFormulation, z: FloatArray
) -> tuple[FloatArray, PointPressures | None, str]:
    """Return forces (n_nodes, dim), the pressures at points if there are any, and the error of the plugin, if any."""
    interface = scene.interface
    forces: FloatArray = np.full(interface.nodes.shape, np.nan)
    try:
        pairing = formulation.pair(interface, z)
        forces = -formulation.residual(interface, pairing, z)[: interface.n_unknowns].reshape(forces.shape)
        if (
            interface.dim != PLANE
            or "contact_points" not in formulation.provides
            or subject.traits.rules.penalty == "nodal"
        ):
            return forces, None, ""
        points = formulation.contact_points(interface, pairing, z)
    except ContractError as error:
        return forces, None, str(error)
    is_point = (points.slave_segment >= 0) & ~points.on_master
    area = np.column_stack([points.area_from, points.area_to])
    pressures = PointPressures(
        points.slave_segment[is_point], points.c[is_point], area[is_point], points.pressure[is_point]
    )
    return forces, pressures, ""


def _in_global_axes(body: Body, stresses: FloatArray) -> FloatArray:
    """Return means (n_cells, 3 or 6) over the Gauss points of stresses (n_cells, n_points, 3 or 6) in its axes."""
    means = stresses.mean(axis=1) if len(stresses) else np.zeros((0, len(STRESSES[body.dim])))
    rotated = body.frame @ as_tensors(means) @ body.frame.T
    return np.column_stack([rotated[:, i, j] for i, j in STRESSES[body.dim].values()])
