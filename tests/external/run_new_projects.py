"""The projects that `contactverif new` makes, as a user runs them: installed by pip, tested, verified.

Usage: `python run_new_projects.py FOLDER`, in an environment of contactverif that may install packages.
"""

import shutil
import subprocess
import sys
from pathlib import Path

PYTHON = (sys.executable, "-P", "-m")
PROJECTS = {"new-numpy": (), "new-jax": ("--jax",), "new-3d": ("--3d",)}  # With the options of `new`


def run_project(folder: Path, name: str, options: tuple[str, ...]) -> None:
    """Make a project, install it, run its tests, and verify it.

    Its tests ask what `verify` asks, so they ask few cases here.
    """
    subprocess.run([*PYTHON, "contactverif", "new", name, *options], cwd=folder, check=True)
    tests = "pytest", "-q", "--contactverif-examples", "5"
    for command in (("pip", "install", "-e", "."), tests, ("contactverif", "verify", name)):
        subprocess.run([*PYTHON, *command], cwd=folder / name, check=True)


if __name__ == "__main__":
    place = Path(sys.argv[1])
    for project, flags in PROJECTS.items():
        subprocess.run([*PYTHON, "pip", "uninstall", "-y", project], check=True)  # From an earlier run.
        shutil.rmtree(place / project, ignore_errors=True)
        run_project(place, project, flags)
