"""Formulations and properties by name for tests, and formulations whose promises or verbs a test changes."""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

from contactverif import Case, Outcome, Property, Subject, Verdict, judge_case, load_formulation, load_properties
from contactverif.contract.property import Measurement
from contactverif.plugins.registry import standalone_names


@cache
def load_subject(name: str) -> Subject:
    """Return the installed formulation of that name, options included; fail if it cannot be loaded."""
    subject = load_formulation(name)
    assert isinstance(subject, Subject), subject
    return subject


@cache
def plane_names() -> tuple[str, ...]:
    """Return the names of the installed formulations that take plane interfaces."""
    return tuple(name for name in standalone_names() if load_subject(name).traits.abilities.in_plane)


@cache
def load_property(property_id: str) -> Property:
    """Return the installed property of that id; fail if it cannot be loaded."""
    (question,) = load_properties([property_id])
    assert isinstance(question, Property), question
    return question


def measure_case(question: Property, case: Case, subject: Subject) -> Measurement:
    """Judge a case, and return what was measured; fail if there is nothing."""
    outcome = judge_case(question, case, subject)
    assert outcome.measurement is not None, outcome.reason
    return outcome.measurement


def same_case(case: Case, other: Case) -> bool:
    """Return whether two cases agree in every array, bit by bit."""
    arrays, others = (
        {name: (array.dtype, array.shape, array.tobytes()) for name, array in each.to_arrays().items()}
        for each in (case, other)
    )
    return list(arrays.items()) == list(others.items())


def judge_as(verdict: Verdict, question: Property, case: Case, subject: Subject) -> Outcome:
    """Judge a case; fail if the verdict is another one."""
    outcome = judge_case(question, case, subject)
    assert outcome.verdict is verdict, outcome.reason
    return outcome


class Changed:
    """A formulation in which some attributes are replaced, such as `tangent` or `traits`; the others are its own.

    Where residual or tangent are replaced, the formulation does not compute them in one call: those would be the old.
    """

    def __init__(self, inner: Any, **attributes: Any) -> None:
        self.inner = inner
        if attributes.keys() & {"residual", "tangent"}:
            self.residual_and_tangent = None
        self.__dict__ |= attributes

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)


def change_verbs(inner: Any, **changes: Callable[..., Any]) -> Changed:
    """Return a formulation of which some verbs are answered by `change(right, *arguments)`; `right` is its own verb."""
    return Changed(inner, **{verb: partial(change, getattr(inner, verb)) for verb, change in changes.items()})


def with_verbs(right: str | Subject | Callable[..., Any], **changes: Callable[..., Any] | None) -> Subject:
    """Return a formulation, its factory or its name, with verbs as `change_verbs` makes them, or without one (None)."""
    subject = load_subject(right) if isinstance(right, str) else right
    make = subject._make if isinstance(subject, Subject) else subject
    missing = {verb: None for verb, change in changes.items() if change is None}
    others = {verb: change for verb, change in changes.items() if change is not None}

    def make_changed(*, penalty: float) -> Changed:
        inner = make(penalty=penalty)
        return Changed(inner, **missing, **{verb: partial(each, getattr(inner, verb)) for verb, each in others.items()})

    return Subject("changed", make_changed)


class ResidualAlone:
    """A formulation that pairs at each state of its residual, and has no other verb."""

    def __init__(self, inner: Any) -> None:
        self.inner, self.traits = inner, inner.traits.revise(batched=False, tangent=None)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self.inner.residual(interface, self.inner.pair(interface, z), z)


def alone(name: str) -> Subject:
    """Return the residual of an installed formulation, which shall do without the other verbs."""
    return Subject("alone", lambda *, penalty: ResidualAlone(load_subject(name).with_penalty(penalty).plugin))


def reporting(change: Callable[[Any], Any], make: Callable[..., Any]) -> Subject:
    """Return a formulation that computes the right thing, and reports `change(points)` in place of its points."""

    def make_reporter(*, penalty: float) -> Changed:
        inner = make(penalty=penalty)
        return Changed(inner, contact_points=lambda *state: change(inner.contact_points(*state)))

    return Subject("reporter", make_reporter)


def with_promises(make: Callable[..., Any], **promises: Any) -> Subject:
    """Return a formulation that promises something else: `make` is its factory, `promises` are traits."""

    def make_boaster(*, penalty: float) -> Changed:
        inner = make(penalty=penalty)
        return Changed(inner, traits=inner.traits.revise(**promises))

    return Subject("boaster", make_boaster)
