"""The work of `new`: the files of a plugin project, from the templates beside this file.

Rule: a project appears whole or not at all, under a name that nothing else has.
"""

import importlib.util
import json
import keyword
import os
import re
import tempfile
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from importlib.resources import files
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from contactverif.cli.console import echo
from contactverif.contract.errors import MisuseError
from contactverif.plugins.registry import formulation_names

_NAME = re.compile(r"[A-Za-z]([A-Za-z0-9._-]*[A-Za-z0-9])?")  # A distribution's name that begins like a module's.
_LONGEST = 60  # Characters. File systems take names of 255 bytes, and the screen of a run has 80 columns.
_NEEDED = f"a name of letters, digits, '-', '_' and '.', at most {_LONGEST}; first a letter, last a letter or digit"
_TEMPLATES = {
    "pyproject.toml": "pyproject.toml",
    "{module}.py": "formulation.py",
    "test_{module}.py": "test_formulation.py",
    "README.md": "README.md",
    "tox.ini": "tox.ini",
    ".gitignore": "gitignore",
    ".github/workflows/tests.yml": "workflow.yml",
}
_SOURCES = {"jax": "jax_formulation.py", "3d": "surface_formulation.py"}  # The formulation of a kind of project.
# The files of a project of C ("c") or Fortran ("f90"), which is built by make and needs no package of its own.
_LIBRARY_TEMPLATES = {
    "pyproject.toml": "library_pyproject.toml",
    "{module}.{language}": "formulation.{language}",
    "{module}.toml": "{language}_traits.toml",
    "test_{module}.py": "library_test_formulation.py",
    "README.md": "library_README.md",
    "Makefile": "Makefile",
    ".gitignore": "gitignore",
}
_HEADER = "contactverif.h"
_FLAGS = {"jax": "--jax", "3d": "--3d", "c": "--c", "f90": "--fortran"}
_LOADERS = {"c": "c", "f90": "uel"}  # The formulations that load a library, by its language.


def new(name: str, jax: bool, in_space: bool, c: bool, fortran: bool) -> None:
    """Make a project of the kind that is wanted, if one is, and say what comes next."""
    wanted = [kind for kind, typed in zip(_FLAGS, (jax, in_space, c, fortran), strict=True) if typed]
    if len(wanted) > 1:
        raise MisuseError("NAME", " and ".join(_FLAGS[kind] for kind in wanted), "one of them")
    kind = wanted[0] if wanted else ""
    echo(f"{name}: {', '.join(make_project(name, kind))}")
    if kind in _LOADERS:
        echo(f"next: cd {name} && make && contactverif verify {library_subject(name, kind)}")
    else:
        echo(f"next: cd {name} && pip install -e . && pytest && contactverif verify {name}")


def library_subject(name: str, language: str) -> str:
    """Return the name of the formulation in a project of C or Fortran, as it is verified in the project's folder."""
    return f"{_LOADERS[language]}:file={_module_of(name)}.so"


def make_project(name: str, kind: str = "") -> list[str]:
    """Write a project into a new folder of that name; return the names of its files.

    The kind is "jax", "3d", a formulation in space, or the language of a library, "c" or "f90".
    """
    module = _module_of(name)
    names = [name, f"{name}-energy"] if kind == "jax" else [name]
    free = "a name that is free"
    if os.path.lexists(name):
        raise MisuseError("NAME", f"{name!r}, which exists in this folder", "the name of a new folder")
    if registered := sorted(set(names) & set(formulation_names())):
        raise MisuseError("NAME", f"{name!r}, but a formulation {registered[0]} is registered", free)
    if _distribution(name) is not None:
        raise MisuseError("NAME", f"{name!r}, a package that is installed", free)
    if importlib.util.find_spec(module) is not None:
        raise MisuseError("NAME", f"{name!r}, but Python has a module {module}", free)
    language = kind if kind in _LOADERS else ""
    words = {"name": name, "names": " ".join(names), "module": module, "kind": kind, "language": language}
    if language:
        words["subject"] = library_subject(name, language)
    else:
        words["requirement"], words["shared_requirement"] = _requirements()
    environment = Environment(  # The templates make no pages of HTML.
        loader=PackageLoader("contactverif.cli", "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    texts = {}
    for file, template in (_LIBRARY_TEMPLATES if language else _TEMPLATES).items():
        source = _SOURCES.get(kind, template) if template == "formulation.py" else template.format(language=language)
        target = file.format(module=module, language=language)
        texts[target] = environment.get_template(f"{source}.jinja").render(words)
    if language == "c":
        texts[_HEADER] = files("contactverif_foreign").joinpath(_HEADER).read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory(prefix=".contactverif-new-", dir=".") as folder:
        project = Path(folder, name)
        for file, text in texts.items():
            path = project / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        project.rename(name)
    return list(texts)


def _module_of(name: str) -> str:
    if not _NAME.fullmatch(name) or len(name) > _LONGEST:
        raise MisuseError("NAME", repr(name), _NEEDED)
    module = re.sub(r"[-.]+", "_", name).lower()
    if keyword.iskeyword(module):
        raise MisuseError("NAME", f"{name!r}, a word of Python", "a name that a module can have")
    return module


def _distribution(name: str) -> Distribution | None:
    try:
        return distribution(name)
    except PackageNotFoundError:
        return None


def _requirements() -> tuple[str, str]:
    """Return what installs this once more, on this machine (from a folder, if pip did so) and on any other."""
    release = "contactverif[box]"
    installed = _distribution("contactverif")
    source = json.loads((installed and installed.read_text("direct_url.json")) or "{}")
    if "vcs_info" in source:
        commit = source["vcs_info"]["commit_id"]
        address = f"{release} @ {source['vcs_info']['vcs']}+{source['url']}@{commit}"
        return address, address
    return f"{release} @ {source['url']}" if source else release, release
