"""Draws the bodies of a solved scene, displacements and penetration each with its magnification. Slow to import.

A contact that is small against the bodies is drawn from near, and beside it all of the meshes.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, log10

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.patches import Rectangle

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif_reports.draw.case_geometry import Gaps
from contactverif_reports.draw.solved_scene import Solution, SolvedScene, pressures_across

_SEEN_MOVE = 0.06  # of the scene: the largest displacement is drawn about as large
_SEEN_GAP = 0.06  # of the scene: so is the deepest penetration
_SUPPORT = 0.1  # of the scene: width of the hatching that stands for a rigid body
_SMALL = 0.2  # of the scene; a contact that is shorter is drawn from near
_AROUND = 1.6  # half-widths of the contact from its middle to the edge of such a drawing
_MANY = 500  # cells; more of them are drawn with finer lines
_COLOURS = "cividis"  # its lightness rises steadily, so that it reads in grey
_FLAT = 1e-6  # relative differences of stress below which all is drawn in one colour


@dataclass(frozen=True, slots=True)
class Magnification:
    """By how much displacements are magnified, and gaps."""

    move: float
    gap: float

    @classmethod
    def of(cls, solved: SolvedScene, solutions: list[Solution]) -> Magnification:
        """One significant digit each, for solutions that are to be compared.

        From near, displacements are as they are: magnified they would close gaps that stay open.
        """
        moves = max(float(np.abs(u).max(initial=0.0)) for one in solutions for u in one.displacements)
        gaps = max(float(np.abs(_gaps(solved, one.z).gap).max()) for one in solutions)
        roundoff = 64 * UNIT_ROUNDOFF * solved.case.largest_coordinate
        if (box := close_up(solved)) is not None:
            deep = max(-float(_gaps(solved, one.z).gap.min()) for one in solutions)
            return cls(1.0, 1.0 if deep <= roundoff else _one_digit(_SEEN_GAP * float(np.ptp(box[:, 0])) / deep))
        move = 1.0 if moves <= roundoff else _one_digit(_SEEN_MOVE * solved.size / moves)
        return cls(move, 1.0 if gaps <= roundoff else _one_digit(_SEEN_GAP * solved.size / gaps))

    @property
    def words(self) -> str:
        """For the reader of the figure."""
        return f"displacements × {self.move:g}, penetration × {self.gap:g}"


def magnifications(solved: SolvedScene) -> dict[str, Magnification]:
    """{formulation: magnification}: the same for all that stayed near, or they could not be compared."""
    near = [one for one in solved.solutions if all(np.abs(u).max(initial=0.0) < solved.size for u in one.displacements)]
    shared = Magnification.of(solved, near) if near else Magnification(1.0, 1.0)
    return {one.formulation: shared if one in near else Magnification.of(solved, [one]) for one in solved.solutions}


def colour_scale(solved: SolvedScene) -> ScalarMappable:
    """From the least to the largest pressure of all cells of all solutions; the exact one, if one, in the middle."""
    values = [
        pressures_across(body, s)
        for one in solved.solutions
        for body, s in zip(solved.bodies, one.stresses, strict=True)
    ]
    found = np.concatenate(values)
    found = found[np.isfinite(found)]
    low, high = (float(found.min()), float(found.max())) if len(found) else (0.0, 1.0)
    if len(solved.pressures) == 1:
        reach = max(high - solved.pressures[0], solved.pressures[0] - low)
        low, high = solved.pressures[0] - reach, solved.pressures[0] + reach
    if high - low <= _FLAT * max(abs(low), abs(high)):
        half = 0.1 * max(abs(low), abs(high)) or 1.0
        low, high = (low + high) / 2 - half, (low + high) / 2 + half
    return ScalarMappable(Normalize(low, high), _COLOURS)


def close_up(solved: SolvedScene) -> FloatArray | None:
    """Lower left and upper right corner (2, 2) of a square around what penetrates; None if that is not small."""
    if solved.course.flat:
        return None
    touching = [one.z.reshape(-1, 2)[np.flatnonzero(_gaps(solved, one.z).gap < 0)] for one in solved.solutions]
    places = np.vstack(
        [nodes for nodes in touching if np.ptp(nodes, axis=0).max(initial=0.0) < solved.size] or touching
    )
    extent = float(np.ptp(places, axis=0).max()) if len(places) > 1 else 0.0
    if not 0 < extent < _SMALL * solved.size:
        return None
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    box: FloatArray = middle + np.array([[-1.0], [1.0]]) * _AROUND * extent / 2
    return box


def draw_meshes(axes: Axes, solved: SolvedScene, box: FloatArray) -> None:
    """All of the meshes before anything moves, and where the close-up is taken."""
    for body in solved.bodies:
        axes.add_collection(
            PolyCollection(list(body.nodes[body.cells]), facecolor="none", edgecolor="0.35", linewidth=0.15, zorder=2)
        )
    (left, low), (right, high) = box
    axes.add_patch(Rectangle((left, low), right - left, high - low, fill=False, linewidth=1.2, zorder=3))
    axes.set_aspect("equal", adjustable="box")
    axes.margins(0.04)
    axes.autoscale_view()


def draw_bodies(
    axes: Axes, solved: SolvedScene, solution: Solution, large: Magnification, scale: ScalarMappable
) -> None:
    """Bodies by the pressure across the interface, the slave over the master, what penetrates hatched."""
    box = close_up(solved)
    moved = [body.nodes + large.move * u for body, u in zip(solved.bodies, solution.displacements, strict=True)]
    surface = solved.case.interface.nodes + large.move * (
        solution.z.reshape(-1, 2) - solved.case.interface.nodes
    )  # (n_nodes, 2) of the interface
    gaps, drawn = _gaps(solved, solution.z), _gaps(solved, surface.reshape(-1))
    shown = large.gap * gaps.gap if box is None else np.where(gaps.gap < 0, large.gap * gaps.gap, drawn.gap)
    shifts = (shown - drawn.gap)[:, None] * drawn.normal  # (n_slave_nodes, 2)
    for index, side in sorted(enumerate(solved.sides), key=lambda pair: pair[1] == "slave"):
        body, nodes = solved.bodies[index], moved[index]
        if side == "slave":
            nodes = nodes + _carried(solved, index, shifts)
        if body.rigid:
            _draw_rigid(axes, body, nodes, _SUPPORT * solved.size)
        else:
            seen = slice(None) if box is None else _seen(nodes[body.cells], box)
            cells = nodes[body.cells[seen]]
            thin = 0.4 if len(cells) <= _MANY else 0.2
            faces = axes.add_collection(
                PolyCollection(list(cells), edgecolor="0.25", linewidth=thin, zorder=2, alpha=None)
            )
            faces.set_array(pressures_across(body, solution.stresses[index])[seen])
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
    if box is not None:
        axes.set(xlim=box[:, 0], ylim=box[:, 1])


def _seen(corners: FloatArray, box: FloatArray) -> IntArray:
    """The cells, of corners (n_cells, n_corners, 2), that the box may show."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    return np.flatnonzero((high >= box[0]).all(axis=1) & (low <= box[1]).all(axis=1))


def _gaps(solved: SolvedScene, z: FloatArray) -> Gaps:
    return Gaps.from_case(Case(solved.case.interface, z))


def _carried(solved: SolvedScene, index: int, shifts: FloatArray) -> FloatArray:
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


def _draw_penetration(axes: Axes, solved: SolvedScene, slave: FloatArray, gap: FloatArray, normal: FloatArray) -> None:
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
