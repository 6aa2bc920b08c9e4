"""Annotations in a workflow of GitHub: what makes a run fail is shown at the factory of the formulation.

The factory is looked up in the working copy, and nothing is imported.

References
----------
GitHub Docs, Workflow commands for GitHub Actions.
"""

import ast
import importlib.util
import os
from functools import cache
from pathlib import Path

import typer

from contactverif.contract.errors import one_line
from contactverif.contract.result import OPPOSITE_SIGN, Run
from contactverif.isolation.file_reader import check_ordinary
from contactverif.plugins.registry import FORMULATIONS, entries_by_name, modules_of

_INSTALLED = {"site-packages", "dist-packages"}  # An environment may lie in the working folder.
_LARGEST = 1 << 18  # Bytes that are read of a file.
_MOST_HOPS = 8  # A name may be imported from module to module.


def annotate(run: Run) -> None:
    """Print an annotation for all that makes a run fail, if this is a job of a workflow."""
    if os.environ.get("GITHUB_ACTIONS") != "true":
        return
    failures = [(item.formulation, f"{item.formulation} is not loaded", item.reason) for item in run.not_loaded]
    failures += [(name, f"{name}: sign", OPPOSITE_SIGN) for name in run.opposite_signs]
    failures += [
        (row.formulation, f"{row.formulation} {row.property_id}: {row.unexpected}", row.reason)
        for row in run.unexpected
        if not row.omitted
    ]
    for formulation, title, text in failures:
        place = factory_place(formulation)
        words = {} if place is None else {"file": place[0], "line": str(place[1])}
        listed = ",".join(f"{name}={_escape(value, ':,')}" for name, value in {**words, "title": title}.items())
        typer.echo(f"::error {listed}::{_escape(one_line(text))}".encode())  # As bytes it passes `obey_nothing`.


def _escape(text: str, marks: str = "") -> str:
    """Return a text in which no character ends a part of the command."""
    for letter in f"%\r\n{marks}":
        text = text.replace(letter, f"%{ord(letter):02X}")
    return text


@cache
def factory_place(name: str) -> tuple[str, int] | None:
    """Return file and line of the factory of a formulation; of a wrapped one, that of the inner formulation.

    None if the file is not below the working folder, or is that of an installed package.
    """
    inner = name.partition(":")[0].rpartition("/")[2]
    for entry in entries_by_name(FORMULATIONS).get(inner, ()):
        place = _follow(entry.module, entry.attr) if modules_of([entry]) else None
        if place is not None:
            return place[0].relative_to(os.getcwd()).as_posix(), place[1]
    return None


def _follow(module: str, name: str) -> tuple[Path, int] | None:
    """Return file and line where a name of a module is defined, through the imports of packages."""
    for _ in range(_MOST_HOPS):
        file = _file_of(module)
        if file is None:
            return None
        try:
            with file.open("rb") as stream:
                tree = ast.parse(stream.read(_LARGEST))
        except (OSError, ValueError, SyntaxError, RecursionError, MemoryError):
            return file, 1
        for node in tree.body:
            targets = getattr(node, "targets", ())
            if name in (getattr(node, "name", None), *(getattr(target, "id", None) for target in targets)):
                return file, node.lineno
        imports = [
            (node, alias.name)
            for node in tree.body
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
            if (alias.asname or alias.name) == name
        ]
        if not imports:
            return file, 1
        node, name = imports[0]
        parts = module.split(".")
        base = parts[: len(parts) - node.level + (file.name == "__init__.py")] if node.level else []
        module = ".".join(filter(None, (*base, node.module)))
    return None


def _file_of(module: str) -> Path | None:
    """Return the file of a module; None if it is not one of the project, whatever links lead there."""
    top, *rest = module.split(".")
    try:
        spec = importlib.util.find_spec(top)
        path = Path((spec and spec.origin) or "")
        if rest:
            path = path.parent.joinpath(*rest)
            path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        path = path.resolve()
        check_ordinary(path, module, "a file")
        return path if path.is_relative_to(os.getcwd()) and not _INSTALLED & {*path.parts} else None
    except (ImportError, OSError, RuntimeError, ValueError):
        return None
