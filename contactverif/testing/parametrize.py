"""For an author's own test file: every property of a formulation as a pytest test of its own.

    from contactverif.testing import parametrize_with_properties

    @parametrize_with_properties("mine", known={"patch.flat.transmission": "issue 12"})
    def test_mine(check):
        check()

Stacked, each decorator adds its own checks.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import pytest

from contactverif.contract.errors import MisuseError
from contactverif.contract.names import unknown_name_error
from contactverif.contract.property import Outcome, Property, Verdict
from contactverif.contract.result import NotLoaded, Row
from contactverif.contract.subject import Subject
from contactverif.run.profiles import Profile, profile_named
from contactverif.run.registry import load_formulation, load_properties, subject_of
from contactverif.run.runner import run
from contactverif.testing.pytest_plugin import MARK

_Test = TypeVar("_Test", bound=Callable[..., Any])


@dataclass(frozen=True, slots=True)
class Asked:
    """The arguments of `parametrize_with_properties`, until pytest collects the test."""

    formulations: tuple[str | Callable[..., Any], ...]
    properties: tuple[str, ...]
    examples: int | None
    seed: int | None
    profile: str | None
    known: Mapping[str, str]


def parametrize_with_properties(
    *formulations: str | Callable[..., Any],
    properties: Sequence[str] = ("*",),
    examples: int | None = None,
    seed: int | None = None,
    profile: str | None = None,
    known: Mapping[str, str] | None = None,
) -> Callable[[_Test], _Test]:
    """Run the decorated test, which takes `check` and calls it, for each formulation and property.

    A check passes where a promise is kept, or where the formulation fails as it said it would. It is skipped where
    there is nothing to ask (not applicable, not provided), and an expected failure (xfail) where a failure is known
    or nothing was promised. Everything else fails, with a drawing of the smallest mesh that shows it.

    Parameters
    ----------
    formulations
        Names as on the command line, or factories `make(*, penalty)`.
    properties : Sequence[str]
        Patterns of ids.
    examples, seed, profile : int | None or str | None
        How much is asked; `--contactverif-examples` and so on overrule them. The profile is `dev` unless said
        otherwise.
    known : Mapping[str, str] | None
        {property id: why its failure is known}; an id that is not asked is an error, and so is one that passes.
    """
    if not formulations or not all(isinstance(one, str) or callable(one) for one in formulations):
        raise MisuseError("formulations", repr(formulations), "names or factories, at least one")
    if isinstance(properties, str):
        raise MisuseError("properties", repr(properties), f"a sequence of patterns, ({properties!r},)")
    asked = Asked(formulations, tuple(properties), examples, seed, profile, known or {})
    mark: Callable[[_Test], _Test] = getattr(pytest.mark, MARK)(asked=asked)
    return mark


@dataclass(slots=True, repr=False)
class Check:
    """One property of one formulation. Calling it judges, and says the result as pytest understands it.

    Attributes
    ----------
    row : Row | None
        What was found, None before the call.
    """

    subject: Subject | NotLoaded
    question: Property | NotLoaded
    profile: Profile
    known: Mapping[str, str]
    row: Row | None = field(default=None, init=False)

    @property
    def id(self) -> str:
        """Formulation and property, `mine-patch.flat.transmission`."""
        name = self.subject.name if isinstance(self.subject, Subject) else self.subject.formulation
        return f"{name}-{_id(self.question)}"

    def __repr__(self) -> str:  # pytest prints the arguments of a test that fails
        return f"<check {self.id}>"

    @property
    def seed(self) -> int:
        """The seed of the cases."""
        return self.profile.seed or 0

    def __call__(self) -> None:
        """Judge.

        Raises
        ------
        AssertionError
            If a promise is broken, something crashed, was not judged or did not load.
        """
        __tracebackhide__ = True
        for part in (self.subject, self.question):
            if isinstance(part, NotLoaded):
                raise AssertionError(f"{part.formulation}: not loaded: {part.reason}")
        [self.row] = run([self.subject], [self.question], profile=self.profile, known=self.known).rows
        row = self.row
        if row.unexpected:
            raise AssertionError(explain(row, again=self._again()))
        if row.verdict in (Verdict.NOT_APPLICABLE, Verdict.NOT_PROVIDED):
            pytest.skip(row.reason)
        if row.verdict in (Verdict.FAIL, Verdict.CRASHED) and row.known:
            pytest.xfail(f"known: {row.known}")
        if row.verdict is Verdict.FAIL and row.promise is None:
            pytest.xfail(f"fails, and promised nothing: {row.reason}")

    def _again(self) -> str:
        node = os.environ.get("PYTEST_CURRENT_TEST", "").rpartition(" ")[0]  # "file::test[id] (call)"
        options = [f"--contactverif-seed={self.seed}", f"--contactverif-examples={self.profile.examples}"]
        return shlex.join(["pytest", node, *options])


def checks(asked: Asked, options: Any, fresh_seed: int) -> list[Check]:
    """The checks of a decorated test; `options` are those of the pytest command line, and overrule.

    Raises
    ------
    MisuseError
        On an unknown formulation, option, property, profile, or a known failure of no property asked.
    """
    questions = load_properties(asked.properties)
    ids = [_id(question) for question in questions]
    for property_id in asked.known:
        if property_id not in ids:
            raise unknown_name_error("known", property_id, ids)
    profile = profile_named(options.contactverif_profile or asked.profile or "dev").resolve(
        examples=_first(options.contactverif_examples, asked.examples),
        seed=_first(options.contactverif_seed, asked.seed),
        fresh=fresh_seed,
    )
    subjects = [
        load_formulation(one) if isinstance(one, str) else subject_of(getattr(one, "__name__", type(one).__name__), one)
        for one in asked.formulations
    ]
    return [
        Check(subject, question, profile, {name: why for name, why in asked.known.items() if name == _id(question)})
        for subject in subjects
        for question in questions
    ]


def explain(row: Row, *, again: str) -> str:
    """Why a row makes a run fail, for a person: numbers against tolerances, the smallest mesh, how to ask again."""
    question = row.question
    lines = [f"{question.id}: {row.formulation}: {row.unexpected}", f"  {question.summary}"]
    if row.planned and row.verdict is not Verdict.NOT_JUDGED:  # whose reason says it
        lines.append(f"  {row.judged} of {row.planned} cases judged")
    if row.reason:
        lines.append(f"  the worst: {row.reason}" if row.shrunk else f"  {row.reason}")
    shown = row.shrunk or row.witness
    if shown is not None:
        what = "smallest case that shows it" if row.shrunk else f"witness {shown.case.name}"
        lines += [f"  {what}: {shown.reason or shown.verdict}", *_numbers(question, shown), _drawing(shown)]
    lines.append(f"  again: {again}")
    return "\n".join(lines)


def _numbers(question: Property, outcome: Outcome) -> list[str]:
    found = outcome.measurement
    if found is None:
        return []
    lines = []
    for quantity in question.quantities:
        if quantity.name in found.values:
            value, tolerance = found.values[quantity.name], found.tolerances[quantity.name]
            why = f"{quantity.tolerance} ({quantity.reason})"
            lines.append(f"    {quantity.name}: {value:.6g}, {quantity.sense} {tolerance:.3g} = {why}")
    return lines


def _drawing(outcome: Outcome) -> str:
    from contactverif_reports.draw import as_text

    drawn: str = as_text(outcome.case)
    return drawn


def _id(question: Property | NotLoaded) -> str:
    return question.id if isinstance(question, Property) else question.formulation


def _first(*values: int | None) -> int | None:
    return next((value for value in values if value is not None), None)
