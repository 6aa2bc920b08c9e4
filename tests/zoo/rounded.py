"""Mutants that lose digits on the way, and promise that they do not.

Each is right up to the precision of its numbers; `gauss_springs` has the ways of writing.
"""

import numpy as np
from gauss_springs import (
    RIGHT,
    WRONG,
    GaussSprings,
    by_differences,
    by_points_first,
    in_single_precision,
    single_precision_at_first_node,
)

import contactverif_nts
from zoo.making import add, mutant

TRANSLATION, LOCAL, ATTAINABLE = "stability.translation", "stability.local", "newton.attainable"
STIFF = 1e3  # The penalty from which on springs may lose digits.


def _write_as(name, **ways):
    """Return a factory of Gauss springs in one way of writing, with another one of the tangent or the search."""

    def make(*, penalty):
        springs = GaussSprings(penalty, *(RIGHT | WRONG)[name], translation_stable=True)
        vars(springs).update(ways)
        return springs

    return make


def _rounds_differences(**traits):
    """Round differences of positions to single precision, which no translation changes."""
    promises = {"translation_stable": True, **traits}
    return lambda *, penalty: GaussSprings(penalty, by_differences, single_precision_at_first_node, **promises)


for _name in WRONG:
    add(f"{_name}, far from the origin", TRANSLATION, _write_as(_name))
add("tangent from points that are rounded first", TRANSLATION,
    _write_as("differences first", tangent_way=by_points_first))  # fmt: skip
add("search in single precision", TRANSLATION, _write_as("differences first", search_before=in_single_precision))
add("differences in single precision", LOCAL, _rounds_differences(takes_longdouble=False))
add("differences in single precision, of named states", "stability.sweep", _rounds_differences())


@mutant("stiff springs that lose digits", "stability.stiffness", "residual", contactverif_nts.nts_ar)
def _(right, *state):
    """Add a number to the stiffest forces and subtract it again."""
    penalty = right.__self__.penalty
    large = 1e4 * penalty if penalty > STIFF else 0.0
    return (right(*state) + large) - large


@mutant("tilt of a slave segment to eight digits", LOCAL, "residual", contactverif_nts.vts_me)
def _(right, interface, pairing, z):
    """Compute the difference of the penetrations of a slave segment's ends to eight digits."""
    forces = np.array(right(interface, pairing, z))
    if z.ndim > 1 or z.dtype != np.float64:
        return forces
    x, by_node = z.reshape(-1, 2), forces.reshape(-1, 2)
    ends = x[interface.master.segments]
    along = (ends[:, 1] - ends[:, 0])[np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).argmax()]
    normal = np.array([along[1], -along[0]]) / np.linalg.norm(along)
    for a, b in interface.slave.segments:
        error = 1e-8 * float((x[b] - x[a]) @ normal)
        by_node[[a, b]] += right.__self__.penalty * np.linalg.norm(x[b] - x[a]) * error / 4 * normal
    return forces


class PointsFirst:
    """VTS-ME whose virtual slave nodes are rounded where they lie, before a master node is subtracted."""

    def __init__(self, *, penalty):
        self._inner = contactverif_nts.vts_me(penalty=penalty)
        self.penalty, self.pair, self.tangent = penalty, self._inner.pair, self._inner.tangent
        self.traits = self._inner.traits.revise(translation_stable=True, batched=False, takes_complex=False)

    def distance(self, point, node, direction):
        return (point - node) @ direction

    def residual(self, interface, pairing, z):
        x, forces = z.reshape(-1, 2), np.zeros_like(z).reshape(-1, 2)
        for point in np.flatnonzero(pairing["active"]):
            a, b = interface.slave.segments[pairing["segment"][point]]
            node_1, node_2 = interface.master.segments[pairing["master"][point]]
            share, slot = (1 + self._inner.c[pairing["slot"][point]]) / 2, pairing["slot"][point]
            area = self._inner.weight[slot] * np.linalg.norm(x[b] - x[a])
            length = np.linalg.norm(x[node_2] - x[node_1])
            t = (x[node_2] - x[node_1]) / length
            normal = np.array([t[1], -t[0]])
            x_v = (1 - share) * x[a] + share * x[b]
            xi = self.distance(x_v, x[node_1], t) / length
            force = self.penalty * self.distance(x_v, x[node_1], normal) * area * normal
            for node, part in ((a, 1 - share), (b, share), (node_1, xi - 1), (node_2, -xi)):
                forces[node] += part * force
        return forces.reshape(-1)


class AbsoluteCoordinates(PointsFirst):
    """VTS-ME whose gaps are differences of products of absolute coordinates with the normal."""

    def distance(self, point, node, direction):
        return point @ direction - node @ direction


add("point rounded before the difference, in a scene", ATTAINABLE, PointsFirst)
add("gap from absolute coordinates, in a scene", ATTAINABLE, AbsoluteCoordinates)
