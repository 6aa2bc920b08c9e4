"""Mutants that remember something of an earlier call, change what they are given, or answer by what is no argument.

Each answer is right where nothing else was asked before.
"""

import numpy as np
from handles import ReusesItsHandle
from subjects import Changed, ResidualAlone

from contactverif import Pairing
from contactverif.contract.arrays import dense
from zoo.making import BALANCED, add, mutant, wrap

PURITY, LONG = "purity", "purity.long"
MANY = 500  # The calls of one instance after which a mutant is wrong.


@mutant("pairing kept from the first call", PURITY, "pair", memory=list)
def _(pairings, right, interface, z):
    pairings.append(right(interface, z))
    same_problem = pairings[0]["master"].shape == pairings[-1]["master"].shape
    return pairings[0] if same_problem else pairings[-1]


@mutant("pairing that changes at every call", PURITY, "pair", memory=list)
def _(calls, right, interface, z):
    calls.append(0)
    return Pairing({**right(interface, z), "call": np.array([len(calls) % 2])})


@mutant("interface modified", PURITY, "residual")
def _(right, interface, pairing, z):
    interface.nodes.setflags(write=True)
    interface.nodes[0, 0] += 1e-3
    return right(interface, pairing, z)


@mutant("positions modified", PURITY, "residual")
def _(right, interface, pairing, z):
    z += 0.0
    return right(interface, pairing, z)


def _leaves_a_trace_in_its_tangent(*, penalty):
    scale = [1.0]

    def tangent(right, *state):
        scale[0] = 1 + 2.0**-40
        return right(*state)

    return wrap(penalty, tangent=tangent, residual=lambda right, *state: right(*state) * scale[0])


def _remembers(memory, user, argument):
    """Return a factory: `user` takes one argument from the last call of `memory`, if the state has its shape.

    The arguments are 0, the interface; 1, the pairing; 2, the state. `memory` pair remembers the pairing it returns.
    """

    def make(*, penalty):
        last = {}

        def remember(right, *arguments):
            answer = right(*arguments)
            last["call"] = (arguments[0], answer, arguments[1]) if memory == "pair" else arguments
            return answer

        def use(right, *arguments):
            earlier, changed = last.get("call", arguments), list(arguments)
            if earlier[2].shape == arguments[2].shape and (argument == 0 or earlier[0] is arguments[0]):
                changed[argument] = earlier[argument]
            return right(*changed)

        return wrap(penalty, **{memory: remember, user: use})

    return make


for _name, *_arguments in (
    ("tangent at the state of the last residual", "residual", "tangent", 2),
    ("residual at the state of the last tangent", "tangent", "residual", 2),
    ("tangent on the pairing of the last residual", "residual", "tangent", 1),
    ("tangent on the last pairing", "pair", "tangent", 1),
    ("residual on the last pairing", "pair", "residual", 1),
    ("tangent of the last residual's interface", "residual", "tangent", 0),
    ("contact points of the last residual", "residual", "contact_points", 2),
    ("contact points of the last pairing", "pair", "contact_points", 1),
    ("residual on the pairing of the last contact points", "contact_points", "residual", 1),
):
    add(_name, PURITY, _remembers(*_arguments))


@mutant("residual of the first interface", PURITY, "residual", memory=dict)
def _(first, right, interface, pairing, z):
    """Answer on the first interface of each size, as a search tree does that is built once."""
    return right(first.setdefault(interface.nodes.shape, interface), pairing, z)


@mutant("pairing kept while the first node stays", PURITY, "pair", memory=dict)
def _(pairings, right, interface, z):
    key = id(interface), z[:2].tobytes()
    if key not in pairings:
        pairings[key] = interface, right(interface, z)  # An interface that lives has an address of its own.
    return pairings[key][1]


class _KeepsFirstLengths(ResidualAlone):
    """Springs as stiff as if the longest slave segment were that of the first residual of an instance."""

    first = None

    def residual(self, interface, pairing, z):
        ends = z[: interface.n_unknowns].reshape(-1, 2)[interface.slave.segments]
        length = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1).max())
        self.first = length if self.first is None else self.first
        return super().residual(interface, pairing, z) * (self.first / length)


@mutant("residual kept by its positions alone", PURITY, "residual", memory=dict)
def _(last, right, interface, pairing, z):
    key = z.tobytes()
    if key not in last:
        last.clear()
        last[key] = right(interface, pairing, z)
    return last[key]


class _LastPenalty:
    """A penalty that all instances share, as a module's global variable is."""

    value = 1.0


def _shares_its_penalty(*, penalty):
    _LastPenalty.value = penalty
    return wrap(penalty, residual=lambda right, *state: right(*state) * (_LastPenalty.value / penalty))


_SHARED_ANSWERS = {}


@mutant("residual kept for any penalty", PURITY, "residual")
def _(right, interface, pairing, z):
    """Keep the last residual of any instance, by its positions and pairing."""
    key = z.tobytes(), interface.nodes.tobytes(), *(values.tobytes() for values in pairing.values())
    if key not in _SHARED_ANSWERS:
        _SHARED_ANSWERS.clear()
        _SHARED_ANSWERS[key] = right(interface, pairing, z)
    return _SHARED_ANSWERS[key]


def _in_one_call(change):
    """Return a factory: right in each method, and wrong where residual and tangent are computed in one call."""

    def make(*, penalty):
        inner = BALANCED(penalty=penalty)
        return Changed(
            inner, residual_and_tangent=lambda *state: change(inner.residual(*state), dense(inner.tangent(*state)))
        )

    return make


def _without_small_entries(residual, tangent):
    """Leave out what is below a millionth of the largest entry, as a pattern does that was made in another state."""
    return residual, np.where(np.abs(tangent) > 1e-6 * np.abs(tangent).max(), tangent, 0.0)


def _last_in_one_call(*, penalty):
    """Take the tangent in one call at the state of the last residual that was asked alone."""
    inner, last = BALANCED(penalty=penalty), []

    def residual(*state):
        last[:] = [state]
        return inner.residual(*state)

    def both(*state):
        fits = last and last[0][0] is state[0]
        return inner.residual(*state), inner.tangent(*(last[0] if fits else state))

    return Changed(inner, residual=residual, residual_and_tangent=both)


def _wears_out(calls, right, *state):
    calls.append(None)
    return right(*state) * (1.01 if len(calls) > MANY else 1.0)


def _wrong_at_first(verb):
    """Return a factory: the first answer of a verb in a process is one percent too large, whatever the instance is."""
    earlier = []

    def make(*, penalty):
        if penalty == 1.0:  # The harness loads a formulation once in a process, and makes it with this penalty.
            earlier.clear()

        def answer(right, *state):
            factor = 1.0 if earlier else 1.01
            earlier.append(True)
            return right(*state) * factor

        return wrap(penalty, **{verb: answer})

    return make


mutant("one percent too stiff after 500 calls of one instance", LONG, "residual", memory=list)(_wears_out)
mutant("tangent one percent too large after 500 calls of one instance", LONG, "tangent", memory=list)(_wears_out)
add("first residual of a process one percent too large", LONG, _wrong_at_first("residual"))
add("first tangent of a process one percent too large", LONG, _wrong_at_first("tangent"))
add("tangent that leaves a trace", PURITY, _leaves_a_trace_in_its_tangent)
add("one object in the handles of all pairings", PURITY, ReusesItsHandle)
add("residual in one call that pulls", PURITY, _in_one_call(lambda residual, tangent: (-residual, tangent)))
add("tangent in one call made symmetric", PURITY, _in_one_call(lambda r, tangent: (r, (tangent + tangent.T) / 2)))
add("tangent in one call without small entries", PURITY, _in_one_call(_without_small_entries))
add("tangent in one call at the state of the last residual", PURITY, _last_in_one_call)
add("lengths of the first residual, kept by segment", PURITY,
    lambda *, penalty: _KeepsFirstLengths(BALANCED(penalty=penalty)))  # fmt: skip
add("penalty of the last instance", PURITY, _shares_its_penalty)
