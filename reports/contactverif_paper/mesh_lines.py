"""Turns the mesh of a body into few long lines, so that the drawing of a fine mesh stays a small file."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.body import Body

_STRAIGHT = 0.7  # The least cosine between two edges of the same line.


def mesh_lines(body: Body, box: FloatArray, tolerance: float) -> list[FloatArray]:
    """Return polylines (n_points, 2) along the edges of a body's cells.

    Parameters
    ----------
    body : Body
        The body, undeformed.
    box : FloatArray, shape (2, 2)
        Lower left and upper right corner; cells that lie outside are left out.
    tolerance : float
        Points that lie nearer than this to the line between their neighbours are left out, a length.
    """
    corners = body.nodes[body.cells]
    inside = (corners.max(axis=1) >= box[0]).all(axis=1) & (corners.min(axis=1) <= box[1]).all(axis=1)
    cells = body.cells[inside]
    pairs = np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = np.unique(np.sort(pairs, axis=1), axis=0)
    return [thin_out(body.nodes[chain], tolerance) for chain in _chains(body.nodes, edges)]


def thin_out(points: FloatArray, tolerance: float) -> FloatArray:
    """Return the polyline without the points that lie within the tolerance of the line through the others."""
    if len(points) < 3:
        return points
    chord = points[-1] - points[0]
    offsets = points - points[0]
    length = float(np.hypot(*chord))
    if length > 0:
        distances = np.abs(chord[0] * offsets[:, 1] - chord[1] * offsets[:, 0]) / length
    else:
        distances = np.hypot(*offsets.T)
    farthest = int(distances.argmax())
    if distances[farthest] <= tolerance:
        return points[[0, -1]]
    return np.vstack([thin_out(points[: farthest + 1], tolerance)[:-1], thin_out(points[farthest:], tolerance)])


def _chains(nodes: FloatArray, edges: IntArray) -> list[list[int]]:
    """Join edges that follow each other about straight; each edge is in one chain."""
    edges_at: defaultdict[int, list[int]] = defaultdict(list)
    for number, (a, b) in enumerate(edges.tolist()):
        edges_at[a].append(number)
        edges_at[b].append(number)
    remaining = set(range(len(edges)))
    chains = []
    for number in range(len(edges)):
        if number not in remaining:
            continue
        remaining.discard(number)
        a, b = edges[number].tolist()
        chain = [a, b]
        _extend(chain, nodes, edges, edges_at, remaining)
        chain.reverse()
        _extend(chain, nodes, edges, edges_at, remaining)
        chains.append(chain)
    return chains


def _extend(
    chain: list[int], nodes: FloatArray, edges: IntArray, edges_at: dict[int, list[int]], remaining: set[int]
) -> None:
    """Lengthen the chain at its end, taking edges from those that remain."""
    while True:
        before, end = chain[-2], chain[-1]
        direction = nodes[end] - nodes[before]
        best, best_cosine, target = -1, _STRAIGHT, -1
        for number in edges_at[end]:
            if number not in remaining:
                continue
            a, b = edges[number].tolist()
            other = b if a == end else a
            step = nodes[other] - nodes[end]
            cosine = float(direction @ step / (np.hypot(*direction) * np.hypot(*step)))
            if cosine > best_cosine:
                best, best_cosine, target = number, cosine, other
        if best < 0:
            return
        remaining.discard(best)
        chain.append(target)
