"""Two passes are a sum, provide what the formulation provides, and pass the patch test with nodal multipliers only."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from every_formulation import bent_state, load
from subjects import load_subject
from surfaces import make_flat
from test_forces import PENALTY

from contactverif import Abilities, Interface, Pairing, Promises, Scene, Subject, Trace, Traits, solve, two_blocks
from contactverif.contract.errors import ContractError
from contactverif.mechanics.bodies import Rectangle
from contactverif.problems.catalogue import make_scene
from contactverif.problems.uniform_stress import stress_error
from contactverif_nts import two_pass

INNERS = ["nts", "nts-ar", "vts-g", "vts-me", "vts-ppt", "vts-ppt-balanced", "nts-lm", "vts-me-lm", "vts-ppt-lm"]


def swapped_places(formulation: Any, interface: Interface) -> Any:
    """Return the places of the unknowns of `interface.swap_roles()` in z, multipliers included."""
    there, n = 2 * interface.n_slave_nodes, interface.n_unknowns
    total = formulation.n_multipliers(interface)
    first = formulation._inner.n_multipliers(interface)
    return np.concatenate([np.roll(np.arange(n), -there), n + np.roll(np.arange(total), -first)])


@pytest.mark.parametrize("name", INNERS)
def test_it_is_the_sum_of_both_passes(name: str) -> None:
    formulation, inner = load(f"two-pass/{name}"), load(name)
    for seed in range(20):
        interface, z = bent_state(formulation, seed)
        swapped, n, there = interface.swap_roles(), interface.n_unknowns, 2 * interface.n_slave_nodes
        first = inner.n_multipliers(interface)
        x, multipliers = z[:n], z[n:]
        states = np.append(x, multipliers[:first]), np.concatenate([x[there:], x[:there], multipliers[first:]])
        parts = [
            inner.residual(side, inner.pair(side, part), part)
            for side, part in zip((interface, swapped), states, strict=True)
        ]
        forces = parts[0][:n] + np.roll(parts[1][:n], there)
        expected = np.concatenate([forces, parts[0][n:], parts[1][n:]])
        assert np.array_equal(formulation.residual(interface, formulation.pair(interface, z), z), expected)


@pytest.mark.parametrize("name", INNERS)
def test_exchanging_the_roles_changes_no_force_bitwise(name: str) -> None:
    formulation, in_contact = load(f"two-pass/{name}"), 0
    for seed in range(50):
        interface, z = bent_state(formulation, seed)
        places, swapped = swapped_places(formulation, interface), interface.swap_roles()
        pairing, other = formulation.pair(interface, z), formulation.pair(swapped, z[places])
        forces = formulation.residual(interface, pairing, z)
        assert np.array_equal(formulation.residual(swapped, other, z[places]), forces[places])
        tangent = formulation.tangent(interface, pairing, z).toarray()
        swapped_tangent = formulation.tangent(swapped, other, z[places]).toarray()
        assert np.abs(swapped_tangent - tangent[np.ix_(places, places)]).max() <= 1e-14 * np.abs(tangent).max()
        in_contact += bool(forces[: interface.n_unknowns].any())
    assert in_contact > 30


@pytest.mark.parametrize("name", ["nts-ar", "vts-ppt-balanced", "nts-lm"])
def test_the_forces_at_its_points_add_up_to_those_on_the_slave(name: str) -> None:
    formulation = load(f"two-pass/{name}")
    for seed in range(20):
        interface, z = bent_state(formulation, seed)
        pairing = formulation.pair(interface, z)
        points = formulation.contact_points(interface, pairing, z)
        on_slave = -formulation.residual(interface, pairing, z)[: 2 * interface.n_slave_nodes].reshape(-1, 2)
        side = np.where(points.on_master, -1.0, 1.0)  # The normal of the second pass points out of the slave.
        pushes = (side * points.pressure * points.weight)[:, None] * points.normal
        assert pushes.sum(axis=0) == pytest.approx(on_slave.sum(axis=0), rel=1e-12, abs=1e-13)
        second = points.select(points.on_master)
        ends = z[: interface.n_unknowns].reshape(-1, 2)[interface.master.segments[second.slave_segment]]
        c = second.c[:, None]
        assert (1 - c) / 2 * ends[:, 0] + (1 + c) / 2 * ends[:, 1] == pytest.approx(second.position, abs=1e-14)


def test_names_of_a_pairing_say_whose_they_are() -> None:
    formulation = load("two-pass/vts-ppt")
    interface, z = bent_state(formulation, 0)
    pairing = formulation.pair(interface, z)
    part = load("vts-ppt").pair(interface, z)
    assert {name.partition(".")[2] for name in pairing} == set(part)
    assert np.array_equal(pairing["pass_1.first"], part["first"])
    assert len(pairing["pass_2.first"]) == 2 * len(interface.master)


class Springs:
    """A spring at each slave node against the line y = 0, one state at a time, and what else a test gives it."""

    def __init__(self, penalty: float, **parts: Any) -> None:
        self.penalty = penalty
        for name, part in parts.items():
            setattr(self, name, part)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        assert z.ndim == 1
        assert pairing is None or isinstance(pairing, Pairing)
        forces = np.zeros_like(z)
        forces[1 : 2 * interface.n_slave_nodes : 2] = self.penalty * z[1 : 2 * interface.n_slave_nodes : 2]
        return forces


def wrap(**parts: Any) -> Subject:
    inner: Callable[..., Any] = lambda *, penalty: Springs(penalty, **parts)  # noqa: E731
    return Subject("springs", lambda *, penalty: two_pass(penalty=penalty, inner=inner))


def dense_tangent(interface: Any, pairing: Any, z: Any) -> Any:
    diagonal = np.zeros(z.size)
    diagonal[1 : 2 * interface.n_slave_nodes : 2] = 3.0
    return np.diag(diagonal)


def test_the_least_plugin_in_two_passes() -> None:
    subject, (interface, z) = wrap(), make_flat([2, 2], [3, 1])
    assert subject.provides == frozenset()
    assert subject.traits == Traits(promises=Promises(unbiased=True), abilities=Abilities(batched=True))
    formulation = subject.with_penalty(3.0)
    assert formulation.pair(interface, z) is None
    assert formulation.n_multipliers(interface) == 0
    states = np.array([[z, 2 * z], [3 * z, 4 * z]])
    expected = np.where(np.arange(z.size) % 2 == 1, 3 * states, 0.0)
    assert np.array_equal(formulation.residual(interface, None, states), expected)


def test_parts_that_a_plugin_does_provide() -> None:
    subject = wrap(tangent=dense_tangent, pair=lambda interface, z: {"a": np.arange(len(interface.slave))})
    assert subject.provides == {"tangent", "pair"}
    interface, z = make_flat([2, 2, 1], [3, 2])
    formulation = subject.with_penalty(3.0)
    pairing = formulation.pair(interface, z)
    assert pairing is not None
    assert [(name, list(values)) for name, values in pairing.items()] == [("pass_1.a", [0, 1, 2]), ("pass_2.a", [0, 1])]
    tangent = formulation.tangent(interface, pairing, z).toarray()
    assert np.array_equal(tangent, np.diag(np.where(np.arange(z.size) % 2 == 1, 3.0, 0.0)))


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"residual": lambda interface, pairing, z: np.float64(0)}, "residual: returned a float64"),
        ({"residual": lambda interface, pairing, z: z.astype(np.float32)}, "residual: returned dtype float32"),
        ({"residual": lambda interface, pairing, z: np.nan * z}, "residual: nan in"),
        ({"pair": lambda interface, z: [1]}, "pair: returned a list"),
        ({"pair": lambda interface, z: {"xi": z}}, "pair: 'xi' is dtype float64"),
        ({"pair": lambda interface, z: {"a": np.array([10**9])}}, "pair: 'a' holds 1000000000"),
    ],
)
def test_a_broken_contract_is_that_of_the_inner_formulation(parts: dict[str, Any], message: str) -> None:
    interface, z = make_flat([2, 2], [3, 1])
    formulation = wrap(**parts).with_penalty(3.0)
    with pytest.raises(ContractError, match=message):
        formulation.residual(interface, formulation.pair(interface, z), z)


def test_what_it_promises() -> None:
    traits = {name: load_subject(f"two-pass/{name}").traits for name in ("nts-ar", "vts-ppt", "nts-lm", "vts-ppt-lm")}
    springs, inner = traits["nts-ar"], load_subject("nts-ar").traits
    unchanged = ("tangent", "symmetric", "conserves_force", "conserves_moment", "penalty", "takes_complex")
    assert all(springs.by_name()[name] == inner.by_name()[name] for name in (*unchanged, "enforcement"))
    assert (springs.promises.patch.flat, springs.rules.area, springs.witness("patch.flat.solve")) == (False, None, "a1")
    # Springs that act twice, nodal multipliers, and multipliers λ of which pass?
    flat = [traits[name].promises.patch.flat for name in ("vts-ppt", "nts-lm", "vts-ppt-lm")]
    assert flat == [False, True, None]
    assert traits["vts-ppt"].witness("balance.force") == "tilted"
    assert traits["nts-lm"].promises.independent_multipliers is False


def test_by_name_with_options_and_nested() -> None:
    interface, z = make_flat([2, 2, 4, 4], [3, 3, 3, 3])
    for name in ("two-pass/nts-ar:area=reference", "two-pass/two-pass/nts-ar:area=reference"):
        subject = load_subject(name)
        assert subject.name == name
        formulation = subject.with_penalty(PENALTY)
        tangent = formulation.tangent(interface, formulation.pair(interface, z), z).toarray()
        assert tangent == pytest.approx(tangent.T, abs=1e-14)
        assert tangent.any()


# Solved

ROUNDOFF = 1e-11  # The largest error of a stress over the pressure, on meshes whose segments differ little.
FAILS = 1e-2


def solve_scene(name: str, scenes: Scene) -> Trace:
    subject = load_subject(name)
    trace = solve(scenes, subject.for_case(scenes.case()))
    assert trace.converged
    return trace


def error_of(trace: Trace) -> float:
    """Return the largest error of a stress at a Gauss point, over the pressure."""
    return stress_error(trace.scene, trace.scene.stresses(trace.solution))


def blocks(slave: list[float], master: list[float]) -> Scene:
    y = np.linspace(0, 4, 3)
    return two_blocks(
        Rectangle(slave, y, young=1e4, poisson=0.3),
        Rectangle(master, y - 4, young=1e4, poisson=0.3),
        pressure=100.0,
        penalty=5e4,
    )


MATCHING = blocks([0, 2, 3, 7], [0, 2, 3, 7])
# Slave nodes face the middles of master segments and master nodes those of slave segments: what one pass gives too
# much to a node, the other gives too little.
STAGGERED = blocks([-3, -1, 1, 3], [-6, -4, -2, 0, 2, 4, 6])


@pytest.mark.parametrize("scenes", [MATCHING, STAGGERED], ids=["matching", "staggered"])
def test_they_pass_where_roles_are_symmetric(scenes: Scene) -> None:
    assert error_of(solve_scene("two-pass/nts-ar", scenes)) < ROUNDOFF
    assert error_of(solve_scene("nts-ar", STAGGERED)) > FAILS


def test_elsewhere_they_lock_which_is_not_passing() -> None:
    errors = [error_of(solve_scene("two-pass/nts-ar", make_scene("c", penalty=penalty))) for penalty in (1e6, 1e7, 1e8)]
    assert np.diff(np.log10(errors)) == pytest.approx(-1, abs=0.1)


@pytest.mark.parametrize(
    ("scene_name", "deficiency"),
    [("a1", 2), ("a2-graded", 2), ("b", 2), ("c", 2), ("c-prime", 2), ("example-1bis", 0), ("matching", 4)],
)
def test_nodal_multipliers_in_two_passes_pass_and_are_too_many_where_nodes_coincide(
    scene_name: str, deficiency: int
) -> None:
    trace = solve_scene("two-pass/nts-lm", MATCHING if scene_name == "matching" else make_scene(scene_name))
    assert error_of(trace) < ROUNDOFF
    assert trace.deficiency == deficiency


def test_two_passes_state_less_where_the_second_pass_shows_more() -> None:
    """Nodes enter past ends, points of two sides are reported twice, and two exact passes are exact on a kink."""
    half_passes, nodal = (load_subject(f"two-pass/{name}").traits for name in ("mortar-two-half-pass", "two-pass/nts"))
    assert (half_passes.rules.penalty, nodal.rules.penalty) == (None, "nodal")
    smooth = [load_subject(f"two-pass/{name}").traits.promises.continuity for name in ("mortar", "chen-hisada", "nts")]
    assert smooth == ["C0", None, "jumps"]
    kinked = [load_subject(f"two-pass/{name}").traits.promises.patch.kinked for name in ("sts", "nts-ar", "nts-lm")]
    assert kinked == [None, False, True]
