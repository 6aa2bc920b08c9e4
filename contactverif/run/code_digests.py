"""The code that judges and the code that is judged, as one word each: a run goes on only with the same.

A version says too little while an author works on a plugin: the outcomes of two codes must not stand in one report.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable, Sequence
from hashlib import sha256
from importlib.metadata import entry_points
from pathlib import Path

from contactverif.contract.errors import MisuseError
from contactverif.contract.names import parse_name
from contactverif.run.registry import FORMULATIONS, PROPERTIES

_CODE = frozenset({".py", ".so", ".pyd", ".dylib", ".dll"})
_DIGITS = 16


def code_digests(formulations: Sequence[str], properties: Sequence[str]) -> dict[str, str]:
    """Return {package: digest of its code} of the harness and of all plugins that the names refer to.

    Parameters
    ----------
    formulations : Sequence[str]
        Names as on the command line, with options and wrappers.
    properties : Sequence[str]
        Ids of properties.
    """
    plugins = {_plugin_name(part) for text in formulations for part in text.split("/")}
    modules = {"contactverif"}
    modules |= {entry.module for entry in entry_points(group=FORMULATIONS) if entry.name in plugins}
    modules |= {entry.module for entry in entry_points(group=PROPERTIES) if entry.name in properties}
    packages = sorted({module.partition(".")[0] for module in modules})
    return {f"code of {package}": _digest(_files_of(package)) for package in packages}


def _plugin_name(text: str) -> str:
    try:
        return parse_name("formulation", text, "")[0]
    except MisuseError:  # The registry will say what is wrong.
        return text


def _files_of(package: str) -> list[tuple[str, Path]]:
    """Return (name, file) of all code of a package, in an order that no machine changes; nothing is imported."""
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        spec = None
    if spec is None:
        return []
    if spec.submodule_search_locations is None:  # A module by itself.
        return [(package, Path(str(spec.origin)))]
    folders = map(Path, spec.submodule_search_locations)
    return sorted((path.relative_to(folder).as_posix(), path) for folder in folders for path in folder.rglob("*"))


def _digest(files: Iterable[tuple[str, Path]]) -> str:
    total = sha256()
    for name, path in files:
        if path.suffix not in _CODE or not path.is_file():
            continue
        content = path.read_bytes()
        total.update(f"{name} {len(content)} ".encode())
        total.update(content)
    return total.hexdigest()[:_DIGITS]
