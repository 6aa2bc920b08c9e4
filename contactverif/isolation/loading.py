"""Formulations that are loaded in processes of their own, and a survey of what is installed.

Rule: nothing of a plugin is imported here, and what its process states is checked like an answer.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import msgspec

from contactverif.contract.errors import ContractError, PluginError
from contactverif.contract.foreign_text import one_line
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.isolation.child import FORKS
from contactverif.isolation.host import host_of, raise_failure
from contactverif.isolation.limits import Limits
from contactverif.isolation.messages import Load, Loaded, Reply, Unloaded, Wraps, encode
from contactverif.isolation.process import PluginProcess, Question
from contactverif.isolation.remote_formulation import RemoteFactory, RemoteSubject


@dataclass(frozen=True, slots=True)
class Wrapper:
    """A name that stands for no formulation by itself: it needs another one, a file, or a kind."""

    name: str
    summary: str  # The first line of the factory's docstring.
    form: str  # What a user writes, `name/NAME`, `name:file=PATH` or `name:kind=KIND`.


def python_program(file: str) -> tuple[str, ...]:
    """Return the command that runs a file, with the folders of this process's modules as its arguments."""
    return sys.executable, file, *filter(None, sys.path)


def load_remote(command: tuple[str, ...], name: str, limits: Limits) -> Subject | NotLoaded:
    """Load a formulation in a process of its own: a program that speaks the protocol and knows formulations by name.

    A wrong name or option is a MisuseError.
    """
    try:
        item = _read_reply(command, name, limits, host_of(command, name, limits).load())
    except ContractError as error:
        return _not_loaded(name, error)
    assert not isinstance(item, Wrapper)
    return item


def survey(command: tuple[str, ...], names: Iterable[str], limits: Limits) -> Iterator[Subject | Wrapper | NotLoaded]:
    """Yield what is installed under each name.

    One process loads no plugin, and a copy of it loads each one. Where processes are not copied, each name has a new
    one. A process that ends is followed by another.
    """
    process: PluginProcess | None = None
    for name in names:
        question = Question(0, "import")
        try:
            process = process or PluginProcess(command, limits)
            process.ask(encode([Load(0, name, survey=True)]), [question])
            yield _read_reply(command, name, limits, raise_failure(question.result, loading=True))
        except ContractError as error:
            process = None if isinstance(error, PluginError) and error.ended else process
            yield _not_loaded(name, error)
        if process is not None and not FORKS:
            process.end()
            process = None
    if process is not None:
        process.end()


def _not_loaded(name: str, error: ContractError) -> NotLoaded:
    ended = isinstance(error, PluginError) and error.ended
    return NotLoaded(name, f"{error.cause}: {error}" if ended else str(error))  # type: ignore[attr-defined]


def _read_reply(command: tuple[str, ...], name: str, limits: Limits, reply: Reply) -> Subject | Wrapper | NotLoaded:
    """Return what a process says that a name is."""
    match reply:
        case Unloaded(_, reason):
            return NotLoaded(name, one_line(reason))
        case Wraps(_, summary, form):
            return Wrapper(name, one_line(summary), one_line(form))
        case Loaded(_, traits, provides):
            return RemoteSubject(RemoteFactory(command, name, limits, _traits(traits), frozenset(provides)))
    raise PluginError(f"import: a {type(reply).__name__} where a formulation was needed", "channel")


def _traits(words: dict[str, Any]) -> Traits:
    """Return the traits that a plugin's process states, checked."""
    evidence = words.get("evidence")
    if isinstance(evidence, dict) and isinstance(evidence.get("source"), str):
        evidence["source"] = one_line(evidence["source"])
    try:
        return msgspec.convert(words, Traits)
    except (msgspec.ValidationError, RecursionError) as error:
        raise ContractError(f"traits: {one_line(str(error))}") from None
