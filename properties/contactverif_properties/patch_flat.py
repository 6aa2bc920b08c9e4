"""The patch test on the interface alone: flat surfaces that penetrate uniformly, and straight slaves that are tilted.

Who passes the test of a class of meshes passes that of each smaller class. A formulation that states the larger promise
alone is asked about all.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, Cases, random_source
from contactverif.contract.errors import ContractError
from contactverif.contract.interface import PLANE, TRIANGLE, Interface
from contactverif.contract.property import WITH_BARRIER, Finding, Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits, parse_forces
from contactverif.oracle.flat_answers import nodal_spring_weights, nodal_surface_weights
from contactverif.problems.flat_states import equal_area_states, equal_length_states
from contactverif.problems.named_states import FLAT_NAMES, named_case
from contactverif.problems.own_law import fit_to_law
from contactverif.strategies import flat_cases, normal_cases, overhung_cases, single_cases, straight, surfaces
from contactverif_properties import applicability, exact_forces, roundoff
from contactverif_properties.applicability import knows_total, refuse_unstated
from contactverif_properties.kinks import explain_by_kink
from contactverif_properties.states import FrozenState

FORCE = roundoff.gap_quantity("error of a nodal force")
TOTAL = roundoff.gap_quantity("error of the total force")
GAP = roundoff.gap_quantity("error of a reported gap")
PRESSURE = roundoff.gap_quantity("error of a reported pressure")
REPORTED_FORCE = roundoff.gap_quantity("error of a reported nodal force")
STATED = roundoff.gap_quantity("difference from the stated forces")
LOST_END = "a slave node faces a free end of the master exactly, and roundoff decides whether it is over the master"
_MOVED = 16.0  # A moved end node bends shares by 128uX over a segment, which the tolerance 8uX/|g| does not cover.

# The share for NTS-AR without a tolerance past free ends: the slave ends where the master ends in every ninth case.
WITHOUT_TOLERANCE = 0.11
_define_uniform = partial(
    Property.define,
    role="exact",
    exact=exact_forces.forces_of_penetration,
    usual_undecided=WITHOUT_TOLERANCE,
    asks=WITH_BARRIER,
)


@_define_uniform(
    id="patch.flat.transmission",
    rank=240,
    turn=2,
    quantities=(FORCE, exact_forces.MOMENT, exact_forces.SKEWED),
    cases=Cases.random(flat_cases),
    cases_in_space=Cases.random(surfaces.flat_surface_cases),
    promise=lambda traits: traits.promises.patch.flat,
)
def patch_flat_transmission(case: Case, subject: Subject) -> Measurement:
    """A uniform penetration of a flat interface gives the exact nodal forces on both sides.

    **Question.** Two flat surfaces with different meshes penetrate each other by the same depth everywhere. Are the
    nodal forces the consistent forces of the pressure ε̂ |g|, on the slave and on the master?

    **Why it matters.** This is the patch test on the interface alone. A formulation that fails it puts a pressure onto
    the bodies that is not there. Finer meshes do not help, because the error is made anew at every node.

    **How it is judged.** The measured number is the largest |F − F_exact| / (ε̂ |g| L) over the nodes of both surfaces,
    and in space the largest |F − F_exact| over the largest exact force on a node. On quadrilaterals that are no
    parallelograms shape functions are no polynomials, and no rule on overlaps gives the exact forces. Whatever the
    rule, ΣF and ΣF x are exact there on either side, over ε̂ |g| A and the size of the domain; nodal forces may err by
    1e-2, which a rule of degree 2 on cells keeps at all angles. The exact forces are computed in rationals. The
    tolerance is u(8X/|g| + 4N + 128): a gap is a difference of coordinates, each rounded to uX, N forces are summed,
    and weights of integration are known to 1e-14. X stands here for every formulation, because the state is turned and
    moved, and stored as it is rounded; `stability.local` asks on states that are exact. With multipliers only the
    distribution of the forces is judged, and not their size: of uniform multipliers if they are pressures, and of those
    that come nearest to the exact forces if they are nodal forces. Of a barrier, whose slave is lifted to a uniform
    gap, the distribution is judged, too.

    **Undecided.** A failing case is undecided where a slave node faces a free end of the master exactly, the error is
    at most X/ℓ times the tolerance, and it is gone with that node a rounding further inside. Mortar integrals of the
    slave and of the master differ by what overhangs, and without the trait `translation_stable` gaps may be their
    products with whole positions. At a kink of a flat interface both partners give the same gap.

    **Source.** Zavarise & De Lorenzis (2009), Figs. 8, 16 and 20.
    """
    most = 0.0 if subject.traits.promises.translation_stable else case.largest_coordinate / case.shortest_segment
    return _unless_end_is_lost(case, partial(exact_forces.measure_transmission, FORCE, subject=subject), most)


@Property.define(
    id="patch.flat.resultant",
    rank=220,
    role="exact",
    turn=3,
    quantities=(TOTAL,),
    cases=Cases.random(flat_cases),
    cases_in_space=Cases.random(surfaces.flat_surface_cases),
    promise=lambda traits: None if applicability.refuse_unknown_total(traits) else True,
    applicable=applicability.refuse_unknown_total,
    usual_undecided=WITHOUT_TOLERANCE,
)
def patch_flat_resultant(case: Case, subject: Subject) -> Measurement:
    """A uniform penetration of a flat interface gives the total force penalty × penetration × area.

    **Question.** Two flat surfaces penetrate each other by the same depth everywhere. Is the total force on the slave
    the penalty times the penetration times the slave's area, in the configuration that the traits name?

    **Why it matters.** A formulation with distributed springs must get the total right, whether it passes the patch
    test or not. A wrong total means a wrong area of competence, and so a wrong stiffness of the contact.

    **How it is judged.** The measured number is |ΣF − ε̂ |g| A n| / (ε̂ |g| A) over the slave's nodes, with the current
    or the reference length A. The reference is scaled by a power of two, so that the two configurations differ.
    Multipliers that are pressures are all ε̂ |g| here. The tolerance is u(8X/|g| + 4N + 128), as in
    `patch.flat.transmission`.

    **Undecided.** A failing case is undecided where a slave node faces a free end of the master exactly: roundoff
    decides whether the node is over the master.
    """
    stretch = 2.0 ** int(np.random.default_rng(case.seed).integers(-2, 3))
    interface, penetration = case.interface.at(case.interface.nodes * stretch), case.parameter("penetration")
    stretched = fit_to_law(replace(case, interface=interface), subject)
    state = FrozenState.with_multiplier(subject.for_case(stretched), stretched, case.penalty * penetration)
    exact = exact_forces.forces_of_penetration(case)[: interface.n_slave_nodes].sum(axis=0)
    areas = {"current": exact, "reference": exact * stretch ** (interface.dim - 1)}
    exact = areas.pop(rule := subject.traits.rules.area or "current")
    ((follows, other),) = areas.items()
    total = exact_forces.pushing_forces(state)[: interface.n_slave_nodes].sum(axis=0)
    error = float(np.linalg.norm(total - exact))
    value, tolerance = error / float(np.linalg.norm(exact)), roundoff.gap_tolerance(case, penetration)
    rounding = roundoff.COORDINATE_ROUNDING * case.largest_coordinate
    undecided = explain_by_kink(state, rounding, {"forces": error}) if value > tolerance else ""
    finding, action = exact_forces.show_force("all slave nodes together", total, exact), ""
    if np.linalg.norm(total - other) <= tolerance * np.linalg.norm(other):
        action = f"on a reference {stretch:g} times as long"  # It explains no other force.
        finding = replace(finding, remark=f"the force follows the {follows} area, and area={rule!r} is promised")
    return Measurement([TOTAL.check(value, tolerance)], undecided).after(action, finding=finding)


def _measure_class(case: Case, subject: Subject) -> Measurement:
    def measure(case: Case) -> Measurement:
        transmission = exact_forces.measure_transmission(FORCE, case, subject=subject)
        numbers, state = [*transmission.numbers], exact_forces.uniform_state(case, subject)
        if state.has_points and subject.traits.rules.enforcement != "barrier":  # Its gaps and pressures are its own.
            depth = case.parameter("penetration")
            errors = exact_forces.point_errors(state, case.penalty, case.penalty * depth)
            # A nodal formulation knows forces only.
            reported = (GAP,) if subject.traits.rules.penalty == "nodal" else (GAP, PRESSURE)
            numbers += check_all(dict(zip(reported, errors, strict=False)), roundoff.gap_tolerance(case, depth))
        return Measurement(numbers, finding=transmission.finding)

    return _unless_end_is_lost(case, measure)


def _unless_end_is_lost(case: Case, measure: Callable[[Case], Measurement], most: float = np.inf) -> Measurement:
    """Return what is measured in a case, undecided if it fails only where roundoff decides whether an end overhangs.

    More than `most` times a tolerance is never undecided. A failure counts as one of roundoff if it is gone with the
    end a rounding further inside, and a quarter of what it was or less.
    """
    before = measure(case)
    if _is_within(before, 1.0) or not _is_within(before, most) or (inside := _move_ends_inwards(case)) is None:
        return before
    after = measure(inside)
    failures = [number.quantity.name for number in before.numbers if number.value > number.tolerance]
    heals = _is_within(after, _MOVED) and all(4 * after.values[name] <= before.values[name] for name in failures)
    return replace(before, undecided=LOST_END if heals else "")


def _is_within(measurement: Measurement, factor: float) -> bool:
    return all(number.value <= factor * number.tolerance for number in measurement.numbers)


def _move_ends_inwards(case: Case) -> Case | None:
    """Return the case with end nodes of the slave that face a free end of the master moved inwards, or None."""
    if case.interface.dim != PLANE:
        return None
    slave, master = case.interface.slave, case.interface.master
    along, positions = case.parameters["along"].copy(), case.positions.copy()
    reach = roundoff.COORDINATE_ROUNDING * case.largest_coordinate
    master_ends = along[master.segments[master.neighbours < 0]]
    moved = False
    for segment, end in np.argwhere(slave.neighbours < 0):
        node, other = slave.segments[segment, [end, 1 - end]]
        if np.abs(master_ends - along[node]).min(initial=np.inf) <= reach:
            step = 2 * reach * np.sign(along[other] - along[node])
            along[node] += step
            positions[node] += step * case.parameters["direction"]
            moved = True
    return replace(case, z=positions.reshape(-1), parameters={**case.parameters, "along": along}) if moved else None


_define_class = partial(_define_uniform, quantities=(FORCE, GAP, PRESSURE))


@_define_class(
    id="patch.flat.normal",
    rank=175,
    turn=3,
    cases=Cases.random(normal_cases),
    cases_in_space=Cases.random(surfaces.matched_surface_cases),
    promise=applicability.promise_normal,
)
def patch_flat_normal(case: Case, subject: Subject) -> Measurement:
    """Forces, gaps and pressures are exact on flat meshes with each inner master node on a slave node.

    **Question.** Two flat surfaces penetrate each other by the same depth everywhere. The master covers the slave, and
    each inner master node lies on a slave node, as in cases A1 and A2. In space both have the same faces, and the
    master a ring of more faces in half of the cases. Are the nodal forces on both sides, the reported
    gaps and the reported pressures exact?

    **Why it matters.** Many formulations state that they fail the general patch test, and a general test cannot tell
    whether they fail as their theory says or by a mistake. On this class NTS-AR, VTS-G and VTS-ME are exact too,
    because the master's shape functions are linear along each slave segment. So a wrong area of competence shows, a
    wrong weight, a wrong sign of what is reported.

    **How it is judged.** The measured numbers are the largest |F − F_exact| / (ε̂ |g| L) over the nodes of both
    surfaces, the largest error of a reported gap over |g|, and that of a reported pressure over ε̂ |g|. The exact
    forces are computed in rationals. The tolerance is u(8X/|g| + 4N + 128), as in `patch.flat.transmission`, and
    multipliers are judged as there. The promise is `patch.normal`; a formulation that passes any flat patch test is
    asked too.

    **Undecided.** A failing case is undecided where a slave node faces a free end of the master exactly, and roundoff
    decides whether the node is over the master.

    **Source.** Zavarise & De Lorenzis (2009), Figs. 8 and 11, Section 4.
    """
    return _measure_class(case, subject)


@_define_class(id="patch.flat.single", rank=200, cases=Cases.random(single_cases), promise=applicability.promise_single)
def patch_flat_single(case: Case, subject: Subject) -> Measurement:
    """They are exact too where inner master nodes lie in the middle of slave segments.

    **Question.** Two flat surfaces penetrate each other by the same depth everywhere. The master covers the slave, and
    each inner master node lies on a slave node or in the middle of a slave segment, as in case B. Are the nodal forces
    on both sides, the reported gaps and the reported pressures exact?

    **Why it matters.** The area of each quarter point of a slave segment then lies over one master segment. VTS-ME with
    an even number of points passes here and fails elsewhere. VTS-G, whose points are elsewhere on the segment, fails
    here. So this is the test that tells them apart, and that a VTS-ME with misplaced points cannot pass.

    **How it is judged.** As in `patch.flat.normal`, with the same tolerances. The promise is `patch.single`; a
    formulation that passes any flat patch test is asked too.

    **Undecided.** As in `patch.flat.normal`.

    **Source.** Zavarise & De Lorenzis (2009), Fig. 16, Section 5.1.2.
    """
    return _measure_class(case, subject)


@Property.define(
    id="patch.flat.nodal",
    rank=90,
    quantities=(FORCE, GAP, REPORTED_FORCE),
    cases=Cases.random(overhung_cases),
    cases_in_space=Cases.random(surfaces.overhung_surface_cases),
    promise=lambda traits: True if traits.rules.penalty == "nodal" and traits.rules.enforcement == "penalty" else None,
    asks=frozenset({"penalty"}),
    applicable=lambda traits: (
        "there are no nodal springs" if traits.rules.penalty == "distributed" else refuse_unstated(traits, "penalty")
    ),
)
def patch_flat_nodal(case: Case, subject: Subject) -> Measurement:
    """Nodal springs push each node with their stiffness times the gap, shared by the lever rule.

    **Question.** Two flat surfaces penetrate each other by the same depth everywhere. Does each slave node get the
    force ε |g| of its spring, and each master node what the lever rule makes of those?

    **Why it matters.** A nodal method such as NTS fails every patch test but the simplest, because its springs know no
    areas. Yet what it must do is known exactly. Without this question any mistake in it would hide behind that failure.

    **How it is judged.** The measured numbers are the largest |F − F_exact| over all nodes, over the forces of all
    springs, and the errors of reported gaps over |g| and of reported nodal forces over ε |g|. A method whose traits say
    `unbiased` has springs at the nodes of both surfaces, all with the same stiffness. How they share the penalty is its
    own choice, so their size is not judged here, but in `patch.flat.published`. The meshes are those of
    `patch.flat.single`, with a master that goes beyond the slave. The exact shares are computed in rationals. The
    tolerance is u(8X/|g| + 4N + 128).

    **Undecided.** Never: no node faces a free end of the other surface, and at a kink of a flat interface both partners
    give the same gap and the same force.

    **Source.** Zavarise & De Lorenzis (2009), Section 4.1, Eq. 6 with F = ε g.
    """
    state, interface = FrozenState.at(subject.for_case(case), case), case.interface
    depth, unbiased = case.parameter("penetration"), bool(subject.traits.promises.unbiased)
    spring, in_plane = subject.penalty(case) * depth, interface.dim == PLANE
    weights_of, places = (nodal_spring_weights, "along") if in_plane else (nodal_surface_weights, "plane")
    weights = weights_of(interface, case.parameters[places], both_surfaces=unbiased)
    exact = spring * exact_forces.push_apart(case, weights, 1.0)
    forces = -state.forces
    if unbiased:
        likeness = float((forces * exact).sum())
        forces = forces * (float((exact**2).sum()) / likeness if likeness > 0 else 1.0)
    tolerance, size = roundoff.gap_tolerance(case, depth), spring * float(weights[: interface.n_slave_nodes].sum())
    values = {FORCE: float(np.linalg.norm(forces - exact, axis=1).max()) / size}
    if state.has_points:
        values[GAP] = exact_forces.point_errors(state, case.penalty, case.penalty * depth)[0]
        if not unbiased:
            values[REPORTED_FORCE] = exact_forces.point_errors(state, case.penalty, spring)[1]
    finding = exact_forces.worst_force(interface, forces, exact) if values[FORCE] > tolerance else None
    return Measurement(check_all(values, tolerance), finding=finding)


@Property.define(
    id="patch.flat.published",
    rank=290,
    quantities=(STATED,),
    cases=Cases.from_list(lambda: tuple(map(named_case, FLAT_NAMES))),
    linear=applicability.LINEAR_FORCES,
    promise=lambda traits: True if traits.evidence.published_forces else None,
    applicable=lambda traits: "" if traits.evidence.published_forces else "the traits state no forces of named cases",
    least_contact=0.0,  # Nothing is asked on a case of which nothing is stated, and one table is better than none.
)
def patch_flat_published(case: Case, subject: Subject) -> Measurement:
    """The forces that the traits state of named flat cases, right or wrong, come out exactly.

    **Question.** The trait `published_forces` gives the nodal forces of a uniform penetration on named cases, as
    fractions: those of the reference paper for A1, A2, B and C, or an author's own. Does the formulation give just
    these?

    **Why it matters.** A formulation that states that it fails the patch test fails by a known amount. Two wrong codes
    of the same method fail by different amounts, and a promise to fail hides the difference. The table shows it.

    **How it is judged.** The measured number is the largest |F − F_stated| over all nodes, over the forces of all slave
    nodes. Forces are over penalty × penetration, with the penalty in the formulation's own unit. With multipliers, they
    are those of unit multipliers. On a case of which nothing is stated the consistent forces are asked of a formulation
    that promises them, and nothing of any other. The tolerance is u(8X/|g| + 4N + 128), as in
    `patch.flat.transmission`.

    **Undecided.** Never: at a kink of a flat interface both partners give the same gap and the same force.

    **Source.** Zavarise & De Lorenzis (2009), Figs. 8, 16 and 20.
    """
    stated = _stated_forces(case, subject.traits)
    if stated is None:
        return Measurement(idle=True)
    state, depth = exact_forces.uniform_state(case, subject, 1.0), case.parameter("penetration")
    if state.case.n_multipliers:
        forces = -exact_forces.unit_forces(state).sum(axis=1).reshape(-1, 2)
    else:
        forces = -state.forces / (subject.penalty(case) * depth)
    size = np.abs(stated[: case.interface.n_slave_nodes]).sum()
    error = float(np.linalg.norm(forces - stated, axis=1).max() / size)
    number = STATED.check(error, roundoff.gap_tolerance(case, depth))
    finding = exact_forces.worst_force(case.interface, forces, stated) if number.ratio > 1 else None
    return Measurement([number], finding=finding)


def _stated_forces(case: Case, traits: Traits) -> FloatArray | None:
    """Return the forces (n_nodes, 2) that must come out; None if that is not known."""
    published = traits.evidence.published_forces
    if strangers := published.keys() - set(FLAT_NAMES):
        needed = f"names of flat cases: {', '.join(FLAT_NAMES)}"
        raise ContractError(f"Traits.published_forces: found {', '.join(sorted(strangers))}; needed {needed}")
    if case.name not in published:
        consistent = traits.promises.patch.flat and traits.rules.penalty == "distributed"
        return exact_forces.consistent_forces(case, 1.0) if consistent else None
    slave, master = parse_forces(published[case.name])
    slave_x, master_x = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    if (len(slave), len(master)) != (len(slave_x), len(master_x)):
        counts = f"{len(slave)} and {len(master)} forces on {case.name}"
        needed = f"{len(slave_x)} on the slave nodes and {len(master_x)} on the master nodes"
        raise ContractError(f"Traits.published_forces: found {counts}; needed {needed}")
    from_left = np.append(np.argsort(slave_x), len(slave_x) + np.argsort(master_x))
    forces = np.zeros((len(from_left), 2))
    forces[from_left, 1] = [*map(float, slave), *(-float(force) for force in master)]
    return forces


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
    rank=326,
    family="patch",
    quantities=(MOST, LEAST, PUSH),
    cases=Cases.from_list(equal_length_states),
    cases_in_space=Cases.from_list(equal_area_states),
    asks=frozenset({"penalty"}),
    linear=applicability.LINEAR_SIZE,
)
def total_stiffness(case: Case, subject: Subject) -> Measurement:
    """The total contact stiffness of a flat interface is ε̂ L, or 2 ε̂ L with two passes.

    **Question.** Slave and master are flat, equally long, and penetrate each other by the same depth everywhere. Is the
    force the penalty times the penetration times the length, or twice that?

    **Why it matters.** The penalty is the one number that a user gives, and an error of its factor shows in nothing but
    the penetration. Most questions about sizes are asked of those who state `penalty` and `area`. This one is asked of
    everybody, whatever is promised, so that no formulation is three times too stiff in silence.

    **How it is judged.** The number is the force that pushes the slave over ε̂ |g| L, and likewise that on the master;
    the worse of both counts. It must lie within 1/n of 1, or within 2/n of 2 where the traits leave room for springs on
    both surfaces; n is the number of slave segments, 8, 16, 304 or 1,032. So a stiffness that is wrong by 0.1 % shows,
    in space by 0.7 %, and so does a master that gets more than the slave. The largest force on a node is that of a few
    mean segments, so that a number of a segment that overflows shows. Nodal springs of ε̂ L/n at n + 1 nodes give 1 +
    1/n. A node that faces the end of the master exactly may be lost to roundoff, which takes no more than 1/n either.
    Segments have the mean length 1, so that it does not matter whether the unit of the penalty is stated. A factor of 2
    on one pass looks like two passes, so the row says that the springs are 2 ε̂ L, unless the traits say `unbiased`. In
    space L is the area, and n is the number of slave nodes, 25 or 144; each has the mean area 1.

    A law that is not linear has no stiffness. The state is asked again at half the depth, and where the number changes
    by more than u(8Z/|g| + 4N + 128), it is kept as a detail and not judged, unless the trait `law` says "linear".

    **Undecided.** Never.
    """
    interface, traits, depth = case.interface, subject.traits, case.parameter("penetration")
    n = len(interface.slave) if interface.dim == PLANE else interface.n_slave_nodes
    away = np.zeros_like(case.positions)
    away[: interface.n_slave_nodes] = depth / 2 * exact_forces.normal_of(case)
    parameters = {**case.parameters, "penetration": np.array(depth / 2)}
    half = replace(case, z=(case.positions + away).reshape(-1), parameters=parameters)
    (springs, opposite, largest), (shallow, *_) = _springs(case, subject), _springs(half, subject)
    tolerance = roundoff.gap_tolerance(half, depth / 2, roundoff.rounding_distance(case, traits))
    details = {"springs over ε̂ L": springs}
    if abs(shallow - springs) > 2 * tolerance * abs(springs) and traits.rules.law != "linear":
        return Measurement(details=details)
    passes = 2 if springs > np.sqrt(2) and applicability.may_act_twice(traits) else 1
    numbers = [
        MOST.check(max(springs, opposite), passes * (1 + 1 / n) + tolerance),
        LEAST.check(min(springs, opposite), passes * (1 - 1 / n) - tolerance),
        PUSH.check(largest * n, LARGEST_PUSH * passes),
    ]
    remark = "" if passes == 1 or traits.promises.unbiased else "two passes, or twice too stiff"
    if any(number.ratio > 1 for number in numbers):
        remark = "one pass has 1 ε̂ L" + (", two passes have 2 ε̂ L" if applicability.may_act_twice(traits) else "")
        if abs(opposite - springs) > abs(springs) / n:
            remark = f"the master gets {opposite:#.3g} ε̂ L; {remark}"
    finding = Finding(f"your springs are {springs:#.3g} ε̂ L: {remark}") if remark else None
    return Measurement(numbers, details=details, finding=finding)


def _springs(case: Case, subject: Subject) -> tuple[float, float, float]:
    """Return the forces that push the slave out, the master out, and a node at most, over ε̂ |g| L."""
    pushes = -exact_forces.uniform_state(case, subject).forces @ exact_forces.normal_of(case)
    size = case.penalty * case.parameter("penetration") * case.slave_measure
    slave, master = np.split(pushes / size, [case.interface.n_slave_nodes])
    return float(slave.sum()), -float(master.sum()), float(np.abs(pushes).max()) / size


OFF_NORMAL = roundoff.stated_gap_quantity("part of the force off the normal")
TILTED_TOTAL = roundoff.stated_gap_quantity("error of the total force")
TILTED_NODAL = roundoff.stated_gap_quantity("error of a nodal force")
TILTED_ROW = roundoff.stated_gap_quantity("error of a constraint row")
TILTED, STEEP, SLIGHT = "tilted by 3° to 35°", "tilted by 35° to 89°", "tilted by 2^-5 to 2^-45"
TILTED_PLANE, STEEP_PLANE = "a plane tilted by up to 19°", "a plane tilted by 14° to 89°"
STEEPEST_SEEN = 0.5  # The cosine of 60°, up to which half passes see a slave, as every other search does.


@random_source("contactverif_properties.straight_slaves.resultant_cases")
def _resultant_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | None:
    makers = {TILTED: straight.tilted_cases, STEEP: straight.steep_cases, SLIGHT: straight.slight_cases}
    return {kind: cases for kind, make in makers.items() if (cases := make(interface)) is not None} or None


@random_source("contactverif_properties.straight_slaves.resultant_plane_cases")
def _resultant_plane_cases(
    interface: Interface | None = None, faces: tuple[int, ...] = (TRIANGLE,)
) -> dict[str, SearchStrategy[Case]] | None:
    tilted, steep = straight.tilted_plane_cases(interface, faces), straight.steep_plane_cases(interface, faces)
    return {TILTED_PLANE: tilted, STEEP_PLANE: steep} if tilted is not None and steep is not None else None


def _tolerance(case: Case, traits: Traits) -> float:
    mean_gap = abs(float(exact_forces.node_gaps(case).mean()))
    return roundoff.gap_tolerance(case, mean_gap, roundoff.rounding_distance(case, traits))


@Property.define(
    id="patch.tilted.resultant",
    rank=250,
    quantities=(OFF_NORMAL, TILTED_TOTAL),
    cases=Cases.random(_resultant_cases),
    cases_in_space=Cases.random(_resultant_plane_cases),
    kinds=(TILTED, STEEP, SLIGHT),
    # Of two passes that balance each may push along the normal of the other surface.
    promise=lambda t: (
        True if t.rules.force_along and not (t.promises.unbiased and t.promises.conserves_force) else None
    ),
    applicable=lambda traits: refuse_unstated(traits, "force_along"),
)
def patch_tilted_resultant(case: Case, subject: Subject) -> Measurement:
    """A straight slave, tilted against a flat master, gets the force ε̂ ∫ |g| ds along the stated normal.

    **Question.** A straight slave is tilted against a flat master by 2^-45 to 89°, and penetrates it with all its
    length. In space it is a plane, tilted by up to 89°. Is the force on the slave ε̂ ∫ |g| ds, along the normal that
    the traits name?

    **Why it matters.** Flat patch tests never tilt a surface. A pressure that falls with the tilt, for example with its
    cosine squared, passes all of them, and is wrong on every curved part.

    **How it is judged.** The gap is linear along the slave, so its integral is exact for every rule: points with
    weights that balance, cells, nodal areas. The trait `gap` names the normal along which gaps are measured,
    `force_along` that along which contact pushes, `area` the configuration of ds. The first number is the part of the
    total force off that normal, over the total. The second is the error of the total force over its exact size, where
    `penalty` and `area` are stated. Multipliers that are pressures are uniform here, and nodal springs are asked for
    the direction alone. The tolerance is u(8Z/|g| + 4N + 128), where Z is the diameter of a formulation that promises
    `translation_stable`, and the largest coordinate of any other.

    In a third of the cases in the plane the tilt is 2^-45 to 2^-5, in a third 35° to 89°, and in half of those in space
    14° to 89°. No coordinate is rounded, and no gap is longer than two master segments, so that every search finds it.
    A formulation that states no rule `gap` may overlook a slave that is steeper than 60°, in space 14°. Else its total
    is no more than with gaps along the slave's normal, and no less than with those along the master's, unless the slave
    is so steep.

    **Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X
    changes the answer by a quarter of the error or more.
    """
    traits, total = subject.traits, exact_forces.slave_forces(case, subject).sum(axis=0)
    of_master, of_slave = exact_forces.directions(case)
    cosine = float(of_master @ of_slave)
    # No rule says that a formulation sees what it is so steep to.
    if not total.any() and (cosine < STEEPEST_SEEN or case.kind == STEEP_PLANE) and traits.rules.gap is None:
        return Measurement()
    normal = of_master if traits.rules.force_along == "master normal" else of_slave
    push, across = float(total @ normal), exact_forces.distance_from_line(total, normal)
    broken = "" if push > 0 else "nothing pushes the slave out of the master"
    values, errors = {OFF_NORMAL: roundoff.ratio(across, float(np.linalg.norm(total)))}, {OFF_NORMAL: across}
    if (is_known := exact_forces.knows_linear_total(traits)) or (knows_total(traits) and not traits.rules.own_law):
        most = float(np.linalg.norm(exact_forces.exact_slave_forces(case, traits).sum(axis=0)))
        least = most if is_known else 0.0 if case.kind in (STEEP, STEEP_PLANE) else most * cosine
        errors[TILTED_TOTAL] = max(least - push, push - most, 0.0)
        values[TILTED_TOTAL] = errors[TILTED_TOTAL] / most
    tolerance = _tolerance(case, traits)
    error = max((error for name, error in errors.items() if values[name] > tolerance), default=0.0)
    formulation, undecided = subject.for_case(case), ""
    if error and not formulation.n_multipliers(case.interface):
        reach = roundoff.COORDINATE_ROUNDING * case.largest_coordinate
        undecided = explain_by_kink(FrozenState.at(formulation, case), reach, {"forces": error})
    return Measurement(check_all(values, tolerance), undecided, broken)


def _refuse_unknown_integral(traits: Traits) -> str:
    if traits.rules.enforcement == "multiplier":
        return "multipliers have pressures of their own, not those of a gap"
    if traits.rules.penalty == "nodal":
        return "there are no distributed springs"
    return refuse_unstated(traits, "penalty", "area", "gap", "force_along")


@Property.define(
    id="patch.tilted.nodal",
    rank=395,
    role="trait",
    quantities=(TILTED_NODAL,),
    cases=Cases.random(straight.tilted_cases),
    cases_in_space=Cases.random(straight.tilted_plane_cases),
    promise=lambda traits: traits.promises.integrates_linear_gap,
    linear=applicability.LINEAR_FORCES,
    applicable=_refuse_unknown_integral,
)
def patch_tilted_nodal(case: Case, subject: Subject) -> Measurement:
    """Each node of a straight, tilted slave gets the exact integral of its linear gap.

    **Question.** A straight slave is tilted against a flat master and penetrates it with all its length, so that the
    gap is linear. Is the force on each node of the slave ε̂ ∫ N_i |g| ds?

    **Why it matters.** A method that integrates a linear pressure exactly takes bending and Hertz-like pressures on
    coarse meshes better than one that knows constant pressures alone. Many good methods do not: those with points in
    the middle of parts, and mortar methods, whose pressures come from weighted means.

    **How it is judged.** The largest error of a nodal force on the slave counts over the total. Gap, direction and
    lengths follow from the traits as in `patch.tilted.resultant`. The tolerance is u(8Z/|g| + 4N + 128), likewise.

    **Undecided.** Never: the slave is in contact with all its length, and far from the ends of the master.
    """
    exact, forces = exact_forces.exact_slave_forces(case, subject.traits), exact_forces.slave_forces(case, subject)
    error = float(np.linalg.norm(forces - exact, axis=1).max()) / float(np.linalg.norm(exact.sum(axis=0)))
    number = TILTED_NODAL.check(error, _tolerance(case, subject.traits))
    finding = exact_forces.worst_force(case.interface, forces, exact) if number.ratio > 1 else None
    return Measurement([number], idle=not forces.any(), finding=finding)


def _refuse_unknown_shapes(traits: Traits) -> str:
    if traits.rules.penalty == "nodal":
        return "there are no pressures"
    return refuse_unstated(traits, "penalty", "area", "gap", "force_along", "gap_shapes", "pressure_shapes")


@Property.define(
    id="patch.tilted.weighted",
    rank=36,
    quantities=(TILTED_NODAL, TILTED_ROW),
    cases=Cases.random(straight.tilted_cases),
    cases_in_space=Cases.random(straight.tilted_plane_cases),
    applicable=_refuse_unknown_shapes,
)
def patch_tilted_weighted(case: Case, subject: Subject) -> Measurement:
    """Forces on a straight, tilted slave follow from weighted gaps and the stated shapes.

    **Question.** A straight slave is tilted against a flat master and penetrates it with all its length. Do the forces
    on its nodes follow from gaps that are weighted with the shapes that the traits name?

    **Why it matters.** Any weights that add up to 1 make a mean of a uniform gap. So no flat patch test shows wrong
    points of integration of a mortar method. And there is no one answer: on a segment of length 2 with depths of 3 and
    9, standard shapes give 17/3 and 19/3, dual ones 3 and 9, and dual pressures of standard gaps 5 and 7.

    **How it is judged.** With the shapes φ_j of `gap_shapes`, ψ_j of `pressure_shapes` and linear N_i, pressures are
    p_j = ε̂ ∫φ_j |g| ds / ∫φ_j ds, and forces ∫N_i Σ ψ_j p_j ds. The slave is covered, so dual shapes have ∫ψ_j N_i = 0
    for i ≠ j, and ∫N_i for i = j. The largest error of a nodal force counts over the total. Multipliers are these
    pressures; the error of a constraint row, ∫φ_j |g| ds, counts over the sum of all. Springs of one dual and one
    standard shape have the same forces in either order, and rows tell them apart. Gap, direction, lengths and the
    tolerance u(8Z/|g| + 4N + 128) are those of `patch.tilted.resultant`.

    **Undecided.** Never: the slave is in contact with all its length, and far from the ends of the master.
    """
    gaps, pressures, exact = exact_forces.weighted_forces(case, subject.traits)
    formulation = subject.for_case(case)
    count = formulation.n_multipliers(case.interface)
    state = FrozenState.at(formulation, case.with_multipliers(pressures) if count else case)
    forces = exact_forces.pushing_forces(state)[: len(exact)]
    error = float(np.linalg.norm(forces - exact, axis=1).max()) / float(np.linalg.norm(exact.sum(axis=0)))
    values = {TILTED_NODAL: error}
    if count:
        values[TILTED_ROW] = float(np.abs(state.residual[case.interface.n_unknowns :] - gaps).max() / gaps.sum())
    numbers = check_all(values, _tolerance(case, subject.traits))
    finding = exact_forces.worst_force(case.interface, forces, exact) if numbers[0].ratio > 1 else None
    return Measurement(numbers, idle=not forces.any(), finding=finding)
