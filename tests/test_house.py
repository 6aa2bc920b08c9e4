"""The rules of the house that a reviewer would forget: who may import what, and what every file and package must have.

The table ROOMS is the rule; it is read against the imports of every source file, wherever in the file they stand.
"""

from __future__ import annotations

import ast
import configparser
import importlib
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES = [ROOT / package for package in PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]]
FILES = {"glob", "io", "os", "pathlib", "pickle", "shutil", "socket", "sqlite3", "subprocess", "tempfile"}


@dataclass(frozen=True)
class Room:
    """What may be imported from here, besides the room's own package and the standard library.

    Attributes
    ----------
    modules : of the package contactverif, if the room lies in it; else the room is the folder of its name.
    rooms : first-party.
    others : third-party, with all that is below them.
    never : of the standard library and the builtins.
    """

    modules: tuple[str, ...] = ()
    rooms: tuple[str, ...] = ()
    others: tuple[str, ...] = ()
    never: frozenset[str] = frozenset()


QUIET = frozenset(FILES | {"print", "open", "input"})
BODIES = ("bulk", "scene", "newton")
INSIDE = ("contracts", "compiled", "projection", "mesh", *BODIES, "strategies", "oracle", "run", "reports")
ROOMS = {
    "contracts": Room(
        ("", "arrays", "errors", "names", "interface", "formulation", "case", "property", "subject", "result", "body"),
        ("contracts",),
        ("numpy", "scipy.sparse"),
        QUIET,
    ),
    "compiled": Room(("compiled",), (), ("numba",), QUIET),
    "projection": Room(("projection",), ("contracts", "compiled"), ("numpy", "numba"), QUIET),
    "mesh": Room(("mesh",), ("contracts",), ("numpy", "meshio")),
    "bulk": Room(("bulk",), ("contracts",), ("numpy", "scipy", "skfem"), QUIET),
    "scene": Room(
        ("scene", "blocks", "disk", "hertz", "catalogue"), ("contracts", "bulk", "scene"), ("numpy", "scipy"), QUIET
    ),
    "newton": Room(("newton", "linear"), ("contracts", "scene", "newton"), ("numpy", "scipy"), QUIET),
    "strategies": Room(("strategies",), ("contracts", "scene", "strategies", "oracle"), ("numpy", "hypothesis"), QUIET),
    "oracle": Room(("oracle",), ("contracts", "oracle"), ("numpy",), QUIET),
    "plugins": Room((), ("contracts", "compiled", "projection"), ("numpy", "scipy", "numba"), QUIET),
    "properties": Room(
        (), ("contracts", "oracle", "scene", "newton", "strategies"), ("numpy", "scipy", "hypothesis"), QUIET
    ),
    "reports": Room((), ("contracts",), ("numpy", "xarray", "netCDF4", "matplotlib", "meshio", "jinja2", "markupsafe")),
    "run": Room(
        ("registry", "runner", "generate", "profile", "provenance"),
        ("contracts", "scene", "strategies", "run"),
        ("numpy", "hypothesis"),
    ),
    "studies": Room(("studies", "pictures"), (*INSIDE, "studies"), ("numpy", "scipy", "hypothesis")),
    "front": Room(  # knows everything, but no formulation and no property by name; imported by nobody
        (
            *("cli", "pytest_plugin", "testing", "tables", "progress", "asked", "drawing", "gallery"),
            *("comparing", "side_by_side"),
        ),
        (*INSIDE, "studies", "front"),
        ("numpy", "hypothesis", "typer", "rich", "pytest"),
    ),
}
OUR_NAMES = {package.name for package in PACKAGES}


def module_name(path: Path) -> str:
    """`plugins/contactverif_nts/eq6.py` is `contactverif_nts.eq6`."""
    package = next(package for package in PACKAGES if package in path.parents)
    return ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__")


SOURCES = {module_name(path): path for package in PACKAGES for path in sorted(package.rglob("*.py"))}


def room_of(module: str) -> str:
    """The room that a first-party module is in, empty if the table has none for it."""
    top, _, rest = module.partition(".")
    if top != "contactverif":
        return next((package.parent.name for package in PACKAGES if package.name == top), "")
    first = rest.partition(".")[0]
    return next((name for name, room in ROOMS.items() if first in room.modules), "")


def imported(tree: ast.AST, module: str, *, is_package: bool) -> Iterator[tuple[int, str]]:
    """(line, dotted name) of all that a file imports, and of the builtins that it calls."""
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names):
                yield from ((node.lineno, alias.name) for alias in names)
            case ast.ImportFrom(module=source, names=names, level=level):
                parts = module.split(".")
                above = parts[: len(parts) - level + is_package] if level else []
                base = ".".join([*above, *([source] if source else [])])
                for alias in names:
                    whole = f"{base}.{alias.name}"
                    ours = base.partition(".")[0] in OUR_NAMES
                    yield node.lineno, base if ours and whole not in SOURCES else whole
            case ast.Call(
                func=ast.Name(id="__import__") | ast.Attribute(attr="import_module"), args=[ast.Constant(value)]
            ):
                yield node.lineno, str(value)
            case ast.Call(func=ast.Name(id=name)):
                yield node.lineno, f"builtins.{name}"


def breaches(source: str, module: str, *, is_package: bool = False, place: str = "fake.py") -> list[str]:
    """What a file imports and its room may not, a line each."""
    room = room_of(module)
    if not room:
        return [f"{place}:1: {module} is in no room; give it one in ROOMS"]
    rule = ROOMS[room]
    found = []
    for line, name in imported(ast.parse(source), module, is_package=is_package):
        top = name.partition(".")[0]
        if top in OUR_NAMES:
            own = top == module.partition(".")[0] and top != "contactverif"
            other = room_of(name)
            if not own and other not in rule.rooms:
                found.append(f"{place}:{line}: {room} may not import {other or name}")
        elif top == "builtins" or top in sys.stdlib_module_names:
            used = name.removeprefix("builtins.") if top == "builtins" else top
            if used in rule.never:
                found.append(f"{place}:{line}: {room} may not use {used}")
        elif not any(f"{name}.".startswith(f"{allowed}.") for allowed in rule.others):
            found.append(f"{place}:{line}: {room} may not import {name}")
    return found


@pytest.mark.parametrize("module", SOURCES)
def test_imports_run_one_way(module: str) -> None:
    path = SOURCES[module]
    place = str(path.relative_to(ROOT))
    found = breaches(path.read_text(), module, is_package=path.stem == "__init__", place=place)
    assert not found, "\n" + "\n".join(found)


@pytest.mark.parametrize(
    ("module", "source", "message"),
    [
        (
            "contactverif_properties.a",
            "from contactverif.projection import foot",
            "properties may not import projection",
        ),
        ("contactverif_properties.a", "from contactverif import projection", "properties may not import projection"),
        ("contactverif_properties.a", "import contactverif.projection as p", "properties may not import projection"),
        ("contactverif_properties.a", "import contactverif_nts", "properties may not import plugins"),
        (
            "contactverif_properties.a",
            "def f():\n\n  from contactverif_nts.eq6 import x",
            "properties may not import plugins",
        ),
        ("contactverif_properties.a", "print(1)", "properties may not use print"),
        ("contactverif_properties.a", "from pathlib import Path", "properties may not use pathlib"),
        (
            "contactverif_properties.a",
            "import importlib as i\ni.import_module('numba')",
            "properties may not import numba",
        ),
        (
            "contactverif_nts.a",
            "if TYPE_CHECKING:\n    from contactverif.runner import run",
            "plugins may not import run",
        ),
        ("contactverif_nts.a", "import contactverif_properties.patch", "plugins may not import properties"),
        ("contactverif_nts.a", "import hypothesis.strategies", "plugins may not import hypothesis.strategies"),
        ("contactverif_nts.a", "open('x')", "plugins may not use open"),
        ("contactverif_reports.a", "from contactverif import oracle", "reports may not import oracle"),
        ("contactverif.interface", "from .mesh import read", "contracts may not import mesh"),
        ("contactverif.interface", "from . import mesh", "contracts may not import mesh"),
        ("contactverif.subject", "import scipy", "contracts may not import scipy"),
        ("contactverif.subject", "from scipy import linalg", "contracts may not import scipy.linalg"),
        ("contactverif.subject", "import numpyro", "contracts may not import numpyro"),
        ("contactverif.oracle", "from contactverif.strategies import x", "oracle may not import strategies"),
        ("contactverif.runner", "from contactverif.cli import main", "run may not import front"),
        ("contactverif.runner", "from contactverif_reports import write", "run may not import reports"),
        ("contactverif.cli", "from contactverif_nts import nts", "front may not import plugins"),
        ("contactverif.runner", "from contactverif.shed import x", "run may not import contactverif.shed"),
        ("contactverif.shed", "import numpy", "contactverif.shed is in no room; give it one in ROOMS"),
    ],
)
def test_the_reader_of_imports_sees_a_wrong_one(module: str, source: str, message: str) -> None:
    line = 1 + source[: max(source.rfind(word) for word in ("import", "print", "open"))].count("\n")
    assert breaches(source, module) == [f"fake.py:{line}: {message}"]


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("contactverif_properties.a", "from contactverif import Case, oracle\nimport contactverif_properties.roundoff"),
        ("contactverif_nts.a", "import numpy.typing\nfrom contactverif_nts import eq6\nfrom .walk import x"),
        ("contactverif.subject", "from scipy import sparse\nfrom scipy.sparse import linalg\nfrom .case import Case"),
        ("contactverif.cli", "from contactverif.runner import run\nimport os\nprint(1)"),
    ],
)
def test_the_reader_of_imports_lets_a_right_one_pass(module: str, source: str) -> None:
    assert not breaches(source, module)


@pytest.mark.parametrize("module", SOURCES)
def test_the_first_lines_of_a_file_say_why_it_exists(module: str) -> None:
    text = SOURCES[module].read_text()
    assert (ast.get_docstring(ast.parse(text)) or "").strip(), "a file starts with a docstring"
    assert text.startswith(('"""', 'r"""')), "the docstring comes first"


def entry_points() -> list[tuple[str, str]]:
    """(name, "module:attribute") of all that pyproject.toml promises."""
    groups = {"scripts": PROJECT["project"]["scripts"], **PROJECT["project"]["entry-points"]}
    return [(f"{group} {name}", target) for group, points in groups.items() for name, target in points.items()]


@pytest.mark.parametrize("target", [pytest.param(target, id=name) for name, target in entry_points()])
def test_every_entry_point_loads(target: str) -> None:
    module, _, attribute = target.partition(":")
    loaded = importlib.import_module(module)
    assert not attribute or getattr(loaded, attribute) is not None


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.name)
def test_every_package_is_typed(package: Path) -> None:
    assert (package / "py.typed").is_file()
    assert (package / "__init__.py").is_file()


def texts() -> Iterator[tuple[Path, str]]:
    """All files of the project that are text, those that tools leave behind excepted."""
    for path in sorted(ROOT.rglob("*")):
        parts = path.relative_to(ROOT).parts
        left_behind = any(
            (part.startswith(".") and part != ".ci") or part.endswith((".egg-info", "~")) for part in parts
        )
        if left_behind or {"__pycache__", "build", "dist", "venv"} & set(parts) or not path.is_file():
            continue
        try:
            yield path, path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue


def test_no_file_knows_this_machine() -> None:
    folders = "|".join(("work", "root", "home", "tmp/venv"))  # joined, or this file would find itself
    pattern = re.compile(
        rf"(?<![\w.\-])/(?:{folders})(?:/|\b(?!\w|-))|https?://[^\s\"'<>)]*/simple\b|\bindex[-_]url\b", re.I
    )
    own = Path(__file__).resolve()
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()[:100]}"
        for path, text in texts()
        if path != own
        for number, line in enumerate(text.splitlines(), 1)
        if pattern.search(line)
    ]
    assert not found, "\n" + "\n".join(found)


def test_ci_runs_what_the_readme_says() -> None:
    readme = (ROOT / "README.md").read_text()
    section = re.search(r"^## Test$(.*?)(?=^## |\Z)", readme, re.M | re.S)
    assert section, "README.md has no heading '## Test'"
    block = re.search(r"^```\w*\n(.*?)^```", section[1], re.M | re.S)
    assert block, "README.md has no code block under '## Test'"
    script = ROOT / ".ci" / "run"
    assert script.stat().st_mode & 0o111, ".ci/run is not executable"
    assert block[1].strip() in script.read_text(), f".ci/run does not call the README's command: {block[1].strip()}"


def test_tox_checks_the_types_of_every_package() -> None:
    tox = configparser.ConfigParser(interpolation=None)
    tox.read(ROOT / "tox.ini")
    command = tox["testenv:type"]["commands"].split()
    assert {str(package.relative_to(ROOT)) for package in PACKAGES} <= set(command)
    assert "--strict" in command
    environments = {"lint", "type", "py311", "properties", "external", "bench"}
    assert environments <= set(tox["tox"]["env_list"].replace(",", " ").split())
