"""A scene in other units, or in another place, is the same problem to the last bit; what would round it is refused."""

from dataclasses import replace

import numpy as np
import pytest
from pressed_blocks import LEANING
from subjects import load_subject

from contactverif import MisuseError, Placing, Rectangle, Scene, solve, two_blocks
from contactverif.mechanics.changed_scenes import change_units, move, snap

LENGTH, MODULUS = 2.0**-31, 4.0**13


def lean_blocks() -> Scene:
    """Two blocks whose meshes do not match, pressed together by a tilted approach; leaning, off the origin."""
    return two_blocks(
        Rectangle([0.1, 1.2, 2.5], [0, 1, 2.5], young=2.0, poisson=0.3),
        Rectangle([-1, 0.7, 2, 3.3], [-1.5, 0], young=3.0, poisson=0.2),
        penalty=20.0,
        approach=0.1,
        tilt=0.02,
        placing=Placing(LEANING, (3.0, -7.0)),
    )


def test_other_units_change_exponents_alone() -> None:
    scene = lean_blocks()
    there = change_units(scene, LENGTH, MODULUS)
    anew = replace(there)  # It has nothing that is only multiplied.
    assert not vars(anew).keys() & {"stiffness", "load", "transformation"}
    assert (there.interface.nodes == scene.interface.nodes * LENGTH).all()
    assert (anew.stiffness == scene.stiffness * MODULUS).all()
    assert (anew.load == scene.load * (MODULUS * LENGTH)).all()
    assert (anew.start == scene.start * LENGTH).all()
    assert (anew.imposed_displacements == scene.imposed_displacements * LENGTH).all()
    for name in ("stiffness", "load", "transformation", "start", "imposed_displacements"):
        assert (getattr(there, name) == getattr(anew, name)).all(), name
    assert there.penalty == scene.penalty * MODULUS / LENGTH


@pytest.mark.parametrize("use_tangent", [True, False])
@pytest.mark.parametrize("name", ["nts", "vts-ppt", "sts", "nts-lm", "mortar-lm"])
def test_newtons_method_takes_the_same_way_in_other_units(name: str, use_tangent: bool) -> None:
    scene, subject = lean_blocks(), load_subject(name)
    there = change_units(scene, LENGTH, MODULUS)
    here, other = (solve(each, subject.for_case(each.case()), use_tangent=use_tangent) for each in (scene, there))
    assert other.end is here.end
    assert (other.q == here.q * LENGTH).all()
    assert (other.changes == here.changes).all()


@pytest.mark.parametrize(
    ("length", "modulus", "message"),
    [
        (3.0, 4.0, "length: found 3.0; needed a power of 2"),
        (-2.0, 4.0, "length: found -2.0; needed a power of 2"),
        (2.0, 2.0, "modulus: found 2.0; needed a power of 4"),
    ],
)
def test_other_factors_are_refused(length: float, modulus: float, message: str) -> None:
    with pytest.raises(MisuseError, match=message):
        change_units(lean_blocks(), length, modulus)


def test_a_moved_interface_has_the_same_digits() -> None:
    interface = snap(lean_blocks(), 2.0**-32).interface
    assert (move(interface, -(2.0**20)).nodes + 2.0**20 == interface.nodes).all()


def test_a_way_that_would_round_a_node_is_refused() -> None:
    with pytest.raises(MisuseError, match="which rounds a node; needed a way that rounds no node"):
        move(lean_blocks().interface, 2.0**20)


def test_coordinates_are_snapped_to_the_nearest_multiple() -> None:
    scene = lean_blocks()
    nodes = snap(scene, 2.0**-10).interface.nodes
    assert (nodes * 2.0**10 == np.rint(nodes * 2.0**10)).all()
    assert np.abs(nodes - scene.interface.nodes).max() <= 2.0**-11
