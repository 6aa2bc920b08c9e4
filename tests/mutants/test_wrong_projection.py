"""Each array of the contact points has a mutant that reports it wrong."""

from dataclasses import fields

import wrong_projection

from contactverif.contract.formulation import ContactPoints

WORDS = {
    "slave_segment": "slave segment",
    "c": "place on the slave",
    "master_segment": "master segment",
    "xi": "ξ",
    "position": "position",
    "normal": "normal",
    "gap": "gap",
    "pressure": "pressure",
    "weight": "weight",
    "active": "activity",
    "area_from": "area reported from",
    "area_to": "of the area reported",
    "weighted": "weighted nodes",
    "on_master": "second pass",
}  # The words for the arrays in the names of mutants.


def test_each_array_has_a_mutant() -> None:
    """The kill matrix says that each of them dies; in the plane there are no shape functions of faces."""
    assert set(WORDS) == {entry.name for entry in fields(ContactPoints)} - {"slave_shape", "master_shape"}
    names = [mutant.name for mutant in wrong_projection.MUTANTS]
    assert all(any(word in name for name in names) for word in WORDS.values())
