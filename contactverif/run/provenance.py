"""The origin of a run: versions, commit, machine, time and command, as text for the root of a report."""

from __future__ import annotations

import json
import platform
import shlex
import subprocess
import sys
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_info

PACKAGES = ("contactverif", "numpy", "scipy", "scikit-fem", "hypothesis", "numba", "xarray")


def collect_provenance(*, profile: str, examples: int, seed: int) -> dict[str, str]:
    """Return the versions, the commit, the machine, the time, the command and the size of a run.

    Parameters
    ----------
    profile : str
        The name of the profile.
    examples : int
        The number of planned cases of each property.
    seed : int
        The seed of all cases.

    Returns
    -------
    dict[str, str]
        {attribute of the report: value}.
    """
    return {
        **collect_versions(),
        "blas": _blas(),
        "cpu_features": _cpu_features(),
        "commit": _commit(),
        "profile": profile,
        "examples": str(examples),
        "seed": str(seed),
        "command": shlex.join(sys.argv),
        "platform": platform.platform(),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def collect_versions() -> dict[str, str]:
    """Return the versions of Python and of the libraries whose results a run depends on."""
    versions = {f"{package.replace('-', '_')}_version": _version(package) for package in PACKAGES}
    return versions | {"python_version": platform.python_version()}


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def _blas() -> str:
    """Return library, version and kernel of each BLAS; the last bits of a solution depend on the kernel."""
    libraries = [
        " ".join(str(entry[key]) for key in ("internal_api", "version", "architecture") if entry.get(key))
        for entry in threadpool_info()
        if entry["user_api"] == "blas"
    ]
    return "; ".join(sorted(set(libraries))) or "unknown"


def _cpu_features() -> str:
    """Return the groups of instructions that numpy has found and may use, beyond those it always uses."""
    try:
        extensions = np.show_config(mode="dicts")["SIMD Extensions"]
        return " ".join([*extensions.get("baseline", []), *extensions.get("found", [])]) or "unknown"
    except (AttributeError, KeyError, TypeError):  # A numpy that was built in another way.
        return "unknown"


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
