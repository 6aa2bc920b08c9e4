"""Mortar contact on faces with multipliers: pressures at the nodes of the slave, or in a space that is too rich.

A pressure is Σ M_i λ_i, and its gap is ∫ M_i g. All faces at a node share its λ_i, or each face has its own at each of
its corners. These are more than the nodes, and so more than the surfaces can follow.
"""

from typing import Any

import numpy as np

from contactverif import Abilities, Pairing, Promises, Rules, Traits
from contactverif_surfaces.cell_points import (
    FacePairs,
    SlaveView,
    add_rows,
    flatten_pushes,
    gauss_points,
    unknowns_of,
)


class FaceMultipliers:
    """A λ for each node, or with `shared=False` for each corner of each face; `dual` shapes M are those of triangles.

    The shapes M are those of the slave by default.
    """

    def __init__(self, *, penalty: float, shared: bool = True, dual: bool = False) -> None:
        self.penalty, self.shared, self.dual = penalty, shared, dual
        self.traits = Traits(
            promises=Promises(inf_sup=True, conserves_force=True, conserves_moment=True, translation_stable=True),
            rules=Rules(enforcement="multiplier", gap="cells", penalty="distributed", area="current"),
            abilities=Abilities(dimensions=(3,), faces=(3,) if dual else (3, 4)),
        )

    def numbers(self, interface: Any) -> Any:
        """Return the number of the multiplier at each corner of each slave face (n_faces, n_corners)."""
        faces = interface.slave.faces
        return faces if self.shared else np.arange(faces.size).reshape(faces.shape)

    def n_multipliers(self, interface: Any) -> int:
        return int(self.numbers(interface).max()) + 1

    def look(self, interface: Any, pairs: Any, z: Any) -> Any:
        """Return the points of the cells, the shapes M there, and ∫ M_i g and ∫ N_i (n_multipliers,)."""
        corners, n_slave = pairs.corners_at(z[: interface.n_unknowns]), pairs.n_slave_corners
        points = gauss_points(SlaveView.of_corners(corners[:, :n_slave], corners[:, n_slave:]), pairs.codes, 6)
        shapes = 4 * points.slave_shape - 1 if self.dual else points.slave_shape
        numbers, count = self.numbers(interface)[pairs.slave_face], self.n_multipliers(interface)
        gaps = ((points.weight * points.gap)[:, None] @ shapes)[:, 0]
        areas = (points.weight[:, None] @ points.slave_shape)[:, 0]
        return points, shapes, add_rows(gaps, numbers, count), add_rows(areas, numbers, count)

    def pair(self, interface: Any, z: Any) -> Any:
        pairs = FacePairs.find(interface, z[: interface.n_unknowns])
        _, _, gaps, areas = self.look(interface, pairs, z)
        return Pairing({**pairs.as_arrays(), "active": areas * z[interface.n_unknowns :] > self.penalty * gaps})

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        pairs, n, active = FacePairs.from_pairing(interface, pairing), interface.n_unknowns, pairing["active"]
        points, shapes, gaps, areas = self.look(interface, pairs, z)
        pressures = np.where(active, z[n:], 0.0)[self.numbers(interface)[pairs.slave_face]]
        forces = points.push((shapes @ pressures[..., None])[..., 0] * points.weight)
        rows = np.where(active, gaps, np.where(areas > 0, areas, 1.0) * z[n:] / self.penalty)
        return np.concatenate([add_rows(flatten_pushes(*forces), unknowns_of(pairs.nodes), n), rows])
