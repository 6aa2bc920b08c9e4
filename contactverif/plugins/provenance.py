"""The origin of a run: versions, commit, machine, time and command for a report, digests of code for a journal."""

import json
import platform
import shlex
import subprocess
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import cache
from importlib import import_module, metadata
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_info

from contactverif.contract.subject import ENGINE
from contactverif.plugins import registry
from contactverif.plugins.registry import digest_files

PACKAGES = ("contactverif", "numpy", "scipy", "scikit-fem", "hypothesis", "numba", "xarray")
CODE = "code of "  # The name of a digest is this and the name of a package or a file.


def collect_provenance(*, profile: str, examples: int, seed: int) -> dict[str, str]:
    """Return {attribute of the report: value}: versions, commit, machine, time, command and the size of a run."""
    return {
        **collect_versions(),
        **machine(),
        "commit": _commit(),
        "profile": profile,
        "examples": str(examples),
        "seed": str(seed),
        "command": shlex.join(sys.argv),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def collect_versions() -> dict[str, str]:
    """Return the versions of Python and of the libraries whose results a run depends on."""
    versions = {f"{package.replace('-', '_')}_version": _version(package) for package in PACKAGES}
    return versions | {"python_version": platform.python_version()}


def collect_repeatable_facts() -> dict[str, str]:
    """Return the versions and the commit: only what a second run repeats on any machine."""
    return {**collect_versions(), "commit": _commit()}


@cache
def machine() -> dict[str, str]:
    """Return what the last bits of a number depend on beside the versions; equal where the machine is the same."""
    import_module("scipy.linalg")  # It brings a BLAS of its own.
    keys = ("internal_api", "version", "architecture")  # The last bits of a solution depend on the kernel of each BLAS.
    pools = (entry for entry in threadpool_info() if entry["user_api"] == "blas")
    libraries = {" ".join(str(entry[key]) for key in keys if entry.get(key)) for entry in pools}
    try:  # The groups of instructions that numpy has found and may use, beyond those it always uses.
        extensions = np.show_config(mode="dicts")["SIMD Extensions"]
        features = " ".join([*extensions.get("baseline", []), *extensions.get("found", [])])
    except (AttributeError, KeyError, TypeError):  # A numpy that was built in another way.
        features = ""
    return {
        "blas": "; ".join(sorted(libraries)) or "unknown",
        "cpu_features": features or "unknown",
        "platform": platform.platform(),
    }


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def _commit() -> str:
    """Return the commit of the code that runs: the one that pip recorded, or that of the working copy it stands in."""
    try:
        record = json.loads(metadata.distribution("contactverif").read_text("direct_url.json") or "{}")
    except (metadata.PackageNotFoundError, ValueError):
        record = {}
    if commit := record.get("vcs_info", {}).get("commit_id"):
        return str(commit)
    folder = Path(__file__).parents[2]
    if not (folder / "pyproject.toml").exists():  # That of installed packages, which may stand in any working copy.
        return "unknown"
    describe = ["git", "-C", str(folder), "describe", "--always", "--abbrev=40", "--dirty", "--exclude=*"]
    try:
        answer = subprocess.run(describe, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    return answer.stdout.strip() if answer.returncode == 0 else "unknown"


def code_digests(formulations: Sequence[str], properties: Sequence[str]) -> dict[str, str]:
    """Return {package or file: digest of its code} of the harness and of all that the names refer to.

    A version says too little while an author works on a plugin: a run goes on only with the same code.
    """
    named = {
        registry.FORMULATIONS: {name for text in formulations for name in registry.names_within(text)},
        registry.ENGINES: {text.removeprefix(ENGINE).partition(":")[0] for text in formulations},
        registry.PROPERTIES: set(properties),
        registry.ENGINE_PROPERTIES: set(properties),
    }
    modules = {"contactverif"}
    for group, names in named.items():
        installed = registry.entries_by_name(group)
        modules |= registry.modules_of(entry for name in names for entry in installed.get(name, ()))
    packages = sorted({module.partition(".")[0] for module in modules})
    files = sorted({path for text in formulations for path in registry.files_within(text)})  # They load these.
    digests = {f"{CODE}{package}": digest_files(registry.package_files(package)) for package in packages}
    return digests | {f"{CODE}{path.name}": digest_files([(path.name, path)]) for path in files}
