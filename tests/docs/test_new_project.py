"""The page about new projects: what `contactverif new` makes passes its own tests and keeps its promises.

tox's environment `external` installs both projects for real and runs all of it. Here, without a network, an
installation is what Python sees of one, and only some properties are asked.
"""

import os
import re
import shlex
from pathlib import Path

import pytest
from quotes import DOCS, call, commands, install_project

CHOICE = ("balance.force", "patch.flat.transmission", "tangent.directional")
COMMANDS = commands((DOCS / "how-to" / "new-project.md").read_text(encoding="utf-8"))


@pytest.mark.parametrize("options", [(), ("--jax",), ("--3d",)], ids=["numpy", "jax", "3d"])
def test_a_new_project_passes_its_tests_and_keeps_its_promises(
    options: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    new, enter, tests, verify = (shlex.split(line) for line in COMMANDS)
    answer = call(*new, *options, folder=tmp_path)
    assert answer.returncode == 0, answer.stderr
    project = tmp_path / "mine"
    assert enter == ["cd", "mine", "&&", "pip", "install", "-e", "."]
    install_project(project / "site", project / "pyproject.toml")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [str(project), os.environ.get("PYTHONPATH")])))
    tested = call(*tests, "-k", " or ".join(CHOICE), folder=project)
    assert tested.returncode == 0, tested.stdout + tested.stderr
    n_formulations = 2 if options == ("--jax",) else 1
    assert re.search(rf"contactverif: {len(CHOICE) * n_formulations} checks", tested.stdout), tested.stdout
    verified = call(*verify, *(f"-p{choice}" for choice in CHOICE), "--examples", "8", folder=project)
    assert verified.returncode == 0, verified.stdout + verified.stderr
    assert verified.stdout.startswith("profile ci: 8 random cases for each property, seed 0\n")
    assert "\nmine: 3 pass\n" in verified.stdout
    assert "\nEvery promise is kept and every property was judged.\n" in verified.stdout
