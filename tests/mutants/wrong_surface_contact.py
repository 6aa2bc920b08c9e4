"""Formulations on faces that decide, push or report wrongly, each with the property that is to catch it in space."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from mutate import Mutant, decides, reports, says, wrap
from wrong_surfaces import MORTAR, STS, changes_points

import contactverif_surfaces
from contactverif_surfaces.cell_points import CellPoints, SlaveView

NTS, NTS_AR = contactverif_surfaces.nts_3d, contactverif_surfaces.nts_ar_3d


def _dual_shapes(points: CellPoints, view: SlaveView) -> CellPoints:
    """Push the slave by shape functions that are negative in places: 4 N − 1, which add up to one on a triangle."""
    return replace(points, slave_shape=4 * points.slave_shape - 1)


def _pushing(make: Callable[..., Any]) -> Callable[..., Any]:
    return says(make, nodes_push=True)


def _report_closed(make: Callable[..., Any]) -> Callable[..., Any]:
    """Return the factory of a right formulation that reports the points in contact alone."""

    def contact_points(right: Any, *arguments: Any) -> Any:
        points = right(*arguments)
        return points.select(points.active)

    return lambda *, penalty: wrap(penalty, make, contact_points=contact_points)


MUTANTS = (
    Mutant("springs that pull, too", "unilateral", decides(STS, lambda pairing, interface: pairing["active"] | True)),
    Mutant("all points of a cell closed with one of them", "unilateral",
           decides(STS, lambda pairing, interface: pairing["active"] | pairing["active"].any(axis=1)[:, None])),
    Mutant("all nodes closed with one of them", "unilateral",
           decides(MORTAR, lambda pairing, interface: pairing["active"] | pairing["active"].any())),
    Mutant("contact that never begins on faces", "unilateral",
           decides(STS, lambda pairing, interface: pairing["active"] & False)),
    Mutant("shape functions that pull nodes of a face", "nodal-push", _pushing(changes_points(_dual_shapes))),
    Mutant("half the gap reported on faces", "patch.flat.normal",
           reports(STS, lambda points, interface, x: {"gap": points.gap / 2})),
    Mutant("equal stiffness at nodes said to be that of areas", "patch.flat.normal",
           says(NTS, normal=True, penalty="distributed", area="current")),
    Mutant("nodal areas said to be nodal springs", "patch.flat.nodal", says(NTS_AR, penalty="nodal", area=None)),
    Mutant("gap over the cosine reported", "projection.place",
           reports(STS, lambda points, interface, x: {"gap": points.gap / np.abs(points.normal[:, 2])})),
    Mutant("foot reported in the middle of its face", "projection.place",
           reports(STS, lambda points, interface, x: {"master_shape": np.full_like(points.master_shape, 1 / 3)})),
    Mutant("normal of the slave reported", "projection.place",
           reports(STS, lambda points, interface, x: {"normal": -points.normal})),
    Mutant("position reported on the master", "projection.place",
           reports(STS, lambda points, interface, x: {
               "position": points.position - points.gap[:, None] * points.normal})),
    Mutant("another master face reported", "projection.segment",
           reports(STS, lambda points, interface, x: {
               "master_segment": (points.master_segment + 1) % len(interface.master)})),
    Mutant("all points of a cell decided by the first one", "projection.activity",
           decides(STS, lambda pairing, interface: pairing["active"] & pairing["active"][:, :1])),
    Mutant("area in the plane z = 0 reported", "projection.area",
           reports(STS, lambda points, interface, x: {"weight": points.weight * np.abs(points.normal[:, 2])})),
    Mutant("closed points alone reported on faces", "projection.area", _report_closed(STS)),
    Mutant("pressure of points reported twice", "projection.forces",
           reports(STS, lambda points, interface, x: {"pressure": 2 * points.pressure})),
    Mutant("forces of nodes reported twice", "patch.flat.nodal",
           reports(NTS, lambda points, interface, x: {"pressure": 2 * points.pressure})),
)  # fmt: skip
