"""The constraint rows of multipliers as `unilateral` holds them to the contract, and what `multipliers.rank` counts."""

from typing import Any

import numpy as np
import pytest
from subjects import Changed, judge_as, load_property, load_subject
from textbook_springs import NodalMultipliers

import contactverif_mortar
from contactverif import Subject, Verdict, judge_case, named_case
from contactverif.problems.flat_states import flat_master, flat_state
from contactverif.run.run import run
from contactverif_properties.compressive import check_constraint_rows, lift_slave, unilateral

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
    textbook = Subject("textbook", lambda *, penalty: NodalMultipliers(penalty=penalty))
    result = run([textbook], [load_property(name) for name in ("multipliers.rank", "unilateral")], examples=40, seed=0)
    assert [row.verdict for row in result.rows] == [Verdict.PASS, Verdict.PASS], [row.reason for row in result.rows]


def test_a_row_of_another_size_breaks_the_contract_and_is_told_beside_the_right_one() -> None:
    def make(*, penalty: float) -> Any:
        inner = contactverif_mortar.mortar_lm(penalty=penalty)

        def residual(interface: Any, pairing: Any, z: Any) -> Any:
            answer = np.array(inner.residual(interface, pairing, z))
            answer[..., interface.n_unknowns :] *= penalty
            return answer

        return Changed(inner, residual=residual)

    outcome = judge_case(unilateral, named_case("a1"), Subject("scaled", make))
    assert outcome.breach
    assert "breaks the contract: residual: constraint row 1 is 2 at a gap of -0.0625" in outcome.reason
    assert "c = 16; needed −area · gap = 0.125 with the area 2, since λ − c gap is" in outcome.reason


def test_a_decision_that_is_late_by_a_hair_is_told() -> None:
    def make(*, penalty: float) -> Any:
        inner = contactverif_mortar.mortar_lm(penalty=penalty)

        def pair(interface: Any, z: Any) -> Any:
            n = interface.n_unknowns
            return inner.pair(interface, np.append(z[:n], z[n:] + 1e-6 * np.abs(z[n:]).max()))

        return Changed(inner, pair=pair)

    outcome = judge_as(Verdict.FAIL, unilateral, named_case("b"), Subject("late", make))
    assert outcome.breach
    assert "needed area · λ = -" in outcome.reason


def test_a_slave_that_nothing_holds_has_no_redundant_multipliers() -> None:
    """Both nodes of its only segment lie beside the master, so no constraint is active, and the slave may move."""
    question, subject = load_property("multipliers.rank"), load_subject("nts-lm")
    (row,) = run([subject], [question], examples=40, seed=0).rows
    assert row.verdict is Verdict.PASS
    assert {kind: counts.failed for kind, counts in row.tally.kinds.items()} == {"covered": 0, "overhang": 0}
