"""Interfaces and states for an author's own tests: what they are asked for, or an error at once."""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import find, given, settings
from hypothesis import strategies as st

from contactverif import Interface
from contactverif.contract.errors import MisuseError
from contactverif.problems.named_states import named_case
from contactverif.strategies import faces, interfaces, states

C, SQUARES = named_case("c").interface, named_case("crossed-diagonals").interface
FEW = settings(max_examples=15, deadline=None, database=None, derandomize=True)


@FEW
@given(interface=interfaces(), ring=interfaces(closed=True), grid=faces(), quadrilaterals=faces(corners=[4]))
def test_an_interface_is_of_the_kind_that_is_asked_for(
    interface: Interface, ring: Interface, grid: Interface, quadrilaterals: Interface
) -> None:
    assert (interface.dim, ring.dim, grid.dim) == (2, 2, 3)
    assert (ring.master.neighbours >= 0).all()
    assert (grid.slave.faces.shape[1], quadrilaterals.master.faces.shape[1]) == (3, 4)


@FEW
@given(data=st.data(), smooth=st.booleans())
def test_a_state_is_one_of_the_interface(data: st.DataObject, smooth: bool) -> None:
    for dim, interface in ((2, C), (3, SQUARES)):
        assert data.draw(states(interface=interface, smooth=smooth)).interface is interface
        assert data.draw(states(dim=dim, smooth=smooth)).interface.dim == dim


def test_faces_may_have_either_number_of_corners() -> None:
    for corners in (3, 4):
        find(faces(corners=(4, 3)), lambda case, corners=corners: case.slave.faces.shape[1] == corners)  # type: ignore[misc]
    assert find(states(dim=3, corners=[4]), lambda _: True).interface.slave.faces.shape[1] == 4


@pytest.mark.parametrize(
    ("make", "arguments", "words"),
    [
        (interfaces, {"closed": None}, "closed: found None; needed True or False"),
        (faces, {"corners": []}, r"corners: found \[\]; needed 3, 4 or both"),
        (faces, {"corners": [5]}, r"corners: found \[5\]; needed 3, 4 or both"),
        (states, {"smooth": 1}, "smooth: found 1; needed True or False"),
        (states, {"dim": 4}, "dim: found 4; needed 2 or 3"),
        (states, {"dim": 3, "interface": C}, "dim: found 3; needed 2"),
    ],
)
def test_an_impossible_argument_is_refused_at_once(
    make: Callable[..., Any], arguments: dict[str, Any], words: str
) -> None:
    with pytest.raises(MisuseError, match=words):
        make(**arguments)
