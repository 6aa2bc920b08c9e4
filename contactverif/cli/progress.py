"""The progress of a run on standard error: a line for each row, and below it a bar, or in a file a line now and then.

While the bar is up, Ctrl-C or SIGTERM ends the run at the next case at the latest, or at the next look at a plugin that
does not answer. Python drops an interrupt that arrives in a callback of the garbage collector or of compiled code;
without the bar such a run would go on to its end.
"""

import os
import signal
import sys
import threading
from time import monotonic
from types import FrameType, TracebackType
from typing import Any, Self

from rich.progress import BarColumn, MofNCompleteColumn, Progress, Task, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Column
from rich.text import Text

from contactverif.cli.console import QuietConsole
from contactverif.contract.errors import one_line
from contactverif.isolation.process import stop_signals
from contactverif.run import scheduler
from contactverif_reports.tables import PLAIN_STYLE, STYLES

SIGNALED = 128  # The exit status of a run that a signal stops is this and its number.
_LONGEST = 120  # Characters beside the bar.
_LONG_CASE = 10.0  # Seconds without news that are worth a word.
_PAUSE = 5.0  # Seconds between two lines about the whole, where there is no terminal.


class _TimeColumn(TimeElapsedColumn):
    """The time without news, if that is long, or that which is left, where there is a guess, or that so far."""

    def render(self, task: Task) -> Text:
        words = _patience(monotonic() - task.fields["since"]) or task.fields["left"]
        return Text(words) if words else super().render(task)


def _patience(seconds: float) -> str:
    return f"no news for {seconds:.0f} s" if seconds >= _LONG_CASE else ""


class Bar:
    """A progress bar, up as long as its `with` block lasts."""

    def __init__(self, first_wait: float = 0.0) -> None:
        console = QuietConsole(stderr=True)
        self._first_wait = first_wait  # Seconds that the first call of a plugin may take; 0 if that is not known.
        self._progress = Progress(
            TextColumn("{task.description}", markup=False, table_column=Column(ratio=1, no_wrap=True)),
            BarColumn(bar_width=10),
            MofNCompleteColumn(),
            _TimeColumn(),
            expand=True,
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task: TaskID | None = None
        self._printed = set[str]()  # The lines of rows.
        self._of_run: scheduler.RunProgress | None = None
        self._last, self._since = "", monotonic()  # The last step, and when it was new.
        self._next_line = self._since + _PAUSE
        self._previous_handlers: dict[int, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():  # Python allows signal handlers in no other thread.
            for number in (signal.SIGINT, signal.SIGTERM):
                self._previous_handlers[number] = signal.signal(number, self._interrupt)
        if not self._progress.disable:
            self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        if not self._progress.disable:  # Old versions of rich end one that never started with an empty line.
            self._progress.stop()
        for number, handler in self._previous_handlers.items():
            signal.signal(number, handler)
        stop_signals.clear()  # What is asked for the screen of a stopped run goes on.

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        stop_signals.append(number)
        raise KeyboardInterrupt(number)

    def show_progress(self, step: scheduler.Progress) -> None:
        """Show how far a run is; the scheduler calls this after every case."""
        self._of_run = step.of_run or self._of_run
        if step.row is not None:
            row = step.row  # One without planned cases is that of a failure of an earlier run.
            judged = f", {row.judged}/{row.planned} judged" if row.planned else " again"
            result = row.result, STYLES.get(row.result, PLAIN_STYLE)
            behind = f"{judged}{f': {row.reason}' if row.reason else ''}"
            line = Text.assemble(f"{row.formulation} {row.property_id}: ", result, behind)
            if line.plain not in self._printed:  # The first round may have judged all of its cases.
                self._printed.add(line.plain)
                self._print(line)
        if step.remark:
            self._print(Text(step.remark))
            if step.count:
                return
        words = f"{f'{step.formulation} {step.property_id}'.rstrip()}: {step.phase} {step.count}/{step.planned}"
        words += f", waits {self._first_wait:g} s at most" if self._first_wait and not step.property_id else ""
        if self._of_run is None:
            self.update(words, 0, None)
        else:
            seconds = self._of_run.seconds_left
            left = "" if seconds is None else f"{scheduler.in_words(seconds)} left"
            self.update(words, self._of_run.finished, self._of_run.planned, left)

    def _print(self, line: Text) -> None:
        try:
            self._progress.console.print(line, soft_wrap=True)
        except OSError:  # Without a reader the run goes on.
            sys.stderr = open(os.devnull, "w")  # noqa: SIM115, or Python would fail to flush it at the end.

    def update(self, description: str, n_finished: int, n_planned: int | None, left: str = "") -> None:
        """Show how many of the planned steps are finished, if that is known, what comes next, and the time left.

        After Ctrl-C, or SIGTERM from the system, it raises a KeyboardInterrupt with the number of the signal.
        """
        if stop_signals:
            raise KeyboardInterrupt(stop_signals[0])
        now = monotonic()
        if description != self._last:
            self._last, self._since = description, now
        if self._progress.disable:
            if now >= self._next_line:
                self._next_line = now + max(_PAUSE, (now - self._since) / 2)
                total = "" if n_planned is None else f"; {n_finished:,} of some {n_planned:,} in all"
                parts = f"{description}{total}", left, _patience(now - self._since)
                self._print(Text(", ".join(filter(None, parts)), style=PLAIN_STYLE))
            return
        if self._task is None:
            self._task = self._progress.add_task("", left=left, since=self._since)
        description = one_line(description, _LONGEST)
        self._progress.update(
            self._task, description=description, completed=n_finished, total=n_planned, left=left, since=self._since
        )


def leave_at_next_signal() -> None:
    """Let a second Ctrl-C or SIGTERM end this process at once; whatever it has started ends with it."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: os._exit(SIGNALED + number))
