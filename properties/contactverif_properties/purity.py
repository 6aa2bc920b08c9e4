"""Ask whether an answer depends on nothing but the question.

**Question.** Calls are repeated, reordered and batched. Is the answer to the same question always the same, and are
the inputs left as they are?

**Why it matters.** A formulation that remembers its last call works in a test and fails in a program that solves two
load cases, restarts an increment, or runs in parallel.

**How it is judged.** R(x1), R(x2), R(x1) must give the first answer again, also after a tangent, and by a fresh
instance that meets the states in the other order. The measured numbers count entries that differ; the tolerance is 0,
since the same operations on the same numbers give the same bits. A batch may sum in another order: its largest
difference over the largest force is at most u(8X/|g| + 4N). A pairing that differs, or an interface that was changed,
fails in words.

**Undecided.** Never.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contactverif.contract.arrays import Array, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif_properties.shared.any_state import any_cases, prepare_state
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.roundoff import GAP_TOLERANCE, gap_tolerance, mean_penetration, ratio

NEAR = 2.0**-12  # The way to another state in a batch: near, and yet twelve binary digits of its answers differ.

REASON = "The same operations on the same numbers give the same bits."
REPEATED = Quantity("entries that change in a repeated call", "1", "0", REASON)
REORDERED = Quantity("entries that change with the order of calls", "1", "0", REASON)
BATCHED = Quantity(
    "difference between batch and loop",
    "1",
    GAP_TOLERANCE,
    "A batch may sum in another order, and a gap is rounded to uX.",
)


@dataclass(frozen=True, slots=True)
class Answer:
    """The pairing of a state, and the residual on it."""

    pairing: Pairing | None
    forces: Array


def ask(formulation: CheckedFormulation, interface: Interface, z: FloatArray) -> Answer:
    """Return the pairing of the state z and the residual on it.

    Each state is asked with its own pairing: far from the state of a pairing, a right formulation may have no answer
    (a quadratic without a root).
    """
    pairing = formulation.pair(interface, z)
    return Answer(pairing, formulation.residual(interface, pairing, z))


def measure_purity(case: Case, subject: Subject) -> Measurement:
    """Repeat, reorder and batch calls, and count the entries that change.

    Parameters
    ----------
    case : Case
        A random state.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The entries that change in a repeated call, those that change for a fresh instance which meets the states in the
        other order, tangents first, and the difference between a batch and a loop. The batch holds the state and one so
        near that its pairing is nearly the same.
    """
    formulation, state = prepare_state(case, subject)
    interface, z = state.interface, state.z
    random = np.random.default_rng(state.seed)
    distant = z + random.uniform(-1, 1, z.size) * state.shortest_segment / 4
    before = _fingerprint(interface)

    first = ask(formulation, interface, z)
    second = ask(formulation, interface, distant)
    repeated = ask(formulation, interface, z)
    fresh, _ = prepare_state(case, subject)
    pairing_first = fresh.pair(interface, distant)
    if "tangent" in fresh.provides:
        fresh.tangent(interface, pairing_first, distant)
        fresh.tangent(interface, first.pairing, z)
    n_changes = (fresh.residual(interface, pairing_first, distant) != second.forces).sum()
    n_changes += (fresh.residual(interface, first.pairing, z) != first.forces).sum()
    near = z + NEAR * (distant - z)
    batch = formulation.residual(interface, first.pairing, np.array([[near, z], [z, z], [z, near]]))
    alone = formulation.residual(interface, first.pairing, near)

    broken = []
    if first.pairing != repeated.pairing:
        broken.append("the pairing of a state differs in a repeated call")
    if second.pairing != pairing_first:
        broken.append("the pairing of a state depends on the state before it")
    if _fingerprint(interface) != before:
        broken.append("the interface was changed")
    loop = np.array([[alone, first.forces], [first.forces, first.forces], [first.forces, alone]])
    largest = float(max(np.abs(first.forces).max(), np.abs(alone).max()))
    values = {
        REPEATED.name: float((repeated.forces != first.forces).sum()),
        REORDERED.name: float(n_changes),
        BATCHED.name: ratio(float(np.abs(batch - loop).max()), largest),
    }
    rounding = gap_tolerance(state, mean_penetration(state, first.forces))
    tolerances = {REPEATED.name: 0.0, REORDERED.name: 0.0, BATCHED.name: rounding}
    n = interface.n_unknowns
    return Measurement(
        values, tolerances, broken="; ".join(broken), idle=not (first.forces[:n].any() or alone[:n].any())
    )


def _fingerprint(interface: Interface) -> tuple[bytes, bytes, bytes]:
    """Return all bits of an interface."""
    return interface.nodes.tobytes(), interface.slave.segments.tobytes(), interface.master.segments.tobytes()


PURITY = Property(
    id="purity",
    family="invariants",
    summary="An answer depends on the question alone, in a repeated call, in another order, and in a batch.",
    quantities=(REPEATED, REORDERED, BATCHED),
    cases=any_cases,
    measure=measure_purity,
    promise=lambda traits: True,
    applicable=refuse_barrier,
)
