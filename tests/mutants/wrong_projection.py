"""Mutants that report something else than they compute, or decide by something else than the exact projection.

Each of the twelve arrays of `ContactPoints` that a formulation must give has at least one mutant here, and so have the
two optional ones.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from mutate import Mutant, changed_line, decides, reports

import contactverif_mortar
import contactverif_nts
from contactverif_nts.two_passes import two_pass

SEGMENT, PLACE, ACTIVITY = "projection.segment", "projection.place", "projection.activity"
RESULTANT = "patch.flat.resultant"
AREA, FORCES = "projection.area", "projection.forces"
VTS_ME, NTS_AR = contactverif_nts.vts_me, contactverif_nts.nts_ar
MORTAR, STS = contactverif_mortar.mortar, contactverif_mortar.sts
TWO_PASS = partial(two_pass, inner=NTS_AR)

Change = Callable[..., Any]  # From points, interface and positions to the arrays that are reported in place of others.


def report(name: str, caught_by: str, change: Change, make: Any = VTS_ME) -> Mutant:
    return Mutant(name, caught_by, reports(make, change))


def line(name: str, caught_by: str, module: str, old: str, new: str, *, factory: str = "vts_me") -> Mutant:
    return Mutant(name, caught_by, changed_line(module, old, new, factory=factory))


def _normal_of_reference(points: Any, interface: Any, x: Any) -> Any:
    ends = interface.nodes[interface.master.segments[points.master_segment]]
    along = (ends[:, 1] - ends[:, 0]) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)[:, None]
    return {"normal": np.column_stack([along[:, 1], -along[:, 0]])}


def _gap_from_coordinates(points: Any, interface: Any, x: Any) -> Any:
    """Return the gap as n·x_s − n·x_m, which loses digits far from the origin."""
    first = x[interface.master.segments[points.master_segment, 0]]
    return {"gap": (points.normal * points.position).sum(axis=1) - (points.normal * first).sum(axis=1)}


# The nearest of the segments that end at the nearest node.
_BY_NEAREST_NODE = (
    "from contactverif.geometry.projection import distance_to_segment; "
    "nearest_node = min(master.ravel().tolist(), key=lambda k: dot(arm(node(x, k), v), arm(node(x, k), v))); "
    "m = min(np.flatnonzero((master == nearest_node).any(axis=1)), key=lambda k: "
    "distance_to_segment(v.a, arm(v.a, v), node(x, master[k, 0]), node(x, master[k, 1])))"
)


def _beside_no_master(points: Any, interface: Any, x: Any) -> Any:
    """Return positions moved by the gap, of points that name no master segment."""
    place = points.position - np.nan_to_num(points.gap)[:, None] * np.nan_to_num(points.normal)
    return {"position": place, "master_segment": np.full_like(points.master_segment, -1)}


MUTANTS = (
    report("position of the foot, of nodes without a master segment", PLACE, _beside_no_master, MORTAR),
    report("nodal forces doubled over half of a weight", FORCES,
            lambda points, *_: {"pressure": 2 * points.pressure, "weight": points.weight / 2}, contactverif_nts.nts),
    report("points called weighted nodes", FORCES,
            lambda points, *_: {"weighted": ~points.weighted}, STS),
    report("slave segment of the neighbour reported", PLACE,
            lambda points, interface, x: {"slave_segment": (points.slave_segment - 1) % len(interface.slave)}),
    report("place on the slave reported from its other end", PLACE, lambda points, *_: {"c": -points.c}),
    report("another master segment reported", SEGMENT,
            lambda points, interface, x: {"master_segment": (points.master_segment + 1) % len(interface.master)}),
    report("ξ reported from the other end", PLACE, lambda points, *_: {"xi": 1 - points.xi}),
    report("ξ clipped in the report", PLACE, lambda points, *_: {"xi": np.clip(points.xi, 0, 1)}),
    report("foot reported as position", PLACE,
            lambda points, *_: {"position": points.position - points.gap[:, None] * points.normal}),
    report("normal into the master reported", PLACE, lambda points, *_: {"normal": -points.normal}),
    report("normal of the reference configuration reported", PLACE, _normal_of_reference),
    report("gap reported half as large", PLACE, lambda points, *_: {"gap": points.gap / 2}, STS),
    report("gap from absolute coordinates reported", PLACE, _gap_from_coordinates),
    report("pressure reported one in a million too large", FORCES,
            lambda points, *_: {"pressure": points.pressure * (1 + 1e-6)}),
    report("idle points report a pressure", FORCES, lambda points, *_: {"pressure": np.abs(points.gap)}),
    report("weight reported half as large", FORCES, lambda points, *_: {"weight": points.weight / 2}),
    report("weight of the whole segment", AREA,
            lambda points, interface, x: {"weight": interface.slave.lengths(x)[points.slave_segment]}),
    report("weight of what is not covered", AREA, lambda points, *_: {"weight": points.weight * 1.25}, STS),
    report("area reported from the first node", AREA,
            lambda points, *_: {"area_from": np.full_like(points.c, -1.0)}, contactverif_nts.vts_ppt),
    report("two thirds of the area reported", AREA,
            lambda points, *_: {"area_to": points.area_to - (points.area_to - points.area_from) / 3},
            contactverif_nts.vts_ppt),
    report("activity of the neighbour reported", ACTIVITY, lambda points, *_: {"active": np.roll(points.active, 1)}),
    Mutant("activity of the neighbour", ACTIVITY, decides(VTS_ME, lambda pairing, _: np.roll(pairing["active"], 1))),
    line("penetrations below 1e-9 left open", ACTIVITY, "nts_force",
         "is_pressed(g,", "is_pressed(g + 1e-9,"),
    line("gaps below 1e-9 closed", ACTIVITY, "nts_force",
         "is_pressed(g,", "is_pressed(g - 1e-9,"),
    line("segments of the nearest node only", SEGMENT, "nts_force",
         "m = order[place]", _BY_NEAREST_NODE),
    # At a vertex of a flat master both segments meet the foot at their ends, and neither counts it as its own.
    line("force dropped where a slave node stands over a master node", RESULTANT, "nts_force",
         "on_surface = foot_on_surface(", "on_surface = 0 < dot(d, t) < l_12 and foot_on_surface(", factory="nts_ar"),
    report("weighted nodes reported as points", PLACE, lambda points, *_: {"weighted": False}, MORTAR),
    report("second pass reported as points of the slave", PLACE, lambda points, *_: {"on_master": False}, TWO_PASS),
)  # fmt: skip
