"""`tangent.directional`, `tangent.sparsity` and `tangent.long` with right and wrong tangents."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gauss_springs
import numpy as np
import pytest
from gauss_springs import RIGHT, springs_of
from handmade import Handmade, OneForce, Plain, case, over_a_node, plain, subject
from planned_cases import draw_cases
from subjects import judge_as, load_subject

from contactverif import Case, Interface, Promises, Subject, Traits, Verdict, judge_case
from contactverif.cli.run_screen import counterexample_text
from contactverif.contract.counterexample import counterexamples
from contactverif.contract.property import judge
from contactverif.problems.long_states import long_states
from contactverif.run.run import run
from contactverif.strategies import smooth_cases
from contactverif.testing.checks import explain
from contactverif_properties.states import freeze_state, random_directions
from contactverif_properties.tangent import (
    BLOCK,
    CENTRAL,
    COMPLEX,
    COMPLEX_BLOCK,
    LACKING,
    NOT_ANALYTIC,
    SLOPE,
    TAYLOR,
    Groups,
    defect_directions,
    first_directions,
    judge_of,
    measure_blocks,
    plan_moves,
    scatter,
    single_moves,
    tangent_directional,
    tangent_long,
    tangent_sparsity,
    taylor_slope,
)
from contactverif_reports.html.report_page import report_page
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.netcdf.write import write

STEPS = np.array([1e-1, 1e-2, 1e-3])


NEARLY_EQUAL = np.array([3.9e-3, 3.8e-3, 2.4e-4])  # Found by 20,000 examples at uS/ℓ = 1e-10.
# {what is said: (remainders, steps, floor, slope)}
SLOPES: dict[str, tuple[Any, Any, float, float]] = {
    **{
        f"a power of {power}": (np.array([2.0, 5.0]) * STEPS[:, None] ** power, STEPS, 0.0, power)
        for power in (1, 1.5, 3)
    },
    "steps in any order": (np.array([2.0, 5.0]) * STEPS[::-1, None] ** 2, STEPS[::-1], 0.0, 2.0),
    "the worst direction counts": (np.column_stack([STEPS**2, 1e-6 * STEPS]), STEPS, 0.0, 1.0),
    "the best pair of steps counts: the last is in roundoff": (np.array([[1e-2], [1e-4], [9e-5]]), STEPS, 0.0, 2.0),
    "two nearly equal steps tell nothing": (np.array([[1e-7], [1.2e-7], [1e-12]]), NEARLY_EQUAL, 1e-9, np.inf),
    "a step beside two nearly equal ones does": (np.array([[1e-4], [1.2e-4], [4e-7]]), NEARLY_EQUAL, 1e-9, 1.99),
    "roundoff decides nothing": (np.array([[1e-2, 1e-13], [1e-4, 1e-14], [1e-12, 1e-15]]), STEPS, 1e-10, 2.0),
    "roundoff alone is exact": (np.array([[1e-13], [1e-14], [1e-15]]), STEPS, 1e-10, np.inf),
    "no remainder at all is exact": (np.zeros((3, 2)), STEPS, 0.0, np.inf),
}


@pytest.mark.parametrize("name", SLOPES)
def test_the_slope_of_remainders(name: str) -> None:
    remainders, steps, floor, slope = SLOPES[name]
    floors = np.full(len(steps), floor)
    assert taylor_slope(remainders, steps, floors) == pytest.approx(slope, rel=0.05 if "beside" in name else 1e-6)


def test_the_slope_finds_a_large_error_and_misses_a_small_one() -> None:
    """So the central difference is asked too."""
    wrong = STEPS[:, None]
    floors = np.full(len(STEPS), 1e-12)
    assert taylor_slope(wrong + STEPS[:, None] ** 2, STEPS, floors) < SLOPE
    assert taylor_slope(1e-3 * wrong + STEPS[:, None] ** 2, STEPS, floors) > SLOPE


def test_directions_are_as_long_as_their_largest_entry_and_of_their_seed() -> None:
    directions, again, others = (random_directions(seed, 8, 10) for seed in (4, 4, 5))
    assert np.array_equal(np.abs(directions).max(axis=1), np.ones(8))
    assert np.array_equal(directions, again)
    assert not np.array_equal(directions, others)


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


class Nearest(OneForce):
    """A spring at one point of the slave, to the height of the master segment that is nearest, kinked over a node."""

    def __init__(self, wrong: float = 0.0) -> None:
        super().__init__(tangent="exact", batched=True)
        self.wrong = wrong

    def pair(self, interface: Any, z: Any) -> Any:
        """1 where the middle of the first slave segment is right of the middle master node."""
        return {"right": np.array([(z[0] + z[2]) / 2 > z[2 * (interface.n_slave_nodes + 1)]])}

    def force(self, z: Any, pairing: Any) -> Any:
        return np.where(pairing["right"][0], 1.0, 3.0) * z[..., 1] ** 2

    def stiffness(self, z: Any, pairing: Any) -> Any:
        return (1 + self.wrong) * np.where(pairing["right"][0], 1.0, 3.0) * 2 * z[1]

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


FEW = draw_cases(smooth_cases(), seed="blocks", examples=40).cases


def off_by(size: float, node: int) -> Any:
    """Return a change of one entry by a share of its block, that of a node with itself."""

    def change(interface: Any, matrix: Any) -> None:
        block = matrix[2 * node : 2 * node + 2, 2 * node : 2 * node + 2]
        block[0, 1] += size * np.abs(block).max()

    return change


def test_unknowns_have_names_and_what_surrounds_a_block_has_its_unit() -> None:
    names = [Groups(2, 5, 3).describe(number) for number in (3, 4, 12)]
    assert names == ["y of slave node 1", "x of master node 2", "multiplier 2"]
    blocks = np.array([[1.0, 2.0, 100.0], [0.5, 3.0, 200.0], [7.0, 8.0, 0.0]])
    assert Groups(1, 2, 1).surroundings(blocks).tolist() == [[2, 3, 200], [3, 3, 200], [8, 8, 0]]


@pytest.mark.parametrize("name", ["vts-ppt-balanced", "mortar-dual-lm"])
@pytest.mark.parametrize("number", range(len(long_states())))
def test_unknowns_that_move_together_give_the_columns_of_single_ones(name: str, number: int) -> None:
    subject = load_subject(name)
    judge = judge_of(long_states()[number], subject)
    moves = plan_moves(judge.state.case, judge.pattern)
    assert sorted(np.concatenate(moves.members)) == list(range(judge.groups.size))
    columns = np.random.default_rng(0).integers(0, judge.groups.size, 20)
    (together,) = scatter(judge.answers(moves), moves)
    single = single_moves(columns, judge.groups.size)
    (alone,) = scatter(judge.answers(single), single)
    assert together[:, columns] == pytest.approx(alone[:, columns], abs=1e-12 * np.abs(alone).max())


def test_few_moves_are_enough_for_many_unknowns() -> None:
    judge = judge_of(long_states()[0], load_subject("vts-ppt-balanced"))
    assert len(plan_moves(judge.state.case, judge.pattern).members) < judge.groups.size / 10


def test_long_states_are_long_and_in_contact() -> None:
    for state in long_states():
        assert max(len(state.interface.slave), len(state.interface.master)) > 100
        forces = freeze_state(state, load_subject("vts-ppt-balanced")).forces[: state.interface.n_slave_nodes]
        assert (np.abs(forces).max(axis=1) > 0).all(), state.name


@pytest.mark.parametrize("name", ["nts", "vts-ppt", "mortar-lm"])
@pytest.mark.parametrize("paired", [True, False])
def test_a_right_tangent_passes_in_doubles_alone_and_without_a_pairing(name: str, paired: bool) -> None:
    innocent = plain(name, paired=paired)
    for each in FEW[:20]:
        judge_as(Verdict.PASS, tangent_sparsity, each, innocent)
    judge_as(Verdict.PASS, tangent_long, long_states()[4], innocent)


@pytest.mark.parametrize("name", gauss_springs.RIGHT)
def test_other_ways_of_writing_pass_in_long_double(name: str) -> None:
    innocent = gauss_springs.springs_of(*gauss_springs.RIGHT[name])
    for each in FEW[:15]:
        judge_as(Verdict.PASS, tangent_sparsity, each, innocent)


@pytest.mark.parametrize("name", ["nts", "vts-ppt-balanced", "mortar"])
@pytest.mark.parametrize(("number", "node"), [(0, 3), (0, 60), (0, 150), (4, 60), (4, 120)])
def test_one_entry_off_by_1e_6_of_its_block_is_found_among_hundreds_of_nodes(name: str, number: int, node: int) -> None:
    """Differences of doubles are enough."""
    state = long_states()[number]
    outcome = judge_as(Verdict.FAIL, tangent_long, state, plain(name, off_by(1e-6, node)))
    name = f"{'slave' if node < state.interface.n_slave_nodes else 'master'} node {node}"
    assert f"row {2 * node} (x of {name}), column {2 * node + 1} (y of {name})" in outcome.reason


def test_an_entry_that_the_pattern_lacks_is_named() -> None:
    def forget(interface: Any, matrix: Any) -> None:
        matrix[0, 1] = 0.0

    state = long_states()[1]
    outcome = judge_case(tangent_long, state, plain("vts-me", forget))
    assert outcome.measurement.values[LACKING.name] == 1
    place = "row 0 (x of slave node 0), column 1 (y of slave node 0), not in the pattern"
    assert f"{place}: tangent 0, derivative" in outcome.reason


def test_a_coupling_outside_the_pattern_is_found_where_unknowns_move_together() -> None:
    """Two far nodes feel each other, and nothing in mesh or tangent says so."""
    inner = load_subject("nts")

    class Coupled(Plain):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            forces = np.array(super().residual(interface, pairing, z))
            forces[5] += 1e-3 * z[300]
            return forces

    far = Subject("coupled", lambda *, penalty: Coupled(inner.with_penalty(penalty).plugin))
    outcome = judge_as(Verdict.FAIL, tangent_long, long_states()[0], far)
    place = "row 5 (y of slave node 2), column 300 (x of master node 150), not in the pattern"
    assert f"{place}: tangent 0, " in outcome.reason


class Kinked(OneForce):
    """A spring at one slave node that is stiffer on one side of its state, without a pairing that says which side."""

    def __init__(self, at: float, wrong: float) -> None:
        super().__init__(tangent="exact")
        self.at, self.stiffness = at, lambda z, pairing: wrong

    def force(self, z: Any, pairing: Any) -> Any:
        return np.where(z[1] > self.at, 1.0, 3.0) * (z[1] - self.at)


@pytest.mark.parametrize(
    ("stiffness", "verdict"),
    [(1.0, Verdict.PASS), (3.0, Verdict.PASS), (2.0, Verdict.PASS), (1.1, Verdict.UNDECIDED), (0.0, Verdict.UNDECIDED)],
)
def test_at_a_kink_the_derivative_to_either_side_is_right_and_another_one_undecided(
    stiffness: float, verdict: Verdict
) -> None:
    """2 is the central difference, which no judge can tell from a derivative."""
    at = case()
    outcome = judge_as(verdict, tangent_sparsity, at, subject(Kinked, at=at.z[1], wrong=stiffness))
    if verdict is Verdict.UNDECIDED:
        assert outcome.reason.startswith("a kink")


def test_a_kink_excuses_no_other_block() -> None:
    class Twice(Kinked):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            forces = super().residual(interface, pairing, z)
            forces[4] = z[4] ** 2
            return forces

    at = case()
    outcome = judge_as(Verdict.FAIL, tangent_sparsity, at, subject(Twice, at=at.z[1], wrong=0.5))
    assert "row 4 (x of master node 2), column 4 (x of master node 2)" in outcome.reason


class Sharp(OneForce):
    """A residual that bends over a very short length, and a tangent that is wrong by 10 % there."""

    def __init__(self, length: float, wrong: float) -> None:
        super().__init__(tangent="exact")
        self.force = lambda z, pairing: np.sin(z[1] / length)
        self.stiffness = lambda z, pairing: (1 + wrong) * np.cos(z[1] / length) / length


@pytest.mark.parametrize(
    ("length", "wrong", "verdict"),
    [(0.02, 0.0, Verdict.PASS), (0.02, 1e-3, Verdict.FAIL), (1e-4, 1e-3, Verdict.UNDECIDED)],
)
def test_a_residual_that_bends_sharply_is_judged_as_well_as_differences_can(
    length: float, wrong: float, verdict: Verdict
) -> None:
    judge_as(verdict, tangent_sparsity, over_a_node(6 / 7), subject(Sharp, length=length, wrong=wrong))


def test_each_formulation_is_judged_by_the_sharpest_way_that_it_takes() -> None:
    assert set(measure_blocks(FEW[0], load_subject("nts")).values) == {COMPLEX_BLOCK.name, LACKING.name}
    assert set(measure_blocks(FEW[0], plain("nts")).values) == {BLOCK.name, LACKING.name}


def test_no_contact_is_an_idle_case() -> None:
    assert measure_blocks(case(), subject(Kinked, at=0.0, wrong=1.0)).idle is False
    open_case = over_a_node(6 / 7, gap=1 / 8)
    assert measure_blocks(open_case, load_subject("nts")).idle is True
    assert judge(tangent_sparsity, measure_blocks(open_case, load_subject("nts")))[0] is Verdict.PASS


def test_a_failure_is_named_in_the_terminal_in_a_report_on_a_page_and_in_pytest(tmp_path: Path) -> None:
    result = run([plain("vts-me", off_by(1e-2, 0))], [tangent_sparsity], examples=5, seed=1)
    (row,) = result.rows
    place = str(row.shrunk.measurement.finding)
    assert place.startswith("row 0 (x of slave node 0), column 1 (y of slave node 0): tangent ")
    assert place in explain(row, command="pytest")
    path = tmp_path / "report.nc"
    write(result, path)
    again = read_run(path)
    for each in (result, again):
        (example,) = counterexamples(each).values()
        assert place in counterexample_text(example, None).plain
    assert place in report_page(again, path)
