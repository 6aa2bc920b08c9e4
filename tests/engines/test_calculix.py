"""The deck of CalculiX holds what the scene does; where the program is there, its answers are those of the scene."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from subjects import load_property

from contactverif import Verdict, judge_case, load_scene
from contactverif.contract.subject import EngineSubject
from contactverif.problems.catalogue import load_scene_case
from contactverif_engines.calculix import (
    FIELD,
    LEAST_FORCE,
    CalculiX,
    Layer,
    in_larger_units,
    make_layer,
    read_displacements,
    write_deck,
)

needs_program = pytest.mark.skipif(shutil.which("ccx") is None, reason="ccx is not installed")


def layer_of(name: str) -> Layer:
    return make_layer(load_scene(name).arrays(lowered=True))


def block_of(lines: list[str], keyword: str) -> list[list[float]]:
    """Return the numbers below each line that begins with a keyword."""
    rows, inside = [], False
    for line in lines:
        if line.startswith("*"):
            inside = line.startswith(keyword)
        elif inside:
            rows.append([float(word) for word in line.split(",")])
    return rows


@pytest.mark.parametrize("name", ["c", "a1", "c:degrees=17", "example-2"])
def test_a_deck_read_back_is_the_scene(name: str) -> None:
    layer = layer_of(name)
    lines = write_deck(layer, "surface")
    nodes = np.array(block_of(lines, "*NODE,"))
    np.testing.assert_allclose(nodes[:, 1:], layer.nodes, rtol=1e-13, atol=1e-300)
    assert len(block_of(lines, "*ELEMENT")) == sum(len(cells) for cells, _ in layer.solids)
    supports = block_of(lines, "*BOUNDARY")
    assert len(supports) == len(layer.nodes) + layer.fixed.sum()
    imposed = {(int(row[0]) - 1, int(row[1]) - 1): row[3] for row in supports if len(row) == 4}
    for (node, part), value in imposed.items():
        assert value == pytest.approx(layer.imposed[node, part], rel=1e-13)
    loads = block_of(lines, "*CLOAD")
    assert sum(row[2] for row in loads) == pytest.approx(layer.load.sum(), rel=1e-12)
    fields = [word.strip() for line in lines if not line.startswith("*") for word in line.split(",")]
    assert max(map(len, fields)) <= FIELD
    assert all(line.isascii() for line in lines)


def test_the_faces_of_both_surfaces_are_faces_of_elements() -> None:
    lines = write_deck(layer_of("c"), "surface")
    slave = lines[lines.index("*SURFACE, NAME=SLAVE, TYPE=ELEMENT") + 1 :]
    count = next(number for number, line in enumerate(slave) if line.startswith("*"))
    assert count == len(load_scene("c").interface.slave)


@pytest.mark.parametrize("unit", [1.0, 2.0**-20])
def test_forces_are_large_numbers_in_whatever_unit_of_length(unit: float) -> None:
    scene = load_scene("c").arrays(lowered=True)
    scene = in_larger_units(replace(scene, nodes=unit * scene.nodes, unit=unit * scene.unit))
    assert scene.young.max() * scene.unit**2 >= LEAST_FORCE / 2  # A power of two may round it down.


def test_the_last_displacements_count() -> None:
    text = (
        " displacements (vx,vy,vz) for set ALL and time  0.5000000E+00\n\n 1 9. 9. 9.\n"
        " displacements (vx,vy,vz) for set ALL and time  0.1000000E+01\n\n 1 1.5 -2. 0.\n 3 7. 7. 7.\n"
    )
    displacements, time = read_displacements(text, 2)
    assert time == 1.0
    np.testing.assert_array_equal(displacements, [[1.5, -2.0], [0.0, 0.0]])


@needs_program
@pytest.mark.parametrize("scene", ["a1", "c", "c:degrees=17"])
def test_surfaces_pass_and_nodes_fail(scene: str) -> None:
    question, case = load_property("patch.flat.solve"), load_scene_case(scene)
    assert judge_case(question, case, EngineSubject("engine/calculix", CalculiX())).verdict is Verdict.PASS
    nodes = judge_case(question, case, EngineSubject("engine/calculix:kind=nodes", CalculiX("nodes")))
    assert nodes.verdict is (Verdict.PASS if scene == "a1" else Verdict.FAIL)
