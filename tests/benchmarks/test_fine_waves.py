"""Rows of cells that grow with depth, and the stored table of interfaces of 512 to 2,048 segments."""

import csv

import numpy as np
import pytest
from fine_waves import FILE, FORMULATIONS, GROWTH, HEADS, INSTANCES, solve

from contactverif import Traits
from contactverif.problems.problem import Variation
from contactverif.problems.wavy import pose_wavy


def test_rows_begin_square_and_grow() -> None:
    equal, growing = (pose_wavy(64, 10.0, Traits(), Variation(), growth).scene.bodies[0] for growth in (0.0, GROWTH))
    assert len(growing.nodes) < 0.8 * len(equal.nodes)
    heights = np.diff(np.unique(growing.nodes[growing.nodes[:, 0] == 0, 1]))
    assert heights[0] == pytest.approx(4 / 64, rel=0.05)
    assert heights[1:] == pytest.approx((1 + GROWTH) * heights[:-1])


def test_a_line_has_the_errors_of_a_solution() -> None:
    line = dict(zip(HEADS, solve("sts", 16, 0), strict=True))
    assert (line["formulation"], line["mesh"]) == ("sts", 16)
    assert float(line["forces"]) < 0.02


def test_the_stored_table_has_all_formulations_on_each_mesh_that_it_has() -> None:
    with FILE.open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    meshes = [(str(mesh), str(number)) for mesh, count in INSTANCES.items() for number in range(count)]
    runs = [(*mesh, name) for mesh in meshes for name in FORMULATIONS]
    stored = [(line["mesh"], line["instance"], line["formulation"]) for line in lines]
    assert stored == runs[: len(stored)]
    assert stored
    assert len(stored) % len(FORMULATIONS) == 0
    for line in lines:  # Nodes with areas converge to forces that are 10 % off.
        assert (float(line["forces"]) < 5e-5) is (line["formulation"] != "nts-ar")
