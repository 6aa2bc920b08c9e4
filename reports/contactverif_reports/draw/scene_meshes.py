"""The bodies of a solved scene, displacements and penetration each with its magnification. Importing it is slow.

A contact that is small against the bodies is drawn enlarged, and beside it all of the meshes.
"""

from __future__ import annotations

from dataclasses import dataclass

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
from contactverif_reports.draw.lengths import one_digit
from contactverif_reports.draw.solved_scene import Solution, SolvedScene, pressures_across

# Lengths as shares of the size of the scene.
_VISIBLE_MOVE = 0.06  # The largest displacement is drawn about so large.
_VISIBLE_GAP = 0.06  # The deepest penetration is drawn about so large.
_SUPPORT = 0.1  # Width of the hatching that stands for a rigid body.
_SMALL = 0.2  # A contact that is shorter is drawn enlarged.
_AROUND = 1.6  # Half-width of an enlarged drawing over that of its contact.
_MANY = 500  # Cells are drawn with finer lines if there are more.
_MANY_NODES = 40  # So are the markers of contact nodes.
_COLOURS = "cividis"  # Its lightness rises steadily, so that it can be read in grey.
_FLAT = 1e-6  # Relative differences of stress below this are drawn in one colour.


@dataclass(frozen=True, slots=True)
class Magnification:
    """The factors by which displacements and gaps are magnified."""

    move: float
    gap: float

    @classmethod
    def for_solutions(cls, solved: SolvedScene, solutions: list[Solution]) -> Magnification:
        """Return factors of one significant digit, for solutions that are compared.

        An enlarged drawing does not magnify displacements, because that would close gaps that stay open.
        """
        moves = max(float(np.abs(u).max(initial=0.0)) for solution in solutions for u in solution.displacements)
        gaps = max(float(np.abs(_gaps(solved, solution.z).gap).max()) for solution in solutions)
        roundoff = 64 * UNIT_ROUNDOFF * solved.case.largest_coordinate
        if (box := close_up(solved)) is not None:
            deep = max(-float(_gaps(solved, solution.z).gap.min()) for solution in solutions)
            return cls(1.0, 1.0 if deep <= roundoff else one_digit(_VISIBLE_GAP * float(np.ptp(box[:, 0])) / deep))
        move = 1.0 if moves <= roundoff else one_digit(_VISIBLE_MOVE * solved.size / moves)
        return cls(move, 1.0 if gaps <= roundoff else one_digit(_VISIBLE_GAP * solved.size / gaps))

    @property
    def words(self) -> str:
        """Return the factors in words, for the reader of the figure."""
        return f"displacements × {self.move:g}, penetration × {self.gap:g}"


def magnifications(solved: SolvedScene) -> dict[str, Magnification]:
    """Return {formulation: magnification}, the same for all solutions that stay near, so that they can be compared."""
    near = [
        solution
        for solution in solved.solutions
        if all(np.abs(u).max(initial=0.0) < solved.size for u in solution.displacements)
    ]
    shared = Magnification.for_solutions(solved, near) if near else Magnification(1.0, 1.0)
    return {
        solution.formulation: shared if solution in near else Magnification.for_solutions(solved, [solution])
        for solution in solved.solutions
    }


def colour_scale(solved: SolvedScene) -> ScalarMappable:
    """Return a scale over the pressures of all cells of all solutions; a single exact pressure is in the middle."""
    values = [
        pressures_across(body, s)
        for solution in solved.solutions
        for body, s in zip(solved.bodies, solution.stresses, strict=True)
    ]
    pressures = np.concatenate(values)
    pressures = pressures[np.isfinite(pressures)]
    low, high = (float(pressures.min()), float(pressures.max())) if len(pressures) else (0.0, 1.0)
    if len(solved.pressures) == 1:
        reach = max(high - solved.pressures[0], solved.pressures[0] - low)
        low, high = solved.pressures[0] - reach, solved.pressures[0] + reach
    if high - low <= _FLAT * max(abs(low), abs(high)):
        half = 0.1 * max(abs(low), abs(high)) or 1.0
        low, high = (low + high) / 2 - half, (low + high) / 2 + half
    return ScalarMappable(Normalize(low, high), _COLOURS)


def close_up(solved: SolvedScene) -> FloatArray | None:
    """Return the lower left and upper right corner (2, 2) of a square around the contact; None if it is not small."""
    if solved.course.flat:
        return None
    touching = [
        solution.z.reshape(-1, 2)[np.flatnonzero(_gaps(solved, solution.z).gap < 0)] for solution in solved.solutions
    ]
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
    """Draw all of the undeformed meshes, and a frame around the enlarged part."""
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
    """Draw the bodies, coloured by the pressure across the interface; penetration is hatched."""
    box = close_up(solved)
    reference = solved.case.interface.nodes
    surface = reference + large.move * (solution.z.reshape(-1, 2) - reference)  # (n_nodes, 2) of the interface
    gaps, magnified = _gaps(solved, solution.z), _gaps(solved, surface.reshape(-1))
    wanted = large.gap * gaps.gap if box is None else np.where(gaps.gap < 0, large.gap * gaps.gap, magnified.gap)
    shifts = (wanted - magnified.gap)[:, None] * magnified.normal  # (n_slave_nodes, 2)
    # The slave is drawn over the master.
    for index, side in sorted(enumerate(solved.sides), key=lambda pair: pair[1] == "slave"):
        body = solved.bodies[index]
        nodes = body.nodes + large.move * solution.displacements[index]
        if side == "slave":
            nodes = nodes + _carry_along(solved, index, shifts)
        if body.rigid:
            _draw_rigid(axes, body, nodes, _SUPPORT * solved.size)
        else:
            _draw_cells(axes, nodes[body.cells], pressures_across(body, solution.stresses[index]), scale, box)
        _draw_contact_side(axes, body, nodes, side)
    _draw_penetration(axes, solved, surface[: len(shifts)] + shifts, large.gap * gaps.gap, magnified.normal)
    axes.set_aspect("equal", adjustable="box")
    axes.margins(0.04)
    if box is not None:
        axes.set(xlim=box[:, 0], ylim=box[:, 1])


def _draw_cells(
    axes: Axes, corners: FloatArray, pressures: FloatArray, scale: ScalarMappable, box: FloatArray | None
) -> None:
    """Draw the cells, with corners (n_cells, n_corners, 2), in the colours of their pressures."""
    if box is not None:
        visible = _cells_in_box(corners, box)
        corners, pressures = corners[visible], pressures[visible]
    thickness = 0.4 if len(corners) <= _MANY else 0.2
    faces = axes.add_collection(
        PolyCollection(list(corners), edgecolor="0.25", linewidth=thickness, zorder=2, alpha=None)
    )
    faces.set_array(pressures)
    faces.set(cmap=scale.cmap, norm=scale.norm)


def _draw_contact_side(axes: Axes, body: Body, nodes: FloatArray, side: str) -> None:
    """Draw the segments and the nodes of a body that may touch: the slave solid and black, the master dashed."""
    style = "solid" if side == "slave" else (0, (4, 1.5))
    axes.add_collection(
        LineCollection(list(nodes[body.contact]), colors="black", linewidths=1.3, linestyles=[style], zorder=5)
    )
    contact_nodes = nodes[body.contact_nodes]
    axes.plot(
        *contact_nodes.T,
        ls="none",
        marker="o" if side == "slave" else "s",
        ms=3.6 if len(contact_nodes) <= _MANY_NODES else 1.5,
        mfc="black" if side == "slave" else "white",
        mec="black",
        mew=0.8,
        zorder=6,
    )


def _cells_in_box(corners: FloatArray, box: FloatArray) -> IntArray:
    """Return the numbers of the cells, with corners (n_cells, n_corners, 2), that the box may show."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    return np.flatnonzero((high >= box[0]).all(axis=1) & (low <= box[1]).all(axis=1))


def _gaps(solved: SolvedScene, z: FloatArray) -> Gaps:
    return Gaps.from_case(Case(solved.case.interface, z))


def _carry_along(solved: SolvedScene, index: int, shifts: FloatArray) -> FloatArray:
    """Return shifts (n_nodes, 2) of all nodes of a slave body: columns of cells move with their contact nodes."""
    body, on = solved.bodies[index], solved.on_interface[index]
    at_nodes = shifts[on]  # (n_contact_nodes, 2)
    if not solved.course.nearly_flat:
        return np.broadcast_to(at_nodes.mean(axis=0), body.nodes.shape)
    along = body.nodes @ solved.course.direction
    order = np.argsort(along[body.contact_nodes], kind="stable")
    places = along[body.contact_nodes][order]
    return np.column_stack([np.interp(along, places, at_nodes[order, axis]) for axis in (0, 1)])


def _draw_rigid(axes: Axes, body: Body, nodes: FloatArray, width: float) -> None:
    """Draw a hatched strip behind the surface."""
    ends = nodes[body.contact]  # (n_segments, 2, 2)
    chords = ends[:, 1] - ends[:, 0]
    lefts = np.column_stack([-chords[:, 1], chords[:, 0]]) / np.linalg.norm(chords, axis=1)[:, None]
    strips = np.concatenate([ends, (ends + width * lefts[:, None])[:, ::-1]], axis=1)
    axes.add_collection(
        PolyCollection(list(strips), facecolor="none", edgecolor="0.5", linewidth=0, hatch="////", zorder=1)
    )
    axes.plot(*strips.reshape(-1, 2).T, linestyle="none")  # The axes reach around it.


def _draw_penetration(axes: Axes, solved: SolvedScene, slave: FloatArray, gap: FloatArray, normal: FloatArray) -> None:
    """Hatch what lies between the slave's surface and the master's where the slave penetrates."""
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
