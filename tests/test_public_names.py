"""The names that plugins, tests and scripts import: the lists are kept here, so that none comes or goes unnoticed.

A name that is removed or renamed breaks somebody's script; change the list together with CHANGELOG.md.
"""

import ast
import doctest
import importlib
import inspect
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import contactverif
import contactverif.strategies
import contactverif.testing

ROOT = Path(__file__).parents[1]
PUBLIC = {
    "contactverif": {
        # Meshes, states and the contract of a formulation.
        *("Interface", "Surface", "Case", "named_case", "read_interface", "read_scene"),
        *("Formulation", "ResidualOnly", "Pairing", "Handle", "ContactPoints", "CheckedFormulation", "Subject"),
        *("Traits", "Promises", "PatchPromises", "Rules", "Abilities", "Evidence"),
        # Bodies, scenes and their solution.
        *("Body", "Rectangle", "Placing", "block", "rigid_surface", "body_from_mesh"),
        *("Scene", "two_blocks", "shrink_fit", "ShrinkFit", "load_scene", "solve", "Trace", "End"),
        # Whole contact codes.
        *("Engine", "EngineTraits", "SceneArrays", "EngineAnswer"),
        # Properties, and runs over them.
        *("Property", "Cases", "Quantity", "Measurement", "Finding", "Outcome", "Verdict", "Row", "Run"),
        *("load_formulation", "load_properties", "evaluate_both", "judge_case", "verify", "Report"),
        # Formulations from functions of JAX.
        *("from_energy", "from_residual"),
        # Errors.
        *("ContactverifError", "ContractError", "MisuseError"),
    },
    "contactverif.testing": {"parametrize_with_properties"},
    "contactverif.strategies": {
        # Examples for an author's own tests.
        *("interfaces", "faces", "states", "projections", "Projection"),
        # Cases of properties.
        *("flat_cases", "normal_cases", "single_cases", "overhung_cases", "general_cases", "smooth_cases", "tie_cases"),
    },
}
NAMES = [(module, name) for module, names in PUBLIC.items() for name in sorted(names)]
# Packages that take long to import, of which `import contactverif` needs none.
HEAVY = {
    "numpy",
    "scipy",
    "numba",
    "skfem",
    "hypothesis",
    "xarray",
    "netCDF4",
    "matplotlib",
    "meshlane",
    "typer",
    "rich",
}
HEAVY |= {"jax"}


@pytest.mark.parametrize("module", PUBLIC)
def test_the_public_names_are_those_of_the_list(module: str) -> None:
    package = importlib.import_module(module)
    assert set(package.__all__) == PUBLIC[module]


@pytest.mark.parametrize(("module", "name"), NAMES)
def test_a_public_name_imports_and_has_a_docstring(module: str, name: str) -> None:
    thing: Any = getattr(importlib.import_module(module), name)
    text = inspect.getdoc(thing) or ""
    assert text[:1].isupper(), f"the docstring of {name} begins with {text[:20]!r}"
    assert text.split("\n\n")[0].rstrip().endswith("."), f"the first paragraph of {name}'s docstring is no sentence"


def test_type_checkers_see_the_same_names() -> None:
    tree = ast.parse(Path(contactverif.__file__).read_text())
    (block,) = [node for node in tree.body if isinstance(node, ast.If)]
    imports = [alias for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names]
    assert {alias.asname or alias.name for alias in imports} == PUBLIC["contactverif"]


def test_an_interactive_session_completes_the_names() -> None:
    assert PUBLIC["contactverif"] <= set(dir(contactverif))


def test_a_name_that_does_not_exist_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match=r"module 'contactverif' has no attribute 'solv'"):
        contactverif.solv  # noqa: B018


def test_importing_the_package_imports_nothing_that_takes_long() -> None:
    code = f"import sys, contactverif; print(sorted({HEAVY!r} & set(sys.modules)), len(sys.modules))"
    bare = "import sys, importlib, typing; print(len(sys.modules))"
    answers = [
        subprocess.run([sys.executable, "-I", "-c", text], capture_output=True, text=True) for text in (code, bare)
    ]
    loaded, count = answers[0].stdout.rsplit(maxsplit=1)
    assert loaded == "[]", f"import contactverif imports {loaded}{answers[0].stderr}"
    assert int(count) <= int(answers[1].stdout) + 3, "import contactverif imports modules of the house"


def homes() -> list[ModuleType]:
    """Return the modules in which public names are defined."""
    things = [getattr(importlib.import_module(module), name) for module, name in NAMES]
    return [sys.modules[name] for name in sorted({thing.__module__ for thing in things})]


@pytest.mark.parametrize("home", homes(), ids=lambda home: home.__name__)
def test_the_examples_in_docstrings_are_right(home: ModuleType) -> None:
    result = doctest.testmod(home)
    assert result.failed == 0, f"{result.failed} of {result.attempted} examples in {home.__name__} fail"
