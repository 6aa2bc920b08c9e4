"""One page for each installed property: what it asks, what it measures, and against which tolerance."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import combinations
from pathlib import Path

from page_text import plain, sentence, table

from contactverif import Property, Quantity, Traits

_VALUES = {
    "flat": (True,),
    "normal": (True,),
    "single": (True,),
    "overhang": (True,),
    "tangent": ("exact",),
    "symmetric": (True,),
    "conserves_force": (True,),
    "conserves_moment": (True,),
    "continuity": ("C0",),
    "area": ("current", "reference"),
    "penalty": ("distributed", "nodal"),
    "enforcement": ("multiplier",),
    "kinked": (True,),
    "converges": (True,),
    "inf_sup": (True,),
    "locks": (False,),
    "integrates_linear_gap": (True,),
    "force_along": ("master normal", "slave normal"),
    "local": (True,),
    "unbiased": (True,),
    "nodes_push": (True,),
    "translation_stable": (True,),
    "independent_multipliers": (True,),
    "published_forces": ({"a1": "1 2 1; 2 2"},),
}


def promised_by(question: Property) -> str:
    """Return in words which traits promise that the property passes; each small set of traits is tried."""
    if question.promise(Traits()):
        return "every formulation, whatever its traits say"
    names = Traits().by_name().keys()
    singles = [(name, value) for name, values in _VALUES.items() if name in names for value in values]
    for size in (1, 2):
        hits = [dict(hit) for hit in combinations(singles, size) if len(dict(hit)) == size and _promises(question, hit)]
        if hits:
            return " or ".join(" with ".join(f"`{name}={hit[name]!r}`" for name in sorted(hit)) for hit in hits)
    return "no trait"


def _promises(question: Property, values: Iterable[tuple[str, object]]) -> bool:
    return bool(question.promise(Traits().revise(**dict(values))))  # type: ignore[arg-type]


def property_page(question: Property) -> str:
    """Return the page of one property."""
    cases = "elastic bodies, solved by Newton's method" if question.bodies else "an interface alone; nothing is solved"
    needs = ", ".join(f"`{part}`" for part in sorted(question.needs)) or "`residual` only"
    facts = [
        ("Cases", cases),
        ("Parts of the plugin that it needs", needs),
        ("Promised by", promised_by(question)),
    ]
    text = [
        f"# {question.id}\n",
        sentence(plain(question.summary)) + "\n",
        *_answers(question),
        "\n".join(f"- **{title}:** {words}" for title, words in facts) + "\n",
        "## Measured numbers\n",
    ]
    text += _quantities(question)
    if question.series:
        names = ", ".join(f"{plain(name)} ({unit})" for name, unit in question.series.items())
        text.append(f"The report also keeps, for each iterate: {names}.\n")
    text += [
        "## See also\n",
        "- [Where tolerances come from](../../concepts/tolerances.md), with all symbols\n"
        "- [Which formulations pass](index.md#who-does-what)\n"
        f"- On the command line: `contactverif verify NAME -p {question.id}`\n",
    ]
    return re.sub(r"`docs/([\w/-]+)\.md`", r"[\1](../../\1.md)", "\n".join(text))


def _answers(question: Property) -> list[str]:
    """Return the paragraphs about question, reason, judgement and undecided cases."""
    answers = []
    for paragraph in question.question.split("\n\n"):
        title, body = re.fullmatch(r"(?:\*\*([^*]+)\.\*\* )?(.*)", paragraph, re.DOTALL).groups()  # type: ignore[union-attr]
        answers.append((f"**{title}.** " if title else "") + plain(body) + "\n")
    return answers


def _quantities(question: Property) -> list[str]:
    """Return the table of tolerances and their reasons; what several quantities share stands once."""
    groups: dict[tuple[str, str], list[Quantity]] = {}
    for quantity in question.quantities:
        sign = "≤" if quantity.sense == "at most" else "≥"
        groups.setdefault((f"{sign} {quantity.tolerance}", quantity.unit), []).append(quantity)
    rows = [
        ["<br>".join(plain(quantity.name) for quantity in members), plain(tolerance), _unit(unit)]
        for (tolerance, unit), members in groups.items()
    ]
    text = [table(["number", "tolerance", "unit"], rows), "Why these tolerances:\n"]
    clauses = [_clauses(quantity.reason) for quantity in question.quantities]
    common = [clause for clause in clauses[0] if all(clause in others for others in clauses)] if clauses else []
    text += [f"- {sentence(plain(clause))}" for clause in common]
    special: dict[str, list[str]] = {}
    for quantity, parts in zip(question.quantities, clauses, strict=True):
        for clause in parts:
            if clause not in common:
                special.setdefault(clause, []).append(quantity.name)
    text += [f"- *{plain(', '.join(names))}:* {sentence(plain(clause))}" for clause, names in special.items()]
    return [*text, ""]


def _clauses(reason: str) -> list[str]:
    """Return the sentences of a reason, or its parts between semicolons."""
    return [clause.strip(" .") for clause in re.split(r";|\.(?= )", reason) if clause.strip(" .")]


def _unit(unit: str) -> str:
    return "ratio" if unit == "1" else unit


def property_index(properties: list[Property], root: Path) -> str:
    """Return the page that lists all properties and shows which formulation passes which."""
    rows = [[f"[{item.id}]({item.id}.md)", sentence(plain(item.summary))] for item in properties]
    text = [
        "# Properties\n",
        "A property is one question to a formulation. Each has a page with its formulas.\n",
        table(["property", "what must hold"], rows),
    ]
    source = (root / "properties" / "README.md").read_text(encoding="utf-8")
    verdicts = re.search(r"<!-- verdicts: begin -->\n(.*?)<!-- verdicts: end -->", source, re.DOTALL)
    if verdicts:
        text += [
            "## Who does what\n",
            "The table holds for 100 random cases and the witness of each. ✓ passes; ✗ fails as the formulation "
            "itself states, with a witness; · is not applicable.\n",
            '<div class="wide" markdown>\n',
            verdicts[1],
            "</div>\n",
        ]
    return "\n".join(text)
