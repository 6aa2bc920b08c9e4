"""Mutants that pull: all signs turned round, a whole segment in contact with its one closed point, wrong shares.

One more hides: its tangent is wrong by noise, which would pass for a kink if anybody asked the tangent itself.
"""

import zlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from mutate import Mutant, decides, replaces, whole_segments, wrap

import contactverif_mortar
import contactverif_nts

UNILATERAL, NODAL_PUSH, OBJECTIVITY = "unilateral", "nodal-push", "objectivity"


def _turn_signs_round(make: Callable[..., Any]) -> Callable[..., Any]:
    """Turn all signs of forces and tangent round; the contact points report what they did."""

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        return -right(interface, pairing, z)

    return lambda *, penalty: wrap(penalty, make, residual=residual, tangent=residual)


def _report_no_tension(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Report the pressures without those below zero, which the forces still have."""
    points = right(interface, pairing, z)
    return replace(points, pressure=np.maximum(points.pressure, 0.0))


@replaces("residual", contactverif_nts.vts_me)
def _outward_shares(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Double the distance of each point from the middle of its segment in the shares of its nodes: force is kept."""
    forces = np.array(right(interface, pairing, z)).reshape(*z.shape[:-1], -1, 2)
    for first, second in interface.slave.segments:
        between = (forces[..., first, :] - forces[..., second, :]) / 2
        forces[..., first, :] += between
        forces[..., second, :] -= between
    return forces.reshape(z.shape)


@replaces("tangent")
def _noisy_tangent(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Change each tangent by up to 1e-6 of it, by other numbers for each state: it jumps wherever it is asked."""
    matrix = np.array(right(interface, pairing, z).toarray())
    random = np.random.default_rng(zlib.crc32(z.tobytes()))
    return matrix * (1 + 1e-6 * random.uniform(-1, 1, matrix.shape))


MUTANTS = (
    Mutant("all signs turned round", UNILATERAL, _turn_signs_round(contactverif_nts.nts_ar)),
    Mutant("all signs of a mortar method turned round", UNILATERAL, _turn_signs_round(contactverif_mortar.mortar)),
    Mutant("all signs of multipliers turned round", UNILATERAL, _turn_signs_round(contactverif_nts.nts_lm)),
    Mutant("whole slave segment active with one of its points", UNILATERAL,
           decides(contactverif_nts.vts_me, whole_segments)),
    Mutant("whole slave segment active, and no tension reported", NODAL_PUSH,
           decides(contactverif_nts.vts_me, whole_segments, contact_points=_report_no_tension)),
    Mutant("shares of the slave nodes spread too far", NODAL_PUSH, _outward_shares),
    Mutant("noise of 1e-6 in the tangent", OBJECTIVITY, _noisy_tangent),
)  # fmt: skip
