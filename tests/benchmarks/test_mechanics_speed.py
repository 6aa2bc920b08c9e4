"""Condensation beside its one factorisation, and a solved patch test beside a script that a user would write."""

from typing import Any

import numpy as np
import pytest
from plain_skfem import TwoBlocks, exact_pressure
from plain_skfem import solve as plain
from racing import Race
from scipy.sparse.linalg import splu
from subjects import load_property, load_subject

from contactverif import Rectangle, Scene, Subject, block, judge_case, solve, two_blocks
from contactverif.mechanics.bulk import assemble_stiffness, condense, forget_condensed
from contactverif.mechanics.scene import forget_bodies
from contactverif.problems.uniform_stress import stress_error

N_MESHES = 10
ROUNDOFF = 1e-11  # The stress error of the plain script and of ours.


def random_blocks() -> list[TwoBlocks]:
    """Return random pairs of blocks of equal width, integer nodes, 1 to 6 segments a side and 1 to 3 layers."""
    random = np.random.default_rng(1)
    pairs = []
    for _ in range(N_MESHES):
        width = int(random.integers(6, 25))
        inner = [random.choice(np.arange(1, width), int(random.integers(0, 6)), replace=False) for _ in range(2)]
        slave_x, master_x = (np.sort(np.concatenate([[0, width], nodes])).astype(float) for nodes in inner)
        layers = [np.concatenate([[0], np.cumsum(random.integers(1, 5, random.integers(1, 4)))]) for _ in range(2)]
        slave_y, master_y = layers[0].astype(float), (layers[1] - layers[1][-1]).astype(float)
        pairs.append(TwoBlocks(slave_x, slave_y, master_x, master_y, (1.0, 3.0), (0.3, 0.2), 0.1, 10.0))
    return pairs


def make_scene(blocks: TwoBlocks) -> Scene:
    """Return the two blocks as a scene."""
    return two_blocks(
        Rectangle(blocks.slave_x, blocks.slave_y, young=blocks.young[0], poisson=blocks.poisson[0]),
        Rectangle(blocks.master_x, blocks.master_y, young=blocks.young[1], poisson=blocks.poisson[1]),
        penalty=blocks.penalty,
        approach=blocks.approach,
    )


def solve_as_scene(blocks: TwoBlocks, subject: Subject) -> float:
    """Do what the plain script does: mesh, bodies, solution, and the comparison of the stresses with the exact ones."""
    scene = make_scene(blocks)
    trace = solve(scene, subject.with_penalty(blocks.penalty))
    return stress_error(scene, scene.stresses(trace.solution), exact_pressure(blocks))


@pytest.mark.parametrize("n_cells", [8, 40])
def test_condensation(race: Race, benchmark: Any, n_cells: int) -> None:
    benchmark.group = "condensation of a square block, cells a side"
    line = np.arange(n_cells + 1.0)
    body = block(Rectangle(line, line), contact="bottom", approach=0.0)
    free = np.flatnonzero(~body.fixed.ravel())
    matrix = assemble_stiffness(body)[0][free][:, free]
    compressed = matrix.tocsc() if hasattr(matrix, "tocsc") else None

    def call() -> None:
        forget_condensed()
        condense(body)

    if compressed is None:
        race(call, lambda: np.linalg.cholesky(matrix), "numpy factorises the stiffness")
    else:
        race(call, lambda: splu(compressed), "scipy factorises the stiffness")


def test_blocks_solved_and_compared_with_the_exact_stress(race: Race, benchmark: Any) -> None:
    benchmark.group = "random patch tests"
    every, subject = random_blocks(), load_subject("vts-ppt")
    assert max(solve_as_scene(blocks, subject) for blocks in every) < ROUNDOFF
    assert max(map(plain, every)) < ROUNDOFF
    race(
        lambda: [solve_as_scene(blocks, subject) for blocks in every],
        lambda: [plain(blocks) for blocks in every],
        "a plain scikit-fem script",
    )


def test_blocks_judged_by_all_quantities(race: Race, benchmark: Any) -> None:
    benchmark.group = "random patch tests"
    every, subject, question = random_blocks(), load_subject("vts-ppt"), load_property("patch.flat.solve")

    def judge_all() -> None:
        forget_bodies()
        for blocks in every:
            judge_case(question, make_scene(blocks).case(), subject)

    race(judge_all, lambda: [plain(blocks) for blocks in every], "a plain scikit-fem script")
