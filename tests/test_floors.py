"""The lowest versions that are promised are those that `tox -e floors` installs and tests."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
NOT_RUN = {"ipykernel", "nbclient", "tox"}  # No test of the environment `floors` uses them.


def _parts(version: str) -> tuple[int, ...]:
    """Return the numbers of a version without zeros at its end."""
    numbers = [int(number) for number in version.split(".")]
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return tuple(numbers)


def _read_promised() -> dict[str, tuple[int, ...]]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = [*project["dependencies"], *project["optional-dependencies"]["test"]]
    matches = [re.fullmatch(r"([A-Za-z0-9-]+)>=([0-9.]+)", line) for line in lines]
    assert all(matches), lines
    return {match[1]: _parts(match[2]) for match in matches if match and match[1] not in NOT_RUN}


def _read_tested() -> dict[str, tuple[int, ...]]:
    lines = (ROOT / "tests" / "floors.txt").read_text(encoding="utf-8").splitlines()
    entries = [line.split("==") for line in lines if not line.startswith("#")]
    return {name: _parts(version) for name, version in entries}


def test_each_lowest_version_is_installed_where_floors_are_read_tested() -> None:
    assert _read_tested() == _read_promised()


def test_the_environment_installs_the_list() -> None:
    text = (ROOT / "tox.ini").read_text(encoding="utf-8")
    section = text.partition("[testenv:floors]")[2].partition("[testenv:")[0]
    assert "-r tests/floors.txt" in section
