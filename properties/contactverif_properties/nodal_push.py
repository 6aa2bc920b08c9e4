"""Ask whether contact pushes every single node.

**Question.** Is the force on each slave node one that pushes it out of the master, and the force on each master node
one that pushes it out of the slave?

**Why it matters.** A node that is pulled is adhesion at that node. It opens gaps that should close, makes pressures
wavy, and lets an algorithm that releases nodes in tension go round in circles. The forces of all nodes together may
push all the same.

**How it is judged.** A force pushes if it is a sum of pushes along allowed normals. For a slave node these are the
normals of the contact points on its segments, and the normals into its own body; for a master node those of all
points, turned round. The number is the distance of the force from that cone over Σ|R|. A master node may also be
pulled by Σ max(−ξ, ξ − 1, 0) |F| of the points on its segments: Eq. 6 leaves ξ unclipped where a foot is past the end.
So may the nodes that a second pass takes for its master's. Where no points are reported, all normals of both surfaces
are allowed. Multipliers press or are 0, at random. Half of the cases are flat, closed on one half and open on the
other: there all normals are nearly one. The
tolerance is u(8X/min(g, ℓ) + 4N).

Dual shape functions are negative in places and may pull. A formulation says so by the trait `nodes_push`: False needs a
witness, and None promises nothing, so that a right dual mortar method of a stranger is not accused. The pressures of
contact points are judged for all formulations, by `unilateral`.

**Undecided.** A failing case is undecided where every node that is pulled belongs to a segment of the master round a
corner: the neighbour of the one that a point faces, turned by more than 60°. Where an area of competence reaches round
such a corner, a part of its force has its foot far past the ends of the neighbour, and Eq. 6 leaves that ξ unclipped,
too. Points do not report their parts.

**Source.** Zavarise & De Lorenzis (2009), Eq. 6.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from scipy.optimize import nnls

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import Surface
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif_properties.shared.any_state import prepare_state
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.openings import ANY_SHAPE, FLAT, open_all_but_one_end, pushing_cases
from contactverif_properties.shared.passes import Pass, split_passes
from contactverif_properties.shared.roundoff import (
    SEGMENT_REASON,
    SEGMENT_TOLERANCE,
    segment_tolerance,
    sum_larger_forces,
)

CORNER = 0.5  # The cosine of 60°: beyond, a foot along the normal of a point may lie far past the ends of a neighbour.
CLOSED = 0.5  # The share of a flat slave that is closed: points and shapes of all formulations find contact there.
PULL = Quantity("pull of a node", "1", SEGMENT_TOLERANCE, SEGMENT_REASON)


def measure_nodal_push(case: Case, subject: Subject) -> Measurement:
    """Measure how far the force on a node is from one that pushes.

    Parameters
    ----------
    case : Case
        A case of `pushing_cases`. A flat one is opened but for one end.
    subject : Subject
        The formulation.

    Returns
    -------
    Measurement
        The largest pull of a node over Σ|R| of a side, dimensionless.
    """
    opened = open_all_but_one_end(case, CLOSED) if "penetration" in case.parameters else case
    formulation, state = prepare_state(opened, subject)
    if state.n_multipliers:
        state = state.with_multipliers(release_some(state))
    pairing = formulation.pair(state.interface, state.z)
    residual = formulation.residual(state.interface, pairing, state.z)[: state.interface.n_unknowns]
    size = sum_larger_forces(state, residual)
    if not size:
        return Measurement([PULL.check(0.0, 0.0)], idle=True)
    forces = -residual.reshape(-1, 2)
    normals, allowance = allowed_pushes(formulation, state)
    pulls = np.array([_distance_from_cone(normals[node], force) - allowance[node] for node, force in enumerate(forces)])
    tolerance = segment_tolerance(state, residual, state.largest_coordinate)
    pulled = set(np.flatnonzero(pulls > tolerance * size).tolist())
    undecided = ""
    if pulled and pulled <= _nodes_round_corners(formulation, state):
        undecided = "a point faces the master beside a corner, and parts of its force may lie round it"
    return Measurement([PULL.check(max(0.0, float(pulls.max())) / size, tolerance)], undecided)


def _nodes_round_corners(formulation: CheckedFormulation, state: Case) -> set[int]:
    """Return the nodes of all master segments that a point faces beside a corner of more than 60°."""
    if "contact_points" not in formulation.provides:
        return set()
    pairing = formulation.pair(state.interface, state.z)
    nodes: set[int] = set()
    for each in split_passes(state, formulation.contact_points(state.interface, pairing, state.z)):
        master = each.interface.master
        for segment, normal in zip(each.points.master_segment, each.points.normal, strict=True):
            for neighbour in master.neighbours[segment] if segment >= 0 else ():
                along = np.diff(each.positions[master.segments[neighbour]], axis=0)[0]
                outward = np.array([along[1], -along[0]]) / np.hypot(*along)  # The body is on the left.
                if neighbour >= 0 and normal @ outward < CORNER:
                    nodes.update(each.numbers[master.segments[neighbour]].tolist())
    return nodes


def release_some(state: Case) -> FloatArray:
    """Return the multipliers (n_multipliers,) of a state, about half of them 0: any that are not negative may occur."""
    random = np.random.default_rng([state.seed, 2])
    pressing = random.integers(0, 2, state.n_multipliers)
    return state.multipliers * (pressing if pressing.any() else 1)


def allowed_pushes(formulation: CheckedFormulation, state: Case) -> tuple[dict[int, list[FloatArray]], FloatArray]:
    """Return the directions in which each node may be pushed, and the force (n_nodes,) by which it may be pulled.

    Parameters
    ----------
    formulation : CheckedFormulation
        The formulation; its contact points are used if it reports them.
    state : Case
        A complete state.
    """
    interface, positions = state.interface, state.positions
    normals: dict[int, list[FloatArray]] = defaultdict(list)
    allowance = np.zeros(interface.n_nodes)
    for side in (interface.slave, interface.master):
        for node, normal in _inward_normals(side, positions):
            normals[node].append(normal)
    if "contact_points" not in formulation.provides:
        _allow_everything(state, normals)
        return normals, allowance
    pairing = formulation.pair(interface, state.z)
    for each in split_passes(state, formulation.contact_points(interface, pairing, state.z)):
        _allow_points(each, normals, allowance)
    return normals, allowance


def _inward_normals(side: Surface, positions: FloatArray) -> list[tuple[int, FloatArray]]:
    """Return (node, unit normal into its own body, which is on the left) of both ends of every segment."""
    along = positions[side.segments[:, 1]] - positions[side.segments[:, 0]]
    inward = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    return [(node, normal) for ends, normal in zip(side.segments.tolist(), inward, strict=True) for node in ends]


def _allow_everything(state: Case, normals: dict[int, list[FloatArray]]) -> None:
    """Allow each node all normals of both surfaces that push it out of the other one."""
    interface = state.interface
    on_slave = [normal for _, normal in _inward_normals(interface.slave, state.positions)]
    on_master = [normal for _, normal in _inward_normals(interface.master, state.positions)]
    for node in range(interface.n_nodes):
        sign = 1 if node < interface.n_slave_nodes else -1
        normals[node] += [sign * normal for normal in on_slave] + [-sign * normal for normal in on_master]


def _allow_points(each: Pass, normals: dict[int, list[FloatArray]], allowance: FloatArray) -> None:
    """Add what the points of a pass allow to the nodes that carry them and to the nodes opposite."""
    directed: BoolArray = np.asarray(np.isfinite(each.points.normal).all(axis=1))
    points = each.points.select(directed)
    slave, master = each.interface.slave.segments, each.interface.master.segments
    for segment, c, normal in zip(points.slave_segment.tolist(), points.c.tolist(), points.normal, strict=True):
        if segment < 0:
            continue
        segments = {segment}
        if abs(c) == 1:  # The point is a node, and so on both of its segments.
            segments |= {int(each.interface.slave.neighbours[segment, int(c > 0)])} - {-1}
        for node in np.unique(slave[list(segments)]):
            normals[int(each.numbers[node])].append(normal)
    carriers = slave[points.slave_segment[points.slave_segment >= 0]].reshape(-1)
    pushing = [normal for node in np.unique(each.numbers[carriers]) for normal in normals[int(node)]]
    for node in np.unique(each.numbers[master]):
        normals[int(node)] += [-normal for normal in pushing]
    for segment, pull in zip(points.master_segment.tolist(), _pull_past_ends(points), strict=True):
        if segment >= 0:
            allowance[each.numbers[master[segment]]] += pull


def _pull_past_ends(points: ContactPoints) -> FloatArray:
    """Return max(−ξ, ξ − 1, 0) |F| of each point (n_points,); 0 for weighted nodes, which have no foot."""
    past = np.maximum(0.0, np.maximum(-points.xi, points.xi - 1.0))
    pulls: FloatArray = np.where(points.weighted | np.isnan(past), 0.0, past * np.abs(points.pressure * points.weight))
    return pulls


def _distance_from_cone(normals: list[FloatArray], force: FloatArray) -> float:
    """Return the distance of a force from the sums of non-negative multiples of the normals."""
    return float(nnls(np.unique(np.array(normals), axis=0).T, force)[1]) if normals else float(np.hypot(*force))


NODAL_PUSH = Property(
    id="nodal-push",
    family="invariants",
    summary="Every node is pushed, none is pulled.",
    quantities=(PULL,),
    cases=pushing_cases,
    kinds=(FLAT, ANY_SHAPE),
    measure=measure_nodal_push,
    promise=lambda traits: traits.nodes_push,
    applicable=refuse_barrier,
    usual_undecided=0.002,  # Six of 3960 cases of right formulations, round corners of the master.
)
