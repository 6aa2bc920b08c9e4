"""Draws the bodies of a solved scene, displacements and penetration each with its magnification. Slow to import."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, log10

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize

from contactverif.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.body import Body
from contactverif.case import Case
from contactverif_reports.geometry import Gaps
from contactverif_reports.solved import Solution, Solved, pressures_across

_SEEN_MOVE = 0.06  # of the scene: the largest displacement is drawn about as large
_SEEN_GAP = 0.06  # of the scene: so is the deepest penetration
_SUPPORT = 0.1  # of the scene: width of the hatching that stands for a rigid body
_COLOURS = "cividis"  # its lightness rises steadily, so that it reads in grey
_FLAT = 1e-6  # relative differences of stress below which all is drawn in one colour


@dataclass(frozen=True, slots=True)
class Magnification:
    """By how much displacements are magnified, and gaps."""

    move: float
    gap: float

    @classmethod
    def of(cls, solved: Solved, solutions: list[Solution]) -> Magnification:
        """One significant digit each, for solutions that are to be compared."""
        moves = max(float(np.abs(u).max(initial=0.0)) for one in solutions for u in one.displacements)
        gaps = max(float(np.abs(_gaps(solved, one.z).gap).max()) for one in solutions)
        roundoff = 64 * UNIT_ROUNDOFF * solved.case.largest_coordinate
        move = 1.0 if moves <= roundoff else _one_digit(_SEEN_MOVE * solved.size / moves)
        return cls(move, 1.0 if gaps <= roundoff else _one_digit(_SEEN_GAP * solved.size / gaps))

    @property
    def words(self) -> str:
        """For the reader of the figure."""
        return f"displacements × {self.move:g}, penetration × {self.gap:g}"


def magnifications(solved: Solved) -> dict[str, Magnification]:
    """{formulation: magnification}: the same for all that stayed near, or they could not be compared."""
    near = [one for one in solved.solutions if all(np.abs(u).max(initial=0.0) < solved.size for u in one.displacements)]
    shared = Magnification.of(solved, near) if near else Magnification(1.0, 1.0)
    return {one.formulation: shared if one in near else Magnification.of(solved, [one]) for one in solved.solutions}


def colour_scale(solved: Solved) -> ScalarMappable:
    """From the least to the largest pressure of all cells of all solutions."""
    values = [
        pressures_across(body, s)
        for one in solved.solutions
        for body, s in zip(solved.bodies, one.stresses, strict=True)
    ]
    found = np.concatenate(values)
    found = found[np.isfinite(found)]
    low, high = (float(found.min()), float(found.max())) if len(found) else (0.0, 1.0)
    if high - low <= _FLAT * max(abs(low), abs(high)):
        half = 0.1 * max(abs(low), abs(high)) or 1.0
        low, high = (low + high) / 2 - half, (low + high) / 2 + half
    return ScalarMappable(Normalize(low, high), _COLOURS)


def draw_bodies(axes: Axes, solved: Solved, solution: Solution, large: Magnification, scale: ScalarMappable) -> None:
    """Bodies by the pressure across the interface, the slave over the master, what penetrates hatched."""
    moved = [body.nodes + large.move * u for body, u in zip(solved.bodies, solution.displacements, strict=True)]
    surface = solved.case.interface.nodes + large.move * (
        solution.z.reshape(-1, 2) - solved.case.interface.nodes
    )  # (n_nodes, 2) of the interface
    gaps, drawn = _gaps(solved, solution.z), _gaps(solved, surface.reshape(-1))
    shifts = (large.gap * gaps.gap - drawn.gap)[:, None] * drawn.normal  # (n_slave_nodes, 2)
    for index, side in sorted(enumerate(solved.sides), key=lambda pair: pair[1] == "slave"):
        body, nodes = solved.bodies[index], moved[index]
        if side == "slave":
            nodes = nodes + _carried(solved, index, shifts)
        if body.rigid:
            _draw_rigid(axes, body, nodes, _SUPPORT * solved.size)
        else:
            faces = axes.add_collection(
                PolyCollection(list(nodes[body.cells]), edgecolor="0.25", linewidth=0.4, zorder=2, alpha=None)
            )
            faces.set_array(pressures_across(body, solution.stresses[index]))
            faces.set(cmap=scale.cmap, norm=scale.norm)
        line = "solid" if side == "slave" else (0, (4, 1.5))
        axes.add_collection(
            LineCollection(list(nodes[body.contact]), colors="black", linewidths=1.3, linestyles=[line], zorder=5)
        )
        at = nodes[body.contact_nodes]
        fill = "black" if side == "slave" else "white"
        few = len(at) <= 40
        axes.plot(
            *at.T,
            ls="none",
            marker="o" if side == "slave" else "s",
            ms=3.6 if few else 1.5,
            mfc=fill,
            mec="black",
            mew=0.8,
            zorder=6,
        )
    _draw_penetration(axes, solved, surface[: len(shifts)] + shifts, large.gap * gaps.gap, drawn.normal)
    axes.set_aspect("equal", adjustable="box")
    axes.margins(0.04)


def _gaps(solved: Solved, z: FloatArray) -> Gaps:
    return Gaps.of(Case(solved.case.interface, z))


def _carried(solved: Solved, index: int, shifts: FloatArray) -> FloatArray:
    """Shifts (n_nodes, 2) of a slave body that move its contact nodes as given, and columns of cells with them."""
    body, on = solved.bodies[index], solved.on_interface[index]
    own = shifts[on]  # (n_contact_nodes, 2)
    if not solved.course.nearly_flat:
        return np.broadcast_to(own.mean(axis=0), body.nodes.shape)
    along = body.nodes @ solved.course.direction
    order = np.argsort(along[body.contact_nodes], kind="stable")
    places = along[body.contact_nodes][order]
    return np.column_stack([np.interp(along, places, own[order, axis]) for axis in (0, 1)])


def _draw_rigid(axes: Axes, body: Body, nodes: FloatArray, width: float) -> None:
    """A hatched strip behind the surface."""
    ends = nodes[body.contact]  # (n_segments, 2, 2)
    chords = ends[:, 1] - ends[:, 0]
    lefts = np.column_stack([-chords[:, 1], chords[:, 0]]) / np.linalg.norm(chords, axis=1)[:, None]
    strips = np.concatenate([ends, (ends + width * lefts[:, None])[:, ::-1]], axis=1)
    axes.add_collection(
        PolyCollection(list(strips), facecolor="none", edgecolor="0.5", linewidth=0, hatch="////", zorder=1)
    )
    axes.plot(*strips.reshape(-1, 2).T, linestyle="none")  # so that the axes reach around it


def _draw_penetration(axes: Axes, solved: Solved, slave: FloatArray, gap: FloatArray, normal: FloatArray) -> None:
    """Hatched between the slave's surface and the master's, where it is beyond that."""
    feet = slave - gap[:, None] * normal
    segments = solved.case.interface.slave.segments
    inside = segments[(np.minimum(gap, 0.0)[segments] < 0).any(axis=1)]
    if not len(inside):
        return
    quads = np.concatenate([slave[inside], feet[inside[:, ::-1]]], axis=1)
    axes.add_collection(
        PolyCollection(
            list(quads), facecolor="white", edgecolor="black", linewidth=0, hatch="xxxxxx", alpha=0.55, zorder=4
        )
    )


def _one_digit(value: float) -> float:
    power = 10.0 ** floor(log10(value))
    return float(f"{round(value / power) * power:.3g}")
