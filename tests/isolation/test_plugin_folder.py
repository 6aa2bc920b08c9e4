"""The folder for temporary files of plugins: a process that was killed leaves none for long."""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from contactverif.isolation.box import hold_folder, plugin_folder, remove_abandoned_folders, remove_plugin_folder
from contactverif.run.worker_pool import worker_pool

HOLDER = """
from contactverif.isolation.box import plugin_folder

print(plugin_folder(), flush=True)
input()
"""
SERVER = """
import os, signal
from contactverif.run.worker_pool import start_server

if __name__ == "__main__":
    start_server()
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    remove_plugin_folder()
    yield tmp_path
    remove_plugin_folder()


def test_the_folder_of_a_killed_process_goes_and_that_of_a_living_one_stays(empty: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as holder:
        assert holder.stdout is not None
        other = Path(holder.stdout.readline().strip())
        (other / "file").touch()
        mine = Path(plugin_folder())
        assert {*empty.iterdir()} == {other, mine}
        holder.kill()
    remove_plugin_folder()
    assert {*empty.iterdir()} == {other}
    mine = Path(plugin_folder())
    assert {*empty.iterdir()} == {mine}


def test_the_folder_of_a_server_of_workers_is_held_beyond_a_run(empty: Path) -> None:
    """The next run of a notebook uses the same server."""
    folder = empty / "pymp-mine"
    folder.mkdir()
    hold_folder(str(folder))
    plugin_folder()
    remove_plugin_folder()
    remove_abandoned_folders()
    assert folder.exists()


def test_the_next_run_removes_the_folder_of_a_server_of_workers_that_was_killed(empty: Path) -> None:
    (empty / "pymp-of-another-program").mkdir()
    subprocess.run([sys.executable, "-c", SERVER], check=False)
    assert len([*empty.glob("pymp-*")]) == 2
    with worker_pool(1):
        assert [path.name for path in empty.iterdir()] == ["pymp-of-another-program"]
