"""The checks of a decorated test: each runs one property of one formulation, and tells pytest the result.

A check that fails shows the promise, the numbers, a mesh that fails, and a command that repeats it.
"""

import os
import shlex
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pytest

from contactverif.contract.property import Outcome, Property, PropertyInfo, Verdict, checked_numbers
from contactverif.contract.result import OPPOSITE_SIGN, NotLoaded, Row
from contactverif.contract.subject import Subject
from contactverif.plugins.registry import load_formulation, load_properties, subject_of
from contactverif.run.run import check_known, run
from contactverif.run.run_options import Profile, profile_named
from contactverif_reports.plot.text import as_text


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
        question = self.question.id if isinstance(self.question, Property) else self.question.formulation
        return f"{name}-{question}"

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
            node = os.environ.get("PYTEST_CURRENT_TEST", "").rpartition(" ")[0]  # "file::test[id] (call)"
            options = [f"--contactverif-seed={self.seed}", f"--contactverif-examples={self.profile.examples}"]
            command = shlex.join(["pytest", node, *options])
            raise AssertionError(explain(row, command=command, opposite_sign=opposite_sign, diagnosis=diagnosis))
        if row.verdict in (Verdict.NOT_APPLICABLE, Verdict.NOT_PROVIDED):
            pytest.skip(row.reason)
        if row.verdict in (Verdict.FAIL, Verdict.CRASHED) and row.known:
            pytest.xfail(f"known failure: {row.known}")
        if row.verdict is Verdict.FAIL and row.promise is None:
            pytest.xfail(f"fails; the formulation promises nothing here: {row.reason}")


def make_checks(
    options: Any,
    fresh_seed: int,
    *,
    formulations: Sequence[str | Callable[..., Any]],
    properties: Sequence[str],
    examples: int | None,
    seed: int | None,
    profile: str | None,
    known: Mapping[str, str],
) -> list[Check]:
    """Return the checks of a decorated test; what is typed behind `pytest` counts more than the decorator."""
    questions = load_properties(properties)
    check_known(known, questions)
    size = profile_named(options.contactverif_profile or profile or "dev").resolve(
        examples=examples if options.contactverif_examples is None else options.contactverif_examples,
        seed=seed if options.contactverif_seed is None else options.contactverif_seed,
        fresh=fresh_seed,
    )
    subjects = [
        load_formulation(item)
        if isinstance(item, str)
        else subject_of(getattr(item, "__name__", type(item).__name__), item)
        for item in formulations
    ]
    return [
        Check(subject, question, size, {id_: known[id_] for id_ in known if id_ == getattr(question, "id", "")})
        for subject in subjects
        for question in questions
    ]


def explain(row: Row, *, command: str, opposite_sign: bool = False, diagnosis: str = "") -> str:
    """Return why a row makes a run fail; that the forces have the opposite sign is said first, then a diagnosis."""
    question = row.info
    lines = [f"{row.formulation}: {OPPOSITE_SIGN}"] if opposite_sign else []
    lines += [f"{row.formulation}, {question.id}: {row.unexpected}"] if row.unexpected else []
    lines += [f"  Diagnosis: {diagnosis}"] if diagnosis else []
    lines.append(f"  The property: {question.summary}")
    if row.planned and row.verdict is not Verdict.NOT_JUDGED:  # Its reason says the numbers.
        lines.append(f"  {row.judged} of {row.planned} cases could be judged.")
    outcome = row.shrunk or row.first or row.witness
    if row.reason:
        lines.append(f"  The {'reason' if outcome is row.witness else 'worst case'}: {row.reason}")
    if row.suspicion:
        lines.append(f"  {row.suspicion}")
    if outcome is not None:
        name, role = outcome.case.name, "witness" if outcome is row.witness else "case"
        unnamed = "smallest case that fails" if row.shrunk else "first case that clearly fails, not shrunk"
        lines.append(f"  The {role} {name}: {outcome.verdict}" if name else f"  The {unnamed}:")
        lines += _numbers(row.info, outcome)
        finding = outcome.measurement and outcome.measurement.finding
        lines.append(textwrap.indent(as_text(outcome.case, worst=finding), "    "))
    lines.append(f"  To run it again: {command}")
    return "\n".join(lines)


def _numbers(question: PropertyInfo, outcome: Outcome) -> list[str]:
    """Return each measured number against its tolerance, with the formula of the tolerance and its reason."""
    measurement = outcome.measurement
    if measurement is None:
        return [f"    {outcome.reason}"]
    lines = [f"    {measurement.broken}"] if measurement.broken else []
    for number in checked_numbers(question, measurement):
        mark, quantity = "✗" if number.ratio > 1 else "✓", number.quantity
        lines.append(f"    {mark} {quantity.name}: {number.value:.6g}; needed: {quantity.sense} {number.tolerance:.3g}")
        lines.append(f"      tolerance: {quantity.tolerance} ({quantity.reason})")
    if measurement.finding is not None:
        lines.append(f"    {measurement.finding}")
    return lines
