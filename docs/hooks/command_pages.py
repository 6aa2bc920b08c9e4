"""The page of the command line, made of the commands themselves.

Rule: only what typer documents is used (`registered_commands`, `typer.Option`, `typer.Argument`), because what lies
below changes from one version of typer to the next.
"""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer
from page_text import table
from typer.models import ArgumentInfo, OptionInfo

from contactverif.cli.app import app
from contactverif.explanations.terms import plain

_METAVARS = {int: "INTEGER", float: "NUMBER", Path: "FILE", str: "TEXT"}


@dataclass(frozen=True)
class Parameter:
    """An argument or option of a command, as its function declares it."""

    name: str
    info: ArgumentInfo | OptionInfo
    types: frozenset[type]  # The Python types of its values.
    many: bool  # It may be given several times.
    default: Any  # The value where it is not given; `...` where it must be.

    @property
    def metavar(self) -> str:
        """Its value as the help shows it; empty for a flag."""
        if self.info.metavar:
            return str(self.info.metavar)
        if bool in self.types:
            return ""
        return next((word for kind, word in _METAVARS.items() if kind in self.types), self.name.upper())

    @property
    def flags(self) -> list[str]:
        """The spellings of an option; as in typer, `--name` is one if no long one is declared."""
        declared = list(self.info.param_decls or [])
        long = any(flag.startswith("--") for flag in declared)
        return declared if long else [f"--{self.name.rstrip('_').replace('_', '-')}", *declared]


def parameters_of(function: Callable[..., Any]) -> list[Parameter]:
    """Return the arguments and options that a command declares, in order."""
    hints = typing.get_type_hints(function, include_extras=True)
    parameters = []
    for name, entry in inspect.signature(function).parameters.items():
        annotation, *extras = typing.get_args(hints[name]) if hasattr(hints[name], "__metadata__") else (hints[name],)
        infos = [extra for extra in extras if isinstance(extra, ArgumentInfo | OptionInfo)]
        if infos and not infos[0].hidden:
            leaves = set(_leaves(annotation))
            default = ... if entry.default is entry.empty else entry.default
            parameters.append(Parameter(name, infos[0], frozenset(leaves - {list}), list in leaves, default))
    return parameters


def _leaves(annotation: Any) -> typing.Iterator[type]:
    """Iterate over the types in an annotation such as `list[str] | None`."""
    origin = typing.get_origin(annotation)
    if origin is list:
        yield list
    if origin in (list, typing.Union, types.UnionType):
        for part in typing.get_args(annotation):
            yield from _leaves(part)
    elif origin is typing.Literal:
        yield str
    elif isinstance(annotation, type):
        yield annotation


def command_page() -> str:
    """Return the page of all commands: usage, what each does, arguments and options."""
    commands = {_name(command): command for command in app.registered_commands if not command.hidden}
    rows = [[f"[`contactverif {name}`](#contactverif-{name})", _first(command)] for name, command in commands.items()]
    text = [
        "# Command line\n",
        plain(str(app.info.help or "")) + "\n",
        table(["command", "what it does"], rows),
        "`contactverif COMMAND --help` prints the same in a terminal.\n",
    ]
    for name, command in commands.items():
        text += _command(name, command)
    return "\n".join(text)


def _name(command: typer.models.CommandInfo) -> str:
    assert command.callback is not None
    return command.name or command.callback.__name__.rstrip("_").replace("_", "-")


def _paragraphs(command: typer.models.CommandInfo) -> list[str]:
    text = command.help or inspect.getdoc(command.callback) or ""
    return [part for part in inspect.cleandoc(text).split("\n\n") if part.strip()]


def _first(command: typer.models.CommandInfo) -> str:
    return plain(" ".join(_paragraphs(command)[0].split()))


def _command(name: str, command: typer.models.CommandInfo) -> list[str]:
    assert command.callback is not None
    parameters = parameters_of(command.callback)
    arguments = [entry for entry in parameters if isinstance(entry.info, ArgumentInfo)]
    options = [entry for entry in parameters if isinstance(entry.info, OptionInfo)]
    usage = " ".join(["contactverif", name, *(["[OPTIONS]"] if options else []), *map(_usage, arguments)])
    text = [f"## contactverif {name}\n", f"```text\n{usage}\n```\n", *map(_paragraph, _paragraphs(command))]
    if arguments:
        text.append(table(["argument", "meaning"], [[f"`{entry.metavar}`", _meaning(entry)] for entry in arguments]))
    if options:
        text.append(table(["option", "meaning"], [[_spellings(entry), _meaning(entry)] for entry in options]))
    return text


def _paragraph(text: str) -> str:
    """Return a paragraph; one that begins with a backspace keeps its lines, as it does in a terminal."""
    if not text.startswith("\b"):
        return plain(" ".join(text.split())) + "\n"
    title, _, body = text.lstrip("\b\n").partition("\n")
    return f"{plain(title)}:\n\n```text\n{inspect.cleandoc(body)}\n```\n"


def _usage(argument: Parameter) -> str:
    text = argument.metavar + ("..." if argument.many else "")
    return text if argument.default is ... else f"[{text}]"


def _spellings(option: Parameter) -> str:
    value = f" {option.metavar}" if option.metavar else ""
    return ", ".join(f"`{flag}{value if flag.startswith('--') else ''}`" for flag in option.flags)


def _meaning(parameter: Parameter) -> str:
    default = parameter.default
    simple = isinstance(default, str | int | float) and not isinstance(default, bool) and default != ""
    return plain(parameter.info.help or "") + (f" Default: `{default}`." if simple else "")
