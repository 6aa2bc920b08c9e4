"""The registry of engines, which are found through entry points, and of whatever can be judged by its name.

A name that begins with `engine/` is that of an engine; every other one is that of a formulation. The option `python` of
any engine is the interpreter that it lives in.
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from importlib.metadata import entry_points

from contactverif.contract.engine_subject import ENGINE, EngineSubject
from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.foreign_text import describe_error
from contactverif.contract.names import parse_name, unknown_name_error
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote_engine import engine_program, load_remote_engine
from contactverif.plugins.registry import check_options, entries_by_name, load_entry, load_formulation, parameters_of

ENGINES = "contactverif.engines"
_PYTHON = "python"
_FORM = "NAME or NAME:OPTION=VALUE,OPTION=VALUE"


def describe_engines() -> dict[str, str]:
    """Return the installed engines, sorted, each with the first line of its docstring, or why it does not load."""
    words = {}
    for name, entries in entries_by_name(ENGINES).items():
        make = load_entry(name, entries)
        if isinstance(make, NotLoaded):
            words[name] = f"not loaded: {make.reason}"
        else:
            words[name] = (inspect.getdoc(make) or "").partition("\n")[0].rstrip(".")
    return words


def has_engine(names: Sequence[str]) -> bool:
    """Return whether one of the names is that of an engine."""
    return any(name.startswith(ENGINE) for name in names)


def load_subject(text: str, limits: Limits | None = None) -> Subject | NotLoaded:
    """Load the formulation or the engine that a text names, as `load_formulation` does."""
    return load_engine(text, limits) if text.startswith(ENGINE) else load_formulation(text, limits)


def the_subject(text: str, limits: Limits | None = None) -> Subject:
    """Return the formulation or engine of that name; one that does not load is a mistake here."""
    return that_loads(text, load_subject(text, limits))


def that_loads(text: str, loaded: Subject | NotLoaded) -> Subject:
    """Return what was loaded by that name; that it does not load is a mistake here."""
    if isinstance(loaded, NotLoaded):
        raise MisuseError("formulation", f"{text}, which does not load ({loaded.reason})", "one that loads")
    return loaded


def load_engine(text: str, limits: Limits | None = None) -> EngineSubject | NotLoaded:
    """Load the engine that a text names, `engine/NAME:OPTION=VALUE`, in this process or, within limits, in its own."""
    name, options = parse_name("engine", text.removeprefix(ENGINE), _FORM)
    installed = entries_by_name(ENGINES)
    if name not in installed:
        raise unknown_name_error("engine", name, installed)
    python = options.pop(_PYTHON, None)
    if limits is not None and python is not None:  # Its modules need not import here, so its options are not checked.
        (entry, *_) = entry_points(group=ENGINES, name=name)
        return load_remote_engine(engine_program(entry.value, options, str(python)), text, limits)
    make = load_entry(name, installed[name])
    if isinstance(make, NotLoaded):
        return NotLoaded(text, make.reason)
    if not callable(make):
        return NotLoaded(text, f"the entry point gives a {type(make).__name__}; needed a factory make(**options)")
    check_options(text, make, parameters_of(make), options)
    if limits is not None:
        return load_remote_engine(engine_program(installed[name][0].value, options), text, limits)
    try:
        return EngineSubject(text, make(**options))
    except ContractError as error:
        return NotLoaded(text, str(error))
    except Exception as error:  # An engine may raise anything while it is made.
        return NotLoaded(text, f"make: {describe_error(error)}")
