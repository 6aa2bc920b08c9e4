"""Two blocks in space in lists: contrasts of stiffness and mesh, overlaps that vanish, and no load at all.

They are the scenes of `block_scenes` over grids of rectangles, or of triangles. The pressure is uniform in all but the
last.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from contactverif.contract.case import Case
from contactverif.mechanics.scene import Scene
from contactverif.problems.catalogue import MODERATE_PENALTY
from contactverif.problems.flat_states import BY_THIRDS, SpaceMotion, collect_on_faces, rotation
from contactverif.problems.space_blocks import facing_grids, space_blocks
from contactverif.problems.stability_states import STIFFNESS_DECADES

Lines = Sequence[float]
SIDE, _STRAIN = 12.0, 2.0**-6  # The side of a square, and the pressure over the softer body's E.
_RATIOS = ("1e-6", "1", "1e6")  # E of the master over E of the slave.
_INCLINED = SpaceMotion((4, 1, -2, 1), (1, -2, 3))
_FINE, _COARSE = np.linspace(0.0, SIDE, 7).tolist(), [0.0, 7.0, SIDE]


def _blocks(corners: int, slave: Lines, master: Lines, ratio: float, *, stiff: float, **others: Any) -> Scene:
    """Return two blocks over grids with the same lines along both axes; ε̂ is in E/h of the softer body."""
    interface, plane = facing_grids((np.array(slave),) * 2, (np.array(master),) * 2, corners)
    low, high = max(slave[0], master[0]), min(slave[-1], master[-1])
    penalty = stiff * min(1.0, ratio) * (len(slave) - 1) / (slave[-1] - slave[0])
    load = {"pressure": _STRAIN * min(1.0, ratio)} if "approach" not in others else {}
    return space_blocks(
        interface,
        plane,
        np.array([[low, low], [high, low], [high, high], [low, high]]),
        layers=([3.0, 3.0], [3.0, 3.0]),
        materials=((1.0, 0.3), (ratio, 0.2)),
        penalty=penalty,
        **load | others,
    )


def _name(name: str, scene: Scene) -> Case:
    return replace(scene, name=name).case()


@collect_on_faces
def stiff_space_scenes(corners: int) -> Iterator[Case]:
    """Return blocks whose springs are up to 1e10 times as stiff as the softer one; E of the other is 1 to 1e6 times."""
    for stiff, ratio in product(("1e4", "1e10"), _RATIOS):
        scene = _blocks(corners, [0.0, 3.0, 8.0, SIDE], [0.0, 5.0, SIDE], float(ratio), stiff=float(stiff))
        yield _name(f"ε̂h/E = {stiff}, E ratio {ratio}", scene)


@collect_on_faces
def contrast_space_scenes(corners: int) -> Iterator[Case]:
    """Return a fine block and a coarse one, each as the slave, the stiffer one or the softer one, at two penalties."""
    for (mesh, (slave, master)), ratio, (label, stiff) in product(
        {"6 on 2": (_FINE, _COARSE), "2 on 6": (_COARSE, _FINE)}.items(),
        _RATIOS,
        (("10 E/h", MODERATE_PENALTY), ("1e5 E/h", 1e5)),
    ):
        yield _name(f"{mesh}, E ratio {ratio}, ε̂ = {label}", _blocks(corners, slave, master, float(ratio), stiff=stiff))


@collect_on_faces
def stability_space_scenes(corners: int) -> Iterator[Case]:
    """Return two blocks at penalties from soft springs to far beyond what doubles can carry.

    The parameters "turn" (4,), a quaternion, and "shift" (3,) are a motion that rounds no coordinate.
    """
    step = rotation(BY_THIRDS)[1] * 2.0**-43
    slave, master = (
        np.round(np.array(lines) / step) * step for lines in ([0.0, 2.7, 5.9, 8.3, SIDE], [0.0, 4.6, 7.1, SIDE])
    )
    motion = {"turn": np.array(BY_THIRDS, dtype=np.float64), "shift": np.zeros(3)}
    for decade in STIFFNESS_DECADES[2::3]:
        stiff = 10.0**decade
        scene = _blocks(corners, slave.tolist(), master.tolist(), 1.0, stiff=stiff, pressure=2.0**-10)
        facts = {**scene.facts, **motion, "stiffness": np.array(stiff)}
        yield _name(f"stiffness-1e{decade}", replace(scene, facts=facts))


@collect_on_faces
def vanishing_space_scenes(corners: int) -> Iterator[Case]:
    """Return blocks whose master covers 1e-1 to 1e-12 of the width of the last slave faces, upright and inclined."""
    for exponent, motion in product((1, 2, 4, 6, 9, 12), (SpaceMotion(), _INCLINED)):
        share = 10.0**-exponent
        scene = _blocks(
            corners, [0.0, 2.0, 5.0, 8.0], [-1.0, 1.5, 3.0, 5 + 3 * share], 1.0, stiff=MODERATE_PENALTY, motion=motion
        )
        facts = {**scene.facts, "share": np.array(share)}
        name = f"overlap 1e-{exponent}{', inclined' if motion is _INCLINED else ''}"
        yield _name(name, replace(scene, facts=facts))


@collect_on_faces
def unloaded_space_scenes(corners: int) -> Iterator[Case]:
    """Return blocks that touch with no load, started in touch, pushed in or lifted, upright and inclined."""
    slave, master = [0.0, 2.0, 4.0, 8.0, SIDE], [0.0, 3.0, 6.0, 9.0, SIDE]
    for (start, lowered), (label, motion), (way, load) in product(
        {"touching": 0.0, "pushed in": 2.0**-4, "lifted": -(2.0**-4)}.items(),
        {"": SpaceMotion(), ", inclined": _INCLINED}.items(),
        {"free": "pressure", "held": "approach"}.items(),
    ):
        others: dict[str, Any] = {load: 0.0, "lowered": lowered, "motion": motion}
        yield _name(f"{way}, {start}{label}", _blocks(corners, slave, master, 3.0, stiff=MODERATE_PENALTY, **others))
