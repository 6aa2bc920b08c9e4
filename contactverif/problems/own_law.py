"""The law of a formulation that states `law="own"`, as it is on one flat pair whose inner nodes meet.

A case is asked with the penalty at which the pressure there, at the depth of the case, is ε̂ |g|. So what is exact for
springs is exact for any law, on any mesh under a uniform pressure: all but a factor, which no property sees.
"""

from dataclasses import replace
from itertools import pairwise, product

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.case import BODIES, FORCE_LENGTH, OWN_PENALTY, Case
from contactverif.contract.interface import PLANE, TRIANGLE, Interface, Surface
from contactverif.contract.subject import Subject

_N_TRIALS = 8  # A pressure in proportion to the penalty takes one.
_SAME = 2.0**-44  # A pressure this near to the wanted one, relatively, is the same but for roundoff.
_STEP = 2.0**-17  # The motion of nodes, over the shortest segment, that shows how forces change.
_SLOPE_STEP = 2.0**-10  # The same of a depth, over the depth.
_N_DIRECTIONS = 2
_DEPTH = 2.0**-10  # The depth at which springs press on bodies, over the shortest segment.


def fit_to_law(case: Case, subject: Subject) -> Case:
    """Return a case with the penalty and the length that a law of its own needs; that of another law as it is.

    A scene, and a state that does not say how deep it is, get the penalty of a small depth, or the penalty that it has.
    """
    if not subject.traits.rules.own_law:
        return case
    has_bodies = any(name.startswith(BODIES) for name in case.parameters)
    if has_bodies or "penetration" in case.parameters:
        depth = _DEPTH * case.shortest_segment if has_bodies else case.parameter("penetration")
        penalty = penalty_for(case, subject, case.penalty, depth)
        case = replace(case, parameters={**case.parameters, OWN_PENALTY: np.array(penalty)})
    if has_bodies:
        return case
    return replace(case, parameters={**case.parameters, FORCE_LENGTH: np.array(_force_length(case, subject))})


def penalty_for(case: Case, subject: Subject, penalty: float, depth: float) -> float:
    """Return the penalty at which the pressure on the pair at a depth is that of linear springs, penalty × depth."""
    wanted = penalty * depth
    for _ in range(_N_TRIALS):
        pressure = _pressure(case, subject, penalty, depth)
        if not pressure > 0 or abs(pressure / wanted - 1) <= _SAME:
            break
        penalty *= wanted / pressure
    return penalty


def stiffness_at(case: Case, subject: Subject, penalty: float, depth: float) -> float:
    """Return the change of the pressure on the pair over that of the depth."""
    step = _SLOPE_STEP * depth
    deeper, higher = (_pressure(case, subject, penalty, depth + way) for way in (step, -step))
    return (deeper - higher) / (2 * step)


def is_nonlinear(case: Case, subject: Subject) -> bool:
    """Return whether the pressure on the pair, at the depth of a case, is not twice that at half of it."""
    depth = case.parameter("penetration")
    whole, half = (_pressure(case, subject, case.penalty, share * depth) for share in (1.0, 0.5))
    return abs(whole - 2 * half) > (_SAME + 64 * UNIT_ROUNDOFF * case.diameter / depth) * abs(whole)


def _pressure(case: Case, subject: Subject, penalty: float, depth: float) -> float:
    """Return the pressure on the pair, whose shortest and longest segments are those of the case, at a depth."""
    mesh, dim = case.interface, case.interface.dim
    stretch = (case.slave_measure / float(mesh.slave.measures(mesh.nodes).sum())) ** (1 / (dim - 1))
    short = min(float(side.heights(mesh.nodes).min()) for side in (mesh.slave, mesh.master))
    long = float(mesh.slave.measures(mesh.nodes).max()) ** (1 / (dim - 1))
    places = np.cumsum([-long, long, short, long, long])
    (slave, of_slave), (master, of_master) = _flat(places[1:4], mesh), _flat(places, mesh)
    of_master = of_master[:, ::-1]
    pair = Interface(np.vstack([slave, master]), Surface(of_slave), Surface(of_master + len(slave)))
    positions = stretch * pair.nodes
    positions[: len(slave), -1] -= depth
    formulation, z = subject.with_penalty(penalty), positions.reshape(-1)
    forces = formulation.residual(pair, formulation.pair(pair, z), z).reshape(positions.shape)
    nodes = pair.nodes if subject.traits.rules.area == "reference" else positions
    return -float(forces[: len(slave), -1].sum() / pair.slave.measures(nodes).sum())


def _flat(places: FloatArray, mesh: Interface) -> tuple[FloatArray, IntArray]:
    """Return nodes (n, dim) at height 0 with these ascending places along each axis, and what faces down there."""
    count = len(places)
    if mesh.dim == PLANE:
        return np.column_stack([places, 0 * places]), np.array(list(pairwise(range(count))))
    nodes = np.array([(x, y, 0.0) for x, y in product(places, repeat=2)])
    corners = [a * count + b for a, b in product(range(count - 1), repeat=2)]
    faces = np.array([(node, node + 1, node + count + 1, node + count) for node in corners])
    return nodes, np.vstack([faces[:, :3], faces[:, [0, 2, 3]]]) if mesh.slave.faces.shape[1] == TRIANGLE else faces


def _force_length(case: Case, subject: Subject) -> float:
    """Return the length over which forces change by as much as they are, half of it where gaps alone count."""
    formulation, n, shortest = subject.for_case(case), case.interface.n_unknowns, case.shortest_segment
    pairing, step = formulation.pair(case.interface, case.z), _STEP * shortest
    moves = step * np.random.default_rng([case.seed, 5]).uniform(-1, 1, (_N_DIRECTIONS, n))
    places = np.vstack([case.z, case.z + moves, case.z - moves])
    here, *moved = formulation.residual(case.interface, pairing, places)
    ahead, behind = np.split(np.array(moved), 2)
    change = float(np.abs(ahead - behind).sum(axis=1).max()) / (2 * step)
    return min(shortest, float(np.abs(here).sum()) / (2 * change)) if change > 0 else shortest
