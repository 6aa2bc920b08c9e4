"""Named states of interfaces with more than a hundred segments a side, for what shows on none of a dozen segments.

A tangent may be right on every small mesh and wrong on a large one: a table of fixed length, a block of rows that is
forgotten, a norm that hides a small entry among a thousand. Each state differs from the others in what is long about
it. Nodes lie off any lattice, so that no state is at a kink; all of the interface is in contact.

Rule for the next editor: names and numbers are for good. A stored report refers to a state by its name.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface, Surface
from contactverif.problems.flat_states import collect, collect_on_faces, grid, rotation

_FINEST = 1e-3  # The shortest over the longest segment of the graded state.
_PENALTY = 16.0
_DEPTH = 1 / 16  # The mean penetration over the shortest segment.


class _Part(NamedTuple):
    """A slave chain over a master chain, at rest: the slave on top, and left of the way that it is walked."""

    slave: FloatArray  # (n, 2) The points in walking order, the body on the left.
    master: FloatArray
    inward: FloatArray  # (n_slave, 2) The unit vectors along which the slave's points penetrate the master.
    closed: bool = False  # The last point of each chain is joined to its first.


@collect_on_faces
def long_face_states(corners: int) -> Iterator[Case]:
    """Return the states in space: faces on a wave, few on many, many on few, and nearly flat and hardly in touch.

    In the last one the tangent is nearly symmetric, as it is in everyday use. A slave grid lies over the middle of a
    wider master grid.
    """
    sizes = {
        "wavy-faces": (8, 5, 1 / 16, _DEPTH),
        "few-faces-on-many": (2, 8, 0.0, _DEPTH),
        "many-faces-on-few": (8, 2, 0.0, _DEPTH),
        "shallow-faces": (4, 8, 0.0, _DEPTH / 64),
    }
    for number, (kind, (*cells, amplitude, depth)) in enumerate(sizes.items()):
        slave, master = (
            grid(_places(number, count).tolist(), _places(number + 20, count).tolist(), corners=corners)
            for number, count in enumerate(map(int, cells), 2 * number)
        )
        upper, lower = np.array(slave.points), 1.1 * np.array(master.points) - [0.05, 0.05, 0.0]
        for points in (upper, lower):
            points[:, 2] = amplitude * np.cos(7 * points[:, 0]) * np.cos(5 * points[:, 1])
        interface = Interface.from_faces(upper, [face[::-1] for face in slave.faces], lower, master.faces)
        least = min(surface.heights(interface.nodes).min() for surface in (interface.slave, interface.master))
        upper[:, 2] -= amplitude / 8 + least * np.random.default_rng(number).uniform(0.5, 1.5, len(upper)) * depth
        matrix, size = rotation((3, 1, 2, 1 + number))
        current = np.vstack([upper, lower]) @ (np.array(matrix).T / size)
        name = f"{kind}-{max(len(slave.faces), len(master.faces))}"
        yield Case(interface, current.reshape(-1), _PENALTY, name=name, kind=kind)


@collect
def long_states() -> Iterator[Case]:
    """Return the states of chains, each turned by an angle; slave nodes penetrate by different depths."""
    groups = {
        "wave-110": [_open(_places(2, 80), _places(13, 110), wavy=True)],
        "graded-110": [_open(_places(4, 110, graded=True), _places(5, 60))],
        "many-on-few-104": [_open(_places(1, 104), _places(3, 4))],
        "few-on-many-200": [_open(_places(3, 4), _places(1, 200))],
        "three-chains-108": [_open(_places(6 + k, 36), _places(9 + k, 12), along=1.5 * k) for k in range(3)],
        "ring-104": [_ring(_places(12, 30), _places(13, 104))],
    }
    for number, (name, parts) in enumerate(groups.items()):
        nodes, surfaces, count = [], [], 0
        for side in ("slave", "master"):
            segments = []
            for part in parts:
                points = getattr(part, side)
                numbers = np.arange(count, count + len(points))
                pairs = np.column_stack([numbers, np.roll(numbers, -1)])
                segments.append(pairs if part.closed else pairs[:-1])
                nodes.append(points)
                count += len(points)
            surfaces.append(Surface(np.vstack(segments)))
        current, inward = np.vstack(nodes), np.vstack([part.inward for part in parts])
        interface, n_slave = Interface(current, *surfaces), len(inward)
        shortest = min(surface.lengths(current).min() for surface in surfaces)
        depths = shortest * np.random.default_rng(n_slave).uniform(0.5, 1.5, n_slave) * _DEPTH
        current[:n_slave] += depths[:, None] * inward
        cos, sin = np.cos(0.5 + number), np.sin(0.5 + number)
        turned = current @ np.array([[cos, sin], [-sin, cos]])
        yield Case(interface, turned.reshape(-1), _PENALTY, name=name, kind=name.rpartition("-")[0])


def _places(seed: int, count: int, *, graded: bool = False) -> FloatArray:
    """Return ascending places (count + 1,) from 0 to 1; graded segments, an even number, are shortest near 1/2."""
    random = np.random.default_rng(seed)
    if graded:
        half = np.geomspace(1.0, _FINEST, count // 2)
        steps = np.concatenate([half, half[::-1]]) * random.uniform(0.9, 1.1, count)
    else:
        steps = random.uniform(0.7, 1.4, count)
    return np.asarray(np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum())


def _open(slave: FloatArray, master: FloatArray, *, along: float = 0.0, wavy: bool = False) -> _Part:
    """Return a slave over the middle of a wider master; both lie on a line or a wave and begin at `along`, a length."""
    lines = [(x + along, np.cos(7 * x) / 16 if wavy else 0 * x) for x in (slave, (1.1 * master - 0.05)[::-1])]
    upper, lower = map(np.column_stack, lines)
    return _Part(upper, lower, np.tile([0.0, -1.0], (len(slave), 1)))


def _ring(slave: FloatArray, master: FloatArray) -> _Part:
    """Return a slave ring around a master ring; places from 0 to 1 go once around."""
    angles = (-2 * np.pi * slave[:-1], 2 * np.pi * master[:-1])
    outer, inner = (np.column_stack([np.cos(angle), np.sin(angle)]) for angle in angles)
    return _Part(outer, inner, -outer, closed=True)
