"""The words of the project, the symbols of the tolerances and the traits, by the names that a user looks up."""

import inspect
import re
from functools import cache
from importlib.resources import files

from contactverif.contract.traits import Abilities, Evidence, PatchPromises, Promises, Rules


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
        parts = re.split(r",| and |[()]", heading.replace("`", ""))  # `Node-to-segment (NTS)`, `Slave and master`
        names = [name.strip().lower() for name in (heading, *parts) if name.strip()]
        texts |= dict.fromkeys(names, f"# {heading}\n\n{text}\n")
    return texts


def term_text(name: str) -> str:
    """Return the text about a term or a symbol, in Markdown; empty if there is none of that name."""
    if meaning := symbol_meanings().get(name):
        return f"# {name}\n\nA symbol of the tolerances: {meaning}.\n"
    return {_key(each): text for each, text in term_texts().items()}.get(_key(name), "")


def _key(name: str) -> str:
    """Return a name in small letters and in the singular, by which it is looked up."""
    words = re.sub(r"[-_\s]+", " ", name.strip().lower())
    return re.sub(r"(?<=ss)es\b|(?<!s)s\b", "", re.sub(r"ies\b", "y", words))


def list_of_terms() -> str:
    """Return in Markdown all terms, in the order of the page, and what else there is to look up."""
    headings = dict.fromkeys(text.partition("\n")[0].removeprefix("# ") for text in term_texts().values())
    terms, symbols = "\n".join(f"- {heading}" for heading in headings), ", ".join(symbol_meanings())
    others = f"Symbols of the tolerances: {symbols}.\n\nTraits: {', '.join(trait_names())}.\n"
    return f"# Terms\n\n{terms}\n\n{others}\n`contactverif list` lists the properties.\n"


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
            if _key(entry) == _key(wanted):
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
