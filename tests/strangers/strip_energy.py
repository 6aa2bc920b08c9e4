"""The energy of springs on what the slave sees of the master; forces are its derivative by complex steps.

What a master node cuts off the slave is energy, too, so that a free end of the master is pushed along the surface. No
other formulation has forces that do no work in a closed loop where a surface ends.
"""

from typing import Any

import numpy as np

from contactverif import PatchPromises, Promises, Rules, Traits
from strangers.segment_penalty import STEP, SegmentPenalty
from strangers.strips import add_at


class StripEnergy:
    """Springs with the lengths of the reference, ε̂/2 gap² at Gauss points of each strip; no tangent, and no points."""

    traits = Traits(
        promises=Promises(
            patch=PatchPromises(flat=True),
            integrates_linear_gap=True,
            conserves_force=True,
            conserves_moment=True,
            local=True,
            translation_stable=True,
        ),
        rules=Rules(penalty="distributed", area="reference"),
    )

    def __init__(self, *, penalty: float) -> None:
        self.springs = SegmentPenalty(penalty=penalty)
        self.springs.snap = 1e-10  # Else a rounding of an end that lies on another one decides about a force.

    def pair(self, interface: Any, z: Any) -> Any:
        return self.springs.pair(interface, z)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, strips = z.reshape(-1, 2), pairing["strips"]
        nodes = self.springs._nodes(interface, strips)
        corners = x[nodes] + 1j * STEP * np.eye(12).reshape(12, 1, 6, 2)
        gap, *_, weight, _ = self.springs._at_points(corners)
        along = corners[..., 1, :] - corners[..., 0, :]
        stretch = np.sqrt((along**2).sum(axis=-1)) / interface.slave.lengths(interface.nodes)[strips[:, 0]]
        energy = (np.where(pairing["active"], gap, 0) ** 2 * weight).sum(axis=-1) / stretch * self.springs.penalty / 2
        forces = np.zeros_like(x)
        for corner, slope in enumerate((energy.imag / STEP).reshape(6, 2, -1)):
            add_at(forces, nodes[:, corner], slope.T)
        return forces.reshape(z.shape)
