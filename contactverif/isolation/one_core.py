"""The core that the judge and a plugin's process share, for one of the two always waits for the other.

Rule for the next editor: to wake a process that sleeps on another core takes longer than most answers, and the system
likes to wake a process on a core that sleeps. So both are held on one core, and let go now and then for one question:
then the system may move the judge to a better core.

A plugin's process starts on one core and stays on one: TBB counts the cores when it is first used, and has no variable.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from time import perf_counter

_QUESTIONS_FIRST = 32  # The judge is not held to one core before so many questions.
_SECONDS_ON_A_CORE = 0.5  # The judge waits so long at most for a core that another program took.
_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None


class Judge:
    """The cores of this process.

    Attributes
    ----------
    core : int
        The core that it is held on; −1 if it may run on any of its cores.
    """

    def __init__(self) -> None:
        self.core = -1
        self._n_questions = 0
        self._cores: set[int] = set()
        self._until = 0.0

    def ask(self) -> None:
        """Note that a question is about to be asked; let this process go if it was held long enough."""
        self._n_questions += 1
        if self._n_questions <= _QUESTIONS_FIRST or _LIBC is None:
            return
        now = perf_counter()
        if self.core < 0:
            self._cores = os.sched_getaffinity(0)
            self._hold(int(_LIBC.sched_getcpu()), now)
        elif now > self._until:
            self.let_go()

    def _hold(self, core: int, now: float) -> None:
        self.core, self._until = core, now + _SECONDS_ON_A_CORE
        with suppress(OSError):
            os.sched_setaffinity(0, {core})

    @contextmanager
    def on_one_core(self) -> Iterator[None]:
        """Open a block in which this process is on one core, so that a process that it starts there is held on it."""
        self.let_go()
        if _LIBC is not None:
            self._cores = os.sched_getaffinity(0)
            self._hold(int(_LIBC.sched_getcpu()), perf_counter())
        try:
            yield
        finally:
            self.let_go()

    def let_go(self) -> None:
        """Let this process run on any of its cores."""
        if self.core >= 0:
            self.core = -1
            with suppress(OSError):
                os.sched_setaffinity(0, self._cores)


JUDGE = Judge()
