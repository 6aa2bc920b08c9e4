"""The contract holds its own rules: a pairing is bounded integers, a promise is data, points of contact are whole."""

from dataclasses import MISSING, FrozenInstanceError, fields
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from contactverif import ContactPoints, ContractError, Evidence, Interface, MisuseError, Pairing
from contactverif.contract.traits import (
    Abilities,
    PatchPromises,
    Promises,
    Rules,
    Traits,
    format_forces,
    parse_forces,
    traits_behind,
)

PAIR = Interface.from_chains([[0, 0], [1, 0]], [[1, 0], [0, 0]])  # eight unknowns


def test_a_pairing_is_a_read_only_mapping() -> None:
    segments = np.array([0, -1, 3])
    pairing = Pairing({"segment": segments, "active": np.array([True, False, True])})
    segments[:] = 7
    assert list(pairing) == ["segment", "active"]
    assert len(pairing) == 2
    assert pairing["segment"].tolist() == [0, -1, 3]
    assert repr(pairing) == "Pairing(segment(3,), active(3,))"
    for values in pairing.values():
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 0
    with pytest.raises(TypeError):
        pairing["segment"] = segments  # type: ignore[index]


def test_a_pairing_keeps_shapes_and_order_of_any_arrays() -> None:
    table = np.arange(12).reshape(3, 4)
    arrays = {
        "columns": table.T,
        "active": table > 5,
        "none": np.zeros((0, 2), np.int64),
        "one": table[2, 3:].reshape(()),
    }
    pairing = Pairing(arrays | {"every second": table.view(np.ma.MaskedArray)[:, ::2]})
    assert list(pairing) == ["columns", "active", "none", "one", "every second"]
    for name, values in arrays.items():
        assert np.array_equal(pairing[name], values)
        assert pairing[name].shape == values.shape
        assert pairing[name].flags.c_contiguous
    assert type(pairing["every second"]) is np.ndarray
    assert pairing["every second"].tolist() == [[0, 2], [4, 6], [8, 10]]


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        ([1, 2], "pair: returned a list; needed a mapping from names to arrays"),
        (None, "pair: returned a NoneType; needed a mapping"),
        ({"xi": np.array([0.5])}, "pair: 'xi' is dtype float64; needed an array of int64 or bool"),
        ({"xi": np.array([0.5j])}, "pair: 'xi' is dtype complex128"),
        ({"segment": np.array([1], dtype=np.int32)}, "pair: 'segment' is dtype int32"),
        ({"segment": np.array([1], dtype=np.uint64)}, "pair: 'segment' is dtype uint64"),
        ({"segment": np.array([0.5], dtype=object)}, "pair: 'segment' is dtype object"),
        ({"segment": [1, 2]}, "pair: 'segment' is a list; needed an array of int64 or bool"),
        ({"segment": 1}, "pair: 'segment' is a int"),
        ({1: np.array([1])}, "pair: the name 1 is a int; needed a string"),
        ({"outer": {"inner": np.array([1])}}, "pair: 'outer' is a dict"),
    ],
)
def test_a_pairing_holds_integers_and_booleans_only(answer: Any, message: str) -> None:
    with pytest.raises(ContractError, match=message):
        Pairing(answer)


@pytest.mark.parametrize("values", [[-1], [8], [], [[0, 1], [2, 64]]])
def test_numbers_within_the_sizes_of_the_problem(values: list[Any]) -> None:
    Pairing({"numbers": np.array(values, dtype=np.int64)}).check_bounds(PAIR)


@pytest.mark.parametrize(
    ("values", "outlier"), [([-2], -2), ([0, 65], 65), ([2**62, 0], 2**62), ([-(2**63), 9], -(2**63))]
)
def test_numbers_that_number_nothing(values: list[int], outlier: int) -> None:
    with pytest.raises(ContractError, match=f"pair: 'numbers' holds {outlier}; needed integers from −1 to 64"):
        Pairing({"numbers": np.array(values), "active": np.array([True])}).check_bounds(PAIR)


def test_entries_of_a_pattern_may_number_more_than_unknowns() -> None:
    Pairing({"rows": np.zeros(90, dtype=np.int64), "entry": np.array([90])}).check_bounds(PAIR)
    with pytest.raises(ContractError, match="needed integers from −1 to 90"):
        Pairing({"rows": np.zeros(90, dtype=np.int64), "entry": np.array([91])}).check_bounds(PAIR)


def test_pairings_are_equal_if_names_shapes_and_values_are() -> None:
    numbers, truths = np.array([1, 2]), np.array([True])
    pairing = Pairing({"a": numbers, "b": truths})
    assert pairing == Pairing({"b": truths, "a": numbers})
    for other in ({"a": numbers + 1, "b": truths}, {"a": numbers[None], "b": truths}, {"a": numbers, "c": truths}, {}):
        assert pairing != Pairing(other)
        assert Pairing(other) != pairing
    assert Pairing({}) == Pairing({})


def test_no_traits_promise_nothing() -> None:
    traits = Traits()
    for name in ("flat", "tangent", "symmetric", "conserves_force", "conserves_moment", "continuity"):
        assert traits.by_name()[name] is None
    assert not traits.abilities.batched
    assert not traits.abilities.takes_complex
    assert not traits.evidence.witnesses
    with pytest.raises(FrozenInstanceError):
        traits.promises = Promises()  # type: ignore[misc]


def points(**changed: Any) -> ContactPoints:
    """Two points of contact, with what is changed."""
    required = [entry.name for entry in fields(ContactPoints) if entry.default_factory is MISSING]
    whole: dict[str, Any] = {name: np.array([0.5, np.nan]) for name in required}
    whole |= {"slave_segment": np.array([0, 0]), "master_segment": np.array([1, -1]), "active": np.array([True, False])}
    whole |= {"position": np.zeros((2, 2)), "normal": np.ones((2, 2))}
    return ContactPoints(**(whole | changed))


def test_contact_points_are_read_only_and_may_be_meaningless() -> None:
    whole = points(c=[0, 1])
    assert whole.c.dtype == np.float64
    assert np.isnan(whole.gap[1])
    assert whole.active.dtype == np.bool_
    with pytest.raises(ValueError, match="read-only"):
        whole.gap[0] = 1


def test_points_lie_on_the_slave_and_are_no_means_unless_they_say_so() -> None:
    assert not points().weighted.any()
    assert not points().on_master.any()
    assert points(weighted=True, on_master=True).weighted.tolist() == [True, True]
    second = points(weighted=np.array([False, True]), on_master=np.array([False, True])).select(np.array([1]))
    assert (second.weighted.tolist(), second.on_master.tolist(), second.c.shape) == ([True], [True], (1,))


def test_points_on_faces_have_shape_functions_and_no_places_on_segments() -> None:
    plane = points()
    names = ("slave_segment", "master_segment", "position", "normal", "gap", "pressure", "weight", "active")
    shapes = {"slave_shape": np.full((2, 3), 1 / 3), "master_shape": np.full((2, 4), 0.25)}
    whole = ContactPoints.on_faces(**{name: getattr(plane, name) for name in names}, **shapes)
    for name in ("c", "xi", "area_from", "area_to"):
        assert np.isnan(getattr(whole, name)).tolist() == [True, True]
    assert whole.select(np.array([1])).master_shape.tolist() == [[0.25] * 4]
    assert plane.slave_shape.shape == plane.master_shape.shape == (2, 0)
    with pytest.raises(MisuseError, match=r"ContactPoints.slave_shape: found shape \(1, 3\); needed \(2, n_corners\)"):
        points(slave_shape=np.ones((1, 3)))


def test_no_contact_points() -> None:
    none: dict[str, Any] = {entry.name: [] for entry in fields(ContactPoints)}
    none |= dict.fromkeys(("position", "normal", "slave_shape", "master_shape"), np.empty((0, 2)))
    assert len(ContactPoints(**none).gap) == 0


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"gap": np.zeros(3)}, r"ContactPoints.gap: found shape \(3,\); needed \(2,\)"),
        ({"gap": np.zeros((2, 1))}, r"ContactPoints.gap: found shape \(2, 1\); needed \(2,\)"),
        ({"normal": np.zeros(2)}, r"ContactPoints.normal: found shape \(2,\); needed \(2, dim\)"),
        ({"slave_segment": np.array([0, 0, 0])}, r"ContactPoints.c: found shape \(2,\); needed \(3,\)"),
        ({"master_segment": np.array([0.7, 1.0])}, "ContactPoints.master_segment: found dtype float64; needed int64"),
        ({"active": np.array([0.3, 1.0])}, "ContactPoints.active: found dtype float64; needed bool"),
        ({"gap": np.array([1j, 0])}, "ContactPoints.gap: found dtype complex128; needed float64"),
        ({"weighted": np.array([True])}, r"ContactPoints.weighted: found shape \(1,\); needed \(2,\)"),
        ({"on_master": 0.0}, "ContactPoints.on_master: found dtype float64; needed bool"),
    ],
)
def test_broken_contact_points(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(MisuseError, match=message):
        points(**changed)


def test_a_formulation_in_space_says_which_faces_it_takes() -> None:
    assert Traits().abilities.faces == (3,)
    assert Abilities(dimensions=(2, 3), faces=(3, 4)).faces == (3, 4)
    with pytest.raises(
        ContractError, match=r"Traits.abilities.faces: found \(4, 3\); needed \(3,\), \(4,\) or \(3, 4\)"
    ):
        Abilities(faces=(4, 3))


def test_a_trait_is_revised_by_its_name_whatever_its_group() -> None:
    traits = Traits(Promises(PatchPromises(flat=True), symmetric=True), Rules(penalty="nodal"))
    revised = traits.revise(flat=False, symmetric=None, area="current", batched=True, source="a paper")
    changes = {"flat": False, "symmetric": None, "area": "current", "batched": True, "source": "a paper"}
    assert revised.by_name() == traits.by_name() | changes
    assert traits.promises.patch.flat
    assert traits.revise() == traits
    with pytest.raises(ContractError, match="Traits: found flatt; needed flat, normal, "):
        traits.revise(flatt=True)
    with pytest.raises(ContractError, match=r"Traits.rules.area: found 'here'; needed one of 'reference', 'current'"):
        traits.revise(area="here")


def test_the_traits_behind_a_statement_are_those_without_which_it_would_be_another() -> None:
    traits = Traits(Promises(PatchPromises(flat=True), symmetric=True), Rules(penalty="nodal", area="current"))
    assert traits_behind(lambda stated: stated.promises.patch.flat, traits) == {"flat": True}
    both = traits_behind(lambda stated: stated.rules.penalty == "nodal" and stated.rules.area is not None, traits)
    assert both == {"penalty": "nodal", "area": "current"}
    assert traits_behind(lambda stated: True, traits) == {}


def test_text_becomes_fractions_and_text_again() -> None:
    slave, master = parse_forces("1 2 1; 5/3 7/3")
    assert (slave, master) == ((1, 2, 1), (Fraction(5, 3), Fraction(7, 3)))
    assert format_forces(slave, master) == "1 2 1; 5/3 7/3"


@pytest.mark.parametrize(
    "text", ["", "1 2 1", "1 2 1;", "1; 2; 3", "one; two", "1/0; 1", "1e10000000; 1", "1e400; 1", None, 3]
)
def test_other_texts_break_the_contract(text: object) -> None:
    with pytest.raises(ContractError, match=r"published_forces: found .*; needed fractions on the slave nodes"):
        Traits(evidence=Evidence(published_forces={"a1": text}))  # type: ignore[dict-item]


def test_a_trait_holds_no_number_that_ends_the_judge() -> None:
    for name in ("activation", "penalty_power"):
        with pytest.raises(
            ContractError, match=rf"Traits.rules.{name}: found 1.7e\+308; needed None or a number above"
        ):
            Rules(**{name: 1.7e308})  # type: ignore[arg-type]
    for error in (0.0, 0.1, float("nan"), True, "exactly"):
        with pytest.raises(ContractError, match=r"Traits.promises.tangent: found .*; needed 'exact', 'approximate', N"):
            Promises(tangent=error)  # type: ignore[arg-type]


def test_a_reach_is_no_less_than_an_eighth_of_a_segment() -> None:
    assert Traits().revise(reach=0.125).abilities.reach == 0.125
    for reach in (0.1, -1.0, float("inf"), float("nan"), "2"):
        with pytest.raises(ContractError, match=r"reach: found .*; needed None or a number of at least 0\.125"):
            Traits().revise(reach=reach)


def test_forces_belong_to_names() -> None:
    with pytest.raises(ContractError, match=r"published_forces: found a str; needed \{name of a flat case: forces\}"):
        Traits(evidence=Evidence(published_forces="1 2 1; 2 2"))  # type: ignore[arg-type]
