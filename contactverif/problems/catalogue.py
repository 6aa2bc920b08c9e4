"""The scenes that have a name on the command line: those of the reference paper, and one of ours.

The lengths along the interface are the paper's where it prints them (A1, B, C). It prints no heights, materials,
lateral supports or lengths of the elements of A2 and of Examples 1 and 1bis, and little of the meshes of Example 2.
Those are assumptions, and the attribute `assumptions` of each scene says so.

Rule for the next editor: this file is data. A new scene of `verify --scene` is one entry of `BLOCKS` or `SCENES`, with
its source. A scene of `bench`, with an exact solution, is a `Problem` (`problem.py`).

Source: Zavarise & De Lorenzis, IJNME 79 (2009) 379–416, Sections 4, 5 and 7.
"""

import inspect
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import cos, inf, radians, sin
from typing import Any, Literal

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError, parse_name, unknown_name_error
from contactverif.mechanics.bodies import Placing, Rectangle
from contactverif.mechanics.newton import DIVERGENCE_FACTOR
from contactverif.mechanics.scene import Scene
from contactverif.problems.blocks import two_blocks
from contactverif.problems.disk import DiskProblem, disk_on_foundation
from contactverif.problems.named_states import FLAT_IN_SPACE, named_case
from contactverif.problems.space_blocks import space_blocks

MODERATE_PENALTY = 10.0  # The dimensionless penalty ε̂ h / E of a scene, unless one is given.
_MATERIAL = "E = 1e4, ν = 0.3 in both; rollers at all sides; heights; two layers of cells"
_QUARTER_TURNS = {0: (1.0, 0.0), 90: (0.0, 1.0), 180: (-1.0, 0.0), 270: (0.0, -1.0)}  # The exact (cos, sin).


@dataclass(frozen=True, slots=True)
class NamedScene:
    """The description of a scene."""

    summary: str  # What the scene shows, in one line.
    source: str  # The place in the paper; empty if the scene is ours.
    assumptions: str  # What the paper does not print; for a scene of ours, why it is as it is.


@dataclass(frozen=True, slots=True)
class NamedBlocks(NamedScene):
    """The description of two blocks, upright, in the paper's units. The pressure between them is uniform."""

    slave: Sequence[float]  # The lengths of the segments from left to right.
    master: Sequence[float]
    slave_from: float = 0.0  # The x at which the segments begin.
    master_from: float = 0.0
    height: float = 4.0  # The height of each block.
    pressure: float = 100.0  # The pressure on top.
    rigid_master: bool = False  # True if the master is a rigid floor.


_ON_A_FLOOR = partial(
    NamedBlocks,
    assumptions=f"the lengths of the segments; {_MATERIAL}",
    master=[10],
    slave_from=-5.0,
    master_from=-5.0,
    rigid_master=True,
)
_PUNCH = partial(
    NamedBlocks,
    assumptions=f"the meshes; {_MATERIAL}",
    slave=[2, 2, 2],
    slave_from=-3.0,
    master_from=-6.0,
    pressure=1.0,
)
_ON_FOUR = partial(NamedBlocks, assumptions=_MATERIAL, slave=[2, 2, 4, 4])
BLOCKS: Mapping[str, NamedBlocks] = {
    "a1": NamedBlocks("two slave segments over one master segment", "case test A1, Fig. 8", _MATERIAL, [2, 2], [4]),
    "a2-uniform": _ON_A_FLOOR("a uniform mesh on a rigid floor", "case test A2, Fig. 11(a)", slave=[2, 2, 2, 2, 2]),
    "a2-graded": _ON_A_FLOOR("a graded mesh on a rigid floor", "case test A2, Fig. 11(c)", slave=[1, 2, 3, 4]),
    "b": _ON_FOUR(
        "non-matching; each area of competence lies over one master segment",
        "case test B, Fig. 16",
        master=[3, 3, 4, 2],
    ),
    "c": _ON_FOUR(
        "non-matching; one area of competence lies over a master node, its virtual slave node on it",
        "case test C, Fig. 20",
        master=[3, 3, 3, 3],
    ),
    "c-prime": _ON_FOUR(
        "c with no virtual slave node on a master node",
        "case test C, lower lengths changed",
        assumptions=f"the last two lower lengths; {_MATERIAL}",
        master=[3, 3, 3.2, 2.8],
    ),
    "example-1": _PUNCH(
        "Taylor and Papadopoulos' punch; each area of competence lies over one master segment",
        "Example 1, Fig. 31",
        master=[3, 1, 4, 1, 3],
    ),
    "example-1bis": _PUNCH(
        "the same punch; areas of competence cross master nodes",
        "Example 1bis, Fig. 34",
        master=[1.625, 1.75, 1.75, 1.75, 1.75, 1.75, 1.625],
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
    """Return the scene that the text names as a case; see `load_scene`.

    The name of a flat state in space stands for two blocks over it, as a witness of what such a state shows.
    """
    if text not in FLAT_IN_SPACE.values():
        return load_scene(text, "scene").case()
    state = named_case(text)
    plane, domain, layers = state.parameters["plane"], state.parameters["domain"], ([0.5, 0.5], [0.5, 0.5])
    materials = (1.0, 0.3), (3.0, 0.2)
    scene = space_blocks(
        state.interface, plane, domain, layers=layers, materials=materials, penalty=MODERATE_PENALTY, approach=2.0**-6
    )
    return replace(scene, name=text).case()


def load_scene(text: str, argument: str = "--scene") -> Scene:
    """Return a scene by its name on the command line, with options.

    Parameters
    ----------
    text : str
        The name and its options, such as ``"c"`` or ``"c:refine=2,penalty=1e4"``.
    argument : str
        The beginning of error messages.

    Raises
    ------
    MisuseError
        If the name, an option or a value does not exist; the message suggests the nearest ones.

    Examples
    --------
    Case test C of the reference paper, with a mesh twice as fine:

    >>> from contactverif import load_scene
    >>> scene = load_scene("c:refine=2")
    >>> len(scene.interface.slave), scene.facts["pressure"].item()
    (8, 100.0)
    """
    name, options = parse_name(argument, text, "NAME or NAME:OPTION=VALUE,OPTION=VALUE")
    if name not in SCENES:
        raise unknown_name_error(argument, name, SCENES)
    _check_options(name, options, f"{argument}: ", repr(text))
    return make_scene(name, **options)


def make_scene(name: str, **options: Any) -> Scene:
    """Return a scene by its name, with options as keywords."""
    if name not in SCENES:
        raise unknown_name_error("scene", name, SCENES)
    _check_options(name, options, "", f"scene {name}")
    scene = _maker(name)(**options)
    with np.errstate(all="ignore"):  # Whatever overflows is refused.
        is_near = np.abs(scene.start).max(initial=0.0) <= DIVERGENCE_FACTOR * np.abs(scene.interface.nodes).max()
    if not is_near:  # Newton's method would end before its first step.
        values = ", ".join(f"{option}={value}" for option, value in options.items())
        raise MisuseError(f"options of scene {name}", values, "more stiffness or less pressure: it starts too far away")
    return scene


def options_of(name: str) -> Mapping[str, Any]:
    """Return the options of a scene with their defaults; None means the scene's own value."""
    return {option: entry.default for option, entry in inspect.signature(_maker(name)).parameters.items()}


def _check_options(name: str, options: Mapping[str, Any], begin: str, scene: str) -> None:
    """Check options; a message says which "option of" the scene is wrong, and after a beginning lists all of them."""
    defaults = options_of(name)
    for option, value in options.items():
        if option not in defaults:
            error = unknown_name_error(f"{begin}option of {scene}", option, defaults)
            needed = f"{error.needed}; there are {', '.join(defaults)}" if begin else error.needed
            raise MisuseError(error.argument, error.found, needed)
        is_default = value is None and defaults[option] is None
        if not is_default and (needed := _describe_need(name, option, value)):
            raise MisuseError(f"{begin}{option} of {scene}", repr(value), needed)


def _maker(name: str) -> Callable[..., Scene]:
    return partial(make_blocks, name) if name in BLOCKS else make_disk


def make_disk(
    *,
    refine: int = 1,
    penalty: float = 1e9,
    young: float = 1e8,
    ratio: float = 10.0,
    poisson: float = 0.0,
    force: float = 1e6,
    lowered: float | None = None,
) -> Scene:
    """Return the disk (slave) on its foundation (master) of Example 2, in the paper's units."""
    problem = DiskProblem(young=(young, ratio * young), poisson=poisson, force=force, penalty=penalty)
    return disk_on_foundation(problem, refine=refine, lowered=lowered, name="example-2")


def make_blocks(
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
    """Return a scene of two blocks by its name.

    `ratio` is E of the master over E of the slave, `degrees` turns the scene counter-clockwise. Free sides strain, so
    that the contact area changes. By default the penalty is 10 E/h with the mean slave segment h.
    """
    drawing = BLOCKS[name]
    p = drawing.pressure if pressure is None else pressure
    slave_x = _grid(drawing.slave_from, drawing.slave, refine)
    master_x = _grid(drawing.master_from, drawing.master, refine)
    layers = np.linspace(0.0, drawing.height, 2 * refine + 1)
    mean_segment = float(np.mean(drawing.slave)) / refine
    angle = radians(degrees)
    axis = _QUARTER_TURNS.get(degrees % 360, (cos(angle), sin(angle)))  # type: ignore[call-overload]
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


def _describe_need(name: str, option: str, value: Any) -> str:
    """Return what the option of a scene needs instead of the value; empty if the value is right."""
    if option == "sides":
        return "" if value in ("rollers", "free") else "rollers or free"
    if option == "refine":
        finest = _FINEST if name in BLOCKS else _FINEST_DISK
        is_whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        return "" if is_whole and 1 <= value <= finest else f"a whole number from 1 to {finest}"
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return "a number"
    low, high, needed = -inf, inf, "a finite number"
    if option == "poisson":
        low, high, needed = -1.0, 0.5, "Poisson's ratio above −1 and below 0.5"
    elif option in _ABOVE_ZERO:
        low, needed = 0.0, "a number > 0"
    try:
        return "" if low < float(value) < high else needed
    except OverflowError:  # No float can hold so large a whole number.
        return needed


OPTIONS = tuple(dict.fromkeys(option for name in SCENES for option in options_of(name)))
_ABOVE_ZERO = ("penalty", "young", "ratio", "pressure", "force")
_FINEST, _FINEST_DISK = 64, 4  # The finest disk has 65,000 cells.


def _grid(start: float, lengths: Sequence[float], refine: int) -> FloatArray:
    """Return the ascending coordinates of a side; the printed nodes are exact at every refinement."""
    coarse = start + np.concatenate([[0.0], np.cumsum(lengths)])
    parts = [np.linspace(a, b, refine, endpoint=False) for a, b in itertools.pairwise(coarse)]
    return np.concatenate([*parts, coarse[-1:]])
