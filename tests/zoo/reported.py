"""Mutants that report, decide or promise something else than what they compute.

Each of the twelve arrays of `ContactPoints` that a formulation must give has at least one mutant here, and so have the
two optional ones.
"""

from dataclasses import replace
from functools import partial

import numpy as np

import contactverif_nts
from contactverif_mortar import chen_hisada, mortar, mortar_dual, mortar_dual_lm, mortar_lm, sts
from contactverif_mortar.integration_cells import Quadrature
from contactverif_nts import nts, nts_ar, two_pass, vts_g, vts_me, vts_ppt
from zoo.lines import SMALL
from zoo.making import BALANCED, add, decides, reports, says, whole_segments
from zoo.on_strips import WholeShapes

SEGMENT, PLACE, AREA, FORCES = "projection.segment", "projection.place", "projection.area", "projection.forces"
ACTIVITY, NORMAL, ARC = "projection.activity", "patch.flat.normal", "accuracy.arc"


def _normal_of_reference(points, interface, x):
    ends = interface.nodes[interface.master.segments[points.master_segment]]
    along = (ends[:, 1] - ends[:, 0]) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)[:, None]
    return {"normal": np.column_stack([along[:, 1], -along[:, 0]])}


def _gap_from_coordinates(points, interface, x):
    """Return the gap as n·x_s − n·x_m, which loses digits far from the origin."""
    first = x[interface.master.segments[points.master_segment, 0]]
    return {"gap": (points.normal * points.position).sum(axis=1) - (points.normal * first).sum(axis=1)}


def _beside_no_master(points, interface, x):
    """Return positions moved by the gap, of points that name no master segment."""
    place = points.position - np.nan_to_num(points.gap)[:, None] * np.nan_to_num(points.normal)
    return {"position": place, "master_segment": np.full_like(points.master_segment, -1)}


def _mean_pressure(points, *_):
    """Return the mean pressure at all active points: the sum of the slave's forces is accounted for."""
    total = (points.pressure * points.weight)[points.active].sum()
    mean = total / max(points.weight[points.active].sum(), np.finfo(float).tiny)
    return {"pressure": np.where(points.active, mean, 0.0)}


# (name, caught by, formulation, {array: what is reported in its place}, or a function of points, interface and x)
for _name, _property, _base, _change in (
    ("position of the foot, of nodes without a master segment", PLACE, mortar, _beside_no_master),
    ("nodal forces doubled over half of a weight", FORCES, nts,
     lambda points, *_: {"pressure": 2 * points.pressure, "weight": points.weight / 2}),
    ("points called weighted nodes", FORCES, sts, lambda points, *_: {"weighted": ~points.weighted}),
    ("slave segment of the neighbour reported", PLACE, vts_me,
     lambda points, interface, x: {"slave_segment": (points.slave_segment - 1) % len(interface.slave)}),
    ("place on the slave reported from its other end", PLACE, vts_me, lambda points, *_: {"c": -points.c}),
    ("another master segment reported", SEGMENT, vts_me,
     lambda points, interface, x: {"master_segment": (points.master_segment + 1) % len(interface.master)}),
    ("ξ reported from the other end", PLACE, vts_me, lambda points, *_: {"xi": 1 - points.xi}),
    ("ξ clipped in the report", PLACE, vts_me, lambda points, *_: {"xi": np.clip(points.xi, 0, 1)}),
    ("foot reported as position", PLACE, vts_me,
     lambda points, *_: {"position": points.position - points.gap[:, None] * points.normal}),
    ("normal into the master reported", PLACE, vts_me, lambda points, *_: {"normal": -points.normal}),
    ("normal of the reference configuration reported", PLACE, vts_me, _normal_of_reference),
    ("gap reported half as large", PLACE, sts, lambda points, *_: {"gap": points.gap / 2}),
    ("gap from absolute coordinates reported", PLACE, vts_me, _gap_from_coordinates),
    ("pressure reported one in a million too large", FORCES, vts_me,
     lambda points, *_: {"pressure": points.pressure * (1 + 1e-6)}),
    ("idle points report a pressure", FORCES, vts_me, lambda points, *_: {"pressure": np.abs(points.gap)}),
    ("weight reported half as large", FORCES, vts_me, lambda points, *_: {"weight": points.weight / 2}),
    ("weight of the whole segment", AREA, vts_me,
     lambda points, interface, x: {"weight": interface.slave.lengths(x)[points.slave_segment]}),
    ("weight of what is not covered", AREA, sts, lambda points, *_: {"weight": points.weight * 1.25}),
    ("area reported from the first node", AREA, vts_ppt,
     lambda points, *_: {"area_from": np.full_like(points.c, -1.0)}),
    ("two thirds of the area reported", AREA, vts_ppt,
     lambda points, *_: {"area_to": points.area_to - (points.area_to - points.area_from) / 3}),
    ("activity of the neighbour reported", ACTIVITY, vts_me, lambda points, *_: {"active": np.roll(points.active, 1)}),
    ("weighted nodes reported as points", PLACE, mortar, lambda points, *_: {"weighted": False}),
    ("second pass reported as points of the slave", PLACE, partial(two_pass, inner=nts_ar),
     lambda points, *_: {"on_master": False}),
    ("reported pressure one percent too small", "patch.flat.solve", BALANCED,
     lambda points, *_: {"pressure": 0.99 * points.pressure}),
    ("reported pressure from the vertical gap", "patch.variants", BALANCED,
     lambda points, *_: {"pressure": points.pressure * abs(points.normal[:, 1])}),
    ("mean pressure reported at all points in contact", "accuracy.wavy", chen_hisada, _mean_pressure),
    ("reported pressure of VTS-ME with the wrong sign", NORMAL, vts_me,
     lambda points, *_: {"pressure": -points.pressure}),
    (f"reported pressure of VTS-G off by {SMALL}", NORMAL, vts_g,
     lambda points, *_: {"pressure": (1 + float(SMALL)) * points.pressure}),
):  # fmt: skip
    add(_name, _property, reports(_base, _change))


def _all_or_none(pairing, interface):
    """Return that all points are active as soon as one is: what is open adheres."""
    return np.full_like(pairing["active"], pairing["active"].any())


def _keeps_between(pairing, interface):
    """Return that all nodes between two active ones are active."""
    numbers, active = np.flatnonzero(pairing["active"]), pairing["active"].copy()
    if len(numbers):
        active[numbers[0] : numbers[-1] + 1] = True
    return active


def _without_tension(right, interface, pairing, z):
    """Report the pressures without those below zero, which the forces still have."""
    points = right(interface, pairing, z)
    return replace(points, pressure=np.maximum(points.pressure, 0.0))


add("open cells adhere", "unilateral", decides(sts, _all_or_none))
add("open nodes adhere", "unilateral", decides(mortar, _all_or_none))
add("multipliers of open nodes adhere", "complementarity", decides(mortar_lm, _all_or_none))
add("nodes between active ones are not released", "complementarity", decides(mortar_lm, _keeps_between))
add("activity of the neighbour", ACTIVITY, decides(vts_me, lambda pairing, _: np.roll(pairing["active"], 1)))
add("whole slave segments in contact", ACTIVITY, decides(vts_g, whole_segments))
add("whole slave segment active with one of its points", "unilateral", decides(vts_me, whole_segments))
add("whole slave segment active, and no tension reported", "nodal-push",
    decides(vts_me, whole_segments, contact_points=_without_tension))  # fmt: skip


class ForcesAlone:
    """The forces of NTS-AR, without a tangent, said to have a potential."""

    def __init__(self, *, penalty):
        inner = nts_ar(penalty=penalty)
        self.pair, self.residual = inner.pair, inner.residual
        self.traits = inner.traits.revise(tangent=None, symmetric=True)


add("forces without a potential said to have one", "symmetric", ForcesAlone)
# (name, caught by, formulation, what is promised beyond the truth)
for _name, _property, _base, _promises in (
    ("locking that is denied", "accuracy.wavy-curved", sts, {"locks": False}),
    ("quarter points said to integrate a linear gap", "patch.tilted.nodal", vts_me, {"integrates_linear_gap": True}),
    ("current areas said to be symmetric", "symmetric", nts_ar, {"symmetric": True}),
    ("nodes on segments said to be symmetric and smooth", "continuity", nts_ar,
     {"symmetric": True, "continuity": "C1"}),
    ("nodes on segments said to push continuously", "continuity", nts, {"continuity": "C0"}),
    ("cells said to be smooth", "continuity", sts, {"continuity": "C1"}),
    ("normals averaged over kinks said to pass there", "patch.kinked", partial(mortar, normals="averaged"),
     {"kinked": True, "witnesses": {}}),
    ("two multipliers a segment, said to be stable", "stability.inf-sup", contactverif_nts.vts_ppt_lm,
     {"inf_sup": True}),
    ("gaps at points in place of weighted gaps, said not to lock", "stability.locking", sts, {"locks": False}),
    ("two virtual slave nodes a segment, said not to lock", "stability.locking", BALANCED, {"locks": False}),
):  # fmt: skip
    add(_name, _property, says(_base, **_promises))
# It is exact for a uniform gap, and so on flat interfaces; action equals reaction at each point.
add("one Gauss point a cell", "patch.tilted.nodal",
    lambda *, penalty: replace(sts(penalty=penalty), quadrature=Quadrature.gauss(1, True)))  # fmt: skip


class _WholeDualShapes(WholeShapes):
    gaps = pressures = "dual"


class _EvenWeights(WholeShapes):
    """Three Gauss points that weigh a third each: right for a uniform gap."""

    weights = np.full(3, 1 / 3)


class _DualGaps(WholeShapes):
    gaps = "dual"


WEIGHTED, OPEN_END = "patch.tilted.weighted", "unilateral.overhang"
add("dual shapes of whole segments", OPEN_END, says(_WholeDualShapes, opens_at_ends=True))
add("gaps extrapolated to a node past the end", OPEN_END, says(mortar_dual, opens_at_ends=True))
add("points of a mortar method that weigh the same", WEIGHTED, _EvenWeights)
add("gaps weighted with other shapes than stated", WEIGHTED, says(_DualGaps, gap_shapes="standard"))
add("rows weighted with other shapes than stated", WEIGHTED, says(mortar_dual_lm, gap_shapes="standard"))
