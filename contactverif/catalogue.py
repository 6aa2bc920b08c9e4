"""The scenes that have a name: those of the reference paper. Data, with their source and with what we had to choose.

Source: Zavarise & De Lorenzis (2009), Sections 4, 5 and 7.1. Lengths along the interface are the paper's where it
prints them (A1, B, C). It prints no heights, materials, lateral supports or dimensions of A2 and of Examples 1 and
1bis: those are chosen, and `chosen` says so.
"""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos, inf, isfinite, radians, sin
from typing import Any, Literal

import numpy as np

from contactverif.arrays import FloatArray
from contactverif.blocks import Placing, two_blocks
from contactverif.errors import MisuseError
from contactverif.names import parsed, unknown
from contactverif.scene import Scene

MODERATE = 10.0  # ε̂ h / E
_MATERIAL = "E = 1e4, ν = 0.3 in both; rollers at all sides; heights; two layers of cells"
_QUARTERS = {0: (1.0, 0.0), 90: (0.0, 1.0), 180: (-1.0, 0.0), 270: (0.0, -1.0)}  # exact (cos, sin)


@dataclass(frozen=True, slots=True)
class NamedScene:
    """A drawing of two blocks, upright, in the paper's units.

    Attributes
    ----------
    summary : what it is, in one line.
    source : where in the paper.
    chosen : what the paper does not print.
    slave, master : lengths of the segments from left to right.
    slave_from, master_from : where they begin.
    height : of each block.
    pressure : on top.
    rigid_master : a rigid floor.
    """

    summary: str
    source: str
    chosen: str
    slave: Sequence[float]
    master: Sequence[float]
    slave_from: float = 0.0
    master_from: float = 0.0
    height: float = 4.0
    pressure: float = 100.0
    rigid_master: bool = False


SCENES: Mapping[str, NamedScene] = {
    "a1": NamedScene(
        "two slave segments over one master segment",
        "case test A1, Fig. 8",
        _MATERIAL,
        [2, 2],
        [4],
    ),
    "a2-uniform": NamedScene(
        "a uniform mesh on a rigid floor",
        "case test A2, Fig. 11(a)",
        f"the lengths; {_MATERIAL}",
        [2, 2, 2, 2],
        [8],
        rigid_master=True,
    ),
    "a2-graded": NamedScene(
        "a graded mesh on a rigid floor",
        "case test A2, Fig. 11(c)",
        f"the lengths; {_MATERIAL}",
        [1, 1, 2, 4],
        [8],
        rigid_master=True,
    ),
    "b": NamedScene(
        "non-matching; each area of competence lies over one master segment",
        "case test B, Fig. 16",
        _MATERIAL,
        [2, 2, 4, 4],
        [3, 3, 4, 2],
    ),
    "c": NamedScene(
        "non-matching; areas of competence cross master nodes, one virtual slave node sits on one",
        "case test C, Fig. 20",
        _MATERIAL,
        [2, 2, 4, 4],
        [3, 3, 3, 3],
    ),
    "c-prime": NamedScene(
        "c with no virtual slave node on a master node",
        "case test C, lower lengths changed",
        f"the last two lower lengths; {_MATERIAL}",
        [2, 2, 4, 4],
        [3, 3, 3.2, 2.8],
    ),
    "example-1": NamedScene(
        "Taylor and Papadopoulos' punch; each area of competence lies over one master segment",
        "Example 1, Fig. 31",
        f"the meshes; {_MATERIAL}",
        [2, 2, 2],
        [2, 2, 2, 2, 2, 2],
        slave_from=-3.0,
        master_from=-6.0,
        pressure=1.0,
    ),
    "example-1bis": NamedScene(
        "the same punch; areas of competence cross master nodes",
        "Example 1bis, Fig. 34",
        f"the meshes; {_MATERIAL}",
        [2, 2, 2],
        [1.625, 1.75, 1.75, 1.75, 1.75, 1.75, 1.625],
        slave_from=-3.0,
        master_from=-6.0,
        pressure=1.0,
    ),
}


def scene_named(text: str, argument: str = "--scene") -> Scene:
    """The scene that the text names, with its options: `c`, `c:refine=2,penalty=1e4`.

    Raises
    ------
    MisuseError : for a name, an option or a value that is none.
    """
    name, options = parsed(argument, text, "NAME or NAME:OPTION=VALUE,OPTION=VALUE")
    if name not in SCENES:
        raise unknown(argument, name, SCENES)
    for option, value in options.items():
        if option not in OPTIONS:
            error = unknown(f"{argument}: option of {text!r}", option, OPTIONS)
            raise MisuseError(error.argument, error.found, f"{error.needed}; there are {', '.join(OPTIONS)}")
        if needed := _refused(option, value):
            raise MisuseError(f"{argument}: {option} of {text!r}", repr(value), needed)
    return made(name, **options)


def made(
    name: str,
    *,
    refine: int = 1,
    penalty: float | None = None,
    young: float = 1e4,
    ratio: float = 1.0,
    poisson: float = 0.3,
    pressure: float | None = None,
    degrees: float = 0.0,
    sides: Literal["rollers", "free"] = "rollers",
    lowered: float | None = None,
) -> Scene:
    """The scene of that name.

    Parameters
    ----------
    refine : parts that each segment and each layer is divided into.
    penalty : ε̂; 10 E/h with the mean slave segment h by default.
    young, poisson : E of the slave, ν of both.
    ratio : E of the master over E of the slave.
    pressure : on top; the scene's own by default.
    degrees : by which all of it is turned, counter-clockwise.
    sides : on rollers, or free to strain, so that the contact area changes.
    lowered : how deep the slave is pushed in the first guess, 0 to begin where they touch; p/ε̂ by default.

    Raises
    ------
    MisuseError : for a value that cannot be.
    """
    if name not in SCENES:
        raise unknown("scene", name, SCENES)
    numbers = {"young": young, "ratio": ratio, "poisson": poisson, "degrees": degrees}
    optional = {"penalty": penalty, "pressure": pressure, "lowered": lowered}
    given = {option: value for option, value in optional.items() if value is not None}
    for option, value in {"refine": refine, **numbers, "sides": sides, **given}.items():
        if needed := _refused(option, value):
            raise MisuseError(f"{option} of scene {name}", repr(value), needed)
    drawing = SCENES[name]
    p = drawing.pressure if pressure is None else pressure
    slave_x, master_x = (
        _grid(start, lengths, refine)
        for start, lengths in ((drawing.slave_from, drawing.slave), (drawing.master_from, drawing.master))
    )
    layers = np.linspace(0.0, drawing.height, 2 * refine + 1)
    mean_segment = float(np.mean(drawing.slave)) / refine
    angle = radians(degrees)
    axis = _QUARTERS.get(degrees % 360, (cos(angle), sin(angle)))  # type: ignore[call-overload]
    return two_blocks(
        slave_x,
        layers,
        master_x,
        layers - drawing.height,
        young=(young, ratio * young),
        poisson=(poisson, poisson),
        penalty=MODERATE * young / mean_segment if penalty is None else penalty,
        pressure=p,
        lowered=lowered,
        free_sides=sides == "free",
        rigid_master=drawing.rigid_master,
        placing=Placing(axis),
        name=name,
    )


def _refused(option: str, value: Any) -> str:
    """Empty, or what the option needs instead of the value."""
    if option == "sides":
        return "" if value in ("rollers", "free") else "rollers or free"
    if option == "refine":
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        return "" if whole and 1 <= value <= _FINEST else f"a whole number from 1 to {_FINEST}"
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return "a number"
    try:
        number = float(value)
    except OverflowError:  # a whole number that no float can hold
        number = inf
    if option == "poisson":
        return "" if -1 < number < 0.5 else "Poisson's ratio above −1 and below 0.5"
    if option in _ABOVE_ZERO:
        return "" if 0 < number < inf else "a number > 0"
    return "" if isfinite(number) else "a finite number"


OPTIONS = tuple(inspect.signature(made).parameters)[1:]
_ABOVE_ZERO = ("penalty", "young", "ratio", "pressure")
_FINEST = 64


def _grid(start: float, lengths: Sequence[float], refine: int) -> FloatArray:
    """Ascending coordinates of a side; the printed nodes are exact whatever the refinement."""
    coarse = start + np.concatenate([[0.0], np.cumsum(lengths)])
    parts = [np.linspace(a, b, refine, endpoint=False) for a, b in itertools.pairwise(coarse)]
    return np.concatenate([*parts, coarse[-1:]])
