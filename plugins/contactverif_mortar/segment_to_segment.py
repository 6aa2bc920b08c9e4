"""Segment-to-segment contact with exact segmentation: a gap and a pressure at three Gauss points of each cell.

Force and moment balance point by point, and a uniform pressure is integrated exactly over what is covered. So the flat
patch test is passed, with an overhang too.

Source: Zavarise & Wriggers (1998); segmentation and tangent: here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray
from contactverif.contract.formulation import ContactPoints, Pairing, check_penalty, choose
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits
from contactverif_mortar.cell_frame import ForcesAndTangent, cell_arguments, springs_at_points, touching_points
from contactverif_mortar.integration_cells import (
    AREAS,
    CELL_TRAITS,
    GAP,
    LOCKING_WITNESSES,
    Cells,
    Quadrature,
    forces,
    report_points,
)

N_POINTS = 3  # The Gauss points of a cell: exact up to degree 5, and a pressure × a shape function has degree 2.


@dataclass(frozen=True, slots=True, eq=False)
class SegmentToSegment:
    """The formulation: pressure −ε̂ g at each Gauss point of a cell where g ≤ 0."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.
    quadrature: Quadrature  # The points on a cell, and the configuration in which lengths are measured.

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells, and which of their points are in contact (n_cells × 3, flat)."""
        x = np.array(z).reshape(-1, 2)
        cells = Cells.find(interface, x, averaged=False)
        return Pairing(
            {**cells._asdict(), "active": touching_points(x, *cell_arguments(interface, cells, self.quadrature))}
        )

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        active = pairing["active"].reshape(-1, len(self.quadrature))
        mask = np.logical_or.reduce(active, axis=1)  # The cells that have a point in contact.
        cells = Cells.from_pairing(pairing).select(mask)
        x = np.array(z).reshape(-1, interface.n_nodes, 2)
        points = self.quadrature.points(interface, cells, x)
        pressure = np.where(active[mask].reshape(-1), -self.penalty * points[..., GAP], 0.0)
        return forces(points, pressure, cells.local_nodes(interface), interface.n_nodes).reshape(z.shape)

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> sparse.csr_array:
        """Compute the derivative of the residual, sparse."""
        return self.residual_and_tangent(interface, pairing, z)[1]

    def residual_and_tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ForcesAndTangent:
        """Compute forces (n_unknowns,) and their derivative from the same points."""
        cells, x = Cells.from_pairing(pairing), np.array(z).reshape(-1, 2)
        return springs_at_points(interface, cells, self.quadrature, x, self.penalty, pairing["active"])

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the Gauss points of all cells, with their own gaps and pressures."""
        cells = Cells.from_pairing(pairing)
        points = self.quadrature.points(interface, cells, np.array(z).reshape(1, -1, 2))[0]
        pressure = np.where(pairing["active"], -self.penalty * points[:, GAP], 0.0)
        return report_points(interface, cells, points, z, pressure, pairing["active"])


def sts(*, penalty: float, area: str = "current") -> SegmentToSegment:
    """Segment to segment: pressures at Gauss points of the overlaps of slave and master segments.

    Slave and master segments that face each other are cut to their overlap. Gap and force are along the normal of the
    slave segment, and the force acts at both facing points. So force and moment are conserved exactly, the flat patch
    test is passed, and an overhang is covered. At a high penalty its springs are more conditions than the surfaces can
    follow, and it locks. The tangent is exact and unsymmetric: the gradient of the gap is not along the slave's normal.

    References
    ----------
    Zavarise & Wriggers, Math. Comput. Modelling 28 (1998) 497–515; segmentation and tangent: here.
    """
    quadrature = Quadrature.gauss(N_POINTS, choose("area", area, AREAS))
    source = "Zavarise & Wriggers, Math. Comput. Modelling 28 (1998) 497–515; segmentation and tangent: here"
    witnesses = {**CELL_TRAITS.evidence.witnesses, **LOCKING_WITNESSES}
    traits = CELL_TRAITS.revise(locks=True, area=area, witnesses=witnesses, source=source)
    return SegmentToSegment(traits, check_penalty(penalty), quadrature)
