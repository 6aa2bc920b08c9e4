"""Formulations whose pressures nothing holds: constraints that are not inf-sup stable, and springs that lock.

Forces balance, and a uniform pressure is exact. Only a pressure that varies shows what is wrong.
"""

from typing import Any

import numpy as np
from mutate import Mutant, says, wrap

import contactverif_mortar
import contactverif_nts
from contactverif.contract.arrays import dense

INF_SUP, LOCKING = "stability.inf-sup", "stability.locking"


def smoothing(interface: Any) -> Any:
    """Return the matrix (n_slave_nodes, n_slave_nodes) that replaces ¼ of a pressure by that of each neighbour."""
    count = interface.n_slave_nodes
    matrix = np.eye(count)
    for first, second in interface.slave.segments:
        matrix[[first, second], [first, second]] -= 0.25
        matrix[[first, second], [second, first]] += 0.25
    return matrix


def _smooths_multipliers(*, penalty: float) -> Any:
    """Press with multipliers that are averaged over neighbours first; the constraints remain those of mortar."""

    def smooth(interface: Any, z: Any) -> Any:
        n = interface.n_unknowns
        return np.concatenate([z[..., :n], z[..., n:] @ smoothing(interface).T], axis=-1)

    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        n = interface.n_unknowns
        forces, rows = right(interface, pairing, smooth(interface, z)), right(interface, pairing, z)
        return np.concatenate([forces[..., :n], rows[..., n:]], axis=-1)

    def tangent(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        n = interface.n_unknowns
        forces, rows = (dense(right(interface, pairing, state)) for state in (smooth(interface, z), z))
        return np.vstack([np.hstack([forces[:n, :n], forces[:n, n:] @ smoothing(interface)]), rows[n:]])

    return wrap(penalty, contactverif_mortar.mortar_lm, residual=residual, tangent=tangent)


MUTANTS = (
    Mutant("multipliers smoothed before they press", INF_SUP, _smooths_multipliers),
    Mutant("two multipliers a segment, said to be stable", INF_SUP,
           says(contactverif_nts.vts_ppt_lm, inf_sup=True)),
    Mutant("gaps at points in place of weighted gaps, said not to lock", LOCKING,
           says(contactverif_mortar.sts, locks=False)),
    Mutant("two virtual slave nodes a segment, said not to lock", LOCKING,
           says(contactverif_nts.vts_ppt_balanced, locks=False)),
)  # fmt: skip
