"""Lagrange multipliers: the forces of springs, which points are active, and what they solve."""

import numpy as np
import pytest
from every_formulation import load
from subjects import load_subject
from surfaces import DEPTH, make_bent, make_flat

from contactverif import Rectangle, solve, two_blocks
from contactverif.problems.catalogue import make_scene
from contactverif.problems.uniform_stress import stress_error

NAMES = (
    *("nts-lm", "vts-me-lm", "vts-me-lm:n=1", "vts-me-lm:n=3,area=reference", "vts-ppt-lm", "vts-ppt-lm:n=1"),
    *("vts-ppt-lm:n=3,free_end=extend", "vts-ppt-lm:free_end=cover", "vts-ppt-lm:transmission=balanced"),
    "vts-ppt-lm:transmission=balanced,n=1,free_end=cover",
)
OF_ALL = pytest.mark.parametrize("name", NAMES)
SPRINGS = {"nts-lm": "nts", "vts-me-lm": "vts-me", "vts-ppt-lm": "vts-ppt"}
FLAT = ([2, 2], [4]), ([2, 2, 4, 4], [3, 3, 4, 2]), ([2, 2, 4, 4], [3, 3, 3, 3])
C = 8.0  # scale of the decision λ − c g ≥ 0


@OF_ALL
def test_a_multiplier_that_is_the_pressure_of_the_spring_does_what_the_spring_does(name: str) -> None:
    """On bent and flat surfaces λ = −ε̂ g gives the forces of the penalty method; rows are −area × g."""
    of_springs = name.replace("-lm:transmission=balanced,", "-balanced:").replace(
        "-lm:transmission=balanced", "-balanced"
    )
    formulation, spring, in_contact = load(name, C), load(of_springs.replace("-lm", ""), C), 0
    for interface, z in (*map(make_bent, range(50)), *(make_flat(*lengths) for lengths in FLAT)):
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
def test_a_point_that_lets_go_has_its_multiplier_for_a_row(name: str) -> None:
    formulation = load(name, C)
    interface, z = make_flat([2, 2, 4, 4], [3, 3, 3, 3], shift=40.0)  # nothing faces anything
    multipliers = np.arange(1.0, 1 + formulation.n_multipliers(interface))
    state = np.append(z * 2, multipliers)  # areas are those of the reference
    pairing = formulation.pair(interface, state)
    forces, rows = np.split(formulation.residual(interface, pairing, state), [interface.n_unknowns])
    assert not forces.any()
    n = len(multipliers) // 4
    area = np.ones(5) if name == "nts-lm" else np.repeat([2, 2, 4, 4], n) / n
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
def test_a_point_is_active_where_its_multiplier_outweighs_its_gap(
    name: str, penetration: float, multiplier: float, active: bool
) -> None:
    formulation, (interface, z) = load(name, C), make_flat([2, 2], [3, 1])
    x = z.reshape(-1, 2).copy()
    x[: interface.n_slave_nodes, 1] = -penetration
    state = np.append(x, np.full(formulation.n_multipliers(interface), multiplier))
    assert (formulation.pair(interface, state)["active"] == active).all()


def test_they_are_counted() -> None:
    interface, _ = make_flat([2, 2, 4, 4], [3, 3, 3, 3])
    counts = {"nts-lm": 5, "vts-me-lm:n=3": 12, "vts-ppt-lm": 8} | dict.fromkeys(SPRINGS.values(), 0)
    assert {name: load(name).n_multipliers(interface) for name in counts} == counts


# `tests/paper/test_paper.py` asks which formulations pass on the paper's scenes, and for their multipliers.

PRESSURE = 100.0
ROUNDOFF = 1e-11  # The largest error of a stress or a multiplier over the pressure, on even meshes.


@pytest.mark.parametrize(
    ("name", "deficiency"), [("vts-ppt-lm", 7), ("vts-me-lm", 7), ("vts-ppt-lm:n=1", 0), ("nts-lm", 0)]
)
def test_a_fine_slave_on_a_coarse_master_is_short_of_rank(name: str, deficiency: int) -> None:
    """Eight slave segments with two points each: 16 constraints, and gaps that nine nodal values describe."""
    heights = np.linspace(0, 4, 3)
    blocks = two_blocks(
        Rectangle(np.arange(9), heights, young=1e4, poisson=0.3),
        Rectangle([0, 4, 8], heights - 4, young=1e4, poisson=0.3),
        pressure=PRESSURE,
    )
    trace = solve(blocks, load_subject(name).with_penalty(1e4))
    assert trace.converged
    assert trace.deficiency == deficiency
    assert stress_error(trace.scene, trace.scene.stresses(trace.solution)) < ROUNDOFF


@pytest.mark.parametrize("name", SPRINGS)
def test_the_scale_of_the_decision_changes_no_solution(name: str) -> None:
    scenes = make_scene("b", pressure=PRESSURE)
    soft, hard = (solve(scenes, load_subject(name).with_penalty(scale)) for scale in (1e2, 1e7))
    assert soft.u[-1] == pytest.approx(hard.u[-1], rel=1e-11, abs=1e-13)
