"""Eight later mistakes, one at a time, put into the right formulation `Springs`.

They were written without knowledge of the rules of the diagnosis. A regex is meant for one sentence on one line.
"""

from typing import Any

import numpy as np
from springs_with_bugs import Springs
from unseen_bugs import Parts


class WrongInterval(Parts):
    """The Gauss points ±1/√3 of the interval [-1, 1] are taken as they are for places in [0, 1]."""

    def points(self, start: Any, end: Any) -> Any:
        for place in (-np.sqrt(1 / 3), np.sqrt(1 / 3)):
            yield start + place * (end - start), end - start


class MasterJacobian(Parts):
    """The share of the slave segment is multiplied by the length of the master segment, not by that of the slave's."""

    master_length: Any = None

    def master_direction(self, normal: Any, c: Any, d: Any) -> Any:
        self.master_length = np.sqrt(((d - c) ** 2).sum(1))  # Of this call: nothing is kept.
        return super().master_direction(normal, c, d)

    def weights(self, length: Any, slave_segment: Any, n_segments: int) -> Any:
        return self.master_length / 2


class NormalNotVaried(Springs):
    """The tangent lacks the change of the slave's normals: they do not turn with the segment."""

    def normals(self, normal: Any) -> Any:
        return normal.real


class OpenPointsInTangent(Springs):
    """The tangent does not ask whether a point is closed: open points have stiffness, though they have no force."""

    def pressure(self, gap: Any) -> Any:
        linear = -self.penalty * gap
        return np.where(gap.real < 0, linear, linear - linear.real)


class UpperTriangleOnly(Springs):
    """The upper triangle of the tangent is computed and mirrored, but the tangent is not symmetric."""

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        upper = np.triu(super().tangent(interface, pairing, z))
        return upper + np.triu(upper, 1).T


class OneMasterEach(Springs):
    """A slave segment is paired with one master segment only, that with the largest share; others are left out."""

    def facing(self, share: Any) -> Any:
        best = share.argmax(1)
        i = np.flatnonzero(share.max(1) > 0)
        return i, best[i]


class NotCutAtFirstNode(Parts):
    """A part is not cut at the slave segment's first node: it reaches beyond it, as far as the master segment does."""

    def part(self, s_c: Any, s_d: Any) -> tuple[Any, Any]:
        return s_d, np.where(s_c.real < 1, s_c, 1)


class NotZeroed(Springs):
    """The array of forces is allocated once and never set to zero, so a call adds its forces to those of all before."""

    total: Any = None

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        force = super().residual(interface, pairing, z)
        if self.total is None or self.total.shape != force.shape:
            self.total = np.zeros_like(force)
        self.total = self.total + force
        return self.total.copy()


LATER = {  # {name on the command line: (factory, words of the diagnosis that say place and kind)}.
    "wrong-interval": (WrongInterval, r"the points of integration"),
    "master-jacobian": (MasterJacobian, r"the length of the master segment stands where"),
    "normal-fixed": (NormalNotVaried, r"the part of δn, .* of the slave, is missing"),
    "open-stiff": (OpenPointsInTangent, r"only where a part of the slave is apart"),
    "upper-only": (UpperTriangleOnly, r"the upper triangle of the derivative, mirrored"),
    "one-master": (OneMasterEach, r"parts are left out: slave segment 0 on master segment 2"),
    "not-cut": (NotCutAtFirstNode, r"the points of integration, their weights and their range"),
    "not-zeroed": (NotZeroed, r"`residual` answers otherwise when it is asked the same again"),
}
