"""The promise of a barrier that no two surfaces ever intersect."""

from itertools import pairwise

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import ACTIVATION, Case, Cases
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.strategies.closings import KINDS, closing_cases
from contactverif_properties.compressive import LEAST_GROWTH, N_HALVINGS, ROUNDED
from contactverif_properties.exact_forces import describe_node, normal_of
from contactverif_properties.roundoff import ratio

NEAR = 2.0**-8  # The largest gap over the length to the nearest other node, whose forces hardly matter then.
BESIDE = 2.0**-20  # The step to either side of a border, over the gap.
LEAST_WORK, LARGEST_JUMP = 0.25, 2.0**-10
GROWTH = Quantity(
    "least growth of the force at half the gap",
    "1.01",
    "At the k-th halving, the weakest force whose work has no bound grows by 2k/(k + 1).",
    sense="at least",
)
WORK = Quantity(
    "gap times force in the end, over that half-way",
    "1/4",
    "The sum of gap times force over all halvings has no bound. If it is that of 1/k, the last is half of it.",
    sense="at least",
)
JUMP = Quantity(
    "jump of a force at the border of a vertex",
    "2^-10",
    "A step of 2^-19 of the gap changes a force that goes with gap^-p by p times that, and no p in use is above 512.",
)


@Property.define(
    id="intersection-free",
    rank=445,
    family="invariants",
    quantities=(GROWTH, WORK, JUMP),
    cases=Cases.random(closing_cases),
    kinds=KINDS,
    promise=lambda traits: traits.promises.never_intersects,
    applicable=lambda traits: "" if traits.promises.never_intersects is not None else "state `never_intersects`",
    asks=frozenset({"barrier"}),
)
def intersection_free(case: Case, subject: Subject) -> Measurement:
    """A barrier lets no node of either surface through a vertex or a segment of the other one.

    **Question.** A node of the slave or of the master closes on a vertex, or on a place inside a segment, of the other
    surface. Does the force that parts them grow so much that its work has no bound? Is it continuous where the node
    passes from the segment to the vertex?

    **Why it matters.** A barrier of the slave's nodes alone lets a peak of the master into a slave segment; one of
    segments without their ends lets corners pass. One whose force ends at some gap, or does a bounded work, gives way
    to a large load. A force that jumps at a border keeps Newton's method from the solution there.

    **How it is judged.** The gap is halved from 1/256 of the length to the nearest other node, down to 2^-40 of the
    activation distance, or to 4096 u X, where rounding the positions begins to decide it. The force is half of the
    difference of what pushes the slave and what pushes the master, along the way. It must grow at every halving. Its
    work has no bound only if the sum of gap × force over all halvings has none. This product may fall as 1/k at the
    k-th halving does, to half of what it was half-way; with a force that goes with gap^-1/2 it falls to 2^-8. A quarter
    is asked, so that powers just below 1 pass.

    Then the node stands over an end of a segment, at a random gap, and steps over the normal there. The last number is
    the largest change of a nodal force over the largest force. The vertices are convex, or all but straight: there the
    slope of a distance is continuous. Lengths, slopes, places and gaps are drawn by their exponents. A barrier that
    weights gaps, or looks from one surface, may be right without this promise.

    **Undecided.** A case whose positions are so large that no gap is left to be halved.
    """
    formulation, n_slave, normal = subject.for_case(case), case.interface.n_slave_nodes, normal_of(case)
    gap, rounding = case.parameter("penetration"), UNIT_ROUNDOFF * case.largest_coordinate
    largest = min(gap, NEAR * case.parameter("room"))
    gaps = largest * 2.0 ** -np.arange(N_HALVINGS)
    gaps = gaps[gaps >= max(2.0**-N_HALVINGS * case.parameter(ACTIVATION), ROUNDED * rounding)]
    if len(gaps) < 3:
        return Measurement(undecided="rounding the positions decides a gap of which nothing is left to be halved")

    def forces_at(shifts: FloatArray) -> FloatArray:  # (k, n_nodes, 2) where the slave has moved by shifts (k, 2).
        states = np.repeat(case.positions[None], len(shifts), axis=0)
        states[:, :n_slave] += shifts[:, None]
        return -formulation.residual(case.interface, None, states.reshape(len(shifts), -1)).reshape(states.shape)

    along = forces_at(np.multiply.outer(gaps - gap, normal)) @ normal
    pushes = (along[:, :n_slave].sum(axis=1) - along[:, n_slave:].sum(axis=1)) / 2
    growth = [closer / farther if farther > 0 else 0.0 for farther, closer in pairwise(pushes.tolist())]
    halfway, last = (gaps * pushes)[[len(gaps) // 2, -1]]
    values = {GROWTH: min(growth), WORK: float(last / halfway) if halfway > 0 else 0.0}
    node, vertex, neighbour = case.parameters["closing"].astype(int)
    height = max(ROUNDED**2 * rounding, largest * 2.0 ** -np.random.default_rng([case.seed, 5]).uniform(0, 16))
    if height <= gap:
        tangent = case.positions[neighbour] - case.positions[vertex]
        tangent /= np.linalg.norm(tangent)
        outward = np.array([tangent[1], -tangent[0]])
        outward *= np.copysign(1.0, outward @ normal * (vertex - n_slave + 0.5))  # Towards the other surface.
        shifts = case.positions[vertex] - case.positions[node] + height * outward
        shifts = shifts + BESIDE * height * np.array([tangent, -tangent])
        both = forces_at(shifts if node < n_slave else -shifts)
        values[JUMP] = ratio(float(np.ptp(both, axis=0).max()), float(np.abs(both).max()))
    measurement = Measurement(check_all(values, {GROWTH: LEAST_GROWTH, WORK: LEAST_WORK, JUMP: LARGEST_JUMP}))
    closing = describe_node(case.interface, int(node))
    measurement = measurement.after(f"{closing} at a gap of {height:.4g} beside a vertex", JUMP)
    return measurement.after(
        f"{closing} closed from a gap of {gaps[np.argmin(growth)]:.4g} to half of it", GROWTH, WORK
    )
