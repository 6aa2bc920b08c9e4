"""Draws a case with matplotlib: both surfaces in grey, bodies hatched, forces as arrows. Slow to import."""

from __future__ import annotations

import textwrap
from math import floor, log10
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif_reports.draw.case_geometry import Course, Gaps
from contactverif_reports.draw.lengths import format_number, unit_of
from contactverif_reports.draw.strokes import MASTER, SLAVE, draw_arrows, draw_surface
from contactverif_reports.files import whole

SUFFIXES = (".png", ".svg")
_SEEN_GAP = 0.05  # of the interface; a smaller largest gap is magnified to it
_APART = 0.13  # of the interface; between surfaces that are drawn apart, to make room for arrows
_BODY = 0.10  # width of the hatched part of a body, of the interface
_ARROW = 0.15  # longest arrow, of the interface


def make_case_figure(
    case: Case, *, title: str, forces: FloatArray | None, exact: FloatArray | None, width: float = 7.5
) -> Figure:
    """The figure that `contactverif_reports.draw.draw_case` writes, for a page; `width` in inches."""
    course, gaps = Course.from_case(case), Gaps.from_case(case)
    interface = case.interface
    lengths = [surface.lengths(case.positions) for surface in (interface.slave, interface.master)]
    unit, unit_name = unit_of(np.concatenate(lengths))
    with_forces = forces is not None or exact is not None
    shown, how = _shown(case, gaps, course.roundoff, with_forces)
    shown = shown / unit
    size = float(np.ptp(shown, axis=0).max())

    wide, high = np.ptp(shown, axis=0) + 2 * (_BODY + _ARROW * with_forces) * size
    figure = Figure(figsize=(width, float(np.clip((width - 1) * high / wide, 1.6, width)) + 1.4), layout="constrained")
    axes = figure.add_subplot()
    axes.set_aspect("equal", adjustable="datalim")
    side = -1.0 if with_forces or gaps.gap.mean() < 0 else 1.0  # towards the other body: there the labels are clear
    for surface, pen, found in ((interface.master, MASTER, lengths[1]), (interface.slave, SLAVE, lengths[0])):
        labels = [format_number(length, course.roundoff / unit) for length in (found / unit).tolist()]
        draw_surface(axes, surface, shown, labels, pen, body=_BODY * size, side=side)
    draw_arrows(axes, shown, forces, exact, longest=_ARROW * size)
    _finish(axes, unit_name)
    shortest = min(float(found.min()) for found in lengths) / unit
    notes = [
        _gap_note(gaps, course.roundoff) + how,
        f"shortest segment {format_number(shortest, course.roundoff / unit)}",
    ]
    axes.set_title(
        "\n".join([*textwrap.wrap(title, 92), ", ".join(notes[: 1 + (shortest < 0.04 * size)])]),
        fontsize=9,
        loc="left",
        parse_math=False,
    )
    return figure


def _shown(case: Case, gaps: Gaps, roundoff: float, apart: bool) -> tuple[FloatArray, str]:
    """Positions (n_nodes, 2) to draw, a length each, and in words what was done to those of the slave."""
    positions = case.positions.copy()
    size = float(np.ptp(positions, axis=0).max())
    if apart:
        moves = np.full(len(gaps.gap), _APART * size + max(0.0, -float(gaps.gap.min())))
        how = ", drawn apart"
    else:
        factor = magnification(gaps.gap, roundoff, size)
        moves = (factor - 1) * gaps.gap
        how = "" if factor == 1 else f", drawn {format_number(factor)} times larger"
    positions[: case.interface.n_slave_nodes] += moves[:, None] * gaps.normal
    return positions, how


def magnification(gap: FloatArray, roundoff: float, size: float) -> float:
    """One significant digit, so that the largest gap is seen; 1 where it is seen already or is none."""
    largest = float(np.abs(gap).max())
    if largest <= roundoff * 1e-3 or largest >= _SEEN_GAP * size:
        return 1.0
    wanted = _SEEN_GAP * size / largest
    power = 10.0 ** floor(log10(wanted))
    return max(1.0, round(wanted / power) * power)


def _gap_note(gaps: Gaps, roundoff: float) -> str:
    found = gaps.gap[gaps.facing]
    if not len(found):
        return "no slave node faces the master"
    if gaps.uniform(roundoff):
        return f"gap {format_number(float(found.mean()), roundoff)}"
    return f"gap {format_number(found.min(), roundoff)} to {format_number(found.max(), roundoff)}"


def _finish(axes: Axes, unit_name: str) -> None:
    axes.set_xlabel(f"x / {unit_name}" if unit_name else "x")
    axes.set_ylabel(f"y / {unit_name}" if unit_name else "y")
    axes.margins(0.05)
    axes.spines[["top", "right"]].set_visible(False)
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    figure.legend(loc="outside lower center", ncols=4, frameon=False)


def save(figure: Figure, target: Path) -> None:
    """The same bytes for the same picture: no date, no random ids.

    Raises
    ------
    MisuseError
        If the file cannot be written.
    """
    suffix = target.suffix.lower()
    metadata = {"Date": None} if suffix == ".svg" else {"Software": None}
    try:
        with matplotlib.rc_context({"svg.hashsalt": "contactverif"}), whole(target) as part:
            figure.savefig(part, format=suffix[1:], dpi=150, metadata=metadata)
    except OSError as error:
        raise MisuseError("path", f"{target}: {error.strerror}", "a file that can be written") from error
