"""The compiled `vts-cell-3d` beside the readable one, which is differentiated by complex steps."""

from functools import cache

import numpy as np
import pytest
from planned_cases import draw_cases
from readable_cells import readable_vts_cell

from contactverif import Case, Interface, Pairing, named_case
from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.oracle.exact_points import Lattice, covered_shares
from contactverif.problems.flat_states import SpaceMotion
from contactverif.strategies.surfaces import flat_surface_cases, smooth_surface_cases, surface_cases
from contactverif_surfaces import vts_cell_3d


@cache
def smooth_states() -> tuple[Case, ...]:
    return draw_cases(smooth_surface_cases(), seed="surface kernels", examples=60).cases  # type: ignore[arg-type]


def test_forces_and_tangent_are_those_of_the_readable_code() -> None:
    """A coordinate is rounded at its distance from the origin, and a face turns by that over its least height."""
    fast, slow = vts_cell_3d(penalty=2.0), readable_vts_cell(penalty=2.0)
    used = []
    for case in (*smooth_states(), named_case("crossed-diagonals"), named_case("tilted-faces")):
        interface, z = case.interface, case.z
        pairing = fast.pair(interface, z)
        other = slow.pair(interface, z)
        assert np.array_equal(other["active"][:, 0], pairing["active"])
        forces, tangent = fast.residual_and_tangent(interface, pairing, z)
        right = slow.residual(interface, other, z), slow.tangent(interface, other, z).toarray()
        rounding = UNIT_ROUNDOFF * case.largest_coordinate / case.shortest_segment
        for mine, readable in zip((forces, tangent.toarray()), right, strict=True):
            used.append(np.abs(mine - readable).max() / (rounding * (np.abs(readable).max() or 1.0)))
    print(f"\nthe largest difference is {max(used):.3g} u X / h")
    assert max(used) < 64


def test_the_forces_of_a_residual_are_those_beside_the_tangent_and_a_repetition_has_the_same_bits() -> None:
    formulation = vts_cell_3d(penalty=2.0)
    for case in smooth_states()[:20]:
        pairing = formulation.pair(case.interface, case.z)
        assert formulation.pair(case.interface, case.z) == pairing
        alone = formulation.residual(case.interface, pairing, case.z)
        (forces, tangent), (forces_again, again) = (
            formulation.residual_and_tangent(case.interface, pairing, case.z) for _ in range(2)
        )
        assert np.array_equal(forces, forces_again)
        assert np.array_equal(tangent.data, again.data)
        assert np.abs(alone - forces).max() <= 16 * UNIT_ROUNDOFF * np.abs(forces).max()  # Sums in the same order.


def test_the_pattern_holds_the_nodes_of_cells_in_contact_and_no_other() -> None:
    formulation = vts_cell_3d(penalty=2.0)
    for case in smooth_states()[:20]:
        pairing, interface = formulation.pair(case.interface, case.z), case.interface
        tangent = formulation.tangent(interface, pairing, case.z)
        coupled = np.zeros((interface.n_nodes, interface.n_nodes), bool)
        for cell in np.flatnonzero(pairing["active"]):
            slave = interface.slave.faces[pairing["slave_face"][cell]]
            nodes = np.concatenate([slave, interface.master.faces[pairing["master_face"][cell]]])
            coupled[np.ix_(nodes, nodes)] = True
        assert tangent.nnz == 9 * coupled.sum()
        assert np.array_equal(np.sort(tangent.indices), np.sort(np.argwhere(np.kron(coupled, np.ones((3, 3))))[:, 1]))


@pytest.mark.parametrize("strategy", [flat_surface_cases, surface_cases])
def test_no_centroid_lies_outside_its_faces(strategy: object) -> None:
    """A cell that roundoff alone makes has no centroid: the search leaves it out."""
    formulation = vts_cell_3d(penalty=2.0)
    for case in draw_cases(strategy(), seed="surface kernels", examples=100).cases:  # type: ignore[operator]
        pairing = formulation.pair(case.interface, case.z)
        points = formulation.contact_points(case.interface, pairing, case.z)
        assert points.slave_shape.min(initial=0.0) >= -1 / 8
        assert points.master_shape.min(initial=0.0) >= -1 / 8


def test_edges_of_needles_that_coincide_within_roundoff_still_have_a_centroid() -> None:
    """In coordinates of the face 1 − s − t lost all digits there: the crossing was 0/0, and the cell had no force."""
    needle = np.array([[0.0, 0, 0], [0.21875000699323377, 0, 0], [0.21874999300675815, 5.5313108585336446e-05, 0]])
    opposite = np.array(
        [[0.21874998352170782, 9.282421955246478e-05], [0.21875000699323, 2.4841240175987878e-15],
         [-0.1874999977033593, -3.2788307827005814e-05]]
    )  # fmt: skip
    random = np.random.default_rng(0)
    for _ in range(200):  # Turns round the edges differently.
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        turn *= np.sign(np.linalg.det(turn))
        slave, master = needle @ turn.T, np.column_stack([opposite, np.full(3, -(2.0**-20))]) @ turn.T
        interface = Interface.from_faces(slave, [[0, 1, 2]], master, [[0, 1, 2]])
        z, formulation = interface.nodes.reshape(-1), vts_cell_3d(penalty=2.0)
        pairing = formulation.pair(interface, z)
        points = formulation.contact_points(interface, pairing, z)
        assert pairing["active"].tolist() == [True]
        assert points.weight[0] == pytest.approx(6.04987144e-06, rel=1e-6)
        assert points.slave_shape[0] == pytest.approx(np.full(3, 1 / 3), abs=1e-4)


def test_a_cell_without_contact_is_not_in_the_tangent() -> None:
    case = named_case("crossed-diagonals")
    nothing = Pairing({**(pairing := vts_cell_3d(penalty=2.0).pair(case.interface, case.z)),
                       "active": np.zeros_like(pairing["active"])})  # fmt: skip
    forces, tangent = vts_cell_3d(penalty=2.0).residual_and_tangent(case.interface, nothing, case.z)
    assert not forces.any()
    assert tangent.nnz == 0


def test_edges_that_nearly_coincide_are_cut_where_the_search_saw_it() -> None:
    """The two long edges turn by 1e-6 against each other and cross at a slave corner, which the cell does not list."""
    left, high, end = 0.34635448455810547, 0.17317724227905273, 0.5130205154418945
    slave = [[left, high, -0.03125], [end, high, -0.03125], [left, 0.08984375, -0.03125]]
    master = [[0.3046875, 0.06901025772094727, 0], [0.47135448455810547, 0.15234375, 0], [0.3046875, 0.15234375, 0]]
    meshes = Interface.from_faces(slave, [[0, 1, 2]], master, [[0, 1, 2]])
    z = meshes.nodes.reshape(-1)
    formulation = vts_cell_3d(penalty=1.0)
    (weight,) = formulation.contact_points(meshes, formulation.pair(meshes, z), z).weight
    (share,) = covered_shares(Lattice.from_state(meshes, z))
    area = meshes.slave.measures(meshes.nodes)[0]
    assert abs(weight - float(share) * area) <= 16 * UNIT_ROUNDOFF * area


def test_the_gap_over_a_needle_is_no_worse_than_its_positions() -> None:
    """The computed normal of a needle tilts by u ℓ/h, which moves a far corner by more than rounding of positions."""
    needle = np.array([[0.0, 0, 0], [1, 2.0**-11, 0], [0.97, 0.0, 0]])
    errors = []
    for case in range(60):
        motion = SpaceMotion((1 + case % 5, case % 7 - 3, case % 3 - 1, case % 4 - 2))
        depth = 2.0**-30
        slave, master = motion(needle[[0, 1, 2]] - [0, 0, depth]), motion(needle[[0, 2, 1]])
        meshes = Interface.from_faces(slave, [[0, 1, 2]], master, [[0, 1, 2]])
        z, formulation = meshes.nodes.reshape(-1), vts_cell_3d(penalty=1.0)
        gaps = formulation.contact_points(meshes, formulation.pair(meshes, z), z).gap
        errors += [abs(abs(gap) - depth) for gap in gaps]
    assert len(errors) >= 60
    assert max(errors) <= 8 * UNIT_ROUNDOFF
