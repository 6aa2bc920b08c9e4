"""Contact that pushes where the surfaces penetrate and never pulls, and the constraint rows of multipliers.

A row is −area · gap where the constraint is active and area · λ where it is not, and it is active where λ − c gap ≥ 0.
The two have opposite signs wherever λ − c gap is near 0, so a row shows which of them the formulation has chosen. The
area is what a unit of the multiplier pushes the slave by, and 1 for a nodal force.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from itertools import chain, pairwise
from typing import NamedTuple

import numpy as np
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray
from contactverif.contract.case import ACTIVATION, Case, Cases, random_source
from contactverif.contract.errors import ContractError
from contactverif.contract.interface import PLANE, TRIANGLE, Interface, Surface, turns_of
from contactverif.contract.property import WITH_BARRIER, Measurement, Property, Quantity, check_all
from contactverif.contract.result import OPPOSITE_SIGN
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.contract.traits import Rules, Traits
from contactverif.problems.open_states import activation_distance
from contactverif.strategies import flat_cases, general_cases
from contactverif.strategies.closings import KINDS, closing_cases
from contactverif.strategies.straight import open_end_cases
from contactverif.strategies.surfaces import flat_surface_cases, surface_cases
from contactverif_properties import roundoff
from contactverif_properties.applicability import may_act_twice, refuse_unstated
from contactverif_properties.exact_forces import describe_node, normal_of, unit_forces, worst_force
from contactverif_properties.roundoff import COORDINATE_ROUNDING
from contactverif_properties.states import FrozenState, Pass, freeze_state, prepare_state, random_moves

NEAREST = 16.0  # λ − c gap is nearest to 0 at so many tolerances of a gap, so that its sign is no matter of roundoff.
FARTHEST = 0.25  # It is farthest at this share of c |gap|.
N_MOVES = 64  # The number of moves by roundoff that are tried where a point may hang at a free end.
MOVED = 32.0  # Such a move of both surfaces changes a gap by 181 uX, which is 23 tolerances.


class _Constraints(NamedTuple):
    """The constraint rows of a flat interface with a uniform gap, as the contract states them."""

    rules: Rules
    scale: float  # The scale c of the decision λ − c gap ≥ 0.
    areas: FloatArray  # (n_multipliers,) The area of each, a length, or 1; 0 where it sees nothing.
    # (n_multipliers,) The lengths by which roundoff counts. Dual shapes on little of a segment are large and cancel.
    spreads: FloatArray
    tolerance: float  # The relative rounding of a gap or an area.

    def active(self, multipliers: FloatArray, gap: float) -> BoolArray:
        return (self.areas > 0) & (multipliers - self.scale * gap >= 0)

    def right(self, multipliers: FloatArray, gap: float) -> FloatArray:
        areas = np.ones_like(self.areas) if self.rules.penalty == "nodal" else self.areas
        return np.where(self.active(multipliers, gap), -areas * gap, areas * multipliers)

    def errors(self, rows: FloatArray, multipliers: FloatArray, gap: float) -> FloatArray:
        """Return the errors of constraint rows (n_multipliers,) over their tolerance; infinite for a wrong sign."""
        active = self.active(multipliers, gap)
        sizes = self.tolerance * self.spreads * np.where(active, abs(gap), np.abs(multipliers))
        # The area of an inactive constraint may be unknown: a second pass may be covered in part.
        known = active | (self.rules.penalty == "nodal") | (self.rules.area is not None) & (self.areas > 0)
        signs = np.where(rows * multipliers > 0, 0.0, np.inf)  # The area of an inactive constraint is positive.
        return np.asarray(np.where(known, np.abs(rows - self.right(multipliers, gap)) / sizes, signs))


def check_constraint_rows(
    formulation: CheckedFormulation, closed: Case, lifted: Case, rules: Rules, scale: float
) -> float:
    """Return the largest error of a constraint row of a flat interface over its tolerance u(8X/min(g, ℓ) + 4N).

    The gap is minus the parameter `penetration` everywhere if closed, and as wide if lifted. A point that faces a free
    end exactly may lose it by roundoff as the slave is lifted. Then the open gap is not judged. `scale` is the scale c
    of the multipliers. A row that is not what the contract states raises a `ContractError`, which names it beside the
    right one.
    """
    depth, count = closed.parameter("penetration"), formulation.n_multipliers(closed.interface)
    random = np.random.default_rng([closed.seed, 2])
    reach = min(depth, closed.shortest_segment)
    largest = max(closed.largest_coordinate, lifted.largest_coordinate)
    tolerance = UNIT_ROUNDOFF * (8 * (largest + roundoff.normal_rounding(closed)) / reach + 4 * closed.n_segments)
    pressing = scale * depth * random.uniform(0.5, 1.0, count)
    areas, spreads = _areas(FrozenState.at(formulation, closed.with_multipliers(pressing)), rules)
    constraints = _Constraints(rules, scale, areas, spreads, tolerance)
    worst = 0.0

    def rows_at(case: Case, multipliers: FloatArray) -> FloatArray:
        state = FrozenState.at(formulation, case.with_multipliers(multipliers))
        return state.residual[case.interface.n_unknowns :]

    for case, gap in ((closed, -depth), (lifted, depth)):
        for multipliers in _choose_multipliers(random, constraints, gap):
            rows = rows_at(case, multipliers)
            errors = constraints.errors(rows, multipliers, gap)
            if not (errors <= 1).all():
                moves = (rows_at(moved, multipliers) for moved in _move_by_roundoff(case))
                if any((constraints.errors(moved, multipliers, gap) <= MOVED).all() for moved in moves):
                    return worst
                raise ContractError(_describe(constraints, rows, multipliers, gap, int(errors.argmax())))
            worst = max(worst, float(errors.max(initial=0.0)))
    return worst


def _choose_multipliers(random: np.random.Generator, constraints: _Constraints, gap: float) -> Iterator[FloatArray]:
    """Yield multipliers for a gap: such that λ − c gap > 0 everywhere, then twice with both signs just beside 0."""
    size, count = constraints.scale * abs(gap), len(constraints.areas)
    yield constraints.scale * gap + size * random.uniform(1.25, 2.0, count)
    nearest = NEAREST * constraints.tolerance
    if nearest < FARTHEST:
        distances = size * np.exp(random.uniform(np.log(nearest), np.log(FARTHEST), count))
        distances *= np.where(random.random(count) < 0.5, 1.0, -1.0)
        yield constraints.scale * gap + distances
        yield constraints.scale * gap - distances


def _areas(state: FrozenState, rules: Rules) -> tuple[FloatArray, FloatArray]:
    """Return what a unit of each multiplier pushes the slave by, and the sizes (n_multipliers,) of what it pushes.

    It is what pushes the master where it does not push the slave. No size is below the largest area.
    """
    case = state.case
    pushes = -unit_forces(state).T.reshape(case.n_multipliers, -1, 2) @ normal_of(case)  # (n_multipliers, n_nodes)
    slave, master = np.split(pushes, [case.interface.n_slave_nodes], axis=1)
    areas: FloatArray = np.maximum(slave.sum(axis=1), -master.sum(axis=1))
    if rules.penalty == "nodal":
        return (areas > 0).astype(np.float64), np.ones_like(areas)
    return areas, np.maximum(np.abs(pushes).sum(axis=1) / 2, areas.max(initial=0.0))


def _move_by_roundoff(case: Case) -> Iterator[Case]:
    reach = COORDINATE_ROUNDING * case.largest_coordinate
    for direction in random_moves(case.seed, N_MOVES, case.z.size):
        yield replace(case, z=case.z + reach * direction)


def _describe(constraints: _Constraints, rows: FloatArray, multipliers: FloatArray, gap: float, row: int) -> str:
    multiplier, scale = float(multipliers[row]), constraints.scale
    area = "1, since it is a nodal force" if constraints.rules.penalty == "nodal" else f"{constraints.areas[row]:.6g}"
    state = f"at a gap of {gap:.6g}, λ = {multiplier:.6g} and c = {scale:.6g}"
    answer = f"residual: constraint row {row} is {rows[row]:.6g} {state}"
    if not constraints.areas[row] > 0:
        return f"{answer}, where its multiplier sees nothing; needed area · λ with an area > 0"
    difference = multiplier - scale * gap
    form = "−area · gap" if difference >= 0 else "area · λ"
    right = f"{form} = {constraints.right(multipliers, gap)[row]:.6g} with the area {area}"
    return f"{answer}; needed {right}, since λ − c gap is {difference:.3g}"


CLOSED = 1 / 8  # The share of the slave's length, at one end, that is closed while the rest is open.
SHALLOW = 2.0**-6  # The deepest penetration there over the slave's length, so that the slave hardly tilts.
FAR = 2.0  # A distance in longest segments: the shapes of a mortar method reach over one, on either side.
FLAT, ANY_SHAPE = "flat", "any shape"
REASON = "An open contact is left out, not rounded away."
OPEN = Quantity("force across an open gap", "0", REASON)
DISTANT = Quantity("force far from the contact zone", "0", REASON)
PULL_OF_POINT = Quantity("pull of a contact point", roundoff.SEGMENT_TOLERANCE, roundoff.SEGMENT_REASON)
BEYOND = 1.01  # A gap beyond which nothing pushes, over the distance at which a barrier or a law of its own begins.
N_HALVINGS = 40
ROUNDED = 2.0**12  # The smallest gap in roundings of a position: the gap is known to 2^-11 of itself.
LEAST_GROWTH = 1.01
GROWTH = Quantity(
    "growth of a barrier's force at half the gap",
    "1.01",
    "The force of a barrier has no bound. A law with a bound hardly grows where the gap is small.",
    sense="at least",
)
NEAR = 2.0**-8  # The largest gap over the length to the nearest other node, whose forces hardly matter then.
BESIDE = 2.0**-20  # The step to either side of the border of a vertex, over the gap.
LEAST_WORK, LARGEST_JUMP = 0.5, 2.0**-10
WORK = Quantity(
    "gap times force, over that half-way", "1/2", "Of 1/k, whose sum has no bound, half is left.", sense="at least"
)
JUMP = Quantity(
    "jump at a vertex", "2^-10", "A step of 2^-19 of the gap changes a force gap^-p by p times that; p is below 512."
)
CORNER = 0.5  # The cosine of 60°: beyond, a foot along the normal of a point may lie far past the ends of a neighbour.
HALF = 0.5  # The share of a flat slave that is closed: points and shapes of all formulations find contact there.
PULL_OF_NODE = Quantity("pull of a node", roundoff.SEGMENT_TOLERANCE, roundoff.SEGMENT_REASON)
Direction = tuple[float, ...]  # A unit vector, which a set holds once.


@random_source("contactverif_properties.shared.openings.pushing_cases")
def _pushing_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]]:
    flat = flat_cases(interface)
    return ({} if flat is None else {FLAT: flat}) | {ANY_SHAPE: general_cases(interface)}


@random_source("contactverif_properties.pushes.pushing_surfaces")
def _pushing_surfaces(
    interface: Interface | None = None, faces: tuple[int, ...] = (TRIANGLE,)
) -> dict[str, SearchStrategy[Case]]:
    cases = {FLAT: flat_surface_cases(interface, faces), ANY_SHAPE: surface_cases(interface, faces)}
    return {kind: strategy for kind, strategy in cases.items() if strategy is not None}


def lift_slave(case: Case, height: float) -> Case:
    """Return the case with its slave moved away from the master, across the interface, by a height (a length)."""
    positions = case.positions.copy()
    positions[: case.interface.n_slave_nodes] += height * normal_of(case)
    return replace(case, z=positions.reshape(-1))


def _open_all_but_one_end(case: Case, closed: float = CLOSED) -> Case:
    """Return a flat case with its slave lifted so that the gap grows along it, and only its first part is closed."""
    depth, positions = case.parameter("penetration"), case.positions.copy()
    shallow = min(depth, SHALLOW * case.slave_length)
    heights = depth + shallow * (_slave_places(case) / closed - 1)
    positions[: case.interface.n_slave_nodes] += heights[:, None] * normal_of(case)
    return replace(case, z=positions.reshape(-1))


def _slave_places(case: Case) -> FloatArray:
    """Return where the slave's nodes lie along a flat interface (n_slave_nodes,), from 0 to 1; in space along x."""
    slave = _places_along(case)[: case.interface.n_slave_nodes]
    return np.asarray((slave - slave.min()) / np.ptp(slave))


def _places_along(case: Case) -> FloatArray:
    return case.parameters["along"] if case.interface.dim == PLANE else case.parameters["plane"][:, 0]


_define = partial(
    Property.define,
    family="invariants",
    cases=Cases.random(_pushing_cases),
    cases_in_space=Cases.random(_pushing_surfaces),
    kinds=(FLAT, ANY_SHAPE),
)


@_define(id="unilateral", rank=60, turn=5, quantities=(OPEN, DISTANT, PULL_OF_POINT, GROWTH), asks=WITH_BARRIER)
def unilateral(case: Case, subject: Subject) -> Measurement:
    """Contact pushes where surfaces penetrate; no force acts across an open gap or far from the contact zone.

    **Question.** A flat interface is lifted until all gaps are open, and until all but one end is open. Is there no
    force across an open gap, none far from the contact zone, and some where the surfaces penetrate? Does that force
    push the slave, and does no contact point pull, there and on interfaces of any shape?

    **Why it matters.** A force across an open gap is adhesion, or a force from nowhere. A contact that never begins
    lets bodies pass through each other. A point that pulls where its gap has opened beside others that are closed is
    adhesion too; it hides in nodal forces that push as a whole.

    **How it is judged.** The first number is the largest nodal force across the open gap over ε̂ |g| L, with all
    multipliers 0. The second is, with springs alone, the largest force of a slave node two or more segments from the
    closed end over the largest force of a node. Both must be exactly 0: an open contact is left out, not rounded away.
    The third is the largest negative pressure of a contact point over the largest of all points, where points are
    reported; it may be as large as rounding the positions makes a gap. Where the surfaces penetrate and nothing begins,
    or the slave is pulled as a whole, the case fails in words. What single nodes may do is asked by `nodal-push`.

    The constraint rows of multipliers are held to the contract on the flat interface, with the gap closed and open:
    −area · gap where λ − c gap ≥ 0, and area · λ elsewhere, whatever the scale c. Multipliers are chosen so that
    λ − c gap is positive everywhere, then of both signs, from c |gap|/4 down to 16 tolerances beside 0; there the two
    forms differ in sign. The area is what a unit of the multiplier pushes the slave by, and 1 for a nodal force. The
    tolerance of a row is u(8X/min(g, ℓ) + 4N). Where springs act twice, an inactive row must have the sign of λ alone.
    A row with another size, or of the other form, breaks the contract.

    A law of its own that begins at a gap (trait `law_distance`) is lifted to 1.01 times that gap, and is not asked for
    the second number.

    A barrier pushes across a gap, up to its activation distance. Beyond that, at 1.01 times and twice the distance,
    its forces must be exactly 0. The fourth number is the factor by which the force on the flat slave grows where
    the gap is halved, down to 2^-40 of what it was or to 4096 u X, where rounding the positions begins to decide the
    gap; it is the median of the last half of these steps. A law that has a bound grows by 1 + 2^-30 there, the slowest
    that has none in use, a logarithm, by 1.03.

    **Undecided.** A case in which nothing begins is undecided if moving the nodes by 64 u X makes contact begin one way
    and not another: a node that faces a free end exactly is over the master or not, as roundoff decides. Where contact
    begins whichever way the nodes move, the case fails.
    """
    if "penetration" in case.parameters:
        if subject.traits.rules.enforcement == "barrier":
            return _measure_barrier(case, subject)
        measurement = _measure_flat_contact(case, subject)
        if measurement.broken or measurement.undecided or subject.traits.rules.enforcement != "multiplier":
            return measurement
        lifted = lift_slave(case, 2 * case.parameter("penetration"))
        error = check_constraint_rows(subject.for_case(case), case, lifted, subject.traits.rules, subject.penalty(case))
        return replace(measurement, details={"error of a constraint row over its tolerance": error})
    state = freeze_state(case, subject)
    pull = _pull_of_points(state)
    return Measurement([] if pull is None else [PULL_OF_POINT.check(*pull)], idle=not state.forces.any())


def _measure_flat_contact(case: Case, subject: Subject) -> Measurement:
    """Lift a flat interface until all is open, and until all but an end is; `complementarity` judges multipliers."""
    formulation, interface, depth = subject.for_case(case), case.interface, case.parameter("penetration")
    size = case.penalty * depth * case.slave_measure
    distance = activation_distance(interface, subject.traits)  # 0 where contact begins in touch.
    gap = max(depth, BEYOND * distance)
    raised = FrozenState.with_multiplier(formulation, lift_slave(case, depth + gap), 0.0)
    values = {OPEN: float(np.abs(raised.forces).max()) / size}
    one_end, along = _open_all_but_one_end(case), _places_along(case)
    longest = max(float(np.ptp(along[side.faces], axis=1).max()) for side in (interface.slave, interface.master))
    distant = (_slave_places(case) - CLOSED) * np.ptp(along[: interface.n_slave_nodes]) > FAR * longest
    if not raised.case.n_multipliers and distant.any() and not distance:
        forces = np.linalg.norm(FrozenState.at(formulation, one_end).forces[: len(distant)], axis=1)
        values[DISTANT] = float(forces[distant].max() / forces.max()) if forces.any() else 0.0
    tolerances = dict.fromkeys(values, 0.0)
    states = (FrozenState.at(formulation, prepare_state(state, subject)[1]) for state in (case, one_end))
    pulls = [pull for pull in map(_pull_of_points, states) if pull is not None]
    if pulls:
        values[PULL_OF_POINT], tolerances[PULL_OF_POINT] = max(pulls, key=lambda pull: pull[0] / pull[1])
    pushes, broken, undecided = _contact_forces(formulation, case), "", ""
    if not pushes.any():
        broken = "nothing begins where the surfaces penetrate"
        begins = {bool(_contact_forces(formulation, moved).any()) for moved in _move_by_roundoff(case)}
        undecided = "a kink: moved by roundoff, it begins one way and not another" if len(begins) == 2 else ""
    elif (pushes[: interface.n_slave_nodes] @ normal_of(case)).sum() > 0:  # A residual that pulls the slave.
        broken = OPPOSITE_SIGN
    measurement = Measurement(check_all(values, tolerances), undecided, broken, idle=bool(undecided))
    if values[OPEN] or broken:  # What is broken is so in the state that is drawn.
        worst = worst_force(interface, -raised.forces, 0 * raised.forces, ("force", "needed")) if values[OPEN] else None
        return measurement.after(f"lifted to a gap of {gap:.4g}", OPEN, finding=worst)
    of_end = (DISTANT,) if not pulls or values[PULL_OF_POINT] == pulls[0][0] else (DISTANT, PULL_OF_POINT)
    return measurement.after(f"lifted until all is open but {CLOSED:g} of the slave at one end", *of_end)


def _measure_barrier(case: Case, subject: Subject) -> Measurement:
    gap, activation = case.parameter("penetration"), case.parameter(ACTIVATION)
    gaps = _halve_gap(case, gap, gap)
    outside = [BEYOND * activation, 2 * activation]
    forces = _forces_at(case, subject, np.multiply.outer(np.array([*gaps, *outside]) - gap, normal_of(case)))
    pushes = (forces[: len(gaps), : case.interface.n_slave_nodes] @ normal_of(case)).sum(axis=1).tolist()
    size = max(abs(pushes[0]), np.finfo(float).tiny)
    values = {OPEN: float(np.abs(forces[len(gaps) :]).max()) / size}
    if len(pushes) > 1:
        growth = _growth(pushes)
        # At a free end that a node faces exactly, roundoff may lose a spring at one gap and find it at the next.
        values[GROWTH] = float(np.median(growth[len(growth) // 2 :]))
    broken = OPPOSITE_SIGN if pushes[0] < 0 else "" if pushes[0] else "nothing begins within the activation distance"
    action = f"with gaps of {outside[0]:.4g} and {outside[1]:.4g}, and halved from {gap:.4g} on"
    numbers = check_all(values, {OPEN: 0.0, GROWTH: LEAST_GROWTH})
    return Measurement(numbers, broken=broken).after(action, OPEN, GROWTH)


def _halve_gap(case: Case, largest: float, length: float) -> FloatArray:
    """Return gaps, each half of the one before, down to 2^-40 of a length or to where rounding decides them."""
    end = max(2.0**-N_HALVINGS * length, ROUNDED * UNIT_ROUNDOFF * case.largest_coordinate)
    return np.array([gap for k in range(N_HALVINGS + 1) if (gap := largest * 2.0**-k) >= end])


def _forces_at(case: Case, subject: Subject, shifts: FloatArray) -> FloatArray:
    """Return the forces (k, n_nodes, dim) that push the nodes where the slave has moved by each of shifts (k, dim)."""
    states = np.repeat(case.positions[None], len(shifts), axis=0)
    states[:, : case.interface.n_slave_nodes] += shifts[:, None]
    pulls = subject.for_case(case).residual(case.interface, None, states.reshape(len(shifts), -1))
    return -pulls.reshape(states.shape)


def _growth(pushes: list[float]) -> list[float]:
    return [closer / farther if farther > 0 else 0.0 for farther, closer in pairwise(pushes)]


@Property.define(
    id="intersection-free",
    rank=33,
    family="invariants",
    quantities=(GROWTH, WORK, JUMP),
    cases=Cases.random(closing_cases),
    kinds=KINDS,
    promise=lambda traits: traits.promises.never_intersects,
    applicable=lambda traits: refuse_unstated(traits, "never_intersects", group="promises"),
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
    activation distance, or to 4096 u X, where rounding the positions begins to decide it. The force along the way, the
    mean of both sides, must grow at every halving. Its work has no bound if gap × force falls as 1/k at the k-th, to
    half of what it was half-way; with a force that goes with gap^-1/2 it falls to 2^-8.

    Then the node stands over an end of a segment, at a random gap, and steps over the normal there. The last number is
    the largest change of a nodal force over the largest force. The vertices are convex, or all but straight: there the
    slope of a distance is continuous. A barrier that weights gaps, or looks from one surface, may lack this promise.

    **Undecided.** A case whose positions are so large that no gap is left to be halved.
    """
    n_slave, normal, gap = case.interface.n_slave_nodes, normal_of(case), case.parameter("penetration")
    largest = min(gap, NEAR * case.parameter("room"))
    gaps = _halve_gap(case, largest, case.parameter(ACTIVATION))
    if len(gaps) < 3:
        return Measurement(undecided="rounding the positions decides a gap of which nothing is left to be halved")
    along = _forces_at(case, subject, np.multiply.outer(gaps - gap, normal)) @ normal
    pushes = (along[:, :n_slave].sum(axis=1) - along[:, n_slave:].sum(axis=1)) / 2
    growth, (halfway, last) = _growth(pushes.tolist()), (gaps * pushes)[[len(gaps) // 2, -1]]
    values = {GROWTH: min(growth), WORK: float(last / halfway) if halfway > 0 else 0.0}
    node, vertex, neighbour = case.parameters["closing"].astype(int)
    share = 2.0 ** -np.random.default_rng([case.seed, 5]).uniform(0, 16)
    height = max(ROUNDED**2 * UNIT_ROUNDOFF * case.largest_coordinate, largest * share)
    if height <= gap:
        tangent = case.positions[neighbour] - case.positions[vertex]
        tangent /= np.linalg.norm(tangent)
        outward = np.array([tangent[1], -tangent[0]])
        outward *= np.copysign(1.0, outward @ normal * (vertex - n_slave + 0.5))  # Towards the other surface.
        shifts = case.positions[vertex] - case.positions[node] + height * outward
        shifts = shifts + BESIDE * height * np.array([tangent, -tangent])
        both = _forces_at(case, subject, shifts if node < n_slave else -shifts)
        values[JUMP] = roundoff.ratio(float(np.ptp(both, axis=0).max()), float(np.abs(both).max()))
    measurement = Measurement(check_all(values, {GROWTH: LEAST_GROWTH, WORK: LEAST_WORK, JUMP: LARGEST_JUMP}))
    closing = describe_node(case.interface, int(node))
    measurement = measurement.after(f"{closing} at a gap of {height:.4g} beside a vertex", JUMP)
    action = f"{closing} closed from a gap of {gaps[np.argmin(growth)]:.4g} to half of it"
    return measurement.after(action, GROWTH, WORK)


def _contact_forces(formulation: CheckedFormulation, case: Case) -> FloatArray:
    """Return the residual of the nodes (n_nodes, dim): of springs, or of multipliers that are all 1."""
    state = FrozenState.with_multiplier(formulation, case, 0.0)
    whole = unit_forces(state).sum(axis=1) if state.case.n_multipliers else state.forces
    return whole.reshape(case.interface.nodes.shape)


def _pull_of_points(state: FrozenState) -> tuple[float, float] | None:
    """Return the largest negative pressure over the largest of all, and its tolerance; None without points."""
    if not state.has_points:
        return None
    pressure = state.points.pressure[np.isfinite(state.points.pressure)]
    largest, pull = (float(np.max(sign * pressure, initial=0.0)) for sign in (1, -1))
    tolerance = roundoff.segment_tolerance(state.case, state.residual, state.case.largest_coordinate)
    return pull / max(largest, pull) if pull else 0.0, tolerance


@_define(
    id="nodal-push",
    rank=135,
    turn=4,
    quantities=(PULL_OF_NODE,),
    promise=lambda traits: traits.promises.nodes_push,
    usual_undecided=0.003,
)
def nodal_push(case: Case, subject: Subject) -> Measurement:
    """Every node is pushed, none is pulled.

    **Question.** Is the force on each slave node one that pushes it out of the master, and the force on each master
    node one that pushes it out of the slave?

    **Why it matters.** A node that is pulled is adhesion at that node. It opens gaps that should close, makes pressures
    wavy, and lets an algorithm that releases nodes in tension go round in circles. The forces of all nodes together may
    push all the same.

    **How it is judged.** A force pushes if it is a sum of pushes along allowed normals. For a slave node these are the
    normals of the contact points on its segments, and the normals into its own body; for a master node those of all
    points, turned round. The number is the distance of the force from that cone over Σ|R|. A master node may also be
    pulled by Σ max(−ξ, ξ − 1, 0) |F| of the points on its segments: Eq. 6 leaves ξ unclipped where a foot is past the
    end. So may the nodes that a second pass takes for its master's. Where no points are reported, all normals of both
    surfaces are allowed. Multipliers press or are 0, at random. Half of the cases are flat, closed on one half and open
    on the other: there all normals are nearly one. The tolerance is u(8X/min(g, ℓ) + 4N).

    Dual shape functions are negative in places and may pull. A formulation says so by the trait `nodes_push`: False
    needs a witness, and None promises nothing, so that a right dual mortar method of a stranger is not accused. The
    pressures of contact points are judged for all formulations, by `unilateral`.

    **Undecided.** A failing case is undecided where every node that is pulled belongs to a segment of the master round
    a corner: the neighbour of the one that a point faces, turned by more than 60°. Where an area of competence reaches
    round such a corner, a part of its force has its foot far past the ends of the neighbour, and Eq. 6 leaves that ξ
    unclipped, too. Points do not report their parts. Where no points are reported, it is undecided as well if master
    nodes alone are pulled, or any nodes where the traits leave room for two passes.

    **Source.** Zavarise & De Lorenzis (2009), Eq. 6.
    """
    opened = _open_all_but_one_end(case, HALF) if "penetration" in case.parameters else case
    formulation, case = prepare_state(opened, subject)
    if case.n_multipliers:  # About half of them are 0: any that are not negative may occur.
        pressing = np.random.default_rng([case.seed, 2]).integers(0, 2, case.n_multipliers)
        case = case.with_multipliers(case.multipliers * (pressing if pressing.any() else 1))
    state = FrozenState.at(formulation, case)
    size = roundoff.sum_larger_forces(case, state.forces)
    if not size:
        return Measurement([PULL_OF_NODE.check(0.0, 0.0)], idle=True)
    from scipy.optimize import nnls  # It takes long to import, and the first rows of a run do not need it.

    normals, allowance = allowed_pushes(state)
    # The distances of forces from the sums of non-negative multiples of the normals.
    distances = [
        float(nnls(np.array(sorted(normals[node])).T, force)[1]) if normals[node] else float(np.linalg.norm(force))
        for node, force in enumerate(-state.forces)
    ]
    pulls = np.array(distances) - allowance
    tolerance = roundoff.segment_tolerance(case, state.forces, case.largest_coordinate)
    pulled = set(np.flatnonzero(pulls > tolerance * size).tolist())
    undecided = _excuse_pulls(state, pulled, subject.traits) if pulled else ""
    action = f"lifted until {HALF:g} of the slave is open, " if "penetration" in case.parameters else ""
    action += f"{describe_node(case.interface, int(pulls.argmax()))} is pulled by {pulls.max():.4g}"
    return Measurement([PULL_OF_NODE.check(max(0.0, float(pulls.max())) / size, tolerance)], undecided).after(action)


def _excuse_pulls(state: FrozenState, pulled: set[int], traits: Traits) -> str:
    if pulled <= _nodes_round_corners(state):
        return "a point faces the master beside a corner, and parts of its force may lie round it"
    twice = traits.promises.unbiased or may_act_twice(traits)
    first_master = 0 if twice else state.case.interface.n_slave_nodes
    if not state.has_points and min(pulled) >= first_master:
        part = "segment" if state.case.interface.dim == PLANE else "face"
        return f"a foot may lie outside its {part}; provide contact_points, and this can be judged"
    return ""


def _nodes_round_corners(state: FrozenState) -> set[int]:
    """Return the nodes of all master segments that a point faces beside a corner of more than 60°."""
    nodes: set[int] = set()
    for each in state.passes if state.has_points and state.case.interface.dim == PLANE else ():
        master = each.interface.master
        for segment, normal in zip(each.points.master_segment, each.points.normal, strict=True):
            for neighbour in master.neighbours[segment] if segment >= 0 else ():
                along = np.diff(each.positions[master.segments[neighbour]], axis=0)[0]
                outward = np.array([along[1], -along[0]]) / np.hypot(*along)  # The body is on the left.
                if neighbour >= 0 and normal @ outward < CORNER:
                    nodes.update(each.numbers[master.segments[neighbour]].tolist())
    return nodes


def allowed_pushes(state: FrozenState) -> tuple[dict[int, set[Direction]], FloatArray]:
    """Return the directions in which each node may be pushed, and the force (n_nodes,) by which it may be pulled."""
    interface, positions = state.case.interface, state.case.positions
    normals: dict[int, set[Direction]] = defaultdict(set)
    allowance = np.zeros(interface.n_nodes)
    sides = [_inward_normals(side, positions) for side in (interface.slave, interface.master)]
    for node, normal in chain(*sides):
        normals[node].add(normal)
    if state.has_points:
        for each in state.passes:
            _allow_points(each, normals, allowance)
        return normals, allowance
    # Without points each node is allowed all normals of both surfaces that push it out of the other one.
    on_slave, on_master = ({normal for _, normal in side} for side in sides)
    out_of_master, out_of_slave = on_slave | _turn_round(on_master), on_master | _turn_round(on_slave)
    for node in range(interface.n_nodes):
        normals[node] |= out_of_master if node < interface.n_slave_nodes else out_of_slave
    return normals, allowance


def _inward_normals(side: Surface, positions: FloatArray) -> list[tuple[int, Direction]]:
    """Return (node, unit normal into its own body) of all corners of every segment or face."""
    if positions.shape[1] == PLANE:
        along = positions[side.segments[:, 1]] - positions[side.segments[:, 0]]
        inward = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    else:
        inward = -turns_of(positions[side.faces]).sum(axis=1)
        inward /= np.linalg.norm(inward, axis=1)[:, None]
    directions = map(tuple, inward.tolist())
    return [(node, normal) for corners, normal in zip(side.faces.tolist(), directions, strict=True) for node in corners]


def _turn_round(directions: Iterable[Direction]) -> set[Direction]:
    return {tuple(-component for component in direction) for direction in directions}


def _allow_points(each: Pass, normals: dict[int, set[Direction]], allowance: FloatArray) -> None:
    """Add what the points of a pass allow to the nodes that carry them and to the nodes opposite.

    A master node may be pulled by max(−ξ, ξ − 1, 0) |F|, in space by the most negative shape function times |F|.
    """
    directed: BoolArray = np.asarray(np.isfinite(each.points.normal).all(axis=1))
    points, numbers = each.points.select(directed), each.numbers
    slave, master = each.interface.slave.faces, each.interface.master.faces
    on_slave, on_master = points.slave_shape, points.master_shape
    if each.interface.dim == PLANE:
        on_slave = np.stack([1 - points.c, 1 + points.c], axis=1) / 2
    if not on_master.shape[1]:
        on_master = np.stack([1 - points.xi, points.xi], axis=1)
    for segment, shape, normal in zip(points.slave_segment.tolist(), on_slave, points.normal.tolist(), strict=True):
        if segment >= 0:  # A point that is a node lies on all segments that meet there.
            node = slave[segment, (shape == 1).argmax()]
            carriers = slave[(slave == node).any(axis=1)] if (shape == 1).any() else slave[segment]
            for carrier in np.unique(carriers):
                normals[int(numbers[carrier])].add(tuple(normal))
    carriers = slave[points.slave_segment[points.slave_segment >= 0]].reshape(-1)
    pushing = _turn_round(normal for node in np.unique(numbers[carriers]) for normal in normals[int(node)])
    for node in np.unique(numbers[master]):
        normals[int(node)] |= pushing
    past = np.maximum(0.0, -on_master.min(axis=1))
    counted = ~points.weighted & np.isfinite(past)  # A weighted node has no foot.
    pulls = np.where(counted, past * np.abs(points.pressure * points.weight), 0.0)
    for segment, pull in zip(points.master_segment.tolist(), pulls, strict=True):
        if segment >= 0:
            allowance[numbers[master[segment]]] += pull


@Property.define(
    id="unilateral.overhang",
    family="invariants",
    rank=323,
    role="trait",
    quantities=(OPEN,),
    cases=Cases.random(open_end_cases),
    promise=lambda traits: traits.promises.opens_at_ends,
    applicable=lambda traits: refuse_unstated(traits, "opens_at_ends", group="promises"),
)
def unilateral_overhang(case: Case, subject: Subject) -> Measurement:
    """No force acts across an open gap where one surface ends under a segment of the other.

    **Question.** A straight slave is tilted over a flat master that ends under one of its segments. The gap is open
    wherever one faces the other. Is there no force?

    **Why it matters.** Dual shapes on the covered part of a segment extrapolate the gap to the node past the end. Where
    the gap grows inwards, that may be negative, and springs push across an open gap. Dual shapes of the whole segment
    do worse: their integrals over a part may be negative. No uniform gap shows either. The cure is to weight gaps with
    standard shapes, and to keep dual ones for pressures.

    **How it is judged.** The number is the largest entry of the residual over ε̂ L², with all multipliers 0; it must be
    0. The master covers 1e-3 to 1 of a segment. The gap is at least 0.05 times slope times longest segment, so that it
    is open where a foot may lie past an end, too: how far past counts is a choice.

    **Undecided.** Never.

    **Source.** Popp, Seitz, Gee & Wall (2013).
    """
    state = FrozenState.with_multiplier(subject.for_case(case), case, 0.0)
    number = OPEN.check(float(np.abs(state.residual).max()) / (case.penalty * case.slave_measure**2), 0.0)
    forces = -state.forces
    worst = worst_force(case.interface, forces, 0 * forces, ("force", "needed")) if forces.any() else None
    return Measurement([number], finding=worst)
