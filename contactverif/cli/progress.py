"""The progress of a run on standard error: a line for each row that is judged, and on a terminal a bar below them.

While the bar is up, Ctrl-C ends the run at the next case at the latest. Python drops an interrupt that arrives in a
callback of the garbage collector or of compiled code; without the bar such a run would go on to its end.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from types import FrameType, TracebackType
from typing import Any

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.text import Text

from contactverif.cli.console import PLAIN_STYLE, STYLES, QuietConsole
from contactverif.contract.foreign_text import one_line
from contactverif.contract.result import Row
from contactverif.run import scheduler

_LONGEST = 120  # Characters beside the bar.


class Bar:
    """A progress bar, up as long as its `with` block lasts."""

    def __init__(self) -> None:
        console = QuietConsole(stderr=True)
        self._progress = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task: TaskID | None = None
        self._interrupted = False
        self._previous_handler: Any = None

    def __enter__(self) -> Bar:
        if threading.current_thread() is threading.main_thread():  # Python allows signal handlers in no other thread.
            self._previous_handler = signal.signal(signal.SIGINT, self._interrupt)
        if not self._progress.disable:
            self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        if not self._progress.disable:  # Old versions of rich end one that never started with an empty line.
            self._progress.stop()
        if self._previous_handler is not None:
            signal.signal(signal.SIGINT, self._previous_handler)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        self._interrupted = True
        raise KeyboardInterrupt

    def show_progress(self, step: scheduler.Progress) -> None:
        """Show how far a run is; the scheduler calls this after every case."""
        if step.row is not None:
            self._show_row(step.row)
        self.update(f"{step.formulation}  {step.property_id}  {step.phase}", step.count, step.planned)

    def _show_row(self, row: Row) -> None:
        # A row without planned cases is that of a failure of an earlier run.
        judged = f", {row.judged}/{row.planned} judged" if row.planned else " again"
        words = f"{row.formulation} {row.property_id}: ", row.result, judged
        reason = f": {row.reason}" if row.reason else ""
        line = Text.assemble(words[0], (words[1], STYLES.get(row.result, PLAIN_STYLE)), words[2] + reason)
        try:
            self._progress.console.print(line, soft_wrap=True)
        except OSError:  # Without a reader the run goes on.
            sys.stderr = open(os.devnull, "w")  # noqa: SIM115, or Python would fail to flush it at the end.

    def update(self, description: str, n_finished: int, n_planned: int) -> None:
        """Show how many of the planned steps are finished, and what comes next.

        Raises
        ------
        KeyboardInterrupt
            If the user has pressed Ctrl-C.
        """
        if self._interrupted:
            raise KeyboardInterrupt
        if self._progress.disable:
            return
        if self._task is None:
            self._task = self._progress.add_task(description)
        self._progress.update(
            self._task, description=one_line(description, _LONGEST), completed=n_finished, total=n_planned
        )
