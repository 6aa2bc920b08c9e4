"""Random scenes in space: two elastic blocks over grids of faces, pressed together, as `solids` has in the plane."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import TRIANGLE, Interface
from contactverif.mechanics.scene import Scene
from contactverif.problems.blocks import is_uniform
from contactverif.problems.catalogue import MODERATE_PENALTY
from contactverif.problems.flat_states import SpaceMotion
from contactverif.problems.space_blocks import space_blocks
from contactverif.strategies import samples, solids
from contactverif.strategies.surfaces import SurfacePair, matched_pairs, space_motions, surface_grids, surface_pairs

Faces = tuple[int, ...]  # The numbers of corners that a face may have.
VARIANTS = ("rigid master", "unequal materials", "punch")
MOST_CELLS = 4  # Along each side of a block.
_LAYERS = st.lists(st.sampled_from([0.5, 0.25, 1.0]), min_size=1, max_size=2)
_BOTH_LAYERS = st.tuples(_LAYERS, _LAYERS)
_POISSON = st.tuples(solids.POISSON, solids.POISSON)
_YOUNG = st.tuples(solids.MODULI, solids.MODULI)


@st.composite
def _flat_blocks(
    draw: DrawFn, pairs_on: Callable[[Faces], SearchStrategy[SurfacePair]], faces: Faces = (TRIANGLE,)
) -> Case:
    pair, layers, young, poisson = draw(pairs_on(faces)), draw(_BOTH_LAYERS), draw(_YOUNG), draw(_POISSON)
    strain, motion, seed = draw(solids.STRAINS), draw(space_motions(furthest=16)), draw(samples.SEEDS)
    return _scene(pair.lay_out(), layers, young, poisson, motion, strain=strain).case(seed=seed)


_ENDS = st.tuples(*[st.integers(1, 13)] * 2)  # Fourteenths of the slave's side at which the master begins and ends.


@st.composite
def _dead_zones(draw: DrawFn, faces: Faces = (TRIANGLE,)) -> Case:
    grids = surface_grids(most=MOST_CELLS, faces=faces, straight=True)
    slave, master, sides = draw(grids), draw(grids), np.array([draw(_ENDS), draw(_ENDS)]) / 14
    layers, young, poisson = draw(_BOTH_LAYERS), draw(_YOUNG), draw(_POISSON)
    strain, motion, seed = draw(solids.STRAINS), draw(space_motions(furthest=16)), draw(samples.SEEDS)
    low, high = sides.min(axis=1), np.maximum(sides.max(axis=1), sides.min(axis=1) + 1 / 14)
    high[0] += 1 if seed % 2 else 0  # The master goes beyond the slave on one side.
    plane = [slave.points(), samples.on_lattice(low + master.points() * (high - low))]
    nodes = [np.column_stack([points, np.zeros(len(points))]) for points in plane]
    interface = Interface.from_faces(nodes[0], slave.faces()[:, ::-1], nodes[1], master.faces())
    ends = [plane[1].min(axis=0), np.minimum(plane[1].max(axis=0), 1.0)]
    domain = np.array([[ends[i][0], ends[j][1]] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))])
    surfaces, pressure = (interface, np.vstack(plane), domain), strain * min(young)
    return _scene(surfaces, layers, young, poisson, motion, pressure=pressure).case(seed=seed)


@st.composite
def _variants(draw: DrawFn, faces: Faces = (TRIANGLE,)) -> Case:
    variant = draw(_NUMBERS)
    name = VARIANTS[variant]
    pairs = surface_pairs(same_domain=name != "punch", most=MOST_CELLS, stretched=False, faces=faces, straight=True)
    pair, layers, poisson = draw(pairs), draw(_BOTH_LAYERS), draw(_POISSON)
    ratio = 10.0 ** draw(_CONTRASTS) if name == "unequal materials" else 1.0
    strain, motion, seed = draw(solids.STRAINS), draw(space_motions(furthest=16)), draw(samples.SEEDS)
    pressure = strain * min(1.0, ratio)
    scene = _scene(
        pair.lay_out(), layers, (1.0, ratio), poisson, motion, pressure=pressure, rigid=name == "rigid master"
    )
    return replace(scene, facts={**scene.facts, "variant": np.array(float(variant))}).case(seed=seed)


_NUMBERS = st.integers(0, len(VARIANTS) - 1)
_CONTRASTS = st.integers(-6, 6)
# Thirteenths of the approach over the side, along both axes: all of the interface is in contact, or a part.
_CLOSED_SLOPES = st.tuples(*[st.sampled_from([1, 2, 3, -1, -2, -3])] * 2)
_SLOPES = st.tuples(*[st.sampled_from([1, 2, 3, -5, 8, 13, -16, 20])] * 2)
_BUMPS = st.sampled_from([0.0, 0.03, 0.06])


@st.composite
def _tilted_blocks(
    draw: DrawFn, slopes: SearchStrategy[tuple[int, ...]], most: int, faces: Faces = (TRIANGLE,)
) -> Case:
    pairs = surface_pairs(same_domain=False, most=most, stretched=False, faces=faces, straight=True)
    pair, layers, young, poisson = draw(pairs), draw(_BOTH_LAYERS), draw(_YOUNG), draw(_POISSON)
    exponent, motion, seed = draw(solids.TILTED_STRAINS), draw(space_motions(furthest=16)), draw(samples.SEEDS)
    tilt, stiff, bump = draw(slopes), draw(solids.STIFF), draw(_BUMPS)
    strain = 2.0 ** -min(exponent, solids.SMALLEST_STRAIN.get(stiff, exponent))
    load: dict[str, Any] = {"strain": strain, "slopes": tilt, "stiff": stiff, "bump": bump}
    return _scene(pair.lay_out(), layers, young, poisson, motion, **load).case(seed=seed)


def _pairs(faces: Faces) -> SearchStrategy[SurfacePair]:
    return surface_pairs(most=MOST_CELLS, stretched=False, faces=faces, straight=True)


_uniform = partial(solids.on_scene, fits=is_uniform, needs=solids.UNIFORM)
space_block_cases = _uniform(partial(_flat_blocks, _pairs), "space_solids.space_block_cases")
space_matched_cases = _uniform(
    partial(_flat_blocks, partial(matched_pairs, stretched=False)), "space_solids.space_matched_cases"
)
space_dead_zone_cases = _uniform(_dead_zones, "space_solids.space_dead_zone_cases")
space_variant_cases = _uniform(_variants, "space_solids.space_variant_cases")
space_solid_cases = solids.on_scene(partial(_tilted_blocks, _SLOPES, 3), "space_solids.space_solid_cases")
space_closed_cases = solids.on_scene(partial(_tilted_blocks, _CLOSED_SLOPES, 3), "space_solids.space_closed_cases")
# Few points, so that few of them are near a kink.
space_smooth_cases = solids.on_scene(partial(_tilted_blocks, _CLOSED_SLOPES, 2), "space_solids.space_smooth_cases")


def _scene(
    surfaces: tuple[Interface, FloatArray, FloatArray],
    layers: tuple[list[float], list[float]],
    young: tuple[float, float],
    poisson: tuple[float, float],
    motion: SpaceMotion,
    *,
    strain: float = 0.0,
    pressure: float | None = None,
    slopes: tuple[int, ...] | None = None,
    bump: float = 0.0,
    stiff: float = MODERATE_PENALTY,
    rigid: bool = False,
) -> Scene:
    """Return the two blocks, pressed by an approach, or by a pressure: on a larger master no approach is uniform."""
    interface, plane, domain = surfaces
    if slopes is not None:  # Off the lattice no slave node lies over a master edge.
        plane = plane.copy()
        plane[: interface.n_slave_nodes] += np.array([3 / 7, 5 / 11]) / 8
        heights = bump * np.cos(2.5 * plane[:, 0]) * np.cos(2 * plane[:, 1])
        interface = interface.at(np.column_stack([plane, heights]))
    approach = strain * (sum(layers[0]) + sum(layers[1]))
    if pressure is None and slopes is None and (np.abs(plane) > np.abs(domain).max(axis=0)).any():
        pressure = strain * min(young)
    mean = float(interface.slave.measures(interface.nodes).mean()) ** 0.5
    return space_blocks(
        interface,
        plane,
        domain,
        layers=layers,
        materials=((young[0], poisson[0]), (young[1], poisson[1])),
        penalty=stiff * (young[0] if rigid else min(young)) / mean / motion.scale,
        pressure=pressure,
        approach=approach if pressure is None else None,
        tilt=(approach * slopes[0] / 13, approach * slopes[1] / 13) if slopes else (0.0, 0.0),
        rigid_master=rigid,
        motion=motion,
    )
