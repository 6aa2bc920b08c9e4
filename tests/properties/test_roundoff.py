"""The tolerances that properties share, and errors counted in roundings."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from handmade import case
from subjects import load_subject

from contactverif import Case, Interface, Subject
from contactverif.contract.traits import Promises, Traits
from contactverif_properties import roundoff
from contactverif_properties.roundoff import count_tangent_roundings, difference_quotient, measure_conditioning
from contactverif_properties.states import FrozenState, freeze_state

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


@pytest.mark.parametrize("penetration", [1 / 8, 1e-2, 1e-9, 0.0])
def test_the_tolerance_of_a_gap_is_the_formula(penetration: float) -> None:
    """X = 2 and N = 3. Where nothing penetrates, no gap is rounded."""
    rounding = 8 * 2 / penetration if penetration else 0.0
    assert roundoff.gap_tolerance(case(), penetration) == pytest.approx(U * (rounding + 4 * 3 + 128), rel=1e-15)


def test_a_stable_formulation_rounds_at_the_diameter_and_any_other_at_its_distance() -> None:
    far = case()
    far = replace(far, interface=far.interface.at(far.interface.nodes + 1e6), z=far.z + 1e6)
    stable = roundoff.rounding_distance(far, Traits(promises=Promises(translation_stable=True)))
    assert stable == far.diameter
    assert roundoff.rounding_distance(far, Traits()) == far.largest_coordinate > 1e6
    assert roundoff.gap_tolerance(far, 0.1, stable) < 1e-4 * roundoff.gap_tolerance(far, 0.1)


@pytest.mark.parametrize(
    ("part", "whole", "ratio"), [(1.0, 4.0, 0.25), (0.0, 0.0, 0.0), (1e-300, 0.0, np.inf), (np.nan, 1.0, np.nan)]
)
def test_a_ratio_to_nothing_is_infinite_or_0(part: float, whole: float, ratio: float) -> None:
    assert roundoff.ratio(part, whole) == pytest.approx(ratio, nan_ok=True)
    assert not roundoff.ratio(np.nan, 0.0) < np.inf


def bent_case() -> Case:
    slave = np.array([[0.1, -0.02], [1.3, 0.01], [2.4, -0.03], [3.2, 0.15]])
    master = np.array([[4.0, 0.3], [2.6, 0.02], [0.9, 0.01], [-1.0, 0.0]])
    return Case(Interface.from_chains(slave, master), np.vstack([slave, master]).reshape(-1), 100.0)


@pytest.mark.parametrize("name", ["nts-ar", "vts-ppt-balanced", "mortar", "mortar-lm", "vts-ppt-lm"])
def test_the_difference_quotient_is_the_tangent_of_an_exact_formulation(name: str) -> None:
    state = freeze_state(bent_case(), load_subject(name))
    error = np.abs(difference_quotient(state) - state.tangent)
    assert error.max() <= 1e-6 * np.abs(state.tangent).max()


@pytest.mark.parametrize("name", ["nts-ar", "vts-ppt-balanced", "mortar", "mortar-lm", "vts-ppt-lm"])
def test_roundings_of_the_input_count_as_few_roundings(name: str) -> None:
    state = freeze_state(bent_case(), load_subject(name))
    case, forces = state.case, state.residual
    conditioning = measure_conditioning(state, forces)
    centre = np.concatenate([np.tile(case.positions.mean(axis=0), case.interface.n_nodes), 0 * case.multipliers])
    random, size = np.random.default_rng(0), 2.0**-30  # Larger than 2⁻⁵³, so that only the input is rounded.
    worst = 0.0
    for _ in range(20):
        moved = case.z + size * random.uniform(-1, 1, len(case.z)) * (case.z - centre)
        worst = max(worst, conditioning.count_roundings(state.residual_at(moved) - forces))
    assert 0.02 <= worst * 2.0**-53 / size <= 1.01


def test_the_three_numbers_of_a_row_belong_together() -> None:
    state = freeze_state(bent_case(), load_subject("mortar-lm"))
    row = measure_conditioning(state, state.residual).worst_row(state.residual * 1e-9)
    assert row.condition >= 1
    assert row.error == pytest.approx(row.roundings * 2.0**-53 * row.condition)


def test_an_error_of_one_constraint_row_counts_over_that_row() -> None:
    state = freeze_state(bent_case(), load_subject("mortar-lm"))
    conditioning = measure_conditioning(state, state.residual)
    error = np.zeros_like(state.residual)
    error[-2] = 2.0**-53 * conditioning.reach[-2]
    assert conditioning.count_roundings(error) == pytest.approx(1.0)
    assert conditioning.count_roundings(0 * error) == 0.0


def test_nothing_in_contact_counts_as_no_rounding_and_any_force_there_as_infinitely_many() -> None:
    case = bent_case()
    opened = Case(case.interface, case.z + np.tile([0.0, 9.0] * 4 + [0.0, 0.0] * 4, 1), 100.0)
    state = freeze_state(opened, load_subject("nts-ar"))
    forces = state.residual
    assert not forces.any()
    conditioning = measure_conditioning(state, forces)
    assert conditioning.count_roundings(forces) == 0.0
    assert conditioning.count_roundings(forces + 1e-300) == np.inf


def test_a_plugin_without_a_pairing_is_measured_too() -> None:
    class Floor:
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            forces = np.zeros_like(z)
            y = z[1 : 2 * interface.n_slave_nodes : 2]
            forces[1 : 2 * interface.n_slave_nodes : 2] = 3.0 * np.where(y < 0, y, 0)
            return forces

    case = bent_case()
    state = FrozenState(Subject("floor", lambda *, penalty: Floor()).for_case(case), case, None)
    assert difference_quotient(state)[1, 1] == pytest.approx(3.0)
    assert measure_conditioning(state, state.residual).floor[0] == pytest.approx(0.09)


def test_tangents_are_compared_in_units_of_the_turn_of_the_shortest_segment() -> None:
    case = bent_case()
    tangent = np.diag(np.full(len(case.z), 7.0))
    unit = 2.0**-53 * 7.0 * case.diameter / case.shortest_segment
    assert count_tangent_roundings(case, tangent, tangent + 5 * unit) == pytest.approx(5.0, rel=0.2)
