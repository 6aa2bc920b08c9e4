"""A solved scene, and its errors where the exact solution is known, measured in one way for all formulations.

An exact field is a function of places (n, dim), in the reference or in the current configuration, whichever the
positions are that come with it. A field that is not smooth inside a segment needs more `parts`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.engine import EngineAnswer
from contactverif.contract.errors import MisuseError, one_line
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import SEGMENT, TRIANGLE, Interface, Surface
from contactverif.contract.subject import CheckedFormulation, EngineSubject, Subject
from contactverif.mechanics.newton import End, Trace, solve
from contactverif.mechanics.scene import Scene

Field = Callable[[FloatArray], FloatArray]  # Places (n, dim) to vectors (n, dim), or to numbers (n,).

# A pressure may end inside a segment with a vertical tangent: so many parts leave 1e-3 of its error.
_PARTS_OF_EDGE = 32
# On each part of a segment, from −1 to 1: exact for a field of degree 10 times a shape function.
_ABSCISSAS, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(6)


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """A solved scene, as its errors need it, whoever solved it."""

    scene: Scene  # It has the distributed penalty ε̂ that it was solved with.
    state: Case  # The positions, multipliers behind them.
    forces: FloatArray  # (n_nodes, dim), by which contact pushes the nodes
    points: ContactPoints | None = None  # None if none are reported
    nodal: bool = False  # Pressures of points are nodal forces (trait `penalty="nodal"`).
    trace: Trace | None = None  # Newton's method, iterate by iterate; None if another code solved the scene.
    no_solution: str = ""  # What another code says where it found none.

    @classmethod
    def from_displacements(cls, scene: Scene, displacements: FloatArray, no_solution: str = "") -> Self:
        """Return the solution of another code from its displacements (n_nodes, dim) of the interface's nodes.

        The forces are those that the bodies need for these displacements, supports included.
        """
        state = Case(scene.interface, (scene.interface.nodes + displacements).reshape(-1), scene.penalty)
        q = scene.transformation.T @ displacements.reshape(-1)
        return cls(scene, state, scene.nodal_forces(np.asarray(q)), no_solution=no_solution)

    @property
    def interface(self) -> Interface:
        """The interface of the scene."""
        return self.scene.interface

    @property
    def displacements(self) -> FloatArray:
        """The displacements (n_nodes, dim) of the interface's nodes."""
        return self.state.positions - self.interface.nodes

    @property
    def n_iterations(self) -> int:
        """The number of iterations of Newton's method."""
        return self.trace.n_iterations if self.trace is not None else 0

    @property
    def end(self) -> str:
        """The end of Newton's method, in words, or what another code says where it found no solution."""
        return self.trace.end.label if self.trace is not None else self.no_solution

    @property
    def balanced(self) -> bool:
        """True if Newton's method found a solution, or came as near to one as roundoff lets it."""
        return self.trace.end in (End.CONVERGED, End.STAGNATED) if self.trace is not None else not self.no_solution

    def is_balanced_to(self, force: float) -> bool:
        """Return whether it is a solution, or out of balance by no more than a force."""
        return self.balanced or (self.trace is not None and bool(self.trace.residuals[-1] <= force))


def shape_integrals(surface: Surface, positions: FloatArray) -> FloatArray:
    """Return m_i = ∫N_i ds (n_nodes,): half of each segment at either end, parts of faces; 0 at other nodes."""
    if surface.faces.shape[1] == SEGMENT:
        shares = np.repeat(surface.lengths(positions) / 2, 2)
    else:
        shapes, _, weights = _quadrature(surface, positions, 1)
        shares = (weights @ shapes).reshape(-1)
    return np.bincount(surface.faces.reshape(-1), weights=shares, minlength=len(positions)).astype(np.float64)


def traction_forces(surface: Surface, positions: FloatArray, traction: Field, parts: int = 1) -> FloatArray:
    """Return the nodal forces ∫N_i t ds (n_nodes, dim) of a traction t on a surface, by Gauss points; 0 at other nodes.

    The traction, force per length or area, acts on the body of this surface. Each segment or side of a face is divided
    into equal parts.
    """
    shapes, places, weights = _quadrature(surface, positions, parts)
    loads = traction(places.reshape(-1, places.shape[-1])).reshape(places.shape) * weights[..., None]
    forces = np.zeros(positions.shape)
    for corners, shape in zip(surface.faces.T, shapes.T, strict=True):
        np.add.at(forces, corners, np.einsum("p,spd->sd", shape, loads))
    return forces


def force_error(forces: FloatArray, exact: FloatArray, integrals: FloatArray) -> float:
    """Return E_F = sqrt(Σ|F_i − F_i^exact|²/m_i) / sqrt(Σ|F_i^exact|²/m_i), dimensionless.

    Forces are nodal (n_nodes, dim). The integrals are m_i = ∫N_i ds (n_nodes,). Nodes where it is 0 do not count, so
    that those of one surface select it.
    """
    counted = integrals > 0
    weights = 1 / integrals[counted, None]
    return float(np.sqrt(((forces - exact)[counted] ** 2 * weights).sum() / (exact[counted] ** 2 * weights).sum()))


def pressure_error(solution: Solution, exact: Field, scale: float) -> float | None:
    """Return the root mean square of p − p^exact at the contact points over a pressure `scale`.

    A point counts with the weight that the plugin gives it, a weighted node with ∫ of its shape. A nodal force counts
    as a pressure F_i/m_i with the weight m_i, the current ∫N_i ds. An idle point has the pressure 0. The exact pressure
    is that at current places of the slave.

    The error is infinite if no point has a weight. It is None if nothing is reported, or if two passes share the
    pressure, since no rule says how.
    """
    points = solution.points
    if points is None or points.on_master.any():
        return None
    places, weights = points.position, points.weight
    pressures = np.where(points.active, points.pressure, 0.0)
    if solution.nodal:
        surface, positions, n = solution.interface.slave, solution.state.positions, solution.interface.n_slave_nodes
        named = points.slave_segment >= 0
        shape = points.slave_shape
        corner = shape.argmax(axis=1) if shape.size else points.c > 0
        nodes = surface.faces[points.slave_segment[named], corner[named].astype(np.int64)]
        places, weights = positions[:n], shape_integrals(surface, positions)[:n]
        pressures = np.bincount(nodes, weights=pressures[named], minlength=n) / weights
    counted = weights > 0
    if not counted.any():
        return np.inf
    errors = pressures[counted] - exact(places[counted])
    return float(np.sqrt(np.average(errors**2, weights=weights[counted]))) / scale


def mass_matrix(surface: Surface, positions: FloatArray) -> sparse.csc_array:
    """Return ∫N_i N_j ds (n_nodes, n_nodes); 0 at other nodes."""
    shapes, _, weights = _quadrature(surface, positions, 1)
    entries, (faces, n) = np.einsum("pe,pf,sp->sef", shapes, shapes, weights), (surface.faces, surface.faces.shape[1])
    places = np.repeat(faces, n, axis=1).ravel(), np.tile(faces, (1, n)).ravel()
    return sparse.csc_array((entries.ravel(), places), shape=(len(positions),) * 2)


def best_pressure_error(surface: Surface, positions: FloatArray, exact: Field, scale: float) -> float:
    """Return the root mean square error of the best pressure on a mesh, over a pressure `scale`.

    The best one is continuous, linear between the nodes of a surface at positions (n_nodes, dim), and nearest to the
    exact pressure in L2.
    """
    shapes, places, weights = _quadrature(surface, positions, _PARTS_OF_EDGE)
    values = exact(places.reshape(-1, places.shape[-1])).reshape(weights.shape)
    nodes, corners = np.unique(surface.faces, return_inverse=True)
    corners = corners.reshape(surface.faces.shape)
    right = np.bincount(corners.ravel(), np.einsum("pe,sp->se", shapes, values * weights).ravel(), len(nodes))
    best = linalg.spsolve(mass_matrix(surface, positions)[nodes][:, nodes], right)
    return float(np.sqrt(np.average((best[corners] @ shapes.T - values) ** 2, weights=weights))) / scale


def displacement_error(
    surface: Surface, positions: FloatArray, displacements: FloatArray, exact: Field, parts: int = 1
) -> float:
    """Return sqrt(∫|u_h − u^exact|² ds) / sqrt(∫|u^exact|² ds) of the displacements of a surface.

    Positions (n_nodes, dim) and the places of the exact field are those of the reference. Displacements (n_nodes, dim)
    are interpolated by the shape functions. Each segment or side of a face is divided into equal parts.
    """
    shapes, places, weights = _quadrature(surface, positions, parts)
    interpolated = np.einsum("pk,fkd->fpd", shapes, displacements[surface.faces])
    expected = exact(places.reshape(-1, places.shape[-1])).reshape(places.shape)
    squares = [((weights[..., None] * field**2).sum()) for field in (interpolated - expected, expected)]
    return float(np.sqrt(squares[0] / squares[1]))


def fit_rate(sizes: Sequence[float] | FloatArray, errors: Sequence[float] | FloatArray) -> float:
    """Return the slope of log error over log h, fitted by least squares.

    Errors of 0 do not count. The rate is infinite if fewer than two errors are above 0, NaN if an error is.
    """
    values = np.asarray(errors, dtype=np.float64)
    if np.isnan(values).any():
        return np.nan
    counted = values > 0
    if counted.sum() < 2:
        return np.inf
    return float(np.polyfit(np.log(np.asarray(sizes)[counted]), np.log(values[counted]), 1)[0])


def _quadrature(surface: Surface, positions: FloatArray, parts: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return shapes (n_points, n_corners), places (n_faces, n_points, dim) and weights (n_faces, n_points)."""
    share = ((np.arange(parts)[:, None] + (_ABSCISSAS + 1) / 2) / parts).reshape(-1)
    weight = np.tile(_GAUSS_WEIGHTS / (2 * parts), parts)
    corners, n_corners = positions[surface.faces], surface.faces.shape[1]
    if n_corners == SEGMENT:
        shapes, weights = np.stack([1 - share, share], axis=1), surface.lengths(positions)[:, None] * weight
    else:  # A triangle is a quadrilateral whose last two corners are one: its Jacobian is linear.
        s, t = (part.reshape(-1) for part in np.meshgrid(share, share, indexing="ij"))
        shapes = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=1)
        slopes = np.array([[t - 1, 1 - t, t, -t], [s - 1, -s, s, 1 - s]]).swapaxes(1, 2)  # (2, n_points, 4)
        if n_corners == TRIANGLE:
            shapes, slopes = (np.add.reduceat(each, [0, 1, 2], axis=-1) for each in (shapes, slopes))
        tangents = slopes[:, None] @ (corners - corners[:, :1])  # (2, n_faces, n_points, 3)
        weights = np.linalg.norm(np.cross(*tangents), axis=-1) * np.outer(weight, weight).reshape(-1)
    return shapes, corners[:, :1] + shapes[:, 1:] @ (corners[:, 1:] - corners[:, :1]), weights


# Forces out of balance by this share of the largest one are a solution: errors of meshes are many times as large.
BALANCED = 1e-9


def solve_for_accuracy(
    scene: Scene, subject: Subject, start: FloatArray | None = None, step: float | None = None
) -> Solution:
    """Solve a scene at its own penalty, with the formulation's tangent, or with differences where that does not help.

    A nodal formulation gets ε̂ × the slave's share of a node (`Case.penalty`). The start (n_free,) is the first guess of
    the scene by default. The step of differences is a length that is small against the penetration. An engine solves it
    by itself.
    """
    if isinstance(subject, EngineSubject):
        return solve_by_engine(scene, subject)[0]
    interface = scene.interface
    guess = Case(interface, scene.positions(scene.start), scene.penalty, name=scene.name)
    formulation = subject.for_case(guess)
    trace = solve_in_tries(scene, formulation, start, step, solution_only=True)[-1]
    return solution_of(trace, formulation, nodal=subject.traits.rules.penalty == "nodal")


def solve_in_tries(
    scene: Scene,
    formulation: CheckedFormulation,
    start: FloatArray | None = None,
    step: float | None = None,
    *,
    solution_only: bool = False,
) -> tuple[Trace, ...]:
    """Solve a scene with the formulation's tangent; if that does not converge, once more with differences.

    The arguments are those of `solve_for_accuracy`. With `solution_only`, calls are saved, see `solve`. Where one
    difference confirms the tangent that did not help, it stands for differences of each unknown.
    """
    options: dict[str, Any] = {"start": start, "tolerance": BALANCED, "difference_step": step}
    options["solution_only"] = solution_only
    trace = solve(scene, formulation, **options)
    if trace.converged or "tangent" not in formulation.provides:
        return (trace,)
    return trace, solve(scene, formulation, use_tangent=False, any_matrix=True, **options)


def solution_of(trace: Trace, formulation: CheckedFormulation, *, nodal: bool) -> Solution:
    """Return the last iterate of Newton's method with its forces and contact points."""
    scene, interface, z = trace.scene, trace.scene.interface, trace.z
    state = Case(interface, z, scene.penalty, name=scene.name, n_multipliers=len(trace.multipliers))
    pairing = formulation.pair(interface, z)
    forces = -formulation.residual(interface, pairing, z)[: interface.n_unknowns].reshape(interface.nodes.shape)
    points = formulation.contact_points(interface, pairing, z) if "contact_points" in formulation.provides else None
    return Solution(scene, state, forces, points, nodal, trace)


def solve_by_engine(
    scene: Scene, subject: EngineSubject, *, linear: bool = False
) -> tuple[Solution, EngineAnswer | None]:
    """Return the solution of a scene by an engine, with its restored answer; None if the scene cannot be posed to it.

    The scene is turned where the engine takes no inclined axes. Bodies that nothing holds are lowered, as in
    `Scene.pose`. Where its solution is linear in the loads, they are multiplied by the engine's `load_scale`.
    """
    traits = subject.engine_traits
    scale = traits.load_scale if linear else 1.0
    try:
        pose = scene.pose(upright=not traits.inclined_supports, lowered=True, scale=scale)
    except MisuseError as error:
        return Solution.from_displacements(scene, np.zeros_like(scene.interface.nodes), str(error)), None
    answer = pose.restore(subject.solve(pose.arrays))
    no_solution = "" if answer.converged else f"did not converge: {one_line(answer.message) or 'no words about it'}"
    return Solution.from_displacements(scene, answer.displacements[scene.nodes_in_reach], no_solution), answer
