"""Bodies in space: stiffness against scikit-fem's own assembly, exact fields, and a scene through its arrays."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

from contactverif import Body, Interface, MisuseError
from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.body import SIDES
from contactverif.contract.case import Case
from contactverif.mechanics.bulk import assemble_stiffness, condense, loose_modes
from contactverif.mechanics.changed_scenes import change_units
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.oracle.flat_answers import uniform_surface_weights
from contactverif.problems.flat_states import SpaceMotion
from contactverif.problems.space_blocks import extrude, rectangle, space_blocks
from contactverif.problems.space_problems import SHELLS
from contactverif.problems.space_scenes import contrast_space_scenes

TURNED = SpaceMotion((3, 1, -2, 1), (5, -7, 2), 3)


def a_body(corners: int, *, distorted: bool = True, **others: Any) -> Body:
    """Return a block of 3 × 2 faces and two layers, its nodes moved, in an inclined frame."""
    points, faces = rectangle(np.array([0.0, 1, 2.5, 3]), np.array([0.0, 1, 3]), corners)
    nodes = np.column_stack([np.tile(points, (3, 1)), np.repeat([0.0, 1, 1.5], len(points))])
    if distorted:
        nodes = nodes + 0.1 * np.random.default_rng(1).uniform(-1, 1, nodes.shape)
    cells = extrude(faces[:, ::-1], len(points), 2)
    body = Body(nodes, cells, faces[:, ::-1], 3.0, 0.3, axis=TURNED.axes[:2], name="block")
    return replace(body, nodes=nodes @ TURNED.axes, **others)


@pytest.mark.parametrize("corners", [3, 4])
def test_the_stiffness_is_that_of_scikit_fem(corners: int) -> None:
    body = a_body(corners)
    kind, element, order = (
        (skfem.MeshTet, skfem.ElementTetP1(), 1) if corners == 3 else (skfem.MeshHex, skfem.ElementHex1(), 2)
    )
    ours = np.array([0, 1, 2, 3] if corners == 3 else [7, 4, 1, 5, 6, 2, 0, 3])
    cells = body.cells[:, np.argsort(ours)]
    mesh = kind((body.nodes @ body.frame).T.copy(), cells.T.copy(), sort_t=False, validate=False)
    basis = skfem.Basis(mesh, skfem.ElementVector(element), intorder=order)
    theirs = skfem.asm(linear_elasticity(*lame_parameters(body.young, body.poisson)), basis).toarray()
    numbers = basis.nodal_dofs.T.reshape(-1)
    stiffness = dense(assemble_stiffness(body)[0])
    assert np.abs(stiffness - theirs[np.ix_(numbers, numbers)]).max() <= 1e3 * UNIT_ROUNDOFF * np.abs(theirs).max()


@pytest.mark.parametrize("corners", [3, 4])
def test_a_linear_displacement_has_one_stress_and_no_forces_inside(corners: int) -> None:
    """Hooke's law by hand: σ = λ tr ε + 2μ ε, with the shear stresses yz, xz, xy."""
    body = a_body(corners)
    gradient = np.array([[2.0, 0.5, -1], [0.25, -1, 0.5], [1, 0.125, 0.5]]) / 64
    local = body.nodes @ body.frame
    q = (local @ gradient.T)[body.contact_nodes].reshape(-1)
    fixed = np.ones(body.nodes.shape, bool)
    fixed[body.contact_nodes] = False
    imposed = np.where(fixed, local @ gradient.T, 0.0)
    condensed = condense(replace(body, fixed=fixed, imposed=imposed))
    strain = (gradient + gradient.T) / 2
    lame, shear = lame_parameters(body.young, body.poisson)
    stress = lame * np.trace(strain) * np.eye(3) + 2 * shear * strain
    voigt = stress[[0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]]
    assert np.abs(condensed.stresses(q) - voigt).max() <= 1e4 * UNIT_ROUNDOFF * np.abs(voigt).max()
    free = replace(body, fixed=np.zeros(fixed.shape, bool))
    inside = np.setdiff1d(np.arange(len(body.nodes)), np.unique(_border(body)))
    forces = (assemble_stiffness(free)[0] @ (local @ gradient.T).reshape(-1)).reshape(-1, 3)
    assert np.abs(forces[inside]).max(initial=0.0) <= 1e4 * UNIT_ROUNDOFF * np.abs(forces).max()


def _border(body: Body) -> FloatArray:
    """Return the nodes of the faces that one cell alone has."""
    faces = np.vstack([body.cells[:, side] for side in SIDES[body.cells.shape[1]]])
    _, number, counts = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
    return faces[counts[number.reshape(-1)] == 1]


@pytest.mark.parametrize("corners", [3, 4])
def test_extruded_cells_fill_the_block_however_nodes_are_numbered(corners: int) -> None:
    random = np.random.default_rng(2)
    points, faces = rectangle(np.array([0.0, 1, 2, 4]), np.array([0.0, 1, 3]), corners)
    for _ in range(8):
        order = random.permutation(len(points))
        numbers = np.argsort(order)[faces][:, ::-1]
        turned = np.array([np.roll(face, random.integers(corners)) for face in numbers])
        nodes = np.column_stack([np.tile(points[order], (2, 1)), np.repeat([0.0, 2.0], len(points))])
        body = Body(nodes, extrude(turned, len(points), 1), turned)  # It checks that neighbours share their faces.
        (first, *others), share = (body.nodes[body.cells[:, k]] for k in (0, 1, 2, 3)), 6
        volume = (np.cross(others[0] - first, others[1] - first) * (others[2] - first)).sum() / share
        assert corners == 4 or volume == pytest.approx(24.0, rel=1e-14)


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"cells": lambda body: body.cells[:, [0, 2, 1, *range(3, body.cells.shape[1])]]}, "cells: found cell 0"),
    ({"contact": lambda body: body.contact[:, ::-1]}, "contact: found the face from node"),
    ({"contact": lambda body: body.contact[:, :2]}, "contact: found shape"),
    ({"axis": lambda body: np.array([[1.0, 0, 0], [1, 0, 0]])}, "axis: found"),
    ({"nodes": lambda body: np.vstack([body.nodes, [9.0, 9, 9]])}, "nodes: found node"),
    ({"cells": lambda body: np.vstack([body.cells, body.cells[:1]])}, "cells: found two cells on the same side"),
]


@pytest.mark.parametrize("corners", [3, 4])
@pytest.mark.parametrize(("change", "message"), WRONG)
def test_a_wrong_body_is_named(corners: int, change: dict[str, Any], message: str) -> None:
    body = a_body(corners)
    arrays = {name: make(body) for name, make in change.items()}
    empty = {name: np.zeros(0) for name in ("fixed", "imposed", "load")} if "nodes" in arrays else {}
    with pytest.raises(MisuseError, match=f"^block: {message}"):
        replace(body, **arrays, **empty)


def test_motions_that_nothing_resists_are_named() -> None:
    body = a_body(3, distorted=False)
    assert loose_modes(body) == ["move along its first axis", "move along its second axis", "turn about its third axis"]
    fixed = np.zeros(body.nodes.shape, bool)
    fixed[:2, :2] = True
    assert loose_modes(replace(body, fixed=fixed)) == []


@pytest.mark.parametrize(
    "make", [lambda: SHELLS.scene(inner_slave=False), lambda: scene_of(contrast_space_scenes((4,))[0])]
)
def test_a_scene_comes_back_from_its_case_to_the_last_bit(make: Any) -> None:
    scene: Scene = make()
    case = Case.from_arrays(scene.case().to_arrays())
    back = scene_of(case)
    assert all((ours == theirs).all() for ours, theirs in ((scene.load, back.load), (scene.start, back.start)))
    assert (dense(scene.stiffness) == dense(back.stiffness)).all()
    assert (scene.interface.nodes == back.interface.nodes).all()


def test_in_other_units_a_scene_is_the_same_to_the_last_bit() -> None:
    scene = replace(scene_of(contrast_space_scenes((3,))[0]), facts={})
    there = change_units(
        scene, 16.0, 1 / 16
    )  # A Cholesky factor has roots of what lengths and moduli are multiplied by.
    bodies = Scene(there.bodies, scene.slave, scene.master, there.penalty)
    assert (dense(bodies.stiffness) == dense(there.stiffness)).all()
    assert (bodies.load == there.load).all()


def test_bodies_in_the_plane_and_in_space_are_not_mixed() -> None:
    flat = Body([[0.0, 0], [1, 0]], np.zeros((0, 4), int), [[0, 1]], fixed=np.ones((2, 2), bool))
    with pytest.raises(MisuseError, match="in the plane and bodies in space"):
        Scene((a_body(3), flat))


@pytest.mark.parametrize("corners", [3, 4])
def test_a_larger_master_carries_the_pressure_beside_the_slave(corners: int) -> None:
    """Bodies under the exact uniform pressure need no force beside it: S q − g are the consistent contact forces."""
    (above, below), (under, upper) = (
        rectangle(np.array(lines), np.array(lines), corners) for lines in ([0.0, 1, 3], [-1.0, 0.5, 2, 4])
    )
    nodes = [np.column_stack([points, np.zeros(len(points))]) for points in (above, under)]
    interface = Interface.from_faces(nodes[0], below[:, ::-1], nodes[1], upper)
    domain = np.array([[0.0, 0], [3, 0], [3, 3], [0, 3]])
    scene = space_blocks(
        interface, np.vstack([above, under]), domain, layers=([1.0], [2.0]), materials=((1.0, 0.3), (2.0, 0.2)),
        penalty=10.0, pressure=0.5, motion=TURNED,
    )  # fmt: skip
    master, normal, n_slave = scene.facts["compliance"][1], scene.facts["normal"], interface.n_slave_nodes
    down = np.where(np.arange(interface.n_nodes) < n_slave, master + 1 / 10, master)
    q = scene.transformation.T @ (-0.5 * down[:, None] * normal).reshape(-1)
    forces, force = scene.nodal_forces(q) @ normal, 0.5 * 9 * TURNED.scale**2
    exact = 0.5 * uniform_surface_weights(interface, scene.facts["plane"], scene.facts["domain"])
    exact[n_slave:] *= -1
    assert exact[:n_slave].sum() == pytest.approx(force, rel=1e-14)
    assert np.abs(forces - exact).max() <= 1e-12 * force
