"""The scenes that have a name: those of the reference paper, and one of ours. Data, with source and what we chose.

Source: Zavarise & De Lorenzis (2009), Sections 4, 5 and 7. Lengths along the interface are the paper's where it
prints them (A1, B, C). It prints no heights, materials, lateral supports or dimensions of A2 and of Examples 1 and
1bis, and little of the meshes of Example 2: those are chosen, and `chosen` says so.
"""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import cos, inf, isfinite, radians, sin
from typing import Any, Literal

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.names import parse_name, unknown_name_error
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.simple_bodies import Placing, Rectangle
from contactverif.scenes.blocks import two_blocks
from contactverif.scenes.disk import DiskProblem, disk_on_foundation

MODERATE_PENALTY = 10.0  # ε̂ h / E
_MATERIAL = "E = 1e4, ν = 0.3 in both; rollers at all sides; heights; two layers of cells"
_QUARTERS = {0: (1.0, 0.0), 90: (0.0, 1.0), 180: (-1.0, 0.0), 270: (0.0, -1.0)}  # exact (cos, sin)


@dataclass(frozen=True, slots=True)
class NamedScene:
    """What there is to say of a scene.

    Attributes
    ----------
    summary : str
        What it is, in one line.
    source : str
        Where in the paper; empty if it is ours.
    chosen : str
        What the paper does not print; of a scene of ours, why it is as it is.
    """

    summary: str
    source: str
    chosen: str


@dataclass(frozen=True, slots=True)
class NamedBlocks(NamedScene):
    """A drawing of two blocks, upright, in the paper's units; the pressure between them is uniform.

    Attributes
    ----------
    slave, master : Sequence[float]
        Lengths of the segments from left to right.
    slave_from, master_from : float
        Where they begin.
    height : float
        Of each block.
    pressure : float
        On top.
    rigid_master : bool
        A rigid floor.
    """

    slave: Sequence[float]
    master: Sequence[float]
    slave_from: float = 0.0
    master_from: float = 0.0
    height: float = 4.0
    pressure: float = 100.0
    rigid_master: bool = False


BLOCKS: Mapping[str, NamedBlocks] = {
    "a1": NamedBlocks(
        "two slave segments over one master segment",
        "case test A1, Fig. 8",
        _MATERIAL,
        [2, 2],
        [4],
    ),
    "a2-uniform": NamedBlocks(
        "a uniform mesh on a rigid floor",
        "case test A2, Fig. 11(a)",
        f"the lengths of the segments; {_MATERIAL}",
        [2, 2, 2, 2, 2],
        [10],
        slave_from=-5.0,
        master_from=-5.0,
        rigid_master=True,
    ),
    "a2-graded": NamedBlocks(
        "a graded mesh on a rigid floor",
        "case test A2, Fig. 11(c)",
        f"the lengths of the segments; {_MATERIAL}",
        [1, 2, 3, 4],
        [10],
        slave_from=-5.0,
        master_from=-5.0,
        rigid_master=True,
    ),
    "b": NamedBlocks(
        "non-matching; each area of competence lies over one master segment",
        "case test B, Fig. 16",
        _MATERIAL,
        [2, 2, 4, 4],
        [3, 3, 4, 2],
    ),
    "c": NamedBlocks(
        "non-matching; one area of competence lies over a master node, its virtual slave node on it",
        "case test C, Fig. 20",
        _MATERIAL,
        [2, 2, 4, 4],
        [3, 3, 3, 3],
    ),
    "c-prime": NamedBlocks(
        "c with no virtual slave node on a master node",
        "case test C, lower lengths changed",
        f"the last two lower lengths; {_MATERIAL}",
        [2, 2, 4, 4],
        [3, 3, 3.2, 2.8],
    ),
    "example-1": NamedBlocks(
        "Taylor and Papadopoulos' punch; each area of competence lies over one master segment",
        "Example 1, Fig. 31",
        f"the meshes; {_MATERIAL}",
        [2, 2, 2],
        [3, 1, 4, 1, 3],
        slave_from=-3.0,
        master_from=-6.0,
        pressure=1.0,
    ),
    "example-1bis": NamedBlocks(
        "the same punch; areas of competence cross master nodes",
        "Example 1bis, Fig. 34",
        f"the meshes; {_MATERIAL}",
        [2, 2, 2],
        [1.625, 1.75, 1.75, 1.75, 1.75, 1.75, 1.625],
        slave_from=-3.0,
        master_from=-6.0,
        pressure=1.0,
    ),
    "dead-zone": NamedBlocks(
        "the slave overhangs the master on either side, inside a slave segment",
        "",
        f"all; the pressure also acts on what the master does not cover; {_MATERIAL}",
        [1.6, 2.3, 1.8, 2.2, 2.1, 2.0],
        [1.7, 2.0, 1.8, 1.1],
        slave_from=-6.0,
        master_from=-3.3,
    ),
}

SCENES: Mapping[str, NamedScene] = {
    **BLOCKS,
    "example-2": NamedScene(
        "an elastic disk on an elastic foundation: pressures that vary, and a contact that has an edge",
        "Example 2, Fig. 37",
        "the mesh of the disk; how the 160 × 30 elements of the foundation, 20 wide and 10 deep, are graded; the "
        "foundation is clamped below, the axis of the disk moves up and down only",
    ),
}


def load_scene_case(text: str) -> Case:
    """The scene that the text names, with its options, as a case.

    Raises
    ------
    MisuseError
        As `load_scene`.
    """
    return load_scene(text, "scene").case()


def load_scene(text: str, argument: str = "--scene") -> Scene:
    """The scene that the text names, with its options: `c`, `c:refine=2,penalty=1e4`.

    Raises
    ------
    MisuseError
        For a name, an option or a value that is none.
    """
    name, options = parse_name(argument, text, "NAME or NAME:OPTION=VALUE,OPTION=VALUE")
    if name not in SCENES:
        raise unknown_name_error(argument, name, SCENES)
    own = options_of(name)
    for option, value in options.items():
        if option not in own:
            error = unknown_name_error(f"{argument}: option of {text!r}", option, own)
            raise MisuseError(error.argument, error.found, f"{error.needed}; there are {', '.join(own)}")
        if needed := _refused(name, option, value):
            raise MisuseError(f"{argument}: {option} of {text!r}", repr(value), needed)
    return make_scene(name, **options)


def make_scene(name: str, **options: Any) -> Scene:
    """The scene of that name; `options_of` says which options it has, `blocks` and `disk` what they mean.

    Raises
    ------
    MisuseError
        For a name or an option that is none, and for a value that cannot be.
    """
    if name not in SCENES:
        raise unknown_name_error("scene", name, SCENES)
    own = options_of(name)
    for option, value in options.items():
        if option not in own:
            raise unknown_name_error(f"option of scene {name}", option, own)
        left_open = value is None and own[option] is None
        if not left_open and (needed := _refused(name, option, value)):
            raise MisuseError(f"{option} of scene {name}", repr(value), needed)
    return _maker(name)(**options)


def options_of(name: str) -> Mapping[str, Any]:
    """The options of a scene with their defaults; None is what the scene itself says."""
    return {option: entry.default for option, entry in inspect.signature(_maker(name)).parameters.items()}


def _maker(name: str) -> Callable[..., Scene]:
    return partial(blocks, name) if name in BLOCKS else disk


def disk(
    *,
    refine: int = 1,
    penalty: float = 1e9,
    young: float = 1e8,
    ratio: float = 10.0,
    poisson: float = 0.0,
    force: float = 1e6,
    lowered: float | None = None,
) -> Scene:
    """The disk on its foundation, in the paper's units.

    Parameters
    ----------
    refine : int
        Parts that each side of each cell is divided into.
    penalty : float
        Ε̂.
    young, poisson : float
        E of the disk, ν of both.
    ratio : float
        E of the foundation over E of the disk.
    force : float
        On top of the disk, per unit of thickness.
    lowered : float | None
        How deep the disk is pushed in the first guess; by default so deep that the contact is about as wide as
        in the solution.

    Raises
    ------
    MisuseError
        For a force so large or a penalty so soft that the contact is wider than the meshes are fine.
    """
    problem = DiskProblem(young=(young, ratio * young), poisson=poisson, force=force, penalty=penalty)
    return disk_on_foundation(problem, refine=refine, lowered=lowered, name="example-2")


def blocks(
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
    """The pair of blocks of that name.

    Parameters
    ----------
    refine : int
        Parts that each segment and each layer is divided into.
    penalty : float | None
        Ε̂; 10 E/h with the mean slave segment h by default.
    young, poisson : float
        E of the slave, ν of both.
    ratio : float
        E of the master over E of the slave.
    pressure : float | None
        On top; the scene's own by default.
    degrees : float
        By which all of it is turned, counter-clockwise.
    sides : Literal['rollers', 'free']
        On rollers, or free to strain, so that the contact area changes.
    lowered : float | None
        How deep the slave is pushed in the first guess, 0 to begin where they touch; p/ε̂ by default.
    """
    drawing = BLOCKS[name]
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
        Rectangle(slave_x, layers, young=young, poisson=poisson),
        Rectangle(master_x, layers - drawing.height, young=ratio * young, poisson=poisson),
        penalty=MODERATE_PENALTY * young / mean_segment if penalty is None else penalty,
        pressure=p,
        lowered=lowered,
        free_sides=sides == "free",
        rigid_master=drawing.rigid_master,
        placing=Placing(axis),
        name=name,
    )


def _refused(name: str, option: str, value: Any) -> str:
    """Empty, or what the option needs instead of the value."""
    if option == "sides":
        return "" if value in ("rollers", "free") else "rollers or free"
    if option == "refine":
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        finest = _FINEST if name in BLOCKS else _FINEST_DISK
        return "" if whole and 1 <= value <= finest else f"a whole number from 1 to {finest}"
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


OPTIONS = tuple(dict.fromkeys(option for name in SCENES for option in options_of(name)))
_ABOVE_ZERO = ("penalty", "young", "ratio", "pressure", "force")
_FINEST, _FINEST_DISK = 64, 4  # that disk has 65,000 cells


def _grid(start: float, lengths: Sequence[float], refine: int) -> FloatArray:
    """Ascending coordinates of a side; the printed nodes are exact whatever the refinement."""
    coarse = start + np.concatenate([[0.0], np.cumsum(lengths)])
    parts = [np.linspace(a, b, refine, endpoint=False) for a, b in itertools.pairwise(coarse)]
    return np.concatenate([*parts, coarse[-1:]])
