"""The files beside the code stay true: workflows, citation, version, tables of contents.

A table of contents lists every heading of the second level below "## Contents", and each of its links leads somewhere.
`python tests/test_habits.py FILE …` writes the table into files that have none, or a wrong one.
"""

import configparser
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

import contactverif

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
WITH_CONTENTS = ("CONTRIBUTING.md", "DECISIONS.md", "plugins/README.md", "properties/README.md", "reports/README.md")
ENOUGH = 4  # A file with this many headings of the second level needs a table of contents.


NOT_RUN = {"ipykernel", "nbclient", "tox"}  # No test of the environment `floors` uses them.


def read_yaml(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def tox_environments() -> set[str]:
    """Return the environments that tox.ini describes; every Python has one without a section of its own."""
    tox = configparser.ConfigParser(interpolation=None)
    tox.read(ROOT / "tox.ini")
    named = {section.removeprefix("testenv:") for section in tox.sections() if section.startswith("testenv:")}
    return named | {"py311", "py312", "py313", "py314"}


def test_there_are_workflows_for_tests_documentation_and_releases() -> None:
    assert {path.stem for path in WORKFLOWS} >= {"tests", "docs", "release"}


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_a_workflow_is_one_that_github_would_run(path: Path) -> None:
    workflow = read_yaml(path)
    assert set(workflow) <= {"name", True, "permissions", "concurrency", "jobs", "env", "defaults"}
    assert workflow[True], "`on` (which YAML 1.1 reads as true) says when it runs"
    assert workflow["permissions"] == {"contents": "read"}, "a job asks for more by itself"
    for name, job in workflow["jobs"].items():
        assert job["runs-on"], name
        assert set([job.get("needs")] if isinstance(job.get("needs"), str) else job.get("needs", [])) <= set(
            workflow["jobs"]
        )
        for step in job["steps"]:
            assert ("uses" in step) != ("run" in step), step
            if "uses" in step:
                assert re.fullmatch(r"[\w.-]+/[\w./-]+@[\w./-]+", step["uses"]), f"{step['uses']} names no version"


def test_workflows_run_environments_that_tox_has() -> None:
    entries = read_yaml(ROOT / ".github/workflows/tests.yml")["jobs"]["tox"]["strategy"]["matrix"]["include"]
    for entry in entries:
        assert entry["environment"] in tox_environments()
        if match := re.fullmatch(r"py(\d)(\d+)", entry["environment"]):
            assert entry["python"] == f"{match[1]}.{match[2]}"
    assert {"lint", "type", "py311", "external"} <= {entry["environment"] for entry in entries}


def test_no_two_files_of_tests_have_one_name() -> None:
    names = sorted(path.name for path in (ROOT / "tests").rglob("test_*.py") if "external" not in path.parts)
    assert names == sorted({*names}), "pytest imports a file of tests by its name alone"


def test_the_files_that_tox_names_are_there() -> None:
    names = re.findall(
        r"\b(?:tests|evidence)/[\w/.-]+\.(?:py|txt|toml)", (ROOT / "tox.ini").read_text(encoding="utf-8")
    )
    assert len(names) > 10
    assert not [name for name in names if not (ROOT / name).is_file()]


def test_pre_commit_runs_the_tools_of_the_lint_environment() -> None:
    hooks = {hook["id"] for repo in read_yaml(ROOT / ".pre-commit-config.yaml")["repos"] for hook in repo["hooks"]}
    assert {"ruff", "ruff-format", "end-of-file-fixer", "codespell", "numpydoc-validation"} <= hooks


def test_the_version_has_one_source() -> None:
    assert "version" not in PROJECT["project"]
    assert PROJECT["project"]["dynamic"] == ["version"]
    assert PROJECT["tool"]["hatch"]["version"]["path"] == "contactverif/__init__.py"
    assert re.fullmatch(r"\d+\.\d+\.\d+", contactverif.__version__)


def test_the_citation_is_that_of_this_version_and_of_the_paper() -> None:
    citation = read_yaml(ROOT / "CITATION.cff")
    assert citation["cff-version"] == "1.2.0"
    for key in ("message", "title", "authors", "abstract"):
        assert citation[key]
    assert citation["type"] == "software"
    assert citation["version"] == contactverif.__version__
    assert citation["license"] == PROJECT["project"]["license"]
    assert citation["keywords"] == PROJECT["project"]["keywords"]
    (paper,) = citation["references"]
    assert (paper["type"], paper["doi"], paper["year"]) == ("article", "10.1002/nme.2559", 2009)
    assert [author["family-names"] for author in paper["authors"]] == ["Zavarise", "De Lorenzis"]


def _parts(version: str) -> tuple[int, ...]:
    """Return the numbers of a version without zeros at its end."""
    numbers = [int(number) for number in version.split(".")]
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return tuple(numbers)


def _read_promised() -> dict[str, tuple[int, ...]]:
    project = PROJECT["project"]
    lines = [*project["dependencies"], *project["optional-dependencies"]["test"]]
    matches = [re.fullmatch(r"([A-Za-z0-9-]+)>=([0-9.]+)", line) for line in lines]
    assert all(matches), lines
    return {match[1]: _parts(match[2]) for match in matches if match and match[1] not in NOT_RUN}


def _read_tested() -> dict[str, tuple[int, ...]]:
    lines = (ROOT / "tests" / "floors.txt").read_text(encoding="utf-8").splitlines()
    entries = [line.split("==") for line in lines if not line.startswith("#")]
    return {name: _parts(version) for name, version in entries}


def test_each_lowest_version_is_installed_where_floors_are_read_tested() -> None:
    """They are the lowest versions that are promised."""
    assert _read_tested() == _read_promised()
    text = (ROOT / "tox.ini").read_text(encoding="utf-8")
    assert "-r tests/floors.txt" in text.partition("[testenv:floors]")[2].partition("[testenv:")[0]


def headings(text: str, level: int = 2) -> list[str]:
    """Return the headings of a Markdown file, those in its code blocks left out."""
    prose = re.sub(r"^(```|~~~).*?^\1", "", text, flags=re.M | re.S)
    return re.findall(rf"^#{{{level}}} (.+?)\s*$", prose, flags=re.M)


def anchor(heading: str) -> str:
    """Return the anchor that GitHub gives to a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def contents(text: str) -> Iterator[str]:
    """Yield the lines of the table of contents that a file needs."""
    for heading in headings(text):
        if heading != "Contents":
            yield f"- [{heading}](#{anchor(heading)})"


def is_complete(text: str) -> bool:
    """Return whether a file's table of contents leads to each heading of the second level, and nowhere else.

    A file of fewer than `ENOUGH` headings needs none.
    """
    needed = [anchor(heading) for heading in headings(text) if heading != "Contents"]
    section = re.search(r"^## Contents$(.*?)(?=^## )", text, flags=re.M | re.S)
    if not section:
        return len(needed) < ENOUGH
    links = re.findall(r"\]\(#([^)]+)\)", section[1])
    deeper = {anchor(heading) for level in (3, 4) for heading in headings(text, level)}
    return [link for link in links if link not in deeper] == needed


def with_contents(text: str) -> str:
    """Return a file's text with a table of contents before its first heading of the second level."""
    bare = re.sub(r"^## Contents$.*?(?=^## )", "", text, flags=re.M | re.S)
    before, first, rest = bare.partition("\n## ")
    return "\n".join([f"{before}\n## Contents\n", *contents(bare), first + rest])


@pytest.mark.parametrize("name", WITH_CONTENTS)
def test_a_long_file_has_a_table_of_contents(name: str) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    assert is_complete(text), f"python tests/test_habits.py {name}"


def test_a_table_of_contents_that_is_written_is_complete() -> None:
    bare = "# A\n\nText.\n\n## B `c`\n\nText.\n\n## D\n\n## E\n\n## F\n"
    written = with_contents(bare)
    assert not is_complete(bare)
    assert is_complete(written)
    assert written == with_contents(written)
    assert "## Contents\n\n- [B `c`](#b-c)\n- [D](#d)\n- [E](#e)\n- [F](#f)\n\n## B `c`\n\nText.\n" in written
    assert not is_complete(written.replace("## D", "## G"))
    assert is_complete("# A\n\n## B\n"), "a short file needs none"


def test_a_heading_in_a_code_block_is_no_heading() -> None:
    assert headings("# A\n## B `c`\n```sh\n## no\n```\n## D, e\n") == ["B `c`", "D, e"]
    assert anchor("B `c`: d") == "b-c-d"


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        content = Path(argument).read_text(encoding="utf-8")
        if not is_complete(content):
            Path(argument).write_text(with_contents(content), encoding="utf-8")
