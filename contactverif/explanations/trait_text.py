"""The text that explains a trait: what it states, from the docstring of its group."""

from __future__ import annotations

import inspect
import re

from contactverif.contract.traits import Abilities, Evidence, PatchPromises, Promises, Rules

_GROUPS = {
    "patch=PatchPromises": PatchPromises,
    "promises=Promises": Promises,
    "rules=Rules": Rules,
    "abilities=Abilities": Abilities,
    "evidence=Evidence": Evidence,
}
_ENTRY = re.compile(r"^(?P<names>\w+(?:, \w+)*) : (?P<kind>[^\n]+)\n(?P<text>(?:    [^\n]*\n?|\n)+)", re.MULTILINE)


def trait_names() -> list[str]:
    """Return the names of all traits."""
    return [name for kind in _GROUPS.values() for name, *_ in _entries(kind)]


def trait_text(name: str) -> str:
    """Return in Markdown what a trait states; `name` may have a value behind it. Empty if there is no such trait."""
    wanted, _, _ = name.partition("=")
    for place, kind in _GROUPS.items():
        for entry, values, text in _entries(kind):
            if entry == wanted:
                form = f"{place}({entry}=…)" if kind is not PatchPromises else f"promises=Promises({place}({entry}=…))"
                return f"# {entry}\n\nA trait, `Traits({form})`: `{values}`.\n\n{text}\n"
    return ""


def _entries(kind: type) -> list[tuple[str, str, str]]:
    """Return (name, values, text) of each trait of a group."""
    attributes = (inspect.getdoc(kind) or "").partition("Attributes\n----------\n")[2]
    return [
        (name, match["kind"], inspect.cleandoc(f"\n{match['text']}"))
        for match in _ENTRY.finditer(f"{attributes}\n")
        for name in match["names"].split(", ")
    ]
