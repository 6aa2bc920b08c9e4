"""The text of a failed check: the promise, the numbers, a mesh that fails, and a command that repeats it."""

from __future__ import annotations

import textwrap

from contactverif.contract.property import Outcome, PropertyInfo, Verdict, checked_numbers
from contactverif.contract.result import OPPOSITE_SIGN, Row


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
        lines += _example(row, outcome)
    lines.append(f"  To run it again: {command}")
    return "\n".join(lines)


def _example(row: Row, outcome: Outcome) -> list[str]:
    """Return the numbers and the drawing of a case."""
    name, role = outcome.case.name, "witness" if outcome is row.witness else "case"
    unnamed = "smallest case that fails" if row.shrunk else "first case that clearly fails, not shrunk"
    lines = [f"  The {role} {name}: {outcome.verdict}" if name else f"  The {unnamed}:"]
    if outcome.measurement is None:
        lines.append(f"    {outcome.reason}")
    return [*lines, *_numbers(row.info, outcome), _drawing(outcome)]


def _numbers(question: PropertyInfo, outcome: Outcome) -> list[str]:
    """Return each measured number against its tolerance, with the formula of the tolerance and its reason."""
    measurement = outcome.measurement
    if measurement is None:
        return []
    lines = [f"    {measurement.broken}"] if measurement.broken else []
    for number in checked_numbers(question, measurement):
        mark, quantity = "✗" if number.ratio > 1 else "✓", number.quantity
        lines.append(f"    {mark} {quantity.name}: {number.value:.6g}; needed: {quantity.sense} {number.tolerance:.3g}")
        lines.append(f"      tolerance: {quantity.tolerance} ({quantity.reason})")
    if measurement.finding is not None:
        lines.append(f"    {measurement.finding}")
    return lines


def _drawing(outcome: Outcome) -> str:
    from contactverif_reports.draw import as_text

    return textwrap.indent(as_text(outcome.case), "    ")
