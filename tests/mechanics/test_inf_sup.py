"""The inf-sup constant, against an eigenvalue problem that is assembled here by hand."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from pressed_blocks import on
from scipy import linalg
from subjects import Changed, load_subject
from zoo.face_multipliers import FaceMultipliers

from contactverif import Scene, Subject
from contactverif.contract.arrays import dense
from contactverif.contract.interface import TRIANGLE
from contactverif.mechanics.accuracy import shape_integrals
from contactverif.mechanics.inf_sup import InfSup, force_rows, gap_rows, inf_sup_constant
from contactverif.problems.refined_blocks import refined_blocks


def constant_of(name: str, scene: Scene) -> InfSup:
    return inf_sup_constant(scene, on(name, scene), nodal=load_subject(name).traits.rules.penalty == "nodal")


def node_on_node_constants(scene: Scene) -> Any:
    """Return all β (n,) of pressures at the nodes of matching meshes, each with half of the segments beside it."""
    interface = scene.interface
    n = interface.n_slave_nodes
    slave, master = np.argsort(interface.nodes[:n, 0]), n + np.argsort(interface.nodes[n:, 0])
    h = float(interface.slave.lengths(interface.nodes)[0])
    areas = h * np.r_[0.5, np.ones(n - 2), 0.5]
    rows = np.zeros((n, interface.n_unknowns))
    rows[np.arange(n), 2 * slave + 1], rows[np.arange(n), 2 * master + 1] = areas, -areas
    rows = rows @ dense(scene.transformation)
    compliance = rows @ np.linalg.solve(dense(scene.stiffness), rows.T)
    return np.sqrt(linalg.eigh(compliance, h * np.diag(areas), eigvals_only=True))


@pytest.mark.parametrize("name", ["nts-lm", "mortar-dual-lm"])
def test_the_constant_is_the_smallest_eigenvalue_of_the_problem_written_by_hand(name: str) -> None:
    scene = refined_blocks(8, 8)
    assert constant_of(name, scene).constant == pytest.approx(node_on_node_constants(scene)[0], rel=1e-9)


@pytest.mark.parametrize("name", ["nts-lm", "mortar-lm", "mortar-dual-lm", "vts-me-lm"])
def test_rows_of_gaps_are_those_of_forces_where_the_saddle_point_is_symmetric(name: str) -> None:
    scene = refined_blocks(6, 4)
    formulation = on(name, scene)
    forces, gaps = force_rows(scene, formulation), gap_rows(scene, formulation)
    assert np.abs(forces + gaps).max() < 1e-9 * np.abs(forces).max() or np.abs(forces - gaps).max() < 1e-9


def test_rows_of_vts_ppt_differ_and_the_smaller_constant_counts() -> None:
    scene = refined_blocks(8, 12)
    printed, standard = (constant_of(name, scene).constant for name in ("vts-ppt-lm", "vts-me-lm"))
    forces, gaps = (rows(scene, on("vts-ppt-lm", scene)) for rows in (force_rows, gap_rows))
    assert min(np.abs(forces - gaps).max(), np.abs(forces + gaps).max()) > 0.01 * np.abs(forces).max()
    assert printed == pytest.approx(standard, rel=1e-6)  # They have the same gaps, and those are the worse rows.


def test_two_passes_have_a_zero_eigenvalue_for_each_pair_of_nodes_in_one_place() -> None:
    assert constant_of("two-pass/nts-lm", refined_blocks(8, 8)).n_zero == 9
    assert constant_of("two-pass/nts-lm", refined_blocks(8, 12)).n_zero == 5


def test_eight_on_two_leaves_seven_pressures_of_vts_ppt_that_move_nothing() -> None:
    """The paper's page counts as many multipliers that are not unique."""
    assert constant_of("vts-ppt-lm", refined_blocks(8, 2)).n_zero == 7


def test_dual_pressures_on_matching_faces_have_the_constant_of_the_problem_written_by_hand() -> None:
    """Node on node, a dual pressure pushes its own node alone, by the integral of its shape function."""
    scene = refined_blocks(4, 4, TRIANGLE)
    interface, n = scene.interface, scene.interface.n_slave_nodes
    areas = shape_integrals(interface.slave, interface.nodes)[:n]
    partner = n + np.abs(interface.nodes[:n, None] - interface.nodes[n:]).sum(axis=2).argmin(axis=1)
    rows = np.zeros((n, interface.n_unknowns))
    rows[np.arange(n), 3 * np.arange(n) + 2], rows[np.arange(n), 3 * partner + 2] = areas, -areas
    rows = rows @ dense(scene.transformation)
    compliance = rows @ np.linalg.solve(dense(scene.stiffness), rows.T)
    h = np.sqrt(areas.sum() / len(interface.slave))
    smallest = np.sqrt(linalg.eigh(compliance, h * np.diag(areas), eigvals_only=True)[0])
    subject = Subject("it", partial(FaceMultipliers, dual=True))
    assert inf_sup_constant(scene, subject.for_case(scene.case()), nodal=False).constant == pytest.approx(smallest)


class WithFactor:
    """A formulation whose constraint rows have a factor, and which decides about contact in its residual."""

    def __init__(self, inner: Any, factor: float) -> None:
        self.inner, self.factor, self.traits = inner, factor, inner.traits

    def n_multipliers(self, interface: Any) -> int:
        return int(self.inner.n_multipliers(interface))

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        states = z.reshape(-1, z.shape[-1])
        rows = np.stack([self.inner.residual(interface, self.inner.pair(interface, state), state) for state in states])
        rows[:, interface.n_unknowns :] *= self.factor
        return rows.reshape(z.shape)


@pytest.mark.parametrize("factor", [1.0, 7.0, -1e-3])
def test_neither_the_factor_of_a_constraint_nor_a_missing_pairing_changes_the_constant(factor: float) -> None:
    scene, right = refined_blocks(6, 4), load_subject("mortar-lm")
    other = Subject("with a factor", lambda *, penalty: WithFactor(right.with_penalty(penalty).plugin, factor))
    answer = inf_sup_constant(scene, other.for_case(scene.case()), nodal=False)
    assert answer.constant == pytest.approx(constant_of("mortar-lm", scene).constant, rel=1e-9)


def test_a_multiplier_that_presses_on_nothing_is_a_zero_eigenvalue() -> None:
    right = load_subject("mortar-lm")

    def without_first(inner: Any) -> Any:
        def residual(interface: Any, pairing: Any, z: Any) -> Any:
            n, state = interface.n_unknowns, np.array(z)
            state[..., n] = 0.0
            rows = inner.residual(interface, pairing, state)
            rows[..., n] = z[..., n]
            return rows

        return Changed(inner, residual=residual)

    scene = refined_blocks(6, 4)
    other = Subject("without the first", lambda *, penalty: without_first(right.with_penalty(penalty).plugin))
    assert inf_sup_constant(scene, other.for_case(scene.case()), nodal=False).n_zero == 1
