"""The numbers that the stability sweeps keep of a state: ω, which is judged, and what a picture of it needs."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import Array
from contactverif.contract.property import Measurement, Quantity
from contactverif_properties.shared.conditioning import MOST_ROUNDINGS, Conditioning
from contactverif_properties.shared.roundoff import ratio

# The names of the details. `contactverif_reports` draws them.
ERROR = "relative error"
CONDITION = "condition number"
FORCE_ERROR = "force error"


def make_sweep_measurement(quantity: Quantity, conditioning: Conditioning, error: Array, *, idle: bool) -> Measurement:
    """Return ω of an error of the residual, with the row that has it.

    Parameters
    ----------
    quantity : Quantity
        The quantity that ω is.
    conditioning : Conditioning
        The condition numbers of the rows.
    error : Array, shape (n_unknowns + n_multipliers,)
        The error of the residual.
    idle : bool
        The residual is 0 everywhere.

    Returns
    -------
    Measurement
        The number of roundings ω against 16. Details: error and condition number of the row with that ω, the largest
        error of a force over the largest force.
    """
    worst = conditioning.worst_row(error)
    n = 2 * (len(error) - len(conditioning.reach))
    largest = float(np.linalg.norm(np.asarray(error[:n], dtype=np.float64).reshape(-1, 2), axis=1).max())
    details = {
        ERROR: worst.error,
        CONDITION: worst.condition,
        FORCE_ERROR: ratio(largest, float(conditioning.floor[0])),
    }
    return Measurement([quantity.check(worst.roundings, MOST_ROUNDINGS)], details=details, idle=idle)
