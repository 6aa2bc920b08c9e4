"""Hard states at vertices, at free ends and in touch, judged by what every right formulation fulfils there.

At a kink two right formulations may give different forces. What they have in common:

- The total force on the slave is a sum of pushes along normals that lie between those of the master segments there.
- No gap is longer than the interface, so no force is larger than the springs on that gap.
- Where `penalty` and `area` are stated, weights are positive and add up to the slave's length. So the total lies
  between the least and the largest gap times that length. A formulation that states its rule for gaps (`gap`) gets the
  bounds of a push along normals of segments. Any other gets those of any direction in between on a straight master,
  and none at a kink, since it may smooth the master there.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.interface import PLANE
from contactverif.contract.measurement import Measurement, Quantity, check_all
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.problems.flat_faces import touching_face_states
from contactverif.problems.flat_states import touching_states
from contactverif.problems.hard_corner_states import (
    concave_corner_states,
    convex_kink_states,
    free_end_states,
    steep_slave_states,
)
from contactverif_properties.shared.applicability import knows_total, may_act_twice
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.roundoff import SEGMENT_REASON, WEIGHT_REASON, WEIGHT_ROUNDINGS, ratio
from contactverif_properties.shared.uniform_pressure import normal_of, pushing_forces, uniform_state

_TOLERANCE = "u(8X/min(|g|, ℓ) + 4N + 128)"
_REASON = f"{SEGMENT_REASON} {WEIGHT_REASON}"
DIRECTION = Quantity("part outside the normals", _TOLERANCE, _REASON)
TOTAL = Quantity("total force outside its bounds", _TOLERANCE, _REASON)
TWO_PASSES = "springs act in two passes at most, on n + 1 nodes for n segments."
SIZE = Quantity("force over ε̂ D L", "4", f"No gap is longer than D; {TWO_PASSES}")


def measure_bounded(case: Case, subject: Subject, aside: float = 0.0) -> Measurement:
    """Compare the total force on the slave with the bounds of the case; all multipliers press as the typical gap.

    So much of the force may point `aside`, a force ≥ 0.
    """
    bounds = case.parameters["segment_bounds" if subject.traits.rules.gap else "bounds"] * case.penalty
    slave = pushing_forces(uniform_state(case, subject))[: case.interface.n_slave_nodes]
    total, size = slave.sum(axis=0), float(np.abs(slave).sum())
    largest = case.penalty * case.diameter * case.slave_length
    numbers, broken = [SIZE.check(size / largest, 4.0)], ""
    reach = min(case.parameter("penetration"), case.shortest_segment)
    tolerance = UNIT_ROUNDOFF * (8 * case.largest_coordinate / reach + 4 * case.n_segments + WEIGHT_ROUNDINGS)
    if bounds[1] == 0:
        broken = f"a force of {size:.2g} on a slave that faces no master" if size > 0 else ""
    else:
        outside = max(0.0, _outside(total, case.parameters["edges"]) - aside)
        numbers.append(DIRECTION.check(ratio(outside, size), tolerance))
        # A master that is smoothed through its nodes bulges at a kink, and who states no rule for gaps may do that.
        straight = bool((case.parameters["edges"][0] == case.parameters["edges"][1]).all())
        if knows_total(subject.traits) and (straight or subject.traits.rules.gap is not None):
            along = float(total @ case.parameters["axis"])
            numbers.append(TOTAL.check(max(0.0, bounds[0] - along, along - bounds[1]) / float(bounds[1]), tolerance))
    details = {"share of the upper bound": ratio(float(total @ case.parameters["axis"]), float(bounds[1]))}
    # Where the lower bound is 0, no force is as good an answer as any.
    return Measurement(numbers, broken=broken, details=details, idle=size == 0 and bounds[0] > 0)


def _outside(force: FloatArray, edges: FloatArray) -> float:
    """Return the part of a force that lies outside the directions between two edges, a force ≥ 0."""
    right, left = edges
    middle = right + left
    sideways = max(-_cross(right, force), -_cross(force, left))
    return max(0.0, sideways, -float(force @ middle) / float(np.linalg.norm(middle)))


def _cross(a: FloatArray, b: FloatArray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


_define = partial(Property.define, family="hard", quantities=(DIRECTION, TOTAL, SIZE), promise=lambda traits: True)


@_define(id="hard.convex-kink", rank=340, cases=Cases.from_list(convex_kink_states))
def hard_convex_kink(case: Case, subject: Subject) -> Measurement:
    """A slave node that passes a convex master vertex within 1e-12 feels no wild force.

    **Question.** The master is a roof with a kink of 0.1, 0.5 or 1.5 rad, and the slave is a parallel roof below it.
    Its vertex is on the bisector, or 1e-3 to 1e-12 to either side. Is the total force what the gap says, and does it
    point between the two normals?

    **Why it matters.** Where two segments are nearly equally near, one code takes neither, one takes both, and one
    averages to a direction outside the two. The sliding body then jumps or sticks at each vertex.

    **How it is judged.** The direction of a node's force may jump by the kink's angle as it crosses, since the nearest
    segment does. What every right formulation fulfils: each push is along a normal between those of the two segments,
    and each side has one gap, d cos a ∓ δ sin a (a half of the kink, d the depth straight down, δ the distance from the
    bisector). So where `penalty`, `area` and `gap` are stated, the vertical force is ε̂ L cos a times a number between
    these two gaps, on both sides of the bisector: as δ goes to 0 it is continuous. A formulation that states no rule
    for gaps may smooth the master, which then bulges at the vertex, and is asked for the direction alone. The tolerance
    is u(8X/min(|g|, ℓ) + 4N + 128).

    **Undecided.** Never: on the bisector itself the bounds allow for either segment.
    """
    return measure_bounded(case, subject)


@_define(id="hard.concave-corner", rank=310, cases=Cases.from_list(concave_corner_states))
def hard_concave_corner(case: Case, subject: Subject) -> Measurement:
    """A corner in a re-entrant corner of 90° is pushed by both faces, whichever is nearer by a rounding.

    **Question.** The corner of the slave penetrates both faces of a 90° corner of the master. Its node is equally far
    from both, or nearer to one by a rounding. Are both faces felt, and is the node counted once?

    **Why it matters.** The foot of that node lies on neither face. A code that asks for a foot inside a segment loses
    the node, and the body falls into the corner. Another one counts it twice.

    **How it is judged.** All gaps are d. Normals are along the axes, so the sum of both components of the total force
    is ε̂ d times the area that is felt: that of the parts that face a face along its normal at least, and the slave's
    length at most. No force pulls. The tolerance is u(8X/min(|g|, ℓ) + 4N + 128). Totals are asked where `penalty`,
    `area` and `gap` are stated, directions of everybody.

    **Undecided.** Never: which face takes the node is left open by the bounds.
    """
    return measure_bounded(case, subject)


@_define(id="hard.free-end", rank=430, cases=Cases.from_list(free_end_states))
def hard_free_end(case: Case, subject: Subject) -> Measurement:
    """At a free end the force is between that of the inner segments and that of all; beyond it is 0.

    **Question.** The first node of the slave is at the free end of a flat master, a rounding beside it, or up to half a
    segment past it; or the slave is wholly outside. Is the total force between that of the segments that surely face
    the master and that of all, and 0 outside?

    **Why it matters.** A body that slides off an edge passes all these states. A master that is continued past its end
    holds it in the air.

    **How it is judged.** How far past an end a point still counts is a choice, such as the option τ. The jump of the
    force as a point crosses that distance is the force of the point, so it is no more than that of its segment. Hence
    where `penalty` and `area` are stated, the total is at least ε̂ |g| times the length of the other segments, and at
    most that of the whole slave. The detail `share of the upper bound` shows the jump: compare the cases 0.0099 and
    0.0101 past the end for τ = 0.01. A slave wholly outside, by the length of a segment or more, must feel exactly
    nothing, whatever the formulation. The tolerance is u(8X/min(|g|, ℓ) + 4N + 128).

    The force points along the common normal. If forces are the derivative of an energy of what is covered, the end
    that cuts the cover is pushed along the surface by the energy there, ε̂ g²/2 for a length. That is subtracted, unless
    the trait `force_along` says that contact pushes along a normal, or `symmetric` is False.

    **Undecided.** Never: what a formulation may choose is inside the bounds.
    """
    traits, gap = subject.traits, case.parameter("penetration")
    may_have_energy = traits.rules.force_along is None and traits.promises.symmetric is not False
    return measure_bounded(case, subject, case.penalty * gap**2 / 2 if may_have_energy else 0.0)


def promise_no_wild_force(traits: Traits) -> bool | None:
    """Return None where theory has no bound: dual shapes, and multipliers of two passes.

    Dual shapes on a sliver of a segment have forces of both signs, each many times larger than their sum. Multipliers
    are set to press here, and where the second pass sees the slave's back, they would press across an open gap.
    """
    both_passes = bool(traits.promises.unbiased) and traits.rules.enforcement == "multiplier"
    return None if traits.promises.nodes_push is False or both_passes else True


@Property.define(
    id="hard.steep-slave",
    rank=360,
    family="hard",
    quantities=(DIRECTION, TOTAL, SIZE),
    promise=promise_no_wild_force,
    cases=Cases.from_list(steep_slave_states),
)
def hard_steep_slave(case: Case, subject: Subject) -> Measurement:
    """A slave segment at 89.9°, 90° or 180° to the master gives no wild force and no pull.

    **Question.** A slave segment is at 89.9°, 90° or 180° to the master that it penetrates: it stands on it, with
    either side in front, or lies in it with its back to it. Is the force finite, bounded, and no pull?

    **Why it matters.** A projected length is 0 there, and a gap along the slave's normal is infinite. Thin bodies,
    edges and corners meet their masters like that.

    **How it is judged.** A formulation may see such a segment or not. What every right formulation fulfils: all numbers
    are finite; the force points between the master's normal and the direction into the slave's body (at 180°: along the
    master's normal); it is at most ε̂ D L, since no gap is longer than the interface's diameter D. Where `penalty` and
    `area` are not stated, springs may act in two passes, and 4 ε̂ D L is allowed. Dual shapes (`nodes_push=False`),
    whose forces have both signs, and multipliers of two passes are asked, but need not pass.

    **Undecided.** Never.
    """
    return measure_bounded(case, subject)


DEPTH = 64.0  # The depth d over u X. It is eight times what a gap is rounded to, so that each has its sign.
FORCE = Quantity("force in touch", "4 (8u + |g|/X)", "A gap is rounded to 8uX, and springs act in two passes at most.")
SLIDING = Quantity(
    "stiffness along the surface",
    "64 u X/ℓ + 4(|g| + d)/ℓ",
    "Rounding the ends of a segment turns its normal by uX/ℓ. d = 64 u X is the depth of the state.",
)
PRESSING = Quantity(
    "stiffness across the surface",
    "s (1 + 30 (uX/ℓ)^(2/3))",
    "s is 1 where areas add up, else what springs on both surfaces have. Differences confirm an exact tangent.",
)
PULLING = Quantity("pull across the surface", "64 u X/ℓ + 4|g|/ℓ", "A spring resists, and never helps.")


@Property.define(
    id="hard.touch",
    rank=140,
    family="hard",
    quantities=(FORCE, SLIDING, PRESSING, PULLING),
    cases=Cases.from_list(touching_states),
    cases_in_space=Cases.from_list(touching_face_states),
    promise=lambda traits: True,
)
def hard_touch(case: Case, subject: Subject) -> Measurement:
    """Surfaces that touch, or miss each other by 1e-16, give neither a force nor a wrong stiffness.

    **Question.** Flat surfaces touch: the gap is exactly 0 at 1000 angles, or 1e-16 open or closed at 24. In space they
    do at some 160 rotations, and 17. Is the force no more than roundoff makes it, and is the tangent that of a spring
    across the surface, or of none?

    **Why it matters.** A normal that is computed as the difference of point and foot over their distance is 0/0 in
    touch, and has any direction at 1e-16. The force is tiny then, and the tangent is as wrong as can be: Newton's
    method slides the bodies.

    **How it is judged.** The first number is the largest nodal force over ε̂ h, a length, in units of the largest
    coordinate X, h the longest slave segment, and in space the slave's area: at most 4 (8u + |g|/X), since a gap is
    rounded to 8uX, and springs act in two passes at most. With an exact tangent, the slave is moved across its surface.
    It meets between no resistance (open) and that of all springs, s ε̂ L:

    - Where `penalty` and `area` are stated, the areas add up to L, so s = 1.
    - Other distributed springs may act on both surfaces, so s = 1 + L_master/L.
    - A nodal spring has the stiffness ε̂ L/n for n slave segments. So s is the number of slave nodes over n, (n + 1)/n
      for one chain. In space n counts the slave nodes. Where they are `unbiased`, the nodes of the master count too.
    - Where the unit of the penalty is not stated, ε̂ may be that of a node, and the largest of these counts.

    A tangent is exact if differences confirm it, so s is allowed to be larger by their 30 (uX/ℓ)^(2/3), as in
    `tangent.directional`. Near the origin, where the gap is ±1e-16, the slave is also moved along its surface, with the
    slave d = 64 u X deeper. No gap changes, so the derivative of a force is at most that of rounded directions,
    64 u X/ℓ + 4(|g| + d)/ℓ, over ε̂ h. At a gap of 0 there is no derivative: the columns of a complex step take the
    side of their own rounding there, each for itself. At d every gap has its sign in spite of its rounding of 8 u X,
    while a normal that is a difference over a distance still turns by u X/d = 1/64. All multipliers are 0 here.

    **Undecided.** Never: contact may be active or not, and the numbers allow for both.
    """
    state = FrozenState.with_multiplier(subject.for_case(case), case, 0.0)
    plane = case.interface.dim == PLANE
    around = float(case.interface.slave.lengths(case.positions).max()) if plane else case.slave_measure
    size, gap = case.largest_coordinate, abs(case.parameter("shift"))
    values = {FORCE: float(np.abs(state.forces).max()) / (case.penalty * around * size)}
    tolerances = {FORCE: 4 * (8 * UNIT_ROUNDOFF + gap / size)}
    if "tangent" in subject.provides and subject.traits.promises.tangent == "exact":
        n = case.interface.n_unknowns
        tangent, (ways, across) = state.tangent[:n, :n], _motions(case)
        resistance = float(across @ tangent @ across) / (case.penalty * case.slave_measure)
        values |= {PRESSING: resistance, PULLING: -resistance}
        roundoff = (64 * UNIT_ROUNDOFF * size + 4 * gap) / case.shortest_segment
        accuracy = 30 * (UNIT_ROUNDOFF * size / case.shortest_segment) ** (2 / 3)
        tolerances |= {PRESSING: _all_springs(case, subject.traits) * (1 + accuracy), PULLING: roundoff}
        if gap:
            depth = DEPTH * UNIT_ROUNDOFF * size
            z = state.case.z.copy()
            z[:n] -= depth * across
            tangent = FrozenState.at(state.formulation, replace(state.case, z=z)).tangent[:n, :n]
            sliding = max(float(np.abs(tangent @ way).max()) for way in ways)
            values[SLIDING] = sliding / (case.penalty * around)
            tolerances[SLIDING] = roundoff + 4 * depth / case.shortest_segment
    return Measurement(check_all(values, tolerances))


def _all_springs(case: Case, traits: Traits) -> float:
    """Return the stiffness of all springs that the traits allow over ε̂ L, if each of them is closed."""
    interface, rules = case.interface, traits.rules
    if knows_total(traits):
        return 1.0
    n_nodes = interface.n_nodes if may_act_twice(traits) else interface.n_slave_nodes
    nodal = n_nodes / (len(interface.slave) if interface.dim == PLANE else interface.n_slave_nodes)
    distributed = 1 + float(interface.master.measures(case.positions).sum()) / case.slave_measure
    # Without a unit the penalty ε̂ may be taken for the stiffness of a node.
    unstated = max(distributed, interface.n_nodes / case.slave_measure)
    return {"nodal": nodal, "distributed": distributed, None: unstated}[rules.penalty]


def _motions(case: Case) -> tuple[list[FloatArray], FloatArray]:
    """Return the motions (n_unknowns,) of the slave by a unit along its surfaces, in space two, and across them."""
    directions, interface = case.parameters["directions"], case.interface
    on_slave = (np.arange(interface.n_nodes) < interface.n_slave_nodes)[:, None]
    if interface.dim != PLANE:
        ways, across = [np.where(on_slave, way, 0.0) for way in directions], np.where(on_slave, normal_of(case), 0.0)
        return [way.reshape(-1) for way in ways], across.reshape(-1)
    along = directions / np.hypot(directions[:, :1], directions[:, 1:])  # Integers, whose length is near 1, are exact.
    along[interface.n_slave_nodes :] = 0.0
    across = np.column_stack([-along[:, 1], along[:, 0]])
    return [along.reshape(-1)], across.reshape(-1)
