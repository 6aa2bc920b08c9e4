"""Ask whether a body that touches nothing changes anything.

**Question.** A pair of bodies, in contact with each other, is added far from a random state. Or a second body is added
behind the master, where no slave point comes near it. Are forces and tangent those of before?

**Why it matters.** Parts of an assembly that do not touch have nothing to do with each other. A formulation that scales
its springs by the mean element size, or searches on the first surface that a line meets, couples them.

**How it is judged.** Changes of the forces on the old nodes count over Σ|R| of the slave, those of the tangent over
max|K|. The penalty stays the same number. The tolerance is u(8Z/min(g, ℓ) + 4N) with the size Z of the whole, because a
right formulation may subtract the mean of all nodes first. The detail counts entries that are not equal bit by bit: 0
for each formulation that looks only at nodes near contact.

**Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X changes
the answer by a quarter of the error or more.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.contract.interface import Interface, Surface
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.strategies import smooth_cases
from contactverif.strategies.straight import cases_over_a_body
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.same_answer import Carry, answer_alike, compare, same_answer_quantities

FAR, BEHIND = "a far pair of bodies", "a body behind the master"
DISTANCE = 64.0  # The distance of the far pair over the diameter of the state.
QUANTITIES = same_answer_quantities("beside another body")


@random_source("contactverif_properties.remote.remote_cases")
def remote_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | SearchStrategy[Case] | None:
    """Return states of any kind, and straight slaves over two bodies; states of a given interface."""
    if interface is not None:
        return smooth_cases(interface)
    behind = cases_over_a_body()
    assert behind is not None
    return {FAR: smooth_cases(), BEHIND: behind}


def measure_remote(case: Case, subject: Subject) -> Measurement:
    """Compare forces and tangent beside another body with those without it.

    Parameters
    ----------
    case : Case
        A random state. Its parameter "behind", if there is one, holds the nodes of a body behind the master.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The largest change of a force over Σ|R| of the slave, and of an entry of the tangent over max|K|.
    """
    if "behind" in case.parameters:
        slave, master = np.empty((0, 2)), case.parameters["behind"]
    else:
        slave, master = make_far_pair(case)
    more, carry = add_chains(case, slave, master)
    return compare(QUANTITIES, subject, *answer_alike(case, more, subject), carry)


def make_far_pair(case: Case) -> tuple[FloatArray, FloatArray]:
    """Return a slave and a master segment, points (2, 2) each, that penetrate each other far from a state."""
    angle = np.random.default_rng([case.seed, 3]).uniform(-np.pi, np.pi)
    length = case.shortest_segment
    origin = case.positions.mean(axis=0) + DISTANCE * case.diameter * np.array([np.cos(angle), np.sin(angle)])
    slave = origin + length * np.array([[0.0, -0.125], [1.0, -0.25]])
    return slave, origin + length * np.array([[2.0, 0.0], [-1.0, 0.0]])


def add_chains(case: Case, slave: FloatArray, master: FloatArray) -> tuple[Case, Carry]:
    """Return a case with one more chain on each side, and the new numbers of its nodes.

    Parameters
    ----------
    case : Case
        The case; its own nodes stay where they are.
    slave, master : FloatArray, shape (n, 2)
        The nodes of the new chains as they are walked, in the state and in the reference; none for no chain.
    """
    interface, n_slave = case.interface, case.interface.n_slave_nodes
    first = n_slave + len(slave)  # The new number of the first master node.
    last = interface.n_nodes + len(slave)  # That of the first node of the new master chain.
    sides = (
        Surface(np.vstack([interface.slave.segments, _walk(n_slave, len(slave))])),
        Surface(np.vstack([interface.master.segments + len(slave), _walk(last, len(master))])),
    )

    def join(nodes: FloatArray) -> FloatArray:
        return np.vstack([nodes[:n_slave], slave, nodes[n_slave:], master])

    more = replace(case, interface=Interface(join(interface.nodes), *sides), z=join(case.positions).reshape(-1))
    numbers = np.concatenate([np.arange(n_slave), first + np.arange(interface.n_nodes - n_slave)])
    return more, Carry(numbers)


def _walk(start: int, count: int) -> FloatArray:
    """Return the segments (count − 1, 2) of a chain whose nodes are numbered from `start`."""
    numbers = start + np.arange(count)
    return np.column_stack([numbers[:-1], numbers[1:]]) if count else np.empty((0, 2), np.int64)


REMOTE = Property(
    id="remote",
    family="invariants",
    summary="A body that touches nothing, far away or behind the master, changes nothing.",
    quantities=QUANTITIES,
    cases=remote_cases,
    measure=measure_remote,
    promise=lambda traits: True,
    applicable=refuse_barrier,
    kinds=(FAR, BEHIND),
)
