"""A mutant that is exact for a uniform penetration, and a little wrong in what a linear one adds."""

from __future__ import annotations

from typing import Any

import numpy as np
from mutate import Mutant, Wrapped

import contactverif_nts


def _round_tilt(*, penalty: float) -> Any:
    """Compute the difference of the penetrations of a slave segment's ends to eight digits."""

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        forces = np.array(right(interface, pairing, z))
        if z.ndim > 1 or z.dtype != np.float64:
            return forces
        x, by_node = z.reshape(-1, 2), forces.reshape(-1, 2)
        ends = x[interface.master.segments]
        along = (ends[:, 1] - ends[:, 0])[np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).argmax()]
        normal = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        for a, b in interface.slave.segments:
            error = 1e-8 * float((x[b] - x[a]) @ normal)
            by_node[[a, b]] += penalty * np.linalg.norm(x[b] - x[a]) * error / 4 * normal
        return forces

    return Wrapped(penalty, contactverif_nts.vts_me, residual=residual)


MUTANTS = (Mutant("tilt of a slave segment to eight digits", "stability.local", _round_tilt),)
