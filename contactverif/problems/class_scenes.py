"""Two blocks whose meshes belong to the classes on which simple formulations pass the patch test, in finite lists.

`contactverif.oracle.flat_answers` says what the classes are. The pressure is uniform and known exactly.

Rule for the next editor: roundoff decides nothing. In the paper's scenes, where both surfaces end together, coordinates
along the interface are exact. In ours the master goes beyond the slave, so that no slave node faces a free end.

Source: Zavarise & De Lorenzis (2009), Sections 4, 5.1.2 and 7.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import cos, radians, sin

import numpy as np

from contactverif.contract.case import Case
from contactverif.mechanics.simple_bodies import UPRIGHT, Placing, Rectangle
from contactverif.problems.blocks import two_blocks
from contactverif.problems.catalogue import MODERATE_PENALTY, load_scene_case

_BESIDE = 0.5  # The length by which the master goes beyond the slave on either side.
_STRAIN = 2.0**-6  # The pressure over the softer body's E.


@dataclass(frozen=True, slots=True, kw_only=True)
class _Blocks:
    """Two blocks under a uniform pressure; all lengths are those of segments from left to right."""

    slave: Sequence[float]
    master: Sequence[float]
    ratio: float = 1.0  # E of the master over E of the slave, which is 1.
    degrees: float = 0.0
    scale: float = 1.0


_NORMAL = {
    "one segment on one": _Blocks(slave=[1], master=[2]),
    "node on node, E ratio 1000": _Blocks(slave=[1, 2, 4, 1], master=[1.5, 2, 4, 1.5], ratio=1e3),
    "some nodes on nodes, inclined by 17.3°": _Blocks(
        slave=[1, 3, 0.5, 2, 1.5, 4], master=[4.5, 2.5, 6.5], ratio=3.0, degrees=17.3
    ),
    "nine segments on two": _Blocks(
        slave=[1, 1, 2, 1, 0.25, 0.25, 0.5, 3, 3], master=[4.5, 8.5], ratio=1 / 8, scale=2e-3
    ),
}
_SINGLE = {
    "one segment on two": _Blocks(slave=[2], master=[1.5, 1.5]),
    "each midpoint, E ratio 1000": _Blocks(slave=[2, 4, 1], master=[1.5, 3, 2.5, 1], ratio=1e3),
    "nodes and midpoints, inclined by 17.3°": _Blocks(
        slave=[1, 3, 0.5, 2, 1.5, 4], master=[3, 1.5, 1.5, 2.5, 2, 2.5], ratio=3.0, degrees=17.3
    ),
    "two of four parts": _Blocks(slave=[4, 0.5, 3, 4.5], master=[4.75, 0.25, 8], ratio=1 / 8, scale=2e-3),
}


@cache
def normal_scenes() -> tuple[Case, ...]:
    """Return the paper's A1 and A2, and scenes of ours whose inner master nodes all lie on slave nodes."""
    return (*map(load_scene_case, ("a1", "a2-uniform", "a2-graded")), *_cases(_NORMAL))


@cache
def single_scenes() -> tuple[Case, ...]:
    """Return the paper's B and Example 1, and scenes of ours with master nodes in the middle of slave segments."""
    return (*map(load_scene_case, ("b", "example-1")), *_cases(_SINGLE))


def _cases(drawings: dict[str, _Blocks]) -> list[Case]:
    return [replace(_scene(drawing), name=name) for name, drawing in drawings.items()]


def _scene(drawing: _Blocks) -> Case:
    """Return the scene: three layers of cells above, two below, the interface on y = 0."""
    slave, master = (np.append(0.0, np.cumsum(lengths)) for lengths in (drawing.slave, drawing.master))
    master -= _BESIDE
    height, softer = float(slave[-1]) / 2, min(1.0, drawing.ratio)
    angle = radians(drawing.degrees)
    axis = (cos(angle), sin(angle)) if drawing.degrees else UPRIGHT.axis
    return two_blocks(
        Rectangle(slave, np.linspace(0.0, height, 4), young=1.0, poisson=0.3),
        Rectangle(master, np.linspace(-0.75 * height, 0.0, 3), young=drawing.ratio, poisson=0.2),
        penalty=MODERATE_PENALTY * softer / float(np.diff(slave).mean()) / drawing.scale,
        pressure=_STRAIN * softer,
        placing=Placing(axis, scale=drawing.scale),
    ).case()
