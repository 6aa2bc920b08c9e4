"""What a solved scene is for a picture: arrays alone. Who fills it solves; who draws it does not.

What a drawing needs besides is computed here: where along the interface a node lies, and its pressure.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.contract.interface import Surface
from contactverif_reports.draw.case_geometry import Course

_SLIVER = 1e-6  # of a segment; less of it under the other side is none


@dataclass(frozen=True, slots=True, eq=False)
class PointPressures:
    """Where a formulation looks for contact, and the pressure that it finds there.

    Attributes
    ----------
    segment : IntArray, shape (n_points,)
        The slave segment that carries the point.
    c : FloatArray, shape (n_points,)
        Where on it, −1 at its first node, +1 at its second.
    area : FloatArray, shape (n_points, 2)
        The ends of the area of competence, as `c`; NaN where the plugin does not say.
    pressure : FloatArray, shape (n_points,)
        Force per length, ≥ 0; NaN where there is none.
    """

    segment: IntArray
    c: FloatArray
    area: FloatArray
    pressure: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """A scene as one formulation leaves it.

    Attributes
    ----------
    formulation : str
        As typed on the command line.
    end : str
        How the solution ended, in a few words: "converged", "2-cycle", ….
    converged : bool
        Whether the last iterate is a solution.
    displacements : tuple[FloatArray, ...]
        Of the nodes of each body (n_nodes, 2), global axes, a length.
    stresses : tuple[FloatArray, ...]
        Of each body (n_cells, 3), means over the Gauss points: xx, yy and xy in global axes, force per length².
    z : FloatArray, shape (n_unknowns,)
        Positions of the interface, flat.
    forces : FloatArray, shape (n_nodes, 2)
        Contact forces on the nodes of the interface; NaN where the plugin gives none.
    residuals, energies, floors, factors : FloatArray, shape (n_iterates,)
        As in a trace: the largest force that is not in balance, the energy of the step from there (NaN at the
        last), the residual's own roundoff, and the share of the loads.
    points : PointPressures | None
        None where the plugin does not provide them or gives forces instead of pressures.
    pressure : float
        The exact contact pressure p; NaN where it is not known or not the same everywhere.
    stress_error : float
        Largest |σ − σ_exact| / p at a Gauss point; NaN where nothing is known exactly.
    remark : str
        What did not come out as it should, empty if all did.
    advice : str
        What happened and what to try next, where Newton's method did not converge; else empty.
    """

    formulation: str
    end: str
    converged: bool
    displacements: tuple[FloatArray, ...]
    stresses: tuple[FloatArray, ...]
    z: FloatArray
    forces: FloatArray
    residuals: FloatArray
    energies: FloatArray
    floors: FloatArray
    factors: FloatArray
    points: PointPressures | None = None
    pressure: float = np.nan
    stress_error: float = np.nan
    remark: str = ""
    advice: str = ""

    @property
    def n_iterations(self) -> int:
        """Linear systems solved."""
        return int(np.isfinite(self.energies).sum())


@dataclass(frozen=True, slots=True, eq=False)
class SolvedScene:
    """A scene, and the solutions of one or several formulations.

    Attributes
    ----------
    case : Case
        The interface, before it is solved.
    bodies : tuple[Body, ...]
        All of them.
    on_interface : tuple[IntArray, ...]
        For each body (n_contact_nodes,) the interface's numbers of its `contact_nodes`; empty if it can touch
        nothing.
    solutions : tuple[Solution, ...]
        At least one.
    failures : Mapping[str, str]
        {formulation: why there is no solution}, a line each.
    """

    case: Case
    bodies: tuple[Body, ...]
    on_interface: tuple[IntArray, ...]
    solutions: tuple[Solution, ...]
    failures: Mapping[str, str] = field(default_factory=dict)

    @property
    def sides(self) -> list[str]:
        """ "slave" or "master" for each body, "" for one that can touch nothing."""
        first_master = self.case.interface.n_slave_nodes
        return ["" if not len(on) else "slave" if on[0] < first_master else "master" for on in self.on_interface]

    @property
    def pressures(self) -> list[float]:
        """The exact pressures that are known, each once: a penalty gives way where multipliers do not."""
        return list(dict.fromkeys(one.pressure for one in self.solutions if np.isfinite(one.pressure)))

    @property
    def size(self) -> float:
        """The larger side of the box around all bodies, a length."""
        return float(np.ptp(np.vstack([body.nodes for body in self.bodies]), axis=0).max())

    @property
    def course(self) -> Course:
        """Which way the interface runs in its reference configuration."""
        return Course.from_case(Case(self.case.interface, self.case.interface.nodes.reshape(-1)))

    @property
    def along(self) -> FloatArray:
        """Coordinates (n_nodes,) of the interface's nodes along it in the reference configuration."""
        along: FloatArray = self.case.interface.nodes @ self.course.direction
        return along

    def points_along(self, points: PointPressures) -> tuple[FloatArray, FloatArray]:
        """Coordinates along the interface of the points (n_points,), and of the ends of their areas (n_points, 2)."""
        ends = self.along[self.case.interface.slave.segments[points.segment]]  # (n_points, 2)

        def at(c: FloatArray, ends: FloatArray) -> FloatArray:
            place: FloatArray = ((1 - c) * ends[..., 0] + (1 + c) * ends[..., 1]) / 2
            return place

        return at(points.c, ends), at(points.area, ends[:, None, :])

    def node_pressures(self, solution: Solution) -> FloatArray:
        """Pressure (n_nodes,) of the nodal forces: along the normal, over the node's share of the interface.

        A uniform pressure comes out exactly. The share is the integral of the node's shape function over what lies
        under the other side; NaN where that is nothing.
        """
        shares = self.shares(solution.z.reshape(-1, 2))
        lengths = np.linalg.norm(shares, axis=1)
        shares[lengths == 0] = np.nan
        pressures: FloatArray = (solution.forces * shares).sum(axis=1) / (shares**2).sum(axis=1)
        return pressures

    def shares(self, positions: FloatArray) -> FloatArray:
        """(n_nodes, 2) vectors into each node's body, as long as its share of the interface at the positions."""
        interface, flat = self.case.interface, self.course.nearly_flat
        along = positions @ self.course.direction
        shares = np.zeros_like(positions)
        for surface, other in ((interface.slave, interface.master), (interface.master, interface.slave)):
            facing = along[other.nodes] if flat else np.array([-np.inf, np.inf])
            firsts, seconds = _covered(along[surface.segments], float(facing.min()), float(facing.max()))
            lefts = _lefts(surface, positions)
            np.add.at(shares, surface.segments[:, 0], firsts[:, None] * lefts)
            np.add.at(shares, surface.segments[:, 1], seconds[:, None] * lefts)
        return shares


def pressures_across(body: Body, stresses: FloatArray) -> FloatArray:
    """−σ (n_cells,) across the body's first axis, along which its interface lies, of stresses (n_cells, 3)."""
    x, y = body.axis
    xx, yy, xy = stresses.T
    pressures: FloatArray = 2 * x * y * xy - y * y * xx - x * x * yy
    return pressures


def _lefts(surface: Surface, positions: FloatArray) -> FloatArray:
    """(n_segments, 2) vectors into the body, as long as the segments."""
    chords = positions[surface.segments[:, 1]] - positions[surface.segments[:, 0]]
    return np.column_stack([-chords[:, 1], chords[:, 0]])


def _covered(ends: FloatArray, low: float, high: float) -> tuple[FloatArray, FloatArray]:
    """Integrals (n_segments,) of both shape functions over what of the segment lies in [low, high], over its length."""
    first, length = ends[:, 0], ends[:, 1] - ends[:, 0]
    if not (np.isfinite([low, high]).all() and (length != 0).all()):
        return np.full(len(ends), 0.5), np.full(len(ends), 0.5)
    bounds = np.sort(np.clip((np.array([[low, high]]) - first[:, None]) / length[:, None], 0.0, 1.0), axis=1)
    part = bounds[:, 1] - bounds[:, 0]
    part = np.where(part > _SLIVER, part, 0.0)
    second = part * bounds.mean(axis=1)
    return part - second, second
