"""Several questions at once: one message, the answers of questions one by one, and the first error."""

import numpy as np
import pytest
from isolation import hostile_few

from contactverif import ContractError, MisuseError, load_formulation, named_case
from contactverif.contract.arrays import dense
from contactverif.contract.subject import Call, CheckedFormulation, Subject
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote import load_remote

CASE = named_case("c")
Messages = list[list[tuple[str, float]]]
METHODS = ("residual", "tangent", "residual_and_tangent", "residual")


def calls_of(formulation: CheckedFormulation, z: np.ndarray, *methods: str) -> list[Call]:
    pairing = formulation.pair(CASE.interface, z)
    return [(method, CASE.interface, pairing, z + number * 1e-6) for number, method in enumerate(methods)]


@pytest.mark.parametrize("name", ["vts-ppt", "mortar", "mortar-lm"])
def test_answers_are_those_of_the_questions_one_by_one(name: str, messages: Messages) -> None:
    formulation = load_formulation(name, Limits()).for_case(CASE)
    z = np.append(CASE.z, np.ones(formulation.n_multipliers(CASE.interface)))
    methods = [method for method in METHODS if method == "residual" or method in formulation.provides]
    calls = calls_of(formulation, z, *methods)
    formulation.answers(calls)
    assert all(len(message) <= 1 for message in messages)  # Each first call has its time.
    formulation.residual(*calls[0][1:])
    messages.clear()
    together = formulation.answers(calls)
    assert len(messages) == 1
    one_by_one = [getattr(formulation, method)(*arguments) for method, *arguments in calls]
    for answer, other in zip(together, one_by_one, strict=True):
        parts, others = (each if isinstance(each, tuple) else (each,) for each in (answer, other))
        assert all(np.array_equal(dense(a), dense(b)) for a, b in zip(parts, others, strict=True))


def test_the_first_error_is_raised_and_the_rest_is_forgotten(messages: Messages) -> None:
    subject = load_remote(hostile_few.PROGRAM, "NoNumberTangent", Limits())
    assert isinstance(subject, Subject)
    formulation = subject.for_case(CASE)
    calls = calls_of(formulation, CASE.z, "residual", "tangent", "residual")
    with pytest.raises(ContractError, match="tangent: nan"):
        formulation.answers(calls)
    messages.clear()
    assert np.array_equal(formulation.residual(*calls[0][1:]), formulation.answers(calls[:1])[0])
    assert [[verb for verb, _ in message] for message in messages] == [["residual"], ["residual"]]


def test_a_method_that_it_does_not_have_is_made_of_two(messages: Messages) -> None:
    formulation = load_formulation("mortar-lm", Limits()).for_case(CASE)
    assert "residual_and_tangent" not in formulation.provides
    z = np.append(CASE.z, np.ones(formulation.n_multipliers(CASE.interface)))
    calls = calls_of(formulation, z, "residual_and_tangent", "residual")
    (residual, tangent), other = formulation.answers(calls)
    assert residual.shape == other.shape == z.shape
    assert tangent.shape == (z.size, z.size)
    assert {verb for message in messages for verb, _ in message} >= {"residual", "tangent"}


def test_a_state_of_another_length_is_a_mistake_of_whoever_asks() -> None:
    formulation = load_formulation("nts", Limits()).for_case(CASE)
    with pytest.raises(MisuseError):
        formulation.answers([("residual", CASE.interface, None, CASE.z[:-1])])
