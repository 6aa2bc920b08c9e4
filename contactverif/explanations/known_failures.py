"""Failures of a property that are known: formulations that state one, and mistakes planted to test the harness."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from functools import cache

from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.explanations.markdown import plain, read_text

_MOST_MISTAKES = 4


@cache
def _table(name: str) -> list[dict[str, str]]:
    return list(csv.DictReader(read_text(name).splitlines()))


def planted_mistakes(property_id: str) -> list[str]:
    """Return the mistakes that a property is meant to catch, the plainest first, as the table has them."""
    return [row["mutant"] for row in _table("kills.csv") if row["caught by"] == property_id]


def smallest_mesh(property_id: str) -> str:
    """Return in words the smallest mesh on which a planted mistake failed a property; empty if none was shrunk."""
    sizes = [
        (tuple(map(int, row["seed 0"].split())), row["mutant"])
        for row in _table("smallest_cases.csv")
        if row["caught by"] == property_id
    ]
    if not sizes:
        return ""
    (n_slave, n_master, _), mutant = min(sizes, key=lambda item: (sum(item[0][:2]), item[0]))
    segments = f"{n_slave} slave segment{'s' * (n_slave > 1)} on {n_master} of the master"
    return f"{segments}, for the mistake “{plain(mutant)}”"


def known_failures(question: Property) -> str:
    """Return in Markdown which mistakes fail a property, and how small the mesh is that shows it."""
    facts = []
    if mistakes := planted_mistakes(question.id):
        listed = "; ".join(map(plain, mistakes[:_MOST_MISTAKES]))
        others = f"; and {len(mistakes) - _MOST_MISTAKES} more" if len(mistakes) > _MOST_MISTAKES else ""
        facts.append(f"- **Usual causes:** it is meant to catch mistakes such as these: {listed}{others}.")
    if mesh := smallest_mesh(question.id):
        facts.append(f"- **Smallest failing mesh:** {mesh}.")
    elif mistakes:
        facts.append("- **Smallest failing mesh:** the cases are a list, none of which is made smaller.")
    return "\n".join(["## Known failures\n", *facts]) + "\n"


def stated_failures(question: Property, installed: Iterable[object]) -> str:
    """Return in Markdown which of the installed formulations state that they fail a property, and by which witness.

    What is installed may be a wrapper, or may not load; neither states anything.
    """
    failing = [
        f"`{subject.name}` (`{subject.traits.witness(question.id)}`)"
        for subject in installed
        if isinstance(subject, Subject)
        and question.promise(subject.traits) is False
        and not question.refusal_of(subject)
    ]
    if not failing:
        return "No installed formulation states that it fails.\n"
    return f"These formulations state that they fail, each with a witness: {', '.join(failing)}.\n"
