"""The judge of tangents, on remainders of known slopes and on formulations made by hand."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gauss_springs import RIGHT, springs_of
from handmade import Handmade, case, over_a_node, subject
from subjects import judge_as

from contactverif import Case, Interface, Promises, Traits, Verdict, judge_case
from contactverif_properties.states import random_directions
from contactverif_properties.tangent import (
    CENTRAL,
    COMPLEX,
    NOT_ANALYTIC,
    SLOPE,
    TAYLOR,
    defect_directions,
    first_directions,
    tangent_directional,
    taylor_slope,
)

STEPS = np.array([1e-1, 1e-2, 1e-3])


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0, 3.0])
def test_the_slope_of_a_power_is_the_power(power: float) -> None:
    remainders = np.array([2.0, 5.0]) * STEPS[:, None] ** power
    assert taylor_slope(remainders, STEPS, floor=0.0) == pytest.approx(power)
    assert taylor_slope(remainders[::-1], STEPS[::-1], floor=0.0) == pytest.approx(power)


def test_the_worst_direction_counts() -> None:
    remainders = np.column_stack([STEPS**2, 1e-6 * STEPS])
    assert taylor_slope(remainders, STEPS, floor=0.0) == pytest.approx(1.0)


def test_the_best_pair_of_steps_counts() -> None:
    """The last step is in roundoff, which no floor told."""
    remainders = np.array([[1e-2], [1e-4], [9e-5]])
    assert taylor_slope(remainders, STEPS, floor=0.0) == pytest.approx(2.0)


def test_two_steps_that_are_nearly_equal_tell_no_slope() -> None:
    """Found by 20,000 examples: with uS/ℓ = 1e-10 two of the steps are 3 % apart, and the slope between them noise."""
    steps = np.array([3.9e-3, 3.8e-3, 2.4e-4])
    assert taylor_slope(np.array([[1e-7], [1.2e-7], [1e-12]]), steps, floor=1e-9) == np.inf
    assert taylor_slope(np.array([[1e-4], [1.2e-4], [4e-7]]), steps, floor=1e-9) == pytest.approx(2, abs=0.1)


def test_what_is_below_the_floor_decides_nothing() -> None:
    remainders = np.column_stack([[1e-2, 1e-4, 1e-12], [1e-13, 1e-14, 1e-15]])
    assert taylor_slope(remainders, STEPS, floor=1e-10) == pytest.approx(2.0)
    assert taylor_slope(remainders[:, 1:], STEPS, floor=1e-10) == np.inf


def test_the_slope_finds_a_large_error_and_misses_a_small_one() -> None:
    """So the central difference is asked too."""
    wrong = STEPS[:, None]
    assert taylor_slope(wrong + STEPS[:, None] ** 2, STEPS, floor=1e-12) < SLOPE
    assert taylor_slope(1e-3 * wrong + STEPS[:, None] ** 2, STEPS, floor=1e-12) > SLOPE


def test_no_remainder_at_all_is_exact() -> None:
    assert taylor_slope(np.zeros((3, 2)), STEPS, floor=0.0) == np.inf


def test_directions_are_as_long_as_their_largest_entry() -> None:
    directions = random_directions(4, 8, 10)
    assert directions.shape == (8, 10)
    assert np.array_equal(np.abs(directions).max(axis=1), np.ones(8))
    assert np.array_equal(directions, random_directions(4, 8, 10))
    assert not np.array_equal(directions, random_directions(5, 8, 10))


def cubes(z: Any) -> Any:
    return z**3 + z * np.roll(z, 1)


def derivative_of_cubes(z: Any) -> Any:
    k = np.diag(3 * z**2 + np.roll(z, 1))
    return k + np.diag(z) @ np.roll(np.eye(len(z)), -1, axis=1)


class Smooth(Handmade):
    """A residual that has nothing to do with contact, and its derivative, with an error if asked for."""

    def __init__(self, error: Callable[[Any], Any] = lambda k: k, **traits: Any) -> None:
        super().__init__(**{"tangent": "exact", "batched": True, **traits})
        self.error = error

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return cubes(z[..., :]) if z.ndim == 1 else np.apply_along_axis(cubes, -1, z)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self.error(derivative_of_cubes(z))

    def pair(self, interface: Any, z: Any) -> Any:
        return {}


def one_entry(size: float) -> Callable[[Any], Any]:
    def wrong(k: Any) -> Any:
        k = k.copy()
        k[0, 0] += size * np.abs(k).max()
        return k

    return wrong


def test_an_exact_tangent_passes_all_three_conditions() -> None:
    outcome = judge_as(Verdict.PASS, tangent_directional, case(), subject(Smooth, takes_complex=True))
    assert set(outcome.measurement.values) == {CENTRAL.name, TAYLOR.name, COMPLEX.name}
    assert outcome.measurement.values[TAYLOR.name] == pytest.approx(2.0, abs=0.05)


def test_without_complex_numbers_there_is_no_complex_step() -> None:
    assert COMPLEX.name not in tangent_directional.measure(case(), subject(Smooth)).values


@pytest.mark.parametrize("size", [1.0, 1e-3, 1e-6, 1e-8])
def test_an_error_in_one_entry_is_found(size: float) -> None:
    outcome = judge_as(Verdict.FAIL, tangent_directional, case(), subject(Smooth, error=one_entry(size)))
    assert CENTRAL.name in outcome.reason


def test_a_complex_step_finds_what_a_central_difference_cannot() -> None:
    wrong = one_entry(1e-10)
    assert judge_case(tangent_directional, case(), subject(Smooth, error=wrong)).verdict is Verdict.PASS
    outcome = judge_as(Verdict.FAIL, tangent_directional, case(), subject(Smooth, error=wrong, takes_complex=True))
    assert outcome.reason.startswith(COMPLEX.name)
    assert NOT_ANALYTIC not in outcome.reason


def test_a_residual_that_no_complex_number_can_take_is_told_from_a_wrong_tangent() -> None:
    class Lengths(Smooth):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return super().residual(interface, pairing, z) * (1 + z**2) / np.abs(1 + z**2)

    outcome = judge_as(Verdict.FAIL, tangent_directional, case(), subject(Lengths, takes_complex=True))
    assert outcome.reason.startswith(COMPLEX.name)
    assert NOT_ANALYTIC in outcome.reason


def test_a_tangent_of_nothing_is_nothing() -> None:
    class Nothing(Smooth):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return 0 * z

        def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
            return np.zeros((z.size, z.size))

    assert judge_case(tangent_directional, case(), subject(Nothing)).verdict is Verdict.PASS

    class TangentOfNothing(Nothing):
        def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
            return 1e-12 * np.eye(z.size)

    assert judge_case(tangent_directional, case(), subject(TangentOfNothing)).verdict is Verdict.FAIL


class Restless(Smooth):
    """Its pairing is another at every call."""

    calls = 0

    def pair(self, interface: Any, z: Any) -> Any:
        self.calls += 1
        return {"call": np.array([self.calls % 5])}


def test_a_pairing_that_changes_at_every_call_is_no_excuse() -> None:
    """A wrong tangent fails. A right one passes, and `purity` judges the pairing: differences need no pairing twice."""
    assert judge_case(tangent_directional, case(), subject(Restless, error=one_entry(1.0))).verdict is Verdict.FAIL
    assert judge_case(tangent_directional, case(), subject(Restless, error=one_entry(0.0))).verdict is Verdict.PASS


def test_nor_where_it_names_its_contact_points() -> None:
    class Pointed(Restless):
        def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
            return self.points(c=0.1)

    assert judge_case(tangent_directional, case(), subject(Pointed, error=one_entry(1.0))).verdict is Verdict.FAIL


@pytest.mark.parametrize("way", RIGHT)
def test_a_pairing_may_flip_where_it_changes_no_force(way: str) -> None:
    """An arc of open Gauss points above a ridge is nearest to the ridge itself, so that roundoff picks the facet."""
    angles = np.linspace(-0.8, 0.8, 13)
    arc = 0.5 * np.stack([np.sin(angles), np.cos(angles)], axis=1)
    slave = np.vstack([[[-4.0, -2.85], [-2.0, -1.5]], arc])
    master = np.array([[6.0, -4.0], [0.0, 0.0], [-6.0, -4.0]])
    interface = Interface.from_chains(slave, master)
    ridge = Case(interface, interface.nodes.reshape(-1), 4.0)
    judge_as(Verdict.PASS, tangent_directional, ridge, springs_of(*RIGHT[way]))


class Stored(Smooth):
    """It stores how far a node is in its pairing, in steps of 1e-12, and the force that follows from it."""

    def __init__(self, share: float) -> None:
        super().__init__()
        self.share = share

    def pair(self, interface: Any, z: Any) -> Any:
        digits = np.int64(round(abs(z[0]) * 1e12))
        return {"digits": np.array([digits >> shift & 1 for shift in range(48)])}

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = super().residual(interface, pairing, z)
        forces[..., 1] += self.share * 1e-12 * (pairing["digits"] << np.arange(48)).sum()
        return forces


def test_a_pairing_that_stores_a_number_of_the_force_is_found() -> None:
    judge_as(Verdict.PASS, tangent_directional, case(), subject(Stored, share=0.0))
    outcome = judge_as(Verdict.FAIL, tangent_directional, case(), subject(Stored, share=1e-3))
    assert "it holds numbers, not decisions" in outcome.reason


@pytest.mark.parametrize(("wrong", "verdict"), [(0.0, Verdict.PASS), (1e-3, Verdict.FAIL)])
def test_where_the_residual_is_not_smooth_the_slope_tells_nothing(wrong: float, verdict: Verdict) -> None:
    """Its remainder falls with slope 1.8, whichever derivative one takes; a wrong tangent is found all the same."""
    at = case().z

    class Rough(Smooth):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return z + np.abs(z - at) ** 1.8

        def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
            return (1 + wrong) * np.eye(z.size)

    assert judge_case(tangent_directional, case(), subject(Rough)).verdict is verdict


class Nearest(Handmade):
    """A spring at one point of the slave, to the height of the master segment that is nearest, kinked over a node."""

    def __init__(self, wrong: float = 0.0, **traits: Any) -> None:
        super().__init__(**{"tangent": "exact", "batched": True, **traits})
        self.wrong = wrong

    def pair(self, interface: Any, z: Any) -> Any:
        """1 where the middle of the first slave segment is right of the middle master node."""
        middle = (z[0] + z[2]) / 2
        return {"right": np.array([middle > z[2 * (interface.n_slave_nodes + 1)]])}

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = 0 * z
        forces[..., 1] = np.where(pairing["right"][0], 1.0, 3.0) * z[..., 1] ** 2
        return forces

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        k = np.zeros((z.size, z.size))
        k[1, 1] = (1 + self.wrong) * np.where(pairing["right"][0], 1.0, 3.0) * 2 * z[1]
        return k

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self.points(c=0.0)


def test_a_true_kink_is_undecided_where_it_would_fail() -> None:
    at_kink, beside = over_a_node(0.0), over_a_node(1 / 7)
    judge_as(Verdict.PASS, tangent_directional, at_kink, subject(Nearest))
    outcome = judge_as(Verdict.UNDECIDED, tangent_directional, at_kink, subject(Nearest, wrong=0.1))
    assert outcome.reason.startswith("a kink: a decision hangs on ")
    assert judge_case(tangent_directional, beside, subject(Nearest)).verdict is Verdict.PASS
    assert judge_case(tangent_directional, beside, subject(Nearest, wrong=0.1)).verdict is Verdict.FAIL


def test_what_provides_no_tangent_is_not_asked() -> None:
    assert tangent_directional.needs == {"tangent"}
    assert tangent_directional.promise(Traits()) is None
    assert tangent_directional.promise(Traits(promises=Promises(tangent="approximate"))) is False
    assert tangent_directional.promise(Traits(promises=Promises(tangent="exact"))) is True


def test_each_region_moves_by_itself() -> None:
    at = case().with_multipliers(np.ones(3))
    directions = first_directions(at, 2)
    moved = [np.flatnonzero(direction).tolist() for direction in directions]
    assert moved == [list(range(13)), list(range(13)), [0, 1, 2, 3], [4, 5, 6, 7, 8, 9], [10, 11, 12]]
    assert np.array_equal(np.abs(directions).max(axis=1), np.ones(5))


@pytest.mark.parametrize("count", [3, 12])
def test_the_leading_singular_direction_of_the_defect_is_found(count: int) -> None:
    """In as many directions as unknowns it is that of the matrix; in fewer, none of them has a larger defect."""
    defect = np.diag([1.0, 2.0, 3.0, 1e-3, 7.0, 0.5])
    directions = random_directions(1, count, 6)
    worst, singular = defect_directions(directions, directions @ defect.T)
    gains = np.linalg.norm(np.vstack([directions, [singular]]) @ defect.T, axis=1)
    gains /= np.linalg.norm(np.vstack([directions, [singular]]), axis=1)
    assert gains.argmax() == count
    if count > 6:
        assert gains[-1] == pytest.approx(7.0)
    assert np.abs(worst).max() == np.abs(singular).max() == 1
    assert len(defect_directions(directions, 0 * directions)) == 0


def test_a_row_counts_over_its_own_derivative() -> None:
    """An error of 1e-6 in a row that is 1e-8 of the largest one."""

    class Uneven(Smooth):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return z * np.where(np.arange(z.shape[-1]) < 2, 1e-8, 1.0)

        def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
            k = np.diag(np.where(np.arange(z.size) < 2, 1e-8, 1.0))
            k[1, 1] *= 1 + 1e-6
            return k

    outcome = judge_as(Verdict.FAIL, tangent_directional, case(), subject(Uneven))
    assert "row 1 (y of slave node 0)" in outcome.reason
