"""Whatever a plugin answers, what comes over the counter is checked or an error that says what was wrong."""

import re
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from contactverif import Case, CheckedFormulation, ContactPoints, Interface, Pairing, Subject, evaluate_both, named_case
from contactverif.contract.arrays import dense
from contactverif.contract.errors import ContractError, MisuseError, NonFiniteError, PluginError
from contactverif.contract.traits import Abilities, Promises, Rules, Traits
from contactverif.plugins.registry import load_formulation

PAIR = Interface.from_chains([[0, 0], [1, 0], [4, 0]], [[4, 0], [-2, 0]])
Z = PAIR.nodes.reshape(-1)
CASE = Case(PAIR, Z, penalty=10.0)
SQUARE = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
BATCH = np.stack([Z, Z + 1, 2 * Z, Z - 1, Z, 3 * Z]).reshape(2, 3, -1)


class Springs:
    """A correct plugin with every part: each unknown is a spring to the origin. Parts are replaced to break it."""

    def __init__(self, penalty: float, **parts: Any) -> None:
        self.penalty = penalty
        self.traits = Traits(promises=Promises(tangent="exact"))
        for name, part in parts.items():
            setattr(self, name, part)

    def pair(self, interface: Interface, z: Any) -> Any:
        return {"active": z > 0}

    def residual(self, interface: Interface, pairing: Pairing, z: Any) -> Any:
        return self.penalty * z

    def tangent(self, interface: Interface, pairing: Pairing, z: Any) -> Any:
        return sparse.csr_array(self.penalty * np.eye(z.size))

    def contact_points(self, interface: Interface, pairing: Pairing, z: Any) -> Any:
        zero, places = np.zeros(1), np.zeros((1, 2))
        none = np.zeros(1, dtype=np.int64)
        return ContactPoints(none, zero, none, zero, places, places, zero, zero, zero, zero > 0, zero, zero)


def subject(**parts: Any) -> Subject:
    return Subject("springs", lambda *, penalty: Springs(penalty, **parts))


def answer_to(verb: str, **parts: Any) -> Any:
    """Return the checked answer to the verb by springs with some parts replaced."""
    guarded = subject(**parts).for_case(CASE)
    pairing = guarded.pair(PAIR, Z)
    return pairing if verb == "pair" else getattr(guarded, verb)(PAIR, pairing, Z)


def always(answer: Any) -> Callable[..., Any]:
    return lambda *_: answer


def raising(*_: Any, **__: Any) -> Any:
    raise ZeroDivisionError("by nothing")


def test_a_correct_plugin() -> None:
    springs = subject()
    assert springs.provides == {"pair", "tangent", "contact_points"}
    assert springs.traits.promises.tangent == "exact"
    pairing = answer_to("pair")
    assert isinstance(pairing, Pairing)
    assert pairing["active"].sum() == (Z > 0).sum()
    assert answer_to("residual").tolist() == (10 * Z).tolist()
    assert answer_to("tangent").toarray().tolist() == (10 * np.eye(10)).tolist()
    assert answer_to("contact_points").gap.tolist() == [0]


def test_the_penalty_in_the_kind_of_the_formulation() -> None:
    assert subject().penalty(CASE) == 10
    assert subject(traits=Traits(rules=Rules(penalty="distributed"))).penalty(CASE) == 10
    nodal = subject(traits=Traits(rules=Rules(penalty="nodal")))
    assert nodal.penalty(CASE) == 20  # mean slave segment: 2
    faces = Interface.from_faces(SQUARE, [[0, 2, 1], [0, 3, 2]], SQUARE - [0, 0, 1], [[0, 1, 2, 3]])
    in_space = Case(faces, faces.nodes.reshape(-1), penalty=8.0)
    assert nodal.penalty(in_space) == pytest.approx(8.0 * 2 / 4)  # the area over the number of slave nodes
    assert subject().with_penalty(7).residual(PAIR, None, Z).tolist() == (7 * Z).tolist()


def test_a_residual_alone_is_a_plugin() -> None:
    def residual(interface: Interface, pairing: None, z: Any) -> Any:
        assert pairing is None
        return -z

    least = Subject("least", lambda *, penalty: SimpleNamespace(residual=residual))
    assert least.provides == frozenset()
    assert least.traits == Traits()
    guarded = least.for_case(CASE)
    assert guarded.pair(PAIR, Z) is None
    assert guarded.residual(PAIR, None, Z).tolist() == (-Z).tolist()


def test_a_part_that_is_none_is_not_provided() -> None:
    assert subject(tangent=None, pair=None).provides == {"contact_points"}


@pytest.mark.parametrize("dtype", [np.float64, np.complex128])
def test_a_batch_equals_a_loop(dtype: type) -> None:
    states = BATCH.astype(dtype)
    dimensions: list[int] = []

    def residual(_: Interface, __: Pairing, z: Any) -> Any:
        dimensions.append(z.ndim)
        return z * np.roll(z, 1, axis=-1)

    answers = {}
    for batched in (False, True):
        guarded = subject(residual=residual, traits=Traits(abilities=Abilities(batched=batched))).for_case(CASE)
        answers[batched] = guarded.residual(PAIR, guarded.pair(PAIR, Z), states)
    assert dimensions == [1] * 6 + [3]
    assert answers[True].shape == states.shape
    assert answers[True].dtype == dtype
    assert np.array_equal(answers[True], answers[False])


VERBS = ["pair", "residual", "tangent", "residual_and_tangent", "contact_points"]


@pytest.mark.parametrize("verb", VERBS)
def test_a_plugin_that_raises(verb: str) -> None:
    message = rf"^{verb}: ZeroDivisionError: by nothing \(test_subject\.py, line \d+\)$"
    with pytest.raises(PluginError, match=message) as caught:
        answer_to(verb, **{verb: raising})
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


@pytest.mark.parametrize("verb", VERBS)
def test_a_plugin_that_writes_to_its_input(verb: str) -> None:
    def writing(interface: Interface, *more: Any) -> Any:
        more[-1][0] = 1.0

    with pytest.raises(PluginError, match=f"^{verb}: ValueError: assignment destination is read-only"):
        answer_to(verb, **{verb: writing})
    z = Z.copy()
    with pytest.raises(PluginError):
        subject(residual=writing).for_case(CASE).residual(PAIR, None, z)
    assert np.array_equal(z, Z)


def test_a_plugin_that_writes_to_the_interface_or_the_pairing() -> None:
    def writing(target: Callable[..., Any]) -> Callable[..., Any]:
        def residual(*arguments: Any) -> Any:
            target(*arguments)[...] = 0
            return arguments[-1]

        return residual

    for target in (lambda i, p, z: i.nodes, lambda i, p, z: i.slave.segments, lambda i, p, z: p["active"]):
        with pytest.raises(PluginError, match="read-only"):
            answer_to("residual", residual=writing(target))


def test_a_plugin_that_changes_how_numpy_treats_errors_changes_it_for_itself_alone() -> None:
    def residual(interface: Any, pairing: Any, z: Any) -> Any:
        np.seterr(all="raise")
        return z

    before = np.geterr()
    answer_to("residual", residual=residual)
    assert np.geterr() == before


def broken_compressed(format_: str, **arrays: Any) -> Any:
    """Return a unit matrix of which some arrays were replaced behind scipy's back."""
    matrix = sparse.eye_array(10).asformat(format_)
    for name, values in arrays.items():
        setattr(matrix, name, np.array(values))
    return matrix


MOST = 2**31 - 1
OUT_OF_RANGE = broken_compressed("csr", indices=[*range(9), 10])
NAN, INF = np.where(np.arange(10) == 3, np.nan, Z), np.where(np.arange(10) < 2, -np.inf, Z)


# {(verb, error): [(answer, message), …]}
WRONG_ANSWERS: dict[tuple[str, type[ContractError]], list[tuple[Any, str]]] = {
    ("residual", ContractError): [
        (Z.tolist(), r"residual: returned a list; needed an array of shape \(10,\)"),
        (None, "residual: returned a NoneType"),
        (Z[:9], r"residual: returned shape \(9,\); needed \(10,\), that of z"),
        (Z.reshape(5, 2), r"residual: returned shape \(5, 2\)"),
        (Z.astype(np.float32), "residual: returned dtype float32; needed float64, that of z"),
        (Z.astype(complex), "residual: returned dtype complex128; needed float64"),
        (Z.astype(int), "residual: returned dtype int64"),
    ],
    ("residual", NonFiniteError): [
        (NAN, "residual: nan in 1 of 10 entries"),
        (INF, "residual: -inf in 2 of 10 entries"),
    ],
    ("tangent", ContractError): [
        (np.eye(10).tolist(), "tangent: returned a list; needed an array or scipy.sparse"),
        (np.eye(9), r"tangent: returned shape \(9, 9\); needed \(10, 10\)"),
        (np.eye(10, dtype=np.float32), "tangent: returned dtype float32; needed float64"),
        (OUT_OF_RANGE, "tangent: returned a broken csr matrix: .*ind(ices|ex values) must be < 10"),
        (broken_compressed("csc", indices=[-1, *range(9)]), "broken csc matrix: .*ind(ices|ex values) must"),
        (broken_compressed("csr", indptr=range(10)), "broken csr matrix: index pointer size"),
        (broken_compressed("csr", indptr=[0, 2, *range(1, 9), 10]), "non-decreasing"),
        (
            broken_compressed("csr", indptr=np.array([0, MOST, -MOST - 1, -1, *range(4, 11)], np.int32)),
            "non-decreasing",
        ),
        (broken_compressed("coo", coords=([0, 12], [1, 1]), data=[1.0, 1.0]), "broken coo matrix: axis 0 index 12 exc"),
    ],
    ("tangent", NonFiniteError): [
        (np.diag(NAN), "tangent: nan in 1 of 100 entries"),
        (sparse.csr_array(np.diag(INF)), "tangent: -inf in 2 of "),
        (sparse.coo_matrix(np.diag(NAN)), "tangent: nan in 1 of "),
    ],
    ("residual_and_tangent", ContractError): [
        (Z, r"residual_and_tangent: returned a ndarray; needed a tuple \(residual, tangent\)"),
        ((Z,), "residual_and_tangent: returned a tuple of 1; needed"),
        ((Z[:9], np.eye(10)), r"residual_and_tangent\[0\]: returned shape \(9,\); needed \(10,\), that of z"),
        ((Z.astype(complex), np.eye(10)), "returned dtype complex128"),
        ((Z, np.eye(9)), r"residual_and_tangent\[1\]: returned shape \(9, 9\); needed \(10, 10\)"),
        ((Z, np.eye(10, dtype=int)), "returned dtype int64; needed float64"),
        (
            (Z, OUT_OF_RANGE),
            r"residual_and_tangent\[1\]: returned a broken csr matrix: .*ind(ices|ex values) must be <",
        ),
    ],
    ("residual_and_tangent", NonFiniteError): [
        ((NAN, np.eye(10)), r"residual_and_tangent\[0\]: nan in 1 of 10"),
        ((Z, np.diag(INF)), r"residual_and_tangent\[1\]: -inf in 2 of 100"),
    ],
    ("contact_points", ContractError): [
        ({}, "contact_points: returned a dict; needed ContactPoints"),
        (None, "contact_points: returned a NoneType"),
    ],
    ("pair", ContractError): [
        (None, "pair: returned a NoneType; needed a mapping"),
        ({"xi": np.zeros(3)}, "pair: 'xi' is dtype float64"),
        ({"segment": np.array([101])}, "pair: 'segment' holds 101; needed integers from −1 to 100"),
        (Pairing({"segment": np.array([-2])}), "pair: 'segment' holds -2"),
    ],
}


@pytest.mark.parametrize(
    ("verb", "error", "answer", "message"), [(*key, *row) for key, rows in WRONG_ANSWERS.items() for row in rows]
)
def test_a_wrong_answer(verb: str, error: type[ContractError], answer: Any, message: str) -> None:
    with pytest.raises(error, match=message):
        answer_to(verb, **{verb: always(answer)})


def test_both_in_one_call_where_the_plugin_offers_it() -> None:
    def both(interface: Interface, pairing: Pairing, z: Any) -> Any:
        calls.append(z.shape)
        return 3 * z, 3 * np.eye(z.size)

    calls: list[Any] = []
    with_it, without = subject(residual_and_tangent=both), subject()
    assert with_it.provides == without.provides | {"residual_and_tangent"}
    for springs, stiffness in ((with_it, 3), (without, 10)):
        for formulation in (springs.for_case(CASE), springs.for_case(CASE).plugin):
            residual, tangent = evaluate_both(formulation, PAIR, None, Z)
            assert residual.tolist() == (stiffness * Z).tolist()
            assert dense(tangent).tolist() == (stiffness * np.eye(10)).tolist()
    assert calls == [(10,), (10,)]
    with pytest.raises(ContractError, match=r"^residual_and_tangent: the plugin has no `tangent`; needed both$"):
        subject(residual_and_tangent=both, tangent=None)


def test_one_bad_state_of_a_batch() -> None:
    def residual(_: Interface, __: Pairing, z: Any) -> Any:
        return np.where(z > 11, np.nan, z)

    for batched in (False, True):
        guarded = subject(residual=residual, traits=Traits(abilities=Abilities(batched=batched))).for_case(CASE)
        with pytest.raises(NonFiniteError, match="residual: nan in 2 of "):
            guarded.residual(PAIR, None, BATCH)


def springs_with(**parts: Any) -> Callable[..., Any]:
    return lambda *, penalty: Springs(penalty, **parts)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (raising, PluginError, "make: ZeroDivisionError: by nothing"),
        (lambda: Springs(1.0), ContractError, r"make: found <lambda>\(\) \(.*\); needed <lambda>\(\*, penalty\)"),
        (
            lambda *, penalty: SimpleNamespace(residuals=0),
            ContractError,
            "without a `residual`; the nearest name is `residuals`",
        ),
        (lambda *, penalty: None, ContractError, "make: returned a NoneType without a `residual`"),
        (springs_with(residual=Z), ContractError, "make: returned a Springs without a `residual`"),
        (springs_with(traits={"tangent": "exact"}), ContractError, "traits: found a dict; needed"),
        (springs_with(traits=None), ContractError, "traits: found a NoneType; needed"),
    ],
)
def test_a_wrong_factory(make: Callable[..., Any], error: type[ContractError], message: str) -> None:
    with pytest.raises(error, match=message):
        Subject("wrong", make)


def test_a_factory_that_fails_for_the_penalty_of_the_case() -> None:
    def make(*, penalty: float) -> Springs:
        if penalty > 1:
            raise ValueError("too stiff")
        return Springs(penalty)

    assert isinstance(Subject("soft", make).with_penalty(1.0), CheckedFormulation)
    with pytest.raises(PluginError, match="make: ValueError: too stiff"):
        Subject("soft", make).for_case(CASE)


@pytest.mark.parametrize(
    ("enforcement", "count", "message"),
    [
        ("penalty", 3, "3 of them, with the trait enforcement 'penalty'; needed \"multiplier\""),
        ("multiplier", 0, "0 of them, with the trait enforcement 'multiplier'; needed n_multipliers"),
        ("multiplier", -1, "returned -1; needed an integer ≥ 0"),
        ("multiplier", 1.0, "returned 1.0; needed an integer ≥ 0"),
        ("multiplier", True, "returned True; needed an integer ≥ 0"),
    ],
)
def test_multipliers_and_the_trait_go_together(enforcement: Any, count: Any, message: str) -> None:
    counting = subject(traits=Traits(rules=Rules(enforcement=enforcement)), n_multipliers=always(count))
    with pytest.raises(ContractError, match=re.escape(message)):
        counting.with_penalty(1.0).n_multipliers(PAIR)


def test_multipliers_are_counted_once_an_interface() -> None:
    counts = iter((1, 2, 3))
    restless = subject(
        traits=Traits(rules=Rules(enforcement="multiplier")), n_multipliers=lambda interface: next(counts)
    )
    guarded = restless.with_penalty(1.0)
    assert [guarded.n_multipliers(PAIR) for _ in range(3)] == [1, 1, 1]
    assert guarded.n_multipliers(PAIR.swap_roles()) == 2


def test_a_state_of_the_wrong_size_never_reaches_a_plugin() -> None:
    """With multipliers left out, nts-lm would answer as nts does."""
    case, formulation = named_case("c"), load_formulation("nts-lm")
    assert isinstance(formulation, Subject)
    guarded = formulation.for_case(case)
    state = case.interface, None, case.z
    for ask, arguments in [(guarded.pair, state[::2]), *((getattr(guarded, verb), state) for verb in VERBS[1:])]:
        with pytest.raises(MisuseError, match=r"z: found shape \(20,\); needed \(\.\.\., 25\), 20 positions and 5 m"):
            ask(*arguments)
