"""Mutants that are right wherever the slave is flat, and wrong on rings and arcs, or at kinks.

Their tangents are exact, and action equals reaction.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from mutate import Mutant, replaces
from wrong_invariants import Look, make_factored

import contactverif_mortar
import contactverif_nts
from contactverif import ContactPoints

CURVED, KINKED, ARC = "patch.curved", "patch.kinked", "accuracy.arc"
LEAST_TURN = 1e-6  # The sine of the angle between segments below which a surface counts as flat.


def _quarter_where_the_slave_bends(look: Look) -> Any:
    """Return 1/4 where a neighbour of the slave segment turns away from it, else 1."""
    turns = abs(look.turns("slave", look.slave, 0)) + abs(look.turns("slave", look.slave, 1))
    return np.where(turns.real > LEAST_TURN, 0.25, 1.0)


def _less_by_depth_over_radius(look: Look) -> Any:
    """Return 1 − 30 (d/R)², d the depth of the middle of the slave segment and R the radius of the slave's turn."""
    ends = look.x[look.interface.slave.segments[look.slave]]
    first = look.x[look.interface.master.segments[look.master, 0]]
    along, arm = look.tangents("master", look.master), ends.mean(axis=1) - first
    depth = arm[:, 0] * along[:, 1] - arm[:, 1] * along[:, 0]
    curvature = look.turns("slave", look.slave, 1) / look.lengths("slave", look.slave)
    return 1 - 30 * (depth * curvature) ** 2


@replaces("contact_points", contactverif_nts.vts_g)
def _reports_a_fifth_less(right: Any, interface: Any, pairing: Any, z: Any) -> ContactPoints:
    """Make VTS-G, whose reported pressures are 20 % too small unless both segments are parallel."""
    points = right(interface, pairing, z)
    look = Look(interface, z.reshape(-1, 2), points.slave_segment, points.master_segment)
    slave, master = look.tangents("slave", look.slave), look.tangents("master", look.master)
    sine = slave[:, 0] * master[:, 1] - slave[:, 1] * master[:, 0]
    return replace(points, pressure=np.where(abs(sine) > LEAST_TURN, 0.8, 1.0) * points.pressure)


def _says_that_kinks_pass(*, penalty: float) -> Any:
    """Make a mortar method with normals averaged over kinks that promises to pass at them."""
    inner = contactverif_mortar.mortar(penalty=penalty, normals="averaged")
    return replace(inner, traits=inner.traits.revise(kinked=True, witnesses={}))


@replaces("pair", contactverif_nts.vts_g)
def _whole_segments(right: Any, interface: Any, z: Any) -> Any:
    """Make VTS-G, in which all points of a slave segment press as soon as one of them penetrates."""
    pairing = dict(right(interface, z))
    segments, on_master = pairing["segment"], pairing["master"] >= 0
    closed = np.bincount(segments[pairing["active"]], minlength=len(interface.slave)) > 0
    return {**pairing, "active": closed[segments] & on_master}


MUTANTS = (
    make_factored("springs a quarter as stiff where the slave bends", CURVED, _quarter_where_the_slave_bends),
    make_factored("springs softer by the square of depth over radius", ARC, _less_by_depth_over_radius),
    Mutant("pressures reported a fifth too small off the parallel", ARC, _reports_a_fifth_less),
    Mutant("normals averaged over kinks said to pass there", KINKED, _says_that_kinks_pass),
    Mutant("whole slave segments in contact", "projection.activity", _whole_segments),
)
