"""Two grids of triangles, one over the other in one plane: a master that is larger and turned, or on the same domain.

The slave lies over the square [0, 1]². A stretch makes needles of both: all coordinates across are multiplied by a
power of two, which rounds none of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.faces import TRIANGLE
from contactverif.contract.interface import Interface, Surface
from contactverif.strategies.panels import on_lattice
from contactverif.strategies.surfaces.surface_grids import SurfaceGrid, surface_grids

_SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
_STRETCHES = st.sampled_from([0] * 7 + [1, 2, 4, 6, 8, 12])  # Exponents of the aspect ratio.


@dataclass(frozen=True, slots=True)
class SurfacePair:
    """A slave grid and a master grid, at rest in the plane z = 0."""

    slave: SurfaceGrid
    master: SurfaceGrid
    same_domain: bool  # The master covers the slave's square exactly; else [−1/2, 3/2]², turned about its middle.
    degrees: int  # The turn of a larger master.
    stretch: int  # Coordinates across are multiplied by 2^-stretch.
    shuffle: int  # The numbering of nodes and faces; 0 for that of the grids.

    def lay_out(self) -> tuple[Interface, FloatArray, FloatArray]:
        """Return the interface, the plane coordinates (n_nodes, 2) of its nodes, and the corners of the slave's domain.

        The slave's body is above, so that its faces are seen from below.
        """
        factors = np.array([1.0, 2.0**-self.stretch])
        slave, master = self.slave.points(), self._master_points()
        plane = np.vstack([slave, master]) * factors
        faces = [self.slave.faces()[:, ::-1], self.master.faces() + len(slave)]
        plane, faces = self._renumber(plane, faces, len(slave))
        nodes = np.column_stack([plane, np.zeros(len(plane))])
        return Interface(nodes, Surface(faces[0]), Surface(faces[1])), plane, _SQUARE * factors

    def _master_points(self) -> FloatArray:
        """Return the master's nodes (n, 2) before the stretch."""
        points = self.master.points()
        if self.same_domain:
            return points
        angle = np.deg2rad(self.degrees)
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        return on_lattice((2 * points - 1) @ turn + 0.5)

    def _renumber(self, plane: FloatArray, faces: list[IntArray], n_slave: int) -> tuple[FloatArray, list[IntArray]]:
        """Return places (n_nodes, 2) and faces of both sides in other numbers, as the shuffle says."""
        if not self.shuffle:
            return plane, faces
        random = np.random.default_rng(self.shuffle)
        order = np.concatenate([random.permutation(n_slave), n_slave + random.permutation(len(plane) - n_slave)])
        number = np.argsort(order)  # The new number of each node.
        return plane[order], [
            np.array([_start(row, random) for row in random.permutation(number[side])]) for side in faces
        ]


@dataclass(frozen=True, slots=True)
class MatchedPair(SurfacePair):
    """A slave grid and a master grid with the same faces, and with a ring of more faces unless the domain is the same.

    So each master node over the slave lies on a slave node.
    """

    def _master_points(self) -> FloatArray:
        """Return the master's nodes (n, 2) before the stretch."""
        points = self.slave.points()
        if self.same_domain:
            return points
        points = np.pad(points.reshape(self.slave.columns + 1, -1, 2), ((1, 1), (1, 1), (0, 0)), mode="edge")
        points[[0, -1], :, 0] = [[-0.5], [1.5]]
        points[:, [0, -1], 1] = [-0.5, 1.5]
        return points.reshape(-1, 2)


def _start(face: IntArray, random: np.random.Generator) -> IntArray:
    """Return the corners of a face from another one on."""
    return np.roll(face, int(random.integers(len(face))))


@cache
def surface_pairs(
    *,
    same_domain: bool | None = None,
    most: int = 6,
    stretched: bool = True,
    faces: tuple[int, ...] = (TRIANGLE,),
    straight: bool = False,
) -> SearchStrategy[SurfacePair]:
    """Return pairs of grids; unless `same_domain` says which, half of them share their domain and half do not.

    `faces` and `straight` are those of `surface_grids`. The border of a slave may cut a triangle of a larger master,
    but no straight quadrilateral, whose forces would have no exact answer.
    """
    same = st.booleans().map(lambda larger: not larger) if same_domain is None else st.just(same_domain)
    grids = surface_grids(most=most, faces=faces, straight=straight)
    shuffle = st.one_of(st.just(0), st.integers(0, 255))
    stretches = _STRETCHES if stretched else st.just(0)

    def pair(slave: SurfaceGrid, master: SurfaceGrid, same: bool, *others: int) -> SurfacePair:
        return SurfacePair(slave, master, same or master.straight, *others)

    return st.builds(pair, grids, grids, same, st.integers(0, 359), stretches, shuffle)


@cache
def matched_pairs() -> SearchStrategy[SurfacePair]:
    """Return pairs with master nodes on slave nodes; half of them share their domain, and half do not."""
    shuffle = st.one_of(st.just(0), st.integers(0, 255))

    def pair(grid: SurfaceGrid, larger: bool, stretch: int, number: int) -> SurfacePair:
        return MatchedPair(grid, grid.with_ring() if larger else grid, not larger, 0, stretch, number)

    return st.builds(pair, surface_grids(), st.booleans(), _STRETCHES, shuffle)
