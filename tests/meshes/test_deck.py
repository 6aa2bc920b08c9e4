"""Decks of Abaqus and CalculiX: what is read, on which side the body of a surface is, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from contactverif.meshes.deck import read_deck
from contactverif.meshes.plain_mesh import PlainMesh

# Two squares, one above the other with a gap of 0.5. Nodes 1 to 4 and 11 to 14, elements 1 and 2.
FOUR = "*NODE, NSET=ALL\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n"
LOW = "*ELEMENT, TYPE=CPE4, ELSET=LOW\n1,1,2,3,4\n"
NODES = FOUR + "11,0,1.5\n12,1,1.5\n13,1,2.5\n14,0,2.5\n"
CELLS = LOW + "*ELEMENT, TYPE=CPE4, ELSET=UP\n2,11,12,13,14\n"
SURFACES = "*SURFACE, NAME=Top\nLOW, S3\n*SURFACE, NAME=Bottom\nUP, S1\n"
SQUARES = NODES + CELLS
TOP, BOTTOM = [[2, 3]], [[4, 5]]

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
# {type: (its corners in the cube, corners of the faces)}: as in the manual of CalculiX and in the library of Abaqus.
FACES = {
    "CPE3": ([0, 1, 3], "12 23 31"),
    "CAX4R": ([0, 1, 2, 3], "12 23 34 41"),
    "C3D4": ([0, 1, 3, 4], "123 142 243 341"),
    "C3D6": ([0, 1, 3, 4, 5, 7], "123 456 1254 2365 3146"),
    "C3D8I": ([0, 1, 2, 3, 4, 5, 6, 7], "1234 5876 1562 2673 3784 4851"),
}


def read(folder: Path, text: str | bytes) -> PlainMesh:
    path = folder / "deck.inp"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_deck(str(path), str(path))


def sides(mesh: PlainMesh, name: str) -> list[list[int]]:
    return [side for part in mesh.groups[name].values() for side in part.tolist()]


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("name", FACES)
def test_a_solid_cell_is_behind_each_of_its_faces(tmp_path: Path, name: str, mirrored: bool) -> None:
    corners, faces = FACES[name]
    points = CUBE[corners] * [-1 if mirrored else 1, 1, 1]
    text = "*NODE\n" + "".join(f"{n}, {x}, {y}, {z}\n" for n, (x, y, z) in enumerate(points, 1))
    text += f"*ELEMENT, TYPE={name}\n7, {', '.join('12345678'[: len(points)])}\n*SURFACE, NAME=SKIN\n7\n"
    text += "".join(f"*SURFACE, NAME=F{n}\n7, S{n}\n" for n in range(1, len(faces.split()) + 1))
    mesh = read(tmp_path, text)
    for number, face in enumerate(faces.split(), 1):
        (side,) = sides(mesh, f"F{number}")
        assert {str(node + 1) for node in side} == {*face}
        a, b, *rest = points[side]
        normal = np.cross(b - a, rest[0] - a if rest else [0, 0, 1])
        assert normal @ (points.mean(axis=0) - a) < 0
    assert sorted(sorted(side) for side in sides(mesh, "SKIN")) == sorted(
        sorted(int(node) - 1 for node in face) for face in faces.split()
    )


@pytest.mark.parametrize(
    "row",
    # The normal of a line is on its left, so the body is on its right. In CalculiX S1 is the negative side of a shell.
    [
        "R2D2 SPOS 21",
        "T2D2 SNEG 12",
        "S3 SPOS 123",
        "S4R SNEG 4321",
        "R3D4 SPOS 1234",
        "S4 S1 4321",
    ],
)
def test_the_body_of_a_thin_cell_is_behind_its_face(tmp_path: Path, row: str) -> None:
    name, face, corners = row.split()
    text = f"{NODES}*ELEMENT, TYPE={name}, ELSET=E\n5, {', '.join(sorted(corners))}\n*SURFACE, NAME=A\nE, {face}\n"
    assert sides(read(tmp_path, text), "A") == [[int(node) - 1 for node in corners]]


def test_an_edge_of_a_shell_is_a_face_as_cgx_writes_it(tmp_path: Path) -> None:
    mesh = read(tmp_path, FOUR + "*ELEMENT, TYPE=S4\n7,1,2,3,4\n*SURFACE, NAME=TOP\n7, S5\n")
    assert sides(mesh, "TOP") == TOP


@pytest.mark.parametrize(
    "text",
    [
        SQUARES + SURFACES,
        "\ufeff" + (SQUARES + SURFACES).replace("\n", "\r\n"),
        (SQUARES + SURFACES).lower().replace("top", "Top").replace("bottom", "Bottom"),
        b"** Gr\xfc\xdfe\n" + (SQUARES + SURFACES).encode(),
        (SQUARES + SURFACES).replace(", ", " ,\t").replace("*NODE ,", "  * NODE,\n** continued\n "),
        NODES.replace("11,0,1.5", "*NODE\n11, 0., 1.5D0, 0.") + CELLS + SURFACES,
        NODES + CELLS.replace("1,1,2,", "1,1,\n2,") + SURFACES,
        NODES + CELLS.replace("1,1,2,", "1,1\n2,").replace("=LOW", "=LOW,") + SURFACES + "*\n",
        SQUARES + SURFACES + "*SURFACE, NAME=TOP, TYPE=NODE\nALL\n",
        SURFACES + CELLS + NODES,
        SQUARES + "*ELSET, ELSET=A, GENERATE\n1, 1, 1\n*ELSET, ELSET=B\nA\n" + SURFACES.replace("LOW", "B"),
        SQUARES + "*SURFACE, NAME=Top, TYPE=ELEMENT\n1, S3\n*SURFACE, NAME=Bottom\n2, S1\n",
        SQUARES + SURFACES + '*SURFACE, NAME="Top "\nUP, S3\n',
    ],
    ids=map(str, range(13)),
)
def test_a_deck_is_read_however_it_is_written(tmp_path: Path, text: str | bytes) -> None:
    mesh = read(tmp_path, text)
    assert (sides(mesh, "Top"), sides(mesh, "Bottom")) == (TOP, BOTTOM)
    assert mesh.points.shape == (8, 2)
    assert mesh.cells["quad"].tolist() == [[0, 1, 2, 3], [4, 5, 6, 7]]


def test_pairs_materials_sets_and_names_are_those_of_the_deck(tmp_path: Path) -> None:
    extra = (
        "*NSET, NSET=N\n1, 4\n*NSET, NSET=N\n11\n*ELSET, ELSET=TOP\n2\n*SURFACE, NAME=P, TYPE=NODE\nN\n12\n"
        "*MATERIAL, NAME=steel\n*ELASTIC\n2.1E5, 0.3, 20.\n1., 0.3, 100.\n*SOLID SECTION, ELSET=LOW, MATERIAL=Steel\n"
        "*CONTACT PAIR, INTERACTION=I, TYPE=NODE TO SURFACE, ADJUST=0.1\nBOTTOM, top\np, TOP\nTop\n*TIE\nx, y\n"
        "*ELSET, ELSET=GEN, GENERATE\n1, 3\n*SURFACE, NAME=TWICE\nLOW, S3\n1, S3\n*NSET, NSET=EMPTY\n"
    )
    ties = "*HEADING\nblocks\n*TIE, NAME=GLUE\nTop, BOTTOM\n*Solid  Print\n*Fluid Law\n*Step\n*Boundary\n1, 1\n*CLOAD\n"
    tied = read(tmp_path, SQUARES + SURFACES + ties)
    assert tied.pairs == (("Top", "Bottom"),)
    assert tied.warnings == "Not read: *FLUID LAW.\nSupports and loads are not those of the deck (*BOUNDARY, *CLOAD).\n"
    mesh = read(tmp_path, SQUARES + SURFACES + extra)
    assert mesh.pairs == (("Bottom", "Top"), ("P", "Top"))
    assert mesh.materials == {"LOW": (2.1e5, 0.3)}
    assert mesh.groups["N"]["vertex"].tolist() == [[0], [3], [4]]
    assert mesh.groups["P"]["vertex"].tolist() == [[0], [3], [4], [5]]
    assert mesh.groups["TOP"]["quad"].tolist() == [[4, 5, 6, 7]]
    assert mesh.warnings == (
        "The surface TWICE has 1 of its sides twice.\nELSET GEN: 2 of 3 numbers are in the deck.\n"
        "NSET EMPTY has no members that are read.\n"
        "Not read: the contact of Top with itself.\n*CONTACT PAIR: ADJUST is not read; no node is moved.\n"
    )


def test_instances_are_moved_and_their_names_have_their_own_in_front(tmp_path: Path) -> None:
    assembly = (
        "*Surface, name=S\nLOW, S3\n*End Part\n*Assembly, name=A\n*Instance, name=I-1, part=P\n*End Instance\n"
        "*Instance, name=I-2, part=P\n0., 3., 0.\n1., 3., 0., 1., 3., 1., 180.\n*Elset, elset=own\n1\n*End Instance\n"
        "*Elset, elset=_E, internal, instance=I-1\n1\n*Surface, name=T\n_E, S3\nI-2.LOW, S1\n"
        "*Nset, nset=N\nI-2.3\n*End Assembly\n*Contact Pair, interaction=I\nI-2.S, T\n"
    )
    mesh = read(tmp_path, "*Part, name=P\n" + FOUR + LOW + assembly)
    turned = [[2, 3], [1, 3], [1, 2], [2, 2]]  # The sine of 180° is half a rounding of π, and arms are at most 1 long.
    np.testing.assert_allclose(mesh.points[4:], turned, rtol=0, atol=4 * np.finfo(float).eps)
    assert mesh.pairs == (("I-2.S", "T"),)
    assert (sides(mesh, "I-1.S"), sides(mesh, "I-2.S")) == ([[2, 3]], [[6, 7]])
    assert sides(mesh, "T") == [[2, 3], [4, 5]]
    assert sides(mesh, "N") == [[6]]
    assert "S" not in mesh.groups
    assert sides(mesh, "own") == sides(mesh, "I-2.own") == [[4, 5, 6, 7]]


def test_files_that_a_deck_includes_are_read_in_their_place(tmp_path: Path) -> None:
    (tmp_path / "mesh.inc").write_text(NODES + "*ELEMENT, TYPE=CPE4, ELSET=UP, INPUT=up.txt\n*INCLUDE, INPUT=low.inc\n")
    (tmp_path / "up.txt").write_text("2,11,12,13,14")
    (tmp_path / "low.inc").write_text(LOW)
    mesh = read(tmp_path, '*Include, input="mesh.inc"\n' + SURFACES)
    assert (sides(mesh, "Top"), sides(mesh, "Bottom")) == (TOP, BOTTOM)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("*INCLUDE, INPUT=deck.inp\n", "line 1: *INCLUDE: found deck.inp; needed an ordinary file"),
        (NODES + "*NODE\n4, 0, 2\n", "line 11: *NODE: found 4, which is no number or is in use"),
        (SQUARES + "*ELSET, ELSET=LOW\n3\n", "line 15: *ELSET: found 3; needed a number or an ELSET of the deck"),
        (SQUARES + "*NSET, NSET=A\nB\n*NSET, NSET=B\nA\n", "no sets in a circle"),
        (NODES + CELLS.replace("1,1,2,3,4", "1,1,2,3"), "line 11: *ELEMENT: found 4 numbers; needed 5"),
        (NODES + CELLS.replace("1,1,2,3,4", "1,1,2,3,5"), "node '5'; needed nodes of the deck"),
        (NODES + "*ELEMENT, TYPE=C3D20R\n", "quadratic elements C3D20R; needed elements of first order"),
        (SQUARES + "*NCOPY, CHANGE NUMBER=10\n", "line 14: *NCOPY: found this card, which makes or moves nodes"),
        (SQUARES + "*SURFACE, NAME=A\nLOW, S5\n", "face S5 of elements CPE4; needed S1, S2, S3, S4"),
        (SQUARES + "*ELEMENT, TYPE=MASS\n9, 1\n*SURFACE, NAME=A\n9, S1\n", "needed elements that are read"),
        (
            SQUARES + SURFACES + "*CONTACT PAIR\nTop, Low\n",
            "found Low, which is no surface of faces or nodes; needed two",
        ),
        (NODES, "needed a deck with *NODE and *ELEMENT"),
        (NODES.replace("1,0,0", "1,0,x"), "line 2: *NODE: found 0, x"),
        (NODES.replace("*NODE", "*NODE, SYSTEM=C"), "needed rectangular coordinates"),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ValueError, match=r"line \d+") as error:
        read(tmp_path, text)
    assert message in str(error.value)
