"""Springs along a continuous field of normals: averaged at the slave's nodes, and interpolated between them.

After Yang, Laursen and Meng, "Two dimensional mortar contact methods for large deformation frictional sliding" (2005).
Master nodes are projected on the slave along that field, which is the root of a quadratic equation.
"""

from typing import Any

import numpy as np

from contactverif import PatchPromises, Promises, Rules, Traits
from strangers.strips import cross, dot

PLACES, WEIGHTS = (np.polynomial.legendre.leggauss(4)[0] + 1) / 2, np.polynomial.legendre.leggauss(4)[1] / 2


class SmoothedNormals:
    """Springs at four Gauss points of each pair of segments that overlap in the field; a residual and nothing else.

    A slave node at a corner of more than 90° has no mean normal: each of its segments keeps its own there. Where the
    field folds, both roots fall together and lose digits, so none are promised.
    """

    traits = Traits(
        promises=Promises(
            patch=PatchPromises(flat=True, overhang=True),
            converges=True,
            conserves_force=True,
            conserves_moment=True,
            local=True,
        ),
        rules=Rules(penalty="distributed", area="current"),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        slave, master = interface.slave.segments, interface.master.segments
        a, along = x[slave[:, 0]], x[slave[:, 1]] - x[slave[:, 0]]
        normals = self._normals(interface.slave, along)  # (n_slave, 2, 2), out of the slave
        places = self._project(a, along, normals, x[master])  # (n_slave, n_master, 2)
        low, high = np.maximum(places[..., 1], 0), np.minimum(places[..., 0], 1)
        number, other = np.nonzero(low < high)  # False where a node has no projection
        size = np.sqrt(dot(along, along))[number]
        forces = np.zeros_like(x)
        for place, weight in zip(PLACES, WEIGHTS, strict=True):
            s = low[number, other] + place * (high - low)[number, other]
            n = (1 - s)[:, None] * normals[number, 0] + s[:, None] * normals[number, 1]
            n = n / np.sqrt(dot(n, n))[:, None]
            t, gap = self._shoot(a[number], along[number], s, n, x[master])
            visible = (places[number, :, 1] <= s[:, None]) & (s[:, None] <= places[number, :, 0])
            visible |= (t >= 0) & (t <= 1)  # Where the field folds, a line hits what the field does not point at.
            depth = np.where(visible, np.abs(gap), np.inf)
            points = np.arange(len(number))
            counts = (gap[points, other] < 0) & (depth[points, other] <= depth.min(axis=1, initial=np.inf))
            load = np.where(counts, -self.penalty * gap[points, other] * weight, 0.0)
            load = load * (high - low)[number, other] * size
            t = np.where(counts, t[points, other], 0.0)
            shares = ((slave[number], 1 - s, s), (master[other], t - 1, -t))
            for ends, first, second in shares:
                np.add.at(forces, ends[:, 0], (first * load)[:, None] * n)
                np.add.at(forces, ends[:, 1], (second * load)[:, None] * n)
        return forces.reshape(-1)

    @staticmethod
    def _normals(slave: Any, along: Any) -> Any:
        """Return the normals (n_slave, 2, 2) at both ends of each segment, of length 1."""
        flat = np.column_stack([along[:, 1], -along[:, 0]]) / np.sqrt(dot(along, along))[:, None]
        ends = np.stack([flat, flat], axis=1)
        for end in (0, 1):
            beside = flat[slave.neighbours[:, end]]
            blunt = (slave.neighbours[:, end] >= 0) & (dot(beside, flat) > 0)
            mean = flat + beside
            length = np.sqrt(np.where(blunt, dot(mean, mean), 1.0))
            ends[blunt, end] = mean[blunt] / length[blunt, None]
        return ends

    @staticmethod
    def _project(a: Any, along: Any, normals: Any, nodes: Any) -> Any:
        """Return where on the slave (n_slave, n_master, 2) the field points at the nodes of master segments.

        Of two such places that counts which is nearer to the middle of the segment, so that neither end is preferred.
        """
        offset = nodes[None] - (a + along / 2)[:, None, None]
        middle, change = ((normals[:, 1] + sign * normals[:, 0])[:, None, None] / 2 for sign in (1, -1))
        d = along[:, None, None] / 2
        c0, c1, c2 = cross(offset, middle), cross(offset, change) - cross(d, middle), -cross(d, change)
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(c1 * c1 - 4 * c2 * c0)
            return (1 - 2 * c0 / (c1 + np.copysign(root, c1))) / 2

    @staticmethod
    def _shoot(a: Any, along: Any, s: Any, n: Any, ends: Any) -> tuple[Any, Any]:
        """Return where lines from points at s along n meet all master segments (n, n_master), and the gaps there."""
        run = (ends[:, 1] - ends[:, 0])[None]
        offset = (ends[None, :, 0] - a[:, None]) - (s[:, None] * along)[:, None]
        line = n[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            t = -cross(offset, line) / cross(run, line)
            return t, dot(offset + t[..., None] * run, line)
