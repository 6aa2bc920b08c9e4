r"""Text of a plugin, a file or a command line, made fit to be shown: cut, and control characters spelled out.

The classes of cases and results call `clean` or `refuse` in their constructors, so that all that is written from them
is clean. The terminal, pages and figures call `printable` as the last guard. Nothing here calls a method of an object
that a plugin made, but for `str(error)`, which may raise.
"""

from __future__ import annotations

import re
from traceback import walk_tb
from types import TracebackType

from contactverif.contract.errors import MisuseError

LONGEST_NAME = 200  # Characters of a name.
LONGEST_LINE = 2000  # Characters of a message that are kept.
LONGEST_MESSAGE = 1000  # Characters of the message of an exception, which is a part of a line.
LONGEST_FACT = 20_000  # Characters of a fact about a run, such as its command.

# Python calls these printable, but nobody sees them: joiners, fillers and selectors of variants.
_UNSEEN = re.compile(
    "[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0\U000e0100-\U000e01ef]"
)
_SPACES = frozenset(
    "\n\u00a0\u2002\u2003\u2007\u2008\u2009\u200a\u202f"
)  # Harmless, though Python does not print them.
_BREAKS = re.compile(r"[ \t]*(?:\r?\n|\t)[ \t\r\n]*")


def one_line(text: str, longest: int = LONGEST_LINE) -> str:
    r"""Return foreign text as one line without control characters, cut behind `longest` characters.

    Examples
    --------
    >>> one_line("red: \x1b[31m, and\na second line")
    'red: \\x1b[31m, and a second line'
    >>> one_line("x" * 20_000_000, longest=5)
    'xxxxx… (20000000 characters)'
    """
    plain = str.__str__(text)  # A subclass of str may have other methods.
    if len(plain) <= longest and plain.isascii() and plain.isprintable():
        return plain
    line = printable(_BREAKS.sub(" ", plain[:longest].strip("\t\r\n")))
    if len(plain) <= longest and len(line) <= longest:
        return line
    return f"{line[:longest]}… ({len(plain)} characters)"


def name_line(text: str) -> str:
    """Return a foreign name as `one_line` does, cut where a name is too long."""
    return one_line(text, LONGEST_NAME)


def printable(text: str) -> str:
    """Return a text of any length in which every character can be shown; line breaks stay."""
    plain = str.__str__(text)
    if plain.replace("\n", "").isprintable() and (plain.isascii() or not _UNSEEN.search(plain)):
        return plain
    return "".join(map(_spell_out, plain))


def describe_error(error: BaseException) -> str:
    """Return class and message of an exception in one line, even if its own methods raise errors."""
    kind = name_line(type.__dict__["__name__"].__get__(type(error)))  # A metaclass may have another `__name__`.
    try:
        message = str(error)
    except KeyboardInterrupt:
        raise
    except BaseException:
        return f"{kind}, whose message cannot be read"
    return f"{kind}: {one_line(message, LONGEST_MESSAGE)}"


def place_of_error(error: BaseException) -> str:
    """Return file and line in which a plugin's own code was when an exception arose, as ` (mine.py, line 7)`.

    The first frame below the caller is the plugin's. The place is that of the last frame in a file of the same folder:
    what lies deeper belongs to a library. It is empty where the exception arose in no code of Python.
    """
    trace: TracebackType | None = BaseException.__dict__["__traceback__"].__get__(error)
    frames = [] if trace is None else [(frame.f_code.co_filename, line) for frame, line in walk_tb(trace.tb_next)]
    places = [(file.replace("\\", "/").rpartition("/"), line) for file, line in frames if file[:1] != "<"]
    names = [f"{name_line(name)}, line {line}" for (folder, _, name), line in places if folder == places[0][0][0]]
    return f" ({names[-1]})" if names else ""


def clean(instance: object, *, names: tuple[str, ...] = (), lines: tuple[str, ...] = ()) -> None:
    """Make attributes of a frozen dataclass fit to be shown; its constructor calls this."""
    for attributes, longest in ((names, LONGEST_NAME), (lines, LONGEST_LINE)):
        for attribute in attributes:
            text = getattr(instance, attribute)
            line = one_line(text, longest)
            if line is not text:
                object.__setattr__(instance, attribute, line)


def refuse(argument: str, *names: str) -> None:
    """Raise an error for a name that other parts refer to, so that it cannot be changed, if it cannot be shown."""
    for name in names:
        if name_line(name) != name:
            raise MisuseError(argument, repr(name_line(name)), f"at most {LONGEST_NAME} characters that can be shown")


def _spell_out(character: str) -> str:
    if character in _SPACES or (character.isprintable() and not _UNSEEN.match(character)):
        return character
    return character.encode("unicode_escape").decode("ascii")
