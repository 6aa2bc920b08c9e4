"""A pairing with a handle: right formulations are never accused, and what the handle hides is found."""

import numpy as np
import pytest
from handles import Handled

import contactverif_mortar
import contactverif_nts
from contactverif import ContractError, Handle, Pairing, Subject, Verdict, load_properties, load_scene
from contactverif.run.run import run

RIGHT = {"vts-ppt": contactverif_nts.vts_ppt, "nts-lm": contactverif_nts.nts_lm, "mortar": contactverif_mortar.mortar}
PROPERTIES = ["tangent.directional", "tangent.sparsity", "purity", "symmetric", "continuity", "objectivity", "units"]


@pytest.mark.parametrize("name", RIGHT)
def test_a_right_formulation_with_a_handle_is_not_accused(name: str) -> None:
    subject = Subject(name, lambda *, penalty: Handled(penalty=penalty, make=RIGHT[name]))
    result = run([subject], load_properties(PROPERTIES), examples=5, seed=3)
    bad = (Verdict.FAIL, Verdict.CRASHED)
    assert not [(row.property_id, row.reason) for row in result.rows if row.verdict in bad and row.promise is not False]


def test_the_harness_pairs_at_each_state_that_it_asks() -> None:
    case = load_scene("c-prime").case()
    formulation = Subject("handled", Handled).for_case(case)
    plain = Subject("plain", contactverif_nts.vts_ppt).for_case(case)
    assert formulation.pair(case.interface, case.z) is None
    assert formulation.own_pairing(case.interface, case.z).handle == plain.pair(case.interface, case.z)
    moved = case.z + 0.01
    states = np.array([case.z, moved])
    forces = formulation.residual(case.interface, None, states)
    for answer, z in zip(forces, states, strict=True):
        assert np.array_equal(answer, plain.residual(case.interface, plain.pair(case.interface, z), z))


def test_a_pairing_has_one_handle_at_most() -> None:
    pairing = Pairing({"a": np.array([1]), "b": Handle([2])})
    assert (pairing.opaque, pairing.handle, list(pairing)) == (True, [2], ["a"])
    assert repr(pairing) == "Pairing(a(1,), a handle)"
    assert pairing == Pairing({"a": np.array([1]), "b": Handle([3])}), "nobody looks into a handle"
    assert pairing != Pairing({"a": np.array([1])})
    assert Pairing({"a": np.array([1])}).handle is None
    with pytest.raises(ContractError, match="pair: returned 2 handles; needed at most one"):
        Pairing({"a": Handle(1), "b": Handle(2)})


def test_two_passes_take_a_formulation_with_a_handle() -> None:
    case = load_scene("c-prime").case()
    subjects = [
        Subject("two", lambda *, penalty, make=make: contactverif_nts.two_pass(penalty=penalty, inner=make))
        for make in (Handled, contactverif_nts.vts_ppt)
    ]
    handled, plain = (subject.for_case(case) for subject in subjects)
    assert handled.pair(case.interface, case.z) is None
    expected = plain.residual(case.interface, plain.pair(case.interface, case.z), case.z)
    assert np.array_equal(handled.residual(case.interface, None, case.z), expected)
