"""Finds formulations and properties through entry points; loads one when it is asked for, never before.

On the command line a formulation is a name with options, `vts-me:n=4`, or a wrapper around one,
`two-pass/nts-ar:area=reference`. What the caller wrote wrong is a `MisuseError`; what the plugin did wrong is a
`NotLoaded`, a row of the report, so that the others run.
"""

from __future__ import annotations

import difflib
import inspect
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import partial
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Literal

from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.names import parse_name, unknown_name_error
from contactverif.contract.property import Property
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject

FORMULATIONS = "contactverif.formulations"
PROPERTIES = "contactverif.properties"

_FORM = "NAME, NAME:OPTION=VALUE,OPTION=VALUE or WRAPPER/NAME"
_RESERVED = ("penalty", "inner")  # given by the harness, never as options


@dataclass(frozen=True, slots=True)
class Wrapper:
    """What is a formulation only around another one, `name/NAME`; `summary` is the first line that its factory says."""

    name: str
    summary: str


def formulation_names() -> tuple[str, ...]:
    """The names of the installed formulations and wrappers, sorted; nothing is loaded."""
    return tuple(_installed(FORMULATIONS))


def standalone_names() -> tuple[str, ...]:
    """The names without those of wrappers, sorted; all are loaded, since their factories tell which is which."""
    return tuple(name for name in formulation_names() if _wrapper(name) is None)


def property_ids() -> tuple[str, ...]:
    """The ids of the installed properties, sorted; nothing is loaded."""
    return tuple(_installed(PROPERTIES))


def load_formulation(text: str) -> Subject | NotLoaded:
    """The formulation that the text names, with its options.

    Raises
    ------
    MisuseError
        If the text is malformed, no such formulation is installed, or it has no such option or value.
    """
    make = _factory(text)
    return make if isinstance(make, NotLoaded) else subject_of(text, make)


def subject_of(name: str, make: Callable[..., Any]) -> Subject | NotLoaded:
    """A factory `make(*, penalty)` put on trial; a `NotLoaded` if it raises or makes no formulation.

    Raises
    ------
    MisuseError
        If the factory raises one, which it does for the value of an option.
    """
    try:
        return Subject(name, make)
    except ContractError as error:
        if isinstance(error.__cause__, MisuseError):
            raise error.__cause__ from None
        return NotLoaded(name, str(error))


def load_formulations() -> tuple[Subject | Wrapper | NotLoaded, ...]:
    """All installed formulations with their own choice of options, for a list; one that needs more is not loaded."""
    return tuple(_by_its_name(name) for name in formulation_names())


def load_properties(globs: Sequence[str] = ("*",)) -> tuple[Property | NotLoaded, ...]:
    """The properties whose id matches one of the patterns (all, if there are none), sorted by id.

    Raises
    ------
    MisuseError
        If a pattern matches nothing.
    """
    names = property_ids()
    for glob in globs:
        if not any(fnmatchcase(name, glob) for name in names):
            raise unknown_name_error("property", glob, names)
    chosen = [name for name in names if not globs or any(fnmatchcase(name, glob) for glob in globs)]
    return tuple(_property(name) for name in chosen)


def _installed(group: str) -> dict[str, list[EntryPoint]]:
    """Entry points by name, sorted; more than one under a name where two of them disagree."""
    found: dict[str, list[EntryPoint]] = {}
    for entry in sorted(entry_points(group=group), key=lambda entry: (entry.name, entry.value)):
        same_name = found.setdefault(entry.name, [])
        if entry.value not in [other.value for other in same_name]:  # a distribution may be on the path twice
            same_name.append(entry)
    return found


def _loaded(name: str, entries: Sequence[EntryPoint]) -> Any:
    """What the entry point refers to, or a NotLoaded."""
    if len(entries) > 1:
        return NotLoaded(name, f"registered {len(entries)} times: {', '.join(map(_origin, entries))}")
    try:
        return entries[0].load()
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        return NotLoaded(name, f"{type(error).__name__}: {error}")


def _origin(entry: EntryPoint) -> str:
    return f"{entry.value} of {entry.dist.name}" if entry.dist is not None else entry.value


def _property(name: str) -> Property | NotLoaded:
    found = _loaded(name, _installed(PROPERTIES)[name])
    if isinstance(found, NotLoaded | Property) and getattr(found, "id", name) == name:
        return found
    what = f"the property {found.id!r}" if isinstance(found, Property) else f"a {type(found).__name__}"
    return NotLoaded(
        name, f"the entry point gives {what}; needed a contactverif.contract.property.Property with the id {name}"
    )


def _by_its_name(name: str) -> Subject | Wrapper | NotLoaded:
    wrapper = _wrapper(name)
    if wrapper is not None:
        return wrapper
    try:
        return load_formulation(name)
    except MisuseError as error:  # an option without a default
        return NotLoaded(name, str(error))


def _wrapper(name: str) -> Wrapper | None:
    """None where the name is that of a formulation, or of what does not load."""
    make = _loaded(name, _installed(FORMULATIONS)[name])
    if not callable(make) or not _wraps(_parameters(make)):
        return None
    return Wrapper(name, (inspect.getdoc(make) or "").partition("\n")[0].rstrip("."))


def _wraps(parameters: Mapping[str, inspect.Parameter]) -> bool:
    return "inner" in parameters


def _factory(text: str) -> Callable[..., Any] | NotLoaded:
    """`make(*, penalty)` for the text, options and inner formulation filled in."""
    outer, slash, inner_text = text.partition("/")
    name, options = parse_name("formulation", outer, _FORM)
    installed = _installed(FORMULATIONS)
    if name not in installed:
        raise unknown_name_error("formulation", name, installed)
    make = _loaded(name, installed[name])
    if isinstance(make, NotLoaded):
        return NotLoaded(text, make.reason)
    if not callable(make):
        return NotLoaded(text, f"the entry point gives a {type(make).__name__}; needed a factory make(*, penalty, …)")
    parameters = _parameters(make)
    _check_options(text, make, parameters, options)
    wraps = _wraps(parameters)
    if wraps and not slash:
        raise MisuseError("formulation", repr(text), f"a formulation that {name} wraps: {name}/NAME")
    if slash and not wraps:
        raise MisuseError("formulation", repr(text), f"a wrapper before the '/'; {name} wraps nothing")
    if wraps:
        inner = _factory(inner_text)
        if not isinstance(inner, NotLoaded):
            trial = subject_of(inner_text, inner)
            inner = trial if isinstance(trial, NotLoaded) else inner
        if isinstance(inner, NotLoaded):
            return NotLoaded(text, f"{inner_text}: {inner.reason}")
        options["inner"] = inner
    return partial(make, **options)


def _parameters(make: Callable[..., Any]) -> Mapping[str, inspect.Parameter]:
    try:
        return inspect.signature(make).parameters
    except (TypeError, ValueError):  # written in C: it has to say itself what it does not like
        return {}


def _check_options(
    text: str, make: Callable[..., Any], parameters: Mapping[str, inspect.Parameter], options: Mapping[str, Any]
) -> None:
    """What can be said about options without calling the factory: their names, and values against annotations."""
    takes_any = not parameters or any(entry.kind is entry.VAR_KEYWORD for entry in parameters.values())
    known = {
        name: entry
        for name, entry in parameters.items()
        if name not in _RESERVED and entry.kind in (entry.KEYWORD_ONLY, entry.POSITIONAL_OR_KEYWORD)
    }
    has = f"it has {', '.join(known)}" if known else "it has none"
    for option, value in options.items():
        if option in _RESERVED:
            raise MisuseError(f"option {option} of {text!r}", repr(value), f"nothing: the harness gives it; {has}")
        if option not in known and not takes_any:
            near = difflib.get_close_matches(option, known, n=1)
            nearest = f" (nearest: {near[0]})" if near else ""
            raise MisuseError(f"option of {text!r}", repr(option), f"an option that exists; {has}{nearest}")
        needed = _refused(make, known.get(option), value)
        if needed:
            raise MisuseError(f"option {option} of {text!r}", repr(value), f"{needed}; {has}")
    missing = [name for name, entry in known.items() if entry.default is entry.empty and name not in options]
    if missing:
        raise MisuseError(f"options of {text!r}", f"no {missing[0]}", f"{missing[0]}=VALUE; {has}")


def _refused(make: Callable[..., Any], parameter: inspect.Parameter | None, value: Any) -> str:
    """Empty, or what the annotation of the option wants instead of the value; silent where it cannot tell."""
    if parameter is None:
        return ""
    try:
        wanted = typing.get_type_hints(make).get(parameter.name)
    except Exception:  # a hint that cannot be evaluated is no reason to refuse anything
        return ""
    if typing.get_origin(wanted) is Literal:
        choices = typing.get_args(wanted)
        return "" if value in choices else "one of " + ", ".join(map(str, choices))
    fits = {int: (int,), float: (int, float), bool: (bool,), str: (str,)}
    if wanted not in fits or (isinstance(value, fits[wanted]) and (wanted is bool or not isinstance(value, bool))):
        return ""
    return {int: "a whole number", float: "a number", bool: "true or false", str: "a word"}[wanted]
