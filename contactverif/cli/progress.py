"""The progress bar of a run, on standard error so that a table can be piped; nothing where nobody watches.

While it is up Ctrl-C ends the run at the next case at the latest: where Python itself drops the interrupt, in a
callback of the garbage collector or of compiled code, the run would go on to its end otherwise.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from contactverif.run import runner


class Bar:
    """A bar that is told how far something is."""

    def __init__(self) -> None:
        console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task: TaskID | None = None
        self._interrupted = False
        self._before: Any = None

    def __enter__(self) -> Bar:
        if threading.current_thread() is threading.main_thread():  # nobody else may ask for signals
            self._before = signal.signal(signal.SIGINT, self._interrupt)
        self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self._progress.stop()
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        self._interrupted = True
        raise KeyboardInterrupt

    def told(self, step: runner.Progress) -> None:
        """One more case is done."""
        self.at(f"{step.formulation}  {step.property_id}  {step.phase}", step.done, step.planned)

    def at(self, description: str, done: int, planned: int) -> None:
        """So many of so many are done, and this comes next."""
        if self._interrupted:
            raise KeyboardInterrupt
        if self._progress.disable:
            return
        if self._task is None:
            self._task = self._progress.add_task(description)
        self._progress.update(self._task, description=description, completed=done, total=planned)
