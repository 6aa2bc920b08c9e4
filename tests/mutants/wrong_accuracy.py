"""Formulations that are right in full contact, and wrong where pressures vary or a contact has an edge.

Flat patch tests and open gaps do not see them. Their tangents are exact, and forces balance.
"""

from typing import Any

import numpy as np
from mutate import Mutant, reports, says, wrap

import contactverif_mortar
import contactverif_nts


def _mean_pressure(points: Any, *_: Any) -> dict[str, Any]:
    """Return the mean pressure at all active points: the sum of the slave's forces is accounted for."""
    total = (points.pressure * points.weight)[points.active].sum()
    mean = total / max(points.weight[points.active].sum(), np.finfo(float).tiny)
    return {"pressure": np.where(points.active, mean, 0.0)}


def _softens_at_an_edge(*, penalty: float) -> Any:
    """Multiply all forces by 0.95 if the contact has an edge on the slave, and promise to converge."""

    def soften(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        active = pairing["active"]
        return (1.0 if active.all() or not active.any() else 0.95) * right(interface, pairing, z)

    make = says(contactverif_nts.vts_ppt_balanced, converges=True)
    return wrap(penalty, make, residual=soften, tangent=soften)


MUTANTS = (
    Mutant("mean pressure reported at all points in contact", "accuracy.wavy",
           reports(contactverif_mortar.chen_hisada, _mean_pressure)),
    Mutant("locking that is denied", "accuracy.wavy-curved", says(contactverif_mortar.sts, locks=False)),
    Mutant("springs softer by 5 % once the contact has an edge", "accuracy.hertz", _softens_at_an_edge),
)  # fmt: skip
