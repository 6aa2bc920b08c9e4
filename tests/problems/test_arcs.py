"""The mesh of two concentric arcs."""

import numpy as np
import pytest

from contactverif.problems.arcs import Arcs


@pytest.mark.parametrize("convex", [True, False])
def test_the_case_has_the_penetration_everywhere_and_tells_its_arcs(convex: bool) -> None:
    arcs = Arcs(convex_slave=convex, depth=0.2)
    case = arcs.case(4, "arcs")
    radii = np.linalg.norm(case.positions, axis=1)
    n_slave = case.interface.n_slave_nodes
    np.testing.assert_allclose(radii[:n_slave] - radii[n_slave:].mean(), 0.2 if convex else -0.2)
    assert (len(case.interface.slave), len(case.interface.master)) == (12, 16)
    assert Arcs.from_case(case) == arcs
    turned = case.positions[case.interface.slave.segments]
    along, place = turned[:, 1] - turned[:, 0], turned.mean(axis=1)
    outwards = along[:, 1] * place[:, 0] - along[:, 0] * place[:, 1]  # The body is on the left.
    assert ((outwards > 0) == convex).all()
