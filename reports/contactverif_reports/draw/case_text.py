"""The drawing of a case in a few lines of text, the slave above the master."""

from __future__ import annotations

import textwrap

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE
from contactverif_reports.draw.case_geometry import Course, Gaps, segment_lengths
from contactverif_reports.draw.lengths import format_number, unit_of
from contactverif_reports.draw.raster import draw_raster
from contactverif_reports.draw.strips import MASTER_NODE, SLAVE_NODE, draw_strips
from contactverif_reports.draw.surface_text import surfaces_as_text

_LISTED = 8  # The positions of at most so many nodes a side are listed.


def as_text(case: Case, width: int = 72) -> str:
    """Draw a case as text.

    A flat interface is two lines with their nodes to scale and the lengths between them. Any other is a small picture
    and, up to eight nodes a side, a table of current positions. In space there are tables of nodes and faces.

    Parameters
    ----------
    case : Case
        The case.
    width : int
        The largest number of columns, at least 60.
    """
    width = max(width, 60)
    if case.interface.dim != PLANE:
        return surfaces_as_text(case, width)
    course, gaps = Course.from_case(case), Gaps.from_case(case)
    unit, unit_name = unit_of(np.concatenate(segment_lengths(case)))
    if course.nearly_flat:
        picture, note = draw_strips(case, course, unit, width)
    else:
        picture, note = draw_raster(case, course, gaps, width)
    notes = [note] if note else []
    if unit_name:
        notes.append(f"lengths, positions and gaps in units of {unit_name}")
    table = [] if course.flat else _table(case, gaps, unit, course.roundoff, width)
    if not table:
        notes.append(_gaps(gaps, course, unit))
    notes.append(_numbers(case))
    lines = [line for note in notes for line in textwrap.wrap(note, width, subsequent_indent="  ")]
    return "\n".join(line.rstrip() for line in [_headline(case, course), *picture, *table, *lines])


def _headline(case: Case, course: Course) -> str:
    n_slave, n_master = len(case.interface.slave), len(case.interface.master)
    shape = "flat" if course.flat else "nearly flat" if course.nearly_flat else "not flat"
    is_rotated = course.nearly_flat and abs(course.angle) > 1e-9
    rotation = f", rotated by {format_number(course.angle, 1e-9)}°" if is_rotated else ""
    name = f"{case.name}: " if case.name else ""
    return f"{name}{n_slave} slave on {n_master} master segment{'s' * (n_master > 1)}, {shape}{rotation}"


def _gaps(gaps: Gaps, course: Course, unit: float) -> str:
    """Say how deep the slave nodes that face the master are in it."""
    facing_gaps = gaps.gap[gaps.facing] / unit
    if not len(facing_gaps):
        return "no slave node faces the master"
    n_beyond = int((~gaps.facing).sum())
    place = f"where a slave node faces the master; {n_beyond} beyond it" if n_beyond else "at every slave node"
    if not gaps.uniform(course.roundoff):
        return f"gap {format_number(facing_gaps.min())} to {format_number(facing_gaps.max())} {place}"
    mean = float(np.mean(facing_gaps))
    amount = format_number(abs(mean), course.roundoff / unit)
    return f"{f'penetration {amount}' if mean < 0 else f'open by {amount}' if mean else 'touching'} {place}"


def _table(case: Case, gaps: Gaps, unit: float, roundoff: float, width: int) -> list[str]:
    """Return a table of positions, slave left and master right if that fits; nothing if there are too many nodes."""
    n_slave = case.interface.n_slave_nodes
    if max(n_slave, case.interface.n_nodes - n_slave) > _LISTED:
        return []
    rows = [
        [str(node), *(format_number(value, 0.0, 6) for value in (position / unit).tolist())]
        for node, position in enumerate(case.positions)
    ]
    for row, gap, facing in zip(rows, gaps.gap.tolist(), gaps.facing.tolist(), strict=False):
        row.append(format_number(gap / unit, roundoff / unit) if facing else "beyond")
    left = _align([[SLAVE_NODE, "x", "y", "gap"], *rows[:n_slave]])
    right = _align([[MASTER_NODE, "x", "y"], *rows[n_slave:]])
    if len(left[0]) + len(right[0]) + 8 > width:
        return [f"  {row}" for row in [*left, *right]]
    height, indent = max(len(left), len(right)), len(left[0])
    left += [" " * indent] * (height - len(left))
    right += [""] * (height - len(right))
    return [f"  {slave}      {master}" for slave, master in zip(left, right, strict=True)]


def _align(rows: list[list[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(entry.rjust(width) for entry, width in zip(row, widths, strict=True)) for row in rows]


def _numbers(case: Case) -> str:
    """Return the penalty, the parameters and the seed of a case."""
    numbers = [f"penalty {format_number(case.penalty)}"]
    numbers += [
        f"{name} {format_number(values.item())}"
        for name, values in case.parameters.items()
        if values.size == 1 and name != "penetration"
    ]
    return "   ".join([*numbers, f"seed {case.seed}"])
