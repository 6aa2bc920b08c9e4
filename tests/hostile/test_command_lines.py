"""A sample of the random command lines; the long campaign is `python evidence/hostile/command_lines.py 5000`."""

import random
from pathlib import Path

import command_lines
import pytest
from command_lines import BAD, Files, Line, draw_line, run_line, run_lines

SAMPLE = 25


def _line(*arguments: str, streams: str = "", without_folder: bool = False) -> Line:
    return Line(arguments, None, streams, without_folder)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    return Files.make(tmp_path_factory.mktemp("files"))


def test_no_line_of_a_sample_ends_badly(tmp_path: Path) -> None:
    bad = [(line, ending) for line, ending in run_lines(SAMPLE, 7, tmp_path) if ending.word in BAD]
    assert not bad


def test_the_same_seed_draws_the_same_lines(files: Files) -> None:
    first, second = ([draw_line(random.Random(seed), files) for seed in range(50)] for _ in range(2))
    assert first == second
    assert len(set(first)) > 40


@pytest.mark.parametrize("streams", ["stdout closed", "stderr closed", "both closed"])
def test_a_closed_stream_changes_no_status(files: Files, streams: str) -> None:
    assert run_line(_line("report", "good.nc", streams=streams), files).word == "0"
    assert run_line(_line("report", "noise.nc", streams=streams), files).word == "2"


def test_a_working_folder_that_is_gone_is_one_line(files: Files) -> None:
    ending = run_line(_line("verify", "nts", "--out", "a.nc", without_folder=True), files)
    assert ending.word == "2"
    assert ending.last_words == "contactverif: the working folder does not exist any more\n"


def test_bad_endings_are_told_apart(files: Files, monkeypatch: pytest.MonkeyPatch) -> None:
    assert command_lines._judge(None, "", "") == "hang"
    assert command_lines._judge(1, "", "Traceback (most recent call last):\n") == "traceback"
    assert command_lines._judge(-11, "", "") == "crash"
    assert command_lines._judge(3, "", "") == "crash"
    assert command_lines._judge(0, "\x1b[31m", "") == "control character"
    assert command_lines._judge(2, "", "a\nb\n") == "several lines"
    assert run_line(_line("verify", "nts", "--profile", "nightly"), files, limit=0.2).word == "hang"
