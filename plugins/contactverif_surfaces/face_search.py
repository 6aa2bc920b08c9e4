"""Find the cells: the pairs of a slave and a master face that overlap, and the corners of each overlap.

A slave face and a master face make a cell where, seen along the slave's normal,

1. they face each other: the master's corners run the other way round;
2. they overlap: the master face, clipped by the edges of the slave face, keeps at least three corners.

Any distance will do, so a master behind another one is touched too. A corner of a cell is two integers (i, j): slave
corner i is (i, −1), master corner j is (−1, j), and (i, j) is the crossing of slave edge i and master edge j. The
master is numbered in reverse, so that both run counter-clockwise.

Two edges cross only if each end lies beyond the other edge by more than `TIE` × size × length of that edge. Otherwise
the place of a crossing would be a quotient of two roundoffs: meshes that share an edge have many such pairs.

Rule for the next editor: this file makes decisions. It returns integers, never a real number.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.geometry.compiled import compile_maker

MOST_CORNERS = 9  # Two quadrilaterals overlap in eight corners at most, and the clip may count one twice.
TIE = 32 * UNIT_ROUNDOFF  # The share of the size that counts as a distance from an edge.


@compile_maker
def find_face_cells(x: FloatArray, slave: IntArray, master: IntArray) -> tuple[IntArray, IntArray]:
    """Return the faces (n_cells, 2) and the corners (n_cells, MOST_CORNERS, 2) of all cells.

    Positions x are (n_nodes, 3). The last corner of a cell is repeated.
    """
    n_slave_corners, n_master_corners = slave.shape[1], master.shape[1]
    room, count = 8 * (len(slave) + len(master)), 0
    faces, corners = np.empty((room, 2), np.int64), np.empty((room, MOST_CORNERS, 2), np.int64)
    seen_slave, seen_master = np.empty((n_slave_corners, 2)), np.empty((n_master_corners, 2))
    for s in range(len(slave)):
        along, across = slave_axes(x, slave[s])
        origin = x[slave[s, 0]]
        for i in range(n_slave_corners):
            arm = x[slave[s, i]] - origin
            seen_slave[i, 0], seen_slave[i, 1] = np.sum(arm * along), np.sum(arm * across)
        for m in range(len(master)):
            for j in range(n_master_corners):
                arm = x[master[m, n_master_corners - 1 - j]] - origin
                seen_master[j, 0], seen_master[j, 1] = np.sum(arm * along), np.sum(arm * across)
            if not may_overlap(seen_slave, seen_master):
                continue
            if count == room:
                room *= 2
                faces, corners = lengthen(faces, corners, room)
            if clip_face(seen_slave, seen_master, corners[count]):
                faces[count, 0], faces[count, 1] = s, m
                count += 1
    return faces[:count].copy(), corners[:count].copy()


@compile_maker
def lengthen(faces: IntArray, corners: IntArray, room: int) -> tuple[IntArray, IntArray]:
    """Return copies of both arrays with room for more cells."""
    more_faces, more_corners = np.empty((room, 2), np.int64), np.empty((room, MOST_CORNERS, 2), np.int64)
    more_faces[: len(faces)], more_corners[: len(corners)] = faces, corners
    return more_faces, more_corners


@compile_maker
def slave_axes(x: FloatArray, face: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the axes of a slave face in its plane: along its first edge, and across it."""
    if len(face) == 3:
        normal = np.cross(x[face[1]] - x[face[0]], x[face[2]] - x[face[0]])
    else:
        normal = np.cross(x[face[2]] - x[face[0]], x[face[3]] - x[face[1]])
    normal = normal / np.sqrt(np.sum(normal * normal))
    edge = x[face[1]] - x[face[0]]
    along = edge - np.sum(edge * normal) * normal
    along = along / np.sqrt(np.sum(along * along))
    return along, np.cross(normal, along)


@compile_maker
def may_overlap(slave: FloatArray, master: FloatArray) -> bool:
    """Return whether the boxes of two faces, seen in the plane, overlap, and the master faces the slave."""
    for axis in range(2):
        if master[:, axis].min() > slave[:, axis].max() or master[:, axis].max() < slave[:, axis].min():
            return False
    turn = 0.0
    for j in range(len(master)):
        k = (j + 1) % len(master)
        turn += master[j, 0] * master[k, 1] - master[j, 1] * master[k, 0]
    return turn > 0


@compile_maker
def clip_face(slave: FloatArray, master: FloatArray, corners: IntArray) -> bool:
    """Clip the master face by the slave face; write the corners of the rest, and return whether any is left.

    `labels` tell which edge leaves a corner: master edge j is j, slave edge i is −1 − i.
    """
    places, clipped = np.empty((2 * MOST_CORNERS, 2)), np.empty((2 * MOST_CORNERS, 2))
    codes, new_codes = np.empty((2 * MOST_CORNERS, 2), np.int64), np.empty((2 * MOST_CORNERS, 2), np.int64)
    labels, new_labels = np.empty(2 * MOST_CORNERS, np.int64), np.empty(2 * MOST_CORNERS, np.int64)
    size, count = max(np.abs(slave).max(), np.abs(master).max()), len(master)
    for j in range(count):
        places[j], labels[j] = master[j], j
        codes[j, 0], codes[j, 1] = -1, j
    for i in range(len(slave)):
        start, edge = slave[i], slave[(i + 1) % len(slave)] - slave[i]
        tie = -TIE * size * np.sqrt(edge[0] * edge[0] + edge[1] * edge[1])
        n_left = 0
        for v in range(count):
            w = (v + 1) % count
            here = edge[0] * (places[v, 1] - start[1]) - edge[1] * (places[v, 0] - start[0])
            there = edge[0] * (places[w, 1] - start[1]) - edge[1] * (places[w, 0] - start[0])
            if here >= tie:
                clipped[n_left], new_codes[n_left] = places[v], codes[v]
                new_labels[n_left] = -1 - i if here <= -tie and there < tie else labels[v]
                n_left += 1
            if cross_edge(here, there, -tie):
                clipped[n_left] = places[v] + here / (here - there) * (places[w] - places[v])
                set_crossing(new_codes[n_left], i, labels[v], len(slave))
                new_labels[n_left] = -1 - i if here >= tie else labels[v]
                n_left += 1
        if n_left < 3:
            return False
        count = n_left
        places[:count], codes[:count], labels[:count] = clipped[:count], new_codes[:count], new_labels[:count]
    for v in range(len(corners)):
        corners[v] = codes[min(v, count - 1)]
    return True


@compile_maker
def cross_edge(here: float, there: float, tie: float) -> bool:
    """Return whether the ends of an edge lie beyond another edge, each by more than a tie, on different sides.

    An end within the tie is a corner itself: a crossing there would be a quotient of two roundoffs.
    """
    return (here > tie and there < -tie) or (here < -tie and there > tie)


@compile_maker
def set_crossing(code: IntArray, i: int, label: int, n_corners: int) -> None:
    """Write the code of the crossing of slave edge i and the edge with a label: two slave edges cross at a corner."""
    if label >= 0:
        code[0], code[1] = i, label
    else:
        other = -1 - label
        code[0] = i if (other + 1) % n_corners == i else (i + 1) % n_corners
        code[1] = -1
