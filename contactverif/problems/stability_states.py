"""The named states of the stability sweeps: one flat interface with smaller and smaller gaps, segments, and far away.

Each state is stored as it lies flat on the x-axis at the origin. There every product of a formulation is exact or
nearly so, and rounding does the least. Its parameters say how it is moved to where rounding matters: turned by the
rational rotation 3-4-5, then shifted. The coordinates are multiples of 5 · 2^-bits, few enough bits that the motion
rounds nothing. So the forces there are exactly those of the flat state, turned.

Rule for the next editor: names and numbers are for good. A stored report refers to a state by its name.
"""

from collections.abc import Iterator
from dataclasses import replace
from math import log2

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, random_source
from contactverif.contract.interface import Interface
from contactverif.mechanics.bodies import Rectangle
from contactverif.problems.blocks import two_blocks
from contactverif.problems.flat_states import collect

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


@collect
@random_source("contactverif_properties.stability_sweep.sweep_cases")
def stability_states() -> Iterator[Case]:
    """Return the states of an interface alone, with names (``"gap-1e-9-a"``), whose kind is one of `SWEEPS`.

    Their parameters are "gap" (the penetration, a length), "ratio" (of the shortest segment to an ordinary one),
    "offset" (a length), "turn" (2,) (legs of the rotation) and "shift" (2,) (a length each).
    """
    for mesh in _MESHES:
        sweeps = [("gap", f"gap-1e{gap}", {"gap": gap}) for gap in GAP_DECADES]
        sweeps += [("ratio", f"ratio-1e{ratio}", {"ratio": ratio}) for ratio in RATIO_DECADES]
        sweeps += [("offset", f"offset-1e{offset}", {"offset": offset}) for offset in OFFSET_DECADES]
        sweeps += [
            ("offset at a small gap", f"offset-1e{offset}-gap-1e{SMALL_GAP}", {"gap": SMALL_GAP, "offset": offset})
            for offset in OFFSET_DECADES
        ]
        sweeps.append(("all of it", "all", {"gap": SMALL_GAP, "ratio": SMALL_RATIO, "offset": FAR}))
        for kind, name, decades in sweeps:
            yield _state(kind, f"{name}-{mesh}", mesh, **decades)


@collect
@random_source("contactverif_properties.stability_stiffness.stiffness_cases")
def stability_scenes() -> Iterator[Case]:
    """Return two blocks at penalties from soft springs to far beyond what doubles can carry."""
    slave_x, master_x = _places(np.random.default_rng(3), _MOST_BITS, 1.0)
    lines = np.array([0.0, 1.0, 2.0])
    master_x = np.concatenate([[slave_x[0]], master_x[1:-1], [slave_x[-1]]])  # Both blocks are equally wide.
    mean = float(np.diff(slave_x).mean())
    for decade in STIFFNESS_DECADES:
        stiffness = 10.0**decade
        scene = two_blocks(
            Rectangle(slave_x, lines, poisson=0.25),
            Rectangle(master_x, lines - 2, poisson=0.25),
            penalty=stiffness / mean,
            pressure=_PRESSURE,
            name=f"stiffness-1e{decade}",
        )
        case = scene.case()
        parameters = {**case.parameters, **_motion(0.0), "stiffness": np.array(stiffness)}
        yield replace(case, parameters=parameters, kind="stiffness")


def _state(kind: str, name: str, mesh: str, *, gap: int = PLAIN_GAP, ratio: int = 0, offset: int | None = None) -> Case:
    """Return a state with a uniform penetration; gap, ratio and offset are decades, an offset None is 0."""
    power = 0 if offset is None else round(offset * log2(10))  # The offset becomes a power of two.
    bits = min(_MOST_BITS, _DIGITS - 1 - max(power, _SIZE_BITS))
    slave_x, master_x = _places(np.random.default_rng(_MESHES.index(mesh)), bits, 10.0**ratio)
    depth = float(_on_lattice(np.array(10.0**gap), bits))
    upper, lower = (np.column_stack([x, np.zeros_like(x)]) for x in (slave_x, master_x[::-1]))
    parameters = _motion(0.0 if offset is None else 2.0**power)
    parameters |= {"gap": np.array(depth), "ratio": np.array(10.0**ratio)}
    z = np.vstack([upper - [0.0, depth], lower]).reshape(-1)
    return Case(Interface.from_chains(upper, lower), z, _PENALTY, parameters, name=name, kind=kind)


def _motion(offset: float) -> dict[str, FloatArray]:
    """Return the parameters of a motion; the shift has a part along the turned interface and a part across it."""
    shift = offset * np.array([1.0, -0.5])
    return {"turn": np.array(TURN), "shift": shift, "offset": np.array(offset)}


def _places(random: np.random.Generator, bits: int, ratio: float) -> list[FloatArray]:
    """Return the ascending x of slave (6,) and master (5,); the middle segment of each is `ratio` long, if below 1."""
    sides = []
    for n, low, high in ((5, 0.0, 5.0), (4, -0.5, 5.5)):
        lengths, short = random.uniform(0.6, 1.4, n), n // 2
        if ratio < 1:
            lengths[short] = 0.0
        x = _on_lattice(low + np.cumsum([0.0, *lengths]) * ((high - low) / lengths.sum()), bits)
        if ratio < 1:  # The nodes behind the short segment move on by its length, which keeps them on the lattice.
            x[short + 1 :] = x[short + 1 :] + _on_lattice(np.array(ratio), bits)
        sides.append(x)
    return sides


def _on_lattice(values: FloatArray, bits: int) -> FloatArray:
    """Return the nearest multiples of 5 · 2^-bits, at least one of them for what is not 0."""
    counts = np.round(values / HYPOTENUSE * 2.0**bits)
    counts = np.where((counts == 0) & (values != 0), np.sign(values), counts)
    return counts * (HYPOTENUSE * 2.0**-bits)
