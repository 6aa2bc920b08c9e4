"""Two blocks in lists: meshes on which simple formulations pass the patch test, and hard cases.

`contactverif.oracle.flat_answers` says what the classes of meshes are. Hard are tiny segments, contrasts of stiffness
and mesh, overlaps that vanish, and no load at all. In all but the last the pressure is uniform and known exactly.

Roundoff decides nothing on the meshes of a class. In the paper's scenes, where both surfaces end together, coordinates
along the interface are exact. In ours the master goes beyond the slave, so that no slave node faces a free end.

Source: Zavarise & De Lorenzis (2009), Sections 4, 5.1.2 and 7.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from math import cos, radians, sin

import numpy as np

from contactverif.contract.case import Case
from contactverif.mechanics.bodies import UPRIGHT, Placing, Rectangle
from contactverif.problems.blocks import two_blocks
from contactverif.problems.catalogue import MODERATE_PENALTY, load_scene_case
from contactverif.problems.flat_states import TINY_MESHES, TINY_PENALTIES
from contactverif.problems.named_states import named_case

_BESIDE = 0.5  # The length by which the master goes beyond the slave on either side.
_STRAIN = 2.0**-6  # The pressure over the softer body's E.


@dataclass(frozen=True, slots=True)
class _ClassMesh:
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


@cache
def normal_scenes() -> tuple[Case, ...]:
    """Return the paper's A1 and A2, and scenes of ours whose inner master nodes all lie on slave nodes."""
    return (*map(load_scene_case, ("a1", "a2-uniform", "a2-graded")), *_class_cases(_NORMAL))


@cache
def single_scenes() -> tuple[Case, ...]:
    """Return the paper's B and Example 1, and scenes of ours with master nodes in the middle of slave segments."""
    return (*map(load_scene_case, ("b", "example-1")), *_class_cases(_SINGLE))


def _class_cases(drawings: dict[str, _ClassMesh]) -> list[Case]:
    """Return the scenes: three layers of cells above, two below, the interface on y = 0."""
    cases = []
    for name, drawing in drawings.items():
        slave, master = (np.append(0.0, np.cumsum(lengths)) for lengths in (drawing.slave, drawing.master))
        master -= _BESIDE
        height, softer = float(slave[-1]) / 2, min(1.0, drawing.ratio)
        angle = radians(drawing.degrees)
        axis = (cos(angle), sin(angle)) if drawing.degrees else UPRIGHT.axis
        scene = two_blocks(
            Rectangle(slave, np.linspace(0.0, height, 4), young=1.0, poisson=0.3),
            Rectangle(master, np.linspace(-0.75 * height, 0.0, 3), young=drawing.ratio, poisson=0.2),
            penalty=MODERATE_PENALTY * softer / float(np.diff(slave).mean()) / drawing.scale,
            pressure=_STRAIN * softer,
            placing=Placing(axis, scale=drawing.scale),
        )
        cases.append(replace(scene.case(), name=name))
    return cases


_UNITS = ("1e-6", "1", "1e6")  # E of the master over E of the slave.


@cache
def case_c() -> tuple[Case, ...]:
    """Return the paper's case C and its variant C′, as states and solved with unequal materials at two penalties."""
    states = [named_case(name) for name in ("c", "c-prime")]
    scenes = [
        replace(load_scene_case(f"{name}:ratio=3,penalty={penalty}"), name=f"{name} solved, ε̂ = {label}")
        for name, (label, penalty) in product(("c", "c-prime"), (("E", 1e4), ("1e4 E", 1e8)))
    ]
    return (*states, *scenes)


@cache
def tiny_segment_scenes() -> tuple[Case, ...]:
    """Return blocks with a segment of 1.2e-5 in an interface of 12, pressed together at three penalties."""
    return tuple(
        _hard_case(f"{side} solved, ε̂ = {penalty:g}", *mesh, penalty=penalty)
        for (side, mesh), penalty in product(TINY_MESHES.items(), TINY_PENALTIES)
    )


@cache
def stiff_scenes() -> tuple[Case, ...]:
    """Return blocks whose springs are up to 1e10 times as stiff as the softer one; E of the other is 1 to 1e6 times."""
    mesh = [0.0, 3.0, 8.0, 12.0], [0.0, 5.0, 12.0]
    cases = []
    for stiff, ratio in product(("1e4", "1e10"), _UNITS):
        penalty = float(stiff) * min(1.0, float(ratio)) / 4
        cases.append(_hard_case(f"ε̂h/E = {stiff}, E ratio {ratio}", *mesh, ratio=float(ratio), penalty=penalty))
    return tuple(cases)


@cache
def contrast_scenes() -> tuple[Case, ...]:
    """Return a fine block and a coarse one, each as the slave, the stiffer one or the softer one, at two penalties."""
    fine, coarse = np.linspace(0.0, 12.0, 9).tolist(), [0.0, 7.0, 12.0]
    cases = []
    for (mesh, (slave, master)), ratio, (label, stiff) in product(
        {"8 on 2": (fine, coarse), "2 on 8": (coarse, fine)}.items(), _UNITS, (("10 E/h", 10.0), ("1e5 E/h", 1e5))
    ):
        penalty = stiff * min(1.0, float(ratio)) * (len(slave) - 1) / 12
        cases.append(_hard_case(f"{mesh}, E ratio {ratio}, ε̂ = {label}", slave, master, float(ratio), penalty=penalty))
    return tuple(cases)


@cache
def vanishing_overlap_scenes() -> tuple[Case, ...]:
    """Return blocks whose master covers 1e-1 to 1e-12 of the last slave segment, upright and inclined."""
    inclined = Placing((cos(radians(17.3)), sin(radians(17.3))))
    places = [("", UPRIGHT, exponent) for exponent in range(1, 13)]
    places += [(", inclined", inclined, exponent) for exponent in (2, 6, 10, 12)]
    return tuple(
        _hard_case(
            f"overlap 1e-{exponent}{label}",
            [0.0, 2.0, 5.0, 8.0],
            [-1.0, 1.5, 3.0, 5.0 + 3 * 10.0**-exponent],
            penalty=10.0 / 3,
            placing=placing,
        )
        for label, placing, exponent in places
    )


@cache
def unloaded_scenes() -> tuple[Case, ...]:
    """Return blocks that touch with no load, started in touch, pushed in or lifted, upright and inclined."""
    starts = {"touching": 0.0, "pushed in": 2.0**-4, "lifted": -(2.0**-4)}
    placings = {"": UPRIGHT, ", inclined": Placing((cos(radians(33.0)), sin(radians(33.0))))}
    cases = []
    for (start, lowered), (label, placing), (way, load) in product(
        starts.items(), placings.items(), {"free": {"pressure": 0.0}, "held": {"approach": 0.0}}.items()
    ):
        scene = two_blocks(
            Rectangle([0.0, 2.0, 4.0, 8.0, 12.0], [0.0, 3.0, 6.0], poisson=0.3),
            Rectangle([0.0, 3.0, 6.0, 9.0, 12.0], [-6.0, -3.0, 0.0], young=3.0, poisson=0.2),
            penalty=10.0 / 3,
            lowered=lowered,
            placing=placing,
            **load,  # type: ignore[arg-type]
        )
        cases.append(replace(scene.case(), name=f"{way}, {start}{label}"))
    return tuple(cases)


def _hard_case(
    name: str,
    slave: Sequence[float],
    master: Sequence[float],
    ratio: float = 1.0,
    *,
    penalty: float,
    placing: Placing = UPRIGHT,
) -> Case:
    """Return two blocks under a uniform pressure; the slave has E = 1, the master `ratio` times that."""
    scene = two_blocks(
        Rectangle(slave, [0.0, 3.0, 6.0], young=1.0, poisson=0.3),
        Rectangle(master, [-6.0, -3.0, 0.0], young=ratio, poisson=0.2),
        penalty=penalty,
        pressure=_STRAIN * min(1.0, ratio),
        placing=placing,
    )
    return replace(scene.case(), name=name)
