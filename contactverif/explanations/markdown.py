"""Small pieces of Markdown, and the files of this folder."""

from __future__ import annotations

import re
from importlib.resources import files


def read_text(name: str) -> str:
    """Return the text of a file of this folder."""
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


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


def without_links(text: str) -> str:
    """Return Markdown in which a link is its words alone, since a terminal has no page to go to."""
    return re.sub(r"(?<![\\!])\[([^\]]+)\]\([^)]*\)", r"\1", text)
