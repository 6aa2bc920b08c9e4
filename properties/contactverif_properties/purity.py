"""Does an answer depend on anything but the question? Calls are repeated, reordered and batched."""

from __future__ import annotations

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import Subject
from contactverif_properties import roundoff
from contactverif_properties.anywhere import any_cases, no_barrier, posed

NEAR = 2.0**-12  # of the way to another state; and twelve binary digits of a batch's answers are their own

BITWISE = "the same operations on the same numbers give the same bits"
AGAIN = Quantity("entries that change when asked again", "1", "0", BITWISE)
REORDERED = Quantity("entries that change with the order of calls", "1", "0", BITWISE)
BATCHED = Quantity(
    "batch against loop", "1", roundoff.PATCH, "a batch may sum in another order; a gap is rounded to uX"
)


def pure(case: Case, subject: Subject) -> Measurement:
    """R(x1), R(x2), R(x1) gives the first again, also after a tangent and in a batch; inputs stay as they are.

    Every state is asked with its own pairing: with another's, far from it, a right formulation may have no answer (a
    quadratic without a root). The batch is of the state and of one so near that the pairing is nearly its own.
    """
    original = case
    formulation, case = posed(original, subject)
    interface, z = case.interface, case.z
    random = np.random.default_rng(case.seed)
    elsewhere = z + random.uniform(-1, 1, z.size) * case.shortest_segment / 4
    before = _fingerprint(interface)

    pairing = formulation.pair(interface, z)
    first = formulation.residual(interface, pairing, z)
    pairing_elsewhere = formulation.pair(interface, elsewhere)
    second = formulation.residual(interface, pairing_elsewhere, elsewhere)
    pairing_again = formulation.pair(interface, z)
    again = formulation.residual(interface, pairing_again, z)
    fresh, _ = posed(original, subject)  # it meets the states the other way round, tangents first
    pairing_first = fresh.pair(interface, elsewhere)
    if "tangent" in fresh.provides:
        fresh.tangent(interface, pairing_first, elsewhere)
        fresh.tangent(interface, pairing, z)
    changed = (fresh.residual(interface, pairing_first, elsewhere) != second).sum()
    changed += (fresh.residual(interface, pairing, z) != first).sum()
    near = z + NEAR * (elsewhere - z)
    batch = formulation.residual(interface, pairing, np.array([[near, z], [z, z], [z, near]]))
    alone = formulation.residual(interface, pairing, near)

    broken = []
    if pairing != pairing_again:
        broken.append("the pairing of a state differs when asked again")
    if pairing_elsewhere != pairing_first:
        broken.append("the pairing of a state depends on the state before it")
    if _fingerprint(interface) != before:
        broken.append("the interface was changed")
    largest = float(max(np.abs(first).max(), np.abs(alone).max()))
    difference = float(np.abs(batch - np.array([[alone, first], [first, first], [first, alone]])).max())
    return Measurement(
        {
            AGAIN.name: float((again != first).sum()),
            REORDERED.name: float(changed),
            BATCHED.name: roundoff.share(difference, largest),
        },
        {
            AGAIN.name: 0.0,
            REORDERED.name: 0.0,
            BATCHED.name: roundoff.of_gap(case, roundoff.mean_penetration(case, first)),
        },
        broken="; ".join(broken),
        idle=not (first[: interface.n_unknowns].any() or alone[: interface.n_unknowns].any()),
    )


def _fingerprint(interface: Interface) -> tuple[bytes, bytes, bytes]:
    return interface.nodes.tobytes(), interface.slave.segments.tobytes(), interface.master.segments.tobytes()


PURITY = Property(
    id="purity",
    family="invariants",
    summary="an answer depends on nothing but the question: no memory, no changed input, a batch equals a loop",
    quantities=(AGAIN, REORDERED, BATCHED),
    cases=any_cases,
    measure=pure,
    promise=lambda traits: True,
    applicable=no_barrier,
)
