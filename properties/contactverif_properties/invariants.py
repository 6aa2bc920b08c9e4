"""Properties about two states that a right formulation answers alike."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases, random_source
from contactverif.contract.interface import PLANE, Interface, Surface
from contactverif.contract.measurement import Measurement
from contactverif.contract.property import WITH_BARRIER, WITHOUT_BARRIER, Property
from contactverif.contract.subject import Subject
from contactverif.strategies import smooth_cases
from contactverif.strategies.rings import closed_cases
from contactverif.strategies.straight import cases_over_a_body
from contactverif.strategies.surfaces import plane_cases_by_a_plate, smooth_surface_cases
from contactverif_properties.shared.same_answer import TIE, Carry, compare, same_answer_quantities

IN_MIRROR = same_answer_quantities("in the mirror image")
WITH_ROLES_EXCHANGED = same_answer_quantities("with roles exchanged")
IN_OTHER_NUMBERS = same_answer_quantities("in other numbers")
ANY, CLOSED = "any mesh, numbered at random", "closed rings, the seam elsewhere"
FAR, BEHIND = "a far pair of bodies", "a body behind the master"
DISTANCE = 64.0  # The distance of the far pair over the diameter of the state.
PLATE = np.array([[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]])  # The faces of a plate's lower and upper side.
BESIDE_OTHERS = same_answer_quantities("beside another body")


def renumber(case: Case, nodes: IntArray, slave: IntArray, master: IntArray) -> tuple[Case, Carry]:
    """Return a case with other numbers.

    The new number of each node is `nodes` (n_nodes,), slave nodes before those of the master. The segments or faces
    (n_faces, n_corners) of both sides have the old numbers of nodes.
    """
    interface, old = case.interface, np.argsort(nodes)
    renumbered = Interface(interface.nodes[old], Surface(nodes[slave]), Surface(nodes[master]))
    return replace(case, interface=renumbered, z=case.positions[old].reshape(-1)), Carry(nodes, np.eye(interface.dim))


def mirror_case(case: Case) -> tuple[Case, Carry]:
    """Return the mirror image in the y-axis; segments run the other way, so that the body stays on the left."""
    interface = case.interface
    sides = (Surface(side.faces[:, ::-1]) for side in (interface.slave, interface.master))
    image = Interface(reflect(interface.nodes), *sides)
    return replace(case, interface=image, z=reflect(case.positions).reshape(-1)), Carry(
        np.arange(len(image.nodes)), np.diag(_mirror_signs(interface.dim))
    )


def exchange_roles(case: Case) -> tuple[Case, Carry]:
    """Return the case in which the slave is the master, and the other way round."""
    interface = case.interface
    n_slave, n_master = interface.n_slave_nodes, interface.n_nodes - interface.n_slave_nodes
    nodes = np.concatenate([n_master + np.arange(n_slave), np.arange(n_master)])
    return renumber(case, nodes, interface.master.faces, interface.slave.faces)


def reflect(points: FloatArray) -> FloatArray:
    """Return the points (n, dim), mirrored; no zero becomes −0."""
    return points * _mirror_signs(points.shape[1]) + 0.0


def _mirror_signs(dim: int) -> FloatArray:
    """Return the factors of the coordinates in the mirror: x changes its sign."""
    return np.array([-1.0, *[1.0] * (dim - 1)])


_define = partial(Property.define, family="invariants", promise=lambda traits: True, asks=WITH_BARRIER)


@_define(
    id="mirror",
    rank=120,
    role="comparison",
    quantities=IN_MIRROR,
    cases=Cases.random(smooth_cases),
    cases_in_space=Cases.random(smooth_surface_cases),
)
def mirror(case: Case, subject: Subject) -> Measurement:
    """The mirror image of a state has the mirror image of its forces and of its tangent.

    **Question.** A random state is mirrored, and its segments run the other way, so that the bodies stay on the left.
    Are the forces and the tangent the old ones, mirrored?

    **Why it matters.** Left and right are alike in mechanics. A formulation that treats the first node of a segment
    otherwise than the second, or walks one way only, gives an unsymmetric answer to a symmetric part.

    **How it is judged.** A coordinate changes its sign, which rounds nothing. Changes of the forces count over Σ|R| of
    the slave, those of the tangent over max|K|. The tolerance is u(8Z/min(g, ℓ) + 4N), because sums run the other way.
    Multipliers are uniform, because their order may change.

    **Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X
    changes the answer by a quarter of the error or more. On an exact bisector, and in the normal cone of a re-entrant
    vertex, a point is as near to one segment as to another, and the mirror image may choose the other.
    """
    return compare(IN_MIRROR, subject, case, *mirror_case(case))


@_define(
    id="swap",
    rank=400,
    role="comparison",
    quantities=WITH_ROLES_EXCHANGED,
    cases=Cases.random(smooth_cases),
    cases_in_space=Cases.random(smooth_surface_cases),
    promise=lambda traits: traits.promises.unbiased,
)
def swap(case: Case, subject: Subject) -> Measurement:
    """Slave and master may exchange their roles.

    **Question.** The slave of a random state becomes the master, and the master the slave. Are the forces on each node
    the old ones?

    **Why it matters.** An analyst must choose one surface as the slave, and in a stack of bodies or in self-contact no
    choice is natural. A formulation without that choice promises `unbiased`. All others give another answer, by as much
    as the detail says.

    **How it is judged.** Changes of the forces count over Σ|R| of the slave, those of the tangent over max|K|. The
    penalty stays the same number, also for nodal springs. The tolerance is u(8Z/min(g, ℓ) + 4N), because sums run in
    another order. Multipliers are uniform, because their order changes.

    **Undecided.** A failing case of a formulation that promises `unbiased` is undecided where the state lies at a kink,
    or where moving the nodes by 64 u X changes the answer by a quarter of the error or more.
    """
    unbiased = bool(subject.traits.promises.unbiased)
    return compare(WITH_ROLES_EXCHANGED, subject, case, *exchange_roles(case), explain=unbiased)


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
    quantities=IN_OTHER_NUMBERS,
    cases=Cases.by_kind(renumbering_cases),
    cases_in_space=Cases.random(smooth_surface_cases),
    kinds=(ANY, CLOSED),
)
def renumbering(case: Case, subject: Subject) -> Measurement:
    """Other numbers of nodes and segments, or another seam of a closed chain, change nothing.

    **Question.** Nodes and segments of a random state get other numbers. On closed rings the numbers go round, so that
    the seam, where the last segment meets the first, is elsewhere. In space each face begins at another one of its
    corners, too. Are the forces on each node the old ones?

    **Why it matters.** A mesh generator numbers as it likes. A formulation that takes the next number for the next
    segment is right on one mesh and wrong on the same mesh from another program, or at the one seam of a ring.

    **How it is judged.** Changes of the forces count over Σ|R| of the slave, those of the tangent over max|K|. The
    tolerance is u(8Z/min(g, ℓ) + 4N), because sums run in another order. Multipliers are uniform, because their order
    changes.

    **Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X
    changes the answer by a quarter of the error or more. On an exact bisector, and in the normal cone of a re-entrant
    vertex, a point is as near to one segment as to another, and the number of a segment may decide. In such a cone the
    state is asked again, with other numbers of nodes alone.
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
    measurement = compare(IN_OTHER_NUMBERS, subject, case, *renumbered)
    if measurement.undecided != TIE:
        return measurement
    # The numbers of segments may decide a tie. Those of nodes still must not matter.
    return compare(IN_OTHER_NUMBERS, subject, case, *renumber(case, nodes, slave, master))


def _roll_corners(faces: IntArray, random: np.random.Generator) -> IntArray:
    """Return faces (n_faces, n_corners) that begin at another one of their corners each."""
    n_faces, n_corners = faces.shape
    places = (np.arange(n_corners) + random.integers(n_corners, size=(n_faces, 1))) % n_corners
    return np.take_along_axis(faces, places, axis=1)


@random_source("contactverif_properties.remote.remote_cases")
def remote_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | SearchStrategy[Case] | None:
    """Return states of any kind, and straight slaves over two bodies; states of a given interface."""
    if interface is not None:
        return smooth_cases(interface)
    behind = cases_over_a_body()
    assert behind is not None
    return {FAR: smooth_cases(), BEHIND: behind}


@random_source("contactverif_properties.remote.remote_surface_cases")
def remote_surface_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | None:
    """Return the same in space; there are none on an interface of the user."""
    far, behind = smooth_surface_cases(interface), plane_cases_by_a_plate(interface)
    return None if far is None or behind is None else {FAR: far, BEHIND: behind}


@_define(
    id="remote",
    rank=190,
    role="comparison",
    quantities=BESIDE_OTHERS,
    cases=Cases.by_kind(remote_cases),
    cases_in_space=Cases.by_kind(remote_surface_cases),
    kinds=(FAR, BEHIND),
    asks=WITHOUT_BARRIER,  # The bodies that are added penetrate each other.
)
def remote(case: Case, subject: Subject) -> Measurement:
    """A body that touches nothing, far away or behind the master, changes nothing.

    **Question.** A pair of bodies, in contact with each other, is added far from a random state. Or a second body is
    added behind the master, where no slave point comes near it. Are forces and tangent those of before?

    **Why it matters.** Parts of an assembly that do not touch have nothing to do with each other. A formulation that
    scales its springs by the mean element size, or searches on the first surface that a line meets, couples them.

    **How it is judged.** Changes of the forces on the old nodes count over Σ|R| of the slave, those of the tangent over
    max|K|. The penalty stays the same number. The tolerance is u(8Z/min(g, ℓ) + 4N) with the size Z of the whole,
    because a right formulation may subtract the mean of all nodes first. The detail counts entries that are not equal
    bit by bit: 0 for each formulation that looks only at nodes near contact. In space half of the far pairs have the
    first numbers of nodes and faces, and the other half the last.

    **Undecided.** A failing case is undecided where the state lies at a kink, or where moving the nodes by 64 u X
    changes the answer by a quarter of the error or more.
    """
    if "behind" in case.parameters:
        slave, master = _no_part(case), case.parameters["behind"]
        return compare(BESIDE_OTHERS, subject, case, *add_parts(case, slave, _as_part(master)))
    first = case.interface.dim != PLANE and case.seed % 2 == 1  # Multipliers of a plane case keep their places.
    return compare(BESIDE_OTHERS, subject, case, *add_parts(case, *make_far_pair(case), first=first))


Part = tuple[FloatArray, IntArray]  # The nodes (n, dim) of a part of a surface, and its faces by their places there.


def make_far_pair(case: Case) -> tuple[Part, Part]:
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
    return _as_part(origin + length * slave), _as_part(origin + length * master)


def _as_part(nodes: FloatArray) -> Part:
    """Return a part with these nodes: a chain as it is walked, a triangle, or a plate."""
    if nodes.shape[1] == PLANE:
        return nodes, np.column_stack([np.arange(len(nodes) - 1), np.arange(1, len(nodes))])
    return nodes, PLATE if len(nodes) == 8 else np.array([[0, 1, 2]])


def _no_part(case: Case) -> Part:
    """Return a part without nodes."""
    dim = case.interface.dim
    return np.empty((0, dim)), np.empty((0, dim), np.int64)


def add_parts(case: Case, slave: Part, master: Part, *, first: bool = False) -> tuple[Case, Carry]:
    """Return a case with one more part on each side, and the new numbers of its nodes.

    The nodes of the new parts are in the same places in the reference. They come behind the others of their side, or
    `first`.
    """
    interface, n_slave = case.interface, case.interface.n_slave_nodes
    parts = np.split(np.arange(interface.n_nodes), [n_slave])
    more = np.split(interface.n_nodes + np.arange(len(slave[0]) + len(master[0])), [len(slave[0])])
    sides = zip(more, parts, strict=True) if first else zip(parts, more, strict=True)
    order = np.concatenate([numbers for side in sides for numbers in side])
    number = np.argsort(order)  # The new number of each node: of the old ones, then of the new parts.

    def join(nodes: FloatArray) -> FloatArray:
        joined: FloatArray = np.vstack([nodes, slave[0], master[0]])[order]
        return joined

    def surface(old: Surface, part: Part, at: int) -> Surface:
        faces = [number[old.faces], number[part[1] + at]]
        return Surface(np.vstack(faces[::-1] if first else faces))

    n_all = interface.n_nodes
    both = surface(interface.slave, slave, n_all), surface(interface.master, master, n_all + len(slave[0]))
    state = replace(case, interface=Interface(join(interface.nodes), *both), z=join(case.positions).reshape(-1))
    return state, Carry(number[:n_all], np.eye(interface.dim))
