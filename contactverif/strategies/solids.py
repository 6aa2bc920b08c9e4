"""Random scenes: two elastic blocks pressed together, for the solved patch test, its variants, and Newton's method.

Lengths are small integers, E and scales powers of two times small integers; all shrink to one cell a block, E = 1,
ν = 0, no motion. Penalties come as ε̂ h / E, so that "moderate" means the same for every mesh.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import accumulate, takewhile
from math import ldexp

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, random_source
from contactverif.mechanics.bodies import Placing, Rectangle
from contactverif.mechanics.scene import Scene, has_bodies
from contactverif.problems.blocks import is_uniform, two_blocks
from contactverif.problems.catalogue import MODERATE_PENALTY
from contactverif.problems.flat_states import overhangs
from contactverif.strategies.samples import SEEDS, Motion, ends_of, lengths, motions, repeat_cyclically

UNIFORM = "a known uniform pressure"
VARIANTS = ("rigid master", "unequal materials", "inclined", "sliding", "punch")
INCLINATIONS = (1.0, 17.3, 45.0, 90.0, 179.0)
POSITIONS = 200  # The number of positions of a punch that slides over one master segment.
_LAYERS = st.lists(st.integers(1, 4), min_size=1, max_size=3)
POISSON = st.sampled_from([0.0, 0.25, 0.3, 0.125, 0.375, 0.4375])
_CLOSED_TILTS = st.sampled_from([1, 2, 3, 4, 5, 6])  # Thirteenths of the approach: all of the interface is in contact.
_TILTS = st.sampled_from([1, 2, 3, 4, 5, 6, 13, 16, 20, 26])  # From 13 on contact ends within the interface.
# Stiffer springs get a larger approach, so that gaps are far longer than the steps that Newton's method is judged by.
SMALLEST_STRAIN = {10.0: 6, 64.0: 5}  # The exponents of the smallest strain 2^-e.
STRAINS = st.integers(3, 8).map(lambda e: 2.0**-e)
_OVERHANGS = st.sampled_from([(1, 0), (0, 1), (1, 1), (1, -1), (-1, 1)])  # Left and right; −1: the master overhangs.
_PARTS = 8  # A master may end at this many parts of a slave segment.
_PART = st.sampled_from([4, 2, 6, 1, 3, 5, 7])
_WIDER = st.integers(1, 4)
_VARIANTS = st.integers(0, len(VARIANTS) - 1)
_SEVENTHS = st.integers(1, 6)
# Distributed stiffness ε̂ h / E of tilted blocks and of those with a dead zone.
STIFF, _DEAD_STIFF = st.sampled_from([1.0, 10.0, 0.125, 64.0]), st.sampled_from([MODERATE_PENALTY, 1.0, 100.0])
TILTED_STRAINS = st.integers(5, 8)  # The exponents of a strain 2^-e.
MODULI = st.builds(ldexp, st.integers(1, 8).map(float), st.integers(-3, 3))


@cache
def _widths() -> SearchStrategy[list[float]]:
    plain = lengths(graded=False)
    wide = st.lists(st.builds(ldexp, st.integers(1, 7).map(float), st.integers(-5, 3)), min_size=1, max_size=6)
    return st.one_of(plain, plain, plain, plain, wide)


def on_scene(
    cases: Callable[..., SearchStrategy[Case]], name: str, fits: Callable[[Case], bool] = has_bodies, needs: str = ""
) -> Callable[..., SearchStrategy[Case] | None]:
    """Return a function that makes these cases, with a stored name; given a scene, that scene alone if it fits.

    In space it takes the numbers of corners that a face may have, too.
    """

    def make(scene: Case | None = None, *faces: tuple[int, ...]) -> SearchStrategy[Case] | None:
        if scene is None:
            return cases(*faces)
        return st.just(scene) if has_bodies(scene) and fits(scene) else None

    return random_source(f"contactverif.strategies.{name}", needs)(make)


@st.composite
def _two_blocks(draw: DrawFn) -> Case:
    """Draw two blocks of equal width under an imposed approach: a uniform pressure that is known exactly."""
    slave, master = draw(_widths()), draw(_widths())
    layers = draw(_LAYERS), draw(_LAYERS)
    young, poisson = (draw(MODULI), draw(MODULI)), (draw(POISSON), draw(POISSON))
    strain, motion, seed = draw(STRAINS), draw(motions(furthest=16)), draw(SEEDS)
    x = ends_of(slave)
    return _scene(x, _cut(master, x[-1]), layers, young, poisson, motion, strain=strain).case(seed=seed)


@st.composite
def _variants(draw: DrawFn) -> Case:
    """Draw scenes as `_two_blocks` does, the patch test's variants: "variant" is an index into VARIANTS."""
    variant = draw(_VARIANTS)
    slave, master = draw(lengths(graded=False)), draw(lengths(graded=False))
    layers = draw(_LAYERS), draw(_LAYERS)
    strain, poisson, seed = draw(STRAINS), (draw(POISSON), draw(POISSON)), draw(SEEDS)
    name, beside = VARIANTS[variant], (0, 0)
    ratio = 10.0 ** draw(st.integers(-6, 6)) if name == "unequal materials" else 1.0
    angle = np.radians(draw(st.sampled_from(INCLINATIONS)) if name == "inclined" else 0.0)
    position = draw(st.integers(0, POSITIONS - 1)) if name == "sliding" else 0
    if name in ("sliding", "punch"):
        beside = draw(_WIDER), draw(_WIDER)
    x = ends_of(slave)
    master_x = _cut(master, x[-1] + sum(beside)) - beside[0]
    # A thin stiff body on a soft one bends at nearly no force, and its stress would be roundoff: height ≥ width/4.
    unit = float(x[-1]) / 4 if ratio != 1.0 else 1.0
    if position:
        x = x - position / POSITIONS * min(float(master_x[1] - master_x[0]), beside[0])
    scene = _scene(
        x,
        master_x,
        tuple([unit * height for height in side] for side in layers),
        (1.0, ratio),
        poisson,
        Placing((float(np.cos(angle)), float(np.sin(angle)))),
        pressure=strain * min(1.0, ratio),
        rigid_master=name == "rigid master",
    )
    return replace(scene, facts={**scene.facts, "variant": np.array(float(variant))}).case(seed=seed)


@st.composite
def _dead_zones(draw: DrawFn) -> Case:
    """Draw scenes as `_two_blocks` does whose slave overhangs its master inside a segment, on one side or both."""
    x, (left, right) = ends_of(draw(_widths())), draw(_OVERHANGS)
    segments = np.diff(x)
    first = draw(st.integers(0, len(segments) - 1)) if left > 0 else 0
    last = draw(st.integers(first, len(segments) - 1)) if right > 0 else len(segments) - 1
    parts = 2 * _PARTS if first == last else _PARTS  # Both ends of the master may lie in the same segment.
    begin = x[first] + (draw(_PART) / parts * segments[first] if left > 0 else left * draw(_WIDER))
    end = x[last + 1] - (draw(_PART) / parts * segments[last] if right > 0 else right * draw(_WIDER))
    master = draw(_widths())
    unit = float(x[-1]) / 4  # a thin body bends at nearly no force, and its stress would be roundoff
    layers = tuple([unit * height for height in draw(_LAYERS)] for _ in range(2))
    young, poisson = (draw(MODULI), draw(MODULI)), (draw(POISSON), draw(POISSON))
    strain, motion, seed = draw(STRAINS), draw(motions(furthest=16)), draw(SEEDS)
    stiff = draw(_DEAD_STIFF)
    master_x = begin + _cut(master, float(end - begin))
    pressure = strain * min(young)
    return _scene(x, master_x, layers, young, poisson, motion, pressure=pressure, stiff=stiff).case(seed=seed)


@st.composite
def _tilted_blocks(draw: DrawFn, tilts: SearchStrategy[int]) -> Case:
    """Draw a tilted block on a wider one, off the lattice: pressure and gaps vary, and few states are at a kink."""
    slave, master = draw(lengths(graded=False)), draw(lengths(graded=False))
    layers = draw(_LAYERS), draw(_LAYERS)
    young, poisson = (draw(MODULI), draw(MODULI)), (draw(POISSON), draw(POISSON))
    exponent, motion, seed = draw(TILTED_STRAINS), draw(motions(furthest=16)), draw(SEEDS)
    tilt, sevenths = draw(tilts), draw(_SEVENTHS)
    stiff = draw(STIFF)
    strain = 2.0 ** -min(exponent, SMALLEST_STRAIN.get(stiff, exponent))
    x = ends_of(slave)
    # The slave's nodes are moved by different sevenths and elevenths, so that no two of its points fall on one kink.
    moved = x + sevenths / 7 + repeat_cyclically([0.0, 1 / 11, 3 / 11, 2 / 11], len(x)) / 4
    master_x = _cut(master, x[-1] + 4) - 1
    scene = _scene(moved, master_x, layers, young, poisson, motion, strain=strain, tilt=tilt / 13, stiff=stiff)
    return scene.case(seed=seed)


def _is_covered(scene: Case) -> bool:
    return is_uniform(scene) and not overhangs(scene)


block_cases = on_scene(_two_blocks, "solids.block_cases", _is_covered, UNIFORM)
variant_cases = on_scene(_variants, "solids.variant_cases", _is_covered, UNIFORM)
dead_zone_cases = on_scene(
    _dead_zones,
    "solids.dead_zone_cases",
    lambda scene: is_uniform(scene) and overhangs(scene),
    "a known pressure and an overhang",
)
solid_cases = on_scene(partial(_tilted_blocks, _TILTS), "solids.solid_cases")
# All of the interface is in contact: for what has nothing to do with opening.
closed_cases = on_scene(partial(_tilted_blocks, _CLOSED_TILTS), "solids.closed_cases")


def _scene(
    slave_x: FloatArray,
    master_x: FloatArray,
    layers: Sequence[Sequence[float]],
    young: tuple[float, float],
    poisson: tuple[float, float],
    placing: Motion | Placing,
    *,
    strain: float = 0.0,
    pressure: float | None = None,
    tilt: float = 0.0,
    stiff: float = MODERATE_PENALTY,
    rigid_master: bool = False,
) -> Scene:
    """Return the two blocks; `strain` and `tilt` impose an approach of the slave's top, unless a pressure is given."""
    if isinstance(placing, Motion):
        placing = Placing(tuple(placing.direction.tolist()), placing.shift, placing.scale)
    slave_y, master_y = ends_of(layers[0]), ends_of(layers[1])
    approach = None if pressure is not None else strain * (slave_y[-1] + master_y[-1])
    segment = float(slave_x[-1] - slave_x[0]) / (len(slave_x) - 1) * placing.scale
    return two_blocks(
        Rectangle(slave_x, slave_y, young=young[0], poisson=poisson[0]),
        Rectangle(master_x, master_y - master_y[-1], young=young[1], poisson=poisson[1]),
        penalty=stiff * (young[0] if rigid_master else min(young)) / segment,
        pressure=pressure,
        approach=approach,
        tilt=tilt * (approach or 0.0),
        rigid_master=rigid_master,
        placing=placing,
    )


def _cut(segments: Sequence[float], end: float) -> FloatArray:
    """Return grid lines from 0 to `end`: what the segments do not cover is one more, and what is too much is cut."""
    return np.array([0.0, *takewhile(lambda x: x < end, accumulate(segments)), end])
