"""Tell at which places along the master slave nodes have no force, while all others have theirs."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.contract.subject import Subject
from contactverif.diagnosis.flat_state import DEPTH, MASTER, PENALTY, SLAVE, flat_state, pushes_of
from contactverif.diagnosis.piece_patterns import SAME, equal

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
    """Return the segments of the master, and the parts of them, whose places are lost."""
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
