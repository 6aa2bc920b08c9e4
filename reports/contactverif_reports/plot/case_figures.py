"""Figures of a case: its interface with forces, its faces from above, or its bodies. Importing it is slow."""

import os
import re
import textwrap
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import BboxBase

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError, printable
from contactverif.contract.interface import PLANE, Surface
from contactverif_reports.files import checked_name, whole
from contactverif_reports.plot.geometry import (
    Course,
    Gaps,
    format_number,
    one_digit,
    outer_faces,
    segment_lengths,
    unit_of,
)
from contactverif_reports.plot.text import describe_blocks, reference_sizes, surfaces_headline

SUFFIXES = (".png", ".svg")
# Lengths as shares of the size of the interface.
_VISIBLE_GAP = 0.05  # A smaller largest gap is magnified to this share.
_DISTANCE = 0.13  # Distance of surfaces that are drawn apart, to make room for arrows.
_BODY = 0.10  # Width of the hatched part of a body.
_ARROW = 0.15  # Length of the longest arrow.
_SHORT = 0.04  # The length of a segment that is shorter is written below the title.
_NUMBERED_FACES = 60  # The faces of at most so many on a side get numbers.
_MEASURED = 16  # The nodes of at most so many on a side get their forces.
_SAME = 1e-6  # Forces that differ by a smaller share of the largest one are written as one.
_ERROR_COLOURS = "Oranges"
_THIN = 6.0  # The ratio of length and width from which surfaces are drawn wider.
_BODY_SHADES = {True: "0.88", False: "0.96"}  # The slave is darker than the master.
_LOAD = 0.14  # Length of the longest load, as a share of the scene.
_SUPPORT = 0.02  # Half the length of the mark of a support, as a share of the scene.
_NUMBERED = 20  # About so many nodes a side get their numbers.
_LABELLED = 10  # Lengths of segments and sizes of forces are written for at most so many a side.
_ROOM = 0.04  # A segment shorter than this share of the picture gets no label.
_POWER_OF_TEN = re.compile(r"(?=.*\d)-?\$(\\mathdefault\{)?[-−+]?[0-9.]*(\\times)?(10)?\^?(\{[-−]?[0-9]+\})?\}?\$")


def plot_case(
    case: Case,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    forces: FloatArray | None = None,
    exact: FloatArray | None = None,
) -> None:
    """Draw the current state of a case to a .png or .svg file, below a title that is wrapped.

    A penetration that is small against the interface is magnified, and the figure says by which factor. Nodal forces of
    the formulation and exact ones, (n_nodes, dim) or (n_unknowns,), act on the nodes (minus the residual). They are
    drawn as arrows of one scale; in space faces are shaded by their difference.
    """
    target = checked_name(path, SUFFIXES)
    save(make_case_figure(case, title=title, forces=forces, exact=exact), target)


def make_case_figure(
    case: Case, *, title: str = "", forces: FloatArray | None, exact: FloatArray | None, width: float = 7.5
) -> Figure:
    """Return the figure of a case: both surfaces, the hatched bodies and the forces, as `plot_case` does.

    In space it is both surfaces from above, shaded by the error of the forces.
    """
    if case.interface.dim != PLANE:
        return _surface_figure(case, title=title, forces=forces, exact=exact, width=width)
    course, gaps = Course.from_case(case), Gaps.from_case(case)
    with_forces = forces is not None or exact is not None
    lengths = segment_lengths(case)
    unit, unit_name = unit_of(np.concatenate(lengths))
    positions, change = _positions_to_draw(case, gaps, course.roundoff, with_forces)
    # A straight interface is turned as in text: the slave lies above the master.
    turn = course.turn if course.rotation else np.eye(2)
    positions = (positions / unit) @ turn
    forces, exact = (None if each is None else np.reshape(each, (-1, 2)) @ turn for each in (forces, exact))
    size = float(np.ptp(positions, axis=0).max())
    across, high = np.ptp(positions, axis=0) + 2 * (_BODY + _ARROW * with_forces) * size
    height = float(np.clip((width - 1) * high / across, 1.6, width)) + 1.7
    figure, axes = _make_axes(width, height)
    # Labels are legible on the side of the other body, where nothing is hatched.
    side = -1.0 if with_forces or gaps.gap.mean() < 0 else 1.0
    surfaces = (case.interface.master, case.interface.slave)
    for surface, pen, its_lengths in zip(surfaces, (MASTER, SLAVE), lengths[::-1], strict=True):
        labels = [f"ℓ={format_number(length, course.roundoff / unit)}" for length in (its_lengths / unit).tolist()]
        _plot_surface(axes, surface, positions, labels, pen, body=_BODY * size, side=side)
    _plot_arrows(axes, positions, forces, exact, longest=_ARROW * size)
    x, y = ("along the slave", "across it") if course.rotation else "xy"
    unit_name = unit_name and f" / {unit_name}"
    axes.set(xlabel=f"{x}{unit_name}", ylabel=f"{y}{unit_name}")
    axes.margins(0.05)
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    facing = gaps.gap[gaps.facing]
    ends = (
        () if not len(facing) else (facing.mean(),) if gaps.uniform(course.roundoff) else (facing.min(), facing.max())
    )
    gap = " to ".join(format_number(float(end), course.roundoff) for end in ends)
    notes = [f"gap {gap}{change}" if gap else f"no slave node faces the master{change}"]
    notes += [f"{course.rotation}, here turned back"] if course.rotation else []
    shortest = min(float(its_lengths.min()) for its_lengths in lengths) / unit
    if shortest < _SHORT * size:
        notes.append(f"shortest segment {format_number(shortest, course.roundoff / unit)}")
    lines = [*textwrap.wrap(title, 92), ", ".join(notes), *textwrap.wrap(reference_sizes(case, unit), 92)]
    axes.set_title("\n".join(lines), fontsize=9, loc="left", parse_math=False)
    return figure


def _make_axes(width: float, height: float) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.add_subplot()
    axes.set_aspect("equal", adjustable="datalim")
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _positions_to_draw(case: Case, gaps: Gaps, roundoff: float, with_forces: bool) -> tuple[FloatArray, str]:
    """Return positions (n_nodes, 2) to draw, a length each, and how the slave is moved for it, in words."""
    positions = case.positions.copy()
    size, largest, factor = float(np.ptp(positions, axis=0).max()), float(np.abs(gaps.gap).max()), 1.0
    if with_forces:
        moves = np.full(len(gaps.gap), _DISTANCE * size + max(0.0, -float(gaps.gap.min())))
        change = ", drawn apart"
    else:
        if roundoff * 1e-3 < largest < _VISIBLE_GAP * size:
            factor = max(1.0, one_digit(_VISIBLE_GAP * size / largest))
        moves = (factor - 1) * gaps.gap
        change = "" if factor == 1 else f", drawn {format_number(factor)} times larger"
    positions[: case.interface.n_slave_nodes] += moves[:, None] * gaps.normal
    return positions, change


def save(figure: Figure, target: Path) -> None:
    """Write a figure to a file; the same figure gives the same bytes, without a date or random ids."""
    suffix = target.suffix.lower()
    metadata = {"Date": None} if suffix == ".svg" else {"Software": None}
    try:
        with matplotlib.rc_context({"svg.hashsalt": "contactverif"}), whole(target) as part:
            save_plainly(figure, part, format=suffix[1:], dpi=150, metadata=metadata)
    except OSError as error:
        raise MisuseError("path", f"{target}: {error.strerror}", "a file that can be written") from error


@dataclass(frozen=True, slots=True)
class Pen:
    """The look that tells one surface from the other, without colours."""

    name: str
    color: str
    style: str
    marker: str
    fill: str
    hatch: str


SLAVE = Pen("slave", "black", "solid", "o", "black", "///")
MASTER = Pen("master", "0.4", "dashed", "s", "white", "\\\\\\")


_BROAD = {"width": 0.010, "headwidth": 2.2, "headlength": 2.4, "headaxislength": 2.4}
_ARROWS: dict[str, dict[str, Any]] = {
    "exact": {"color": "0.72", "label": "exact force", **_BROAD},
    "formulation": {"color": "black", "width": 0.003, "label": "force of the formulation"},
}


def _plot_surface(
    axes: Axes, surface: Surface, nodes: FloatArray, labels: Sequence[str], pen: Pen, *, body: float, side: float
) -> None:
    """Draw segments, nodes and a hatched strip `body` wide, texts on the side of the body (1) or the other (−1)."""
    lefts = _lefts(surface, nodes)
    hatch(axes, nodes[surface.segments], (nodes + body * lefts)[surface.segments], "0.82", pen.hatch)
    few = len(surface.nodes) <= _NUMBERED
    label = f"{pen.name} (body hatched {pen.hatch[0]})"
    _plot_side(axes, surface.segments, nodes, pen, 5.5 if few else 3, label)
    size = float(np.ptp(nodes, axis=0).max())
    numbered: list[int] = []  # About twenty nodes at most, none on top of the one before.
    for node in surface.nodes.tolist()[:: -(-len(surface.nodes) // _NUMBERED)]:
        if not numbered or np.linalg.norm(nodes[node] - nodes[numbered[-1]]) > _ROOM / 2 * size:
            numbered.append(node)
            style: dict[str, Any] = {"fontsize": 8 if few else 6, "color": pen.color, "zorder": 5}
            _write(axes, str(node), nodes[node], 11 * side * lefts[node], **style)
    if len(surface) > _LABELLED:
        return
    for (first, second), label in zip(surface.segments.tolist(), labels, strict=True):
        if np.linalg.norm(nodes[second] - nodes[first]) > _ROOM * size:
            offset = 9 * side * (lefts[first] + lefts[second]) / 2
            style = {"fontsize": 7, "style": "italic", "color": "0.35", "zorder": 4.5}
            _write(axes, label, (nodes[first] + nodes[second]) / 2, offset, **style)


def hatch(axes: Axes, ends: FloatArray, inside: FloatArray, color: str, pattern: str) -> FloatArray:
    """Hatch strips (n, 4, 2) between segments and their copies inside a body, (n, 2, 2) each; return the strips."""
    strips = np.concatenate([ends, inside[:, ::-1]], axis=1)
    look: dict[str, Any] = {"facecolor": "none", "edgecolor": color, "linewidth": 0, "hatch": pattern, "zorder": 1}
    axes.add_collection(PolyCollection(list(strips), **look))
    return strips


def _plot_side(axes: Axes, edges: IntArray, nodes: FloatArray, pen: Pen, size: float, label: str) -> None:
    """Draw segments (n, 2) with their nodes, whose markers are `size` points wide, and an entry of the legend."""
    look: dict[str, Any] = {"color": pen.color, "marker": pen.marker, "markerfacecolor": pen.fill, "markersize": size}
    lines: dict[str, Any] = {"colors": pen.color, "linewidths": 1.6, "linestyles": pen.style, "zorder": 3}
    axes.add_collection(LineCollection(list(nodes[edges]), **lines))
    axes.plot(*nodes[np.unique(edges)].T, linestyle="none", zorder=4, **look)
    axes.plot([], [], linestyle=pen.style, label=label, **look)


def _plot_arrows(
    axes: Axes, nodes: FloatArray, forces: FloatArray | None, exact: FloatArray | None, *, longest: float
) -> None:
    """Draw nodal forces as arrows, at most `longest`: the formulation's, thin, over the exact ones, broad and light."""
    kinds = (("exact", exact), ("formulation", forces))
    by_kind = {kind: np.reshape(values, (-1, 2)) for kind, values in kinds if values is not None}
    largest = max((float(np.linalg.norm(values, axis=1).max()) for values in by_kind.values()), default=0.0)
    if not (np.isfinite(largest) and largest > 0):
        return
    for kind, values in by_kind.items():
        arrows = values * (longest / largest)
        axes.quiver(*nodes.T, *arrows.T, angles="xy", scale_units="xy", scale=1, zorder=6, **_ARROWS[kind])
        axes.plot(*(nodes + 1.15 * arrows).T, linestyle="none")  # The axes reach beyond the tips.
    if len(nodes) > 2 * _LABELLED:
        return
    for node, at_node in enumerate(np.stack(list(by_kind.values()), axis=1)):  # (n_kinds, 2), the exact force first
        sizes = np.linalg.norm(at_node, axis=1).tolist()
        tip, reach = at_node[int(np.argmax(sizes))], max(sizes)
        if reach > 0:
            words = _size_in_words(sizes[-1], sizes[0], 1e-6 * largest)
            offset = (3 + 4 * (1 + words.count("\n"))) * tip / reach
            _write(axes, words, nodes[node] + tip * (longest / largest), offset, fontsize=7, color="black", zorder=7)


def _size_in_words(size: float, exact: float, slack: float) -> str:
    """Return the size of a force; if the exact one differs, both, with the digits that tell them apart."""
    if abs(exact - size) <= slack:
        return f"{size:.3g}"
    digits = next(count for count in range(3, 17) if f"{size:.{count}g}" != f"{exact:.{count}g}")
    return f"{size:.{digits}g}\nexact {exact:.{digits}g}"


def _write(axes: Axes, words: str, place: FloatArray, offset: FloatArray, **style: Any) -> None:
    """Write words beside a place; `offset` is in points."""
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8}
    at, moved = ((float(x), float(y)) for x, y in (place, offset))
    axes.annotate(words, at, moved, textcoords="offset points", ha="center", va="center", bbox=box, **style)


def _lefts(surface: Surface, nodes: FloatArray) -> FloatArray:
    """Return (n_nodes, 2) unit vectors into the body, the mean of the adjacent segments; zero off this surface."""
    chords = nodes[surface.segments[:, 1]] - nodes[surface.segments[:, 0]]
    chords = chords / np.maximum(np.linalg.norm(chords, axis=1, keepdims=True), np.finfo(float).tiny)
    lefts = np.zeros_like(nodes)
    for end in (0, 1):
        np.add.at(lefts, surface.segments[:, end], np.column_stack([-chords[:, 1], chords[:, 0]]))
    lengths = np.linalg.norm(lefts, axis=1, keepdims=True)
    units: FloatArray = np.divide(lefts, lengths, out=np.zeros_like(lefts), where=lengths > 1e-9)
    return units


def _surface_figure(
    case: Case, *, title: str, forces: FloatArray | None, exact: FloatArray | None, width: float
) -> Figure:
    places, stretch = widen(view_from_above(case))
    interface, with_bodies = case.interface, bool(case.packed_bodies)
    errors = sizes = None  # (n_nodes,) The error of each nodal force over the largest exact one, if both are known.
    if forces is not None:
        sizes = np.linalg.norm(forces.reshape(interface.nodes.shape), axis=1)
        if exact is not None:
            difference = (forces - exact).reshape(interface.nodes.shape)
            largest = float(np.linalg.norm(exact.reshape(difference.shape), axis=1).max())
            errors = np.linalg.norm(difference, axis=1) / (largest or 1.0)
    figure = Figure(figsize=(width, width / 2 + 1.2), layout="compressed")
    grid = figure.add_gridspec(1, 2 + with_bodies, width_ratios=[3, 3, 2][: 2 + with_bodies])
    first = figure.add_subplot(grid[0])
    panels = first, figure.add_subplot(grid[1], sharex=first, sharey=first)
    titles = "slave, from inside", "master, from outside"
    for axes, surface, name in zip(panels, (interface.slave, interface.master), titles, strict=True):
        _plot_faces(axes, surface, places, sizes if errors is None else errors, _force_labels(surface, forces, exact))
        axes.set_title(name, fontsize=8, pad=6 if forces is None else 22)  # Forces stand above the upper nodes.
        axes.margins(0.08)
        axes.set_aspect("equal", adjustable="box")
        axes.set_axis_off()
    for axes, other in zip(panels, (interface.master, interface.slave), strict=True):
        outlines = list(places[other.faces])
        axes.add_collection(PolyCollection(outlines, facecolors="none", edgecolors="0.8", linewidths=0.5, zorder=0))
        axes.autoscale_view()
    if with_bodies:
        plot_blocks(figure.add_subplot(grid[2]), case)
    lines = [surfaces_headline(case) + (f", drawn {format_number(stretch)} times wider across" if stretch > 1 else "")]
    if with_bodies:
        state = "the first guess" if exact is None else "the exact solution"
        lines += [f"forces at {state}"] * (forces is not None) + describe_blocks(case, 1.0)
    if forces is not None:
        exactly = " and, where it differs, exact force" if errors is not None else ""
        lines.append(f"at the nodes, given room: number, force{exactly}")
    if errors is not None:
        share = f"up to {errors.max():.3g} of the largest exact force" if np.isfinite(errors).all() else "not finite"
        lines.append(f"shade: error of the nodal forces, {share}")
    elif sizes is not None:
        lines.append(f"shade: size of the nodal forces, up to {sizes.max():.3g}")
    wrapped = (textwrap.wrap(line, int(14 * width)) for line in [title, *lines, reference_sizes(case, 1.0)])
    figure.suptitle("\n".join(chain.from_iterable(wrapped)), fontsize=9, x=0.02, ha="left", parse_math=False)
    _thin_out(figure, np.zeros(len(places)) if errors is None else np.nan_to_num(errors, nan=np.inf))
    return figure


def _thin_out(figure: Figure, errors: FloatArray) -> None:
    """Shorten labels that cover others to the number of their node, or drop them; larger errors (n_nodes,) go first."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # Labels stay where they are compared.
    boxes: list[BboxBase] = []
    labels = [text for axes in figure.axes for text in axes.texts]
    for label in sorted(labels, key=lambda text: -errors[int(gid)] if (gid := text.get_gid()) else 1.0):
        words = label.get_text()
        label.set_gid(None)  # The file would have it as an id.
        for shorter in (words, words.partition(":")[0], ""):
            label.set_text(shorter)
            if not any(label.get_window_extent().overlaps(box) for box in boxes):
                break
        if label.get_text():
            boxes.append(label.get_window_extent())


def plot_blocks(axes: Axes, case: Case) -> None:
    """Draw the bodies of a case in space from the side and from above, in their reference, far faces first."""
    packed, towards = case.packed_bodies, np.array([0.5, -0.7, 0.5])  # Towards the eye, in the axes of the view.
    towards = towards / np.linalg.norm(towards)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    nodes = packed["nodes"] @ view_axes(case)
    of_body = np.repeat(np.arange(len(packed["count"])), packed["count"].astype(np.int64))
    shades, polygons = [], []
    for faces in outer_faces(packed["cells"].astype(np.int64), packed["contact"].astype(np.int64)):
        corners = nodes[faces]
        turns = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
        seen = turns @ towards > 0
        polygons += list(corners[seen])
        shades += [_BODY_SHADES[side] for side in (packed["is_slave"][of_body[faces[seen, 0]]] != 0).tolist()]
    order = np.argsort([float(corners.mean(axis=0) @ towards) for corners in polygons])
    places = [polygons[number] @ np.column_stack([right, np.cross(towards, right)]) for number in order]
    look: dict[str, Any] = {"facecolors": [shades[number] for number in order], "edgecolor": "0.4", "linewidth": 0.4}
    axes.add_collection(PolyCollection(places, **look))
    axes.set_title("the bodies, slave darker", fontsize=8)
    axes.margins(0.05)
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="box")
    axes.set_axis_off()


def view_axes(case: Case) -> FloatArray:
    """Return the axes (3, 3) of a view against the master's mean normal as columns: to the right, up, to the eye."""
    positions, faces = case.positions, case.interface.master.faces
    corners = positions[faces]
    turns = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]).sum(axis=0)
    size = float(np.linalg.norm(turns))
    normal = turns / size if size > 0 else np.array([0.0, 0.0, 1.0])  # A closed surface has no mean normal.
    start = np.eye(3)[np.argmin(np.abs(normal))]
    right = np.cross(start, normal)
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(normal, right), normal])


def view_from_above(case: Case) -> FloatArray:
    """Return plane coordinates (n_nodes, 2) of the current positions, seen against the master's mean normal."""
    places: FloatArray = (case.positions - case.positions.mean(axis=0)) @ view_axes(case)[:, :2]
    return places


def widen(places: FloatArray) -> tuple[FloatArray, float]:
    """Return places (n_nodes, 2) stretched across their longer axis if they are long and thin, and the factor."""
    axes, sizes = np.linalg.svd(places - places.mean(axis=0), full_matrices=False)[2:0:-1]
    if sizes[1] <= 0 or sizes[0] < _THIN * sizes[1]:
        return places, 1.0
    factor = one_digit(float(sizes[0] / sizes[1]) / 2)
    return (places @ axes.T) * [1.0, factor], factor


def _force_labels(surface: Surface, forces: FloatArray | None, exact: FloatArray | None) -> dict[int, str]:
    """Return {node: its number, its force, and the exact one if that differs}; numbers alone for a large surface."""
    if forces is None or len(surface.nodes) > _MEASURED:
        return {node: str(node) for node in surface.nodes.tolist()}
    by_node, exact_by_node = (np.reshape(each, (-1, 3)) for each in (forces, forces if exact is None else exact))
    sizes, exact_sizes = (np.linalg.norm(each, axis=1) for each in (by_node, exact_by_node))
    slack = _SAME * float(exact_sizes.max())
    labels = {}
    for node in surface.nodes.tolist():
        labels[node] = f"{node}: {_size_in_words(float(sizes[node]), float(exact_sizes[node]), slack)}"
        if "\n" not in labels[node] and np.linalg.norm(by_node[node] - exact_by_node[node]) > slack:
            labels[node] += "\nother way"  # Forces of one size in two directions.
    return labels


def _plot_faces(
    axes: Axes, surface: Surface, places: FloatArray, errors: FloatArray | None, labels: dict[int, str]
) -> None:
    collection = PolyCollection(list(places[surface.faces]), facecolors="white", edgecolors="black", linewidths=0.8)
    if errors is not None and np.isfinite(errors).all():
        collection.set_array(errors[surface.faces].max(axis=1))
        collection.set_cmap(_ERROR_COLOURS)
        collection.set_clim(0.0, max(2 * float(errors.max()), np.finfo(np.float64).tiny))  # Numbers stay legible.
    axes.add_collection(collection)
    if len(surface) > _NUMBERED_FACES:
        return
    for number, corners in enumerate(surface.faces.tolist()):
        x, y = places[corners].mean(axis=0).tolist()
        axes.text(x, y, str(number), fontsize=7, ha="center", va="center", color="0.35")
    middle = places[surface.nodes].mean(axis=0)
    for node, label in labels.items():
        axes.plot(*places[node], "o", markersize=2.5, color="black")
        right, upper = (places[node] >= middle).tolist()
        aligned: dict[str, Any] = {"ha": "right" if right else "left", "va": "bottom" if upper else "top"}
        offset = (0, 3 if upper else -3)
        style: dict[str, Any] = {"textcoords": "offset points", "fontsize": 7, "fontweight": "bold", "gid": str(node)}
        axes.annotate(label, places[node], offset, **aligned, **style)


def make_mesh_figure(
    case: Case, width: float, *, forces: FloatArray | None = None, exact: FloatArray | None = None
) -> Figure:
    """Return the figure of a case: its interface with forces; of bodies in the plane the bodies alone."""
    if case.packed_bodies and case.interface.dim == PLANE:
        return make_outline_figure(case, width)
    return make_case_figure(case, forces=forces, exact=exact, width=width)


def make_outline_figure(case: Case, width: float) -> Figure:
    """Return a figure of the bodies in their reference configuration; a rigid body is its surface."""
    packed = case.packed_bodies
    nodes = packed["nodes"]  # (n_nodes, 2) of all bodies
    of_body = np.repeat(np.arange(len(packed["count"])), packed["count"].astype(np.int64))  # (n_nodes,)
    is_slave = (packed["is_slave"] != 0)[of_body]  # (n_nodes,)
    size = float(np.ptp(nodes, axis=0).max())
    wide, high = np.ptp(nodes, axis=0) / size + 2 * _LOAD
    height = float(np.clip(width * high / wide, 1.8, 0.75 * width)) + 0.5
    figure, axes = _make_axes(width, height)
    cells = packed["cells"].astype(np.int64)
    for side, shade in _BODY_SHADES.items():
        polygons = [nodes[cell[cell >= 0]] for cell in cells if bool(is_slave[cell[0]]) == side]
        axes.add_collection(PolyCollection(polygons, facecolor=shade, edgecolor="0.55", linewidth=0.5, zorder=1))
    axes.plot(*nodes.T, linestyle="none")  # The axes reach around it.
    first = packed["axis"][of_body]  # (n_nodes, 2)
    second = np.column_stack([-first[:, 1], first[:, 0]])
    rigid = ~np.isin(of_body, of_body[cells[cells >= 0]])  # (n_nodes,); a triangle has −1 for a fourth corner
    contact = packed["contact"].astype(np.int64)
    for pen, side in ((MASTER, False), (SLAVE, True)):
        edges = contact[is_slave[contact[:, 0]] == side]
        label = pen.name + " (rigid)" * bool(rigid[edges].all())
        _plot_side(axes, edges, nodes, pen, 4.5 if len(edges) <= 30 else 2, label)
    fixed = (packed["fixed"] != 0) & ~rigid[:, None]
    if fixed.any():  # A short bar stands across each direction in which a node is fixed.
        ends = _SUPPORT * size * np.vstack([second[fixed[:, 0]], first[fixed[:, 1]]])
        at = np.vstack([nodes[fixed[:, 0]], nodes[fixed[:, 1]]])
        bars = list(np.stack([at - ends, at + ends], axis=1))
        axes.add_collection(LineCollection(bars, colors="black", linewidths=2.2, zorder=5))
        axes.plot([], [], color="black", linewidth=2.2, label="support")
    loads = packed["load"][:, :1] * first + packed["load"][:, 1:] * second
    sizes = np.linalg.norm(loads, axis=1)
    if sizes.max(initial=0.0) > 0:  # Arrows end at the nodes.
        arrows, at = loads[sizes > 0] * (_LOAD * size / sizes.max()), nodes[sizes > 0]
        look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1, "width": 0.004, "zorder": 6}
        axes.quiver(*(at - arrows).T, *arrows.T, color="0.25", **look)
        axes.plot(*(at - arrows).T, linestyle="none")
        axes.plot([], [], marker=r"$\downarrow$", linestyle="none", color="0.25", label="load")
    axes.set(xlabel="x", ylabel="y")
    axes.margins(0.06)
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    return figure


def save_plainly(figure: Figure, target: Any, **options: Any) -> None:
    """Write a figure with `Figure.savefig`, its texts as they are."""
    for text in figure.findobj(Text):
        label = text.get_text()
        if label and not _POWER_OF_TEN.fullmatch(label):  # An empty text may become a power of ten as it is drawn.
            text.set_text(printable(label))
            text.set_parse_math(False)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from font", UserWarning)  # It is drawn as a box.
        warnings.filterwarnings("ignore", ".*layout not applied", UserWarning)  # A name is as wide as the figure.
        figure.savefig(target, **options)
