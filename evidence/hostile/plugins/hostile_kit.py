"""The parts of a hostile plugin: NTS, which is right in everything, with one hostile act in one verb.

A plugin of this folder is a function with a decorator from here. The decorator makes a factory of it, which the
catalogue registers as an entry point. Rule for the next editor: a plugin harms nothing outside of its own process and
its temporary folder, it never asks for memory without the limit of its runner, it starts at most 50 processes, and
whatever it starts ends by itself after `LONG`.
"""

import itertools
import os
import select
import struct
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

import contactverif_nts

LONG = 120.0  # Seconds. It is longer than any limit of a test, and short enough to leave nothing for the night.

MOST_FILES = 200  # No process here has more open files.

# The ends that a run with the plugin may have.
CAUGHT = "caught"  # The run says that the plugin is at fault; the exit status is 1.
LIKE_NTS = "like nts"  # All answers are right, so the plugin is judged as NTS is, with the same numbers.
IMPURE = "impure"  # The property `purity` fails; the exit status is 1.
EITHER = "either"  # Both verdicts are right; what counts is that nobody else suffers.
STOPS = "stops"  # The run cannot go on; what was judged before can be resumed.

Act = Callable[..., Any]
Factory = Callable[..., Any]


class HostileNts:
    """NTS, whose verbs are answered by acts: each gets a function with the right answer, then the verb's arguments."""

    def __init__(self, penalty: float, acts: Mapping[str, Act]) -> None:
        self._right, self._acts = contactverif_nts.nts(penalty=penalty), acts

    def _answer(self, verb: str, right: Callable[[], Any], *arguments: Any) -> Any:
        act = self._acts.get(verb)
        return right() if act is None else act(right, *arguments)

    @property
    def traits(self) -> Any:
        return self._answer("traits", lambda: self._right.traits)

    def n_multipliers(self, interface: Any) -> Any:
        return self._answer("n_multipliers", lambda: 0, interface)

    def pair(self, interface: Any, z: Any) -> Any:
        return self._answer("pair", lambda: self._right.pair(interface, z), interface, z)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._answer("residual", lambda: self._right.residual(interface, pairing, z), interface, pairing, z)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._answer("tangent", lambda: self._right.tangent(interface, pairing, z), interface, pairing, z)

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
        right = self._right
        return self._answer(
            "contact_points", lambda: right.contact_points(interface, pairing, z), interface, pairing, z
        )


def instead(verb: str, *, ends: str = CAUGHT) -> Callable[..., Factory]:
    """Decorate `act(right, *arguments)`, which answers a verb; `right()` is the right answer.

    The decorators of this file take a summary beside an act that is no function with a docstring. A verb is a method of
    a formulation, "traits" or "make"; `ends` is the end that a run with the plugin must have.
    """

    def decorate(act: Act, summary: str | None = None) -> Factory:
        def make(*, penalty: float) -> Any:
            if verb == "make":
                return act(lambda: HostileNts(penalty, {}))
            return HostileNts(penalty, {verb: act})

        make.__doc__ = summary or act.__doc__
        make.__dict__.update(ends=ends, verb=verb)
        return make

    return decorate


def before(verb: str, *, ends: str = CAUGHT) -> Callable[..., Factory]:
    """Decorate `act()`, which does something before a verb gives its right answer."""

    def decorate(act: Callable[[], Any], summary: str | None = None) -> Factory:
        def first(right: Callable[[], Any], *arguments: Any) -> Any:
            act()
            return right()

        return instead(verb, ends=ends)(first, summary or act.__doc__)

    return decorate


def raises(verb: str, *, ends: str = CAUGHT) -> Callable[..., Factory]:
    """Make a plugin that raises `error()` in a verb."""

    def decorate(error: Callable[[], BaseException], summary: str) -> Factory:
        def throw() -> None:
            raise error()

        return before(verb, ends=ends)(throw, summary)

    return decorate


def answers(verb: str, *, ends: str = CAUGHT) -> Callable[..., Factory]:
    """Decorate `act(answer)`, which makes the hostile answer of a verb from the right one."""

    def decorate(act: Callable[[Any], Any], summary: str | None = None) -> Factory:
        def change(right: Callable[[], Any], *arguments: Any) -> Any:
            return act(right())

        return instead(verb, ends=ends)(change, summary or act.__doc__)

    return decorate


def wrongly(act: Callable[[], Any], summary: str | None = None) -> Factory:
    """Decorate `act()`, which hides that the forces of the plugin are wrong: they are 1.5 times what they should be.

    NTS states which forces it gives on two named cases, so a verdict that is not manipulated is a broken promise.
    """

    def scale(right: Callable[[], Any], *arguments: Any) -> Any:
        act()
        return 1.5 * right()

    return instead("residual")(scale, summary or act.__doc__)


def leaves(act: Callable[[], Any], summary: str | None = None) -> Factory:
    """Decorate `act()`, which leaves something behind at the first question for forces; all answers are right."""
    calls = itertools.count()

    def leave() -> None:
        if next(calls) == 0:
            act()

    return before("residual", ends=LIKE_NTS)(leave, summary or act.__doc__)


def write_to_sockets(data: bytes, n_bytes: int | None = None) -> None:
    """Write a message to every socket of this process, and so to the harness; its head may announce other bytes."""
    for number in range(3, MOST_FILES):
        with suppress(OSError):
            if os.readlink(f"/proc/self/fd/{number}").startswith("socket"):
                os.write(number, struct.pack("<Q", len(data) if n_bytes is None else n_bytes) + data)


def send_all(data: bytes) -> None:
    """Write a message of any length to every socket of this process, and wait until the harness has read it."""
    for number in range(3, MOST_FILES):
        with suppress(OSError):
            if os.readlink(f"/proc/self/fd/{number}").startswith("socket"):
                rest = memoryview(struct.pack("<Q", len(data)) + data)
                while rest:
                    select.select([], [number], [])
                    rest = rest[os.write(number, rest) :]
