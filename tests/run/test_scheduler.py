"""The work of a run in several processes: the same results, and a clear end whatever happens to a worker."""

import errno
import multiprocessing
import multiprocessing.synchronize
import os
import signal
import sys
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from itertools import count
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from same_facts import facts

from contactverif import Interface, Subject, load_formulation, load_properties, named_case
from contactverif.contract.errors import MisuseError
from contactverif.contract.result import NotLoaded
from contactverif.contract.traits import Traits
from contactverif.isolation import host
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote import RemoteSubject, code_files, note_code_files, places
from contactverif.plugins.registry import load_subject, start_loading
from contactverif.run import scheduler
from contactverif.run.run import run
from contactverif.run.scheduler import CaseChunk, WorkerError, begin_loading, decode, encode
from contactverif.run.worker_pool import default_jobs, usable_cores, worker_pool

LIMITS = Limits()
PROPERTY_IDS = ("balance.moment", "patch.flat.transmission", "hard.deep", "hard.dead-zone")


@pytest.fixture(scope="module")
def pool() -> Iterator[Executor]:
    with worker_pool(2) as executor:
        assert executor is not None
        yield executor


class Ends:
    """A formulation that ends its process."""

    traits = Traits()

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
        os._exit(0)


def test_one_process_and_two_give_the_same_results_bit_by_bit(pool: Executor) -> None:
    subjects = [load_formulation("vts-ppt"), load_formulation("nts")]
    alone, shared = (
        run(subjects, load_properties(PROPERTY_IDS), examples=30, seed=3, executor=executor, shrink="all")
        for executor in (None, pool)
    )
    assert facts(alone) == facts(shared)
    assert any(row.shrunk is not None for row in shared.rows)
    assert any(row.witness is not None for row in shared.rows)


def test_a_formulation_that_stands_alone_is_judged_here_and_in_workers(pool: Executor) -> None:
    subject = load_subject("vts-ppt", LIMITS)
    assert isinstance(subject, RemoteSubject)
    processes = set[int]()

    def jobs() -> Iterator[scheduler.Job]:
        while len(processes) < 2:  # A worker takes part as soon as it has started the process of the formulation.
            yield scheduler.Job(os.getpid, (), processes.add)

    scheduler.Scheduler(pool, subject=subject).work(jobs())
    assert os.getpid() in processes
    processes.clear()
    scheduler.Scheduler(pool, subject=subject).work(
        scheduler.Job(os.getpid, (), processes.add, is_local=True) for _ in range(9)
    )
    assert processes == {os.getpid()}
    here, shared = (
        run([subject], load_properties(PROPERTY_IDS), examples=60, seed=3, executor=executor, shrink="all")
        for executor in (None, pool)
    )
    assert facts(here) == facts(shared)
    host.end_all()


class Busy(Executor):
    """An executor whose only worker never begins its second job."""

    _max_workers = 1

    def __init__(self) -> None:
        self.n_jobs = 0

    def submit(self, function: Any, /, *arguments: Any, **options: Any) -> Future[Any]:
        future, self.n_jobs = Future[Any](), self.n_jobs + 1
        if self.n_jobs == 1:
            future.set_result(function(*arguments, **options))
        return future


def test_what_no_worker_has_begun_is_done_here() -> None:
    subject, busy, results = load_subject("nts", LIMITS), Busy(), list[int]()
    assert isinstance(subject, RemoteSubject)
    numbers = count()

    def jobs() -> Iterator[scheduler.Job]:
        while busy.n_jobs < 3:
            yield scheduler.Job(abs, (next(numbers),), results.append)

    scheduler.Scheduler(busy, subject=subject).work(jobs())
    assert sorted(results) == [*range(next(numbers))]
    host.end_all()


def test_what_a_function_defines_runs_in_the_parent(pool: Executor) -> None:
    processes = set()

    class Local:
        traits = Traits()

        def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
            processes.add(os.getpid())
            return 0 * z

    local = Subject("local", lambda *, penalty: Local())
    result = run([local], load_properties(["balance.force"]), examples=10, seed=1, executor=pool)
    assert processes == {os.getpid()}
    assert result.rows[0].judged == 10


def test_a_worker_that_dies_ends_the_run_with_one_clear_line() -> None:
    ends = object.__new__(Subject)  # Its constructor would call nothing, but the run must not either.
    ends.name, ends._make, ends.traits, ends.provides = "ends", Ends, Ends.traits, frozenset()
    with pytest.raises(WorkerError, match="a worker process died"), worker_pool(2) as executor:
        run([ends], load_properties(["balance.force"]), examples=10, seed=1, executor=executor)


def test_an_executor_with_threads_is_refused() -> None:
    with ThreadPoolExecutor(2) as threads, pytest.raises(MisuseError, match="executor: found a ThreadPoolExecutor"):
        run([load_formulation("nts")], load_properties(["purity"]), examples=1, executor=threads)


def test_the_default_number_of_jobs_follows_the_planned_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("contactverif.run.worker_pool.usable_cores", lambda: 4)
    assert default_jobs(10**6) == 1  # Here pytest runs.
    for name in ("PYTEST_CURRENT_TEST", "PYTEST_XDIST_WORKER"):
        monkeypatch.delenv(name, raising=False)
    assert [default_jobs(planned) for planned in (100, 1999, 2000, 3000, 10**6)] == [1, 1, 2, 3, 4]


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="this system does not bind processes to cores")
def test_only_the_cores_that_a_container_allows_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {3})
    assert usable_cores() == 1


def test_what_travels_is_the_same_and_read_only_there() -> None:
    (case,) = decode(encode(CaseChunk([named_case("c-prime")], 0))).cases
    before = named_case("c-prime")
    assert {name: values.tobytes() for name, values in case.to_arrays().items()} == {
        name: values.tobytes() for name, values in before.to_arrays().items()
    }
    for array in (case.z, case.interface.nodes, case.interface.slave.segments, *case.parameters.values()):
        assert not array.flags.writeable
        with pytest.raises(ValueError, match="WRITEABLE"):
            array.setflags(write=True)
    (question,) = load_properties(["purity"])
    assert decode(encode(question)) is question
    assert decode(encode(np.empty((0, 2)))).shape == (0, 2)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signal")
def test_an_interrupt_in_the_parent_ends_workers_that_hear_none_themselves(pool: Executor) -> None:
    assert pool.submit(signal.getsignal, signal.SIGINT).result() is signal.SIG_IGN
    before = set(multiprocessing.active_children())
    started: set[BaseProcess] = set()

    def interrupt() -> None:
        with worker_pool(2) as executor:
            assert executor is not None
            executor.submit(signal.getsignal, signal.SIGINT).result()
            executor.submit(signal.pause)  # It would never end.
            started.update(set(multiprocessing.active_children()) - before)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupt()
    assert started
    for worker in started:
        worker.join()
        assert worker.exitcode != 0


def test_processes_that_cannot_share_memory_have_a_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(multiprocessing.synchronize.SemLock, "__init__", refuse)
    words = "--jobs: found 2, but .*Read-only file system; needed --jobs 1, or a /dev/shm that can be written"
    with pytest.raises(MisuseError, match=words), worker_pool(2):
        pass


def test_how_often_a_plugin_hung_in_one_process_is_known_in_the_others() -> None:
    known, key = host.hangs(), (("program",), "sleeper", Limits())
    job = encode((abs, (-1,), Counter({key: 1})))
    for _ in range(2):  # A number that comes back is not counted again.
        _, _, there = decode(scheduler._do(job))
        host.note_hangs(there)
        assert known[key] == 1
    host.end_all()
    assert not known


def test_what_a_plugin_prints_in_a_worker_comes_to_the_parent(pool: Executor, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduler, "last_words", lambda: {"loud": b"words"})
    result, words, _ = decode(scheduler._do(encode((abs, (-1,), Counter()))))
    assert (result, words) == (1, {"loud": b"words"})
    results: list[int] = []
    jobs = (scheduler.Job(abs, (number,), lambda answer: results.append(answer) or ()) for number in (-2, -3))
    scheduler.Scheduler(pool).work(jobs)
    assert sorted(results) == [2, 3]


# ---------------------------------------------------------------------------------------------------------------------
# Workers load formulations as this process does: what loads, what does not, and what a user has mistyped.


def test_what_has_begun_to_load_is_not_begun_again() -> None:
    for _ in range(2):
        start_loading("nts", LIMITS)
    subject = load_subject("nts", LIMITS)
    assert isinstance(subject, RemoteSubject)
    assert subject.host.n_started == 1
    host.end_all()


def test_a_worker_loads_what_this_process_loads(pool: Executor) -> None:
    loader, _ = begin_loading(["vts-me:n=4", "nts"], LIMITS, pool)
    there, here = loader(), load_subject("vts-me:n=4", LIMITS)
    assert isinstance(there, Subject)
    assert isinstance(here, Subject)
    assert (there.name, there.traits, there.provides) == (here.name, here.traits, here.provides)


def test_the_compiled_code_of_a_workers_plugin_is_in_the_report(pool: Executor) -> None:
    loader, _ = begin_loading(["sts", "nts"], LIMITS, pool)
    subject = loader()
    assert isinstance(subject, Subject)
    assert any("numba" in str(file) for file in code_files(subject))
    note_code_files(subject, [*code_files(subject), Path(__file__)])  # This process may run the others, too.
    assert Path(__file__).name in places([subject])["libraries"]


def test_a_mistyped_name_is_the_users_mistake_and_the_others_load(pool: Executor) -> None:
    wrong, right = begin_loading(["vts-me:n=four", "nts"], LIMITS, pool)
    with pytest.raises(MisuseError, match="option n of 'vts-me:n=four'") as there:
        wrong()
    with pytest.raises(MisuseError) as here:
        load_subject("vts-me:n=four", LIMITS)
    assert str(there.value) == str(here.value)
    assert isinstance(right(), Subject)


def test_a_wrapper_without_a_formulation_is_told_as_here(pool: Executor) -> None:
    loader, _ = begin_loading(["two-pass", "nts"], LIMITS, pool)
    loaded = loader()
    assert isinstance(loaded, NotLoaded)
    assert "two-pass/NAME" in loaded.reason


def test_what_does_not_load_says_why(pool: Executor) -> None:
    loader, _ = begin_loading(["nts", "sts"], Limits(memory=1), pool)
    assert isinstance(loader(), NotLoaded)
