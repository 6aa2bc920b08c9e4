"""Newton's method: the exact pressure, every way to end, and what a trace tells."""

import itertools
import re
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from math import inf, isnan
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from pressed_blocks import ALL, make_sparse, on, solve_named
from scipy import sparse
from subjects import Changed, change_verbs, load_subject

from contactverif import CheckedFormulation, End, Interface, Rectangle, Scene, Subject, Trace, Traits, solve, two_blocks
from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.errors import MisuseError, PluginError
from contactverif.mechanics import bulk, linear
from contactverif.mechanics.system import System
from contactverif.problems import catalogue


def mean_pressure(scene: Scene, q: FloatArray) -> tuple[float, float]:
    """Return the mean normal stress of each body over its Gauss points, as a pressure."""
    upper, lower = (-stresses[..., 1] for stresses in scene.stresses(q))
    return float(upper.mean()), float(lower.mean())


# --- the exact answer -------------------------------------------------------------------------------------------

MASTERS = {"nts-ar": [0.0, 8.0], "vts-g": [0.0, 8.0], "vts-me": [0.0, 4, 8]}
DENSE_OR_SPARSE = pytest.mark.parametrize("dense", [True, False], ids=["dense", "sparse"])


@pytest.mark.parametrize("name", ALL[1:])
def test_the_pressure_of_two_pressed_blocks(name: str) -> None:
    """The pressure is p = Δ/(H1/M1 + H2/M2 + 1/ε̂), on a pair of meshes that each formulation can do."""
    slave = Rectangle([0, 2, 4, 8], [0, 2, 6], young=1, poisson=0.3)
    master = Rectangle(MASTERS.get(name, [0.0, 1.7, 3.1, 6.4, 8.0]), [-4, -2, 0], young=3, poisson=0.2)
    scene = two_blocks(slave, master, penalty=10, approach=0.1)
    trace = solve_named(name, scene)
    assert trace.end is End.CONVERGED
    upper, lower = mean_pressure(scene, trace.solution)
    assert abs(upper - 0.017369727047) <= 1e-12  # The exact pressure was computed by hand.
    assert abs(lower - 0.017369727047) <= 1e-12
    # E (1 − ν) / ((1 + ν) (1 − 2ν)) of both
    upper_modulus, lower_modulus = Fraction(7, 10) / Fraction(52, 100), Fraction(24, 10) / Fraction(72, 100)
    exact = float(Fraction(1, 10) / (6 / upper_modulus + 4 / lower_modulus + Fraction(1, 10)))
    matrix, _ = System(scene, on(name, scene)).matrix(trace.solution, on(name, scene).pair(scene.interface, trace.z))
    assert abs(upper - exact) <= UNIT_ROUNDOFF * np.linalg.cond(matrix) * 0.1  # of a displacement of 0.1


# --- every end --------------------------------------------------------------------------------------------------


def check_trace(trace: Trace, scene: Scene) -> None:
    """Check the shapes and meanings of all that a trace has, whatever its end."""
    n = len(trace.q)
    assert trace.scene is scene
    assert trace.q.shape == (n, scene.n_free)
    for name in ("factors", "residuals", "energies", "floors", "roundings", "changes", "conditions"):
        assert getattr(trace, name).shape == (n,), name
        with pytest.raises(ValueError, match="read-only"):
            getattr(trace, name)[0] = 0
    assert trace.changes.dtype == np.int64
    assert isnan(trace.energies[-1])
    assert trace.n_iterations == np.isfinite(trace.energies).sum()
    assert isnan(trace.conditions[-1]) == (trace.end is not End.SINGULAR)
    assert np.array_equal(trace.solution, trace.q[-1])
    assert np.array_equal(trace.z[: scene.interface.n_unknowns], scene.positions(trace.q[-1], trace.factors[-1]))
    assert trace.converged == (trace.end is End.CONVERGED) == (trace.roundings[-1] <= 1)
    assert trace.end.label
    assert trace.end.advice.count("\n") == 0


class Springs:
    """Springs on both sides whether open or not: forces stiffness × (z − Z).

    The tangent is the right one times `tangent_factor`.
    """

    def __init__(self, penalty: float, tangent_factor: float = 1.0, noise: float = 0.0) -> None:
        self.penalty, self.tangent_factor, self.noise = penalty, tangent_factor, noise
        self.traits = Traits()

    def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
        moved = z - interface.nodes.reshape(-1)
        rough = np.sin(1e18 * moved + np.arange(z.size))  # another number at every iterate, the same at the same one
        return self.penalty * (moved + self.noise * np.abs(z) * rough)

    def tangent(self, interface: Interface, pairing: Any, z: Any) -> Any:
        return self.tangent_factor * self.penalty * np.eye(z.size)


def springs(scene: Scene, **options: float) -> CheckedFormulation:
    return Subject("springs", lambda *, penalty: Springs(penalty, **options)).with_penalty(1e4)


def test_converged() -> None:
    scene = catalogue.make_scene("c", penalty=1e4, sides="free", ratio=0.5, lowered=0.0)
    trace = solve_named("vts-ppt", scene)
    check_trace(trace, scene)
    assert trace.end is End.CONVERGED
    assert (trace.factors == 1).all()
    assert trace.changes[0] == -1
    assert (trace.changes[1:] >= 0).all()
    assert (trace.conditions[:-1] > 0).all()
    assert (trace.conditions[:-1] < 1).all()


def test_a_two_cycle_is_named() -> None:
    scene = catalogue.make_scene("c", penalty=1e4)
    trace = solve_named("vts-me", scene)
    check_trace(trace, scene)
    assert trace.end is End.CYCLE
    assert np.abs(trace.q[-1] - trace.q[-3]).max() <= 2.0**-20 * np.abs(trace.q[-1] - trace.q[-2]).max()
    assert (trace.changes[-2:] > 0).all()  # two pairings take turns
    assert min(trace.residuals[-4:]) > 1e3 * max(trace.floors[-4:])


@DENSE_OR_SPARSE
@pytest.mark.parametrize("name", catalogue.BLOCKS)
def test_a_punch_that_starts_open_and_hangs_on_contact_is_singular(
    name: str, dense: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever roundoff makes of the matrix: a step of 1e14 downwards would find contact there, and "converge"."""
    if not dense:
        make_sparse(monkeypatch)
    for degrees, poisson, refine in ((0.0, 0.3, 1), (10.0, 0.2, 3), (33.0, 0.45, 1), (77.0, 0.0, 2)):
        scene = catalogue.make_scene(name, lowered=-0.1, degrees=degrees, poisson=poisson, refine=refine)
        trace = solve_named("vts-ppt", scene)
        check_trace(trace, scene)
        assert trace.end is End.SINGULAR
        assert trace.n_iterations == 0
        assert trace.conditions[-1] <= scene.n_free * UNIT_ROUNDOFF
    assert "contact" in trace.end.advice


def test_roundoff_of_the_solver_does_not_decide_whether_a_tie_is_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes face nodes here, so roundoff decides who is paired with whom, and some of these matrices are singular."""
    shortest, random = linear._shortest, np.random.default_rng(1)

    def add_roundoff(matrix: FloatArray, *arguments: Any) -> Any:
        return shortest(matrix * (1 + UNIT_ROUNDOFF * random.uniform(-1, 1, matrix.shape)), *arguments)

    monkeypatch.setattr(linear, "_shortest", add_roundoff)
    scene = catalogue.make_scene("c", refine=2)
    iterations = []
    for _ in range(6):
        trace = solve_named("vts-ppt-lm", scene)
        assert trace.converged
        assert trace.roundings[-1] <= 1
        iterations.append(trace.n_iterations)
    assert max(iterations) > 1


@DENSE_OR_SPARSE
def test_a_stiff_contact_is_not_singular(dense: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if not dense:
        make_sparse(monkeypatch)
    for penalty, ratio in ((1e14, 1.0), (1e4, 1e6), (1e14, 1e6)):
        scene = catalogue.make_scene("c", penalty=penalty, ratio=ratio)
        system = System(scene, on("vts-ppt", scene))
        matrix, _ = system.matrix(scene.start, system.pair(scene.start))
        full = matrix if dense else matrix.toarray()
        exact = 1 / np.linalg.cond(full, 1)
        condition = system.step(matrix, np.ones(scene.n_free)).condition
        # The estimate of |K⁻¹| is one from below, in single precision.
        assert exact <= condition * (1 + 2.0**-24 + scene.n_free * UNIT_ROUNDOFF / exact)
        assert condition <= 3 * exact


def test_iterates_that_leave() -> None:
    scene = catalogue.make_scene("c")
    trace = solve(scene, springs(scene, tangent_factor=0.1), start=np.full(scene.n_free, 1e-3))
    check_trace(trace, scene)
    assert trace.end is End.DIVERGED
    assert trace.residuals[-1] > 1e8 * trace.residuals[0] > 1e8 * trace.residuals[-2] / trace.residuals[-1]
    assert np.isfinite(trace.q).all()


def test_out_of_iterations() -> None:
    scene = catalogue.make_scene("c", penalty=1e4, lowered=0.0)
    trace = solve_named("vts-ppt-basic", scene, iterations=3)
    check_trace(trace, scene)
    assert trace.end is End.EXHAUSTED
    assert trace.n_iterations == 3
    assert len(trace.q) == 4
    whole = solve_named("vts-ppt-basic", scene)
    assert np.array_equal(whole.q[:4], trace.q)
    assert whole.end is End.CONVERGED


def test_stagnated_just_above_roundoff() -> None:
    scene = catalogue.make_scene("c")
    quiet = solve(scene, springs(scene))
    assert quiet.end is End.CONVERGED
    trace = solve(scene, springs(scene, noise=1e3 * UNIT_ROUNDOFF))
    check_trace(trace, scene)
    assert trace.end is End.STAGNATED
    assert 1 < min(trace.roundings) <= 1e3


def test_a_wrong_tangent_is_no_error() -> None:
    """The tangent says that nothing pushes though something does; what pushes is no roundoff."""
    scene = catalogue.make_scene("c")
    scene = replace(scene, bodies=tuple(replace(body, load=0 * body.load) for body in scene.bodies))
    trace = solve(scene, springs(scene, tangent_factor=0.0, noise=1e-3), start=np.zeros(scene.n_free), iterations=5)
    check_trace(trace, scene)
    assert trace.roundings[0] > 1e12
    assert trace.end is not End.CONVERGED


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("scene", ["b", "c", "c-prime", "example-1", "example-1bis"])
@pytest.mark.parametrize("penalty", [1e2, 1e5, 1e9])
def test_non_convergence_never_raises(name: str, scene: str, penalty: float) -> None:
    for lowered in (-1e-3, 0.0, 1.0, 3.0):
        low_scene = catalogue.make_scene(scene, penalty=penalty, lowered=lowered, sides="free", degrees=10.0)
        check_trace(solve_named(name, low_scene, iterations=12), low_scene)


def test_bad_options_of_a_solution() -> None:
    scene = catalogue.make_scene("a1")
    formulation = on("vts-ppt", scene)
    for name, value, message in (
        ("load_steps", 0, "found 0; needed at least 1"),
        ("iterations", 0, "found 0; needed at least 1"),
        ("start", np.zeros(3), f"found shape (3,); needed shape ({scene.n_free},)"),
        ("start", np.full(scene.n_free, np.nan), "found NaN or infinity; needed finite numbers"),
    ):
        with pytest.raises(MisuseError, match=f"^{re.escape(f'{name}: {message}')}$"):
            solve(scene, formulation, **{name: value})  # type: ignore[arg-type]


# --- what a trace tells -----------------------------------------------------------------------------------------


def test_residuals_energies_and_changes_are_what_they_say() -> None:
    scene = catalogue.make_scene("c", penalty=1e4, sides="free", ratio=0.5, lowered=0.0)
    formulation = on("vts-ppt-basic", scene)
    trace = solve(scene, formulation)
    pairings = []
    for index, q in enumerate(trace.q):
        z = scene.interface.nodes.reshape(-1) + scene.imposed_displacements + np.asarray(scene.transformation) @ q
        pairing = formulation.pair(scene.interface, z)
        assert pairing is not None
        pairings.append(pairing)
        contact = formulation.residual(scene.interface, pairing, z)
        residual = scene.stiffness @ q - scene.load + np.asarray(scene.transformation).T @ contact
        assert abs(np.abs(residual).max() - trace.residuals[index]) <= trace.floors[index]
        if index < trace.n_iterations:
            energy = abs((trace.q[index + 1] - q) @ residual)
            step = np.abs(trace.q[index + 1] - q).sum()
            assert abs(energy - trace.energies[index]) <= 2 * trace.floors[index] * step + 1e-15 * energy
            matrix, _ = System(scene, formulation).matrix(q, pairing)
            exact = 1 / np.linalg.cond(matrix, 1)
            # The estimate of |K⁻¹| is one from below, in single precision.
            assert exact <= trace.conditions[index] * (1 + 2.0**-24 + scene.n_free * UNIT_ROUNDOFF / exact)
            assert trace.conditions[index] <= 3 * exact
    changes = [sum(int((b[name] != a[name]).sum()) for name in a) for a, b in itertools.pairwise(pairings)]
    assert trace.changes.tolist() == [-1, *changes]
    assert trace.residuals[0] > 1e10 * trace.residuals[-1]


def rounding_at(trace: Trace, formulation: CheckedFormulation, floor: float = 0.0) -> float:
    """Return by how much two solutions may differ that both stop where the residual is below its roundoff."""
    system, u = System(trace.scene, formulation), trace.u[-1]
    matrix, floors = system.matrix(u, system.pair(u))
    return float(2 * np.linalg.norm(np.linalg.inv(matrix), np.inf) * max(floors.max(), floor))


def test_load_steps_end_at_the_same_solution() -> None:
    scene = catalogue.make_scene("c", penalty=1e4, sides="free", ratio=0.5)
    once, four = solve_named("vts-ppt", scene), solve_named("vts-ppt", scene, load_steps=4)
    check_trace(four, scene)
    assert four.end is once.end is End.CONVERGED
    assert np.abs(four.solution - once.solution).max() <= rounding_at(once, on("vts-ppt", scene))
    factors, counts = np.unique(four.factors, return_counts=True)
    assert factors.tolist() == [0.25, 0.5, 0.75, 1.0]
    assert (np.diff(four.factors) >= 0).all()
    assert counts.sum() - 4 == four.n_iterations
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    assert (four.changes[starts] == -1).all()  # each load step begins anew, from where the one before ended
    assert np.array_equal(four.q[starts[1:]], four.q[starts[1:] - 1])
    assert np.array_equal(four.q[0], scene.start / 4)
    pressures = [mean_pressure(scene, four.q[last])[0] for last in np.cumsum(counts) - 1]
    assert (np.diff(pressures) > 0).all()


def test_load_steps_of_an_imposed_displacement() -> None:
    scene = two_blocks(Rectangle([0, 1, 3], [0, 1]), Rectangle([0, 2, 3], [-1, 0]), penalty=10, approach=0.1)
    trace = solve_named("vts-ppt", scene, load_steps=2)
    half = [-stresses[..., 1] for stresses in scene.stresses(trace.q[np.flatnonzero(trace.factors == 0.5)[-1]], 0.5)]
    exact = 0.1 / (1 + 1 + 0.1)
    bound = 64 * UNIT_ROUNDOFF  # Displacements are up to 0.1, cells 1, and coordinates up to 3.
    assert max(np.abs(values - exact / 2).max() for values in half) <= bound
    assert abs(mean_pressure(scene, trace.solution)[0] - exact) <= bound


def test_a_load_step_that_fails_is_the_last() -> None:
    scene = catalogue.make_scene("c", penalty=1e4, lowered=0.0)
    trace = solve_named("vts-ppt-basic", scene, load_steps=3, iterations=2)
    assert trace.end is End.EXHAUSTED
    assert trace.factors.tolist() == [1 / 3] * 3
    assert np.array_equal(trace.z, scene.positions(trace.solution, 1 / 3))


def wrap_formulation(name: str, scene: Scene, **parts: Callable[..., Any] | None) -> CheckedFormulation:
    inner = load_subject(name)
    return Subject(name, lambda *, penalty: Changed(inner._make(penalty=penalty), **parts)).for_case(scene.case())


@pytest.mark.parametrize("name", ["vts-ppt", "vts-ppt-basic", "nts-ar"])
def test_a_formulation_without_tangent_is_differentiated(name: str) -> None:
    scene = catalogue.make_scene("c", penalty=1e4, sides="free", ratio=0.5)
    formulation = wrap_formulation(name, scene, tangent=None)
    assert "tangent" not in formulation.provides
    trace, reference = solve(scene, formulation), solve_named(name, scene)
    check_trace(trace, scene)
    assert trace.end is reference.end is End.CONVERGED
    differentiated = solve_named(name, scene, use_tangent=False)
    assert np.array_equal(differentiated.q, trace.q)
    bound = rounding_at(reference, formulation, trace.floors[-1])
    assert np.abs(trace.solution - reference.solution).max() <= bound
    pairing, right = formulation.pair(scene.interface, reference.z), on(name.removesuffix("-basic"), scene)
    matrix, exact = (System(scene, each).matrix(reference.solution, pairing)[0] for each in (formulation, right))
    # central differences: a third power of (u X / shortest) twice over
    h = (UNIT_ROUNDOFF * np.abs(reference.z).max() / 2) ** (1 / 3)
    assert np.abs(matrix - exact).max() <= h**2 * np.abs(exact).max()


def test_a_formulation_without_pairing() -> None:
    scene = catalogue.make_scene("c")
    trace = solve(scene, springs(scene))
    assert trace.end is End.CONVERGED
    assert (trace.changes == -1).all()
    assert trace.n_iterations == 1  # linear
    expected = np.linalg.solve(scene.stiffness + 1e4 * np.eye(scene.n_free), scene.load)
    assert np.abs(trace.solution - expected).max() <= rounding_at(trace, springs(scene))


@pytest.mark.parametrize("stiffness", ["sparse", "full"])
@pytest.mark.parametrize("name", ["vts-ppt", "vts-ppt-balanced", "nts-ar", "mortar-lm"])
def test_sparse_and_dense_agree(name: str, stiffness: str, monkeypatch: pytest.MonkeyPatch) -> None:
    options: dict[str, Any] = {"penalty": 1e4, "sides": "free", "ratio": 0.5, "refine": 2}
    scene = catalogue.make_scene("c", **options)
    dense = solve_named(name, scene)
    bound = rounding_at(dense, on(name, scene))
    make_sparse(monkeypatch, bulk.DENSE_SHARE if stiffness == "full" else inf)
    large = catalogue.make_scene("c", **options)
    trace = solve_named(name, large)
    check_trace(trace, large)
    assert sparse.issparse(large.transformation)
    assert sparse.issparse(large.stiffness) == (stiffness == "sparse")
    assert trace.end is dense.end is End.CONVERGED
    assert np.abs(trace.solution - dense.solution).max() <= bound


@pytest.mark.parametrize("verb", ["pair", "residual", "tangent"])
def test_a_plugin_that_raises_in_the_middle(verb: str) -> None:
    scene, calls = catalogue.make_scene("c", penalty=1e4, lowered=0.0), []

    def third_time(right: Any, *state: Any) -> Any:
        calls.append(verb)
        return right(*state) if len(calls) < 3 else 1 // 0

    inner = load_subject("vts-ppt-basic")
    subject = Subject("raises", lambda *, penalty: change_verbs(inner._make(penalty=penalty), **{verb: third_time}))
    with pytest.raises(PluginError, match=rf"^{verb}: ZeroDivisionError: .* by zero \(test_newton\.py, line"):
        solve(scene, subject.for_case(scene.case()))
    assert len(calls) == 3


@pytest.mark.parametrize("in_one_call", [True, False])
def test_each_iterate_asks_once_for_the_residual_and_once_for_the_tangent(in_one_call: bool) -> None:
    scene, calls = catalogue.make_scene("c", penalty=1e4, lowered=0.0), []
    plugin = load_subject("vts-ppt-basic")._make(penalty=1e4)

    def count(*names: str) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            calls.extend(names)
            answers = tuple(getattr(plugin, name)(*arguments) for name in names)
            return answers if len(names) > 1 else answers[0]

        return call

    parts = {"residual": count("residual"), "tangent": count("tangent")}
    if in_one_call:
        parts = {name: lambda *_: pytest.fail("one call is enough") for name in parts}
        parts["residual_and_tangent"] = count("residual", "tangent")
    trace = solve(scene, wrap_formulation("vts-ppt-basic", scene, **parts))
    reference = solve_named("vts-ppt-basic", scene)
    assert calls == ["residual", "tangent"] * len(trace.u)
    assert np.array_equal(trace.u, reference.u)
    assert trace.n_iterations == reference.n_iterations > 1


def test_no_tangent_where_forces_balance_already() -> None:
    scene = catalogue.make_scene("c", penalty=1e4, lowered=0.0)
    tangent = Mock(wraps=load_subject("vts-ppt-basic")._make(penalty=1e4).tangent)
    trace = solve(scene, wrap_formulation("vts-ppt-basic", scene, tangent=tangent), tolerance=1e-6)
    assert trace.converged
    assert tangent.call_count == trace.n_iterations == len(trace.u) - 1


@DENSE_OR_SPARSE
def test_unsymmetric_matrices_are_solved_right(dense: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if not dense:
        make_sparse(monkeypatch)
    scene = catalogue.make_scene("c", sides="free", penalty=1e5, lowered=0.05)
    system = System(scene, on("vts-ppt", scene))
    q = scene.start + 1e-3 * np.sin(np.arange(scene.n_free))
    pairing = system.pair(q)
    matrix, _ = system.matrix(q, pairing)
    residual = system.residual(q, pairing)
    full = matrix if dense else matrix.toarray()
    assert np.abs(full - full.T).max() > 1e-3 * np.abs(full).max()
    step = system.step(matrix, -residual).change
    assert step is not None
    expected = np.linalg.solve(full, -residual)
    assert np.abs(step - expected).max() <= 4 * UNIT_ROUNDOFF * np.linalg.cond(full) * np.abs(expected).max()
    other = np.linalg.solve(full.T, -residual)
    assert np.abs(other - expected).max() > 1e-3 * np.abs(expected).max()


def test_every_end_has_its_number_and_its_words() -> None:
    assert len({end.label for end in End}) == len(End) == 6
    assert [int(end) for end in End] == list(range(6))


@pytest.mark.parametrize("name", ["vts-ppt", "mortar"])
def test_a_kept_matrix_leads_to_the_same_solution(name: str) -> None:
    scene = catalogue.load_scene("c-prime")
    traces = [solve(scene, on(name, scene), use_tangent=False, solution_only=keep) for keep in (False, True)]
    assert all(trace.converged for trace in traces)
    size = np.abs(traces[0].solution).max()
    assert np.abs(traces[1].solution - traces[0].solution).max() <= 1e-12 * size


def test_a_kept_matrix_stops_where_the_matrix_of_that_state_would() -> None:
    """The first guess penetrates 60 times too deep. Its floor is 50 times that of the solution."""
    slave, master = Rectangle([0, 0.125], [2, 3]), Rectangle([0, 0.125], [-3, -2, 2])
    scene = two_blocks(slave, master, penalty=80, approach=0.75)
    trace = solve(scene, on("vts-ppt", scene), use_tangent=False, solution_only=True)
    system = System(scene, on("vts-ppt", scene), use_tangent=False)
    pairing = system.pair(trace.solution)
    _, floor = system.matrix(trace.solution, pairing)
    assert trace.converged
    assert (np.abs(system.residual(trace.solution, pairing)) <= floor).all()
