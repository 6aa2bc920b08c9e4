"""Segment-to-segment contact with exact segmentation: a gap and a pressure at three Gauss points of each cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, BoolArray, FloatArray
from contactverif.contract.formulation import ContactPoints, Pairing, Traits
from contactverif.contract.interface import Interface
from contactverif_mortar import transmission
from contactverif_mortar.cells import GAP, Cells, Quadrature
from contactverif_mortar.geometry import D_GAP
from contactverif_mortar.options import AREAS, check_penalty, chosen
from contactverif_mortar.reported import at_points

N_POINTS = 3  # exact for a pressure and two shape functions, all linear along a cell, and more than enough


@dataclass(frozen=True, slots=True, eq=False)
class SegmentToSegment:
    """Pressure −ε̂ g at each Gauss point of a cell where g ≤ 0.

    Attributes
    ----------
    quadrature : Quadrature
        The points on a cell, and where their lengths are measured.
    """

    traits: Traits
    penalty: float
    quadrature: Quadrature

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """The cells, and which of their points are in contact (n_cells × 3, flat)."""
        x = np.array(z).reshape(-1, 2)
        cells = Cells.find(interface, x, averaged=False)
        points = self.quadrature.points(interface, cells, x[None])[0]
        return Pairing({**cells.as_arrays(), "active": points[:, GAP] <= 0})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Forces (..., n_unknowns)."""
        cells, active = _touching(pairing, len(self.quadrature))
        x = np.array(z).reshape(-1, interface.n_nodes, 2)
        points = self.quadrature.points(interface, cells, x)
        pressure = np.where(active, -self.penalty * points[..., GAP], 0.0)
        return transmission.forces(points, pressure, cells.local_nodes(interface), interface.n_nodes).reshape(z.shape)

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.coo_array:
        """The exact derivative of the residual, sparse."""
        cells, active = _touching(pairing, len(self.quadrature))
        x = np.array(z).reshape(-1, 2)
        points, gains = self.quadrature.points(interface, cells, x[None])[0], self.quadrature.gains(interface, cells, x)
        pressure = np.where(active, -self.penalty * points[:, GAP], 0.0)
        d_pressure = np.where(active[:, None, None], -self.penalty * gains[:, D_GAP], 0.0)
        return transmission.tangent(points, gains, pressure, d_pressure, cells.local_nodes(interface), z.size)

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """The Gauss points of all cells, with their own gaps and pressures."""
        cells = Cells.of(pairing)
        points = self.quadrature.points(interface, cells, np.array(z).reshape(1, -1, 2))[0]
        pressure = np.where(pairing["active"], -self.penalty * points[:, GAP], 0.0)
        return at_points(interface, cells, points, z, pressure, pairing["active"])


def _touching(pairing: Pairing, n_q: int) -> tuple[Cells, BoolArray]:
    """The cells that have a point in contact, and which of their points are."""
    active = pairing["active"].reshape(-1, n_q)
    mask = np.logical_or.reduce(active, axis=1)
    return Cells.of(pairing).where(mask), active[mask].reshape(-1)


def sts(*, penalty: float, area: str = "current") -> SegmentToSegment:
    """Segment to segment: slave and master segments that face each other are cut to their overlap and integrated.

    The frame is that of the slave segment; gap and force are along its normal, at both facing points.

    Parameters
    ----------
    penalty : float
        Distributed stiffness ε̂ > 0, force per length per length of penetration.
    area : str
        "current" or "reference", where lengths are measured.
    """
    return SegmentToSegment(
        Traits(
            passes_flat_patch=True,
            covers_overhang=True,
            tangent="exact",
            symmetric=False,  # the force is along the slave's normal, the gradient of the gap is not
            conserves_force=True,
            conserves_moment=True,
            continuity="C0",
            area="current" if chosen("area", area, AREAS) else "reference",
            penalty="distributed",
            batched=True,
            takes_complex=True,
            source="Zavarise & Wriggers, Math. Comput. Modelling 28 (1998) 497–515; segmentation and tangent: here",
        ),
        check_penalty(penalty),
        Quadrature.gauss(N_POINTS, chosen("area", area, AREAS)),
    )
