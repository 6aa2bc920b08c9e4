"""The exact answers in space against other ways to them: linear systems, collocation, quadrature."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy import integrate

from contactverif import Traits
from contactverif.contract.arrays import FloatArray
from contactverif.mechanics.accuracy import shape_integrals
from contactverif.problems.space_problems import EGG_MESHES, HERTZ_POINT, SHELLS, EggBox, EggMesh

REFERENCE = Traits().revise(area="reference")


@pytest.mark.parametrize("inner_slave", [True, False])
def test_shells_against_the_constants_of_both_spheres(inner_slave: bool) -> None:
    """U = A r + B/r²; four equations: no stress at the free radii, forces that balance, and springs that give way."""
    a, b, radii = SHELLS.inner_radius, SHELLS.outer_radius, (SHELLS.radius, SHELLS.radius - SHELLS.interference)
    rows = np.zeros((4, 4))
    for shell, (free, radius) in enumerate(zip((a, b), radii, strict=True)):
        young, ratio = SHELLS.young[shell], SHELLS.poisson[shell]

        def stress(r: float, young: float = young, ratio: float = ratio) -> FloatArray:
            return young * np.array([1 / (1 - 2 * ratio), -2 / ((1 + ratio) * r**3)])

        part = slice(2 * shell, 2 * shell + 2)
        rows[shell, part] = stress(free)
        rows[2, part] = stress(radius) * radius**2 * (1, -1)[shell]
        rows[3, part] = np.array([radius, 1 / radius**2]) * (-1, 1)[shell]
        if shell == int(not inner_slave):
            rows[3, part] += stress(radius) * (-1 / SHELLS.penalty)
            traction = stress(radius)
    constants = np.linalg.solve(rows, [0, 0, 0, SHELLS.interference])
    expected = -traction @ constants[2 * int(not inner_slave) :][:2]
    assert SHELLS.traction(inner_slave=inner_slave, traits=REFERENCE) == pytest.approx(expected, rel=1e-12)


def test_facets_of_shells_enclose_the_ball() -> None:
    for whole, share in ((False, 1 / 8), (True, 1.0)):
        scene = SHELLS.scene(inner_slave=True, whole=whole)
        corners = scene.interface.nodes[scene.interface.slave.faces]
        volume = (corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        assert volume == pytest.approx(share * 4 / 3 * pi * SHELLS.radius**3, rel=1e-14)
    assert (scene.interface.slave.neighbours >= 0).all()


def test_the_compliance_of_a_layer_against_collocation() -> None:
    """Navier's equations for (U sin, U sin, W cos cos) on 48 Chebyshev points; the box alone has this layer."""
    box, n = EggBox(1.0), 48
    expected = []
    for height, young, ratio in zip(box.heights, box.young, box.poisson, strict=True):
        lame, shear = young * ratio / ((1 + ratio) * (1 - 2 * ratio)), young / (2 * (1 + ratio))
        places = np.cos(pi * np.arange(n + 1) / n)
        signs = np.where((np.arange(n + 1) == 0) | (np.arange(n + 1) == n), 2.0, 1.0) * (-1.0) ** np.arange(n + 1)
        gaps = places[:, None] - places[None] + np.eye(n + 1)
        slope = np.outer(signs, 1 / signs) / gaps
        slope -= np.diag(slope.sum(axis=1))
        slope *= 2 / height
        q, unit = np.hypot(*(pi / np.array(box.sides))), np.eye(n + 1)
        matrix = np.block(
            [
                [shear * slope @ slope - (lame + 2 * shear) * q**2 * unit, (lame + shear) * slope],
                [-(lame + shear) * q**2 * slope, (lame + 2 * shear) * slope @ slope - shear * q**2 * unit],
            ]
        )
        right = np.zeros(2 * n + 2)
        sheared, pressed = np.hstack([slope, unit]), np.hstack([-lame * q**2 * unit, (lame + 2 * shear) * slope])
        lowest = np.concatenate([np.zeros(n + 1), unit[n]])
        for row, equation, value in ((0, sheared[0], 0), (n, sheared[n], 0), (n + 1, pressed[0], -1), (-1, lowest, 0)):
            matrix[row], right[row] = equation, value
        expected.append(-np.linalg.solve(matrix, right)[n + 1])
    for penalty in (1e2, 1e4):
        assert box.amplitude(penalty) == pytest.approx(box.wave / (sum(expected) + 1 / penalty), rel=1e-8)


def test_the_half_space_of_hertz() -> None:
    """Boussinesq's displacement of one point, integrated over the disk by adaptive quadrature."""
    place = np.array([2.0, 0.5, -1.0])
    young, ratio = HERTZ_POINT.young, HERTZ_POINT.poisson

    def down(radius: float, angle: float) -> float:
        x, y = place[0] - radius * np.cos(angle), place[1] - radius * np.sin(angle)
        far = np.sqrt(x * x + y * y + place[2] ** 2)
        pressure = HERTZ_POINT.peak * np.sqrt(1 - radius**2)
        return radius * pressure * (1 + ratio) / (2 * pi * young) * (2 * (1 - ratio) / far + place[2] ** 2 / far**3)

    expected = integrate.dblquad(down, 0, 2 * pi, 0, 1, epsabs=1e-12, epsrel=1e-10)[0]
    moves = HERTZ_POINT.displacements(place[None])[0]
    assert moves[2] == pytest.approx(-expected, rel=1e-8)
    assert moves[1] / moves[0] == pytest.approx(0.25, rel=0.2)  # Nearly along the radius from the middle.


@pytest.mark.parametrize("mesh", EGG_MESHES)
def test_exact_forces_of_an_egg_box_add_up(mesh: EggMesh) -> None:
    box = EggBox(1e2, mesh=mesh)
    instance = box.pose(2, Traits())
    scene, n = instance.scene, instance.scene.interface.n_slave_nodes
    forces = instance.exact_forces(instance.first_guess)
    total = box.load * box.amplitude(1e2) * np.prod(box.sides)
    assert forces[:n, 2].sum() == pytest.approx(total, rel=1e-12)
    assert forces[n:, 2].sum() == pytest.approx(-total, rel=1e-12)
    assert shape_integrals(scene.interface.slave, scene.interface.nodes)[:n].sum() == pytest.approx(3.0, rel=1e-5)


def test_exact_forces_of_a_point_contact_add_up() -> None:
    point = HERTZ_POINT.pose(5, Traits())
    slave = point.exact_forces(point.first_guess)[: point.scene.interface.n_slave_nodes, 2]
    assert slave.sum() == pytest.approx(-2 / 3 * pi * HERTZ_POINT.peak / 4, rel=2e-3)
    assert replace(HERTZ_POINT, radius=200.0).peak == pytest.approx(HERTZ_POINT.peak / 2)
