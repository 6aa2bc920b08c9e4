"""Mutants that are right wherever the slave is flat, and wrong on rings and arcs, or at kinks.

Their tangents are exact, and action equals reaction.
"""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from mutate import Mutant, decides, replaces, says, whole_segments, wrap
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


def _stiffer_where_turns_are_small(look: Look) -> Any:
    """Return 1.003 where a slave segment turns from a neighbour by 0.3° to 2.9°, else 1."""
    turns = [abs(look.turns("slave", look.slave, end).real) for end in (0, 1)]
    return np.where(
        (np.maximum(*turns) > np.sin(np.radians(0.3))) & (np.maximum(*turns) < np.sin(np.radians(2.9))), 1.003, 1
    )


def _less_at_the_ends_of_arcs(look: Look) -> Any:
    """Return 0.99 where the slave ends and the other end of the segment turns from its neighbour, else 1."""
    ends = (look.interface.slave.neighbours[look.slave] < 0).any(axis=1)
    turns = abs(look.turns("slave", look.slave, 0)) + abs(look.turns("slave", look.slave, 1))
    return np.where(ends & (turns.real > LEAST_TURN), 0.99, 1)


@replaces("contact_points", contactverif_nts.vts_g)
def _reports_a_fifth_less(right: Any, interface: Any, pairing: Any, z: Any) -> ContactPoints:
    """Make VTS-G, whose reported pressures are 20 % too small unless both segments are parallel."""
    points = right(interface, pairing, z)
    look = Look(interface, z.reshape(-1, 2), points.slave_segment, points.master_segment)
    slave, master = look.tangents("slave", look.slave), look.tangents("master", look.master)
    sine = slave[:, 0] * master[:, 1] - slave[:, 1] * master[:, 0]
    return replace(points, pressure=np.where(abs(sine) > LEAST_TURN, 0.8, 1.0) * points.pressure)


def _where_kinks_are_sharp(interface: Any, z: Any) -> float:
    """Return 1.01 if two slave segments meet at 14° or more, else 1."""
    look = Look(interface, z[..., : interface.n_unknowns].real.reshape(-1, interface.n_nodes, 2)[0], None, None)
    sines = look.turns("slave", np.arange(len(interface.slave)), 1)
    return 1.01 if abs(sines).max() > 0.25 else 1.0


def _scales(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    return _where_kinks_are_sharp(interface, z) * right(interface, pairing, z)


def _reports_as_stiff(right: Any, interface: Any, pairing: Any, z: Any) -> ContactPoints:
    points = right(interface, pairing, z)
    return replace(points, pressure=_where_kinks_are_sharp(interface, z) * points.pressure)


def stiffer_at_sharp_kinks(*, penalty: float) -> Any:
    """Make segment-to-segment springs that are 1 % too stiff, all of them, as soon as one kink is sharp."""
    return wrap(penalty, contactverif_mortar.sts, residual=_scales, tangent=_scales, contact_points=_reports_as_stiff)


MUTANTS = (
    make_factored("springs a quarter as stiff where the slave bends", CURVED, _quarter_where_the_slave_bends),
    make_factored("springs softer by the square of depth over radius", ARC, _less_by_depth_over_radius),
    make_factored("springs 0.3 % stiffer where segments turn by 0.3° to 2.9°", ARC, _stiffer_where_turns_are_small),
    make_factored("springs 1 % softer at the ends of arcs", ARC, _less_at_the_ends_of_arcs),
    Mutant("pressures reported a fifth too small off the parallel", ARC, _reports_a_fifth_less),
    Mutant("normals averaged over kinks said to pass there", KINKED,
           says(partial(contactverif_mortar.mortar, normals="averaged"), kinked=True, witnesses={})),
    Mutant("springs 1 % too stiff where a kink is sharp", KINKED, stiffer_at_sharp_kinks),
    Mutant("whole slave segments in contact", "projection.activity", decides(contactverif_nts.vts_g, whole_segments)),
)  # fmt: skip
