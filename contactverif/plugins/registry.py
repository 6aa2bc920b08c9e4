"""The registry: it finds formulations, engines, properties and problems through entry points, and loads each on demand.

On the command line a formulation is a name with options, `vts-me:n=4`, or a wrapper around one,
`two-pass/nts-ar:area=reference`. Behind a name that wraps nothing a "/" belongs to the value of an option, such as
`uel:file=build/contact.so`. A name that begins with `engine/` is that of an engine, whose option `python` is the
interpreter that it lives in.

Rule: a mistake of the user is a `MisuseError`; a mistake of a plugin is a `NotLoaded`, which becomes a row of the
report, so that the other plugins run.
"""

from __future__ import annotations

import difflib
import inspect
import os
import re
import subprocess
import sys
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import cache, lru_cache, partial
from hashlib import sha256
from importlib.metadata import EntryPoint, entry_points
from importlib.util import cache_from_source, find_spec
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

from contactverif.contract.errors import (
    LONGEST_NAME,
    ContractError,
    MisuseError,
    describe_error,
    name_line,
    parse_name,
    unknown_name_error,
)
from contactverif.contract.property import Property
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import ENGINE, EngineSubject, Subject
from contactverif.isolation import remote
from contactverif.isolation.box import kernel_folder
from contactverif.isolation.host import host_of
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote import Wrapper

if TYPE_CHECKING:
    from contactverif.problems.problem import Problem

FORMULATIONS = "contactverif.formulations"
PROPERTIES = "contactverif.properties"
ENGINE_PROPERTIES = "contactverif.engine_properties"  # Those that are asked of engines alone.
ENGINES = "contactverif.engines"
PROBLEMS = "contactverif.problems"
_RENAMED = {"scale": "total-stiffness", "scaling": "units", "engine.scaling": "engine.units"}  # {former id: id}
_OURS = "contactverif"  # The distribution whose problems keep their names.

_MOST_WRAPPERS = 3  # Each wrapper calls its formulation several times, so time grows exponentially with their number.
_FORM = "NAME, NAME:OPTION=VALUE,OPTION=VALUE or WRAPPER/NAME"
_ENGINE_FORM = "NAME or NAME:OPTION=VALUE,OPTION=VALUE"
_MARKS = ":/"  # They stand before options, and before the formulation that is wrapped.
_RESERVED = ("penalty", "inner")  # Arguments that the harness passes; a user cannot set them as options.
_CODE = frozenset({".py", ".so", ".pyd", ".dylib", ".dll"})
_DIGITS = 16
# {an option: its form} of loaders: without the option such a name stands for no formulation.
_FILE = "file"
_NEEDED = {_FILE: f"{_FILE}=PATH", "kind": "kind=KIND"}
# {annotation of an option: (the types of its values, what it needs in words)}
_FITTING: dict[Any, tuple[tuple[type, ...], str]] = {
    int: ((int,), "a whole number"),
    float: ((int, float), "a number"),
    bool: ((bool,), "true or false"),
    str: ((str,), "a word"),
}


# Entry points


def entries_by_name(group: str) -> dict[str, list[EntryPoint]]:
    """Return the entry points by name, sorted. A name has several where distributions disagree about it."""

    def time_of_change(path: str) -> int:
        try:
            return os.stat(path or ".").st_mtime_ns
        except OSError:
            return 0

    folders = tuple((os.path.abspath(path), time_of_change(path)) for path in sys.path)
    return dict(_read_entries(entry_points, group, folders))


# To list the formulations takes sixty looks, and each would read the files of all distributions.
@lru_cache(maxsize=16)
def _read_entries(
    read: Callable[..., Iterable[EntryPoint]], group: str, folders: tuple[tuple[str, int], ...]
) -> dict[str, list[EntryPoint]]:
    """Return the entry points by name as they are while the folders of distributions are unchanged."""
    by_name: dict[str, list[EntryPoint]] = {}
    for entry in sorted(read(group=group), key=lambda entry: (entry.name, entry.value)):
        same_name = by_name.setdefault(entry.name, [])
        if entry.value not in [other.value for other in same_name]:  # A distribution may be on the path twice.
            same_name.append(entry)
    return by_name


def load_entry(name: str, entries: Sequence[EntryPoint]) -> Any:
    """Return the object that the entry point refers to, or a NotLoaded."""
    if name_line(name) != name or not name.isascii():  # One with a letter of another script may look like ours.
        return NotLoaded(name, f"its name is {name!a}; needed at most {LONGEST_NAME} characters of ASCII")
    if len(entries) > 1:
        return NotLoaded(name, f"registered {len(entries)} times: {', '.join(map(_origin, entries))}")
    if not modules_of(entries):
        return NotLoaded(name, f"its entry point is {entries[0].value!r}; needed MODULE:OBJECT")
    try:
        return entries[0].load()
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # A plugin may raise anything while it is imported.
        reason, named = describe_error(error), entries[0].value
        if getattr(error, "name", None) in named.split(":"):  # A class or a module that has another name by now.
            reason += f"; pyproject.toml names {named}; after a change of entry points run pip install -e ."
        return NotLoaded(name, reason)


def modules_of(entries: Iterable[EntryPoint]) -> set[str]:
    """Return the modules that entry points name; a malformed one names none."""
    return {entry.module for entry in entries if entry.pattern.match(entry.value)}


def _origin(entry: EntryPoint) -> str:
    return f"{entry.value} of {entry.dist.name}" if entry.dist is not None else entry.value


def names_within(text: str) -> set[str]:
    """Return the names of formulations and wrappers in a text, and perhaps parts of a path that are no names."""
    return {part.partition(":")[0] for part in text.split("/")}


def files_within(text: str) -> list[Path]:
    """Return the files that a text names by an option `file`, as far as they exist."""
    paths = [Path(file).expanduser() for file in re.findall(rf"[:,]{_FILE}=([^,]+)", text)]
    return [path.resolve() for path in paths if path.is_file()]


def loads_file(text: str) -> bool:
    """Return whether a name may load a file or run a program: not if its options are plain words and numbers."""
    options = re.findall(r"[:,]([^=,]*)=([^,]*)", text)
    is_plain = re.compile(r"[\w+-]+|[-+]?[\d.]+(e[-+]?\d+)?").fullmatch
    return any(name in (_FILE, "program") or not is_plain(value) for name, value in options)


def package_files(package: str) -> list[tuple[str, Path]]:
    """Return (name, file) of all code of a package, in an order that no machine changes; nothing is imported."""
    try:
        spec = find_spec(package)
    except (ImportError, ValueError):
        spec = None
    if spec is None:
        return []
    if spec.submodule_search_locations is None:  # A module by itself.
        return [(package, Path(str(spec.origin)))]
    files = ((Path(folder), path) for folder in spec.submodule_search_locations for path in Path(folder).rglob("*"))
    return sorted((path.relative_to(folder).as_posix(), path) for folder, path in files if path.suffix in _CODE)


def digest_files(files: Iterable[tuple[str, Path]]) -> str:
    """Return a digest of files and of the names that they go by."""
    total = sha256()
    for name, path in files:
        if not path.is_file():
            continue
        content = path.read_bytes()
        total.update(f"{name} {len(content)} ".encode())
        total.update(content)
    return total.hexdigest()[:_DIGITS]


# Formulations and engines


def formulation_names() -> tuple[str, ...]:
    """Return the names of the installed formulations and wrappers, sorted; nothing is loaded."""
    return tuple(entries_by_name(FORMULATIONS))


def standalone_names(limits: Limits | None = None) -> tuple[str, ...]:
    """Return the names of the formulations that need no other one, file or kind, sorted; all are loaded to tell."""
    items = zip(formulation_names(), load_formulations(limits), strict=True)
    return tuple(name for name, item in items if not isinstance(item, Wrapper))


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


def load_formulation(text: str, limits: Limits | None = None) -> Subject | NotLoaded:
    """Load the formulation that the text names, with its options.

    Parameters
    ----------
    text : str
        A name as on the command line, such as `vts-me:n=4`.
    limits : Limits | None
        The limits of a process of its own, in which the plugin lives; None to load it in this process.

    Returns
    -------
    Subject | NotLoaded
        The formulation, or the reason why the plugin does not load.

    Raises
    ------
    MisuseError
        If the text is malformed, no such formulation is installed, or it has no such option or value. An error about
        an installed name without options is a reason instead.
    """
    try:
        if limits is None:
            make = _load_factory(text)
            return make if isinstance(make, NotLoaded) else subject_of(text, make)
        return remote.load_remote(_worker(), text, _with_store(limits, text))
    except MisuseError as error:
        if text not in formulation_names() or error.found == f"no {_FILE}":
            raise
        return NotLoaded(text, str(error))


def start_loading(text: str, limits: Limits) -> None:
    """Let the process of a formulation load it, while this one does other things; what fails, fails when it is loaded.

    Engines are not begun, and what has begun is not begun again.
    """
    if not text.startswith(ENGINE):
        host = host_of(_worker(), text, _with_store(limits, text))
        with suppress(ContractError):
            if not host.has_process:
                host.begin_load()


def _with_store(limits: Limits, text: str) -> Limits:
    """Return the limits of a formulation's process, with a store of its kernels in the box, if there is one."""
    installed = entries_by_name(FORMULATIONS)
    modules = modules_of(entry for name in names_within(text) for entry in installed.get(name, ()))
    _compile_once(packages := frozenset(module.partition(".")[0] for module in modules))
    if limits.box is not None:  # It keeps compiled kernels, those of all formulations of the same modules and code.
        # A library leaves there what it likes, and another one would load it: so libraries have none that stays.
        keeps = modules and not loads_file(text)
        store = kernel_folder("+".join(sorted(modules)), _digest_of(packages)) if keeps else ""
        return replace(limits, box=replace(limits.box, store=store))
    return limits


@cache
def _digest_of(packages: frozenset[str]) -> str:
    return digest_files(file for package in sorted(packages) for file in package_files(package))


@cache
def _compile_once(packages: frozenset[str]) -> None:
    """Let Python keep compiled files: a plugin's process may write none, and would compile for seconds each time."""
    if sys.dont_write_bytecode:
        return
    for name in sorted(packages | {"numba"}):
        with suppress(ImportError, ValueError, OSError, subprocess.SubprocessError):  # The process says what is wrong.
            spec = find_spec(name)
            source = Path((spec and spec.origin) or "")
            missing = source.suffix == ".py" and not os.path.exists(cache_from_source(source))
            if missing and os.access(source.parent, os.W_OK):
                place = source.parent if spec and spec.submodule_search_locations else source
                # All of numba is too much.
                arguments = ["-c", "import numba"] if name == "numba" else ["-m", "compileall", "-q", str(place)]
                subprocess.run([sys.executable, *arguments], capture_output=True, check=False, timeout=60.0)


def _worker() -> tuple[str, ...]:
    return remote.python_program(str(Path(__file__).with_name("plugin_worker.py")))


def subject_of(name: str, make: Callable[..., Any]) -> Subject | NotLoaded:
    """Call a factory `make(*, penalty)` once, and return its formulation, with every answer checked, or why not.

    A `MisuseError` goes on where the name has options or an inner formulation, which a user may have got wrong.
    """
    try:
        return Subject(name, make)
    except ContractError as error:
        if isinstance(error.__cause__, MisuseError) and any(mark in name for mark in _MARKS):
            raise error.__cause__ from None
        return NotLoaded(name, str(error))


def load_formulations(
    limits: Limits | None = None, *, engines: bool = False
) -> tuple[Subject | Wrapper | NotLoaded, ...]:
    """Load all installed formulations with the defaults of their options; with `engines` also those, which follow."""
    names = [*formulation_names(), *(f"{ENGINE}{name}" for name in (entries_by_name(ENGINES) if engines else ()))]
    return tuple(map(load_with_defaults, names) if limits is None else remote.survey(_worker(), names, limits))


def load_with_defaults(name: str) -> Subject | Wrapper | NotLoaded:
    """Load what is installed under a name, with the defaults of its options.

    A wrapper or loader stands for itself, and so does an engine, whose factory is not called.
    """
    if name.startswith(ENGINE):
        factory = load_entry(plain := name.removeprefix(ENGINE), entries_by_name(ENGINES)[plain])
        return factory if isinstance(factory, NotLoaded) else Wrapper(name, _first_line(factory), "")
    make = load_entry(name, entries_by_name(FORMULATIONS)[name])
    parameters = _parameters_of(make) if callable(make) else {}
    forms = {option: form for option, form in _NEEDED.items() if option in _required_among(parameters)}
    needed = next((f"{name}:{form}" for form in forms.values()), f"{name}/NAME" if "inner" in parameters else "")
    return Wrapper(name, _first_line(make), needed) if needed else load_formulation(name)


def _first_line(make: Any) -> str:
    return (inspect.getdoc(make) or "").partition("\n")[0].rstrip(".")


def load_engine(text: str, limits: Limits | None = None) -> EngineSubject | NotLoaded:
    """Load the engine that a text names, `engine/NAME:OPTION=VALUE`, in this process or, within limits, in its own."""
    name, options = parse_name("engine", text.removeprefix(ENGINE), _ENGINE_FORM)
    installed = entries_by_name(ENGINES)
    if name not in installed:
        raise unknown_name_error("engine", name, installed)
    python = options.pop("python", None)
    make: Any = None
    if limits is None or python is None:
        make = _callable_of(text, installed[name], "**options")
        if isinstance(make, NotLoaded):
            return make
        _check_options(text, make, options)
    if limits is not None:  # The modules of another interpreter need not import here, so its options are not checked.
        program = remote.engine_program(installed[name][0].value, options, None if python is None else str(python))
        return remote.load_remote_engine(program, text, limits)
    try:
        return EngineSubject(text, make(**options))
    except ContractError as error:
        return NotLoaded(text, str(error))
    except Exception as error:  # An engine may raise anything while it is made.
        return NotLoaded(text, f"make: {describe_error(error)}")


# The factory that a text names


def _load_factory(text: str, depth: int = 0) -> Callable[..., Any] | NotLoaded:
    """Return `make(*, penalty)` for the text behind `depth` wrappers, with options and inner formulation filled in."""
    if len(text) > LONGEST_NAME:
        raise MisuseError("formulation", repr(name_line(text)), f"at most {LONGEST_NAME} characters")
    if text.partition(":")[0].endswith(".py"):
        needed = "an installed name (`contactverif new NAME` begins one); in Python, contactverif.verify takes a class"
        raise MisuseError("formulation", f"a file, {text!r}", needed)
    outermost, installed = re.split(f"[{_MARKS}]", text, maxsplit=1)[0], entries_by_name(FORMULATIONS)
    if not outermost:
        raise MisuseError("formulation", repr(text), _FORM)
    if outermost not in installed:
        raise unknown_name_error("formulation", outermost, installed)
    make = _callable_of(text, installed[outermost], "*, penalty, …")
    wraps = not isinstance(make, NotLoaded) and "inner" in _parameters_of(make)
    outer, slash, inner_text = text.partition("/")
    if ":" in outer and not wraps:  # A "/" behind the options of a name that wraps nothing belongs to a value.
        outer, slash = text, ""
    required = [] if isinstance(make, NotLoaded) else _required_among(_parameters_of(make))
    form = next((f"{outermost}:{_NEEDED[option]}" for option in required if option in _NEEDED), _FORM)
    name, options = parse_name("formulation", outer, form)
    if isinstance(make, NotLoaded):
        return make
    _check_options(text, make, options)
    if not slash:
        if wraps:
            raise MisuseError("formulation", repr(text), f"a formulation that {name} wraps: {name}/NAME")
        return partial(make, **options)
    if not wraps:
        raise MisuseError("formulation", repr(text), f"a wrapper before the '/'; {name} wraps nothing")
    if depth >= _MOST_WRAPPERS:
        raise MisuseError("formulation", f"{depth + 1} wrappers before {inner_text!r}", f"at most {_MOST_WRAPPERS}")
    inner = _load_factory(inner_text, depth + 1)
    trial = inner if isinstance(inner, NotLoaded) else subject_of(inner_text, inner)
    if isinstance(trial, NotLoaded):
        return NotLoaded(text, f"{inner_text}: {trial.reason}")
    return partial(make, **options, inner=inner)


def _callable_of(text: str, entries: Sequence[EntryPoint], arguments: str) -> Callable[..., Any] | NotLoaded:
    make = load_entry(entries[0].name, entries)
    if isinstance(make, NotLoaded):
        return NotLoaded(text, make.reason)
    if not callable(make):
        return NotLoaded(text, f"the entry point gives a {type(make).__name__}; needed a factory make({arguments})")
    return cast(Callable[..., Any], make)


def _parameters_of(make: Callable[..., Any]) -> Mapping[str, inspect.Parameter]:
    try:
        return inspect.signature(make).parameters
    except (TypeError, ValueError):  # A factory written in C has no signature and checks its options itself.
        return {}


def _required_among(parameters: Mapping[str, inspect.Parameter]) -> list[str]:
    return [name for name, parameter in parameters.items() if parameter.default is parameter.empty]


def _check_options(text: str, make: Callable[..., Any], options: Mapping[str, Any]) -> None:
    """Refuse unknown and missing options, and values that do not fit their annotation, without calling the factory."""
    parameters = _parameters_of(make)
    by_name = inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
    known = {name: entry for name, entry in parameters.items() if name not in _RESERVED and entry.kind in by_name}
    names = f"it has {', '.join(known)}" if known else "it has none"
    takes_any = not parameters or any(entry.kind is entry.VAR_KEYWORD for entry in parameters.values())
    for option, value in options.items():
        if option in _RESERVED:
            raise MisuseError(f"option {option} of {text!a}", ascii(value), f"nothing: the harness sets it; {names}")
        if option in known:
            if needed := _needed_value(make, option, value):
                raise MisuseError(f"option {option} of {text!a}", ascii(value), f"{needed}; {names}")
        elif not takes_any:
            near = difflib.get_close_matches(option, known, n=1)
            nearest = f" (nearest: {near[0]})" if near else ""
            raise MisuseError(f"option of {text!a}", ascii(option), f"an option that exists; {names}{nearest}")
    for name in _required_among(known):
        if name not in options:
            raise MisuseError(f"options of {text!a}", f"no {name}", f"{_NEEDED.get(name, f'{name}=VALUE')}; {names}")


def _needed_value(make: Callable[..., Any], option: str, value: Any) -> str:
    """Return what the annotation of an option needs instead of the value; empty if the value may fit."""
    try:
        annotation = typing.get_type_hints(make).get(option)
    except Exception:  # An annotation that cannot be evaluated is no reason to refuse a value.
        return ""
    if typing.get_origin(annotation) is Literal:
        choices = typing.get_args(annotation)
        return "" if value in choices else "one of " + ", ".join(map(str, choices))
    types, needed = _FITTING.get(annotation, ((object,), ""))
    return "" if isinstance(value, types) and (annotation is bool or not isinstance(value, bool)) else needed


# Properties


def installed_properties(*, engines: bool = False) -> Mapping[str, Sequence[EntryPoint]]:
    """Return the entry points of the installed properties by id, sorted; with `engines` also those of engines alone.

    To read them takes longer than to load a property, so read them once to load many.
    """
    of_engines = entries_by_name(ENGINE_PROPERTIES) if engines else {}
    return dict(sorted((entries_by_name(PROPERTIES) | of_engines).items()))


def property_ids(*, engines: bool = False) -> tuple[str, ...]:
    """Return the ids of the installed properties, sorted; with `engines` also those of engines alone."""
    return tuple(installed_properties(engines=engines))


def matching_ids(globs: Sequence[str], *, engines: bool = False) -> tuple[str, ...]:
    """Return the ids of the properties that `load_properties` loads; it imports them only to look for a family."""
    installed, matching = installed_properties(engines=engines), set[str]()
    for glob in globs:
        ids = {name for name in installed if fnmatchcase(name, glob)}
        if not ids:
            loaded = (load_property(name, installed) for name in installed)
            family = glob.removesuffix(".*")
            ids = {item.id for item in loaded if isinstance(item, Property) and item.family == family}
        if not ids:
            raise unknown_property_error("property", glob, installed)
        matching |= ids
    return tuple(name for name in installed if not globs or name in matching)


def unknown_property_error(argument: str, name: str, ids: Iterable[str]) -> MisuseError:
    """Return the error for an id that no property has; it names the new id of a property that was renamed."""
    if name in _RENAMED:
        return MisuseError(argument, repr(name), f"{_RENAMED[name]!r}, the new id of that property")
    return unknown_name_error(argument, name, ids)


def load_properties(globs: Sequence[str] = ("*",), *, engines: bool = False) -> tuple[Property | NotLoaded, ...]:
    """Load the properties whose id matches one of the patterns, sorted by id.

    Parameters
    ----------
    globs : Sequence[str]
        Patterns such as `patch.*`, or names of families such as `invariants`; none at all means all properties.
    engines : bool
        Also those that are asked of engines alone.

    Returns
    -------
    tuple[Property | NotLoaded, ...]
        The properties, or why one does not load.

    Raises
    ------
    MisuseError
        If a pattern matches nothing.
    """
    installed = installed_properties(engines=engines)
    return tuple(load_property(name, installed) for name in matching_ids(globs, engines=engines))


def load_property(name: str, installed: Mapping[str, Sequence[EntryPoint]]) -> Property | NotLoaded:
    """Load the property of that id, one of `installed_properties`."""
    loaded = load_entry(name, installed[name])
    if isinstance(loaded, NotLoaded | Property) and getattr(loaded, "id", name) == name:
        return loaded
    description = f"the property {loaded.id!r}" if isinstance(loaded, Property) else f"a {type(loaded).__name__}"
    needed = f"a contactverif.contract.property.Property with the id {name}"
    return NotLoaded(name, f"the entry point gives {description}; needed {needed}")


def the_property(property_id: str) -> Property:
    """Return the property of that id; one that does not load is a mistake here."""
    installed = installed_properties(engines=True)
    if property_id not in installed:  # A pattern is no id.
        raise unknown_property_error("property", property_id, installed)
    question = load_property(property_id, installed)
    if isinstance(question, NotLoaded):
        raise MisuseError("property", f"{property_id}, which does not load ({question.reason})", "one that loads")
    return question


# Problems


def load_problems() -> dict[str, Problem | NotLoaded]:
    """Load the installed problems with an exact answer by name, those of lower rank first.

    Another distribution that registers the name of one of ours does not replace it, and is listed by its entry point.
    """
    from contactverif.problems.problem import Problem  # It needs mechanics, which most commands do not.

    problems: dict[str, Problem | NotLoaded] = {}
    for name, entries in entries_by_name(PROBLEMS).items():
        ours = [entry for entry in entries if entry.dist is not None and entry.dist.name == _OURS]
        for entry in (entry for entry in entries if ours and entry not in ours):
            words = f"is registered as {name}, the name of a problem of {_OURS}; needed another name"
            problems[entry.value] = NotLoaded(entry.value, f"{_origin(entry)} {words}")
        loaded = load_entry(name, ours or entries)
        if not isinstance(loaded, NotLoaded | Problem):
            needed = "a contactverif.problems.problem.Problem"
            loaded = NotLoaded(name, f"the entry point gives a {type(loaded).__name__}, not {needed}")
        problems[name] = loaded
    return dict(sorted(problems.items(), key=lambda item: item[1].rank if isinstance(item[1], Problem) else inf))
