"""Time a random patch test, everything included, and the same test in a script that a user would have written.

The ratios are printed; no verdict hangs on a clock.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from plain_skfem import TwoBlocks, exact_pressure
from plain_skfem import solve as plain
from test_speed import time_in_turns

from contactverif.contract.subject import Subject
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import Scene, forget_bodies, scene_of
from contactverif.mechanics.simple_bodies import Rectangle
from contactverif.run.driver import draw_cases
from contactverif.run.registry import load_formulation
from contactverif.run.runner import judge_case
from contactverif.scenes.blocks import two_blocks
from contactverif.scenes.uniform_stress import stress_error
from contactverif.strategies.solids import block_cases
from contactverif_properties.flat_solve import FLAT_SOLVE
from contactverif_properties.shared.solved_patch import measure_at_penalty

N_MESHES = 40


def formulation(name: str = "vts-ppt") -> Subject:
    subject = load_formulation(name)
    assert isinstance(subject, Subject)
    return subject


def meshes() -> list[TwoBlocks]:
    """Random pairs of blocks of equal width, integer nodes, 1 to 6 segments a side and 1 to 3 layers."""
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


def judge_as_property(blocks: TwoBlocks, subject: Subject) -> float:
    """Compute all that the property needs: forces on both sides, gaps, pressures, tolerances."""
    return measure_at_penalty(make_scene(blocks).case(), subject, blocks.penalty).values["stress error"]


def test_beside_the_plain_script(benchmark: Any, capsys: pytest.CaptureFixture[str]) -> None:
    benchmark.group = "the same two blocks, solved and held against the exact stress"
    subject, every = formulation(), meshes()
    for way in (
        lambda blocks: solve_as_scene(blocks, subject),
        lambda blocks: judge_as_property(blocks, subject),
        plain,
    ):
        assert max(way(blocks) for blocks in every) < 1e-11
    mine, whole, theirs = time_in_turns(
        lambda: [solve_as_scene(blocks, subject) for blocks in every],
        lambda: [judge_as_property(blocks, subject) for blocks in every],
        lambda: [plain(blocks) for blocks in every],
        repeats=1,
    )
    benchmark.extra_info["plain script over ours"] = theirs / mine
    benchmark(lambda: solve_as_scene(every[0], subject))
    with capsys.disabled():
        print(
            f"\n{N_MESHES} pairs of blocks, meshes a second: ours {N_MESHES / mine:.0f} (judged by all quantities "
            f"{N_MESHES / whole:.0f}), the plain scikit-fem script {N_MESHES / theirs:.0f}: {theirs / mine:.2f} × as "
            f"many ({theirs / whole:.2f} ×)"
        )


def test_one_random_patch_test(benchmark: Any, capsys: pytest.CaptureFixture[str]) -> None:
    """Drawn, solved at two penalties and judged; and where the time goes."""
    benchmark.group = "patch.flat.solve, one random case"
    subject = formulation()
    cases = draw_cases(block_cases(), seed="0", examples=N_MESHES).cases

    def judge_all() -> None:
        forget_bodies()
        for case in cases:
            judge_case(FLAT_SOLVE, case, subject)

    def condense_all() -> None:
        forget_bodies()
        for case in cases:
            assert len(scene_of(case).condensed_bodies) == 2

    def solve_all() -> None:
        for case in cases:
            solve(scene_of(case), subject.for_case(case))

    drawing, whole, bodies, newton = time_in_turns(
        lambda: draw_cases(block_cases(), seed="0", examples=N_MESHES), judge_all, condense_all, solve_all, repeats=1
    )
    judge_all()
    again = time_in_turns(lambda: [judge_case(FLAT_SOLVE, case, subject) for case in cases], repeats=1)[0]
    benchmark(judge_all)
    drawing, whole, bodies, newton, again = (1e3 * time / N_MESHES for time in (drawing, whole, bodies, newton, again))
    benchmark.extra_info |= {"drawing, ms": drawing, "judging, ms": whole}
    with capsys.disabled():
        print(
            f"\nOne random patch test, everything included: {drawing + whole:.2f} ms = {drawing:.2f} drawing "
            f"(hypothesis, mesh, scene) + {whole:.2f} judging at two penalties. Of these: scene from its case and "
            f"condensation {bodies:.2f}, Newton at one penalty {newton:.2f}. With bodies that another formulation "
            f"has condensed: judging {again:.2f}"
        )
