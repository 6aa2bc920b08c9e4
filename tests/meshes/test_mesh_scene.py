"""Scenes from meshes with cells: bodies, materials, supports, and whatever can be asked of them."""

from collections.abc import Callable
from pathlib import Path

import meshlane
import numpy as np
import pytest
from curved_bodies import write_curved_bodies
from hypothesis.strategies import SearchStrategy
from planned_cases import draw_cases
from subjects import load_subject

from contactverif import Case, End, Interface, MisuseError, Scene, Verdict, load_properties, read_scene, solve
from contactverif.contract.interface import ways_to_master
from contactverif.contract.result import NOT_HERE
from contactverif.meshes.mesh_scene import describe_bodies, parse_material, parse_support
from contactverif.run.run import run
from contactverif.strategies import general_cases, smooth_cases

PUNCH = Path(__file__).parents[1] / "data" / "punch.msh"
SIDES = {"slave": "arc", "master": "top"}
ON_ANY_SCENE = {"newton.history", "newton.order", "newton.units", "newton.attainable"}


@pytest.fixture(name="curved", scope="module")
def make_curved_bodies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_curved_bodies(tmp_path_factory.mktemp("mesh") / "curved.msh")


@pytest.mark.parametrize(("cells", "slave", "master"), [("quad", "arc", "top"), ("triangle", "top", "arc")])
def test_every_property_is_judged_on_curved_bodies_or_says_what_it_needs(
    tmp_path: Path, cells: str, slave: str, master: str
) -> None:
    scene = read_scene(write_curved_bodies(tmp_path / "curved.msh", cells=cells), slave=slave, master=master)
    result = run([load_subject("vts-ppt")], load_properties(["*"]), place=scene.case(), examples=2, seed=1)
    assert len(result.rows) == len(load_properties(["*"]))
    assert {row.property_id for row in result.rows if row.verdict in (Verdict.PASS, Verdict.FAIL)} > ON_ANY_SCENE
    for row in result.rows:
        assert row.verdict not in (Verdict.NOT_JUDGED, Verdict.CRASHED), row
        assert row.outcomes or row.reason, row
        assert not row.outcomes or row.tally.counts.contact_share == 1, row
    needs = {row.property_id: row.reason for row in result.rows if row.reason.startswith(NOT_HERE)}
    assert needs["accuracy.hertz"] == f"{NOT_HERE}meshes with a known answer"
    assert needs["patch.flat.transmission"] == f"{NOT_HERE}a straight slave over a parallel master that covers it"
    assert needs["patch.flat.solve"] == f"{NOT_HERE}a known uniform pressure"


@pytest.mark.parametrize("strategy", [general_cases, smooth_cases])
@pytest.mark.parametrize("roles", [("arc", "top"), ("top", "arc")])
def test_most_slave_nodes_touch_in_random_states_of_curved_bodies(
    curved: Path, strategy: Callable[[Interface], SearchStrategy[Case]], roles: tuple[str, str]
) -> None:
    interface = read_scene(curved, slave=roles[0], master=roles[1]).interface
    shares = []
    for case in draw_cases(strategy(interface), seed="1", examples=40).cases:
        ways, _ = ways_to_master(interface.at(case.positions))
        shares.append((ways[np.isfinite(ways)] < 0).mean())
    assert np.quantile(shares, 0.1) >= 0.8


def test_a_scene_is_that_of_the_file(curved: Path) -> None:
    scene = read_scene(curved, **SIDES, materials={"base": (1000.0, 0.25)})
    slave, master = scene.bodies
    assert (slave.young, slave.poisson, master.young, master.poisson) == (1.0, 0.3, 1000.0, 0.25)
    assert (len(slave.cells), len(master.cells)) == (21, 36)
    assert np.array_equal(np.flatnonzero(slave.fixed.all(axis=1)), np.flatnonzero(slave.nodes[:, 1] == 1))
    assert np.array_equal(np.flatnonzero(master.fixed.all(axis=1)), np.flatnonzero(master.nodes[:, 1] == -1))
    assert not master.imposed.any()
    trace = solve(scene, load_subject("mortar").with_penalty(scene.penalty))
    assert trace.end is End.CONVERGED
    assert trace.forces.any()
    assert describe_bodies(scene) == [
        "slave: 21 cells, E = 1, ν = 0.3, 8 nodes held, moved by (0, -0.0676)",
        "master: 36 cells, E = 1000, ν = 0.25, 13 nodes held",
    ]


def test_supports_are_those_that_the_user_says(curved: Path) -> None:
    slave, master = read_scene(curved, **SIDES, supports={"lid": (None, -0.1), "3": (0.0, None)}).bodies
    lid, arc = slave.nodes[:, 1] == 1, np.isin(np.arange(len(slave.nodes)), slave.contact)
    assert np.array_equal(slave.fixed, np.column_stack([arc, lid]))
    assert np.array_equal(slave.imposed[:, 1], np.where(lid, -0.1, 0))
    assert master.fixed.any()


def test_triangles_and_quadrilaterals_of_one_body_become_triangles(tmp_path: Path) -> None:
    slave, master = read_scene(write_curved_bodies(tmp_path / "mixed.msh", cells="mixed"), **SIDES).bodies
    assert slave.cells.shape == (42, 3)
    assert master.cells.shape == (72, 3)


def test_lines_without_cells_are_a_rigid_body(tmp_path: Path) -> None:
    path = write_curved_bodies(tmp_path / "rigid.msh", with_base=False)
    with pytest.raises(MisuseError, match="bodies on the same side"):
        read_scene(path, **SIDES)
    slave, master = read_scene(path, **SIDES, flip="master").bodies
    assert (slave.rigid, master.rigid) == (False, True)


def test_supports_that_do_not_hold_a_body_are_refused() -> None:
    with pytest.raises(MisuseError, match=r"^supports of slave body: found too few: it can .*; needed fixed comp"):
        read_scene(PUNCH, slave="punch", master="base", supports={"punch": (None, 0.0)})


@pytest.mark.parametrize(("way", "gap"), [(0.03, "0.03"), (0.0, "0"), (None, "0")])
def test_supports_that_leave_the_bodies_apart_are_refused(way: float | None, gap: str) -> None:
    supports = {"punch body": (0.0, way)}
    with pytest.raises(MisuseError, match=f"--support: found supports that leave the bodies {gap} apart; needed"):
        read_scene(PUNCH, slave="punch", master="base", supports=supports)


def test_a_body_that_surrounds_its_contact_is_held_on_its_other_boundary(tmp_path: Path) -> None:
    angles = np.linspace(0, 2 * np.pi, 17)[:-1]
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(16)])
    ring = np.arange(16)
    after = np.roll(ring, -1)
    outer = np.column_stack([ring, ring + 16, after + 16, after])  # Circles of radii 1.1 and 2, and 0.5 and 1.
    cells = np.vstack([outer, outer + 32])
    lines = np.vstack([np.column_stack([ring, after]), np.column_stack([ring, after]) + 48])
    tags = [np.full(16, 1), np.full(16, 2), np.full(32, 3)]
    mesh = meshlane.Mesh(
        np.vstack([radius * circle for radius in (1.1, 2.0, 0.5, 1.0)]),
        [("line", lines[:16]), ("line", lines[16:]), ("quad", cells)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
    )
    meshlane.write(tmp_path / "rings.msh", mesh, file_format="gmsh22", binary=False)
    scene = read_scene(tmp_path / "rings.msh", slave="2", master="1", materials={"3": (5.0, 0.0)})
    assert [body.fixed.all(axis=1).sum() for body in scene.bodies] == [16, 16]
    assert [body.imposed.any() for body in scene.bodies] == [False, False]
    assert [body.young for body in scene.bodies] == [5.0, 5.0]


WRONG = [
    ({"materials": {"bass": (1.0, 0.3)}}, r"--material: found 'bass', which is no group of the file; needed 'base'.*"),
    ({"materials": {"base": (0.0, 0.3)}}, r"--material: found E = 0, ν = 0.3 of 'base'; needed .*E > 0 and .*"),
    ({"materials": {"base": (1.0, 0.5)}}, r"--material: found E = 1, ν = 0.5 of 'base'; needed .*ν < 0.5"),
    (
        {"materials": {"base": (1.0, 0.3), "top": (2.0, 0.3)}},
        r"--material: found two materials of one body, those of 'base' and 'top'; needed one for each body.*",
    ),
    ({"supports": {"lit": (0.0, 0.0)}}, r"--support: found 'lit', which is no group of the file; needed 'lid'\?.*"),
    ({"slave": "lid"}, r"--mesh: found bodies on the same side.*"),
    ({"master": "lid"}, r"--mesh: found the slave at .* with the body between; needed two sides that face each .*"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG)
def test_a_wrong_scene_is_refused(curved: Path, arguments: dict[str, object], message: str) -> None:
    with pytest.raises(MisuseError, match=f"(?s)^{message}$"):
        read_scene(curved, **{**SIDES, **arguments})  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ["base", "base=", "base=1", "base=1,0.3,2", "=1,0.3", "base=nan,0.3", "base=free,0.3"])
def test_a_material_that_cannot_be_read_is_refused(text: str) -> None:
    with pytest.raises(MisuseError, match=r"^--material: found '.*'; needed GROUP=E,ν such as base=1000,0.3$"):
        parse_material(text)


def test_materials_and_supports_are_read() -> None:
    assert parse_material("a=b=1e3,0.25") == ("a=b", (1000.0, 0.25))
    assert parse_support("lid=free,-0.1") == ("lid", (None, -0.1))
    with pytest.raises(MisuseError, match=r"^--support: found 'lid=loose,0'; needed GROUP=X,Y .*$"):
        parse_support("lid=loose,0")


def test_the_punch_of_the_documentation_is_a_scene() -> None:
    scene = read_scene(PUNCH, slave="punch", master="base", materials={"base body": (1000.0, 0.3)})
    assert isinstance(scene, Scene)
    assert [body.young for body in scene.bodies] == [1.0, 1000.0]
