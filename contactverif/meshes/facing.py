"""Two surfaces of a mesh can touch if their normals oppose each other, and no body lies between them."""

from collections.abc import Collection

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import ONE_SIDED, Interface, Surface, turns_of, unit_normals

_RAYS = 50  # So many elements of a surface look behind them.


def check_facing(interface: Interface, can_turn: Collection[str] = ("slave", "master")) -> None:
    """Refuse two surfaces whose mean normals, weighted by length or area, do not oppose each other.

    `can_turn` are those without cells beside them; the one whose body lies on the side of the other is named.
    """
    nodes, n_slave = interface.nodes, interface.n_slave_nodes
    slave, master = (mean_direction(surface, nodes) for surface in (interface.slave, interface.master))
    if slave is None or master is None or slave @ master < 0:
        return
    wrong = "slave" if slave @ (nodes[:n_slave].mean(axis=0) - nodes[n_slave:].mean(axis=0)) > 0 else "master"
    needed = f"--flip {wrong} turns that one" if wrong in can_turn else "other groups"
    places = [describe(0.0 - normal.round(3)) for normal in (slave, master)]
    actual = f"bodies on the same side: that of the slave lies towards {places[0]}, that of the master {places[1]}"
    raise MisuseError("--mesh", actual, f"two sides that face each other: {needed}")


def mean_direction(surface: Surface, nodes: FloatArray) -> FloatArray | None:
    """Return the mean normal (dim,) out of the body; None where the surface is closed, or nearly so in space."""
    if nodes.shape[1] == 3:
        turns = turns_of(nodes[surface.faces]).sum(axis=1)
        mean: FloatArray = turns.sum(axis=0) / np.linalg.norm(turns, axis=1).sum()
        return mean if np.linalg.norm(mean) >= ONE_SIDED else None
    # The normals of a closed chain sum to zero whichever way it runs. The sum over an open one telescopes.
    starts = surface.segments[surface.neighbours[:, 0] < 0, 0]
    ends = surface.segments[surface.neighbours[:, 1] < 0, 1]
    if not len(starts):
        return None
    along = nodes[ends].sum(axis=0) - nodes[starts].sum(axis=0)
    normal: FloatArray = np.array([along[1], -along[0]]) / surface.lengths(nodes).sum()
    return normal


def back_to_back(points: FloatArray, slave: IntArray, master: IntArray, boundary: IntArray) -> str:
    """Return in words where two surfaces turn their backs to each other; empty if they do not.

    Most elements of the slave see no master before them, and behind them the slave's own body ends before the master
    comes. In a shrink fit, however deep, the master comes first.

    Parameters
    ----------
    points : FloatArray, shape (n_points, dim)
        Positions.
    slave, master : IntArray, shape (n, n_corners)
        The elements of both surfaces, each with its body behind it.
    boundary : IntArray, shape (n, n_corners)
        All other elements around the bodies, and the master too if both are of one body. Where there are none, a body
        ends behind an element as far away as the element is wide.
    """
    master, boundary = _simplices(master), _simplices(boundary)
    of_master, of_boundary = unit_normals(points[master]), unit_normals(points[boundary])
    rays = slave[np.unique(np.linspace(0, len(slave) - 1, _RAYS).astype(np.int64))]
    origins, normals = points[rays].mean(axis=1), unit_normals(points[_simplices(rays)[: len(rays)]])
    votes, places = 0, ""
    for origin, normal, element in zip(origins, normals, rays, strict=True):
        ways = _ways(origin, normal, points[master])[of_master @ normal < 0]
        behind = -ways[ways < 0].max(initial=-np.inf)
        is_back = not np.isfinite(ways[ways >= 0]).any() and np.isfinite(behind)
        if is_back:
            ends = -_ways(origin, normal, points[boundary])[of_boundary @ normal < 0]
            width = np.ptp(points[element], axis=0).max()
            is_back = behind >= (ends[ends > 0].min(initial=np.inf) if len(boundary) else width)
        votes += 1 if is_back else -1
        if is_back and not places:
            there = origin - behind * normal
            places = f"the slave at {describe(origin)} and the master at {describe(there)}"
    return places if votes > 0 else ""


def describe(place: FloatArray) -> str:
    """Return a position in words."""
    return f"({', '.join(f'{part:g}' for part in place)})"


def _simplices(elements: IntArray) -> IntArray:
    """Return lines, and faces as triangles: first a triangle of each face, then the other ones of quadrilaterals."""
    return np.vstack([elements[:, :3], elements[:, [0, 2, 3]]]) if elements.shape[1] == 4 else elements


def _ways(origin: FloatArray, direction: FloatArray, corners: FloatArray) -> FloatArray:
    """Return how far along a unit vector lines or triangles are met, negative if backwards; infinity if not."""
    relative = corners - origin
    if corners.shape[2] == 2:
        weights = (relative @ [-direction[1], direction[0]])[:, ::-1] * [1, -1]
    else:
        across = np.linalg.svd(direction[None])[2][1:]  # Two unit vectors normal to the direction and to each other.
        second, third = (np.roll(relative @ across.T, -step, axis=1) for step in (1, 2))
        weights = second[..., 0] * third[..., 1] - second[..., 1] * third[..., 0]
    total = weights.sum(axis=1)
    is_met = ((weights >= 0).all(axis=1) | (weights <= 0).all(axis=1)) & (total != 0)
    return np.where(is_met, (weights * (relative @ direction)).sum(axis=1) / np.where(is_met, total, 1.0), np.inf)
