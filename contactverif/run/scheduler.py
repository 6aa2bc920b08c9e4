"""The scheduler of a run: it does jobs in this process, in a pool of its own, or in any executor that the user has.

A job is a plain function of data that can be pickled. Jobs may end in any order, with the same results.

- A job that cannot be encoded, because a notebook or a function defines its formulation, runs in the parent.
- A worker that dies ends the run with one clear line. The run never waits for a dead worker.

The workers also load formulations, while the run's own process does other things: one that has loaded a formulation has
its process ready when the first cases come.
"""

import io
import pickle
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import cycle, islice
from pathlib import Path
from typing import Any, Literal

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.errors import ContactverifError, MisuseError
from contactverif.contract.property import Property
from contactverif.contract.result import NotLoaded, Row
from contactverif.contract.subject import Subject
from contactverif.isolation.host import hangs, last_words, note_hangs, note_last_words
from contactverif.isolation.limits import Limits
from contactverif.isolation.remote import code_files, note_code_files, start_process
from contactverif.plugins.registry import installed_properties, load_property, load_subject, start_loading

Phase = Literal[
    "first call", "first call (compiles)", "asking again", "first round", "drawing", "judging", "diagnosis", "shrinking"
]
_SILENCE = 5.0  # Seconds after which the job that all wait for is reported, to show that the run goes on.
_FURTHER_WORKERS = 32  # The number of workers of an executor that does not say it.
_NOT_HERE = b""  # The answer of a worker that cannot import what a job refers to.


class WorkerError(ContactverifError):
    """A worker process ended before it had done its job."""

    def __init__(self) -> None:
        super().__init__(
            "a worker process died, so the run is not complete; a plugin may have crashed or ended it. "
            "Run again with --jobs 1 to see where"
        )


@dataclass(frozen=True, slots=True)
class RunProgress:
    """The cases of a run that are judged, the number of all, and a guess of the seconds that are left."""

    finished: int
    planned: int  # A guess as long as lists of cases are not made.
    seconds_left: float | None  # None as long as nothing is measured.


def in_words(seconds: float) -> str:
    """Return a guessed time with a unit that suits it."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"about {seconds / size:.0f} {unit}"
    return f"about {seconds:.0f} s"


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of a run with one property of one formulation, named as on the command line.

    The first call of a formulation has no property. Shrinking may end before all planned cases.
    """

    formulation: str
    property_id: str
    phase: Phase
    count: int  # The number of finished cases.
    planned: int
    row: Row | None = None  # The row, once all its cases are judged.
    of_run: RunProgress | None = field(default=None, compare=False)  # How far the run is, with some steps.
    remark: str = ""  # A sentence about the run, once it is known.


@dataclass(frozen=True, slots=True, eq=False)
class Job:
    """A call of a function, and what the parent does with the result: `then` returns the jobs that follow, if any."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    then: "Callable[[Any], Iterable[Job] | None]"
    progress: Progress | None = None  # At its start. In the parent, the function gets `count` to report each case.
    is_local: bool = False  # The parent does it, if it takes part.


class Scheduler:
    """A scheduler of jobs, in the executor or in this process, that reports each step of the progress once.

    All jobs are about `subject`, if there is one, whose process answers here: then this process takes part, and does
    all jobs as long as the workers are starting.
    """

    def __init__(
        self,
        executor: Executor | None = None,
        report: Callable[[Progress], None] | None = None,
        *,
        subject: Subject | None = None,
    ) -> None:
        if isinstance(executor, ThreadPoolExecutor):  # Hypothesis does not allow threads.
            raise MisuseError("executor", "a ThreadPoolExecutor", "one with processes, such as ProcessPoolExecutor")
        self._executor, self._report = executor, report
        self.is_watched = report is not None
        n_workers = int(getattr(executor, "_max_workers", _FURTHER_WORKERS))
        self._takes_part = subject is not None
        self._limit = 1 if executor is None else (4 if self._takes_part else 2) * n_workers
        self._last: Progress | None = None
        self._start: Future[None] | None = None
        if executor is not None and subject is not None:  # In a thread, since the first job waits for the server.
            self._start = ThreadPoolExecutor(1).submit(_start_workers, executor, n_workers, subject)

    def work(self, jobs: Iterable[Job]) -> None:
        """Do all jobs, those that follow from one before all others: so few drawn cases wait at a time."""
        waiting, running = deque([iter(jobs)]), dict[Future[bytes], Job]()
        while waiting or running:
            is_full = len(running) >= self._limit
            job = None if is_full and not self._takes_part else _next_job(waiting)
            if job is None and self._takes_part:  # What no worker has begun is done here.
                job = next((running.pop(future) for future in reversed([*running]) if future.cancel()), None)
                is_full = True
            if job is not None:
                are_starting = self._start is not None and not self._start.done()
                stays = is_full or (self._takes_part and (job.is_local or are_starting))
                future = None if stays else _submit(self._executor, job.function, *job.arguments)
                if future is not None:
                    running[future] = job
                    continue
                if job.progress is not None:
                    self.report(job.progress)
                result = job.function(*job.arguments, **self._counting(job.progress))
                waiting.appendleft(iter(job.then(result) or ()))
            for future in self._wait(running, is_patient=job is None):
                job = running.pop(future)
                here = partial(job.function, *job.arguments, **self._counting(job.progress))
                waiting.appendleft(iter(job.then(_fetch(future, here)) or ()))

    def _wait(self, running: Mapping[Future[bytes], Job], *, is_patient: bool) -> Iterable[Future[bytes]]:
        while running:
            ended = wait(running, _SILENCE if is_patient else 0, FIRST_COMPLETED).done
            if ended or not is_patient:
                return ended
            step = next(iter(running.values())).progress or self._last
            if self._report is not None and step is not None:
                self._report(replace(step, row=None))
        return ()

    def report(self, step: Progress) -> None:
        """Report a step, unless it was the last."""
        if step != self._last and self._report is not None:
            self._last = step
            self._report(step)

    def _counting(self, start: Progress | None) -> dict[str, Callable[[int], None]]:
        """Return the argument with which a job that is done here reports how far it is behind its start."""
        if start is None:
            return {}
        return {"count": lambda finished: self.report(replace(start, count=start.count + finished))}


def _next_job(waiting: deque[Iterator[Job]]) -> Job | None:
    while waiting:
        if (job := next(waiting[0], None)) is not None:
            return job
        waiting.popleft()
    return None


def _start_workers(executor: Executor, count: int, subject: Subject) -> None:
    futures = [_submit(executor, start_process, subject) for _ in range(count)]
    wait(filter(None, futures), return_when=FIRST_COMPLETED)


def _submit(executor: Executor | None, function: Callable[..., Any], *arguments: Any) -> Future[bytes] | None:
    """Hand a call to an executor; return None if there is none, or if the call cannot be encoded."""
    if executor is None:
        return None
    try:
        encoded = encode((function, arguments, hangs()))
    except Exception:  # Pickle raises errors of many kinds.
        return None
    try:
        return executor.submit(_do, encoded)
    except BrokenExecutor as error:
        raise WorkerError from error


def _fetch(future: Future[bytes], here: Callable[[], Any]) -> Any:
    try:
        answer = future.result()
    except BrokenExecutor as error:
        raise WorkerError from error
    if answer == _NOT_HERE:
        return here()
    result, words, known_hangs = decode(answer)
    note_last_words(words)
    note_hangs(known_hangs)
    return result


Loader = Callable[[], Subject | NotLoaded]


def begin_loading(names: Sequence[str], limits: Limits | None, executor: Executor | None = None) -> list[Loader]:
    """Begin to load formulations and engines, named as on the command line, in the workers of an executor.

    Return a function for each name that waits for what is loaded and returns it, or raises a MisuseError as
    `load_subject` does. Without an executor this process loads all: within limits, the first begins to load at once.
    It loads one that stands alone, too, since it takes part in judging it.
    """
    here: list[Loader] = [partial(load_subject, name, limits) for name in names]
    if limits is None:
        return here
    if executor is None or len(names) == 1:
        start_loading(names[0], limits)
        return here
    futures = [_submit(executor, _load, name, limits) for name in names]
    n_workers = int(getattr(executor, "_max_workers", 0))
    for name in islice(cycle(names), len(names), n_workers):  # Each worker has something to load.
        _submit(executor, _load, name, limits)
    return [
        load if future is None else partial(_fetch_subject, future, name, limits)
        for future, name, load in zip(futures, names, here, strict=True)
    ]


def _load(name: str, limits: Limits) -> tuple[Subject | NotLoaded | tuple[str, str, str], list[Path]]:
    try:
        subject = load_subject(name, limits)
    except MisuseError as error:
        return (error.argument, error.found, error.needed), []
    return subject, [] if isinstance(subject, NotLoaded) else code_files(subject)


def _fetch_subject(future: Future[bytes], name: str, limits: Limits) -> Subject | NotLoaded:
    loaded: Subject | NotLoaded | tuple[str, str, str]
    loaded, files = _fetch(future, partial(_load, name, limits))
    if isinstance(loaded, tuple):
        raise MisuseError(*loaded)
    if isinstance(loaded, Subject):
        note_code_files(loaded, files)
    return loaded


def _do(encoded: bytes) -> bytes:
    """Do a job in a worker, and return its result with what plugins have printed there, and how often they hung."""
    try:
        function, arguments, known_hangs = decode(encoded)
    except Exception:  # A module, or a class in a notebook, that is not here.
        return _NOT_HERE
    note_hangs(known_hangs)
    return encode((function(*arguments), last_words(), hangs()))


class CaseChunk:
    """A few cases of a row that are judged in one job. They are encoded once, and decoded when they are wanted.

    `first` is the number of the first of them in the row, and `count` is how many they are.
    """

    __slots__ = ("_cases", "_encoded", "count", "first")

    def __init__(self, cases: Sequence[Case], first: int) -> None:
        self._cases: tuple[Case, ...] | None = tuple(cases)
        self._encoded = b""
        self.first, self.count = first, len(cases)

    @property
    def cases(self) -> tuple[Case, ...]:
        """The cases; of a chunk that came from another process they are made anew at every call."""
        cases: tuple[Case, ...] = decode(self._encoded) if self._cases is None else self._cases
        return cases

    def keep(self) -> None:
        """Keep the cases in memory, for several rows that hold them."""
        self._cases = self.cases

    def __getstate__(self) -> tuple[bytes, int, int]:
        return self._encoded or encode(self._cases), self.first, self.count

    def __setstate__(self, state: tuple[bytes, int, int]) -> None:
        self._cases = None
        self._encoded, self.first, self.count = state


def encode(item: Any) -> bytes:
    """Return an object as bytes, or raise any error if it cannot be pickled, such as a class that a function defines.

    What comes out again is what went in, bit by bit. A read-only array stays read-only, or a plugin could change in a
    worker what it cannot change in the parent. A registered property travels as its id.
    """
    buffer = io.BytesIO()
    _Pickler(buffer, protocol=pickle.HIGHEST_PROTOCOL).dump(item)
    return buffer.getvalue()


decode = pickle.loads  # It raises any error if this process cannot import what the bytes refer to.


class _Pickler(pickle.Pickler):
    def reducer_override(self, item: Any) -> Any:
        if type(item) is np.ndarray and not item.flags.writeable and not item.dtype.hasobject:
            # From bytes, because an array that owns its memory could be made writeable again.
            return np.ndarray, (item.shape, item.dtype.str, item.tobytes())
        if isinstance(item, Property) and _find_registered(item.id) is item:
            return _find_registered, (item.id,)
        return NotImplemented


@cache
def _find_registered(property_id: str) -> Any:
    installed = _read_installed()
    return load_property(property_id, installed) if property_id in installed else None


_read_installed = cache(partial(installed_properties, engines=True))
