"""The figure of a case in space: both surfaces seen from above, side by side, with numbers and forces.

The view is along the mean normal of the master, so the slave is seen through its body. Nodes have the force of the
formulation beside the exact one, and faces are shaded by the largest error at their corners. Importing matplotlib is
slow.
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
from contactverif_reports.draw.strokes import size_in_words
from contactverif_reports.draw.surface_text import headline

_NUMBERED = 60  # The faces of at most so many on a side get numbers.
_MEASURED = 16  # The nodes of at most so many on a side get their forces.
_SAME = 1e-6  # Forces that differ by a smaller share of the largest one are written as one.
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
    titles = "slave, seen through its body", "master, seen from outside"
    for axes, surface, name in zip(panels, (interface.slave, interface.master), titles, strict=True):
        _draw_faces(axes, surface, places, errors, _force_labels(surface, forces, exact))
        axes.set_title(name, fontsize=9, pad=6 if forces is None else 22)  # Forces stand above the upper nodes.
        axes.margins(0.08)
        axes.set_aspect("equal", adjustable="box")
        axes.set_axis_off()
    for axes, other in zip(panels, (interface.master, interface.slave), strict=True):
        outlines = list(places[other.faces])
        axes.add_collection(PolyCollection(outlines, facecolors="none", edgecolors="0.8", linewidths=0.5, zorder=0))
        axes.autoscale_view()
    lines = [headline(case) + (f", drawn {format_number(stretch)} times wider across" if stretch > 1 else "")]
    lines += _force_notes(forces, errors)
    figure.suptitle("\n".join([*textwrap.wrap(title, 92), *lines]), fontsize=9, x=0.02, ha="left", parse_math=False)
    return figure


def _force_notes(forces: FloatArray | None, errors: FloatArray | None) -> list[str]:
    """Say what the numbers at the nodes and the shades of the faces are."""
    if forces is None:
        return []
    if errors is None:
        return ["at the nodes: number, force"]
    largest = f"up to {errors.max():.3g} of the largest exact force" if np.isfinite(errors).all() else "not finite"
    return [
        "at the nodes: number, force and, where it differs, exact force",
        f"shade: error of the nodal forces, {largest}",
    ]


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
    largest = float(np.linalg.norm(exact.reshape(difference.shape), axis=1).max())
    errors: FloatArray = np.linalg.norm(difference, axis=1) / (largest or 1.0)
    return errors


def _force_labels(surface: Surface, forces: FloatArray | None, exact: FloatArray | None) -> dict[int, str]:
    """Return {node: its number, its force, and the exact one if that differs}; numbers alone for a large surface."""
    if forces is None or len(surface.nodes) > _MEASURED:
        return {node: str(node) for node in surface.nodes.tolist()}
    by_node, exact_by_node = (np.reshape(each, (-1, 3)) for each in (forces, forces if exact is None else exact))
    sizes, exact_sizes = (np.linalg.norm(each, axis=1) for each in (by_node, exact_by_node))
    slack = _SAME * float(exact_sizes.max())
    labels = {}
    for node in surface.nodes.tolist():
        labels[node] = f"{node}: {size_in_words(float(sizes[node]), float(exact_sizes[node]), slack)}"
        if "\n" not in labels[node] and np.linalg.norm(by_node[node] - exact_by_node[node]) > slack:
            labels[node] += "\nother way"  # Forces of one size in two directions.
    return labels


def _draw_faces(
    axes: Axes, surface: Surface, places: FloatArray, errors: FloatArray | None, labels: dict[int, str]
) -> None:
    """Draw the faces of a surface with their numbers, shaded by the errors (n_nodes,) at corners, and its nodes."""
    collection = PolyCollection(list(places[surface.faces]), facecolors="white", edgecolors="black", linewidths=0.8)
    if errors is not None and np.isfinite(errors).all():
        collection.set_array(errors[surface.faces].max(axis=1))
        collection.set_cmap(_SHADES)
        collection.set_clim(0.0, max(2 * float(errors.max()), np.finfo(np.float64).tiny))  # Numbers stay legible.
    axes.add_collection(collection)
    if len(surface) > _NUMBERED:
        return
    for number, corners in enumerate(surface.faces.tolist()):
        x, y = places[corners].mean(axis=0).tolist()
        axes.text(x, y, str(number), fontsize=7, ha="center", va="center", color="0.35")
    middle = places[surface.nodes].mean(axis=0)
    for node, label in labels.items():
        axes.plot(*places[node], "o", markersize=2.5, color="black")
        right, upper = (places[node] >= middle).tolist()
        axes.annotate(
            label,
            places[node],
            (0, 3 if upper else -3),
            textcoords="offset points",
            ha="right" if right else "left",
            va="bottom" if upper else "top",
            fontsize=7,
            fontweight="bold",
        )
