"""Exact consistent nodal lengths of a flat interface: what a uniform pressure is multiplied by."""

from __future__ import annotations

from bisect import bisect_right
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Interface, Surface
from contactverif.oracle.rationals import integers


def uniform_pressure_weights_exact(interface: Interface, along: ArrayLike) -> list[Fraction]:
    """Lengths (n_nodes,) that a uniform pressure is multiplied by to give the consistent nodal forces.

    ∫ N over the part of the node's surface that faces chains of the other surface: where both are, whichever is wider.
    `along` (n_nodes,) is the coordinate of each node along the straight interface, a length; floats count as the
    rationals that they are. Chains are open, and those of one surface do not overlap.
    """
    places, scale = integers(np.asarray(along, dtype=np.float64))
    weights = [Fraction(0)] * len(places)
    for surface, other in ((interface.slave, interface.master), (interface.master, interface.slave)):
        ordered = sorted(sorted(ends, key=places.__getitem__) for ends in surface.segments.tolist())
        ordered.sort(key=lambda ends: places[ends[0]])
        starts = [places[low] for low, _ in ordered]
        for low, high in _covered(other, places):
            for first, second in ordered[max(bisect_right(starts, low) - 1, 0) : bisect_right(starts, high)]:
                begin, length = places[first], places[second] - places[first]
                a, b = max(low, begin) - begin, min(high, places[second]) - begin  # the covered part, from first node
                if a < b:
                    towards_second = Fraction(b * b - a * a, 2 * length)
                    weights[second] += towards_second
                    weights[first] += b - a - towards_second
    return [weight / scale for weight in weights]


def uniform_pressure_weights(interface: Interface, along: ArrayLike) -> FloatArray:
    """As `uniform_pressure_weights_exact`, each length (n_nodes,) rounded once."""
    return np.array([float(weight) for weight in uniform_pressure_weights_exact(interface, along)])


def _covered(surface: Surface, places: list[int]) -> list[tuple[int, int]]:
    """The stretch that each chain covers."""
    firsts, lasts = surface.segments[:, 0].tolist(), surface.segments[:, 1].tolist()
    stretches: list[tuple[int, int]] = []
    for segment in surface.chain_order.tolist():
        if surface.neighbours[segment, 0] < 0:
            begin = places[firsts[segment]]
        if surface.neighbours[segment, 1] < 0:
            end = places[lasts[segment]]
            stretches.append((min(begin, end), max(begin, end)))
    return stretches
