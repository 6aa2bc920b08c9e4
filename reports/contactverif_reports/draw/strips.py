"""Draws an interface that is straight, or nearly, as two lines with their nodes to scale and the lengths between."""

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
MARGIN = 8  # columns of "slave" and "master"
TOO_MANY = "too many segments to write lengths between; nodes may share a column"


@dataclass(frozen=True, slots=True)
class _Link:
    """A segment between two columns to be: indices into the places along the line, and its label."""

    start: int
    end: int
    label: str


def strips(case: Case, course: Course, unit: float, width: int) -> tuple[list[str], str]:
    """Two lines with ticks, node numbers above and below; and what is to be said of the scale."""
    places, number = _places(course, case.interface.n_slave_nodes)
    width -= MARGIN + len(str(case.interface.n_nodes)) - 1  # the last node number ends behind its node
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
    """Ascending places along the line, nodes that face each other in one; and the place of each node."""
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
    """A column for each place: to scale in the least width that leaves room for the labels, else as they fit."""
    shares = (places - places[0]) / (places[-1] - places[0])
    for room in (3, 2):
        for span in range(min(24, width - 1), width):
            columns = np.round(shares * span).astype(int).tolist()
            distinct = all(before < after for before, after in pairwise(columns))
            if distinct and all(columns[link.end] - columns[link.start] >= len(link.label) + room for link in links):
                return columns, ""
    for room in (5, 3, 2):
        columns = [0] * len(places)
        for place in range(1, len(places)):
            ending = [columns[link.start] + len(link.label) + room for link in links if link.end == place]
            columns[place] = max([columns[place - 1] + 1, *ending])
        if columns[-1] < width:
            return columns, "not to scale"
    return None, ""


def _strip(links: Sequence[_Link], columns: Sequence[int], node: str) -> str:
    """`●──2──●────4────●`, with a blank where two chains leave room between them."""
    line = [" "] * (columns[-1] + 1)
    for link in links:
        start, end = columns[link.start], columns[link.end]
        inner = link.label.center(end - start - 1, "─") if link.label else "─" * (end - start - 1)
        line[start + 1 : end] = inner
    for link in links:
        line[columns[link.start]] = line[columns[link.end]] = node
    return "".join(line)


def _numbers(surface: Surface, number: Sequence[int], columns: Sequence[int]) -> str:
    """Node numbers at their columns; one that does not fit beside the one before it is left out."""
    line = ""
    for node in sorted(surface.nodes.tolist(), key=lambda node: columns[number[node]]):
        column = columns[number[node]]
        if column >= len(line) + bool(line):
            line = line.ljust(column) + str(node)
    return line
