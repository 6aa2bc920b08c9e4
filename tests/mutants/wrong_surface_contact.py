"""Formulations on faces that decide, push or report wrongly, each with the property that is to catch it in space."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from mutate import Mutant, decides, reports, says
from wrong_surfaces import MORTAR, STS, changes_points

import contactverif_surfaces
from contactverif_surfaces.cell_points import CellPoints, SlaveView

NTS, NTS_AR = contactverif_surfaces.nts_3d, contactverif_surfaces.nts_ar_3d


def _dual_shapes(points: CellPoints, view: SlaveView) -> CellPoints:
    """Push the slave by shape functions that are negative in places: 4 N − 1, which add up to one on a triangle."""
    return replace(points, slave_shape=4 * points.slave_shape - 1)


def _pushing(make: Callable[..., Any]) -> Callable[..., Any]:
    return says(make, nodes_push=True)


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
    Mutant("forces of nodes reported twice", "patch.flat.nodal",
           reports(NTS, lambda points, interface, x: {"pressure": 2 * points.pressure})),
)  # fmt: skip
