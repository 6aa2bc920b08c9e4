"""Interfaces in 3-D: a grid of triangles or quadrilaterals over another one, larger and turned, or on the same square.

The slave lies over the square [0, 1]², and every coordinate of the grids is a multiple of 2^-20, so that oracles in
rationals see the numbers that a formulation sees. A stretch multiplies all coordinates across by a power of two. All
shrink to one square on one square, each cut in two, without any motion.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Self

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case, random_source
from contactverif.contract.interface import TRIANGLE, Interface, Surface
from contactverif.problems.flat_states import SpaceMotion
from contactverif.strategies import samples
from contactverif.strategies.given_interface import given_surface_states, least_height
from contactverif.strategies.translations import FINENESS, FURTHEST


@cache
def space_motions(*, furthest: int = 64, exponents: int = 20) -> SearchStrategy[SpaceMotion]:
    """Return rest or any rigid motion, with translations up to `furthest` and scales 2^±`exponents`."""
    part, place = st.integers(-4, 4), st.integers(-furthest, furthest)
    quaternion = st.tuples(st.integers(1, 5), part, part, part)
    exponent = st.one_of(st.just(0), st.integers(-exponents, exponents))
    motions = st.builds(SpaceMotion, quaternion, st.tuples(place, place, place), exponent)
    return st.one_of(st.just(SpaceMotion()), motions)


MOST_CELLS = 6  # The most cells along a side.
FURTHEST_MOVE = 14  # The largest move in 64ths of a cell; at 16 a triangle could lose its area.


@dataclass(frozen=True, slots=True)
class SurfaceGrid:
    """A grid on the unit square."""

    columns: int
    rows: int
    moves: Sequence[int]  # The moves of the nodes along and across in 64ths of a cell, dealt out in turn.
    diagonals: Sequence[int]  # The diagonal of each cell, 0 or 1, dealt out in turn.
    corners: int = TRIANGLE  # The corners of a face: 4 leaves the cells whole.
    straight: bool = False  # Whole lines of nodes move, so that all cells are rectangles.

    def points(self) -> FloatArray:
        """Return the nodes (n, 2); those on the border stay on it."""
        shape = (self.columns + 1, self.rows + 1)
        move = samples.repeat_cyclically(self.moves, 2 * shape[0] * shape[1]).reshape(*shape, 2) / 64
        if self.straight:
            move[..., 0], move[..., 1] = move[:, :1, 0], move[:1, :, 1]
        move[[0, -1], :, 0] = move[:, [0, -1], 1] = 0.0
        place = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1) + move
        return samples.on_lattice((place / [self.columns, self.rows]).reshape(-1, 2))

    @property
    def choices(self) -> IntArray:
        """The diagonal of each cell (n_cells,)."""
        return samples.repeat_cyclically(self.diagonals, self.columns * self.rows).astype(np.int64)

    def with_ring(self) -> Self:
        """Return a grid with one more cell on each side, in which the cells of this grid keep their diagonals."""
        choices = np.pad(self.choices.reshape(self.columns, self.rows), 1).reshape(-1)
        return replace(self, columns=self.columns + 2, rows=self.rows + 2, diagonals=choices.tolist())

    def faces(self) -> IntArray:
        """Return the faces (n_faces, corners), counter-clockwise in the plane."""
        n = np.arange((self.columns + 1) * (self.rows + 1)).reshape(self.columns + 1, -1)
        cells = np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]], axis=-1).reshape(-1, 4)
        if self.corners != TRIANGLE:
            return cells
        a, b, c, d = cells.T
        choice = self.choices[:, None] == 0
        first = np.where(choice, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
        second = np.where(choice, np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
        return np.stack([first, second], axis=1).reshape(-1, 3)


@cache
def surface_grids(
    *, most: int = MOST_CELLS, faces: tuple[int, ...] = (TRIANGLE,), straight: bool = False
) -> SearchStrategy[SurfaceGrid]:
    """Return grids of 1 × 1 to `most` × `most` cells; they shrink to one cell that is cut along its first diagonal.

    `faces` are the numbers of corners that a face may have. Quadrilaterals are rectangles if they are `straight`.
    """
    cells = st.integers(1, most)
    moves = st.lists(st.integers(-FURTHEST_MOVE, FURTHEST_MOVE), min_size=1, max_size=12)
    diagonals = st.lists(st.integers(0, 1), min_size=1, max_size=8)
    if faces == (TRIANGLE,):
        return st.builds(SurfaceGrid, cells, cells, moves, diagonals)
    kinds = st.sampled_from([(corners, straight and corners != TRIANGLE) for corners in faces])
    return st.builds(
        lambda kind, columns, rows, moves, diagonals: SurfaceGrid(columns, rows, moves, diagonals, *kind),
        *(kinds, cells, cells, moves, diagonals),
    )


_SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
_STRETCHES = st.sampled_from([0] * 7 + [1, 2, 4, 6, 8, 12])  # Exponents of the aspect ratio.


@dataclass(frozen=True, slots=True)
class SurfacePair:
    """A slave grid and a master grid, at rest in the plane z = 0."""

    slave: SurfaceGrid
    master: SurfaceGrid
    same_domain: bool  # The master covers the slave's square exactly; else [−1/2, 3/2]².
    degrees: int  # The turn of a larger master about its middle.
    stretch: int  # Coordinates across are multiplied by 2^-stretch.
    shuffle: int  # The numbering of nodes and faces; 0 for that of the grids.
    matched: bool = False  # A larger master has the slave's nodes and a ring of others, so that nodes lie on nodes.

    def lay_out(self) -> tuple[Interface, FloatArray, FloatArray]:
        """Return the interface, the plane coordinates (n_nodes, 2) of its nodes, and the corners of the slave's domain.

        The slave's body is above, so that its faces are seen from below.
        """
        factors = np.array([1.0, 2.0**-self.stretch])
        slave = self.slave.points()
        plane = np.vstack([slave, self._master_points(slave)]) * factors
        faces = [self.slave.faces()[:, ::-1], self.master.faces() + len(slave)]
        if self.shuffle:
            random, n_slave = np.random.default_rng(self.shuffle), len(slave)
            order = np.concatenate([random.permutation(n_slave), n_slave + random.permutation(len(plane) - n_slave)])
            number = np.argsort(order)  # The new number of each node.
            plane = plane[order]
            faces = [
                np.array([np.roll(row, int(random.integers(len(row)))) for row in random.permutation(number[side])])
                for side in faces
            ]
        nodes = np.column_stack([plane, np.zeros(len(plane))])
        return Interface(nodes, Surface(faces[0]), Surface(faces[1])), plane, _SQUARE * factors

    def _master_points(self, slave: FloatArray) -> FloatArray:
        if self.matched and self.same_domain:
            return slave
        if self.matched:
            columns = slave.reshape(self.slave.columns + 1, -1, 2)
            points = np.pad(columns, ((1, 1), (1, 1), (0, 0)), mode="edge")
            points[[0, -1], :, 0] = [[-0.5], [1.5]]
            points[:, [0, -1], 1] = [-0.5, 1.5]
            return points.reshape(-1, 2)
        points = self.master.points()
        if self.same_domain:
            return points
        angle = np.deg2rad(self.degrees)
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        return samples.on_lattice((2 * points - 1) @ turn + 0.5)


@cache
def surface_pairs(
    *,
    same_domain: bool | None = None,
    most: int = 6,
    stretched: bool = True,
    faces: tuple[int, ...] = (TRIANGLE,),
    straight: bool = False,
    skewed: bool = False,
) -> SearchStrategy[SurfacePair]:
    """Return pairs of grids; unless `same_domain` says which, half of them share their domain and half do not.

    `faces` and `straight` are those of `surface_grids`. A larger master of straight quadrilaterals turns by a multiple
    of 90°, so that they stay rectangles: the border of a slave may cut those, and triangles. If they may be `skewed`,
    half of the pairs have quadrilaterals of any convex shape instead, turned by any angle.
    """
    same = st.booleans().map(lambda larger: not larger) if same_domain is None else st.just(same_domain)
    grids = surface_grids(most=most, faces=faces, straight=straight)
    stretches = _STRETCHES if stretched else st.just(0)

    def pair(
        slave: SurfaceGrid, master: SurfaceGrid, same: bool, degrees: int, stretch: int, shuffle: int
    ) -> SurfacePair:
        if skewed and degrees % 2:  # No draw of its own, so that triangles are those that they would be without.
            slave, master = replace(slave, straight=False), replace(master, straight=False)
        return SurfacePair(slave, master, same, degrees // 90 * 90 if master.straight else degrees, stretch, shuffle)

    return st.builds(pair, grids, grids, same, st.integers(0, 359), stretches, samples.SHUFFLES)


@cache
def matched_pairs(faces: tuple[int, ...], *, stretched: bool = True) -> SearchStrategy[SurfacePair]:
    """Return pairs in which each master node over the slave lies on a slave node."""

    def pair(grid: SurfaceGrid, larger: bool, stretch: int, number: int) -> SurfacePair:
        return SurfacePair(grid, grid.with_ring() if larger else grid, not larger, 0, stretch, number, matched=True)

    grids = surface_grids(faces=faces, straight=True)
    return st.builds(pair, grids, st.booleans(), _STRETCHES if stretched else st.just(0), samples.SHUFFLES)


_QUARTERS = st.integers(1, 8)  # The penetration of the middle, in quarters of a unit of the least height of a face.


@random_source("contactverif.strategies.surfaces.uniform_surfaces.flat_surface_cases")
@samples.on_own_meshes
def flat_surface_cases(draw: DrawFn, faces: tuple[int, ...] = (TRIANGLE,)) -> Case:
    """Return cases of uniform penetration in space; the master covers the slave.

    Their parameters are "penetration" (|g| > 0, a length), "plane" (n_nodes, 2) (coordinates of the nodes in the plane
    of the interface, before any rigid motion), "domain" (4, 2) (the corners of the slave's domain there) and "normal"
    (3,) (the unit vector out of the master). Half of the quadrilaterals are rectangles. There are no cases on an
    interface of the user.
    """
    return _penetrate_uniformly(draw, surface_pairs(faces=faces, straight=True, skewed=True))


@random_source("contactverif.strategies.surfaces.uniform_surfaces.matched_surface_cases")
@samples.on_own_meshes
def matched_surface_cases(draw: DrawFn, faces: tuple[int, ...] = (TRIANGLE,)) -> Case:
    """Return cases as `flat_surface_cases` does, with each master node over the slave on a slave node."""
    return _penetrate_uniformly(draw, matched_pairs(faces))


@random_source("contactverif.strategies.surfaces.uniform_surfaces.overhung_surface_cases")
@samples.on_own_meshes
def overhung_surface_cases(draw: DrawFn, faces: tuple[int, ...] = (TRIANGLE,)) -> Case:
    """Return cases as `flat_surface_cases` does, with a master that goes beyond the slave on all sides."""
    return _penetrate_uniformly(draw, surface_pairs(same_domain=False, faces=faces, straight=True))


def _penetrate_uniformly(draw: DrawFn, pairs: SearchStrategy[SurfacePair]) -> Case:
    pair = draw(pairs)
    quarters, unit = draw(_QUARTERS), draw(samples.depth_units())
    motion, penalty, seed = draw(space_motions()), draw(samples.PENALTIES), draw(samples.SEEDS)
    interface, plane, domain = pair.lay_out()
    penetration = quarters / 4 * unit * 2.0 ** np.floor(np.log2(least_height(interface, interface.nodes)))
    current = interface.nodes.copy()
    current[: interface.n_slave_nodes, 2] -= penetration
    parameters = {
        "penetration": np.array(penetration * motion.scale),
        "plane": plane * motion.scale,
        "domain": domain * motion.scale,
        "normal": motion.normal,
    }
    reference = interface.at(interface.nodes * motion.scale)
    return Case(reference, motion(current).reshape(-1), penalty, parameters, seed)


_SLOPES = st.sampled_from([0.0, 0.125, -0.125, 0.375, -0.375, 1.0, -1.0])
_FINENESS = FINENESS + 1  # One bit more: far away all 53 are full, so that the middle of an edge is rounded.
_PLACES = st.integers(-(2**FURTHEST) + 2**6, 2**FURTHEST - 2**6)
_WARPS = st.lists(st.integers(-4, 4), min_size=1, max_size=9)  # Moves across in sixteenths of the least height.


@random_source("contactverif.strategies.surfaces.tilted_surfaces.surface_cases")
def surface_cases(
    interface: Interface | None = None, faces: tuple[int, ...] = (TRIANGLE,)
) -> SearchStrategy[Case] | None:
    """Return tilted and warped states, of which half have surfaces on the same domain, with all its ties.

    Given an interface, states of that one.
    """
    if interface is not None:
        return given_surface_states(interface, smooth=False)
    return _tilted_states(surface_pairs(faces=faces), space_motions(), smooth=False)


_GRADES = st.integers(-8, 8)  # Sixteenths.
_WAYS = st.sampled_from([(0.25, 0.0), (0.0, 0.25), (-0.25, 0.0), (0.0, -0.25), (0.1875, 0.125), (-0.125, 0.1875)])


@random_source("contactverif.strategies.surfaces.sliding_surface_cases")
@samples.on_own_meshes
def sliding_surface_cases(draw: DrawFn, faces: tuple[int, ...] = (TRIANGLE,)) -> Case:
    """Return plane, tilted slaves that slide over the edges of a flat, larger master, and penetrate it everywhere.

    The parameter "path" (n_unknowns,) holds the way of each node, a length each, as in `translations.sliding_cases`.
    """
    pair = draw(surface_pairs(same_domain=False, most=3, stretched=False, faces=faces))
    grades, depth, way = (draw(_GRADES), draw(_GRADES)), draw(_QUARTERS), draw(_WAYS)
    motion, penalty, seed = draw(space_motions()), draw(samples.PENALTIES), draw(samples.SEEDS)
    interface, plane, domain = pair.lay_out()
    current, slave = interface.nodes.copy(), np.arange(interface.n_nodes) < interface.n_slave_nodes
    rise = (plane[slave] - domain.mean(axis=0)) @ np.array(grades) / 16
    current[slave, 2] += rise - rise.max() - depth / 64
    z = motion(current).reshape(-1)
    path = motion(current + np.outer(slave, [*way, 0.0])).reshape(-1) - z
    return Case(interface.at(interface.nodes * motion.scale), z, penalty, {"path": path}, seed)


@random_source("contactverif.strategies.surfaces.tilted_surfaces.smooth_surface_cases")
def smooth_surface_cases(
    interface: Interface | None = None, faces: tuple[int, ...] = (TRIANGLE,)
) -> SearchStrategy[Case] | None:
    """Return cases as `surface_cases` does, off the lattice, over a larger master: for derivatives."""
    if interface is not None:
        return given_surface_states(interface, smooth=True)
    pairs = surface_pairs(same_domain=False, stretched=False, faces=faces)
    return _tilted_states(pairs, space_motions(), smooth=True)


@random_source("contactverif.strategies.surfaces.tilted_surfaces.translated_surface_cases")
@samples.on_own_meshes
def translated_surface_cases(draw: DrawFn, faces: tuple[int, ...] = (TRIANGLE,)) -> Case:
    """Return turned states near the origin that a translation by the parameter "shift" (3,) moves exactly.

    State and reference are rounded to multiples of 2^-33, and the translation goes up to 2^20.
    """
    pairs = surface_pairs(same_domain=False, stretched=False, most=3, faces=faces)
    case = draw(_tilted_states(pairs, space_motions(furthest=0, exponents=0), smooth=True))
    shift = np.array([draw(_PLACES), draw(_PLACES), draw(_PLACES)], dtype=np.float64)
    nodes, z = (samples.on_lattice(values, _FINENESS) for values in (case.interface.nodes, case.z))
    return replace(case, interface=case.interface.at(nodes), z=z, parameters={"shift": shift})


@st.composite
def _tilted_states(
    draw: DrawFn, pairs: SearchStrategy[SurfacePair], motions: SearchStrategy[SpaceMotion], *, smooth: bool
) -> Case:
    pair = draw(pairs)
    quarters, unit = draw(_QUARTERS), draw(samples.depth_units())
    slopes, warps = (draw(_SLOPES), draw(_SLOPES)), (draw(_WARPS), draw(_WARPS))
    motion, penalty, seed = draw(motions), draw(samples.PENALTIES), draw(samples.SEEDS)
    offsets = draw(samples.OFFSETS) if smooth else [0]  # Drawn last, so that the offset shrinks last.
    interface, _, domain = pair.lay_out()
    least = least_height(interface, interface.nodes)
    n_slave, current = interface.n_slave_nodes, interface.nodes.copy()
    # Offsets of 0 to 1/16, on lattices that are coprime to the powers of two.
    current[:n_slave] += samples.repeat_cyclically(offsets, 3 * n_slave).reshape(-1, 3) / [7.0, 11.0, 13.0] / 16 * least
    current[:n_slave, 2] += (current[:n_slave, :2] - domain.mean(axis=0)) @ slopes - quarters / 4 * unit * least
    for part, warp in zip((slice(n_slave), slice(n_slave, None)), warps, strict=True):
        current[part, 2] += samples.repeat_cyclically(warp, len(current[part])) / 16 * unit * least
    scaled = interface.at(interface.nodes * motion.scale)
    return Case(scaled, motion(current).reshape(-1), penalty, {}, seed)
