"""The words of the project and the symbols of the tolerances, by the names under which a user looks them up."""

from __future__ import annotations

import re
from functools import cache

from contactverif.explanations.markdown import read_text

_SYMBOL_ROW = re.compile(r"^\| (\S+) \| (.+) \|$", re.MULTILINE)


@cache
def symbol_meanings() -> dict[str, str]:
    """Return {symbol: meaning in words} of all symbols of the tolerances."""
    table = read_text("tolerances.md").partition("| symbol | meaning |\n|---|---|\n")[2].partition("\n\n")[0]
    return {symbol: meaning.replace("\\|", "|") for symbol, meaning in _SYMBOL_ROW.findall(table + "\n")}


@cache
def term_texts() -> dict[str, str]:
    """Return {name in small letters: text in Markdown} of all terms; those that share a heading share its text."""
    sections = re.split(r"^### ", read_text("words.md"), flags=re.MULTILINE)[1:]
    texts: dict[str, str] = {}
    for section in sections:
        heading, _, body = section.partition("\n")
        text = body.partition("\n## ")[0].strip()
        texts |= dict.fromkeys(_names(heading), f"# {heading}\n\n{text}\n")
    return texts


def term_text(name: str) -> str:
    """Return the text about a term or a symbol, in Markdown; empty if there is none of that name."""
    if meaning := symbol_meanings().get(name):
        return f"# {name}\n\nA symbol of the tolerances: {meaning}.\n"
    return term_texts().get(name.lower(), "")


def list_of_terms() -> str:
    """Return in Markdown all terms, in the order of the page, and what else there is to look up."""
    headings = dict.fromkeys(text.partition("\n")[0].removeprefix("# ") for text in term_texts().values())
    terms, symbols = "\n".join(f"- {heading}" for heading in headings), ", ".join(symbol_meanings())
    return f"# Terms\n\n{terms}\n\nSymbols of the tolerances: {symbols}. `contactverif list` lists the properties.\n"


def _names(heading: str) -> list[str]:
    """Return the names in a heading, `Node-to-segment (NTS)` or `Slave and master`, in small letters."""
    parts = re.split(r",| and |[()]", heading.replace("`", ""))
    return [name.strip().lower() for name in (heading, *parts) if name.strip()]
