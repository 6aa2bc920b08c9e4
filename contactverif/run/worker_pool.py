"""The worker processes of a run: how many there are, and how they start and end.

Ctrl-C goes to the parent alone, which ends the workers. If the parent is killed, they end by themselves. This file
imports no numpy, so that the server of processes is started first and imports while the parent does.
"""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import util
from multiprocessing.process import BaseProcess
from typing import Any

import psutil

from contactverif.contract.errors import MisuseError
from contactverif.isolation.box import hold_folder, remove_abandoned_folders
from contactverif.isolation.confine import ONE_THREAD, die_with_parent, one_thread_for_children

CASES_A_WORKER = 1000  # A worker starts in about two seconds, in which the parent judges some hundred cases.
# What the server of processes imports once for all workers: the judge, and, as it is imported, all properties.
_PRELOAD = ["contactverif.run.run", "contactverif.plugins.preload"]


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
    """Return the number of processes that the user wants, at least 1; too many would fill the memory."""
    most = max(16, 4 * usable_cores())
    if not 1 <= jobs <= most:
        raise MisuseError("--jobs", str(jobs), f"at least 1, at most {most} on this machine")
    return jobs


@contextmanager
def worker_pool(jobs: int, *, parent_judges: bool = False) -> Iterator[Executor | None]:
    """Yield an executor with so many worker processes, or one fewer if the parent does jobs, too; None for one job.

    The workers start with the first job for them.
    """
    if jobs < 1:
        raise MisuseError("jobs", str(jobs), "at least 1")
    remove_abandoned_folders()
    if jobs == 1:
        yield None
        return
    before = set(multiprocessing.active_children())
    try:
        pool = _Pool(jobs - parent_judges, mp_context=_context(), initializer=_begin_worker)
    except (OSError, ImportError) as error:  # Python needs semaphores for it, and they are in shared memory.
        reason = f"{jobs}, but processes cannot share memory here: {getattr(error, 'strerror', None) or error}"
        raise MisuseError("--jobs", reason, "--jobs 1, or a /dev/shm that can be written") from error
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in set(multiprocessing.active_children()) - before:
            worker.terminate()
        # A worker that the server has yet to start would find nothing of this process, and print a traceback. With the
        # server the workers of another pool would end.
        for child in () if before else psutil.Process().children():
            with suppress(psutil.Error):
                if any("multiprocessing.forkserver" in word for word in child.cmdline()):
                    child.kill()
        raise
    pool.shutdown()


class _Pool(ProcessPoolExecutor):
    def submit(self, *arguments: Any, **options: Any) -> Future[Any]:
        start_server()
        return super().submit(*arguments, **options)


def _context() -> Any:
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOAD)
    return context


def start_server() -> None:
    """Start the server of worker processes, unless it runs: it imports while this process goes on."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return
    from multiprocessing import forkserver  # Windows has none.

    _context()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        with one_thread_for_children():  # The server inherits both, and hears no Ctrl-C.
            forkserver.ensure_running()
        hold_folder(util.get_temp_dir())  # That of its socket: a later run removes it if this one is killed.
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin_worker() -> None:
    """Leave interrupts to the parent, end with it, and let what is loaded from now on compute on one thread."""
    os.environ.update(ONE_THREAD)  # For a worker that no server of ours has started.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    die_with_parent()
    parent = multiprocessing.parent_process()
    if parent is not None:  # The server of processes may outlive it.
        threading.Thread(target=_end_after, args=(parent,), daemon=True).start()


def _end_after(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)
