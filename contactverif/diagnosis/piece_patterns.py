"""Tell how forces are wrong on one side alone: by the sums over pieces of segments, or by points of integration."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.diagnosis.flat_state import DEPTH, PENALTY, FlatState

# Two sizes are the same within this share of the largest. A tilt of the state by DEPTH changes them by less, and so do
# all roundings, even if forces are summed in single precision.
SAME = 1e-4
_MOST_POINTS = 4  # More are used by hardly anybody.


def of_pieces(state: FlatState, pushes: FloatArray) -> str:
    """Return what was done with the pieces on which two segments face each other, if a rule knows it."""
    return (
        _single_piece(state, pushes)
        or _piece_factors(state, pushes)
        or _halves(state, pushes)
        or _nearest_nodes(state, pushes)
        or _whole_segments(state, pushes)
        or _shifted_points(state, pushes)
    )


def _piece_factors(state: FlatState, pushes: FloatArray) -> str:
    """Return which pieces are left out, or whether a length of the master is counted, if the pieces have factors."""
    factors = np.asarray(np.linalg.lstsq(state.pieces.T, pushes, rcond=None)[0], dtype=np.float64)
    if not same(state.pieces.T @ factors, pushes):
        return ""
    of_slave = np.diff(state.along[: state.n_slave_nodes])[state.slave_segment]
    of_master = -np.diff(state.along[state.n_slave_nodes :])[state.master_segment]
    lengths = {
        "is counted, too": of_master,
        "divides the force": 1 / of_master,
        "stands where that of the slave segment belongs": of_master / of_slave,
    }
    for words, ratios in lengths.items():
        if same(factors, ratios):
            return f"the length of the master segment {words}"
    places = [
        f"slave segment {slave} on master segment {master}"
        for slave, master, factor in zip(state.slave_segment, state.master_segment, factors, strict=True)
        if abs(factor) < SAME
    ]
    rest = factors[np.abs(factors) >= SAME]
    return f"parts are left out: {', '.join(places)}" if places and same(rest, np.ones(len(rest))) else ""


def _single_piece(state: FlatState, pushes: FloatArray) -> str:
    """Return whether each wrong node has the force of one piece, or one segment, where several are to be added."""
    parts = [*state.pieces]
    for of_pieces in (state.slave_segment, state.master_segment):
        parts += [state.pieces[of_pieces == segment].sum(axis=0) for segment in np.unique(of_pieces)]
    wrong = ~equal(pushes, state.exact)
    alike = [np.abs(part - pushes) <= SAME * np.abs(state.exact).max() for part in parts]
    if not (np.any(alike, axis=0) & (pushes != 0))[wrong].all():
        return ""
    return "nodes that belong to several pieces have the force of one alone: the others are overwritten, and not added"


def _halves(state: FlatState, pushes: FloatArray) -> str:
    """Return whether both nodes of a master segment take the same force, wherever it acts."""
    n, halves = state.n_slave_nodes, np.zeros(len(pushes))
    for piece, segment in zip(state.pieces, state.master_segment, strict=True):
        halves[state.case.interface.master.segments[segment]] += piece[n:].sum() / 2
    if not same(pushes[:n], state.exact[:n]) or not same(pushes[n:], halves[n:]):
        return ""
    return "both nodes of a master segment take half of its force, wherever it acts: the shape functions are ½"


def _nearest_nodes(state: FlatState, pushes: FloatArray) -> str:
    """Return whether the whole force of a point of integration is that of the nearer node of a side."""
    interface, along, n = state.case.interface, state.along, state.n_slave_nodes
    sides = {
        "slave": (interface.slave.segments[state.slave_segment], slice(None, n)),
        "master": (interface.master.segments[state.master_segment], slice(n, None)),
    }
    for side, (segments, nodes) in sides.items():
        for n_points in range(1, _MOST_POINTS + 1):
            forces = np.zeros(len(pushes))
            for start, length, of_piece in zip(state.starts, state.lengths, segments, strict=True):
                places, weights = np.polynomial.legendre.leggauss(n_points)
                distances = np.abs(along[of_piece] - (start + (places[:, None] + 1) / 2 * length))
                np.add.at(forces, of_piece[distances.argmin(axis=1)], PENALTY * DEPTH * length * weights / 2)
            if same(pushes[nodes], forces[nodes]):
                return f"the whole force of a point of integration goes to the nearer node of the {side} segment"
    return ""


def _whole_segments(state: FlatState, pushes: FloatArray) -> str:
    """Return whether the forces are those of points of whole slave segments, which nodes of the master do not cut."""
    for n_points in range(1, _MOST_POINTS + 1):
        places, weights = np.polynomial.legendre.leggauss(n_points)
        if same(pushes, _sum_at_points(state, (places + 1) / 2, weights / 2)):
            return (
                f"the points of integration are the {n_points} of whole slave segments, not cut at the master's nodes"
            )
    return ""


def _shifted_points(state: FlatState, pushes: FloatArray) -> str:
    """Return by which share of its length the force of each piece acts beside the middle, if it is the same for all."""
    shifts = np.zeros(len(pushes))  # The change of the forces if the share is 1.
    interface, along = state.case.interface, state.along
    sides = (interface.slave.segments[state.slave_segment], interface.master.segments[state.master_segment])
    for segments in sides:
        change = PENALTY * DEPTH * state.lengths**2 / (along[segments[:, 1]] - along[segments[:, 0]])
        np.add.at(shifts, segments, np.stack([-change, change], axis=1))
    share = float(shifts @ (pushes - state.exact) / (shifts @ shifts))
    if not same(pushes, state.exact + share * shifts):
        return ""
    end = "end" if share > 0 else "start"
    return (
        f"the force of each part acts {abs(share):.3g} of its length nearer to the part's {end}: look at the places of "
        "the points of integration and at their weights"
    )


def _sum_at_points(state: FlatState, places: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the forces (n_nodes,) of a uniform pressure that is summed at places 0 to 1 of each slave segment."""
    interface, along, forces = state.case.interface, state.along, np.zeros(len(state.along))
    for nodes in interface.slave.segments:
        length = along[nodes[1]] - along[nodes[0]]
        for place, weight in zip(places, weights, strict=True):
            x = along[nodes[0]] + place * length
            shares = (x - along[interface.master.segments[:, 0]]) / np.diff(along[interface.master.segments], axis=1)[
                :, 0
            ]
            (segment,) = np.flatnonzero((shares >= 0) & (shares < 1))
            for ends, share in ((nodes, place), (interface.master.segments[segment], shares[segment])):
                forces[ends] += PENALTY * DEPTH * length * weight * np.array([1 - share, share])
    return forces


def equal(a: FloatArray, b: FloatArray) -> BoolArray:
    """Return which numbers are the same, over the largest of the second list."""
    result: BoolArray = np.abs(a - b) <= SAME * np.abs(b).max()
    return result


def same(a: FloatArray, b: FloatArray) -> bool:
    """Return whether all numbers are the same, over the largest of the second list."""
    return bool(equal(a, b).all())
