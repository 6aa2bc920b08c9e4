"""The check that a run has judged all that was planned, counted anew from the plan itself.

Rule for the next editor: nothing here uses what the conductor or a row has counted, so that a mistake there cannot make
a run green in which an outcome is missing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import product

from contactverif.contract.property import Outcome, Property, Verdict
from contactverif.contract.result import NotLoaded, Row, Run
from contactverif.contract.subject import Subject
from contactverif.run.draw import CaseSource, Sampling, draw_cases

_WITHOUT_CASES = (Verdict.NOT_APPLICABLE, Verdict.NOT_PROVIDED)


def find_gap(
    result: Run, subjects: Sequence[Subject | NotLoaded], questions: Sequence[Property | NotLoaded], sampling: Sampling
) -> str:
    """Return what a run lacks, in words; empty if it has an outcome of every planned case.

    Parameters
    ----------
    result : Run
        The run.
    subjects : Sequence[Subject | NotLoaded]
        The formulations that were to be judged.
    questions : Sequence[Property | NotLoaded]
        The properties.
    sampling : Sampling
        The size and the seed of the run.
    """
    names = {subject.name: subject for subject in subjects if isinstance(subject, Subject)}
    properties = {question.id: question for question in questions if isinstance(question, Property)}
    if gap := _gap_of_rows(result, names, properties):
        return gap
    gaps = (_gap_of(row, names[row.formulation], properties[row.property_id], sampling) for row in result.rows)
    return next((gap for gap in gaps if gap), "")


def _gap_of_rows(result: Run, names: Iterable[str], property_ids: Iterable[str]) -> str:
    """Return which row is missing, or there without a plan."""
    planned = Counter(product(names, property_ids))
    rows = Counter((row.formulation, row.property_id) for row in result.rows)
    wrong = (key for key in planned | rows if rows[key] != planned[key])
    return next((f"{' '.join(key)}: {rows[key]} rows instead of {planned[key]}" for key in wrong), "")


def _gap_of(row: Row, subject: Subject, question: Property, sampling: Sampling) -> str:
    source = sampling.source(question)
    if question.refusal(subject.traits) or question.needs - subject.provides or source is None:
        return "" if row.verdict in _WITHOUT_CASES else f"{row.formulation} {row.property_id}: {row.verdict}"
    count = sum(isinstance(outcome, Outcome) for outcome in row.outcomes)
    planned = _count_planned(question, source, sampling, count)
    if count != planned or not planned:
        return f"{row.formulation} {row.property_id}: outcomes of {count} of {planned} cases"
    if row.promise is False and row.witness is None:
        return f"{row.formulation} {row.property_id}: no outcome of its witness"
    return ""


def _count_planned(question: Property, source: CaseSource, sampling: Sampling, count: int) -> int:
    """Return the number of planned cases. A strategy that may have fewer than were wanted is drawn once more."""
    if isinstance(source, tuple):
        return len(source)
    if count == sampling.examples:
        return count
    return len(draw_cases(source, seed=sampling.key(question), examples=sampling.examples).cases)
