"""Two blocks in lists: meshes on which simple formulations pass the patch test, and hard cases.

`contactverif.oracle.flat_answers` says what the classes of meshes are. Hard are tiny segments, contrasts of stiffness
and mesh, overlaps that vanish, and no load at all. In all but the last the pressure is uniform and known exactly.

Roundoff decides nothing on the meshes of a class. In the paper's scenes, where both surfaces end together, coordinates
along the interface are exact. In ours the master goes beyond the slave, so that no slave node faces a free end.

Source: Zavarise & De Lorenzis (2009), Sections 4, 5.1.2 and 7.1.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from math import cos, radians, sin
from typing import Any, NamedTuple

import numpy as np

from contactverif.contract.case import Case
from contactverif.mechanics.bodies import UPRIGHT, Placing, Rectangle
from contactverif.problems.blocks import two_blocks
from contactverif.problems.catalogue import MODERATE_PENALTY, load_scene_case
from contactverif.problems.flat_states import TINY_MESHES, TINY_PENALTIES, collect
from contactverif.problems.named_states import named_case

_BESIDE = 0.5  # The length by which the master goes beyond the slave on either side.
_STRAIN = 2.0**-6  # The pressure over the softer body's E.


class _ClassMesh(NamedTuple):
    """Two blocks under a uniform pressure; all lengths are those of segments from left to right."""

    slave: Sequence[float]
    master: Sequence[float]
    ratio: float = 1.0  # E of the master over E of the slave, which is 1.
    degrees: float = 0.0
    scale: float = 1.0


_NORMAL = {
    "one segment on one": _ClassMesh([1], [2]),
    "node on node, E ratio 1000": _ClassMesh([1, 2, 4, 1], [1.5, 2, 4, 1.5], 1e3),
    "some nodes on nodes, inclined by 17.3°": _ClassMesh([1, 3, 0.5, 2, 1.5, 4], [4.5, 2.5, 6.5], 3.0, 17.3),
    "nine segments on two": _ClassMesh([1, 1, 2, 1, 0.25, 0.25, 0.5, 3, 3], [4.5, 8.5], 1 / 8, scale=2e-3),
}
_SINGLE = {
    "one segment on two": _ClassMesh([2], [1.5, 1.5]),
    "each midpoint, E ratio 1000": _ClassMesh([2, 4, 1], [1.5, 3, 2.5, 1], 1e3),
    "nodes and midpoints, inclined by 17.3°": _ClassMesh([1, 3, 0.5, 2, 1.5, 4], [3, 1.5, 1.5, 2.5, 2, 2.5], 3.0, 17.3),
    "two of four parts": _ClassMesh([4, 0.5, 3, 4.5], [4.75, 0.25, 8], 1 / 8, scale=2e-3),
}


@collect
def normal_scenes() -> Iterator[Case]:
    """Return the paper's A1 and A2, and scenes of ours whose inner master nodes all lie on slave nodes."""
    yield from map(load_scene_case, ("a1", "a2-uniform", "a2-graded"))
    yield from _class_cases(_NORMAL)


@collect
def single_scenes() -> Iterator[Case]:
    """Return the paper's B and Example 1, and scenes of ours with master nodes in the middle of slave segments."""
    yield from map(load_scene_case, ("b", "example-1"))
    yield from _class_cases(_SINGLE)


def _class_cases(drawings: dict[str, _ClassMesh]) -> Iterator[Case]:
    """Return the scenes: three layers of cells above, two below, the interface on y = 0."""
    for name, (lengths, opposite, ratio, degrees, scale) in drawings.items():
        slave, master = (np.append(0.0, np.cumsum(each)) for each in (lengths, opposite))
        height, mean = float(slave[-1]) / 2, float(np.diff(slave).mean())
        yield _case(
            name,
            Rectangle(slave, np.linspace(0.0, height, 4), poisson=0.3),
            Rectangle(master - _BESIDE, np.linspace(-0.75 * height, 0.0, 3), young=ratio, poisson=0.2),
            penalty=MODERATE_PENALTY * min(1.0, ratio) / mean / scale,
            placing=_incline(degrees, scale),
        )


_UNITS = ("1e-6", "1", "1e6")  # E of the master over E of the slave.


@collect
def case_c() -> Iterator[Case]:
    """Return the paper's case C and its variant C′, as states and solved with unequal materials at two penalties."""
    names = ("c", "c-prime")
    yield from map(named_case, names)
    for name, (label, penalty) in product(names, (("E", 1e4), ("1e4 E", 1e8))):
        scene = load_scene_case(f"{name}:ratio=3,penalty={penalty}")
        yield replace(scene, name=f"{name} solved, ε̂ = {label}")


@collect
def tiny_segment_scenes() -> Iterator[Case]:
    """Return blocks with a segment of 1.2e-5 in an interface of 12, pressed together at three penalties."""
    for (side, mesh), penalty in product(TINY_MESHES.items(), TINY_PENALTIES):
        yield _hard_case(f"{side} solved, ε̂ = {penalty:g}", *mesh, penalty=penalty)


@collect
def stiff_scenes() -> Iterator[Case]:
    """Return blocks whose springs are up to 1e10 times as stiff as the softer one; E of the other is 1 to 1e6 times."""
    mesh = [0.0, 3.0, 8.0, 12.0], [0.0, 5.0, 12.0]
    for stiff, ratio in product(("1e4", "1e10"), _UNITS):
        penalty = float(stiff) * min(1.0, float(ratio)) / 4
        yield _hard_case(f"ε̂h/E = {stiff}, E ratio {ratio}", *mesh, float(ratio), penalty=penalty)


@collect
def contrast_scenes() -> Iterator[Case]:
    """Return a fine block and a coarse one, each as the slave, the stiffer one or the softer one, at two penalties."""
    fine, coarse = np.linspace(0.0, 12.0, 9).tolist(), [0.0, 7.0, 12.0]
    for (mesh, (slave, master)), ratio, (label, stiff) in product(
        {"8 on 2": (fine, coarse), "2 on 8": (coarse, fine)}.items(), _UNITS, (("10 E/h", 10.0), ("1e5 E/h", 1e5))
    ):
        penalty = stiff * min(1.0, float(ratio)) * (len(slave) - 1) / 12
        yield _hard_case(f"{mesh}, E ratio {ratio}, ε̂ = {label}", slave, master, float(ratio), penalty=penalty)


@collect
def vanishing_overlap_scenes() -> Iterator[Case]:
    """Return blocks whose master covers 1e-1 to 1e-12 of the last slave segment, upright and inclined."""
    places = [("", 0.0, exponent) for exponent in range(1, 13)]
    places += [(", inclined", 17.3, exponent) for exponent in (2, 6, 10, 12)]
    for label, degrees, exponent in places:
        name, end = f"overlap 1e-{exponent}{label}", 5.0 + 3 * 10.0**-exponent
        slave, master = [0.0, 2.0, 5.0, 8.0], [-1.0, 1.5, 3.0, end]
        yield _hard_case(name, slave, master, penalty=10.0 / 3, placing=_incline(degrees))


@collect
def unloaded_scenes() -> Iterator[Case]:
    """Return blocks that touch with no load, started in touch, pushed in or lifted, upright and inclined."""
    starts = {"touching": 0.0, "pushed in": 2.0**-4, "lifted": -(2.0**-4)}
    slave = Rectangle([0.0, 2.0, 4.0, 8.0, 12.0], [0.0, 3.0, 6.0], poisson=0.3)
    master = Rectangle([0.0, 3.0, 6.0, 9.0, 12.0], [-6.0, -3.0, 0.0], young=3.0, poisson=0.2)
    for (start, lowered), (label, degrees), (way, load) in product(
        starts.items(), {"": 0.0, ", inclined": 33.0}.items(), {"free": "pressure", "held": "approach"}.items()
    ):
        others: dict[str, Any] = {load: 0.0, "lowered": lowered, "placing": _incline(degrees)}
        yield replace(two_blocks(slave, master, penalty=10.0 / 3, **others).case(), name=f"{way}, {start}{label}")


def _incline(degrees: float, scale: float = 1.0) -> Placing:
    angle = radians(degrees)
    return Placing((cos(angle), sin(angle)) if degrees else UPRIGHT.axis, scale=scale)


def _hard_case(
    name: str,
    slave: Sequence[float],
    master: Sequence[float],
    ratio: float = 1.0,
    *,
    penalty: float,
    placing: Placing = UPRIGHT,
) -> Case:
    upper = Rectangle(slave, [0.0, 3.0, 6.0], poisson=0.3)
    lower = Rectangle(master, [-6.0, -3.0, 0.0], young=ratio, poisson=0.2)
    return _case(name, upper, lower, penalty=penalty, placing=placing)


def _case(name: str, slave: Rectangle, master: Rectangle, *, penalty: float, placing: Placing) -> Case:
    """Return two blocks under a uniform pressure; the slave has E = 1."""
    pressure = _STRAIN * min(1.0, master.young)
    return replace(two_blocks(slave, master, penalty=penalty, pressure=pressure, placing=placing).case(), name=name)
