"""Engines in space: the arrays that they get, the control that passes, and engines that are wrong there."""

import shutil
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from planned_cases import draw_cases

from contactverif import Body, Property, Scene, Verdict, judge_case
from contactverif.contract.engine import EngineAnswer, EngineTraits, SceneArrays
from contactverif.contract.subject import EngineSubject
from contactverif.contract.traits import Rules, Traits
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote import engine_program, load_remote_engine
from contactverif.mechanics import changed_scenes
from contactverif.plugins.registry import load_properties
from contactverif.problems.space_problems import SHELLS
from contactverif.sampling.draw import Sampling
from contactverif_engines import faces
from contactverif_engines.calculix import CalculiX, make_layer, write_deck
from contactverif_engines.control import Control
from contactverif_engines.filled import fill_rigid_bodies
from contactverif_engines.kratos import write_model

TURNED = np.array([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]])
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
CUBE = np.vstack([CORNERS - [0, 0, 1], CORNERS])
CONTROL = EngineSubject("engine/control:dim=3", Control(dim=3))


def two_cells() -> Scene:
    """Return a tetrahedron that stands on a hexahedron by a face, each with a fixed node or more."""
    nodes = np.array([[0.25, 0.25, 0], [0.75, 0.25, 0], [0.25, 0.75, 0], [0.25, 0.25, 0.5]])
    top, bottom = np.arange(4) == 3, np.arange(8) < 4
    tetrahedron = Body(
        nodes, np.array([[0, 1, 2, 3]]), np.array([[0, 2, 1]]), 2.0, 0.25, np.outer(top, [1, 1, 1]) != 0, axis=TURNED
    )
    sides = np.outer(np.ones(4, bool), [True, True, False])
    tetrahedron = replace(tetrahedron, fixed=tetrahedron.fixed | sides, imposed=np.outer(top, [0.0, 0.0, -0.25]))
    hexahedron = Body(
        CUBE, np.arange(8)[None], np.array([[4, 5, 6, 7]]), fixed=np.outer(bottom, np.ones(3)) != 0, name="hexahedron"
    )
    return Scene((tetrahedron, hexahedron), penalty=8.0)


def rigid_surfaces(n_corners: int) -> SceneArrays:
    """Return a cube below a rigid face, or two."""
    above = np.array([[3, 2, 1, 0]]) if n_corners == 4 else np.array([[2, 1, 0], [3, 2, 0]])
    cube = Body(CUBE, np.arange(8)[None], np.array([[4, 5, 6, 7]]), fixed=np.outer(np.arange(8) < 4, np.ones(3)) != 0)
    rigid = Body(CORNERS, np.zeros((0, 8), np.int64), above, fixed=np.ones((4, 3), bool), name="rigid")
    return Scene((cube, rigid), penalty=1.0).arrays()


def load_question(name: str) -> Property:
    (question,) = load_properties([name], engines=True)
    assert isinstance(question, Property)
    return question


def verdicts(name: str, choice: slice, subject: EngineSubject = CONTROL) -> Iterator[Verdict]:
    """Iterate over the verdicts of some cases in space, of random ones the first."""
    question = load_question(name).for_traits(CONTROL.traits)
    cases = question.cases(None)
    if not isinstance(cases, tuple):
        cases = draw_cases(cases, seed=Sampling(examples=8, seed=1).key(question), examples=8).cases
    return (judge_case(question, case, subject).verdict for case in cases[choice])


def test_the_arrays_of_a_tetrahedron_on_a_hexahedron() -> None:
    arrays = two_cells().arrays()
    np.testing.assert_array_equal(arrays.cells, [[0, 1, 2, 3, -1, -1, -1, -1], np.arange(4, 12)])
    np.testing.assert_array_equal(arrays.slave, [[0, 2, 1, -1]])
    np.testing.assert_array_equal(arrays.master, [[8, 9, 10, 11]])
    np.testing.assert_array_equal(arrays.body_of_node, [0] * 4 + [1] * 8)
    np.testing.assert_array_equal(arrays.axes, [TURNED, np.eye(3)[:2]])
    np.testing.assert_array_equal(arrays.frames()[0], np.vstack([TURNED, [0.0, 0.8, -0.6]]).T)
    np.testing.assert_array_equal(arrays.imposed[3], [0.0, 0.0, -0.25])
    zero = EngineAnswer(np.zeros((12, 3)), True, contact_forces=np.zeros((12, 3)), pressures=np.zeros(3))
    assert not zero.flaw(arrays)
    assert "needed shape (3,)" in replace(zero, pressures=np.zeros(4)).flaw(arrays)


def test_a_process_of_its_own_gets_these_arrays() -> None:
    program = engine_program("contactverif_engines.control:Control", {"dim": 3})
    remote = load_remote_engine(program, "engine/control:dim=3", Limits(60.0))
    assert isinstance(remote, EngineSubject)
    assert remote.traits == CONTROL.traits
    here, there = (subject.solve(two_cells().arrays()).displacements for subject in (CONTROL, remote))
    np.testing.assert_array_equal(here, there)


def test_an_engine_is_asked_in_the_dimensions_that_it_takes() -> None:
    question = load_question("patch.flat.solve")
    flat, both = (EngineSubject("engine/x", Control(dim=2)), EngineTraits("penalty", dimensions=(2, 3)))
    assert question.for_traits(flat.traits) is question
    assert both.dimensions == (2, 3)
    assert "interfaces are plane" in load_question("accuracy.wavy-curved").refusal_of(CONTROL)
    with pytest.raises(ValueError, match="dimensions: found"):
        EngineTraits("penalty", dimensions=(4,))


@pytest.mark.parametrize(
    ("name", "choice"),
    [
        ("patch.flat.solve", slice(6)),
        ("patch.variants", slice(8)),
        ("patch.curved", slice(2)),
        ("accuracy.wavy", slice(2, 3)),
        ("accuracy.hertz", slice(1)),
        ("hard.contrast", slice(0, None, 7)),
        ("hard.dead-zone", slice(1, None, 5)),
        *(
            (f"engine.{name}", slice(4))
            for name in ("purity", "mirror", "renumbering", "units", "objectivity", "remote")
        ),
    ],
)
def test_the_control_passes(name: str, choice: slice) -> None:
    assert set(verdicts(name, choice)) == {Verdict.PASS}


class Wrong(Control):
    """The control, given another scene than it should be."""

    def __init__(self, change: str) -> None:
        super().__init__(dim=3)
        object.__setattr__(self, "change", change)

    def solve(self, scene: SceneArrays) -> EngineAnswer:
        """Return the answer to the other scene."""
        if self.change == "an absolute length" and np.ptp(scene.nodes) > 20:  # type: ignore[attr-defined]
            scene = replace(scene, penalty=0.999 * scene.penalty)
        if self.change == "supports along the axes":  # type: ignore[attr-defined]
            scene = replace(scene, axes=np.array([np.eye(3)[:2]] * len(scene.axes)))
        return super().solve(scene)


@pytest.mark.parametrize(
    ("name", "change"), [("engine.units", "an absolute length"), ("engine.objectivity", "supports along the axes")]
)
def test_a_wrong_scene_is_caught(name: str, change: str) -> None:
    assert Verdict.FAIL in verdicts(name, slice(8), EngineSubject("engine/wrong", Wrong(change)))


def lose_small_parts(points: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what is left, as CalculiX does it, here of parts below 0.01."""
    parts = np.repeat(weights.reshape(-1, 9).sum(axis=1), 9)
    return points[parts > 0.01], weights[parts > 0.01]


@pytest.mark.parametrize("name", ["patch.flat.solve", "patch.variants"])
def test_small_parts_that_are_left_out_are_caught(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = faces._common_points
    monkeypatch.setattr(faces, "_common_points", lambda first, second: lose_small_parts(*right(first, second)))
    assert Verdict.FAIL in verdicts(name, slice(1, 8))


def test_a_first_corner_that_gets_more_is_caught_by_another_numbering(monkeypatch: pytest.MonkeyPatch) -> None:
    right = faces._shapes
    monkeypatch.setattr(
        faces, "_shapes", lambda corners, points: right(corners, points) + 1e-4 * np.eye(len(corners))[0]
    )
    assert Verdict.FAIL in verdicts("engine.renumbering", slice(8))


@pytest.mark.parametrize("n_corners", [3, 4])
def test_a_rigid_surface_gets_solids_behind_it(n_corners: int) -> None:
    arrays = rigid_surfaces(n_corners)
    filled = fill_rigid_bodies(arrays)
    tetrahedra, wedges, hexahedra = (cells for cells, _ in filled.cells)
    assert (len(tetrahedra), len(wedges), len(hexahedra)) == ((0, 2, 1) if n_corners == 3 else (0, 0, 2))
    cells = wedges if n_corners == 3 else hexahedra
    first, second, up = (filled.nodes[cells[:, k]] - filled.nodes[cells[:, 0]] for k in (1, 2, n_corners))
    assert (np.einsum("ni,ni->n", np.cross(first, second), up) > 0).all()
    assert filled.fixed[len(arrays.nodes) :].all()
    lines, model = write_deck(make_layer(arrays), "surface"), write_model(filled)
    assert f"*ELEMENT, TYPE=C3D{6 if n_corners == 3 else 8}, ELSET=B1" in lines
    assert sum(line.endswith((", S1", ", S2", ", S6")) for line in lines) == 1 + len(arrays.master)
    assert f"Begin Conditions SurfaceCondition3D{n_corners}N" in model


@pytest.mark.skipif(shutil.which("ccx") is None, reason="ccx is not installed")
@pytest.mark.parametrize("name", ["hard.contrast", "accuracy.hertz", "engine.objectivity"])
def test_calculix_passes_in_space(name: str) -> None:
    assert set(verdicts(name, slice(4), EngineSubject("engine/calculix:dim=3", CalculiX(dim=3)))) == {Verdict.PASS}


def test_a_mirrored_scene_is_one_of_right_handed_bodies_and_twice_it_is_the_same() -> None:
    scene = two_cells()
    once = changed_scenes.mirror(scene)
    np.testing.assert_array_equal(once.bodies[0].frame, scene.bodies[0].frame * [[1, -1, -1], [-1, 1, 1], [-1, 1, 1]])
    for body, image in zip(scene.bodies, changed_scenes.mirror(once).bodies, strict=True):
        np.testing.assert_array_equal(image.nodes, body.nodes)
        np.testing.assert_array_equal(image.frame, body.frame)


@pytest.mark.parametrize("inner_slave", [True, False])
def test_the_traction_of_hard_contact_is_near_that_of_stiff_springs(inner_slave: bool) -> None:
    hard, stiff = Traits(rules=Rules("multiplier")), replace(SHELLS, penalty=1e7)
    traction = SHELLS.traction(inner_slave=inner_slave, traits=hard)
    assert traction == pytest.approx(stiff.traction(inner_slave=inner_slave, traits=CONTROL.traits), rel=1e-4)
