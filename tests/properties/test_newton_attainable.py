"""The property `newton.attainable`: what stored positions allow is attained, and what a formulation adds is told."""

import numpy as np
import pytest
from subjects import load_subject

from contactverif.mechanics.changed_scenes import snap
from contactverif.mechanics.scene import scene_of
from contactverif.mechanics.system import System
from contactverif.problems.catalogue import load_scene_case
from contactverif_properties.newton_method import OFFSETS, examine, newton_attainable, settle

# Virtual slave nodes lie off master nodes, and nothing of the scene is a multiple of the way.
SCENE = "c-prime:penalty=1e4"


def test_the_error_of_the_solution_grows_with_the_way() -> None:
    details = newton_attainable.measure(load_scene_case(SCENE), load_subject("nts")).details
    errors = [details[f"error over the shortest segment at 2^{power}"] for power in OFFSETS]
    assert errors[-1] > 1e3 * errors[0]
    assert errors[-1] < 1e-8


def test_who_promises_nothing_breaks_nothing() -> None:
    assert newton_attainable.promise(load_subject("nts").traits.revise(translation_stable=None)) is None
    assert newton_attainable.promise(load_subject("nts").traits.revise(translation_stable=True)) is True


def test_a_matrix_without_inverse_is_undecided() -> None:
    case = load_scene_case(SCENE)
    system = System(scene_of(case), load_subject("nts").for_case(case))
    slave, master = system.scene.condensed_bodies
    apart = np.concatenate([slave.unknowns % 2, -(master.unknowns % 2)]).astype(np.float64)
    assert examine(system, case, apart) is None  # The slave hangs free, above the master.


def test_the_roundoff_grows_with_the_distance_alone() -> None:
    case = load_scene_case(SCENE)
    system = System(snap(scene_of(case), 2.0**-20), load_subject("nts").for_case(case))
    solution = examine(system, case, system.scene.start)
    assert solution is not None
    assert (solution.roundoff(0.0) == 2.0**-50 * solution.terms).all()
    added = solution.roundoff(2.0**30) - solution.roundoff(2.0**29)
    assert added == pytest.approx(2.0**29 * 2.0**-50 * solution.contact)
    assert settle(solution, case, [2.0**20])[0].added <= 1.0
