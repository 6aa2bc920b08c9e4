"""The page "Test your search" is true: its tests and its C library pass as they stand."""

import shutil
import subprocess
from pathlib import Path

import pytest
from quotes import DOCS, PROGRAMS, blocks


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler called cc")
def test_the_tests_of_the_page_pass(tmp_path: Path) -> None:
    page = (DOCS / "how-to" / "test-your-search.md").read_text(encoding="utf-8")
    for name, language in (("test_search.py", "python"), ("nearest_segment.c", "c")):
        (tmp_path / name).write_text(*blocks(language, page), encoding="utf-8")
    finished = subprocess.run([*PROGRAMS["pytest"], "test_search.py"], cwd=tmp_path, capture_output=True, text=True)
    assert finished.stdout.splitlines()[-1].startswith("2 passed"), finished.stdout
