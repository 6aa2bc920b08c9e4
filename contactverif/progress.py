"""The progress bar of a run, on standard error so that a table can be piped; nothing where nobody watches."""

from __future__ import annotations

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from contactverif import runner


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

    def __enter__(self) -> Bar:
        self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self._progress.stop()

    def told(self, step: runner.Progress) -> None:
        """One more case is done."""
        self.at(f"{step.formulation}  {step.property_id}  {step.phase}", step.done, step.planned)

    def at(self, description: str, done: int, planned: int) -> None:
        """So many of so many are done, and this comes next."""
        if self._progress.disable:
            return
        if self._task is None:
            self._task = self._progress.add_task(description)
        self._progress.update(self._task, description=description, completed=done, total=planned)
