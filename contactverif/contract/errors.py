r"""The errors that contactverif raises on purpose, and the text that stands in them, made fit to be shown.

An error of a caller is a `MisuseError`, whose message says what to change; an error of a plugin is a `ContractError`.
The classes of cases and results call `clean` or `refuse` in their constructors, so that all that is written from them
is clean. The terminal, pages and figures call `printable` as the last guard. Nothing here calls a method of an object
that a plugin made, but for `str(error)`, which may raise.
"""

import difflib
import re
from collections.abc import Iterable
from contextlib import suppress
from traceback import walk_tb
from types import TracebackType
from typing import Any


class ContactverifError(Exception):
    """The base of all errors that contactverif raises on purpose."""


class MisuseError(ContactverifError, ValueError):
    """The caller gave something that cannot be used.

    The message reads ``argument: found …; needed …``.

    Parameters
    ----------
    argument : str
        The name of the argument, as the caller wrote it.
    found : str
        What was there.
    needed : str
        What would have been right.
    """

    def __init__(self, argument: str, found: str, needed: str) -> None:
        super().__init__(f"{argument}: found {found}; needed {needed}")
        self.argument, self.found, self.needed = argument, found, needed


class ContractError(ContactverifError):
    """The plugin broke the contract of a formulation: an answer of the wrong kind, shape or dtype.

    The contract is stated in `contactverif.contract.formulation`.
    """


class NonFiniteError(ContractError):
    """The plugin returned NaN or infinity."""


class PluginError(ContractError):
    """The plugin raised an exception, which is the `__cause__` of this error, or its process ended."""

    # Causes: "exception", "memory", "exit", "signal", "hang" (no answer in time), "channel" (no readable answer) and
    # "not asked": it has ended its process too often to be asked again, or the state is too deep for it. `ended`: its
    # process has ended.
    def __init__(self, message: str, cause: str = "exception", *, ended: bool = False) -> None:
        super().__init__(message)
        self.cause, self.ended = cause, ended


LONGEST_NAME = 200  # Characters of a name.
LONGEST_LINE = 2000  # Characters of a message that are kept.
LONGEST_MESSAGE = 1000  # Characters of the message of an exception, which is a part of a line.
LONGEST_FACT = 20_000  # Characters of a fact about a run, such as its command.

# Python calls these printable, but nobody sees what they are: joiners, fillers, selectors of variants, hyphens that are
# not the one of ASCII, and a third mark on a letter.
_MARK = "[\u0300-\u036f\u0483-\u0489\u0591-\u05bd\u064b-\u065f\u1ab0-\u1aff\u1dc0-\u1dff\u20d0-\u20ff\ufe20-\ufe2f]"
_UNSEEN = re.compile(
    "[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2010-\u2012\u2800\u3164\ufe00-\ufe0f\uffa0\U000e0100-\U000e01ef]"
    f"|(?<={_MARK}{_MARK}){_MARK}"
)
_SPACES = frozenset("\n\u00a0\u2002\u2003\u2007\u2008\u2009\u200a\u202f")  # Harmless, but Python does not print them.
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
    return "".join(
        character if character in _SPACES or character.isprintable() else ascii(character)[1:-1]
        for character in _UNSEEN.sub(lambda match: ascii(match[0])[1:-1], plain)
    )


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


def unknown_name_error(argument: str, name: str, names: Iterable[str], otherwise: str = "") -> MisuseError:
    """Return the error for a name that does not exist; it suggests the nearest names.

    If none is near, it lists all, or says `otherwise` what is needed.
    """
    every = sorted(names)
    needed = otherwise or (f"one of {', '.join(every)}" if every else "a name, but there is none")
    if near := difflib.get_close_matches(name, every, n=3):
        needed = f"a name that exists; the nearest: {', '.join(near)}"
    return MisuseError(argument, ascii(name), needed)  # A hyphen of another kind looks like one.


def parse_name(
    argument: str, text: str, form: str = "NAME or NAME:OPTION=VALUE,OPTION=VALUE"
) -> tuple[str, dict[str, Any]]:
    """Split `name:option=value,option=value` into the name and its options.

    Examples
    --------
    >>> parse_name("formulation", "vts-me:n=4,area=reference")
    ('vts-me', {'n': 4, 'area': 'reference'})
    """
    name, colon, rest = text.partition(":")
    if not name:
        raise MisuseError(argument, ascii(text), form)
    options: dict[str, Any] = {}
    for part in rest.split(",") if colon else ():
        option, equals, value = part.partition("=")
        if not (option and equals and value):
            raise MisuseError(argument, f"{part!a} in {text!a}", form)
        if option in options:
            raise MisuseError(argument, f"{option} twice in {text!r}", "each option once")
        options[option] = {"true": True, "false": False}.get(value, value)
        for number in (float, int):  # An integer stays one.
            with suppress(ValueError):
                options[option] = number(value)
    return name, options
