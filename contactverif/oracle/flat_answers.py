"""Exact answers on flat interfaces: consistent forces of a uniform pressure, forces of nodal springs, and mesh classes.

All arithmetic of forces is rational on the stored floats; the only rounding is the last one.
"""

from __future__ import annotations

from bisect import bisect_right
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.interface import Interface, Surface
from contactverif.oracle.exact_distance import integers

_ROUNDING = 64 * UNIT_ROUNDOFF  # Nodes this close, over the largest coordinate, coincide.


def uniform_pressure_weights_exact(interface: Interface, along: ArrayLike) -> list[Fraction]:
    """Return the lengths that turn a uniform pressure into consistent nodal forces, as exact rationals.

    The weight of a node is ∫ N over the part of its surface that faces chains of the other surface. What lies beside
    the other surface has no weight, whichever of the two is wider. `along` (n_nodes,) are coordinates along the
    straight interface; floats count as the rationals that they are. Chains of one surface are open and do not overlap.
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


def nodal_spring_weights(interface: Interface, along: ArrayLike, *, both_surfaces: bool = False) -> FloatArray:
    """Return the forces (n_nodes,) away from the other body of springs of unit force at the nodes of the slave.

    A nodal method knows no areas. Its forces are a unit on each slave node, shared between the nodes of the master
    segment below by the lever rule.

    The interface is flat, with coordinates `along` (n_nodes,); floats count as the rationals that they are. A node
    beside the other surface has no spring. With `both_surfaces` there are springs at the nodes of the master too.
    """
    places, _ = integers(np.asarray(along, dtype=np.float64))
    forces = [Fraction(0)] * len(places)
    passes = [(interface.slave, interface.master), (interface.master, interface.slave)]
    for surface, other in passes if both_surfaces else passes[:1]:
        for node in np.unique(surface.segments).tolist():
            _add_spring(forces, node, other, places)
    return np.array([float(force) for force in forces])


def _add_spring(forces: list[Fraction], node: int, other: Surface, places: list[int]) -> None:
    """Add the unit force of a spring at a node, and its shares on the first segment that is opposite."""
    for first, second in other.segments.tolist():
        span, arm = places[second] - places[first], places[node] - places[first]
        if 0 <= Fraction(arm, span) <= 1:
            forces[node] += 1
            forces[second] += Fraction(arm, span)
            forces[first] += 1 - Fraction(arm, span)
            return


def is_of_class(interface: Interface, along: ArrayLike, *, midpoints: bool) -> bool:
    """Return whether all inner master nodes of a flat interface lie on slave nodes, or in the middle of slave segments.

    Zavarise & De Lorenzis (2009), Sections 4 and 5.1.2, order their cases by that:

    | class | inner master nodes lie | cases | passes the patch test |
    |---|---|---|---|
    | normal | on slave nodes | A1, A2 | NTS-AR, VTS-G, VTS-ME, and all that pass the next class |
    | single | there or, with `midpoints`, in the middle of segments | B | VTS-ME with an even n, VTS-PPT, mortar, … |

    In the normal class the shape functions of the master are linear along each slave segment, so the trapezoidal rule,
    and any better one, transmits a uniform pressure exactly. In the single class they may have a bend in the middle.
    `along` (n_nodes,) are coordinates along the interface.
    """
    places = np.asarray(along, dtype=np.float64)
    slave, master = interface.slave.segments, interface.master.segments
    inner = places[np.intersect1d(master[:, 0], master[:, 1])]
    allowed = places[np.unique(slave)]
    if midpoints:
        allowed = np.append(allowed, places[slave].mean(axis=1))
    distances = np.abs(inner[:, None] - allowed).min(axis=1)
    return bool((distances <= _ROUNDING * np.abs(places).max()).all())
