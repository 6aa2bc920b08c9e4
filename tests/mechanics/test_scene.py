"""A scene and its case are the same bits; what is far away changes none; what a scene cannot be has its line."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from pressed_blocks import ALL, LEANING, in_triangles
from subjects import change_verbs, load_subject

from contactverif import Body, Case, Interface, MisuseError, Subject, Surface
from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.geometry import projection
from contactverif.mechanics import newton
from contactverif.mechanics.bodies import Placing, Rectangle, block, rigid_surface
from contactverif.mechanics.bulk import assemble_stiffness
from contactverif.mechanics.scene import Scene, WholeScene, has_bodies, scene_of
from contactverif.oracle.flat_answers import uniform_pressure_weights
from contactverif.problems import catalogue
from contactverif.problems.blocks import exact_unknowns, two_blocks
from contactverif_nts import nts_force, vts_ppt_force


def press_blocks(**more: Any) -> Scene:
    """Two blocks whose meshes do not match, pressed together; leaning, off the origin."""
    slave = Rectangle([0, 1, 2.5, 4], [0, 1, 2, 3.5], young=1.0, poisson=0.3)
    master = Rectangle([0, 2, 3, 4], [-3, -1, 0], young=3.0, poisson=0.2)
    usual: dict[str, Any] = {"penalty": 10.0, "pressure": 0.5, "placing": Placing(LEANING, (1.0, -2.0), 2.0)}
    return two_blocks(slave, master, **usual | more)


def three_bodies() -> Scene:
    """Return a scene of a quadrilateral and a triangular slave on one master, of different heights."""
    master = block(Rectangle(np.linspace(0, 8, 6), [-2, -1, 0], young=5.0), contact="top", approach=0.0, name="base")
    left, right = Rectangle([0.5, 1, 3], [0, 1, 2], poisson=0.25), Rectangle([4, 6, 7.5], [0, 3], young=2.0)
    first = block(left, contact="bottom", approach=0.125, tilt=0.01, lowered=0.125)
    second = in_triangles(block(right, contact="bottom", pressure=0.25, lowered=0.0625))
    return Scene((first, master, second), slave=(0, 2), master=(1,), penalty=7.0)


def change_bodies(change: Callable[[Body], Body], count: int = 2) -> Scene:
    """Return the pressed blocks, the first of which are changed."""
    scene = press_blocks()
    return replace(scene, bodies=(*map(change, scene.bodies[:count]), *scene.bodies[count:]))


SCENES: dict[str, Callable[[], Scene]] = {
    "quadrilaterals": press_blocks,
    "triangles": lambda: change_bodies(in_triangles),
    "triangles on quadrilaterals": lambda: change_bodies(in_triangles, 1),
    "rigid floor": lambda: press_blocks(rigid_master=True),
    "rigid both": lambda: Scene(
        (rigid_surface([[0, 0], [1, 0], [3, 0]], displacement=(0, -0.5)), rigid_surface([[4, 0], [-1, 0]])),
        penalty=1 / 3,
    ),
    "three": three_bodies,
    "named": lambda: catalogue.make_scene("c", degrees=33.0),
}
every_scene = pytest.mark.parametrize("make", SCENES.values(), ids=SCENES)


def bits(arrays: Mapping[str, Any]) -> dict[str, tuple[Any, ...]]:
    """Return arrays in a form that can be compared bit by bit."""
    every = {name: np.asarray(values) for name, values in arrays.items()}
    return {name: (array.dtype, array.shape, array.tobytes()) for name, array in every.items()}


ATTRIBUTES = ("nodes", "cells", "contact", "young", "poisson", "fixed", "imposed", "load", "axis", "start")


def same_body(*bodies: Body) -> bool:
    first, second = (bits({name: getattr(body, name) for name in ATTRIBUTES}) for body in bodies)
    return first == second


@every_scene
def test_round_trip_through_a_case(make: Callable[[], Scene]) -> None:
    scene = make()
    case = scene.case(seed=7)
    assert has_bodies(case)
    assert (case.seed, case.penalty, case.name) == (7, scene.penalty, scene.name)
    for again in (scene_of(case), scene_of(Case.from_arrays(case.to_arrays()))):
        assert (again.slave, again.master) == (scene.slave, scene.master)
        assert (again.penalty, again.name) == (scene.penalty, scene.name)
        assert bits(again.facts) == bits(scene.facts)
        assert len(again.bodies) == len(scene.bodies)
        assert all(map(same_body, again.bodies, scene.bodies))
        assert bits(again.case(seed=7).to_arrays()) == bits(case.to_arrays())


def test_one_scene_is_made_of_one_case_and_its_bodies_are_called_by_their_roles() -> None:
    case = three_bodies().case()
    assert scene_of(case) is scene_of(case)
    assert [body.name for body in scene_of(case).bodies] == ["slave 1", "master", "slave 2"]


def test_a_case_without_bodies() -> None:
    interface = Interface.from_chains([[0, 0], [1, 0]], [[1, 0], [0, 0]])
    case = Case(interface, interface.nodes.reshape(-1), parameters={"gap": np.array(1.0)})
    assert not has_bodies(case)
    with pytest.raises(MisuseError, match=r"^case: found an interface without bodies; needed a case made of a scene$"):
        scene_of(case)


# --- what a scene is made of ------------------------------------------------------------------------------------


def test_the_interface_has_slave_nodes_first() -> None:
    scene = three_bodies()
    assert scene.bodies_in_reach == (0, 2, 1)
    interface = scene.interface
    assert interface.nodes[:, 0].tolist() == [0.5, 1, 3, 4, 6, 7.5, *np.linspace(0, 8, 6)]
    assert not interface.nodes[:, 1].any()
    assert interface.slave.segments.tolist() == [[0, 1], [1, 2], [3, 4], [4, 5]]
    assert sorted(interface.master.segments.tolist()) == [[n + 1, n] for n in range(6, 11)]
    assert scene.slices == (slice(0, 4), slice(4, 8), slice(8, 18))  # at the sides, on rollers, y alone is free
    assert [unknowns.tolist() for unknowns in scene.unknowns[:2]] == [[1, 2, 3, 5], [1, 2, 3, 5]]


def at_random(scene: Scene) -> FloatArray:
    q: FloatArray = np.random.default_rng(3).normal(size=scene.n_free)
    return q


@every_scene
@pytest.mark.parametrize("factor", [1.0, 0.25])
def test_positions_are_those_of_the_displaced_bodies(make: Callable[[], Scene], factor: float) -> None:
    scene = make()
    q = at_random(scene)
    displaced = scene.displacements(q, factor)
    expected = np.vstack(
        [(scene.bodies[k].nodes + displaced[k])[scene.bodies[k].contact_nodes] for k in scene.bodies_in_reach]
    )
    positions = scene.positions(q, factor).reshape(-1, 2)
    terms = np.abs(scene.interface.nodes).max() + np.abs(q).max(initial=1.0)
    assert np.abs(positions - expected).max() <= 8 * UNIT_ROUNDOFF * terms  # a sum of four products at most


@every_scene
def test_spread_is_the_derivative_of_positions(make: Callable[[], Scene]) -> None:
    scene = make()
    spread = np.asarray(scene.transformation)
    for unknown, unit in enumerate(np.eye(scene.n_free)):
        difference = scene.positions(unit) - scene.positions(0 * unit)
        assert np.abs(difference - spread[:, unknown]).max() <= 4 * UNIT_ROUNDOFF * np.abs(scene.positions(unit)).max()
    # each unknown moves one node by one: columns are orthonormal
    assert np.abs(spread.T @ spread - np.eye(scene.n_free)).max(initial=0.0) <= 4 * UNIT_ROUNDOFF


def test_the_first_guess() -> None:
    scene = press_blocks(lowered=0.25)
    moved = scene.positions(scene.start).reshape(-1, 2) - scene.interface.nodes
    down = 0.25 * 2 * np.array([LEANING[1], -LEANING[0]])  # the scene is scaled by 2
    bound = 4 * UNIT_ROUNDOFF * np.abs(scene.interface.nodes).max()
    assert np.abs(moved[:4] - down).max() <= bound
    assert not moved[4:].any()
    assert np.array_equal(scene.case().z, scene.positions(scene.start))


# --- forces against exact ones ----------------------------------------------------------------------------------


PRESSED = [press_blocks(**more) for more in ({}, {"rigid_master": True}, {"placing": Placing()})]
PRESSED += map(catalogue.make_scene, catalogue.BLOCKS)


@pytest.mark.parametrize("scene", PRESSED, ids=lambda scene: scene.name or "pressed")
@pytest.mark.parametrize("factor", [1.0, 0.5])
def test_bulk_forces_of_the_exact_solution_are_the_consistent_ones(scene: Scene, factor: float) -> None:
    """Uniform pressure: what contact must bring is p ∫ N along the normal, from rationals."""
    p, interface = float(scene.facts["pressure"]), scene.interface
    q = factor * exact_unknowns(scene, p, scene.penalty)
    n_slave, frame = interface.n_slave_nodes, scene.bodies[0].frame
    along = interface.nodes @ frame[:, 0]  # rounded once more: 4 u X of a length
    weights, on_slave = uniform_pressure_weights(interface, along), np.arange(len(along)) < n_slave
    expected = factor * p * np.where(on_slave, weights, -weights)[:, None] * frame[:, 1]
    supported = ~on_slave & scene.bodies[1].rigid  # supports take it
    forces = scene.nodal_forces(q, factor)
    assert not forces[supported].any()
    terms = np.abs(scene.stiffness) @ np.abs(q) + factor * np.abs(scene.load)
    assert np.abs(forces - expected)[~supported].max() <= 2 * scene.n_free * UNIT_ROUNDOFF * terms.max()


def test_a_body_out_of_reach_is_solved_on_its_own() -> None:
    far = block(Rectangle([100, 101, 103], [0, 1, 2], young=2.0, poisson=0.25), contact="bottom", approach=0.25)
    free = block(Rectangle([200, 201], [0, 3]), contact="top", pressure=0.5, free_sides=True)
    free = replace(free, fixed=free.fixed | (free.nodes[:, 1:] == 3) & [False, True])  # hangs on its contact side
    scene = replace(press_blocks(), bodies=(*press_blocks().bodies, far, free), slave=(0, 2), master=(1, 3))
    assert scene.bodies_in_reach == (0, 1)
    displaced = scene.displacements(scene.start)
    assert np.abs(displaced[2] - [0, -0.25]).max() <= 64 * UNIT_ROUNDOFF  # pushed from above and nothing below
    assert np.abs(scene.stresses(scene.start)[2]).max() <= 64 * UNIT_ROUNDOFF
    hanging = np.asarray(assemble_stiffness(free)[0])[np.ix_(*[np.flatnonzero(~free.fixed)] * 2)]
    bound = UNIT_ROUNDOFF * (np.linalg.cond(hanging) + 201) * 0.5  # its nodes are up to 201 cells from the origin
    assert np.abs(scene.stresses(scene.start)[3] - [0, -0.5, 0]).max() <= bound
    assert np.abs(scene.stresses(scene.start, 0.5)[3] - [0, -0.25, 0]).max() <= bound


# --- what a scene cannot be -------------------------------------------------------------------------------------

SLAVE, MASTER = press_blocks(placing=Placing()).bodies
LOOSE = replace(SLAVE, fixed=np.zeros_like(SLAVE.fixed))
ROLES = "bodies: found slave {} and master {} of {} bodies; needed each body either slave or master, and at least one"
PREVENTION = "; needed fixed components that prevent it (contact without friction does not)"


ONE_SUPPORT = replace(LOOSE, name="punch", fixed=np.arange(32).reshape(-1, 2) == 31)
SLIDES = f"it can move along its first axis{PREVENTION}"


@pytest.mark.parametrize(
    ("bodies", "slave", "master", "message"),
    [
        ((SLAVE, MASTER), (0,), (0,), ROLES.format("(0,)", "(0,)", 2)),
        ((SLAVE, MASTER), (0, 1), (1,), ROLES.format("(0, 1)", "(1,)", 2)),
        ((SLAVE, MASTER, MASTER), (0,), (1,), ROLES.format("(0,)", "(1,)", 3)),
        ((SLAVE, MASTER), (0,), (1, 2), ROLES.format("(0,)", "(1, 2)", 2)),
        ((SLAVE, MASTER), (0, 1), (), "bodies: found no master; needed at least one of both"),
        ((SLAVE, MASTER), (), (0, 1), "bodies: found no slave; needed at least one of both"),
        ((), (), (), "bodies: found no slave; needed at least one of both"),
        ((LOOSE, MASTER), (0,), (1,), f"supports of slave: found none: {SLIDES}"),
        ((ONE_SUPPORT, MASTER), (0,), (1,), f"supports of punch: found too few: {SLIDES}"),
        (
            (SLAVE, replace(MASTER, fixed=MASTER.fixed & [False, True])),
            (0,),
            (1,),
            f"supports of master: found too few: {SLIDES}",
        ),
    ],
)
def test_wrong_scenes(bodies: tuple[Body, ...], slave: Any, master: Any, message: str) -> None:
    with pytest.raises(MisuseError) as error:
        Scene(bodies, slave, master)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


def test_bodies_that_cannot_meet() -> None:
    far = replace(MASTER, nodes=MASTER.nodes - [0, 1e3])
    scene = Scene((SLAVE, far))
    with pytest.raises(MisuseError, match=r"^bodies: found no slave within reach of a master; needed bodies that can"):
        _ = scene.interface


def test_a_body_out_of_reach_that_nothing_holds() -> None:
    far = block(Rectangle([100, 101, 103], [0, 1, 2]), contact="bottom", pressure=0.5, name="far")
    scene = Scene((SLAVE, MASTER, far), slave=(0, 2))  # contact alone would hold it
    message = r"^supports of far: found not enough to hold a body that can touch nothing; needed supports against"
    with pytest.raises(MisuseError, match=message):
        scene.stresses(scene.start)


# --- far away ---------------------------------------------------------------------------------------------------


def count_calls(name: str) -> tuple[Subject, list[tuple[Any, ...]]]:
    """Return a formulation that notes its calls and how large its answers are, and these notes."""
    calls: list[tuple[Any, ...]] = []

    def note(size: Callable[[Any], Any], right: Any, *state: Any) -> Any:
        answer = right(*state)
        calls.append((right.__name__, size(answer)))
        return answer

    sizes: dict[str, Callable[[Any], Any]] = {
        "pair": lambda pairing: {key: values.size for key, values in pairing.items()},
        "residual": np.shape,
        "tangent": lambda matrix: (matrix.shape, matrix.nnz),
    }
    changes = {verb: partial(note, size) for verb, size in sizes.items()}
    inner = load_subject(name)
    return Subject(name, lambda *, penalty: change_verbs(inner._make(penalty=penalty), **changes)), calls


def with_a_far_body(scene: Scene, role: str) -> Scene:
    far = block(Rectangle([4e3, 4001, 4003], [0, 1, 2]), contact="bottom" if role == "slave" else "top", approach=0.25)
    bodies = (*scene.bodies, far)
    return replace(scene, bodies=bodies, **{role: (*getattr(scene, role), len(bodies) - 1)})


@pytest.mark.parametrize("role", ["slave", "master"])
@pytest.mark.parametrize("name", ALL)
def test_a_far_body_changes_no_bit_of_a_solution(name: str, role: str) -> None:
    alone = catalogue.make_scene("c", penalty=1e4, sides="free", ratio=0.5, lowered=0.0)
    beside = with_a_far_body(alone, role)
    assert len(beside.bodies) == 3
    answers, counts = [], []
    for scene in (alone, beside):
        subject, calls = count_calls(name)
        case = scene.case()
        formulation = subject.for_case(case)
        pairing = formulation.pair(case.interface, case.z)
        assert pairing is not None
        tangent = formulation.tangent(case.interface, pairing, case.z).tocoo()
        residual = formulation.residual(case.interface, pairing, case.z)
        surfaces = {"slave": case.interface.slave.segments, "master": case.interface.master.segments}
        arrays = {"nodes": case.interface.nodes, **surfaces, "z": case.z, "residual": residual, **pairing}
        arrays |= {f"tangent {key}": getattr(tangent, key) for key in ("row", "col", "data")}
        trace = newton.solve(scene, formulation, iterations=8)
        fields = ("q", "factors", "residuals", "energies", "floors", "changes", "conditions")
        answers.append((bits(arrays | {key: getattr(trace, key) for key in fields}), trace.end))
        counts.append(calls)
    assert answers[0] == answers[1]
    assert counts[0] == counts[1]
    assert {entry[0] for entry in counts[0]} == {"pair", "residual", "tangent"}


def test_a_near_body_does_change_it() -> None:
    alone = catalogue.make_scene("c")
    near = block(Rectangle([13, 14], [0, 4]), contact="bottom", approach=0.0)
    beside = replace(alone, bodies=(*alone.bodies, near), slave=(0, 2))
    assert len(beside.interface.slave) == len(alone.interface.slave) + 1


def wavy_interface(seed: int, n_master: int) -> tuple[Interface, FloatArray]:
    """Return a wavy slave pressed into a wavy master, with some overhang."""
    random = np.random.default_rng(seed)
    upper, lower = np.linspace(0, 10, 9), np.linspace(-0.4, 10.3, n_master + 1)
    upper[1:-1] += random.uniform(-0.3, 0.3, 7)
    slave = np.column_stack([upper, -0.1 - 0.1 * random.random(9)])
    master = np.column_stack([lower, 0.1 * random.random(n_master + 1)])[::-1]
    interface = Interface.from_chains(slave, master)
    return interface, interface.nodes.reshape(-1)


def with_a_far_chain(interface: Interface, n_far: int) -> Interface:
    """Add a chain of the master that is far away."""
    far = np.column_stack([1e4 + np.arange(n_far + 1.0), np.full(n_far + 1, -3.0)])[::-1]
    numbers = interface.n_nodes + np.arange(n_far + 1)
    return Interface(
        np.vstack([interface.nodes, far]),
        interface.slave,
        Surface(np.vstack([interface.master.segments, np.column_stack([numbers[:-1], numbers[1:]])])),
    )


Counts = tuple[int, int]


def python_function(function: Any) -> Any:
    """Return the Python function behind a compiled one; or the function if not compiled."""
    return getattr(function, "py_func", function)


@pytest.fixture
def distances(monkeypatch: pytest.MonkeyPatch) -> Callable[[str, Case], Counts]:
    """Count the distances from a point to a segment that one `pair` evaluates, and those to far segments.

    Counted inside the search itself: its own Python functions run, not compiled, with a counter for a distance.
    """
    distance = python_function(projection.distance_to_segment)
    searches = [(projection, "nearest_place", python_function(projection.nearest_place))]
    searches += [(projection, name, getattr(projection, name)) for name in ("_look_at", "_look_at_leaf", "_look_below")]
    searches += [(module, "nearest_place_from", projection.nearest_place_from) for module in (nts_force, vts_ppt_force)]
    searches += [(module, "_pair_points", module._pair_points) for module in (nts_force, vts_ppt_force)]

    def count(name: str, case: Case) -> Counts:
        evaluated: list[bool] = []

        def counting(origin: Any, p: Any, x1: Any, x2: Any) -> Any:
            evaluated.append(x1[0] > 1e3)
            return distance(origin, p, x1, x2)

        subject = load_subject(name)
        with monkeypatch.context() as patched:
            patched.setattr(projection, "distance_to_segment", counting)
            for module, function, compiled in searches:
                patched.setattr(module, function, python_function(compiled))
            pairing = subject.for_case(case).pair(case.interface, case.z)
        assert pairing == subject.for_case(case).pair(case.interface, case.z)  # what was counted is what is compiled
        return len(evaluated), sum(evaluated)

    return count


@pytest.mark.parametrize("name", ["nts", "vts-me", "vts-ppt-balanced"])
@pytest.mark.parametrize("n_master", [5, 7, 12, 15, 16])
@pytest.mark.parametrize("n_far", [8, 200])
def test_no_distance_to_far_segments_of_an_interface_is_evaluated(
    name: str, n_master: int, n_far: int, distances: Callable[[str, Case], Counts]
) -> None:
    interface, z = wavy_interface(3, n_master)
    more = with_a_far_chain(interface, n_far)
    expected = distances(name, Case(interface, z))
    assert expected[0] > 0
    assert distances(name, Case(more, more.nodes.reshape(-1))) == (expected[0], 0)


@pytest.mark.parametrize("name", ["vts-ppt", "mortar-lm"])
@pytest.mark.parametrize("triangles", [False, True])
def test_a_whole_scene_has_the_solution_of_the_condensed_one(name: str, triangles: bool) -> None:
    scene = SCENES["triangles" if triangles else "quadrilaterals"]()
    whole, subject = WholeScene.of_scene(scene), load_subject(name)
    assert whole.n_free > scene.n_free
    formulation = subject.for_case(scene.case())
    condensed, uncondensed = (newton.solve(each, formulation) for each in (scene, whole))
    assert condensed.converged
    assert uncondensed.converged
    # What is left are two factorisations of one system: their roundoff is 1e-14, and grows with the condition.
    np.testing.assert_allclose(uncondensed.z, condensed.z, rtol=1e-11, atol=1e-11)
    forces = [trace.scene.nodal_forces(trace.u[-1][: trace.scene.n_free]) for trace in (condensed, uncondensed)]
    np.testing.assert_allclose(forces[1], forces[0], atol=1e-10 * np.abs(forces[0]).max())


def test_a_whole_scene_may_have_a_rigid_body() -> None:
    punch = block(Rectangle([0, 1, 2], [0, 1]), contact="bottom", approach=0.1, name="punch")
    scene = Scene((punch, rigid_surface([[3, 0], [-1, 0]], name="floor")), penalty=100.0)
    formulation = load_subject("sts").for_case(scene.case())
    traces = [newton.solve(each, formulation) for each in (scene, WholeScene.of_scene(scene))]
    np.testing.assert_allclose(traces[1].z, traces[0].z, rtol=1e-12, atol=1e-12)
