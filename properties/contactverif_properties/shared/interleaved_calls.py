"""Calls of all methods in turn, for states, pairings and interfaces in turn, and the many calls of one instance.

Two instances are asked, in two orders. A formulation that remembers something of an earlier call answers differently.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from contactverif.contract.arrays import Array, FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface, Surface
from contactverif.contract.pairing import Pairing
from contactverif.contract.subject import CheckedFormulation

BOTH = "residual_and_tangent"
# The questions are two states of one interface, 0 and 1, and a state of another interface, 2. The first and the last
# call before a question, of any method, on its interface or on any, differ between the orders for at least one
# question. So a memory of such a call shows. The second order begins with positions that the first does not begin with
# (those of 2 are those of 0), so that what the first call fills for good differs. The first order ends with its first
# question again, after contact points.
_ORDERS = (
    (
        *(("residual", 0), ("tangent", 1), ("residual", 2), ("tangent", 0), ("residual", 1), (BOTH, 0), (BOTH, 1)),
        *(("contact_points", 0), ("contact_points", 1), ("residual", 0)),
    ),
    (
        *(("contact_points", 1), ("residual", 1), ("residual", 2), ("residual", 1), ("tangent", 0), ("tangent", 1)),
        *(("residual", 0), ("contact_points", 0), (BOTH, 1), (BOTH, 0)),
    ),
)
# Two pairings of one state, 3 and 4: a memory that looks at the positions alone shows.
_ORDERS_OF_PAIRINGS = (
    (("residual", 3), ("residual", 4), ("tangent", 4), (BOTH, 3), (BOTH, 4)),
    (("tangent", 4), ("residual", 4), ("residual", 3), (BOTH, 4), (BOTH, 3)),
)


@dataclass(frozen=True, slots=True)
class Question:
    """The arguments of a residual, a tangent or contact points."""

    interface: Interface  # The meshes.
    pairing: Pairing | None  # The frozen pairing.
    z: FloatArray  # (n_unknowns + n_multipliers,) The state.


def count_changes(
    first: CheckedFormulation, second: CheckedFormulation, questions: Sequence[Question]
) -> tuple[float, dict[str, float]]:
    """Ask two instances the same questions in different orders, and count the entries of the answers that differ.

    The first number is that of entries that change when an instance is asked the same again. The others, by method, are
    those of entries that change with the order of the questions.
    """
    with_pairings = len(questions) > 3
    calls, others = (
        [call for call in order + (of_pairings if with_pairings else ()) if call[0] in {"residual", *first.provides}]
        for order, of_pairings in zip(_ORDERS, _ORDERS_OF_PAIRINGS, strict=True)
    )
    answers: dict[tuple[str, int], Array] = {}
    repeated = 0.0
    for call, answer in _ask(first, calls, questions):
        repeated += _count_different(answer, answers.setdefault(call, answer))
    changed = dict.fromkeys(("residual", "tangent", "contact_points", BOTH), 0.0)
    for call, answer in _ask(second, others, questions):
        changed[call[0]] += _count_different(answer, answers[call])
    return repeated, changed


def count_changes_in_life(
    formulation: CheckedFormulation, question: Question, states: FloatArray
) -> tuple[float, bool]:
    """Ask one instance a question with all methods, then in rounds of four calls, and all methods once more.

    A round is a residual at the state of the question, a pairing, a tangent, and a residual at a new state. Pairing and
    tangent are those of the question and of new states (n_rounds, n) in turn, so that half of all answers must repeat.
    The question holds the pairing that was the first answer to it. Return how many entries of answers to it change, and
    whether its pairing does.
    """
    interface, z = question.interface, question.z
    verbs = {"residual", *formulation.provides} & {"residual", "tangent", "contact_points", BOTH}
    slow = "tangent" if "tangent" in verbs else "residual"
    first = dict(_ask(formulation, [(verb, 0) for verb in sorted(verbs)], [question]))
    changed, pairs_otherwise = 0.0, False
    for number, state in enumerate(states):
        repeats = number % 2 == 1
        pairing = formulation.pair(interface, z if repeats else state)
        pairs_otherwise |= repeats and pairing != question.pairing
        near = Question(interface, question.pairing if repeats else pairing, state)
        answers = _ask(
            formulation, [("residual", 0), (slow, 1), ("residual", 2)], [question, question if repeats else near, near]
        )
        for (verb, _), answer in answers[: 1 + repeats]:
            changed += _count_different(answer, first[verb, 0])
    pairs_otherwise |= formulation.pair(interface, z) != question.pairing
    for call, answer in _ask(formulation, list(first), [question]):
        changed += _count_different(answer, first[call])
    return changed, pairs_otherwise


def _ask(
    formulation: CheckedFormulation, calls: Sequence[tuple[str, int]], questions: Sequence[Question]
) -> list[tuple[tuple[str, int], Array]]:
    """Return some calls, each with its answer in one array."""
    states = [questions[number] for _, number in calls]
    answers = formulation.answers(
        [(method, each.interface, each.pairing, each.z) for (method, _), each in zip(calls, states, strict=True)]
    )
    return [(call, _in_one_array(call[0], answer)) for call, answer in zip(calls, answers, strict=True)]


def _in_one_array(method: str, answer: Any) -> Array:
    """Return the residual (n,), the tangent (n, n), both (1 + n, n), or all arrays of the contact points in one."""
    if method == "contact_points":
        return np.concatenate([np.ravel(getattr(answer, entry.name)).astype(np.float64) for entry in fields(answer)])
    if method == BOTH:
        residual, tangent = answer
        return np.vstack([residual, dense(tangent)])
    return dense(answer)


def _count_different(answer: Array, other: Array) -> float:
    """Return how many entries differ; all of them where the shapes do. NaN agrees with NaN."""
    if answer.shape != other.shape:
        return float(max(answer.size, other.size))
    return float(((answer != other) & ~(np.isnan(answer) & np.isnan(other))).sum())


def renumber(case: Case, formulation: CheckedFormulation) -> tuple[Interface, FloatArray]:
    """Return another interface with as many nodes, and the state of the case on it.

    The nodes of each side are numbered from the last to the first, and the reference is twice as large.
    """
    interface, n_slave = case.interface, case.interface.n_slave_nodes
    number = np.concatenate([np.arange(n_slave)[::-1], np.arange(n_slave, interface.n_nodes)[::-1]])
    slave, master = (Surface(number[surface.faces]) for surface in (interface.slave, interface.master))
    other = Interface(2 * interface.nodes[number], slave, master)
    multipliers = np.resize(case.multipliers, formulation.n_multipliers(other))
    return other, np.concatenate([case.positions[number].reshape(-1), multipliers])


def compare_two_pairings(
    formulation: CheckedFormulation, interface: Interface, z: FloatArray, distant: FloatArray
) -> list[str]:
    """Pair twice at a state, with a distant one in between, and return in words what differs."""
    first = formulation.own_pairing(interface, z)
    if first is None or not first.opaque:
        return []
    formulation.own_pairing(interface, distant)
    methods = ["residual", *(["tangent"] if "tangent" in formulation.provides else [])]
    answers = [dense(getattr(formulation, method)(interface, first, z)) for method in methods]
    second = formulation.own_pairing(interface, z)
    if first != second:
        return ["the pairing of a state differs in a repeated call"]
    return [
        f"the {method} differs on two pairings of one state"
        for method, answer in zip(methods, answers, strict=True)
        if not np.array_equal(answer, dense(getattr(formulation, method)(interface, second, z)))
    ]
