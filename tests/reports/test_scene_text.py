"""Blocks as text: to scale, closed boxes, and what presses where."""

import pytest
from handmade_scene import bodies, make_solved_scene

from contactverif_reports.draw.scene_text import blocks_as_text


def test_blocks_as_one_would_draw_them() -> None:
    scene = make_solved_scene(wide=2.0)
    assert blocks_as_text(scene.case, *scene.bodies).splitlines() == [
        "      ↓   ↓   ↓   ↓   ↓   ↓",
        "      ┌───────────────────┐",
        "      │       slave       │",
        "↓   ↓ ●─1─●──2──●────3────● ↓   ↓",
        "o─────4──────o────────6─────────o",
        "│             master            │",
        "└───────────────────────────────┘",
    ]


def test_a_rigid_master_is_hatched_and_no_pressure_no_arrows() -> None:
    scene = make_solved_scene(rigid_master=True)
    lines = blocks_as_text(scene.case, *scene.bodies).splitlines()
    assert set(lines[-1]) == {"/"}
    assert len(lines[-1]) == len(lines[-2])
    fixed_nodes = make_solved_scene().bodies[1]  # nothing loads or moves it
    assert "↓" in lines[0]
    assert "↓" not in blocks_as_text(make_solved_scene().case, fixed_nodes, fixed_nodes)


@pytest.mark.parametrize("width", [40, 60, 100])
@pytest.mark.parametrize("angle", [0.0, 0.5, 3.0])
def test_it_fits_and_its_boxes_close(width: int, angle: float) -> None:
    scene = make_solved_scene(wide=1.0, angle=angle)
    lines = blocks_as_text(scene.case, *bodies(wide=1.0, angle=angle), width).splitlines()
    assert max(map(len, lines)) <= width
    top, slave = lines[1], lines[3]
    assert (top.index("┌"), top.index("┐")) == (slave.index("●"), slave.rindex("●"))
    bottom, master = lines[6], lines[4]
    assert (bottom.index("└"), bottom.index("┘")) == (master.index("o"), master.rindex("o"))
