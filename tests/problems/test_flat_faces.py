"""The flat states in space are flat to the last bit, and their weights are the areas that they say."""

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from itertools import product

import numpy as np
import pytest

from contactverif import Case
from contactverif.problems.flat_states import (
    grid,
    node_hit_face_states,
    offset_face_states,
    plate,
    read_frame,
    rotation,
    search_face_states,
    touching_face_states,
)

MAKERS = [node_hit_face_states, offset_face_states, search_face_states, touching_face_states]
LISTS = [partial(make, (corners,)) for make in MAKERS for corners in (3, 4)]


def exact_heights(case: Case) -> set[Fraction]:
    """Return the exact heights of the slave's nodes over the flat part, times a length."""
    weights, x = case.parameters["weights"], case.positions
    n_slave, (flat, *others) = case.interface.n_slave_nodes, np.flatnonzero(weights)[::-1]
    corners = [[Fraction(value) for value in x[node].tolist()] for node in (flat, others[0], others[1])]
    first, second = ([b - a for a, b in zip(corners[0], corner, strict=True)] for corner in corners[1:])
    normal = [first[k - 2] * second[k - 1] - first[k - 1] * second[k - 2] for k in range(3)]
    return {
        sum((Fraction(a) - b) * n for a, b, n in zip(node.tolist(), corners[0], normal, strict=True))
        for node in x[:n_slave]
    }


@pytest.mark.parametrize("make", LISTS)
def test_slave_and_flat_part_are_parallel_to_the_last_bit(make: Callable[[], tuple[Case, ...]]) -> None:
    cases = make()
    assert len({case.name for case in cases}) == len(cases)
    for case in cases:
        assert len(exact_heights(case)) == 1 or case.parameters.get("shift"), case.name


@pytest.mark.parametrize("make", LISTS)
def test_the_weights_of_each_side_add_up_to_the_slave_s_area(make: Callable[[], tuple[Case, ...]]) -> None:
    for case in make():
        n_slave, weights = case.interface.n_slave_nodes, case.parameters["weights"]
        assert [weights[:n_slave].sum(), weights[n_slave:].sum()] == pytest.approx([case.slave_measure] * 2, rel=1e-13)


def test_nodes_lie_where_the_names_say() -> None:
    """The node of the master lies on a slave node, or one rounding beside it, in the frame of each state."""
    states = [case for case in node_hit_face_states() if case.name.startswith("node ")]
    beside = set()
    for case, quaternion in zip(states, [(1, 0, 0, 0), (1, 1, 1, 0)] * 4, strict=True):
        matrix, size = rotation(quaternion)
        x = case.positions
        frame = read_frame(x, [*zip(*matrix, strict=True)], size, x[4])  # The slave's node in the middle.
        (x_there, y_there, height) = frame[case.interface.n_slave_nodes]
        assert height == Fraction(case.parameter("penetration"))
        assert max(abs(x_there), abs(y_there)) < Fraction(1, 2**45)
        beside.add((x_there, y_there))
    assert len(beside) == 7  # On it, and three places a rounding away, by the rounding of two frames.


def test_rotations_keep_right_angles() -> None:
    for quaternion in product((1, 2), (-1, 3), (0, 2), (1,)):
        matrix, size = rotation(quaternion)
        assert (np.array(matrix) @ np.array(matrix).T == size**2 * np.eye(3)).all()
        assert round(float(np.linalg.det(matrix))) == size**3


def test_a_plate_is_closed_and_its_faces_look_outside() -> None:
    for n in (3, 4):
        sheet = plate(grid([0.0, 2.0, 8.0], [0.0, 8.0], corners=n), 0.5, (3.0, 3.0))
        corners = np.array(sheet.points)[np.array(sheet.faces)]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
        if n == 4:
            normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        assert normals.sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-12)
        assert (corners[:, 0] * normals).sum() / 6 == pytest.approx(8 * 8 * 0.5)
