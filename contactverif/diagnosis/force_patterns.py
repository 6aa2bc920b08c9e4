"""Tell in what pattern the forces of a formulation with springs are wrong.

The flat state comes first. Then the slave is moved along the master or tilted, a segment of it is open, all is turned
by a quarter, or places change by little: forces that are wrong on one of these alone show what they depend on.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.subject import Subject
from contactverif.diagnosis.flat_state import (
    COARSE,
    DEPTH,
    FINE,
    MASTER,
    PENALTY,
    SAME,
    SLAVE,
    FlatState,
    equal,
    flat_state,
    flat_state_of,
    pushes_of,
    same,
    spell,
)
from contactverif.diagnosis.matching_pairs import diagnose_skewed

_MOST_POINTS = 4  # More points of integration are used by hardly anybody.
# The slave is moved along the master by these lengths. Its nodes pass nearly all of it, and face no node.
_SHIFTS = (np.arange(-61, 61) + 0.5) / 128
# The heights of all nodes of the slave but one, over its depth, from one at which only the nearest point presses.
_LIFTS = 2.0 ** np.arange(6, -3, -1)
# A change of places near 1 that single precision, with digits of 2^-24, does not see, and one that it sees.
_TOO_SMALL, _LARGE = 2.0**-26, 2.0**-12
# The penetrations of a law are 2 to the power of minus these, small against all segments.
_POWERS = range(16, 4, -1)
_OVERHANG = "where the slave reaches past both ends of the master"
_PLACES = {
    "on a slave that is finer than its master": FINE,
    "on a slave that is coarser than its master": COARSE,
    "where a master segment faces 12 slave segments": (np.linspace(0.0, 3.0, 13), MASTER[[0, -1]]),
    "where a slave segment faces 12 master segments": (SLAVE[[0, -1]], np.linspace(3.625, -0.5, 15)),
    _OVERHANG: (SLAVE, MASTER[1:-1]),
}
# The penetrations of the slave's nodes, over DEPTH, in which the segment of that number is open.
_OPEN = {0: np.array([-1.0, 0.0, 1.0, 1.0]), len(SLAVE) - 2: np.array([1.0, 1.0, 0.0, -1.0])}


def diagnose_forces(subject: Subject, *, in_full: bool) -> str:
    """Return what is wrong with the forces on a flat interface; empty where they are right, or no rule knows them.

    Not `in_full`, nothing is said of forces that merely are not the consistent ones: a formulation that does not
    promise the patch test may have them.
    """
    return next(filter(None, _patterns(subject, in_full)), "")


def _patterns(subject: Subject, in_full: bool) -> Iterator[str]:
    rules, promises = subject.traits.rules, subject.traits.promises
    if rules.enforcement != "penalty":
        return
    if not subject.traits.abilities.in_plane:
        yield from _patterns_in_space(subject, in_full)
        return
    yield _find_lost_sums(subject)
    if rules.penalty is not None:  # Else the pressure may be any function of the penetration.
        yield _diagnose_law(subject)
    if rules.penalty == "nodal" or promises.patch.flat is False:
        return  # Other forces than the consistent ones are right there.
    yield _diagnose_digits(subject)
    state = flat_state()
    forces = pushes_of(subject, state)
    yield from _uniform_patterns(subject, state, in_full)
    if np.abs(forces[:, 0]).max() > SAME * np.abs(forces[:, 1]).max():
        yield "the forces have a part along the surface, where both normals are the same"
    for state in (flat_state(slope=1.0), flat_state(slope=1.0, places=(SLAVE, MASTER[[0, -1]]))):
        pushes = pushes_of(subject, state)[:, 1]
        if not same(pushes, state.exact):  # Other rules of integration give other forces, and are not wrong.
            yield _exchange(state, pushes, 0) or _exchange(state, pushes, 1)
    for words, places in _PLACES.items():
        state = flat_state(places=places)
        if words != _OVERHANG or promises.patch.overhang:
            for text in filter(None, _uniform_patterns(subject, state, in_full)):
                yield f"{words}: {text}"
    for number, depths in _OPEN.items():
        pushes = pushes_of(subject, flat_state(depths=DEPTH * depths))[: len(SLAVE), 1]
        if free := [node for node in np.flatnonzero(depths > 0) if pushes[node] == 0]:
            yield f"where slave segment {number} is open, nothing pushes {spell('slave node', free)}, which penetrate"


def _patterns_in_space(subject: Subject, in_full: bool) -> Iterator[str]:
    if subject.traits.rules.penalty == "nodal" or subject.traits.promises.patch.flat is False:
        return
    for state in map(flat_state_of, sorted(subject.traits.abilities.faces)):
        yield from _uniform_patterns(subject, state, in_full)
    yield diagnose_skewed(subject)


def _uniform_patterns(subject: Subject, state: FlatState, in_full: bool) -> Iterator[str]:
    rules, forces = subject.traits.rules, pushes_of(subject, state)
    knows_total = rules.penalty == "distributed" and rules.area is not None
    pushes, n = forces[:, -1], state.n_slave_nodes
    if not forces.any():
        yield "there is no force at all where the surfaces penetrate"
    if same(pushes, state.exact):
        return
    yield _segment_pattern(state, pushes, 0)
    yield _segment_pattern(state, pushes, 1)
    if state.in_plane:
        yield _exchange(state, pushes, 1)
    if in_full:
        yield from _patterns_of_pieces(state, pushes)
    if same(pushes[:n], np.full(n, PENALTY * DEPTH)):
        nodal = 'for nodal springs state penalty = "nodal" in the traits'
        yield f"each slave node has a whole spring, ε̂ |g|: {nodal}; else the length at the node is missing"
    if in_full:
        yield _side_pattern(state, pushes)
    elif knows_total and not same(pushes[:n].sum(keepdims=True), state.exact[:n].sum(keepdims=True)):
        yield f"the forces on the slave are wrong{_total(pushes[:n], state.exact[:n])}"


def _patterns_of_pieces(state: FlatState, pushes: FloatArray) -> Iterator[str]:
    exact = state.exact
    parts = [*state.pieces]
    for numbers in state.segments:
        parts += [state.pieces[numbers == segment].sum(axis=0) for segment in np.unique(numbers)]
    alike = [np.abs(part - pushes) <= SAME * np.abs(exact).max() for part in parts]
    if (np.any(alike, axis=0) & (pushes != 0))[~equal(pushes, exact)].all():
        owners = "nodes that belong to several pieces"
        yield f"{owners} have the force of one alone: the others are overwritten, and not added (`np.add.at`)"
    yield _piece_factors(state, pushes)
    if not state.in_plane:
        return
    rules = [np.polynomial.legendre.leggauss(n_points) for n_points in range(1, _MOST_POINTS + 1)]
    for side, ends, nodes in zip(("slave", "master"), state.ends, state.sides, strict=True):
        for places, weights in rules:
            forces = np.zeros(len(pushes))
            for start, length, of_piece in zip(state.starts, state.lengths, ends, strict=True):
                distances = np.abs(state.along[of_piece] - (start + (places[:, None] + 1) / 2 * length))
                np.add.at(forces, of_piece[distances.argmin(axis=1)], PENALTY * DEPTH * length * weights / 2)
            if same(pushes[nodes], forces[nodes]):
                yield f"the whole force of a point of integration goes to the nearer node of the {side} segment"
    for places, weights in rules:
        if same(pushes, _sum_at_points(state, (places + 1) / 2, weights / 2)):
            points = f"the {len(places)} of whole slave segments"
            yield f"the points of integration are {points}, not cut at the master's nodes"
    shifts = np.zeros(len(pushes))  # The change of the forces if each piece's acts its whole length beside the middle.
    for ends in state.ends:
        change = PENALTY * DEPTH * state.lengths**2 / (state.along[ends[:, 1]] - state.along[ends[:, 0]])
        np.add.at(shifts, ends, np.stack([-change, change], axis=1))
    share = float(shifts @ (pushes - exact) / (shifts @ shifts))
    if same(pushes, exact + share * shifts):
        yield (
            f"the force of each part acts {abs(share):.3g} of its length nearer to the part's "
            f"{'end' if share > 0 else 'start'}: look at the places of the points of integration and at their weights"
        )


def _exchange(state: FlatState, pushes: FloatArray, side: int) -> str:
    ends, nodes = state.ends[side], state.sides[side]
    swapped = np.zeros(len(pushes))
    np.add.at(swapped, ends[:, ::-1], np.take_along_axis(state.pieces, ends, axis=1))
    if not same(pushes[nodes], swapped[nodes]):
        return ""
    if side:
        return "the two shape functions of each master segment are exchanged: ξ where 1 − ξ belongs"
    return "the two shape functions of each slave segment are exchanged: a node has what belongs to its neighbour"


def _segment_pattern(state: FlatState, pushes: FloatArray, side: int) -> str:
    numbers = state.segments[side]
    segments = np.unique(numbers)
    parts = np.stack([state.pieces[numbers == segment].sum(axis=0) for segment in segments], axis=1)
    factors: FloatArray = np.linalg.lstsq(parts, pushes, rcond=None)[0]
    wrong = ~equal(factors, np.ones(len(factors)))
    if not same(parts @ factors, pushes) or wrong.all() or factors.min() < -SAME:  # On few nodes none is unique.
        return ""
    name, word = ("slave", "master")[side], "segment" if state.in_plane else "face"
    missed = [int(segment) for segment, factor in zip(segments, factors, strict=True) if abs(factor) < SAME]
    if len(missed) == wrong.sum():
        are = "is" if len(missed) == 1 else "are"
        return f"{spell(f'{name} {word}', missed)} {are} left out{_ends(missed, len(segments))}"
    words = ", ".join(f"{name} {word} {segments[n]} {_times(factors[n])}" for n in np.flatnonzero(wrong))
    ends = _ends(segments[wrong].tolist(), len(segments))
    return f"{word}s have forces of another size: {words} the exact one, all others right{ends}"


def _ends(numbers: Sequence[int], total: int) -> str:
    names = {0: "the first", total - 1: "the last"}
    if total == 1 or not set(numbers) <= set(names):
        return ""
    words = " and ".join(names[number] for number in numbers)
    return f"; {'it is' if len(numbers) == 1 else 'they are'} {words} of {total}"


def _piece_factors(state: FlatState, pushes: FloatArray) -> str:
    factors = np.asarray(np.linalg.lstsq(state.pieces.T, pushes, rcond=None)[0], dtype=np.float64)
    if not same(state.pieces.T @ factors, pushes):
        return ""
    faces, nodes = state.case.interface, state.case.interface.nodes
    word, size = ("segment", "length") if state.in_plane else ("face", "area")
    of_slave, of_master = (
        side.measures(nodes)[numbers] for side, numbers in zip((faces.slave, faces.master), state.segments, strict=True)
    )
    sizes = {
        "is counted, too": of_master,
        "divides the force": 1 / of_master,
        f"stands where that of the slave {word} belongs": of_master / of_slave,
    }
    for words, ratios in sizes.items():
        if same(factors, ratios):
            return f"the {size} of the master {word} {words}"
    missed = np.abs(factors) < SAME
    if not missed.any() or not same(factors[~missed], np.ones(len(factors) - missed.sum())):
        return ""
    pairs = zip(*(numbers[missed] for numbers in state.segments), strict=True)
    return f"parts are left out: {', '.join(f'slave {word} {a} on master {word} {b}' for a, b in pairs)}"


def _side_pattern(state: FlatState, pushes: FloatArray) -> str:
    places = state.case.positions[:, :-1]
    slave, master = ((pushes[nodes], state.exact[nodes], places[nodes]) for nodes in state.sides)
    if same(*slave[:2]):
        return "the forces on the slave are right, those on the master are not" + _total(*master[:2])
    total = _total(*slave[:2])
    if same(*master[:2]):
        return "the forces on the master are right, those on the slave are not" + total
    sums = [np.append(part.sum(), part @ at) for part, _, at in (slave, master)]
    if same(*sums) and slave[0].sum() > 0:  # What is integrated acts alike on both sides.
        total += "; the sides balance, in moments too: look at the points of integration, their weights and their range"
    return f"the forces are wrong on both sides{total}"


def _total(pushes: FloatArray, exact: FloatArray) -> str:
    factor = float(pushes.sum() / exact.sum())
    return "; their sum is right" if abs(factor - 1) <= SAME else f"; their sum is {_times(factor)} the exact one"


def _times(factor: float) -> str:
    return f"{factor:.4g} times"


def _sum_at_points(state: FlatState, places: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the forces (n_nodes,) of a uniform pressure that is summed at places 0 to 1 of each slave segment."""
    interface, along, forces = state.case.interface, state.along, np.zeros(len(state.along))
    master = interface.master.segments
    for nodes in interface.slave.segments:
        length = along[nodes[1]] - along[nodes[0]]
        for place, weight in zip(places, weights, strict=True):
            shares = (along[nodes[0]] + place * length - along[master[:, 0]]) / np.diff(along[master], axis=1)[:, 0]
            for segment in np.flatnonzero((shares >= 0) & (shares < 1)):
                for ends, share in ((nodes, place), (master[segment], shares[segment])):
                    forces[ends] += PENALTY * DEPTH * length * weight * np.array([1 - share, share])
    return forces


def find_lost_places(subject: Subject) -> str:
    """Return the places along the master at which a slave node has no force; empty if there are none.

    Each node must have the exact force or a whole spring elsewhere: else the places mean nothing.
    """
    all_idle = []
    for shift in _SHIFTS:
        state = flat_state(places=(SLAVE + shift, MASTER))
        pushes, exact = pushes_of(subject, state)[: len(SLAVE), 1], state.exact[: len(SLAVE)]
        no_force = np.abs(pushes) <= SAME * exact.max()
        if not (no_force | equal(pushes, exact) | equal(pushes, np.full(len(exact), PENALTY * DEPTH))).all():
            return ""
        all_idle.append(no_force)
    places, idle = np.add.outer(_SHIFTS, SLAVE).reshape(-1), np.concatenate(all_idle)
    parts = {}
    for segment, (first, last) in enumerate(pairwise(MASTER)):
        xi = (places - first) / (last - first)
        inside = (xi > 0) & (xi < 1)
        without, right = xi[inside & idle], xi[inside & ~idle]
        if len(without):
            low = right[right < without.min()].max(initial=0.0)
            parts[segment] = low, right[right > without.max()].min(initial=1.0)
    if not parts or idle.all() or np.sum(np.any(all_idle, axis=0)) == 1:  # One node may lose it by its number.
        return ""
    if len(parts) == len(MASTER) - 1:  # Then the parts are alike, but for the places that were asked.
        lows, highs = zip(*parts.values(), strict=True)
        return f"slave nodes have no force between ξ = {min(lows):.2g} and {max(highs):.2g} of a master segment"
    words = [
        f"master segment {segment}" + (f" between ξ = {low:.2g} and {high:.2g}" if (low, high) != (0.0, 1.0) else "")
        for segment, (low, high) in parts.items()
    ]
    return f"slave nodes that face {', or '.join(words)} have no force; all others are right"


def _find_lost_sums(subject: Subject) -> str:
    def sums(lift: float, pressed: int) -> list[float]:
        depths = np.where(np.arange(len(FINE[0])) == pressed, DEPTH, -DEPTH * lift)
        state = flat_state(places=FINE, depths=depths)
        return [float(pushes_of(subject, state)[nodes, 1].sum()) for nodes in state.sides]

    slave, master = sums(-1.0, 0)
    if not 0 <= master < (1 - SAME) * slave:
        return ""
    for pressed in (0, len(FINE[0]) - 1):  # Open points that follow may overwrite a force by 0.
        alone, opposite = next((pair for lift in _LIFTS if (pair := sums(lift, pressed))[0] > 0), (0.0, 0.0))
        if alone and abs(opposite - alone) <= SAME * alone:
            less = f"the master gets {_times(master / slave)} the force of the slave"
            return f"{less}, and all of it where one point presses: do several points add to one node (`np.add.at`)?"
    return ""


def _diagnose_digits(subject: Subject) -> str:
    state = flat_state()
    formulation, interface = subject.for_case(state.case), state.case.interface

    def forces(change: float) -> FloatArray:
        z = state.case.z.copy()
        z[2 * np.arange(1, len(SLAVE) - 1)] += change
        return formulation.residual(interface, formulation.pair(interface, z), z)

    before = forces(0.0)
    if np.array_equal(forces(_TOO_SMALL), before) and not np.array_equal(forces(_LARGE), before):
        return f"places near 1 that change by {_TOO_SMALL:.1e} change no force: numbers have single precision"
    return ""


def _diagnose_law(subject: Subject) -> str:
    depths = np.array([2.0**-power for power in _POWERS])
    states = [flat_state(depth=depth) for depth in depths]
    shares = np.array([pushes_of(subject, state)[:, 1].sum() / state.exact.sum() for state in states])
    if same(shares, np.full(len(shares), shares[0])):
        return ""
    slope, offset = np.polyfit(depths, shares * depths, 1)
    if offset and same(shares * depths, slope * depths + offset):
        return f"the gap that counts is off by {offset / slope:.3g}, on segments of length 1"
    powers = np.diff(np.log2(np.abs(shares)))
    if np.isfinite(powers).all() and same(powers, np.full(len(powers), powers[0])):
        power = f"{1 + powers[0]:.3g}"
        return f"the force grows like the penetration to the power {power}, and should be proportional to it"
    changed = int(np.argmax(np.abs(shares - shares[0]) > SAME * abs(shares[0])))
    before, after = depths[changed - 1], depths[changed]
    if not shares[0]:
        return f"there is no force up to a penetration of {before:.2g}, and from {after:.2g} on there is one"
    return (
        f"the force is proportional to the penetration up to {before:.2g}, and from {after:.2g} on it has "
        f"{shares[changed] / shares[0]:.3g} times this size, on segments of length 1: look for a limit of depths"
    )
