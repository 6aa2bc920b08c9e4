"""The text that explains a property: what it asks, why, what it measures, its tolerance, and its known failures."""

import csv
import re
from collections.abc import Iterable, Sequence
from functools import cache
from itertools import combinations
from typing import Any

from contactverif.contract.property import Property, Quantity
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.explanations.case_numbers import symbols_of
from contactverif.explanations.terms import plain, read_text, sentence, symbol_meanings

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
    return _lines(["## Known failures\n", *facts])


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


_ALWAYS = (
    "flat normal single overhang kinked symmetric conserves_force conserves_moment converges inf_sup "
    "integrates_linear_gap local unbiased nodes_push opens_at_ends translation_stable"
)
_STATEMENTS: tuple[tuple[str, Any], ...] = (  # (name, value) of the traits from which a promise may follow.
    *((name, True) for name in _ALWAYS.split()),
    *(("tangent", "exact"), ("continuity", "C0"), ("locks", False), ("area", "current"), ("area", "reference")),
    *(("penalty", "distributed"), ("penalty", "nodal"), ("enforcement", "multiplier")),
    *(("independent_multipliers", True), ("never_intersects", True)),
    *(("force_along", "master normal"), ("force_along", "slave normal"), ("published_forces", {"a1": "1 2 1; 2 2"})),
)


def promised_by(question: Property) -> str:
    """Return in words which traits promise that the property passes; each small set of traits is tried."""
    if question.promise(Traits()):
        return "every formulation, whatever its traits say"
    for size in (1, 2):
        sets = (dict(pairs) for pairs in combinations(_STATEMENTS, size))
        hits = [each for each in sets if len(each) == size and question.promise(Traits().revise(**each))]
        if hits:
            return " or ".join(" with ".join(f"`{name}={hit[name]!r}`" for name in sorted(hit)) for hit in hits)
    return "no trait"


def property_text(question: Property) -> str:
    """Return in Markdown all that is known of a property without the formulations that are installed."""
    cases = "elastic bodies, solved by Newton's method" if question.bodies else "an interface alone; nothing is solved"
    needs = ", ".join(f"`{part}`" for part in sorted(question.needs)) or "`residual` only"
    in_space = ", and in space, where a segment is a face" if question.cases_in_space else ""
    facts = [
        ("Cases", cases),
        ("Dimensions", f"in the plane{in_space}"),
        ("Parts of the plugin that it needs", needs),
        ("Promised by", promised_by(question)),
        *([("Not asked of a law of its own", question.linear)] if question.linear else []),
    ]
    answers = []
    for paragraph in question.question.split("\n\n"):
        title, body = re.fullmatch(r"(?:\*\*([^*]+)\.\*\* )?(.*)", paragraph, re.DOTALL).groups()  # type: ignore[union-attr]
        answers.append((f"**{title}.** " if title else "") + plain(body) + "\n")
    if not any(answer.startswith("**Source.**") for answer in answers):
        answers.append("**Source.** No publication is named; the requirement follows from mechanics.\n")
    text = [
        f"# {question.id}\n",
        sentence(plain(question.summary)) + "\n",
        *answers,
        _lines(f"- **{title}:** {words}" for title, words in facts),
        "## Measured numbers\n",
        _tolerances(question.quantities),
        _reasons(question.quantities),
    ]
    symbols = dict.fromkeys(symbol for quantity in question.quantities for symbol in symbols_of(quantity.tolerance))
    if symbols:
        text.append(_lines(["The symbols:\n", *(f"- {each}: {plain(symbol_meanings()[each])}" for each in symbols)]))
    if question.series:
        names = ", ".join(f"{plain(name)} ({unit})" for name, unit in question.series.items())
        text.append(f"The report also keeps, for each iterate: {names}.\n")
    return "\n".join([*text, known_failures(question)])


def _lines(lines: Iterable[str]) -> str:
    return "\n".join(lines) + "\n"


def _tolerances(quantities: Sequence[Quantity]) -> str:
    """Return the list of quantities with their tolerances; what several share stands once."""
    groups: dict[tuple[str, str], list[str]] = {}
    for quantity in quantities:
        sign = "≤" if quantity.sense == "at most" else "≥"
        groups.setdefault((f"{sign} {quantity.tolerance}", quantity.unit), []).append(quantity.name)
    return _lines(
        f"- **{plain('; '.join(names))}** {plain(tolerance)} ({'ratio' if unit == '1' else unit})"
        for (tolerance, unit), names in groups.items()
    )


def _reasons(quantities: Sequence[Quantity]) -> str:
    """Return the list of the reasons of tolerances: first those that all quantities share."""
    owners: dict[str, list[str]] = {}
    for quantity in quantities:
        for part in re.split(r";|\.(?= )", quantity.reason):  # Its sentences, or parts between semicolons.
            if clause := part.strip(" ."):
                owners.setdefault(clause, []).append(quantity.name)
    everywhere = [clause for clause, names in owners.items() if len(names) == len(quantities)]
    lines = [f"- {sentence(plain(clause))}" for clause in everywhere]
    lines += [
        f"- *{plain(', '.join(names))}:* {sentence(plain(clause))}"
        for clause, names in owners.items()
        if clause not in everywhere
    ]
    return _lines(["Why these tolerances:\n", *lines])
