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


@pytest.mark.parametrize("convex", [True, False])
def test_whole_circles_are_closed_and_numbered_from_anywhere(convex: bool) -> None:
    circle = (0.0, 360.0)
    case = Arcs(convex_slave=convex, slave=circle, master=circle).case(4)
    for surface, counter_clockwise in ((case.interface.slave, convex), (case.interface.master, not convex)):
        assert (surface.neighbours >= 0).all()
        first, second = np.moveaxis(case.positions[surface.segments], 1, 0)
        assert (((first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) > 0) == counter_clockwise).all()
        assert abs(np.arctan2(*first[0, ::-1])) > 0.1
    assert (len(case.interface.slave), len(case.interface.master)) == (12, 16)
