"""The parts of a body, and a one-line message for every input that makes no body."""

import re
from collections.abc import Callable
from dataclasses import replace
from math import cos, radians, sin
from typing import Any

import numpy as np
import pytest

from contactverif import Body, MisuseError, Placing, Rectangle, block, rigid_surface
from contactverif.contract.arrays import UNIT_ROUNDOFF

# Four cells; nodes are numbered along x from below, so 0 1 2 touch and 6 7 8 are held.
BLOCK = block(Rectangle([0, 1, 2], [0, 1, 2]), contact="bottom", approach=0.1)
LEANING = (cos(radians(17.3)), sin(radians(17.3)))


def test_what_a_body_is() -> None:
    assert not BLOCK.rigid
    assert BLOCK.contact.tolist() == [[0, 1], [1, 2]]
    assert BLOCK.contact_nodes.tolist() == [0, 1, 2]
    assert BLOCK.cells.tolist() == [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]]
    assert BLOCK.frame.tolist() == [[1, 0], [0, 1]]
    assert replace(BLOCK, axis=[0.0, 1.0]).frame.tolist() == [[0, -1], [1, 0]]
    assert (BLOCK.young, BLOCK.poisson) == (1, 0)


def test_what_is_left_out_is_free_and_unloaded() -> None:
    bare = Body(BLOCK.nodes, BLOCK.cells, BLOCK.contact)
    for values in (bare.fixed, bare.imposed, bare.load):
        assert not values.any()
        assert values.shape == (9, 2)


@pytest.mark.parametrize(("young", "poisson", "modulus"), [(3.0, 0.2, 10 / 3), (1.0, 0.0, 1.0), (1.0, -0.5, 1.5)])
def test_the_oedometer_modulus(young: float, poisson: float, modulus: float) -> None:
    # 3 × .8/(1.2 × .6) = 10/3; 1 × 1.5/(.5 × 2) = 3/2; a few roundings
    assert abs(replace(BLOCK, young=young, poisson=poisson).oedometric_modulus - modulus) <= 8 * UNIT_ROUNDOFF * modulus


def test_a_body_is_a_read_only_copy() -> None:
    nodes = BLOCK.nodes.copy()
    body = replace(BLOCK, nodes=nodes)
    nodes[:] = 9
    assert np.array_equal(body.nodes, BLOCK.nodes)
    for name in ("nodes", "cells", "contact", "fixed", "imposed", "load", "axis", "start"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(body, name)[0] = 0


def alter(name: str, place: tuple[int, ...], value: Any) -> Any:
    """Return an attribute of the block of which an entry, or a row, is another."""
    values = getattr(BLOCK, name).copy()
    values[place] = value
    return values


def shape_of(values: Any) -> str:
    return f"shape {np.shape(values)}"


def dtype_of(values: Any) -> str:
    return f"dtype {np.asarray(values).dtype}"


def rows(name: str, found: str | Callable[[Any], str], needed: str, *values: Any) -> list[tuple[dict[str, Any], str]]:
    """Return the changes and the messages of wrong values of one attribute."""
    return [
        ({name: value}, f"punch: {name}: found {found if isinstance(found, str) else found(value)}; needed {needed}")
        for value in values
    ]


NU = "Poisson's ratio above −1 and below 0.5 (an incompressible body has no stiffness matrix in displacements)"
INFINITE, CONVEX = "NaN or infinity", "convex, counter-clockwise"
RAGGED, BOUNDARY = "rows of different lengths", "edges of the boundary, each with the body on its left"
WITH_A_NODE: dict[str, Any] = {  # One node more than the cells use.
    **{name: np.vstack([getattr(BLOCK, name), [[0, 0]]]) for name in ("imposed", "load")},
    "fixed": np.vstack([BLOCK.fixed, [[False, False]]]),
    "nodes": np.vstack([BLOCK.nodes, (5, 5)]),
}
WRONG = [
    *rows("poisson", repr, NU, 0.5, -1.0, np.nan, None),
    *rows("young", repr, "Young's modulus > 0", 0.0, -1e4, np.nan, np.inf, "1e4", True, np.array([1.0, 2.0])),
    *rows("nodes", shape_of, "shape (n, 2)", np.zeros((9, 4)), np.zeros(18)),
    *rows("cells", shape_of, "shape (n, 4)", np.zeros((2, 5), int), np.arange(4), "quads"),
    *rows("contact", shape_of, "shape (n, 2)", [[0, 1, 2]]),
    *rows("fixed", shape_of, "shape (9, 2)", BLOCK.fixed[:3]),
    *rows("imposed", shape_of, "shape (9, 2)", np.zeros(9)),
    *rows("load", shape_of, "shape (9, 2)", np.zeros((9, 1))),
    *rows("axis", shape_of, "shape (2,)", (1.0, 0.0, 0.0)),
    *rows("start", shape_of, "shape (2,)", [0.0]),
    *rows("nodes", dtype_of, "float64", BLOCK.nodes * 1j),
    *rows("load", dtype_of, "float64", np.full((9, 2), "a")),
    *rows("cells", dtype_of, "int64", BLOCK.cells * 1.0),
    *rows("contact", dtype_of, "int64", [[0.0, 1.0]]),
    *rows("fixed", dtype_of, "bool", np.ones((9, 2))),
    *rows("nodes", INFINITE, "finite numbers", alter("nodes", (4, 1), np.nan), alter("nodes", (4, 1), -np.inf)),
    *rows("imposed", INFINITE, "finite numbers", alter("imposed", (7, 1), np.nan)),
    *rows("load", INFINITE, "finite numbers", alter("load", (1, 1), np.inf)),
    *rows("start", INFINITE, "finite numbers", (0.0, np.nan)),
    *rows("nodes", RAGGED, "an array", [[0, 1], [2]]),
    *rows("cells", RAGGED, "an array", [[0, 1, 4, 3], [1, 2, 5]]),
    *rows("axis", str, "a unit vector", (1.0, 1e-5), (0.0, 0.0)),
    (WITH_A_NODE, "punch: nodes: found node 9 in no cell; needed every node in a cell"),
    *rows("cells", "cell 0, which is clockwise, folded or flat", CONVEX, BLOCK.cells[:, ::-1]),
    *rows("cells", "cell 0, which is clockwise, folded or flat", CONVEX, alter("cells", (0,), [0, 1, 3, 4])),
    *rows("cells", "cell 2, which is clockwise, folded or flat", CONVEX, alter("cells", (2,), [3, 6, 7, 4])),
    *(
        (change, f"punch: cells: found cell 1, which is clockwise, folded or flat; needed {CONVEX}")
        for change in ({"nodes": alter("nodes", (4,), place)} for place in ((3.5, 3.5), (2.0, 1.0)))
    ),
    *rows("cells", "node number 9", "numbers from 0 to 8", alter("cells", (3, 2), 9)),
    *rows("cells", "node number -1", "numbers from 0 to 8", alter("cells", (3, 2), -1)),
    *rows("contact", "node number 99", "numbers from 0 to 8", [[0, 99]]),
    *rows(
        "cells",
        "two cells on the same side of an edge",
        "cells that do not overlap",
        np.vstack([BLOCK.cells, BLOCK.cells[2:3]]),
    ),
    *rows("contact", "the edge from node 1 to node 0", BOUNDARY, BLOCK.contact[:, ::-1]),
    *rows("contact", "the edge from node 3 to node 4", BOUNDARY, [[0, 1], [3, 4]]),
    *rows("contact", "the edge from node 0 to node 4", BOUNDARY, [[0, 4]]),
    *rows("contact", "no edges", "the edges that may touch something", np.zeros((0, 2), int)),
    *rows("contact", "two edges that begin or end at one node", "each edge once", [[0, 1], [1, 2], [0, 1]]),
    *rows("imposed", "a displacement of a free component", "0 where nothing is fixed", alter("imposed", (1, 1), 0.1)),
]


@pytest.mark.parametrize(("attributes", "message"), WRONG)
def test_wrong_bodies(attributes: dict[str, Any], message: str) -> None:
    with pytest.raises(MisuseError, match=f"^{re.escape(message)}[^\n]*$"):
        replace(BLOCK, name="punch", **attributes)


def test_an_axis_may_be_a_rounding_too_long() -> None:
    for angle in np.linspace(0, 7, 50):
        replace(BLOCK, axis=(cos(angle), sin(angle)))


def unit_block(x: Any = (0, 1), y: Any = (0, 1), *, contact: str = "top", young: float = 1.0, **placing: Any) -> Body:
    return block(Rectangle(x, y, young=young), contact=contact, placing=Placing(**placing))


LINE = [[0, 0], [1, 0]]
WRONG_BLOCKS: list[tuple[Callable[[], Body], str]] = [
    (lambda: unit_block([0, 2, 1]), "block: x: found [0.0, 2.0, 1.0]; needed at least two ascending"),
    (lambda: unit_block(y=[3]), "block: y: found [3.0]; needed at least two ascending"),
    (lambda: unit_block([0, 0]), "block: x: found [0.0, 0.0]; needed at least two"),
    (lambda: unit_block([0, np.nan]), "block: x: found [0.0, nan]; needed at least two"),
    (lambda: unit_block([0, np.inf]), "block: x: found [0.0, inf]; needed at least two"),
    (lambda: unit_block("ab"), "block: x: found dtype <U2; needed numbers"),
    (lambda: unit_block([[0, 1]]), "block: x: found shape (1, 2); needed shape (n,)"),
    (lambda: unit_block(contact="left"), "block: contact: found 'left'; needed 'bottom' or 'top'"),
    (lambda: unit_block(axis=(1, 1)), "block: axis: found (1.0, 1.0); needed a"),
    (lambda: unit_block(axis=(1, 0, 0)), "block: axis: found shape (3,); needed shape (2,)"),
    (lambda: unit_block(shift=(1,)), "block: shift: found shape (1,); needed shape (2,)"),
    (lambda: unit_block(young=0), "block: young: found 0; needed Young's"),
    (lambda: rigid_surface([[0, 0]]), "rigid: contact: found no edges; needed the edges that may touch"),
    (lambda: rigid_surface([0, 1, 2]), "rigid: points: found shape (3,); needed shape (n, 2)"),
    (lambda: rigid_surface([[0, 1], [2]]), "rigid: points: found rows of different lengths; needed an array"),
    (lambda: rigid_surface("abc"), "rigid: points: found dtype <U3; needed numbers"),
    (lambda: rigid_surface(LINE, displacement=(1, 2, 3)), "rigid: displacement: found shape (3,); needed shape (2,"),
    (lambda: rigid_surface(LINE, displacement=(np.nan, 0)), "rigid: imposed: found NaN or infinity; needed"),
    (
        lambda: Body(np.array(LINE), np.zeros((0, 4), int), np.array([[0, 1]])),
        "body: fixed: found a free node of a rigid body; needed every component of every node fixed",
    ),
]


@pytest.mark.parametrize(("make", "message"), WRONG_BLOCKS)
def test_wrong_blocks(make: Callable[[], Body], message: str) -> None:
    with pytest.raises(MisuseError, match=f"^{re.escape(message)}[^\n]*$"):
        make()


@pytest.mark.parametrize("contact", ["bottom", "top"])
def test_the_body_is_on_the_left_of_its_contact_edges(contact: str) -> None:
    placing = Placing(axis=LEANING, shift=(5, -1), scale=2.0)
    body = block(Rectangle([0, 1, 3], [0, 2]), contact=contact, approach=0.0, placing=placing)
    first, second = np.swapaxes(body.nodes[body.contact], 0, 1)
    along, to_centre = second - first, body.nodes.mean(axis=0) - first
    assert (along[:, 0] * to_centre[:, 1] - along[:, 1] * to_centre[:, 0] > 0).all()
    assert body.contact[1:, 0].tolist() == body.contact[:-1, 1].tolist()


@pytest.mark.parametrize(("contact", "down"), [("bottom", -1.0), ("top", 1.0)])
def test_pressure_on_the_far_side(contact: str, down: float) -> None:
    body = block(Rectangle([0, 1, 3], [0, 1, 2]), contact=contact, pressure=5.0, placing=Placing(scale=2.0))
    far = body.nodes[:, 1] == (4 if contact == "bottom" else 0)
    assert body.load[far].tolist() == [[0, 5 * down], [0, 15 * down], [0, 10 * down]]  # 5 × (1, 3, 2)
    assert not body.load[~far].any()
    assert not body.fixed[:, 1].any()
    assert body.fixed[:, 0].tolist() == [True, False, True] * 3
    assert not body.imposed.any()


def test_an_approach_of_the_far_side_with_a_tilt() -> None:
    moves: dict[str, Any] = {"approach": 0.25, "tilt": 0.125, "lowered": 0.5, "placing": Placing(scale=2.0)}
    body = block(Rectangle([0, 1, 4], [0, 1]), contact="bottom", **moves)
    assert body.imposed.tolist() == [[0, 0]] * 3 + [[0, -0.25], [0, -0.375], [0, -0.75]]
    assert body.fixed[:3, 1].tolist() == [False] * 3
    assert body.fixed[3:, 1].all()
    assert body.start.tolist() == [0, -1]
    assert block(Rectangle([0, 1, 4], [0, 1]), contact="top", approach=0.25).imposed[:3, 1].tolist() == [0.25] * 3


def test_free_sides_hold_one_node_from_sliding() -> None:
    body = block(Rectangle([0, 1, 3], [0, 1, 2]), contact="bottom", pressure=1.0, free_sides=True)
    assert np.argwhere(body.fixed).tolist() == [[6, 0]]


def test_pressure_beside_what_presses() -> None:
    body = block(Rectangle([0, 2, 4], [0, 1]), contact="top", approach=0.0, pressure=3.0, contact_range=(1, 3))
    # outside [1, 3]: ∫ N over [0, 1] is 3/4 at x = 0 and 1/4 at x = 2; the same from the right
    assert body.load.tolist() == [[0, 0]] * 3 + [[0, -2.25], [0, -1.5], [0, -2.25]]
    whole = block(Rectangle([0, 2, 4], [0, 1]), contact="top", approach=0.0, pressure=3.0, contact_range=(0, 4))
    assert not whole.load.any()


def test_where_a_block_lies() -> None:
    placing = Placing(axis=(0, 1), shift=(1, 0), scale=2.0)
    quarter = block(Rectangle([0, 1], [0, 2]), contact="bottom", approach=0.0, placing=placing)
    assert quarter.nodes.tolist() == [[2, 0], [2, 2], [-2, 0], [-2, 2]]
    points = np.array([[3.0, 4.0]])
    turned = Placing(LEANING, (1, 2), 0.5).place(points)
    expected = 0.5 * (np.array([1, 2]) + 3 * np.array(LEANING) + 4 * np.array([-LEANING[1], LEANING[0]]))
    assert np.abs(turned - expected).max() <= 4 * UNIT_ROUNDOFF * 7  # 7 = 3 + 4, two products and two sums


def test_a_rigid_body() -> None:
    floor = rigid_surface([[4, 0], [1, 0], [0, 0]], displacement=(0, 0.5), name="floor")
    assert floor.rigid
    assert floor.fixed.all()
    assert floor.imposed.tolist() == [[0, 0.5]] * 3
    assert floor.contact.tolist() == [[0, 1], [1, 2]]
    assert floor.cells.shape == (0, 4)
