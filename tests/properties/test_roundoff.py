"""The tolerances that the properties share."""

from dataclasses import replace

import numpy as np
import pytest
from handmade import case

from contactverif.contract.traits import Promises, Traits
from contactverif_properties import roundoff

U = 2.0**-53


def test_forces_of_the_slave_are_summed_entry_by_entry() -> None:
    forces = np.array([[1.0, -2.0], [3.0, 0.0], [100.0, 100.0], [0.0, 0.0], [5.0, 5.0]])
    assert roundoff.sum_slave_forces(case(), forces) == 6.0
    assert roundoff.sum_slave_forces(case(), forces.reshape(-1)) == 6.0


def test_the_mean_penetration_is_the_uniform_one_that_the_same_forces_need() -> None:
    """Here ε̂ = 4 and L = 1, so that a penetration of 1/8 pushes each of two nodes with 1/4."""
    forces = np.zeros((5, 2))
    forces[:2, 1] = 1 / 4
    assert roundoff.mean_penetration(case(), forces) == 1 / 8


def test_the_tolerance_of_a_gap_is_the_formula() -> None:
    """X = 2 and N = 3."""
    assert roundoff.gap_tolerance(case(), 1 / 8) == pytest.approx(U * (8 * 2 / (1 / 8) + 4 * 3 + 128), rel=1e-15)
    assert roundoff.gap_tolerance(case(), 1e-9) > 1e6 * roundoff.gap_tolerance(case(), 1e-2)


def test_where_nothing_penetrates_no_gap_is_rounded() -> None:
    assert roundoff.gap_tolerance(case(), 0.0) == U * (4 * 3 + 128)


def test_a_stable_formulation_rounds_at_the_diameter_and_any_other_at_its_distance() -> None:
    far = case()
    far = replace(far, interface=far.interface.at(far.interface.nodes + 1e6), z=far.z + 1e6)
    stable = roundoff.rounding_distance(far, Traits(promises=Promises(translation_stable=True)))
    assert stable == far.diameter
    assert roundoff.rounding_distance(far, Traits()) == far.largest_coordinate > 1e6
    assert roundoff.gap_tolerance(far, 0.1, stable) < 1e-4 * roundoff.gap_tolerance(far, 0.1)


def test_a_share_of_nothing() -> None:
    assert roundoff.ratio(1.0, 4.0) == 0.25
    assert roundoff.ratio(0.0, 0.0) == 0.0
    assert roundoff.ratio(1e-300, 0.0) == np.inf
    assert np.isnan(roundoff.ratio(np.nan, 0.0)) or roundoff.ratio(np.nan, 0.0) == np.inf
    assert np.isnan(roundoff.ratio(np.nan, 1.0))
