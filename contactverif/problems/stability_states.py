"""The named states of the stability sweeps: one flat interface with smaller and smaller gaps, segments, and far away.

Each state is stored as it lies flat on the x-axis at the origin. There every product of a formulation is exact or
nearly so, and rounding does the least. Its parameters say how it is moved to where rounding matters: turned by the
rational rotation 3-4-5, then shifted. The coordinates are multiples of 5 · 2^-bits, few enough bits that the motion
rounds nothing. So the forces there are exactly those of the flat state, turned.

Rule for the next editor: names and numbers are for good. A stored report refers to a state by its name.
"""

from __future__ import annotations

from functools import cache
from math import log2

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, random_source
from contactverif.contract.interface import Interface
from contactverif.mechanics.bodies import Rectangle
from contactverif.problems.blocks import two_blocks

TURN = (3.0, 4.0)  # The rotation by cos = 3/5 and sin = 4/5.
HYPOTENUSE = 5.0
GAP_DECADES = range(-1, -13, -1)  # The gap is 10 to these powers.
RATIO_DECADES = range(-1, -10, -1)
OFFSET_DECADES = range(1, 10)
STIFFNESS_DECADES = range(-2, 13)  # The ratio ε̂h/E of the solved scenes.
PLAIN_GAP, SMALL_GAP, SMALL_RATIO, FAR = -2, -6, -6, 6  # Decades. What is not swept: plain gap, ratio 1, offset 0.
SWEEPS = ("gap", "ratio", "offset", "offset at a small gap", "all of it", "stiffness")  # The kinds of the cases.

_MESHES = "ab"  # Each state comes on two meshes, named by a letter.
_DIGITS = 53  # The digits of a double.
_MOST_BITS = 43  # Finer coordinates than 2^-43 would leave none for a product.
_SIZE_BITS = 3  # The interface is shorter than 2^3.
_PENALTY = 16.0
_PRESSURE = 2.0**-10  # The pressure on the solved blocks, whose modulus E is 1.


@cache
@random_source("contactverif_properties.stability_sweep.sweep_cases")
def stability_states() -> tuple[Case, ...]:
    """Return the states of an interface alone, with names (``"gap-1e-9-a"``), whose kind is one of `SWEEPS`.

    Their parameters are "gap" (the penetration, a length), "ratio" (of the shortest segment to an ordinary one),
    "offset" (a length), "turn" (2,) (legs of the rotation) and "shift" (2,) (a length each).
    """
    states = []
    for mesh in _MESHES:
        states += [_state("gap", f"gap-1e{gap}-{mesh}", mesh, gap=gap) for gap in GAP_DECADES]
        states += [_state("ratio", f"ratio-1e{ratio}-{mesh}", mesh, ratio=ratio) for ratio in RATIO_DECADES]
        states += [_state("offset", f"offset-1e{offset}-{mesh}", mesh, offset=offset) for offset in OFFSET_DECADES]
        for offset in OFFSET_DECADES:
            name = f"offset-1e{offset}-gap-1e{SMALL_GAP}-{mesh}"
            states.append(_state("offset at a small gap", name, mesh, gap=SMALL_GAP, offset=offset))
        states.append(_state("all of it", f"all-{mesh}", mesh, gap=SMALL_GAP, ratio=SMALL_RATIO, offset=FAR))
    return tuple(states)


@cache
@random_source("contactverif_properties.stability_stiffness.stiffness_cases")
def stability_scenes() -> tuple[Case, ...]:
    """Return two blocks at penalties from soft springs to far beyond what doubles can carry."""
    slave_x, master_x = _places(np.random.default_rng(3), _MOST_BITS, 1.0)
    lines = np.array([0.0, 1.0, 2.0])
    master_x = np.concatenate([[slave_x[0]], master_x[1:-1], [slave_x[-1]]])  # Both blocks are equally wide.
    mean = float(np.diff(slave_x).mean())
    cases = []
    for decade in STIFFNESS_DECADES:
        stiffness = 10.0**decade
        scene = two_blocks(
            Rectangle(slave_x, lines, young=1.0, poisson=0.25),
            Rectangle(master_x, lines - 2, young=1.0, poisson=0.25),
            penalty=stiffness / mean,
            pressure=_PRESSURE,
            name=f"stiffness-1e{decade}",
        )
        case = scene.case()
        parameters = {**case.parameters, **_motion(0.0), "stiffness": np.array(stiffness)}
        cases.append(Case(case.interface, case.z, case.penalty, parameters, name=case.name, kind="stiffness"))
    return tuple(cases)


def _state(kind: str, name: str, mesh: str, *, gap: int = PLAIN_GAP, ratio: int = 0, offset: int | None = None) -> Case:
    """Return a state with a uniform penetration; gap, ratio and offset are decades, an offset None is 0."""
    power = 0 if offset is None else round(offset * log2(10))  # The offset becomes a power of two.
    bits = min(_MOST_BITS, _DIGITS - 1 - max(power, _SIZE_BITS))
    slave_x, master_x = _places(np.random.default_rng(_MESHES.index(mesh)), bits, 10.0**ratio)
    depth = float(_on_lattice(np.array(10.0**gap), bits))
    upper, lower = (np.column_stack([x, np.zeros_like(x)]) for x in (slave_x, master_x[::-1]))
    interface = Interface.from_chains(upper, lower)
    parameters = _motion(0.0 if offset is None else 2.0**power)
    parameters |= {"gap": np.array(depth), "ratio": np.array(10.0**ratio)}
    z = np.vstack([upper - [0.0, depth], lower]).reshape(-1)
    return Case(interface, z, _PENALTY, parameters, name=name, kind=kind)


def _motion(offset: float) -> dict[str, FloatArray]:
    """Return the parameters of a motion; the shift has a part along the turned interface and a part across it."""
    shift = offset * np.array([1.0, -0.5])
    return {"turn": np.array(TURN), "shift": shift, "offset": np.array(offset)}


def _places(random: np.random.Generator, bits: int, ratio: float) -> tuple[FloatArray, FloatArray]:
    """Return the ascending x of slave (6,) and master (5,); one segment of each is `ratio` long, if that is below 1."""
    return _line(random, 5, (0.0, 5.0), bits, ratio), _line(random, 4, (-0.5, 5.5), bits, ratio)


def _line(random: np.random.Generator, n: int, ends: tuple[float, float], bits: int, ratio: float) -> FloatArray:
    """Return n + 1 ascending coordinates between the ends, the middle segment `ratio` long."""
    lengths = random.uniform(0.6, 1.4, n)
    short = n // 2
    if ratio < 1:
        lengths[short] = 0.0
    x = _on_lattice(ends[0] + np.cumsum([0.0, *lengths]) * ((ends[1] - ends[0]) / lengths.sum()), bits)
    if ratio < 1:  # The nodes behind the short segment move on by its length, which keeps them on the lattice.
        x[short + 1 :] = x[short + 1 :] + _on_lattice(np.array(ratio), bits)
    return x


def _on_lattice(values: FloatArray, bits: int) -> FloatArray:
    """Return the nearest multiples of 5 · 2^-bits, at least one of them for what is not 0."""
    counts = np.round(values / HYPOTENUSE * 2.0**bits)
    counts = np.where((counts == 0) & (values != 0), np.sign(values), counts)
    return counts * (HYPOTENUSE * 2.0**-bits)
