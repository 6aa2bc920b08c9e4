"""Annotations in a workflow of GitHub: what makes a run fail is shown at the factory of the formulation.

References
----------
GitHub Docs, Workflow commands for GitHub Actions.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from contactverif.contract.result import Run

_IN_WORKFLOW = "GITHUB_ACTIONS"


def annotate(run: Run) -> None:
    """Print an annotation for all that makes a run fail, if this is a job of a workflow."""
    if os.environ.get(_IN_WORKFLOW) == "true":
        for formulation, title, text in _failures(run):
            typer.echo(_annotation(formulation, title, text))


def _failures(run: Run) -> Iterator[tuple[str, str, str]]:
    """Yield (formulation, title, text) of all that makes a run fail."""
    from contactverif.contract.result import OPPOSITE_SIGN

    for item in run.not_loaded:
        yield item.formulation, f"{item.formulation} is not loaded", item.reason
    for name in run.opposite_signs:
        yield name, f"{name}: sign", OPPOSITE_SIGN
    for row in run.unexpected:
        if row.omitted:
            continue
        yield row.formulation, f"{row.formulation} {row.property_id}: {row.unexpected}", row.reason


def _annotation(formulation: str, title: str, text: str) -> str:
    from contactverif.api.factory_places import factory_place
    from contactverif.contract.foreign_text import one_line

    place = factory_place(formulation)
    properties = {} if place is None else {"file": place[0], "line": str(place[1])}
    words = ",".join(f"{name}={_escape(value, ':,')}" for name, value in {**properties, "title": title}.items())
    return f"::error {words}::{_escape(one_line(text))}"


def _escape(text: str, marks: str = "") -> str:
    """Return a text in which no character ends a part of the command."""
    for letter in f"%\r\n{marks}":
        text = text.replace(letter, f"%{ord(letter):02X}")
    return text
