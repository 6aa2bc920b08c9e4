"""Mutants that remember something of an earlier call. Each answer is right where nothing else was asked before."""

from collections.abc import Callable
from typing import Any

import numpy as np
from handles import ReusesItsHandle
from mutate import Mutant, replaces, wrap
from subjects import Changed, ResidualAlone

import contactverif_nts
from contactverif.contract.arrays import dense

PURITY, LONG = "purity", "purity.long"
MANY = 500  # The calls of one instance after which a mutant is wrong.


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

        return wrap(penalty, **{memory: remember, user: use})

    return make


def _keeps_first_interface(*, penalty: float) -> Any:
    """Answer on the first interface of each size, as a search tree does that is built once."""
    first: dict[Any, Any] = {}

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        return right(first.setdefault(interface.nodes.shape, interface), pairing, z)

    return wrap(penalty, residual=residual)


def _knows_a_state_by_its_first_node(*, penalty: float) -> Any:
    """Keep the pairings of an interface, and return one where the first node is where it was."""
    pairings: dict[Any, Any] = {}

    def pair(right: Any, interface: Any, z: Any) -> Any:
        key = id(interface), z[:2].tobytes()
        if key not in pairings:
            pairings[key] = interface, right(interface, z)  # An interface that lives has an address of its own.
        return pairings[key][1]

    return wrap(penalty, pair=pair)


class _KeepsFirstLengths(ResidualAlone):
    """Springs as stiff as if the longest slave segment were that of the first residual of an instance."""

    first: float | None = None

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        ends = z[: interface.n_unknowns].reshape(-1, 2)[interface.slave.segments]
        length = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1).max())
        self.first = length if self.first is None else self.first
        return super().residual(interface, pairing, z) * (self.first / length)


def _caches_by_positions(*, penalty: float) -> Any:
    """Keep the last residual, and return it where the positions are the same, whatever the pairing is."""
    last: dict[bytes, Any] = {}

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        key = z.tobytes()
        if key not in last:
            last.clear()
            last[key] = right(interface, pairing, z)
        return last[key]

    return wrap(penalty, residual=residual)


class _LastPenalty:
    """A penalty that all instances share, as a module's global variable is."""

    value = 1.0


def _shares_its_penalty(*, penalty: float) -> Any:
    _LastPenalty.value = penalty

    def residual(right: Any, *arguments: Any) -> Any:
        return right(*arguments) * (_LastPenalty.value / penalty)

    return wrap(penalty, residual=residual)


_SHARED_ANSWERS: dict[Any, Any] = {}


@replaces("residual")
def _shares_its_answers(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Keep the last residual of any instance, by its positions and pairing, whatever the penalty is."""
    key = z.tobytes(), interface.nodes.tobytes(), *(values.tobytes() for values in pairing.values())
    if key not in _SHARED_ANSWERS:
        _SHARED_ANSWERS.clear()
        _SHARED_ANSWERS[key] = right(interface, pairing, z)
    return _SHARED_ANSWERS[key]


def _in_one_call(change: Callable[[Any, Any], tuple[Any, Any]]) -> Callable[..., Any]:
    """Return a factory: right in each method, and wrong where residual and tangent are computed in one call."""

    def make(*, penalty: float) -> Changed:
        inner = contactverif_nts.vts_ppt_balanced(penalty=penalty)

        def both(*state: Any) -> tuple[Any, Any]:
            return change(inner.residual(*state), dense(inner.tangent(*state)))

        return Changed(inner, residual_and_tangent=both)

    return make


def _without_small_entries(residual: Any, tangent: Any) -> tuple[Any, Any]:
    """Leave out what is below a millionth of the largest entry, as a pattern does that was made in another state."""
    return residual, np.where(np.abs(tangent) > 1e-6 * np.abs(tangent).max(), tangent, 0.0)


def _last_in_one_call(*, penalty: float) -> Changed:
    """Take the tangent in one call at the state of the last residual that was asked alone."""
    inner, last = contactverif_nts.vts_ppt_balanced(penalty=penalty), []

    def residual(*state: Any) -> Any:
        last[:] = [state]
        return inner.residual(*state)

    def both(*state: Any) -> tuple[Any, Any]:
        fits = last and last[0][0] is state[0]
        return inner.residual(*state), inner.tangent(*(last[0] if fits else state))

    return Changed(inner, residual=residual, residual_and_tangent=both)


def _wears_out(verb: str) -> Callable[..., Any]:
    """Return a factory: the answers of a verb are one percent too large after many calls of one instance."""

    def make(*, penalty: float) -> Any:
        calls: list[None] = []

        def answer(right: Any, *arguments: Any) -> Any:
            calls.append(None)
            return right(*arguments) * (1.01 if len(calls) > MANY else 1.0)

        return wrap(penalty, **{verb: answer})

    return make


def _wrong_at_first(verb: str) -> Callable[..., Any]:
    """Return a factory: the first answer of a verb in a process is one percent too large, whatever the instance is."""
    answered: list[bool] = []

    def make(*, penalty: float) -> Any:
        if penalty == 1.0:  # The harness loads a formulation once in a process, and makes it with this penalty.
            answered.clear()

        def answer(right: Any, *arguments: Any) -> Any:
            factor = 1.0 if answered else 1.01
            answered.append(True)
            return right(*arguments) * factor

        return wrap(penalty, **{verb: answer})

    return make


MUTANTS = (
    Mutant("one percent too stiff after 500 calls of one instance", LONG, _wears_out("residual")),
    Mutant("tangent one percent too large after 500 calls of one instance", LONG, _wears_out("tangent")),
    Mutant("first residual of a process one percent too large", LONG, _wrong_at_first("residual")),
    Mutant("first tangent of a process one percent too large", LONG, _wrong_at_first("tangent")),
    Mutant("one object in the handles of all pairings", PURITY, ReusesItsHandle),
    Mutant("residual in one call that pulls", PURITY, _in_one_call(lambda residual, tangent: (-residual, tangent))),
    Mutant("tangent in one call made symmetric", PURITY,
           _in_one_call(lambda residual, tangent: (residual, (tangent + tangent.T) / 2))),
    Mutant("tangent in one call without small entries", PURITY, _in_one_call(_without_small_entries)),
    Mutant("tangent in one call at the state of the last residual", PURITY, _last_in_one_call),
    *(
        Mutant(name, PURITY, _remembers(memory=memory, user=user, argument=argument))
        for name, memory, user, argument in (
            ("tangent at the state of the last residual", "residual", "tangent", 2),
            ("residual at the state of the last tangent", "tangent", "residual", 2),
            ("tangent on the pairing of the last residual", "residual", "tangent", 1),
            ("tangent on the last pairing", "pair", "tangent", 1),
            ("residual on the last pairing", "pair", "residual", 1),
            ("tangent of the last residual's interface", "residual", "tangent", 0),
            ("contact points of the last residual", "residual", "contact_points", 2),
            ("contact points of the last pairing", "pair", "contact_points", 1),
            ("residual on the pairing of the last contact points", "contact_points", "residual", 1),
        )
    ),
    Mutant("residual of the first interface", PURITY, _keeps_first_interface),
    Mutant("pairing kept while the first node stays", PURITY, _knows_a_state_by_its_first_node),
    Mutant("lengths of the first residual, kept by segment", PURITY,
           lambda *, penalty: _KeepsFirstLengths(contactverif_nts.vts_ppt_balanced(penalty=penalty))),
    Mutant("residual kept by its positions alone", PURITY, _caches_by_positions),
    Mutant("penalty of the last instance", PURITY, _shares_its_penalty),
    Mutant("residual kept for any penalty", PURITY, _shares_its_answers),
)  # fmt: skip
