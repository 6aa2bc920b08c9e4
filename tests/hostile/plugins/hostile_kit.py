"""The parts of a hostile plugin: NTS, which is right in everything, with one hostile act in one verb.

A plugin of this folder is a function with a decorator from here. The decorator makes a factory of it, which the
catalogue registers as an entry point. Rule for the next editor: a plugin harms nothing outside of its own process and
its temporary folder, it never asks for memory without the limit of its runner, it starts at most 50 processes, and
whatever it starts ends by itself after `LONG`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import contactverif_nts

LONG = 120.0  # Seconds. It is longer than any limit of a test, and short enough to leave nothing for the night.

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


def instead(verb: str, *, ends: str = CAUGHT) -> Callable[[Act], Factory]:
    """Decorate `act(right, *arguments)`, which answers a verb; `right()` is the right answer.

    Parameters
    ----------
    verb : str
        A method of a formulation, "traits" or "make".
    ends : str
        The end that a run with the plugin must have.
    """

    def decorate(act: Act) -> Factory:
        def make(*, penalty: float) -> Any:
            if verb == "make":
                return act(lambda: HostileNts(penalty, {}))
            return HostileNts(penalty, {verb: act})

        make.__name__, make.__doc__, make.__module__ = act.__name__, act.__doc__, act.__module__
        make.__dict__.update(ends=ends, verb=verb)
        return make

    return decorate


def before(verb: str, *, ends: str = CAUGHT) -> Callable[[Callable[[], Any]], Factory]:
    """Decorate `act()`, which does something before a verb gives its right answer."""

    def decorate(act: Callable[[], Any]) -> Factory:
        def first(right: Callable[[], Any], *arguments: Any) -> Any:
            act()
            return right()

        first.__name__, first.__doc__, first.__module__ = act.__name__, act.__doc__, act.__module__
        return instead(verb, ends=ends)(first)

    return decorate


def answers(verb: str, *, ends: str = CAUGHT) -> Callable[[Callable[[Any], Any]], Factory]:
    """Decorate `act(answer)`, which makes the hostile answer of a verb from the right one."""

    def decorate(act: Callable[[Any], Any]) -> Factory:
        def change(right: Callable[[], Any], *arguments: Any) -> Any:
            return act(right())

        change.__name__, change.__doc__, change.__module__ = act.__name__, act.__doc__, act.__module__
        return instead(verb, ends=ends)(change)

    return decorate


def wrongly(act: Callable[[], Any]) -> Factory:
    """Decorate `act()`, which hides that the forces of the plugin are wrong: they are 1.5 times what they should be.

    NTS states which forces it gives on two named cases, so a verdict that is not manipulated is a broken promise.
    """

    def scale(right: Callable[[], Any], *arguments: Any) -> Any:
        act()
        return 1.5 * right()

    scale.__name__, scale.__doc__, scale.__module__ = act.__name__, act.__doc__, act.__module__
    return instead("residual")(scale)
