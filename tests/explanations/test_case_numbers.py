"""The numbers of a case in the formula of its tolerance: they make the tolerance, or none is claimed."""

from math import isclose, isnan

import numpy as np
import pytest
from subjects import load_property, load_subject

import contactverif
from contactverif import Case, Interface, Property, Quantity
from contactverif.contract.counterexample import Counterexample
from contactverif.contract.property import Measurement, Outcome, PropertyInfo, Verdict
from contactverif.contract.result import Row
from contactverif.explanations.property_text import case_text, put_in, symbol_numbers, symbols_of, value_of
from contactverif.explanations.terms import symbol_meanings

SPELLED = (
    "hard.convex-kink",
    "patch.flat.nodal",
    "patch.flat.transmission",
    "projection.forces",
    "tangent.directional",
)
INTERFACE = Interface.from_chains(slave=[[0, 0], [1, 0]], master=[[2, 0], [-1, 0]])
CASE = Case(INTERFACE, np.array([0, -0.25, 1, -0.25, 2, 0, -1, 0]), parameters={"penetration": np.array(0.25)})


def example(formula: str, tolerance: float) -> Counterexample:
    quantity = Quantity("error", formula, "")
    info = PropertyInfo("mine", "mine", "", (quantity,))
    outcome = Outcome(CASE, Verdict.FAIL, "", Measurement([quantity.check(1.0, tolerance)]))
    return Counterexample("id", Row("wrong", info, Verdict.FAIL, None, shrunk=outcome), outcome)


def test_a_formula_with_numbers_in_place_of_its_symbols_can_be_computed() -> None:
    numbers = {"u": 0.5, "X": 3.0, "g": -4.0, "N": 5.0, "S": 2.0, "ℓ": 0.25}
    for formula, filled, value in (
        ("u(8X/|g| + 4N)", "0.5·(8·3/|-4| + 4·5)", 13.0),
        ("30 (uS/ℓ)^(2/3)", "30·(0.5·2/0.25)^(2/3)", 30 * 4 ** (2 / 3)),
        ("64 uS/ℓ − max(u, ℓ)", "64·0.5·2/0.25 − max(0.5, 0.25)", 255.5),
        ("u(8Z/ℓ)", "0.5·(8·Z/0.25)", None),
    ):
        assert put_in(formula, numbers) == filled
        assert isnan(value_of(filled)) if value is None else value_of(filled) == value


@pytest.mark.parametrize("formula", ["8Z", "2 3", "__import__('os')", "abs.__self__", "1/0", "9^9^9^9", "3 P1", ""])
def test_what_is_no_arithmetic_has_no_value(formula: str) -> None:
    assert isnan(value_of(formula))


def test_words_of_a_formula_are_no_symbols() -> None:
    assert symbols_of("16 (times what rounding the positions relative to their centroid does)") == []
    assert symbols_of("h_m/2R") == symbols_of("1 P0 + facets") == []
    assert symbols_of("64 u (X ε̂ + ΣH/M)/p; with multipliers X/s in place of X") == ["u", "X", "ε̂", "ΣH/M", "p"]


def test_every_symbol_has_a_meaning() -> None:
    assert {"u", "X", "S", "ℓ", "Z", "g", "ε̂", "κ", "ΣH/M", "cond"} <= symbol_meanings().keys()
    assert all(symbol_meanings().values())


def test_numbers_are_claimed_to_make_a_tolerance_only_where_they_do() -> None:
    u = 2.0**-53
    text = case_text(example("u(8X/|g| + 4N)", u * (8 * 2 / 0.25 + 8)), solved=False)
    assert "must be at most u(8X/|g| + 4N) = 1.11e-16·(8·2/|0.25| + 4·2) = 7.99e-15." in text
    text = case_text(example("u(8Z/|g| + 4N)", u * (8 * 3.01 / 0.25 + 8)), solved=False)
    assert "= 1.11e-16·(8·3.01/|0.25| + 4·2) =" in text
    text = case_text(example("u(8X/|g| + 4N)", 1e-9), solved=False)
    assert "must be at most u(8X/|g| + 4N) = 1e-09, where the case has u = 1.11e-16, X = 2, N = 2." in text
    assert "1.11e-16" not in case_text(example("u X", 2 * u), solved=True)
    assert "must be at most 1.9." in case_text(example("1.9", 1.9), solved=False)


def test_the_diagnosis_of_the_report_stands_beside_the_numbers() -> None:
    assert "**Diagnosis:** a factor \\_2\\_." in case_text(example("1", 1.0), "a factor _2_", solved=False)


def test_the_numbers_of_a_case_make_the_tolerances_of_many_properties() -> None:
    questions: list[Property] = [load_property(name) for name in SPELLED]
    rows = contactverif.verify([load_subject("nts-ar")], questions, examples=3, seed=1, keep_going=True).rows
    spelled = {
        row.property_id
        for row in rows
        for outcome in row.outcomes
        if outcome.measurement is not None
        for number in outcome.measurement.numbers
        if isclose(
            value_of(put_in(number.quantity.tolerance, symbol_numbers(outcome.case))), number.tolerance, rel_tol=0.01
        )
    }
    assert spelled >= {row.property_id for row in rows if row.verdict is not Verdict.NOT_APPLICABLE}
    assert len(spelled) >= 4
