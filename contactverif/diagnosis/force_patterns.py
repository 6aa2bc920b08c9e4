"""Tell in what pattern the forces of a formulation with springs are wrong on a flat interface."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.subject import Subject
from contactverif.diagnosis.flat_state import (
    COARSE,
    DEPTH,
    FINE,
    PENALTY,
    SAME,
    FlatState,
    equal,
    flat_state,
    pushes_of,
    same,
)
from contactverif.diagnosis.other_states import (
    diagnose_balance,
    diagnose_digits,
    diagnose_law,
    diagnose_lost_places,
    diagnose_open_segment,
    diagnose_turned,
)

_MEANINGS = {  # {factor: what it may mean}
    2.0: "two passes that each have the whole penalty, or a factor 2",
    0.5: "a factor ½, such as a mean of two sides that is taken once too often",
    -1.0: "the sign",
}


def diagnose_forces(subject: Subject, *, in_full: bool = True) -> str:
    """Return what is wrong with the forces on a flat interface; empty where they are right, or no rule knows them.

    Not `in_full`, nothing is said of forces that merely are not the consistent ones: a formulation that does not
    promise the patch test may have them.
    """
    rules, patch = subject.traits.rules, subject.traits.promises.patch
    if rules.enforcement != "penalty":
        return ""
    if text := diagnose_lost_places(subject):
        return text
    if rules.penalty == "nodal" or patch.flat is False:
        return ""  # Other forces than the consistent ones are right there.
    patterns = (
        diagnose_digits,
        diagnose_law,
        partial(_diagnose_uniform, in_full=in_full),
        _diagnose_linear,
        partial(_on_other_meshes, in_full=in_full),
        diagnose_turned,
        diagnose_open_segment,
        diagnose_balance,
    )
    return next(filter(None, (pattern(subject) for pattern in patterns)), "")


def _diagnose_uniform(subject: Subject, *, in_full: bool) -> str:
    """Return the pattern of the forces of a uniform penetration, on the mesh on which no two segments are alike."""
    state = flat_state()
    forces = pushes_of(subject, state)
    if text := _uniform_pattern(state, forces, in_full=in_full):
        return text
    if np.abs(forces[:, 0]).max() > SAME * np.abs(forces[:, 1]).max():
        return "the forces have a part along the surface, where both normals are the same"
    return ""


def _diagnose_linear(subject: Subject) -> str:
    """Return the pattern of the forces of a penetration that grows along the slave."""
    state = flat_state(slope=1.0)
    pushes = pushes_of(subject, state)[:, 1]
    if same(pushes, state.exact):
        return ""
    # Other rules of integration give other forces, and are not wrong.
    return _exchange(state, pushes, master=False) or _exchange(state, pushes, master=True)


def _on_other_meshes(subject: Subject, *, in_full: bool) -> str:
    """Return the pattern on a slave that is finer than its master, or coarser."""
    for places, words in ((FINE, "finer"), (COARSE, "coarser")):
        state = flat_state(places=places)
        if text := _uniform_pattern(state, pushes_of(subject, state), in_full=in_full):
            return f"on a slave that is {words} than its master: {text}"
    return ""


def _uniform_pattern(state: FlatState, forces: FloatArray, *, in_full: bool) -> str:
    """Return the pattern of the forces of a uniform penetration; empty if they are right."""
    pushes, exact, n = forces[:, 1], state.exact, state.n_slave_nodes
    if not forces.any():
        return "there is no force at all where the surfaces penetrate"
    if same(pushes, exact):
        return ""
    text = (
        _factor(pushes, exact)
        or _node_pattern(pushes[:n], exact[:n])
        or _length_pattern(state, pushes)
        or _segment_pattern("slave", state.pieces, state.slave_segment, pushes)
        or _segment_pattern("master", state.pieces, state.master_segment, pushes)
        or _exchange(state, pushes, master=True)
    )
    if text or not in_full:
        return text or _whole_springs(pushes[:n])
    return (
        _single_piece(state, pushes)
        or _piece_factors(state, pushes)
        or _halves(state, pushes)
        or _nearest_nodes(state, pushes)
        or _whole_segments(state, pushes)
        or _shifted_points(state, pushes)
        or _whole_springs(pushes[:n])
        or _side_pattern(state, pushes)
    )


def _whole_springs(pushes: FloatArray) -> str:
    if not same(pushes, np.full(len(pushes), PENALTY * DEPTH)):
        return ""
    return "each slave node has a whole spring: ε̂ |g| without the length that belongs to the node"


def _exchange(state: FlatState, pushes: FloatArray, *, master: bool) -> str:
    nodes = slice(state.n_slave_nodes, None) if master else slice(state.n_slave_nodes)
    if not same(pushes[nodes], state.swap(master=master)[nodes]):
        return ""
    if master:
        return "the two shape functions of each master segment are exchanged: ξ where 1 − ξ belongs"
    return "the two shape functions of each slave segment are exchanged: a node has what belongs to its neighbour"


def _length_pattern(state: FlatState, pushes: FloatArray) -> str:
    """Return whether the parts of the slave's segments lack the length of their segment, or have another one."""
    factors = _factors(state.pieces, state.slave_segment, pushes)
    if factors is None:
        return ""
    lengths = np.diff(state.along[: state.n_slave_nodes])
    for power, words in ((-1, "is missing"), (1, "is counted twice")):
        if len(factors) > 1 and same(factors, lengths**power):
            return (
                f"the length of a slave segment {words}: its force has {_times(factors[1])} the exact size on segment 1"
            )
    if len(factors) > 1 and same(factors * lengths, np.full(len(factors), (factors * lengths).mean())):
        words = "" if not same(factors[0] * lengths[0], lengths.mean()) else ", the mean"
        return f"each slave segment counts with the same length, {factors[0] * lengths[0]:.4g}{words}, whatever its own"
    return ""


def _side_pattern(state: FlatState, pushes: FloatArray) -> str:
    """Return on which side the forces are wrong, and whether their sum is."""
    exact, n = state.exact, state.n_slave_nodes
    slave_is_right, master_is_right = same(pushes[:n], exact[:n]), same(pushes[n:], exact[n:])
    if slave_is_right:
        return "the forces on the slave are right, those on the master are not" + _total(pushes[n:], exact[n:])
    if master_is_right:
        return "the forces on the master are right, those on the slave are not" + _total(pushes[:n], exact[:n])
    total, along = _total(pushes[:n], exact[:n]), state.along
    sums = [
        np.array([part.sum(), part @ places]) for part, places in ((pushes[:n], along[:n]), (pushes[n:], along[n:]))
    ]
    if same(*sums):  # What is integrated acts alike on both sides.
        total += "; the sides balance, in moments too: look at the points of integration, their weights and their range"
    return f"the forces are wrong on both sides{total}"


def _node_pattern(pushes: FloatArray, exact: FloatArray) -> str:
    """Return what factor the ends of the slave have, if all nodes between them are right."""
    inner = equal(pushes, exact)[1:-1].all()
    ends = [node for node in (0, len(exact) - 1) if not equal(pushes, exact)[node]]
    if not inner or not ends:
        return ""
    factors = pushes[ends] / exact[ends]
    words = " and ".join(f"{_times(factor)} at slave node {node}" for node, factor in zip(ends, factors, strict=True))
    return f"only free ends are wrong: {words}"


def _segment_pattern(side: str, pieces: FloatArray, of_pieces: IntArray, pushes: FloatArray) -> str:
    """Return what factors the segments of a side have, if the forces are the sum of their parts with such factors."""
    segments, factors = np.unique(of_pieces), _factors(pieces, of_pieces, pushes)
    if factors is None or (wrong := ~equal(factors, np.ones(len(factors)))).all():
        return ""
    missed = [int(segment) for segment, factor in zip(segments, factors, strict=True) if abs(factor) < SAME]
    if len(missed) == wrong.sum():
        listed = f"{side} segment{'s' * (len(missed) > 1)} {', '.join(map(str, missed))}"
        return f"{listed} {'is' if len(missed) == 1 else 'are'} left out{_ends(missed, len(segments))}"
    words = ", ".join(f"{side} segment {segments[n]} {_times(factors[n])}" for n in np.flatnonzero(wrong))
    ends = _ends(segments[wrong].tolist(), len(segments))
    return f"segments have forces of another size: {words} the exact one, all others right{ends}"


def _factors(pieces: FloatArray, of_pieces: IntArray, pushes: FloatArray) -> FloatArray | None:
    """Return the factors (n_segments,) of the parts of the segments whose sum the forces are; None if they are none."""
    parts = np.stack([pieces[of_pieces == segment].sum(axis=0) for segment in np.unique(of_pieces)], axis=1)
    factors: FloatArray = np.linalg.lstsq(parts, pushes, rcond=None)[0]
    return factors if same(parts @ factors, pushes) else None


def _factor(pushes: FloatArray, exact: FloatArray) -> str:
    """Return the factor that all forces have, and what it may mean, if they have one."""
    factor = float(pushes @ exact / (exact @ exact))
    if not same(pushes, factor * exact):
        return ""
    near = [words for known, words in _MEANINGS.items() if abs(factor - known) <= SAME * abs(known)]
    return f"every node has {_times(factor)} the exact force{f': {near[0]}' if near else ''}"


def _total(pushes: FloatArray, exact: FloatArray) -> str:
    factor = float(pushes.sum() / exact.sum())
    return "; their sum is right" if abs(factor - 1) <= SAME else f"; their sum is {_times(factor)} the exact one"


def _ends(numbers: Sequence[int], total: int) -> str:
    names = {0: "the first", total - 1: "the last"}
    if total == 1 or not set(numbers) <= set(names):
        return ""
    words = " and ".join(names[number] for number in numbers)
    return f"; {'it is' if len(numbers) == 1 else 'they are'} {words} of {total}"


def _times(factor: float) -> str:
    return f"{factor:.4g} times"


_MOST_POINTS = 4  # More are used by hardly anybody.


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
    parts = [*state.pieces]
    for of_pieces in (state.slave_segment, state.master_segment):
        parts += [state.pieces[of_pieces == segment].sum(axis=0) for segment in np.unique(of_pieces)]
    wrong = ~equal(pushes, state.exact)
    alike = [np.abs(part - pushes) <= SAME * np.abs(state.exact).max() for part in parts]
    if not (np.any(alike, axis=0) & (pushes != 0))[wrong].all():
        return ""
    return "nodes that belong to several pieces have the force of one alone: the others are overwritten, and not added"


def _halves(state: FlatState, pushes: FloatArray) -> str:
    n, halves = state.n_slave_nodes, np.zeros(len(pushes))
    for piece, segment in zip(state.pieces, state.master_segment, strict=True):
        halves[state.case.interface.master.segments[segment]] += piece[n:].sum() / 2
    if not same(pushes[:n], state.exact[:n]) or not same(pushes[n:], halves[n:]):
        return ""
    return "both nodes of a master segment take half of its force, wherever it acts: the shape functions are ½"


def _nearest_nodes(state: FlatState, pushes: FloatArray) -> str:
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
