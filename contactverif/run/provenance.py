"""Where a run comes from: the root attributes of a report, all of them strings."""

from __future__ import annotations

import json
import platform
import shlex
import subprocess
import sys
from datetime import UTC, datetime
from importlib import metadata
from urllib.parse import unquote, urlparse

PACKAGES = ("contactverif", "numpy", "scipy", "scikit-fem", "hypothesis", "numba", "xarray")


def collect_provenance(*, profile: str, examples: int, seed: int) -> dict[str, str]:
    """Versions, commit, machine, time and command, with what the run was asked for."""
    return {
        **{f"{package.replace('-', '_')}_version": _version(package) for package in PACKAGES},
        "python_version": platform.python_version(),
        "commit": _commit(),
        "profile": profile,
        "examples": str(examples),
        "seed": str(seed),
        "command": shlex.join(sys.argv),
        "platform": platform.platform(),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def _commit() -> str:
    """The commit that was installed: as pip noted it, or that of the working copy of an editable install."""
    try:
        noted = json.loads(metadata.distribution("contactverif").read_text("direct_url.json") or "{}")
    except (metadata.PackageNotFoundError, ValueError):
        return "unknown"
    if commit := noted.get("vcs_info", {}).get("commit_id"):
        return str(commit)
    url = urlparse(noted.get("url", ""))
    if url.scheme != "file" or not noted.get("dir_info", {}).get("editable"):
        return "unknown"
    describe = ["git", "-C", unquote(url.path), "describe", "--always", "--abbrev=40", "--dirty", "--exclude=*"]
    try:
        answer = subprocess.run(describe, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    return answer.stdout.strip() if answer.returncode == 0 else "unknown"
