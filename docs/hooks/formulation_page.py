"""The page of the installed formulations: what each promises, then the text of plugins/README.md."""

from __future__ import annotations

from pathlib import Path

from page_text import table
from repository_pages import relink

from contactverif import Subject, Traits
from contactverif.explanations.terms import plain
from contactverif.plugins.registry import load_formulations

_COLUMNS = {
    "flat": "flat patch test",
    "normal": "node on node",
    "single": "nodes on midpoints",
    "overhang": "overhang",
    "tangent": "tangent",
    "symmetric": "symmetric",
    "conserves_force": "force balance",
    "conserves_moment": "moment balance",
    "penalty": "penalty",
    "enforcement": "enforcement",
}


def _cell(value: object) -> str:
    return {True: "yes", False: "no", None: "–"}.get(value, str(value))  # type: ignore[call-overload, no-any-return]


def formulation_page(root: Path) -> str:
    """Return the page of the formulations that are installed."""
    names = [name for name in Traits().by_name() if name in _COLUMNS]
    subjects = [item for item in load_formulations() if isinstance(item, Subject)]
    rows = [[f"`{item.name}`", *(_cell(item.traits.by_name()[name]) for name in names)] for item in subjects]
    sources = [
        [f"`{item.name}`", plain(item.traits.evidence.source)] for item in subjects if item.traits.evidence.source
    ]
    families = relink((root / "plugins" / "README.md").read_text(encoding="utf-8"), "plugins/README.md")
    body = families.partition("\n")[2]
    text = [
        "# Formulations\n",
        "The command `contactverif list --traits` prints what every installed formulation promises. "
        "[Promise and witness](../concepts/promises.md) says what a promise is.\n",
        "## Promises\n",
        '<div class="wide" markdown>\n',
        table(["name", *(_COLUMNS[name] for name in names)], rows),
        "</div>\n",
        "A dash means that the formulation promises nothing.\n",
        "## Sources\n",
        table(["name", "source"], sources),
        "## Families\n",
        body.replace("\n## ", "\n### "),
    ]
    return "\n".join(text)
