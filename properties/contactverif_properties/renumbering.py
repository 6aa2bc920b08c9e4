"""Ask whether the numbers of nodes and segments matter.

**Question.** Nodes and segments of a random state get other numbers. On closed rings the numbers go round, so that the
seam, where the last segment meets the first, is elsewhere. Are the forces on each node the old ones?

**Why it matters.** A mesh generator numbers as it likes. A formulation that takes the next number for the next segment
is right on one mesh and wrong on the same mesh from another program, or at the one seam of a ring.

**How it is judged.** Changes of the forces count over Σ|R| of the slave, those of the tangent over max|K|. The
tolerance is u(8Z/min(g, ℓ) + 4N), because sums run in another order. Multipliers are uniform, because their order
changes.

**Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X changes
the answer by a quarter of the error or more. On an exact bisector, and in the normal cone of a re-entrant vertex, a
point is as near to one segment as to another, and the number of a segment may decide. In such a cone the state is asked
again, with other numbers of nodes alone.
"""

from __future__ import annotations

import numpy as np
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import IntArray
from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.contract.interface import Interface
from contactverif.contract.property import Measurement, Property
from contactverif.contract.subject import Subject
from contactverif.strategies import smooth_cases
from contactverif.strategies.rings import closed_cases
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.relabelled import renumber
from contactverif_properties.shared.same_answer import TIE, answer_alike, compare, same_answer_quantities

QUANTITIES = same_answer_quantities("in other numbers")
ANY, CLOSED = "any mesh, numbered at random", "closed rings, the seam elsewhere"


@random_source("contactverif_properties.renumbering.renumbering_cases")
def renumbering_cases(
    interface: Interface | None = None,
) -> dict[str, SearchStrategy[Case]] | SearchStrategy[Case] | None:
    """Return meshes of any kind and closed rings; states of a given interface."""
    return {ANY: smooth_cases(), CLOSED: closed_cases()} if interface is None else smooth_cases(interface)


def measure_renumbering(case: Case, subject: Subject) -> Measurement:
    """Compare the forces and the tangent in other numbers with those of the state.

    Parameters
    ----------
    case : Case
        A random state. Numbers go round if its kind is `CLOSED`; else they are shuffled.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The largest change of a force over Σ|R| of the slave, and of an entry of the tangent over max|K|.
    """
    interface, random = case.interface, np.random.default_rng([case.seed, 2])

    def order(count: int) -> IntArray:
        numbers: IntArray = np.arange(count)
        if case.kind == CLOSED:
            return np.roll(numbers, int(random.integers(1, count)))
        return random.permutation(numbers)

    n_slave = interface.n_slave_nodes
    nodes = np.concatenate([order(n_slave), n_slave + order(interface.n_nodes - n_slave)])
    slave, master = order(len(interface.slave)), order(len(interface.master))
    other, carry = renumber(case, nodes, slave, master)
    measurement = compare(QUANTITIES, subject, *answer_alike(case, other, subject), carry)
    if measurement.undecided != TIE:
        return measurement
    # The numbers of segments may decide a tie. Those of nodes still must not matter.
    other, carry = renumber(case, nodes, np.arange(len(slave)), np.arange(len(master)))
    return compare(QUANTITIES, subject, *answer_alike(case, other, subject), carry)


RENUMBERING = Property(
    id="renumbering",
    family="invariants",
    summary="Other numbers of nodes and segments, or another seam of a closed chain, change nothing.",
    quantities=QUANTITIES,
    cases=renumbering_cases,
    measure=measure_renumbering,
    promise=lambda traits: True,
    applicable=refuse_barrier,
    kinds=(ANY, CLOSED),
)
