"""The picture of one judged case: its interface with the forces of a formulation beside the exact ones."""

from __future__ import annotations

from pathlib import Path

from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Outcome, Property
from contactverif.contract.subject import Subject
from contactverif.run.one_case import forces_on
from contactverif_reports.draw import draw_case


def draw_outcome(subject: Subject, question: Property, outcome: Outcome, path: Path, argument: str) -> None:
    """Draw the case of an outcome to a file."""
    title = f"{subject.name}, {question.id}: {outcome.reason or outcome.verdict}"
    forces = forces_on(outcome.case, subject)
    exact = question.exact(outcome.case) if question.exact is not None and forces is not None else None
    try:
        draw_case(outcome.case, path, title=title, forces=forces, exact=exact)
    except MisuseError as error:
        raise MisuseError(argument, error.found, error.needed) from None
