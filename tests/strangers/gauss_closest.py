"""Two Gauss points of each slave segment against the closest master segment, along its normal, without cells.

After Fischer and Wriggers, "Frictionless 2D contact formulations for finite deformations based on the mortar method"
(2005), where the points of the mortar integrals are projected alone; here each has a spring. The kernel runs on arrays,
and on dual numbers for the tangent.
"""

from typing import Any

import numpy as np
from scipy import sparse

from contactverif import ContactPoints, Promises, Rules, Traits
from strangers.closest import closest_segments
from strangers.duals import Dual, root

C = np.array([-1.0, 1.0]) / np.sqrt(3.0)


class GaussClosest:
    """Springs at two Gauss points of each slave segment along the master's normal, with an exact tangent."""

    traits = Traits(
        promises=Promises(
            integrates_linear_gap=True,
            tangent="exact",
            conserves_force=True,
            conserves_moment=True,
            local=True,
            translation_stable=True,
        ),
        rules=Rules(penalty="distributed", area="current", gap="closest point", force_along="master normal"),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def pair(self, interface: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        a, b = (np.repeat(x[interface.slave.segments[:, end]], 2, axis=0) for end in (0, 1))
        c = np.tile(C, len(interface.slave))[:, None]
        master, over = closest_segments((1 - c) / 2 * a + (1 + c) / 2 * b, interface.master, x)
        gap = self._kernel(self._corners(interface, master, x))[0]
        return {"master": master.astype(np.int64), "active": over & (gap <= 0)}

    def _nodes(self, interface: Any, master: Any) -> Any:
        return np.hstack([np.repeat(interface.slave.segments, 2, axis=0), interface.master.segments[master]])

    def _corners(self, interface: Any, master: Any, x: Any) -> list[Any]:
        """Return the coordinates of the four nodes of each point: x and y of A, B, 1 and 2, each (n_points,)."""
        return list(x[self._nodes(interface, master)].reshape(-1, 8).T)

    def _kernel(self, corners: list[Any]) -> tuple[Any, Any, tuple[Any, Any], Any]:
        """Return gap, ξ, the master's normal and the length of the slave segment, of arrays or of dual numbers."""
        ax, ay, bx, by, px, py, qx, qy = corners
        n = np.size(ax.value if isinstance(ax, Dual) else ax)
        shares = (1 - np.tile(C, n // 2)) / 2, (1 + np.tile(C, n // 2)) / 2
        ux, uy = qx - px, qy - py
        vx = (ax - px) * shares[0] + (bx - px) * shares[1]
        vy = (ay - py) * shares[0] + (by - py) * shares[1]
        size = root(ux * ux + uy * uy)
        tx, ty = ux / size, uy / size
        return (
            vx * ty - vy * tx,
            (vx * tx + vy * ty) / size,
            (ty, 0.0 - tx),
            root((bx - ax) * (bx - ax) + (by - ay) * (by - ay)),
        )

    def _parts(self, active: Any, corners: list[Any]) -> list[Any]:
        """Return the eight forces of each point, x and y at A, B, 1 and 2."""
        gap, xi, normal, length = self._kernel(corners)
        c = np.tile(C, len(active) // 2)
        size = gap * length * (self.penalty * np.where(active, 0.5, 0.0))
        pulls = [size * each for each in normal]
        return [pull * share for share in ((1 - c) / 2, (1 + c) / 2, xi - 1.0, 0.0 - xi) for pull in pulls]

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        parts = self._parts(pairing["active"], self._corners(interface, pairing["master"], z.reshape(-1, 2)))
        forces = np.zeros_like(z).reshape(-1, 2)
        nodes = self._nodes(interface, pairing["master"])
        for number in range(4):
            np.add.at(forces, nodes[:, number], np.column_stack(parts[2 * number : 2 * number + 2]))
        return forces.reshape(-1)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        corners = self._corners(interface, pairing["master"], z.reshape(-1, 2))
        unit = np.eye(8)
        duals = [Dual(value, np.broadcast_to(unit[number], (len(value), 8))) for number, value in enumerate(corners)]
        slopes = np.stack([part.slope for part in self._parts(pairing["active"], duals)], axis=1)
        nodes = self._nodes(interface, pairing["master"])
        unknowns = (2 * nodes[..., None] + np.arange(2)).reshape(-1, 8)
        rows, columns = (np.broadcast_to(each, slopes.shape) for each in (unknowns[:, :, None], unknowns[:, None, :]))
        return sparse.csc_array((slopes.ravel(), (rows.ravel(), columns.ravel())), shape=(z.size, z.size))

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        x, master, active = z.reshape(-1, 2), pairing["master"], pairing["active"]
        gap, xi, normal, length = self._kernel(self._corners(interface, master, x))
        carrier, c = np.repeat(np.arange(len(interface.slave)), 2), np.tile(C, len(interface.slave))
        a, b = (x[interface.slave.segments[carrier, end]] for end in (0, 1))
        position = ((1 - c) / 2)[:, None] * a + ((1 + c) / 2)[:, None] * b
        pressure, low = np.where(active, -self.penalty * gap, 0.0), np.where(c < 0, -1.0, 0.0)
        places = (carrier, c, master, xi, position, np.column_stack(normal))
        return ContactPoints(*places, gap, pressure, length / 2, active, low, low + 1)
