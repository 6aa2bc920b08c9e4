"""The checks of a decorated test: each runs one property of one formulation and tells pytest the result."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest

from contactverif.contract.property import Property, Verdict
from contactverif.contract.result import NotLoaded, Row
from contactverif.contract.subject import Subject
from contactverif.plugins.registry import load_formulation, load_properties, subject_of
from contactverif.run.profiles import Profile, profile_named
from contactverif.run.run import check_known, run
from contactverif.testing.failure_text import explain
from contactverif.testing.parametrize import CheckOptions


@dataclass(slots=True, repr=False)
class Check:
    """One property of one formulation; calling it judges the cases and tells pytest the result."""

    subject: Subject | NotLoaded
    question: Property | NotLoaded
    profile: Profile  # The size of the run, with a seed.
    known: Mapping[str, str]  # {property id: why its failure is known}, for this property at most.
    row: Row | None = field(default=None, init=False)  # The result; None before the call.

    @property
    def id(self) -> str:
        """Return formulation and property, such as `mine-patch.flat.transmission`."""
        name = self.subject.name if isinstance(self.subject, Subject) else self.subject.formulation
        return f"{name}-{_id(self.question)}"

    def __repr__(self) -> str:  # pytest prints the arguments of a test that fails.
        return f"<check {self.id}>"

    @property
    def seed(self) -> int:
        """Return the seed of the cases."""
        return self.profile.seed or 0

    def __call__(self) -> None:
        """Judge the cases."""
        __tracebackhide__ = True
        for part in (self.subject, self.question):
            if isinstance(part, NotLoaded):
                raise AssertionError(f"{part.formulation}: not loaded: {part.reason}")
        result = run([self.subject], [self.question], profile=self.profile, known=self.known)
        [self.row] = result.rows
        row, opposite_sign = self.row, bool(result.opposite_signs)
        if row.unexpected or opposite_sign:
            diagnosis = result.diagnoses.get(row.formulation, "")
            command = self._command()
            raise AssertionError(explain(row, command=command, opposite_sign=opposite_sign, diagnosis=diagnosis))
        if row.verdict in (Verdict.NOT_APPLICABLE, Verdict.NOT_PROVIDED):
            pytest.skip(row.reason)
        if row.verdict in (Verdict.FAIL, Verdict.CRASHED) and row.known:
            pytest.xfail(f"known failure: {row.known}")
        if row.verdict is Verdict.FAIL and row.promise is None:
            pytest.xfail(f"fails; the formulation promises nothing here: {row.reason}")

    def _command(self) -> str:
        """Return the command that runs this check once more."""
        node = os.environ.get("PYTEST_CURRENT_TEST", "").rpartition(" ")[0]  # "file::test[id] (call)"
        options = [f"--contactverif-seed={self.seed}", f"--contactverif-examples={self.profile.examples}"]
        return shlex.join(["pytest", node, *options])


def make_checks(arguments: CheckOptions, options: Any, fresh_seed: int) -> list[Check]:
    """Return the checks of a decorated test."""
    questions = load_properties(arguments.properties)
    check_known(arguments.known, questions)
    profile = profile_named(options.contactverif_profile or arguments.profile or "dev").resolve(
        examples=_first(options.contactverif_examples, arguments.examples),
        seed=_first(options.contactverif_seed, arguments.seed),
        fresh=fresh_seed,
    )
    return [
        Check(subject, question, profile, _known_of(question, arguments.known))
        for subject in map(_load_subject, arguments.formulations)
        for question in questions
    ]


def _known_of(question: Property | NotLoaded, known: Mapping[str, str]) -> dict[str, str]:
    return {property_id: reason for property_id, reason in known.items() if property_id == _id(question)}


def _load_subject(formulation: str | Callable[..., Any]) -> Subject | NotLoaded:
    if isinstance(formulation, str):
        return load_formulation(formulation)
    return subject_of(getattr(formulation, "__name__", type(formulation).__name__), formulation)


def _id(question: Property | NotLoaded) -> str:
    return question.id if isinstance(question, Property) else question.formulation


def _first(*values: int | None) -> int | None:
    return next((value for value in values if value is not None), None)
