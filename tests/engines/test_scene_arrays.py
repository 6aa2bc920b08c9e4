"""A scene as arrays is the same scene, and an answer to a turned or lowered one is an answer to the scene."""

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from plain_engine import Plain

from contactverif import MisuseError, Scene, load_scene
from contactverif.contract.engine import EngineAnswer, SceneArrays
from contactverif.isolation.plain_msgpack import decode, encode
from contactverif.mechanics.accuracy import Solution
from contactverif.mechanics.changed_scenes import turn


def test_arrays_make_the_scene_again() -> None:
    arrays = load_scene("c:degrees=17").arrays()
    again = SceneArrays.from_arrays(arrays.to_arrays())
    for name, array in arrays.to_arrays().items():
        np.testing.assert_array_equal(again.to_arrays()[name], array)
    assert not arrays.nodes.flags.writeable


def test_an_upright_scene_has_a_flat_interface_again() -> None:
    scene = load_scene("c:degrees=17")
    arrays = scene.arrays(upright=True)
    heights = arrays.nodes[np.unique(np.vstack([arrays.slave, arrays.master]))][:, 1]
    assert len(np.unique(heights)) == 1
    assert (arrays.axes == [1.0, 0.0]).all()
    expected = np.vstack([body.nodes @ body.frame for body in scene.bodies])
    np.testing.assert_allclose(arrays.nodes, expected, atol=1e-14)


def test_bodies_with_different_axes_cannot_be_upright_together() -> None:
    scene = load_scene("c")
    first, second = scene.bodies
    inclined = turn(scene, np.array([[0.6, -0.8], [0.8, 0.6]])).bodies[1]
    with pytest.raises(MisuseError, match="bodies with different axes"):
        Scene((first, inclined), penalty=1.0).arrays(upright=True)
    assert second is scene.bodies[1]


def test_a_body_that_nothing_holds_is_lowered_and_the_answer_counts_from_where_it_was() -> None:
    scene = load_scene("c")
    pose = scene.pose(lowered=True)
    moved = pose.arrays.nodes - np.vstack([body.nodes for body in scene.bodies])
    lower = np.where(pose.arrays.body_of_node == 0, scene.bodies[0].start[1], 0.0)
    np.testing.assert_allclose(moved, np.column_stack([0 * lower, lower]), atol=1e-15)
    zero = EngineAnswer(np.zeros_like(pose.arrays.nodes), True)
    starts = [0.0, scene.bodies[0].start[1]], [0.0, 0.0]
    counts = [len(body.contact_nodes) for body in scene.bodies]
    expected = np.repeat(starts, counts, axis=0)
    moves = pose.restore(zero).displacements[scene.nodes_in_reach]
    np.testing.assert_allclose(moves, expected, atol=1e-15)


@pytest.mark.parametrize("upright", [True, False])
@pytest.mark.parametrize("scale", [1.0, 2.0**-10])
def test_the_solution_is_that_of_the_scene_however_it_is_posed(upright: bool, scale: float) -> None:
    scene = load_scene("c:degrees=17")
    pose = scene.pose(upright=upright, lowered=True, scale=scale)
    answers = [each.restore(Plain().solve(each.arrays)).displacements for each in (pose, scene.pose())]
    forces = [Solution.from_displacements(scene, moves[scene.nodes_in_reach]).forces for moves in answers]
    np.testing.assert_allclose(forces[0], forces[1], atol=1e-8 * 400)


_items = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False) | st.text() | st.binary(),
    lambda inner: st.lists(inner, max_size=20) | st.dictionaries(st.text(), inner, max_size=20),
    max_leaves=30,
)


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])  # No clock decides a test.
@given(_items)
def test_plain_messages_are_those_of_msgspec(item: object) -> None:
    assert decode(msgspec.msgpack.encode(item)) == item
    assert msgspec.msgpack.decode(encode(item)) == item


@pytest.mark.parametrize("size", [40, 300, 70000])
def test_long_messages_too(size: int) -> None:
    for item in (["a"] * size, "ä" * size, b"x" * size, {str(n): n for n in range(size)}):
        assert decode(msgspec.msgpack.encode(item)) == item
    with pytest.raises(ValueError, match="1 bytes too many"):
        decode(encode(1) + b"\x00")
    with pytest.raises(ValueError, match="unknown kind"):
        decode(b"\xc1")
