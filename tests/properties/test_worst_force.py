"""The node that errs most is named with the force found there beside the exact one."""

import numpy as np
import pytest

from contactverif.problems.named_states import named_case
from contactverif_properties.exact_forces import forces_of_penetration, total_force, worst_force


def test_a_factor_at_a_free_end_is_named() -> None:
    case = named_case("c")
    exact = forces_of_penetration(case)
    wrong = exact.copy()
    wrong[0] *= 2
    finding = worst_force(case.interface, wrong, exact)
    assert finding.place == "slave node 0 (free end)"
    assert finding.found == pytest.approx(2 * np.array(finding.right))
    assert finding.remark == "ratio 2"
    assert str(finding).startswith("slave node 0 (free end): force ")


def test_a_force_the_other_way_has_a_negative_ratio() -> None:
    case = named_case("c")
    exact = forces_of_penetration(case)
    assert worst_force(case.interface, -exact, exact).remark == "ratio -1"


@pytest.mark.parametrize("share", [2.0**-40, -(2.0**-40)])
def test_a_ratio_that_four_digits_call_1_says_by_how_much_it_is_not(share: float) -> None:
    case = named_case("c")
    exact = forces_of_penetration(case)
    remark = worst_force(case.interface, exact * (1 + share), exact).remark
    assert remark == f"ratio 1 {'+' if share > 0 else '−'} 9.1e-13"


def test_a_force_aside_has_both_components() -> None:
    case = named_case("c")
    exact = forces_of_penetration(case)
    wrong = exact + np.where(np.arange(len(exact)) == case.interface.n_slave_nodes, 1.0, 0.0)[:, None] * exact.max()
    wrong[:, 0] += np.abs(exact).max() * (np.arange(len(exact)) == 1)
    finding = worst_force(case.interface, wrong, exact)
    assert len(finding.found) == 2
    assert "x and y" in finding.place


def test_nothing_beside_a_force_has_no_ratio() -> None:
    finding = total_force(np.array([0.0, 2.0]), np.zeros(2))
    assert (finding.found, finding.right, finding.remark) == ((2.0,), (0.0,), "")
