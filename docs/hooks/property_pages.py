"""The pages of the properties: one for each, with the text of `contactverif explain`, and one that lists all."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from page_text import table

from contactverif import Property
from contactverif.explanations.property_text import property_text, stated_failures
from contactverif.explanations.terms import plain, sentence


def property_page(question: Property, installed: Iterable[object]) -> str:
    """Return the page of one property: what the command says, and links."""
    text = f"""{property_text(question)}
{stated_failures(question, installed)}
## See also

- [Where tolerances come from](../../concepts/tolerances.md), with all symbols
- [Which formulations pass](index.md#who-does-what)
- On the command line: `contactverif explain {question.id}` and `contactverif verify NAME -p {question.id}`
"""
    return re.sub(r"`docs/([\w/-]+)\.md`", r"[\1](../../\1.md)", text)


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
