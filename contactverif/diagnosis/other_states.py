"""Tell what a formulation does wrong on states that differ from the flat one in one thing.

The slave is moved along the master or tilted, a segment of it is open, all is turned by a quarter, or places change by
little. Forces that are right on the flat state, and wrong on one of these, show what they depend on.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.contract.subject import Subject
from contactverif.diagnosis.flat_state import DEPTH, MASTER, PENALTY, SAME, SLAVE, equal, flat_state, pushes_of, same

# The slave is moved along the master by these lengths. Its nodes pass nearly all of it, and face no node.
_SHIFTS = (np.arange(-61, 61) + 0.5) / 128


def diagnose_lost_places(subject: Subject) -> str:
    """Return the places along the master at which a slave node has no force; empty if there are none.

    Each node must have the exact force or a whole spring elsewhere: else the places mean nothing.
    """
    places, idle = [], []
    for shift in _SHIFTS:
        state = flat_state(places=(SLAVE + shift, MASTER))
        pushes = pushes_of(subject, state)[: len(SLAVE), 1]
        exact = state.exact[: len(SLAVE)]
        no_force = np.abs(pushes) <= SAME * exact.max()
        if not (no_force | equal(pushes, exact) | equal(pushes, np.full(len(exact), PENALTY * DEPTH))).all():
            return ""
        places.append(SLAVE + shift)
        idle.append(no_force)
    without_force = np.concatenate(idle)
    return "" if without_force.all() else _name_places(np.concatenate(places), without_force)


def _name_places(places: FloatArray, no_force: BoolArray) -> str:
    parts = {}
    for segment, (first, last) in enumerate(pairwise(MASTER)):
        xi = (places - first) / (last - first)
        inside = (xi > 0) & (xi < 1)
        without, right = xi[inside & no_force], xi[inside & ~no_force]
        if len(without):
            low = right[right < without.min()].max(initial=0.0)
            parts[segment] = low, right[right > without.max()].min(initial=1.0)
    if not parts:
        return ""
    if len(parts) == len(MASTER) - 1:  # Then the parts are alike, but for the places that were asked.
        lows, highs = zip(*parts.values(), strict=True)
        return f"slave nodes have no force between ξ = {min(lows):.2g} and {max(highs):.2g} of a master segment"
    words = [
        f"master segment {segment}" + (f" between ξ = {low:.2g} and {high:.2g}" if (low, high) != (0.0, 1.0) else "")
        for segment, (low, high) in parts.items()
    ]
    return f"slave nodes that face {', or '.join(words)} have no force; all others are right"


_TILT = 0.25  # The slope of a slave whose forces must balance, too.
# A change of places near 1 that single precision, with digits of 2^-24, does not see, and one that it sees.
_TOO_SMALL, _LARGE = 2.0**-26, 2.0**-12
# The penetrations of a law are 2 to the power of minus these, small against all segments.
_POWERS = range(16, 4, -1)
# The penetrations of the slave's nodes in which the first segment, or the last one, is open, over DEPTH.
_OPEN_FIRST = np.array([-1.0, 0.0, 1.0, 1.0])
_OPEN_LAST = np.array([1.0, 1.0, 0.0, -1.0])


def diagnose_turned(subject: Subject) -> str:
    """Return by how many quarters the flat state must be turned until its forces do not turn with it."""
    state = flat_state()
    interface, positions = state.case.interface, state.case.positions
    expected = None
    for degrees, x, y in ((0, 1, 0), (90, 0, 1), (180, -1, 0), (270, 0, -1)):
        turn = np.array([[x, y], [-y, x]], dtype=np.float64)  # So it takes rows to rows, without any rounding.
        turned, z = interface.at(interface.nodes @ turn), (positions @ turn).reshape(-1)
        formulation = subject.for_interface(turned, state.case.penalty)
        forces = formulation.residual(turned, formulation.pair(turned, z), z).reshape(-1, 2) @ turn.T
        expected = forces if expected is None else expected
        if not same(forces, expected):
            words = "are reversed" if same(forces, -expected) else "do not turn with it"
            return f"on a mesh that is turned by {degrees}° the forces {words}: look at the normal, and at angles"
    return ""


def diagnose_digits(subject: Subject) -> str:
    """Return whether the forces do not see a change of places that has its digit in double precision alone."""
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


def diagnose_open_segment(subject: Subject) -> str:
    """Return which nodes nothing pushes, of segments that are closed, where another segment is open."""
    for depths, open_segment in ((_OPEN_FIRST, 0), (_OPEN_LAST, len(SLAVE) - 2)):
        pushes = pushes_of(subject, flat_state(depths=DEPTH * depths))[: len(SLAVE), 1]
        if free := [node for node in np.flatnonzero(depths > 0) if pushes[node] == 0]:
            nodes = f"slave node{'s' * (len(free) > 1)} {', '.join(map(str, free))}"
            return f"where slave segment {open_segment} is open, nothing pushes {nodes}, which penetrate"
    return ""


def diagnose_balance(subject: Subject) -> str:
    """Return how the forces on a tilted slave do not balance: by their directions, or by their moments."""
    if not subject.traits.promises.conserves_force:
        return ""
    state = flat_state(slope=_TILT, depth=1.0)
    n, normals = state.n_slave_nodes, {"the slave's": np.array([_TILT, 1.0]), "the master's": np.array([0.0, 1.0])}
    pushes = pushes_of(subject, state)
    on_slave, on_master = pushes[:n].sum(axis=0), pushes[n:].sum(axis=0)
    if not same(on_slave, on_master):
        along = [_name_direction(force, normals) for force in (on_slave, on_master)]
        words = f"along {along[0]} normal on the slave, along {along[1]} normal on the master"
        return f"the forces on the sides of a tilted slave do not balance: they are {words}"
    x, y = state.case.positions.T
    moments = x * pushes[:, 1] - y * pushes[:, 0]
    if not subject.traits.promises.conserves_moment or same(moments[:n].sum(), moments[n:].sum()):
        return ""
    direction = _name_direction(on_slave, normals)
    return (
        "the forces on the sides of a tilted slave balance, and their moments do not: the points that push each other "
        f"do not face each other along the force, which is along {direction} normal: look at the projection"
    )


def _name_direction(force: FloatArray, normals: Mapping[str, FloatArray]) -> str:
    size = np.linalg.norm(force)
    names = (name for name, normal in normals.items() if same(force, normal * size / np.linalg.norm(normal)))
    return next(names, "another")


def diagnose_law(subject: Subject) -> str:
    """Return how the force depends on a uniform penetration, where it is not proportional to it."""
    depths = np.array([2.0**-power for power in _POWERS])
    states = [flat_state(depth=depth) for depth in depths]
    shares = np.array([pushes_of(subject, state)[:, 1].sum() / state.exact.sum() for state in states])
    if same(shares, np.full(len(shares), shares[0])):
        return ""
    powers = np.diff(np.log2(np.abs(shares)))
    if np.isfinite(powers).all() and same(powers, np.full(len(powers), powers[0])):
        return (
            f"the force grows like the penetration to the power {1 + powers[0]:.3g}, and should be proportional to it"
        )
    changed = int(np.argmax(np.abs(shares - shares[0]) > SAME * abs(shares[0])))
    before, after = depths[changed - 1], depths[changed]
    if not shares[0]:
        return f"there is no force up to a penetration of {before:.2g}, and from {after:.2g} on there is one"
    factor = shares[changed] / shares[0]
    return (
        f"the force is proportional to the penetration up to {before:.2g}, and from {after:.2g} on it has {factor:.3g} "
        "times this size, on segments of length 1: look for a limit of depths"
    )
