"""A few plugins that try what a box forbids, which this file is the program of; what they manage stands in an error."""

import sys

if __name__ == "__main__":
    sys.path[:], sys.argv[1:] = sys.argv[1:], []

import ctypes
import fcntl
import os
import signal
import socket
from contextlib import suppress
from pathlib import Path

import psutil

from contactverif.isolation.confine import PROGRESS
from contactverif.isolation.remote import python_program
from contactverif.isolation.worker import main
from contactverif.plugins.registry import subject_of

PROGRAM = python_program(__file__)
PTRACE_SEIZE = 0x4206
TARGETS = "TARGETS_OF_BOXED_FEW"  # The environment variable with what the attempts aim at, separated by lines.


def read_file(path):
    if Path(path).read_text(encoding="utf-8"):
        return
    raise FileNotFoundError


def fork_often(count):
    """Start many processes at a time, each of which waits."""
    for _ in range(int(count)):
        if os.fork() == 0:
            signal.pause()


def fill_memory(megabytes):
    """Take memory in four processes together, each less than a process may take."""
    for _ in range(4):
        if os.fork() == 0:
            block = bytearray(int(megabytes) * 2**18)
            block[::4096] = b"x" * len(block[::4096])
            os._exit(0)
    statuses = [os.wait()[1] for _ in range(4)]
    if any(statuses):
        raise MemoryError


def talk_to_itself(host):
    """Listen to a port, and connect to it."""
    with socket.create_server((host, 0)) as listener:
        socket.create_connection(listener.getsockname(), 1).close()


def connect_by_file(path):
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(path)


def connect_by_name(name):
    with socket.socket(socket.AF_UNIX) as line:
        line.connect("\0" + name)


def list_folder(path):
    if not os.listdir(path):
        raise FileNotFoundError


def make_user_namespace(flags):
    if os.fork() == 0:
        with suppress(OSError):
            _call("unshare", int(flags))
            os._exit(0)
        os._exit(1)
    if os.wait()[1]:
        raise PermissionError


def lengthen_progress(size):
    number = int(os.environ[PROGRESS])
    fcntl.fcntl(number, fcntl.F_SETFL, os.O_APPEND)  # What the judge writes lands at the end, too.
    os.ftruncate(number, int(size))


def _call(name, *arguments):
    if getattr(ctypes.CDLL(None, use_errno=True), name)(*arguments) < 0:
        raise OSError(ctypes.get_errno(), name)


def write_to_terminal(path):
    with open(path, "w", encoding="utf-8") as terminal:
        terminal.write("\a")


ATTEMPTS = {
    "write_file": lambda path: Path(path).write_text("changed", encoding="utf-8"),
    "delete_file": os.unlink,
    "make_file": lambda path: os.close(os.open(path, os.O_WRONLY | os.O_CREAT, 0o600)),
    "open_to_write": lambda path: os.close(os.open(path, os.O_WRONLY | os.O_NONBLOCK)),
    "see_process": lambda number: psutil.Process(int(number)).cmdline(),
    "stop_process": lambda number: os.kill(int(number), signal.SIGSTOP),
    "limit_process": lambda number: psutil.Process(int(number)).rlimit(psutil.RLIMIT_CORE, (0, 0)),
    "attach_to": lambda number: _call("ptrace", PTRACE_SEIZE, int(number), None, None),
    "connect_by_network": lambda port: socket.create_connection(("127.0.0.1", int(port)), 1).close(),
}


def try_everything():
    """Try everything that the environment names, and return what did not fail."""
    successes = []
    for line in filter(None, os.environ.get(TARGETS, "").splitlines()):
        verb, _, target = line.partition(" ")
        try:
            (ATTEMPTS.get(verb) or globals()[verb])(target)
        except (OSError, MemoryError, psutil.Error):
            continue
        successes.append(verb)
    return successes


class Attempts:
    """It never loads; the reason is what it managed."""

    def __init__(self, *, penalty):
        raise RuntimeError(f"managed: {' '.join(try_everything()) or 'nothing'}")


class Daemons(Attempts):
    """It leaves daemons that fork again and again, so that whoever is killed has been replaced."""

    def __init__(self, *, penalty):
        for _ in range(3):
            if os.fork() == 0:
                os.setsid()
                while True:
                    if os.fork():
                        os._exit(0)
        super().__init__(penalty=penalty)


def load(name):
    return subject_of(name, globals()[name])


if __name__ == "__main__":
    main(load, load)
