"""Codes by the interpreters that variables name, as `GETFEM_PYTHON` and `OPENSEES_PYTHON` do, or in this one."""

import os
from importlib.util import find_spec

import numpy as np
import pytest
from subjects import load_property

from contactverif import Verdict, judge_case, load_scene
from contactverif.contract.subject import EngineSubject
from contactverif.isolation.limits import Limits
from contactverif.plugins.registry import load_engine
from contactverif.problems.catalogue import load_scene_case
from contactverif_engines.control import Control
from contactverif_engines.filled import deepen, fill_rigid_bodies
from contactverif_engines.opensees import find_chains

MODULES = {"getfem": "getfem", "opensees": "openseespy", "fedoo": "fedoo", "sfepy": "sfepy"}


def load_code(name: str, options: str = "") -> EngineSubject:
    """Return the engine of a code; the test is skipped where the code is not installed."""
    python = os.environ.get(f"{name.upper()}_PYTHON", "")
    if not python and find_spec(MODULES[name]) is None:
        pytest.skip(f"{name} is not installed, and {name.upper()}_PYTHON is not set")
    words = [word for word in (options, f"python={python}" if python else "") if word]
    engine = load_engine(":".join([name, ",".join(words)]) if words else name, Limits())
    assert isinstance(engine, EngineSubject), engine.reason
    return engine


def test_chains_follow_their_edges() -> None:
    assert find_chains(np.array([[4, 2], [1, 4], [7, 8]])) == [[1, 4, 2], [7, 8]]
    assert find_chains(np.array([[0, 1], [1, 2], [2, 0]])) == [[0, 1, 2, 0]]


def test_slaves_that_touch_get_deeper() -> None:
    scene = load_scene("c").arrays(upright=True, lowered=True)
    moves = deepen(fill_rigid_bodies(scene), 0.5)
    slave, master = np.unique(scene.slave), np.unique(scene.master)
    np.testing.assert_allclose(moves[slave], np.tile([0.0, -0.5 * scene.unit], (len(slave), 1)))
    assert not moves[master].any()


def test_getfem_passes_matching_meshes_alone() -> None:
    question, getfem = load_property("patch.flat.solve"), load_code("getfem")
    assert judge_case(question, load_scene_case("a1"), getfem).verdict is Verdict.PASS
    assert judge_case(question, load_scene_case("c"), getfem).verdict is Verdict.FAIL


@pytest.mark.parametrize(
    ("name", "scene", "error"),
    [
        ("getfem", "c", 1e-2),
        ("opensees", "c", 0.1),
        ("fedoo", "c", 0.15),
        ("sfepy", "c", 1e-8),
        # The pressures of nodes are the same on matching meshes where inner nodes stand for twice the length of ends.
        ("fedoo", "a1", 0.05),
    ],
)
def test_displacements_are_near_those_of_the_control(name: str, scene: str, error: float) -> None:
    engine = load_code(name)
    arrays = load_scene(scene).arrays(upright=True, lowered=True)
    answer, right = engine.solve(arrays), Control().solve(arrays)
    assert answer.converged
    size = np.abs(right.displacements).max()
    np.testing.assert_allclose(answer.displacements, right.displacements, atol=error * size)
