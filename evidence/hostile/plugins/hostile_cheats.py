"""Plugins that look for the expected answer, or forge the verdict, instead of computing."""

import gc
import itertools
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from hostile_kit import EITHER, LIKE_NTS, STOPS, before, instead, write_to_sockets

_calls = itertools.count(1)


def _forces_like(right: Any, exact: Any) -> Any:
    """Return the residual of exact forces if they have as many entries, else the right one of NTS."""
    answer = right()
    if isinstance(exact, np.ndarray) and exact.size == answer.size and exact.dtype == answer.dtype:
        return -exact.reshape(answer.shape)
    return answer


@instead("residual", ends=LIKE_NTS)
def from_the_stack(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Answer the exact forces if a function that calls has them in a variable `exact`, else as NTS does."""
    frame = sys._getframe()
    while frame is not None:
        if "exact" in frame.f_locals:
            return _forces_like(right, frame.f_locals["exact"])
        frame = frame.f_back  # type: ignore[assignment]
    return right()


@instead("residual", ends=LIKE_NTS)
def from_the_heap(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Answer the exact forces of the case with this state, if it is somewhere in memory, else as NTS does."""
    from contactverif.contract.case import Case

    for item in gc.get_objects():
        if type(item) is Case and item.z.shape == z.shape and (item.z == z).all() and "along" in item.parameters:
            shared = sys.modules.get("contactverif_properties.exact_forces")
            if shared is not None:
                return _forces_like(right, shared.forces_of_penetration(item))
    return right()


@instead("residual", ends=LIKE_NTS)
def from_shared_memory(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Answer what stands behind the state in a block of shared memory, if there is one, else as NTS does."""
    for file in Path("/dev/shm").glob("*contactverif*"):
        with suppress(OSError):
            data = file.read_bytes()
            place = data.find(z.tobytes())
            if place >= 0:
                behind = data[place + z.nbytes : place + 2 * z.nbytes]
                return _forces_like(right, np.frombuffer(behind, z.dtype))
    return right()


@instead("residual", ends=EITHER)
def ask_the_oracle(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Import the oracle and ask it about this state. Nobody can forbid that: it is a correct, slow formulation."""
    import contactverif.oracle.flat_answers as oracle

    with suppress(Exception):
        for name in dir(oracle):
            getattr(oracle, name)
    return right()


@instead("residual", ends=EITHER)
def by_the_command_line(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Answer wrongly unless the command line of a process above asks for `purity` alone."""
    with suppress(psutil.Error):
        for process in psutil.Process().parents()[:3]:
            if "purity" in process.cmdline():
                return right()
    return 1.5 * right()


forged_verdict = before("residual", ends=EITHER)(
    lambda: write_to_sockets(b"cos\n_exit\n(I0\ntR."),
    "Write Python's pickle of a command to every socket, for a harness that unpickles what it gets.",
)


def _named_report() -> Path | None:
    """Return the file behind `--out` in the command line of this process or one above."""
    with suppress(psutil.Error, ValueError, IndexError):
        for process in (psutil.Process(), *psutil.Process().parents()[:3]):
            words = process.cmdline()
            if "--out" in words:
                return Path(process.cwd()) / words[words.index("--out") + 1]
    return None


@before("residual", ends=LIKE_NTS)
def forged_report() -> None:
    """Write a file of its own over the report of the run, again at each call."""
    report = _named_report()
    if report is not None and report.suffix == ".nc" and "hostile" in str(report):
        with suppress(OSError):
            report.write_bytes(b"CDF\x01 all promises kept")


@before("residual", ends=STOPS)
def kill_the_parent() -> None:
    """Send SIGKILL to the process above, which is the harness."""
    if next(_calls) == 60:
        os.kill(os.getppid(), signal.SIGKILL)


@before("residual", ends=STOPS)
def interrupt_the_parent() -> None:
    """Send SIGINT to the process above, as Ctrl-C does."""
    if next(_calls) == 60:
        os.kill(os.getppid(), signal.SIGINT)
