"""Small pieces of Markdown that several generated pages need."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table; a bar inside a cell is escaped."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "&#124;") for cell in line) + " |" for line in lines) + "\n"


def sentence(text: str) -> str:
    """Return the text with a capital first letter, unless that is a symbol, and a full stop."""
    text = text.strip()
    if not text:
        return ""
    first = text[0].upper() if re.match(r"[a-z]{2}|a ", text) else text[0]
    return first + text[1:] + ("" if text[-1] in ".!?…" else ".")


def plain(text: str) -> str:
    """Return running text with the signs escaped that Markdown would read as markup or HTML."""
    outside = re.split(r"(`[^`]*`)", text)
    return "".join(part if part.startswith("`") else re.sub(r"([*_<\[])", r"\\\1", part) for part in outside)
