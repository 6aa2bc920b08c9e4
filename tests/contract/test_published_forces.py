"""Forces that a formulation states of itself, as text."""

from fractions import Fraction

import pytest

from contactverif import ContractError, Evidence, Traits
from contactverif.contract.traits import format_forces, parse_forces


def test_text_becomes_fractions_and_text_again() -> None:
    slave, master = parse_forces("1 2 1; 5/3 7/3")
    assert (slave, master) == ((1, 2, 1), (Fraction(5, 3), Fraction(7, 3)))
    assert format_forces(slave, master) == "1 2 1; 5/3 7/3"


@pytest.mark.parametrize("text", ["", "1 2 1", "1 2 1;", "1; 2; 3", "one; two", "1/0; 1", None, 3])
def test_other_texts_break_the_contract(text: object) -> None:
    with pytest.raises(ContractError, match=r"published_forces: found .*; needed fractions on the slave nodes"):
        Traits(evidence=Evidence(published_forces={"a1": text}))  # type: ignore[dict-item]


def test_forces_belong_to_names() -> None:
    with pytest.raises(ContractError, match=r"published_forces: found a str; needed \{name of a flat case: forces\}"):
        Traits(evidence=Evidence(published_forces="1 2 1; 2 2"))  # type: ignore[arg-type]
