"""The time that a process has used up, which on a busy machine is less than the time that has passed.

Rule: a process that sleeps, or was stopped, uses all of the time. One that runs, or waits for a core, uses the time
that the processor has worked for it.
"""

from __future__ import annotations

from contextlib import suppress
from time import perf_counter

import psutil

# A process that waits for a core uses at least this share of the time, so that it ends however many take the core.
_LEAST_SHARE = 1 / 16


class ActiveClock:
    """A clock that goes on with each look at a process and its descendants.

    Attributes
    ----------
    seconds : float
        The time used up since the first look.
    """

    def __init__(self, pid: int) -> None:
        self._pid, self.seconds = pid, 0.0
        self._before = perf_counter(), self._look()[1]

    def look(self) -> None:
        """Add the time that was used up since the last look."""
        runs, processor = self._look()
        now = perf_counter()
        passed, worked = now - self._before[0], processor - self._before[1]
        self.seconds += min(passed, max(worked, _LEAST_SHARE * passed)) if runs else passed
        self._before = now, processor

    def _look(self) -> tuple[bool, float]:
        """Return whether one of the processes runs or is ready to, and the processor's time of all, ended ones too."""
        runs, processor = False, 0.0
        with suppress(psutil.Error):
            root = psutil.Process(self._pid)
            for process in (root, *root.children(recursive=True)):
                with suppress(psutil.Error), process.oneshot():
                    runs = process.status() == psutil.STATUS_RUNNING or runs
                    processor += sum(process.cpu_times()[:4])
        return runs, processor
