"""Scenes from meshes with tetrahedra or hexahedra: two blocks of a Gmsh file and of a deck, and what is refused."""

from pathlib import Path

import meshlane
import numpy as np
import pytest
from subjects import load_subject

from contactverif import End, MisuseError, Scene, Verdict, load_properties, read_scene, solve
from contactverif.contract.interface import Surface, mean_normal, ways_to_master
from contactverif.mechanics.bulk import elasticity
from contactverif.meshes.mesh_scene import describe_bodies, parse_support
from contactverif.problems.space_blocks import extrude, rectangle
from contactverif.problems.space_problems import SHELLS
from contactverif.run.run import run

CELLS = {3: ("triangle", "tetra", "C3D4"), 4: ("quad", "hexahedron", "C3D8")}
LAYERS, GAP = 2, 0.125
ON_ANY_SCENE = {"newton.history", "newton.units", "newton.attainable"}  # On flat blocks one step is enough: no order.


def make_blocks(corners: int) -> tuple[list[np.ndarray], list[np.ndarray], list[np.ndarray]]:
    """Return the points, contact faces and cells of a block of 2 × 1.5 × 1 above another one, each numbered from 0."""
    points, faces, cells = [], [], []
    for counts, level, sign in (((4, 3), GAP, 1.0), ((3, 2), 0.0, -1.0)):
        lines = (np.linspace(0.0, side, n + 1) for side, n in zip((2.0, 1.5), counts, strict=True))
        flat, below = rectangle(*lines, corners)
        below = below[:, ::-1] if sign > 0 else below
        heights = level + sign * np.repeat(np.linspace(0, 1, LAYERS + 1), len(flat))
        points.append(np.column_stack([np.tile(flat, (LAYERS + 1, 1)), heights]))
        faces.append(below)
        cells.append(extrude(below, len(flat), LAYERS))
    return points, faces, cells


def write_gmsh(path: Path, corners: int, *, extra: tuple[tuple[str, np.ndarray], ...] = ()) -> Path:
    """Write the blocks with the groups punch, base, lid and two bodies; every other cell is inside out."""
    points, faces, cells = make_blocks(corners)
    face, solid, _ = CELLS[corners]
    first, lid = len(points[0]), faces[0] + LAYERS * len(points[0]) // (LAYERS + 1)
    turned = cells[1] + first
    turned[::2] = turned[::2][:, [0, 2, 1, 3] if corners == 3 else [4, 5, 6, 7, 0, 1, 2, 3]]
    parts = [(face, faces[0]), (face, faces[1] + first), (face, lid), (solid, cells[0]), (solid, turned), *extra]
    tags = [np.full(len(data), number) for number, (_, data) in enumerate(parts, 1)]
    names = {"punch": (1, 2), "base": (2, 2), "lid": (3, 2), "upper": (4, 3), "lower": (5, 3)}
    mesh = meshlane.Mesh(
        np.vstack(points),
        parts,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={name: np.array(value) for name, value in names.items()},
    )
    meshlane.write(path, mesh, file_format="gmsh22", binary=False)
    return path


def write_deck(path: Path, corners: int) -> Path:
    """Write them as a deck whose contact pair, sections and materials say everything."""
    points, faces, cells = make_blocks(corners)
    places, element = np.vstack(points).tolist(), 0
    lines = ["*NODE", *(f"{node}, {', '.join(map(str, place))}" for node, place in enumerate(places, 1))]
    for name, part, touching, first in zip(("UP", "LOW"), cells, faces, (1, 1 + len(points[0])), strict=True):
        lines.append(f"*ELEMENT, TYPE={CELLS[corners][2]}, ELSET={name}")
        start = element + 1
        for row in (part + first).tolist():
            element += 1
            lines.append(", ".join(map(str, [element, *row])))
        # `extrude` begins with the cells behind the faces, whose first side is the face.
        lines += [f"*SURFACE, TYPE=ELEMENT, NAME={name}FACE"]
        lines += [f"{start + number}, S1" for number in range(len(touching))]
        lines += [f"*MATERIAL, NAME=M{name}", "*ELASTIC", "1000., 0.3" if name == "UP" else "300., 0.2"]
        lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL=M{name}"]
    path.write_text("\n".join([*lines, "*CONTACT PAIR, INTERACTION=I", "UPFACE, LOWFACE", ""]), encoding="utf-8")
    return path


@pytest.fixture(name="scene", params=[("msh", 3), ("msh", 4), ("inp", 3), ("inp", 4)], ids=str)
def read(request: pytest.FixtureRequest, tmp_path: Path) -> Scene:
    suffix, corners = request.param
    if suffix == "inp":
        return read_scene(write_deck(tmp_path / "blocks.inp", corners))
    path, materials = write_gmsh(tmp_path / "blocks.msh", corners), {"upper": (1000.0, 0.3), "lower": (300.0, 0.2)}
    return read_scene(path, slave="punch", master="base", materials=materials)


def test_two_blocks_are_held_far_from_the_contact_pushed_and_solved(scene: Scene) -> None:
    slave, master = scene.bodies
    assert [(body.young, body.poisson) for body in scene.bodies] == [(1000.0, 0.3), (300.0, 0.2)]
    assert np.array_equal(slave.fixed.all(axis=1), slave.nodes[:, 2] == 1 + GAP)
    assert np.array_equal(master.fixed.all(axis=1), master.nodes[:, 2] == -1)
    assert slave.imposed[slave.fixed[:, 0]] == pytest.approx(np.tile([0, 0, -GAP - 0.01], (20, 1)))
    corners = scene.interface.slave.faces.shape[1]
    area = 0.125 if corners == 3 else 0.25
    assert scene.penalty == pytest.approx(300 / area**0.5)
    lines = describe_bodies(scene)
    assert lines[0] == f"slave: {len(slave.cells)} cells, E = 1000, ν = 0.3, 20 nodes held, moved by (0, 0, -0.135)"
    trace = solve(scene, load_subject("sts-3d").with_penalty(scene.penalty))
    assert trace.end is End.CONVERGED
    pressing = trace.forces.reshape(-1, 3)[: scene.interface.n_slave_nodes].sum(axis=0)
    modulus = 1 / sum(1 / elasticity(body)[2, 2] for body in scene.bodies)
    assert 0.5 < abs(pressing[2]) / (3.0 * 0.01 * modulus) < 1.0


@pytest.mark.parametrize("corners", [3, 4])
def test_properties_about_bodies_are_judged_or_say_what_they_need(tmp_path: Path, corners: int) -> None:
    scene = read_scene(write_gmsh(tmp_path / "blocks.msh", corners), slave="punch", master="base")
    properties = load_properties(["newton.*", "patch.flat.*", "accuracy.*", "hard.contrast", "balance.*"])
    result = run([load_subject("sts-3d")], properties, place=scene.case(), examples=2, seed=1)
    verdicts = {row.property_id: row.verdict for row in result.rows}
    assert {id_ for id_, verdict in verdicts.items() if verdict is Verdict.PASS} >= {*ON_ANY_SCENE, "balance.force"}
    assert not {Verdict.FAIL, Verdict.CRASHED, Verdict.NOT_JUDGED} & {*verdicts.values()}


def test_supports_have_three_numbers(tmp_path: Path) -> None:
    path = write_gmsh(tmp_path / "blocks.msh", 4)
    scene = read_scene(
        path, slave="punch", master="base", supports=dict(map(parse_support, ["lid=free,0,-0.2", "punch=0,free,free"]))
    )
    lid, punch = (scene.bodies[0].nodes[:, 2] == level for level in (1 + GAP, GAP))
    assert np.array_equal(scene.bodies[0].fixed, np.column_stack([punch, lid, lid]))
    with pytest.raises(MisuseError, match=r"^--support: found lid=0,free; needed 3 numbers, one along each axis$"):
        read_scene(path, slave="punch", master="base", supports={"lid": (0.0, None)})
    with pytest.raises(MisuseError, match=r"--support: found supports that leave the bodies 0.025 apart"):
        read_scene(path, slave="punch", master="base", supports={"lid": (0.0, 0.0, -0.1)})


@pytest.mark.parametrize(
    ("kind", "cell", "words"),
    [
        ("wedge", [40, 41, 45, 20, 21, 25], "tetrahedra and wedges"),
        ("hexahedron", [40, 41, 46, 45, 20, 21, 26, 25], "tetrahedra and hexahedra"),
        ("tetra10", [*range(40, 50)], "tetrahedra and cells of 10 nodes"),
    ],
)
def test_a_body_of_several_kinds_of_cells_is_refused(tmp_path: Path, kind: str, cell: list[int], words: str) -> None:
    path = write_gmsh(tmp_path / "mixed.msh", 3, extra=((kind, np.array([cell])),))
    with pytest.raises(MisuseError, match=f"--mesh: found a body of {words}; needed tetrahedra alone or hexahedra"):
        read_scene(path, slave="punch", master="base")


def test_nodes_look_for_the_master_along_the_slave() -> None:
    """From a plane along its normal; from a closed sphere each node along its own."""
    scene = SHELLS.scene(inner_slave=True, whole=True)
    ways, directions = ways_to_master(scene.interface)
    nodes = scene.interface.nodes[: len(ways)]
    assert (directions * nodes).sum(axis=1) == pytest.approx(np.linalg.norm(nodes, axis=1), rel=0.01)
    assert np.isfinite(ways).all()
    assert ways == pytest.approx(-SHELLS.interference, abs=0.06)
    assert mean_normal(Surface([[0, 2, 1]]), np.eye(3)) == pytest.approx(-(3**-0.5) * np.ones(3))
