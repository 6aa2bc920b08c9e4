"""States for a barrier: the surfaces of a random state are taken apart, to a gap within the activation distance.

The slave's nodes go back along their own normals, all by the same way but for a tenth of the activation distance, until
the nearest ones are 0.3 to 0.7 of it away. So a flat slave stays straight, a ring becomes a smaller one, and no node
stands exactly over another.

Rule for the next editor: a state that is lifted stays as it is when it is lifted again, or no stored case could be
judged again.
"""

from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import ACTIVATION, LEAST_GAP, Case
from contactverif.contract.interface import PLANE, Interface, Surface
from contactverif.contract.property import CLOSED_CHAIN
from contactverif.contract.traits import Traits

LEAST, LARGEST = 0.3, 0.7  # The range of the least gap over the activation distance.
FLAT_LARGEST = 0.5  # A uniform gap is then no farther from 0 than from the activation distance.
UNEVEN = 0.1  # The largest part of the activation distance by which one node goes back farther than another.
N_TRIALS = 120  # Heights that are tried, by growing steps and then by halving.
STRIDE = 1.4  # Each step over the one before; twice as long, a step would turn a small ring inside out.
NOT_LIFTED = "the surfaces cannot be taken apart to a gap within the activation distance"


def activation_distance(interface: Interface, traits: Traits) -> float:
    """Return the largest distance at which a barrier pushes, or a law of its own begins, a length."""
    activation = (traits.rules.law_distance if traits.rules.own_law else traits.rules.activation) or 0.0
    if traits.rules.activation_unit == "length":
        return activation
    return activation * min(float(side.heights(interface.nodes).min()) for side in (interface.slave, interface.master))


def fit_to_traits(case: Case, traits: Traits) -> tuple[Case, str]:
    """Return a state as a formulation with these traits takes it, and why it takes none, or an empty string."""
    if case.interface.dim != PLANE:
        return case, ""
    if traits.abilities.chains == "open" and any(map(_is_closed, (case.interface.slave, case.interface.master))):
        return case, CLOSED_CHAIN
    if traits.rules.enforcement != "barrier" or ACTIVATION in case.parameters:
        return case, ""
    lifted = _lift_flat(case, traits) if "direction" in case.parameters else _lift(case, traits)
    return (lifted, "") if lifted is not None else (case, NOT_LIFTED)


def _lift_flat(case: Case, traits: Traits) -> Case | None:
    """Return a flat case with a uniform gap, its "penetration" then; None if rounding would change it."""
    activation = activation_distance(case.interface, traits)
    gap = activation * np.random.default_rng([case.seed, 4]).uniform(LEAST, FLAT_LARGEST)
    if case.largest_coordinate * UNIT_ROUNDOFF > 2.0**-20 * gap:
        return None
    along, positions = case.parameters["direction"], case.positions.copy()
    height = (case.parameter("penetration") + gap) * np.array([-along[1], along[0]])
    positions[: case.interface.n_slave_nodes] += height
    flat = replace(case, parameters={**case.parameters, "penetration": np.array(gap)})
    return _place_apart(flat, positions, gap, activation)


def _lift(case: Case, traits: Traits) -> Case | None:
    """Return a case with its surfaces apart, the least gap within the activation distance; None if there is none."""
    slave, activation = case.interface.slave, activation_distance(case.interface, traits)
    away = -_node_normals(slave, case.positions)[: case.interface.n_slave_nodes]
    lifted = _lift_along(away, case, activation)
    if lifted is None and _is_closed(slave):  # A ring of few nodes does not fit into another one as it is.
        rays = case.positions[: len(away)] - case.positions[case.interface.master.nodes].mean(axis=0)
        outwards = np.copysign(1.0, (rays * away).sum())
        lifted = _lift_along(outwards * rays / np.linalg.norm(rays, axis=1).max(), case, activation)
    return lifted


def _lift_along(away: FloatArray, case: Case, activation: float) -> Case | None:
    """Return a case whose slave nodes went along vectors (n_slave_nodes, 2) until the surfaces are apart, or None."""
    interface, random = case.interface, np.random.default_rng([case.seed, 4])
    target = activation * random.uniform(LEAST, LARGEST)
    uneven = UNEVEN * activation * random.uniform(0, 1, len(away))
    low, high, step, height = -np.inf, np.inf, activation / 4, 0.0
    for _ in range(N_TRIALS):
        positions = case.positions.copy()
        positions[: len(away)] += (height + uneven)[:, None] * away
        gap = least_distance(interface, positions)
        if LEAST * activation <= gap <= LARGEST * activation and abs(gap - target) <= UNEVEN * activation:
            return _place_apart(case, positions, gap, activation)
        if gap < target:
            low, height = height, (height + high) / 2 if np.isfinite(high) else height + step
        else:
            high, height = height, (low + height) / 2 if np.isfinite(low) else height - step
        step *= STRIDE
    return None


def _place_apart(case: Case, positions: FloatArray, gap: float, activation: float) -> Case:
    parameters = {**case.parameters, LEAST_GAP: np.array(gap), ACTIVATION: np.array(activation)}
    return replace(case, z=positions.reshape(-1), parameters=parameters)


def least_distance(interface: Interface, positions: FloatArray) -> float:
    """Return the least distance of the two surfaces at positions (n_nodes, 2).

    It is 0 where they cross, and negative where one has passed the other: the nearest point lies behind.
    """
    (nodes, master), (other_nodes, slave) = _facing(interface, positions)
    if _cross(slave, master):
        return 0.0
    return min(_node_distance(nodes, master), _node_distance(other_nodes, slave), key=abs)


def activation_margin(case: Case) -> float:
    """Return how far, as a length, the nearest of all distances between a node and a segment is from the activation.

    There the forces of a barrier begin, with a jump in the rate at which their slope changes.
    """
    activation = case.parameter(ACTIVATION)
    pairs = _facing(case.interface, case.positions)
    return min(float(np.abs(_distances(*pair)[0] - activation).min()) for pair in pairs)


def _facing(interface: Interface, positions: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return the nodes (n, 2) of each side with the segments (m, 2, 2) of the other one."""
    sides = interface.slave, interface.master
    return [(positions[here.nodes], positions[other.segments]) for here, other in (sides, sides[::-1])]


def _node_distance(points: FloatArray, segments: FloatArray) -> float:
    """Return the least distance of points (n, 2) from segments (m, 2, 2), negative where that point is behind."""
    run = segments[:, 1] - segments[:, 0]
    distances, way = _distances(points, segments)
    point, segment = np.unravel_index(int(distances.argmin()), distances.shape)
    front = way[point, segment, 0] * run[segment, 1] - way[point, segment, 1] * run[segment, 0]
    return float(distances[point, segment]) * (1.0 if front >= 0 else -1.0)


def _distances(points: FloatArray, segments: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the distances (n, m) of points from segments, and the ways (n, m, 2) from the nearest places there."""
    first, run = segments[:, 0], segments[:, 1] - segments[:, 0]
    way = points[:, None] - first
    size = (run**2).sum(axis=1)
    along = np.divide((way * run).sum(axis=2), size, out=np.zeros(way.shape[:2]), where=size > 0)
    way = way - np.clip(along, 0.0, 1.0)[..., None] * run
    return np.linalg.norm(way, axis=2), way


def _cross(slave: FloatArray, master: FloatArray) -> bool:

    def sides(line: FloatArray, points: FloatArray) -> FloatArray:
        run = (line[:, 1] - line[:, 0])[:, None, None]
        way = points[None] - line[:, 0][:, None, None]
        turns: FloatArray = run[..., 0] * way[..., 1] - run[..., 1] * way[..., 0]  # (lines, others, ends)
        return turns[..., 0] * turns[..., 1]

    return bool(((sides(slave, master) <= 0) & (sides(master, slave).T <= 0)).any())


def _node_normals(surface: Surface, positions: FloatArray) -> FloatArray:
    """Return the unit normals (n_nodes, 2) out of the body, the mean of those of a node's segments; 0 of others."""
    first, second = positions[surface.segments[:, 0]], positions[surface.segments[:, 1]]
    run = (second - first) / np.linalg.norm(second - first, axis=1)[:, None]
    normals = np.zeros_like(positions)
    for end in (0, 1):
        np.add.at(normals, surface.segments[:, end], np.column_stack([run[:, 1], -run[:, 0]]))
    size = np.linalg.norm(normals, axis=1)[:, None]
    return np.asarray(np.divide(normals, size, out=np.zeros_like(normals), where=size > 0))


def _is_closed(surface: Surface) -> bool:
    first = surface.chain_order[surface.chain_starts]
    return bool((surface.neighbours[first, 0] >= 0).any())
