"""`unilateral` and `nodal-push`, and the constraint rows of multipliers."""

from typing import Any

import numpy as np
import pytest
from subjects import judge_as, load_property, load_subject, with_verbs
from textbook_springs import NodalMultipliers

from contactverif import Case, Interface, Pairing, Subject, Verdict, judge_case, load_properties, named_case
from contactverif.contract.result import OPPOSITE_SIGN
from contactverif.contract.traits import Rules, Traits
from contactverif.problems.flat_states import Turn, flat_master, flat_state
from contactverif.run.run import run
from contactverif_mortar import mortar, mortar_lm
from contactverif_properties.compressive import (
    allowed_pushes,
    check_constraint_rows,
    lift_slave,
    nodal_push,
    unilateral,
)
from contactverif_properties.states import FrozenState


class Springs:
    """A spring at each slave node of a horizontal interface, across to the node of the master below it."""

    traits = Traits(rules=Rules(penalty="distributed"))

    def __init__(self, *, penalty: float, at: float = 0.0, closed: bool = True) -> None:
        self.penalty, self.at, self.closed = penalty, at, closed

    def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
        forces = np.zeros_like(z)
        gap = z[1] - z[2 * interface.n_slave_nodes + 1]
        if gap < self.at and self.closed:
            forces[1] = self.penalty * (gap - self.at)
        return forces


def verdict(case: Case, **options: Any) -> tuple[Verdict, str]:
    outcome = judge_case(unilateral, case, Subject("springs", lambda *, penalty: Springs(penalty=penalty, **options)))
    return outcome.verdict, outcome.reason


def test_springs_that_push_and_never_pull() -> None:
    case = named_case("a1")
    assert lift_slave(case, 0.25).positions[0, 1] == case.positions[0, 1] + 0.25
    assert verdict(case)[0] is Verdict.PASS
    depth = case.parameter("penetration")
    outcome, reason = verdict(case, at=1.01 * depth)
    assert outcome is Verdict.FAIL
    assert f"lifted to a gap of {depth:.4g}, slave node 0 (free end): force " in reason
    assert verdict(case, at=0.99 * depth)[0] is Verdict.PASS
    outcome, reason = verdict(case, closed=False)
    assert outcome is Verdict.FAIL
    assert "nothing begins" in reason


@pytest.mark.parametrize("turn", [(1, 0, 1), (0, 1, 1), (-1, 0, 1)])
def test_nodes_a_rounding_beyond_free_ends_are_undecided(turn: Turn) -> None:
    """A segment longer than the one below it by the last bit of a coordinate: without τ no node is over that one."""
    last_bit = float(np.spacing(1.0))
    over, beyond = (
        flat_state("", [-excess, 1 + excess], flat_master([0, 1]), depth=0.25, turn=turn) for excess in (last_bit, 0.5)
    )
    without_tau = load_subject("nts:tau=0")
    outcome = judge_as(Verdict.UNDECIDED, unilateral, over, without_tau)
    assert outcome.reason == "a kink: moved by roundoff, it begins one way and not another"
    assert judge_case(unilateral, over, load_subject("nts")).verdict is Verdict.PASS
    assert judge_case(unilateral, beyond, without_tau).verdict is Verdict.FAIL


class Augmented:
    """A mortar whose pressure is λ_j − ε̂ G_j: multipliers beside springs, as in an augmented Lagrangian."""

    traits = mortar_lm(penalty=1.0).traits.revise(tangent=None)

    def __init__(self, *, penalty: float) -> None:
        self.multipliers, self.springs = mortar_lm(penalty=penalty), mortar(penalty=penalty)
        self.n_multipliers, self.pair = self.multipliers.n_multipliers, self.multipliers.pair

    def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
        answer = self.multipliers.residual(interface, pairing, z)
        n = interface.n_unknowns
        answer[..., :n] += self.springs.residual(interface, pairing, np.ascontiguousarray(z[..., :n]))
        return answer


def test_springs_beside_multipliers_are_not_accused() -> None:
    """A unit multiplier is lost in roundoff beside them; one of their size is not."""
    questions = load_properties(["patch.flat.resultant", "patch.flat.solve", "patch.flat.transmission", "unilateral"])
    result = run([Subject("augmented", Augmented)], questions, examples=60, seed=0)
    assert {row.property_id: row.verdict for row in result.rows} == dict.fromkeys(
        ["patch.flat.resultant", "patch.flat.solve", "patch.flat.transmission", "unilateral"], Verdict.PASS
    )


class Ungated(Augmented):
    """All multipliers give their forces, also those below zero, which the idle rows take away."""

    def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
        rows = self.multipliers.residual(interface, pairing, z)
        everybody = Pairing({**pairing, "active": np.ones_like(pairing["active"])})
        n = interface.n_unknowns
        return np.concatenate([self.multipliers.residual(interface, everybody, z)[..., :n], rows[..., n:]], axis=-1)


def test_multipliers_that_are_not_gated_are_not_accused() -> None:
    result = run([Subject("ungated", Ungated)], load_properties(["complementarity", "unilateral"]), examples=60, seed=0)
    assert [row.verdict for row in result.rows] == [Verdict.PASS, Verdict.PASS], [row.reason for row in result.rows]


class Pulling(Springs):
    """Springs on the same nodes that pull where they should push."""

    def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
        return -super().residual(interface, pairing, z)


def test_a_slave_that_is_pulled_as_a_whole_is_told_so_in_words() -> None:
    outcome = judge_case(unilateral, named_case("a1"), Subject("pulling", Pulling))
    assert (outcome.verdict, outcome.reason) == (Verdict.FAIL, OPPOSITE_SIGN)


class OneSegment(Springs):
    """Both nodes of a slave segment are held as soon as one of them penetrates."""

    def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
        forces, x = np.zeros_like(z), z.reshape(-1, 2)
        gap = x[: interface.n_slave_nodes, 1] - x[-1, 1]
        for segment in interface.slave.segments:
            if gap[segment].min() < 0:
                forces.reshape(-1, 2)[segment, 1] += self.penalty * gap[segment]
        return forces


def test_single_nodes_are_judged_where_that_is_promised_and_told_elsewhere() -> None:
    """A dual mortar method of a stranger, which says nothing, is not accused of what its shapes do."""
    case = named_case("c")
    springs = Subject("one segment", OneSegment)
    assert judge_case(unilateral, case, springs).verdict is Verdict.PASS
    outcome = judge_as(Verdict.UNDECIDED, nodal_push, case, springs)
    assert outcome.reason == "a foot may lie outside its segment; provide contact_points, and this can be judged"
    assert nodal_push.promise(springs.traits) is None
    assert judge_case(nodal_push, case, Subject("right", Springs)).verdict is Verdict.PASS


def test_a_master_node_may_be_pulled_by_as_much_as_a_foot_lies_past_its_segment() -> None:
    """Eq. 6 with the foot at ξ = −0.005: a lever, whose longer end is pushed by more than the whole."""
    slave, master = [[0.0, 0.0], [1.0, 0.0]], [[2.0, 0.0], [0.005, 0.0]]
    interface = Interface.from_chains(slave, master)
    z = np.array([0.0, -0.1, 1.0, -0.1, 2.0, 0.0, 0.005, 0.0])
    case = Case(interface, z, 1.0)
    subject = load_subject("nts")
    state = FrozenState.at(subject.for_case(case), case)
    _, allowance = allowed_pushes(state)
    assert allowance[2] == pytest.approx(0.005 / 1.995 * 0.1, rel=1e-9)
    assert -state.forces[2, 1] < 0  # The other node carries the slave's second node too.
    assert judge_case(nodal_push, case, subject).verdict is Verdict.PASS


SLAVE = [[0.446875, -0.875], [1.446875, -0.375]]
CORNER = Interface.from_chains(SLAVE, [[1.005, 0.0], [1.0025, -0.5], [0.0025, -0.5], [0.0, 0.0]])
STRAIGHT = Interface.from_chains([[0.0, -0.25], [1.0, -0.25]], [[1.5, 0.0], [0.5, 0.0], [-0.5, 0.0]])


VALLEY = Interface.from_chains([[-0.05, -0.2], [0.05, -0.2]], [[1.0, 0.5], [0.0, 0.0], [-1.0, 0.5]])


def pull(node: int, sign: float) -> Subject:
    """Return VTS-PPT with forces times a sign, but for one node, which is pulled."""

    def residual(right: Any, *state: Any) -> Any:
        forces = np.array(right(*state))
        forces[..., 2 * node + 1] -= 2 * np.abs(forces).max()
        return sign * forces

    return with_verbs("vts-ppt", residual=residual)


def without_points(right: str | Subject) -> Subject:
    return with_verbs(right, contact_points=None)


# Eq. 6 leaves ξ unclipped: the foot of a part may be past the neighbour of its point's segment by its whole length. In
# the valley both slave nodes are nearest to the vertex, and so lever the outer nodes of the master up.
PUSHES: list[tuple[Subject, Interface, Verdict]] = [
    *((load_subject(name), CORNER, Verdict.PASS) for name in ("sts", "mortar", "nts-ar", "vts-me")),
    (load_subject("vts-ppt"), CORNER, Verdict.UNDECIDED),
    (pull(0, -1.0), CORNER, Verdict.FAIL),
    (load_subject("vts-ppt"), STRAIGHT, Verdict.PASS),
    (pull(3, 1.0), STRAIGHT, Verdict.FAIL),
    (without_points(pull(0, -1.0)), STRAIGHT, Verdict.FAIL),
    *((load_subject(name), VALLEY, Verdict.PASS) for name in ("nts-ar", "nts", "two-pass/nts-ar")),
    *((without_points(name), VALLEY, Verdict.UNDECIDED) for name in ("nts-ar", "nts", "two-pass/nts-ar")),
]


@pytest.mark.parametrize(("subject", "interface", "verdict"), PUSHES)
def test_a_node_that_is_pulled_is_found_and_a_foot_past_an_end_is_not_accused(
    subject: Subject, interface: Interface, verdict: Verdict
) -> None:
    judge_as(verdict, nodal_push, Case(interface, interface.nodes.reshape(-1)), subject)


PRESSURES = ("mortar-lm:normals=averaged", "two-pass/vts-me-lm", "two-pass/mortar-dual-lm", "vts-ppt-lm:n=1")


def largest_error(name: str, case: Any) -> float:
    subject = load_subject(name)
    lifted = lift_slave(case, 2 * case.parameter("penetration"))
    return check_constraint_rows(subject.for_case(case), case, lifted, subject.traits.rules, subject.penalty(case))


@pytest.mark.parametrize("name", ["nts-lm", "vts-me-lm:n=3,area=reference", "vts-ppt-lm", "mortar-lm", *PRESSURES])
@pytest.mark.parametrize("case", ["a1", "b", "c-prime-swapped"])
def test_rows_are_those_of_the_contract(name: str, case: str) -> None:
    assert largest_error(name, named_case(case)) < 0.5


def test_a_node_that_loses_a_free_end_as_the_slave_is_lifted_is_not_accused() -> None:
    last_bit = float(np.spacing(1.0))
    master = flat_master([0, 1])
    for excess in np.arange(-4, 5) * last_bit:
        for turn in ((1, 0, 1), (3, 4, 5), (5, 12, 13)):
            case = flat_state("", [-excess, 1 + excess], master, depth=0.25, turn=turn)
            assert largest_error("nts-lm:tau=0", case) < 0.5


def test_the_multipliers_of_a_textbook_are_not_accused() -> None:
    textbook = Subject("textbook", NodalMultipliers)
    result = run([textbook], [load_property(name) for name in ("multipliers.rank", "unilateral")], examples=40, seed=0)
    assert [row.verdict for row in result.rows] == [Verdict.PASS, Verdict.PASS], [row.reason for row in result.rows]


def test_a_row_of_another_size_breaks_the_contract_and_is_told_beside_the_right_one() -> None:
    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        answer = np.array(right(interface, pairing, z))
        answer[..., interface.n_unknowns :] *= right.__self__.penalty
        return answer

    outcome = judge_case(unilateral, named_case("a1"), with_verbs("mortar-lm", residual=residual))
    assert outcome.breach
    assert "breaks the contract: residual: constraint row 1 is 2 at a gap of -0.0625" in outcome.reason
    assert "c = 16; needed −area · gap = 0.125 with the area 2, since λ − c gap is" in outcome.reason


def test_a_decision_that_is_late_by_a_hair_is_told() -> None:
    def pair(right: Any, interface: Any, z: Any) -> Any:
        n = interface.n_unknowns
        return right(interface, np.append(z[:n], z[n:] + 1e-6 * np.abs(z[n:]).max()))

    outcome = judge_as(Verdict.FAIL, unilateral, named_case("b"), with_verbs("mortar-lm", pair=pair))
    assert outcome.breach
    assert "needed area · λ = -" in outcome.reason


def test_a_slave_that_nothing_holds_has_no_redundant_multipliers() -> None:
    """Both nodes of its only segment lie beside the master, so no constraint is active, and the slave may move."""
    question, subject = load_property("multipliers.rank"), load_subject("nts-lm")
    (row,) = run([subject], [question], examples=40, seed=0).rows
    assert row.verdict is Verdict.PASS
    assert {kind: counts.failed for kind, counts in row.tally.kinds.items()} == {"covered": 0, "overhang": 0}
