"""The data of a solved scene for a picture: arrays alone, filled by `studies` and drawn here.

Rule: nothing is solved here. Only what follows from the arrays is computed: where along the interface a node lies, and
its pressure.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE, SPACE, turns_of
from contactverif_reports.plot.geometry import Course

# {dim: {name of a component of the stress: its place in the tensor}}
STRESSES = {
    PLANE: {"xx": (0, 0), "yy": (1, 1), "xy": (0, 1)},
    SPACE: {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "yz": (1, 2), "xz": (0, 2), "xy": (0, 1)},
}
_SLIVER = 1e-6  # A smaller share of a segment under the other side counts as none.


@dataclass(frozen=True, slots=True, eq=False)
class PointPressures:
    """The contact points of a formulation, and the pressure at each."""

    segment: IntArray  # (n_points,) The slave segment that carries the point.
    c: FloatArray  # (n_points,) The place on the segment, −1 at its first node, +1 at its second.
    area: FloatArray  # (n_points, 2) The ends of the area of competence, as `c`; NaN where the plugin does not say.
    pressure: FloatArray  # (n_points,) Force per length, ≥ 0; NaN where there is none.


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """A scene as one formulation solves it."""

    formulation: str  # The name on the command line.
    end: str  # How the solution ended, in a few words: "converged", "2-cycle", ….
    converged: bool  # Whether the last iterate is a solution.
    # Displacements of the nodes of each body (n_nodes, dim), global axes, a length.
    displacements: tuple[FloatArray, ...]
    # Stresses of each body (n_cells, 3 or 6), means over the Gauss points: STRESSES in global axes, force per length².
    stresses: tuple[FloatArray, ...]
    z: FloatArray  # (n_unknowns,) Positions of the interface, flat.
    forces: FloatArray  # (n_nodes, dim) Contact forces on the nodes of the interface; NaN where the plugin gives none.
    # (n_iterates,) As in a trace: the largest force that is not in balance, the energy of the step from there (NaN at
    # the last), the residual's own roundoff, and the share of the loads.
    residuals: FloatArray
    energies: FloatArray
    floors: FloatArray
    factors: FloatArray
    # None where the plugin does not provide them or gives forces instead of pressures.
    points: PointPressures | None = None
    pressure: float = np.nan  # The exact contact pressure p; NaN where it is not known or not the same everywhere.
    stress_error: float = np.nan  # Largest |σ − σ_exact| / p at a Gauss point; NaN where nothing is known exactly.
    remark: str = ""  # A remark on what did not come out as it should; empty if all did.
    advice: str = ""  # If Newton's method did not converge: what happened, and what to try next; else empty.

    @property
    def n_iterations(self) -> int:
        """Return the number of linear systems that were solved."""
        return int(np.isfinite(self.energies).sum())


@dataclass(frozen=True, slots=True, eq=False)
class SolvedScene:
    """A scene, and the solutions of one or several formulations."""

    case: Case  # The interface, before it is solved.
    bodies: tuple[Body, ...]  # All bodies.
    # For each body (n_contact_nodes,) the interface's numbers of its `contact_nodes`; empty if it can touch nothing.
    on_interface: tuple[IntArray, ...]
    solutions: tuple[Solution, ...]  # At least one.
    # {formulation: why there is no solution}, one line of text each.
    failures: Mapping[str, str] = field(default_factory=dict)

    @property
    def sides(self) -> list[str]:
        """Return "slave" or "master" for each body, "" for one that can touch nothing."""
        first_master = self.case.interface.n_slave_nodes
        return ["" if not len(on) else "slave" if on[0] < first_master else "master" for on in self.on_interface]

    @property
    def pressures(self) -> list[float]:
        """Return the known exact pressures, each once. A penalty may have another than multipliers, as it gives way."""
        known = [solution.pressure for solution in self.solutions if np.isfinite(solution.pressure)]
        return list(dict.fromkeys(known))

    @property
    def size(self) -> float:
        """Return the larger side of the box around all bodies, a length."""
        return float(np.ptp(np.vstack([body.nodes for body in self.bodies]), axis=0).max())

    @property
    def course(self) -> Course:
        """Return the direction and the shape of the interface in its reference configuration."""
        return Course.from_case(Case(self.case.interface, self.case.interface.nodes.reshape(-1)))

    @property
    def along(self) -> FloatArray:
        """Return coordinates (n_nodes,) of the interface's nodes along it, in the reference configuration."""
        return self.case.interface.nodes @ self.course.direction

    def points_along(self, points: PointPressures) -> tuple[FloatArray, FloatArray]:
        """Return coordinates along the interface of points (n_points,) and of the ends of their areas (n_points, 2)."""
        ends = self.along[self.case.interface.slave.segments[points.segment]]  # (n_points, 2)

        def at(c: FloatArray, ends: FloatArray) -> FloatArray:
            return ((1 - c) * ends[..., 0] + (1 + c) * ends[..., 1]) / 2

        return at(points.c, ends), at(points.area, ends[:, None, :])

    def node_pressures(self, solution: Solution) -> FloatArray:
        """Return the pressure (n_nodes,) of the nodal forces: along the normal, over the node's share of the interface.

        A uniform pressure comes out exactly. The share is the integral of the node's shape function over the part of
        the surface that lies under the other side; without such a part the pressure is NaN. In space it is the share
        of the whole faces.
        """
        if self.case.interface.dim != PLANE:
            return pressures_of_forces(replace(self.case, z=solution.z), solution.forces)
        shares = self.shares(solution.z.reshape(-1, 2))
        lengths = np.linalg.norm(shares, axis=1)
        shares[lengths == 0] = np.nan
        pressures: FloatArray = (solution.forces * shares).sum(axis=1) / (shares**2).sum(axis=1)
        return pressures

    def shares(self, positions: FloatArray) -> FloatArray:
        """Return vectors (n_nodes, 2) into each node's body, as long as its share of the interface at the positions."""
        interface, flat = self.case.interface, self.course.nearly_flat
        along = positions @ self.course.direction
        shares = np.zeros_like(positions)
        for surface, other in ((interface.slave, interface.master), (interface.master, interface.slave)):
            facing = along[other.nodes] if flat else np.array([-np.inf, np.inf])
            firsts, seconds = _shape_integrals(along[surface.segments], float(facing.min()), float(facing.max()))
            chords = positions[surface.segments[:, 1]] - positions[surface.segments[:, 0]]
            lefts = np.column_stack([-chords[:, 1], chords[:, 0]])  # Into the body, as long as the segments.
            np.add.at(shares, surface.segments[:, 0], firsts[:, None] * lefts)
            np.add.at(shares, surface.segments[:, 1], seconds[:, None] * lefts)
        return shares


def pressures_across(body: Body, stresses: FloatArray) -> FloatArray:
    """Return −σ along the last axis of a body in each cell, of `stresses` (n_cells, 3 or 6) in global axes."""
    normal = body.frame[:, -1]
    pressures: FloatArray = -(as_tensors(stresses) @ normal @ normal)
    return pressures


def as_tensors(stresses: FloatArray) -> FloatArray:
    """Return tensors (n_cells, dim, dim) of stresses (n_cells, 3 or 6), in the order of STRESSES."""
    dim = PLANE if stresses.shape[1] == len(STRESSES[PLANE]) else SPACE
    tensors = np.zeros((len(stresses), dim, dim))
    for column, (i, j) in zip(stresses.T, STRESSES[dim].values(), strict=True):
        tensors[:, i, j] = tensors[:, j, i] = column
    return tensors


def pressures_of_forces(case: Case, forces: FloatArray) -> FloatArray:
    """Return the pressures (n_nodes,) of nodal forces in space, over a node's share of the area of its faces.

    It is 0 at a node whose faces have no mean normal.
    """
    shares = np.zeros_like(case.positions)  # (n_nodes, 3) Along the normal, as long as the node's share of the area.
    for surface in (case.interface.slave, case.interface.master):
        normals = turns_of(case.positions[surface.faces]).sum(axis=1)
        areas = normals / np.linalg.norm(normals, axis=1, keepdims=True) * surface.measures(case.positions)[:, None]
        np.add.at(shares, surface.faces, areas[:, None] / surface.faces.shape[1])
    squares = (shares**2).sum(axis=1)
    pressures: FloatArray = np.divide(
        -(forces * shares).sum(axis=1), squares, np.zeros(len(squares)), where=squares > 0
    )
    return pressures


def _shape_integrals(ends: FloatArray, low: float, high: float) -> tuple[FloatArray, FloatArray]:
    """Return integrals (n_segments,) of both shape functions over the part in [low, high], divided by the length."""
    first, length = ends[:, 0], ends[:, 1] - ends[:, 0]
    if not (np.isfinite([low, high]).all() and (length != 0).all()):
        return np.full(len(ends), 0.5), np.full(len(ends), 0.5)
    bounds = np.sort(np.clip((np.array([[low, high]]) - first[:, None]) / length[:, None], 0.0, 1.0), axis=1)
    part = bounds[:, 1] - bounds[:, 0]
    part = np.where(part > _SLIVER, part, 0.0)
    second = part * bounds.mean(axis=1)
    return part - second, second
