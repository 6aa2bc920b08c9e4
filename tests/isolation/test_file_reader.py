"""However a child process ends, its parent goes on with one line."""

import os
from pathlib import Path

import psutil
import pytest

from contactverif.contract.errors import MisuseError
from contactverif.isolation import child
from contactverif.isolation.file_reader import ReadError, check_ordinary, read_in_child
from contactverif.isolation.limits import Limits

HERE = Path(__file__).parent


@pytest.fixture(params=[True, False], ids=["fork", "new process"], autouse=True)
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param and not child.FORKS:
        pytest.skip("no forks here")
    monkeypatch.setattr(child, "FORKS", request.param)
    monkeypatch.syspath_prepend(HERE)
    monkeypatch.setenv("PYTHONPATH", str(HERE))


def test_an_answer_arrives_and_nothing_is_printed(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_bytes(b"12345")
    assert read_in_child("bad_readers:length", str(tmp_path / "file"), Limits(20, 500)) == b"5"
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("reader", "words"),
    [
        ("crash", r"reading it crashes \(SIGSEGV\)"),
        ("leave", "reading it ends the process with status 0"),
        ("sleep", "reading it takes longer than 1 s"),
        ("eat", "reading it takes more than 2 MB of memory"),
        ("talk", "(it holds|reading it takes) more than 2 MB( of memory)?"),
        ("fail", "no good x{200,300}"),
        ("leave_python", "bye"),
    ],
)
def test_a_child_that_ends_badly_is_one_line(reader: str, words: str) -> None:
    limits = Limits(1 if reader == "sleep" else 20, 2)
    before = set(psutil.Process().children())  # Such as the fork server of an earlier test.
    with pytest.raises(ReadError, match=f"^({words})$") as caught:
        read_in_child(f"bad_readers:{reader}", "nothing", limits)
    assert "\n" not in str(caught.value)
    assert set(psutil.Process().children()) <= before  # Neither a process nor its status is left behind.


def test_only_an_ordinary_file_is_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    os.symlink(tmp_path / "loop", tmp_path / "loop")
    for path, words in {
        tmp_path: "which is a folder",
        tmp_path / "pipe": "which is a pipe",
        tmp_path / "loop": "which cannot be read",
        tmp_path / "absent": "which does not exist",
        tmp_path / ("x" * 300): "which cannot be read",
        Path("/dev/zero"): "which is a device",
        tmp_path / "a\0b": "which is no name of a file",
    }.items():
        with pytest.raises(MisuseError, match=f"FILE: found .*, {words}.*; needed a file"):
            check_ordinary(path, "FILE", "a file")
