"""Hard states with a name: far away, deep, at vertices and free ends, in touch; and hard scenes with a name, solved.

On a flat state all rules for gaps agree, so every formulation is asked something: a push out of the master, larger than
what is along it (all). Who passes the patch test, or denies it and states the total, is asked more: no force along the
surface; the total (with `penalty` and `area`); each nodal force (unless `patch.flat` is False).

At a kink two right formulations may give different forces. What they have in common:

- The total force on the slave is a sum of pushes along normals that lie between those of the master segments there.
- No gap is longer than the interface, so no force is larger than the springs on that gap.
- Where `penalty` and `area` are stated, weights are positive and add up to the slave's length. So the total lies
  between the least and the largest gap times that length. A formulation that states its rule for gaps (`gap`) gets the
  bounds of a push along normals of segments. Any other gets those of any direction in between on a straight master,
  and none at a kink, since it may smooth the master there.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray
from contactverif.contract.case import Case, Cases
from contactverif.contract.interface import PLANE
from contactverif.contract.property import CheckedNumber, Measure, Measurement, Property, Quantity, check_all
from contactverif.contract.subject import SOLVE, EngineSubject, Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import solve_by_engine
from contactverif.mechanics.linear import RANK_ROUNDOFF, scale_factors
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import Scene, has_bodies, scene_of
from contactverif.mechanics.system import System
from contactverif.problems import block_scenes, flat_states, hard_corner_states, space_scenes
from contactverif.problems.blocks import pressure_of
from contactverif.problems.open_states import activation_distance
from contactverif.problems.uniform_stress import CONDITION_TOLERANCE, condition_tolerance
from contactverif.strategies.beside import beside_cases
from contactverif_properties import applicability, exact_forces, patch_solved, roundoff
from contactverif_properties.newton_method import end_details
from contactverif_properties.states import FrozenState

FLAT_TOTAL = roundoff.stated_gap_quantity("error of the total force")
FLAT_NODAL = roundoff.stated_gap_quantity("error of a nodal force")
ALONG = replace(
    FLAT_TOTAL, name="force along the surface", reason=f"{FLAT_TOTAL.reason} A flat surface pushes across itself alone."
)
FLAT_QUANTITIES = (ALONG, FLAT_TOTAL, FLAT_NODAL)
VACUOUS = "the gap is smaller than the rounding of positions that far from the origin"


def measure_flat(case: Case, subject: Subject) -> Measurement:
    """Compare the forces of a uniform penetration with what is known about them."""
    penetration, traits, in_plane = case.parameter("penetration"), subject.traits, case.interface.dim == PLANE
    tolerance = roundoff.gap_tolerance(case, penetration, roundoff.rounding_distance(case, traits))
    if tolerance >= 1:
        return Measurement(undecided=VACUOUS)
    exact = flat_forces(case)
    slave = exact_forces.pushing_forces(exact_forces.uniform_state(case, subject))[: case.interface.n_slave_nodes]
    # In space the force along the surface has two components.
    tangents = case.parameters["direction" if in_plane else "directions"]
    along = float(np.hypot.reduce(np.abs(np.atleast_1d((slave @ tangents.T).sum(axis=0)))))
    push = float((slave @ exact_forces.normal_of(case)).sum())
    broken, finding = "" if push > along else "nothing pushes the slave out of the master", None
    passes = traits.promises.patch.flat
    # A smoothed master, for one, bulges beside an edge.
    if not (applicability.knows_total(traits) if passes is False else passes):
        return Measurement(broken=broken)
    numbers = [ALONG.check(roundoff.ratio(along, float(np.abs(slave).sum())), tolerance)]
    whole = float(np.linalg.norm(exact[: len(slave)].sum(axis=0)))
    if applicability.knows_total(traits):
        numbers.append(FLAT_TOTAL.check(abs(push / whole - 1), tolerance))
    if passes is not False:
        forces, largest = exact_forces.forces_of_gap(case, subject, exact)
        error = float(np.linalg.norm(forces - exact, axis=1).max())
        numbers.append(FLAT_NODAL.check(error / whole, tolerance * largest))
        finding = exact_forces.worst_force(case.interface, forces, exact) if numbers[-1].ratio > 1 else None
    return Measurement(numbers, broken=broken, finding=finding)


def flat_forces(case: Case) -> FloatArray:
    """Return the exact forces (n_nodes, dim) of the pressure ε̂ |g| that push the nodes of a flat state."""
    if "weights" not in case.parameters:  # There is no other surface than the flat one.
        return exact_forces.forces_of_penetration(case)
    return exact_forces.push_apart(case, case.parameters["weights"], case.penalty * case.parameter("penetration"))


_States = Callable[[], tuple[Case, ...]]


def _define_flat(*, id: str, rank: int, plane: _States, space: _States) -> Callable[[Measure], Property]:
    return Property.define(
        id=id,
        rank=rank,
        quantities=FLAT_QUANTITIES,
        role="exact",
        cases=Cases.from_list(plane),
        cases_in_space=Cases.from_list(space),
        exact=flat_forces,
    )


@_define_flat(id="hard.offset", rank=420, plane=flat_states.offset_states, space=flat_states.offset_face_states)
def hard_offset(case: Case, subject: Subject) -> Measurement:
    """Far from the origin, with gaps of 1e-6 to 1e-9, forces are those of the stored positions.

    **Question.** A flat interface with lengths near 1 lies 1e6, 1e8 or 2^10 away from the origin, and penetrates by
    1e-6, 1e-9, or one step of the doubles. Are the forces those of the gap that the stored numbers say?

    **Why it matters.** Users work in millimetres, with coordinates of a site or of a whole machine. A kernel that
    rounds a point where it is, and then subtracts a node, loses the gap. At 1e6 and a gap of 1e-6 that costs a part in
    1e4 of the force, and nobody sees it.

    **How it is judged.** The states are flat to the last bit: upright, or turned by a Pythagorean triple, with
    coordinates of few enough bits. So the stored gap is uniform, and the forces are exact in rationals. Near 1e8 the
    stored gap is not the one that was asked for, and the stored one counts. What is asked depends on the traits.
    Everybody pushes the slave out of the master, and more than along it. Who promises `patch.flat`, or denies it and
    states `penalty` and `area`, has no force along the surface, the total (with these two), and each nodal force
    (unless `patch.flat` is False). The tolerance is u(8Z/|g| + 4N + 128). Z is the diameter D of the interface for
    whoever says `translation_stable`, and the largest coordinate X for everybody else.

    **Undecided.** The case whose gap is one step of the doubles is undecided without that promise: there the tolerance
    is more than the force.
    """
    return measure_flat(case, subject)


@_define_flat(id="hard.deep", rank=405, plane=flat_states.deep_states, space=flat_states.deep_face_states)
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


@_define_flat(id="hard.node-hit", rank=410, plane=flat_states.node_hit_states, space=flat_states.node_hit_face_states)
def hard_node_hit(case: Case, subject: Subject) -> Measurement:
    """A point over a master node, or beside it by one rounding, is counted once.

    **Question.** A slave node, a quarter point or the middle of a slave segment lies over a master node exactly, or one
    rounding to its left or right. So ξ is 0, 1, −u or 1 + u. Or it lies 2^-49, 2^-48, … 2^-3 of a segment beside it, so
    that two segments overlap on a strip as narrow. Are the forces as if nothing were special there? In space a master
    node lies so under a node, an edge or the middle of a slave face, and up to 32 faces meet in either node.

    **Why it matters.** A point that belongs to both segments is counted twice by one code, and lost by another; a strip
    is below the tolerance of a third. Meshes of two bodies share lines more often than not, so this is the normal case.

    **How it is judged.** As in `hard.offset`: the interface is flat, so both segments give the same gap, and the exact
    forces are those of a uniform pressure. The tolerance is u(8Z/|g| + 4N + 128).

    **Undecided.** Never: whichever segment a formulation takes, the answer is the same.
    """
    return measure_flat(case, subject)


@_define_flat(id="hard.search", rank=390, plane=flat_states.search_states, space=flat_states.search_face_states)
def hard_search(case: Case, subject: Subject) -> Measurement:
    """Other surfaces nearby, sharp wedges and the seam of a closed chain do not mislead the search.

    **Question.** The slave lies on a flat part of the master. Something else is near: a node that is nearer than those
    of the right segment, the other side of a thin plate or of a sharp wedge, a second body behind the first, the place
    where a closed chain begins, or the other sides of a hole, numbered from each of its nodes. In space there are also
    264 or 4050 triangles, numbered at random. Are the forces those of the flat part alone?

    **Why it matters.** These are the named failures of projection in the manuals of contact codes. A search that starts
    from the nearest node ends on the wrong side of a plate, and pulls where it should push. A hole is walked clockwise;
    who takes each closed chain for a disc finds nothing there.

    **How it is judged.** The flat part is the nearest surface, and the first that the slave's normal meets, for every
    point of the slave. So all rules agree, and the exact forces are those of a uniform pressure on it; all other nodes
    are free. What is asked, and the tolerance u(8Z/|g| + 4N + 128), are as in `hard.offset`.

    **Undecided.** Never.
    """
    return measure_flat(case, subject)


_TOLERANCE = "u(8X/min(|g|, ℓ) + 4N + 128)"
_REASON = f"{roundoff.SEGMENT_REASON} {roundoff.WEIGHT_REASON}"
DIRECTION = Quantity("part outside the normals", _TOLERANCE, _REASON)
TOTAL = Quantity("total force outside its bounds", _TOLERANCE, _REASON)
TWO_PASSES = "springs act in two passes at most, on n + 1 nodes for n segments."
SIZE = Quantity("force over ε̂ D L", "4", f"No gap is longer than D; {TWO_PASSES}")


def _measure_bounded(case: Case, subject: Subject, aside: float = 0.0) -> Measurement:
    """Compare the total force on the slave with the bounds of the case; all multipliers press as the typical gap.

    Where a case says which slave nodes lie beside the master, the forces on these count.
    """
    traits, edges = subject.traits, case.parameters["edges"]
    bounds = case.parameters["segment_bounds" if traits.rules.gap else "bounds"] * case.penalty
    state, n_slave = exact_forces.uniform_state(case, subject), case.interface.n_slave_nodes
    beside = case.parameters.get("beside", np.ones(n_slave)) > 0
    slave = exact_forces.pushing_forces(state)[:n_slave][beside]
    total, size = slave.sum(axis=0), float(np.abs(slave).sum())
    along = float(total @ case.parameters["axis"])
    numbers, broken = [], ""
    if case.interface.dim == PLANE:  # In space nodal springs of two passes have no such bound.
        numbers.append(SIZE.check(size / (case.penalty * case.diameter * case.slave_length), 4.0))
    tolerance = roundoff.gap_tolerance(case, min(case.parameter("penetration"), case.shortest_segment))
    if bounds[1] == 0 and size > 0:
        broken = f"a force of {size:.2g} on a slave that faces no master"
    elif bounds[1] == 0:
        broken = _find_stiffness(state, beside, traits)
    else:
        outside = max(0.0, _outside(total, edges) - aside)
        numbers.append(DIRECTION.check(roundoff.ratio(outside, size), tolerance))
        # A master that is smoothed through its nodes bulges at a kink, and who states no rule for gaps may do that.
        if applicability.knows_total(traits) and ((edges[0] == edges[1]).all() or traits.rules.gap is not None):
            numbers.append(TOTAL.check(max(0.0, bounds[0] - along, along - bounds[1]) / float(bounds[1]), tolerance))
    details = {"share of the upper bound": roundoff.ratio(along, float(bounds[1]))}
    # Where the lower bound is 0, no force is as good an answer as any.
    return Measurement(numbers, broken=broken, details=details, idle=size == 0 and bounds[0] > 0)


def _find_stiffness(state: FrozenState, beside: BoolArray, traits: Traits) -> str:
    """Return what an exact tangent holds of slave nodes (n_slave_nodes,) that face nothing, or an empty string.

    All that a formulation has is asked: nothing may be paired here, which a kernel may not expect.
    """
    _ = state.has_points and state.points
    if "tangent" not in state.formulation.provides:
        return ""
    rows = np.flatnonzero(np.repeat(beside, state.case.interface.dim))
    stiff = state.tangent[rows, : state.case.interface.n_unknowns].any()
    return "a stiffness of a slave that faces no master" if stiff and traits.promises.tangent == "exact" else ""


def _outside(force: FloatArray, edges: FloatArray) -> float:
    """Return the part of a force that lies outside the directions between two edges, in space one; a force ≥ 0."""
    right, left = edges
    if len(force) != PLANE:
        return max(exact_forces.distance_from_line(force, right), -float(force @ right))
    middle = right + left
    past_right, past_left = (float(a[0] * b[1] - a[1] * b[0]) for a, b in ((right, force), (force, left)))
    return max(0.0, max(-past_right, -past_left), -float(force @ middle) / float(np.linalg.norm(middle)))


_define_bounded = partial(Property.define, quantities=(DIRECTION, TOTAL, SIZE))


@_define_bounded(
    id="hard.convex-kink",
    rank=340,
    cases=Cases.from_list(hard_corner_states.convex_kink_states),
    linear=applicability.LINEAR_FORCES,
)
def hard_convex_kink(case: Case, subject: Subject) -> Measurement:
    """A slave node that passes a convex master vertex within 1e-12 feels no wild force.

    **Question.** The master is a roof with a kink of 0.1, 0.5 or 1.5 rad, and the slave is a parallel roof below it.
    Its vertex is on the bisector, or 1e-13 to 0.03 to either side. Is the total force what the gap says, and does it
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
    return _measure_bounded(case, subject)


@_define_bounded(id="hard.concave-corner", rank=310, cases=Cases.from_list(hard_corner_states.concave_corner_states))
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
    return _measure_bounded(case, subject)


@_define_bounded(
    id="hard.free-end",
    rank=430,
    cases=Cases.from_list(hard_corner_states.free_end_states),
    cases_in_space=Cases.random(beside_cases),
)
def hard_free_end(case: Case, subject: Subject) -> Measurement:
    """At a free end the force is between that of the inner segments and that of all; beyond it is 0.

    **Question.** The first node of the slave is at the free end of a flat master, a rounding beside it, or up to half a
    segment past it; or all of the slave is outside, wholly or but for 2^-49 to 2^-4 of a segment. Is the total force
    between that of the segments that surely face the master and that of all, and 0 outside? In space slave faces lie
    wholly beside an edge or a corner of the master, 1e-12 to 2000 of its longest edges away, alone or with another face
    in contact.

    **Why it matters.** A body that slides off an edge passes all these states. A master that is continued past its end
    holds it in the air.

    **How it is judged.** How far past an end a point still counts is a choice, such as the option τ. As a point crosses
    that distance, the force jumps by no more than that of its segment. Hence where `penalty` and `area` are stated, the
    total is at least ε̂ |g| times the length of the other segments, and at most that of the whole slave. The detail
    `share of the upper bound` shows the jump: compare the cases 0.0099 and 0.0101 past the end for τ = 0.01. A slave
    wholly outside, by the length of a segment or more, must feel exactly nothing, whatever the formulation. In space
    that holds from the longest edge of the master on, and nearer the force is no pull, and at most that of the faces
    beside. Where nothing faces the master, an exact tangent has no entry either, and contact points are asked for: a
    kernel may not expect that it pairs nothing. The tolerance is u(8X/min(|g|, ℓ) + 4N + 128), in space with D d/h
    added to X.

    The force points along the common normal. If forces are the derivative of an energy of what is covered, the end that
    cuts the cover is pushed along the surface by the energy there, ε̂ g²/2 for a length, and of a law of its own at
    most ε̂ |g| (|g| + d) if it begins at a gap d. That is subtracted, unless the trait `force_along` says that contact
    pushes along a normal, or `symmetric` is False.

    **Undecided.** Never: what a formulation may choose is inside the bounds.
    """
    traits, gap = subject.traits, case.parameter("penetration")
    may_have_energy = traits.rules.force_along is None and traits.promises.symmetric is not False
    deepest = gap + activation_distance(case.interface, traits)
    energy = case.penalty * gap * (deepest if traits.rules.own_law else gap / 2)
    return _measure_bounded(case, subject, energy if may_have_energy else 0.0)


def _promise_no_wild_force(traits: Traits) -> bool | None:
    """Return None where theory has no bound: dual shapes, and multipliers of two passes.

    Dual shapes on a sliver of a segment have forces of both signs, each many times larger than their sum. Multipliers
    are set to press here, and where the second pass sees the slave's back, they would press across an open gap.
    """
    both_passes = bool(traits.promises.unbiased) and traits.rules.enforcement == "multiplier"
    return None if traits.promises.nodes_push is False or both_passes else True


@_define_bounded(
    id="hard.steep-slave",
    rank=360,
    promise=_promise_no_wild_force,
    linear=applicability.LINEAR_FORCES,
    cases=Cases.from_list(hard_corner_states.steep_slave_states),
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
    return _measure_bounded(case, subject)


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
    role="comparison",  # Springs of a wrong size fail here, too, and an exact answer says more of them.
    quantities=(FORCE, SLIDING, PRESSING, PULLING),
    promise=applicability.law_is_linear,
    linear=applicability.LINEAR_BEGINNING,
    cases=Cases.from_list(flat_states.touching_states),
    cases_in_space=Cases.from_list(flat_states.touching_face_states),
)
def hard_touch(case: Case, subject: Subject) -> Measurement:
    """Surfaces that touch, or miss each other by 1e-16, give neither a force nor a wrong stiffness.

    **Question.** Flat surfaces touch: the gap is exactly 0 at 1000 angles, or 1e-16 open or closed at 24. In space they
    do at some 160 rotations, and 17; quadrilaterals at 40, and 5. Is the force no more than roundoff makes it, and is
    the tangent that of a spring across the surface, or of none?

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
        rounding = (64 * UNIT_ROUNDOFF * size + 4 * gap) / case.shortest_segment
        accuracy = 30 * (UNIT_ROUNDOFF * size / case.shortest_segment) ** (2 / 3)
        tolerances |= {PRESSING: _all_springs(case, subject.traits) * (1 + accuracy), PULLING: rounding}
        if gap:
            depth = DEPTH * UNIT_ROUNDOFF * size
            z = state.case.z.copy()
            z[:n] -= depth * across
            tangent = FrozenState.at(state.formulation, replace(state.case, z=z)).tangent[:n, :n]
            sliding = max(float(np.abs(tangent @ way).max()) for way in ways)
            values[SLIDING] = sliding / (case.penalty * around)
            tolerances[SLIDING] = rounding + 4 * depth / case.shortest_segment
    return Measurement(check_all(values, tolerances)).after("pressed in by 64 u X", SLIDING)


def _all_springs(case: Case, traits: Traits) -> float:
    """Return the stiffness of all springs that the traits allow over ε̂ L, if each of them is closed."""
    interface, rules = case.interface, traits.rules
    if applicability.knows_total(traits):
        return 1.0
    n_nodes = interface.n_nodes if applicability.may_act_twice(traits) else interface.n_slave_nodes
    nodal = n_nodes / (len(interface.slave) if interface.dim == PLANE else interface.n_slave_nodes)
    distributed = 1 + float(interface.master.measures(case.positions).sum()) / case.slave_measure
    # Without a unit the penalty ε̂ may be taken for the stiffness of a node.
    unstated = max(distributed, interface.n_nodes / case.slave_measure)
    return {"nodal": nodal, "distributed": distributed, None: unstated}[rules.penalty]


def _motions(case: Case) -> tuple[list[FloatArray], FloatArray]:
    """Return the motions (n_unknowns,) of the slave by a unit along its surfaces, in space two, and across them."""
    directions, interface = case.parameters["directions"], case.interface
    on_slave = (np.arange(interface.n_nodes) < interface.n_slave_nodes)[:, None]
    if interface.dim == PLANE:
        along = directions / np.hypot(directions[:, :1], directions[:, 1:])  # Integers of length near 1 are exact.
        motions = [along, np.column_stack([-along[:, 1], along[:, 0]])]
    else:
        motions = [*directions, exact_forces.normal_of(case)]
    *ways, across = (np.where(on_slave, motion, 0.0).reshape(-1) for motion in motions)
    return ways, across


def _measure_patch(case: Case, subject: Subject) -> Measurement:
    if not has_bodies(case):
        return measure_flat(case, subject)
    measurement, promises = patch_solved.measure_once(case, subject), subject.traits.promises
    if promises.patch.flat and promises.independent_multipliers is False:
        # Newton's method may release a redundant multiplier, and others carry its force: another solution.
        return replace(measurement, undecided="the multipliers are not independent, so the forces are not unique")
    return measurement


_define_solved = partial(Property.define, bodies=True)
_define_patch = partial(
    _define_solved,
    quantities=(*FLAT_QUANTITIES, *patch_solved.QUANTITIES, patch_solved.MULTIPLIERS),
    promise=lambda traits: True if traits.promises.patch.flat else None,  # Which of the cases would fail is not stated.
    exact=lambda case: patch_solved.forces_to_draw(case) if has_bodies(case) else flat_forces(case),
)


@_define_patch(id="hard.c", rank=670, cases=Cases.from_list(block_scenes.case_c))
def hard_c(case: Case, subject: Subject) -> Measurement:
    """Cases C and C′ of the reference paper give the exact forces as states, and the exact stress solved.

    **Question.** Two slave segments of 2 and two of 4 lie on four master segments of 3. One area of competence covers
    two master segments, and its virtual slave node is exactly on a master node (C), or beside it (C′). Are the forces
    of a uniform penetration exact, and is the stress of two blocks under a uniform pressure?

    **Why it matters.** It is the smallest mesh on which VTS-ME and its relatives fail the patch test, and the one by
    which the paper shows that VTS-PPT passes. In C roundoff decides between two segments in every iteration of Newton's
    method.

    **How it is judged.** The states have the paper's forces, in rationals, and are judged as in `hard.offset`. The
    scenes have a master three times as stiff, and ε̂ = E and 1e4 E; they are judged as in `patch.flat.solve`, with its
    tolerances. The promise is `patch.flat`.

    **Undecided.** Never: on a flat interface both partners of the kink give the same gap.
    """
    return _measure_patch(case, subject)


@_define_patch(
    id="hard.contrast",
    rank=650,
    cases=Cases.from_list(block_scenes.contrast_scenes),
    cases_in_space=Cases.from_list(space_scenes.contrast_space_scenes),
    engines=True,
)
def hard_contrast(case: Case, subject: Subject) -> Measurement:
    """A uniform pressure stays uniform for any contrast of stiffness and mesh, whichever body is the slave.

    **Question.** A block with 8 segments lies on one with 2. Either is the slave, and either is softer by 1e6, or they
    are equally stiff. Is the stress of a uniform pressure exact at 10 E/h and at 1e5 E/h?

    **Why it matters.** Manuals tell users to take the softer or the finer body as the slave, and warn of locking
    otherwise. A formulation that passes the patch test must pass it for every choice.

    **How it is judged.** As in `patch.flat.solve`, with its tolerances. The promise is `patch.flat`. Whether
    pressures that vary lock is another question, which this one does not answer.

    **Undecided.** Never.
    """
    return _measure_patch(case, subject)


@_define_patch(
    id="hard.short-segment",
    rank=640,
    cases=Cases.from_list(lambda: flat_states.tiny_segment_states() + block_scenes.tiny_segment_scenes()),
)
def hard_short_segment(case: Case, subject: Subject) -> Measurement:
    """One segment of 1.2e-5 in an interface of 12 changes nothing, at ε̂ = 1, 1e4 and 1e8.

    **Question.** An interface of length 12 has a segment of 1.2e-5 on the slave, on the master, on both facing each
    other, or at the end. Are forces and stresses still those of a uniform pressure, at ε̂ = 1, 1e4 and 1e8?

    **Why it matters.** Meshes that were cut or merged have slivers. A formulation fails there if it divides by a
    length, or compares it with an absolute number.

    **How it is judged.** As states, with the penalties as they are: as in `hard.offset`. Solved, with E = 1 in both
    blocks: as in `patch.flat.solve`, whose tolerances have the term 5e-15/r for the ratio r = 4e-6 of the shortest to
    the longest segment. The promise is `patch.flat`.

    **Undecided.** A scene that fails is undecided for multipliers that are not independent: Newton's method may release
    one that is redundant on the tiny segment, and others carry its force.
    """
    return _measure_patch(case, subject)


@_define_patch(
    id="hard.stiff",
    rank=630,
    cases=Cases.from_list(block_scenes.stiff_scenes),
    cases_in_space=Cases.from_list(space_scenes.stiff_space_scenes),
    engines=True,
)
def hard_stiff(case: Case, subject: Subject) -> Measurement:
    """Springs of ε̂h/E = 1e10 on bodies whose stiffness differs by 1e6 leave a uniform pressure uniform.

    **Question.** The penalty is 1e4 or 1e10 E/h, E that of the softer body, and E of the master is 1e-6, 1 or 1e6 times
    that of the slave. Is the stress of a uniform pressure still as exact as the condition of the matrix allows?

    **Why it matters.** Users raise the penalty until the penetration is small, and press rubber on steel. A tangent
    that subtracts large numbers, or a pressure that is computed from a gap near roundoff, then gives noise in place of
    stress.

    **How it is judged.** As in `patch.flat.solve`. Its tolerances contain the condition κ of the matrix and the
    rounding X ε̂/p of gaps, so they are wide at 1e10: up to 1 part in 10 for pressures. What is asked there is that
    nothing is worse than conditioning, that Newton's method comes near a solution, and that all numbers are finite. The
    promise is `patch.flat`.

    **Undecided.** Never.
    """
    return _measure_patch(case, subject)


POINTWISE = (patch_solved.GAP.name, patch_solved.PRESSURE.name)


def _divide_by_share(quantity: Quantity) -> Quantity:
    term = " + 64 u X ε̂/(p s)" if quantity.name in POINTWISE else ""
    tolerance = f"{quantity.tolerance}{term}; with multipliers X/s in place of X"
    reason = "s is the share of the slave segment that the master covers, by which roundoff of its gap grows."
    return replace(quantity, tolerance=tolerance, reason=f"{quantity.reason} {reason}")


@_define_solved(
    id="hard.dead-zone",
    rank=600,
    quantities=tuple(map(_divide_by_share, patch_solved.patch_dead_zone.quantities)),
    cases=Cases.from_list(block_scenes.vanishing_overlap_scenes),
    cases_in_space=Cases.from_list(space_scenes.vanishing_space_scenes),
    promise=lambda traits: True if traits.promises.patch.overhang else None,
    exact=patch_solved.forces_to_draw,
    engines=True,
)
def hard_dead_zone(case: Case, subject: Subject) -> Measurement:
    """A uniform pressure stays exact where the master covers 1e-1 to 1e-12 of a slave segment.

    **Question.** The master ends inside a slave segment, of which it covers 1e-1 to 1e-12. Is the stress of a uniform
    pressure exact?

    **Why it matters.** As a body slides off an edge, every such share occurs. A nodal gap is then an integral over the
    share, divided by another one. A multiplier has next to nothing to act on, and the matrix loses rank.

    **How it is judged.** As in `patch.dead-zone`, and promised by the same trait, `patch.overhang`. Where the master
    covers a share s of a segment, roundoff of a gap there grows by 1/s. So what is measured at single points (gaps and
    pressures) has the rounding term 64 u X ε̂/(p s) more, and with multipliers all that is measured has X/s in place of
    X: a force that no gap holds is known no better. Details say what the matrix of the exact solution is like: its
    reciprocal condition, with multipliers scaled to the bodies, and how many of its singular values are 0 to roundoff.
    Nobody promises anything about these two. A rank that falls by one is what an overlap of 0 means for a method with
    multipliers.

    **Undecided.** Never.
    """
    measurement = patch_solved.patch_dead_zone.measure(case, subject)
    if isinstance(subject, EngineSubject):  # It states how accurate it is, and has no matrix.
        return measurement
    rounding = 64 * UNIT_ROUNDOFF * case.largest_coordinate * case.penalty / pressure_of(case, case.penalty)
    more = rounding / covered_share(case)
    if subject.traits.rules.enforcement == "multiplier":  # All tolerances are multiples of that of the stress.
        growth = 1 + more / measurement.tolerances[patch_solved.STRESS.name]
        tolerances = [growth * number.tolerance for number in measurement.numbers]
    else:
        tolerances = [
            number.tolerance + (more if number.quantity.name in POINTWISE else 0.0) for number in measurement.numbers
        ]
    numbers = [replace(each, tolerance=new) for each, new in zip(measurement.numbers, tolerances, strict=True)]
    # What the matrix of the exact solution is like.
    scene, formulation = scene_of(case), subject.for_case(case)
    system = System(scene, formulation, use_tangent=False)
    u = patch_solved.exact_solution(scene, case, subject, formulation)
    matrix = system.matrix(u, system.pair(u))[0]
    rows, columns = scale_factors(matrix, scene.n_free)
    sizes = linalg.svdvals(rows[:, None] * matrix * columns)
    floor = RANK_ROUNDOFF * len(sizes) * UNIT_ROUNDOFF * sizes[0]
    rank = {"reciprocal condition": float(sizes[-1] / sizes[0]), "lack of rank": float((sizes <= floor).sum())}
    return replace(measurement, numbers=numbers, details={**measurement.details, **rank})


def covered_share(case: Case) -> float:
    """Return the least share of a slave segment that the master covers, of those of which it covers something."""
    if case.interface.dim != PLANE:
        return case.parameter("share")
    slave, master = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    ends = np.sort(slave[case.interface.slave.segments], axis=1)
    covered = np.minimum(ends[:, 1], master.max()) - np.maximum(ends[:, 0], master.min())
    shares = covered / (ends[:, 1] - ends[:, 0])
    return float(shares[shares > 0].min())


ITERATIONS = 10  # From touch, Newton's method ends at once or wanders; then rest itself is judged.
NO_STRESS = Quantity(
    "stress without a load",
    f"({CONDITION_TOLERANCE}) S/ℓ + 64 u (X/ℓ)(1 + ε̂ ℓ/E)",
    "Displacements and gaps are rounded like coordinates X, which strains the shortest segment ℓ. "
    "The step from a start that is S away is solved as exactly as the condition of the matrix allows.",
)
NO_FORCE = replace(NO_STRESS, name="force without a load")


def _check_unloaded(
    quantities: tuple[Quantity, Quantity], case: Case, scene: Scene, q: FloatArray, forces: FloatArray, error: float
) -> tuple[CheckedNumber, ...]:
    """Judge the largest stress at q (n_free,) over E, and force over E H; displacements may be wrong by `error`."""
    young, shortest = max(body.young for body in scene.bodies), case.shortest_segment
    height = float(np.ptp(scene.bodies[0].nodes, axis=0).max())
    stress = max(float(np.abs(part).max(initial=0.0)) for part in scene.stresses(q))
    tolerance = 64 * UNIT_ROUNDOFF * case.largest_coordinate / shortest * (1 + case.penalty * shortest / young)
    sizes = stress / young, float(np.abs(forces).max()) / (young * height)
    return check_all(dict(zip(quantities, sizes, strict=True)), tolerance + error / shortest)


@_define_solved(
    id="hard.zero-load",
    rank=690,
    quantities=(NO_STRESS, NO_FORCE),
    cases=Cases.from_list(block_scenes.unloaded_scenes),
    cases_in_space=Cases.from_list(space_scenes.unloaded_space_scenes),
    promise=applicability.law_is_linear,
    linear=applicability.LINEAR_BEGINNING,
    applicable=applicability.refuse_dependent_multipliers,
)
def hard_zero_load(case: Case, subject: Subject) -> Measurement:
    """Two bodies that touch without a load stay without stress, wherever Newton's method starts.

    **Question.** Two blocks touch each other and carry no load. They start in touch, pushed into each other, or lifted.
    Does Newton's method end in a state without stress, and is rest in touch a solution?

    **Why it matters.** Every assembly begins like this: gap zero, force zero. The active set hangs on the sign of a gap
    of 1e-16 there. A normal that is computed as a difference over a distance is 0/0.

    **How it is judged.** Without a load the exact answer is no stress, wherever the upper block rests. The first number
    is the largest stress over E of the stiffer body, the second the largest contact force over E H. Both are at most 64
    u (X/ℓ)(1 + ε̂ ℓ/E), since displacements and gaps are rounded like coordinates X on the shortest segment ℓ, and what
    the condition of the matrix leaves of a start that is S away. The iterate with the least residual counts: against
    terms that all vanish, no residual is small. Where Newton's method does not end by itself, as in touch it may not,
    the state of rest itself is judged: nothing is strained there, so the formulation must give no force.

    **Undecided.** Never.
    """
    scene, formulation = scene_of(case), subject.for_case(case)
    trace = solve(scene, formulation, iterations=ITERATIONS, use_tangent=False, solution_only=True)
    u = trace.u[int(np.argmin(trace.residuals))] if trace.converged else np.zeros(trace.u.shape[1])
    q = u[: scene.n_free]
    end = replace(case, z=scene.positions(q)).with_multipliers(u[scene.n_free :])
    forces = FrozenState.at(formulation, end).forces
    error = condition_tolerance(scene, case.penalty) * float(np.abs(scene.start).max())
    numbers = _check_unloaded((NO_STRESS, NO_FORCE), case, scene, q, forces, error)
    return Measurement(numbers, details=end_details(trace))


_define_for_codes = partial(Property.define, needs=frozenset({SOLVE}), bodies=True)
_define_patch_for_codes = partial(
    _define_for_codes,
    quantities=(*patch_solved.QUANTITIES, patch_solved.MULTIPLIERS),
    promise=lambda traits: True if traits.promises.patch.flat else None,
    exact=patch_solved.forces_to_draw,
)


@_define_patch_for_codes(id="engine.c", cases=Cases.from_list(lambda: tuple(filter(has_bodies, block_scenes.case_c()))))
def engine_c(case: Case, subject: Subject) -> Measurement:
    """Cases C and C′ of the reference paper give the exact stress.

    **Question.** The scenes of `hard.c`: two slave segments of 2 and two of 4 on four master segments of 3. Is the
    stress of a uniform pressure exact?

    **Why it matters.** It is the smallest mesh on which many methods fail the patch test.

    **How it is judged.** As in `patch.flat.solve`.

    **Undecided.** Where the code finds no solution.
    """
    return patch_solved.measure_once(case, subject)


@_define_patch_for_codes(id="engine.short-segment", cases=Cases.from_list(block_scenes.tiny_segment_scenes))
def engine_short_segment(case: Case, subject: Subject) -> Measurement:
    """One segment of 1.2e-5 in an interface of 12 changes nothing, at ε̂ = 1, 1e4 and 1e8.

    **Question.** The scenes of `hard.short-segment`. Are stress and forces still those of a uniform pressure?

    **Why it matters.** Meshes that were cut or merged have slivers.

    **How it is judged.** As in `patch.flat.solve`. A displacement that is wrong by a U strains the tiny segment, so
    that the tolerance of a code with few digits is wide.

    **Undecided.** Where the code finds no solution.
    """
    return patch_solved.measure_once(case, subject)


CODE_TERMS = "64 u (X/ℓ)(1 + ε̂ ℓ/E) + 1e-12 κ S/ℓ + a S/ℓ"
CODE_REASON = "Displacements are rounded like coordinates X, and wrong by a S where the bodies move by S."
CODE_STRESS, CODE_FORCE = (Quantity(f"{name} without a load", CODE_TERMS, CODE_REASON) for name in ("stress", "force"))


@_define_for_codes(
    id="engine.zero-load",
    quantities=(CODE_STRESS, CODE_FORCE),
    # A body that nothing holds would be free to move.
    cases=Cases.from_list(lambda: tuple(case for case in block_scenes.unloaded_scenes() if case.name[:4] == "held")),
)
def engine_zero_load(case: Case, subject: Subject) -> Measurement:
    """Two bodies that touch without a load stay without stress.

    **Question.** The scenes of `hard.zero-load` in which both bodies are held: two blocks touch and carry no load. Is
    there no stress and no force?

    **Why it matters.** Every assembly begins like this. A test of convergence that is relative to the load divides 0 by
    0, and a normal that is a difference over a distance is 0/0.

    **How it is judged.** The first number is the largest stress over E of the stiffer body, the second the largest
    force over E H. The tolerance is that of `hard.zero-load`, and a S/ℓ more: S is how far the start lies from touch,
    or how far the bodies moved.

    **Undecided.** Where the code finds no solution.
    """
    assert isinstance(subject, EngineSubject)
    scene = scene_of(case)
    solution, _ = solve_by_engine(scene, subject)
    if solution.no_solution:
        return Measurement(undecided=solution.no_solution)
    q = np.asarray(scene.transformation.T @ solution.displacements.reshape(-1))
    moved = max(float(np.abs(scene.start).max()), float(np.abs(solution.displacements).max()))
    error = (condition_tolerance(scene, case.penalty) + subject.engine_traits.accuracy) * moved
    return Measurement(_check_unloaded((CODE_STRESS, CODE_FORCE), case, scene, q, solution.forces, error))
