"""Hertz' boxes: meshes that match nowhere, tractions in balance, exact displacements that fit, and a first solution."""

import numpy as np
import pytest
from subjects import load_subject

from contactverif import MisuseError, solve
from contactverif.problems.hertz_boxes import COARSEST, HertzBox, exact_displacements, hertz_body, hertz_box, mesh_lines

BOX = HertzBox()
MESHES = (16, 23, 24, 33, 48, 54)


@pytest.mark.parametrize("across", MESHES)
def test_no_node_of_one_body_meets_one_of_the_other_in_the_contact(across: int) -> None:
    zones = [mesh_lines(number, across)[2] for number in (0, 1)]
    nearest = np.abs(zones[0][:, None] - zones[1])[np.abs(zones[0]) < 1].min()
    assert nearest > 1e-4 * np.diff(zones[0])[0]


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("across", MESHES)
def test_the_edges_divide_segments_one_to_two_and_two_to_one(number: int, across: int) -> None:
    _, _, zone = mesh_lines(number, across)
    shares = (np.array([-1.0, 1.0]) - zone[0]) / np.diff(zone)[0] % 1
    assert np.sort(shares) == pytest.approx([1 / 3, 2 / 3], abs=1e-9)
    assert np.diff(zone) == pytest.approx(np.full(len(zone) - 1, np.diff(zone)[0]), rel=1e-9)


def test_at_least_eight_segments_lie_across_the_half_width() -> None:
    assert np.diff(mesh_lines(0, COARSEST)[2])[0] <= 1 / 8
    with pytest.raises(MisuseError, match="across: found 15; needed at least 16"):
        hertz_box(BOX, penalty=1.0, across=15)


@pytest.mark.parametrize("penalty", [None, 8.0, 800.0])
@pytest.mark.parametrize("number", [0, 1])
def test_the_tractions_carry_the_force_and_have_no_moment(number: int, penalty: float | None) -> None:
    body, pressure = hertz_body(BOX, number, penalty=penalty), BOX.pressure(penalty)
    along, across = body.load.sum(axis=0)
    assert across == pytest.approx((-1, 1)[number] * pressure.force, rel=1e-8)
    assert abs(along) <= 1e-8 * pressure.force
    moment = (body.nodes[:, 0] * body.load[:, 1] - body.nodes[:, 1] * body.load[:, 0]).sum()
    assert abs(moment) <= 1e-2 * pressure.force  # Of the slope a/R times the width 8a: sides of the parabola are bent.


@pytest.mark.parametrize("penalty", [None, 8.0])
def test_the_exact_surfaces_fit(penalty: float | None) -> None:
    """Parabola minus flat is −p/ε̂ in contact, and open beside it."""
    x = np.linspace(-1.2, 1.2, 25)
    up = [exact_displacements(BOX, penalty, number, x, 16)[:, 1] for number in (0, 1)]
    gap = x**2 / (2 * BOX.radius) + up[0] - up[1]
    layer = 0 * x if penalty is None else BOX.pressure(penalty).pressure(x) / penalty
    inside = np.abs(x) <= 1
    assert (gap + layer)[inside] == pytest.approx(0, abs=1e-12)
    assert (gap[~inside] > 0).all()


def test_nodal_forces_are_consistent() -> None:
    pressure, x = BOX.pressure(8.0), np.linspace(-1.3, 1.3, 14)
    forces = pressure.nodal_forces(x)
    assert forces.sum() == pytest.approx(pressure.force, rel=1e-12)
    assert forces @ x == pytest.approx(0, abs=1e-12 * pressure.force)
    points, weights = np.polynomial.legendre.leggauss(30)
    left, right = ((x[n] + x[n + 1]) / 2 + 0.1 * points for n in (5, 6))  # The pressure is smooth in the middle.
    shapes = (left - x[5]) / 0.2, (x[7] - right) / 0.2
    exact = sum(0.1 * weights @ (pressure.pressure(s) * shape) for s, shape in zip((left, right), shapes, strict=True))
    assert forces[6] == pytest.approx(exact, rel=1e-11)


@pytest.mark.parametrize("parabola_is_slave", [True, False])
def test_a_solution_is_near_the_exact_displacements(parabola_is_slave: bool) -> None:
    penalty = 16.0
    scene = hertz_box(BOX, penalty=penalty, parabola_is_slave=parabola_is_slave)
    subject = load_subject("sts")
    trace = solve(scene, subject.for_case(scene.case()))
    assert trace.converged
    moves = (scene.positions(trace.solution) - scene.interface.nodes.reshape(-1)).reshape(-1, 2)
    n_slave, x = scene.interface.n_slave_nodes, scene.interface.nodes[:, 0]
    for number, nodes in ((0, slice(None, n_slave)), (1, slice(n_slave, None))):
        body = number if parabola_is_slave else 1 - number
        exact = exact_displacements(BOX, penalty, body, x[nodes], COARSEST)
        assert np.abs(moves[nodes] - exact).max() <= 0.02 * np.abs(exact).max()
