"""The origin of stored tables: with which commit they were made, and which judge each row is of.

The digest of a judge is that of the code of a property, and of all that it names of exact answers, cases and mechanics.

A row of a stored table keeps the digest of the properties that judged it. A row with another digest than that of today,
or with none, is of an older judge. Comments, docstrings and the places of definitions are no part of a digest, so that
moving code makes no row old; nor are contracts and the run, which carry cases and outcomes.
"""

import ast
import csv
import subprocess
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = {"contactverif": "", "contactverif_properties": "properties/"}
JUDGES = (
    "contactverif_properties",
    *(f"contactverif.{name}" for name in ("mechanics", "oracle", "problems", "sampling", "strategies")),
)
GROUPS = ("contactverif.properties", "contactverif.engine_properties")
DIGITS = 8
COMMITS = ROOT / "reports" / "commits.csv"  # {table: commit}
Place = tuple[str, str]  # A module, and a name in it.


@dataclass(frozen=True)
class Module:
    """What a module defines and imports."""

    definitions: dict[str, ast.AST]
    imports: dict[str, Place]  # {name here: where it is from}


def read(path: str) -> str:
    """Return the text of a file of ours; empty if there is none."""
    return (ROOT / path).read_text(encoding="utf-8") if (ROOT / path).is_file() else ""


@cache
def module(name: str) -> Module:
    """Return what a module defines and imports; nothing if it is not ours."""
    package, *_ = name.split(".")
    if package not in FOLDERS:
        return Module({}, {})
    path = FOLDERS[package] + name.replace(".", "/")
    tree = ast.parse(read(f"{path}.py") or read(f"{path}/__init__.py"))
    definitions: dict[str, ast.AST] = {}
    for node in tree.body:
        match node:
            case (
                ast.FunctionDef(name=defined) | ast.ClassDef(name=defined) | ast.AnnAssign(target=ast.Name(id=defined))
            ):
                definitions[defined] = node
            case ast.Assign(targets=targets):
                named = (part for target in targets for part in ast.walk(target))
                definitions |= {part.id: node for part in named if isinstance(part, ast.Name)}
    found = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module)
    return Module(
        definitions,
        {alias.asname or alias.name: (str(node.module), alias.name) for node in found for alias in node.names},
    )


def resolve(place: Place) -> Place | None:
    """Return where a name that a module uses is defined; None if that is no code of ours."""
    known, name = module(place[0]), place[1]
    if name in known.definitions:
        return place
    return resolve(known.imports[name]) if name in known.imports else None


def uses(place: Place) -> Iterator[Place]:
    """Iterate over the definitions of ours that one of them names."""
    for part in ast.walk(module(place[0]).definitions[place[1]]):
        match part:
            case ast.Attribute(value=ast.Name(id=name), attr=attribute) if name in module(place[0]).imports:
                used = resolve((".".join(module(place[0]).imports[name]), attribute))
            case ast.Name(id=name):
                used = resolve((place[0], name))
            case _:
                used = None
        if used:
            yield used


def closure(place: Place) -> set[Place]:
    """Return all definitions to which one of them leads, itself among them."""
    known, rest = set[Place](), [place]
    while rest:
        place = rest.pop()
        if place not in known:
            known.add(place)
            rest += uses(place)
    return known


@cache
def text(place: Place) -> str:
    """Return a definition without docstrings, comments and line numbers."""
    node = module(place[0]).definitions[place[1]]
    for part in ast.walk(node):
        if isinstance(part, ast.FunctionDef | ast.ClassDef) and ast.get_docstring(part) is not None:
            part.body = part.body[1:] or [ast.Pass()]
    return ast.dump(node)


@cache
def entries() -> dict[str, Place]:
    """Return {id of a property: where it is}."""
    groups = tomllib.loads(read("pyproject.toml"))["project"]["entry-points"]
    found = {name: target.partition(":") for group in GROUPS for name, target in groups[group].items()}
    return {name: (target[0], target[2]) for name, target in found.items()}


@cache
def judge_of(*ids: str) -> str:
    """Return the digest of the properties with these ids; empty if one of them is not there."""
    begin = [resolve(entries()[name]) if name in entries() else None for name in ids]
    places = {place for each in begin if each for place in closure(each) if place[0].startswith(JUDGES)}
    return "" if None in begin else sha256("\n".join(sorted(map(text, places))).encode()).hexdigest()[:DIGITS]


def read_commits() -> dict[str, str]:
    """Return {stored table: commit with which it was made last}."""
    with COMMITS.open(encoding="utf-8", newline="") as stream:
        return {row["table"]: row["commit"] for row in csv.DictReader(stream)}


def keep_commit(table: Path) -> None:
    """Note with which commit a table is made, if it is a stored one."""
    if not table.resolve().is_relative_to(COMMITS.parent):
        return
    answer = subprocess.run(["git", "rev-parse", "--short", "HEAD"], check=True, capture_output=True, text=True)
    commits = read_commits() | {table.resolve().relative_to(COMMITS.parent).as_posix(): answer.stdout.strip()}
    with COMMITS.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows([("table", "commit"), *sorted(commits.items())])
