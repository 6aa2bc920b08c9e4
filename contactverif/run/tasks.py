"""The pieces of a run that wait, and the report of its progress."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from typing import Any, Literal

from contactverif.run.workers import Team

Phase = Literal["first call (compiles)", "drawing", "judging", "shrinking"]


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of a run with one property of one formulation.

    Attributes
    ----------
    formulation, property_id : str
        The names on the command line; no property in the first call of a formulation.
    phase : Phase
        The kind of work.
    count, planned : int
        The numbers of finished cases and of all cases; shrinking may end early.
    """

    formulation: str
    property_id: str
    phase: Phase
    count: int
    planned: int


class Reporter:
    """Hands each step of the progress to a function, once.

    Parameters
    ----------
    report : Callable[[Progress], None]
        The function.
    """

    def __init__(self, report: Callable[[Progress], None]) -> None:
        self._report = report
        self._last: Progress | None = None

    def counter(self, formulation: str, property_id: str, phase: Phase, planned: int) -> Callable[[int], None]:
        """Return a function that reports how many cases are finished."""
        return lambda count: self._report_once(Progress(formulation, property_id, phase, count, planned))

    def _report_once(self, step: Progress) -> None:
        if step != self._last:
            self._last = step
            self._report(step)


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """A piece that waits.

    Attributes
    ----------
    function : Callable[..., Any] | None
        The piece; None if there is nothing to do but `then`.
    arguments : tuple[Any, ...]
        Its arguments.
    then : Callable[[Any], None]
        What the parent does with its result.
    count : Callable[[int], None] | None
        A function that reports how far it is.
    """

    function: Callable[..., Any] | None
    arguments: tuple[Any, ...]
    then: Callable[[Any], None]
    count: Callable[[int], None] | None = None

    @property
    def here(self) -> dict[str, Any]:
        """The further arguments of a piece that the parent does."""
        return {} if self.count is None else {"count": self.count}


class TaskQueue:
    """The tasks that wait.

    Parameters
    ----------
    team : Team
        Those who do them.
    """

    def __init__(self, team: Team) -> None:
        self._team = team
        self._tasks: deque[Task] = deque()

    def add(self, task: Task) -> None:
        """Add a task behind all others."""
        self._tasks.append(task)

    def add_first(self, tasks: Iterable[Task]) -> None:
        """Add tasks before all others, in their order."""
        self._tasks.extendleft(reversed(list(tasks)))

    def work(self) -> None:
        """Hand out tasks until none is left."""
        running: dict[Future[Any], Task] = {}
        while self._tasks or running:
            while self._tasks and len(running) < self._team.limit:
                task = self._tasks.popleft()
                if task.function is None:
                    task.then(None)
                else:
                    running[self._team.submit(task.function, task.arguments, **task.here)] = task
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                task = running.pop(future)
                assert task.function is not None
                task.then(self._team.result(future, task.function, task.arguments, **task.here))
