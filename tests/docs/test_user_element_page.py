"""The page about user elements: its project builds, and `verify` says of it what the page quotes."""

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
from quotes import DOCS, blocks, call, commands

PAGE = (DOCS / "how-to" / "user-elements.md").read_text(encoding="utf-8")
RIGHT, WRONG = blocks("text", PAGE)[:2]
BOTH_TERMS = "(vt(i) * vn0(j) + vn0(i) * vt(j))"


def plain_lines(text: str) -> list[str]:
    """Return the lines of a text, without its numbers."""
    return [re.sub(r"-?\d[\d.e-]*", "#", line) for line in text.splitlines()]


@pytest.mark.skipif(not (shutil.which("make") and shutil.which("gfortran")), reason="make or gfortran is missing")
def test_verify_says_of_the_project_what_the_page_quotes(tmp_path: Path) -> None:
    new, build, verify = (shlex.split(line) for line in commands(PAGE))
    assert call(*new, folder=tmp_path).returncode == 0
    assert build == ["cd", "mine", "&&", "make"]
    project = tmp_path / "mine"
    source = project / "mine.f90"
    text = source.read_text(encoding="utf-8")
    assert text in PAGE
    assert text.count(BOTH_TERMS) == 1
    for content, status, quote in (
        (text, 0, RIGHT),
        (text.replace(BOTH_TERMS, "vt(i) * vn0(j)"), 1, WRONG),
    ):
        (project / "mine.so").unlink(missing_ok=True)
        source.write_text(content, encoding="utf-8")
        subprocess.run(["make"], cwd=project, check=True)
        answer = call(*verify, "--examples", "3", folder=project)
        assert answer.returncode == status, answer.stdout + answer.stderr
        assert set(plain_lines(quote)) <= set(plain_lines(answer.stdout)), answer.stdout
