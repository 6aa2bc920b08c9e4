"""Answers that depend on the question alone: all methods are asked in turn, in two orders, and in a long life."""

from collections.abc import Sequence
from dataclasses import fields
from functools import partial
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, FloatArray, dense
from contactverif.contract.case import Case, Cases
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface, Surface
from contactverif.contract.property import WITH_BARRIER, CheckedNumber, Measurement, Property, Quantity
from contactverif.contract.subject import CheckedFormulation, FirstAnswers, Restartable, Subject, ask_first
from contactverif.problems.named_states import first_state, named_case, tilted_in_space
from contactverif.strategies.surfaces import surface_cases
from contactverif_properties.roundoff import pair_coordinates, ratio, slenderness
from contactverif_properties.states import any_cases, prepare_state

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


class _Question(NamedTuple):
    """The arguments of a residual, a tangent or contact points."""

    interface: Interface
    pairing: Pairing | None
    z: FloatArray


def _count_changes(
    first: CheckedFormulation, second: CheckedFormulation, questions: Sequence[_Question]
) -> tuple[float, dict[str, float]]:
    """Ask two instances the same questions in different orders, and count the entries of the answers that differ."""
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


def _count_changes_in_life(
    formulation: CheckedFormulation, question: _Question, states: FloatArray
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
        near = _Question(interface, question.pairing if repeats else pairing, state)
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
    formulation: CheckedFormulation, calls: Sequence[tuple[str, int]], questions: Sequence[_Question]
) -> list[tuple[tuple[str, int], Array]]:
    """Return some calls, each with its answer in one array: all arrays of contact points, residual over tangent."""
    arrays = []
    answers = formulation.answers([(method, *questions[number]) for method, number in calls])
    for (method, _), answer in zip(calls, answers, strict=True):
        if method == "contact_points":
            parts = [np.ravel(getattr(answer, entry.name)).astype(np.float64) for entry in fields(answer)]
            arrays.append(np.concatenate(parts))
        else:
            arrays.append(np.vstack([answer[0], dense(answer[1])]) if method == BOTH else dense(answer))
    return list(zip(calls, arrays, strict=True))


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


def _compare_two_pairings(
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


NEAR = 2.0**-12  # The way to another state in a batch: near, and yet twelve binary digits of its answers differ.
FACTORS = 4  # An entry of a tangent has four factors, each with roundings of its own.
REASON = "The same operations on the same numbers give the same bits."
REPEATED = Quantity("entries that change in a repeated call", "0", REASON)
REORDERED = Quantity("entries that change with the order of calls", "0", REASON)
TANGENT = Quantity("entries of the tangent that change with the order of calls", "0", REASON)
POINTS = Quantity("entries of the contact points that change with the order of calls", "0", REASON)
BATCHED = Quantity(
    "difference between batch and loop",
    "8u",
    "A batch may round otherwise, as if nodes had moved by uX. The difference counts over X (k + |R|/ℓ) + N |R|.",
)
SECOND_PROCESS = Quantity(
    "difference from a second process",
    "8u",
    "It may add in another order, as if nodes had moved by uX. The difference counts over X (k + |R|/ℓ) + N |R|.",
)
IN_ONE_CALL = Quantity("entries of residual and tangent in one call that change with the order of calls", "0", REASON)
ONE_RESIDUAL = Quantity(
    "difference of the residual in one call",
    "8u",
    "One call may round otherwise, as a batch may. The difference counts over X (k + |R|/ℓ) + N |R|.",
)
ONE_TANGENT = Quantity(
    "difference of the tangent in one call",
    "32u",
    "One call may round four factors otherwise, as if nodes had moved by uX. The difference counts over X K' + N |K|.",
)

N_ROUNDS = 500  # The rounds of four calls in the life of an instance.
IN_LIFE = Quantity("entries that change in 2,000 calls of one instance", "0", REASON)
FIRST_RESIDUAL = Quantity(
    "difference of the first residual of a process",
    "8u",
    "The first call may add in another order, as a batch may. The difference counts over X (k + |R|/ℓ) + N |R|.",
)
FIRST_TANGENT = Quantity(
    "difference of the first tangent of a process",
    "32u",
    "The first call may round four factors otherwise, as if nodes had moved by uX. "
    "The difference counts over X K' + N |K|.",
)


_define = partial(Property.define, role="foundation", family="invariants", asks=WITH_BARRIER)


@_define(
    id="purity",
    rank=10,
    turn=8,
    restarts=True,
    quantities=(REPEATED, REORDERED, TANGENT, POINTS, BATCHED, SECOND_PROCESS, IN_ONE_CALL, ONE_RESIDUAL, ONE_TANGENT),
    cases=Cases.random(any_cases),
    cases_in_space=Cases.random(surface_cases),
)
def purity(case: Case, subject: Subject) -> Measurement:
    """An answer depends on the question alone: repeated, reordered, interleaved, in a batch, and in one call.

    **Question.** Calls are repeated, reordered, interleaved and batched. Is the answer to the same question always the
    same, and are the inputs left as they are?

    **Why it matters.** A formulation that remembers its last call works in a test and fails in a program that solves
    two load cases, restarts an increment, or runs in parallel.

    **How it is judged.** Two instances answer the same questions in different orders: residual, tangent and contact
    points in turn, at two states and on two interfaces in turn, and with two pairings of one state where it has two.
    One more state is paired in which one side, or half of all nodes, lies as before, so that a store with too small a
    key is seen. The measured numbers count entries that differ; the tolerance is 0, since the same operations on the
    same numbers give the same bits. A third instance has another penalty. Its forces differ, and those of the first
    instance are what they were. A batch may round otherwise, as if nodes had moved by uX. That changes a force by uX (k
    + |R|/ℓ): k is the stiffness, and a segment turns by uX/ℓ. Summing N forces adds uN|R|. Each state of the batch has
    its own |R|, and k is the larger of ε̂L and the change of the residual from one state to the other over the way
    between them. Each coordinate of two segments may be rounded, so the tolerance is 8u; two triangles have 18. In
    space |R|/ℓ counts as often as a face is slender, by its longest edge over its least height: places along it are
    rounded by so much more. A pairing that differs, or an interface that was changed, fails in words. A pairing with a
    handle is made twice at one state, with another state in between: it must have the same entries and give the same
    answers.

    A plugin that lives in a process of its own is asked in a second process too, which differs in what no answer may
    depend on: the seed of hashes, and the state that was asked first. The pairing is the same, and the residual is held
    to that of the first process as a batch is held to a loop, since the order of a set may be that of a sum. Each
    process has one thread: bits that depend on the number of threads are no breach.

    Some formulations compute residual and tangent in one call. Its residual is held to that of the method alone as a
    batch is held to a loop. Its tangent may round each of the four factors of an entry (area, pressure, normal, shape)
    as if nodes had moved by uX. That changes an entry by uX times the slope of K, the larger of |K|/ℓ and the change of
    the tangent from one state to the other over the way between them. Summing N entries adds uN|K|. The same operations
    may round nothing at all; an exact agreement is not asked.

    **Undecided.** Never.
    """
    formulation, state = prepare_state(case, subject)
    penalty = state.penalty if state.n_multipliers else subject.penalty(case)
    interface, z = state.interface, state.z
    random = np.random.default_rng(state.seed)
    distant = z + random.uniform(-1, 1, z.size) * state.resolution / 4
    partly = _move_some(state, distant, random)
    near = z + NEAR * (distant - z)
    other, z_other = renumber(state, formulation)
    before = _fingerprint(interface), _fingerprint(other)

    # Each state is asked with its own pairing, or with that of a state nearby: far from the state of a pairing, a right
    # formulation may have no answer (a quadratic without a root).
    places = ((interface, z), (interface, distant), (other, z_other), (interface, near))
    questions = [_Question(mesh, formulation.pair(mesh, u), u) for mesh, u in places]
    pairing, second = questions[0].pairing, subject.with_penalty(penalty)
    broken = []
    if formulation.pair(interface, z) != pairing:
        broken.append("the pairing of a state differs in a repeated call")
    pairing_of_some = formulation.pair(interface, partly)
    if second.pair(interface, partly) != pairing_of_some or any(
        second.pair(mesh, u) != paired for mesh, paired, u in (*questions[1:3], questions[1])
    ):
        broken.append("the pairing of a state depends on the state before it")
    broken += _compare_two_pairings(formulation, interface, z, distant)
    if questions[3].pairing == pairing:
        questions = questions[:3]
    else:
        questions.append(_Question(interface, pairing, near))
    repeated, changes = _count_changes(formulation, second, questions)

    by_method = {REORDERED: "residual", TANGENT: "tangent", POINTS: "contact_points"}
    numbers = [REPEATED.check(repeated, 0.0), *(each.check(changes[name], 0.0) for each, name in by_method.items())]
    bound = pair_coordinates(state) * UNIT_ROUNDOFF
    forces = np.array(formulation.answers([("residual", interface, pairing, u) for u in (z, near)]))
    if subject.traits.rules.enforcement == "penalty":
        changed = subject.with_penalty(2 * penalty).residual(*questions[0])
        if forces[0].any() and (changed == forces[0]).all():
            broken.append("another penalty gives the same forces")
        if (formulation.residual(*questions[0]) != forces[0]).any():
            broken.append("the forces change when another instance is made with another penalty")
    if subject.traits.abilities.batched:
        batch = formulation.residual(interface, pairing, np.array([[z, near], [near, z]]))
        difference = max(_compare(state, near, forces, each) for each in (batch[0], batch[1][::-1]))
        numbers.append(BATCHED.check(difference, bound))
    if isinstance(subject, Restartable):
        far = subject.restart().with_penalty(penalty)
        far.residual(other, far.pair(other, z_other), z_other)
        if far.pair(interface, partly) != pairing_of_some or far.pair(interface, z) != pairing:
            broken.append("the pairing of a state differs in another process")
        forces_there = np.array(far.answers([("residual", interface, pairing, u) for u in (z, near)]))
        numbers.append(SECOND_PROCESS.check(_compare(state, near, forces, forces_there), bound))
    if BOTH in formulation.provides:
        answers = formulation.answers([(verb, interface, pairing, u) for verb in ("tangent", BOTH) for u in (z, near)])
        tangents, pairs = np.array([dense(tangent) for tangent in answers[:2]]), answers[2:]
        residuals, others = (np.array([dense(pair[part]) for pair in pairs]) for part in (0, 1))
        numbers += [
            IN_ONE_CALL.check(changes[BOTH], 0.0),
            ONE_RESIDUAL.check(_compare(state, near, forces, residuals), bound),
            ONE_TANGENT.check(_compare(state, near, tangents, others), FACTORS * bound),
        ]
    if (_fingerprint(interface), _fingerprint(other)) != before:
        broken.append("the interface was changed")
    idle = not forces[:, : interface.n_unknowns].any()
    return Measurement(numbers, broken="; ".join(broken), idle=idle)


def _move_some(state: Case, distant: FloatArray, random: np.random.Generator) -> FloatArray:
    """Return a state (n_unknowns,) in which one side, or about half of all nodes, is where it was."""
    n_slave, n_nodes = state.interface.n_slave_nodes, state.interface.n_nodes
    stays = random.random(n_nodes) < 1 / 2
    match random.integers(3):
        case 0:
            stays = np.arange(n_nodes) < n_slave
        case 1:
            stays = np.arange(n_nodes) >= n_slave
    moves = np.ones(state.z.size, bool)
    moves[: state.interface.n_unknowns] = np.repeat(~stays, state.interface.dim)
    return np.where(moves, distant, state.z)


@_define(
    id="purity.long",
    rank=80,
    quantities=(IN_LIFE, FIRST_RESIDUAL, FIRST_TANGENT),
    cases=Cases.from_list(lambda: (named_case("offset-c"),)),
    cases_in_space=Cases.from_list(tilted_in_space),
)
def purity_long(case: Case, subject: Subject) -> Measurement:
    """The first answers of an instance and of a process are those that a long life repeats.

    **Question.** One instance answers 2,000 calls. Are its answers the same from the first to the last? Is the first
    answer of a process, before anything is warm, the answer that it gives later?

    **Why it matters.** A program makes an instance once, and asks it in thousands of iterations. A counter that runs
    over, a store that is full, a sum that drifts or a table that is filled in the first call shows in no test of a few
    calls.

    **How it is judged.** The methods are asked at one state. Then residuals, pairings and tangents follow in turn, at
    that state and at 500 new ones near it, and all methods are asked at that state again. The first number counts the
    entries of repeated answers that differ; the tolerance is 0. A pairing that differs fails in words. The other two
    compare the first residual and the first tangent of the process with those that it gives now, each as `purity`
    compares a batch with a loop. A run notes the first answers where it calls a formulation for the first time, on case
    C′ or on two pairs of faces, in a process of its own or in that of the harness. They are only compared to
    roundoff, since a process may compile in its first calls and add in another order later.

    **Undecided.** Never.
    """
    first = subject.first_answers
    if first is None:
        first = ask_first(subject, first_state(subject.traits)[0], subject.provides)
    formulation, state = prepare_state(case, subject)
    random = np.random.default_rng(state.seed)
    moves = random.uniform(-1, 1, (N_ROUNDS, state.z.size)) * state.resolution
    question = _Question(state.interface, formulation.pair(state.interface, state.z), state.z)
    changed, pairs_otherwise = _count_changes_in_life(formulation, question, state.z + NEAR * moves)
    numbers = [IN_LIFE.check(changed, 0.0), *_compare_first(first, subject, random)]
    broken = "the pairing of a state differs after many calls" if pairs_otherwise else ""
    idle = not formulation.residual(state.interface, question.pairing, state.z)[: state.interface.n_unknowns].any()
    return Measurement(numbers, broken=broken, idle=idle)


def _compare_first(first: FirstAnswers, subject: Subject, random: np.random.Generator) -> list[CheckedNumber]:
    """Return the differences of the first answers of a process from those that it gives now."""
    case, formulation = first.case, subject.for_case(first.case)
    near = case.z + NEAR * random.uniform(-1, 1, case.z.size) * case.resolution
    pairing = formulation.pair(case.interface, case.z)
    bound, numbers = pair_coordinates(case) * UNIT_ROUNDOFF, []
    for verb, quantity, then, tolerance in (
        ("residual", FIRST_RESIDUAL, first.residual, bound),
        ("tangent", FIRST_TANGENT, first.tangent, FACTORS * bound),
    ):
        if then is not None:
            answers = formulation.answers([(verb, case.interface, pairing, u) for u in (case.z, near)])
            now = np.array([dense(answer) for answer in answers])
            numbers.append(quantity.check(_compare(case, near, now, np.array([then, now[1]])), tolerance))
    return numbers


def _compare(case: Case, near: FloatArray, answers: Array, others: Array) -> float:
    """Return the largest difference of answers over what moving the nodes by X would change.

    Both are residuals (2, n) or tangents (2, n, n): in the state of the case, and in one nearby, on one pairing. Each
    state has its own size: where one of the two just touches, its forces say nothing about those of the other.
    """
    axes, way = tuple(range(1, answers.ndim)), float(np.abs(near - case.z).max())
    slope = float(np.abs(answers[1] - answers[0]).max()) / way if way > 0 else 0.0
    largest = np.abs(answers).max(axis=axes)
    turned = slenderness(case) * largest / case.resolution
    stiffness = max(case.penalty * case.slave_measure, slope)  # The slope counts where the law is stiffer than ε̂.
    changed = stiffness + turned if answers.ndim == 2 else np.maximum(slope, turned)
    moved = case.largest_coordinate * changed + case.n_segments * largest
    differences = np.abs(others - answers).max(axis=axes)
    return float(max(map(ratio, differences.tolist(), moved.tolist())))


def _fingerprint(interface: Interface) -> tuple[bytes, bytes, bytes]:
    return interface.nodes.tobytes(), interface.slave.faces.tobytes(), interface.master.faces.tobytes()
