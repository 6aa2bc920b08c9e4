"""The answers of programs: what may stand in a line, and the one line that says what may not."""

import os
import sys
from math import isnan
from pathlib import Path

import pytest

from contactverif.contract.errors import MisuseError
from contactverif.studies.queries.answers import Answer, Answers, ask_program, read_answers
from contactverif.studies.queries.query_file import Queries, read_queries
from contactverif.studies.queries.text_lines import TextLines

QUERIES = """contactverif-queries 1 1 3
surface 0 3 2
0.0 0.0
-1.0 0.0
-2.0 0.5
0 1
1 2
query 0 0 -0.5 0.25 inside
query 1 0 -0.5 -0.25 inside
query 2 0 0.25 0.25 free-end
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "queries.txt").write_text(QUERIES)
    return tmp_path / "queries.txt"


@pytest.fixture
def queries(path: Path) -> Queries:
    return read_queries(path)[0]


def read(text: str, queries: Queries) -> Answers:
    return read_answers(TextLines("mine.txt", text), queries)


def test_a_line_says_what_the_program_knows(queries: Queries) -> None:
    answers = read("# mine\n 1 1 -1 5e-1 .25\n\n2 0 ? ? ?\r\n0 ?\n", queries)
    assert answers.answers == [Answer(None), Answer(1, -1, 0.5, 0.25), Answer(0)]
    assert answers.seconds == {}
    assert read("0 ? ? ? ?\n1 ?\n2 ?", queries).answers[0] == Answer(None)


def test_the_order_does_not_matter_and_nan_is_an_answer(queries: Queries) -> None:
    answers = read("2 0 +1 NaN Infinity\n1 ?\n0 ?\n", queries).answers
    assert answers[2].xi is not None
    assert isnan(answers[2].xi)
    assert answers[2].sign == 1


def test_a_comment_may_say_what_all_queries_took_and_those_of_a_kind(queries: Queries) -> None:
    text = "#seconds 0.5\n0 ?\n1 ?\n2 ?\n# seconds inside 1e-3\n# seconds go by\n"
    with pytest.raises(MisuseError, match=r"mine.txt, line 6: found 'seconds go by'; needed # seconds S"):
        read(text, queries)
    assert read(text.replace("# seconds go by", "# go by"), queries).seconds == {"": 0.5, "inside": 1e-3}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("1 1 -1 0.5", "line 2: found '1 1 -1 0.5'; needed QUERY SEGMENT SIGN XI DISTANCE, or QUERY ?"),
        ("3 1 -1 0.5 0.5", "line 2: found '3'; needed an integer from 0 to 2"),
        ("one 1 -1 0.5 0.5", "line 2: found 'one'; needed an integer from 0 to 2"),
        ("1 2 -1 0.5 0.5", "line 2: found '2'; needed an integer from 0 to 1"),
        ("1 1.0 -1 0.5 0.5", "line 2: found '1.0'; needed an integer from 0 to 1"),
        ("1 1 -2 0.5 0.5", "line 2: found '-2'; needed an integer from -1 to 1"),
        ("1 1 -1 0,5 0.5", "line 2: found '0,5'; needed a number"),
        ("1 1 -1 0.5 -0.5", "line 2: found '-0.5'; needed a distance of at least 0; SIGN says on which side"),
        ("0 1 -1 0.5 0.5", "line 2: found a second answer to query 0; needed one answer to each query"),
        ("# seconds -1", "line 2: found '-1'; needed a time of at least 0 s"),
        ("# seconds nowhere 1", "line 2: found 'seconds nowhere 1'; needed # seconds S, or # seconds KIND S"),
        ("2 ?", "mine.txt: found 2 answers and none to query 1; needed answers to all 3 queries"),
    ],
)
def test_a_malformed_line_is_named(queries: Queries, line: str, words: str) -> None:
    rest = "" if words.startswith("mine") else "\n1 ?\n2 ?"
    with pytest.raises(MisuseError) as error:
        read(f"0 ?\n{line}{rest}\n", queries)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_a_long_line_is_cut(queries: Queries) -> None:
    with pytest.raises(MisuseError) as error:
        read("0 " + "1 " * 1000, queries)
    assert len(str(error.value)) < 200


def test_the_start_of_a_program_does_not_count(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run without queries takes 3 s or a little more, a run with them 5 s; one is disturbed and takes longer."""
    times = {True: iter([5.5, 5.0, 9.0, 5.25, 5.125]), False: iter([3.25, 3.5, 3.0, 3.125, 20.0])}
    monkeypatch.setattr(
        "contactverif.studies.queries.answers._time", lambda command, text: next(times[b"\nquery" in text])
    )
    script = "import sys\nfor line in sys.stdin:\n  if line[:5] == 'query': print(line.split()[1], '0 1 0.5 0.25')"
    answers = ask_program([sys.executable, "-c", script], path)
    assert answers.answers == [Answer(0, 1, 0.5, 0.25)] * 3
    assert answers.seconds == {"": 2.0}


def test_a_run_without_queries_still_reads_the_surfaces(path: Path) -> None:
    script = "import sys; text = sys.stdin.read(); assert 'surface 0 3 2' in text\nif 'query 0' in text:\n"
    script += "  for number in range(3): print(number, '?')"
    assert ask_program([sys.executable, "-c", script], path).seconds[""] >= 0


def test_a_program_that_states_its_seconds_runs_once(path: Path, tmp_path: Path) -> None:
    record = f"open({os.fspath(tmp_path / 'runs')!r}, 'a').write('x')"
    script = f"{record}\nprint('# seconds 3')\nfor number in range(3): print(number, '?')"
    assert ask_program([sys.executable, "-c", script], path).seconds == {"": 3.0}
    assert (tmp_path / "runs").read_text() == "x"


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (["./no-such-program"], "PROGRAM: found ./no-such-program: No such file or directory; needed a program that"),
        ([sys.executable, "-c", "raise SystemExit('no surface')"], "which ends with status 1: no surface; needed a"),
        ([sys.executable, "-c", "print('0 1')"], f"the output of {sys.executable}, line 1: found '0 1'; needed QUERY"),
        ([sys.executable, "-c", "import os; os.kill(os.getpid(), 9)"], "which ends with status -9; needed a program"),
    ],
)
def test_a_program_that_fails_is_one_line(path: Path, command: list[str], words: str) -> None:
    with pytest.raises(MisuseError) as error:
        ask_program(command, path)
    assert words in str(error.value)
