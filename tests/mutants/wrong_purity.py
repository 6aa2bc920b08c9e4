"""Mutants that remember something of an earlier call. Each answer is right where nothing else was asked before."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from handles import ReusesItsHandle
from mutate import Mutant, Wrapped, replaces

from contactverif.contract.arrays import dense

PURITY = "purity"


def _remembers(*, memory: str, user: str, argument: int) -> Callable[..., Any]:
    """Return a factory: `user` takes one argument from the last call of `memory`, if the state has its shape.

    The arguments are 0, the interface; 1, the pairing; 2, the state. `memory` pair remembers the pairing it returns.
    """

    def make(*, penalty: float) -> Any:
        last: dict[str, Any] = {}

        def remember(right: Any, *arguments: Any) -> Any:
            answer = right(*arguments)
            last["call"] = (arguments[0], answer, arguments[1]) if memory == "pair" else arguments
            return answer

        def use(right: Any, *arguments: Any) -> Any:
            earlier = last.get("call", arguments)
            fits = earlier[2].shape == arguments[2].shape and (argument == 0 or earlier[0] is arguments[0])
            changed = list(arguments)
            if fits:
                changed[argument] = earlier[argument]
            return right(*changed)

        return Wrapped(penalty, **{memory: remember, user: use})

    return make


def _keeps_first_interface(*, penalty: float) -> Any:
    """Answer on the first interface of each size, as a search tree does that is built once."""
    first: dict[Any, Any] = {}

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        return right(first.setdefault(interface.nodes.shape, interface), pairing, z)

    return Wrapped(penalty, residual=residual)


def _caches_by_positions(*, penalty: float) -> Any:
    """Keep the last residual, and return it where the positions are the same, whatever the pairing is."""
    last: dict[bytes, Any] = {}

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        key = z.tobytes()
        if key not in last:
            last.clear()
            last[key] = right(interface, pairing, z)
        return last[key]

    return Wrapped(penalty, residual=residual)


class _LastPenalty:
    """A penalty that all instances share, as a module's global variable is."""

    value = 1.0


def _shares_its_penalty(*, penalty: float) -> Any:
    _LastPenalty.value = penalty

    def residual(right: Any, *arguments: Any) -> Any:
        return right(*arguments) * (_LastPenalty.value / penalty)

    return Wrapped(penalty, residual=residual)


_SHARED_ANSWERS: dict[Any, Any] = {}


@replaces("residual")
def _shares_its_answers(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Keep the last residual of any instance, by its positions and pairing, whatever the penalty is."""
    key = z.tobytes(), interface.nodes.tobytes(), *(values.tobytes() for values in pairing.values())
    if key not in _SHARED_ANSWERS:
        _SHARED_ANSWERS.clear()
        _SHARED_ANSWERS[key] = right(interface, pairing, z)
    return _SHARED_ANSWERS[key]


class _InOneCall(Wrapped):
    """A formulation that is right in each method, and wrong where it computes residual and tangent in one call."""

    def __init__(self, penalty: float, change: Callable[[Any, Any], tuple[Any, Any]]) -> None:
        super().__init__(penalty)
        self._change = change

    def residual_and_tangent(self, interface: Any, pairing: Any, z: Any) -> tuple[Any, Any]:
        arguments = interface, pairing, z
        return self._change(self._inner.residual(*arguments), dense(self._inner.tangent(*arguments)))


def _in_one_call(change: Callable[[Any, Any], tuple[Any, Any]]) -> Callable[..., Any]:
    return lambda *, penalty: _InOneCall(penalty, change)


def _without_small_entries(residual: Any, tangent: Any) -> tuple[Any, Any]:
    """Leave out what is below a millionth of the largest entry, as a pattern does that was made in another state."""
    return residual, np.where(np.abs(tangent) > 1e-6 * np.abs(tangent).max(), tangent, 0.0)


class _LastInOneCall(Wrapped):
    """Residual and tangent in one call, the tangent at the state of the last residual that was asked alone."""

    last: Any = None

    def residual(self, *arguments: Any) -> Any:
        self.last = arguments
        return self._inner.residual(*arguments)

    def residual_and_tangent(self, *arguments: Any) -> tuple[Any, Any]:
        fits = self.last is not None and self.last[0] is arguments[0]
        return self._inner.residual(*arguments), self._inner.tangent(*(self.last if fits else arguments))


MUTANTS = (
    Mutant("one object in the handles of all pairings", PURITY, ReusesItsHandle),
    Mutant("residual in one call that pulls", PURITY, _in_one_call(lambda residual, tangent: (-residual, tangent))),
    Mutant(
        "tangent in one call made symmetric",
        PURITY,
        _in_one_call(lambda residual, tangent: (residual, (tangent + tangent.T) / 2)),
    ),
    Mutant("tangent in one call without small entries", PURITY, _in_one_call(_without_small_entries)),
    Mutant("tangent in one call at the state of the last residual", PURITY, lambda *, penalty: _LastInOneCall(penalty)),
    Mutant(
        "tangent at the state of the last residual", PURITY, _remembers(memory="residual", user="tangent", argument=2)
    ),
    Mutant(
        "residual at the state of the last tangent", PURITY, _remembers(memory="tangent", user="residual", argument=2)
    ),
    Mutant(
        "tangent on the pairing of the last residual", PURITY, _remembers(memory="residual", user="tangent", argument=1)
    ),
    Mutant("tangent on the last pairing", PURITY, _remembers(memory="pair", user="tangent", argument=1)),
    Mutant("residual on the last pairing", PURITY, _remembers(memory="pair", user="residual", argument=1)),
    Mutant(
        "tangent of the last residual's interface", PURITY, _remembers(memory="residual", user="tangent", argument=0)
    ),
    Mutant("residual of the first interface", PURITY, _keeps_first_interface),
    Mutant("residual kept by its positions alone", PURITY, _caches_by_positions),
    Mutant(
        "contact points of the last residual", PURITY, _remembers(memory="residual", user="contact_points", argument=2)
    ),
    Mutant("contact points of the last pairing", PURITY, _remembers(memory="pair", user="contact_points", argument=1)),
    Mutant(
        "residual on the pairing of the last contact points",
        PURITY,
        _remembers(memory="contact_points", user="residual", argument=1),
    ),
    Mutant("penalty of the last instance", PURITY, _shares_its_penalty),
    Mutant("residual kept for any penalty", PURITY, _shares_its_answers),
)
