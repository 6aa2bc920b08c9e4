"""The figure of a case: both surfaces in grey, bodies hatched, forces as arrows. Importing matplotlib is slow."""

from __future__ import annotations

import textwrap
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import PLANE
from contactverif_reports.draw.case_geometry import Course, Gaps, segment_lengths
from contactverif_reports.draw.lengths import format_number, one_digit, unit_of
from contactverif_reports.draw.plain_labels import save_plainly
from contactverif_reports.draw.strokes import MASTER, SLAVE, draw_arrows, draw_surface
from contactverif_reports.draw.surface_figure import make_surface_figure
from contactverif_reports.files import whole

SUFFIXES = (".png", ".svg")
# Lengths as shares of the size of the interface.
_VISIBLE_GAP = 0.05  # A smaller largest gap is magnified to this share.
_DISTANCE = 0.13  # Distance of surfaces that are drawn apart, to make room for arrows.
_BODY = 0.10  # Width of the hatched part of a body.
_ARROW = 0.15  # Length of the longest arrow.
_SHORT = 0.04  # The length of a segment that is shorter is written below the title.


def make_case_figure(
    case: Case, *, title: str = "", forces: FloatArray | None, exact: FloatArray | None, width: float = 7.5
) -> Figure:
    """Return the figure of a case: both surfaces, the hatched bodies and the forces, as `draw_case` does.

    In space it is both surfaces from above, shaded by the error of the forces.
    """
    if case.interface.dim != PLANE:
        return make_surface_figure(case, title=title, forces=forces, exact=exact, width=width)
    course, gaps = Course.from_case(case), Gaps.from_case(case)
    with_forces = forces is not None or exact is not None
    lengths = segment_lengths(case)
    unit, unit_name = unit_of(np.concatenate(lengths))
    positions, change = _positions_to_draw(case, gaps, course.roundoff, with_forces)
    positions = positions / unit
    size = float(np.ptp(positions, axis=0).max())
    figure, axes = _empty_figure(positions, width, margin=(_BODY + _ARROW * with_forces) * size)
    # Labels are legible on the side of the other body, where nothing is hatched.
    side = -1.0 if with_forces or gaps.gap.mean() < 0 else 1.0
    surfaces = (case.interface.master, case.interface.slave)
    for surface, pen, its_lengths in zip(surfaces, (MASTER, SLAVE), lengths[::-1], strict=True):
        labels = [format_number(length, course.roundoff / unit) for length in (its_lengths / unit).tolist()]
        draw_surface(axes, surface, positions, labels, pen, body=_BODY * size, side=side)
    draw_arrows(axes, positions, forces, exact, longest=_ARROW * size)
    _label_axes(axes, unit_name)
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    notes = [_gap_note(gaps, course.roundoff) + change]
    shortest = min(float(its_lengths.min()) for its_lengths in lengths) / unit
    if shortest < _SHORT * size:
        notes.append(f"shortest segment {format_number(shortest, course.roundoff / unit)}")
    lines = [*textwrap.wrap(title, 92), ", ".join(notes)]
    axes.set_title("\n".join(lines), fontsize=9, loc="left", parse_math=False)
    return figure


def _empty_figure(positions: FloatArray, width: float, *, margin: float) -> tuple[Figure, Axes]:
    """Return a figure whose height suits the positions, with `margin` around them, a length."""
    across, high = np.ptp(positions, axis=0) + 2 * margin
    height = float(np.clip((width - 1) * high / across, 1.6, width)) + 1.7
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.add_subplot()
    axes.set_aspect("equal", adjustable="datalim")
    return figure, axes


def _positions_to_draw(case: Case, gaps: Gaps, roundoff: float, with_forces: bool) -> tuple[FloatArray, str]:
    """Return positions (n_nodes, 2) to draw, a length each, and say how far the slave is moved for it."""
    positions = case.positions.copy()
    size = float(np.ptp(positions, axis=0).max())
    if with_forces:
        moves = np.full(len(gaps.gap), _DISTANCE * size + max(0.0, -float(gaps.gap.min())))
        change = ", drawn apart"
    else:
        factor = magnification(gaps.gap, roundoff, size)
        moves = (factor - 1) * gaps.gap
        change = "" if factor == 1 else f", drawn {format_number(factor)} times larger"
    positions[: case.interface.n_slave_nodes] += moves[:, None] * gaps.normal
    return positions, change


def magnification(gap: FloatArray, roundoff: float, size: float) -> float:
    """Return the factor, of one significant digit, that makes the largest gap visible; 1 if all is roundoff."""
    largest = float(np.abs(gap).max())
    if largest <= roundoff * 1e-3 or largest >= _VISIBLE_GAP * size:
        return 1.0
    return max(1.0, one_digit(_VISIBLE_GAP * size / largest))


def _gap_note(gaps: Gaps, roundoff: float) -> str:
    facing_gaps = gaps.gap[gaps.facing]
    if not len(facing_gaps):
        return "no slave node faces the master"
    if gaps.uniform(roundoff):
        return f"gap {format_number(float(facing_gaps.mean()), roundoff)}"
    return f"gap {format_number(facing_gaps.min(), roundoff)} to {format_number(facing_gaps.max(), roundoff)}"


def _label_axes(axes: Axes, unit_name: str) -> None:
    axes.set(xlabel=f"x / {unit_name}" if unit_name else "x", ylabel=f"y / {unit_name}" if unit_name else "y")
    axes.margins(0.05)
    axes.spines[["top", "right"]].set_visible(False)


def save(figure: Figure, target: Path) -> None:
    """Write a figure to a file; the same figure gives the same bytes, without a date or random ids."""
    suffix = target.suffix.lower()
    metadata = {"Date": None} if suffix == ".svg" else {"Software": None}
    try:
        with matplotlib.rc_context({"svg.hashsalt": "contactverif"}), whole(target) as part:
            save_plainly(figure, part, format=suffix[1:], dpi=150, metadata=metadata)
    except OSError as error:
        raise MisuseError("path", f"{target}: {error.strerror}", "a file that can be written") from error
