"""The judge of the blocks of a tangent: what it finds, what it excuses, and how it names what it found."""

from pathlib import Path
from typing import Any

import gauss_springs
import numpy as np
import pytest
from handmade import Handmade, case, over_a_node, subject
from subjects import judge_as, load_subject

from contactverif import Subject, judge_case
from contactverif.cli.counterexample_output import counterexample_text
from contactverif.contract.counterexample import counterexamples
from contactverif.contract.property import Verdict, judge
from contactverif.problems.long_states import long_states
from contactverif.run.run import run
from contactverif.sampling.draw import draw_cases
from contactverif.strategies import smooth_cases
from contactverif.testing.failure_text import explain
from contactverif_properties.states import freeze_state
from contactverif_properties.tangent import (
    BLOCK,
    COMPLEX_BLOCK,
    LACKING,
    Groups,
    judge_of,
    measure_blocks,
    plan_moves,
    scatter,
    single_moves,
    tangent_long,
    tangent_sparsity,
)
from contactverif_reports.html.report_page import report_page
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.netcdf.write import write

FEW = draw_cases(smooth_cases(), seed="blocks", examples=40).cases


class Plain:
    """A formulation in doubles alone, with an error in its tangent if asked for; without a pairing if asked for."""

    def __init__(self, inner: Any, change: Any = None, *, paired: bool = True) -> None:
        self._inner, self._change, self._paired = inner, change, paired
        self.traits = inner.traits.revise(takes_complex=False, takes_longdouble=False, batched=False)
        if hasattr(inner, "n_multipliers"):
            self.n_multipliers = inner.n_multipliers
        if paired:
            self.pair = inner.pair

    def _pairing(self, interface: Any, pairing: Any, z: Any) -> Any:
        return pairing if self._paired else self._inner.pair(interface, z)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._inner.residual(interface, self._pairing(interface, pairing, z), z)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        matrix = self._inner.tangent(interface, self._pairing(interface, pairing, z), z)
        if self._change is None:
            return matrix
        matrix = matrix.toarray()
        self._change(interface, matrix)
        return matrix


def plain(name: str, change: Any = None, *, paired: bool = True) -> Subject:
    inner = load_subject(name)
    return Subject(name, lambda *, penalty: Plain(inner.with_penalty(penalty).plugin, change, paired=paired))


def off_by(size: float, node: int, *, large: bool = False) -> Any:
    """Return a change of one entry by a share of its block, that of a node with itself."""

    def change(interface: Any, matrix: Any) -> None:
        if not large or max(len(interface.slave), len(interface.master)) > 100:
            block = matrix[2 * node : 2 * node + 2, 2 * node : 2 * node + 2]
            block[0, 1] += size * np.abs(block).max()

    return change


def test_unknowns_have_names() -> None:
    groups = Groups(2, 5, 3)
    assert groups.describe(3) == "y of slave node 1"
    assert groups.describe(4) == "x of master node 2"
    assert groups.describe(12) == "multiplier 2"
    assert (groups.count, groups.size) == (8, 13)
    assert groups.of_unknowns.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 6, 7]


def test_a_block_is_the_rows_of_a_node_times_the_columns_of_a_node() -> None:
    groups = Groups(1, 2, 1)
    matrix = np.arange(25.0).reshape(5, 5) - 12
    assert groups.largest(matrix).tolist() == [[12, 10, 8], [4, 6, 7], [9, 11, 12]]


def test_what_surrounds_a_block_has_its_unit() -> None:
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
    assert outcome.measurement is not None
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


class Kinked(Handmade):
    """A spring at one slave node that is stiffer on one side of its state, without a pairing that says which side."""

    def __init__(self, at: float, stiffness: float) -> None:
        super().__init__(tangent="exact")
        self.at, self.stiffness = at, stiffness

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = 0 * z
        forces[1] = np.where(z[1] > self.at, 1.0, 3.0) * (z[1] - self.at)
        return forces

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        k = np.zeros((z.size, z.size))
        k[1, 1] = self.stiffness
        return k


@pytest.mark.parametrize(
    ("stiffness", "verdict"),
    [(1.0, Verdict.PASS), (3.0, Verdict.PASS), (2.0, Verdict.PASS), (1.1, Verdict.UNDECIDED), (0.0, Verdict.UNDECIDED)],
)
def test_at_a_kink_the_derivative_to_either_side_is_right_and_another_one_undecided(
    stiffness: float, verdict: Verdict
) -> None:
    """2 is the central difference, which no judge can tell from a derivative."""
    at = case()
    outcome = judge_as(verdict, tangent_sparsity, at, subject(Kinked, at=at.z[1], stiffness=stiffness))
    if verdict is Verdict.UNDECIDED:
        assert outcome.reason.startswith("a kink")


def test_a_kink_excuses_no_other_block() -> None:
    class Twice(Kinked):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            forces = super().residual(interface, pairing, z)
            forces[4] = z[4] ** 2
            return forces

    at = case()
    outcome = judge_as(Verdict.FAIL, tangent_sparsity, at, subject(Twice, at=at.z[1], stiffness=0.5))
    assert "row 4 (x of master node 2), column 4 (x of master node 2)" in outcome.reason


class Sharp(Handmade):
    """A residual that bends over a very short length, and a tangent that is wrong by 10 % there."""

    def __init__(self, length: float, wrong: float) -> None:
        super().__init__(tangent="exact")
        self.length, self.wrong = length, wrong

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = 0 * z
        forces[1] = np.sin(z[1] / self.length)
        return forces

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        k = np.zeros((z.size, z.size))
        k[1, 1] = (1 + self.wrong) * np.cos(z[1] / self.length) / self.length
        return k


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
    assert measure_blocks(case(), subject(Kinked, at=0.0, stiffness=1.0)).idle is False
    open_case = over_a_node(6 / 7, gap=1 / 8)
    assert measure_blocks(open_case, load_subject("nts")).idle is True
    assert judge(tangent_sparsity, measure_blocks(open_case, load_subject("nts")))[0] is Verdict.PASS


def test_a_failure_is_named_in_the_terminal_in_a_report_on_a_page_and_in_pytest(tmp_path: Path) -> None:
    result = run([plain("vts-me", off_by(1e-2, 0))], [tangent_sparsity], examples=5, seed=1)
    (row,) = result.rows
    assert row.shrunk is not None
    assert row.shrunk.measurement is not None
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
