"""Two states that have the same answer: mirrored, in other units, in other numbers, beside other bodies.

Each state is one case. `Carry` says which node of the second state is which node of the first, and how vectors go over.
Multipliers are uniform, so that their order does not matter; only the rows of positions are compared. Tangents are
compared where the traits call them exact.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from hypothesis.strategies import SearchStrategy
from scipy import linalg

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case, Cases, random_source
from contactverif.contract.errors import NonFiniteError
from contactverif.contract.interface import PLANE, QUADRILATERAL, TRIANGLE, Interface, Surface, unit_normals
from contactverif.contract.property import WITH_BARRIER, WITHOUT_BARRIER, Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.oracle.kink_distance import default_points
from contactverif.oracle.nearest import nearest_segments
from contactverif.strategies import smooth_cases
from contactverif.strategies.general import closed_cases
from contactverif.strategies.straight import bent_end_cases, cases_over_a_body, plane_cases_by_a_plate
from contactverif.strategies.surfaces import smooth_surface_cases, surface_cases
from contactverif_properties import roundoff
from contactverif_properties.applicability import may_act_twice, refuse_unstated
from contactverif_properties.exact_forces import worst_force
from contactverif_properties.kinks import explain_by_kink
from contactverif_properties.states import FrozenState, any_cases, ask_forces_and_tangents, freeze_state

TOLERANCE = "u(8Z/min(g, ℓ) + 4N)"
CHANGED = ("force then", "before")  # The forces after a change of the case, and as it is drawn.
SHARE = 0.1875  # A uniform multiplier over the shortest segment, with c = 1: as large as a penetration would be.
BITS = "entries with other bits"
TIE = "a tie: a point in the normal cone of a vertex is as near to one segment as to another"


@dataclass(frozen=True, slots=True)
class Carry:
    """The way in which the first of two states becomes the second."""

    nodes: IntArray  # (n_nodes,) The number, in the second state, of each node of the first.
    # (dim, dim) What becomes of vectors: a force f becomes matrix · f.
    matrix: FloatArray = field(default_factory=lambda: np.eye(2))


def _same_answer(situation: str) -> tuple[Quantity, Quantity]:
    """Return the quantities of `compare`, the changes of forces and tangent; `situation` ends their names."""
    return (
        Quantity(f"change of the forces {situation}", TOLERANCE, roundoff.SEGMENT_REASON),
        Quantity(f"change of the tangent {situation}", TOLERANCE, roundoff.SEGMENT_REASON),
    )


def _ask(case: Case, subject: Subject, penalty: float, multiplier: float) -> tuple[FrozenState, FloatArray, FloatArray]:
    """Return a state with uniform multipliers if there are any, its forces (n_nodes, dim) and tangent."""
    formulation, n = subject.with_penalty(penalty), case.interface.n_unknowns
    if formulation.n_multipliers(case.interface):
        formulation = subject.with_penalty(1.0)
    state = FrozenState.with_multiplier(formulation, case, multiplier)
    (forces,), tangents = ask_forces_and_tangents(subject, state)
    return state, forces[:n].reshape(case.positions.shape), tangents[0][:n, :n] if tangents else np.empty((0, 0))


class _Change(NamedTuple):
    part: str  # "forces" or "tangent".
    quantity: Quantity
    change: FloatArray
    size: float  # The size that the largest change counts over, in the unit of the change.
    # (n_nodes,) The number, in the second state, of each node of the change; None where both have the same numbers.
    nodes: IntArray | None = None
    dim: int = PLANE  # The number of unknowns of a node.

    def worst_columns(self, number: int) -> IntArray:
        """Return the columns of the node, or the multiplier, with the largest change, in the first state or second."""
        n_columns = self.change.shape[-1]
        node, axes = int(np.abs(self.change).argmax()) % n_columns // self.dim, np.arange(self.dim)
        if self.nodes is not None and number > 0:
            return self.dim * int(self.nodes[node]) + axes
        return np.asarray(np.minimum(self.dim * node + axes, n_columns - 1))


def _judge_changes(
    changes: Sequence[_Change], tolerance: float, states: Iterable[FrozenState], largest: float | None = None
) -> Measurement:
    """Judge the largest changes over their sizes; undecided where a kink excuses those above the tolerance.

    Coordinates are rounded at the largest one of each state, or at a length. Without states, nothing is excused.
    """
    largest_changes = {each.part: float(np.abs(each.change).max()) for each in changes}
    values = {each.quantity: roundoff.ratio(largest_changes[each.part], each.size) for each in changes}
    failures = {each.part: each for each in changes if values[each.quantity] > tolerance}
    errors, undecided = {part: largest_changes[part] for part in failures}, ""
    for number, state in enumerate(states) if failures else ():
        columns = failures["tangent"].worst_columns(number) if "tangent" in failures else None
        reach = roundoff.COORDINATE_ROUNDING * (largest or state.case.largest_coordinate)
        undecided = undecided or explain_by_kink(state, reach, errors, columns)
    return Measurement(check_all(values, tolerance), undecided)


def _compare(
    question: Property, subject: Subject, case: Case, other: Case, carry: Carry, action: str, *, explain: bool = True
) -> Measurement:
    """Compare the answers in two states: the largest change of a force over Σ|R| of a side, of an entry over max|K|.

    `action` says what made the second state of the first. If the forces are finite in one of them alone, that is said.
    The sizes are the larger of both states. The detail `BITS` counts entries that are not equal to the last bit.
    """
    penalty, multiplier = subject.penalty(case), SHARE * case.resolution
    answers: dict[str, tuple[FrozenState, FloatArray, FloatArray]] = {}
    flaws: list[str] = []
    for words, state in (("as drawn", case), (action, other)):
        try:
            answers[words] = _ask(state, subject, penalty, multiplier)
        except NonFiniteError as error:
            flaws.append(f"{error}, {words}")
    if flaws:
        raise NonFiniteError("; finite ".join([flaws[0], *answers]))
    (first, forces, tangent), (second, forces_there, tangent_there) = answers.values()
    size = max(roundoff.sum_larger_forces(case, forces), roundoff.sum_larger_forces(other, forces_there))
    changes = [_Change("forces", question.quantities[0], forces_there[carry.nodes] - forces @ carry.matrix.T, size)]
    if tangent.size:
        dim = case.interface.dim
        places = (dim * carry.nodes[:, None] + np.arange(dim)).reshape(-1)
        turn = np.kron(np.eye(len(carry.nodes)), carry.matrix)
        change = tangent_there[np.ix_(places, places)] - turn @ tangent @ turn.T
        size = float(max(np.abs(tangent).max(), np.abs(tangent_there).max()))
        changes.append(_Change("tangent", question.quantities[1], change, size, carry.nodes, dim))
    distance = max(roundoff.rounding_distance(state, subject.traits) for state in (case, other))
    tolerance = roundoff.segment_tolerance(case, forces, distance)
    measurement, finding = _judge_changes(changes, tolerance, [first, second] if explain else []), None
    fails = any(number.value > number.tolerance for number in measurement.numbers)
    if explain and fails and not measurement.undecided:
        # A point that is active in one state may be tied to a segment for which it is open, and be open in the other.
        measurement = replace(measurement, undecided=_find_tie(first) or _find_tie(second))
    if measurement.numbers[0].ratio > 1:
        finding = worst_force(case.interface, forces_there[carry.nodes] @ carry.matrix, forces, CHANGED)
    details = {BITS: float(sum(np.count_nonzero(each.change) for each in changes))}
    idle = not (forces.any() or forces_there.any())
    return replace(measurement, details=details, idle=idle).after(action, finding=finding)


def _find_tie(state: FrozenState) -> str:
    """Return why either of two segments is right for a point, or an empty string if none is tied.

    A point in the normal cone of a re-entrant vertex is equally near to both segments there, wherever it is. By the
    rule "the nearest segment" alone, a formulation may take the one with the lower number.
    """
    interface, positions = state.case.interface, state.case.positions
    if interface.dim != PLANE:
        return ""
    if state.has_points:
        passes = [(each.interface, each.positions, each.points.position[each.points.active]) for each in state.passes]
    else:
        segment, c, _, _ = default_points(interface)
        first, second = np.swapaxes(positions[interface.slave.segments[segment]], 0, 1)
        share = (1 + c[:, None]) / 2
        passes = [(interface, positions, (1 - share) * first + share * second)]
    for interface, nodes, places in passes:
        for x, y in places[np.isfinite(places).all(axis=1)].tolist():
            near = nearest_segments(nodes, interface.master.segments, (x, y)).segments
            open_point = all(segment.signed_squared_gap > 0 for segment in near)
            if len(near) > 1 and (not open_point or state.case.n_multipliers):  # Multipliers may push across a gap.
                return TIE
    return ""


ANY, CLOSED = "any mesh, numbered at random", "closed rings, the seam elsewhere"
FAR, BEHIND = "a far pair of bodies", "a body behind the master"
MOST_NUMBERS = 12  # So many new numbers of nodes are said.
DISTANCE = 64.0  # The distance of the far pair over the diameter of the state.
PLATES = {
    TRIANGLE: np.array([[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]]),
    QUADRILATERAL: np.array([[0, 3, 2, 1], [4, 5, 6, 7]]),
}  # The faces of a plate's lower and upper side.


def renumber(case: Case, nodes: IntArray, slave: IntArray, master: IntArray) -> tuple[Case, Carry]:
    """Return a case with other numbers.

    The new number of each node is `nodes` (n_nodes,), slave nodes before those of the master. The segments or faces
    (n_faces, n_corners) of both sides have the old numbers of nodes.
    """
    interface, old = case.interface, np.argsort(nodes)
    renumbered = Interface(interface.nodes[old], Surface(nodes[slave]), Surface(nodes[master]))
    return replace(case, interface=renumbered, z=case.positions[old].reshape(-1)), Carry(nodes, np.eye(interface.dim))


_define = partial(
    Property.define,
    family="invariants",
    cases=Cases.random(smooth_cases),
    cases_in_space=Cases.random(smooth_surface_cases),
    asks=WITH_BARRIER,
)


@_define(id="mirror", rank=120, role="comparison", quantities=_same_answer("in the mirror image"))
def mirror(case: Case, subject: Subject) -> Measurement:
    """The mirror image of a state has the mirror image of its forces and of its tangent.

    **Question.** A random state is mirrored, and its segments run the other way, so that the bodies stay on the left.
    Are the forces and the tangent the old ones, mirrored?

    **Why it matters.** Left and right are alike in mechanics. A formulation that treats the first node of a segment
    otherwise than the second, or walks one way only, gives an unsymmetric answer to a symmetric part.

    **How it is judged.** A coordinate changes its sign, which rounds nothing. Changes of the forces count over Σ|R| of
    the slave, those of a tangent that is called exact over max|K|. The tolerance is u(8Z/min(g, ℓ) + 4N), because sums
    run the other way. Multipliers are uniform, because their order may change.

    **Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X
    changes the answer by a quarter of the error or more. On an exact bisector, and in the normal cone of a re-entrant
    vertex, a point is as near to one segment as to another, and the mirror image may choose the other.
    """
    interface, signs = case.interface, np.where(np.arange(case.interface.dim) == 0, -1.0, 1.0)
    sides = (Surface(side.faces[:, ::-1]) for side in (interface.slave, interface.master))
    image = Interface(interface.nodes * signs + 0.0, *sides)  # No zero becomes −0.
    there = replace(case, interface=image, z=(case.positions * signs + 0.0).reshape(-1))
    carry = Carry(np.arange(interface.n_nodes), np.diag(signs))
    return _compare(mirror, subject, case, there, carry, "mirrored from x to −x")


@_define(
    id="swap",
    rank=400,
    role="trait",
    quantities=_same_answer("with roles exchanged"),
    promise=lambda traits: traits.promises.unbiased,
)
def swap(case: Case, subject: Subject) -> Measurement:
    """Slave and master may exchange their roles.

    **Question.** The slave of a random state becomes the master, and the master the slave. Are the forces on each node
    the old ones?

    **Why it matters.** An analyst must choose one surface as the slave, and in a stack of bodies or in self-contact no
    choice is natural. A formulation without that choice promises `unbiased`. All others give another answer, by as much
    as the detail says.

    **How it is judged.** As in `mirror`. The penalty stays the same number, also for nodal springs.

    **Undecided.** As in `mirror`, for a formulation that promises `unbiased`.
    """
    interface, unbiased = case.interface, bool(subject.traits.promises.unbiased)
    nodes = np.roll(np.arange(interface.n_nodes), -interface.n_slave_nodes).argsort()
    swapped = renumber(case, nodes, interface.master.faces, interface.slave.faces)
    return _compare(swap, subject, case, *swapped, "with slave and master exchanged", explain=unbiased)


@random_source("contactverif_properties.renumbering.renumbering_cases")
def renumbering_cases(
    interface: Interface | None = None,
) -> dict[str, SearchStrategy[Case]] | SearchStrategy[Case] | None:
    """Return meshes of any kind and closed rings; states of a given interface."""
    return {ANY: smooth_cases(), CLOSED: closed_cases()} if interface is None else smooth_cases(interface)


@_define(
    id="renumbering",
    rank=130,
    role="comparison",
    quantities=_same_answer("in other numbers"),
    cases=Cases.random(renumbering_cases),
    kinds=(ANY, CLOSED),
)
def renumbering(case: Case, subject: Subject) -> Measurement:
    """Other numbers of nodes and segments, or another seam of a closed chain, change nothing.

    **Question.** Nodes and segments of a random state get other numbers. On closed rings the numbers go round, so that
    the seam, where the last segment meets the first, is elsewhere. In space each face begins at another one of its
    corners, too. Are the forces on each node the old ones?

    **Why it matters.** A mesh generator numbers as it likes. A formulation that takes the next number for the next
    segment is right on one mesh and wrong on the same mesh from another program, or at the one seam of a ring.

    **How it is judged.** As in `mirror`: sums run in another order, and that of multipliers changes.

    **Undecided.** As in `mirror`: where a point is as near to one segment as to another, the number of a segment may
    decide. In the normal cone of a re-entrant vertex the state is asked again, with other numbers of nodes alone.
    """
    interface, random = case.interface, np.random.default_rng([case.seed, 2])

    def order(count: int) -> IntArray:
        numbers: IntArray = np.arange(count)
        if case.kind == CLOSED:
            return np.roll(numbers, int(random.integers(1, count)))
        return random.permutation(numbers)

    n_slave = interface.n_slave_nodes
    nodes = np.concatenate([order(n_slave), n_slave + order(interface.n_nodes - n_slave)])
    slave, master = interface.slave.faces, interface.master.faces
    if interface.dim != PLANE:  # Which corner of a face is the first has no meaning.
        slave, master = (_roll_corners(faces, random) for faces in (slave, master))
    renumbered = renumber(case, nodes, slave[order(len(slave))], master[order(len(master))])
    numbers = ", ".join(map(str, nodes[:MOST_NUMBERS])) + (" …" if len(nodes) > MOST_NUMBERS else "")
    action = f"with the numbers {numbers} for nodes 0, 1, 2 …"
    measurement = _compare(renumbering, subject, case, *renumbered, f"{action} and segments in another order")
    if measurement.undecided != TIE:
        return measurement
    # The numbers of segments may decide a tie. Those of nodes still must not matter.
    return _compare(renumbering, subject, case, *renumber(case, nodes, slave, master), action)


def _roll_corners(faces: IntArray, random: np.random.Generator) -> IntArray:
    places = np.arange(faces.shape[1]) + random.integers(faces.shape[1], size=(len(faces), 1))
    return np.take_along_axis(faces, places % faces.shape[1], axis=1)


@random_source("contactverif_properties.remote.remote_cases")
def _remote_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | SearchStrategy[Case] | None:
    if interface is not None:
        return smooth_cases(interface)
    behind = cases_over_a_body()
    assert behind is not None
    return {FAR: smooth_cases(), BEHIND: behind}


@random_source("contactverif_properties.remote.remote_surface_cases")
def _remote_surface_cases(
    interface: Interface | None = None, faces: tuple[int, ...] = (TRIANGLE,)
) -> dict[str, SearchStrategy[Case]] | None:
    far, behind = smooth_surface_cases(interface, faces), plane_cases_by_a_plate(interface, faces)
    return None if far is None or behind is None else {FAR: far, BEHIND: behind}


def _refuse_shortest_segment(traits: Traits) -> str:
    in_segments = traits.rules.own_law and traits.rules.law_distance and traits.rules.activation_unit == "segment"
    return "the law begins at a share of the shortest segment, which another body may have" if in_segments else ""


@_define(
    id="remote",
    rank=137,
    role="comparison",
    quantities=_same_answer("beside another body"),
    cases=Cases.random(_remote_cases),
    cases_in_space=Cases.random(_remote_surface_cases),
    kinds=(FAR, BEHIND),
    asks=WITHOUT_BARRIER,  # The bodies that are added penetrate each other.
    applicable=_refuse_shortest_segment,
)
def remote(case: Case, subject: Subject) -> Measurement:
    """A body that touches nothing, far away or behind the master, changes nothing.

    **Question.** A pair of bodies, in contact with each other, is added far from a random state. Or a second body is
    added behind the master, where no slave point comes near it. Are forces and tangent those of before?

    **Why it matters.** Parts of an assembly that do not touch have nothing to do with each other. A formulation that
    scales its springs by the mean element size, or searches on the first surface that a line meets, couples them.

    **How it is judged.** Changes of the forces on the old nodes count over Σ|R| of the slave, those of a tangent that
    is called exact over max|K|. The penalty stays the same number. The tolerance is u(8Z/min(g, ℓ) + 4N) with the size
    Z of the whole, because a right formulation may subtract the mean of all nodes first. The detail counts entries that
    are not equal bit by bit: 0 for each formulation that looks only at nodes near contact. In space half of the far
    pairs have the first numbers of nodes and faces, and the other half the last. A body at the slave's back is asked
    there only where the traits say that springs act in one pass.

    **Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X
    changes the answer by a quarter of the error or more.
    """
    if "behind" in case.parameters:
        slave, master = (side.faces for side in (case.interface.slave, case.interface.master))
        nothing = np.empty((0, case.interface.dim)), slave[:0]
        parts = nothing, _as_part(case.parameters["behind"], master.shape[1])
        first, name = False, BEHIND
        way = case.parameters["behind"].mean(axis=0) - case.positions[slave].mean(axis=(0, 1))
        at_the_back = case.interface.dim != PLANE and way @ unit_normals(case.positions[slave])[0] < 0
        if at_the_back and may_act_twice(subject.traits):
            return Measurement()  # Its points lie inside the slave's body, which a second pass looks at.
    else:  # Multipliers of a plane case keep their places.
        parts, first, name = _make_far_pair(case), case.interface.dim != PLANE and case.seed % 2 == 1, FAR
    return _compare(remote, subject, case, *_add_parts(case, *parts, first=first), f"beside {name}")


_Part = tuple[FloatArray, IntArray]  # The nodes (n, dim) of a part of a surface, and its faces by their places there.


def _make_far_pair(case: Case) -> tuple[_Part, _Part]:
    """Return a slave and a master of one face each, that penetrate each other far from a state."""
    random, length = np.random.default_rng([case.seed, 3]), case.shortest_segment
    if case.interface.dim == PLANE:
        angle = random.uniform(-np.pi, np.pi)
        direction = np.array([np.cos(angle), np.sin(angle)])
        slave, master = np.array([[0.0, -0.125], [1.0, -0.25]]), np.array([[2.0, 0.0], [-1.0, 0.0]])
    else:
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        slave = np.array([[0.0, 0.0, -0.125], [0.0, 1.0, -0.125], [1.0, 0.0, -0.25]])
        master = np.array([[-1.0, -1.0, 0.0], [3.0, -1.0, 0.0], [-1.0, 3.0, 0.0]])
    origin = case.positions.mean(axis=0) + DISTANCE * case.diameter * direction
    sides = (slave, case.interface.slave), (master, case.interface.master)
    first, second = (_as_part(origin + length * nodes, side.faces.shape[1]) for nodes, side in sides)
    return first, second


def _as_part(nodes: FloatArray, corners: int) -> _Part:
    """Return a part with these nodes: a chain as it is walked, a triangle, a parallelogram, or a plate."""
    if nodes.shape[1] == PLANE:
        return nodes, np.column_stack([np.arange(len(nodes) - 1), np.arange(1, len(nodes))])
    if len(nodes) > TRIANGLE:
        return nodes, PLATES[corners]
    fourth = [nodes[0] + nodes[2] - nodes[1]] if corners == QUADRILATERAL else []
    return np.vstack([nodes, *fourth]), np.arange(corners)[None]


def _add_parts(case: Case, slave: _Part, master: _Part, *, first: bool = False) -> tuple[Case, Carry]:
    """Return a case with one more part on each side, and the new numbers of its nodes."""
    interface, n_slave = case.interface, case.interface.n_slave_nodes
    parts = np.split(np.arange(interface.n_nodes), [n_slave])
    more = np.split(interface.n_nodes + np.arange(len(slave[0]) + len(master[0])), [len(slave[0])])
    sides = zip(more, parts, strict=True) if first else zip(parts, more, strict=True)
    order = np.concatenate([numbers for side in sides for numbers in side])
    number = np.argsort(order)  # The new number of each node: of the old ones, then of the new parts.

    def join(nodes: FloatArray) -> FloatArray:
        return np.asarray(np.vstack([nodes, slave[0], master[0]])[order])

    def surface(old: Surface, part: _Part, at: int) -> Surface:
        faces = [number[old.faces], number[part[1] + at]]
        return Surface(np.vstack(faces[::-1] if first else faces))

    n_all = interface.n_nodes
    both = surface(interface.slave, slave, n_all), surface(interface.master, master, n_all + len(slave[0]))
    state = replace(case, interface=Interface(join(interface.nodes), *both), z=join(case.positions).reshape(-1))
    return state, Carry(number[:n_all], np.eye(interface.dim))


@Property.define(
    id="locality.bend",
    rank=260,
    family="invariants",
    quantities=_same_answer("after a bend elsewhere"),
    cases=Cases.random(bent_end_cases),
    promise=lambda traits: traits.promises.local,
)
def locality_bend(case: Case, subject: Subject) -> Measurement:
    """A bend of the master's unloaded neighbours changes neither forces nor tangent.

    **Question.** A slave lies on a flat part of the master. The unloaded segments on both sides of that part turn about
    its ends by −0.3 to 0.9 rad. Are forces and tangent those of before?

    **Why it matters.** Contact acts between what touches. A formulation that makes its springs softer where the surface
    bends, by averaged normals or by an estimate of the curvature, answers for a part of the surface that carries
    nothing. On flat parts nothing shows, and at a bend every formulation may differ from every other.

    **How it is judged.** The largest change of a nodal force counts over Σ|R| of the slave, that of an entry of a
    tangent that is called exact over max|K|. The slave stays away from the ends of the flat part by more than two
    penetrations, so no point comes nearer to a bent segment than to the flat part, along any normal. The tolerance is
    u(8Z/min(g, ℓ) + 4N), because a right formulation may subtract the mean of all nodes first. Formulations that
    compare nodes of facing segments alone give 0. Smoothed masters do not promise `local`, and may say so.

    **Undecided.** A failing case is undecided where a state lies at a kink, or where moving the nodes by 64 u X changes
    the answer by a quarter of the error or more.
    """
    bent = replace(case, z=case.parameters["bent"])
    action = f"with free nodes of the master moved by up to {np.abs(bent.z - case.z).max():.4g}"
    return _compare(locality_bend, subject, case, bent, Carry(np.arange(case.interface.n_nodes)), action)


POWERS_OF_TWO = "Powers of two scale the four operations and square roots exactly. A power or an angle is rounded anew."
SCALED_FORCES = Quantity("error of the forces in another unit", TOLERANCE, POWERS_OF_TWO)
SCALED_TANGENT = Quantity("error of the tangent in another unit", TOLERANCE, POWERS_OF_TWO)
LARGEST_EXPONENT = 60
TURNED_FORCES = Quantity("error of the forces after a rotation", roundoff.SEGMENT_TOLERANCE, roundoff.SEGMENT_REASON)
TURNED_TANGENT = Quantity("error of the tangent after a rotation", roundoff.SEGMENT_TOLERANCE, roundoff.SEGMENT_REASON)


def _refuse_unknown_unit(traits: Traits) -> str:
    if not (is_barrier := traits.rules.enforcement == "barrier") and not traits.rules.own_law:
        return refuse_unstated(traits, "penalty")
    if traits.rules.activation_unit == "length" and (is_barrier or traits.rules.law_distance):
        return f"the {_force_of(traits)} begins at a length, which another unit would change"
    return "" if traits.rules.penalty_power is not None else f"the {_force_of(traits)} states no `penalty_power`"


def _force_of(traits: Traits) -> str:
    return "barrier" if traits.rules.enforcement == "barrier" else "law"


@_define(
    id="units",
    rank=180,
    role="comparison",
    turn=6,
    quantities=(SCALED_FORCES, SCALED_TANGENT),
    cases=Cases.random(any_cases),
    cases_in_space=Cases.random(surface_cases),
    applicable=_refuse_unknown_unit,
)
def units(case: Case, subject: Subject) -> Measurement:
    """Another unit of length changes nothing, so no absolute tolerance is hidden.

    **Question.** All lengths are multiplied by 2^k, for a random k from −60 to 60. Are the forces 2^k times the old
    ones, and is the tangent the same, for a penalty that changes with its unit?

    **Why it matters.** A code with an absolute tolerance hidden in it, such as 1e-6 for "touching", works in
    millimetres and fails in metres or micrometres.

    **How it is judged.** Differences of the forces count over max|R|, those of a tangent that is called exact over
    max|K|. The tolerance is u(8Z/min(g, ℓ) + 4N), where Z is the diameter of a formulation that promises
    `translation_stable`, and the largest coordinate of any other. Powers of two scale the four operations and square
    roots exactly, so a formulation that uses nothing else gives 0; a power or an angle is rounded anew. A multiplier
    stays the same if it is a pressure, in space it becomes 2^−k times as large, and it scales if it is a nodal force.
    Of a formulation with multipliers only the position rows are compared.

    **Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X
    changes the answer by a quarter of the error or more.
    """
    interface, random, dim = case.interface, np.random.default_rng(case.seed), case.interface.dim
    factor, n = 2.0 ** int(random.integers(-LARGEST_EXPONENT, LARGEST_EXPONENT + 1)), interface.n_unknowns
    distributed = subject.traits.rules.penalty == "distributed"
    state = freeze_state(case, subject)
    case, z = state.case, state.case.z
    # Forces grow with lengths here, so that a pressure on faces falls with them.
    z_there = np.concatenate([z[:n] * factor, z[n:] * factor ** (2 - dim if distributed else 1)])
    case_there = replace(case, interface=interface.at(interface.nodes * factor), z=z_there)
    penalty = 1.0 if case.n_multipliers else subject.penalty(case)
    # The power of a length in the penalty, so that forces grow with lengths and the tangent stays.
    power = float(1 - dim) if distributed else 0.0
    if subject.traits.rules.enforcement == "barrier" or subject.traits.rules.own_law:
        power = subject.traits.rules.penalty_power or 0.0
    there = FrozenState.at(subject.with_penalty(penalty * factor**power), case_there)
    (forces,), tangents = ask_forces_and_tangents(subject, state)
    (forces_there,), tangents_there = ask_forces_and_tangents(subject, there)
    forces, forces_there = forces[:n], forces_there[:n]
    changes = [_Change("forces", SCALED_FORCES, forces_there / factor - forces, float(np.abs(forces).max()))]
    if tangents:
        tangent, tangent_there = tangents[0][:n, :n], tangents_there[0][:n, :n]
        changes.append(
            _Change("tangent", SCALED_TANGENT, tangent_there - tangent, float(np.abs(tangent).max()), dim=dim)
        )
    tolerance = roundoff.segment_tolerance(case, forces, roundoff.rounding_distance(case, subject.traits))
    measurement = replace(_judge_changes(changes, tolerance, [state]), idle=not forces.any())
    return measurement.after(f"with all lengths times {factor:.4g}")


def _turn_state(case: Case) -> tuple[Case, FloatArray]:
    """Return a case with the nodes at Qx + c, and the rotation Q (dim, dim), both random by the seed of the case."""
    random = np.random.default_rng(case.seed)
    if case.interface.dim == PLANE:
        angle = random.uniform(-np.pi, np.pi)
        rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    else:  # A random quaternion.
        quaternion = random.normal(size=4)
        a, x, y, z = quaternion / np.linalg.norm(quaternion)
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        rotation = np.eye(3) + 2 * a * cross + 2 * cross @ cross
    positions = case.positions @ rotation.T + random.uniform(-1, 1, case.interface.dim) * case.diameter
    return replace(case, z=np.concatenate([positions.reshape(-1), case.multipliers])), rotation


@_define(
    id="objectivity",
    rank=132,
    role="comparison",
    turn=7,
    quantities=(TURNED_FORCES, TURNED_TANGENT),
    applicable=lambda traits: (
        "normals are those of the reference configuration" if traits.abilities.motions == "small" else ""
    ),
    usual_undecided=0.003,
)
def objectivity(case: Case, subject: Subject) -> Measurement:
    """Turning and shifting the state turns the forces and the tangent with it.

    **Question.** A random state is turned by a random angle and shifted. Are the forces and the tangent the old ones,
    turned?

    **Why it matters.** A formulation that prefers an axis gives another answer for the same part in another position in
    the assembly. In large rotations it creates energy.

    **How it is judged.** The forces R(Qx + c) are compared with Q R(x) over Σ|R| of a side, and the tangent K(Qx + c)
    with Q K Qᵀ over max|K|, if the traits call it exact. Nothing turns multipliers; their constraint rows are compared
    too. The tolerance is u(8X/min(g, ℓ) + 4N): a gap is a difference of coordinates, and rounding the ends of a segment
    turns the segment and its force by uX/ℓ. X stands here for every formulation, because the harness itself rounds the
    turned positions to uX. Where springs act twice, in two passes, half of the penetration g needs the same forces.

    **Undecided.** A failing case is undecided where either state lies at a kink, or where moving the nodes by 64 u X
    changes the answer by a quarter of the error or more.
    """
    state = freeze_state(case, subject)
    case, n = state.case, case.interface.n_unknowns
    case_there, rotation = _turn_state(case)
    there = FrozenState.at(state.formulation, case_there)
    turn = linalg.block_diag(np.kron(np.eye(case.interface.n_nodes), rotation), np.eye(case.n_multipliers))
    (forces, forces_there), tangents = ask_forces_and_tangents(subject, state, there)

    largest = max(case.largest_coordinate, case_there.largest_coordinate)
    # Where springs act twice, in two passes, half of the penetration needs the same forces.
    n_passes = len(list(state.passes)) if subject.traits.rules.area is None and state.has_points else 1
    one_pass = forces / n_passes
    tolerance = roundoff.segment_tolerance(case, one_pass, largest)
    size = roundoff.sum_larger_forces(case, forces) + float(np.abs(forces[n:]).sum())
    changes = [_Change("forces", TURNED_FORCES, forces_there - turn @ forces, size)]
    if tangents:
        tangent, tangent_there = tangents
        change = tangent_there - turn @ tangent @ turn.T
        size = float(np.abs(tangent).max())
        changes.append(_Change("tangent", TURNED_TANGENT, change, size, dim=case.interface.dim))
    # Slivers may cost more digits in one place than in the other, so that both are looked at.
    measurement = _judge_changes(changes, tolerance, [state, there], largest)
    turned = np.degrees(np.arccos(np.clip((np.trace(rotation) - rotation.shape[0] + 2) / 2, -1, 1)))
    return replace(measurement, idle=not forces[:n].any()).after(f"turned by {turned:.4g}° and shifted")
