"""The way from each slave node to the master: how far a mesh is open, for states and loads that close it."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Interface, Surface

STEEPEST_FACING = 0.5  # The cosine of 60°: two surfaces whose normals differ more from opposite ones do not face.
# The normals of a half disk have a mean of 0.64, of half a sphere 0.5; those of a ring or a sphere have none.
ONE_SIDED = 0.5


def ways_to_master(interface: Interface) -> tuple[FloatArray, FloatArray]:
    """Return how far each slave node (n_slave_nodes,) is from the master, and the unit vector (n, 2) along which.

    Nodes look along the mean normal of the slave; around a ring each looks along its own. The way is a length, negative
    where the node is inside the master, and infinite where the node does not see the master.
    """
    directions = _directions(interface)
    pairs = zip(interface.nodes[: interface.n_slave_nodes], directions, strict=True)
    return np.array([_way_along(interface, point, direction) for point, direction in pairs]), directions


def mean_normal(surface: Surface, nodes: FloatArray) -> FloatArray:
    """Return the mean normal (2,) out of the body, weighted by length: shorter than 1 where the surface is bent."""
    along = np.diff(nodes[surface.segments], axis=1)[:, 0]
    normal: FloatArray = np.array([along[:, 1].sum(), -along[:, 0].sum()]) / np.hypot(*along.T).sum()
    return normal


def _directions(interface: Interface) -> FloatArray:
    """Return the unit vector (n_slave_nodes, 2) out of the slave along which each of its nodes looks."""
    surface, nodes = interface.slave, interface.nodes
    mean, normals = mean_normal(surface, nodes), np.zeros((interface.n_slave_nodes, 2))
    if np.hypot(*mean) > ONE_SIDED:
        normals[:] = mean / np.hypot(*mean)
        return normals
    along = np.diff(nodes[surface.segments], axis=1)[:, 0]
    for end in surface.segments.T:
        np.add.at(normals, end, np.column_stack([along[:, 1], -along[:, 0]]))
    lengths = np.hypot(*normals.T)[:, None]
    normals /= np.where(lengths > 0, lengths, 1.0)
    return normals


def _way_along(interface: Interface, point: FloatArray, direction: FloatArray) -> float:
    """Return the shortest way, forwards or backwards, from a point (2,) to a master segment that faces it."""
    first, second = np.moveaxis(interface.nodes[interface.master.segments], 1, 0)
    along, apart = second - first, first - point
    facing = direction[0] * along[:, 1] - direction[1] * along[:, 0]  # −|along| where the normals oppose each other.
    facing = np.where(facing < -STEEPEST_FACING * np.hypot(*along.T), facing, np.nan)
    place = (direction[1] * apart[:, 0] - direction[0] * apart[:, 1]) / facing
    ways = (along[:, 1] * apart[:, 0] - along[:, 0] * apart[:, 1]) / facing
    ways = ways[(place >= 0) & (place <= 1)]
    return float(ways[np.argmin(np.abs(ways))]) if len(ways) else np.inf
