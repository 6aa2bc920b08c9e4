"""Faces of surfaces in space: how triangles and quadrilaterals hang together, how large they are, and what is wrong.

A face lists its corners counter-clockwise, seen from outside the body. Edge i runs from corner i to the next one.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.errors import MisuseError

TRIANGLE, QUADRILATERAL = 3, 4  # Numbers of corners.


def link_faces(faces: IntArray) -> IntArray:
    """Check faces (n_faces, n_corners), and return the face across each edge (n_faces, n_corners), −1 at the border.

    Raises
    ------
    MisuseError
        If a node number is negative or occurs twice in a face, an edge belongs to three faces, or the corners of two
        neighbours are listed the other way round.
    """
    _check_corners(faces)
    n_corners = faces.shape[1]
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)  # (n_faces · n_corners, 2)
    first, second = _match_edges(edges, n_corners)
    alike = np.flatnonzero((edges[first] == edges[second]).all(axis=1))
    if len(alike):
        numbers = " and ".join(str(int(places[alike[0]]) // n_corners) for places in (first, second))
        pair = f"faces {numbers}, which both run along the edge {edges[first[alike[0]]].tolist()}"
        raise MisuseError("faces", pair, "corners counter-clockwise seen from outside the body, throughout")
    neighbours = np.full(faces.size, -1)
    neighbours[first], neighbours[second] = second // n_corners, first // n_corners
    return neighbours.reshape(faces.shape)


def _check_corners(faces: IntArray) -> None:
    """Check that the corners of each face are node numbers, and different ones."""
    if faces.min() < 0:
        raise MisuseError("faces", f"node number {faces.min()}", "node numbers ≥ 0")
    twice = np.flatnonzero((np.diff(np.sort(faces, axis=1), axis=1) == 0).any(axis=1))
    if len(twice):
        corners = faces[twice[0]].tolist()
        raise MisuseError("faces", f"face {twice[0]} with the corners {corners}", "different corners")


def _match_edges(edges: IntArray, n_corners: int) -> tuple[IntArray, IntArray]:
    """Return the places of both edges of each pair that has the same two nodes, of edges (n_faces · n_corners, 2)."""
    keys, number, counts = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    number = number.reshape(-1)
    crowded = np.flatnonzero(counts > 2)
    if len(crowded):
        owners = np.flatnonzero(number == crowded[0]) // n_corners
        those = f"faces {', '.join(map(str, owners[:4]))} on the edge {keys[crowded[0]].tolist()}"
        raise MisuseError("faces", those, "a surface: at most two faces on an edge")
    order = np.argsort(number, kind="stable")
    matched = np.flatnonzero(number[order[1:]] == number[order[:-1]])
    return order[matched], order[matched + 1]


def measure_faces(corners: FloatArray) -> FloatArray:
    """Return the areas (n_faces,) of faces with corners (n_faces, n_corners, 3); a quadrilateral is a bilinear face."""
    if corners.shape[1] == TRIANGLE:
        areas: FloatArray = np.linalg.norm(turns_of(corners)[:, 0], axis=1) / 2
        return areas
    # Where the face is flat, its Jacobian is linear in either coordinate, and the rule is exact. Else it is smooth.
    places, weights = np.polynomial.legendre.leggauss(4)
    areas = np.zeros(len(corners))
    for s, weight_s in zip(places, weights, strict=True):
        for t, weight_t in zip(places, weights, strict=True):
            along_s = np.array([t - 1, 1 - t, 1 + t, -1 - t]) / 4
            along_t = np.array([s - 1, -1 - s, 1 + s, 1 - s]) / 4
            tangents = [np.einsum("a,fai->fi", shares, corners) for shares in (along_s, along_t)]
            areas += weight_s * weight_t * np.linalg.norm(np.cross(*tangents), axis=1)
    return areas


def measure_heights(corners: FloatArray) -> FloatArray:
    """Return the least distance (n_faces,) of a corner from an edge of its face that does not end there."""
    n_corners = corners.shape[1]
    heights = np.full(len(corners), np.inf)
    for edge in range(n_corners):
        start, run = corners[:, edge], corners[:, (edge + 1) % n_corners] - corners[:, edge]
        for corner in range(n_corners):
            if corner not in (edge, (edge + 1) % n_corners):
                across = np.cross(run, corners[:, corner] - start)
                heights = np.minimum(heights, np.linalg.norm(across, axis=1) / np.linalg.norm(run, axis=1))
    return heights


def turns_of(corners: FloatArray) -> FloatArray:
    """Return the cross products (n_faces, n_corners, 3) of the edge after each corner and the one before, reversed."""
    following, before = np.roll(corners, -1, axis=1), np.roll(corners, 1, axis=1)
    turns: FloatArray = np.cross(following - corners, before - corners)
    return turns


def check_faces(name: str, corners: FloatArray) -> None:
    """Check that faces with corners (n_faces, n_corners, 3) have an area and no corner that points inwards.

    Raises
    ------
    MisuseError
        If a face has no area, or a quadrilateral is not convex along its normal.
    """
    turns = turns_of(corners)
    normals = turns.sum(axis=1)
    flat = np.flatnonzero(~normals.any(axis=1))
    if len(flat):
        raise MisuseError(name, f"face {flat[0]} of no area", "corners that do not lie on one line")
    dented = np.flatnonzero((np.einsum("fci,fi->fc", turns, normals) <= 0).any(axis=1))
    if len(dented):
        dent = f"face {dented[0]}, a quadrilateral that is not convex"
        raise MisuseError(name, dent, "four corners that point outwards")
