"""The consistent nodal forces of a uniform pressure on a flat interface, exact.

Rule for the next editor: all arithmetic is rational on the stored floats; the only rounding is the last one.
"""

from __future__ import annotations

from bisect import bisect_right
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Interface, Surface
from contactverif.oracle.rationals import integers


def uniform_pressure_weights_exact(interface: Interface, along: ArrayLike) -> list[Fraction]:
    """Return the lengths that turn a uniform pressure into consistent nodal forces, as exact rationals.

    The weight of a node is ∫ N over the part of its surface that faces chains of the other surface. What lies beside
    the other surface has no weight, whichever of the two is wider.

    Parameters
    ----------
    interface : Interface
        A flat interface of open chains; those of one surface do not overlap.
    along : ArrayLike, shape (n_nodes,)
        The coordinate of each node along the straight interface, a length. Floats count as the rationals that they are.

    Returns
    -------
    list[Fraction]
        The weight of each node, a length: force = pressure × weight.
    """
    places, scale = integers(np.asarray(along, dtype=np.float64))
    weights = [Fraction(0)] * len(places)
    halves = [0] * len(places)  # The lengths of the segments that are covered as a whole: half of each is a weight.
    for surface, other in ((interface.slave, interface.master), (interface.master, interface.slave)):
        ordered = sorted(sorted(ends, key=places.__getitem__) for ends in surface.segments.tolist())
        ordered.sort(key=lambda ends: places[ends[0]])
        starts = [places[low] for low, _ in ordered]
        for low, high in _stretches(other, places):
            for first, second in ordered[max(bisect_right(starts, low) - 1, 0) : bisect_right(starts, high)]:
                begin, end = places[first], places[second]
                if low <= begin and end <= high:
                    halves[first] += end - begin
                    halves[second] += end - begin
                elif (a := max(low, begin) - begin) < (b := min(high, end) - begin):  # From the first node.
                    towards_second = Fraction(b * b - a * a, 2 * (end - begin))
                    weights[second] += towards_second
                    weights[first] += b - a - towards_second
    return [weight / scale + Fraction(half, 2 * scale) for weight, half in zip(weights, halves, strict=True)]


def uniform_pressure_weights(interface: Interface, along: ArrayLike) -> FloatArray:
    """Return the weights of `uniform_pressure_weights_exact` as floats (n_nodes,), each rounded once."""
    return np.array([float(weight) for weight in uniform_pressure_weights_exact(interface, along)])


def _stretches(surface: Surface, places: list[int]) -> list[tuple[int, int]]:
    """Return the stretch that each chain covers."""
    firsts, lasts = surface.segments[:, 0].tolist(), surface.segments[:, 1].tolist()
    stretches: list[tuple[int, int]] = []
    for segment in surface.chain_order.tolist():
        if surface.neighbours[segment, 0] < 0:
            begin = places[firsts[segment]]
        if surface.neighbours[segment, 1] < 0:
            end = places[lasts[segment]]
            stretches.append((min(begin, end), max(begin, end)))
    return stretches
