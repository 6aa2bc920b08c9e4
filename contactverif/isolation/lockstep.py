"""Calls in lockstep: each runs until it needs an answer of a plugin's process, and one message carries all questions.

Each call is a greenlet of the calling thread: to change from one to another takes less than a microsecond, and what
belongs to a thread, such as a factor of SuperLU, serves all of them.
"""

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any, Generic, TypeVar

from greenlet import getcurrent, greenlet

_Result = TypeVar("_Result")
# What a call waits for. It returns False if a process has ended: then the calls begin anew, one after another.
Wish = Callable[[], bool]


class _Lane(Generic[_Result]):
    def __init__(self, call: Callable[[], _Result]) -> None:
        self._greenlet = greenlet(call)
        self._greenlet.lane = self
        self.result: _Result | None = None
        self.wish: Wish | None = None
        self.seconds = 0.0

    @property
    def ended(self) -> bool:
        return bool(self._greenlet.dead)

    def advance(self) -> None:
        """Let the call run until it has a wish or has ended; an exception of the call is raised here."""
        start = perf_counter()
        self.result = self._greenlet.switch()  # That of the call, once it has ended.
        self.seconds += perf_counter() - start

    def wait(self, wish: Wish) -> None:
        """Stop this call, the one that runs, until the wish is granted."""
        self.wish = wish
        self._greenlet.parent.switch()

    def cancel(self) -> None:
        """End the call where it stands; if it asks on its way out, there too."""
        while not self.ended:
            self._greenlet.throw()


def wait_in_lockstep(wish: Wish) -> bool:
    """Let the other calls run until a wish is granted; return False at once if this is no call in lockstep."""
    lane: _Lane[Any] | None = getattr(getcurrent(), "lane", None)
    if lane is not None:
        lane.wait(wish)
    return lane is not None


def in_lockstep(calls: Sequence[Callable[[], _Result]]) -> list[tuple[_Result, float]] | None:
    """Return the result of each call with its share of the time; None if a process has ended meanwhile."""
    lanes = [_Lane(call) for call in calls]
    running = lanes
    try:
        while running:
            for lane in running:
                lane.advance()
            running = [lane for lane in running if not lane.ended]
            for wish in dict.fromkeys(lane.wish for lane in running):
                assert wish is not None
                start, waiting = perf_counter(), [lane for lane in running if lane.wish == wish]
                if not wish():
                    return None
                for lane in waiting:
                    lane.seconds += (perf_counter() - start) / len(waiting)
    finally:
        for lane in lanes:
            lane.cancel()
    return [(lane.result, lane.seconds) for lane in lanes]  # type: ignore[misc]
