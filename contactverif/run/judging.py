"""The judgement of one case, and the order of outcomes from harmless to bad.

Rule for the next editor: whatever a plugin does is an outcome. What the harness or a property does wrong is an
exception.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from time import perf_counter

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError, NonFiniteError, PluginError
from contactverif.contract.property import Outcome, Property, PropertyInfo, Verdict, checked_numbers, judge
from contactverif.contract.subject import Subject
from contactverif.run.one_thread import one_thread


def judge_case(question: Property, case: Case, subject: Subject) -> Outcome:
    """Judge one case, a new one or one that was stored. Whatever the plugin does is an outcome.

    Parameters
    ----------
    question : Property
        The property to check.
    case : Case
        The case to check it on.
    subject : Subject
        The formulation.

    Returns
    -------
    Outcome
        Verdict, reason and numbers.

    Raises
    ------
    Exception
        Any error of the harness or the property itself, with the case as a note.
    """
    start = perf_counter()

    def outcome(verdict: Verdict, reason: str, *, breach: bool = False) -> Outcome:
        return Outcome(case, verdict, reason, seconds=perf_counter() - start, breach=breach)

    try:
        with one_thread(), np.errstate(all="ignore"):  # A check of the answer reports NaN, not a warning on the way.
            measurement = question.measure(case, subject)
            verdict, reason = judge(question, measurement)
    except PluginError as error:
        verdict = Verdict.UNDECIDED if error.cause == "not asked" else Verdict.CRASHED
        return outcome(verdict, f"{error.cause}: {error}")
    except NonFiniteError as error:
        return outcome(Verdict.FAIL, f"not finite: {error}", breach=True)
    except ContractError as error:
        return outcome(Verdict.FAIL, f"breaks the contract: {error}", breach=True)
    except Exception as error:
        error.add_note(f"while judging {question.id} of {subject.name} on {case!r}")
        raise
    return replace(outcome(verdict, reason), measurement=measurement)


def badness(info: PropertyInfo, outcome: Outcome) -> tuple[int, float]:
    """Return a key that orders outcomes: crashes, breaches of the contract, failures by how far beyond tolerance."""
    if outcome.verdict is Verdict.CRASHED:
        return 3, inf
    if outcome.verdict is not Verdict.FAIL:
        return 0, 0.0
    if outcome.breach:
        return 2, inf
    if outcome.measurement is None or outcome.measurement.broken:
        return 1, inf
    return 1, max((number.ratio for number in checked_numbers(info, outcome.measurement)), default=inf)
