"""Drawings of cases and scenes in a few lines of text, for a terminal."""

import re
import textwrap
from collections.abc import Iterable, Sequence
from itertools import pairwise, zip_longest
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif.contract.interface import PLANE, Surface
from contactverif_reports.plot.geometry import NEARLY_FLAT, Course, Gaps, format_number, segment_lengths, unit_of

_SLAVE, _MASTER = "●", "o"  # The nodes of a side.
_MARGIN = 8  # The columns of the words "slave" and "master".
_TOO_MANY = "too many segments to write lengths between; nodes may share a column"
_ASPECT = 2.0  # A character is twice as high as wide.
_PICTURE_HEIGHT, _SILHOUETTE_HEIGHT = 17, 20  # The largest numbers of rows.
_DISTANCE = 2  # Rows between surfaces that would be nearer to each other.
_LABELLED = 12  # The nodes of a picture get their numbers if a side has at most so many.
_LISTED = 8  # The positions of at most so many nodes a side are listed.
_LISTED_FACES = 12  # The nodes and faces of at most so many a side in space are listed.
_SAME_SIZE = 1e-9  # Sizes that differ by less are the same but for rounding, as those of a mesh that was turned.
_LISTED_SIZES = 6  # The least and the largest size stand for those of more elements.
_INKS = {"slave": "▒", "master": "░"}  # The fillings of bodies.
_FACES = {3: "triangle", 4: "quadrilateral"}


def as_text(case: Case, width: int = 72, worst: object = "") -> str:
    """Draw a case as text.

    A flat interface is two lines with their nodes to scale and the lengths between them. Any other is a small picture
    and, up to eight nodes a side, a table of current positions. In space there are tables of nodes and faces.
    The text has at most `width` columns, which are 60 or more. The worst node, which the finding `worst` may name, is
    listed with its faces where a side in space has too many nodes for a table.
    """
    width = max(width, 60)
    if case.interface.dim != PLANE:
        return _surfaces(case, width, {int(node) for node in re.findall(r"\bnode (\d+)", str(worst))})
    course, gaps = Course.from_case(case), Gaps.from_case(case)
    unit, unit_name = unit_of(np.concatenate(segment_lengths(case)))
    if course.nearly_flat:
        picture, note = _draw_strips(case, course, unit, width)
    else:
        picture, note = _draw_picture(case, course, gaps, width)
    notes = [note] if note else []
    if unit_name:
        notes.append(f"lengths, positions and gaps in units of {unit_name}")
    table = [] if course.flat else _list_positions(case, gaps, unit, course.roundoff, width)
    if not table:
        notes.append(_describe_gaps(gaps, course, unit))
    notes += filter(None, [reference_sizes(case, unit)])
    parameters = [(name, each) for name, each in case.parameters.items() if each.size == 1 and name != "penetration"]
    numbers = [("penalty", case.penalty), *((name, each.item()) for name, each in parameters)]
    notes.append("   ".join([*(f"{name} {format_number(number)}" for name, number in numbers), f"seed {case.seed}"]))
    n_slave, n_master = len(case.interface.slave), len(case.interface.master)
    shape = "flat" if course.flat else "nearly flat" if course.nearly_flat else "not flat"
    rotation = f", {course.rotation}" if course.rotation else ""
    segments = f"{n_slave} slave on {n_master} master segment{'s' * (n_master > 1)}"
    lines = [f"{_name(case)}{segments}, {shape}{rotation}", *picture, *table, *_wrap(notes, width)]
    return "\n".join(line.rstrip() for line in lines)


def _name(case: Case) -> str:
    return f"{case.name}: " if case.name else ""


def _position_rows(case: Case, nodes: Iterable[int], unit: float) -> list[list[str]]:
    return [
        [str(node), *(format_number(value, 0.0, 6) for value in (case.positions[node] / unit).tolist())]
        for node in nodes
    ]


def _wrap(notes: Sequence[str], width: int) -> list[str]:
    return [line for note in notes for line in textwrap.wrap(note, width, subsequent_indent="  ")]


def _align(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(entry.rjust(width) for entry, width in zip(row, widths, strict=True)) for row in rows]


def _describe_gaps(gaps: Gaps, course: Course, unit: float) -> str:
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


def reference_sizes(case: Case, unit: float) -> str:
    """Return in words the sizes of segments or faces in the reference, of a side on which they are other ones."""
    interface, sides, power = case.interface, [], case.interface.dim - 1
    for name, surface in (("slave", interface.slave), ("master", interface.master)):
        sizes, now = (surface.measures(nodes) / unit**power for nodes in (interface.nodes, case.positions))
        if not np.allclose(sizes, now, rtol=_SAME_SIZE, atol=0):
            few = sizes if len(sizes) <= _LISTED_SIZES else np.array([sizes.min(), sizes.max()])
            texts = [format_number(size, _SAME_SIZE * size) for size in few.tolist()]
            sides.append(f"{name} {(', ' if few is sizes else ' to ').join(texts)}")
    return f"{'lengths' if power == 1 else 'areas'} in the reference: {'; '.join(sides)}" if sides else ""


def _list_positions(case: Case, gaps: Gaps, unit: float, roundoff: float, width: int) -> list[str]:
    """Return a table of positions, slave left and master right if that fits; nothing if there are too many nodes."""
    n_slave = case.interface.n_slave_nodes
    if max(n_slave, case.interface.n_nodes - n_slave) > _LISTED:
        return []
    rows = _position_rows(case, range(case.interface.n_nodes), unit)
    for row, gap, facing in zip(rows, gaps.gap.tolist(), gaps.facing.tolist(), strict=False):
        row.append(format_number(gap / unit, roundoff / unit) if facing else "beyond")
    left = _align([[_SLAVE, "x", "y", "gap"], *rows[:n_slave]])
    right = _align([[_MASTER, "x", "y"], *rows[n_slave:]])
    if len(left[0]) + len(right[0]) + 8 > width:
        return [f"  {row}" for row in [*left, *right]]
    return [f"  {slave:{len(left[0])}}      {master}" for slave, master in zip_longest(left, right, fillvalue="")]


# Tables of a case in space.


def surfaces_headline(case: Case) -> str:
    """Return the numbers of faces in words: "2 slave on 8 master triangles, in space"."""
    slave, master = case.interface.slave.faces, case.interface.master.faces
    kinds = [f"{_FACES[faces.shape[1]]}{'s' * (len(faces) > 1)}" for faces in (slave, master)]
    first = f"{len(slave)} slave" if kinds[0].rstrip("s") == kinds[1].rstrip("s") else f"{len(slave)} slave {kinds[0]}"
    return f"{_name(case)}{first} on {len(master)} master {kinds[1]}, in space"


def _surfaces(case: Case, width: int, worst: set[int]) -> str:
    interface, n_slave = case.interface, case.interface.n_slave_nodes
    unit, unit_name = unit_of(np.array([case.shortest_segment, case.diameter]))
    lines = [surfaces_headline(case)]
    nodes = list(range(interface.n_nodes))
    sides = (("slave", nodes[:n_slave], interface.slave), ("master", nodes[n_slave:], interface.master))
    for name, side, surface in sides:
        if max(len(side), len(surface)) > _LISTED_FACES:
            lines.append(f"  {name}: {len(side)} nodes, too many to be listed; see replay --out case.svg")
            side = [node for node in side if node in worst]
            if not side:
                continue
        listed = [
            (number, face) for number, face in enumerate(surface.faces.tolist()) if not set(side).isdisjoint(face)
        ]
        corners = [f"{number}: {' '.join(map(str, face))}" for number, face in listed]
        faces = textwrap.wrap(f"faces   {'   '.join(corners)}", 68, subsequent_indent="        ")
        table = _align([[name, "x", "y", "z"], *_position_rows(case, side, unit)])
        lines += [f"  {line}" for line in [*table, *faces]]
    notes = [f"lengths and positions in units of {unit_name}"] if unit_name else []
    notes += [f"seen from outside its body, a {_FACES[interface.slave.faces.shape[1]]}'s corners run counter-clockwise"]
    if "penetration" in case.parameters:
        notes.append(f"penetration {format_number(case.parameter('penetration') / unit)} everywhere")
    notes += filter(None, [reference_sizes(case, unit)])
    lines += describe_blocks(case, unit)
    known = [(name, case.parameter(name)) for name in ("pressure", "approach") if name in case.parameters]
    numbers = [f"{name} {format_number(number)}" for name, number in (("penalty", case.penalty), *known)]
    notes.append("   ".join([*numbers, f"seed {case.seed}"]))
    return "\n".join([*lines, *_wrap(notes, width)])


def describe_blocks(case: Case, unit: float) -> list[str]:
    """Return a line for each body of a case in space: its cells, the heights of their layers, its material."""
    packed, lines = case.packed_bodies, []
    ends = np.cumsum(packed.get("count", np.zeros(0))).astype(np.int64).tolist()
    for body, (start, end) in enumerate(pairwise([0, *ends])):
        nodes, first = packed["nodes"][start:end], packed["cells"][:, 0]
        cells = packed["cells"][(first >= start) & (first < end)]
        axis = np.cross(*packed["axis"][body])
        levels = np.unique(np.round((nodes @ axis) / unit, 9)) if len(nodes) else np.zeros(0)
        heights = [format_number(height, 1e-6 * abs(height)) for height in np.diff(levels)]
        layers = f" in layers of {', '.join(heights)}" if len(heights) <= _LISTED_SIZES else ""
        kind = "hexahedra" if len(cells) and (cells >= 0).all() else "tetrahedra"
        material = f"E {format_number(packed['young'][body])}, ν {format_number(packed['poisson'][body])}"
        words = f"{len(cells)} {kind}{layers}, {material}" if len(cells) else "rigid"
        lines.append(f"  {'slave' if packed['is_slave'][body] else 'master'}: {words}")
    return lines


# A straight interface as two lines.


class _Link(NamedTuple):
    start: int
    end: int
    label: str


def _draw_strips(case: Case, course: Course, unit: float, width: int) -> tuple[list[str], str]:
    """Draw the surfaces of a flat or nearly flat interface as two lines, with node numbers above and below."""
    places, number = _places(course, case.interface.n_slave_nodes)
    width -= _MARGIN + len(str(case.interface.n_nodes)) - 1  # The last node number ends behind its node.
    surfaces = (case.interface.slave, case.interface.master)
    for digits in (4, 2):
        links = []
        for surface in surfaces:
            lengths = (surface.lengths(case.positions) / unit).tolist()
            labels = [format_number(length, course.roundoff / unit, digits) for length in lengths]
            ends = [(number[first], number[second]) for first, second in surface.segments.tolist()]
            its_links = (_Link(min(pair), max(pair), label) for pair, label in zip(ends, labels, strict=True))
            links.append(sorted(its_links, key=lambda link: link.start))
        columns, note = _columns(places, [*links[0], *links[1]], width)
        if columns is not None:
            break
    else:
        columns = np.round((places - places[0]) / (places[-1] - places[0]) * (width - 1)).astype(int).tolist()
        links = [[link._replace(label="") for link in side] for side in links]
        note = _TOO_MANY
    rows = [
        "nodes   " + _node_numbers(case.interface.slave, number, columns),
        "slave   " + _strip(links[0], columns, _SLAVE),
        "master  " + _strip(links[1], columns, _MASTER),
        "nodes   " + _node_numbers(case.interface.master, number, columns),
    ]
    if note == _TOO_MANY:
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


def _columns(places: FloatArray, links: Sequence[_Link], width: int) -> tuple[list[int] | None, str]:
    """Return a column for each place: to scale if the labels fit so, else as they fit; None if they do not."""
    shares = (places - places[0]) / (places[-1] - places[0])
    for room in (3, 2):
        for span in range(min(24, width - 1), width):
            columns = np.round(shares * span).astype(int).tolist()
            distinct = all(before < after for before, after in pairwise(columns))
            if distinct and all(columns[link.end] - columns[link.start] >= len(link.label) + room for link in links):
                return list(columns), ""
    for room in (5, 3, 2):
        columns = [0] * len(places)
        for place in range(1, len(places)):
            ending = [columns[link.start] + len(link.label) + room for link in links if link.end == place]
            columns[place] = max([columns[place - 1] + 1, *ending])
        if columns[-1] < width:
            return columns, "not to scale"
    return None, ""


def _strip(links: Sequence[_Link], columns: Sequence[int], node: str) -> str:
    """Return a line such as `●──2──●────4────●`, with a blank between two chains."""
    line = [" "] * (columns[-1] + 1)
    for link in links:
        start, end = columns[link.start], columns[link.end]
        line[start + 1 : end] = link.label.center(end - start - 1, "─")
    for link in links:
        line[columns[link.start]] = line[columns[link.end]] = node
    return "".join(line)


def _node_numbers(surface: Surface, number: Sequence[int], columns: Sequence[int]) -> str:
    """Return a line of node numbers; one that does not fit beside the number before it is left out."""
    line = ""
    for node in sorted(surface.nodes.tolist(), key=lambda node: columns[number[node]]):
        column = columns[number[node]]
        if column >= len(line) + bool(line):
            line = line.ljust(column) + str(node)
    return line


# A small picture of any other interface.


def _draw_picture(case: Case, course: Course, gaps: Gaps, width: int) -> tuple[list[str], str]:
    """Draw an interface to scale in so many columns; surfaces that nearly touch are drawn apart."""
    n_slave = case.interface.n_slave_nodes
    positions = case.positions - case.positions.mean(axis=0)
    scale = _rows_per_length(positions, width)
    is_apart = course.straight and bool(np.abs(gaps.gap).max() * scale < _DISTANCE)
    if is_apart:
        is_slave = np.arange(len(positions)) < n_slave
        positions = positions + is_slave[:, None] * _DISTANCE / scale * course.turn[:, 1]
        scale = _rows_per_length(positions, width)
    offsets = positions - [positions[:, 0].min(), positions[:, 1].max()]
    columns = np.round(offsets[:, 0] * scale * _ASPECT).astype(np.int64) + 4
    cells = np.column_stack([columns, np.round(-offsets[:, 1] * scale).astype(np.int64) + 1])  # The top row first.
    canvas = [[" "] * width for _ in range(cells[:, 1].max() + 1)]
    for surface, pen in ((case.interface.master, ""), (case.interface.slave, "·")):
        for first, second in surface.segments.tolist():
            _draw_line(canvas, cells[first], cells[second], pen)
    for node, (column, row) in reversed(list(enumerate(cells.tolist()))):
        canvas[row][column] = _SLAVE if node < n_slave else _MASTER
    if max(n_slave, len(cells) - n_slave) <= _LABELLED:
        for node, (column, row) in enumerate(cells.tolist()):
            _label(canvas, str(node), column, row, above=node < n_slave)
    note = "slave ●··● drawn apart from master o──o" if is_apart else "slave ●··●, master o──o"
    return ["".join(row).rstrip() for row in canvas], note


def _rows_per_length(positions: FloatArray, width: int) -> float:
    """Return how many rows a unit of length takes, so that the picture fits with room for node numbers."""
    across, high = np.maximum(np.ptp(positions, axis=0), np.finfo(float).tiny)
    return float(min((width - 9) / _ASPECT / across, (_PICTURE_HEIGHT - 3) / high))


def _draw_line(canvas: list[list[str]], start: IntArray, end: IntArray, pen: str) -> None:
    """Draw a straight line; without a pen, of characters that lean as the line does."""
    columns, rows = (int(step) for step in end - start)
    steps = max(abs(columns), abs(rows), 1)
    if not pen:
        lean = abs(rows) * _ASPECT / max(abs(columns), 1)
        pen = "─" if lean < 0.5 else "│" if lean > 4 else "╲" if rows * columns > 0 else "╱"
    for step in range(steps + 1):
        canvas[int(start[1]) + round(step * rows / steps)][int(start[0]) + round(step * columns / steps)] = pen


def _label(canvas: list[list[str]], words: str, column: int, row: int, *, above: bool) -> None:
    """Write a node number at the first free place beside the node, if there is one."""
    vertical = [(column, row - 1), (column, row + 1)] if above else [(column, row + 1), (column, row - 1)]
    for at, line in [*vertical, (column + 2, row), (column - 1 - len(words), row)]:
        if line == len(canvas):
            canvas.append([" "] * len(canvas[0]))
        place = canvas[line][max(at - 1, 0) : at + len(words) + 1] if line >= 0 else ["x"]
        if at >= 0 and len(place) >= len(words) and all(cell == " " for cell in place):
            canvas[line][at : at + len(words)] = words
            return


# Two bodies.


def blocks_as_text(case: Case, slave: Body, master: Body, width: int = 72) -> str:
    """Draw two blocks, whose interface runs straight or nearly so, as text of at most `width` columns, 40 or more.

    Loads on the slave, and on the master beside it, are a row of arrows; a rigid master is hatched.
    """
    course = Course.from_case(case)
    unit, _ = unit_of(np.concatenate(segment_lengths(case)))
    rows, note = _draw_strips(case, course, unit, max(width, 40))
    upper, lower = (row[_MARGIN:] for row in rows[1:3])
    (first, last), (low, high) = (
        (side.index(node), side.rindex(node)) for side, node in ((upper, _SLAVE), (lower, _MASTER))
    )
    top = _box(first, last, "slave", ("┌", "┐"))
    bottom = [" " * low + "/" * (high - low + 1)] if master.rigid else _box(low, high, "master", ("└", "┘"))[::-1]
    if (slave.load != 0).any() or (slave.imposed != 0).any():
        top.insert(0, _arrows(first, last))
    if (master.load[master.contact_nodes] != 0).any():
        beside = _arrows(low, high).ljust(len(lower))
        upper = f"{beside[: first - 1]} {upper[first : last + 1]} {beside[last + 2 :]}"
    return "\n".join(line.rstrip() for line in [*top, upper, lower, *bottom, *([note] if note else [])])


def _box(first: int, last: int, name: str, corners: tuple[str, str]) -> list[str]:
    """Return the far side of a body and a row with its name, as wide as the nodes of its contact side."""
    inner = last - first - 1
    return [f"{' ' * first}{corners[0]}{'─' * inner}{corners[1]}", f"{' ' * first}│{name.center(inner)}│"]


def _arrows(first: int, last: int) -> str:
    marks = ["↓" if (column - first) % 4 == (last - first) % 4 // 2 else " " for column in range(first, last + 1)]
    return " " * first + "".join(marks)


def silhouettes_as_text(case: Case, slave: Body, master: Body, width: int = 72) -> str:
    """Draw two bodies of any shape as text: filled, to scale, with the loads on the slave."""
    nodes = np.vstack([slave.nodes, master.nodes])
    (left, low), (right, high) = nodes.min(axis=0), nodes.max(axis=0)
    row = max((high - low) / _SILHOUETTE_HEIGHT, (right - left) * _ASPECT / width)  # The height of a row, a length.
    columns, rows = (max(int(np.ceil(size)), 1) for size in ((right - left) * _ASPECT / row, (high - low) / row))
    x = left + (np.arange(columns) + 0.5) * row / _ASPECT
    y = high - (np.arange(rows) + 0.5) * row
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    canvas = np.full(len(places), " ")
    for name, body in (("master", master), ("slave", slave)):
        following = np.roll(body.cells, -1, axis=1)
        edges = {(a, b) for a, b in np.stack([body.cells, following], axis=-1).reshape(-1, 2).tolist()}
        outer = body.nodes[np.array([edge for edge in edges if edge[::-1] not in edges])]
        canvas[is_inside(outer, places)] = _INKS[name]
    arrows = [" "] * columns
    for place in slave.nodes[(slave.load != 0).any(axis=1)]:
        arrows[min(int((place[0] - left) / row * _ASPECT), columns - 1)] = "↓"
    legend = [
        f"{ink} {name}, {len(side)} segments of {side.lengths(case.positions).min():.3g} or more"
        for (name, ink), side in zip(_INKS.items(), (case.interface.slave, case.interface.master), strict=True)
    ]
    lines = ["".join(arrows), *map("".join, canvas.reshape(rows, columns).tolist()), *legend]
    return "\n".join(line.rstrip() for line in lines)


def is_inside(outer: FloatArray, places: FloatArray) -> BoolArray:
    """Return (n_places,) whether a place is in a body: a ray crosses an odd number of its edges (n_edges, 2, 2)."""
    (x1, y1), (x2, y2) = outer[:, 0].T, outer[:, 1].T
    x, y = places.T[:, :, None]
    crosses = (y1 > y) != (y2 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        right = x < x1 + (y - y1) * (x2 - x1) / (y2 - y1)
    odd: BoolArray = (crosses & right).sum(axis=1) % 2 == 1
    return odd
