"""The processes that do the pieces of a run: none, a pool of our own, or any executor that the user has.

Rules for the next editor:

- A piece that cannot travel, because a notebook or a function defines its formulation, runs in the parent.
- A worker that dies ends the run with one clear line. The run never waits for a dead worker.
- Ctrl-C goes to the parent alone, which ends the workers. If the parent is killed, they end by themselves.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing.process import BaseProcess
from typing import Any

from contactverif.contract.errors import ContactverifError, MisuseError
from contactverif.isolation.host import last_words, note_last_words
from contactverif.isolation.parent_death import die_with_parent
from contactverif.run.packing import pack, unpack

CASES_A_WORKER = 1000  # A worker starts in about two seconds, in which the parent judges some hundred cases.
# The modules that the server of processes imports once for all workers: the judge, and libraries that import slowly.
_PRELOAD = ["contactverif.run.pieces", "contactverif.mechanics.accuracy", "contactverif.strategies", "numba"]
_FURTHER_WORKERS = 32  # The number of workers of an executor that does not say it.
_NOT_HERE = b""  # The answer of a worker that cannot import what a piece refers to.


class WorkerError(ContactverifError):
    """A worker process ended before it had done its piece."""


def usable_cores() -> int:
    """Return the number of cores that this process may use, which in a container may be few."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def default_jobs(planned: int) -> int:
    """Return the number of workers for a number of planned cases: one for each 1000, at most one for each core.

    Under pytest it is 1, because pytest-xdist has started as many processes as there are cores.
    """
    if "PYTEST_CURRENT_TEST" in os.environ or "PYTEST_XDIST_WORKER" in os.environ:
        return 1
    return max(1, min(usable_cores(), planned // CASES_A_WORKER))


def check_jobs(jobs: int) -> int:
    """Return the number of processes that the user wants.

    Raises
    ------
    MisuseError
        If it is less than 1, or more processes than help: they would fill the memory.
    """
    most = max(16, 4 * usable_cores())
    if not 1 <= jobs <= most:
        raise MisuseError("--jobs", str(jobs), f"at least 1, at most {most} on this machine")
    return jobs


@contextmanager
def worker_pool(jobs: int) -> Iterator[Executor | None]:
    """Yield an executor with so many worker processes; None for one job, which the parent does itself.

    Enter it before plugins and properties are loaded: the workers import while the parent does.

    Raises
    ------
    MisuseError
        If there is less than one job.
    """
    if jobs < 1:
        raise MisuseError("jobs", str(jobs), "at least 1")
    if jobs == 1:
        yield None
        return
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(jobs, mp_context=_context(), initializer=_begin)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in set(multiprocessing.active_children()) - before:
            worker.terminate()
        raise
    pool.shutdown()


def _context() -> Any:
    """Return the way to start processes: from a server that has imported the harness, where there is one."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    from multiprocessing import forkserver  # Windows has none.

    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOAD)
    with _interrupts_wait():  # The server inherits that, and hears no Ctrl-C.
        forkserver.ensure_running()  # It imports while the parent goes on.
    return context


@contextmanager
def _interrupts_wait() -> Iterator[None]:
    """Open a block behind which Ctrl-C is heard at the latest."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin() -> None:
    """Leave interrupts to the parent, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    die_with_parent()
    parent = multiprocessing.parent_process()
    if parent is not None:  # The server of processes may outlive it.
        threading.Thread(target=_end_after, args=(parent,), daemon=True).start()


def _end_after(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)


class Team:
    """The processes that do the pieces.

    Parameters
    ----------
    executor : Executor | None
        The executor; None if the parent does all.

    Attributes
    ----------
    limit : int
        The number of pieces that are handed out at a time.

    Raises
    ------
    MisuseError
        If the executor has threads, which hypothesis does not allow.
    """

    def __init__(self, executor: Executor | None) -> None:
        if isinstance(executor, ThreadPoolExecutor):
            raise MisuseError("executor", "a ThreadPoolExecutor", "one with processes, such as ProcessPoolExecutor")
        self._executor = executor
        self.limit = 1 if executor is None else 2 * int(getattr(executor, "_max_workers", _FURTHER_WORKERS))

    def submit(self, function: Callable[..., Any], arguments: tuple[Any, ...], **here: Any) -> Future[Any]:
        """Hand out a piece. In the parent it is done at once, with the further arguments `here`."""
        if self._executor is not None:
            try:
                packed = pack((function, arguments))
            except Exception:  # Pickle raises errors of many kinds.
                packed = _NOT_HERE
            if packed:
                try:
                    return self._executor.submit(_do, packed)
                except BrokenExecutor as error:
                    raise _make_error() from error
        future: Future[Any] = Future()
        future.set_result(_Here(function(*arguments, **here)))
        return future

    def result(self, future: Future[Any], function: Callable[..., Any], arguments: tuple[Any, ...], **here: Any) -> Any:
        """Return the result of a finished piece; a piece that its worker could not import is done now.

        Raises
        ------
        WorkerError
            If the worker has died.
        Exception
            If the piece raised it.
        """
        try:
            answer = future.result()
        except BrokenExecutor as error:
            raise _make_error() from error
        if isinstance(answer, _Here):
            return answer.result
        if answer == _NOT_HERE:
            return function(*arguments, **here)
        result, words = unpack(answer)
        note_last_words(words)
        return result


class _Here:
    """The result of a piece that the parent has done."""

    def __init__(self, result: Any) -> None:
        self.result = result


def _do(packed: bytes) -> bytes:
    """Do a piece in a worker, and return its result with what plugins have printed there."""
    try:
        function, arguments = unpack(packed)
    except Exception:  # A module, or a class in a notebook, that is not here.
        return _NOT_HERE
    return pack((function(*arguments), last_words()))


def _make_error() -> WorkerError:
    return WorkerError(
        "a worker process died, so the run is not complete; a plugin may have crashed or ended it. "
        "Run again with --jobs 1 to see where"
    )
