"""Draws and stores the patch tests of the paper: pressures, magnified penetrations, meshes. Slow to import.

Items `case_a1` to `example_1bis` use this file; it knows none of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from contactverif.contract.arrays import FloatArray
from contactverif.contract.body import Body
from contactverif_paper.figure_style import (
    LETTERS,
    REFERENCE_LINE,
    TWO_COLUMNS,
    add_legend,
    line_style,
    new_figure,
    new_panels,
    use_round_ticks,
)
from contactverif_paper.paper_formulations import PaperFormulation, name_variables
from contactverif_paper.paper_item import Agreement, Statement
from contactverif_paper.paper_tree import pad_rows
from contactverif_paper.patch_solutions import Curve, PatchSolution
from contactverif_reports.draw.scene_meshes import colour_scale, draw_bodies, magnifications
from contactverif_reports.draw.solved_scene import SolvedScene
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.variables import codes, numbers, words

_TALLEST = 2.6  # Inches: the height of a panel with a deformed mesh.
_SHORT_AXIS = 4.0  # An x axis of this length has a tick at each unit.
_BROAD_LEGEND = 3  # Columns of a legend under two panels.
_ARROW = 0.12  # Length of an arrow of pressure over the height of a body.


def plot_pressures(patches: Sequence[PatchSolution]) -> Figure:
    """Draw one panel for each scene, or for a scene and its close-up, with the paper's axes."""
    views = [(patch, patch.setup.axis) for patch in patches]
    views += [(patch, patch.setup.close_up) for patch in patches if patch.setup.close_up]
    figure = new_figure(TWO_COLUMNS, 3.6 if len(views) > 1 else 3.4)
    for axes, (patch, limits) in zip(new_panels(figure, len(views)), views, strict=True):
        _draw_pressures(axes, patch, limits)
    remarks = {curve.formulation: end_remark(curve) for patch in patches for curve in patch.not_converged}
    add_legend(figure, _legend_order(patches), reference="exact", columns=_BROAD_LEGEND, remarks=remarks)
    return figure


def _draw_pressures(axes: Axes, patch: PatchSolution, limits: tuple[float, float]) -> None:
    low, high = limits
    axes.axhline(1.0, **REFERENCE_LINE)
    for curve in patch.curves:
        inside = low <= curve.pressure.min() and curve.pressure.max() <= high
        axes.plot(curve.x, curve.pressure, clip_on=not inside, **line_style(curve.formulation, len(curve.x)))
    axes.set_xlabel("x coordinate (length)")
    axes.set_ylabel("contact pressure / p (–)")
    use_round_ticks(axes, 6)
    axes.set_xticks(_printed_ticks(*patch.setup.x_axis))
    axes.set_xlim(*patch.setup.x_axis)
    axes.set_ylim(low, high)


def _legend_order(patches: Sequence[PatchSolution]) -> list[PaperFormulation]:
    return list(dict.fromkeys(curve.formulation for patch in patches for curve in patch.curves))


def plot_penetrations(patches: Sequence[PatchSolution]) -> Figure:
    """Draw one panel for each formulation and scene, the penetration magnified alike in all of a scene."""
    panels = [curve for patch in patches for curve in patch.curves]
    across = 2
    down = -(-len(panels) // across)
    wide, high = np.ptp(np.vstack([body.nodes for body in patches[0].solved.bodies]), axis=0)
    panel = min((TWO_COLUMNS - 1.0) / across, _TALLEST * wide / high)
    figure = new_figure(TWO_COLUMNS, down * (1.08 * panel * high / wide + 0.4) + 0.5)
    grid = figure.subplots(down, across, squeeze=False)
    for axes in grid.ravel():
        axes.set_axis_off()
    letters, remaining = iter("abcdefghij"), iter(grid.ravel())
    remarks: dict[str, None] = {}
    for patch in patches:
        scale, magnified = colour_scale(patch.solved), magnifications(patch.solved)
        remarks |= dict.fromkeys(magnification.words for magnification in magnified.values())
        panels_of_scene = [next(remaining) for _ in patch.curves]
        for axes, curve in zip(panels_of_scene, patch.curves, strict=True):
            draw_bodies(axes, patch.solved, curve.solution, magnified[curve.solution.formulation], scale)
            axes.set_title(f"({next(letters)}) {curve.formulation.legend}{end_remark(curve)}", loc="left")
        bar = figure.colorbar(scale, ax=panels_of_scene, shrink=0.8, aspect=16, pad=0.01)
        bar.set_label("−σₙ (force / length)")
        bar.locator = MaxNLocator(5, steps=[1, 2, 5, 10])
        bar.outline.set_linewidth(0.5)
    figure.supxlabel("\n".join(_above_and_below(list(remarks))), fontsize=LETTERS)
    return figure


def plot_meshes(solved: SolvedScene) -> Figure:
    """Draw the undeformed meshes of both bodies and the pressure on them."""
    figure = new_figure(TWO_COLUMNS, 3.6)
    axes = figure.subplots()
    axes.set_axis_off()
    for body in solved.bodies:
        axes.add_collection(LineCollection(list(_edges(body)), colors="0.35", linewidths=0.7, zorder=2))
        _draw_contact(axes, body)
        _draw_load(axes, body)
    axes.set_aspect("equal")
    axes.margins(0.04)
    axes.autoscale_view()
    figure.supxlabel("filled: slave nodes; open: master nodes; arrows: p = 1", fontsize=LETTERS)
    return figure


def range_statement(patch: PatchSolution) -> Statement:
    """Say what the printed pressure axis and our curves have in common; the paper prints no penalty."""
    setup = patch.setup
    low, high = setup.axis
    least, largest = patch.pressure_range
    inside = low <= least and largest <= high
    share = (largest - least) / (high - low)
    result = f"at ε̂ = {setup.stiffness:g} × E, which we chose, curves run from {least:.3f} to {largest:.3f}: "
    result += f"{share:.0%} of that axis" if inside else "they leave that axis"
    return Statement(
        f"Fig. {setup.pressures}",
        f"{setup.title}: the axis runs from {low:.2f} to {high:.2f} of the exact pressure; no penalty is printed",
        result,
        Agreement.SILENT if inside else Agreement.DIFFERS,
        f"fig{setup.pressures.partition('(')[0].zfill(2)}",
    )


def end_remark(curve: Curve) -> str:
    """Return how Newton's method ended, in brackets; empty for a solution."""
    return "" if curve.solution.converged else f" ({curve.solution.end})"


def patch_dataset(patches: Sequence[PatchSolution]) -> xr.Dataset:
    """Return pressures, stress errors and displacements (scene, formulation, …).

    NaN stands where a figure does not show a formulation.
    """
    columns = _legend_order(patches)
    cells = [[_curve_of(patch, formulation) for formulation in columns] for patch in patches]
    table = name_variables(columns) | _setup_variables(patches) | _curve_variables(cells) | _node_variables(patches)
    comment = "pressures at virtual slave nodes where at_points, else nodal forces over the nodes' shares"
    return xr.Dataset(table, attrs={"comment": comment})


def _setup_variables(patches: Sequence[PatchSolution]) -> dict[str, xr.Variable]:
    scene, setups = ["scene"], [patch.setup for patch in patches]
    return {
        "scene": words(scene, [setup.scene for setup in setups], "scene, as on the command line"),
        "figure": words(scene, [f"{setup.meshes}, {setup.pressures}" for setup in setups], "meshes, pressures"),
        "stiffness": numbers(scene, [setup.stiffness for setup in setups], "penalty over E", "m-1"),
        "exact_pressure": numbers(scene, [patch.exact for patch in patches], "exact contact pressure", schema.STRESS),
        "penalty": numbers(scene, [patch.solved.case.penalty for patch in patches], "penalty", schema.PENALTY),
    }


def _curve_variables(cells: Sequence[Sequence[Curve | None]]) -> dict[str, xr.Variable]:
    dims = ["scene", "formulation"]
    stress_error = "largest error of a stress at a Gauss point over the pressure"
    at_points = [[-1 if curve is None else curve.at_points for curve in row] for row in cells]
    ends = [["" if curve is None else curve.solution.end for curve in row] for row in cells]
    kinds = {"at_nodes": 0, "at_points": 1}
    return {
        "x": _ragged_variable([*dims, "point"], cells, "x", "reference coordinate on the paper's axis", schema.LENGTH),
        "pressure": _ragged_variable([*dims, "point"], cells, "pressure", "contact pressure over the exact one", "1"),
        "at_points": codes(dims, at_points, kinds, "where pressures are taken", "missing: not shown", fill=-1),
        "stress_error": _scalar(dims, cells, "stress_error", stress_error),
        "iterations": _scalar(dims, cells, "n_iterations", "linear systems solved"),
        "end": words(dims, ends, "how Newton's method ended"),
        "displacement_x": _ragged_variable([*dims, "node"], cells, "ux", "displacement along x", schema.LENGTH),
        "displacement_y": _ragged_variable([*dims, "node"], cells, "uy", "displacement along y", schema.LENGTH),
    }


def _printed_ticks(low: float, high: float) -> FloatArray:
    """Return the ticks of the paper's x axes: every unit on a short axis, else every second one."""
    return np.arange(low, high + 0.5, 1.0 if high - low <= _SHORT_AXIS else 2.0)


def _above_and_below(lines: list[str]) -> list[str]:
    return [f"above: {lines[0]}", f"below: {lines[1]}"] if len(lines) == 2 else lines


def _edges(body: Body) -> FloatArray:
    """Return the ends (n_edges, 2, 2) of the edges of a body's cells, each once."""
    pairs = np.stack([body.cells, np.roll(body.cells, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges: FloatArray = body.nodes[np.unique(np.sort(pairs, axis=1), axis=0)]
    return edges


def _draw_contact(axes: Axes, body: Body) -> None:
    is_slave = body.name == "slave"
    face = "black" if is_slave else "white"
    nodes = body.nodes[body.contact_nodes]
    axes.plot(*nodes.T, ls="none", marker="o" if is_slave else "s", ms=5, mfc=face, mec="black", zorder=6 - is_slave)


def _draw_load(axes: Axes, body: Body) -> None:
    loaded = np.flatnonzero(body.load[:, 1] < 0)
    height = float(np.ptp(body.nodes[:, 1])) * _ARROW
    for x, y in body.nodes[loaded]:
        axes.annotate("", (x, y), (x, y + height), arrowprops={"arrowstyle": "-|>", "color": "black", "lw": 0.8})
        axes.plot(x, y + height, alpha=0.0)


def _curve_of(patch: PatchSolution, formulation: PaperFormulation) -> Curve | None:
    return next((curve for curve in patch.curves if curve.formulation == formulation), None)


def _values(curve: Curve | None, name: str) -> FloatArray:
    if curve is None:
        return np.zeros(0)
    if name in ("ux", "uy"):
        displacements: FloatArray = np.vstack(curve.solution.displacements)[:, "xy".index(name[1])]
        return displacements
    values: FloatArray = getattr(curve, name)
    return values


def _ragged_variable(
    dims: Sequence[str], cells: Sequence[Sequence[Curve | None]], name: str, long_name: str, units: str
) -> xr.Variable:
    flat = pad_rows([_values(curve, name) for row in cells for curve in row])
    shaped = flat.reshape(len(cells), len(cells[0]), -1)
    return numbers(dims, shaped, long_name, units, "NaN: nothing there", fill=np.nan)


def _scalar(dims: Sequence[str], cells: Sequence[Sequence[Curve | None]], name: str, long_name: str) -> xr.Variable:
    def value(curve: Curve | None) -> float:
        if curve is None:
            return np.nan
        return curve.solution.stress_error if name == "stress_error" else float(len(curve.solution.residuals) - 1)

    return numbers(dims, [[value(curve) for curve in row] for row in cells], long_name, "1", fill=np.nan)


def _node_variables(patches: Sequence[PatchSolution]) -> dict[str, xr.Variable]:
    """Return reference coordinates and bodies (scene, node) of the nodes that displacements belong to."""
    dims = ["scene", "node"]
    nodes = [np.vstack([body.nodes for body in patch.solved.bodies]) for patch in patches]
    bodies = [np.repeat(np.arange(2.0), [len(body.nodes) for body in patch.solved.bodies]) for patch in patches]
    table = {"body": numbers(dims, pad_rows(bodies), "body of the node; 0 is the slave", "1", fill=np.nan)}
    for axis, name in enumerate("xy"):
        places = pad_rows([rows[:, axis] for rows in nodes])
        table[f"node_{name}"] = numbers(dims, places, f"reference {name}", schema.LENGTH, fill=np.nan)
    return table
