"""The parts of a body, and a one-line message for every input that makes no body."""

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


def changed_attribute(name: str, **entries: Any) -> dict[str, Any]:
    """Replace some entries of an attribute of the block: {"3,1": 7.0} or {"3": (0, 1)}."""
    values = getattr(BLOCK, name).copy()
    for place, value in entries.items():
        values[tuple(map(int, place[1:].split("_")))] = value
    return {name: values}


def with_node(node: tuple[float, float]) -> dict[str, Any]:
    """One node more than the cells use."""
    return {
        "nodes": np.vstack([BLOCK.nodes, node]),
        **{name: np.vstack([getattr(BLOCK, name), [[0, 0]]]) for name in ("imposed", "load")},
        "fixed": np.vstack([BLOCK.fixed, [[False, False]]]),
    }


NU = r"needed Poisson's ratio above −1 and below 0.5 \(an incompressible body has no stiffness matrix"
WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "nu 1/2": ({"poisson": 0.5}, f"poisson: found 0.5; {NU}"),
    "nu -1": ({"poisson": -1.0}, f"poisson: found -1.0; {NU}"),
    "nu nan": ({"poisson": np.nan}, f"poisson: found nan; {NU}"),
    "nu none": ({"poisson": None}, f"poisson: found None; {NU}"),
    "E 0": ({"young": 0.0}, "young: found 0.0; needed Young's modulus > 0"),
    "E < 0": ({"young": -1e4}, "young: found -10000.0; needed Young's modulus > 0"),
    "E nan": ({"young": np.nan}, "young: found nan; needed Young's"),
    "E inf": ({"young": np.inf}, "young: found inf; needed Young's"),
    "E text": ({"young": "1e4"}, "young: found '1e4'; needed Young's"),
    "E true": ({"young": True}, "young: found True; needed Young's"),
    "E two": ({"young": np.array([1.0, 2.0])}, r"young: found array\(\[1., 2.\]\); needed Young's"),
    "nodes nan": (changed_attribute("nodes", _4_1=np.nan), "nodes: found NaN or infinity; needed finite numbers"),
    "nodes inf": (changed_attribute("nodes", _4_1=-np.inf), "nodes: found NaN or infinity; needed finite numbers"),
    "nodes 3d": ({"nodes": np.zeros((9, 3))}, r"nodes: found shape \(9, 3\); needed shape \(n, 2\)"),
    "nodes flat": ({"nodes": np.zeros(18)}, r"nodes: found shape \(18,\); needed shape \(n, 2\)"),
    "nodes complex": ({"nodes": BLOCK.nodes * 1j}, "nodes: found dtype complex128; needed float64"),
    "nodes ragged": ({"nodes": [[0, 1], [2]]}, "nodes: found rows of different lengths; needed an array"),
    "node in no cell": (with_node((5, 5)), "nodes: found node 9 in no cell; needed every node in a cell"),
    "clockwise": ({"cells": BLOCK.cells[:, ::-1]}, "cells: found cell 0, which is clockwise, folded or flat; needed"),
    "one clockwise": (changed_attribute("cells", _2=[3, 6, 7, 4]), "cells: found cell 2, which is clockwise"),
    "folded": (changed_attribute("nodes", _4=(3.5, 3.5)), "cells: found cell 1, which is clockwise, folded or flat"),
    "flat": (changed_attribute("nodes", _4=(2.0, 1.0)), "cells: found cell 1, which is clockwise, folded or flat"),
    "bow tie": (changed_attribute("cells", _0=[0, 1, 3, 4]), "cells: found cell 0, which is clockwise, folded or flat"),
    "cells float": ({"cells": BLOCK.cells * 1.0}, "cells: found dtype float64; needed int64"),
    "cells of 5": ({"cells": np.zeros((2, 5), int)}, r"cells: found shape \(2, 5\); needed shape \(n, 4\)"),
    "cells flat": ({"cells": np.arange(4)}, r"cells: found shape \(4,\); needed shape \(n, 4\)"),
    "cells ragged": ({"cells": [[0, 1, 4, 3], [1, 2, 5]]}, "cells: found rows of different lengths; needed an array"),
    "cells text": ({"cells": "quads"}, r"cells: found shape \(\); needed shape \(n, 4\)"),
    "cells beyond": (changed_attribute("cells", _3_2=9), "cells: found node number 9; needed numbers from 0 to 8"),
    "cells below": (changed_attribute("cells", _3_2=-1), "cells: found node number -1; needed numbers from 0 to 8"),
    "cell twice": (
        {"cells": np.vstack([BLOCK.cells, BLOCK.cells[2:3]])},
        "cells: found two cells on the same side of an edge; needed cells that do not overlap",
    ),
    "reversed": (
        {"contact": BLOCK.contact[:, ::-1]},
        "contact: found the edge from node 1 to node 0; needed edges of the boundary, each with the body on its left",
    ),
    "inside": ({"contact": [[0, 1], [3, 4]]}, "contact: found the edge from node 3 to node 4; needed edges of the b"),
    "no edge": ({"contact": [[0, 4]]}, "contact: found the edge from node 0 to node 4; needed edges of the boundary"),
    "no contact": ({"contact": np.zeros((0, 2), int)}, "contact: found no edges; needed the edges that may touch"),
    "edge twice": (
        {"contact": [[0, 1], [1, 2], [0, 1]]},
        "contact: found two edges that begin or end at one node; needed each edge once",
    ),
    "contact beyond": ({"contact": [[0, 99]]}, "contact: found node number 99; needed numbers from 0 to 8"),
    "contact float": ({"contact": [[0.0, 1.0]]}, "contact: found dtype float64; needed int64"),
    "contact cells": ({"contact": [[0, 1, 2]]}, r"contact: found shape \(1, 3\); needed shape \(n, 2\)"),
    "fixed as numbers": ({"fixed": np.ones((9, 2))}, "fixed: found dtype float64; needed bool"),
    "fixed short": ({"fixed": BLOCK.fixed[:3]}, r"fixed: found shape \(3, 2\); needed shape \(9, 2\)"),
    "imposed short": ({"imposed": np.zeros(9)}, r"imposed: found shape \(9,\); needed shape \(9, 2\)"),
    "imposed nan": (changed_attribute("imposed", _7_1=np.nan), "imposed: found NaN or infinity; needed finite"),
    "imposed on a free one": (
        changed_attribute("imposed", _1_1=0.1),
        "imposed: found a displacement of a free component; needed 0 where nothing is fixed",
    ),
    "load short": ({"load": np.zeros((9, 1))}, r"load: found shape \(9, 1\); needed shape \(9, 2\)"),
    "load inf": (changed_attribute("load", _1_1=np.inf), "load: found NaN or infinity; needed finite"),
    "load text": ({"load": np.full((9, 2), "a")}, "load: found dtype <U1; needed float64"),
    "long axis": ({"axis": (1.0, 1e-5)}, r"axis: found \(1.0, 1e-05\); needed a unit vector"),
    "no axis": ({"axis": (0.0, 0.0)}, r"axis: found \(0.0, 0.0\); needed a unit vector"),
    "axis of 3": ({"axis": (1.0, 0.0, 0.0)}, r"axis: found shape \(3,\); needed shape \(2,\)"),
    "start": ({"start": (0.0, np.nan)}, "start: found NaN or infinity; needed finite"),
    "start of 1": ({"start": [0.0]}, r"start: found shape \(1,\); needed shape \(2,\)"),
}


def only_line(error: pytest.ExceptionInfo[MisuseError]) -> str:
    """Return the message, which has one line and says what was found and what is needed."""
    line = str(error.value)
    assert "\n" not in line
    assert ": found " in line
    assert "; needed " in line
    return line


@pytest.mark.parametrize(("attributes", "message"), WRONG.values(), ids=WRONG)
def test_wrong_bodies(attributes: dict[str, Any], message: str) -> None:
    with pytest.raises(MisuseError, match=f"^punch: {message}") as error:
        replace(BLOCK, name="punch", **attributes)
    only_line(error)


def test_an_axis_may_be_a_rounding_too_long() -> None:
    for angle in np.linspace(0, 7, 50):
        replace(BLOCK, axis=(cos(angle), sin(angle)))


def unit_block(x: Any = (0, 1), y: Any = (0, 1), *, contact: str = "top", young: float = 1.0, **placing: Any) -> Body:
    return block(Rectangle(x, y, young=young), contact=contact, placing=Placing(**placing))


WRONG_BLOCKS: dict[str, tuple[Callable[[], Body], str]] = {
    "descending": (lambda: unit_block([0, 2, 1]), r"block: x: found \[0.0, 2.0, 1.0\]; needed at l"),
    "one line": (lambda: unit_block(y=[3]), r"block: y: found \[3.0\]; needed at least two ascending"),
    "equal": (lambda: unit_block([0, 0]), r"block: x: found \[0.0, 0.0\]; needed at least two"),
    "nan": (lambda: unit_block([0, np.nan]), r"block: x: found \[0.0, nan\]; needed at least two"),
    "inf": (lambda: unit_block([0, np.inf]), r"block: x: found \[0.0, inf\]; needed at least two"),
    "text": (lambda: unit_block("ab"), "block: x: found dtype <U2; needed numbers"),
    "a grid": (lambda: unit_block([[0, 1]]), r"block: x: found shape \(1, 2\); needed shape \(n,\)"),
    "side": (lambda: unit_block(contact="left"), "block: contact: found 'left'; needed 'bottom' or 'top'"),
    "axis": (lambda: unit_block(axis=(1, 1)), r"block: axis: found \(1.0, 1.0\); needed a"),
    "axis of 3": (lambda: unit_block(axis=(1, 0, 0)), r"block: axis: found shape \(3,\); needed shape \(2,\)"),
    "shift": (lambda: unit_block(shift=(1,)), r"block: shift: found shape \(1,\); needed shape \(2,\)"),
    "material": (lambda: unit_block(young=0), "block: young: found 0; needed Young's"),
    "one point": (lambda: rigid_surface([[0, 0]]), "rigid: contact: found no edges; needed the edges that may touch"),
    "in line": (lambda: rigid_surface([0, 1, 2]), r"rigid: points: found shape \(3,\); needed shape \(n, 2\)"),
    "ragged": (lambda: rigid_surface([[0, 1], [2]]), "rigid: points: found rows of different lengths; needed an array"),
    "words": (lambda: rigid_surface("abc"), "rigid: points: found dtype <U3; needed numbers"),
    "move": (
        lambda: rigid_surface([[0, 0], [1, 0]], displacement=(1, 2, 3)),
        r"rigid: displacement: found shape \(3,\); needed shape \(2,",
    ),
    "nowhere": (
        lambda: rigid_surface([[0, 0], [1, 0]], displacement=(np.nan, 0)),
        "rigid: imposed: found NaN or infinity; needed",
    ),
    "loose": (
        lambda: Body([[0, 0], [1, 0]], np.zeros((0, 4), int), [[0, 1]]),  # type: ignore[arg-type]
        "body: fixed: found a free node of a rigid body; needed every component of every node fixed",
    ),
}


@pytest.mark.parametrize(("make", "message"), WRONG_BLOCKS.values(), ids=WRONG_BLOCKS)
def test_wrong_blocks(make: Callable[[], Body], message: str) -> None:
    with pytest.raises(MisuseError, match=f"^{message}") as error:
        make()
    only_line(error)


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
