"""The figure of a case in space: both surfaces seen from above, side by side, with numbers and the error of the forces.

The view is along the mean normal of the master. Faces are shaded by the largest error of a nodal force at their
corners. Importing matplotlib is slow.
"""

from __future__ import annotations

import textwrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Surface
from contactverif_reports.draw.lengths import format_number, one_digit
from contactverif_reports.draw.surface_text import headline

_NUMBERED = 60  # The faces of at most so many on a side get numbers.
_SHADES = "Oranges"
_THIN = 6.0  # The ratio of length and width from which surfaces are drawn wider.


def make_surface_figure(
    case: Case, *, title: str, forces: FloatArray | None, exact: FloatArray | None, width: float
) -> Figure:
    """Return the figure: the slave on the left and the master on the right, in one scale and one view."""
    places, stretch = widen(view_from_above(case))
    errors = _node_errors(case, forces, exact)
    figure = Figure(figsize=(width, width / 2 + 1.2), layout="constrained")
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    interface = case.interface
    for axes, surface, name in zip(panels, (interface.slave, interface.master), ("slave", "master"), strict=True):
        _draw_faces(axes, surface, places, errors)
        axes.set_title(f"{name}, seen from outside its body", fontsize=9)
        axes.set_aspect("equal", adjustable="box")
        axes.set_axis_off()
    for axes, other in zip(panels, (interface.master, interface.slave), strict=True):
        outlines = list(places[other.faces])
        axes.add_collection(PolyCollection(outlines, facecolors="none", edgecolors="0.8", linewidths=0.5, zorder=0))
        axes.autoscale_view()
    notes = [headline(case) + (f", drawn {format_number(stretch)} times wider across" if stretch > 1 else "")]
    if errors is not None:
        largest = format_number(float(errors.max()))
        notes.append(f"shade: error of the nodal forces, up to {largest} of the largest force")
    figure.suptitle("\n".join([*textwrap.wrap(title, 92), *notes]), fontsize=9, x=0.02, ha="left", parse_math=False)
    return figure


def view_from_above(case: Case) -> FloatArray:
    """Return plane coordinates (n_nodes, 2) of the current positions, seen against the master's mean normal."""
    positions, faces = case.positions, case.interface.master.faces
    corners = positions[faces]
    turns = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]).sum(axis=0)
    size = float(np.linalg.norm(turns))
    normal = turns / size if size > 0 else np.array([0.0, 0.0, 1.0])  # A closed surface has no mean normal.
    start = np.eye(3)[np.argmin(np.abs(normal))]
    right = np.cross(start, normal)
    right /= np.linalg.norm(right)
    centred = positions - positions.mean(axis=0)
    return np.column_stack([centred @ right, centred @ np.cross(normal, right)])


def widen(places: FloatArray) -> tuple[FloatArray, float]:
    """Return places (n_nodes, 2) stretched across their longer axis if they are long and thin, and the factor."""
    axes, sizes = np.linalg.svd(places - places.mean(axis=0), full_matrices=False)[2:0:-1]
    if sizes[1] <= 0 or sizes[0] < _THIN * sizes[1]:
        return places, 1.0
    factor = one_digit(float(sizes[0] / sizes[1]) / 2)
    return (places @ axes.T) * [1.0, factor], factor


def _node_errors(case: Case, forces: FloatArray | None, exact: FloatArray | None) -> FloatArray | None:
    """Return the error (n_nodes,) of each nodal force over the largest exact one, if both are known."""
    if forces is None or exact is None:
        return None
    difference = (forces - exact).reshape(case.interface.nodes.shape)
    size = float(np.linalg.norm(exact.reshape(difference.shape), axis=1).max())
    errors: FloatArray = np.linalg.norm(difference, axis=1) / (size or 1.0)
    return errors


def _draw_faces(axes: Axes, surface: Surface, places: FloatArray, errors: FloatArray | None) -> None:
    """Draw the faces of a surface with their numbers and those of nodes, shaded by the errors (n_nodes,) at corners."""
    collection = PolyCollection(list(places[surface.faces]), facecolors="white", edgecolors="black", linewidths=0.8)
    if errors is not None:
        collection.set_array(errors[surface.faces].max(axis=1))
        collection.set_cmap(_SHADES)
        collection.set_clim(0.0, max(2 * float(errors.max()), np.finfo(np.float64).tiny))  # Numbers stay legible.
    axes.add_collection(collection)
    if len(surface) > _NUMBERED:
        return
    for number, corners in enumerate(surface.faces.tolist()):
        x, y = places[corners].mean(axis=0).tolist()
        axes.text(x, y, str(number), fontsize=7, ha="center", va="center", color="0.35")
    for node in surface.nodes.tolist():
        axes.plot(*places[node], "o", markersize=2.5, color="black")
        axes.annotate(str(node), places[node], (2, 2), textcoords="offset points", fontsize=7, fontweight="bold")
