"""The bodies of a stored scene before anything is solved: cells, supports, loads, surfaces. Importing it is slow.

The case holds all of it (`parameter_bodies_…`, see reports/README.md), in one numbering of nodes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif_reports.draw.case_figure import make_case_figure
from contactverif_reports.draw.strokes import MASTER, SLAVE

_SHADES = {True: "0.88", False: "0.96"}  # The slave is darker than the master.
_ARROW = 0.14  # Length of the longest load, as a share of the scene.
_SUPPORT = 0.02  # Half the length of the mark of a support, as a share of the scene.


def make_mesh_figure(
    case: Case, width: float, *, forces: FloatArray | None = None, exact: FloatArray | None = None
) -> Figure:
    """Return the figure of a case: its bodies, if it holds any, else its interface with forces."""
    if case.packed_bodies:
        return make_outline_figure(case, width)
    return make_case_figure(case, forces=forces, exact=exact, width=width)


def make_outline_figure(case: Case, width: float) -> Figure:
    """Return a figure of the bodies in their reference configuration; a rigid body is its surface."""
    packed = case.packed_bodies
    nodes = packed["nodes"]  # (n_nodes, 2) of all bodies
    of_body = np.repeat(np.arange(len(packed["count"])), packed["count"].astype(np.int64))  # (n_nodes,)
    is_slave = packed["is_slave"] != 0
    size = float(np.ptp(nodes, axis=0).max())
    across, high = np.ptp(nodes, axis=0) / size + 2 * _ARROW
    height = float(np.clip(width * high / across, 1.8, 0.75 * width)) + 0.5
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.add_subplot()
    axes.set_aspect("equal", adjustable="datalim")
    cells = packed["cells"].astype(np.int64)
    _draw_cells(axes, cells, nodes, is_slave[of_body])
    first = packed["axis"][of_body]  # (n_nodes, 2)
    second = np.column_stack([-first[:, 1], first[:, 0]])
    rigid = ~np.isin(of_body, of_body[cells[cells >= 0]])  # (n_nodes,); a triangle has −1 for a fourth corner
    _draw_surfaces(axes, packed["contact"].astype(np.int64), nodes, is_slave[of_body], rigid)
    fixed = (packed["fixed"] != 0) & ~rigid[:, None]
    _draw_supports(axes, nodes, fixed, (first, second), _SUPPORT * size)
    loads = packed["load"][:, :1] * first + packed["load"][:, 1:] * second
    _draw_loads(axes, nodes, loads, _ARROW * size)
    axes.set(xlabel="x", ylabel="y")
    axes.margins(0.06)
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    return figure


def _draw_cells(axes: Axes, cells: IntArray, nodes: FloatArray, is_slave: Any) -> None:
    for side, shade in _SHADES.items():
        polygons = [nodes[cell[cell >= 0]] for cell in cells if bool(is_slave[cell[0]]) == side]
        axes.add_collection(PolyCollection(polygons, facecolor=shade, edgecolor="0.55", linewidth=0.5, zorder=1))
    axes.plot(*nodes.T, linestyle="none")  # The axes reach around it.


def _draw_surfaces(axes: Axes, contact: IntArray, nodes: FloatArray, is_slave: Any, rigid: Any) -> None:
    for pen, side in ((MASTER, False), (SLAVE, True)):
        edges = contact[is_slave[contact[:, 0]] == side]
        look = pen.marks(4.5 if len(edges) <= 30 else 2)
        axes.add_collection(
            LineCollection(list(nodes[edges]), colors=pen.color, linewidths=1.6, linestyles=pen.style, zorder=3)
        )
        axes.plot(*nodes[np.unique(edges)].T, linestyle="none", zorder=4, **look)
        axes.plot([], [], linestyle=pen.style, label=pen.name + " (rigid)" * bool(rigid[edges].all()), **look)


def _draw_supports(
    axes: Axes, nodes: FloatArray, fixed: Any, frame: tuple[FloatArray, FloatArray], half: float
) -> None:
    """Draw a short bar across each direction in which a node is fixed."""
    first, second = frame
    bars = []
    for component, across in ((0, second), (1, first)):
        ends = half * across[fixed[:, component]]
        at_nodes = nodes[fixed[:, component]]
        bars += list(np.stack([at_nodes - ends, at_nodes + ends], axis=1))
    if bars:
        axes.add_collection(LineCollection(bars, colors="black", linewidths=2.2, zorder=5))
        axes.plot([], [], color="black", linewidth=2.2, label="support")


def _draw_loads(axes: Axes, nodes: FloatArray, loads: FloatArray, longest: float) -> None:
    """Draw arrows that end at the nodes."""
    sizes = np.linalg.norm(loads, axis=1)
    if not sizes.max(initial=0.0) > 0:
        return
    arrows, at = loads[sizes > 0] * (longest / sizes.max()), nodes[sizes > 0]
    axes.quiver(
        *(at - arrows).T, *arrows.T, angles="xy", scale_units="xy", scale=1, width=0.004, color="0.25", zorder=6
    )
    axes.plot(*(at - arrows).T, linestyle="none")
    axes.plot([], [], marker=r"$\downarrow$", linestyle="none", color="0.25", label="load")
