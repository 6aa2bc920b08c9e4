"""The figure of a solved scene: bodies, pressures along the interface, Newton's iterates. Importing it is slow."""

import os
import textwrap
from dataclasses import dataclass, replace
from typing import Any, Literal, Self

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE
from contactverif_reports.files import checked_name
from contactverif_reports.plot.case_figures import SUFFIXES, hatch, plot_blocks, save, view_from_above
from contactverif_reports.plot.geometry import Gaps, format_number, one_digit
from contactverif_reports.plot.solved_scene import Solution, SolvedScene, pressures_across

_WIDTH = 3.7  # Width of the figure in inches: that of a phone, or of a column of a journal.
_LETTERS = 50  # Letters in a line of that width.
_SMALL: dict[Any, Any] = {"font.size": 9, "axes.titlesize": 9, "legend.fontsize": 9, "hatch.linewidth": 0.5}
_MANY = 40  # The points of a curve get markers up to this number.
# Lengths as shares of the size of the scene.
_VISIBLE_MOVE = 0.06  # The largest displacement is drawn about so large.
_VISIBLE_GAP = 0.06  # The deepest penetration is drawn about so large.
_SUPPORT = 0.1  # Width of the hatching that stands for a rigid body.
_SMALL_CONTACT = 0.2  # A contact that is shorter is drawn enlarged.
_AROUND = 1.6  # Half-width of an enlarged drawing over that of its contact.
_MANY_CELLS = 500  # Cells are drawn with finer lines if there are more.
_MANY_NODES = 40  # So are the markers of contact nodes.
_COLOURS = "cividis"  # Its lightness rises steadily, so that it can be read in grey.
_FLAT = 1e-6  # Relative differences of stress below this are drawn in one colour.


@dataclass(frozen=True, slots=True)
class Pen:
    """The look of the curves of one formulation, which differs from the others in grey too."""

    color: str
    style: Any
    marker: str
    fill: str

    def look(self, n_points: int) -> dict[str, Any]:
        """Return the arguments of a plot of so many points."""
        look: dict[str, Any] = {"color": self.color, "linestyle": self.style, "linewidth": 1.2}
        if n_points <= _MANY:
            fill = self.color if self.fill == "full" else "white"
            look |= {"marker": self.marker, "markersize": 4.5, "markerfacecolor": fill, "markeredgewidth": 1.0}
        return look


_PENS = (
    Pen("black", "solid", "o", "full"),
    Pen("#0072b2", (0, (5, 1.5)), "s", "none"),
    Pen("#d55e00", (0, (1, 1)), "^", "full"),
    Pen("#777777", (0, (6, 1.5, 1, 1.5)), "D", "none"),
    Pen("#009e73", (0, (3, 1, 1, 1, 1, 1)), "v", "full"),
    Pen("#aa4499", (0, (8, 2)), "x", "full"),
)


def choose_pen(number: int) -> Pen:
    """Return the pen of the formulation of that number. There are six; then they repeat."""
    return _PENS[number % len(_PENS)]


def _plot_pressures(axes: Axes, solved: SolvedScene, side: Literal["slave", "master"]) -> None:
    order = [index for index, its_side in enumerate(solved.sides) if its_side == side]
    for number, solution in enumerate(solved.solutions):
        along, pressures, look = solved.along, solved.node_pressures(solution), choose_pen(number)
        for index in order:
            on = solved.on_interface[index]
            on = on[np.argsort(along[on], kind="stable")]
            on = on[np.isfinite(pressures[on])]
            axes.plot(along[on], pressures[on], zorder=3, **look.look(len(on)))
        if side == "slave" and solution.points is not None:
            _plot_points(axes, solved, solution, look.color)
    for pressure in solved.pressures:
        axes.axhline(pressure, color="0.6", linewidth=2.2, zorder=1)
    axes.set_ylabel(f"{side}: nodal force\nover its share\n(force / length)")
    low, high = axes.get_ylim()
    middle = (low + high) / 2
    # A tenth of the pressure at least, so that roundoff does not look like a result.
    half = max((high - low) / 2, 0.1 * abs(middle))
    axes.set_ylim(middle - half, middle + half)


def _plot_history(axes: Axes, solved: SolvedScene, quantity: Literal["residuals", "energies"]) -> None:
    for number, solution in enumerate(solved.solutions):
        values = getattr(solution, quantity)
        floors = solution.floors if quantity == "residuals" else np.full_like(values, np.finfo(float).tiny)
        norms = np.where(values == 0, floors, values)
        iterates = np.flatnonzero(np.isfinite(norms) & (norms > 0))
        axes.plot(iterates, norms[iterates], zorder=3, **choose_pen(number).look(len(iterates)))
        for step in np.flatnonzero(np.diff(solution.factors)) if len(solved.solutions) == 1 else ():
            axes.axvline(step + 0.5, color="0.8", linewidth=0.8, zorder=1)
    axes.set_yscale("log")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    last = max(len(solution.residuals) for solution in solved.solutions) - 1
    axes.set_xlim(-0.3, max(last, 1) + 0.3)
    if quantity == "residuals":
        floor = max(float(solution.floors[-1]) for solution in solved.solutions)
        axes.axhspan(0, floor, color="0.92", zorder=0, linewidth=0)
    labels = {"residuals": "largest residual\n(force)", "energies": "energy of the step\n(force × length)"}
    axes.set_ylabel(labels[quantity])


def _plot_points(axes: Axes, solved: SolvedScene, solution: Solution, color: str) -> None:
    """Draw each point's pressure over its area of competence, or at its place if the plugin gives no area."""
    assert solution.points is not None
    places, areas = solved.points_along(solution.points)
    pressures = solution.points.pressure
    here = np.isfinite(pressures)
    known = here & np.isfinite(areas).all(axis=1)
    low, high = areas[known].min(axis=1), areas[known].max(axis=1)
    axes.hlines(pressures[known], low, high, color=color, linewidth=0.8, zorder=2)
    bare = here & ~known
    axes.plot(places[bare], pressures[bare], ls="none", marker=".", ms=4, color=color, zorder=2)


def plot_scene(solved: SolvedScene, path: str | os.PathLike[str], *, title: str = "") -> None:
    """Draw a solved scene to a .png or .svg file."""
    target = checked_name(path, SUFFIXES)
    with matplotlib.rc_context(_SMALL):
        save(make_scene_figure(solved, title), target)


@matplotlib.rc_context(_SMALL)
def make_scene_figure(solved: SolvedScene, title: str = "") -> Figure:
    """Return the figure that `plot_scene` writes."""
    if in_space := solved.case.interface.dim != PLANE:
        heights = (len(solved.solutions) + 1) * 1.9 + 0.9, 5.0
    else:
        box = close_up(solved)
        panels = len(solved.solutions) + (box is not None)
        width, height = np.ptp(np.vstack([body.nodes for body in solved.bodies]), axis=0) + 0.1 * solved.size
        slope = height / width if box is None else 1.0
        panel = float(np.clip((_WIDTH - 0.9) * slope, 0.8, 4.2))
        heights = panels * (panel + 0.4) + 1.1, 8.2
    figure = Figure(figsize=(_WIDTH, sum(heights)), layout=ConstrainedLayoutEngine(h_pad=0.07))
    grid = figure.add_gridspec(2, 1, height_ratios=heights)
    bodies, curves = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
    if in_space:
        _plot_surfaces(bodies, solved)
    else:
        _plot_meshes(bodies, solved, panels)
    _plot_curves(curves, solved)
    soft = (body for body in solved.bodies if not body.rigid)
    moduli = ", ".join(f"{body.name} E {format_number(body.young)}, ν {format_number(body.poisson)}" for body in soft)
    facts = f"penalty {format_number(float(f'{solved.case.penalty:.4g}'))}; {moduli}"
    lines = [*textwrap.wrap(title, _LETTERS), *textwrap.wrap(facts, _LETTERS, max_lines=3, placeholder=" …")]
    for solution in solved.solutions:  # What happened where Newton's method did not converge.
        lines += textwrap.wrap(f"{solution.formulation}: {solution.advice}", _LETTERS) if solution.advice else []
    figure.suptitle("\n".join(lines), fontsize=9, parse_math=False)
    return figure


def _plot_meshes(figure: SubFigure, solved: SolvedScene, n_panels: int) -> None:
    scale, large = colour_scale(solved), magnifications(solved)
    box = close_up(solved)
    panels = figure.subplots(n_panels, 1, squeeze=False, sharex=box is None, sharey=box is None)
    if box is not None:
        whole = panels.flat[0]
        for body in solved.bodies:
            cells = list(body.nodes[body.cells])
            whole.add_collection(PolyCollection(cells, facecolor="none", edgecolor="0.35", linewidth=0.15, zorder=2))
        size = np.ptp(box, axis=0).tolist()
        whole.add_patch(Rectangle(box[0].tolist(), *size, fill=False, linewidth=1.2, zorder=3))
        whole.set_aspect("equal", adjustable="box")
        whole.margins(0.04)
        whole.autoscale_view()
        whole.set_title("all of the meshes; the frame is drawn below")
        _bare(whole, alone=True)
    from_near = panels.ravel()[int(box is not None) :]
    for axes, solution in zip(from_near, solved.solutions, strict=False):
        plot_bodies(axes, solved, solution, large[solution.formulation], scale)
        axes.set_title(f"{solution.formulation}\n{large[solution.formulation].words}", parse_math=False)
        _bare(axes, alone=box is not None)
    bar = figure.colorbar(scale, ax=panels, location="bottom", aspect=30, pad=0.01)
    bar.set_label("pressure across the interface, −σₙ (force / length)")


def _plot_surfaces(figure: SubFigure, solved: SolvedScene) -> None:
    """Draw the bodies, and for each solution both surfaces from above with the pressures of nodal forces at nodes."""
    interface, scale = solved.case.interface, colour_scale(solved)
    rows = figure.subplots(len(solved.solutions) + 1, 2, squeeze=False)
    plot_blocks(rows[0, 0], solved.case)
    for axes in rows.flat:
        axes.set_axis_off()
    for row, solution in zip(rows[1:], solved.solutions, strict=True):
        places, pressures = view_from_above(replace(solved.case, z=solution.z)), solved.node_pressures(solution)
        for axes, surface, name in zip(row, (interface.slave, interface.master), ("slave", "master"), strict=True):
            edges = PolyCollection(list(places[surface.faces]), facecolor="none", edgecolor="0.4", linewidth=0.6)
            axes.add_collection(edges)
            at = places[surface.nodes].T
            axes.scatter(*at, c=pressures[surface.nodes], cmap=scale.cmap, norm=scale.norm, s=24, zorder=3)
            axes.set_title(f"{solution.formulation}\n{name}", parse_math=False)
            axes.set_aspect("equal", adjustable="box")
    bar = figure.colorbar(scale, ax=rows, location="bottom", aspect=30, pad=0.01)
    bar.set_label("nodal force over its share (force / area)")


def _plot_curves(figure: SubFigure, solved: SolvedScene) -> None:
    in_space = solved.case.interface.dim != PLANE
    panels = *along, residuals, energies = figure.subplots(2 if in_space else 4, 1)
    if not in_space:
        _plot_pressures(along[0], solved, "slave")
        _plot_pressures(along[1], solved, "master")
        along[1].set_xlabel("position along the interface (length)")
    _plot_history(residuals, solved, "residuals")
    _plot_history(energies, solved, "energies")
    energies.set_xlabel("iterate")
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
    handles: list[Artist] = []
    for number, solution in enumerate(solved.solutions):
        times = f"{solution.n_iterations} iteration{'s' * (solution.n_iterations != 1)}"
        end = f"{solution.formulation}: {solution.end}{' after' if solution.converged else ','} {times}"
        handles.append(Line2D([], [], label=end, **choose_pen(number).look(1)))
    if any(solution.points is not None for solution in solved.solutions):
        label = "pressure at contact points, over their areas"
        handles.append(Line2D([], [], color="0.3", linewidth=0.8, marker=".", label=label))
    if solved.pressures:
        exact = " and ".join(map(format_number, solved.pressures))  # A penalty and multipliers may have one each.
        handles.append(Line2D([], [], color="0.6", linewidth=2.2, label=f"exact pressure {exact}"))
    handles.append(Patch(color="0.92", label="roundoff of the residual"))
    figure.legend(handles=handles, loc="outside lower center", frameon=False)


def _bare(axes: Axes, *, alone: bool) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.set(xlabel="x (length)", ylabel="y (length)")
    if not alone:  # A panel that stands alone has a scale of its own.
        axes.label_outer()


@dataclass(frozen=True, slots=True)
class Magnification:
    """The factors by which displacements and gaps are magnified."""

    move: float
    gap: float

    @classmethod
    def for_solutions(cls, solved: SolvedScene, solutions: list[Solution]) -> Self:
        """Return factors of one significant digit, for solutions that are compared.

        An enlarged drawing does not magnify displacements, because that would close gaps that stay open.
        """
        roundoff = 64 * UNIT_ROUNDOFF * solved.case.largest_coordinate
        moves = max(float(np.abs(u).max(initial=0.0)) for solution in solutions for u in solution.displacements)
        gaps = np.array([_gaps(solved, solution.z).gap for solution in solutions])
        box, size, largest = close_up(solved), solved.size, float(np.abs(gaps).max())
        if box is not None:
            moves, size, largest = 0.0, float(np.ptp(box[:, 0])), -float(gaps.min())
        sizes = ((_VISIBLE_MOVE, moves), (_VISIBLE_GAP, largest))
        return cls(*(1.0 if value <= roundoff else one_digit(share * size / value) for share, value in sizes))

    @property
    def words(self) -> str:
        """Return the factors in words, for the reader of the figure."""
        return f"displacements × {self.move:g}, penetration × {self.gap:g}"


def magnifications(solved: SolvedScene) -> dict[str, Magnification]:
    """Return {formulation: magnification}, the same for all solutions that stay near, so that they can be compared."""
    near = [
        each for each in solved.solutions if all(np.abs(u).max(initial=0.0) < solved.size for u in each.displacements)
    ]
    shared = Magnification.for_solutions(solved, near) if near else Magnification(1.0, 1.0)
    return {
        solution.formulation: shared if solution in near else Magnification.for_solutions(solved, [solution])
        for solution in solved.solutions
    }


def colour_scale(solved: SolvedScene) -> ScalarMappable:
    """Return a scale over the pressures of all cells of all solutions, in space of all nodes of the interface.

    A single exact pressure is in the middle.
    """
    if solved.case.interface.dim != PLANE:
        pressures = np.concatenate([solved.node_pressures(solution) for solution in solved.solutions])
    else:
        pairs = [pair for solution in solved.solutions for pair in zip(solved.bodies, solution.stresses, strict=True)]
        pressures = np.concatenate([pressures_across(*pair) for pair in pairs])
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
    states = [(solution.z.reshape(-1, 2), _gaps(solved, solution.z).gap < 0) for solution in solved.solutions]
    touching = [positions[np.flatnonzero(inside)] for positions, inside in states]
    near = [nodes for nodes in touching if np.ptp(nodes, axis=0).max(initial=0.0) < solved.size]
    places = np.vstack(near or touching)
    extent = float(np.ptp(places, axis=0).max()) if len(places) > 1 else 0.0
    if not 0 < extent < _SMALL_CONTACT * solved.size:
        return None
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    box: FloatArray = middle + np.array([[-1.0], [1.0]]) * _AROUND * extent / 2
    return box


def plot_bodies(
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
            ends = nodes[body.contact]  # (n_segments, 2, 2)
            chords = ends[:, 1] - ends[:, 0]
            lefts = np.column_stack([-chords[:, 1], chords[:, 0]]) / np.linalg.norm(chords, axis=1)[:, None]
            strips = hatch(axes, ends, ends + _SUPPORT * solved.size * lefts[:, None], "0.5", "////")
            axes.plot(*strips.reshape(-1, 2).T, linestyle="none")  # The axes reach around it.
        else:
            _plot_cells(axes, nodes[body.cells], pressures_across(body, solution.stresses[index]), scale, box)
        style, marker, fill = ("solid", "o", "black") if side == "slave" else ((0, (4, 1.5)), "s", "white")
        edges, at = list(nodes[body.contact]), nodes[body.contact_nodes]
        axes.add_collection(LineCollection(edges, colors="black", linewidths=1.3, linestyles=[style], zorder=5))
        look: dict[str, Any] = {"marker": marker, "mfc": fill, "ms": 3.6 if len(at) <= _MANY_NODES else 1.5}
        axes.plot(*at.T, ls="none", mec="black", mew=0.8, zorder=6, **look)
    _plot_penetration(axes, solved, surface[: len(shifts)] + shifts, large.gap * gaps.gap, magnified.normal)
    axes.set_aspect("equal", adjustable="box")
    axes.margins(0.04)
    if box is not None:
        axes.set(xlim=box[:, 0], ylim=box[:, 1])


def _plot_cells(
    axes: Axes, corners: FloatArray, pressures: FloatArray, scale: ScalarMappable, box: FloatArray | None
) -> None:
    """Draw the cells, with corners (n_cells, n_corners, 2), in the colours of their pressures."""
    if box is not None:
        low, high = corners.min(axis=1), corners.max(axis=1)
        visible = (high >= box[0]).all(axis=1) & (low <= box[1]).all(axis=1)
        corners, pressures = corners[visible], pressures[visible]
    look: dict[str, Any] = {"edgecolor": "0.25", "linewidth": 0.4 if len(corners) <= _MANY_CELLS else 0.2, "zorder": 2}
    faces = axes.add_collection(PolyCollection(list(corners), **look))
    faces.set_array(pressures)
    faces.set(cmap=scale.cmap, norm=scale.norm)


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


def _plot_penetration(axes: Axes, solved: SolvedScene, slave: FloatArray, gap: FloatArray, normal: FloatArray) -> None:
    """Hatch what lies between the slave's surface and the master's where the slave penetrates."""
    feet = slave - gap[:, None] * normal
    segments = solved.case.interface.slave.segments
    inside = segments[(np.minimum(gap, 0.0)[segments] < 0).any(axis=1)]
    if not len(inside):
        return
    quads = np.concatenate([slave[inside], feet[inside[:, ::-1]]], axis=1)
    look: dict[str, Any] = {"facecolor": "white", "edgecolor": "black", "linewidth": 0, "hatch": "xxxxxx"}
    axes.add_collection(PolyCollection(list(quads), alpha=0.55, zorder=4, **look))
