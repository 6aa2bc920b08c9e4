"""The projects that `contactverif new` makes, as a user runs them: installed by pip, tested, verified.

Usage: `python run_new_projects.py FOLDER`, in an environment of contactverif that may install packages.
"""

import shutil
import subprocess
import sys
from pathlib import Path

PYTHON = (sys.executable, "-P", "-m")
# The options of `new`, and those of `verify`: each face is cut by each other one in plain numpy, which takes longer.
PROJECTS = {"new-numpy": ((), ()), "new-jax": (("--jax",), ()), "new-3d": (("--3d",), ("--examples", "10"))}


def run_project(folder: Path, name: str, options: tuple[str, ...], verify_options: tuple[str, ...]) -> None:
    """Make a project, install it, run its tests, and verify it.

    Its tests ask what `verify` asks, so they ask few cases here.
    """
    subprocess.run([*PYTHON, "contactverif", "new", name, *options], cwd=folder, check=True)
    tests = "pytest", "-q", "--contactverif-examples", "5"
    for command in (("pip", "install", "-e", "."), tests, ("contactverif", "verify", name, *verify_options)):
        subprocess.run([*PYTHON, *command], cwd=folder / name, check=True)


if __name__ == "__main__":
    place = Path(sys.argv[1])
    for project, (flags, verify_flags) in PROJECTS.items():
        subprocess.run([*PYTHON, "pip", "uninstall", "-y", project], check=True)  # From an earlier run.
        shutil.rmtree(place / project, ignore_errors=True)
        run_project(place, project, flags, verify_flags)
