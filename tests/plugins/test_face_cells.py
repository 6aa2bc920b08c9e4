"""The corners of cells where edges of both sides nearly coincide."""

import numpy as np
import pytest

from contactverif import Interface
from contactverif_surfaces.cell_points import FacePairs, SlaveView
from contactverif_surfaces.face_search import TIE


@pytest.mark.parametrize("near", [-1.5, -0.9, -0.5, 0.0, 0.5, 0.9, 1.5])
@pytest.mark.parametrize("far", [-3.0, -1.1, -0.7, 0.3, 0.7, 1.1, 3.0])
def test_edges_that_nearly_coincide_have_no_crossing_far_from_both(near: float, far: float) -> None:
    """The master's lower edge lies so many ties above that of the slave: with one end near, the other far.

    A crossing where both ends lie on one side, or within a tie, would be a quotient of two roundoffs.
    """
    slave = [[0.0, 0, 0], [1, 0, 0], [0.3, 0.8, 0]]
    master = [[0.25, near * TIE, 0], [0.75, far * TIE, 0], [0.4, 0.9, 0]]
    meshes = Interface.from_faces(slave, [[0, 2, 1]], master, [[0, 1, 2]])
    pairs = FacePairs.find(meshes, meshes.nodes.reshape(-1))
    corners = pairs.corners_at(meshes.nodes.reshape(-1))
    plane = SlaveView.of_corners(corners[:, :3], corners[:, 3:])
    cell = plane.cell_corners(pairs.codes)[0]
    both = np.concatenate([plane.slave[0], plane.master[0]])
    assert (cell >= both.min(axis=0)).all()
    assert (cell <= both.max(axis=0)).all()
    before, after = cell - np.roll(cell, 1, axis=0), np.roll(cell, -1, axis=0) - cell
    assert (before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] >= -8 * TIE).all()
