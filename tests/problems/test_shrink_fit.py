"""The exact fields of two rings that are shrunk onto each other, and their scene."""

from dataclasses import replace
from math import inf, pi
from typing import Literal

import numpy as np
import pytest

from contactverif.contract.errors import MisuseError
from contactverif.problems.shrink_fit import RingStudy, Role, ShrinkFit, shrink_fit

RINGS: tuple[Role, Role] = ("inner", "outer")


def test_the_pressures_are_those_of_lame() -> None:
    assert ShrinkFit().pressure() == pytest.approx(0.0696185, abs=5e-8)
    assert ShrinkFit().pressure(1e3) == pytest.approx(0.0650872, abs=5e-8)


@pytest.mark.parametrize("ring", RINGS)
@pytest.mark.parametrize("penalty", [1e2, inf])
def test_stress_and_displacement_satisfy_the_equations_of_an_elastic_ring(ring: Role, penalty: float) -> None:
    problem = ShrinkFit()
    index = int(ring == "outer")
    free = (problem.inner_radius, problem.outer_radius)[index]
    r, h = np.linspace(min(free, 1.5), max(free, 1.5), 7), 1e-5
    radial, hoop = problem.stresses(r, ring, penalty).T
    slope = (problem.stresses(r + h, ring, penalty)[:, 0] - problem.stresses(r - h, ring, penalty)[:, 0]) / (2 * h)
    np.testing.assert_allclose(slope + (radial - hoop) / r, 0, atol=1e-8 * np.abs(hoop).max())  # balance of forces
    young, poisson = problem.young[index], problem.poisson[index]
    modulus, ratio = young / (1 - poisson**2), poisson / (1 - poisson)
    u = problem.displacement(r, ring, penalty)
    stretch = (problem.displacement(r + h, ring, penalty) - problem.displacement(r - h, ring, penalty)) / (2 * h)
    np.testing.assert_allclose(u / r, (hoop - ratio * radial) / modulus, rtol=1e-12)
    np.testing.assert_allclose(stretch, (radial - ratio * hoop) / modulus, rtol=1e-6)


@pytest.mark.parametrize("penalty", [1e2, 1e3, inf])
def test_the_rings_meet_at_the_interface_and_are_free_elsewhere(penalty: float) -> None:
    problem = ShrinkFit()
    c = np.array([problem.radius])
    moves = [problem.displacement(c, ring, penalty)[0] for ring in RINGS]
    pressure = problem.pressure(penalty)
    assert problem.interference + moves[0] - moves[1] == pytest.approx(pressure / penalty, rel=1e-12, abs=1e-18)
    for ring, free in zip(RINGS, (problem.inner_radius, problem.outer_radius), strict=True):
        assert problem.stresses(c, ring, penalty)[0, 0] == pytest.approx(-pressure, rel=1e-12)
        assert problem.stresses(np.array([free]), ring, penalty)[0, 0] == pytest.approx(0, abs=1e-12 * pressure)


@pytest.mark.parametrize("slave", RINGS)
@pytest.mark.parametrize("penalty", [1e2, inf])
def test_the_finite_fit_tends_to_lame_with_the_interference(slave: Role, penalty: float) -> None:
    errors = []
    for interference in (1e-2, 1e-3, 1e-4):
        problem = ShrinkFit(interference=interference)
        fit = problem.finite(slave, penalty)
        errors.append(
            [fit.force / (problem.radius * problem.pressure(penalty)) - 1, fit.pressure / problem.pressure(penalty) - 1]
        )
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 10, rtol=0.1)
    assert np.abs(errors[-1]).max() < 1e-4


@pytest.mark.parametrize("slave", RINGS)
def test_the_finite_fit_balances_the_rings_of_the_scene(slave: Role) -> None:
    """A uniform traction moves each ring by its compliance, and the springs have that pressure in what is left."""
    problem = ShrinkFit(interference=1e-2)
    fit, scene = problem.finite(slave, 1e2), shrink_fit(problem, slave=slave, refine=8)
    radii = {}
    for index, condensed in zip(scene.bodies_in_reach, scene.condensed_bodies, strict=True):
        body = scene.bodies[index]
        places = body.nodes[body.contact_nodes]
        angles = np.arctan2(places[:, 1], places[:, 0])
        shares = np.gradient(np.pad(angles, 1, mode="reflect", reflect_type="odd"))[1:-1]
        shares[[0, -1]] /= 2
        load = np.zeros(body.nodes.shape)
        outwards = places / np.linalg.norm(places, axis=1)[:, None]
        load[body.contact_nodes] = (-1 if body.name == "inner" else 1) * fit.force * shares[:, None] * outwards
        q = np.linalg.solve(condensed.stiffness, load.reshape(-1)[condensed.unknowns])
        moves = condensed.displacements(q)[body.contact_nodes]
        radii[body.name] = float(np.linalg.norm(places + moves, axis=1).mean())
    assert (radii["inner"] - radii["outer"]) * 1e2 == pytest.approx(fit.pressure, rel=5e-3)
    assert fit.pressure * radii[slave] == pytest.approx(fit.force, rel=1e-4)


@pytest.mark.parametrize("slave", RINGS)
def test_the_scene_is_a_quarter_whose_case_tells_its_problem(slave: Role) -> None:
    problem = ShrinkFit(interference=5e-3, young=(10.0, 20.0))
    scene = shrink_fit(problem, slave=slave, refine=2)
    assert RingStudy.from_case(scene.case()) == RingStudy(problem, slave, 1.0)
    assert (len(scene.interface.slave), len(scene.interface.master)) == ((24, 32) if slave == "inner" else (32, 24))
    radii = np.linalg.norm(scene.interface.nodes, axis=1)
    inner, outer = (radii[:25], radii[25:]) if slave == "inner" else (radii[33:], radii[:33])
    assert inner.mean() - outer.mean() == pytest.approx(problem.interference)
    for body in scene.bodies:
        assert not body.nodes[body.fixed].any()  # Whatever is held lies on a line of symmetry.
        assert np.arctan2(*body.nodes.T[::-1]).max() == pi / 2
    angles = [np.arctan2(*body.nodes[body.contact_nodes].T[::-1]) for body in shrink_fit(refine=4).bodies]
    assert np.abs(np.subtract.outer(angles[0][1:-1], angles[1])).min() > 1e-4  # No nodes meet but at the ends.


@pytest.mark.parametrize("slave", RINGS)
def test_whole_rings_are_four_quarters_without_ends(slave: Role) -> None:
    quarter, whole = (shrink_fit(slave=slave, refine=2, quarters=quarters) for quarters in (1, 4))
    for side, body in zip(("slave", "master"), whole.bodies, strict=True):
        ring, part = (getattr(scene.interface, side) for scene in (whole, quarter))
        assert len(ring) == 4 * len(part)
        assert (ring.neighbours >= 0).all()
        lengths = [surface.lengths(scene.interface.nodes) for surface, scene in ((ring, whole), (part, quarter))]
        assert np.sort(lengths[0])[::4] == pytest.approx(np.sort(lengths[1]))
        nodes, component = np.nonzero(body.fixed)
        assert len(nodes) == 4  # One more than a rigid body needs.
        assert np.abs(body.nodes[nodes, component]).max() < 1e-15 * np.abs(body.nodes).max()
        assert not np.isin(nodes, body.contact_nodes).any()


@pytest.mark.parametrize("area", ["current", "reference"])
@pytest.mark.parametrize("slave", RINGS)
def test_half_passes_give_each_ring_the_pressure_on_its_own_radius(
    slave: Role, area: Literal["current", "reference"]
) -> None:
    problem, penalty = ShrinkFit(interference=1e-2), 1e2
    fit = problem.half_passes(slave, penalty, area)
    forces = (fit.force, fit.master_force) if slave == "inner" else (fit.master_force, fit.force)
    before, after = problem.contact_radii, []
    for index, (radius, force, outwards) in enumerate(zip(before, forces, (-1, 1), strict=True)):
        lame = replace(problem, radius=radius).compliances[index]
        after.append(radius + outwards * lame * force / radius)
    assert penalty * (after[0] - after[1]) == pytest.approx(fit.pressure, rel=1e-12)
    lengths = after if area == "current" else before
    assert np.divide(forces, lengths) == pytest.approx(fit.pressure, rel=1e-12)


def test_half_passes_tend_to_one_force_as_springs_become_stiff() -> None:
    problem = ShrinkFit(interference=1e-2)
    fit, exact = problem.half_passes("outer"), problem.finite("outer")
    assert fit.force == pytest.approx(fit.master_force, rel=1e-12) == pytest.approx(exact.force, rel=1e-12)
    assert fit.pressure == pytest.approx(exact.pressure, rel=1e-12)
    assert problem.half_passes("inner", 1e2).force == problem.half_passes("outer", 1e2).master_force


def test_unknown_rings_are_refused() -> None:
    with pytest.raises(MisuseError, match="'inner' or 'outer'"):
        shrink_fit(ShrinkFit(), slave="middle")
    with pytest.raises(MisuseError, match="'inner' or 'outer'"):
        ShrinkFit().stresses(np.ones(1), "middle")


def test_an_area_of_the_reference_changes_the_finite_fit_by_the_motion_of_the_slave() -> None:
    problem = replace(ShrinkFit(), interference=1e-2)
    current, reference = (problem.finite("outer", 1e2, area) for area in ("current", "reference"))
    assert 1e-4 < abs(current.force / reference.force - 1) < problem.interference
