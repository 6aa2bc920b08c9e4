"""Calls in lockstep: each runs until it needs an answer of a plugin's process, and one message carries all questions.

Each call has a thread, and one thread runs at a time. Rule: the calling thread alone sends messages and starts
processes, since the system ends the process of a plugin together with the thread that started it.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from queue import Empty, SimpleQueue
from time import perf_counter
from typing import Any, Generic, TypeVar

from contactverif.isolation.process import PINNING

_Result = TypeVar("_Result")
# What a call waits for. It returns False if a process has ended: then the calls begin anew, one after another.
Wish = Callable[[], bool]
_thread = threading.local()
# Seconds. A call that takes longer may wait for a lock that another one holds, such as that of a
# `functools.cached_property` of Python 3.11. From then on, calls in this process are made one after another.
_LONGEST_STEP = 10.0
_blocks = False
_idle: list[_Lane[Any]] = []  # Threads that wait for a call; to start one takes longer than many a case.


class _CancelledError(BaseException):
    """The call is not needed any more."""


class _Lane(threading.Thread, Generic[_Result]):
    """A thread that makes one call at a time, and stops wherever it needs an answer."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self._go, self._back = SimpleQueue[None](), SimpleQueue[None]()
        self._core = -1
        self.start()

    def begin(self, call: Callable[[], _Result]) -> None:
        self._call, self._cancelled = call, False
        self.result: _Result | None = None
        self.error: BaseException | None = None
        self.wish: Wish | None = None
        self.stands, self.ended, self.seconds = True, False, 0.0

    def run(self) -> None:
        _thread.lane = self
        while True:
            self._wait_for_turn()
            try:
                if not self._cancelled:
                    self.result = self._call()
            except BaseException as error:
                self.error = error
            self.ended = True
            self._stand()

    def _wait_for_turn(self) -> None:
        self._go.get()
        if PINNING.core not in (-1, self._core):  # Cores are those of a thread, and this one computes for the judge.
            self._core = PINNING.core
            with suppress(OSError):
                os.sched_setaffinity(0, {self._core})

    def _stand(self) -> None:
        self.stands = True
        self._back.put(None)

    def advance(self, seconds: float | None = None) -> bool:
        """Let the thread run until it has a wish or has ended; return False if it does not within some seconds."""
        start = perf_counter()
        self.stands = False
        self._go.put(None)
        try:
            self._await(seconds)
        except BaseException:  # After Ctrl-C, too, one thread runs at a time.
            self._await()
            raise
        self.seconds += perf_counter() - start
        return self.stands

    def _await(self, seconds: float | None = None) -> None:
        with suppress(Empty):
            while not self.stands:  # What is in the queue may be of an earlier step.
                self._back.get(timeout=seconds)

    def wait(self, wish: Wish) -> None:
        """Stop this thread, the one that runs, until the wish is granted."""
        if not self._cancelled:
            self.wish = wish
            self._stand()
            self._wait_for_turn()
        if self._cancelled:
            raise _CancelledError

    def cancel(self) -> None:
        """Let the call end at once, or where it needs its next answer."""
        self._cancelled = True
        self._await()
        while not self.ended:
            self.advance()


def wait_in_lockstep(wish: Wish) -> bool:
    """Let the other calls run until a wish is granted; return False at once if this is no call in lockstep."""
    lane: _Lane[Any] | None = getattr(_thread, "lane", None)
    if lane is not None:
        lane.wait(wish)
    return lane is not None


def in_lockstep(calls: Sequence[Callable[[], _Result]]) -> list[tuple[_Result, float]] | None:
    """Return the result of each call with its share of the time.

    None if a process has ended meanwhile, or if the calls block each other.
    """
    global _blocks
    if _blocks:
        return None
    threads = [lane for lane in _idle if lane.is_alive()]  # A process that was forked has none of its parent's.
    _idle.clear()
    threads += [_Lane() for _ in range(len(calls) - len(threads))]
    lanes: list[_Lane[_Result]] = threads[: len(calls)]
    for lane, call in zip(lanes, calls, strict=True):
        lane.begin(call)
    running = lanes
    try:
        while running:
            if not all(lane.advance(_LONGEST_STEP) for lane in running):
                _blocks = True
                return None
            running = [lane for lane in running if not lane.ended]
            for wish in dict.fromkeys(lane.wish for lane in running):
                assert wish is not None
                start, waiting = perf_counter(), [lane for lane in running if lane.wish == wish]
                if not wish():
                    return None
                for lane in waiting:
                    lane.seconds += (perf_counter() - start) / len(waiting)
    finally:
        for lane in sorted(lanes, key=lambda lane: not lane.stands):  # One that stands may block one that does not.
            lane.cancel()
        _idle.extend(threads)
    for lane in lanes:
        if lane.error is not None:
            raise lane.error
    return [(lane.result, lane.seconds) for lane in lanes]  # type: ignore[misc]
