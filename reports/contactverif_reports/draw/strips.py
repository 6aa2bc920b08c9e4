"""The drawing of a straight interface, or a nearly straight one, as two lines with their nodes to scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Surface
from contactverif_reports.draw.case_geometry import NEARLY_FLAT, Course
from contactverif_reports.draw.lengths import format_number

SLAVE_NODE, MASTER_NODE = "●", "o"
MARGIN = 8  # The columns of the words "slave" and "master".
TOO_MANY = "too many segments to write lengths between; nodes may share a column"


@dataclass(frozen=True, slots=True)
class _Link:
    """A segment between two places along the line, whose columns are not known yet, and its label."""

    start: int
    end: int
    label: str


def draw_strips(case: Case, course: Course, unit: float, width: int) -> tuple[list[str], str]:
    """Draw the surfaces of a flat or nearly flat interface as two lines, with node numbers above and below.

    `unit` is that of the lengths that are written, `width` the largest number of columns.
    """
    places, number = _places(course, case.interface.n_slave_nodes)
    width -= MARGIN + len(str(case.interface.n_nodes)) - 1  # The last node number ends behind its node.
    surfaces = (case.interface.slave, case.interface.master)
    for digits in (4, 2):
        links = [_links(surface, number, case.positions, course, unit, digits) for surface in surfaces]
        columns, note = _columns(places, [*links[0], *links[1]], width)
        if columns is not None:
            break
    else:
        columns = np.round((places - places[0]) / (places[-1] - places[0]) * (width - 1)).astype(int).tolist()
        links = [[_Link(link.start, link.end, "") for link in side] for side in links]
        note = TOO_MANY
    rows = [
        " " * MARGIN + _numbers(case.interface.slave, number, columns),
        "slave   " + _strip(links[0], columns, SLAVE_NODE),
        "master  " + _strip(links[1], columns, MASTER_NODE),
        " " * MARGIN + _numbers(case.interface.master, number, columns),
    ]
    if note == TOO_MANY:
        for name, side in zip(("slave", "master"), surfaces, strict=True):
            lengths = side.lengths(case.positions) / unit
            shortest, longest = format_number(lengths.min()), format_number(lengths.max())
            rows.append(f"{name:8}{len(side)} segments of length {shortest} to {longest}")
    return rows, note


def _places(course: Course, n_slave: int) -> tuple[FloatArray, list[int]]:
    """Return ascending places along the line, nodes that face each other in one, and the place of each node."""
    together = course.roundoff if course.flat else max(course.roundoff, NEARLY_FLAT * course.rise)
    order = np.argsort(course.along, kind="stable")
    places: list[float] = []
    number = [0] * len(order)
    last_of_side = [-1, -1]
    for node in order.tolist():
        side = int(node >= n_slave)
        position = float(course.along[node])
        if not places or position - places[-1] > together or last_of_side[side] == len(places) - 1:
            places.append(position)
        number[node] = last_of_side[side] = len(places) - 1
    return np.array(places), number


def _links(
    surface: Surface, number: Sequence[int], positions: FloatArray, course: Course, unit: float, digits: int
) -> list[_Link]:
    lengths = surface.lengths(positions) / unit
    slack = course.roundoff / unit
    links = []
    for (first, second), length in zip(surface.segments.tolist(), lengths.tolist(), strict=True):
        start, end = sorted((number[first], number[second]))
        links.append(_Link(start, end, format_number(length, slack, digits)))
    return sorted(links, key=lambda link: link.start)


def _columns(places: FloatArray, links: Sequence[_Link], width: int) -> tuple[list[int] | None, str]:
    """Return a column for each place: to scale if the labels fit so, else as they fit; None if they do not."""
    columns = _columns_to_scale(places, links, width)
    if columns is not None:
        return columns, ""
    for room in (5, 3, 2):
        columns = _columns_in_turn(len(places), links, room)
        if columns[-1] < width:
            return columns, "not to scale"
    return None, ""


def _columns_to_scale(places: FloatArray, links: Sequence[_Link], width: int) -> list[int] | None:
    """Return columns to scale in the least width that leaves room for the labels, None if there is none."""
    shares = (places - places[0]) / (places[-1] - places[0])
    for room in (3, 2):
        for span in range(min(24, width - 1), width):
            columns = np.round(shares * span).astype(int).tolist()
            distinct = all(before < after for before, after in pairwise(columns))
            if distinct and all(columns[link.end] - columns[link.start] >= len(link.label) + room for link in links):
                return list(columns)
    return None


def _columns_in_turn(n_places: int, links: Sequence[_Link], room: int) -> list[int]:
    """Return the first free column for each place, with room for the labels."""
    columns = [0] * n_places
    for place in range(1, n_places):
        ending = [columns[link.start] + len(link.label) + room for link in links if link.end == place]
        columns[place] = max([columns[place - 1] + 1, *ending])
    return columns


def _strip(links: Sequence[_Link], columns: Sequence[int], node: str) -> str:
    """Return a line such as `●──2──●────4────●`, with a blank between two chains."""
    line = [" "] * (columns[-1] + 1)
    for link in links:
        start, end = columns[link.start], columns[link.end]
        inner = link.label.center(end - start - 1, "─") if link.label else "─" * (end - start - 1)
        line[start + 1 : end] = inner
    for link in links:
        line[columns[link.start]] = line[columns[link.end]] = node
    return "".join(line)


def _numbers(surface: Surface, number: Sequence[int], columns: Sequence[int]) -> str:
    """Return a line of node numbers; one that does not fit beside the number before it is left out."""
    line = ""
    for node in sorted(surface.nodes.tolist(), key=lambda node: columns[number[node]]):
        column = columns[number[node]]
        if column >= len(line) + bool(line):
            line = line.ljust(column) + str(node)
    return line
