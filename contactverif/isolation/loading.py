"""Formulations that are loaded in processes of their own, and a survey of what is installed.

Rule for the next editor: nothing of a plugin is imported here, and what its process states is checked like an answer.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from contactverif.contract.errors import ContractError, PluginError
from contactverif.contract.foreign_text import one_line
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.isolation.host import raise_failure
from contactverif.isolation.limits import Limits
from contactverif.isolation.messages import Failure, Loaded, Reply, Survey, Unloaded, Wraps, encode
from contactverif.isolation.process import PluginProcess
from contactverif.isolation.remote_formulation import RemoteFactory


@dataclass(frozen=True, slots=True)
class Wrapper:
    """A formulation that works only around another one, `name/NAME`.

    Attributes
    ----------
    name : str
        The name of the entry point.
    summary : str
        The first line of the factory's docstring.
    """

    name: str
    summary: str


def load_remote(loader: str, name: str, limits: Limits) -> Subject | NotLoaded:
    """Load a formulation in a process of its own.

    Parameters
    ----------
    loader : str
        The function that loads a name there, as ``"module:function"``; it returns a `Subject` or a `NotLoaded`.
    name : str
        The name as on the command line.
    limits : Limits
        The limits of the process.

    Returns
    -------
    Subject | NotLoaded
        The formulation, or the reason why it does not load.

    Raises
    ------
    MisuseError
        If the name or its options are wrong.
    """
    factory = RemoteFactory(loader, name, limits)
    try:
        item = _read_finding(name, factory, factory.host.load())
    except ContractError as error:
        return _not_loaded(name, error)
    assert not isinstance(item, Wrapper)
    return item


def survey(loader: str, names: Iterable[str], limits: Limits) -> Iterator[Subject | Wrapper | NotLoaded]:
    """Yield what is installed under each name. One process loads them all; one that ends is followed by another.

    Parameters
    ----------
    loader : str
        The function that loads a name there, as ``"module:function"``; it returns a `Wrapper`, too.
    names : Iterable[str]
        The names of entry points.
    limits : Limits
        The limits of the process.
    """
    process: PluginProcess | None = None
    for name in names:
        process = process or PluginProcess(limits)
        try:
            (reply,) = process.ask(encode([Survey(loader, name)]), ["import"])
            yield _read_finding(name, RemoteFactory("", name, limits), reply)
        except PluginError as error:
            process = None if error.ended else process
            yield _not_loaded(name, error)
        except ContractError as error:
            yield _not_loaded(name, error)
    if process is not None:
        process.end()


def _not_loaded(name: str, error: ContractError) -> NotLoaded:
    ended = isinstance(error, PluginError) and error.ended
    return NotLoaded(name, f"{error.cause}: {error}" if ended else str(error))  # type: ignore[attr-defined]


def _read_finding(name: str, factory: RemoteFactory, reply: Reply) -> Subject | Wrapper | NotLoaded:
    """Return what a process says that a name is."""
    match reply:
        case Unloaded(reason):
            return NotLoaded(name, one_line(reason))
        case Wraps(summary):
            return Wrapper(name, one_line(summary))
        case Loaded(words, provides):
            return Subject.of_parts(name, factory, _traits(words), frozenset(provides))
        case Failure():
            raise_failure(reply, loading=True)
    raise PluginError(f"import: a {type(reply).__name__} where a formulation was needed", "channel")


def _traits(words: Mapping[str, Any]) -> Traits:
    """Return the traits that a plugin's process states, checked."""
    values: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in words.items()}
    if isinstance(values.get("source"), str):
        values["source"] = one_line(values["source"])
    try:
        return Traits(**values)
    except TypeError as error:
        raise ContractError(f"traits: {error}") from None
