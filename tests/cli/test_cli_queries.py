"""The commands `queries` and `score`: files that are written and scored, a C program, and a user's mistakes."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from asking import Ask

from contactverif.studies.queries.query_making import KINDS

ROOT = Path(__file__).parents[2]
C_PROGRAM = ROOT / "examples" / "nearest_segment.c"
NUMBER = 10 * len(KINDS)


@pytest.fixture
def file(ask: Ask, tmp_path: Path) -> Path:
    path = tmp_path / "queries.txt"
    assert ask("queries", "--out", path, "-n", str(NUMBER)).status == 0
    return path


def rows(out: str) -> dict[str, list[str]]:
    """Return {kind: cells} of a table of scores."""
    names = {kind.name for kind in KINDS}
    cells = {}
    for line in out.splitlines():
        first, *others = line.split() or [""]
        if len(others) == 9 and first in names:
            cells[first] = others
        elif line.strip().startswith("all kinds"):
            cells["all kinds"] = others[1:]
    return cells


def test_two_files_are_written_and_named(ask: Ask, tmp_path: Path) -> None:
    path = tmp_path / "queries.txt"
    answer = ask("queries", "--out", path, "--seed", "4", "-n", str(NUMBER))
    assert answer == (
        0,
        f"queries: {path}, {NUMBER} of {len(KINDS)} kinds\nexact answers: {tmp_path / 'queries.exact.txt'}\n",
        "",
    )
    assert path.read_text().startswith("contactverif-queries 1 ")
    before = path.read_bytes(), (tmp_path / "queries.exact.txt").read_bytes()
    ask("queries", "--out", path, "--seed", "4", "-n", str(NUMBER))
    assert before == (path.read_bytes(), (tmp_path / "queries.exact.txt").read_bytes())


def test_the_built_in_search_is_scored(ask: Ask, file: Path) -> None:
    answer = ask("score", file, "--built-in")
    assert answer.status == 0
    cells = rows(answer.out)
    assert set(cells) == {*(kind.name for kind in KINDS), "all kinds"}
    assert cells["all kinds"][0] == str(NUMBER)
    assert cells["inside"][:5] == ["10", "0", "0", "0", "0"]
    assert "mistakes     wrong decisions that roundoff does not explain" in answer.out


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler called cc")
def test_the_c_program_of_the_how_to_is_scored(ask: Ask, file: Path, tmp_path: Path) -> None:
    program = tmp_path / "nearest_segment"
    command = ["cc", "-O2", "-std=c99", "-Wall", "-Wextra", "-Werror", "-o", program, C_PROGRAM, "-lm"]
    subprocess.run(command, check=True)
    answer = ask("score", file, "--", program)
    assert answer.status == 0, answer.err
    cells = rows(answer.out)
    wrong = {kind for kind, values in cells.items() if values[1] != "0"}
    assert wrong <= {"near-tie", "node-hit", "node-almost-hit", "all kinds"}
    assert float(cells["all kinds"][6]) <= 4
    assert float(cells["all kinds"][7]) <= 4
    assert re.fullmatch(r"[\d.e-]+", cells["all kinds"][8]), "the program states its seconds"


def test_answers_in_a_file_are_scored_and_may_be_too_wrong(ask: Ask, file: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine.txt"
    mine.write_text("".join(f"{number} ?\n" for number in range(NUMBER)))
    silent = ask("score", file, "--answers", mine, "--at-most", "0")
    assert silent.status == 0
    assert rows(silent.out)["all kinds"][5] == str(NUMBER)
    mine.write_text("".join(f"{number} 0 1 ? ?\n" for number in range(NUMBER)))
    assert ask("score", file, "--answers", mine, "--at-most", "999999").status == 0
    answer = ask("score", file, "--answers", mine, "--at-most", "1000")
    assert answer.status == 1
    assert re.search(r"^wrong decisions a million: \d{6}, but --at-most 1000$", answer.out, re.MULTILINE)
    assert "the first wrong decision of each kind\n  query " in answer.out


def test_the_exact_answers_may_have_another_name(ask: Ask, file: Path, tmp_path: Path) -> None:
    exact = file.with_suffix(".exact.txt").rename(tmp_path / "truth.txt")
    assert ask("score", file, "--built-in", "--exact", exact).status == 0
    answer = ask("score", file, "--built-in")
    assert answer.status == 2
    assert "queries.exact.txt, which does not exist" in answer.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("queries",), "Missing option '--out'"),
        (("queries", "--out", "queries.nc"), "--out: found 'queries.nc'; needed a name that ends in .txt"),
        (("queries", "--out", "FOLDER/queries.txt", "-n", "5"), f"-n: found 5; needed at least {len(KINDS)}"),
        (("queries", "--out", "FOLDER/queries.txt", "--seed", "-1"), "--seed: found -1; needed a number of at least 0"),
        (("score",), "Missing argument 'QUERIES'"),
        (("score", "FILE"), "PROGRAM: found nothing; needed one of -- PROGRAM, --answers FILE and --built-in"),
        (("score", "FILE", "--built-in", "--", "a", "b"), "PROGRAM: found a b and --built-in; needed one of"),
        (("score", "FILE", "--answers", "FILE"), "line 1: found 'contactverif-queries'; needed an integer from 0 to"),
        (
            ("score", "FILE", "--", "FOLDER/none"),
            "none: No such file or directory; needed a program that can be started",
        ),
        (("score", "FOLDER/none.txt", "--built-in"), "none.txt, which does not exist; needed a text file"),
    ],
)
def test_a_mistake_is_one_line(
    ask: Ask, file: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], words: str
) -> None:
    monkeypatch.chdir(file.parent)
    places = {"FILE": str(file), "FOLDER": str(file.parent)}
    answer = ask(*(re.sub("FILE|FOLDER", lambda match: places[match[0]], argument) for argument in arguments))
    assert answer.status == 2
    assert words in answer.err
    assert answer.err.count("\n") == 1
