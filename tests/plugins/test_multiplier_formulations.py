"""Lagrange multipliers: the forces of springs and of the paper's tables, who is active, and what they solve."""

from typing import Any

import numpy as np
import pytest
from surfaces import DEPTH, make_bent, make_flat
from test_forces import TABLE

import contactverif_nts
from contactverif import Rectangle, Scene, Subject, Trace, solve, two_blocks
from contactverif.problems.catalogue import make_scene
from contactverif.problems.uniform_stress import stress_error

METHODS = [
    ("nts_lm", {}),
    ("vts_me_lm", {}),
    ("vts_me_lm", {"n": 1}),
    ("vts_me_lm", {"n": 3, "area": "reference"}),
    ("vts_ppt_lm", {}),
    ("vts_ppt_lm", {"n": 1}),
    ("vts_ppt_lm", {"n": 3, "free_end": "extend"}),
    ("vts_ppt_lm", {"free_end": "cover"}),
    ("vts_ppt_lm", {"transmission": "balanced"}),
    ("vts_ppt_lm", {"transmission": "balanced", "n": 1, "free_end": "cover"}),
]
IDS = [f"{name}{options or ''}" for name, options in METHODS]
OF_ALL = pytest.mark.parametrize(("name", "options"), METHODS, ids=IDS)
SPRINGS = {"nts_lm": "nts", "vts_me_lm": "vts_me", "vts_ppt_lm": "vts_ppt"}
C = 8.0  # scale of the decision λ − c g ≥ 0


def make(name: str, **options: Any) -> Any:
    return getattr(contactverif_nts, name)(penalty=C, **options)


@OF_ALL
def test_a_multiplier_that_is_the_pressure_of_the_spring_does_what_the_spring_does(
    name: str, options: dict[str, Any]
) -> None:
    """On bent and flat surfaces λ = −ε̂ g gives the forces of the penalty method; rows are −area × g."""
    formulation = make(name, **options)
    balanced = "_balanced" if "transmission" in options else ""
    others = {option: value for option, value in options.items() if option != "transmission"}
    spring = make(SPRINGS[name] + balanced, **others)
    in_contact = 0
    for interface, z in (*map(make_bent, range(50)), *(make_flat(*case[:2]) for case in TABLE.values())):
        points = spring.contact_points(interface, spring.pair(interface, z), z)
        state = np.append(z, -C * points.gap)
        pairing = formulation.pair(interface, state)
        assert pairing == spring.pair(interface, z)
        answer = formulation.residual(interface, pairing, state)
        forces, rows = np.split(answer, [interface.n_unknowns])
        exact = spring.residual(interface, pairing, z)
        assert forces == pytest.approx(exact, rel=1e-13, abs=1e-14)
        active = pairing["active"]
        assert rows[active] == pytest.approx((-points.weight * points.gap)[active], rel=1e-13)
        computed = formulation.contact_points(interface, pairing, state)
        assert np.array_equal(computed.pressure, points.pressure)
        in_contact += int(active.sum())
    assert in_contact > 50


@OF_ALL
def test_a_point_that_lets_go_has_its_multiplier_for_a_row(name: str, options: dict[str, Any]) -> None:
    formulation = make(name, **options)
    interface, z = make_flat([2, 2, 4, 4], [3, 3, 3, 3], shift=40.0)  # nothing faces anything
    multipliers = np.arange(1.0, 1 + formulation.n_multipliers(interface))
    state = np.append(z * 2, multipliers)  # areas are those of the reference
    pairing = formulation.pair(interface, state)
    forces, rows = np.split(formulation.residual(interface, pairing, state), [interface.n_unknowns])
    assert not forces.any()
    n = 1 if name == "nts_lm" else options.get("n", 2)
    area = np.ones(5) if name == "nts_lm" else np.repeat([2, 2, 4, 4], n) / n
    assert rows == pytest.approx(area * multipliers, rel=1e-15)
    assert not formulation.contact_points(interface, pairing, state).pressure.any()


@pytest.mark.parametrize(
    ("penetration", "multiplier", "active"),
    [
        (DEPTH, 0.0, True),
        (0.0, 0.0, True),  # bodies that touch exactly begin in contact
        (-DEPTH, 0.0, False),
        (-DEPTH, C * DEPTH, True),
        (-DEPTH, C * DEPTH * (1 - 2.0**-50), False),
        (DEPTH, -C * DEPTH, True),
        (DEPTH, -C * DEPTH * (1 + 2.0**-50), False),
    ],
)
@pytest.mark.parametrize("name", SPRINGS)
def test_who_is_active(name: str, penetration: float, multiplier: float, active: bool) -> None:
    formulation = make(name)
    interface, z = make_flat([2, 2], [3, 1])
    x = z.reshape(-1, 2).copy()
    x[: interface.n_slave_nodes, 1] = -penetration
    state = np.append(x, np.full(formulation.n_multipliers(interface), multiplier))
    assert (formulation.pair(interface, state)["active"] == active).all()


def test_they_are_counted() -> None:
    interface, _ = make_flat([2, 2, 4, 4], [3, 3, 3, 3])
    assert make("nts_lm").n_multipliers(interface) == 5
    assert make("vts_me_lm", n=3).n_multipliers(interface) == 12
    assert make("vts_ppt_lm").n_multipliers(interface) == 8
    assert all(make(name).n_multipliers(interface) == 0 for name in SPRINGS.values())


# Solved. `tests/paper/test_paper_table.py` asks who passes on the paper's scenes, and what the multipliers are there.

PRESSURE = 100.0
ROUNDOFF = 1e-11  # The largest error of a stress or a multiplier over the pressure, on even meshes.


def solve_scene(name: str, scene: Scene, *, penalty: float | None = None, **options: Any) -> Trace:
    subject = Subject(name, lambda *, penalty: getattr(contactverif_nts, name)(penalty=penalty, **options))
    return solve(scene, subject.for_case(scene.case()) if penalty is None else subject.with_penalty(penalty))


def error_of(trace: Trace) -> float:
    """Return the largest error of a stress at a Gauss point, over the pressure."""
    return stress_error(trace.scene, trace.scene.stresses(trace.solution))


@pytest.mark.parametrize(
    ("name", "options", "deficiency"),
    [("vts_ppt_lm", {}, 7), ("vts_me_lm", {}, 7), ("vts_ppt_lm", {"n": 1}, 0), ("nts_lm", {}, 0)],
)
def test_a_fine_slave_on_a_coarse_master_is_short_of_rank(name: str, options: dict[str, Any], deficiency: int) -> None:
    """Eight slave segments with two points each: 16 constraints, and gaps that nine nodal values describe."""
    heights = np.linspace(0, 4, 3)
    blocks = two_blocks(
        Rectangle(np.arange(9), heights, young=1e4, poisson=0.3),
        Rectangle([0, 4, 8], heights - 4, young=1e4, poisson=0.3),
        pressure=PRESSURE,
    )
    trace = solve_scene(name, blocks, penalty=1e4, **options)
    assert trace.converged
    assert trace.deficiency == deficiency
    assert error_of(trace) < ROUNDOFF


@pytest.mark.parametrize("name", SPRINGS)
def test_the_scale_of_the_decision_changes_no_solution(name: str) -> None:
    scenes = make_scene("b", pressure=PRESSURE)
    soft, hard = (solve_scene(name, scenes, penalty=scale) for scale in (1e2, 1e7))
    assert soft.u[-1] == pytest.approx(hard.u[-1], rel=1e-11, abs=1e-13)
