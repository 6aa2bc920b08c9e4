"""The pages whose projects are built and run: a new project, user elements, a search, faces.

tox's environment `external` installs new projects for real and runs all of it. Here, without a network, an
installation is what Python sees of one, and only some properties are asked.
"""

import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
from quotes import DOCS, PROGRAMS, blocks, call, commands, excerpt, install_project, outputs, quotes
from test_docs import PYTHON

# The last one has states in which nothing is paired.
CHOICE = ("balance.force", "patch.flat.transmission", "tangent.directional", "hard.free-end")
FACES = DOCS / "tutorial" / "faces.md"
NEW_PROJECT, USER_ELEMENTS, SEARCH = (
    (DOCS / "how-to" / f"{name}.md").read_text(encoding="utf-8")
    for name in ("new-project", "user-elements", "test-your-search")
)
BOTH_TERMS = "(vt(i) * vn0(j) + vn0(i) * vt(j))"


@pytest.mark.parametrize("options", [(), ("--jax",), ("--3d",)], ids=["numpy", "jax", "3d"])
def test_a_new_project_passes_its_tests_and_keeps_its_promises(
    options: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    new, enter, tests, verify = (shlex.split(line) for line in commands(NEW_PROJECT))
    answer = call(*new, *options, folder=tmp_path)
    assert answer.returncode == 0, answer.stderr
    project = tmp_path / "mine"
    assert enter == ["cd", "mine", "&&", "pip", "install", "-e", "."]
    install_project(project / "site", (project / "pyproject.toml").read_text(encoding="utf-8"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [str(project), os.environ.get("PYTHONPATH")])))
    choices = (*CHOICE, "patch.flat.solve") if options == ("--3d",) else CHOICE
    tested = call(*tests, "-k", " or ".join(choices), folder=project)
    assert tested.returncode == 0, tested.stdout + tested.stderr
    n_formulations = 2 if options == ("--jax",) else 1
    assert re.search(rf"contactverif: {len(choices) * n_formulations} checks", tested.stdout), tested.stdout
    verified = call(*verify, *(f"-p{choice}" for choice in choices), "--examples", "8", folder=project)
    assert verified.returncode == 0, verified.stdout + verified.stderr
    assert verified.stdout.startswith("profile ci: 8 random cases for each property, seed 0\n")
    assert f"\nmine: {len(choices)} pass\n" in verified.stdout
    assert "\nEvery promise is kept and every property was judged.\n" in verified.stdout


@pytest.mark.parametrize(("option", "compiler", "subject"), [("--c", "cc", "c"), ("--fortran", "gfortran", "uel")])
def test_a_new_library_keeps_its_promises(option: str, compiler: str, subject: str, tmp_path: Path) -> None:
    if not (shutil.which("make") and shutil.which(compiler)):
        pytest.skip(f"make or {compiler} is missing")
    assert call("contactverif", "new", "mine", option, folder=tmp_path).returncode == 0
    subprocess.run(["make"], cwd=tmp_path / "mine", check=True)
    choices = (f"-p{choice}" for choice in CHOICE)
    verified = call(
        "contactverif", "verify", f"{subject}:file=mine.so", *choices, "--examples", "8", folder=tmp_path / "mine"
    )
    assert verified.returncode == 0, verified.stdout + verified.stderr
    assert "passes: " in verified.stdout
    assert "hard 1 of 1" in verified.stdout


def plain_lines(text: str) -> list[str]:
    """Return the lines of a text, without its numbers."""
    return [re.sub(r"-?\d[\d.e-]*", "#", line.rstrip()) for line in text.splitlines()]


@pytest.mark.skipif(not (shutil.which("make") and shutil.which("gfortran")), reason="make or gfortran is missing")
def test_verify_says_of_the_project_what_the_page_quotes(tmp_path: Path) -> None:
    right, wrong = blocks("text", USER_ELEMENTS)[:2]
    new, build, verify = (shlex.split(line) for line in commands(USER_ELEMENTS))
    assert call(*new, folder=tmp_path).returncode == 0
    assert build == ["cd", "mine", "&&", "make"]
    project = tmp_path / "mine"
    source = project / "mine.f90"
    text = source.read_text(encoding="utf-8")
    assert text in USER_ELEMENTS
    assert text.count(BOTH_TERMS) == 1
    for content, status, quote in (
        (text, 0, right),
        (text.replace(BOTH_TERMS, "vt(i) * vn0(j)"), 1, wrong),
    ):
        (project / "mine.so").unlink(missing_ok=True)
        source.write_text(content, encoding="utf-8")
        subprocess.run(["make"], cwd=project, check=True)
        answer = call(*verify, "--examples", "3", folder=project)
        assert answer.returncode == status, answer.stdout + answer.stderr
        assert set(plain_lines(quote)) <= set(plain_lines(answer.stdout)), answer.stdout


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler called cc")
def test_the_tests_of_the_page_pass(tmp_path: Path) -> None:
    for name, language in (("test_search.py", "python"), ("nearest_segment.c", "c")):
        (tmp_path / name).write_text(*blocks(language, SEARCH), encoding="utf-8")
    finished = subprocess.run([*PROGRAMS["pytest"], "test_search.py"], cwd=tmp_path, capture_output=True, text=True)
    assert finished.stdout.splitlines()[-1].startswith("2 passed"), finished.stdout


def test_the_page_about_faces_quotes_what_its_commands_print(tmp_path: Path) -> None:
    results = outputs(FACES, tmp_path)
    for quote in quotes(FACES):
        finished = results[quote.command]
        assert finished.returncode == 0, finished.stderr
        assert quote.block == excerpt(finished.stdout, quote.argument)


def test_the_quoted_verdicts_are_those_that_its_python_must_print() -> None:
    assert blocks("text", FACES.read_text(encoding="utf-8"))[0].strip() == PYTHON["tutorial/faces.md"]
