"""Named states of a flat interface with a uniform penetration: far away, deep, over a node, or near other surfaces.

All rules for gaps agree there, so every formulation is asked something: no force along the surface, and a push out of
the master (everybody); the total (who states `penalty` and `area`); each nodal force (unless `patch.flat` is
False).
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.interface import PLANE
from contactverif.contract.measurement import Finding, Measurement, Quantity
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.problems.flat_faces import (
    deep_face_states,
    equal_area_states,
    node_hit_face_states,
    offset_face_states,
    search_face_states,
)
from contactverif.problems.flat_states import (
    deep_states,
    equal_length_states,
    node_hit_states,
    offset_states,
    search_states,
)
from contactverif_properties.shared import uniform_pressure
from contactverif_properties.shared.applicability import knows_total, may_act_twice
from contactverif_properties.shared.roundoff import gap_tolerance, ratio, rounding_distance, stated_gap_quantity
from contactverif_properties.shared.worst_force import worst_force

TOTAL = stated_gap_quantity("error of the total force")
NODAL = stated_gap_quantity("error of a nodal force")
ALONG = replace(
    TOTAL, name="force along the surface", reason=f"{TOTAL.reason} A flat surface pushes across itself alone."
)
FLAT_QUANTITIES = (ALONG, TOTAL, NODAL)
VACUOUS = "the gap is smaller than the rounding of positions that far from the origin"


def promise_flat_forces(traits: Traits) -> bool | None:
    """Return True where the traits promise what is asked, the patch test or at least the total; else None."""
    return True if traits.promises.patch.flat or (traits.promises.patch.flat is False and knows_total(traits)) else None


def measure_flat(case: Case, subject: Subject) -> Measurement:
    """Compare the forces of a uniform penetration with what is known about them."""
    penetration, traits = case.parameter("penetration"), subject.traits
    tolerance = gap_tolerance(case, penetration, rounding_distance(case, traits))
    if tolerance >= 1:
        return Measurement(undecided=VACUOUS)
    exact = exact_forces(case)
    slave = uniform_pressure.pushing_forces(uniform_pressure.uniform_state(case, subject))[
        : case.interface.n_slave_nodes
    ]
    normal = uniform_pressure.normal_of(case)
    numbers = [ALONG.check(ratio(_force_along(case, slave), float(np.abs(slave).sum())), tolerance)]
    push, whole = float((slave @ normal).sum()), float(np.linalg.norm(exact[: len(slave)].sum(axis=0)))
    broken, finding = "" if push > 0 else "nothing pushes the slave out of the master", None
    if knows_total(traits):
        numbers.append(TOTAL.check(abs(push / whole - 1), tolerance))
    if traits.promises.patch.flat is not False:
        forces, largest = uniform_pressure.forces_of_gap(case, subject, exact)
        numbers.append(NODAL.check(float(np.linalg.norm(forces - exact, axis=1).max()) / whole, tolerance * largest))
        if numbers[-1].ratio > 1:
            finding = worst_force(case.interface, forces, exact)
    return Measurement(numbers, broken=broken, finding=finding)


def _force_along(case: Case, forces: FloatArray) -> float:
    """Return the size of the sum of forces (n, dim) along the surface, in space over both tangents."""
    tangents = case.parameters["direction" if case.interface.dim == PLANE else "directions"]
    return float(np.hypot.reduce(np.abs(np.atleast_1d((forces @ tangents.T).sum(axis=0)))))


def exact_forces(case: Case) -> FloatArray:
    """Return the exact forces (n_nodes, dim) of the pressure ε̂ |g| that push the nodes of a flat state."""
    if "weights" not in case.parameters:  # There is no other surface than the flat one.
        return uniform_pressure.forces_of_penetration(case)
    return uniform_pressure.push_apart(case, case.parameters["weights"], case.penalty * case.parameter("penetration"))


_define = partial(
    Property.define, family="hard", quantities=FLAT_QUANTITIES, promise=promise_flat_forces, exact=exact_forces
)


@_define(
    id="hard.offset", rank=420, cases=Cases.from_list(offset_states), cases_in_space=Cases.from_list(offset_face_states)
)
def hard_offset(case: Case, subject: Subject) -> Measurement:
    """Far from the origin, with gaps of 1e-6 to 1e-9, forces are those of the stored positions.

    **Question.** A flat interface with lengths near 1 lies 1e6, 1e8 or 2^10 away from the origin, and penetrates by
    1e-6, 1e-9, or one step of the doubles. Are the forces those of the gap that the stored numbers say?

    **Why it matters.** Users work in millimetres, with coordinates of a site or of a whole machine. A kernel that
    rounds a point where it is, and then subtracts a node, loses the gap. At 1e6 and a gap of 1e-6 that costs a part in
    1e4 of the force, and nobody sees it.

    **How it is judged.** The states are flat to the last bit: upright, or turned by a Pythagorean triple, with
    coordinates of few enough bits. So the stored gap is uniform, and the forces are exact in rationals. Near 1e8 the
    stored gap is not the one that was asked for, and the stored one counts. What is asked depends on the traits: no
    force along the surface (everybody), the total (who states `penalty` and `area`), each nodal force (unless
    `patch.flat` is False). The tolerance is u(8Z/|g| + 4N + 128). Z is the diameter D of the interface for whoever
    says `translation_stable`, and the largest coordinate X for everybody else.

    **Undecided.** The case whose gap is one step of the doubles is undecided without that promise: there the tolerance
    is more than the force.
    """
    return measure_flat(case, subject)


@_define(id="hard.deep", rank=380, cases=Cases.from_list(deep_states), cases_in_space=Cases.from_list(deep_face_states))
def hard_deep(case: Case, subject: Subject) -> Measurement:
    """A penetration of half a segment or two segments gives the forces of that penetration.

    **Question.** A flat slave penetrates a flat master by half a segment, and by two segments. Are the forces those of
    the pressure ε̂ |g|?

    **Why it matters.** A first guess of Newton's method, or a large load step, often penetrates that deep. A search
    that looks at near segments only, or takes what is deep for the far side of the body, lets the bodies pass through.

    **How it is judged.** As in `hard.offset`: flat states that are exact in binary, no force along the surface, the
    total and the nodal forces as the traits promise them, with the tolerance u(8Z/|g| + 4N + 128).

    **Undecided.** Never.
    """
    return measure_flat(case, subject)


@_define(
    id="hard.node-hit",
    rank=410,
    cases=Cases.from_list(node_hit_states),
    cases_in_space=Cases.from_list(node_hit_face_states),
)
def hard_node_hit(case: Case, subject: Subject) -> Measurement:
    """A point over a master node, or beside it by one rounding, is counted once.

    **Question.** A slave node, a quarter point or the middle of a slave segment lies over a master node exactly, or one
    rounding to its left or right. So ξ is 0, 1, −u or 1 + u. Are the forces as if nothing were special there? In space
    a master node lies so under a node, an edge or the middle of a slave face, and up to 32 faces meet in either node.

    **Why it matters.** A point that belongs to both segments is counted twice by one code, and lost by another. Meshes
    of two bodies share lines more often than not, so this is the normal case.

    **How it is judged.** As in `hard.offset`: the interface is flat, so both segments give the same gap, and the exact
    forces are those of a uniform pressure. The tolerance is u(8Z/|g| + 4N + 128).

    **Undecided.** Never: whichever segment a formulation takes, the answer is the same.
    """
    return measure_flat(case, subject)


@_define(
    id="hard.search", rank=390, cases=Cases.from_list(search_states), cases_in_space=Cases.from_list(search_face_states)
)
def hard_search(case: Case, subject: Subject) -> Measurement:
    """Other surfaces nearby, sharp wedges and the seam of a closed chain do not mislead the search.

    **Question.** The slave lies on a flat part of the master. Something else is near: a node that is nearer than those
    of the right segment, the other side of a thin plate or of a sharp wedge, a second body behind the first, or the
    place where a closed chain begins. In space there are also 264 faces, numbered at random. Are the forces those of
    the flat part alone?

    **Why it matters.** These are the named failures of projection in the manuals of contact codes. A search that starts
    from the nearest node ends on the wrong side of a plate, and pulls where it should push.

    **How it is judged.** The flat part is the nearest surface, and the first that the slave's normal meets, for every
    point of the slave. So all rules agree, and the exact forces are those of a uniform pressure on it; all other nodes
    are free. What is asked, and the tolerance u(8Z/|g| + 4N + 128), are as in `hard.offset`.

    **Undecided.** Never.
    """
    return measure_flat(case, subject)


_END_SPRINGS = "Nodal springs are n + 1 for n segments, and roundoff may lose the two halves at the ends."
MOST = Quantity("your springs, over ε̂ L", "k (1 + 1/n) + u(8Z/|g| + 4N + 128)", f"k is 1 or 2 passes. {_END_SPRINGS}")
LEAST = Quantity(
    "your springs, over ε̂ L, at least",
    "k (1 − 1/n) − u(8Z/|g| + 4N + 128)",
    f"As above. {_END_SPRINGS}",
    sense="at least",
)


LARGEST_PUSH = 5.0
PUSH = Quantity(
    "largest force on a node, over ε̂ |g| of a mean segment",
    f"{LARGEST_PUSH:g} k",
    "k is 1 or 2 passes. Two segments of at most 1.5 mean segments meet at a node; dual shape functions take up to 5/3 "
    "of them.",
)


@Property.define(
    id="total-stiffness",
    rank=350,
    family="patch",
    quantities=(MOST, LEAST, PUSH),
    cases=Cases.from_list(equal_length_states),
    cases_in_space=Cases.from_list(equal_area_states),
    promise=lambda traits: True,
    asks=frozenset({"penalty"}),
)
def total_stiffness(case: Case, subject: Subject) -> Measurement:
    """The springs of a flat interface have the stiffness ε̂ L together, or 2 ε̂ L in two passes.

    **Question.** Slave and master are flat, equally long, and penetrate each other by the same depth everywhere. Is the
    force the penalty times the penetration times the length, or twice that?

    **Why it matters.** The penalty is the one number that a user gives, and an error of its factor shows in nothing but
    the penetration. Most questions about sizes are asked of those who state `penalty` and `area`. This one is asked of
    everybody, whatever is promised, so that no formulation is three times too stiff in silence.

    **How it is judged.** The number is the force that pushes the slave over ε̂ |g| L, and likewise that on the master;
    the worse of both counts. It must lie within 1/n of 1, or within 2/n of 2 where the traits leave room for springs on
    both surfaces; n is the number of slave segments, 8, 16 or 304. So a stiffness that is wrong by 0.4 % shows, and so
    does a master that gets more than the slave. The largest force on a node is that of a few mean segments, so that a
    number of a segment that overflows shows. Nodal springs of ε̂ L/n at n + 1 nodes give 1 + 1/n. A node that faces the
    end of the master exactly may be lost to roundoff, which takes no more than 1/n either. Segments have the mean
    length 1, so that it does not matter whether the unit of the penalty is stated. A factor of 2 on one pass looks like
    two passes, so the row says that the springs are 2 ε̂ L, unless the traits say `unbiased`. In space L is the area,
    and n is the number of slave nodes, 25 or 144; each has the mean area 1.

    A law that is not linear has no stiffness. The state is asked again at half the depth, and where the number changes
    by more than u(8Z/|g| + 4N + 128), it is kept as a detail and not judged.

    **Undecided.** Never.
    """
    n, traits, depth = _count_springs(case), subject.traits, case.parameter("penetration")
    away = np.zeros_like(case.positions)
    away[: case.interface.n_slave_nodes] = depth / 2 * uniform_pressure.normal_of(case)
    parameters = {**case.parameters, "penetration": np.array(depth / 2)}
    half = replace(case, z=(case.positions + away).reshape(-1), parameters=parameters)
    (springs, opposite, largest), (shallow, *_) = _springs(case, subject), _springs(half, subject)
    tolerance = gap_tolerance(half, depth / 2, rounding_distance(case, traits))
    details = {"springs over ε̂ L": springs}
    if abs(shallow - springs) > 2 * tolerance * abs(springs):
        return Measurement(details=details)
    passes = 2 if springs > np.sqrt(2) and may_act_twice(traits) else 1
    numbers = [
        MOST.check(max(springs, opposite), passes * (1 + 1 / n) + tolerance),
        LEAST.check(min(springs, opposite), passes * (1 - 1 / n) - tolerance),
        PUSH.check(largest, LARGEST_PUSH * passes),
    ]
    finding = (
        None if passes == 1 or traits.promises.unbiased else Finding(_say(springs, "two passes, or twice too stiff"))
    )
    if any(number.ratio > 1 for number in numbers):
        right = "one pass has 1 ε̂ L" + (", two passes have 2 ε̂ L" if may_act_twice(traits) else "")
        if abs(opposite - springs) > abs(springs) / n:
            right = f"the master gets {opposite:#.3g} ε̂ L; {right}"
        finding = Finding(_say(springs, right))
    return Measurement(numbers, details=details, finding=finding)


def _say(springs: float, remark: str) -> str:
    """Return a sentence about the stiffness of all springs over ε̂ L."""
    return f"your springs are {springs:#.3g} ε̂ L: {remark}"


def _springs(case: Case, subject: Subject) -> tuple[float, float, float]:
    """Return the forces that push the slave out of the master, and the master out of the slave, over ε̂ |g| L.

    The third number is the largest force on a node over that of a slave segment of mean length, or of the mean area of
    a slave node.
    """
    pushes = -uniform_pressure.uniform_state(case, subject).forces @ uniform_pressure.normal_of(case)
    size = case.penalty * case.parameter("penetration") * case.slave_measure
    slave, master = np.split(pushes / size, [case.interface.n_slave_nodes])
    largest = float(np.abs(pushes).max()) / size * _count_springs(case)
    return float(slave.sum()), -float(master.sum()), largest


def _count_springs(case: Case) -> int:
    """Return the number of slave segments, or of slave nodes in space."""
    interface = case.interface
    return len(interface.slave) if interface.dim == PLANE else interface.n_slave_nodes
