"""Ctrl-C while a library has the word: the run ends at once, and nothing of the library goes on."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil

from foreign.comparison import Build

BUSY = 0.5  # Seconds of a processor: the element does not return.


def wait_for_library(run: psutil.Process, library: Path) -> psutil.Process:
    """Return the process in which the library works, once it has worked for a while."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        for process in run.children(recursive=True):
            try:
                inside = any(Path(part.path).name == library.name for part in process.memory_maps())
                if inside and process.cpu_times().user > BUSY + process.cpu_times().system:
                    return process
            except psutil.Error:
                continue
        time.sleep(0.05)
    raise AssertionError("the library was never called")


def test_a_library_is_interrupted_within_a_call(build: Build, tmp_path: Path) -> None:
    library = build("wrong_writes.f90")
    command = [sys.executable, "-m", "contactverif", "verify", f"uel:file={library},props=13", "-p", "balance.force"]
    options = ["--isolation", "box", "--examples", "3", "--seed", "1", "--out", "r.nc"]
    with subprocess.Popen(
        [*command, *options], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as running:
        try:
            worker = wait_for_library(psutil.Process(running.pid), library)
            running.send_signal(signal.SIGINT)
            out, err = running.communicate(timeout=30)
        finally:
            running.kill()
    assert (running.returncode, err.splitlines()[-1]) == (130, "contactverif: stopped")
    assert "stopped: 0 of 3 cases judged" in out
    assert not worker.is_running() or worker.status() == psutil.STATUS_ZOMBIE
    assert [path.name for path in tmp_path.iterdir()] == ["r.nc.journal"]
